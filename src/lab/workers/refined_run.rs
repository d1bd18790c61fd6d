//! Refined run of a watched grasp: the same grasp with finer steps, in parallel, for the numerical error band.

use crate::grasping::{ErrorBand, GraspRun, prepare_refined};
use glam::DVec3;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_tactile::Sensors;

/// Simulation with finer steps that advances sample by sample with the watched grasp.
pub(super) struct RefinedRun {
    run: GraspRun,
    band: ErrorBand,
}

impl RefinedRun {
    /// Creates the refined run of a grasp that starts.
    pub(super) fn new(scene: &Scene, object: Option<&ObjectModel>, seed: u64, channels: usize) -> Self {
        Self { run: prepare_refined(scene, object, seed), band: ErrorBand::new(scene, channels) }
    }

    /// Advances by one sample and returns the estimated errors of the sensor values at that time (s); empty at its end.
    pub(super) fn errors(&mut self, t: f64, values: &[Option<f64>], sensors: &Sensors) -> Box<[f32]> {
        match self.run.next_frame() {
            Some(finer) => self.band.push(t, values, &sensors.read(finer)).into(),
            None => Box::default(),
        }
    }

    /// Applies the same pull to the object as in the watched grasp (N, world axes).
    pub(super) fn pull(&mut self, force: DVec3) {
        self.run.gripper_mut().run_mut().pull_object(force);
    }
}
