//! Opening the gripper's port for a command: one that another program has for a moment is waited for.

use super::Failure;
use super::terminal::note;
use palpate_device::serial::{LinkOptions, PortTrouble, SerialLink};
use std::time::{Duration, Instant};

/// How long ModemManager looks at a board that was plugged in just now, and so how long a busy port is worth waiting for (s).
pub(super) const USUAL_WAIT_S: f64 = 30.0;
/// Between two attempts.
const RETRY: Duration = Duration::from_secs(1);
/// How soon a request to end is noticed.
const PIECE: Duration = Duration::from_millis(50);

/// Opens a port, a link to one, or a file. While another program has it, tries again each second, for up to `wait_s`
/// seconds or until `stopped` says so.
pub(super) fn open(
    options: &LinkOptions,
    wait_s: f64,
    mut stopped: impl FnMut() -> bool,
) -> Result<SerialLink, Failure> {
    let begun = Instant::now();
    let mut told = false;
    loop {
        let error = match SerialLink::open(options) {
            Ok(link) => return Ok(link),
            Err(error) => error,
        };
        if error.trouble != PortTrouble::Busy || begun.elapsed().as_secs_f64() >= wait_s {
            return Err(error.into());
        }
        if !std::mem::replace(&mut told, true) {
            note(&format!("{error}; until then it is tried each second, for {wait_s:.0} s"));
        }
        let tried = Instant::now();
        while tried.elapsed() < RETRY {
            if stopped() {
                return Err(error.into());
            }
            std::thread::sleep(PIECE);
        }
    }
}
