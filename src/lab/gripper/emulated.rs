//! The emulated gripper as a stream, without a port.

use super::BoardStream;
use palpate_device::emulator::EmulatedGripper;
use palpate_device::protocol::{AdcRange, BoardEvent, ConsoleLine, Decoder};
use palpate_device::serial::{BoardKind, LinkState, LinkStatus, PortInfo, SendError};
use palpate_tactile::board::SensorList;
use palpate_tactile::capture::Captured;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// An emulated gripper that a stream shares with who puts objects into its hand.
#[derive(Clone)]
pub struct SharedEmulator(Arc<Mutex<EmulatedGripper>>);

impl SharedEmulator {
    /// Shares a gripper.
    pub fn new(gripper: EmulatedGripper) -> Self {
        Self(Arc::new(Mutex::new(gripper)))
    }

    /// The gripper, whose time stands still meanwhile.
    pub fn lock(&self) -> MutexGuard<'_, EmulatedGripper> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Stream of an emulated gripper. Each look at it takes 10 ms of its time: on a busy computer it is slow, never late.
pub struct EmulatedStream {
    gripper: SharedEmulator,
    decoder: Decoder,
    t_s: f64,
    look: Duration,
    /// What the board prints, where it is asked for.
    printed: Option<Arc<Mutex<String>>>,
}

impl EmulatedStream {
    /// Time of the gripper that passes with each look at it (s).
    pub const LOOK_S: f64 = 0.01;

    /// A host connects. A look takes the time `look` in truth.
    pub fn new(gripper: SharedEmulator, sensors: SensorList, look: Duration) -> Self {
        let t_s = gripper.lock().now_s();
        Self { gripper, decoder: Decoder::new(sensors), t_s, look, printed: None }
    }

    /// The gripper.
    pub fn gripper(&self) -> &SharedEmulator {
        &self.gripper
    }

    /// What its board prints from now on, before any fault.
    pub fn printed(&mut self) -> Arc<Mutex<String>> {
        Arc::clone(self.printed.get_or_insert_default())
    }
}

impl BoardStream for EmulatedStream {
    fn take(&mut self, _patience: Duration) -> Vec<BoardEvent> {
        std::thread::sleep(self.look);
        self.t_s += Self::LOOK_S;
        let (mut gripper, mut decoded) = (self.gripper.lock(), Vec::new());
        gripper.advance(self.t_s);
        let (printed, bytes) = (gripper.take_printed(), gripper.take_bytes());
        drop(gripper.take_happened());
        if let Some(kept) = &self.printed {
            kept.lock().unwrap_or_else(PoisonError::into_inner).push_str(&printed);
        }
        if bytes.is_empty() {
            return Vec::new();
        }
        self.decoder.push(&bytes, self.t_s, &mut decoded);
        let piece = BoardEvent::Captured(Captured::Bytes { arrived_s: self.t_s, bytes });
        std::iter::once(piece).chain(decoded).collect()
    }

    fn status(&self) -> LinkStatus {
        LinkStatus {
            state: LinkState::Listening,
            port: PortInfo {
                path: "emulated".into(),
                title: "without a serial port".to_owned(),
                usb: None,
                kind: BoardKind::default(),
            },
            baud: Some(115_200),
            board: self.decoder.board(),
            detected: self.decoder.detected(),
            cadence: self.decoder.cadence(),
            saturation: self.decoder.saturation(),
            adc_range: AdcRange::Fits,
            reconnects: 0,
            now_s: self.t_s,
            dropped: [0; 2],
        }
    }

    fn now_s(&self) -> f64 {
        self.t_s
    }

    fn send(&mut self, line: &str) -> Result<(), SendError> {
        self.gripper.lock().hear(format!("{line}\n").as_bytes());
        Ok(())
    }

    fn console(&self) -> Vec<ConsoleLine> {
        self.decoder.console().cloned().collect()
    }

    fn is_over(&self) -> bool {
        false
    }
}
