//! Trials that cannot be trusted: marked, explained, and kept out of data sets, all the way from the solver to the files
//! that others learn from.

use crate::program::{json, refused, run};
use glam::DVec3;
use palpate_lab::datasets::{DatasetError, DatasetQuery, SensorView};
use palpate_lab::grasping::{grasp, prepare};
use palpate_sim::frame::Quality;
use palpate_sim::scene::Scene;
use palpate_store::Store;
use palpate_tactile::trial::SimulatedTrial;
use std::path::Path;

fn scene() -> Scene {
    let mut scene = Scene::default();
    "ball".clone_into(&mut scene.object.source);
    scene
}

/// One Newton iteration is not enough for a touch.
fn not_converged() -> SimulatedTrial {
    let mut scene = scene();
    scene.solver.max_iterations = 1;
    grasp(&scene, scene.load_object().unwrap().as_ref(), 2)
}

/// A pull that is no number, after a second.
fn not_finite() -> SimulatedTrial {
    let scene = scene();
    let mut run = prepare(&scene, scene.load_object().unwrap().as_ref(), 3);
    while run.next_frame().is_some() {
        if run.frames().len() == 75 {
            run.simulation_mut().pull_object(DVec3::new(0.0, f64::NAN, 0.0));
        }
    }
    run.finish(&scene)
}

fn sound() -> SimulatedTrial {
    let scene = scene();
    grasp(&scene, scene.load_object().unwrap().as_ref(), 1)
}

/// A store with a sound trial and two that are not.
fn filled(folder: &Path) -> Store {
    let mut store = Store::open(&folder.join("trials.sqlite")).unwrap();
    for trial in [sound(), not_converged(), not_finite()] {
        store.insert(&trial).unwrap();
    }
    store
}

#[test]
fn a_trial_that_misses_its_tolerance_says_where_and_when() {
    let trial = not_converged();
    let quality = &trial.data.quality;
    let imbalance = quality.imbalance.clone().unwrap();
    assert!(quality.finite && !quality.converged && quality.unconverged_steps > 0, "{quality:?}");
    assert!(imbalance.worst_excess > 1.0, "{imbalance:?}");
    assert!((imbalance.first_tick as f64 / 300.0 - imbalance.first_s).abs() < 1e-9, "{imbalance:?}");
    let found = trial.header.warnings.iter().find(|w| w.contains("missed the solver's tolerance")).unwrap();
    let steps = format!("{} of {} steps", quality.unconverged_steps, quality.steps);
    let tick = format!("(tick {})", imbalance.first_tick);
    for part in [&steps, &tick, &imbalance.worst_at] {
        assert!(found.contains(part.as_str()), "{found}");
    }
    assert!(imbalance.worst_at == "the object" || imbalance.worst_at.contains("finger"), "{imbalance:?}");
    assert_eq!(sound().data.quality.imbalance, None);
}

#[test]
fn a_trial_that_leaves_the_range_keeps_what_came_before_and_says_what_left() {
    let trial = not_finite();
    assert!(!trial.data.quality.finite && trial.frames().len() == 75, "{:?}", trial.data.quality);
    let found = trial.header.warnings.iter().find(|w| w.contains("left the range of numbers")).unwrap();
    assert!(found.contains("1.000 s (step 300)") && found.contains("the object"), "{found}");
    assert!(trial.frames().iter().all(|f| f.q.iter().all(|q| q.is_finite())));
}

#[test]
fn no_data_set_takes_what_cannot_be_trusted() {
    let folder = tempfile::tempdir().unwrap();
    let store = filled(folder.path());
    let (kept, marked): (Vec<_>, Vec<_>) = store.list(false).unwrap().into_iter().partition(|row| row.sound);
    assert_eq!((kept.len(), marked.len()), (1, 2));
    for row in &marked {
        assert!(!store.load(row.id).unwrap().simulated().unwrap().quality.is_sound());
    }
    let data = DatasetQuery::default().read(&store, &SensorView::default(), &mut |_, _| ()).unwrap();
    let ids: Vec<i64> = data.examples.iter().map(|example| example.id).collect();
    assert_eq!((ids, data.about.left_out), (vec![kept[0].id], 2));
    assert!(data.about.described().contains("2 left out"), "{}", data.about.described());
    let first = DatasetQuery { most_of_each: Some(1), ..DatasetQuery::default() };
    let first = first.read(&store, &SensorView::default(), &mut |_, _| ()).unwrap();
    let met: Vec<_> = marked.iter().filter(|row| row.object != kept[0].object || row.id < kept[0].id).collect();
    assert_eq!((first.examples.len(), first.about.left_out), (1, met.len()), "none after the last that is read");
    assert!(met.len() < 2, "{marked:?}");
    let alone = DatasetQuery::default().read_trial(&store, marked[0].id, &SensorView::default());
    assert!(matches!(alone, Err(DatasetError::TrialUnsound { id }) if id == marked[0].id), "{alone:?}");
}

#[test]
fn the_terminal_marks_them_and_leaves_them_out() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    drop(filled(at));
    let listed = run(at, &["trials", "list"]);
    assert_eq!(listed.out.matches("unsound: data sets exclude it").count(), 2, "{listed:?}");
    let shown = run(at, &["trials", "show", "2"]);
    assert!(shown.out.contains("static residual at hold") && shown.out.contains("unsound"), "{shown:?}");
    assert!(shown.err.contains("missed the solver's tolerance, the first at"), "{shown:?}");
    assert!(!run(at, &["trials", "show", "1"]).out.contains("unsound"));
    refused(at, &["recognise", "2"], &["trial 2 is not sound: `palpate trials show 2` says why"]);
    let exported = run(at, &["trials", "export", "1", "2", "3", "--out", "csv"]);
    assert!(exported.code == Some(0) && exported.err.contains("trial 2, 3 excluded"), "{exported:?}");
    assert_eq!(std::fs::read_dir(at.join("csv")).unwrap().count(), 2, "one trial and its contacts");
    refused(at, &["trials", "export", "3", "--out", "three.csv"], &["excluded", "--unsound"]);
    let asked_for = run(at, &["trials", "export", "2", "--unsound", "--out", "two.csv"]);
    assert_eq!(asked_for.code, Some(0), "{asked_for:?}");
    assert_eq!(json(at, &["trials", "show", "2", "--json"])["converged"], false);
}

#[test]
fn trials_from_before_still_have_a_quality() {
    let old = r#"{"finite":true,"converged":false,"steps":1200,"unconverged_steps":3,"newton_mean":2.0,"newton_max":9,
        "friction_residual":0.1,"static_residual":0.0}"#;
    let quality: Quality = serde_json::from_str(old).unwrap();
    assert_eq!(quality.misses().as_deref(), Some("3 of 1200 steps missed the solver's tolerance"));
    assert!(!quality.is_sound());
}
