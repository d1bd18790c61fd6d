//! Recognition by both grippers: threshold, next object, and the model for the real one.

use crate::app::features::gripper::GripperFeature;
use crate::app::features::inspect::InspectFeature;
use crate::app::features::simulation::SimulationFeature;
use crate::app::features::tools::{GripperTools, ToolAction};
use crate::app::features::view::ViewState;
use crate::app::notices::Notices;
use crate::app::view_source::ViewSource;
use palpate_lab::workers::{
    Command, ExplainRequest, ExplainedGrasp, Explainer, GripperCommand, TrainCommand, TrainedModel,
};
use palpate_learn::Model;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

/// Action on the recognition.
#[derive(Clone, Debug)]
pub enum RecognitionAction {
    /// Probability from which a class counts as certain.
    SetThreshold(f64),
    /// Recognise another object: a random built-in one, or whatever the real gripper holds next.
    NextObject,
    /// Explain the answer to a grasp, for the panel Why.
    Explain(ExplainRequest),
    /// Use the model in this file for the real gripper and its trials; without one, the shipped model.
    UseModel(Option<PathBuf>),
    /// Use the model in this file for the simulation and other trials; without one, the shipped model.
    UseSimulationModel(Option<PathBuf>),
}

/// State of the recognition in the window.
pub(in crate::app) struct RecognitionFeature {
    /// Models that come with the program, for the simulation and for the real gripper.
    shipped: [Option<Arc<Model>>; 2],
    /// Models to be loaded, and for which gripper; the first one is being loaded.
    loading: VecDeque<(PathBuf, ViewSource)>,
    explainer: Explainer,
    /// Grasp explained last.
    asked: Option<ExplainRequest>,
}

/// Features that recognition acts on.
pub(in crate::app) struct Recognisers<'a> {
    pub(in crate::app) simulation: &'a mut SimulationFeature,
    pub(in crate::app) gripper: &'a GripperFeature,
    pub(in crate::app) tools: &'a mut GripperTools,
    pub(in crate::app) inspect: &'a mut InspectFeature,
}

impl RecognitionFeature {
    /// Loads the model of the last run, which is remembered again once it is loaded.
    pub(in crate::app) fn new(
        shipped: [Option<Arc<Model>>; 2],
        explainer: Explainer,
        tools: &mut GripperTools,
        view: &mut ViewState,
        notices: &mut Notices,
    ) -> Self {
        let mut feature = Self { shipped, loading: VecDeque::new(), explainer, asked: None };
        for (path, gripper) in
            [(view.gripper_model.take(), ViewSource::Gripper), (view.simulation_model.take(), ViewSource::Simulation)]
        {
            if let Some(path) = path {
                feature.load(path, gripper, tools, notices);
            }
        }
        feature
    }

    /// Loads a model after those that are being loaded.
    fn load(&mut self, path: PathBuf, gripper: ViewSource, tools: &mut GripperTools, notices: &mut Notices) {
        if self.loading.is_empty() {
            tools.apply(ToolAction::Train(TrainCommand::Load(path.clone())), notices);
        }
        self.loading.push_back((path, gripper));
    }

    /// Newest explanation.
    pub(in crate::app) fn explained(&self) -> Option<Arc<ExplainedGrasp>> {
        self.explainer.view()
    }

    pub(in crate::app) fn apply(
        &mut self,
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
                ViewSource::Simulation | ViewSource::Trial => on.simulation.open_next(notices),
            },
            RecognitionAction::Explain(request) => self.explain(request),
            RecognitionAction::UseModel(Some(path)) => self.load(path, ViewSource::Gripper, on.tools, notices),
            RecognitionAction::UseModel(None) => {
                view.gripper_model = None;
                let [_, shipped] = self.shipped.clone();
                on.inspect.set_model(ViewSource::Gripper, shipped.clone());
                on.gripper.worker().command(GripperCommand::SetModel(shipped));
            }
            RecognitionAction::UseSimulationModel(Some(path)) => {
                self.load(path, ViewSource::Simulation, on.tools, notices);
            }
            RecognitionAction::UseSimulationModel(None) => {
                view.simulation_model = None;
                let [shipped, _] = self.shipped.clone();
                on.inspect.set_model(ViewSource::Simulation, shipped.clone());
                on.simulation.send(Command::SetModel(shipped), notices);
            }
        }
    }

    /// Explains a grasp instead of the one before, unless it is the same.
    fn explain(&mut self, request: ExplainRequest) {
        let is_same =
            |asked: &ExplainRequest| asked.trial == request.trial && Arc::ptr_eq(&asked.grasp, &request.grasp);
        if !self.asked.as_ref().is_some_and(is_same) {
            self.explainer.give_up();
            self.explainer.ask(request.clone());
            self.asked = Some(request);
        }
    }

    /// Takes in models that were trained or loaded since the last frame.
    pub(in crate::app) fn gather(&mut self, on: &mut Recognisers<'_>, view: &mut ViewState, notices: &mut Notices) {
        match on.tools.trained() {
            Some(Ok(finished)) => {
                let f1 = finished.judged.evaluation.f1_macro;
                notices.info(format!("Trained: macro F1 {f1:.2} on held-back trials."));
                use_for_gripper(&finished.trained, on, view, notices);
            }
            Some(Err(cause)) => notices.error(format!("Training failed: {cause}")),
            None => {}
        }
        let Some(outcome) = on.tools.loaded() else { return };
        let gripper = self.loading.pop_front().map_or(ViewSource::Gripper, |(_, gripper)| gripper);
        if let Some((next, _)) = self.loading.front() {
            on.tools.apply(ToolAction::Train(TrainCommand::Load(next.clone())), notices);
        }
        match (outcome, gripper) {
            (Ok(trained), ViewSource::Gripper) => use_for_gripper(&trained, on, view, notices),
            (Ok(trained), ViewSource::Simulation | ViewSource::Trial) => {
                use_for_simulation(&trained, on, view, notices);
            }
            (Err(cause), _) => notices.error(format!("Model not changed: {cause}")),
        }
    }
}

/// Uses a model for the simulation from now on.
fn use_for_simulation(trained: &TrainedModel, on: &mut Recognisers<'_>, view: &mut ViewState, notices: &mut Notices) {
    view.simulation_model = Some(trained.path.clone());
    on.inspect.set_model(ViewSource::Simulation, Some(Arc::clone(&trained.model)));
    on.simulation.send(Command::SetModel(Some(Arc::clone(&trained.model))), notices);
    notices.info(format!("Model for the simulation: {}", trained.about));
}

/// Uses a model for the real gripper from now on.
fn use_for_gripper(trained: &TrainedModel, on: &mut Recognisers<'_>, view: &mut ViewState, notices: &mut Notices) {
    view.gripper_model = Some(trained.path.clone());
    on.inspect.set_model(ViewSource::Gripper, Some(Arc::clone(&trained.model)));
    on.gripper.worker().command(GripperCommand::SetModel(Some(Arc::clone(&trained.model))));
    notices.info(format!("Model for the real gripper: {}", trained.about));
}
