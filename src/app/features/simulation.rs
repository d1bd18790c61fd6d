//! The simulated gripper: its thread, its scene and its traces.

use super::App;
use super::view::{ViewSource, ViewState};
use crate::app::shown::HeldMoment;
use crate::app::traces::TraceHistory;
use palpate_lab::grasping::ShuffledObjects;
use palpate_lab::workers::{Command, GhostGrasp, Job, MeasuredAccuracy, Notice, Refusal, SimWorker, Snapshot};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{Auto, Phase};
use palpate_sim::objects::{CollisionShape, EMPTY, anchored, catalogue, is_file, object_title};
use palpate_sim::scene::Scene;
use palpate_store::TrialPlace;
use palpate_study::Explanation;
use palpate_study::accuracy::{AccuracyStudy, stored_accuracy};
use palpate_tactile::board::SensorList;
use palpate_tactile::trial::TrialId;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Seed of the sequence of objects.
const DECK_SEED: u64 = 1;

/// State of the simulated gripper in the window.
pub struct SimulationFeature {
    pub(in crate::app) worker: SimWorker,
    /// Its newest state, as of this frame.
    pub(in crate::app) snapshot: Option<Arc<Snapshot>>,
    /// Cost and error of the last scene measured.
    pub(in crate::app) accuracy: Option<Arc<MeasuredAccuracy>>,
    /// Measurement of the effects of a scene.
    pub(in crate::app) effects: Job<Scene, Explanation>,
    /// Stored study of what accuracy costs; absent where it cannot be read.
    pub(in crate::app) stored_accuracy: Option<AccuracyStudy>,
    /// Scene as set by the user.
    pub(in crate::app) scene: Scene,
    pub(in crate::app) traces: TraceHistory,
    /// The newest moment at which an object was held.
    pub(in crate::app) held: Option<HeldMoment>,
    /// Number of the grasp from which on this scene is grasped.
    scene_since: u64,
    /// Object last seen in the hand: a built-in name or a file.
    seen: Option<String>,
    shuffled: ShuffledObjects,
    changes: SceneChanges,
    /// Scene that was refused last.
    refused: Option<Scene>,
    /// Trial that holds the last grasp, and where it was when the grasp ended.
    pub(super) last_trial: Option<(TrialId, TrialPlace)>,
    /// Scene, by its first grasp, for which a message has said that its grasp is stored already.
    told_known: Option<u64>,
    ended: bool,
}

/// A grasp in the demo log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::app) struct LoggedGrasp {
    /// Its trial.
    pub(in crate::app) trial: TrialId,
    /// It has been moved to the store.
    pub(in crate::app) kept: bool,
}

impl SimulationFeature {
    pub(in crate::app) fn new(worker: SimWorker, effects: Job<Scene, Explanation>, scene: Scene) -> Self {
        Self {
            worker,
            snapshot: None,
            accuracy: None,
            effects,
            stored_accuracy: stored_accuracy().map(|stored| stored.result),
            scene,
            traces: TraceHistory::default(),
            held: None,
            scene_since: 0,
            seen: None,
            shuffled: ShuffledObjects::new(DECK_SEED),
            changes: SceneChanges::default(),
            refused: None,
            last_trial: None,
            told_known: None,
            ended: false,
        }
    }

    /// The last hold of the object, from its end until the next contact: forces of the release are no measure of it.
    pub(in crate::app) fn last_hold(&self) -> Option<&HeldMoment> {
        let snapshot = self.snapshot.as_ref()?;
        let frame = &snapshot.frame;
        let over = frame.phase == Phase::Release || frame.taxels.is_empty();
        self.held.as_ref().filter(|held| over && held.object == snapshot.object)
    }

    /// Sends a command to the simulation.
    pub fn send(&self, command: Command) {
        self.worker.send(command);
    }

    /// Last grasp of the other engine, where it is to be drawn.
    pub(in crate::app) fn ghost(&self, view: &ViewState) -> Option<Arc<GhostGrasp>> {
        self.worker.ghost().filter(|_| view.ghost && !view.presents)
    }

    /// The scene with another object: a built-in name or a file.
    pub(in crate::app) fn scene_with(&self, source: &str) -> Scene {
        let mut scene = self.scene.clone();
        scene.object.source = anchored(source);
        // Name, mass and size belong to the object before.
        let fresh = Scene::default().object;
        scene.object.name = fresh.name;
        scene.object.mass = fresh.mass;
        scene.object.friction = fresh.friction;
        scene.object.scale = fresh.scale;
        scene.object.collision = fresh.collision;
        scene.object.rotation_deg = fresh.rotation_deg;
        scene
    }

    /// Takes a scene without noting the change.
    pub(in crate::app) fn use_scene(&mut self, scene: Scene) {
        self.scene = scene;
        self.effects.stop();
        self.worker.send(Command::SetScene(Box::new(self.scene.clone())));
    }

