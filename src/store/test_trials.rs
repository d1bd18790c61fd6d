//! Trials for the tests of this package.

use palpate_geometry::Pose;
use palpate_sim::frame::{Plan, Quality};
use palpate_sim::objects::ObjectModel;
use palpate_sim::run::SimRun;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::{Trial, TrialInfo};

/// Simulates a grasp.
pub(crate) fn grasp(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> Trial {
    let (mut run, placement) = SimRun::new(scene, object);
    let frames = run.run_programme(&scene.programme).expect("finite");
    let info = TrialInfo {
        rig: "sim".to_owned(),
        object: object.map_or("empty", |o| &o.name).to_owned(),
        seed,
        collection: None,
        scene: scene.to_toml(),
        world_from_gripper: placement.world_from_gripper,
        plan: run.plan().clone(),
        quality: run.quality(),
        warnings: placement.warnings,
        version: env!("CARGO_PKG_VERSION").to_owned(),
    };
    Trial { info, frames }
}

/// Description of a trial of the real gripper.
pub(crate) fn board_info(object: &str) -> TrialInfo {
    TrialInfo { rig: crate::BOARD_RIG.to_owned(), object: object.to_owned(), ..info("sim") }
}

/// Description of a trial without scene and frames.
pub(crate) fn info(object: &str) -> TrialInfo {
    TrialInfo {
        rig: "sim".to_owned(),
        object: object.to_owned(),
        seed: 0,
        collection: None,
        scene: String::new(),
        world_from_gripper: Pose::IDENTITY,
        plan: Plan::default(),
        quality: Quality::default(),
        warnings: Vec::new(),
        version: "0".to_owned(),
    }
}
