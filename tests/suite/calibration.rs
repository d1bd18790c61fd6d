//! The emulated gripper calibrated and fitted: what is hidden in its parts and fingers is found again from what its
//! board prints.

use crate::bench::{Bench, BenchSetup};
use crate::cpu_renderer::CpuRenderer;
use crate::golden::compare;
use crate::program::{json, palpate, ran, refused, run};
use crate::streams::alike;
use egui_kittest::kittest::Queryable as _;
use palpate::app::ALL_PANELS;
use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts, parse_faults, parse_script};
use palpate_device::protocol::{BoardEvent, Decoder};
use palpate_lab::datasets::{DatasetQuery, SensorView};
use palpate_lab::gripper::Listen;
use palpate_sim::gripper::{GripperModel, Phase, Side, TorquePoint};
use palpate_sim::objects::{EMPTY, ObjectModel};
use palpate_sim::scene::Scene;
use palpate_store::{BoardChunk, BoardInfo, Store};
use palpate_study::{Certainty, FingerFit, Observation, Trust, fit_finger};
use palpate_tactile::board::{Board, Reading, Sensor, SensorList};
use palpate_tactile::calibration::{BendingZero, Calibration, Curve, Input, Procedure, Readout, SensorKind};
use palpate_tactile::capture::{CAPTURE_MAGIC, Captured};
use palpate_tactile::electronics::StripPart;
use palpate_tactile::trial::{BoardCourse, PhaseMark, TrialHeader, TrialId};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// What a board prints while a script is done on the bench, read as a host reads it.
pub(crate) fn readings(
    parts: &HiddenParts,
    scene: &Scene,
    script: &str,
    seconds: f64,
    seed: u64,
) -> (Board, Vec<Reading>) {
    let script = parse_script(script).unwrap();
    let hand = HandPlan {
        sensors: SensorList::default(),
        scene: scene.clone(),
        objects: vec![EMPTY.to_owned()],
        seed,
        grasp_every_s: None,
        script,
    };
    let setup = EmulatorSetup {
        hand,
        parts: parts.clone(),
        rate_hz: 50,
        channels: 4,
        most_steps: 30,
        clock_start_us: 0,
        faults: vec![],
        seed,
    };
    let mut gripper = EmulatedGripper::new(setup).unwrap();
    let (mut decoder, mut events) = (Decoder::default(), Vec::new());
    for k in 1..=(seconds / 0.005) as u32 {
        let now = 0.005 * f64::from(k);
        gripper.advance(now);
        decoder.push(&gripper.take_bytes(), now, &mut events);
    }
    (decoder.board().clone(), events.into_iter().filter_map(BoardEvent::into_reading).collect())
}

/// The steps of a script that hold angles (degrees) and then loads (kg), 2 s each.
fn holds(angles: &[f64], loads: &[f64]) -> String {
    let angles = angles.iter().map(|angle| format!("angle={angle} hold=2; "));
    angles.chain(loads.iter().map(|load| format!("load={load}kg hold=2; "))).collect()
}

/// The usual procedure for all four sensors at once, hands-free; pads learn their zero from an empty close.
pub(crate) fn calibrated(parts: &HiddenParts, seed: u64) -> (Board, Vec<(Sensor, Calibration)>) {
    let steps = |kind: SensorKind| {
        let plan = palpate_tactile::calibration::plan(kind);
        plan.into_iter().map(|stimulus| kind.shown(stimulus)).collect::<Vec<f64>>()
    };
    let mut calibrations = Vec::new();
    let mut board = Board::default();
    for kind in [SensorKind::Flex, SensorKind::Pad] {
        let plan = steps(kind);
        let script = if kind == SensorKind::Flex { holds(&plan, &[]) } else { holds(&[], &plan) };
        let (own, stream) = readings(parts, &Scene::default(), &script, 2.0 * plan.len() as f64, seed);
        board = own;
        for side in Side::BOTH {
            let sensor = SensorList::default().first_on(kind, side).unwrap();
            let mut procedure = Procedure::new(sensor, sensor.channel(), None);
            assert!(procedure.see(&board));
            for reading in &stream {
                procedure.feed(reading);
                if let Some(next) = procedure.next().filter(|_| procedure.has_changed() && procedure.settled().is_ok())
                {
                    procedure.take(next).unwrap();
                }
            }
            assert_eq!(procedure.left(), 0, "{sensor:?}: {:?}", procedure.record().points);
            calibrations.push((sensor, procedure.fit().unwrap()));
        }
    }
    let readout = Readout::new(&board, &calibrations).unwrap();
    let (_, close) = readings(parts, &Scene::default(), "rest=0.5; close empty bar=0.5", 4.0, seed + 1);
    for side in Side::BOTH {
        let (_, calibration) = &mut calibrations[2 + side.index()];
        let mut record = calibration.record.clone();
        record.bending =
            Some(BendingZero::from_empty_close(&readout.bending(Sensor::PAPER[2 + side.index()], &close)).unwrap());
        *calibration = Calibration::fit(record).unwrap();
    }
    (board, calibrations)
}

