//! Background fit of the simulated finger for the window: a thread "fit" that lists the recorded trials of the real
//! gripper and fits the finger to some of them.

use super::background_job::{BackgroundJob, Outlet};
use super::messages::Wake;
use crate::study::{FingerFit, FingerFitError, FitWatch, RecordedGraspError, RecordedGrasps, fit_finger_watched};
use palpate_sim::scene::Scene;
use palpate_store::{Store, StoreError, TrialRow};
use palpate_tactile::trial::{TrialId, TrialSource};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Command to the fitting thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FitCommand {
    /// List the trials.
    List,
    /// Fit the finger to these trials.
    Fit(Vec<TrialId>),
}

/// Result of a fit.
#[derive(Clone, Debug)]
pub struct FittedFinger {
    /// Trials used for the fit.
    pub trials: Vec<TrialId>,
    /// Estimates of the fit.
    pub fit: FingerFit,
    /// Scene of the first trial, with the fitted gripper.
    pub scene: Scene,
    /// Warnings about the trials, as sentences.
    pub warnings: Vec<String>,
}

/// Error of a fit to stored trials.
#[derive(Debug, thiserror::Error)]
pub enum FitTrialsError {
    /// A trial could not be read.
    #[error(transparent)]
    Trial(#[from] RecordedGraspError),
    /// The fit failed.
    #[error(transparent)]
    Fit(#[from] FingerFitError),
}

/// Function that fits the finger to trials of a store, such as [`fit_trials`].
pub type FitTrials =
    Arc<dyn Fn(&Path, &[TrialId], &FitWatch<'_>) -> Result<FittedFinger, FitTrialsError> + Send + Sync>;

/// Reads trials with the newest calibrations of their parts and fits the finger to them.
pub fn fit_trials(store: &Path, trials: &[TrialId], watch: &FitWatch<'_>) -> Result<FittedFinger, FitTrialsError> {
    let store = Store::open(store).map_err(RecordedGraspError::Store)?;
    let mut recorded = RecordedGrasps::default();
    for id in trials {
        recorded.add(&store, *id, None, &[])?;
    }
    let RecordedGrasps { observations, trust, warnings } = recorded;
    let fit = fit_finger_watched(&observations, &trust, watch)?;
    let first = observations.first().map(|seen| seen.scene.clone()).unwrap_or_default();
    let scene = Scene { gripper: fit.gripper.clone(), ..first };
    Ok(FittedFinger { trials: trials.to_vec(), fit, scene, warnings })
}

/// State of the fitting thread.
#[derive(Clone, Debug, Default)]
pub struct FitterView {
    /// Complete trials of the real gripper, newest first, or why they cannot be listed; `None` before the first
    /// listing.
    pub trials: Option<Result<Arc<[TrialRow]>, Arc<StoreError>>>,
    /// Steps done of the fit in progress; `None` without one.
    pub running: Option<f64>,
    /// Result of the last fit that was not cancelled.
    pub ended: Option<Result<Arc<FittedFinger>, Arc<FitTrialsError>>>,
}

/// Handle of the fitting thread.
pub type Fitter = BackgroundJob<FitCommand, FitterView>;

impl Fitter {
    /// Starts the thread; trials come from the store at `store`.
    pub fn start(store: PathBuf, fit: FitTrials, wake: Wake) -> std::io::Result<Self> {
        let mut view = FitterView::default();
        Self::spawn("fit", wake, move |command, stop, outlet| {
            match command {
                FitCommand::List => view.trials = Some(listed(&store).map_err(Arc::new)),
                FitCommand::Fit(trials) => {
                    let ended = fitted(&fit, &store, &trials, stop, outlet, &view);
                    if !stop.load(Ordering::Relaxed) {
                        view.ended = Some(ended.map(Arc::new).map_err(Arc::new));
                    }
                }
            }
            outlet.publish(view.clone());
        })
    }
}

fn fitted(
    fit: &FitTrials,
    store: &Path,
    trials: &[TrialId],
    stop: &AtomicBool,
    outlet: &Outlet<FitterView>,
    view: &FitterView,
) -> Result<FittedFinger, FitTrialsError> {
    let report = |steps: f64| outlet.publish(FitterView { running: Some(steps), ..view.clone() });
    report(0.0);
    fit(store, trials, &FitWatch { progress: &report, stop })
}

fn listed(store: &Path) -> Result<Arc<[TrialRow]>, StoreError> {
    let mut rows = Store::open(store)?.list(false)?;
    rows.retain(|row| row.source == TrialSource::Recorded && row.state == "complete");
    rows.reverse();
    Ok(rows.into())
}

#[cfg(test)]
mod tests {
    use super::super::background_job::watch::{until, waker};
    use super::*;
    use crate::grasping::grasp;
    use palpate_store::BoardInfo;
    use palpate_tactile::trial::TrialHeader;

    /// Scene in which an empty hand closes quickly.
    fn close() -> Scene {
        let mut scene = Scene::default();
        palpate_sim::objects::EMPTY.clone_into(&mut scene.object.source);
        scene.programme.peak_bar = 0.5;
        scene.programme.close_bar_per_tick = 0.25;
        scene.programme.release_bar_per_tick = 0.5;
        scene.programme.hold_ticks = 5;
        (scene.timing.duration_s, scene.timing.sample_hz) = (1.2, 50);
        scene
    }

    #[test]
    fn trials_are_listed_fitted_and_given_up() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("trials.sqlite");
        let mut store = Store::open(&path)?;
        let simulated = store.insert(&grasp(&close(), None, 0))?.id();
        for object in ["lemon", "empty", "ball"] {
            let id = store.begin_board(&TrialHeader::new(object, close()), &BoardInfo::default())?;
            if object != "ball" {
                store.finish_board(id, &BoardInfo::default(), &[])?;
            }
        }
        let (wake, woken) = waker();
        let mut job = Fitter::start(path, Arc::new(fit_trials), wake)?;
        job.ask(FitCommand::List);
        let view = until(&job, &woken, |view| view.trials.is_some());
        let rows = view.trials.clone().ok_or("looked for")??;
        let listed: Vec<&str> = rows.iter().map(|row| row.object.as_str()).collect();
        assert_eq!(listed, ["empty", "lemon"], "whole trials of the board, newest first");

        // The finger of this trial is known, so the fit can be checked.
        job.ask(FitCommand::Fit(vec![simulated]));
        until(&job, &woken, |view| view.running.is_some_and(|steps| steps > 1.0));
        let view = until(&job, &woken, |view| view.running.is_none() && view.ended.is_some());
        let fitted = view.ended.clone().ok_or("it has ended")??;
        let truth = close().gripper.finger.bending_stiffness;
        let found = fitted.scene.gripper.finger.bending_stiffness;
        assert!((found / truth - 1.0).abs() < 0.03 && found != truth, "{found} instead of {truth}");
        assert_eq!(fitted.scene.object, close().object);

        job.ask(FitCommand::Fit(vec![simulated]));
        until(&job, &woken, |view| view.running.is_some_and(|steps| steps > 0.0));
        job.give_up();
        let view = until(&job, &woken, |view| view.running.is_none());
        assert!(matches!(&view.ended, Some(Ok(kept)) if Arc::ptr_eq(kept, &fitted)), "what was there stays");
        job.ask(FitCommand::Fit(vec![77]));
        let view = until(&job, &woken, |view| matches!(view.ended, Some(Err(_))));
        assert!(matches!(&view.ended, Some(Err(cause)) if cause.to_string().contains("77")), "{:?}", view.ended);
        Ok(())
    }
}
