//! Named threads around grippers and stores: commands in, snapshots and notices out. They know no window; its owner passes
//! a `wake` function.
//!
//! ```text
//!  UI                         "sim"                          "recorder"
//!  Command ----bounded--->    runs the grasp, keeps pace     
//!  <--newest Snapshot-----    recognises, publishes          writes the store
//!  <--every TraceRow------    derives         frames ----->  a chunk each second
//!  <--Notice--------------                    <------------  Notice
//!  <--MeasuredAccuracy----  "accuracy": whole grasps of each new scene, for what its accuracy costs
//! ```
//!
//! The thread "check" compares each finished grasp with a finer run, and computes it again on request.
//!
//! The thread "effects" measures on request what the effects of a scene cost and change, "accuracy-study" what each
//! setting of accuracy costs there. The thread "ghost" computes each
//! grasp by the other engine, if switched on; [`SimWorker::ghost`] has the newest.
//!
//! The thread "label" handles labels, "library" search and edits of all trials. Both show changes by other programs.
//!
//! A thread "gripper" owns the link to the real gripper's board: live view, trials, recognition and calibrations share it.
//! "inspect" opens stored trials ([`Inspector`]). "why" explains the answer to a grasp and finds the stored trials nearest to it,
//! "advise" how to move the object before the next one.
//! "examine" runs the doctor's checks, "fit" fits the simulated finger to the real one, "train" trains on labelled trials,
//! "study" runs the studies of the paper.
//!
//! "portraits" draws small pictures of objects from files.
//!
//! Pictures may skip, samples may not: a newer snapshot replaces an older one, trace rows and recorded frames keep
//! their order and none is lost.

mod accuracy_job;
mod adviser;
mod background_job;
mod check_job;
mod current;
mod diagnostics_job;
mod effects;
mod explainer;
mod fitter;
mod ghost;
mod gripper;
mod held_object;
mod inspector;
mod labeller;
mod labelling_session;
mod latest;
mod librarian;
mod listener;
#[cfg(test)]
mod listener_tests;
mod messages;
mod object_search;
mod pace;
mod portraits;
mod refined_run;
mod scene_accuracy;
mod sim;
#[cfg(test)]
mod sim_tests;
mod simulation_session;
mod student;
mod teacher;
mod trainer;

pub use adviser::{Advice, Adviser};
pub use background_job::BackgroundJob;
pub use diagnostics_job::{DiagnosticsJob, DiagnosticsReport, DiagnosticsView, Examine, ExamineRequest, examine_port};
pub use effects::{EffectsState, EffectsView, EffectsWorker, Explain, explain_scene};
pub use explainer::{ExplainRequest, ExplainedGrasp, Explainer, NearestState};
pub use fitter::{FitCommand, FitTrials, FitTrialsError, FittedFinger, Fitter, FitterView, fit_trials};
pub use ghost::GhostGrasp;
pub use gripper::{
    CalibrationCommand, CalibrationPlan, CalibrationSession, CalibrationSetup, CalibrationView, CrosstalkCommand,
    CrosstalkView, EndedTrial, GripperCommand, GripperSetup, GripperView, GripperWorker, LatestReading, ObserveRequest,
    RunningCalibration, RunningCrosstalk, SensorJobError, TrialView,
};
pub use inspector::{Inspector, OpenRequest, Opened};
pub use labeller::{LabelCommand, LabelError, LabelOutcome, LabelView, Labeller, start_labeller};
pub use labelling_session::{
    LabelDraft, LabellingAction, LabellingEffect, LabellingSession, SessionContext, TrialFilter, TrialInSight,
    parse_tags,
};
pub use latest::Latest;
pub use librarian::{Librarian, LibraryCommand, LibraryView, start_librarian};
pub use listener::THRESHOLDS;
pub use messages::{
    Checking, Command, FinishedGrasp, MeasuredAccuracy, NotSent, Notice, ObjectCard, Refusal, SimWorkerSetup, Snapshot,
    Status, TraceRow, Wake,
};
pub use object_search::NUMBERED_OBJECTS;
pub use portraits::{PORTRAIT_SIDE, Portrait, PortraitJob};
pub use scene_accuracy::{SceneAccuracyJob, SceneAccuracyState, SceneAccuracyView};
pub use sim::SimWorker;
pub use student::{
    DrawFigure, Student, StudentCommand, StudentError, StudentView, StudyFiles, StudyOrigin, StudyOutcome,
    StudyRequest, StudyResult,
};
pub use teacher::{EndedLesson, TeachError, TeachRequest, Teacher, TeacherView};
pub use trainer::{FinishedTraining, TrainCommand, TrainRequest, TrainedModel, Trainer, TrainerView};
