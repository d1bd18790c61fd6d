//! One path for every grasp: the same fault of the same emulated board, recorded as `palpate record` does and as the window
//! does, leaves the same trial.

use crate::calibration::{capture, parts};
use crate::gripper::{Desk, FAST, scene, store_calibrations};
use crate::program::{json, refused, run};
use crate::streams;
use palpate_device::emulator::{EmulatorSetup, HandPlan};
use palpate_device::protocol::{BoardEvent, ConsoleLine};
use palpate_device::serial::{LinkOptions, LinkStatus, SendError, SerialLink};
use palpate_lab::grasping::{Identification, Row, grasp};
use palpate_lab::gripper::{BoardStream, EmulatedStream, SerialGripper};
use palpate_lab::recording::{Replay, TrialRequest, record};
use palpate_lab::workers::GripperCommand;
use palpate_learn::{Shipped, StopRule, Verdict};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_store::labels::Flag;
use palpate_store::{ImportedTrial, Store};
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::{Control, TrialId};
use palpate_tactile::{Channel, SensorLayout, Sensors, Signals};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// What goes wrong, counted from the first pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
enum BoardFault {
    None,
    /// Keep-alives are lost, so that the board vents by itself.
    Vents,
    /// At 1 s the connection breaks.
    Unplugs,
    /// The box stops at 0.5 bar and refuses more.
    Refuses,
    /// At 1.05 s a fault of the emulator begins, and lasts (s).
    Emulated(&'static str, f64),
}

/// When a fault of the emulator begins (s): between two steps of the programme.
const STRIKES_S: f64 = 1.05;

/// The emulated gripper behind a link with a fault.
struct FaultyLink {
    inner: EmulatedStream,
    fault: BoardFault,
    /// First pressure (s).
    driven_s: Option<f64>,
    struck: bool,
}

impl FaultyLink {
    fn new(fault: BoardFault) -> Self {
        let hand = HandPlan {
            sensors: palpate_tactile::board::SensorList::default(),
            scene: slow(),
            objects: vec![EMPTY.to_owned()],
            seed: 1,
            grasp_every_s: None,
            script: vec![],
        };
        let setup = EmulatorSetup {
            hand,
            parts: parts(1, false),
            rate_hz: 50,
            channels: 4,
            most_steps: if fault == BoardFault::Refuses { 10 } else { 30 },
            clock_start_us: 0,
            faults: vec![],
            seed: 1,
        };
        Self { inner: streams::emulated(setup, FAST), fault, driven_s: None, struck: false }
    }

    fn is_past(&self, seconds: f64) -> bool {
        self.driven_s.is_some_and(|driven_s| self.inner.now_s() > driven_s + seconds)
    }
}

impl BoardStream for FaultyLink {
    fn take(&mut self, patience: Duration) -> Vec<BoardEvent> {
        if let BoardFault::Emulated(fault, seconds) = self.fault
            && self.is_past(STRIKES_S)
            && !std::mem::replace(&mut self.struck, true)
        {
            streams::strike(&self.inner, fault, seconds);
        }
        let events = self.inner.take(patience);
        let breaks = self.fault == BoardFault::Unplugs && self.is_past(1.0);
        if !breaks || self.is_past(2.0) {
            return events;
        }
        let cause = "the board was unplugged".to_owned();
        let piece = Captured::Interrupted { at_s: self.inner.now_s(), cause };
        let first = !std::mem::replace(&mut self.struck, true);
        first.then_some(BoardEvent::Captured(piece)).into_iter().collect()
    }

    fn status(&self) -> LinkStatus {
        self.inner.status()
    }

    fn now_s(&self) -> f64 {
        self.inner.now_s()
    }

    fn send(&mut self, line: &str) -> Result<(), SendError> {
        if line.starts_with('P') {
            self.driven_s.get_or_insert(self.inner.now_s());
        }
        if self.fault == BoardFault::Vents && line == "K" {
            return Ok(());
        }
        self.inner.send(line)
    }

    fn console(&self) -> Vec<ConsoleLine> {
        self.inner.console()
    }

