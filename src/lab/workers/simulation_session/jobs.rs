//! Jobs of the simulation thread: the grasp by the other engine, the check of a finished grasp by other runs, and the cost
//! and error of a scene's accuracy.

use super::super::job::{Job, Newer};
use super::super::messages::{GhostGrasp, MeasuredAccuracy, Wake};
use crate::grasping::{EndState, GraspComparison, accuracy_cost, compare, grasp_until_agreement, prepare};
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::SimulatedTrial;
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
        let mut frames = vec![ghost.simulation_mut().first_look()];
        while !run.stopped() {
            match ghost.next_frame() {
                Some(frame) => frames.push(frame.clone()),
                None => return Ok(Some(GhostGrasp { grasp: *grasp, engine: scene.solver.engine, frames })),
            }
        }
        Ok(None)
    })
}

/// A finished grasp that can be computed again.
#[derive(Clone)]
pub(super) struct Subject {
    /// Its number, as in [`super::TraceRow::grasp`].
    pub(super) grasp: u64,
    pub(super) scene: Arc<Scene>,
    pub(super) object: Option<Arc<ObjectModel>>,
    pub(super) seed: u64,
    /// Where it ended.
    pub(super) end: Option<EndState>,
    /// The trial is in the store.
    pub(super) recorded: bool,
}

/// What is to be done with a grasp.
pub(super) enum CheckRequest {
    /// Compare its end with that of other runs.
    Compare(Subject),
    /// Compute it again until three levels agree.
    ComputeAgain(Subject),
}

/// Result of a check.
pub(super) enum CheckResult {
    /// What other runs of it say.
    Compared { grasp: u64, found: GraspComparison },
    /// The grasp computed again.
    ComputedAgain { grasp: u64, trial: Box<SimulatedTrial> },
}

/// The job; a check that is stopped has no result.
pub(super) fn check_job(wake: Wake) -> Job<CheckRequest, CheckResult> {
    Job::new("check", Newer::Replaces, wake, |request: &CheckRequest, run| {
        let cancelled = || run.stopped();
        Ok(match request {
            CheckRequest::Compare(Subject { grasp, scene, object, seed, end, .. }) => {
                let found = compare(scene, object.as_deref(), *seed, end.as_ref(), &cancelled);
                found.map(|found| CheckResult::Compared { grasp: *grasp, found })
            }
            CheckRequest::ComputeAgain(subject) => {
                let trial = grasp_until_agreement(&subject.scene, subject.object.as_deref(), subject.seed, &cancelled);
                trial.map(|trial| CheckResult::ComputedAgain { grasp: subject.grasp, trial: Box::new(trial) })
            }
        })
    })
}

/// A scene to measure, and its object.
pub(super) type AccuracyRequest = (Scene, Option<Arc<ObjectModel>>);

/// Measures the accuracy of scenes by whole grasps of its own, so that the numbers stand there long before the watched grasp is
/// over; another scene makes it start over.
pub(super) fn accuracy_job(wake: Wake) -> Job<AccuracyRequest, MeasuredAccuracy> {
    Job::new("accuracy", Newer::Replaces, wake, |(scene, object): &AccuracyRequest, run| {
        let cost = accuracy_cost(scene, object.as_deref(), &|| run.stopped());
        Ok(cost.and_then(|cost| run.unless_stopped(MeasuredAccuracy { scene: scene.clone(), cost })))
    })
}
