//! The simulation's thread, watched as a window watches it.

use super::{Command, Notice, Refusal, SimWorker, SimWorkerSetup, Snapshot, TraceRow, Wake};
use crate::datasets::SensorView;
use crate::grasping::grasp;
use glam::DVec3;
use palpate_learn::{Model, Models};
use palpate_sim::frame::TrustLevel;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::{Accuracy, Scene};
use palpate_store::{Store, TrialPlace};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

pub(super) struct Watched {
    pub(super) worker: SimWorker,
    woken: Receiver<()>,
}

fn start(scene: Scene, store: PathBuf, grasps: u32) -> Watched {
    start_with(None, scene, store, grasps)
}

pub(super) fn start_with(model: Option<Model>, scene: Scene, store: PathBuf, grasps: u32) -> Watched {
    let (wake, woken) = channel();
    let wake: Wake = Arc::new(move || {
        // The test may have stopped listening.
        let _heard = wake.send(());
    });
    let sensors = SensorView { layout: "C1".to_owned(), ..SensorView::default() };
    let models = model.map(Arc::new).map_or_else(Models::default, |model| Models::all(&model));
    let setup = SimWorkerSetup {
        scene,
        sensors,
        store,
        recording: Some(TrialPlace::Store),
        grasps,
        models,
        playing: true,
        wake,
    };
    Watched { worker: SimWorker::start(setup).expect("starts"), woken }
}

impl Watched {
    pub(super) fn send(&self, command: Command) {
        self.worker.send(command);
    }

    /// Waits for a scene to be refused.
    fn refusal(&self) -> Refusal {
        loop {
            let refused = self.worker.notices().find_map(|notice| match notice {
                Notice::SceneRefused(refusal) => Some(*refusal),
                _ => None,
            });
            if let Some(refusal) = refused {
                return refusal;
            }
            self.woken.recv_timeout(Duration::from_secs(600)).expect("the worker is alive");
        }
    }

    /// Waits, as long as it keeps waking us, until the snapshot is as wanted.
    pub(super) fn until(&self, wanted: impl Fn(&Snapshot) -> bool) -> Arc<Snapshot> {
        loop {
            if let Some(snapshot) = self.worker.snapshot().filter(|s| wanted(s)) {
                return snapshot;
            }
            self.woken.recv_timeout(Duration::from_secs(600)).expect("the worker is alive");
        }
    }
}

pub(super) fn ball() -> Scene {
    let mut scene = Scene::default();
    "ball".clone_into(&mut scene.object.source);
    scene.timing.duration_s = 1.6;
    scene
}

#[test]
fn a_watched_grasp_is_the_same_as_a_headless_one_and_is_stored() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("trials.sqlite");
    let watched = start(ball(), path.clone(), 2);
    watched.send(Command::SetSpeed(64.0));
    watched.until(|s| s.status.finished);
    let rows: Vec<TraceRow> = watched.worker.rows().collect();
    assert_eq!(rows.len(), 240, "two grasps of 120 samples, none lost");
    assert!(rows.windows(2).all(|w| (w[0].grasp, w[0].sample.t_s) < (w[1].grasp, w[1].sample.t_s)), "in order");
    assert!(!watched.worker.take_rows_lost());
    drop(watched);
    let store = Store::open(&path).expect("opens");
    assert_eq!(store.list(false).expect("lists").len(), 2);
    let object = ball().load_object().expect("loads");
    let mut headless = grasp(&ball(), object.as_ref(), 0);
    let stored = store.load(1).expect("whole");
    // It may have been compared with another run before the next grasp ended.
    headless.data.quality.agrees = stored.simulated().expect("simulated").quality.agrees;
    assert!(stored == headless.into());
}