    fn is_over(&self) -> bool {
        self.inner.is_over()
    }
}

/// A programme that holds for longer than the board's watchdog waits.
fn slow() -> Scene {
    let mut slow = scene();
    slow.programme.hold_ticks = 15;
    slow
}

/// What must not depend on who records.
#[derive(Clone, Debug, PartialEq)]
struct Essence {
    flags: Vec<Flag>,
    warnings: Vec<String>,
    channels: Vec<String>,
    phases: Vec<(Phase, Option<f64>)>,
    /// From the first reading to the closing, and to the last reading, in steps of a twentieth of a second.
    lead: i64,
    span: i64,
}

impl Essence {
    fn new(store: &Store, id: TrialId, warnings: &[String]) -> Self {
        let info = store.board_info(id).unwrap().unwrap();
        let trial = store.board_log(id).unwrap().unwrap();
        let [first, last] = [trial.readings.first(), trial.readings.last()].map(|reading| reading.unwrap().t_s);
        let closing = trial.course.phases.first().unwrap().from_s;
        let steps = |seconds: f64| (seconds / 0.05).round() as i64;
        Self {
            flags: info.flags.iter().map(|found| found.flag).collect(),
            warnings: warnings.to_vec(),
            channels: trial.course.board.channels.clone(),
            phases: trial.course.phases.iter().map(|mark| (mark.phase, mark.line_bar)).collect(),
            lead: steps(closing - first),
            span: steps(last - first),
        }
    }
}

fn request() -> TrialRequest {
    TrialRequest { object: Some("lemon".to_owned()), length_s: None, control: Control::Driven, adds: false }
}

fn by_command(fault: BoardFault) -> Essence {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trials.sqlite");
    let mut gripper = SerialGripper::new(Box::new(FaultyLink::new(fault)));
    let stop = AtomicBool::new(false);
    let recording = record(&mut gripper, &slow(), request(), path.clone(), &stop, &mut |_| ()).unwrap();
    assert_eq!(recording.aborted.is_some(), fault != BoardFault::None);
    Essence::new(&Store::open(&path).unwrap(), recording.trial.id, &recording.trial.warnings)
}

fn by_window(fault: BoardFault) -> Essence {
    let mut desk = Desk::on(Arc::new(move |_, _| Ok(Box::new(FaultyLink::new(fault)))));
    desk.connect();
    // A command also begins with some tenths of a second of what came before.
    desk.until(|view| view.link.as_ref().is_some_and(|link| link.now_s > 1.0));
    desk.command(GripperCommand::SetScene(Box::new(slow())));
    desk.command(GripperCommand::Begin(request()));
    let ended = desk.until(|view| view.ended.is_some()).ended.clone().unwrap();
    Essence::new(&desk.store(), ended.id, &ended.warnings)
}

/// The trial of a fault, by the command line and the window alike.
fn by_both(fault: BoardFault) -> Essence {
    let (mut command, mut window) = (by_command(fault), by_window(fault));
    // The clock of the emulator advances in steps of a look, and so a last step of the programme may just be due.
    let apart = (command.lead - window.lead).abs() + (command.span - window.span).abs();
    assert!(apart <= 2, "{fault:?}: {command:?}\n{window:?}");
    let steps = command.phases.len().min(window.phases.len());
    assert!(command.phases.len().max(window.phases.len()) <= steps + 1, "{fault:?}: {command:?}\n{window:?}");
    window.phases.truncate(steps);
    command.phases.truncate(steps);
    // That step is named, too.
    let nameless =
        |warnings: &[String]| warnings.iter().map(|text| text.replace(|c: char| c.is_ascii_digit(), "0")).collect();
    let found = Essence { lead: command.lead, span: command.span, warnings: nameless(&window.warnings), ..window };
    assert_eq!(Essence { warnings: nameless(&command.warnings), ..command.clone() }, found, "{fault:?}");
    command
}

#[test]
fn the_same_fault_leaves_the_same_trial_from_the_command_line_and_from_the_window() {
    let faults = [BoardFault::None, BoardFault::Vents, BoardFault::Unplugs, BoardFault::Refuses];
    let [sound, vents, unplugs, refuses] = faults.map(by_both);
    assert!(sound.flags.iter().all(|flag| *flag == Flag::NoContact) && sound.warnings.is_empty(), "{sound:?}");
    for (cut, cause) in [(vents, "watchdog"), (unplugs, "unplugged"), (refuses, "above-maximum")] {
        assert!(cut.flags.contains(&Flag::Interrupted), "{cut:?}");
        assert!(cut.warnings.iter().any(|text| text.contains(cause)), "{cut:?}");
        assert!(cut.span < sound.span && cut.lead.abs_diff(sound.lead) <= 1, "{cut:?}\n{sound:?}");
    }
}

#[test]
fn no_air_flows_into_a_hand_of_whose_board_nothing_is_known() {
    for (fault, seconds, cause, most_bar) in [
        ("silent", 60.0, "no readable line came from the board for 0.", 0.75),
        ("garbage", 60.0, "no readable line came from the board for 0.", 0.75),
        ("reset", 0.2, "the board restarted", 0.7),
        ("reset", 9.0, "no readable line came from the board for 0.", 0.75),
        ("deaf", 60.0, "did not acknowledge 0.60 bar within 0.3 s", 0.75),
        ("noanswer", 60.0, "did not acknowledge 0.60 bar within 0.3 s", 0.75),
        ("wronganswer=1.5", 60.0, "acknowledged 1.50 bar where 0.60 bar was asked", 0.6),
        ("wrongpressure=0", 60.0, "reports 0.00 bar where 0.", 0.75),
        ("wrongpressure=1.5", 60.0, "reports 1.50 bar where 0.6", 0.65),
    ] {
        let found = by_both(BoardFault::Emulated(fault, seconds));
        assert!(found.flags.contains(&Flag::Interrupted), "{fault}: {found:?}");
        assert!(found.warnings.iter().any(|text| text.contains(cause)), "{fault}: {found:?}");
        let most = found.phases.iter().filter_map(|(_, bar)| *bar).fold(0.0, f64::max);
        assert!((0.54..most_bar + 0.01).contains(&most), "{fault}: {most} bar, {found:?}");
    }
}

/// Rows as text, because undefined values differ from themselves, and the last answer.
fn played(mut replay: Replay) -> (Vec<String>, Option<Verdict>) {
    let row = || replay.next_row().unwrap().map(|row| format!("{row:?}"));
    let rows = std::iter::from_fn(row).collect();
    (rows, replay.identification().and_then(|own| own.verdict()).cloned())
}

#[test]
fn a_replayed_simulation_gives_the_rows_and_the_answer_of_the_live_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = Scene::default();
    scene.object.source = "lemon".to_owned();
    let trial = grasp(&scene, scene.load_object().unwrap().as_ref(), 0);
    let model = Arc::new(Shipped::PerfectSensors.model().unwrap());
    let mut live = Identification::new(Arc::clone(&model), StopRule::default());
    let more = live.channels_on(&scene.gripper).unwrap();
    let mut reader = Sensors::new(&SensorLayout::named("C1+F").unwrap(), &scene.gripper, more[0].signals).unwrap();
    reader.add(&more);
    live.begin_grasp(reader.channels().iter().map(Channel::name).enumerate()).unwrap();
    let rows: Vec<_> = trial.frames().iter().map(|frame| Row::of_frame(frame, &reader)).collect();
    for row in &rows {
        live.push(row.t_s, row);
    }
    live.end_grasp();
    let mut store = Store::open(&folder.path().join("trials.sqlite")).unwrap();
    let id = store.insert(&trial).unwrap().id();
    let (replayed, verdict) = played(Replay::of_trial(&store, id, Some(model)).unwrap());
    assert!(verdict.is_some() && verdict.as_ref() == live.verdict());
    assert_eq!(replayed, rows.iter().map(|row| format!("{row:?}")).collect::<Vec<_>>());
    drop(store);
    let played = json(folder.path(), &["replay", "1", "--json"]);
    assert_eq!(
        (played["rows"].as_array().unwrap().len(), &played["decided"]),
        (300, &"lemon".into()),
        "{}",
        played["pmf"]
    );
    assert!(played["rows"][0]["class"].is_null() && played["rows"][299]["class"] == "lemon");
    let text = run(folder.path(), &["replay", "1", "--speed", "0"]);
    assert!(text.out.lines().count() == 301 && text.err.contains("recognised as lemon"), "{text:?}");
    refused(folder.path(), &["replay", "9"], &["no trial 9"]);
    refused(folder.path(), &["replay", "gone.bytes"], &["gone.bytes", "number of a trial"]);
}

