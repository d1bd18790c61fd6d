//! Trials for the tests of this package.

use palpate_sim::objects::ObjectModel;
use palpate_sim::run::SimRun;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::{SimulatedData, SimulatedTrial, Trial, TrialHeader};

/// Simulates a grasp.
pub(crate) fn grasp(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> SimulatedTrial {
    let (mut run, placement) = SimRun::new(scene, object);
    let frames = run.run_programme(&scene.programme).expect("finite");
    let warnings = placement.warnings;
    let header = TrialHeader { seed, warnings, ..header(object.map_or("empty", |o| &o.name)) };
    let (plan, quality) = (run.plan().clone(), run.quality());
    let data = SimulatedData { world_from_gripper: placement.world_from_gripper, plan, quality, frames };
    Trial { header: TrialHeader { scene: scene.clone(), ..header }, data }
}

/// A simulated trial without frames.
pub(crate) fn without_frames(object: &str) -> SimulatedTrial {
    let (run, placement) = SimRun::new(&Scene::default(), None);
    let (plan, quality, frames) = (run.plan().clone(), run.quality(), Vec::new());
    let data = SimulatedData { world_from_gripper: placement.world_from_gripper, plan, quality, frames };
    Trial { header: header(object), data }
}

/// Header of a trial in the default scene.
pub(crate) fn header(object: &str) -> TrialHeader {
    TrialHeader::new(object, Scene::default())
}
