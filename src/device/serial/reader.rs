//! Reader thread of a port. It stamps and queues bytes, reconnects to a board that is gone, and scans baud rates when the
//! data is unreadable.

use super::baud::Baud;
use super::port_error::PortError;
use super::ports::{BoardKind, PortInfo, describe, find, list_ports};
use super::queue::lock;
use super::scan::{Scan, scan};
use super::shared::{LinkOptions, LinkState, Shared};
use palpate_tactile::capture::Captured;
use serialport::{ClearBuffer, SerialPort};
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Longest wait of a read; stopping takes no longer.
const READ_PATIENCE: Duration = Duration::from_millis(50);
/// Time in which bytes from before a reset arrive.
const RESET: Duration = Duration::from_millis(250);
/// Longest boot time of a board after connection.
const BOOT: Duration = Duration::from_secs(4);
/// Silence after which DTR is toggled on a native port, once.
const MUTE: Duration = Duration::from_secs(3);
/// Bytes without a reading that show unreadable data.
const ENOUGH_BYTES: u64 = 300;
/// Wait before a scan of baud rates: before the first reading, after it, and between two scans.
const DOUBT: Duration = Duration::from_millis(1500);
const DOUBT_LATER: Duration = Duration::from_secs(4);
const RESCAN: Duration = Duration::from_secs(10);
/// Share of printable bytes at the right baud rate; at half the rate about half of the bytes are printable.
const TEXT: f64 = 0.9;
/// Waits between attempts to reconnect; the last repeats.
const ATTEMPTS: [Duration; 3] = [Duration::from_millis(200), Duration::from_millis(500), Duration::from_secs(1)];
/// Attempts after which the wait becomes [`SELDOM`].
const MANY: u32 = 300;
const SELDOM: Duration = Duration::from_secs(3);

/// Opens a port with DTR set, at a harmless baud rate.
pub(super) fn open_port(path: &Path, baud: Baud) -> Result<Box<dyn SerialPort>, PortError> {
    let builder = serialport::new(path.to_string_lossy(), baud.rate()).timeout(READ_PATIENCE).dtr_on_open(true);
    builder.open().map_err(|error| PortError::of(path, &error, &list_ports()))
}

/// Discards bytes from before the port was opened. A board that restarts on connection sends on for a moment.
pub(super) fn discard_old(port: &dyn SerialPort, kind: BoardKind) {
    if kind.rank > 0 && !kind.native {
        std::thread::sleep(RESET);
    }
    if let Err(error) = port.clear(ClearBuffer::Input) {
        tracing::debug!("old bytes cannot be discarded: {error}");
    }
}

/// Reads one port, through losses.
#[derive(Debug)]
pub(super) struct PortReader {
    shared: Arc<Shared>,
    port: PortInfo,
    baud: Baud,
    /// The user has set the baud rate.
    baud_is_given: bool,
    reconnect: bool,
}

/// State of a connection.
struct Connection {
    bytes: u64,
    newest: Instant,
    /// Readings came.
    understood: bool,
    /// Number of readings when it last grew, when that was, and bytes by then.
    progress: (u64, Instant, u64),
    woken: bool,
    /// The handshake was requested.
    asked: bool,
    scanned: Option<Instant>,
}

impl PortReader {
    pub(super) fn new(shared: Arc<Shared>, port: PortInfo, baud: Baud, options: &LinkOptions) -> Self {
        Self { shared, port, baud, baud_is_given: options.baud.is_some(), reconnect: options.reconnect }
    }