pub(crate) fn parts(seed: u64, faults: bool) -> HiddenParts {
    HiddenParts { hysteresis: faults, drift: faults, ..HiddenParts::drawn(seed) }
}

/// Largest errors of angle (degrees) and force (share), over holds between the points of the calibration.
fn errors(parts: &HiddenParts, seed: u64) -> [f64; 2] {
    let (board, calibrations) = calibrated(parts, seed);
    let readout = Readout::new(&board, &calibrations).unwrap();
    // Up and down, so that hysteresis shows.
    let angles = [5.0, 20.0, 45.0, 75.0, 90.0, 60.0, 35.0, 10.0];
    let loads = [0.0306, 0.08, 0.16, 0.32, 0.5, 0.4, 0.24, 0.0306];
    let (_, stream) = readings(parts, &Scene::default(), &holds(&angles, &loads), 32.0, seed + 2);
    let mut worst = [0.0f64; 2];
    for (step, stimulus) in angles.iter().map(|a| (0, *a)).chain(loads.iter().map(|l| (1, *l))).enumerate() {
        let (from, to) = (2.0 * step as f64 + 1.2, 2.0 * step as f64 + 1.9);
        let held: Vec<&Reading> = stream.iter().filter(|reading| (from..to).contains(&reading.t_s)).collect();
        assert!(held.len() > 30);
        for side in 0..2 {
            let mean = |value: &dyn Fn(&Reading) -> Option<f64>| {
                held.iter().map(|reading| value(reading).unwrap()).sum::<f64>() / held.len() as f64
            };
            let (kind, shown) = stimulus;
            let error = match kind {
                0 => mean(&|reading| readout.estimate(reading).value(Sensor::PAPER[side])).to_degrees() - shown,
                _ => {
                    mean(&|reading| readout.estimate(reading).value(Sensor::PAPER[2 + side]))
                        / SensorKind::Pad.stimulus(shown)
                        - 1.0
                }
            };
            worst[kind] = worst[kind].max(error.abs());
        }
    }
    worst
}

#[test]
fn hidden_parts_are_read_within_a_degree_and_5_per_cent_through_noise() {
    for seed in [1, 2, 3] {
        let [angle, force] = errors(&parts(seed, false), seed);
        assert!(angle < 1.0 && force < 0.05, "seed {seed}: {angle} degrees, {force}");
        // With hysteresis and drift the promise is smaller: the data sheet's 5 % and what repeats not.
        let [angle, force] = errors(&parts(seed, true), seed);
        println!("seed {seed} with hysteresis and drift: {angle:.2} degrees, {:.1} %", 100.0 * force);
        assert!(angle < 1.5 && force < 0.10, "seed {seed}: {angle} degrees, {force}");
    }
}

#[test]
fn a_resistor_that_is_not_what_the_board_says_is_told() {
    let mut wrong = parts(4, false);
    wrong.pads[1].divider_ohm = 1e3;
    let plan = palpate_tactile::calibration::plan(SensorKind::Pad);
    let loads: Vec<f64> = plan.iter().map(|force| SensorKind::Pad.shown(*force)).collect();
    let (mut board, stream) = readings(&wrong, &Scene::default(), &holds(&[], &loads), 16.0, 1);
    // The hello line says what the maker believed.
    board.divider_ohm = vec![47e3, 47e3, 4.7e3, 47e3];
    let mut procedure = Procedure::new(Sensor::PAD_RIGHT, "P2", None);
    assert!(procedure.see(&board));
    for reading in &stream {
        procedure.feed(reading);
        if let Some(next) = procedure.next().filter(|_| procedure.has_changed() && procedure.settled().is_ok()) {
            procedure.take(next).unwrap();
        }
    }
    let found = procedure.fit().expect_err("no such pad").to_string();
    assert!(found.contains("is not the 47.0 kΩ entered"), "{found}");
}

