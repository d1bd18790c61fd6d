//! What accuracy costs in time, and what it is worth.
//!
//! Every scene is grasped at every setting of a plan: tolerances, fixed steps, integrators, engines, joints and taxels.
//! CPU time is that of the grasp's thread. Errors are those of motion, root mean squares over a grasp against the same
//! scene at a tolerance of 1e-7; for joints and taxels they are those of the model, against many more of them. What is
//! reported is the median over poses and shapes, with quartiles.
//!
//! Beside it, recognition: models trained on grasps of each setting are tested on reference grasps.

mod continuum;
mod figure;
mod measure;
mod plan;
mod recognition;
mod report;
mod stated;
mod tables;

pub use continuum::{Continuum, ContinuumPair, FingerRow, PadRow};
pub use figure::accuracy_plot;
pub use measure::GraspSample;
pub use plan::{AccuracyPlan, AccuracySetting, RecognitionPlan, SettingFamily};
pub use report::{
    AccuracyRow, AccuracyStudy, FAILED_SHARE, GroupCost, MethodScore, RecognitionRow, SceneGroup, Spread,
};
pub use stated::{StatedError, stated_error};

use super::frame::{
    Experiment, LinkedFigure, OWN_PHYSICS, PlainStudy, StoredStudy, StudyCard, StudyCell, StudyCommand, StudyError,
    StudyReport, StudySize,
};
use measure::measure_scene;
use palpate_geometry::DistanceField;
use palpate_lab::grasping::posed_object;
use palpate_sim::objects::{ObjectError, ObjectModel};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::Scene;
use recognition::{LevelAnswers, RecognitionData, scores};
use report::SceneKind;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Result of one unit of work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AccuracyUnit(UnitResult);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum UnitResult {
    Grasps(Vec<GraspSample>),
    Recognition(LevelAnswers),
    Continuum(Continuum),
}

/// A unit of work.
#[derive(Clone, Debug)]
pub enum AccuracyCell {
    /// All settings of one object in one pose.
    Pose {
        object: String,
        /// True where it is fixed.
        fixed: bool,
        /// Seed of the pose.
        seed: u64,
    },
    /// Models of one setting.
    Recognition(AccuracySetting),
    /// Pad and finger beside finite elements.
    Continuum,
}

impl StudyCell for AccuracyCell {
    fn name(&self) -> String {
        match self {
            Self::Pose { object, fixed, seed } => format!("{object} {} {seed}", SceneGroup::of(*fixed).title()),
            Self::Recognition(setting) => format!("recognition, {} {}", setting.family.title(), setting.name),
            Self::Continuum => "pad and finger beside finite elements".to_owned(),
        }
    }
}

/// The study in the list.
pub(crate) const LISTED: PlainStudy<AccuracyExperiment> = PlainStudy {
    card: StudyCard {
        key: "accuracy",
        title: "Cost and worth of accuracy",
        about: "CPU time and error of each setting of the simulation, and what it is worth for recognition",
        paper: OWN_PHYSICS,
    },
    of_size: |size| {
        let plan = match size {
            StudySize::Full => AccuracyPlan::full(),
            StudySize::Quick | StudySize::Sample { .. } => AccuracyPlan::quick(),
        };
        Ok(AccuracyExperiment::new(plan)?)
    },
};

/// The result of the full study that comes with the program, which window and manual show.
pub fn stored_accuracy() -> Option<StoredStudy<AccuracyStudy>> {
    StoredStudy::shipped(LISTED.card.key).ok().flatten()
}

/// The study with its objects.
pub struct AccuracyExperiment {
    plan: AccuracyPlan,
    objects: BTreeMap<String, (ObjectModel, PoseSampler)>,
    /// Test grasps, once the first models are trained.
    bench: Mutex<Option<Arc<RecognitionData>>>,
}

impl AccuracyExperiment {
    /// A study by a plan.
    pub fn new(plan: AccuracyPlan) -> Result<Self, ObjectError> {
        let mut objects = BTreeMap::new();
        for name in &plan.objects {
            objects.extend(posed_object(&Scene::default(), name)?.map(|object| (name.clone(), object)));
        }
        Ok(Self { plan, objects, bench: Mutex::new(None) })
    }

    fn bench(&self, stop: &AtomicBool) -> Result<Arc<RecognitionData>, StudyError> {
        let mut bench = self.bench.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bench) = &*bench {
            return Ok(Arc::clone(bench));
        }
        let made = Arc::new(RecognitionData::new(self.plan.recognition.clone(), stop)?);
        *bench = Some(Arc::clone(&made));
        Ok(made)
    }
}

