//! Lessons: grasps by which a model learns new objects, simulated from an object's file, recorded with the real gripper, or
//! both.

use super::agreement::{Recompute, grasp_soundly};
use super::known_geometry::seeds_of;
use crate::datasets::{DatasetError, DatasetQuery, SensorView, sequence_of};
use palpate_learn::{
    Class, DataCard, Dataset, Example, Fitting, Labels, LearnError, Model, ModelCard, OTHER, Sequence,
};
use palpate_sim::frame::GraspFailure;
use palpate_sim::objects::{ObjectError, ObjectModel};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{ObjectSetup, PosePreset, Scene};
use palpate_store::Store;
use palpate_store::labels::{ClassClash, Classes, compared};
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::TrialSource;
use palpate_tactile::{Channel, LayoutError};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Simulated grasps of a new object by which a model usually learns it.
pub const LESSON_GRASPS: usize = 80;
/// Fewest recorded grasps of an object that a model learns.
const LEAST_RECORDED: usize = 5;
/// Grippers with drawn sensors that read each simulated grasp.
const DRAWS: u32 = 6;
/// What to do with two objects in one class.
const SEPARATE: &str = "name another class with --class, or rename one of them";
/// Pose preset where the model's own is unknown.
const PRESET: &str = "B";

/// Progress of a lesson.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LessonStage {
    /// Number of simulated grasps, and of all.
    Simulating(usize, usize),
    /// Completed share of the fit.
    Fitting(f64),
}

/// Objects to learn, and how.
pub struct Lessons<'a> {
    /// Objects whose grasps are simulated.
    pub objects: &'a [ObjectSetup],
    /// Their classes, in the same order; empty where they have their own names.
    pub classes: &'a [String],
    /// Labels of recorded grasps, in the store.
    pub recorded: &'a [String],
    /// Simulated grasps of each object.
    pub grasps: usize,
    /// Seed of poses and of the fit.
    pub seed: u64,
    /// Receives the progress.
    pub progress: &'a (dyn Fn(LessonStage) + Sync),
    /// Flag that cancels the lesson.
    pub stop: &'a AtomicBool,
}

/// What was learned, and from what.
#[derive(Debug)]
pub struct Taught {
    /// The model, which knows the new objects.
    pub model: Model,
    /// Simulated grasps that it learned from.
    pub grasps: usize,
    /// Those of them in which the object left the hand, or was never touched.
    pub lost: usize,
}

impl Taught {
    /// A warning where the hand was empty in many of the grasps.
    pub fn warning(&self) -> Option<String> {
        let Self { grasps, lost, .. } = self;
        let words = "was not held: it slid away or was never touched. Fix it in place, or see `palpate grasp`";
        (4 * lost >= *grasps && *lost > 0).then(|| format!("in {lost} of {grasps} grasps the object {words}"))
    }
}

/// Reason why a model learned nothing.
#[derive(Debug, thiserror::Error)]
pub enum LessonError {
    /// An object failed to load.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// Two objects would be one class.
    #[error(transparent)]
    OneClass(#[from] ClassClash),
    /// The gripper has no such sensors.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The recorded grasps cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The fit failed.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// There is nothing to learn, or too little.
    #[error("{0}")]
    Refused(String),
}

fn refused(cause: impl Into<String>) -> LessonError {
    LessonError::Refused(cause.into())
}

impl Lessons<'_> {
    /// Teaches a model these objects. The store is read only for recorded grasps.
    pub fn teach(&self, model: &Model, store: Option<&Store>) -> Result<Taught, LessonError> {
        model.check_learns_new_objects()?;
        let view = view_of(&model.card);
        let nothing = || refused("name an object file, or a label with --recorded");
        let needs = &model.card.channels;
        let other_channels = || refused(format!("these grasps lack channels of the model: {}", needs.join(", ")));
        let mut lessons: Option<Dataset> = None;
        let mut add = |data: Dataset| -> Result<(), LessonError> {
            let joined = match lessons.take() {
                Some(before) => before.with(&data),
                None => Some(data),
            };
            lessons = Some(joined.ok_or_else(&other_channels)?);
            Ok(())
        };
        let scene = scene_of(&model.card);
        let has = |name: &str| model.card.labels.classes.iter().any(|class| compared(&class.name) == compared(name));
        let known = |name: &String| !model.card.taught.contains(name) && has(name);
        let (mut classes, mut taught_from) = (Classes::default(), model.card.taught_from.clone());
        for (class, (content, source)) in &taught_from {
            classes.take(class, *content, source, SEPARATE)?;
        }
        let (mut grasps, mut lost) = (0, 0);
        for (number, setup) in self.objects.iter().enumerate() {
            let mut scene = scene.clone();
            let Scene { object: ObjectSetup { fixed, shift, .. }, .. } = scene;
            scene.object = ObjectSetup { fixed, shift, ..setup.clone() };
            let object = scene.load_object()?;
            let mut object = object
                .ok_or_else(|| refused(format!("\"{}\" is no object; name a URDF, OBJ or STL file", setup.source)))?;
            if let Some(class) = self.classes.get(number) {
                object.name.clone_from(class);
            }
            if known(&object.name) || object.name == OTHER {
                return Err(refused(format!(
                    "the model already knows \"{}\"; to teach another object, name its class with --class, or rename the file",
                    object.name
                )));
            }
            classes.take(&object.name, object.content, &setup.source, SEPARATE)?;
            taught_from.insert(object.name.clone(), (object.content, setup.source.clone()));
            let (data, of_them) = self.simulated(number, &scene, &object, &view)?;
            (grasps, lost) = (grasps + data.examples.len(), lost + of_them);
            add(data)?;
        }
        for name in self.recorded {
            let store = store.ok_or_else(nothing)?;
            let simulated = self.objects.len() * self.grasps;
            add(recorded(name, store, &view, simulated)?)?;
        }
        let lessons = lessons.ok_or_else(nothing)?;
        if lessons.channels != *needs {
            return Err(other_channels());
        }
        let progress = |share: f64| (self.progress)(LessonStage::Fitting(share));
        let fitting = Fitting { progress: &progress, ..Fitting::new(self.seed, false, self.stop) };
        fitting.check()?;
        let mut taught = model.taught(&lessons, &fitting)?;
        taught.card.taught_from = taught_from;
        Ok(Taught { model: taught, grasps, lost })
    }

