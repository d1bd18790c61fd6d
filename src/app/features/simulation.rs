//! The simulated gripper: its thread, its scene and its traces.

use crate::app::features::view::ViewState;
use crate::app::notices::Notices;
use crate::app::traces::TraceHistory;
use palpate_lab::grasping::ShuffledObjects;
use palpate_lab::study::Explanation;
use palpate_lab::study::accuracy::{AccuracyStudy, stored_accuracy};
use palpate_lab::workers::{Command, GhostGrasp, Job, Notice, Refusal, SimWorker, Snapshot};
use palpate_sim::gripper::Auto;
use palpate_sim::objects::{CollisionShape, EMPTY, anchored, catalogue, object_title};
use palpate_sim::scene::{PoseSpread, Scene};
use palpate_store::TrialPlace;
use palpate_tactile::trial::TrialId;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Seed of the sequence of objects.
const DECK_SEED: u64 = 1;

/// Action on the simulated gripper.
#[derive(Clone)]
pub enum SimulationAction {
    /// Send a command to the simulation.
    Send(Command),
    /// Grasp this scene.
    SetScene(Box<Scene>),
    /// Grasp this object: a built-in name or a file.
    OpenObject(String),
    /// Draw the other engine's fingers and object, or do not.
    SetGhost(bool),
    /// Measure cost and influence of the scene's effects.
    MeasureEffects,
    /// Grasp the scene refused last, or the present one, with the convex hull of its object.
    UseHull,
    /// Set the factor on all lengths of the object.
    SetScale(f64),
    /// Back to the scene before the last change.
    Undo,
    /// Forward again.
    Redo,
}

/// State of the simulated gripper in the window.
pub(in crate::app) struct SimulationFeature {
    worker: SimWorker,
    effects: Job<Scene, Explanation>,
    stored_accuracy: Option<AccuracyStudy>,
    scene: Scene,
    traces: TraceHistory,
    /// Object last seen in the hand: a built-in name or a file.
    seen: Option<String>,
    shuffled: ShuffledObjects,
    changes: SceneChanges,
    /// Scene that was refused last.
    refused: Option<Scene>,
    /// Trial that holds the last grasp, and where it was when the grasp ended.
    last_trial: Option<(TrialId, TrialPlace)>,
}

impl SimulationFeature {
    pub(in crate::app) fn new(worker: SimWorker, effects: Job<Scene, Explanation>, scene: Scene) -> Self {
        Self {
            worker,
            effects,
            stored_accuracy: stored_accuracy().ok().map(|stored| stored.result),
            scene,
            traces: TraceHistory::default(),
            seen: None,
            shuffled: ShuffledObjects::new(DECK_SEED),
            changes: SceneChanges::default(),
            refused: None,
            last_trial: None,
        }
    }

    pub(in crate::app) fn worker(&self) -> &SimWorker {
        &self.worker
    }

    /// Measurement of the effects of a scene.
    pub(in crate::app) fn effects(&self) -> &Job<Scene, Explanation> {
        &self.effects
    }

    /// Stored study of what accuracy costs.
    pub(in crate::app) fn stored_accuracy(&self) -> Option<&AccuracyStudy> {
        self.stored_accuracy.as_ref()
    }

    /// Scene as set by the user.
    pub(in crate::app) fn scene(&self) -> &Scene {
        &self.scene
    }

    pub(in crate::app) fn traces(&self) -> &TraceHistory {
        &self.traces
    }

    /// Last grasp of the other engine, where it is to be drawn.
    pub(in crate::app) fn ghost(&self, view: &ViewState) -> Option<Arc<GhostGrasp>> {
        self.worker.ghost().filter(|_| view.ghost)
    }

    /// Trial of the demo log that holds the last grasp.
    pub(in crate::app) fn logged_trial(&self) -> Option<TrialId> {
        self.last_trial.filter(|(_, place)| *place == TrialPlace::DemoLog).map(|(id, _)| id)
    }

    /// Takes in rows and notices since the last frame.
    pub(in crate::app) fn gather(&mut self, view: &mut ViewState, notices: &mut Notices) {
        if self.worker.take_rows_lost() {
            self.traces.clear();
        }
        for row in self.worker.rows() {
            self.traces.push(&row);
        }
        let news: Vec<Notice> = self.worker.notices().collect();
        for notice in news {
            match notice {
                Notice::SceneRefused(refusal) => self.take_refusal(*refusal, notices),
                // The bar offers to keep it.
                Notice::Logged(id, place) => self.last_trial = Some((id, place)),
                Notice::Stored(id) | Notice::Known(id) | Notice::Kept(id) => {
                    self.last_trial = Some((id, TrialPlace::Store));
                    notices.show(notice);
                }
                other => notices.show(other),
            }
        }
        if let Some(snapshot) = self.worker.snapshot() {
            self.traces.forget_before(snapshot.scene_since);
            self.take_note_of_object(&snapshot, view);
        }
    }

