//! The emulated gripper with everything that can go wrong: what is recorded is what was sent, what is missing is said, the
//! stream goes on by itself, and the doctor names cause and fix. Faults come on the emulator's own clock, which needs no real
//! time; over a real pseudo-terminal, events are waited for.

#![cfg(unix)]

use crate::bench::HANG;
use crate::calibration::{capture, parts};
use crate::gripper::scene;
use crate::program::{palpate, ran, refused};
use crate::serial::{TOO_BUSY, finished, interrupt, start};
use crate::streams;
use palpate_device::emulator::{EmulatorSetup, HandPlan, parse_faults};
use palpate_device::protocol::BoardEvent;
use palpate_device::serial::{LinkOptions, SerialLink};
use palpate_lab::gripper::SerialGripper;
use palpate_lab::recording::{Recording, TrialRequest, record};
use palpate_sim::objects::EMPTY;
use palpate_store::Store;
use palpate_store::labels::Flag;
use palpate_tactile::board::{Gap, Reading};
use palpate_tactile::trial::{BoardLog, Control};
use serde_json::Value;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// A running `palpate emulate`, ended as by Ctrl+C when dropped.
struct Emulated {
    child: Option<Child>,
    folder: PathBuf,
}

impl Emulated {
    /// Starts it in a folder of its own and waits for its link.
    fn new(folder: &Path, arguments: &[&str]) -> Self {
        let mut command = palpate(&folder.join("unused.sqlite"));
        command
            .args(["emulate", "--link", "port", "--sent", "sent.txt", "--json", "--object", "empty"])
            .args(arguments);
        command.current_dir(folder).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = start(command);
        let emulated = Self { child: Some(child), folder: folder.to_owned() };
        let began = Instant::now();
        while std::fs::symlink_metadata(emulated.port()).is_err() {
            assert!(began.elapsed() < HANG, "no link appeared");
            std::thread::sleep(Duration::from_millis(10));
        }
        emulated
    }

    fn port(&self) -> PathBuf {
        self.folder.join("port")
    }

    /// Ends it; what it told of.
    fn end(mut self) -> Vec<Value> {
        let child = self.child.take().unwrap();
        interrupt(&child);
        let ran = ran(&child.wait_with_output().unwrap());
        assert!(ran.code == Some(0) && ran.err.is_empty(), "{ran:?}");
        assert!(std::fs::symlink_metadata(self.port()).is_err(), "the link is gone");
        ran.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}

/// The counts of every sample in what a board printed.
fn samples(printed: &str) -> Vec<Vec<f32>> {
    let samples = printed.lines().filter(|line| line.starts_with("t_us:"));
    samples.map(|line| line.split(',').skip(2).take(4).map(number).collect()).collect()
}

/// The same of a running emulator, once it has ended.
fn sent(folder: &Path) -> Vec<Vec<f32>> {
    samples(&std::fs::read_to_string(folder.join("sent.txt")).unwrap())
}

impl Drop for Emulated {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _dead = child.kill();
            let _gone = child.wait();
        }
    }
}

fn number(field: &str) -> f32 {
    field.split(':').nth(1).unwrap().parse().unwrap()
}

