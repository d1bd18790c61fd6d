//! The real gripper's side, over real pseudo-terminals: `palpate record` as a user would run it.
#![cfg(unix)]

use crate::bench::HANG;
use crate::program::{Ran, palpate, ran, refused};
use palpate_store::Store;
use palpate_tactile::board::Reading;
use serialport::{SerialPort, TTYPort};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Held while a program is started, so that none inherits an end of a pseudo-terminal that is being made: it would never
/// be seen to vanish.
static STARTING: Mutex<()> = Mutex::new(());

/// The two ends of a pseudo-terminal, closed in programs that are started later.
fn pair() -> (TTYPort, TTYPort) {
    let _alone = STARTING.lock().unwrap();
    let (board, port) = TTYPort::pair().unwrap();
    (board.try_clone_native().unwrap(), port.try_clone_native().unwrap())
}

pub(crate) fn start(mut command: Command) -> Child {
    let _alone = STARTING.lock().unwrap();
    command.spawn().unwrap()
}

/// A board that sends a hundred lines a second until it is dropped, and remembers what it was told.
struct Board {
    link: PathBuf,
    stop: Arc<AtomicBool>,
    /// It is connected and says nothing.
    silent: Arc<AtomicBool>,
    sent: Arc<AtomicU32>,
    thread: Option<JoinHandle<Vec<u8>>>,
}

fn line(i: u32) -> String {
    format!("t_us:{},seq:{i},flexL:{},flexR:2100,fsrL:12.5,fsrR:0\n", 10_000 * u64::from(i), 1000 + i % 3000)
}

