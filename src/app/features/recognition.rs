//! Recognition by both grippers: threshold, next object, models, and new objects that a model is taught.

use super::App;
use super::tools::GripperTools;
use super::view::{ViewSource, ViewState};
use palpate_lab::datasets::knows_fingers;
use palpate_lab::grasping::RecognisedGrasp;
use palpate_lab::workers::{ClassChange, Command, EndedJob, Explainer, GripperCommand, TeachRequest, TrainedModel};
use palpate_learn::{Lesson, Model, Models, Shipped};
use palpate_sim::objects::capital_title;
use palpate_sim::scene::Scene;
use palpate_store::labels::class_name;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// State of the recognition in the window.
pub(in crate::app) struct RecognitionFeature {
    /// Models that come with the program.
    shipped: Models,
    /// Grippers of the models that are being loaded, in order.
    loading: VecDeque<ViewSource>,
    /// Models in use.
    models: Models,
    /// Object file that the model in use was last asked to learn, its content, and when.
    taught: Option<(String, u64)>,
    asked: Instant,
    /// The last lesson, until it is dismissed.
    pub(in crate::app) learned: Option<Learned>,
    /// Explanations of answers.
    pub(in crate::app) explainer: Explainer,
    /// Grasp on which advice was asked last.
    advised: Option<Arc<RecognisedGrasp>>,
}

/// An object that the model has learned.
pub(in crate::app) struct Learned {
    /// Its class.
    pub(in crate::app) name: String,
    /// It was fixed in place.
    pub(in crate::app) fixed: bool,
    /// How well it is known; none where that was not tested.
    pub(in crate::app) lesson: Option<Lesson>,
    /// Time that the lesson took (s); none where that was before.
    pub(in crate::app) seconds: Option<f64>,
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
        let mut feature = Self {
            shipped,
            loading: VecDeque::new(),
            models,
            taught: None,
            asked: Instant::now(),
            learned: None,
            explainer,
            advised: None,
        };
        let mut simulated: Vec<PathBuf> = std::mem::take(&mut view.simulation_models).into_iter().flatten().collect();
        simulated.dedup();
        let gripper = view.gripper_model.take().into_iter().map(|path| (path, ViewSource::Gripper));
        for (path, gripper) in gripper.chain(simulated.into_iter().map(|path| (path, ViewSource::Simulation))) {
            feature.load(path, gripper, tools);
        }
        feature
    }

    /// Model of the real gripper.
    pub(in crate::app) fn gripper_model(&self) -> Option<&Model> {
        self.models.of(Shipped::AnyGripper).map(Arc::as_ref)
    }

    /// Models of the simulation, for free and for fixed objects.
    fn simulated(&self) -> impl Iterator<Item = &Arc<Model>> {
        [false, true].into_iter().filter_map(|fixed| self.models.of(Shipped::simulated(fixed)))
    }

    /// True where the model of the simulation has not learned the fingers of a scene.
    pub(super) fn has_other_fingers(&self, scene: &Scene) -> bool {
        let model = self.models.of(Shipped::simulated(scene.holds_object()));
        model.is_some_and(|model| !knows_fingers(&model.card, scene))
    }

    /// True where a class of own objects is known only to the model of objects that are held otherwise.
    pub(super) fn is_learned_otherwise(&self, class: &str, fixed: bool) -> bool {
        let knows = |fixed: bool| self.learned_from(fixed).any(|(own, _)| own == class);
        knows(!fixed) && !knows(fixed)
    }

    /// Classes that the model of the simulation has learned, with their files.
    pub(super) fn learned_from(&self, fixed: bool) -> impl Iterator<Item = (&str, &str)> {
        let model = self.models.of(Shipped::simulated(fixed)).into_iter();
        model.flat_map(|model| &model.card.taught_from).map(|(class, (_, file))| (class.as_str(), file.as_str()))
    }

    /// Loads a model after those that are being loaded.
    fn load(&mut self, path: PathBuf, gripper: ViewSource, tools: &GripperTools) {
        tools.load.start(path);
        self.loading.push_back(gripper);
    }
}

