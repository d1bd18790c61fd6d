//! What accuracy costs in time, and what it is worth.
//!
//! Every scene is grasped at every setting of a plan: tolerances, fixed steps, integrators, engines, joints and taxels.
//! CPU time is that of the grasp's thread. Errors are those of motion, root mean squares over a grasp against the same
//! scene at a tolerance of 1e-7; for joints and taxels they are those of the model, against many more of them. What is
//! reported is the median over poses and shapes, with quartiles.
//!
//! Beside it, recognition: models trained on grasps of each setting are tested on reference grasps.

mod figure;
mod measure;
mod plan;
mod recognition;
mod report;
mod tables;

pub use figure::{accuracy_figure, accuracy_plot};
pub use measure::GraspSample;
pub use plan::{AccuracyPlan, AccuracySetting, RecognitionPlan, SettingFamily};
pub use report::{
    AccuracyRow, AccuracyStudy, FAILED_SHARE, GroupCost, MethodScore, RecognitionRow, SceneGroup, Spread,
};
pub use tables::accuracy_tables;

use super::effects::Measuring;
use super::result_file::{ResultFile, ResultFileError};
use super::stored_study::StoredStudy;
use measure::measure_scene;
use palpate_geometry::DistanceField;
use palpate_learn::LearnError;
use palpate_sim::objects::{ObjectError, ObjectModel};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Scene, SceneError};
use palpate_tactile::LayoutError;
use recognition::{LevelAnswers, RecognitionBench, TestGrasps, scores};
use report::SceneKind;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

/// Name of the study in its files, and of the unit that counts the cost of test grasps.
const STUDY: &str = "accuracy";
const TESTS: &str = "recognition, test grasps";

/// Error of the study.
#[derive(Debug, thiserror::Error)]
pub enum AccuracyStudyError {
    /// The result file failed.
    #[error(transparent)]
    File(#[from] ResultFileError),
    /// An object failed to load.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// A setting does not fit the scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The sensor layout does not fit.
    #[error("{cause}")]
    Layout {
        /// Cause.
        cause: LayoutError,
    },
    /// A model could not be fitted.
    #[error("{method}: {cause}")]
    Fit {
        /// Key of the method.
        method: &'static str,
        /// Cause.
        cause: LearnError,
    },
}

/// Result of one unit of work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AccuracyUnit(UnitResult);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum UnitResult {
    Grasps(Vec<GraspSample>),
    Recognition(LevelAnswers),
    Tests(TestGrasps),
}

