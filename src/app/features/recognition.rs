//! Recognition by both grippers: threshold, next object, and the model for the real one.

use crate::app::features::gripper::GripperFeature;
use crate::app::features::simulation::SimulationFeature;
use crate::app::features::tools::{GripperTools, ToolAction};
use crate::app::features::view::ViewState;
use crate::app::notices::Notices;
use crate::app::view_source::ViewSource;
use palpate_lab::workers::{Command, GripperCommand, TrainCommand, TrainedModel};
use palpate_learn::Model;
use std::path::PathBuf;
use std::sync::Arc;

/// Action on the recognition.
#[derive(Clone, Debug)]
pub enum RecognitionAction {
    /// Probability from which a class counts as certain.
    SetThreshold(f64),
    /// Recognise another object: a random built-in one, or whatever the real gripper holds next.
    NextObject,
    /// Use the model in this file for the real gripper; without one, the shipped model.
    UseModel(Option<PathBuf>),
}

/// State of the recognition in the window.
pub(in crate::app) struct RecognitionFeature {
    /// Model that comes with the program.
    shipped: Option<Arc<Model>>,
}

/// Features that recognition acts on.
pub(in crate::app) struct Recognisers<'a> {
    pub(in crate::app) simulation: &'a mut SimulationFeature,
    pub(in crate::app) gripper: &'a GripperFeature,
    pub(in crate::app) tools: &'a mut GripperTools,
}

impl RecognitionFeature {
    /// Loads the model of the last run, which is remembered again once it is loaded.
    pub(in crate::app) fn new(
        shipped: Option<Arc<Model>>,
        tools: &mut GripperTools,
        view: &mut ViewState,
        notices: &mut Notices,
    ) -> Self {
        if let Some(path) = view.gripper_model.take() {
            tools.apply(ToolAction::Train(TrainCommand::Load(path)), notices);
        }
        Self { shipped }
    }

    pub(in crate::app) fn apply(
        &self,
        action: RecognitionAction,
        on: &mut Recognisers<'_>,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        match action {
            RecognitionAction::SetThreshold(threshold) => {
                on.gripper.worker().command(GripperCommand::SetThreshold(threshold));
                on.simulation.send(Command::SetThreshold(threshold), notices);
            }
            RecognitionAction::NextObject => match view.source {
                ViewSource::Gripper => {
                    on.gripper.worker().command(GripperCommand::AnotherObject);
                }
                ViewSource::Simulation => on.simulation.open_next(notices),
            },
            RecognitionAction::UseModel(Some(path)) => {
                on.tools.apply(ToolAction::Train(TrainCommand::Load(path)), notices);
            }
            RecognitionAction::UseModel(None) => {
                view.gripper_model = None;
                on.gripper.worker().command(GripperCommand::SetModel(self.shipped.clone()));
            }
        }
    }

    /// Takes in models that were trained or loaded since the last frame.
    pub(in crate::app) fn gather(
        &self,
        tools: &mut GripperTools,
        gripper: &GripperFeature,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        match tools.trained() {
            Some(Ok(finished)) => {
                let f1 = finished.judged.evaluation.f1_macro;
                notices.info(format!("Trained: macro F1 {f1:.2} on held-back trials."));
                use_model(&finished.trained, gripper, view, notices);
            }
            Some(Err(cause)) => notices.error(format!("Training failed: {cause}")),
            None => {}
        }
        match tools.loaded() {
            Some(Ok(trained)) => use_model(&trained, gripper, view, notices),
            Some(Err(cause)) => notices.error(format!("Model not changed: {cause}")),
            None => {}
        }
    }
}

/// Uses a model for the real gripper from now on.
fn use_model(trained: &TrainedModel, gripper: &GripperFeature, view: &mut ViewState, notices: &mut Notices) {
    view.gripper_model = Some(trained.path.clone());
    gripper.worker().command(GripperCommand::SetModel(Some(Arc::clone(&trained.model))));
    notices.info(format!("Model for the real gripper: {}", trained.about));
}
