//! At which speed a board speaks: each is listened to for a moment and judged by what can be read.

use super::baud::Baud;
use super::link::Shared;
use crate::wire::{Cadence, Decoder};
use serialport::{ClearBuffer, SerialPort};
use std::io::ErrorKind;
use std::time::{Duration, Instant};

/// How long each speed is listened to: five lines of a board that sends ten a second.
const LISTEN: Duration = Duration::from_millis(600);
/// Readings that a speed must give.
const READINGS: u64 = 3;
/// Share of unreadable lines that a speed may give.
const BAD_SHARE: f64 = 0.2;
/// Share of bytes that must be text.
const PRINTABLE: f64 = 0.95;

/// What came of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scan {
    /// The board speaks at this speed; the port is set to it.
    Found(Baud),
    /// None is understood; the port is as it was.
    Nothing,
}

/// Tries the usual speeds in turn.
pub(super) fn scan(port: &mut dyn SerialPort, current: Baud, shared: &Shared) -> Scan {
    for baud in Baud::SCANNED {
        if shared.is_stopped() {
            break;
        }
        // A speed that the port does not have is not the one.
        if port.set_baud_rate(baud.rate()).is_err() || port.clear(ClearBuffer::Input).is_err() {
            continue;
        }
        if is_understood(&listen(port)) {
            return Scan::Found(baud);
        }
    }
    if let Err(error) = port.set_baud_rate(current.rate()) {
        tracing::debug!("the speed cannot be set back: {error}");
    }
    Scan::Nothing
}

fn listen(port: &mut dyn SerialPort) -> Cadence {
    let mut decoder = Decoder::default();
    let (mut buffer, mut heard) = ([0; 1024], Vec::new());
    let start = Instant::now();
    while start.elapsed() < LISTEN {
        match port.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => decoder.push(&buffer[..count], start.elapsed().as_secs_f64(), &mut heard),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(_) => break,
        }
        heard.clear();
    }
    decoder.cadence()
}

fn is_understood(cadence: &Cadence) -> bool {
    cadence.samples >= READINGS && cadence.bad_share <= BAD_SHARE && cadence.printable_share >= PRINTABLE
}
