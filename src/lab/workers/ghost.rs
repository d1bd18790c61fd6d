//! Ghost: the grasp computed by the other engine in a thread of its own, for comparison.

use super::latest::Latest;
use super::messages::Wake;
use crate::grasping::prepare;
use palpate_sim::frame::Frame;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{EngineKind, Scene};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;

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

/// Starts ghosts, one at a time: a newer one makes an older one stop.
pub(super) struct GhostMaker {
    wanted: bool,
    newest: Arc<AtomicU64>,
    result: Arc<Latest<GhostGrasp>>,
    wake: Wake,
    thread: Option<JoinHandle<()>>,
}

impl GhostMaker {
    pub(super) fn new(result: Arc<Latest<GhostGrasp>>, wake: Wake) -> Self {
        Self { wanted: false, newest: Arc::new(AtomicU64::new(0)), result, wake, thread: None }
    }

    /// Whether grasps get a ghost from now on.
    pub(super) fn set_wanted(&mut self, wanted: bool) {
        self.wanted = wanted;
    }

    /// Computes the ghost of a grasp, if ghosts are wanted. A failure leaves it without one: nothing else depends on it.
    pub(super) fn begin(&mut self, grasp: u64, scene: &Scene, object: Option<Arc<ObjectModel>>) {
        self.stop();
        if !self.wanted {
            return;
        }
        let mut scene = scene.clone();
        scene.solver.engine = scene.solver.engine.other();
        self.newest.store(grasp, Ordering::Relaxed);
        let (newest, result, wake) = (Arc::clone(&self.newest), Arc::clone(&self.result), Arc::clone(&self.wake));
        let compute = move || {
            let mut run = prepare(&scene, object.as_deref(), 0);
            let mut frames = vec![run.gripper_mut().run_mut().first_look()];
            while newest.load(Ordering::Relaxed) == grasp {
                match run.next_frame() {
                    Some(frame) => frames.push(frame.clone()),
                    None => {
                        result.publish(Arc::new(GhostGrasp { grasp, engine: scene.solver.engine, frames }));
                        return wake();
                    }
                }
            }
        };
        self.thread = match std::thread::Builder::new().name("ghost".to_owned()).spawn(compute) {
            Ok(thread) => Some(thread),
            Err(error) => {
                tracing::warn!("no ghost: {error}");
                None
            }
        };
    }

    fn stop(&mut self) {
        self.newest.store(u64::MAX, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A ghost that broke is a ghost that is not shown.
            let _ended = thread.join();
        }
    }
}

impl Drop for GhostMaker {
    fn drop(&mut self) {
        self.stop();
    }
}
