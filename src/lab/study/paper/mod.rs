//! The paper's studies: each figure of its section V, and two of its future work, from one command each; and what
//! recognition reaches beyond the paper.
//!
//! A [`PaperStudy`] divides its work into units. A unit takes a data set from the [`StudyBench`] and returns a
//! [`UnitResult`]; finished units are kept, so that a study that was stopped goes on where it stopped. From all units it
//! makes a [`StudyReport`]: tables, and a [`Finding`] for each claim of the paper. Figures are drawn from the tables.
//!
//! To add a study, write its file and add it to [`PAPER_STUDIES`]. Most have units of one kind: their `cases`.

mod answers;
mod bench;
mod cases;
mod claims;
mod drawing;
mod drift;
mod emulated_grasps;
mod folder;
mod grasps;
mod in_short;
mod layouts;
mod modality;
mod models;
mod plan;
mod pools;
mod recognition;
mod report;
mod run;
mod shaking;
mod signatures;
mod stages;
mod training_size;

pub use bench::{StudyBench, StudyError, StudyProgress, StudyStep, StudyWork};
pub(in crate::study) use claims::sections;
pub use claims::stored_report;
pub use folder::StudyFolder;
pub(in crate::study) use in_short::sections_in_short;
pub use plan::{DataWanted, STUDY_PRESET, StudyPlan, StudySize};
pub use report::{
    Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyColumn, StudyReport, StudyRow,
    StudyTable,
};
pub use run::{run_study, study_fingerprint};

use palpate_learn::Method;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// All studies of the paper, in the order of its figures.
pub const PAPER_STUDIES: &[&dyn PaperStudy] = &[
    &signatures::TactileSignatures,
    &layouts::Layouts,
    &modality::Modality,
    &stages::Stages,
    &training_size::TrainingSize,
    &models::Models,
    &grasps::Grasps,
    &drift::Drift,
    &shaking::Shaken,
    &recognition::Recognition,
];

/// Finds a study by its key.
pub fn paper_study(key: &str) -> Option<&'static dyn PaperStudy> {
    PAPER_STUDIES.iter().copied().find(|study| study.card().key == key)
}

/// Name and purpose of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StudyCard {
    /// Key on the command line and in files.
    pub key: &'static str,
    /// Display name.
    pub title: &'static str,
    /// What it shows, in a sentence without full stop.
    pub about: &'static str,
    /// Figure or section of the paper.
    pub paper: &'static str,
    /// CPU time of the full form, without collecting grasps.
    pub budget: &'static str,
}

impl StudyCard {
    /// True for a study that the paper has, or calls future work.
    pub fn is_of_the_paper(&self) -> bool {
        self.paper != OWN
    }

    /// Where it comes from: `Fig. 7 of the paper`.
    pub fn origin(&self) -> String {
        if self.is_of_the_paper() { format!("{} of the paper", self.paper) } else { "our own methods".to_owned() }
    }
}

/// Section of the paper of a study of our own methods.
const OWN: &str = "none: our own methods";

/// A unit of work of a study: the part of it that is computed at once and kept.
#[derive(Clone, Debug)]
pub struct StudyUnit {
    /// Its name, different for each unit of a plan.
    pub name: String,
    /// Method that is fitted, on whose version the result depends.
    pub method: Option<&'static Method>,
}

impl StudyUnit {
    /// Name of its result: results of another version of the method are others.
    fn stored_name(&self) -> String {
        let version = self.method.map(|method| format!(" ({})", method.fingerprint()));
        format!("{}{}", self.name, version.unwrap_or_default())
    }
}

/// A study of the paper.
pub trait PaperStudy: Sync {
    /// Name and purpose.
    fn card(&self) -> StudyCard;

    /// The units of work. Units of the same data set follow each other.
    fn units(&self, plan: &StudyPlan) -> Vec<StudyUnit>;

    /// Computes a unit by its name; none where it was cancelled.
    fn measure(&self, unit: &str, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError>;

    /// Tables and findings from the results of all units, by name.
    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError>;

    /// Figures, drawn from the tables.
    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure>;
}

/// Result of a unit, in a form of its study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct UnitResult(serde_json::Value);

impl UnitResult {
    /// Result of a unit.
    pub fn new(result: &impl Serialize) -> Result<Self, StudyError> {
        Ok(Self(serde_json::to_value(result)?))
    }

    /// The result in the form of its study.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, StudyError> {
        Ok(T::deserialize(&self.0)?)
    }
}