    /// Gives the object in a file another name, or its own: here, and wherever the scene goes back to.
    pub(super) fn name_object(&mut self, source: &str, name: Option<&str>) {
        let SceneChanges { before, after, .. } = &mut self.changes;
        for scene in before.iter_mut().chain(after).filter(|scene| scene.object.source == source) {
            scene.object.name = name.map(str::to_owned);
        }
        if self.scene.object.source == source && self.scene.object.name.as_deref() != name {
            let mut scene = self.scene.clone();
            scene.object.name = name.map(str::to_owned);
            self.use_scene(scene);
        }
    }

    /// Measures cost and influence of the scene's effects.
    pub(in crate::app) fn measure_effects(&self) {
        self.effects.start(self.scene.clone());
    }

    /// Keeps the newest moment of the grasp at which an object is held; none after a grasp that held nothing.
    fn note_hold(&mut self, snapshot: &Snapshot) {
        self.held.take_if(|_| snapshot.status.nothing_held);
        let Some(trace) = self.traces.current().filter(|trace| trace.grasp == snapshot.grasp) else { return };
        let holds = |frame: &&Arc<Frame>| frame.phase == Phase::Hold && snapshot.stage.force_on_object(frame).is_some();
        let newest = trace.frames.iter().rev().flatten().take_while(|frame| frame.phase != Phase::Close).find(holds);
        if let Some(frame) = newest {
            let (stage, object) = (Arc::clone(&snapshot.stage), snapshot.object.clone());
            self.held = Some(HeldMoment { stage, frame: Arc::clone(frame), object });
        }
    }

    /// Shows the scene that stays, unless the user has set another one since; returns why the other was refused.
    fn take_refusal(&mut self, refusal: Refusal) -> String {
        if self.scene == refusal.refused {
            self.scene = refusal.kept;
        }
        self.changes.forget(&self.scene);
        self.refused = Some(refusal.refused);
        refusal.cause
    }
}

impl App {
    /// The last grasp of the simulation, while it is in the demo log.
    pub(in crate::app) fn logged(&self) -> Option<LoggedGrasp> {
        let (trial, _) = self.simulation.last_trial.filter(|(_, place)| *place == TrialPlace::DemoLog)?;
        Some(LoggedGrasp { trial, kept: self.library.kept == Some(trial) })
    }

    /// Takes in rows and notices since the last frame.
    pub(super) fn poll_simulation(&mut self) {
        let Self { simulation, notices, .. } = self;
        if simulation.worker.take_rows_lost() {
            simulation.traces.clear();
        }
        for row in simulation.worker.rows() {
            simulation.traces.push(&row);
        }
        let news: Vec<Notice> = simulation.worker.notices().collect();
        for notice in news {
            match notice {
                Notice::SceneRefused(refusal) => notices.failed("scene", simulation.take_refusal(*refusal)),
                // The bar offers to keep it.
                Notice::Logged(stored, place) => {
                    simulation.last_trial = Some((stored.id(), place));
                    let since = Some(simulation.scene_since);
                    if !stored.is_new() && std::mem::replace(&mut simulation.told_known, since) != since {
                        notices.show(Notice::Stored(stored));
                    }
                }
                Notice::Stored(stored) => {
                    simulation.last_trial = Some((stored.id(), TrialPlace::Store));
                    notices.show(notice);
                }
                other => notices.show(other),
            }
        }
        simulation.accuracy = simulation.worker.accuracy();
        simulation.snapshot = simulation.worker.snapshot();
        if let Some(snapshot) = simulation.snapshot.clone() {
            simulation.traces.forget_before(snapshot.scene_since);
            simulation.note_hold(&snapshot);
            if std::mem::replace(&mut simulation.scene_since, snapshot.scene_since) != snapshot.scene_since {
                notices.done("scene");
            }
            self.take_note_of_object(&snapshot);
        }
        if self.simulation.worker.has_ended() && !std::mem::replace(&mut self.simulation.ended, true) {
            self.notices.warning("the simulation has stopped; restart Palpate");
        }
    }

    /// Frames a new object and, where it came from a file, remembers that.
    fn take_note_of_object(&mut self, snapshot: &Snapshot) {
        let Self { simulation, view, notices, .. } = self;
        let source = &snapshot.scene.object.source;
        if simulation.seen.as_ref() == Some(source) {
            return;
        }
        if view.framed.is_none_or(|camera| camera == view.camera) {
            view.frame_all(snapshot);
        }
        if source != EMPTY && !catalogue().iter().any(|b| b.name == *source) {
            view.remember_file(source, snapshot.object.as_ref().map(|object| object.title.as_str()));
            if simulation.seen.is_some()
                && let Some(object) = &snapshot.object
            {
                notices.info(format!("Opened {}.", object.title));
            }
        }
        simulation.seen = Some(source.clone());
    }

    /// Grasps this scene.
    pub fn set_scene(&mut self, scene: Scene) {
        if let Err(error) = scene.check() {
            return self.notices.failed("scene", error.to_string());
        }
        if scene != self.simulation.scene {
            self.simulation.changes.note(&self.simulation.scene);
        }
        let (new, old) = (&scene.object, &self.simulation.scene.object);
        if (&new.source, new.scale, new.collision) != (&old.source, old.scale, old.collision) {
            self.notices.object_changed();
        }
        self.simulation.use_scene(scene);
    }