impl Experiment for AccuracyExperiment {
    type Cell = AccuracyCell;
    type Found = AccuracyUnit;
    type Report = AccuracyStudy;

    fn key(&self) -> &'static str {
        LISTED.card.key
    }

    fn header(&self) -> serde_json::Value {
        serde_json::json!(self.plan)
    }

    fn command(&self) -> StudyCommand {
        let quick = AccuracyPlan { poses: self.plan.poses, ..AccuracyPlan::full() } != self.plan;
        let usual = if quick { AccuracyPlan::quick() } else { AccuracyPlan::full() };
        let poses = (self.plan.poses != usual.poses).then_some(self.plan.poses);
        StudyCommand::new(self.key()).flag("quick", quick).option("poses", poses)
    }

    fn grid(&self) -> Vec<AccuracyCell> {
        let AccuracyPlan { objects, poses, recognition, .. } = &self.plan;
        let trained = recognition.settings.iter().cloned().map(AccuracyCell::Recognition);
        let posed = objects.iter().flat_map(|object| {
            [false, true].into_iter().flat_map(move |fixed| {
                (1..=*poses).map(move |seed| AccuracyCell::Pose { object: object.clone(), fixed, seed })
            })
        });
        trained.chain([AccuracyCell::Continuum]).chain(posed).collect()
    }

    fn measure(&self, cell: &AccuracyCell, stop: &AtomicBool) -> Result<AccuracyUnit, StudyError> {
        let found = match cell {
            AccuracyCell::Pose { object, fixed, seed } => {
                let known = self.objects.get(object);
                let (model, sampler) = known.ok_or_else(|| StudyError::Unknown(format!("object {object}")))?;
                let mut scene = sampler.draw(Some(model), *seed).0;
                scene.set_object_fixed(*fixed);
                let stopped = || stop.load(Ordering::Relaxed);
                UnitResult::Grasps(measure_scene(&scene, model, &self.plan.settings, &stopped)?)
            }
            AccuracyCell::Recognition(setting) => UnitResult::Recognition(self.bench(stop)?.level(setting, stop)?),
            AccuracyCell::Continuum => UnitResult::Continuum(Continuum::measure()?),
        };
        Ok(AccuracyUnit(found))
    }

    fn report(&self, found: Vec<(AccuracyCell, AccuracyUnit)>) -> AccuracyStudy {
        let AccuracyPlan { settings, objects, poses, recognition } = &self.plan;
        let mut samples: Vec<Vec<(SceneKind, GraspSample)>> = vec![Vec::new(); settings.len()];
        let (mut levels, mut continuum) = (Vec::new(), None);
        for (cell, AccuracyUnit(found)) in found {
            match (cell, found) {
                (AccuracyCell::Pose { object, fixed, .. }, UnitResult::Grasps(grasps)) => {
                    let mesh = self.objects.get(&object).is_some_and(|(object, _)| has_mesh(object));
                    let kind = SceneKind { fixed, mesh };
                    samples.iter_mut().zip(grasps).for_each(|(own, grasp)| own.push((kind, grasp)));
                }
                (AccuracyCell::Recognition(setting), UnitResult::Recognition(level)) => levels.push((setting, level)),
                (AccuracyCell::Continuum, UnitResult::Continuum(found)) => continuum = Some(found),
                _ => {}
            }
        }
        let row = |(setting, samples): (&AccuracySetting, &Vec<(SceneKind, GraspSample)>)| AccuracyRow {
            setting: setting.clone(),
            groups: SceneGroup::ALL.into_iter().filter_map(|group| GroupCost::new(group, samples)).collect(),
        };
        let reference = levels.iter().find(|(setting, _)| *setting == recognition.test).map(|(_, level)| level);
        AccuracyStudy {
            objects: objects.clone(),
            poses: *poses,
            rows: settings.iter().zip(&samples).map(row).collect(),
            recognition: reference.map(|reference| scores(&levels, reference)).unwrap_or_default(),
            continuum,
        }
    }

    fn shown(report: &AccuracyStudy) -> StudyReport {
        report.shown()
    }

    fn figures(report: &AccuracyStudy) -> Vec<LinkedFigure> {
        vec![report.figure()]
    }
}

/// True for objects whose distances come from a mesh.
fn has_mesh(object: &ObjectModel) -> bool {
    matches!(object.field, DistanceField::Grid(_))
}
