//! Experiments as functions from data to tables, without a window. The command line runs each of them.

pub mod accuracy;
mod accuracy_cost;
mod comparison;
mod effect_audit;
mod effects;
mod finger_fit;
mod frame;
mod generated;
mod labelled_training;
mod network_cost;
pub mod paper;
mod physics_cost;
mod search;
mod shipped;
pub mod stability;
mod timed_grasp;

pub use accuracy_cost::{AccuracyCost, accuracy_cost};
pub use comparison::{
    Compared, Comparison, ComparisonError, ComparisonRow, Controls, Difference, MethodResult, compare, in_table_order,
};
pub use effect_audit::{
    AuditReport, AuditRow, AuditedEffect, AuditedScene, EffectAudit, EffectSize, SEEN, SceneNumber, stored_effects,
};
pub use effects::{EffectChange, ExplainedEffect, Explanation, explain_effects};
pub use finger_fit::{
    Certainty, Estimate, FingerFit, FingerFitError, FingerMotion, FitWatch, MOST_STEPS, Observation,
    RecordedGraspError, RecordedGrasps, Remainder, Trust, fit_finger, fit_finger_watched,
};
pub use frame::{
    Experiment, GeneratedSection, Measuring, ResultFile, ResultFileError, StoredStudy, StudyCell, StudyCommand,
    StudyOutcome, StudyProgress, StudyStep, TrialNumbers, markdown_table, merged_units, program, run_experiment,
};
pub use generated::generated_sections;
pub use labelled_training::{
    HELD_BACK, JudgedModel, LEAST_TRIALS, LabelledClass, LabelledTraining, TrainingError, TrainingStage,
    labelled_classes,
};
pub use network_cost::{NetworkCost, StepSizes, candle_step_cost, kernel_step_cost, live_step_cost};
pub use physics_cost::{BenchScene, CostRow, bench_scenes, physics_cost, physics_truth};
pub use search::{SearchError, SearchRow, search};
