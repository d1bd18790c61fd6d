//! What accuracy is worth: recognition by models that are trained on grasps of each setting and tested on reference
//! grasps.
//!
//! Sensors are those like on the real gripper. Perfect ones show the digits behind the comma of the integrator, in which
//! trees find the object before any finger has touched it: a forest trained and tested on reference grasps then scores twice
//! as much as one trained on standard grasps, and neither number means anything.

use super::AccuracyStudyError;
use super::plan::{AccuracySetting, RecognitionPlan};
use super::report::{MethodScore, RecognitionRow, rounded};
use crate::datasets::{SensorView, labels_of_catalogue, sequence_of};
use crate::study::timed_grasp::timed_grasp;
use palpate_learn::evaluation::answer;
use palpate_learn::metrics::{Bootstrap, Confusion, Interval};
use palpate_learn::{Dataset, Example, Fitting, Labels, method};
use palpate_sim::objects::{EMPTY, ObjectError, ObjectModel, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{PosePreset, Scene};
use palpate_tactile::model::SensorModel;
use rayon::iter::{IntoParallelIterator as _, IntoParallelRefIterator as _, ParallelIterator as _};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Test results of the models of one setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct LevelAnswers {
    /// CPU time of a training grasp (ms): the median.
    cpu_ms: f64,
    grasps: usize,
    left_out: usize,
    /// Class of each test grasp.
    truth: Vec<usize>,
    /// Decision of each method on each test grasp.
    decided: BTreeMap<String, Vec<usize>>,
}

/// How many test grasps there are, and what they cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct TestGrasps {
    test_grasps: usize,
    left_out: usize,
    /// CPU time of all (s).
    pub(super) cpu_s: f64,
}

/// Objects with their poses, and the test grasps.
pub(super) struct RecognitionBench<'a> {
    plan: &'a RecognitionPlan,
    objects: Vec<(ObjectModel, PoseSampler)>,
    labels: Labels,
    test: Dataset,
}

/// First seed of training and of test poses; a pose is never in both.
const TRAIN_SEEDS: u64 = 1;
const TEST_SEEDS: u64 = 1_000_001;

impl<'a> RecognitionBench<'a> {
    /// Loads the objects and computes the test grasps, in parallel; `None` if cancelled.
    pub(super) fn new(
        plan: &'a RecognitionPlan,
        cancelled: &AtomicBool,
    ) -> Result<Option<(Self, TestGrasps)>, AccuracyStudyError> {
        let base = Scene {
            pose: PosePreset::named(&plan.preset).map(|preset| preset.poses()).unwrap_or_default(),
            ..Scene::default()
        };
        let load = |name: &String| -> Result<Option<(ObjectModel, PoseSampler)>, ObjectError> {
            let mut scene = base.clone();
            scene.object.source.clone_from(name);
            let object = scene.load_object()?;
            let sampler = PoseSampler::new(&scene, object.as_ref());
            Ok(object.map(|object| (object, sampler)))
        };
        let names: Vec<String> = catalogue().iter().map(|built_in| built_in.name.clone()).collect();
        let objects = names.par_iter().map(load).collect::<Result<Vec<_>, ObjectError>>()?;
        let mut labels = labels_of_catalogue();
        labels.classes.retain(|class| class.name != EMPTY);
        let objects = objects.into_iter().flatten().collect();
        let mut bench = Self { plan, objects, labels, test: Dataset::default() };
        let cancelled = || cancelled.load(Ordering::Relaxed);
        let of_object = |object: usize| bench.grasps_of(object, &plan.test, TEST_SEEDS, plan.test_grasps, &cancelled);
        let parts = (0..bench.objects.len()).into_par_iter().map(of_object);
        let Some(parts) = parts.collect::<Result<Option<Vec<Grasps>>, AccuracyStudyError>>()? else { return Ok(None) };
        let (test, cpu_ms, left_out) = bench.dataset(parts);
        let made = TestGrasps { test_grasps: test.examples.len(), left_out, cpu_s: 1e-3 * cpu_ms.iter().sum::<f64>() };
        bench.test = test;
        Ok(Some((bench, made)))
    }

