//! Cost and error of one scene at every setting.

use super::plan::{AccuracySetting, SettingFamily};
use crate::frame::StudyError;
use palpate_lab::grasping::{ErrorNorms, timed_grasp, truth_of};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{Accuracy, Scene, SceneError};
use palpate_tactile::trial::SimulatedTrial;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// One grasp at one setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GraspSample {
    /// CPU time (ms).
    pub cpu_ms: f64,
    /// Error against the truth.
    pub error: ErrorNorms,
    /// True if the trial reports no fault: numbers finite, steps converged, the hold at rest.
    pub sound: bool,
    /// Distance of the object from where it truly is at the end of the hold (m).
    pub astray_m: f64,
}

impl GraspSample {
    /// True where the grasp cannot be used: it reports a fault, or ends with the object elsewhere.
    pub fn failed(&self) -> bool {
        !self.sound || self.astray_m > ASTRAY_M || !self.error.curvature_per_m.is_finite()
    }
}

/// Distance from which on an object is somewhere else (m): more than pads give way.
const ASTRAY_M: f64 = 5e-3;

/// Tolerance of truths with a finer model, whose errors of motion count little beside those of the model.
const FINER_MODEL: Accuracy = Accuracy::Tolerance(1e-5);

/// Grasps a scene at every setting, and compares each with its truth.
pub(super) fn measure_scene(
    scene: &Scene,
    object: &ObjectModel,
    settings: &[AccuracySetting],
    stopped: &dyn Fn() -> bool,
) -> Result<Vec<GraspSample>, StudyError> {
    let grasped = |scene: &Scene| timed_grasp(scene, Some(object), stopped).ok_or(StudyError::Stopped);
    let mut truths: BTreeMap<&[&str], SimulatedTrial> = BTreeMap::new();
    let mut samples = Vec::new();
    for setting in settings {
        let truth = match truths.entry(setting.family.finer_model()) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(missing) => missing.insert(grasped(&truth_for(scene, setting.family)?)?.0),
        };
        let (trial, cpu_s) = grasped(&setting.adopted(scene)?)?;
        samples.push(GraspSample {
            cpu_ms: cpu_s * 1e3,
            error: ErrorNorms::of_whole_fingers(&trial, truth),
            sound: trial.data.quality.is_sound(),
            astray_m: astray(&trial, truth),
        });
    }
    Ok(samples)
}

fn truth_for(scene: &Scene, family: SettingFamily) -> Result<Scene, SceneError> {
    let truth = truth_of(scene);
    if family.is_of_motion() {
        return Ok(truth);
    }
    let set: Vec<String> = family.finer_model().iter().map(|set| (*set).to_owned()).collect();
    let mut finer = truth.with_settings(&set)?;
    finer.solver.accuracy = FINER_MODEL;
    Ok(finer)
}

/// Distance between the objects of two trials at the end of the hold (m); infinite where one has no such sample.
fn astray(trial: &SimulatedTrial, truth: &SimulatedTrial) -> f64 {
    let held = |trial: &SimulatedTrial| trial.frames().iter().rposition(|frame| frame.phase == Phase::Hold);
    let Some(sample) = held(truth) else { return 0.0 };
    let at = |trial: &SimulatedTrial| trial.frames().get(sample).map(|frame| frame.world_from_object);
    match (at(trial), at(truth)) {
        (Some(Some(here)), Some(Some(there))) => (here.position - there.position).length(),
        (Some(None), Some(None)) => 0.0,
        _ => f64::INFINITY,
    }
}
