//! Opens the gripper's port for a command; waits while another program has it.

use super::Failure;
use super::terminal::note;
use palpate_device::protocol::BoardEvent;
use palpate_device::serial::{LinkOptions, LinkState, PortTrouble, SerialLink};
use palpate_tactile::board::{Board, Reading, SensorList};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Default wait for a busy port (s): ModemManager probes a newly connected board for about this long.
pub(super) const USUAL_WAIT_S: f64 = 30.0;
/// Time between two attempts.
const RETRY: Duration = Duration::from_secs(1);
/// Interval at which a stop request is checked.
const POLL: Duration = Duration::from_millis(50);
/// Longest wait for the first readings (s).
pub(super) const PATIENCE_S: f64 = 10.0;

/// Opens a port, a link to one, or a file. While another program has it, retries each second, for up to `wait_s` seconds or
/// until `stop` is set.
pub(super) fn open(options: &LinkOptions, wait_s: f64, stop: &AtomicBool) -> Result<SerialLink, Failure> {
    let begun = Instant::now();
    let mut noted = false;
    loop {
        let error = match SerialLink::open(options) {
            Ok(link) => return Ok(link),
            Err(error) => error,
        };
        if matches!(error.trouble, PortTrouble::NoBoard | PortTrouble::Several) {
            return Err(format!("{error}; --port PORT names one, such as the link of `palpate emulate`").into());
        }
        if error.trouble != PortTrouble::Busy || begun.elapsed().as_secs_f64() >= wait_s {
            return Err(error.into());
        }
        if !std::mem::replace(&mut noted, true) {
            note(&format!("{error}; retrying each second, for up to {wait_s:.0} s"));
        }
        let tried = Instant::now();
        while tried.elapsed() < RETRY {
            if stop.load(Ordering::Relaxed) {
                return Err(error.into());
            }
            std::thread::sleep(POLL);
        }
    }
}

/// Options of a link to the board: captured bytes come as they were captured, or without a pause.
pub(super) fn options(port: Option<&Path>, at_once: bool, sensors: SensorList) -> LinkOptions {
    let replay_speed = if at_once && port.is_some_and(Path::is_file) { f64::INFINITY } else { 1.0 };
    LinkOptions { path: port.map(Path::to_owned), replay_speed, sensors, ..LinkOptions::default() }
}

/// Readings of a board, for a command that guides the user. It prints changes of the state of the link.
pub(super) struct Listener {
    link: SerialLink,
    /// State that was printed last.
    state: LinkState,
    opened: Instant,
    has_heard: bool,
}

impl Listener {
    pub(super) fn open(options: &LinkOptions, stop: &AtomicBool) -> Result<Self, Failure> {
        let link = open(options, USUAL_WAIT_S, stop)?;
        Ok(Self { link, state: LinkState::Waiting, opened: Instant::now(), has_heard: false })
    }

    /// The board as it is known by now.
    pub(super) fn board(&self) -> Board {
        self.link.status().board
    }

    /// The next readings, which may be none yet; `None` where the stream has ended. Fails where none has ever come.
    pub(super) fn next(&mut self) -> Result<Option<Vec<Reading>>, Failure> {
        let readings: Vec<Reading> = self.link.take(POLL).into_iter().filter_map(BoardEvent::into_reading).collect();
        let state = self.link.status().state;
        if state != self.state {
            if !matches!(state, LinkState::Listening | LinkState::Ended { .. }) {
                note(&state.sentence());
            }
            self.state = state;
        }
        self.has_heard |= !readings.is_empty();
        let is_over = readings.is_empty() && self.link.is_over();
        if !self.has_heard && (is_over || self.opened.elapsed().as_secs_f64() > PATIENCE_S) {
            return Err(format!("no readings from the board. {}", self.state.sentence()).into());
        }
        Ok((!is_over).then_some(readings))
    }

    /// How the stream stands, in a sentence.
    pub(super) fn sentence(&self) -> String {
        self.state.sentence()
    }
}
