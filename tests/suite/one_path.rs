//! One path for every grasp: the same fault of the same emulated board, recorded as `palpate record` does and as the window
//! does, leaves the same trial.

use crate::calibration::parts;
use crate::gripper::{Desk, FAST, scene};
use crate::streams::Emulated;
use palpate_device::emulator::{EmulatorSetup, HandPlan};
use palpate_device::protocol::ConsoleLine;
use palpate_device::serial::{LinkEvent, LinkStatus, SendError};
use palpate_lab::gripper::{BoardStream, SerialGripper};
use palpate_lab::recording::{TrialRequest, record};
use palpate_lab::workers::GripperCommand;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_store::Store;
use palpate_store::labels::Flag;
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::{Control, TrialId};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// What goes wrong, counted from the first pressure command.
#[derive(Clone, Copy, Debug, PartialEq)]
enum BoardFault {
    None,
    /// From 1.2 s on the board hears nothing, and vents by itself.
    Vents,
    /// At 1 s the connection breaks.
    Unplugs,
    /// The box stops at 0.5 bar and refuses more.
    Refuses,
}

/// The emulated gripper behind a link with a fault.
struct FaultyLink {
    inner: Emulated,
    fault: BoardFault,
    /// First pressure command (s).
    driven_s: Option<f64>,
    unplugged: bool,
}

impl FaultyLink {
    fn new(fault: BoardFault) -> Self {
        let hand =
            HandPlan { scene: scene(), objects: vec![EMPTY.to_owned()], seed: 1, grasp_every_s: None, script: vec![] };
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
        Self { inner: Emulated::new(setup, FAST), fault, driven_s: None, unplugged: false }
    }

    fn is_past(&self, seconds: f64) -> bool {
        self.driven_s.is_some_and(|driven_s| self.inner.now_s() > driven_s + seconds)
    }
}

impl BoardStream for FaultyLink {
    fn take(&mut self, patience: Duration) -> Vec<LinkEvent> {
        let events = self.inner.take(patience);
        let breaks = self.fault == BoardFault::Unplugs && self.is_past(1.0);
        if !breaks || self.is_past(2.0) {
            return events;
        }
        let cause = "the board was unplugged".to_owned();
        let piece = Captured::Interrupted { at_s: self.inner.now_s(), cause };
        let first = !std::mem::replace(&mut self.unplugged, true);
        first.then_some(LinkEvent::Captured(piece)).into_iter().collect()
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
        if self.fault == BoardFault::Vents && self.is_past(1.2) {
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

/// What must not depend on who records.
#[derive(Debug, PartialEq)]
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
        let closing = trial.phases.first().unwrap().from_s;
        let steps = |seconds: f64| (seconds / 0.05).round() as i64;
        Self {
            flags: info.flags.iter().map(|found| found.flag).collect(),
            warnings: warnings.to_vec(),
            channels: trial.board.channels.clone(),
            phases: trial.phases.iter().map(|mark| (mark.phase, mark.line_bar)).collect(),
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
    let recording = record(&mut gripper, &scene(), request(), path.clone(), &stop, &mut |_| ()).unwrap();
    assert_eq!(recording.aborted.is_some(), fault != BoardFault::None);
    Essence::new(&Store::open(&path).unwrap(), recording.trial.id, &recording.trial.warnings)
}

fn by_window(fault: BoardFault) -> Essence {
    let mut desk = Desk::on(Arc::new(move |_| Ok(Box::new(FaultyLink::new(fault)))));
    desk.connect();
    desk.command(GripperCommand::Begin(request()));
    let ended = desk.until(|view| view.ended.is_some()).ended.clone().unwrap();
    Essence::new(&desk.store(), ended.id, &ended.warnings)
}

#[test]
fn the_same_fault_leaves_the_same_trial_from_the_command_line_and_from_the_window() {
    let mut all = Vec::new();
    for fault in [BoardFault::None, BoardFault::Vents, BoardFault::Unplugs, BoardFault::Refuses] {
        let (command, window) = (by_command(fault), by_window(fault));
        // The clock of the emulator advances in steps of a look.
        let apart = (command.lead - window.lead).abs() + (command.span - window.span).abs();
        assert!(apart <= 2, "{fault:?}: {command:?}\n{window:?}");
        assert_eq!(Essence { lead: 0, span: 0, ..command }, Essence { lead: 0, span: 0, ..window }, "{fault:?}");
        all.push(by_command(fault));
    }
    let [sound, vents, unplugs, refuses] = &all[..] else { panic!("four") };
    assert!(sound.flags.iter().all(|flag| *flag == Flag::NoContact) && sound.warnings.is_empty(), "{sound:?}");
    for cut in [vents, unplugs] {
        assert!(cut.flags.contains(&Flag::Interrupted), "{cut:?}");
    }
    for (cut, cause) in [(vents, "watchdog"), (unplugs, "unplugged"), (refuses, "above-maximum")] {
        assert!(cut.warnings.iter().any(|text| text.contains(cause)), "{cut:?}");
        assert!(cut.span < sound.span && cut.lead.abs_diff(sound.lead) <= 1, "{cut:?}\n{sound:?}");
    }
}
