//! Options and state of a link, and what its threads share.

use super::baud::Baud;
use super::ports::PortInfo;
use super::queue::{ByteQueue, EventQueue, WhenFull, lock};
use crate::protocol::BoardEvent;
use crate::protocol::Decoder;
use palpate_tactile::board::SensorList;
use palpate_tactile::capture::Captured;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Port and settings of a link.
#[derive(Clone, Debug)]
pub struct LinkOptions {
    /// A port, a link to one, or a file of captured bytes; none for the only likely port.
    pub path: Option<PathBuf>,
    /// Baud rate; none to scan the usual ones.
    pub baud: Option<Baud>,
    /// Wait for a board that disconnects.
    pub reconnect: bool,
    /// Sensors of the gripper.
    pub sensors: SensorList,
    /// Speed of a replay, as a multiple of the original; infinite for as fast as possible.
    pub replay_speed: f64,
}

impl Default for LinkOptions {
    fn default() -> Self {
        Self { path: None, baud: None, reconnect: true, sensors: SensorList::default(), replay_speed: 1.0 }
    }
}

/// State of a link.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "state")]
pub enum LinkState {
    /// Just opened: a board may restart.
    Waiting,
    /// Readings come.
    Listening,
    /// Nothing comes.
    Silent {
        /// What to try.
        hint: String,
    },
    /// Bytes come that are no lines of a board, at any speed.
    Unreadable {
        /// What to try.
        hint: String,
    },
    /// The port is gone; the link looks for it.
    Lost {
        /// Why.
        cause: String,
    },
    /// The link has ended.
    Ended {
        /// Why, if it was not stopped on request.
        cause: Option<String>,
        /// Captured bytes that are damaged or end within a record: what followed is missing.
        cut_short: bool,
    },
}

impl LinkState {
    /// In a sentence for the user.
    pub fn sentence(&self) -> String {
        match self {
            Self::Waiting => "Waiting for the board (it restarts on connection)".to_owned(),
            Self::Listening => "Listening".to_owned(),
            Self::Silent { hint } | Self::Unreadable { hint } => hint.clone(),
            Self::Lost { cause } => format!("Connection lost: {cause}. Trying again every second"),
            Self::Ended { cause: Some(cause), .. } => format!("Ended: {cause}"),
            Self::Ended { cause: None, .. } => "Ended".to_owned(),
        }
    }

    /// Why captured bytes could not be read to their end.
    pub fn cut_short(&self) -> Option<&str> {
        match self {
            Self::Ended { cause: Some(cause), cut_short: true } => Some(cause),
            _ => None,
        }
    }
}

/// State that the threads of a link share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) bytes: ByteQueue,
    pub(super) events: EventQueue,
    pub(super) decoder: Mutex<Decoder>,
    pub(super) state: Mutex<LinkState>,
    pub(super) port: Mutex<PortInfo>,
    /// Writer to the board, while it is connected.
    pub(super) writer: Mutex<Option<Box<dyn serialport::SerialPort>>>,
    pub(super) baud: AtomicU32,
    pub(super) reconnects: AtomicU32,
    /// Readings so far, by which the reader separates noise from data.
    pub(super) readings: AtomicU64,
    pub(super) stop: AtomicBool,
    pub(super) began: Instant,
}

impl Shared {
    pub(super) fn new(port: PortInfo, when_full: WhenFull, sensors: SensorList) -> Arc<Self> {
        Arc::new(Self {
            bytes: ByteQueue::new(when_full),
            events: EventQueue::new(when_full),
            decoder: Mutex::new(Decoder::new(sensors)),
            state: Mutex::new(LinkState::Waiting),
            port: Mutex::new(port),
            writer: Mutex::new(None),
            baud: AtomicU32::new(0),
            reconnects: AtomicU32::new(0),
            readings: AtomicU64::new(0),
            stop: AtomicBool::new(false),
            began: Instant::now(),
        })
    }

    pub(super) fn set_state(&self, state: LinkState) {
        *lock(&self.state) = state;
    }

    pub(super) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Sleeps in pieces, so that stopping is prompt.
    pub(super) fn sleep(&self, time: Duration) {
        const PIECE: Duration = Duration::from_millis(20);
        let until = Instant::now() + time;
        while !self.is_stopped() {
            match until.checked_duration_since(Instant::now()) {
                Some(left) if !left.is_zero() => std::thread::sleep(left.min(PIECE)),
                _ => return,
            }
        }
    }

    /// Decodes until there is nothing more to come.
    pub(super) fn decode(&self) {
        let mut decoded = Vec::new();
        while let Some(pieces) = self.bytes.take() {
            for piece in pieces {
                {
                    let mut decoder = lock(&self.decoder);
                    match &piece {
                        Captured::Bytes { arrived_s, bytes } => decoder.push(bytes, *arrived_s, &mut decoded),
                        Captured::Interrupted { cause, .. } => decoder.interrupt(cause),
                    }
                    self.readings.store(decoder.readings(), Ordering::Relaxed);
                }
                self.events.push(std::iter::once(BoardEvent::Captured(piece)).chain(decoded.drain(..)));
            }
        }
        self.events.close();
    }
}
