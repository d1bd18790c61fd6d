//! Scan of baud rates: listens at each for a moment and judges it by its readings.

use super::baud::Baud;
use crate::protocol::Decoder;
use palpate_tactile::cadence::Cadence;
use serialport::{ClearBuffer, SerialPort};
use std::io::ErrorKind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time at each rate: five lines of a board that sends ten per second.
const LISTEN: Duration = Duration::from_millis(600);
/// Time where text comes: three lines of a board that sends one per second.
const LISTEN_TO_TEXT: Duration = Duration::from_secs(4);
/// Time where nothing comes: one line of a board that sends one per second.
const LISTEN_TO_NOTHING: Duration = Duration::from_millis(1200);
/// Readings that a rate must give.
const READINGS: u64 = 3;
/// Largest share of unreadable lines.
const BAD_SHARE: f64 = 0.2;
/// Least share of printable bytes.
const PRINTABLE: f64 = 0.95;

/// Result of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scan {
    /// The rate of the board, to which the port is set.
    Found(Baud),
    /// None fits; the port is unchanged.
    Nothing,
}

/// Tries the usual rates in turn.
pub(super) fn scan(port: &mut dyn SerialPort, current: Baud, stop: &AtomicBool) -> Scan {
    for baud in Baud::SCANNED {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        // Rates that the port does not support are skipped.
        if port.set_baud_rate(baud.rate()).is_err() || port.clear(ClearBuffer::Input).is_err() {
            continue;
        }
        if is_understood(&listen(port, stop)) {
            return Scan::Found(baud);
        }
    }
    if let Err(error) = port.set_baud_rate(current.rate()) {
        tracing::debug!("the baud rate cannot be restored: {error}");
    }
    Scan::Nothing
}

fn listen(port: &mut dyn SerialPort, stop: &AtomicBool) -> Cadence {
    let mut decoder = Decoder::default();
    let (mut buffer, mut events) = ([0; 1024], Vec::new());
    let (start, mut any) = (Instant::now(), false);
    loop {
        let cadence = decoder.cadence();
        let patience = match any {
            false => LISTEN_TO_NOTHING,
            true if is_text(&cadence) && !is_understood(&cadence) => LISTEN_TO_TEXT,
            true => LISTEN,
        };
        if start.elapsed() >= patience || stop.load(Ordering::Relaxed) {
            return cadence;
        }
        match port.read(&mut buffer) {
            Ok(0) => return decoder.cadence(),
            Ok(count) => {
                any = true;
                decoder.push(&buffer[..count], start.elapsed().as_secs_f64(), &mut events);
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(_) => return decoder.cadence(),
        }
        events.clear();
    }
}

fn is_text(cadence: &Cadence) -> bool {
    cadence.printable_share >= PRINTABLE
}

fn is_understood(cadence: &Cadence) -> bool {
    cadence.samples >= READINGS && cadence.bad_share <= BAD_SHARE && is_text(cadence)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use serialport::TTYPort;
    use std::io::Write;

    /// A board that speaks at one speed, a line each so many ms: at any other its bytes arrive as nonsense. The end of a
    /// pseudo-terminal that a board has knows the speed that is set at the other.
    fn speak(board: &mut TTYPort, speed: u32, period_ms: u64, stop: &AtomicBool) {
        let mut i = 0u32;
        while !stop.load(Ordering::Relaxed) {
            let line = format!("flexL:{},flexR:2\n", i % 4096);
            let right = board.baud_rate().is_ok_and(|baud| baud == speed);
            let bytes =
                line.bytes().map(|byte| if right { byte } else { byte.rotate_left(3) | 0x80 }).collect::<Vec<u8>>();
            let _unheard = board.write_all(&bytes);
            i += 1;
            std::thread::sleep(Duration::from_millis(period_ms));
        }
    }

    /// Scans time and again, as a link does: a busy machine may not let the board speak while it is listened to.
    fn scan_until_found(port: &mut TTYPort, current: Baud) -> Scan {
        let mut scans = (0..30).map(|_| scan(port, current, &AtomicBool::new(false)));
        scans.find(|scan| *scan != Scan::Nothing).unwrap_or(Scan::Nothing)
    }

    #[test]
    fn the_speed_of_a_board_is_found_by_what_can_be_read() {
        let (mut board, mut port) = TTYPort::pair().expect("a pseudo-terminal");
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| speak(&mut board, 57_600, 10, &stop));
            let found = scan_until_found(&mut port, Baud::B115200);
            stop.store(true, Ordering::Relaxed);
            assert_eq!(found, Scan::Found(Baud::B57600));
        });
        assert_eq!(port.baud_rate().ok(), Some(57_600));
        // One that sends two lines a second is listened to for longer.
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| speak(&mut board, 115_200, 500, &stop));
            let found = scan_until_found(&mut port, Baud::B57600);
            stop.store(true, Ordering::Relaxed);
            assert_eq!(found, Scan::Found(Baud::B115200));
        });
        let stop = AtomicBool::new(true);
        // After a stop, it leaves the port unchanged.
        assert_eq!(scan(&mut port, Baud::B9600, &stop), Scan::Nothing);
        assert_eq!(port.baud_rate().ok(), Some(9_600));
    }
}
