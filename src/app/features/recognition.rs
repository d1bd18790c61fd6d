//! Recognition by both grippers: threshold, next object, models, and new objects that a model is taught.

use crate::app::features::gripper::GripperFeature;
use crate::app::features::inspect::InspectFeature;
use crate::app::features::simulation::SimulationFeature;
use crate::app::features::tools::GripperTools;
use crate::app::features::view::ViewState;
use crate::app::notices::Notices;
use crate::app::view_source::ViewSource;
use palpate_lab::grasping::RecognisedGrasp;
use palpate_lab::workers::{
    Command, EndedJob, ExplainRequest, Explainer, GripperCommand, JobFailure, TeachRequest, TrainedModel,
};
use palpate_learn::{Model, Models, Shipped};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
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
    /// Teach the model of the simulation the object in the hand.
    TeachObject,
    /// Teach the model of the real gripper its recorded grasps of an object; simulated ones too, where the simulation holds it.
    TeachRecorded(String),
    /// Cancel the lesson.
    StopTeaching,
}

/// State of the recognition in the window.
pub(in crate::app) struct RecognitionFeature {
    /// Models that come with the program.
    shipped: Models,
    /// Grippers of the models that are being loaded, in order.
    loading: VecDeque<ViewSource>,
    /// Models in use.
    models: Models,
    /// Object file that the model in use was last asked to learn.
    taught: Option<String>,
    explainer: Explainer,
    /// Grasp on which advice was asked last.
    advised: Option<Arc<RecognisedGrasp>>,
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
        shipped: Models,
        explainer: Explainer,
        tools: &GripperTools,
        view: &mut ViewState,
    ) -> Self {
        let models = shipped.clone();
        let mut feature = Self { shipped, loading: VecDeque::new(), models, taught: None, explainer, advised: None };
        for (path, gripper) in
            [(view.gripper_model.take(), ViewSource::Gripper), (view.simulation_model.take(), ViewSource::Simulation)]
        {
            if let Some(path) = path {
                feature.load(path, gripper, tools);
            }
        }
        feature
    }

    /// Model of the real gripper.
    pub(in crate::app) fn gripper_model(&self) -> Option<&Model> {
        self.models.of(Shipped::AnyGripper).map(Arc::as_ref)
    }

    /// Loads a model after those that are being loaded.
    fn load(&mut self, path: PathBuf, gripper: ViewSource, tools: &GripperTools) {
        tools.load.start(path);
        self.loading.push_back(gripper);
    }

    /// Explanations of answers.
    pub(in crate::app) fn explainer(&self) -> &Explainer {
        &self.explainer
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
                on.gripper.worker().send(GripperCommand::SetThreshold(threshold));
                on.simulation.send(Command::SetThreshold(threshold), notices);
            }
            RecognitionAction::NextObject => match view.source {
                ViewSource::Gripper => {
                    on.gripper.worker().send(GripperCommand::AnotherObject);
                }
                ViewSource::Simulation | ViewSource::Trial => on.simulation.open_next(notices),
            },
            RecognitionAction::Explain(request) => self.explainer.explain(&request),
            RecognitionAction::UseModel(Some(path)) => self.load(path, ViewSource::Gripper, on.tools),
            RecognitionAction::UseModel(None) => {
                view.gripper_model = None;
                let shipped = self.shipped.of(Shipped::AnyGripper).cloned();
                self.use_for_gripper(shipped, on);
            }
            RecognitionAction::UseSimulationModel(Some(path)) => self.load(path, ViewSource::Simulation, on.tools),
            RecognitionAction::UseSimulationModel(None) => {
                view.simulation_model = None;
                self.use_in_simulation(None, on, notices);
            }
            RecognitionAction::TeachObject => {
                self.taught = None;
                self.teach_new_object(on);
            }
            RecognitionAction::TeachRecorded(name) => {
                let held = on
                    .simulation
                    .worker()
                    .snapshot()
                    .filter(|snapshot| snapshot.object.as_ref().is_some_and(|object| object.name == name));
                let object = held.map(|snapshot| snapshot.scene.object.clone());
                if let Some(model) = self.models.of(Shipped::AnyGripper).cloned() {
                    on.tools.teaching.start(TeachRequest { model, name, object, recorded: true });
                }
            }
            RecognitionAction::StopTeaching => {
                on.tools.teaching.stop();
                notices.info("The model stays as it is.");
            }
        }
    }

    /// Uses a model in the simulation from now on, for grasps of objects that are held as it learned them; the shipped models
    /// for all others.
    fn use_in_simulation(&mut self, model: Option<&Arc<Model>>, on: &mut Recognisers<'_>, notices: &mut Notices) {
        let real = self.models.of(Shipped::AnyGripper).cloned();
        self.models = self.shipped.clone().with_real(real);
        if let Some(model) = model {
            self.models = self.models.clone().with_simulated(model);
        }
        self.taught = None;
        on.inspect.set_models(self.models.clone());
        on.simulation.send(Command::SetModels(self.models.clone()), notices);
    }

    /// Uses a model for the real gripper from now on.
    fn use_for_gripper(&mut self, model: Option<Arc<Model>>, on: &mut Recognisers<'_>) {
        self.models = self.models.clone().with_real(model.clone());
        on.inspect.set_models(self.models.clone());
        on.gripper.worker().send(GripperCommand::SetModel(model));
    }

    /// Uses a model from a file for the real gripper from now on.
    fn use_file_for_gripper(
        &mut self,
        trained: &TrainedModel,
        on: &mut Recognisers<'_>,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        view.gripper_model = Some(trained.path.clone());
        self.use_for_gripper(Some(Arc::clone(&trained.model)), on);
        notices.info(format!("Model for the real gripper: {}", trained.about));
    }

    /// Has the model of the simulation learn the object in the hand, where it comes from a file and the model lacks it: once
    /// for each object.
    fn teach_new_object(&mut self, on: &mut Recognisers<'_>) {
        let Some(snapshot) = on.simulation.worker().snapshot() else { return };
        let model = self.models.of(Shipped::simulated(snapshot.scene.holds_object()));
        let Some(model) = model.filter(|model| model.learns_new_objects()) else { return };
        let Some(card) = &snapshot.object else { return };
        let source = &snapshot.scene.object.source;
        // A lesson with another object of a class that was taught says why it cannot be.
        let is_other = model.card.taught_from.get(&card.name).is_some_and(|(content, _)| *content != card.content);
        let is_known = model.card.labels.class(&card.name).is_some() && !is_other;
        if is_known || self.taught.as_ref() == Some(source) {
            return;
        }
        self.taught = Some(source.clone());
        if Path::new(source).is_file() {
            let (name, object) = (card.name.clone(), Some(snapshot.scene.object.clone()));
            on.tools.teaching.start(TeachRequest { model: Arc::clone(model), name, object, recorded: false });
        }
    }

    /// Takes in a lesson that has ended.
    fn take_lesson(
        &mut self,
        EndedJob { command: request, outcome, .. }: EndedJob<TeachRequest, TrainedModel>,
        on: &mut Recognisers<'_>,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        let is_current = |kind: &Shipped| self.models.of(*kind).is_some_and(|model| Arc::ptr_eq(model, &request.model));
        let simulated = [false, true].map(Shipped::simulated);
        match outcome {
            Ok(trained) if is_current(&Shipped::AnyGripper) => self.use_file_for_gripper(&trained, on, view, notices),
            Ok(trained) if simulated.iter().any(is_current) => {
                view.simulation_model = Some(trained.path.clone());
                self.use_in_simulation(Some(&trained.model), on, notices);
                notices.info(format!("The model knows {} now.", request.name));
                // What was decided without the new class is tried again.
                if on.simulation.worker().snapshot().is_some_and(|snapshot| snapshot.status.finished) {
                    on.simulation.send(Command::Play, notices);
                }
            }
            // Another model is in use by now.
            Ok(trained) => notices.info(format!("Taught {}, saved as {}.", request.name, trained.path.display())),
            Err(cause) => notices.warning(format!("The model did not learn {}: {cause}", request.name)),
        }
    }

    /// Asks for advice after a grasp of the real gripper that decided nothing.
    fn ask_for_advice(&mut self, on: &Recognisers<'_>) {
        let Some(gripper) = on.gripper.worker().view() else { return };
        let undecided = gripper.identification.as_ref().filter(|view| view.decision.is_none() && !view.listening);
        let Some(last) = undecided.and_then(|view| view.last.clone()) else { return };
        if !self.advised.as_ref().is_some_and(|advised| Arc::ptr_eq(advised, &last)) {
            on.tools.advice.start(Arc::clone(&last));
            self.advised = Some(last);
        }
    }

    /// Takes in models that were trained or loaded since the last frame.
    pub(in crate::app) fn gather(&mut self, on: &mut Recognisers<'_>, view: &mut ViewState, notices: &mut Notices) {
        match on.tools.trained() {
            Some(Ok(finished)) => {
                let f1 = finished.judged.evaluation.f1_macro;
                notices.info(format!("Trained: macro F1 {f1:.2} on held-back trials."));
                self.use_file_for_gripper(&finished.trained, on, view, notices);
            }
            Some(Err(cause)) => notices.error(format!("Training failed: {cause}")),
            None => {}
        }
        for ended in on.tools.teaching.take() {
            self.take_lesson(ended, on, view, notices);
        }
        self.teach_new_object(on);
        self.ask_for_advice(on);
        for ended in on.tools.load.take() {
            let gripper = self.loading.pop_front().unwrap_or(ViewSource::Gripper);
            self.take_loaded(ended.outcome, gripper, on, view, notices);
        }
    }

    /// Uses a model that was loaded.
    fn take_loaded(
        &mut self,
        outcome: Result<Arc<TrainedModel>, JobFailure>,
        gripper: ViewSource,
        on: &mut Recognisers<'_>,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        match (outcome, gripper) {
            (Ok(trained), ViewSource::Gripper) => self.use_file_for_gripper(&trained, on, view, notices),
            (Ok(trained), ViewSource::Simulation | ViewSource::Trial) => {
                view.simulation_model = Some(trained.path.clone());
                self.use_in_simulation(Some(&trained.model), on, notices);
                notices.info(format!("Model for the simulation: {}", trained.about));
            }
            (Err(cause), _) => notices.error(format!("Model not changed: {cause}")),
        }
    }
}