/// The twin's scene, and the one with the hidden finger.
pub(crate) fn scenes() -> [Scene; 2] {
    let mut known = Scene::default();
    // What is pressed against stands where the scene says.
    (known.pose.shift, known.pose.yaw_deg) = ([0.0; 3], 0.0);
    let mut hidden = known.clone();
    hidden.gripper.finger.bending_stiffness *= 0.82;
    hidden.gripper.finger.damping_time = 0.03;
    hidden.gripper.actuation.filling_time = 0.06;
    hidden.gripper.actuation.curve =
        [(0.0, 0.0), (0.4, 0.018), (0.8, 0.042)].map(|(bar, torque)| TorquePoint { bar, torque }).to_vec();
    [known, hidden]
}

/// A grasp of the emulated gripper as the fit takes it.
fn observed(parts: &HiddenParts, readout: &Readout, script: &str, fixed: bool, seed: u64) -> Observation {
    let [mut known, mut hidden] = scenes();
    let object = if fixed { "bigball" } else { EMPTY };
    for scene in [&mut known, &mut hidden] {
        scene.set_object_fixed(fixed);
        scene.object.source = object.to_owned();
    }
    let (_, readings) = readings(parts, &hidden, script, 5.0, seed);
    let line = readings.iter().filter_map(|reading| Some((reading.t_s, reading.line_bar?))).collect();
    let object: Option<ObjectModel> = known.load_object().unwrap();
    Observation {
        name: script.to_owned(),
        signals: readout.derive(&readings, None).signals,
        line,
        scene: known,
        object,
    }
}

fn off(fit: &FingerFit) -> f64 {
    let [_, hidden] = scenes();
    fit.gripper.finger.bending_stiffness / hidden.gripper.finger.bending_stiffness - 1.0
}

/// An empty close and a press of a gripper with these parts, fitted.
fn fitted(parts: &HiddenParts, seed: u64) -> FingerFit {
    let (board, calibrations) = calibrated(parts, seed);
    let readout = Readout::new(&board, &calibrations).unwrap();
    let recordings = [
        observed(parts, &readout, "rest=0.5; close empty bar=0.6", false, seed + 3),
        observed(parts, &readout, "rest=0.5; grasp bigball bar=0.8", true, seed + 4),
        observed(parts, &readout, "rest=0.5; grasp bigball bar=0.7", true, seed + 5),
    ];
    // These pads repeat better than the data sheet says: their gain is known as well as they are calibrated.
    fit_finger(&recordings, &Trust { pad_gain: [0.005; 2], strip_gain: [0.005; 2] }).unwrap()
}

#[test]
fn the_hidden_finger_is_fitted_within_3_per_cent() {
    let fit = fitted(&parts(5, false), 5);
    println!("{:+.4} {:?} {} steps {:?}", off(&fit), fit.estimates, fit.steps, fit.remainders);
    assert!(off(&fit).abs() < 0.03 && fit.estimates[0].known == Certainty::Well, "{}", off(&fit));
    assert_ne!(fit.gripper, GripperModel::default());
    // The grippers that a model learns, drawn about the fitted one, have the hidden one among them.
    let (ranges, [_, hidden]) = (fit.gripper.fitted.unwrap(), scenes());
    let ratio = |own: &GripperModel| own.actuation.torque(0.8) / own.finger.bending_stiffness;
    let within = |[low, high]: [f64; 2], x: f64| (low..=high).contains(&x);
    assert!(within(ranges.stiffness, 1.0 / (1.0 + off(&fit))), "{ranges:?}");
    assert!(within(ranges.torque_per_stiffness, ratio(&hidden.gripper) / ratio(&fit.gripper)), "{ranges:?}");
    assert!(ranges.stiffness[1] < 1.1 && ranges.torque_per_stiffness[1] < 1.05, "{ranges:?}");
}

/// A file of a strip's points, as `palpate calibrate --points` takes them.
fn write_points(folder: &Path, name: &str, record: &palpate_tactile::calibration::Record) {
    let column = if record.kind == SensorKind::Flex { "angle_deg" } else { "load_kg" };
    let rows = record.points.iter().map(|p| format!("{},{}\n", record.kind.shown(p.stimulus), p.counts));
    std::fs::write(folder.join(name), format!("{column},counts\n{}", rows.collect::<String>())).unwrap();
}

