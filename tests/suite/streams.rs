//! Boards without a port, for what listens to one: readings that a test makes up, and the emulated gripper on a clock
//! that runs as fast as it is asked.

use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, parse_faults};
use palpate_device::protocol::AdcRange;
use palpate_device::protocol::{BoardEvent, ConsoleLine, Decoder};
use palpate_device::serial::{BoardKind, LinkState, LinkStatus, PortInfo, SendError};
use palpate_lab::gripper::BoardStream;
use palpate_tactile::board::{Board, Gap, Reading};
use palpate_tactile::cadence::Cadence;
use palpate_tactile::capture::Captured;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How a link stands that listens.
fn listening(board: Board, cadence: Cadence, now_s: f64) -> LinkStatus {
    LinkStatus {
        state: LinkState::Listening,
        port: PortInfo {
            path: "/dev/pretended".into(),
            title: "a board of the tests".to_owned(),
            usb: None,
            kind: BoardKind::default(),
        },
        baud: Some(115_200),
        board,
        detected: None,
        cadence,
        saturation: Vec::new(),
        adc_range: AdcRange::Fits,
        reconnects: 0,
        now_s,
        dropped: [0; 2],
    }
}

/// A board whose events a test makes up: those of the next look at it, and the time by then (s).
pub(crate) struct MadeUp<F> {
    next: F,
    t_s: f64,
}

/// Fifty readings of a second at a time, all alike.
pub(crate) fn alike(counts: impl Fn() -> Vec<Option<f32>>) -> MadeUp<impl FnMut(Duration) -> (f64, Vec<BoardEvent>)> {
    let mut t_s = 0.0;
    let next = move |_| {
        std::thread::sleep(Duration::from_millis(2));
        t_s += 1.0;
        let counts = counts();
        (t_s, (0..50).map(|k| reading(t_s + 0.02 * f64::from(k), counts.clone())).collect())
    };
    MadeUp { next, t_s: 0.0 }
}

/// Three seconds of strips that bend and pads that are pressed, at 50 Hz, of which eight tenths are missing; and silence
/// behind them.
pub(crate) fn once_with_a_gap() -> MadeUp<impl FnMut(Duration) -> (f64, Vec<BoardEvent>)> {
    let sample = |k: u32| {
        let t_s = 0.02 * f64::from(k);
        let wave = (std::f64::consts::PI * t_s / 3.0).sin() as f32;
        reading(t_s, [1420.0 + 500.0 * wave, 1400.0 + 450.0 * wave, 900.0 * wave, 700.0 * wave].map(Some).to_vec())
    };
    let gap = Gap { from_s: 1.0, to_s: 1.8, lost: Some(39), cause: "the board was unplugged".to_owned() };
    let gap = BoardEvent::Gap(gap);
    let mut events: Vec<BoardEvent> = (0..=50).map(sample).chain([gap]).chain((90..=150).map(sample)).collect();
    let next = move |patience| {
        if events.is_empty() {
            std::thread::sleep(patience);
        }
        (3.0, std::mem::take(&mut events))
    };
    MadeUp { next, t_s: 3.0 }
}

fn reading(t_s: f64, counts: Vec<Option<f32>>) -> BoardEvent {
    BoardEvent::Reading(Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None })
}

impl<F: FnMut(Duration) -> (f64, Vec<BoardEvent>)> BoardStream for MadeUp<F> {
    fn take(&mut self, patience: Duration) -> Vec<BoardEvent> {
        let (t_s, events) = (self.next)(patience);
        self.t_s = t_s;
        events
    }

    fn status(&self) -> LinkStatus {
        listening(Board::default(), Cadence::default(), self.t_s)
    }

    fn now_s(&self) -> f64 {
        self.t_s
    }

    fn send(&mut self, _: &str) -> Result<(), SendError> {
        Ok(())
    }

    fn console(&self) -> Vec<ConsoleLine> {
        Vec::new()
    }

    fn is_over(&self) -> bool {
        false
    }
}

/// The emulated gripper. Each look at it lets 10 ms of its time pass.
pub(crate) struct Emulated {
    gripper: EmulatedGripper,
    decoder: Decoder,
    t_s: f64,
    /// How long a look takes in truth.
    look: Duration,
    /// What its board has printed, before any fault.
    printed: Arc<Mutex<String>>,
}

/// Time that passes with each look (s).
const LOOK_S: f64 = 0.01;

impl Emulated {
    pub(crate) fn new(setup: EmulatorSetup, look: Duration) -> Self {
        let gripper = EmulatedGripper::new(setup).unwrap();
        Self { gripper, decoder: Decoder::default(), t_s: 0.0, look, printed: Arc::default() }
    }

    /// What its board prints, before any fault.
    pub(crate) fn printed(&self) -> Arc<Mutex<String>> {
        Arc::clone(&self.printed)
    }

    /// Lets a fault begin now: `NAME[=VALUE]`, and how long it lasts (s).
    pub(crate) fn strike(&mut self, fault: &str, seconds: f64) {
        for fault in parse_faults(&format!("{fault}@{}/{seconds}", self.t_s)).unwrap() {
            self.gripper.add_fault(fault);
        }
    }
}

impl BoardStream for Emulated {
    fn take(&mut self, _: Duration) -> Vec<BoardEvent> {
        std::thread::sleep(self.look);
        self.t_s += LOOK_S;
        self.gripper.advance(self.t_s);
        self.printed.lock().unwrap().push_str(&self.gripper.take_printed());
        let (bytes, mut decoded) = (self.gripper.take_bytes(), Vec::new());
        if bytes.is_empty() {
            return Vec::new();
        }
        self.decoder.push(&bytes, self.t_s, &mut decoded);
        let piece = BoardEvent::Captured(Captured::Bytes { arrived_s: self.t_s, bytes });
        std::iter::once(piece).chain(decoded).collect()
    }

    fn status(&self) -> LinkStatus {
        LinkStatus {
            detected: self.decoder.detected(),
            ..listening(self.decoder.board(), self.decoder.cadence(), self.t_s)
        }
    }

    fn now_s(&self) -> f64 {
        self.t_s
    }

    fn send(&mut self, line: &str) -> Result<(), SendError> {
        self.gripper.hear(format!("{line}\n").as_bytes());
        Ok(())
    }

    fn console(&self) -> Vec<ConsoleLine> {
        self.decoder.console().cloned().collect()
    }

    fn is_over(&self) -> bool {
        false
    }
}