#[test]
fn captured_bytes_replay_as_the_trial_that_is_recorded_from_them() {
    let folder = tempfile::tempdir().unwrap();
    let (at, bytes) = (folder.path(), folder.path().join("grasp.bytes"));
    let parts = parts(1, false);
    store_calibrations(&at.join("trials.sqlite"), &parts);
    capture(&parts, "rest=2.5; close empty bar=0.8; rest=3", "", 12.0, &bytes);
    json(at, &["record", "--port", "grasp.bytes", "--speed", "0", "--json"]);
    let mut store = Store::open(&at.join("trials.sqlite")).unwrap();
    let model = Arc::new(Shipped::PerfectSensors.model().unwrap());
    let options = LinkOptions { path: Some(bytes), replay_speed: f64::INFINITY, ..LinkOptions::default() };
    let gripper = SerialGripper::new(Box::new(SerialLink::open(&options).unwrap()));
    let from_bytes = played(Replay::of_capture(gripper, Some(&store), Some(Arc::clone(&model))).unwrap());
    let from_trial = played(Replay::of_trial(&store, 1, Some(Arc::clone(&model))).unwrap());
    assert!(from_trial.0.len() > 500 && from_trial.1.is_some(), "{}", from_trial.0.len());
    assert_eq!(from_bytes, from_trial);
    // An imported trial has channels of its own.
    let signals = Signals { channels: vec!["grip".to_owned()], t_s: vec![0.0, 0.1], values: vec![1.0, 2.0] };
    let (name, label) = ("1".to_owned(), "mug".to_owned());
    store
        .insert_imported("mine", &[ImportedTrial { name, label, size: None, shape: None, session: None, signals }])
        .unwrap();
    let mut imported = Replay::of_trial(&store, 2, Some(model)).unwrap();
    assert!(imported.why_off().is_some_and(|cause| cause.to_string().contains("curvature_left")));
    assert_eq!(imported.next_row().unwrap().map(|row| row.values[0]), Some(1.0));
}