    pub(in crate::app) fn apply(&mut self, action: SimulationAction, view: &mut ViewState, notices: &mut Notices) {
        match action {
            SimulationAction::Send(command) => self.send(command, notices),
            SimulationAction::SetScene(scene) => self.set_scene(*scene, notices),
            SimulationAction::OpenObject(source) => self.open(&source, notices),
            SimulationAction::SetGhost(ghost) => {
                view.ghost = ghost;
                self.send(Command::SetGhost(ghost), notices);
            }
            SimulationAction::MeasureEffects => _ = self.effects.start(self.scene.clone()),
            SimulationAction::UseHull => {
                let mut scene = self.refused.take().unwrap_or_else(|| self.scene.clone());
                scene.object.collision = CollisionShape::Hull;
                self.set_scene(scene, notices);
            }
            SimulationAction::SetScale(scale) => {
                let mut scene = self.scene.clone();
                scene.object.scale = Auto::Value(scale);
                self.set_scene(scene, notices);
            }
            SimulationAction::Undo => match self.changes.undo(&self.scene) {
                Some(scene) => self.take_back(scene, "Scene change undone", notices),
                None => notices.info("No scene change to undo. Labels are undone in Label mode (Ctrl+3)."),
            },
            SimulationAction::Redo => match self.changes.redo(&self.scene) {
                Some(scene) => self.take_back(scene, "Scene change redone", notices),
                None => notices.info("No scene change to redo."),
            },
        }
    }

    pub(in crate::app) fn send(&mut self, command: Command, notices: &mut Notices) {
        self.worker.send(command);
        if self.worker.has_ended() {
            notices.warning("the simulation has stopped; restart Palpate");
        }
    }

    /// Grasps a built-in object, a file, or the scene in a scene file.
    pub(in crate::app) fn open(&mut self, source: &str, notices: &mut Notices) {
        if source.to_ascii_lowercase().ends_with(".toml") {
            match Scene::from_file(Path::new(source)) {
                Ok(scene) => self.set_scene(scene, notices),
                Err(error) => notices.error(error.to_string()),
            }
            return;
        }
        self.set_scene(self.scene_with(source), notices);
    }

    /// The scene with another object: a built-in name or a file.
    pub(in crate::app) fn scene_with(&self, source: &str) -> Scene {
        let mut scene = self.scene.clone();
        scene.object.source = anchored(source);
        // Mass and size belong to the object before.
        let fresh = Scene::default().object;
        scene.object.mass = fresh.mass;
        scene.object.friction = fresh.friction;
        scene.object.scale = fresh.scale;
        scene.object.collision = fresh.collision;
        scene.object.rotation_deg = fresh.rotation_deg;
        scene
    }

    /// Grasps a built-in object in random poses.
    pub(in crate::app) fn open_in(&mut self, object: &str, pose: PoseSpread, notices: &mut Notices) {
        self.set_scene(Scene { pose, ..self.scene_with(object) }, notices);
        self.send(Command::Play, notices);
    }

    /// Grasps another built-in object, drawn at random.
    pub(in crate::app) fn open_next(&mut self, notices: &mut Notices) {
        let next = self.shuffled.next(&self.scene.object.source);
        self.open(next, notices);
        self.send(Command::Play, notices);
    }

    fn set_scene(&mut self, scene: Scene, notices: &mut Notices) {
        if let Err(error) = scene.check() {
            return notices.error(error.to_string());
        }
        if scene != self.scene {
            self.changes.note(&self.scene);
        }
        self.use_scene(scene);
    }

    /// Takes a scene without noting the change.
    pub(in crate::app) fn use_scene(&mut self, scene: Scene) {
        self.scene = scene;
        self.effects.stop();
        self.worker.send(Command::SetScene(Box::new(self.scene.clone())));
    }

    fn take_back(&mut self, scene: Scene, done: &str, notices: &mut Notices) {
        let object = object_title(&scene.object.source);
        self.use_scene(scene);
        notices.info(format!("{done}: {object}."));
    }

    /// Shows the scene that stays, unless the user has set another one since.
    fn take_refusal(&mut self, refusal: Refusal, notices: &mut Notices) {
        if self.scene == refusal.refused {
            self.scene = refusal.kept;
        }
        self.changes.forget(&self.scene);
        self.refused = Some(refusal.refused);
        notices.error(refusal.cause);
    }

    /// Frames a new object and, where it came from a file, remembers that.
    fn take_note_of_object(&mut self, snapshot: &Snapshot, view: &mut ViewState) {
        let source = &snapshot.scene.object.source;
        if self.seen.as_ref() == Some(source) {
            return;
        }
        if view.framed.is_none_or(|camera| camera == view.camera) {
            view.frame_all(snapshot);
        }
        if source != EMPTY && !catalogue().iter().any(|b| b.name == *source) {
            view.remember_file(source);
        }
        self.seen = Some(source.clone());
    }
}

/// Changes of the scene, to be undone.
#[derive(Default)]
struct SceneChanges {
    before: Vec<Scene>,
    after: Vec<Scene>,
    last: Option<Instant>,
}

/// Changes that can be undone.
const MOST_CHANGES: usize = 50;
/// Changes that follow each other faster are one: a value that is dragged changes with every frame.
const ONE_CHANGE: Duration = Duration::from_millis(600);

impl SceneChanges {
    /// Notes that the scene is about to change from this one.
    fn note(&mut self, scene: &Scene) {
        let now = Instant::now();
        let continues = self.last.replace(now).is_some_and(|last| now - last < ONE_CHANGE);
        self.after.clear();
        if continues && !self.before.is_empty() {
            return;
        }
        self.before.push(scene.clone());
        if self.before.len() > MOST_CHANGES {
            self.before.remove(0);
        }
    }

    /// Forgets the last change, where it led nowhere.
    fn forget(&mut self, now: &Scene) {
        self.before.pop_if(|before| before == now);
    }

    fn undo(&mut self, now: &Scene) -> Option<Scene> {
        self.last = None;
        let scene = self.before.pop()?;
        self.after.push(now.clone());
        Some(scene)
    }

    fn redo(&mut self, now: &Scene) -> Option<Scene> {
        self.last = None;
        let scene = self.after.pop()?;
        self.before.push(now.clone());
        Some(scene)
    }
}