/// A unit of work.
enum Work<'a> {
    /// All settings of one object in one pose.
    Pose { object: &'a str, fixed: bool, seed: u64 },
    /// Models of one setting.
    Recognition(&'a AccuracySetting),
}

/// The stored result of the full study, which manual, README and window show.
pub fn stored_accuracy() -> Result<StoredStudy<AccuracyStudy>, serde_json::Error> {
    StoredStudy::parse(include_str!("../../../../assets/studies/accuracy.json"))
}

impl AccuracyPlan {
    /// Opens or starts the file with the results of this plan.
    pub fn open(&self, path: &std::path::Path) -> Result<ResultFile<AccuracyUnit>, ResultFileError> {
        ResultFile::open(path, STUDY, self)
    }

    fn units(&self) -> Vec<(String, Work<'_>)> {
        let trained = self.recognition.settings.iter().map(|setting| {
            (format!("recognition, {} {}", setting.family.title(), setting.name), Work::Recognition(setting))
        });
        let poses = self.objects.iter().flat_map(|object| {
            [false, true].into_iter().flat_map(move |fixed| {
                (1..=self.poses).map(move |seed| {
                    let how = if fixed { "fixed" } else { "free" };
                    (format!("{object} {how} {seed}"), Work::Pose { object, fixed, seed })
                })
            })
        });
        trained.chain(poses).collect()
    }

    /// Computes what the file lacks; `None` if cancelled.
    pub fn run(
        &self,
        file: &mut ResultFile<AccuracyUnit>,
        how: &Measuring<'_>,
    ) -> Result<Option<AccuracyStudy>, AccuracyStudyError> {
        let units = self.units();
        let mut objects = BTreeMap::new();
        for name in &self.objects {
            let mut scene = Scene::default();
            scene.object.source.clone_from(name);
            if let Some(object) = scene.load_object()? {
                let sampler = PoseSampler::new(&scene, Some(&object));
                objects.insert(name.as_str(), (object, sampler));
            }
        }
        let trains =
            |(name, work): &(String, Work<'_>)| matches!(work, Work::Recognition(_)) && file.get(name).is_none();
        let bench = if units.iter().any(trains) {
            let made = parallel(how.threads, || RecognitionBench::new(&self.recognition, how.cancelled))?;
            let Some((bench, tests)) = made else { return Ok(None) };
            if file.get(TESTS).is_none() {
                file.add(TESTS, AccuracyUnit(UnitResult::Tests(tests)), tests.cpu_s)?;
            }
            Some(bench)
        } else {
            None
        };
        let cancelled = || how.cancelled.load(Ordering::Relaxed);
        let finished = file.complete(&units, how, |work| -> Result<_, AccuracyStudyError> {
            let result = match work {
                Work::Pose { object, fixed, seed } => {
                    let Some((model, sampler)) = objects.get(object) else { return Ok(None) };
                    let mut scene = sampler.draw(Some(model), *seed).0;
                    scene.set_object_fixed(*fixed);
                    measure_scene(&scene, model, &self.settings, &cancelled)?.map(UnitResult::Grasps)
                }
                Work::Recognition(setting) => match &bench {
                    Some(bench) => bench.level(setting, how.cancelled)?.map(UnitResult::Recognition),
                    None => None,
                },
            };
            Ok(result.map(AccuracyUnit))
        })?;
        Ok(finished.then(|| self.report(&units, file, &objects)))
    }

    fn report(
        &self,
        units: &[(String, Work<'_>)],
        file: &ResultFile<AccuracyUnit>,
        objects: &BTreeMap<&str, (ObjectModel, PoseSampler)>,
    ) -> AccuracyStudy {
        let mut samples: Vec<Vec<(SceneKind, GraspSample)>> = vec![Vec::new(); self.settings.len()];
        let mut levels: Vec<(&AccuracySetting, &LevelAnswers)> = Vec::new();
        for (name, work) in units {
            match (work, file.get(name)) {
                (Work::Pose { object, fixed, .. }, Some(AccuracyUnit(UnitResult::Grasps(grasps)))) => {
                    let mesh = objects.get(object).is_some_and(|(object, _)| has_mesh(object));
                    let kind = SceneKind { fixed: *fixed, mesh };
                    samples.iter_mut().zip(grasps).for_each(|(own, grasp)| own.push((kind, *grasp)));
                }
                (Work::Recognition(setting), Some(AccuracyUnit(UnitResult::Recognition(level)))) => {
                    levels.push((*setting, level));
                }
                _ => {}
            }
        }
        let reference = levels.iter().find(|(setting, _)| **setting == self.recognition.test).map(|(_, level)| *level);
        AccuracyStudy {
            objects: self.objects.clone(),
            poses: self.poses,
            rows: self.rows(&samples),
            recognition: reference.map(|reference| scores(&levels, reference)).unwrap_or_default(),
        }
    }

    fn rows(&self, samples: &[Vec<(SceneKind, GraspSample)>]) -> Vec<AccuracyRow> {
        let row = |(setting, samples): (&AccuracySetting, &Vec<(SceneKind, GraspSample)>)| AccuracyRow {
            setting: setting.clone(),
            groups: SceneGroup::ALL.into_iter().filter_map(|group| GroupCost::new(group, samples)).collect(),
        };
        self.settings.iter().zip(samples).map(row).collect()
    }
}

/// Runs something that is parallel inside on as many threads; on rayon's own where none can be started.
fn parallel<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build() {
        Ok(pool) => pool.install(work),
        Err(_none) => work(),
    }
}

/// True for objects whose distances come from a mesh.
fn has_mesh(object: &ObjectModel) -> bool {
    matches!(object.field, DistanceField::Grid(_))
}
