//! Boards without a port, for what listens to one: readings that a test makes up, and the emulated gripper on a clock
//! that runs as fast as it is asked.

use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, parse_faults};
use palpate_device::protocol::AdcRange;
use palpate_device::protocol::{BoardEvent, ConsoleLine};
use palpate_device::serial::{BoardKind, LinkState, LinkStatus, PortInfo, SendError};
use palpate_lab::gripper::{BoardStream, EmulatedStream, SharedEmulator};
use palpate_tactile::board::{Board, Gap, Reading};
use palpate_tactile::cadence::Cadence;
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

/// The emulated gripper. A look at it takes the time `look` in truth.
pub(crate) fn emulated(setup: EmulatorSetup, look: Duration) -> EmulatedStream {
    let sensors = setup.hand.sensors;
    EmulatedStream::new(SharedEmulator::new(EmulatedGripper::new(setup).unwrap()), sensors, look)
}

/// Lets a fault of an emulated gripper begin now: `NAME[=VALUE]`, and how long it lasts (s).
pub(crate) fn strike(stream: &EmulatedStream, fault: &str, seconds: f64) {
    for fault in parse_faults(&format!("{fault}@{}/{seconds}", stream.now_s())).unwrap() {
        stream.gripper().lock().add_fault(fault);
    }
}