/// Text of the field for another name, while it is open.
pub(in crate::app) fn name_id() -> egui::Id {
    egui::Id::unique("name of what was learned")
}

impl App {
    /// Sets the probability from which a class counts as certain.
    pub fn set_threshold(&mut self, threshold: f64) {
        self.gripper.send(GripperCommand::SetThreshold(threshold));
        self.simulation.send(Command::SetThreshold(threshold));
    }

    /// Recognises another object: a random built-in one, or whatever the real gripper holds next.
    pub fn next_object(&mut self) {
        match self.view.source {
            // Presenter mode has a sequence of its own.
            _ if self.view.presents => self.present_next(),
            ViewSource::Gripper => _ = self.gripper.send(GripperCommand::AnotherObject),
            ViewSource::Simulation | ViewSource::Trial => self.open_next(),
        }
    }

    /// Uses the model in this file for the real gripper and its trials; without one, the shipped model.
    pub fn use_model(&mut self, path: Option<PathBuf>) {
        match path {
            Some(path) => self.recognition.load(path, ViewSource::Gripper, &self.tools),
            None => {
                self.view.gripper_model = None;
                self.use_for_gripper(self.recognition.shipped.of(Shipped::AnyGripper).cloned());
            }
        }
    }

    /// Uses the model in this file for the simulation and other trials; without one, the shipped model.
    pub(in crate::app) fn use_simulation_model(&mut self, path: Option<PathBuf>) {
        match path {
            Some(path) => self.recognition.load(path, ViewSource::Simulation, &self.tools),
            None => {
                let shipped =
                    [false, true].map(|fixed| self.recognition.shipped.of(Shipped::simulated(fixed)).cloned());
                shipped.iter().flatten().for_each(|model| self.use_in_simulation(model, None));
            }
        }
    }

    /// Teaches the model of the simulation the object in the hand.
    pub fn teach_object(&mut self) {
        self.recognition.taught = None;
        self.teach_new_object();
        if self.tools.teaching.running().is_none() {
            let is_file = Path::new(&self.simulation.scene.object.source).is_file();
            let why =
                if is_file { "The model knows it already: forget it first." } else { "Open an object file first." };
            self.notices.info(format!("Nothing to learn. {why}"));
        }
    }

    /// Teaches the model of the real gripper its recorded grasps of an object; simulated ones too, where the simulation holds
    /// it.
    pub(in crate::app) fn teach_recorded(&mut self, name: String) {
        let held =
            self.snapshot().filter(|snapshot| snapshot.object.as_ref().is_some_and(|object| object.name == name));
        let object = held.map(|snapshot| snapshot.scene.object.clone());
        if let Some(model) = self.recognition.models.of(Shipped::AnyGripper).cloned() {
            self.tools.teaching.start(TeachRequest { model, name, object, change: ClassChange::Recorded });
        }
    }

    /// Takes an object that was learned in hand, and asks whether it is to be forgotten or renamed.
    pub fn change_learned(&mut self, source: &str) {
        if !self.choose_learned(source) {
            return self.notices.info("No learned object is in the hand.");
        }
        if self.simulation.scene.object.source != source {
            self.open(source);
        }
        self.show_panel("recognition");
    }

    /// The same, with the field for its name.
    pub(in crate::app) fn ask_for_name(&mut self, source: &str) {
        self.change_learned(source);
        if let Some(Learned { name, .. }) = &self.recognition.learned {
            let title = capital_title(name);
            self.ctx.data_mut(|data| data.insert_temp(name_id(), title));
            self.ctx.memory_mut(|memory| memory.request_focus(name_id().with("field")));
        }
    }

    /// Uses the model without the object in this file.
    pub(in crate::app) fn forget_object(&mut self, source: &str) {
        if self.choose_learned(source) {
            self.forget_learned();
        }
    }

    /// What is said of a lesson is about the object in this file; false where that was not learned.
    fn choose_learned(&mut self, source: &str) -> bool {
        let Some(name) = self.learned_as(source).map(str::to_owned) else { return false };
        let (lesson, fixed) = (self.lesson(&name).cloned(), self.simulation.scene.holds_object());
        let told = self.recognition.learned.as_ref().filter(|own| (&own.name, own.fixed) == (&name, fixed));
        let seconds = told.and_then(|own| own.seconds);
        self.recognition.learned = Some(Learned { name, fixed, lesson, seconds });
        true
    }

