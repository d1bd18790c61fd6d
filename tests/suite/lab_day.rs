//! A day in a lab with a gripper that only its file describes: doctor, adapting, sixty labelled grasps in two sessions, leak check,
//! training, a promise, live recognition, a pad that dies, and taxels for another program. The board's clock runs as fast as it
//! is asked.

use crate::gripper_file::{GRIPPER, feel, recorded};
use crate::program::{json, run};
use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts, parse_faults};
use palpate_lab::datasets::SensorView;
use palpate_lab::grasping::{Adaptation, Identification};
use palpate_lab::labelling::SensorWatch;
use palpate_learn::Model;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::{Accuracy, Scene};
use palpate_store::Store;
use palpate_tactile::board::SensorList;
use palpate_tactile::calibration::Zero;
use palpate_tactile::trial::TrialData;
use std::path::Path;
use std::sync::Arc;

const OBJECTS: [&str; 3] = ["ball", "box", "syringe"];
/// Grasps of each object.
const EACH: u64 = 20;

/// What a command prints that must succeed.
fn said(folder: &Path, arguments: &[&str]) -> String {
    let ran = run(folder, arguments);
    assert_eq!(ran.code, Some(0), "{arguments:?}: {ran:?}");
    ran.out
}

/// Seconds of lines of the board, while its fingers close and open by themselves.
fn lines(sensors: SensorList, parts: &HiddenParts, seconds: u32) -> Vec<u8> {
    let mut scene = Scene::default();
    scene.solver.accuracy = Accuracy::Draft;
    let objects = vec!["ball".to_owned()];
    let hand = HandPlan { sensors, scene, objects, seed: 1, grasp_every_s: Some(6.0), script: Vec::new() };
    let mut gripper = EmulatedGripper::new(EmulatorSetup {
        hand,
        parts: parts.clone(),
        rate_hz: 50,
        channels: sensors.len(),
        most_steps: 30,
        clock_start_us: 0,
        faults: Vec::new(),
        seed: 1,
    })
    .unwrap();
    let mut lines = Vec::new();
    for k in 1..=100 * seconds {
        gripper.advance(0.01 * f64::from(k));
        lines.extend(gripper.take_bytes());
    }
    lines
}

#[test]
fn from_an_unknown_board_to_taxels_for_another_program() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("gripper.toml"), GRIPPER).unwrap();
    let sensors = SensorList::from_file(&at.join("gripper.toml")).unwrap();
    let parts = HiddenParts::drawn(7);

    // The doctor knows the columns of the board by the file.
    std::fs::write(at.join("board.txt"), lines(sensors, &parts, 14)).unwrap();
    let doctor = said(at, &["doctor", "board.txt", "--gripper", "gripper.toml"]);
    assert!(doctor.contains("fsrL2") && doctor.contains("chamber"), "{doctor}");

    // One close of the empty hand, then sixty labelled grasps.
    let mut store = Store::open(&at.join("trials.sqlite")).unwrap();
    store.calibrations().set_sensors(sensors).unwrap();
    let empty = recorded(&mut store, &parts, EMPTY, 1, Vec::new());
    Adaptation::from_close(&mut store, empty, &Scene::default(), &[], false).unwrap().keep(&store).unwrap();
    let sixty = EACH * OBJECTS.len() as u64;
    for seed in 0..sixty {
        if 2 * seed == sixty {
            // After the break the fingers are tared, which begins another session.
            let zero = Zero { offsets: vec![Some(0.0); sensors.len()] };
            assert!(!store.calibrations().add_tare(&zero).unwrap().parts.is_empty());
        }
        recorded(&mut store, &parts, OBJECTS[seed as usize % OBJECTS.len()], 100 + seed, Vec::new());
    }

    // The emulated gripper tells nothing before the touch, and the model knows the grasps that it has not learned.
    let split = ["evaluate", "--source", "serial", "--models", "extra-trees", "--split", "folds:5"];
    let table = said(at, &split);
    assert!(
        table.contains("before the touch, chance 33 %: no sign of a leak") && table.contains("60 trials"),
        "{table}"
    );
    let f1 = json(at, &[&split[..], &["--json"]].concat())[0]["f1_macro"].as_f64().unwrap_or_default();
    assert!(f1 > 0.8, "F1 {f1}");

    // Each session is tested by a model of the other one.
    let sessions = said(at, &[&split[..5], &["--split", "leave-a-session-out"]].concat());
    assert!(sessions.contains("one session left out at a time, 2 fits"), "{sessions}");

    // A model of all sixty, with a promise.
    let trained = said(at, &["train", "extra-trees", "--source", "serial", "--out", "day.safetensors"]);
    assert!(trained.contains("1 recorded to adapt"), "{trained}");
    let promise = said(at, &["promise", "day.safetensors", "--rounds", "100", "--grasps", "2"]);
    assert!(promise.contains("the true class is left in 90 % of rounds"), "{promise}");
    let model = Arc::new(Model::load(&at.join("day.safetensors")).unwrap());
    let view = SensorView::of_model(&model.card);
    let mut live = Identification::new(Arc::clone(&model), model.card.stop);
    for seed in [301, 302] {
        let trial = recorded(&mut store, &parts, "box", seed, Vec::new());
        feel(&mut live, &store, trial, &view);
    }
    let seen = live.view();
    let named = |class: usize| model.card.labels.classes[class].name.as_str();
    let left = seen.left.unwrap();
    assert_eq!(named(seen.beliefs[1].top().0), "box");
    assert!((0..left.len()).any(|class| left[class] && named(class) == "box"), "{left:?}");

    // A pad dies in the hold and is named, and no other.
    let faults = parse_faults("saturation=3@3/3").unwrap();
    let trial = recorded(&mut store, &parts, "ball", 303, faults);
    let TrialData::Recorded(log) = store.load(trial).unwrap().data else { panic!("a board's") };
    let calibrations = store.calibrations().serving(Some(trial), &[]).unwrap().calibrations;
    let course = &log.course;
    let closing_s = course.phases[0].from_s;
    let rest = log.readings.partition_point(|reading| reading.t_s < closing_s);
    let watched = [&log.readings[..rest], &log.readings];
    let watch = SensorWatch::of_trial(&course.board, watched, &course.phases, &calibrations);
    let dead: Vec<String> = watch.faults().map(|fault| fault.sensor.channel().to_string()).collect();
    assert_eq!(dead, ["fsrL2"]);
    drop(store);

    // Taxels of a simulated grasp leave, and its channels come back.
    said(at, &["collect", "--objects", "ball", "--trials", "1", "--seed", "5"]);
    let simulated = (trial + 1).to_string();
    said(at, &["trials", "export", &simulated, "--taxels", "--out", "pads.npz"]);
    let back = said(at, &["trials", "import", "pads.npz"]);
    assert!(back.contains("1 trial(s) added"), "{back}");
}