    pub(super) fn run(mut self, first: Box<dyn SerialPort>) {
        let mut port = first;
        loop {
            let cause = self.listen(port);
            *lock(&self.shared.writer) = None;
            let Some(cause) = cause.filter(|_| !self.shared.is_stopped()) else {
                return self.shared.set_state(LinkState::Ended { cause: None, cut_short: false });
            };
            let at_s = self.shared.began.elapsed().as_secs_f64();
            self.shared.bytes.push(Captured::Interrupted { at_s, cause: cause.clone() });
            if !self.reconnect {
                return self.shared.set_state(LinkState::Ended { cause: Some(cause), cut_short: false });
            }
            match self.find_again(&cause) {
                Some(found) => {
                    *lock(&self.shared.writer) = found.try_clone().ok();
                    port = found;
                }
                None => return self.shared.set_state(LinkState::Ended { cause: None, cut_short: false }),
            }
            self.shared.reconnects.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Reads until the port is gone and returns why; none when stopped.
    fn listen(&mut self, mut port: Box<dyn SerialPort>) -> Option<String> {
        self.shared.set_state(LinkState::Waiting);
        self.shared.baud.store(self.baud.rate(), Ordering::Relaxed);
        let now = Instant::now();
        let readings_before = self.shared.readings.load(Ordering::Relaxed);
        let mut connection = Connection {
            bytes: 0,
            newest: now,
            understood: false,
            progress: (readings_before, now, 0),
            woken: false,
            asked: false,
            scanned: None,
        };
        let mut buffer = [0; 4096];
        while !self.shared.is_stopped() {
            match port.read(&mut buffer) {
                Ok(0) => return Some("the board was unplugged".to_owned()),
                Ok(count) => {
                    let arrived_s = self.shared.began.elapsed().as_secs_f64();
                    self.shared.bytes.push(Captured::Bytes { arrived_s, bytes: buffer[..count].to_vec() });
                    connection.bytes += count as u64;
                    connection.newest = Instant::now();
                }
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                Err(error) if error.kind() == ErrorKind::BrokenPipe => {
                    return Some("the board was unplugged".to_owned());
                }
                Err(error) => return Some(format!("the port failed ({error})")),
            }
            self.judge(&mut connection, port.as_mut());
        }
        None
    }

    /// Updates the state; wakes the port or scans baud rates where needed.
    fn judge(&mut self, connection: &mut Connection, port: &mut dyn SerialPort) {
        let readings = self.shared.readings.load(Ordering::Relaxed);
        let mute = connection.newest.elapsed();
        let native = self.port.kind.native;
        let received = readings > connection.progress.0;
        if received {
            connection.progress = (readings, Instant::now(), connection.bytes);
            connection.understood = true;
        }
        let (_, since, bytes_then) = connection.progress;
        let patience = if connection.understood { DOUBT_LATER } else { DOUBT };
        if mute >= MUTE {
            if native && !connection.woken {
                connection.woken = true;
                wake(port, &self.shared);
            }
            if mute >= BOOT {
                self.shared.set_state(LinkState::Silent { hint: self.silence() });
            }
        } else if received {
            self.shared.set_state(LinkState::Listening);
            if !std::mem::replace(&mut connection.asked, true) {
                self.ask(port);
            }
        } else if connection.bytes - bytes_then >= ENOUGH_BYTES && since.elapsed() >= patience {
            let due = connection.scanned.is_none_or(|scanned| scanned.elapsed() >= RESCAN);
            // Text without readings is not the fault of the baud rate.
            let is_text = lock(&self.shared.decoder).cadence().printable_share > TEXT;
            if native || self.baud_is_given || is_text {
                self.shared.set_state(LinkState::Unreadable { hint: self.nonsense() });
            } else if due {
                self.scan_rates(port);
                // Bytes meanwhile went to the scan alone.
                let now = Instant::now();
                connection.scanned = Some(now);
                connection.newest = now;
                connection.progress = (readings, now, connection.bytes);
            }
        }
    }

    /// Requests the handshake, if it has not come; other sketches ignore that.
    fn ask(&self, port: &mut dyn SerialPort) {
        if !lock(&self.shared.decoder).knows_board()
            && let Err(error) = port.write_all(b"?\n")
        {
            tracing::debug!("the handshake cannot be requested: {error}");
        }
    }

    fn scan_rates(&mut self, port: &mut dyn SerialPort) {
        let cause = match scan(port, self.baud, &self.shared.stop) {
            Scan::Found(baud) => {
                self.baud = baud;
                self.shared.baud.store(baud.rate(), Ordering::Relaxed);
                format!("the baud rate was found to be {}", baud.rate())
            }
            Scan::Nothing => {
                self.shared.set_state(LinkState::Unreadable { hint: self.nonsense() });
                "other baud rates were tried".to_owned()
            }
        };
        let at_s = self.shared.began.elapsed().as_secs_f64();
        self.shared.bytes.push(Captured::Interrupted { at_s, cause });
    }

    fn silence(&self) -> String {
        let port = self.port.path.display();
        if self.port.kind.native {
            format!(
                "No data from {port}: does the sketch print to SerialUSB? One that prints to Serial uses the programming port"
            )
        } else {
            format!("No data from {port}: is the sketch on the board? Press its reset button, or try its other port")
        }
    }

    fn nonsense(&self) -> String {
        let port = self.port.path.display();
        let speeds = if self.port.kind.native {
            String::new()
        } else if self.baud_is_given {
            format!(" at {} baud; omit the rate to scan the usual ones", self.baud.rate())
        } else {
            let tried = Baud::SCANNED.map(|baud| baud.rate().to_string());
            format!("; tried {} baud", tried.join(", "))
        };
        format!("Unreadable data from {port}{speeds}. The console shows it")
    }

    /// Waits for the board to come back; none when stopped.
    fn find_again(&mut self, cause: &str) -> Option<Box<dyn SerialPort>> {
        let mut cause = cause.to_owned();
        for attempt in 0u32.. {
            self.shared.set_state(LinkState::Lost { cause: cause.clone() });
            let usual = ATTEMPTS.get(attempt as usize).or(ATTEMPTS.last()).copied().unwrap_or(SELDOM);
            self.shared.sleep(if attempt < MANY { usual } else { SELDOM });
            if self.shared.is_stopped() {
                return None;
            }
            // It may come back under another number.
            let found = self.port.usb.as_ref().map_or_else(|| Some(describe(&self.port.path)), find);
            let Some(found) = found else { continue };
            match open_port(&found.path, self.baud) {
                Ok(port) => {
                    *lock(&self.shared.port) = found.clone();
                    self.port = found;
                    return Some(port);
                }
                // Still gone.
                Err(error) if !found.path.exists() => tracing::debug!("{error}"),
                Err(error) => cause = error.to_string(),
            }
        }
        None
    }
}

/// Toggles DTR: a native port sends only to a connected host.
fn wake(port: &mut dyn SerialPort, shared: &Shared) {
    for level in [false, true] {
        if let Err(error) = port.write_data_terminal_ready(level) {
            tracing::debug!("DTR cannot be set: {error}");
        }
        shared.sleep(Duration::from_millis(50));
    }
}
