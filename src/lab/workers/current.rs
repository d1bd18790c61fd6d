//! The grasp that is going on in the simulation's thread.

use crate::grasping::{GraspRun, RefinedRun};
use crate::picture::Stage;
use glam::DVec3;
use palpate_sim::frame::{Frame, Plan};
use palpate_sim::scene::Scene;
use palpate_store::TrialPlace;
use palpate_tactile::Sensors;
use palpate_tactile::trial::EarlierGrasps;
use std::sync::Arc;

/// The grasp that is going on.
pub(super) struct Current {
    pub(super) run: GraspRun,
    /// Refined run for the error band, if one is wanted.
    pub(super) refined_run: Option<RefinedRun>,
    pub(super) plan: Arc<Plan>,
    pub(super) scene: Arc<Scene>,
    pub(super) stage: Arc<Stage>,
    pub(super) reader: Sensors,
    pub(super) frame: Arc<Frame>,
    /// Grasps of the same object before it.
    pub(super) earlier: Option<EarlierGrasps>,
    /// Where its trial is stored at its end, if it is.
    pub(super) recorded: Option<TrialPlace>,
    /// Warnings at its beginning; later ones are reported at its end.
    pub(super) warned: usize,
    /// The user has pulled at the object.
    pub(super) pulled: bool,
    pub(super) ended: bool,
}

impl Current {
    /// Pulls at the object; the trial gets a warning.
    pub(super) fn pull(&mut self, force: DVec3) {
        if force != DVec3::ZERO && !self.pulled {
            self.pulled = true;
            let t = self.frame.t;
            self.run.warn(format!(
                "the object was pulled by hand from {t:.2} s on, so the scene alone cannot reproduce this grasp"
            ));
        }
        if self.pulled {
            self.run.pull_object(force);
        }
        if let Some(refined_run) = &mut self.refined_run {
            refined_run.pull(force);
        }
    }
}