#[test]
fn calibrations_are_made_listed_exchanged_and_withdrawn_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let hidden = parts(6, false);
    let (_, calibrations) = calibrated(&hidden, 6);
    write_points(at, "strip.csv", &calibrations[0].1.record);
    write_points(at, "pad.csv", &calibrations[2].1.record);
    let looked = run(at, &["calibrate", "flexL", "--part", "A7", "--points", "strip.csv", "--dry-run"]);
    assert!(looked.code == Some(0) && looked.out.contains("not stored"), "{looked:?}");
    assert_eq!(std::fs::read_dir(at).unwrap().count(), 2, "a dry run leaves no store");
    let made = json(at, &["calibrate", "flexL", "--part", "A7", "--points", "strip.csv", "--json"]);
    assert_eq!((&made["id"], &made["version"], &made["part"]), (&1.into(), &1.into(), &"A7".into()));
    assert!(made["curve"]["flex"]["flat_ohm"].as_f64().unwrap() > 17.5e3);
    // The part is known to sit there now.
    let text = run(at, &["calibrate", "flexL", "--points", "strip.csv"]);
    assert!(
        text.code == Some(0) && text.out.contains("version 2 of \"A7\", mounted as the left flex strip"),
        "{text:?}"
    );
    assert_eq!(run(at, &["calibrate", "fsrL", "--part", "P1", "--points", "pad.csv", "--dry-run"]).code, Some(0));
    // Weights from a file, and how the zero moves with bending from an empty close.
    capture(&hidden, "rest=0.5; close empty bar=0.5", "", 4.0, &at.join("close.bytes"));
    let pad = ["calibrate", "fsrL", "--part", "P1", "--points", "pad.csv"];
    let close = ["--empty-close", "3.5", "--auto", "--dry-run", "--json", "--port"];
    let learned = json(at, &[&pad[..], &close, &["close.bytes"]].concat());
    assert!(learned["bending"]["knots"].as_array().unwrap().len() > 3, "{learned}");
    refused(at, &[&pad[..], &["--port", "close.bytes"]].concat(), &["--port has no effect", "--empty-close"]);
    let listed = json(at, &["calibrate", "list", "--json"]);
    assert_eq!((listed["calibrations"].as_array().unwrap().len(), &listed["mounted"]["flexL"]), (2, &"A7".into()));
    assert_eq!(run(at, &["calibrate", "export", "--out", "c.json"]).code, Some(0));
    assert_eq!(run(at, &["calibrate", "withdraw", "2"]).code, Some(0));
    assert!(run(at, &["calibrate", "list"]).out.contains("withdrawn"));
    assert!(run(at, &["calibrate", "show", "1"]).out.contains("kΩ flat"));
    let mut other = palpate(&at.join("other.sqlite"));
    let taken = ran(&other.args(["calibrate", "import", "c.json", "c.json"]).current_dir(at).output().unwrap());
    assert!(
        taken.code == Some(0) && taken.out.contains("2 calibration(s) added") && taken.out.contains("2 already there"),
        "{taken:?}"
    );
    let mounted = run(at, &["calibrate", "mount", "flexR", "A9"]);
    assert!(mounted.out.contains("right flex strip") && mounted.err.contains("has no calibration"), "{mounted:?}");
    // What goes wrong is told with a cause and what to do.
    refused(at, &["calibrate", "fsrL", "--part", "P1", "--points", "strip.csv"], &["no column load_kg", "angle_deg"]);
    refused(at, &["calibrate", "flexL", "--points", "strip.csv", "--resistor", "1000"], &["is not the 1.00 kΩ"]);
    refused(at, &["calibrate", "fsrL", "--points", "pad.csv"], &["give it a name"]);
    refused(at, &["calibrate", "show", "77"], &["no calibration 77", "calibrate list"]);
    refused(at, &["calibrate", "import", "strip.csv"], &["strip.csv", "calibrate export"]);
    refused(at, &["calibrate", "flexL", "--port", "nowhere", "--auto"], &["nowhere"]);
}