    /// Changes the model of the simulation in the object of the last lesson.
    fn change_class(&mut self, change: &ClassChange) {
        let Some(Learned { name, fixed, .. }) = &self.recognition.learned else { return };
        let models = &self.recognition.models;
        let knows = |fixed: bool| {
            models.of(Shipped::simulated(fixed)).filter(|model| model.card.taught.contains(name)).cloned()
        };
        // An object has one name, free or fixed.
        let other = knows(!*fixed).filter(|_| matches!(change, ClassChange::Renamed(_)));
        for model in knows(*fixed).into_iter().chain(other) {
            let (name, change) = (name.clone(), change.clone());
            self.tools.teaching.start(TeachRequest { model, name, object: None, change });
        }
    }

    /// Uses the model without the object of the last lesson.
    pub(in crate::app) fn forget_learned(&mut self) {
        self.change_class(&ClassChange::Forgotten);
    }

    /// Gives the object of the last lesson another name.
    pub(in crate::app) fn rename_learned(&mut self, name: &str) {
        let Some(learned) = &self.recognition.learned else { return };
        let is_taken = |name: &str| self.recognition.simulated().any(|model| model.card.labels.class(name).is_some());
        let name = match class_name(name) {
            Ok(name) if name == learned.name => return,
            Ok(name) if !is_taken(&name) => name,
            Ok(name) => return self.notices.failed("name", format!("The model knows another \"{name}\".")),
            Err(cause) => return self.notices.failed("name", cause.to_string()),
        };
        self.notices.done("name");
        self.change_class(&ClassChange::Renamed(name));
    }

    /// Takes in a model in which a learned object has another name, or is forgotten.
    fn take_changed(&mut self, trained: &TrainedModel, TeachRequest { model, name, change, .. }: &TeachRequest) {
        self.recognition.learned = None;
        let (content, source) = model.card.taught_from.get(name).cloned().unwrap_or_default();
        let title = capital_title(name);
        // A shipped model without a learned object is the shipped one again.
        let card = &trained.model.card;
        let shipped = [false, true].map(|fixed| self.recognition.shipped.of(Shipped::simulated(fixed)));
        let shipped = shipped.into_iter().flatten().find(|own| own.card.data.collections == card.data.collections);
        match shipped.filter(|_| card.taught.is_empty()).cloned() {
            Some(shipped) => self.use_in_simulation(&shipped, None),
            None => self.use_in_simulation(&trained.model, Some(&trained.path)),
        }
        // It is not learned again by itself.
        self.recognition.taught = Some((source.clone(), content));
        // The answer was the other model's.
        if self.snapshot().is_some_and(|snapshot| snapshot.status.finished) {
            self.simulation.send(Command::Play);
        }
        match change {
            ClassChange::Renamed(new) => {
                self.notices.info(format!("\"{title}\" is \"{}\" now.", capital_title(new)));
                self.simulation.name_object(&source, Some(new));
            }
            // Its name goes with it.
            _ => {
                self.notices.info(format!("Forgot \"{title}\"."));
                self.simulation.name_object(&source, None);
            }
        }
    }

    /// Says no more about the last lesson.
    pub(in crate::app) fn dismiss_learned(&mut self) {
        self.recognition.learned = None;
    }

    /// Class as which the model in use has learned the object in this file.
    pub(in crate::app) fn learned_as(&self, source: &str) -> Option<&str> {
        let mut learned = self.recognition.learned_from(self.simulation.scene.holds_object());
        learned.find(|(_, file)| *file == source).map(|(class, _)| class)
    }

    /// Class as which a model of the simulation has learned the object in this file, if any: the one in use, or else the other.
    pub(in crate::app) fn name_of_learned(&self, source: &str) -> Option<&str> {
        let mut otherwise = self.recognition.learned_from(!self.simulation.scene.holds_object());
        let other = || otherwise.find(|(_, file)| *file == source).map(|(class, _)| class);
        self.learned_as(source).or_else(other)
    }

