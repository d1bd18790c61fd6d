//! The emulated gripper over a real pseudo-terminal, with everything that can go wrong: what is recorded is what was sent,
//! what is missing is said, the stream goes on by itself, and the doctor names cause and fix.

#![cfg(unix)]

use crate::program::{palpate, ran, refused};
use crate::serial::start;
use palpate_device::serial::{LinkOptions, SerialLink};
use palpate_store::Store;
use palpate_tactile::trial::BoardLog;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
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
            assert!(began.elapsed() < Duration::from_secs(20), "no link appeared");
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

    /// The counts of every sample that its board printed.
    fn sent(&self) -> Vec<Vec<f32>> {
        let text = std::fs::read_to_string(self.folder.join("sent.txt")).unwrap();
        let samples = text.lines().filter(|line| line.starts_with("t_us:"));
        samples.map(|line| line.split(',').skip(2).take(4).map(number).collect()).collect()
    }
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

/// Ctrl+C.
fn interrupt(child: &Child) {
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
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

/// Finds every recorded reading among what was sent, in its order: which of the sent ones they are.
fn among(sent: &[Vec<f32>], trial: &BoardLog) -> Vec<usize> {
    let mut from = 0;
    let find = |reading: &palpate_tactile::board::Reading| {
        let same =
            |sent: &Vec<f32>| sent.iter().zip(&reading.counts).all(|(sent, got)| got.is_none_or(|got| got == *sent));
        let at = from + sent[from..].iter().position(same).unwrap_or_else(|| panic!("nobody sent {reading:?}"));
        from = at + 1;
        at
    };
    trial.readings.iter().map(find).collect()
}

/// What a fault must come to in four seconds at 50 Hz, of which it takes seven tenths from 1.6 s on.
struct Case {
    faults: &'static str,
    /// More than so many readings are missing in the middle, and no more than so many.
    missing: [usize; 2],
    /// A part of the cause of some gap.
    cause: &'static str,
    reconnects: u64,
}

const fn case(faults: &'static str, missing: [usize; 2], cause: &'static str) -> Case {
    Case { faults, missing, cause, reconnects: 0 }
}

/// Everything is recorded through these; or what is missing is known to be.
const CASES: [Case; 12] = [
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
    Case { reconnects: 1, ..case("vanish@1.6/0.7", [30, 110], "unplugged") },
];

fn survives(case: &Case) {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &["--faults", case.faults]);
    let (found, trial) = recorded(&emulated, "4.0");
    let sent = emulated.sent();
    let kept = among(&sent, &trial);
    let whole: Vec<usize> = kept.windows(2).map(|pair| pair[1] - pair[0] - 1).collect();
    let missing: usize = whole.iter().sum();
    let faults = case.faults;
    let [least, most] = case.missing;
    assert!((least..=most).contains(&missing), "{faults}: {missing} are missing: {found}");
    assert_eq!(found["lost"], missing, "{faults}: what is missing is said: {found}, {:?}", trial.gaps);
    assert_eq!(found["reconnects"], case.reconnects, "{faults}: {found}");
    assert_eq!(found["dropped"], serde_json::json!([0, 0]), "{faults}");
    // It goes on to the end: the last reading is no older than a burst, and what a busy machine is behind by.
    let behind = (found["delay_p95_ms"].as_f64().unwrap() * 0.05) as usize;
    assert!(
        kept[kept.len() - 1] + 25 + behind > sent.len() && trial.readings.len() + missing > 100,
        "{faults}: {found}"
    );
    assert_eq!(missing > 0, !trial.gaps.is_empty(), "{faults}: {:?}", trial.gaps);
    assert!(missing == 0 || trial.gaps.iter().any(|gap| gap.cause.contains(case.cause)), "{faults}: {:?}", trial.gaps);
    assert!(trial.readings.windows(2).all(|pair| pair[0].t_s < pair[1].t_s), "{faults}: time goes on");
    if faults.starts_with("nan") {
        let without = trial.readings.iter().filter(|reading| reading.counts[3].is_none()).count();
        assert!((30..40).contains(&without) && trial.readings.iter().all(|r| r.counts[0].is_some()), "{without}");
    }
    let events = emulated.end();
    assert!(events.iter().any(|event| event["event"] == "host-came"), "{events:?}");
    assert_eq!(faults.is_empty(), !events.iter().any(|event| event["event"] == "fault"), "{events:?}");
}