/// What a board sends while a script is done on the bench, as a file of captured bytes.
pub(crate) fn capture(parts: &HiddenParts, script: &str, faults: &str, seconds: f64, file: &Path) {
    let script = parse_script(script).unwrap();
    let hand = HandPlan {
        sensors: SensorList::default(),
        scene: Scene::default(),
        objects: vec![EMPTY.to_owned()],
        seed: 1,
        grasp_every_s: None,
        script,
    };
    let (channels, most_steps, clock_start_us) = (4, 30, 0);
    let setup = EmulatorSetup {
        hand,
        parts: parts.clone(),
        rate_hz: 50,
        channels,
        most_steps,
        clock_start_us,
        faults: parse_faults(faults).unwrap(),
        seed: 1,
    };
    let mut gripper = EmulatedGripper::new(setup).unwrap();
    let mut bytes = CAPTURE_MAGIC.to_vec();
    for k in 1..=(100.0 * seconds) as u32 {
        let arrived_s = 0.01 * f64::from(k);
        gripper.advance(arrived_s);
        Captured::Bytes { arrived_s, bytes: gripper.take_bytes() }.write(&mut bytes).unwrap();
    }
    std::fs::write(file, bytes).unwrap();
}

#[test]
fn a_captured_stream_is_calibrated_hands_free() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let parts = parts(7, true);
    capture(&parts, "rest=2; angle=0 hold=2; angle=50 hold=3; angle=90 hold=3", "", 10.0, &at.join("bench.bytes"));
    let arguments =
        ["calibrate", "flexR", "--part", "B", "--port", "bench.bytes", "--auto", "--plan", "0,50,90", "--json"];
    let made = json(at, &arguments);
    let flat = made["curve"]["flex"]["flat_ohm"].as_f64().unwrap();
    assert!((flat / parts.strips[1].part.flat_ohm - 1.0).abs() < 0.01, "{flat}");
    let missing = [&arguments[..8], &["0,50,90,10"]].concat();
    refused(at, &missing, &["ended before all points were recorded"]);
}

#[test]
fn a_tare_is_taken_kept_and_shown_beside_the_drift_of_trials() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let parts = parts(7, false);
    let (board, calibrations) = calibrated(&parts, 7);
    refused(at, &["calibrate", "tare", "--port", "rest.bytes"], &["no calibrations yet", "palpate help gripper"]);
    let mut store = Store::open(&at.join("trials.sqlite")).unwrap();
    for (sensor, calibration) in &calibrations {
        store.calibrations().add(&calibration.record).unwrap();
        store.calibrations().mount(*sensor, &calibration.record.part).unwrap();
    }
    // The left strip has slipped by 4 degrees, the right one by 17: too little to press on a pad.
    let scene = Scene::default();
    let (_, rest) = readings(&parts, &scene, "angleL=4 angleR=17 hold=9", 4.0, 3);
    let rest: Vec<Reading> = rest.into_iter().filter(|reading| reading.t_s > 1.0).collect();
    let lines: Vec<String> = rest
        .iter()
        .map(|reading| {
            let counts: Vec<String> = reading.counts.iter().map(|count| count.unwrap().to_string()).collect();
            format!("{},{}\n", (reading.t_s * 1e3).round(), counts.join(","))
        })
        .collect();
    std::fs::write(at.join("rest.bytes"), format!("\nms,flexL,flexR,fsrL,fsrR\n{}", lines.concat())).unwrap();
    let taken = json(at, &["calibrate", "tare", "--port", "rest.bytes", "--json"]);
    let levels: Vec<&str> = taken["drift"].as_array().unwrap().iter().map(|d| d["level"].as_str().unwrap()).collect();
    assert_eq!(levels, ["moved", "too-far", "steady", "steady"], "{taken}");
    let offsets = store.calibrations().tare().unwrap().unwrap().zero.offsets;
    assert!((offsets[0].unwrap().to_degrees() - 4.0).abs() < 0.5 && offsets[1].is_none(), "{offsets:?}");
    let said = run(at, &["calibrate", "tare", "--port", "rest.bytes", "--seconds", "0.5"]);
    assert!(said.out.contains("corrected from now on") && said.out.contains("slipped"), "{said:?}");
    assert!(said.out.contains("\"flexL\" version 2"), "{said:?}");
    stored(&mut store, &board, rest, &scene, EMPTY, 2.0);
    let found = json(at, &["calibrate", "drift", "--json"]);
    assert_eq!((&found[0]["trial"], &found[0]["drift"][1]["level"]), (&1.into(), &"too-far".into()), "{found}");
    let text = run(at, &["calibrate", "drift", "1"]);
    assert!(text.out.contains("moved") && text.out.contains("tare 2"), "{text:?}");
    refused(at, &["calibrate", "drift", "9"], &["no trial 9", "trials list"]);
}

