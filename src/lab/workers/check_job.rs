//! Check of finished grasps while the simulation runs: comparison with a run at a tenth of the tolerance, and computing
//! again until three levels agree.

use super::job::{Job, Newer};
use super::messages::Wake;
use crate::grasping::{EndState, grasp_until_agreement, prepare};
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::SimulatedTrial;
use std::sync::Arc;

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
    /// Compare its end with that of a finer run.
    Compare(Subject),
    /// Compute it again until three levels agree.
    ComputeAgain(Subject),
}

/// Result of a check.
pub(super) enum CheckResult {
    /// Whether a finer run ends in the same state.
    Compared { grasp: u64, agrees: bool },
    /// The grasp computed again.
    ComputedAgain { grasp: u64, trial: Box<SimulatedTrial> },
}

/// The job; a check that is stopped has no result.
pub(super) fn check_job(wake: Wake) -> Job<CheckRequest, CheckResult> {
    Job::new("check", Newer::Replaces, wake, |request: &CheckRequest, run| {
        let cancelled = || run.stopped();
        Ok(match request {
            CheckRequest::Compare(subject) => compare(subject, &cancelled),
            CheckRequest::ComputeAgain(subject) => {
                let trial = grasp_until_agreement(&subject.scene, subject.object.as_deref(), subject.seed, &cancelled);
                trial.map(|trial| CheckResult::ComputedAgain { grasp: subject.grasp, trial: Box::new(trial) })
            }
        })
    })
}

/// Compares a grasp with the next level of accuracy; `None` where there is none, and if it was cancelled.
fn compare(subject: &Subject, cancelled: &dyn Fn() -> bool) -> Option<CheckResult> {
    let solver = subject.scene.solver.finer()?;
    let scene = Scene { solver, ..Scene::clone(&subject.scene) };
    let trial = prepare(&scene, subject.object.as_deref(), subject.seed).to_end(&scene, cancelled)?;
    let alike = subject.end.as_ref().zip(EndState::of(trial.frames())).is_some_and(|(a, b)| a.is_like(&b));
    Some(CheckResult::Compared { grasp: subject.grasp, agrees: alike && trial.data.quality.is_sound() })
}
