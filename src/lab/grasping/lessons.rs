//! Lessons: grasps by which a model learns new objects, simulated from an object's file, recorded with the real gripper, or
//! both.

use super::agreement::{Recompute, grasp_soundly};
use super::known_geometry::seeds_of;
use crate::datasets::{DatasetError, DatasetQuery, SensorView, sequence_of};
use palpate_learn::{
    Class, DataCard, Dataset, Example, Fitting, Labels, LearnError, Lesson, Model, ModelCard, OTHER, Pmf, Sequence,
};
use palpate_sim::frame::GraspFailure;
use palpate_sim::objects::{ObjectError, ObjectModel, capital_title, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{ObjectSetup, PosePreset, PoseSpread, Scene};
use palpate_store::Store;
use palpate_store::labels::{ClassClash, Classes, compared};
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::TrialSource;
use palpate_tactile::{Channel, LayoutError};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

/// Simulated grasps of a new object by which a model usually learns it.
pub const LESSON_GRASPS: usize = 160;
/// Simulated grasps of each built-in object that the model knows, in the poses of a scene by default: few of the grasps that
/// it has kept are in these.
const REHEARSED: usize = 8;
/// One of so many simulated grasps of a new object is straight.
const STRAIGHT: usize = 8;
/// Simulated grasps of a new object by which it is tested.
const TESTED: usize = 12;
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

/// A model that has learned.
#[derive(Debug)]
pub struct Taught {
    /// The model, which knows the new objects.
    pub model: Model,
    /// How well it knows each object whose grasps were simulated.
    pub lessons: Vec<Lesson>,
}

/// Tests a class that a model has learned by grasps that it has not learned from.
fn test(lesson: &mut Lesson, model: &Model, grasps: &[Example]) {
    let (labels, prior) = (&model.card.labels, model.card.prior());
    let felt = |own: &Example, before: Option<&Pmf>| model.recogniser.recognise(&own.grasp, before).pmf;
    let (mut right, mut after_three) = (0, 0);
    for (k, own) in grasps.iter().enumerate() {
        let mut answer = felt(own, prior.as_ref());
        match &labels.classes[answer.top().0].name {
            name if *name == lesson.name => right += 1,
            other => *lesson.taken_for.entry(other.clone()).or_default() += 1,
        }
        for next in grasps.iter().cycle().skip(k + 1).take(2) {
            answer = felt(next, Some(&answer));
        }
        after_three += usize::from(labels.classes[answer.top().0].name == lesson.name);
    }
    (lesson.tested, lesson.recognised, lesson.after_three) = (grasps.len(), right, Some(after_three));
}

/// Most classes that are named as mistaken for a new one.
const MOST_NAMED: usize = 3;

/// Classes that grasps of a new object are taken for, the most frequent first: `Cube (6), Case (2) and Box (1)`.
fn rivals(lesson: &Lesson) -> String {
    let mut all: Vec<(&String, usize)> = lesson.taken_for.iter().map(|(class, count)| (class, *count)).collect();
    all.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let others: usize = all.iter().skip(MOST_NAMED).map(|(_, count)| count).sum();
    let named = all.iter().take(MOST_NAMED).map(|(class, count)| format!("{} ({count})", capital_title(class)));
    let mut named: Vec<String> = named.collect();
    named.extend((others > 0).then(|| format!("further ones ({others})")));
    match named.as_slice() {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// How well a new object is recognised, in words.
pub fn lesson_result(lesson: &Lesson) -> String {
    let Lesson { tested, recognised, after_three, taken_for, .. } = lesson;
    let after = after_three.map_or_else(String::new, |right| format!(", after three grasps in {right} of {tested}"));
    let others = if taken_for.is_empty() { String::new() } else { format!(", others taken for {}", rivals(lesson)) };
    format!("the most likely answer in {recognised} of {tested} new grasps{others}{after}")
}

/// Most new grasps of the object were taken for others, also three together.
pub fn is_doubtful(lesson: &Lesson) -> bool {
    2 * lesson.after_three.unwrap_or(lesson.recognised) < lesson.tested && !lesson.taken_for.is_empty()
}

/// A warning where the hand was empty in many of the grasps, or they are like those of other objects.
pub fn lesson_warning(lesson: &Lesson) -> Option<String> {
    let Lesson { grasps, lost, .. } = lesson;
    if 4 * lost >= *grasps && *lost > 0 {
        let words = "it slid away or was never touched. Fix it in place to learn its shape";
        return Some(format!("not held in {lost} of {grasps} grasps: {words}"));
    }
    is_doubtful(lesson).then(|| format!("hard to tell from {}", rivals(lesson)))
}

/// Simulated grasps of one object.
struct Simulated {
    /// Those that are sound.
    examples: Vec<Example>,
    /// Number of those in which the object left the hand or was never touched.
    lost: usize,
    /// Why another one is not sound.
    unsound: Option<GraspFailure>,
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
        let known = |name: &str| has(name) && !model.card.taught.iter().any(|taught| taught == name);
        let (mut classes, mut taught_from) = (Classes::default(), model.card.taught_from.clone());
        for (class, (content, source)) in &taught_from {
            classes.take(class, *content, source, SEPARATE)?;
        }
        // Half of the grasps are in poses of a scene by default, where any turn and any face are rare; some of these are as
        // straight as a first grasp: flat faces that lie on the pads read like no others.
        let [usual, straight] =
            [PoseSpread::default(), PoseSpread { shift: [1e-3; 3], yaw_deg: 2.0, ..PoseSpread::default() }]
                .map(|pose| Scene { pose: PoseSpread { build: scene.pose.build, ..pose }, ..scene.clone() });
        let rehearsed: Vec<&str> = catalogue().iter().map(|own| own.name.as_str()).filter(|name| known(name)).collect();
        let rehearsed = if self.objects.is_empty() { Vec::new() } else { rehearsed };
        let (done, of) =
            (AtomicUsize::new(0), self.objects.len() * (self.grasps + TESTED) + rehearsed.len() * REHEARSED);
        let tick = || (self.progress)(LessonStage::Simulating(done.fetch_add(1, Ordering::Relaxed) + 1, of));
        let (mut learned, mut tests) = (Vec::new(), Vec::new());
        for name in rehearsed {
            let mut scene = usual.clone();
            name.clone_into(&mut scene.object.source);
            let Some(object) = scene.load_object()? else { continue };
            let own = self.simulated(&scene, &object, 0..REHEARSED, &view, &tick)?;
            add(data_of(&object.name, own.examples, &scene, &view)?)?;
        }
        for (number, setup) in self.objects.iter().enumerate() {
            let ObjectSetup { fixed, shift, .. } = scene.object;
            let [scene, usual, straight] = [&scene, &usual, &straight].map(|own| {
                let object = ObjectSetup { fixed, shift, ..setup.clone() };
                Scene { object, ..own.clone() }
            });
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
            let (few, half) = (self.grasps / STRAIGHT, self.grasps / 2);
            let (mut examples, mut lost) = (Vec::new(), 0);
            for (scene, grasps) in [(&scene, self.grasps - half), (&usual, half - few), (&straight, few)] {
                let own = self.simulated(scene, &object, 0..grasps, &view, &tick)?;
                examples.extend(own.examples);
                lost += own.lost;
            }
            let test = self.simulated(&usual, &object, half..half + TESTED, &view, &tick)?;
            if examples.is_empty() || test.examples.is_empty() {
                let why = test.unsound.map_or("their numbers are unsound".to_owned(), |failure| failure.to_string());
                return Err(refused(format!("no usable grasp of \"{}\": {why}", object.name)));
            }
            let (name, grasps) = (object.name.clone(), examples.len());
            learned.push(Lesson { name, grasps, lost, ..Lesson::default() });
            tests.push(test.examples);
            add(data_of(&object.name, examples, &scene, &view)?)?;
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
        learned.iter_mut().zip(&tests).for_each(|(lesson, grasps)| test(lesson, &taught, grasps));
        taught.card.lessons.retain(|before| !learned.iter().any(|lesson| lesson.name == before.name));
        taught.card.lessons.extend(learned.iter().cloned());
        Ok(Taught { model: taught, lessons: learned })
    }

    /// Simulated grasps of one object in the poses of a scene.
    fn simulated(
        &self,
        scene: &Scene,
        object: &ObjectModel,
        grasps: Range<usize>,
        view: &SensorView,
        tick: &(dyn Fn() + Sync),
    ) -> Result<Simulated, LessonError> {
        let sampler = PoseSampler::new(scene, Some(object));
        let seeds: Vec<u64> = seeds_of(object, self.seed).skip(grasps.start).take(grasps.len()).collect();
        let (lost, unsound) = (AtomicUsize::new(0), OnceLock::new());
        let read = |seed: &u64| -> Result<Option<Example>, LessonError> {
            if self.stop.load(Ordering::Relaxed) {
                return Err(LearnError::Stopped.into());
            }
            let (drawn, _) = sampler.draw(Some(object), *seed);
            let trial = grasp_soundly(&drawn, Some(object), *seed, Recompute::Unsettled);
            tick();
            if !trial.data.quality.is_sound() {
                trial.data.quality.failure.into_iter().for_each(|failure| _ = unsound.set(failure));
                return Ok(None);
            }
            let mut readings = view.readings(&trial)?.into_iter().map(|signals| Arc::new(sequence_of(&signals)));
            let Some(grasp) = readings.next() else { return Ok(None) };
            let failure = trial.data.quality.failure;
            let is_lost = matches!(failure, Some(GraspFailure::LostObject | GraspFailure::NeverTouched));
            lost.fetch_add(usize::from(is_lost), Ordering::Relaxed);
            let content = grasp.content();
            Ok(Some(Example { grasp, content, further: readings.collect(), ..Example::default() }))
        };
        let examples: Vec<Option<Example>> = seeds.par_iter().map(read).collect::<Result<_, _>>()?;
        let examples = examples.into_iter().flatten().collect();
        Ok(Simulated { examples, lost: lost.into_inner(), unsound: unsound.into_inner() })
    }
}

/// Grasps of one class as a data set.
fn data_of(name: &str, examples: Vec<Example>, scene: &Scene, view: &SensorView) -> Result<Dataset, LessonError> {
    let examples = examples.into_iter().enumerate().map(|(k, example)| Example { id: k as i64, ..example });
    let examples: Vec<Example> = examples.collect();
    let class = Class { name: name.to_owned(), size: None, shape: None };
    let channels = view.learnt()?.channels(&scene.gripper, view.signals)?;
    Ok(Dataset {
        channels: channels.iter().map(Channel::name).collect(),
        labels: Labels { classes: vec![class], ..Labels::default() },
        about: DataCard { grasps: examples.len(), ..DataCard::default() },
        examples,
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn at_most_three_rivals_are_named_with_their_counts() {
        let taken_for =
            [("cube", 1), ("case", 5), ("box", 2), ("ball", 1)].map(|(name, count)| (name.to_owned(), count));
        let lesson =
            Lesson { grasps: 160, tested: 12, recognised: 3, taken_for: taken_for.into(), ..Lesson::default() };
        let rivals = "Earphone case (5), Cardboard box (2), Rubber ball (1) and further ones (1)";
        assert_eq!(
            lesson_result(&lesson),
            format!("the most likely answer in 3 of 12 new grasps, others taken for {rivals}")
        );
        assert_eq!(lesson_warning(&lesson), Some(format!("hard to tell from {rivals}")));
        let slow = Lesson { after_three: Some(11), ..lesson.clone() };
        assert!(lesson_result(&slow).ends_with("further ones (1), after three grasps in 11 of 12"));
        assert_eq!(lesson_warning(&slow), None, "three grasps tell it");
        let known = Lesson { recognised: 12, taken_for: BTreeMap::new(), ..lesson.clone() };
        let result = "the most likely answer in 12 of 12 new grasps";
        assert_eq!((lesson_result(&known).as_str(), lesson_warning(&known)), (result, None));
        let lost = Lesson { lost: 40, ..lesson };
        assert!(lesson_warning(&lost).is_some_and(|words| words.starts_with("not held in 40 of 160 grasps")));
    }
}