/// Stores readings as `palpate record` does.
pub(crate) fn stored(
    store: &mut Store,
    board: &Board,
    readings: Vec<Reading>,
    scene: &Scene,
    object: &str,
    closing_s: f64,
) -> TrialId {
    let header = TrialHeader::new(object, scene.clone());
    let phases = vec![PhaseMark { from_s: closing_s, phase: Phase::Close, line_bar: None }];
    let about = BoardInfo {
        course: BoardCourse { board: board.clone(), phases, ..BoardCourse::default() },
        ..BoardInfo::default()
    };
    let id = store.begin_board(&header, &about).unwrap();
    store.append_board(id, &about, &BoardChunk { readings, ..BoardChunk::default() }).unwrap();
    store.finish_board(id, &about, &[]).unwrap();
    id
}

/// File of a model of contact pressure, which only simulations have, in a folder.
pub(crate) fn model_of_contact(at: &Path) -> String {
    let mut model = crate::scripted::made_up();
    model.card.data.signals = Some("contact".to_owned());
    for channel in &mut model.card.channels {
        *channel = channel.replace("pressure_", "contact_pressure_");
    }
    palpate_lab::datasets::save_model(&model, &at.join("contact.safetensors")).unwrap();
    "contact.safetensors".to_owned()
}

/// File of a model as one that was trained on trials of a board, in a folder: any answer will do.
pub(crate) fn model_of_pads(at: &Path) -> String {
    let mut model = crate::scripted::made_up();
    let data = &mut model.card.data;
    (data.signals, data.sensors, data.layout) = (None, None, None);
    palpate_lab::datasets::save_model(&model, &at.join("pads.safetensors")).unwrap();
    "pads.safetensors".to_owned()
}

#[test]
fn stored_trials_of_the_board_are_fitted_and_recognised_and_derived_anew() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let parts = parts(8, false);
    let (board, calibrations) = calibrated(&parts, 8);
    let [known, hidden] = scenes();
    let mut store = Store::open(&at.join("trials.sqlite")).unwrap();
    let press = |bar: &str| format!("rest=0.5; grasp bigball bar={bar}");
    let close = "rest=0.5; close empty bar=0.6".to_owned();
    let grasps = [(close, EMPTY), (press("0.8"), "bigball"), (press("0.7"), "bigball")];
    for (script, object) in grasps {
        let of = |scene: &Scene| {
            let mut scene = scene.clone();
            scene.set_object_fixed(object != EMPTY);
            scene.object.source = object.to_owned();
            scene
        };
        let (_, readings) = readings(&parts, &of(&hidden), &script, 5.0, 3);
        stored(&mut store, &board, readings, &of(&known), object, 0.5);
    }
    drop(store);
    let model = model_of_pads(at);
    refused(at, &["recognise", "1", "--model", &model], &["trial 1", "no part is mounted as the left flex strip"]);
    refused(at, &["fit", "1", "2"], &["no curvature"]);
    let store = Store::open(&at.join("trials.sqlite")).unwrap();
    for (sensor, calibration) in &calibrations {
        store.calibrations().add(&calibration.record).unwrap();
        store.calibrations().mount(*sensor, &calibration.record.part).unwrap();
    }
    let kappa = |store: &Store| {
        let signals = store.board_signals(1, &[]).unwrap().unwrap().derived.signals;
        (0..signals.len()).map(|k| signals.row(k)[0]).fold(0.0, f32::max)
    };
    let before = kappa(&store);
    let fit = json(at, &["fit", "1", "2", "3", "--pad-gain", "0.5", "--json", "--out", "twin.toml"]);
    let stiffness = fit["estimates"][0]["value"].as_f64().unwrap();
    assert!((stiffness / hidden.gripper.finger.bending_stiffness - 1.0).abs() < 0.03, "{stiffness} {fit}");
    let gap = json(at, &["gap", "1", "2", "3", "--json"]);
    crate::frozen::compare_numbers("json_gap", &crate::frozen::pretty(gap.clone()));
    let channels = gap["channels"].as_array().unwrap();
    assert_eq!(channels.len(), 4, "{gap}");
    for channel in channels {
        let [before, after] = [0, 1].map(|which| channel["rmse"][which].as_f64().unwrap());
        assert!(after < before, "{channel}");
    }
    let left = |k: usize| gap["constants"][k]["left"].as_f64().unwrap();
    assert!(left(0) < left(7) && left(7) <= 1.0 + 1e-6, "{gap}");
    let said = run(at, &["gap", "1", "2", "3"]).out;
    assert!(said.contains("curvature_left") && said.contains("squared difference left"), "{said}");
    let twin = Scene::from_file(&at.join("twin.toml")).unwrap();
    assert_eq!(twin.gripper.finger.bending_stiffness, stiffness);
    let found = run(at, &["recognise", "1", "2", "--model", &model]);
    assert!(found.code == Some(0) && found.out.contains("bigball") && found.err.is_empty(), "{found:?}");
    assert!(!found.out.contains("stage one"), "a model of one stage has no column for another: {}", found.out);
    // The shipped model for any gripper, and the one for perfect sensors.
    let found = run(at, &["recognise", "1"]);
    assert!(found.code == Some(0) && found.err.is_empty(), "{found:?}");
    let perfect = concat!(env!("CARGO_MANIFEST_DIR"), "/models/live.safetensors");
    let found = run(at, &["recognise", "1", "--model", perfect]);
    assert!(found.code == Some(0) && found.err.contains("knows perfect sensors only"), "{found:?}");
    // Every calibration of a trial must be named: one of four is not enough, and the reason says so.
    let one = ["train", "knn", "--calibration", "1", "--include-flagged", "--out", "m.safetensors"];
    refused(at, &one, &["(calibrations 1, with flagged trials) is usable: 3 with other calibrations"]);
    let query = DatasetQuery { calibrations: vec![1, 2, 3, 4], include_flagged: true, ..DatasetQuery::default() };
    let data = query.read(&store, &SensorView::default(), &mut |_, _| ()).unwrap();
    assert_eq!((data.examples.len(), data.about.calibrations), (3, vec![1, 2, 3, 4]));
    // Another strip calibration, and the old trial reads differently.
    let mut record = calibrations[0].1.record.clone();
    record.points.iter_mut().for_each(|point| point.stimulus *= 0.9);
    store.calibrations().add(&record).unwrap();
    assert!((kappa(&store) / before - 0.9).abs() < 0.01, "{} {before}", kappa(&store));
}

