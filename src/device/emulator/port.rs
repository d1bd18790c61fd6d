//! The pseudo-terminal on which the emulated gripper is reached, and the link that names it.
//!
//! The terminal's other end is not kept open here, so that a host that comes or goes is noticed. Each host gets a fresh
//! terminal: nothing that was meant for the last one is left in it, and no lock that the last one put on it.

use super::faults::FaultKind;
use super::gripper::{EmulatedGripper, EmulatorEventKind};
use super::uart::misread;
use serialport::{SerialPort as _, TTYPort};
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// How long a look for bytes from the host takes at most: the grain of everything that happens on the port.
const GRAIN: Duration = Duration::from_millis(1);

/// Bytes that wait for a host that does not read, beyond what the terminal itself holds: two seconds at 1 kHz on eight
/// channels. What comes then is given up, as drivers and boards give it up.
const MOST_WAITING: usize = 1 << 18;

/// How often it is told that something was given up.
const TELL_EVERY: Duration = Duration::from_secs(1);

/// How the gripper is reached.
#[derive(Clone, Debug)]
pub struct PortSetup {
    /// The symbolic link that names the terminal.
    pub link: PathBuf,
    /// Seconds of the gripper per second.
    pub speed: f64,
    /// Bits per second of its serial line, where it has one: a host that reads at another rate gets nonsense.
    pub baud: Option<u32>,
    /// Silence after a host has opened the port (s): the programming port of a Due restarts the board.
    pub boot_s: f64,
}

/// Why a emulated gripper cannot be reached.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// Something else stands where the link should be.
    #[error("{path} exists and is not a link to a terminal. Choose another name, or remove it")]
    Taken {
        /// The path.
        path: PathBuf,
    },
    /// The link cannot be made.
    #[error("cannot make the link {path}: {cause}. Choose a folder that exists and that you may write to")]
    Link {
        /// The path.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// There is no pseudo-terminal.
    #[error("cannot open a pseudo-terminal: {0}")]
    Terminal(#[from] serialport::Error),
    /// The writing thread cannot start.
    #[error("cannot start a thread: {0}")]
    Thread(std::io::Error),
}

/// Runs the gripper on a pseudo-terminal until `stop` is set. `turn` is called again and again, to take what happened and to
/// say what comes next.
pub fn serve(
    gripper: &mut EmulatedGripper,
    served: &PortSetup,
    stop: &AtomicBool,
    turn: &mut dyn FnMut(&mut EmulatedGripper),
) -> Result<(), ServeError> {
    let mut port = Port::new(served, gripper)?;
    while !stop.load(Ordering::Relaxed) {
        port.turn(gripper)?;
        turn(gripper);
    }
    Ok(())
}

/// The port as a host sees it.
struct Port<'a> {
    served: &'a PortSetup,
    /// Gone while it has vanished.
    terminal: Option<Terminal>,
    link: Link,
    /// When the first host came: the gripper's time counts from there.
    since: Option<Instant>,
    /// When the host came that is there now.
    host: Option<Instant>,
}

impl<'a> Port<'a> {
    fn new(served: &'a PortSetup, gripper: &mut EmulatedGripper) -> Result<Self, ServeError> {
        let link = Link::new(&served.link)?;
        let mut port = Self { served, terminal: None, link, since: None, host: None };
        port.appear(gripper)?;
        Ok(port)
    }

    /// Opens a terminal, beside the one there was if that is still held by its writer.
    fn appear(&mut self, gripper: &mut EmulatedGripper) -> Result<(), ServeError> {
        let (terminal, path) = Terminal::open(&self.link)?;
        gripper.tell(EmulatorEventKind::Port { path });
        self.terminal = Some(terminal);
        Ok(())
    }

    /// Looks what the host does, lets the gripper's time pass, and hands over what it printed.
    fn turn(&mut self, gripper: &mut EmulatedGripper) -> Result<(), ServeError> {
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
        let mut heard = [0; 256];
        match terminal.near.read(&mut heard) {
            Ok(count) => {
                self.host_is_there(gripper);
                gripper.hear(&heard[..count]);
            }
            // A host is there and says nothing.
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
            // What came out before was for nobody.
            drop(gripper.take_bytes());
            gripper.tell(EmulatorEventKind::HostCame);
        }
    }

    fn nobody_is_there(&mut self, gripper: &mut EmulatedGripper) -> Result<(), ServeError> {
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

    /// Gives the host what the board printed, as its line makes it arrive.
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
        if let Some(bytes) = terminal.take_given_up() {
            gripper.tell(EmulatorEventKind::Overrun { bytes });
        }
    }
}

/// The symbolic link; it goes when this does.
struct Link {
    path: PathBuf,
}

impl Link {
    /// Complains when something else is in its place.
    fn new(path: &Path) -> Result<Self, ServeError> {
        match std::fs::symlink_metadata(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => {}
            Ok(_) if leads_to_a_terminal(path) => {}
            _ => return Err(ServeError::Taken { path: path.to_owned() }),
        }
        Ok(Self { path: path.to_owned() })
    }

    /// Makes it lead to a terminal; at no moment is there none if there was one.
    fn lead_to(&self, terminal: &str) -> Result<(), ServeError> {
        let mut beside = self.path.clone().into_os_string();
        beside.push(format!(".{}", std::process::id()));
        let made = symlink(terminal, &beside).and_then(|()| std::fs::rename(&beside, &self.path));
        made.map_err(|cause| ServeError::Link { path: self.path.clone(), cause })
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

/// Whether a path is a symbolic link to a pseudo-terminal, of whatever age.
fn leads_to_a_terminal(path: &Path) -> bool {
    std::fs::read_link(path).is_ok_and(|to| to.starts_with("/dev/pts") || to.to_string_lossy().starts_with("/dev/ttys"))
}

/// One pseudo-terminal: our end of it, and a thread that writes, so that a host that does not read holds up nobody.
struct Terminal {
    near: TTYPort,
    output: Sender<Vec<u8>>,
    /// Bytes that were handed to the writer and that the terminal has not taken.
    waiting: Arc<AtomicUsize>,
    /// Bytes that were given up and not told of, and when that was done last.
    given_up: u64,
    told: Instant,
}

impl Terminal {
    fn open(link: &Link) -> Result<(Self, String), ServeError> {
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
            .map_err(ServeError::Thread)?;
        link.lead_to(&name)?;
        Ok((Self { near, output, waiting, given_up: 0, told: Instant::now() }, name))
    }

    /// Hands bytes to the host; what it does not read in time is given up.
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
        self.given_up += size as u64;
    }

    /// Bytes that were given up since this was asked for last, once in a while.
    fn take_given_up(&mut self) -> Option<u64> {
        if self.given_up == 0 || self.told.elapsed() < TELL_EVERY {
            return None;
        }
        self.told = Instant::now();
        Some(std::mem::take(&mut self.given_up))
    }
}

/// Writes a piece, however often it takes; a host that has gone misses it.
fn write(writer: &mut TTYPort, mut piece: &[u8]) {
    while !piece.is_empty() {
        match writer.write(piece) {
            Ok(written) => piece = piece.get(written..).unwrap_or_default(),
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(_) => return,
        }
    }
}
