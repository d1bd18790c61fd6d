//! Studies: a grid of factors in; tables, figures and claims out. Without a window; command line and window run them.
//!
//! An [`Experiment`] names the cells of its grid, measures one, and reports on all. [`run_experiment`] measures cells in
//! parallel, keeps what is finished, and resumes.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | `frame` | what all studies have: grid, rows and columns, claims, figures, files |
//! | 0 | `finger_fit` | the simulated finger, fitted to recorded grasps |
//! | 0 | `network_cost`, `physics_cost` | CPU time of networks and of the physics, for `palpate bench` |
//! | 0 | `shipped` | the shipped models in the manual |
//! | 1 | `emulated` | grasps of emulated grippers, with faults |
//! | 2 | `effects` | cost and influence of physical effects; an audit of the rules that switch them on |
//! | 2 | [`stability`] | hard cases, holds that chatter, random scenes |
//! | 2 | [`paper`] | the studies of the paper |
//! | 3 | [`accuracy`] | what accuracy costs, and what it is worth for recognition |
//! | 3 | `public` | recordings of others |
//! | 3 | `sensor_faults` | sensors that fail in the middle of a grasp |
//! | 3 | `added_sensors` | what sensors beyond the paper's four are worth |
//! | 3 | `answers` | whether answers keep their promise |
//! | 4 | `promises` | the numbers behind the program's promises, beside those of the version before |
//! | 5 | `generated` | sections of manual and README, written from stored results |
//! | 5 | `all` | the list of all studies |
//! | 6 | [`jobs`] | background tasks of the window |

pub mod accuracy;
mod added_sensors;
mod all;
mod answers;
mod effects;
mod emulated;
mod finger_fit;
mod frame;
mod generated;
pub mod jobs;
mod network_cost;
pub mod paper;
mod physics_cost;
mod promises;
mod public;
mod sensor_faults;
mod shipped;
pub mod stability;

pub use added_sensors::added_sensor_study;
pub use all::{all_studies, listed_study, study_title};
pub use answers::{AnswerCase, AnswerStudy, KeptPromise};
pub use effects::{
    AuditReport, AuditRow, AuditedEffect, AuditedScene, EffectAudit, EffectChange, EffectSize, ExplainedEffect,
    Explanation, SEEN, SceneNumber, explain_effects,
};
pub use finger_fit::{
    Certainty, ChannelGap, ConstantGap, Estimate, FingerFit, FingerFitError, FingerMotion, FitWatch, MOST_STEPS,
    Observation, RecordedGraspError, RecordedGrasps, Remainder, SimulationGap, Trust, fit_finger, fit_finger_watched,
    simulation_gap,
};
pub use frame::{
    Agreement, Cell, ClaimNumber, Draw, Experiment, FigureLink, FigureMark, Finding, GeneratedSection, IntervalStrip,
    LinkedFigure, ListedStudy, Measuring, PERCENT, POINTS, ResultFile, ResultFileError, ShownStudy, StoredStudy,
    StudyCard, StudyCell, StudyColumn, StudyCommand, StudyError, StudyFolder, StudyOutcome, StudyProgress, StudyReport,
    StudyRow, StudySize, StudyStep, StudyTable, TrialNumbers, cpu_cost, markdown_table, merged_units, program,
    run_experiment,
};
pub use generated::generated_sections;
pub use network_cost::{
    LiveCost, NetworkCost, StepSizes, answer_cost, candle_step_cost, kernel_step_cost, live_step_cost,
};
pub use physics_cost::{BenchScene, CostRow, bench_scenes, physics_cost, physics_truth};
pub use promises::{Promise, PromiseNumber, Promises};
pub use public::{PUBLIC, PublicData, PublishedResult, PublishedResults, public_study};
pub use sensor_faults::{SENSOR_FAULTS, sensor_fault_study, sound_channels};