#[test]
fn a_finished_grasp_is_compared_and_computed_again_on_request() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("trials.sqlite");
    let mut scene = ball();
    scene.solver.accuracy = Accuracy::Draft;
    let watched = start(scene.clone(), path.clone(), 1);
    watched.send(Command::SetSpeed(64.0));
    let trust = |s: &Snapshot| s.last.as_ref().map(|last| last.summary.quality.trust().0);
    let compared = watched.until(|s| trust(s) == Some(TrustLevel::Green));
    let last = compared.last.as_ref().expect("finished");
    assert!(last.repeatable && last.accuracy == Accuracy::Draft);
    let first: Vec<TraceRow> = watched.worker.rows().collect();
    watched.send(Command::ComputeAgain);
    let again = watched.until(|s| s.last.as_ref().is_some_and(|last| last.accuracy != Accuracy::Draft));
    let last = again.last.as_ref().expect("finished");
    let quality = &last.summary.quality;
    assert_eq!((last.accuracy, quality.agrees, last.grasp), (Accuracy::Tolerance(1e-5), Some(true), 1));
    assert!(quality.recomputed.is_some_and(|recomputed| recomputed.asked == Accuracy::Draft));
    assert!(again.status.checking.is_none() && !again.status.playing);
    let rows: Vec<TraceRow> = watched.worker.rows().collect();
    assert_eq!((first.len(), rows.len()), (120, 120));
    assert!(rows.iter().zip(&first).all(|(a, b)| (a.grasp, a.sample.t_s) == (b.grasp, b.sample.t_s)) && rows != first);
    drop(watched);
    let mut store = Store::open(&path).expect("opens");
    assert_eq!((store.list(false).expect("lists").len(), store.list(true).expect("lists").len()), (1, 2));
    store.restore(&[1]).expect("restores");
    let compared = store.load(1).expect("whole");
    assert_eq!(compared.simulated().expect("simulated").quality.agrees, Some(true), "the trial in the store knows too");
    store.delete(&[1]).expect("deletes");
    let object = ball().load_object().expect("loads");
    let stored = crate::grasping::grasp_until_agreement(&scene, object.as_ref(), 0, &|| false).expect("not cancelled");
    assert!(store.load(2).expect("whole") == stored.into());
}

#[test]
fn stepping_pausing_and_resetting() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("trials.sqlite");
    let watched = start(ball(), path.clone(), 1);
    watched.send(Command::Pause);
    let paused = watched.until(|s| !s.status.playing);
    watched.send(Command::Step);
    let stepped = watched.until(|s| s.frame.t > paused.frame.t);
    assert!((stepped.frame.t - paused.frame.t - 1.0 / 75.0).abs() < 1e-9);
    watched.send(Command::Reset);
    let reset = watched.until(|s| s.grasp > stepped.grasp);
    assert_eq!(reset.frame.t, 0.0);
    drop(watched);
    let store = Store::open(&path).expect("opens");
    assert!(store.list(false).expect("lists").is_empty(), "unfinished trials are discarded");
}

#[test]
fn a_scene_that_cannot_be_loaded_leaves_the_old_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("trials.sqlite");
    let watched = start(ball(), path.clone(), 2);
    watched.until(|s| s.object.is_some() && s.frame.t > 0.05);
    let mut missing = ball();
    "/nowhere/at/all.urdf".clone_into(&mut missing.object.source);
    watched.send(Command::SetScene(Box::new(missing.clone())));
    let refusal = watched.refusal();
    assert!(refusal.cause.contains("/nowhere/at/all.urdf"));
    assert!(refusal.refused == missing && refusal.kept == ball());
    // The grasp that was going on goes on, is stored, and the next one follows.
    watched.send(Command::SetSpeed(64.0));
    let last = watched.until(|s| s.status.finished);
    assert!(last.grasp == 2 && last.object.as_ref().is_some_and(|o| o.name == "ball"));
    watched.send(Command::Reset);
    watched.until(|s| s.grasp == 3);
    drop(watched);
    let rows = Store::open(&path).expect("opens").list(false).expect("lists");
    assert_eq!(rows.iter().map(|row| (row.object.as_str(), row.seed)).collect::<Vec<_>>(), [("ball", 0), ("ball", 1)]);
}