    /// How well the model in use knows a class that it has learned.
    pub(in crate::app) fn lesson(&self, class: &str) -> Option<&Lesson> {
        self.recognition.models.of(Shipped::simulated(self.simulation.scene.holds_object()))?.card.lesson(class)
    }

    /// Cancels the lesson.
    pub(in crate::app) fn stop_teaching(&mut self) {
        self.tools.teaching.stop();
        self.notices.info("Model unchanged.");
    }

    /// Uses a model in the simulation from now on, for grasps of objects that are held as it learned them. `path` is its file;
    /// a shipped one has none.
    fn use_in_simulation(&mut self, model: &Arc<Model>, path: Option<&Path>) {
        let own = &mut self.recognition;
        let before = own.models.clone();
        own.models = before.clone().with_simulated(model);
        // Lessons of the model before are given to this one.
        self.tools.teaching.renew(|lesson| {
            let kinds = [false, true].map(Shipped::simulated);
            let kind =
                kinds.into_iter().find(|kind| before.of(*kind).is_some_and(|own| Arc::ptr_eq(own, &lesson.model)))?;
            let now = self.recognition.models.of(kind).filter(|now| !Arc::ptr_eq(now, &lesson.model))?;
            let is_new = lesson.change == ClassChange::Simulated && now.card.labels.class(&lesson.name).is_none();
            is_new.then(|| TeachRequest { model: Arc::clone(now), ..lesson.clone() })
        });
        let own = &mut self.recognition;
        for fixed in model.card.data.supports() {
            self.view.simulation_models[usize::from(fixed)] = path.map(Path::to_owned);
        }
        own.taught = None;
        let models = own.models.clone();
        self.inspect.set_models(models.clone());
        self.simulation.send(Command::SetModels(models));
    }

    /// Uses a model for the real gripper from now on.
    fn use_for_gripper(&mut self, model: Option<Arc<Model>>) {
        self.recognition.models = self.recognition.models.clone().with_real(model.clone());
        self.inspect.set_models(self.recognition.models.clone());
        self.gripper.send(GripperCommand::SetModel(model));
    }

    /// Uses a model from a file for the real gripper from now on.
    fn use_file_for_gripper(&mut self, trained: &TrainedModel) {
        self.view.set_gripper_model(&trained.path);
        self.use_for_gripper(Some(Arc::clone(&trained.model)));
        self.notices.info(format!("Model for the real gripper: {}", trained.about));
    }

    /// Has the model of the simulation learn the object in the hand, where it comes from a file and the model lacks it: once
    /// for each object.
    fn teach_new_object(&mut self) {
        let Self { simulation, recognition, tools, .. } = self;
        let Some(snapshot) = &simulation.snapshot else { return };
        let model = recognition.models.of(Shipped::simulated(snapshot.scene.holds_object()));
        let Some(model) = model.filter(|model| model.learns_new_objects()) else { return };
        let Some(card) = &snapshot.object else { return };
        let source = &snapshot.scene.object.source;
        // A name that was just given is on its way.
        if *source == simulation.scene.object.source && snapshot.scene.object.name != simulation.scene.object.name {
            return;
        }
        // A lesson with another object of a class that was taught says why it cannot be, or is learned anew.
        let is_other = model.card.taught_from.get(&card.name).is_some_and(|(content, _)| *content != card.content);
        let is_known = model.card.labels.class(&card.name).is_some() && !is_other;
        let asked = Some((source.clone(), card.content));
        if is_known || recognition.taught == asked {
            return;
        }
        if recognition.taught.as_ref().is_some_and(|(before, _)| before == source) {
            // A lesson that runs is of the file before it changed.
            tools.teaching.stop();
        }
        let (name, object) = (card.name.clone(), Some(snapshot.scene.object.clone()));
        let lessons =
            tools.teaching.running().map(|running| running.command).into_iter().chain(tools.teaching.waiting());
        let same = |lesson: &TeachRequest| Arc::ptr_eq(&lesson.model, model) && lesson.object == object;
        let is_on_its_way = lessons.into_iter().any(|lesson| same(&lesson));
        (recognition.taught, recognition.asked) = (asked, Instant::now());
        if Path::new(source).is_file() && !is_on_its_way {
            tools.teaching.start(TeachRequest {
                model: Arc::clone(model),
                name,
                object,
                change: ClassChange::Simulated,
            });
        }
    }