    /// Grasps a built-in object, a file, or the scene in a scene file; takes the sensors of a gripper file.
    pub fn open(&mut self, source: &str) {
        if source.to_ascii_lowercase().ends_with(".toml") {
            if SensorList::is_in(Path::new(source)) {
                return self.set_gripper_file(Path::new(source));
            }
            return match Scene::from_file(Path::new(source)) {
                Ok(scene) => self.set_scene(scene),
                Err(error) => self.notices.failed("scene", error.to_string()),
            };
        }
        self.grasp_object(source);
        if self.view.source == ViewSource::Gripper {
            self.notices.info("Set in the simulation; the real gripper is shown. Click SIMULATED to see it.");
        }
    }

    /// Grasps this object in the simulation.
    pub(super) fn grasp_object(&mut self, source: &str) {
        let mut scene = self.simulation.scene_with(source);
        // A file that the model has learned keeps the name that it had then.
        scene.object.name = self.name_of_learned(&scene.object.source).map(str::to_owned);
        self.set_scene(scene);
    }

    /// Grasps another built-in object, drawn at random.
    pub(super) fn open_next(&mut self) {
        self.dismiss_learned();
        let next = self.simulation.shuffled.next(&self.simulation.scene.object.source);
        self.open(next);
        self.simulation.send(Command::Play);
    }

    /// Draws the other engine's fingers and object, or does not.
    pub fn set_ghost(&mut self, ghost: bool) {
        self.view.ghost = ghost;
        self.simulation.send(Command::SetGhost(ghost));
    }

    /// Enlarges the picture of the touch, or makes it as large as usual.
    pub(in crate::app) fn enlarge_touch(&mut self) {
        self.view.inset_large ^= true;
        let size = if self.view.inset_large { "enlarged, where the 3-D view has room" } else { "as large as usual" };
        self.notices.info(format!("Picture of the touch: {size}."));
    }

    /// Grasps the scene refused last, or the present one, with the convex hull of its object.
    pub(in crate::app) fn use_hull(&mut self) {
        let mut scene = self.simulation.refused.take().unwrap_or_else(|| self.simulation.scene.clone());
        scene.object.collision = CollisionShape::Hull;
        self.set_scene(scene);
    }

    /// Sets the factor on all lengths of the object.
    pub(in crate::app) fn set_object_scale(&mut self, scale: f64) {
        let mut scene = self.simulation.scene.clone();
        scene.object.scale = Auto::Value(scale);
        self.set_scene(scene);
    }

    /// Back to the scene before the last change.
    pub(in crate::app) fn undo_scene(&mut self) {
        match self.simulation.changes.undo(&self.simulation.scene) {
            Some(scene) => self.take_back(scene, "Undone"),
            None => self.notices.info("No scene change to undo. Labels are undone in Label mode (Ctrl+3)."),
        }
    }

    /// Forward again.
    pub(in crate::app) fn redo_scene(&mut self) {
        match self.simulation.changes.redo(&self.simulation.scene) {
            Some(scene) => self.take_back(scene, "Redone"),
            None => self.notices.info("No scene change to redo."),
        }
    }

    fn take_back(&mut self, scene: Scene, done: &str) {
        let changed = changes(&self.simulation.scene, &scene, |path| self.view.title_of(path));
        self.simulation.use_scene(scene);
        self.notices.info(format!("{done}: {changed}."));
    }
}

/// What differs between two scenes: `object lemon → tomato`, `yaw deg 30 → 0`.
fn changes(from: &Scene, to: &Scene, title_of_file: impl Fn(&str) -> String) -> String {
    /// Most settings that are named.
    const NAMED: usize = 2;
    let settings = |scene: &Scene| -> BTreeMap<String, String> {
        let lines = scene.differences();
        lines.lines().filter_map(|line| line.split_once('=')).map(|(k, v)| (k.to_owned(), v.to_owned())).collect()
    };
    let (before, after) = (settings(from), settings(to));
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let value = |of: &BTreeMap<String, String>, key: &str| of.get(key).cloned().unwrap_or_else(|| "default".to_owned());
    let named = |key: &str| key.rsplit('.').next().unwrap_or(key).replace('_', " ");
    let title = |scene: &Scene| match &scene.object.source {
        _ if scene.object.name.is_some() => object_title(scene.object.name.as_deref().unwrap_or_default()),
        file if is_file(file) => title_of_file(file),
        built_in => object_title(built_in),
    };
    let titles = [from, to].map(title);
    let mut texts: Vec<String> = Vec::new();
    if titles[0] != titles[1] {
        texts.push(format!("object {} \u{2192} {}", titles[0], titles[1]));
    }
    let changed = keys.into_iter().filter(|key| before.get(*key) != after.get(*key));
    texts.extend(changed.map(|key| format!("{} {} \u{2192} {}", named(key), value(&before, key), value(&after, key))));
    let more = texts.len().saturating_sub(NAMED);
    texts.truncate(NAMED);
    if more > 0 {
        texts.push(format!("{more} more"));
    }
    texts.join(", ")
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
