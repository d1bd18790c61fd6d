//! What accuracy is worth: recognition by models that are trained on grasps of each setting and tested on reference
//! grasps.
//!
//! Sensors are those like on the real gripper. Perfect ones show the digits behind the comma of the integrator, in which
//! trees find the object before any finger has touched it: a forest trained and tested on reference grasps then scores twice
//! as much as one trained on standard grasps, and neither number means anything.

use super::plan::{AccuracySetting, RecognitionPlan};
use super::report::{MethodScore, RecognitionRow};
use crate::frame::{StudyError, rounded};
use crate::paper::Pool;
use palpate_lab::datasets::{DatasetError, SensorView, labels_of_catalogue, sequence_of};
use palpate_lab::grasping::{posed_object, timed_grasp};
use palpate_learn::evaluation::answer;
use palpate_learn::metrics::Interval;
use palpate_learn::{Dataset, Example, Fitting, Labels, method};
use palpate_sim::objects::{BuiltIn, EMPTY, ObjectError, ObjectModel, catalogue};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{PosePreset, Scene};
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::TrialId;
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

/// Objects with their poses, and the test grasps.
pub(super) struct RecognitionData {
    plan: RecognitionPlan,
    objects: Vec<(ObjectModel, PoseSampler)>,
    labels: Labels,
    test: Dataset,
}

/// First seed of training and of test poses; a pose is never in both.
const TRAIN_SEEDS: u64 = 1;
const TEST_SEEDS: u64 = 1_000_001;

impl RecognitionData {
    /// Loads the objects and computes the test grasps.
    pub(super) fn new(plan: RecognitionPlan, stop: &AtomicBool) -> Result<Self, StudyError> {
        let base = Scene {
            pose: PosePreset::named(&plan.preset).map(|preset| preset.poses()).unwrap_or_default(),
            ..Scene::default()
        };
        let load = |built_in: &BuiltIn| posed_object(&base, &built_in.name).transpose();
        let objects = catalogue().iter().filter_map(load).collect::<Result<_, ObjectError>>()?;
        let mut labels = labels_of_catalogue();
        labels.classes.retain(|class| class.name != EMPTY);
        let mut bench = Self { plan, objects, labels, test: Dataset::default() };
        let RecognitionPlan { test, test_grasps, .. } = bench.plan.clone();
        bench.test = bench.grasps(&test, TEST_SEEDS, test_grasps, stop)?.0;
        Ok(bench)
    }

    /// Trains on grasps of a setting, and answers all test grasps.
    pub(super) fn level(&self, setting: &AccuracySetting, stop: &AtomicBool) -> Result<LevelAnswers, StudyError> {
        let (train, mut cpu_ms, left_out) = self.grasps(setting, TRAIN_SEEDS, self.plan.train_grasps, stop)?;
        cpu_ms.sort_by(f64::total_cmp);
        let mut decided = BTreeMap::new();
        for key in &self.plan.methods {
            let Some(method) = method(key) else { continue };
            let mut settings = serde_json::Map::new();
            if method.recipe.is_some() {
                settings.insert("epochs".to_owned(), self.plan.epochs.into());
            }
            let fitting = Fitting { settings, ..Fitting::new(1, false, stop) };
            let recogniser = (method.fit)(&train, &fitting).map_err(|cause| StudyError::of_fit(key, cause))?;
            let answers = answer(recogniser.as_ref(), &self.test);
            decided.insert(key.clone(), answers.verdicts.iter().map(|verdict| verdict.pmf.top().0).collect());
        }
        Ok(LevelAnswers {
            cpu_ms: rounded(cpu_ms.get(cpu_ms.len() / 2).copied().unwrap_or_default()),
            grasps: train.examples.len(),
            left_out,
            truth: self.test.truth(),
            decided,
        })
    }

    /// Grasps of all objects at a setting, all CPU times (ms), and the number of grasps left out.
    fn grasps(
        &self,
        setting: &AccuracySetting,
        first_seed: u64,
        count: u64,
        stop: &AtomicBool,
    ) -> Result<(Dataset, Vec<f64>, usize), StudyError> {
        let view = SensorView { sensors: SensorModel::PhysicalLike, ..SensorView::default() };
        let mut data = Dataset { labels: self.labels.clone(), ..Dataset::default() };
        let (mut cpu_ms, mut left_out) = (Vec::new(), 0);
        for (model, sampler) in &self.objects {
            let class = self.labels.class(&model.name);
            for seed in first_seed..first_seed + count {
                let scene = setting.adopted(&sampler.draw(Some(model), seed).0)?;
                let grasped = timed_grasp(&scene, Some(model), &|| stop.load(Ordering::Relaxed));
                let (mut trial, cpu_s) = grasped.ok_or(StudyError::Stopped)?;
                // Seeds the noise of the sensors, too.
                trial.header.seed = seed;
                cpu_ms.push(cpu_s * 1e3);
                let (Some(class), true) = (class, trial.data.quality.is_sound()) else {
                    left_out += 1;
                    continue;
                };
                let signals = view.signals(&trial).map_err(DatasetError::Layout)?;
                data.channels.clone_from(&signals.channels);
                let grasp = Arc::new(sequence_of(&signals));
                let (id, content) = (seed as i64, grasp.content());
                data.examples.push(Example { id, class, content, grasp, ..Example::default() });
            }
        }
        Ok((data, cpu_ms, left_out))
    }
}

/// Scores of every setting, beside those of grasps of the reference.
pub(super) fn scores(levels: &[(AccuracySetting, LevelAnswers)], reference: &LevelAnswers) -> Vec<RecognitionRow> {
    let truth = &reference.truth;
    let classes: Vec<String> = (0..=truth.iter().max().copied().unwrap_or(0)).map(|class| class.to_string()).collect();
    let pool = |decided: &[usize]| {
        let decisions = truth.iter().zip(decided).enumerate();
        Pool::of_decisions(&classes, decisions.map(|(trial, (truth, decided))| (trial as TrialId, *truth, *decided)))
    };
    let short = |Interval { estimate, low, high }: Interval| Interval {
        estimate: rounded(estimate),
        low: rounded(low),
        high: rounded(high),
    };
    let score = |(method, decided): (&String, &Vec<usize>)| {
        let (own, beside) = (pool(decided), pool(reference.decided.get(method)?));
        Some(MethodScore { method: method.clone(), f1: short(own.f1()?), gain: short(own.against(&beside)?.f1) })
    };
    let row = |(setting, level): &(AccuracySetting, LevelAnswers)| RecognitionRow {
        setting: setting.clone(),
        cpu_ms: level.cpu_ms,
        grasps: level.grasps,
        left_out: level.left_out,
        scores: level.decided.iter().filter_map(score).collect(),
    };
    levels.iter().map(row).collect()
}