#[test]
fn whatever_fails_nothing_is_invented_and_what_is_missing_is_said() {
    // They wait more than they work, so all at once.
    std::thread::scope(|scope| {
        let cases: Vec<_> = CASES.iter().map(|case| (case, scope.spawn(move || survives(case)))).collect();
        let failed: Vec<&str> = cases.into_iter().filter_map(|(c, t)| t.join().is_err().then_some(c.faults)).collect();
        assert!(failed.is_empty(), "these failed: {failed:?}");
    });
}

#[test]
fn a_board_that_restarts_counts_anew_and_its_readings_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &["--faults", "reset@1/0.5"]);
    let (found, trial) = recorded(&emulated, "3");
    let kept = among(&emulated.sent(), &trial);
    assert!(kept.len() > 100 && kept.windows(2).all(|pair| pair[1] == pair[0] + 1), "{found}");
    assert!(trial.readings.windows(2).all(|pair| pair[0].t_s < pair[1].t_s), "time goes on");
    assert_eq!(trial.gaps.len(), 1, "{:?}", trial.gaps);
    let gap = &trial.gaps[0];
    assert!((0.3..0.8).contains(&(gap.to_s - gap.from_s)), "{gap:?}");
}

#[test]
fn a_port_that_another_program_has_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &[]);
    let store = folder.path().join("trials.sqlite");
    let other = SerialLink::open(&LinkOptions { path: Some(emulated.port()), ..LinkOptions::default() }).unwrap();
    let record = |wait: &str| {
        let mut command = palpate(&store);
        command.arg("record").arg("--port").arg(emulated.port()).args(["--seconds", "1", "--json", "--wait", wait]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        start(command)
    };
    let refused = ran(&record("0").wait_with_output().unwrap());
    assert!(refused.code == Some(1) && refused.err.contains("it is open in another program"), "{refused:?}");
    let waits = record("60");
    std::thread::sleep(Duration::from_millis(1500));
    drop(other);
    let recorded = ran(&waits.wait_with_output().unwrap());
    assert!(recorded.code == Some(0) && recorded.err.contains("retrying each second"), "{recorded:?}");
    let found: Value = serde_json::from_str(&recorded.out).unwrap();
    assert!(found["samples"].as_u64() > Some(30) && found["baud"] == 115_200, "{found}");
}

#[test]
fn a_clock_that_wraps_is_no_gap() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &["--clock-start", "4293967295"]);
    let (found, trial) = recorded(&emulated, "2.5");
    assert!(trial.gaps.is_empty() && found["lost"] == 0 && trial.readings.len() > 90, "{found}");
    // The first readings are placed by when they arrived.
    for pair in trial.readings[10..].windows(2) {
        assert!((pair[1].t_s - pair[0].t_s - 0.02).abs() < 5e-3, "{pair:?}");
    }
}

#[test]
fn a_thousand_samples_a_second_on_eight_channels_are_all_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &["--rate", "1000", "--channels", "8"]);
    let (found, trial) = recorded(&emulated, "2");
    assert_eq!((&found["lost"], &found["bad_lines"]), (&0.into(), &0.into()), "{found}");
    let numbers: Vec<u64> = trial.readings.iter().map(|reading| reading.seq.unwrap()).collect();
    assert!(numbers.len() > 1500 && numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "{found}");
    assert!(trial.readings.iter().all(|reading| reading.counts.len() == 8));
}

