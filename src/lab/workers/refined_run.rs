//! The companion of a watched grasp: the same grasp computed more finely beside it, for the numerical error band.

use crate::grasping::{ErrorBand, GraspRun, prepare_refined};
use crate::gripper::SimulatedGripper;
use glam::DVec3;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_tactile::Sensors;

/// A finer simulation that goes along, sample by sample.
pub(super) struct RefinedRun {
    run: GraspRun<SimulatedGripper>,
    band: ErrorBand,
}

impl RefinedRun {
    /// A companion at the start of a grasp.
    pub(super) fn new(scene: &Scene, object: Option<&ObjectModel>, seed: u64, channels: usize) -> Self {
        Self { run: prepare_refined(scene, object, seed), band: ErrorBand::new(scene, channels) }
    }

    /// Takes its next sample; estimated errors of what the sensors read at that time (s), none once it has stopped.
    pub(super) fn errors(&mut self, t: f64, values: &[Option<f64>], sensors: &Sensors) -> Box<[f32]> {
        match self.run.next_frame() {
            Some(finer) => self.band.push(t, values, &sensors.read(finer)).into(),
            None => Box::default(),
        }
    }

    /// Is pulled at as the grasp is (N, world axes).
    pub(super) fn pull(&mut self, force: DVec3) {
        self.run.gripper_mut().run_mut().pull_object(force);
    }
}
