//! Pseudo-terminal of the emulated gripper, and the symbolic link to it.
//!
//! The terminal's other end is not kept open, so that hosts are noticed when they connect and disconnect. Each host gets a
//! fresh terminal, without old bytes and locks.

use super::event::{EmulatorError, EmulatorEventKind};
use super::faults::FaultKind;
use super::gripper::EmulatedGripper;
use super::uart::misread;
use serialport::{SerialPort as _, TTYPort};
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// Longest wait for bytes from the host, and time resolution of the port.
const GRAIN: Duration = Duration::from_millis(1);

/// Buffer for a host that does not read, beyond the terminal's own (bytes): two seconds at 1 kHz on eight channels. More is
/// dropped, as drivers and boards drop it.
const MOST_WAITING: usize = 1 << 18;

/// Period of reports about dropped bytes.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// Port of the emulated gripper.
#[derive(Clone, Debug)]
pub struct PortSetup {
    /// Symbolic link to the terminal.
    pub link: PathBuf,
    /// Speed of emulated time.
    pub speed: f64,
    /// Baud rate, if it has one: a host at another rate reads garbage.
    pub baud: Option<u32>,
    /// Silence after a host connects (s): the programming port of a Due restarts the board.
    pub boot_s: f64,
}

impl From<serialport::Error> for EmulatorError {
    fn from(cause: serialport::Error) -> Self {
        Self(format!("cannot open a pseudo-terminal: {cause}"))
    }
}

/// Runs the gripper on a pseudo-terminal until `stop` is set; `turn` is called every millisecond or so.
pub fn serve(
    gripper: &mut EmulatedGripper,
    served: &PortSetup,
    stop: &AtomicBool,
    turn: &mut dyn FnMut(&mut EmulatedGripper),
) -> Result<(), EmulatorError> {
    let mut port = Port::new(served, gripper)?;
    while !stop.load(Ordering::Relaxed) {
        port.turn(gripper)?;
        turn(gripper);
    }
    Ok(())
}

/// The port, as a host sees it.
struct Port<'a> {
    served: &'a PortSetup,
    /// None while it has disappeared.
    terminal: Option<Terminal>,
    link: Link,
    /// Time of the first host, from which the gripper's time counts.
    since: Option<Instant>,
    /// Time at which the present host connected.
    host: Option<Instant>,
}

impl<'a> Port<'a> {
    fn new(served: &'a PortSetup, gripper: &mut EmulatedGripper) -> Result<Self, EmulatorError> {
        let link = Link::new(&served.link)?;
        let mut port = Self { served, terminal: None, link, since: None, host: None };
        port.appear(gripper)?;
        Ok(port)
    }

    /// Opens a terminal, beside the old one if its writer still holds it.
    fn appear(&mut self, gripper: &mut EmulatedGripper) -> Result<(), EmulatorError> {
        let (terminal, path) = Terminal::open(&self.link)?;
        gripper.tell(EmulatorEventKind::Port { path });
        self.terminal = Some(terminal);
        Ok(())
    }

    /// Reads from the host, advances the gripper, and sends its output.
    fn turn(&mut self, gripper: &mut EmulatedGripper) -> Result<(), EmulatorError> {
        if let Some(since) = self.since {
            gripper.advance(since.elapsed().as_secs_f64() * self.served.speed);
        }
        if gripper.fault(FaultKind::Vanish).is_some() {
            self.vanish(gripper);
            return Ok(());
        }
        if self.terminal.is_none() {
            self.appear(gripper)?;
        }
        let Some(terminal) = &mut self.terminal else { return Ok(()) };
        let mut bytes = [0; 256];
        match terminal.near.read(&mut bytes) {
            Ok(count) => {
                self.host_is_there(gripper);
                gripper.hear(&bytes[..count]);
            }
            // A host is connected and silent.
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => self.host_is_there(gripper),
            Err(_) => self.nobody_is_there(gripper)?,
        }
        self.hand_over(gripper);
        Ok(())
    }

    fn host_is_there(&mut self, gripper: &mut EmulatedGripper) {
        if self.host.is_none() {
            let now = Instant::now();
            self.since.get_or_insert(now);
            self.host = Some(now);
            // Output from before is dropped.
            drop(gripper.take_bytes());
            gripper.tell(EmulatorEventKind::HostCame);
        }
    }

    fn nobody_is_there(&mut self, gripper: &mut EmulatedGripper) -> Result<(), EmulatorError> {
        if self.host.take().is_some() {
            gripper.tell(EmulatorEventKind::HostLeft);
            self.terminal = None;
            self.appear(gripper)?;
        }
        drop(gripper.take_bytes());
        std::thread::sleep(GRAIN);
        Ok(())
    }

