//! Ghost: the grasp computed by the other engine, for comparison.

use super::job::{Job, Newer};
use super::messages::{GhostGrasp, Wake};
use crate::grasping::prepare;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use std::sync::Arc;

/// Grasp to be computed.
pub(super) struct GhostRequest {
    /// Its number, as in [`super::TraceRow::grasp`].
    pub(super) grasp: u64,
    /// The scene, with the engine of the ghost.
    pub(super) scene: Scene,
    pub(super) object: Option<Arc<ObjectModel>>,
}

/// The job; without a ghost nothing else changes.
pub(super) fn ghost_job(wake: Wake) -> Job<GhostRequest, GhostGrasp> {
    Job::new("ghost", Newer::Replaces, wake, |GhostRequest { grasp, scene, object }, run| {
        let mut ghost = prepare(scene, object.as_deref(), 0);
        let mut frames = vec![ghost.gripper_mut().run_mut().first_look()];
        while !run.stopped() {
            match ghost.next_frame() {
                Some(frame) => frames.push(frame.clone()),
                None => return Ok(Some(GhostGrasp { grasp: *grasp, engine: scene.solver.engine, frames })),
            }
        }
        Ok(None)
    })
}