/// What `palpate record` says and stores of a gripper that is recorded for some seconds.
fn recorded(emulated: &Emulated, seconds: &str) -> (Value, BoardLog) {
    let store = emulated.folder.join("trials.sqlite");
    let mut command = palpate(&store);
    command.arg("record").arg("--port").arg(emulated.port()).args(["--seconds", seconds, "--json"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let output = start(command).wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let id = found["trial_id"].as_i64().unwrap();
    (found, Store::open(&store).unwrap().board_log(id).unwrap().unwrap())
}

/// What a trial of an emulated gripper on a clock of its own came to, and what its board had printed by then.
struct OnItsClock {
    recording: Recording,
    log: BoardLog,
    printed: String,
}

/// Records an emulated gripper with these faults for some seconds of its own time.
fn record_on_its_clock(faults: &str, change: impl Fn(&mut EmulatorSetup), seconds: f64) -> OnItsClock {
    let objects = vec![EMPTY.to_owned()];
    let hand = HandPlan {
        sensors: palpate_tactile::board::SensorList::default(),
        scene: scene(),
        objects,
        seed: 1,
        grasp_every_s: Some(6.0),
        script: vec![],
    };
    let mut setup = EmulatorSetup {
        hand,
        parts: parts(1, true),
        rate_hz: 50,
        channels: 4,
        most_steps: 30,
        clock_start_us: 0,
        faults: parse_faults(faults).unwrap(),
        seed: 1,
    };
    change(&mut setup);
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("trials.sqlite");
    let mut board = streams::emulated(setup, Duration::ZERO);
    let printed = board.printed();
    let request = TrialRequest { object: None, length_s: Some(seconds), control: Control::Free, adds: false };
    let (mut gripper, go_on) = (SerialGripper::new(Box::new(board)), AtomicBool::new(false));
    let recording = record(&mut gripper, &scene(), request, store.clone(), &go_on, &mut |_| {}).unwrap();
    let log = Store::open(&store).unwrap().board_log(recording.trial.id).unwrap().unwrap();
    let printed = printed.lock().unwrap().clone();
    OnItsClock { recording, log, printed }
}

/// Finds every reading among what was sent, in its order: which of the sent ones they are.
fn among(sent: &[Vec<f32>], readings: &[Reading]) -> Vec<usize> {
    let mut from = 0;
    let find = |reading: &Reading| {
        let same =
            |sent: &Vec<f32>| sent.iter().zip(&reading.counts).all(|(sent, got)| got.is_none_or(|got| got == *sent));
        let at = from + sent[from..].iter().position(same).unwrap_or_else(|| panic!("nobody sent {reading:?}"));
        from = at + 1;
        at
    };
    readings.iter().map(find).collect()
}

/// How many are missing between those that are there.
fn missing(kept: &[usize]) -> usize {
    kept.windows(2).map(|pair| pair[1] - pair[0] - 1).sum()
}

/// What a fault must come to in four seconds at 50 Hz, of which it takes seven tenths from 1.6 s on.
struct Case {
    faults: &'static str,
    /// At least so many readings are missing in the middle, and no more than so many.
    missing: [usize; 2],
    /// A part of the cause of some gap.
    cause: &'static str,
}

const fn case(faults: &'static str, missing: [usize; 2], cause: &'static str) -> Case {
    Case { faults, missing, cause }
}

/// Everything is recorded through these; or what is missing is known to be.
const CASES: [Case; 11] = [
    case("", [0, 0], ""),
    case("burst=0.3@1.6/0.7", [0, 0], ""),
    case("clock=200@0", [0, 0], ""),
    case("stuck=0@1.6/0.7", [0, 0], ""),
    case("saturation=2@1.6", [0, 0], ""),
    case("nan=3@1.6/0.7", [0, 0], ""),
    case("loss=0.3@1.6/0.7", [2, 30], ""),
    case("garbage@1.6/0.7", [30, 45], ""),
    case("partial=0.3@1.6/0.7", [2, 40], ""),
    case("byte=0.6@1.6/0.7", [10, 40], ""),
    case("silent@1.6/0.7", [30, 40], ""),
];

#[test]
fn whatever_fails_nothing_is_invented_and_what_is_missing_is_said() {
    for Case { faults, missing: [least, most], cause } in CASES {
        let OnItsClock { recording, log, printed } = record_on_its_clock(faults, |_| {}, 4.0);
        let sent = samples(&printed);
        let kept = among(&sent, &log.readings);
        let (missing, cadence) = (missing(&kept), &recording.trial.about.course.cadence);
        assert!((least..=most).contains(&missing), "{faults}: {missing} are missing: {cadence:?}");
        assert_eq!(cadence.lost, missing as u64, "{faults}: what is missing is said: {cadence:?}, {:?}", log.gaps);
        // It goes on to the end: the last reading is no older than a burst.
        let whole = kept[kept.len() - 1] + 25 > sent.len() && (195..=205).contains(&(log.readings.len() + missing));
        assert!(whole && recording.aborted.is_none(), "{faults}: {cadence:?}");
        assert_eq!(missing > 0, !log.gaps.is_empty(), "{faults}: {:?}", log.gaps);
        assert!(missing == 0 || log.gaps.iter().any(|gap| gap.cause.contains(cause)), "{faults}: {:?}", log.gaps);
        assert!(log.readings.windows(2).all(|pair| pair[0].t_s < pair[1].t_s), "{faults}: time goes on");
        if faults.starts_with("nan") {
            let without = log.readings.iter().filter(|reading| reading.counts[3].is_none()).count();
            assert!((30..40).contains(&without) && log.readings.iter().all(|r| r.counts[0].is_some()), "{without}");
        }
    }
}

#[test]
fn a_trial_in_which_a_sensor_fails_is_flagged_and_names_it() {
    // The hand closes at 0 s and opens from 3 s on, again and again, on nothing: pads are idle, and look so when they are open.
    for (faults, wanted) in [
        ("", None),
        ("burst=0.3@1.6/0.7", None),
        ("silent@1.6/0.7", None),
        ("stuck=0@1", Some("left flex strip stuck")),
        ("open=1@1", Some("right flex strip at an end of its range")),
        ("saturation=2@1", Some("left pad at an end of its range")),
        ("nan=3@1", Some("right pad silent")),
        ("gain=1*0.7@1.5", Some("right flex strip jumped")),
        ("open=3@1", None),
    ] {
        let recording = record_on_its_clock(faults, |_| {}, 4.0).recording;
        let flags = recording.trial.about.flags;
        let found = flags.iter().find(|found| found.flag == Flag::SensorFault).map(|found| found.remark.as_str());
        assert_eq!(found.map(|remark| remark.split(',').next().unwrap()), wanted, "{faults}: {found:?}");
    }
}

#[test]
fn a_sound_gripper_is_recorded_through_a_port_without_a_loss() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &[]);
    let (found, trial) = recorded(&emulated, "2");
    let events = emulated.end();
    let kept = among(&sent(folder.path()), &trial.readings);
    assert!(kept.len() > 50 && missing(&kept) == 0 && found["lost"] == 0 && trial.gaps.is_empty(), "{found}");
    assert!(found["reconnects"] == 0 && found["dropped"] == serde_json::json!([0, 0]), "{found}");
    assert!(events.iter().any(|event| event["event"] == "host-came"), "{events:?}");
    assert!(!events.iter().any(|event| event["event"] == "fault"), "{events:?}");
}

