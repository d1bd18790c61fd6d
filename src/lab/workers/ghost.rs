//! Ghost: the grasp computed by the other engine, for comparison.

use super::job::{Job, Newer};
use super::messages::Wake;
use crate::grasping::prepare;
use palpate_sim::frame::Frame;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{EngineKind, Scene};
use std::sync::Arc;

/// Grasp to be computed.
pub(super) struct GhostRequest {
    /// Its number, as in [`super::TraceRow::grasp`].
    pub(super) grasp: u64,
    /// The scene, with the engine of the ghost.
    pub(super) scene: Scene,
    pub(super) object: Option<Arc<ObjectModel>>,
}

/// The whole of one grasp as another engine computes it.
#[derive(Debug)]
pub struct GhostGrasp {
    /// The grasp it belongs to, as in [`super::TraceRow::grasp`].
    pub grasp: u64,
    /// What computed it.
    pub engine: EngineKind,
    /// Its samples, the state before the first step included.
    pub frames: Vec<Frame>,
}

impl GhostGrasp {
    /// The sample at a time (s), or the last one before.
    pub fn at(&self, t: f64) -> Option<&Frame> {
        let after = self.frames.partition_point(|frame| frame.t <= t + 1e-9);
        after.checked_sub(1).and_then(|k| self.frames.get(k))
    }
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
