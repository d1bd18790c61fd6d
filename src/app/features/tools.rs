//! Tools, each a job behind a panel: diagnostics, finger fit, training, teaching of new objects, advice on the next grasp.

use super::App;
use palpate_lab::grasping::{ObjectMove, RecognisedGrasp};
use palpate_lab::workers::{
    DiagnosticsReport, Examine, ExamineRequest, FinishedTraining, Job, JobFailure, TeachRequest, TrainRequest,
    TrainedModel, TrainingData, Wake, advice_job, class_training_job, doctor_job, load_model_job, training_data_job,
    training_job,
};
use palpate_store::TrialRow;
use palpate_study::jobs::{FitTrials, FittedFinger, fit_job, recorded_trials_job};
use palpate_tactile::trial::TrialId;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Method that is trained by default: fast, and good with few trials.
pub(in crate::app) const DEFAULT_METHOD: &str = "macro-layer";
/// Seed of training and of the held-back trials: the same data give the same model.
pub(in crate::app) const TRAINING_SEED: u64 = 1;

/// Parts that the tools are started with.
pub struct GripperToolsSetup {
    /// Examines the gripper's port.
    pub examine: Examine,
    /// Fits the finger to recorded trials.
    pub fit: FitTrials,
    /// Folder of trained models.
    pub models: PathBuf,
}

/// The tools' jobs.
pub struct GripperTools {
    /// Diagnostics of board and port.
    pub doctor: Job<ExamineRequest, DiagnosticsReport>,
    /// List of trials of the real gripper.
    pub trials: Job<(), Vec<TrialRow>>,
    /// Fit of the simulated finger.
    pub fit: Job<Vec<TrialId>, FittedFinger>,
    /// Labelled trials and saved models.
    pub data: Job<(), TrainingData>,
    /// Training on labelled trials.
    pub training: Job<TrainRequest, FinishedTraining>,
    pub load: Job<PathBuf, TrainedModel>,
    /// Teaching of new objects.
    pub teaching: Job<TeachRequest, TrainedModel>,
    /// Advice on the next grasp of the real gripper.
    pub advice: Job<Arc<RecognisedGrasp>, ObjectMove>,
    /// Number of the training whose model is used once it has ended.
    awaited: Option<u64>,
}

impl GripperTools {
    /// The tools on the store at `store`.
    pub(in crate::app) fn new(setup: GripperToolsSetup, store: &Path, wake: &Wake) -> Self {
        let GripperToolsSetup { examine, fit, models } = setup;
        let (store, wake) = (|| store.to_owned(), || Arc::clone(wake));
        Self {
            doctor: doctor_job(examine, wake()),
            trials: recorded_trials_job(store(), wake()),
            fit: fit_job(store(), fit, wake()),
            data: training_data_job(store(), models.clone(), wake()),
            training: training_job(store(), models.clone(), wake()),
            load: load_model_job(store(), wake()),
            teaching: class_training_job(store(), models, wake()),
            advice: advice_job(wake()),
            awaited: None,
        }
    }

    /// Outcome of [`App::train_and_use`], once it has ended.
    pub(super) fn trained(&mut self) -> Option<Result<Arc<FinishedTraining>, JobFailure>> {
        let ended = self.training.take();
        if !ended.is_empty() {
            self.data.start(());
        }
        ended
            .into_iter()
            .find(|ended| self.awaited.take_if(|number| *number == ended.number).is_some())
            .map(|e| e.outcome)
    }
}

impl App {
    /// Trains with the default method, and uses the model.
    pub(in crate::app) fn train_and_use(&mut self) {
        let request = TrainRequest { method: DEFAULT_METHOD.to_owned(), seed: TRAINING_SEED, quick: false };
        self.tools.awaited = Some(self.tools.training.start(request));
        self.notices.info("Training on all labelled trials: see panel Training.");
    }
}
