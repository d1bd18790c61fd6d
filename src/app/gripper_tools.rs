//! The threads that help with the real gripper, each behind a panel of its own.

use palpate_lab::workers::{Examine, ExamineRequest, Examiner, FinishedTraining, FitTrials, FitWish, Fitter, TrainRequest, TrainWish, TrainedModel, Trainer, Wake};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What they start from.
pub struct GripperToolsSetup {
    /// Looks at the gripper's port for the doctor.
    pub examine: Examine,
    /// Fits the finger to recorded trials.
    pub fit: FitTrials,
    /// Folder for trained models.
    pub models: PathBuf,
}

/// What can be asked of them.
#[derive(Clone, Debug)]
pub enum ToolWish {
    /// Find out what is wrong between the gripper's board and this computer.
    Examine(ExamineRequest),
    /// End that, with what was seen so far.
    StopExamining,
    /// Fit the finger to recorded trials, or list them.
    Fit(FitWish),
    /// Give the fit up.
    StopFitting,
    /// Train on labelled trials, look what there is, or load a model.
    Train(TrainWish),
    /// Give the training up.
    StopTraining,
}

/// Their handles.
pub struct GripperTools {
    /// Finds out what is wrong between board and computer.
    pub examiner: Examiner,
    /// Lays the simulated finger over the real one.
    pub fitter: Fitter,
    /// Learns from what was labelled.
    pub trainer: Trainer,
    /// Loads of models that have been taken note of.
    loads: u64,
    /// A training that was asked for without looking at its panel.
    awaited: Option<Awaited>,
}

/// A training whose end somebody waits for.
struct Awaited {
    /// How the one before it ended.
    before: Option<Result<Arc<FinishedTraining>, String>>,
    /// It has been seen going on.
    begun: bool,
}

impl GripperTools {
    /// Starts the threads; trials come from the store at `store`. The error is a text for the user.
    pub(super) fn start(setup: GripperToolsSetup, store: &Path, wake: &Wake) -> Result<Self, String> {
        let failed = |what: &str| {
            let what = what.to_owned();
            move |error: std::io::Error| format!("{what} could not be started: {error}")
        };
        let wake = || Arc::clone(wake);
        Ok(Self {
            examiner: Examiner::start(setup.examine, wake()).map_err(failed("the doctor"))?,
            fitter: Fitter::start(store.to_owned(), setup.fit, wake()).map_err(failed("the fit"))?,
            trainer: Trainer::start(store.to_owned(), setup.models, wake()).map_err(failed("training"))?,
            loads: 0,
            awaited: None,
        })
    }

    /// Passes a wish on.
    pub(super) fn grant(&mut self, wish: ToolWish) {
        match wish {
            ToolWish::Examine(request) => self.examiner.ask(request),
            ToolWish::StopExamining => self.examiner.give_up(),
            ToolWish::Fit(wish) => self.fitter.ask(wish),
            ToolWish::StopFitting => self.fitter.give_up(),
            ToolWish::Train(wish) => self.trainer.ask(wish),
            ToolWish::StopTraining => self.trainer.give_up(),
        }
    }

    /// Trains, and remembers that somebody waits for it.
    pub(super) fn train_and_tell(&mut self, request: TrainRequest) {
        let before = self.trainer.view().and_then(|view| view.finished.clone());
        self.awaited = Some(Awaited { before, begun: false });
        self.trainer.ask(TrainWish::Train(request));
    }

    /// How the training ended that somebody waits for, once it has.
    pub(super) fn trained(&mut self) -> Option<Result<Arc<FinishedTraining>, String>> {
        let awaited = self.awaited.as_mut()?;
        let view = self.trainer.view()?;
        awaited.begun |= view.running.is_some();
        let same = match (&view.finished, &awaited.before) {
            (Some(Ok(now)), Some(Ok(before))) => Arc::ptr_eq(now, before),
            (Some(Err(now)), Some(Err(before))) => now == before,
            (now, before) => now.is_none() && before.is_none(),
        };
        let ended = view.running.is_none() && (awaited.begun || !same);
        let outcome = view.finished.clone().filter(|_| ended)?;
        self.awaited = None;
        Some(outcome)
    }

    /// The model that was loaded since the last call, or why it could not be.
    pub(super) fn loaded(&mut self) -> Option<Result<Arc<TrainedModel>, String>> {
        let view = self.trainer.view()?;
        let (loads, outcome) = &view.loaded;
        let is_new = *loads > std::mem::replace(&mut self.loads, *loads);
        outcome.clone().filter(|_| is_new)
    }
}
