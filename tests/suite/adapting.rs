//! Adapting to a gripper without labels, over a real pseudo-terminal: one close of the empty hand, and then grasps.

#![cfg(unix)]

use crate::bench::HANG;
use crate::program::{Ran, palpate, ran, refused, run};
use crate::serial::{TOO_BUSY, finished, start};
use palpate_store::Store;
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::{Curve, Readout};
use palpate_tactile::trial::TrialData;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// A running `palpate emulate`, killed when dropped.
pub(crate) struct Emulator {
    child: Child,
    pub(crate) port: PathBuf,
}

impl Emulator {
    /// Starts it.
    pub(crate) fn start(folder: &Path, arguments: &[&str]) -> Self {
        let port = folder.join("port");
        // An earlier one was killed.
        let _old = std::fs::remove_file(&port);
        let mut command = palpate(&folder.join("unused.sqlite"));
        command.arg("emulate").args(arguments).arg("--link").arg(&port);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let child = start(command);
        let began = Instant::now();
        while std::fs::symlink_metadata(&port).is_err() {
            assert!(began.elapsed() < HANG, "no link appeared");
            std::thread::sleep(Duration::from_millis(10));
        }
        Self { child, port }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _dead = self.child.kill();
        let _gone = self.child.wait();
    }
}

/// Runs a command on a fresh emulator.
fn on_emulator(folder: &Path, emulate: &[&str], arguments: &[&str]) -> (Emulator, Ran) {
    finished(&TOO_BUSY, || {
        let emulator = Emulator::start(folder, emulate);
        // An attempt before this one may have stored a trial.
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("trials.sqlite")) {
                std::fs::remove_file(path).unwrap();
            }
        }
        let mut command = palpate(&folder.join("trials.sqlite"));
        command.args(arguments).arg("--port").arg(&emulator.port);
        (emulator, command)
    })
}

fn adapted(folder: &Path, emulate: &[&str]) -> (Emulator, Value) {
    let (emulator, ran) = on_emulator(folder, emulate, &["adapt", "--json"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    (emulator, serde_json::from_str(&ran.out).unwrap())
}

fn json_at_port(folder: &Path, arguments: &[&str], port: &Path) -> Value {
    let (_, ran) = finished(&TOO_BUSY, || {
        let mut command = palpate(&folder.join("trials.sqlite"));
        command.args(arguments).arg("--json").arg("--port").arg(port);
        ((), command)
    });
    assert_eq!(ran.code, Some(0), "{ran:?}");
    serde_json::from_str(&ran.out).unwrap()
}

#[test]
fn a_gripper_recognises_after_one_close_of_its_empty_hand() {
    let folder = tempfile::tempdir().unwrap();
    let emulate = ["--grasp-every", "0", "--seed", "77", "--object", "empty,lemon"];
    let emulator = Emulator::start(folder.path(), &emulate);
    let port = emulator.port.to_str().unwrap();
    refused(folder.path(), &["demo", "--port", port], &["not calibrated", "palpate adapt --port"]);
    drop(emulator);

    let (emulator, adapted) = adapted(folder.path(), &emulate);
    let outcomes: Vec<&str> =
        adapted["sensors"].as_array().unwrap().iter().filter_map(|sensor| sensor["outcome"].as_str()).collect();
    assert_eq!(outcomes, ["adapted"; 4], "{adapted}");

    // The emulated fingers are the modelled ones, so that the strips come out as they are.
    let mut secrets = palpate(&folder.path().join("unused.sqlite"));
    let secrets = ran(&secrets.args(["emulate", "--print-secrets", "--seed", "77"]).output().unwrap());
    let secrets: Value = serde_json::from_str(&secrets.out).unwrap();
    let store = Store::open(&folder.path().join("trials.sqlite")).unwrap();
    let serving = store.calibrations().serving(None, &[]).unwrap();
    assert_eq!(serving.calibrations.len(), 4, "{serving:?}");
    for (strip, (sensor, calibration)) in serving.calibrations[..2].iter().enumerate() {
        let Curve::Flex(curve) = &calibration.curve else { panic!("{sensor:?} is no strip") };
        let truth = |name: &str| secrets["strips"][strip][name].as_f64().unwrap();
        assert!(calibration.record.assumed && (curve.flat_ohm / truth("flat_ohm") - 1.0).abs() < 0.02);
        let rise = curve.ohm_per_rad / curve.flat_ohm;
        assert!((rise / truth("rise_per_rad") - 1.0).abs() < 0.05, "{sensor:?}: {rise} {}", truth("rise_per_rad"));
    }
    // Pads fire in the empty hand, and that is taken away.
    let TrialData::Recorded(log) = store.load(adapted["trial"].as_i64().unwrap()).unwrap().data else { panic!() };
    let readout = Readout::new(&log.course.board, &serving.calibrations).unwrap();
    let shown = |side: usize| {
        let forces = log.readings.iter().filter_map(|reading| readout.estimate(reading).value(Sensor::PAPER[2 + side]));
        forces.fold(0.0, f64::max)
    };
    assert!(shown(0) < 0.08 && shown(1) < 0.08, "{} {}", shown(0), shown(1));
    drop(store);

    let demo = json_at_port(folder.path(), &["demo", "--grasps", "1", "--object", "lemon"], &emulator.port);
    let grasp = &demo["grasps"][0];
    assert_eq!((demo["truth"].as_str(), demo["grasps"].as_array().unwrap().len()), (Some("lemon"), 1));
    let width: Vec<f64> = grasp["touch"]["width_mm"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
    // 48 to 70 mm, as it lies.
    assert!(width[1] < 72.0 && width[2] > 46.0, "{width:?}");
    let total: f64 = grasp["pmf"].as_object().unwrap().values().filter_map(Value::as_f64).sum();
    assert!((total - 1.0).abs() < 1e-6, "{grasp}");
}

#[test]
fn what_adapt_cannot_use_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let ran = run(folder.path(), &["grasp", "lemon"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    refused(folder.path(), &["adapt", "--trial", "1"], &["not of a real gripper"]);
    refused(folder.path(), &["adapt", "--trial", "99"], &["99"]);
    let nothing = folder.path().join("nothing.bytes");
    std::fs::write(&nothing, "noise\n").unwrap();
    refused(folder.path(), &["adapt", "--port", nothing.to_str().unwrap()], &["no reading"]);
}

#[test]
fn adapt_works_as_the_readme_prints_it_and_refuses_a_ball() {
    let folder = tempfile::tempdir().unwrap();
    // It grasps the built-in objects by itself until a host drives it.
    let (emulator, adapted) = adapted(folder.path(), &[]);
    let outcomes: Vec<&str> =
        adapted["sensors"].as_array().unwrap().iter().filter_map(|sensor| sensor["outcome"].as_str()).collect();
    assert_eq!(outcomes, ["adapted"; 4], "{adapted}");
    drop(emulator);
    let kept = |store: &Store| store.calibrations().serving(None, &[]).unwrap().calibrations.len();
    let second = tempfile::tempdir().unwrap();
    let (_holding, ran) = on_emulator(second.path(), &["--object", "ball"], &["adapt"]);
    let refused = ["something is in the hand", "Take it out and close again"].iter().all(|text| ran.err.contains(text));
    assert!(ran.code == Some(1) && refused, "{ran:?}");
    assert!(ran.err.contains("`palpate trials restore 1`"), "{ran:?}");
    let store = Store::open(&second.path().join("trials.sqlite")).unwrap();
    assert_eq!(
        (kept(&store), store.list(false).unwrap().len()),
        (0, 0),
        "nothing is calibrated by a ball, nor learned"
    );
}