    /// Takes in a lesson that has ended.
    fn take_lesson(&mut self, EndedJob { command, outcome, .. }: EndedJob<TeachRequest, TrainedModel>) {
        let models = &self.recognition.models;
        let is_current = |kind: &Shipped| models.of(*kind).is_some_and(|model| Arc::ptr_eq(model, &command.model));
        let simulated = [false, true].map(Shipped::simulated);
        match outcome {
            Ok(trained) if is_current(&Shipped::AnyGripper) => self.use_file_for_gripper(&trained),
            Ok(trained) if simulated.iter().any(is_current) => {
                if let ClassChange::Renamed(_) | ClassChange::Forgotten = command.change {
                    return self.take_changed(&trained, &command);
                }
                self.use_in_simulation(&trained.model, Some(&trained.path));
                self.notices.info(format!("Learned \"{}\".", capital_title(&command.name)));
                let seconds = self.recognition.asked.elapsed().as_secs_f64();
                self.recognition.learned = command.object.as_ref().map(|_| Learned {
                    name: command.name.clone(),
                    fixed: trained.model.card.data.fixed() == Some(true),
                    lesson: trained.model.card.lesson(&command.name).cloned(),
                    seconds: Some(seconds),
                });
                // What was decided without the new class is tried again.
                if self.snapshot().is_some_and(|snapshot| snapshot.status.finished) {
                    self.simulation.send(Command::Play);
                }
            }
            // Another model is in use by now.
            Ok(trained) => {
                self.notices.info(format!("Taught {}, saved as {}.", command.name, trained.path.display()));
            }
            Err(cause) => self.notices.warning(format!("The model did not learn {}: {cause}", command.name)),
        }
    }

    /// Asks for advice after a grasp of the real gripper that decided nothing.
    fn ask_for_advice(&mut self) {
        let Some(gripper) = &self.gripper.view else { return };
        let undecided = gripper.identification.as_ref().filter(|view| view.decision.is_none() && !view.listening);
        let Some(last) = undecided.and_then(|view| view.last.clone()) else { return };
        if !self.recognition.advised.as_ref().is_some_and(|advised| Arc::ptr_eq(advised, &last)) {
            self.tools.advice.start(Arc::clone(&last));
            self.recognition.advised = Some(last);
        }
    }

    /// Takes in models that were trained or loaded since the last frame.
    pub(super) fn poll_recognition(&mut self) {
        match self.tools.trained() {
            Some(Ok(finished)) => {
                self.notices.done("training");
                let f1 = finished.judged.evaluation.f1_macro;
                let [_, tested] = finished.judged.trials;
                self.notices.info(format!("Trained: macro F1 {f1:.2} on {tested} held-back trials."));
                self.use_file_for_gripper(&finished.trained);
            }
            Some(Err(cause)) => self.notices.failed("training", format!("Training failed: {cause}")),
            None => {}
        }
        for ended in self.tools.teaching.take() {
            self.take_lesson(ended);
        }
        self.teach_new_object();
        self.ask_for_advice();
        for ended in self.tools.load.take() {
            let gripper = self.recognition.loading.pop_front().unwrap_or(ViewSource::Gripper);
            if ended.outcome.is_ok() {
                self.notices.done("model");
            }
            match (ended.outcome, gripper) {
                (Ok(trained), ViewSource::Gripper) => self.use_file_for_gripper(&trained),
                (Ok(trained), ViewSource::Simulation | ViewSource::Trial) => {
                    self.use_in_simulation(&trained.model, Some(&trained.path));
                    self.notices.info(format!("Model for the simulation: {}", trained.about));
                }
                (Err(cause), _) => self.notices.failed("model", format!("Model not changed: {cause}")),
            }
        }
    }
}