/// Readings and gaps from a link, until enough has come.
fn listen(link: &SerialLink, mut is_enough: impl FnMut(&[Reading]) -> bool) -> (Vec<Reading>, Vec<Gap>) {
    let (mut readings, mut gaps, began) = (Vec::new(), Vec::new(), Instant::now());
    while !is_enough(&readings) {
        assert!(began.elapsed() < HANG, "it hangs after {} readings: {:?}", readings.len(), link.status());
        for event in link.take(Duration::from_millis(50)) {
            match event {
                BoardEvent::Reading(reading) => readings.push(reading),
                BoardEvent::Gap(gap) => gaps.push(gap),
                BoardEvent::Board(_) | BoardEvent::Reply(_) | BoardEvent::Captured(_) => {}
            }
        }
    }
    (readings, gaps)
}

fn open(emulated: &Emulated) -> SerialLink {
    SerialLink::open(&LinkOptions { path: Some(emulated.port()), ..LinkOptions::default() }).unwrap()
}

#[test]
fn a_port_that_vanishes_is_opened_again_and_what_is_missing_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &["--faults", "vanish@1.6/0.7"]);
    let link = open(&emulated);
    let mut back = usize::MAX;
    let (readings, gaps) = listen(&link, |readings| {
        if link.status().reconnects > 0 {
            back = back.min(readings.len());
        }
        readings.len() >= back.saturating_add(60)
    });
    drop(link);
    let events = emulated.end();
    let missing = missing(&among(&sent(folder.path()), &readings));
    assert!(gaps.len() == 1 && gaps[0].cause.contains("unplugged") && gaps[0].lost == Some(missing as u64), "{gaps:?}");
    assert!(missing >= 30, "the port was gone for 0.7 s: {missing}");
    assert!(readings.windows(2).all(|pair| pair[0].t_s < pair[1].t_s), "time goes on");
    assert!(events.iter().any(|event| event["event"] == "fault"), "{events:?}");
}

