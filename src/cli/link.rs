//! Opens the gripper's port for a command; waits while another program has it.

use super::Failure;
use super::terminal::note;
use palpate_device::protocol::BoardEvent;
use palpate_device::serial::{LinkOptions, PortTrouble, SerialLink};
use palpate_tactile::board::Reading;
use std::time::{Duration, Instant};

/// Default wait for a busy port (s): ModemManager probes a newly connected board for about this long.
pub(super) const USUAL_WAIT_S: f64 = 30.0;
/// Time between two attempts.
const RETRY: Duration = Duration::from_secs(1);
/// Interval at which a stop request is checked.
const POLL: Duration = Duration::from_millis(50);

/// Opens a port, a link to one, or a file. While another program has it, retries each second, for up to `wait_s` seconds or
/// until `stopped` returns true.
pub(super) fn open(
    options: &LinkOptions,
    wait_s: f64,
    mut stopped: impl FnMut() -> bool,
) -> Result<SerialLink, Failure> {
    let begun = Instant::now();
    let mut noted = false;
    loop {
        let error = match SerialLink::open(options) {
            Ok(link) => return Ok(link),
            Err(error) => error,
        };
        if error.trouble != PortTrouble::Busy || begun.elapsed().as_secs_f64() >= wait_s {
            return Err(error.into());
        }
        if !std::mem::replace(&mut noted, true) {
            note(&format!("{error}; retrying each second, for up to {wait_s:.0} s"));
        }
        let tried = Instant::now();
        while tried.elapsed() < RETRY {
            if stopped() {
                return Err(error.into());
            }
            std::thread::sleep(POLL);
        }
    }
}

/// Readings of the board, waited for as long as `patience`.
pub(super) fn readings(link: &SerialLink, patience: Duration) -> impl Iterator<Item = Reading> {
    link.take(patience).into_iter().filter_map(BoardEvent::into_reading)
}
