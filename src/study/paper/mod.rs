//! The paper's studies: each figure of its section V, and two of its future work, from one command each; and what
//! recognition reaches beyond the paper.
//!
//! A `Study` is a grid of cells. A cell takes a data set from the [`StudyData`]; its result is kept, so that a
//! study that was stopped resumes. From all cells come typed rows, and from these a
//! [`StudyReport`](crate::StudyReport): tables, and a [`Finding`](crate::Finding) for each claim of the paper. Figures
//! are drawn from the tables.
//!
//! To add a study, write its file and add it to [`PAPER_STUDIES`]. One that crosses sensors, methods and another factor
//! is a `Crossing` (in `rows`), which has the rest.

mod answers;
mod bench;
mod drift;
mod emulated_grasps;
mod grasps;
mod in_short;
mod layouts;
mod modality;
mod models;
mod plan;
mod prelude;
mod recognition;
mod region;
mod rows;
mod shaking;
mod signatures;
mod stages;
mod stored;
mod study;
mod training_size;

pub(crate) use answers::{Pool, TestAnswers, judge};
pub use bench::StudyData;
pub(crate) use in_short::sections_in_short;
pub use plan::{DataWanted, STUDY_PRESET, StudyPlan};
pub(crate) use stored::sections;
pub use study::{PaperStudy, is_current, study_fingerprint};

/// All studies of the paper, in the order of its figures.
pub const PAPER_STUDIES: &[&dyn PaperStudy] = &[
    &signatures::TactileSignatures,
    &layouts::Layouts,
    &modality::Modality,
    &stages::Stages,
    &training_size::TrainingSize,
    &models::Models,
    &region::Region,
    &grasps::Grasps,
    &drift::Drift,
    &shaking::Shaken,
    &recognition::Recognition,
];

/// Finds a study by its key.
pub fn paper_study(key: &str) -> Option<&'static dyn PaperStudy> {
    PAPER_STUDIES.iter().copied().find(|study| study.card().key == key)
}