    fn vanish(&mut self, gripper: &mut EmulatedGripper) {
        if self.terminal.take().is_some() {
            self.link.remove();
            if self.host.take().is_some() {
                gripper.tell(EmulatorEventKind::HostLeft);
            }
        }
        drop(gripper.take_bytes());
        std::thread::sleep(GRAIN);
    }

    /// Sends the board's output to the host, at its baud rate.
    fn hand_over(&mut self, gripper: &mut EmulatedGripper) {
        let bytes = gripper.take_bytes();
        let (Some(terminal), Some(host)) = (&mut self.terminal, self.host) else { return };
        if host.elapsed().as_secs_f64() * self.served.speed < self.served.boot_s {
            return;
        }
        let bytes = match (self.served.baud, terminal.near.baud_rate()) {
            (Some(sent), Ok(read)) => misread(&bytes, f64::from(sent), f64::from(read)),
            _ => bytes,
        };
        terminal.send(bytes);
        if let Some(bytes) = terminal.take_dropped() {
            gripper.tell(EmulatorEventKind::Overrun { bytes });
        }
    }
}

/// Symbolic link, removed on drop.
struct Link {
    path: PathBuf,
}

impl Link {
    /// Refuses a path that is taken.
    fn new(path: &Path) -> Result<Self, EmulatorError> {
        match std::fs::symlink_metadata(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => {}
            Ok(_) if leads_to_a_terminal(path) => {}
            _ => {
                let path = path.display();
                return Err(EmulatorError(format!(
                    "{path} exists and is not a link to a terminal. Choose another name, or remove it"
                )));
            }
        }
        Ok(Self { path: path.to_owned() })
    }

    /// Points it to a terminal, atomically.
    fn lead_to(&self, terminal: &str) -> Result<(), EmulatorError> {
        let mut beside = self.path.clone().into_os_string();
        beside.push(format!(".{}", std::process::id()));
        let made = symlink(terminal, &beside).and_then(|()| std::fs::rename(&beside, &self.path));
        made.map_err(|cause| {
            let path = self.path.display();
            EmulatorError(format!("cannot create the link {path}: {cause}. Choose an existing, writable folder"))
        })
    }

    fn remove(&self) {
        if leads_to_a_terminal(&self.path) {
            // Someone else may have removed it.
            let _gone = std::fs::remove_file(&self.path);
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.remove();
    }
}

/// True for a symbolic link to a pseudo-terminal, old or new.
fn leads_to_a_terminal(path: &Path) -> bool {
    std::fs::read_link(path).is_ok_and(|to| to.starts_with("/dev/pts") || to.to_string_lossy().starts_with("/dev/ttys"))
}

/// Our end of a pseudo-terminal, and a writing thread, so that a host that does not read blocks nothing.
struct Terminal {
    near: TTYPort,
    output: Sender<Vec<u8>>,
    /// Bytes that the writer holds.
    waiting: Arc<AtomicUsize>,
    /// Dropped bytes since the last report, and its time.
    dropped: u64,
    reported: Instant,
}

impl Terminal {
    fn open(link: &Link) -> Result<(Self, String), EmulatorError> {
        let (mut near, far) = TTYPort::pair()?;
        near.set_timeout(GRAIN)?;
        let name = far.name().unwrap_or_default();
        let mut writer = near.try_clone_native()?;
        let (output, pieces) = channel::<Vec<u8>>();
        let waiting = Arc::new(AtomicUsize::new(0));
        let left = Arc::clone(&waiting);
        std::thread::Builder::new()
            .name("emulator-port".to_owned())
            .spawn(move || {
                for piece in pieces {
                    write(&mut writer, &piece);
                    left.fetch_sub(piece.len(), Ordering::Relaxed);
                }
            })
            .map_err(|cause| EmulatorError(format!("cannot start a thread: {cause}")))?;
        link.lead_to(&name)?;
        Ok((Self { near, output, waiting, dropped: 0, reported: Instant::now() }, name))
    }

    /// Sends bytes to the host, or drops them when the buffer is full.
    fn send(&mut self, bytes: Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        let size = bytes.len();
        if self.waiting.load(Ordering::Relaxed) + size <= MOST_WAITING {
            self.waiting.fetch_add(size, Ordering::Relaxed);
            if self.output.send(bytes).is_ok() {
                return;
            }
        }
        self.dropped += size as u64;
    }

    /// Dropped bytes since the last report, once per [`REPORT_EVERY`].
    fn take_dropped(&mut self) -> Option<u64> {
        if self.dropped == 0 || self.reported.elapsed() < REPORT_EVERY {
            return None;
        }
        self.reported = Instant::now();
        Some(std::mem::take(&mut self.dropped))
    }
}

/// Writes a piece in full, unless the host is gone.
fn write(writer: &mut TTYPort, mut piece: &[u8]) {
    while !piece.is_empty() {
        match writer.write(piece) {
            Ok(written) => piece = piece.get(written..).unwrap_or_default(),
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(_) => return,
        }
    }
}