    /// Simulated grasps of one object, and the number of those in which it left the hand.
    fn simulated(
        &self,
        number: usize,
        scene: &Scene,
        object: &ObjectModel,
        view: &SensorView,
    ) -> Result<(Dataset, usize), LessonError> {
        let sampler = PoseSampler::new(scene, Some(object));
        let seeds: Vec<u64> = seeds_of(object, self.seed).take(self.grasps).collect();
        let (done, lost) = (AtomicUsize::new(number * self.grasps), AtomicUsize::new(0));
        let of = self.objects.len() * self.grasps;
        let read = |(k, seed): (usize, &u64)| -> Result<Option<Example>, LessonError> {
            if self.stop.load(Ordering::Relaxed) {
                return Err(LearnError::Stopped.into());
            }
            let (drawn, _) = sampler.draw(Some(object), *seed);
            let trial = grasp_soundly(&drawn, Some(object), *seed, Recompute::Unsettled);
            (self.progress)(LessonStage::Simulating(done.fetch_add(1, Ordering::Relaxed) + 1, of));
            if !trial.data.quality.is_sound() {
                return Ok(None);
            }
            let mut readings = view.readings(&trial)?.into_iter().map(|signals| Arc::new(sequence_of(&signals)));
            let Some(grasp) = readings.next() else { return Ok(None) };
            let failure = trial.data.quality.failure;
            let is_lost = matches!(failure, Some(GraspFailure::LostObject | GraspFailure::NeverTouched));
            lost.fetch_add(usize::from(is_lost), Ordering::Relaxed);
            let content = grasp.content();
            Ok(Some(Example { id: k as i64, grasp, content, further: readings.collect(), ..Example::default() }))
        };
        let examples: Vec<Option<Example>> = seeds.par_iter().enumerate().map(read).collect::<Result<_, _>>()?;
        let examples: Vec<Example> = examples.into_iter().flatten().collect();
        if examples.is_empty() {
            let name = &object.name;
            return Err(refused(format!("no simulated grasp of \"{name}\" is sound; `palpate grasp` shows why")));
        }
        let class = Class { name: object.name.clone(), size: None, shape: None };
        let channels = view.learnt()?.channels(&scene.gripper, view.signals)?;
        let data = Dataset {
            channels: channels.iter().map(Channel::name).collect(),
            labels: Labels { classes: vec![class], ..Labels::default() },
            about: DataCard { grasps: examples.len(), ..DataCard::default() },
            examples,
        };
        Ok((data, lost.into_inner()))
    }
}

/// Recorded grasps of one object, each counted so often that together they weigh as much as simulated ones.
fn recorded(name: &str, store: &Store, view: &SensorView, simulated: usize) -> Result<Dataset, LessonError> {
    let query =
        DatasetQuery { source: Some(TrialSource::Recorded), objects: vec![name.to_owned()], ..DatasetQuery::default() };
    let mut data = query.read(store, view, &mut |_, _| ())?;
    let found = data.examples.len();
    if found < LEAST_RECORDED {
        return Err(refused(format!(
            "\"{name}\" has {found} usable recorded grasps; teaching needs {LEAST_RECORDED}. Record and label more"
        )));
    }
    let times = (simulated * view.readers() as usize).div_ceil(found).max(1);
    for example in &mut data.examples {
        let again: Vec<Arc<Sequence>> = vec![Arc::clone(&example.grasp); times - 1];
        example.further.extend(again);
    }
    Ok(data)
}

/// The scene in which a model's training grasps were made, as far as its card says.
pub(super) fn scene_of(card: &ModelCard) -> Scene {
    let preset = card.data.preset.as_deref().and_then(PosePreset::named).or_else(|| PosePreset::named(PRESET));
    let mut scene = Scene::default();
    if let Some(preset) = preset {
        scene.pose = preset.poses();
    }
    scene.pose.build = if view_of(card).sensors == SensorModel::Drawn { 1.0 } else { 0.0 };
    if card.data.object.starts_with("fixed") {
        scene.set_object_fixed(true);
    }
    scene
}

/// How simulated grasps are read for a model: as its own were, or, where it learned from a real gripper, as any gripper reads.
pub(super) fn view_of(card: &ModelCard) -> SensorView {
    let view = SensorView::of_model(card);
    let sensors = if card.data.sensors.is_none() { SensorModel::Drawn } else { view.sensors };
    SensorView { draws: DRAWS, sensors, ..view }
}