#[test]
fn a_board_that_restarts_counts_anew_and_its_readings_go_on() {
    let OnItsClock { recording, log, printed } = record_on_its_clock("reset@1.5/0.5", |_| {}, 3.0);
    let kept = among(&samples(&printed), &log.readings);
    assert!(kept.len() > 100 && kept.windows(2).all(|pair| pair[1] == pair[0] + 1), "{recording:?}");
    assert!(log.readings.windows(2).all(|pair| pair[0].t_s < pair[1].t_s), "time goes on");
    let [gap] = &log.gaps[..] else { panic!("{:?}", log.gaps) };
    assert!(gap.is_restart() && (0.3..0.8).contains(&(gap.to_s - gap.from_s)), "{gap:?}");
    let warnings = &recording.trial.warnings;
    assert!(warnings.iter().any(|text| text.contains("the board restarted 1 time(s)")), "{warnings:?}");
    assert!(!warnings.iter().any(|text| text.contains("for certain")), "{warnings:?}");
}

#[test]
fn a_port_that_another_program_has_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &[]);
    let store = folder.path().join("trials.sqlite");
    let other = open(&emulated);
    let record = |wait: &str| {
        let mut command = palpate(&store);
        command.arg("record").arg("--port").arg(emulated.port()).args(["--seconds", "1", "--json", "--wait", wait]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        start(command)
    };
    let refused = ran(&record("0").wait_with_output().unwrap());
    assert!(refused.code == Some(1) && refused.err.contains("it is open in another program"), "{refused:?}");
    let mut waits = record("600");
    let mut said = BufReader::new(waits.stderr.take().unwrap()).lines().map(Result::unwrap);
    assert!(said.any(|line| line.contains("retrying each second")), "it waits");
    drop(other);
    let recorded = ran(&waits.wait_with_output().unwrap());
    assert_eq!(recorded.code, Some(0), "{recorded:?} {:?}", said.collect::<Vec<_>>());
    let found: Value = serde_json::from_str(&recorded.out).unwrap();
    assert!(found["samples"].as_u64() > Some(30) && found["baud"] == 115_200, "{found}");
}

#[test]
fn a_clock_that_wraps_is_no_gap() {
    let starts_us = 4_292_967_295;
    let OnItsClock { recording, log, printed } = record_on_its_clock("", |setup| setup.clock_start_us = starts_us, 2.5);
    assert!(log.gaps.is_empty() && log.readings.len() > 120, "{recording:?}");
    let wraps = printed.contains("\nt_us:4294967295,seq:100,") && printed.contains("\nt_us:19999,seq:101,");
    assert!(wraps, "{} bytes", printed.len());
    // The first readings are placed by when they arrived.
    for pair in log.readings[10..].windows(2) {
        assert!((pair[1].t_s - pair[0].t_s - 0.02).abs() < 5e-3, "{pair:?}");
    }
}

#[test]
fn a_thousand_samples_a_second_on_eight_channels_are_all_recorded() {
    let fast = |setup: &mut EmulatorSetup| (setup.rate_hz, setup.channels) = (1000, 8);
    let OnItsClock { recording, log, .. } = record_on_its_clock("", fast, 2.0);
    let cadence = &recording.trial.about.course.cadence;
    assert_eq!((cadence.lost, cadence.bad_lines), (0, 0), "{cadence:?}");
    let numbers: Vec<u64> = log.readings.iter().map(|reading| reading.seq.unwrap()).collect();
    assert!(numbers.len() > 1900 && numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "{cadence:?}");
    assert!(log.readings.iter().all(|reading| reading.counts.len() == 8));
}

#[test]
fn a_host_drives_the_fingers_through_a_programme() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("trials.sqlite");
    let (emulated, ran) = finished(&TOO_BUSY, || {
        // An earlier one was killed.
        let _old = [&store, &folder.path().join("port")].map(std::fs::remove_file);
        let emulated = Emulated::new(folder.path(), &["--grasp-every", "0", "--without", "hysteresis,drift"]);
        let mut command = palpate(&store);
        command.arg("record").arg("--port").arg(emulated.port()).args(["--drive", "--json"]);
        (emulated, command)
    });
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let trial = Store::open(&store).unwrap().board_log(1).unwrap().unwrap();
    let most = |of: &dyn Fn(&palpate_tactile::board::Reading) -> Option<f64>| {
        trial.readings.iter().filter_map(of).fold(0.0, f64::max)
    };
    assert_eq!(most(&|reading| reading.line_bar), 1.0);
    let flex = |reading: &palpate_tactile::board::Reading| reading.counts[0].map(f64::from);
    let rest = trial.readings.iter().find_map(flex).unwrap();
    assert!(most(&flex) > rest + 250.0, "{rest}");
    let events = emulated.end();
    assert!(events.iter().any(|event| event["event"] == "grasp" && event["object"] == "empty"), "{events:?}");
    assert!(!events.iter().any(|event| event["event"] == "watchdog"), "the host kept itself known: {events:?}");
}