/// A gripper on the bench, as its board reads it: counts of each sensor, and how far the empty hand has bent since it began
/// to close (degrees).
#[derive(Default)]
struct OnTheBench {
    counts: [f64; 4],
    bends: Option<f64>,
    /// Seconds of readings that were sent.
    seconds: u32,
}

/// A strip of 24 kΩ that rises to 2.2 times that.
fn strip_counts(degrees: f64) -> f64 {
    Input::on(&Board::default(), Sensor::FLEX_RIGHT).counts(24e3 * (1.0 + 1.2 * degrees / 90.0))
}

/// A pad of 6 kΩ under 1 N.
fn pad_counts(force: f64) -> f64 {
    let input = Input::on(&Board::default(), Sensor::PAD_RIGHT);
    if force < 0.05 { 0.0 } else { input.counts(6e3 / force.powf(0.9)) }
}

/// Chooses a sensor and begins with a part.
fn begin_calibration(bench: &mut Bench, sensor: Sensor, part: &str) {
    bench.harness.get_by_label(&sensor.label()).click();
    bench.harness.get_by_label("Part").focus();
    bench.harness.step();
    for _ in 0..4 {
        bench.harness.key_press(egui::Key::Backspace);
    }
    bench.harness.get_by_label("Part").type_text(part);
    bench.harness.step();
    bench.harness.get_by_label("Start calibration").click();
    bench.harness.step();
}

/// Sets what is asked for and takes it, once it has settled.
fn take_points<'a>(
    bench: &mut Bench,
    hand: &Mutex<OnTheBench>,
    sensor: Sensor,
    holds: impl IntoIterator<Item = (&'a str, f64)>,
) {
    for (instruction, wanted) in holds {
        hand.lock().unwrap().counts[sensor.index()] = wanted;
        // Nothing from before it is among the readings whose mean is taken.
        let settled = hand.lock().unwrap().seconds + 5;
        while hand.lock().unwrap().seconds < settled {
            bench.wait();
        }
        bench.until_shown(true, instruction);
        bench.until_shown(true, &format!("{wanted:.0} counts, settled"));
        bench.harness.get_by_label("Take point").click();
        bench.until_shown(false, instruction);
    }
    bench.until_shown(true, "all points are taken");
}

