//! Named threads around grippers and stores: commands in, snapshots and notices out. They do not depend on the window,
//! which passes a `wake` function.
//!
//! ```text
//!  UI                         "sim"                          "recorder"
//!  Command -------------->    runs the grasp, keeps pace
//!  <--newest Snapshot-----    recognises, publishes          writes the store
//!  <--every TraceRow------    derives         trial ------>  when a grasp has ended
//!  <--Notice--------------                    <------------  Notice
//!  <--MeasuredAccuracy----  "accuracy": whole grasps of each new scene, for what its accuracy costs
//! ```
//!
//! A [`Worker`] owns something for as long as the window is open: the simulated gripper, the link to the real gripper's
//! board ("gripper", shared by live view, trials, recognition and calibrations), the labels ("label"), or all trials
//! ("library"). Labels and library show changes by other programs. Commands go in; the newest view, trace rows and
//! notices come out; a panic becomes a notice.
//!
//! A [`Job`] is a background task with a beginning and an end: a command in, progress, then an outcome or a failure
//! out. Its thread runs while there is something to do. A newer command replaces the older ones, or waits for them.
//!
//! | job | command | outcome | newer |
//! |---|---|---|---|
//! | [`doctor_job`] | a port | findings | replaces |
//! | [`training_data_job`] | | what the store and its folders hold | replaces |
//! | [`training_job`] [`class_training_job`] [`load_model_job`] | method, object, file | a model | waits |
//! | [`advice_job`] | a grasp | the move before the next one | replaces |
//! | [`Explainer`] | a grasp | why the model gave its answer; the nearest trials | replaces |
//! | [`open_trial_job`] [`portrait_job`] | a trial, a file | what is shown of it | waits |
//! | of the simulation | a grasp | its ghost by the other engine; a check by other runs | replaces |
//!
//! A [`Tap`] is a second listener of a worker, and a second sender of its commands: other programs control the gripper through
//! one.
//!
//! Pictures may be skipped, samples may not: a newer snapshot replaces an older one, but trace rows keep their order
//! and none is lost.

mod advice;
mod class_training;
mod current;
mod doctor;
mod gripper;
mod held_object;
mod job;
mod label_worker;
mod labelling_session;
mod latest;
mod library_worker;
mod live_recognition;
#[cfg(test)]
mod live_recognition_tests;
mod messages;
mod object_search;
mod open_trial;
mod own_store;
mod pace;
mod portraits;
mod sim;
#[cfg(test)]
mod sim_tests;
mod simulation_session;
mod training;
mod why;
mod worker;

pub use advice::advice_job;
pub use class_training::{ClassChange, TeachRequest, class_training_job};
pub use doctor::{DiagnosticsReport, Examine, ExamineRequest, doctor_job, examine_port};
pub use gripper::{
    CalibrationCommand, CalibrationPlan, CalibrationSession, CalibrationSetup, CalibrationView, CrosstalkCommand,
    CrosstalkView, EndedTrial, GripperCommand, GripperSetup, GripperView, GripperWorker, Guided, LatestReading,
    ObserveRequest, TrialView, keep_calibration,
};
pub use job::{EndedJob, Job, JobError, JobFailure, JobProgress, JobRun, Newer, RunningJob, spare_threads};
pub use label_worker::{LabelCommand, LabelView, LabelWorker};
pub use labelling_session::{
    LabelDraft, LabellingAction, LabellingEffect, LabellingSession, SessionContext, TrialFilter, TrialInSight,
    parse_tags,
};
pub use library_worker::{LibraryCommand, LibraryView, LibraryWorker};
pub use live_recognition::THRESHOLDS;
pub use messages::{
    Checking, Command, FinishedGrasp, GhostGrasp, MeasuredAccuracy, Notice, ObjectCard, Refusal, SimWorkerSetup,
    Snapshot, Status, TraceRow, Wake,
};
pub use object_search::{LISTED_OBJECTS, NUMBERED_OBJECTS, ObjectSearch, search_objects};
pub use open_trial::{OpenRequest, open_trial_job};
pub use portraits::{PORTRAIT_SIDE, portrait_job};
pub use sim::SimWorker;
pub use training::{
    FinishedTraining, TrainRequest, TrainedModel, TrainingData, load_model_job, training_data_job, training_job,
};
pub use why::{ExplainRequest, Explainer};
pub use worker::{Said, Tap, Worker};