#[test]
fn a_command_that_drives_a_silent_board_vents_it_and_fails() {
    let folder = tempfile::tempdir().unwrap();
    let attempt = || {
        let (emulated, ran) = finished(&TOO_BUSY[..2], || {
            // An earlier one was killed.
            let _old = std::fs::remove_file(folder.path().join("port"));
            let emulated = Emulated::new(folder.path(), &["--grasp-every", "0", "--faults", "silent@3/60"]);
            let mut command = palpate(&folder.path().join("trials.sqlite"));
            command.args(["record", "--drive", "--port"]).arg(emulated.port());
            (emulated, command)
        });
        let bars = std::fs::read_to_string(folder.path().join("sent.txt")).unwrap();
        let bars = bars.lines().filter_map(|line| line.split_once(",p_bar:")?.1.split(',').next()?.parse().ok());
        (emulated, ran, bars.fold(0.0, f32::max))
    };
    // On a busy machine the command may come when the board is silent already.
    let (emulated, ran, most) =
        std::iter::repeat_with(attempt).take(10).find(|(_, _, most)| *most > 0.0).expect("in time");
    assert!(ran.code == Some(1) && ran.err.contains("no readable line came from the board for 0."), "{ran:?}");
    assert!(ran.err.contains("palpate doctor") && ran.out.contains("flagged"), "{ran:?}");
    assert!(most < 1.0, "not to the end of the programme: {most}");
    assert!(!emulated.end().iter().any(|event| event["event"] == "watchdog"), "it was told to vent");
}

/// What the doctor says of a port or a file: its exit code, the checks that failed, and everything.
fn diagnosed(folder: &Path, arguments: &[&str]) -> (Option<i32>, Vec<String>, Value) {
    let mut command = palpate(&folder.join("unused.sqlite"));
    command.arg("doctor").args(arguments).arg("--json").current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let ran = ran(&start(command).wait_with_output().unwrap());
    let found: Value = serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{e}: {ran:?}"));
    let findings = found["findings"].as_array().unwrap();
    for finding in findings.iter().filter(|finding| finding["verdict"] == "note" || finding["verdict"] == "failed") {
        assert!(["cause", "fix"].iter().all(|part| finding[part].is_string()), "{finding}");
    }
    let failed = findings.iter().filter(|finding| finding["verdict"] == "failed");
    let failed = failed.map(|finding| finding["check"].as_str().unwrap().to_owned()).collect();
    (ran.code, failed, found)
}

/// Strips are bent and pads pressed, as the doctor asks for.
const MOVED: &str = "rest=0.2; angleL=60 hold=0.4; rest=0.4; angleR=60 hold=0.4; rest=0.4; load=2N hold=0.5; rest=9";

#[test]
fn the_doctor_finds_each_fault_and_nothing_in_a_sound_gripper() {
    let folder = tempfile::tempdir().unwrap();
    for (faults, check) in [
        ("", None),
        ("burst=0.3@0/60", None),
        ("saturation=2@0", Some("saturation")),
        ("open=0@0", Some("open-circuit")),
        ("nan=1@0", Some("open-circuit")),
        ("crosstalk=0.2@0", Some("crosstalk")),
        ("stuck=0@0.5", Some("movement")),
        ("reset@2/0.5", Some("restarts")),
        ("loss=0.2@1/30", Some("rate")),
        ("garbage@1/1", Some("lines")),
        ("partial@1/1", Some("lines")),
        ("baud@1/1", Some("lines")),
        ("tenbit@0", Some("bits")),
        ("silent@0/60", Some("silence")),
    ] {
        capture(&parts(1, true), MOVED, faults, 8.0, &folder.path().join("hand.bytes"));
        let (code, failed, found) = diagnosed(folder.path(), &["hand.bytes"]);
        let wanted: Vec<String> = check.into_iter().map(str::to_owned).collect();
        assert_eq!((code, &failed), (Some(wanted.len() as i32), &wanted), "{faults}: {found:#}");
        if faults.is_empty() {
            assert_eq!(found["not_checked"], serde_json::json!([]), "{found:#}");
        }
        let is_note = |finding: &Value| finding["check"] == "rate" && finding["verdict"] == "note";
        let late = found["findings"].as_array().unwrap().iter().any(is_note);
        assert!(late || !faults.starts_with("burst"), "{found:#}");
    }
}