#[test]
fn the_window_calibrates_step_by_step() {
    let hand =
        Arc::new(Mutex::new(OnTheBench { counts: [1400.0, strip_counts(0.0), 0.0, 0.0], bends: None, seconds: 0 }));
    let read = Arc::clone(&hand);
    let listen: Listen = Arc::new(move |_, _| {
        let read = Arc::clone(&read);
        let counts = move || {
            let mut hand = read.lock().unwrap();
            hand.seconds += 1;
            // Bending alone presses on the pad: 5 mN a degree. It opens again, and closes, and opens.
            if let Some(degrees) = hand.bends {
                let now = 45.0 - (45.0 - degrees).abs();
                (hand.counts[1], hand.counts[3]) = (strip_counts(now), pad_counts(0.005 * now));
                hand.bends = Some((degrees + 9.0) % 90.0);
            }
            hand.counts.map(|counts| Some(counts as f32)).to_vec()
        };
        Ok(Box::new(alike(counts)))
    });
    let panel = ALL_PANELS.iter().find(|panel| panel.name == "calibration");
    let setup = BenchSetup { panel, size: [340.0, 640.0], listen, ..BenchSetup::default() };
    let mut bench = Bench::new(setup, CpuRenderer::default());
    begin_calibration(&mut bench, Sensor::FLEX_RIGHT, "A7");
    // It has slipped a little at 60 degrees.
    let holds = [("hang straight", 0.0), ("by 30 degrees", 30.0), ("by 60 degrees", 61.5), ("by 90 degrees", 90.0)];
    take_points(&mut bench, &hand, Sensor::FLEX_RIGHT, holds.map(|(asked, degrees)| (asked, strip_counts(degrees))));
    bench.until_shown(true, "kΩ flat");
    bench.until_shown(true, "counts, settled");
    assert!(bench.harness.query_by_label("Empty close").is_none(), "a strip has no such zero");
    compare("calibration_done", &bench.picture(), "the CPU renderer of the tests");
    bench.harness.get_by_label("Save").click();
    bench.until_shown(true, "version 1 of \"A7\", the right flex strip");
    // A pad, and what bending does to it.
    begin_calibration(&mut bench, Sensor::PAD_RIGHT, "P3");
    let plan = palpate_tactile::calibration::plan(SensorKind::Pad);
    let asked: Vec<(String, f64)> = plan
        .iter()
        .map(|force| match *force {
            0.0 => ("put nothing on it".to_owned(), 0.0),
            force => (format!("put {:.0} g on", 1e3 * SensorKind::Pad.shown(force)), pad_counts(force)),
        })
        .collect();
    take_points(&mut bench, &hand, Sensor::PAD_RIGHT, asked.iter().map(|(asked, counts)| (asked.as_str(), *counts)));
    bench.until_shown(true, "let the empty hand close once");
    *hand.lock().unwrap() = OnTheBench { counts: [1400.0, strip_counts(0.0), 0.0, 0.0], bends: Some(0.0), seconds: 0 };
    bench.harness.get_by_label("Empty close").click();
    bench.until_shown(true, "zero shift by bending, up to");
    *hand.lock().unwrap() = OnTheBench { counts: [1400.0, strip_counts(0.0), 0.0, 0.0], bends: None, seconds: 0 };
    bench.until_shown(true, "0 counts, settled");
    // A plot knows the width of its labels after it has been drawn.
    bench.harness.run_steps(4);
    compare("calibration_pad", &bench.picture(), "the CPU renderer of the tests");
    bench.harness.get_by_label("Save").click();
    bench.until_shown(true, "version 1 of \"P3\", the right pad");
    let store = bench.store();
    let serving = store.calibrations().serving(None, &[]).unwrap().calibrations;
    let (_, pad) = serving.iter().find(|(sensor, _)| *sensor == Sensor::PAD_RIGHT).unwrap();
    let bending = pad.record.bending.as_ref().expect("learned");
    let Curve::Pad(curve) = &pad.curve else { panic!("{pad:?}") };
    let load = bending.preload(curve, 30f64.to_radians() / StripPart::ACTIVE_LENGTH);
    assert!((load - 0.15).abs() < 0.03, "{load}");
}