#[test]
fn a_first_scene_that_cannot_be_loaded_leaves_an_empty_hand() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut missing = ball();
    "/nowhere/at/all.urdf".clone_into(&mut missing.object.source);
    let watched = start(missing, folder.path().join("trials.sqlite"), 1);
    assert_eq!(watched.refusal().kept.object.source, EMPTY);
    assert!(watched.until(|s| s.frame.t > 0.0).object.is_none());
    watched.send(Command::SetScene(Box::new(ball())));
    watched.until(|s| s.object.is_some() && s.frame.t > 0.0);
}

#[test]
fn more_grasps_come_from_new_poses_and_pulled_ones_say_so() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("trials.sqlite");
    let watched = start(ball(), path.clone(), 2);
    watched.send(Command::SetSpeed(64.0));
    watched.until(|s| s.status.finished);
    // Slow enough for a busy machine to pull before the grasp is over.
    watched.send(Command::SetSpeed(1.0));
    watched.send(Command::Play);
    watched.until(|s| s.grasp == 3);
    watched.send(Command::Pull(DVec3::new(0.0, 0.3, 0.0)));
    watched.send(Command::SetSpeed(64.0));
    watched.until(|s| s.status.finished && s.grasp == 4);
    drop(watched);
    let store = Store::open(&path).expect("opens");
    let rows = store.list(false).expect("lists");
    assert_eq!(rows.iter().map(|row| row.seed).collect::<Vec<_>>(), [0, 1, 2, 3]);
    let warnings: Vec<Vec<String>> = (1..=4).map(|id| store.load(id).expect("whole").header.warnings).collect();
    let pulled = |k: usize| warnings[k].iter().any(|w: &String| w.contains("pulled by hand"));
    assert!(!pulled(0) && !pulled(1) && pulled(2) && !pulled(3), "{warnings:?}");
}

#[test]
fn scenes_that_are_passed_over_leave_nothing_in_the_store() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("trials.sqlite");
    let watched = start(ball(), path.clone(), 1);
    for k in 0..20 {
        let mut scene = ball();
        scene.gripper.mount.yaw_deg = f64::from(k);
        watched.send(Command::SetScene(Box::new(scene)));
        watched.until(|s| s.scene.gripper.mount.yaw_deg == f64::from(k));
    }
    drop(watched);
    assert!(Store::open(&path).expect("opens").list(true).expect("lists").is_empty());
}

#[test]
fn a_companion_brings_errors_and_the_gauge_both_numbers() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("trials.sqlite");
    let watched = start(ball(), path.clone(), 1);
    watched.send(Command::SetErrorBand(true));
    watched.send(Command::SetSpeed(64.0));
    watched.until(|s| s.status.error_band && s.status.finished);
    let rows: Vec<TraceRow> = watched.worker.rows().collect();
    let banded: Vec<&TraceRow> = rows.iter().filter(|row| row.grasp == rows[rows.len() - 1].grasp).collect();
    assert_eq!(banded.len(), 120);
    assert!(banded.iter().all(|row| row.errors.len() == row.sample.values.len()));
    let largest = banded.iter().map(|row| row.errors[0]).fold(0.0, f32::max);
    assert!(largest > 1e-3 && largest < 1.0, "{largest} 1/m");
    let before = loop {
        match watched.worker.accuracy() {
            Some(measured) => break measured,
            None => watched.woken.recv_timeout(Duration::from_secs(600)).expect("the accuracy job runs"),
        }
    };
    assert_eq!(before.scene, ball());
    let mut finer = ball();
    finer.solver.accuracy = Accuracy::Tolerance(1e-5);
    watched.send(Command::SetScene(Box::new(finer.clone())));
    let after = loop {
        match watched.worker.accuracy().filter(|measured| measured.scene == finer) {
            Some(measured) => break measured,
            None => watched.woken.recv_timeout(Duration::from_secs(600)).expect("the accuracy job runs"),
        }
    };
    assert!(after.cost.error.curvature_per_m < 0.5 * before.cost.error.curvature_per_m);
    assert!(after.cost.cpu_ms > 0.0 && after.cost.times_real_time > 0.0);
    drop(watched);
    let store = Store::open(&path).expect("opens");
    let object = ball().load_object().expect("loads");
    assert!(store.load(1).expect("whole") == grasp(&ball(), object.as_ref(), 0).into(), "the trial is the same");
}