#[test]
fn the_doctor_looks_at_a_port() {
    let folder = tempfile::tempdir().unwrap();
    for (faults, wanted) in [("", &[][..]), ("silent@0/600", &["silence"])] {
        let emulated = Emulated::new(folder.path(), &["--script", MOVED, "--faults", faults]);
        let (code, failed, found) = diagnosed(folder.path(), &["port", "--seconds", "4"]);
        assert!(code == Some(wanted.len() as i32) && failed == wanted, "{found:#}");
        let mut findings = found["findings"].as_array().unwrap().iter();
        assert!(findings.all(|finding| finding["verdict"] != "failed" || finding["command"].is_string()), "{found:#}");
        emulated.end();
    }
}

#[test]
fn a_board_at_another_speed_is_found_by_trying() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &["--baud", "250000"]);
    let link = open(&emulated);
    let (readings, _) = listen(&link, |readings| readings.len() > 50);
    assert_eq!((link.status().baud, readings[50].counts.len()), (Some(250_000), 4));
    emulated.end();
}

#[test]
fn the_doctor_names_a_port_that_is_not_there_or_is_none() {
    let folder = tempfile::tempdir().unwrap();
    for (port, words) in [("/dev/ttyACM99", "no such port"), ("/", "not a serial port")] {
        let ran = crate::program::run(folder.path(), &["doctor", port]);
        assert!(ran.code == Some(1) && ran.out.contains(words) && ran.out.contains("1 fault found"), "{ran:?}");
        assert!(ran.out.contains("do:") && ran.err.is_empty(), "{ran:?}");
    }
}

#[test]
fn the_link_replaces_no_file_and_goes_in_the_end() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("precious"), "data").unwrap();
    refused(folder.path(), &["emulate", "--link", "precious"], &["precious", "is not a link"]);
    assert_eq!(std::fs::read_to_string(folder.path().join("precious")).unwrap(), "data");
    refused(folder.path(), &["emulate", "--link", "no/such/folder/port"], &["no/such/folder/port", "folder"]);
    refused(folder.path(), &["emulate", "--link", "port", "--script", "angel=3"], &["angel", "step 1"]);
    std::fs::write(folder.path().join("secrets.json"), "{\"strips\": []}").unwrap();
    refused(
        folder.path(),
        &["emulate", "--link", "port", "--secrets", "secrets.json"],
        &["secrets.json", "--print-secrets"],
    );
    // A link that an earlier one has left behind is taken over.
    std::os::unix::fs::symlink("/dev/pts/9999", folder.path().join("port")).unwrap();
    let emulated = Emulated::new(folder.path(), &[]);
    let began = Instant::now();
    while std::fs::read_link(emulated.port()).unwrap() == Path::new("/dev/pts/9999") {
        assert!(began.elapsed() < HANG, "the old link is still there");
        std::thread::sleep(Duration::from_millis(10));
    }
    emulated.end();
}

#[test]
fn secrets_are_printed_as_they_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut secrets = crate::program::json(folder.path(), &["emulate", "--print-secrets", "--seed", "7"]);
    secrets["pads"][1]["gain"] = 2e-4.into();
    std::fs::write(folder.path().join("mine.json"), secrets.to_string()).unwrap();
    let again = crate::program::json(folder.path(), &["emulate", "--print-secrets", "--secrets", "mine.json"]);
    assert_eq!(again, secrets);
    let without = ["emulate", "--print-secrets", "--secrets", "mine.json", "--without", "noise,drift"];
    let without = crate::program::json(folder.path(), &without);
    assert_eq!(
        (&without["noise_counts"], &without["drift"], &without["hysteresis"]),
        (&0.0.into(), &false.into(), &true.into())
    );
}