impl Board {
    /// Plugs it in at `link`, counting from `first` on.
    fn plug_in(link: &Path, first: u32) -> Self {
        let (mut board, port) = pair();
        let _old = std::fs::remove_file(link);
        std::os::unix::fs::symlink(port.name().unwrap(), link).unwrap();
        board.set_timeout(Duration::from_millis(1)).unwrap();
        let (stop, sent) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU32::new(first)));
        let silent = Arc::new(AtomicBool::new(false));
        let (stopped, silenced, count) = (Arc::clone(&stop), Arc::clone(&silent), Arc::clone(&sent));
        let thread = std::thread::spawn(move || {
            let (mut result, mut buffer, start) = (Vec::new(), [0; 256], Instant::now());
            let hello = b"\n# tactile-gripper fw=1 adc=12 vref=3.3 rate=100 ch=flexL,flexR,fsrL,fsrR\n";
            let _unheard = board.write_all(hello);
            let mut i = first;
            while !stopped.load(Ordering::Relaxed) {
                if silenced.load(Ordering::Relaxed) {
                    std::thread::sleep(Duration::from_millis(10));
                    continue;
                }
                // A full buffer means that nobody listens.
                let _unheard = board.write_all(line(i).as_bytes());
                i += 1;
                count.store(i, Ordering::Relaxed);
                if let Ok(n) = board.read(&mut buffer) {
                    result.extend_from_slice(&buffer[..n]);
                    // It acknowledges each command for the fingers.
                    let lines = buffer[..n].split(|byte| *byte == b'\n').map(String::from_utf8_lossy);
                    for command in lines.filter(|line| line.starts_with('P') || *line == "V") {
                        let bar: f64 = command[1..].trim().parse().unwrap_or(0.0);
                        let _unheard = board.write_all(format!("# ok p={bar:.2}\n").as_bytes());
                    }
                }
                let due = start + Duration::from_millis(10) * (i - first);
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
            }
            drop(port);
            result
        });
        Self { link: link.to_owned(), stop, silent, sent, thread: Some(thread) }
    }

    /// Unplugs it; what it was told, and how many lines it had sent.
    fn unplug(mut self) -> (String, u32) {
        // Its number may be another's the moment it is free.
        std::fs::remove_file(&self.link).unwrap();
        self.stop.store(true, Ordering::Relaxed);
        let result = self.thread.take().unwrap().join().unwrap();
        (String::from_utf8(result).unwrap(), self.sent.load(Ordering::Relaxed))
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

fn record(folder: &Path, port: &Path, arguments: &[&str]) -> Command {
    let mut command = palpate(&folder.join("trials.sqlite"));
    command.arg("record").arg("--port").arg(port).args(["--json", "--object", "lemon"]).args(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn result(child: Child) -> serde_json::Value {
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Ctrl+C.
pub(crate) fn interrupt(child: &Child) {
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

/// What ends a driven grasp where the machine is too busy for board and host to hear each other in time: the fingers are
/// vented, as they should be.
pub(crate) const TOO_BUSY: [&str; 3] = ["did not acknowledge", "vented on its own", "no readable line came"];

/// Runs a command that drives a board to its end, and again where it ended by one of these causes.
pub(crate) fn finished<B>(too_busy: &[&str], mut begin: impl FnMut() -> (B, Command)) -> (B, Ran) {
    for _ in 0..10 {
        let (board, mut command) = begin();
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let ran = ran(&start(command).wait_with_output().unwrap());
        if !too_busy.iter().any(|cause| ran.err.contains(cause)) {
            return (board, ran);
        }
    }
    panic!("the machine is too busy to drive a board");
}

/// Waits until a trial has readings in the store.
fn wait_for_samples(store: &Path, trial: usize, samples: i64) {
    let start = Instant::now();
    loop {
        let rows = if store.exists() { Store::open(store).unwrap().list(false).unwrap() } else { Vec::new() };
        if rows.get(trial).is_some_and(|row| row.samples >= samples) {
            return;
        }
        assert!(start.elapsed() < HANG, "{rows:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_second_of_a_board_is_a_trial_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let port = folder.path().join("due");
    let board = Board::plug_in(&port, 0);
    let result = result(start(record(folder.path(), &port, &["--seconds", "1"])));
    board.unplug();
    assert_eq!((&result["lost"], &result["bad_lines"], &result["reconnects"]), (&0.into(), &0.into(), &0.into()));
    let samples = result["samples"].as_u64().unwrap();
    assert!(result["trial_id"] == 1 && samples > 50, "{result}");
    assert!((result["rate_hz"].as_f64().unwrap() - 100.0).abs() < 1.0 && result["jitter_p95_ms"].is_f64(), "{result}");
    let store = Store::open(&folder.path().join("trials.sqlite")).unwrap();
    let trial = store.board_log(1).unwrap().unwrap();
    for pair in trial.readings.windows(2) {
        assert_eq!(pair[1].seq.unwrap(), pair[0].seq.unwrap() + 1);
        assert!(pair[1].t_s > pair[0].t_s);
    }
    // What was recorded is heard again from its bytes.
    let out = folder.path().join("out.csv");
    let text = crate::program::run(folder.path(), &["trials", "export", "1", "--out", out.to_str().unwrap()]);
    assert_eq!(text.code, Some(0), "{text:?}");
    assert_eq!(std::fs::read_to_string(&out).unwrap().lines().count() as u64, samples + 1);
    let again = start(record(folder.path(), &out.with_extension("bytes"), &["--speed", "0"]));
    let again = self::result(again);
    assert!(again["samples"].as_u64().unwrap() >= samples && again["lost"] == 0, "{again}");
    let shown = crate::program::json(folder.path(), &["trials", "show", "1", "--json"]);
    assert_eq!(shown["cadence"]["samples"], samples);
}

#[test]
fn a_board_that_vanishes_while_it_is_recorded_leaves_a_gap_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let (port, store) = (folder.path().join("due"), folder.path().join("trials.sqlite"));
    let board = Board::plug_in(&port, 0);
    let child = start(record(folder.path(), &port, &[]));
    wait_for_samples(&store, 0, 50);
    let (_, sent) = board.unplug();
    let board = Board::plug_in(&port, sent + 50);
    // More than the first board sent.
    wait_for_samples(&store, 0, i64::from(sent) + 20);
    interrupt(&child);
    let result = result(child);
    board.unplug();
    assert_eq!(result["reconnects"], 1, "{result}");
    let trial = Store::open(&store).unwrap().board_log(1).unwrap().unwrap();
    assert_eq!(trial.gaps.len(), 1, "{:?}", trial.gaps);
    assert!(trial.gaps[0].cause.contains("unplugged") && trial.gaps[0].lost >= Some(50), "{:?}", trial.gaps);
    let numbers: Vec<u64> = trial.readings.iter().map(|reading| reading.seq.unwrap()).collect();
    let jumps: Vec<u64> = numbers.windows(2).map(|pair| pair[1] - pair[0]).filter(|jump| *jump != 1).collect();
    assert_eq!(jumps, [trial.gaps[0].lost.unwrap() + 1]);
    for reading in &trial.readings {
        assert_eq!(reading.counts[0], Some((1000 + reading.seq.unwrap() % 3000) as f32));
    }
}

#[test]
fn a_board_that_does_not_come_back_leaves_a_gap_to_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let (port, store) = (folder.path().join("due"), folder.path().join("trials.sqlite"));
    let board = Board::plug_in(&port, 0);
    let child = start(record(folder.path(), &port, &["--seconds", "6"]));
    wait_for_samples(&store, 0, 50);
    board.unplug();
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.code() == Some(1) && said.contains("ended early, and is stored"), "{said}");
    let result: serde_json::Value = serde_json::from_slice(&ended.stdout).unwrap();
    let trial = Store::open(&store).unwrap().board_log(1).unwrap().unwrap();
    let [gap] = &trial.gaps[..] else { panic!("{:?}", trial.gaps) };
    assert!(gap.cause.contains("unplugged") && gap.lost.is_none() && gap.to_s - trial.course.began_s >= 6.0, "{gap:?}");
    assert_eq!(gap.from_s, trial.readings.last().unwrap().t_s);
    assert!(result["warnings"].to_string().contains("interrupted"), "{result}");
}

#[test]
fn a_recording_that_ends_with_its_port_is_a_failure() {
    let folder = tempfile::tempdir().unwrap();
    let (port, store) = (folder.path().join("due"), folder.path().join("trials.sqlite"));
    let board = Board::plug_in(&port, 0);
    let child = start(record(folder.path(), &port, &["--seconds", "60", "--no-reconnect"]));
    wait_for_samples(&store, 0, 50);
    board.unplug();
    let ended = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.code() == Some(1) && said.contains("ended early, and is stored"), "{said}");
    let trial = Store::open(&store).unwrap().board_log(1).unwrap().unwrap();
    assert!((50..5000).contains(&trial.readings.len()), "{}", trial.readings.len());
}

#[test]
fn a_kill_loses_nothing_that_waited_to_be_written_and_no_other_trial() {
    let folder = tempfile::tempdir().unwrap();
    let (port, store) = (folder.path().join("due"), folder.path().join("trials.sqlite"));
    let board = Board::plug_in(&port, 0);
    let first = result(start(record(folder.path(), &port, &["--seconds", "0.3"])));
    let mut child = start(record(folder.path(), &port, &[]));
    wait_for_samples(&store, 1, 100);
    // What was sent is written though nothing follows it.
    board.silent.store(true, Ordering::Relaxed);
    let newest = || Some(u64::from(board.sent.load(Ordering::Relaxed)) - 1);
    let kept = |trial: i64| Store::open(&store).unwrap().board_log(trial).unwrap().unwrap().readings;
    let began = Instant::now();
    while kept(2).last().unwrap().seq != newest() {
        assert!(began.elapsed() < HANG, "{:?} was sent, {:?} was kept", newest(), kept(2).last());
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!((first["samples"].as_u64(), kept(2).last().unwrap().seq), (Some(kept(1).len() as u64), newest()));
    board.unplug();
    let found = Store::open(&store).unwrap();
    assert!(found.board_bytes(2).unwrap().is_some());
    let states: Vec<String> = found.list(false).unwrap().into_iter().map(|row| row.state).collect();
    assert_eq!(states, ["complete", "recording"]);
}

#[test]
fn an_end_by_ctrl_c_is_an_end_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let (port, store) = (folder.path().join("due"), folder.path().join("trials.sqlite"));
    let board = Board::plug_in(&port, 0);
    let child = start(record(folder.path(), &port, &[]));
    wait_for_samples(&store, 0, 50);
    interrupt(&child);
    let result = result(child);
    board.unplug();
    assert!(result["samples"].as_u64().unwrap() >= 50 && result["lost"] == 0, "{result}");
    assert_eq!(Store::open(&store).unwrap().list(false).unwrap()[0].state, "complete");
}

#[test]
fn two_programs_record_two_boards_into_one_store() {
    let folder = tempfile::tempdir().unwrap();
    let ports: Vec<PathBuf> = ["left", "right"].iter().map(|name| folder.path().join(name)).collect();
    let boards: Vec<Board> = ports.iter().map(|port| Board::plug_in(port, 0)).collect();
    let children: Vec<Child> =
        ports.iter().map(|port| start(record(folder.path(), port, &["--seconds", "1"]))).collect();
    let result: Vec<serde_json::Value> = children.into_iter().map(result).collect();
    boards.into_iter().for_each(|board| drop(board.unplug()));
    let store = Store::open(&folder.path().join("trials.sqlite")).unwrap();
    for result in result {
        let trial = store.board_log(result["trial_id"].as_i64().unwrap()).unwrap().unwrap();
        assert_eq!(
            (result["samples"].as_u64(), &result["lost"]),
            (Some(trial.readings.len() as u64), &0.into()),
            "{result}"
        );
        // How many come within a second is up to the machine; none of them may be missing in between.
        let counted = |pair: &[Reading]| pair[0].seq.zip(pair[1].seq).is_none_or(|(a, b)| b == a + 1);
        assert!(
            trial.readings.len() > 50 && trial.gaps.is_empty() && trial.readings.windows(2).all(counted),
            "{result}"
        );
    }
}

#[test]
fn a_driven_grasp_tells_the_board_each_pressure_and_vents() {
    let folder = tempfile::tempdir().unwrap();
    let port = folder.path().join("due");
    let scene = folder.path().join("quick.toml");
    let programme =
        "[programme]\npeak_bar = 0.3\nclose_bar_per_tick = 0.1\nhold_ticks = 8\nrelease_bar_per_tick = 0.3\n";
    std::fs::write(&scene, programme).unwrap();
    let scene = scene.to_string_lossy().into_owned();
    let store = folder.path().join("trials.sqlite");
    let (board, ran) = finished(&TOO_BUSY, || {
        let _old = std::fs::remove_file(&store);
        (Board::plug_in(&port, 0), record(folder.path(), &port, &["--drive", "--scene", &scene]))
    });
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let (lines, _) = board.unplug();
    let said: Vec<&str> = lines.lines().collect();
    let pressures: Vec<&str> = said.iter().copied().filter(|line| line.starts_with('P')).collect();
    assert!(pressures.ends_with(&["P 0.30", "P 0.00"]) || pressures.contains(&"P 0.30"), "{said:?}");
    assert!(said.contains(&"K") && said.last() == Some(&"V"), "{said:?}");
    let trial = Store::open(&folder.path().join("trials.sqlite")).unwrap().board_log(1).unwrap().unwrap();
    let phases: Vec<&str> = trial.course.phases.iter().map(|mark| mark.phase.name()).collect();
    assert!(phases.contains(&"close") && phases.contains(&"hold"), "{phases:?}");
}

#[test]
fn ports_that_cannot_be_recorded_say_cause_and_fix() {
    let folder = tempfile::tempdir().unwrap();
    let port = folder.path().join("due");
    let path = port.to_str().unwrap();
    refused(folder.path(), &["record", "--port", path], &["cannot open port", "no such port", "plugged in"]);
    refused(folder.path(), &["record", "--port", "/dev/null"], &["not a serial port"]);
    let empty = folder.path().join("empty.bytes");
    std::fs::write(&empty, "").unwrap();
    refused(folder.path(), &["record", "--port", empty.to_str().unwrap()], &["has no reading"]);
    let _board = Board::plug_in(&port, 0);
    let _held = serialport::new(path, 115_200).open_native().unwrap();
    refused(folder.path(), &["record", "--port", path], &["it is", "then connect"]);
    let ran = crate::program::run(folder.path(), &["record", "--port", path, "--baud", "1200"]);
    assert!(ran.code == Some(2) && ran.err.contains("erases"), "{ran:?}");
    let listed = crate::program::run(folder.path(), &["record", "--list"]);
    assert_eq!(listed.code, Some(0), "{listed:?}");
    let mut lines = BufReader::new(listed.out.as_bytes()).lines();
    assert!(lines.next().is_some());
}
