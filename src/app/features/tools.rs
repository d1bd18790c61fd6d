//! Tools, each in a thread of its own behind a panel: diagnostics, finger fit, training, teaching of new objects, advice on the
//! next grasp.

use crate::app::notices::Notices;
use crate::app::startup::ThreadError;
use palpate_lab::study::TrainingError;
use palpate_lab::workers::{
    Adviser, DiagnosticsJob, Examine, ExamineRequest, FinishedTraining, FitCommand, FitTrials, Fitter, Teacher,
    TrainCommand, TrainRequest, TrainedModel, Trainer, Wake,
};
use palpate_learn::ModelError;
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

/// Action on a tool.
#[derive(Clone, Debug)]
pub enum ToolAction {
    /// Examine the gripper's board.
    Examine(ExamineRequest),
    /// Stop the examination and report so far.
    StopExamining,
    /// List trials, or fit the finger to some.
    Fit(FitCommand),
    /// Cancel the fit.
    StopFitting,
    /// Train on labelled trials, list them, or load a model.
    Train(TrainCommand),
    /// Train with the default method, and use the model.
    TrainAndUse,
    /// Cancel the training.
    StopTraining,
}

/// The tools' threads.
pub struct GripperTools {
    /// Diagnostics of board and port.
    pub examiner: DiagnosticsJob,
    /// Fit of the simulated finger.
    pub fitter: Fitter,
    /// Training on labelled trials.
    pub trainer: Trainer,
    /// Teaching of new objects.
    pub teacher: Teacher,
    /// Advice on the next grasp of the real gripper.
    pub adviser: Adviser,
    /// Loads of models taken note of.
    loads: u64,
    /// Training whose model is used once it has ended.
    awaited: Option<Awaited>,
}

struct Awaited {
    /// Outcome of the training before it.
    before: Option<Result<Arc<FinishedTraining>, Arc<TrainingError>>>,
    /// It has been seen running.
    begun: bool,
}

impl GripperTools {
    /// Starts the threads on the store at `store`.
    pub(in crate::app) fn start(setup: GripperToolsSetup, store: &Path, wake: &Wake) -> Result<Self, ThreadError> {
        let wake = || Arc::clone(wake);
        Ok(Self {
            examiner: DiagnosticsJob::start(setup.examine, wake()).map_err(ThreadError::of("the doctor"))?,
            fitter: Fitter::start(store.to_owned(), setup.fit, wake()).map_err(ThreadError::of("the finger fit"))?,
            trainer: Trainer::start(store.to_owned(), setup.models.clone(), wake())
                .map_err(ThreadError::of("training"))?,
            teacher: Teacher::start(store.to_owned(), setup.models, wake()).map_err(ThreadError::of("teaching"))?,
            adviser: Adviser::start(wake()).map_err(ThreadError::of("advice"))?,
            loads: 0,
            awaited: None,
        })
    }

    pub(in crate::app) fn apply(&mut self, action: ToolAction, notices: &mut Notices) {
        match action {
            ToolAction::Examine(request) => self.examiner.ask(request),
            ToolAction::StopExamining => self.examiner.give_up(),
            ToolAction::Fit(command) => self.fitter.ask(command),
            ToolAction::StopFitting => self.fitter.give_up(),
            ToolAction::Train(command) => self.trainer.ask(command),
            ToolAction::TrainAndUse => {
                let before = self.trainer.view().and_then(|view| view.finished.clone());
                self.awaited = Some(Awaited { before, begun: false });
                let method = DEFAULT_METHOD.to_owned();
                self.trainer.ask(TrainCommand::Train(TrainRequest { method, seed: TRAINING_SEED, quick: false }));
                notices.info("Training on all labelled trials: see panel Training.");
            }
            ToolAction::StopTraining => self.trainer.give_up(),
        }
    }

    /// Outcome of [`ToolAction::TrainAndUse`], once it has ended.
    pub(in crate::app) fn trained(&mut self) -> Option<Result<Arc<FinishedTraining>, Arc<TrainingError>>> {
        let awaited = self.awaited.as_mut()?;
        let view = self.trainer.view()?;
        awaited.begun |= view.running.is_some();
        let same = match (&view.finished, &awaited.before) {
            (Some(Ok(now)), Some(Ok(before))) => Arc::ptr_eq(now, before),
            (Some(Err(now)), Some(Err(before))) => Arc::ptr_eq(now, before),
            (now, before) => now.is_none() && before.is_none(),
        };
        let ended = view.running.is_none() && (awaited.begun || !same);
        let outcome = view.finished.clone().filter(|_| ended)?;
        self.awaited = None;
        Some(outcome)
    }

    /// Model loaded since the last call, or why it could not be.
    pub(in crate::app) fn loaded(&mut self) -> Option<Result<Arc<TrainedModel>, ModelError>> {
        let view = self.trainer.view()?;
        let (loads, outcome) = &view.loaded;
        let is_new = *loads > std::mem::replace(&mut self.loads, *loads);
        outcome.clone().filter(|_| is_new)
    }
}