    /// Trains on grasps of a setting, and answers all test grasps; `None` if cancelled.
    pub(super) fn level(
        &self,
        setting: &AccuracySetting,
        cancelled: &AtomicBool,
    ) -> Result<Option<LevelAnswers>, AccuracyStudyError> {
        let stopped = || cancelled.load(Ordering::Relaxed);
        let mut parts = Vec::new();
        for object in 0..self.objects.len() {
            match self.grasps_of(object, setting, TRAIN_SEEDS, self.plan.train_grasps, &stopped)? {
                Some(part) => parts.push(part),
                None => return Ok(None),
            }
        }
        let (train, mut cpu_ms, left_out) = self.dataset(parts);
        cpu_ms.sort_by(f64::total_cmp);
        let mut decided = BTreeMap::new();
        for key in &self.plan.methods {
            let Some(method) = method(key) else { continue };
            let mut settings = serde_json::Map::new();
            if method.recipe.is_some() {
                settings.insert("epochs".to_owned(), self.plan.epochs.into());
            }
            let fitting = Fitting { seed: 1, quick: false, settings, second: None, progress: &|_| (), stop: cancelled };
            let recogniser = match (method.fit)(&train, &fitting) {
                Err(_) if stopped() => return Ok(None),
                outcome => outcome.map_err(|cause| AccuracyStudyError::Fit { method: method.key, cause })?,
            };
            let answers = answer(recogniser.as_ref(), &self.test);
            decided.insert(key.clone(), answers.verdicts.iter().map(|verdict| verdict.pmf.top().0).collect());
        }
        Ok(Some(LevelAnswers {
            cpu_ms: rounded(cpu_ms.get(cpu_ms.len() / 2).copied().unwrap_or_default()),
            grasps: train.examples.len(),
            left_out,
            truth: self.test.truth(),
            decided,
        }))
    }

    fn grasps_of(
        &self,
        object: usize,
        setting: &AccuracySetting,
        first_seed: u64,
        count: u64,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Option<Grasps>, AccuracyStudyError> {
        let (model, sampler) = &self.objects[object];
        let view = SensorView { sensors: SensorModel::PhysicalLike, ..SensorView::default() };
        let mut grasps = Grasps::default();
        let class = self.labels.class(&model.name);
        for seed in first_seed..first_seed + count {
            let scene = setting.adopted(&sampler.draw(Some(model), seed).0)?;
            let Some((mut trial, cpu_s)) = timed_grasp(&scene, Some(model), cancelled) else { return Ok(None) };
            // Seeds the noise of the sensors, too.
            trial.header.seed = seed;
            grasps.cpu_ms.push(cpu_s * 1e3);
            let (Some(class), true) = (class, trial.data.quality.is_sound()) else {
                grasps.left_out += 1;
                continue;
            };
            let signals = view.signals(&trial).map_err(|cause| AccuracyStudyError::Layout { cause })?;
            grasps.channels.clone_from(&signals.channels);
            let grasp = Arc::new(sequence_of(&signals));
            grasps.examples.push(Example {
                id: seed as i64,
                class,
                content: grasp.content(),
                grasp,
                ..Example::default()
            });
        }
        Ok(Some(grasps))
    }

    /// One data set, all CPU times (ms), and the number of grasps left out.
    fn dataset(&self, parts: Vec<Grasps>) -> (Dataset, Vec<f64>, usize) {
        let mut data = Dataset { labels: self.labels.clone(), ..Dataset::default() };
        let (mut cpu_ms, mut left_out) = (Vec::new(), 0);
        for part in parts {
            data.examples.extend(part.examples);
            if !part.channels.is_empty() {
                data.channels = part.channels;
            }
            cpu_ms.extend(part.cpu_ms);
            left_out += part.left_out;
        }
        (data, cpu_ms, left_out)
    }
}

/// Grasps of one object.
#[derive(Default)]
struct Grasps {
    channels: Vec<String>,
    examples: Vec<Example>,
    cpu_ms: Vec<f64>,
    left_out: usize,
}

/// Scores of every setting, beside those of the last, which is trained on reference grasps.
pub(super) fn scores(levels: &[(&AccuracySetting, &LevelAnswers)], reference: &LevelAnswers) -> Vec<RecognitionRow> {
    let classes = reference.truth.iter().max().map_or(0, |most| most + 1);
    let truth = &reference.truth;
    let f1 = |decided: &[usize], trials: &[usize]| {
        Confusion::from_pairs(classes, trials.iter().map(|k| (truth[*k], decided.get(*k).copied())))?.macro_f1()
    };
    let bootstrap = Bootstrap { resamples: 1000, seed: 0 };
    let score = |method: &String, decided: &Vec<usize>| {
        let beside = reference.decided.get(method)?;
        let short = |interval: Interval| Interval {
            estimate: rounded(interval.estimate),
            low: rounded(interval.low),
            high: rounded(interval.high),
        };
        Some(MethodScore {
            method: method.clone(),
            f1: short(bootstrap.interval(truth, |trials| f1(decided, trials))?),
            gain: short(bootstrap.difference(truth, |trials| f1(decided, trials), |trials| f1(beside, trials))?),
        })
    };
    levels
        .iter()
        .map(|(setting, level)| RecognitionRow {
            setting: (*setting).clone(),
            cpu_ms: level.cpu_ms,
            grasps: level.grasps,
            left_out: level.left_out,
            scores: level.decided.iter().filter_map(|(method, decided)| score(method, decided)).collect(),
        })
        .collect()
}