#[test]
fn a_host_drives_the_fingers_through_a_programme() {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), &["--grasp-every", "0", "--without", "hysteresis,drift"]);
    let store = folder.path().join("trials.sqlite");
    let mut command = palpate(&store);
    command.arg("record").arg("--port").arg(emulated.port()).args(["--drive", "--json"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let output = start(command).wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
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
    let emulated = Emulated::new(folder.path(), &["--grasp-every", "0", "--faults", "silent@3/60"]);
    let mut command = palpate(&folder.path().join("trials.sqlite"));
    command.args(["record", "--drive", "--port"]).arg(emulated.port()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let ran = ran(&start(command).wait_with_output().unwrap());
    assert!(ran.code == Some(1) && ran.err.contains("no readable line came from the board for 0."), "{ran:?}");
    assert!(ran.err.contains("palpate doctor") && ran.out.contains("flagged"), "{ran:?}");
    let bars = std::fs::read_to_string(folder.path().join("sent.txt")).unwrap();
    let bars: Vec<f32> =
        bars.lines().filter_map(|line| line.split_once(",p_bar:")?.1.split(',').next()?.parse().ok()).collect();
    let most = bars.iter().copied().fold(0.0, f32::max);
    assert!(most > 0.0 && most < 1.0, "not to the end of the programme: {most}");
    assert!(!emulated.end().iter().any(|event| event["event"] == "watchdog"), "it was told to vent");
}

/// What the doctor says of a fault: which checks are not content.
fn diagnosed(arguments: &[&str], seconds: &str) -> (i32, Vec<(String, String)>, Value) {
    let folder = tempfile::tempdir().unwrap();
    let emulated = Emulated::new(folder.path(), arguments);
    let mut command = palpate(&folder.path().join("unused.sqlite"));
    command.arg("doctor").arg(emulated.port()).args(["--seconds", seconds, "--json"]);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let output = start(command).wait_with_output().unwrap();
    let found: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {output:?}"));
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap_or_default().to_owned();
    let findings = found["findings"].as_array().unwrap();
    for finding in findings.iter().filter(|finding| ["note", "failed"].contains(&text(finding, "verdict").as_str())) {
        let all = ["cause", "fix", "command"];
        assert!(all.iter().all(|part| !text(finding, part).is_empty()), "{finding}");
    }
    let wrong = findings.iter().filter(|finding| !["passed", "skipped"].contains(&text(finding, "verdict").as_str()));
    let wrong = wrong.map(|finding| (text(finding, "check"), text(finding, "verdict"))).collect();
    (output.status.code().unwrap_or(-1), wrong, found)
}

#[test]
fn the_doctor_finds_each_fault_and_nothing_in_a_sound_gripper() {
    // A strip is bent and each pad pressed meanwhile, as the doctor asks for.
    let moving = "rest=0.2; angleL=60 hold=0.4; rest=0.4; angleR=60 hold=0.4; rest=0.4; load=2N hold=0.5; rest=9";
    let cases: [(&str, &[&str], &str, &str); 9] = [
        ("", &[], "3", ""),
        ("saturation=2@0", &[], "3", "saturation"),
        ("open=0@0", &[], "3", "open-circuit"),
        ("nan=1@0", &[], "3", "open-circuit"),
        ("crosstalk=0.2@0", &[], "3", "crosstalk"),
        ("loss=0.2@1/30", &[], "3", "rate"),
        ("garbage@1/1", &[], "6", "lines"),
        ("tenbit@0", &[], "6", "bits"),
        ("silent@0/60", &[], "3", "silence"),
    ];
    std::thread::scope(|scope| {
        let look = |(faults, more, seconds, _): &(&str, &[&str], &str, &str)| {
            let arguments = [&["--faults", faults, "--script", moving], *more].concat();
            diagnosed(&arguments, seconds)
        };
        let looks: Vec<_> = cases.iter().map(|case| (case, scope.spawn(move || look(case)))).collect();
        for ((faults, _, _, check), look) in looks {
            let (code, wrong, found) = look.join().unwrap();
            let wrong: Vec<&str> =
                wrong.iter().filter(|(_, verdict)| verdict == "failed").map(|(c, _)| c.as_str()).collect();
            let want: Vec<&str> = check.split_whitespace().collect();
            assert_eq!((code, &wrong), (i32::from(!want.is_empty()), &want), "{faults}: {found:#}");
        }
    });
    // It is found by trying, and worth a note. Not beside the others: a host that is late loses bytes at speeds it tries.
    let (code, wrong, found) = diagnosed(&["--baud", "250000"], "9");
    assert!(code == 0 && wrong.contains(&("baud".to_owned(), "note".to_owned())), "{found:#}");
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
    std::thread::sleep(Duration::from_millis(300));
    assert_ne!(std::fs::read_link(emulated.port()).unwrap(), Path::new("/dev/pts/9999"));
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
