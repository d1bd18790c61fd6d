//! Fit of the simulated finger to recorded trials, in the background.

use crate::{FingerFit, FitWatch, MOST_STEPS, RecordedGrasps, fit_finger_watched};
use palpate_lab::workers::{Job, JobError, Newer, Wake};
use palpate_sim::scene::Scene;
use palpate_store::{Store, TrialRow};
use palpate_tactile::trial::{TrialId, TrialSource};
use std::path::{Path, PathBuf};
use std::sync::Arc;

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

/// Function that fits the finger to trials of a store, such as [`fit_trials`].
pub type FitTrials = Arc<dyn Fn(&Path, &[TrialId], &FitWatch<'_>) -> Result<FittedFinger, JobError> + Send + Sync>;

/// Reads trials with the newest calibrations of their parts and fits the finger to them.
pub fn fit_trials(store: &Path, trials: &[TrialId], watch: &FitWatch<'_>) -> Result<FittedFinger, JobError> {
    let store = Store::open(store)?;
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

/// The job that fits the finger to trials of a store.
pub fn fit_job(store: PathBuf, fit: FitTrials, wake: Wake) -> Job<Vec<TrialId>, FittedFinger> {
    Job::new("fit", Newer::Replaces, wake, move |trials: &Vec<TrialId>, run| {
        let progress = |steps: f64| {
            let words = format!("step {:.0} of at most {MOST_STEPS}", steps.floor() + 1.0);
            run.progress(steps / f64::from(MOST_STEPS), words);
        };
        progress(0.0);
        let fitted = fit(&store, trials, &FitWatch { progress: &progress, stop: run.stop() })?;
        Ok(run.unless_stopped(fitted))
    })
}

/// The job that lists the complete trials of the real gripper, newest first.
pub fn recorded_trials_job(store: PathBuf, wake: Wake) -> Job<(), Vec<TrialRow>> {
    Job::new("fit-trials", Newer::Replaces, wake, move |(), _run| {
        let mut rows = Store::open(&store)?.list(false)?;
        rows.retain(|row| row.source == TrialSource::Recorded && row.state == "complete");
        rows.reverse();
        Ok(Some(rows))
    })
}

#[cfg(test)]
mod tests {
    use super::super::watch::{settled, until, waker};
    use super::*;
    use palpate_lab::grasping::grasp;
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
        let trials = recorded_trials_job(path.clone(), Arc::clone(&wake));
        trials.start(());
        let rows = settled(&trials, &woken).ok_or("listed")?.map_err(|cause| cause.to_string())?;
        let listed: Vec<&str> = rows.iter().map(|row| row.object.as_str()).collect();
        assert_eq!(listed, ["empty", "lemon"], "whole trials of the board, newest first");

        // The finger of this trial is known, so the fit can be checked.
        let job = fit_job(path, Arc::new(fit_trials), wake);
        job.start(vec![simulated]);
        until(&woken, || job.running().filter(|running| running.progress.share > 0.04));
        let fitted = settled(&job, &woken).ok_or("ended")?.map_err(|cause| cause.to_string())?;
        let truth = close().gripper.finger.bending_stiffness;
        let found = fitted.scene.gripper.finger.bending_stiffness;
        assert!((found / truth - 1.0).abs() < 0.03 && found != truth, "{found} instead of {truth}");
        assert_eq!(fitted.scene.object, close().object);

        job.start(vec![simulated]);
        until(&woken, || job.running().filter(|running| running.progress.share > 0.0));
        job.stop();
        let kept = settled(&job, &woken).ok_or("ended")?;
        assert!(kept.is_ok_and(|kept| Arc::ptr_eq(&kept, &fitted)), "what was there stays");
        job.start(vec![77]);
        let cause = settled(&job, &woken).ok_or("ended")?.expect_err("no such trial");
        assert!(cause.to_string().contains("77"), "{cause}");
        Ok(())
    }
}
