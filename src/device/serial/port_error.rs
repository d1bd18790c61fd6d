//! Errors of ports, with cause and fix.

use super::ports::PortInfo;
use serde::Serialize;
use std::io::ErrorKind as Io;
use std::path::Path;

/// Kind of port error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PortTrouble {
    /// There is no such port.
    NotFound,
    /// No port looks like a board.
    NoBoard,
    /// More than one port looks like a board.
    Several,
    /// The user lacks permission.
    Permission,
    /// Another program has it.
    Busy,
    /// It is not a serial port.
    NotSerial,
    /// A file of captured bytes cannot be read.
    Capture,
    /// Another system error.
    System,
}

/// Error of a port: what failed, why, and what to try.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{what}: {cause}. {fix}")]
pub struct PortError {
    /// Its kind.
    pub trouble: PortTrouble,
    /// What failed.
    pub what: String,
    pub cause: String,
    /// Fix, in a sentence.
    pub fix: String,
    /// Command for the fix, if there is one.
    pub command: Option<String>,
}

/// udev rule that keeps ModemManager away from Arduino boards.
pub const MODEM_MANAGER_RULE: &str = "ATTRS{idVendor}==\"2341|2a03\", ENV{ID_MM_DEVICE_IGNORE}=\"1\"";
/// Command that installs [`MODEM_MANAGER_RULE`].
pub const MODEM_MANAGER_COMMAND: &str = "echo 'ATTRS{idVendor}==\"2341|2a03\", ENV{ID_MM_DEVICE_IGNORE}=\"1\"' | \
     sudo tee /etc/udev/rules.d/77-palpate.rules && sudo udevadm control --reload && sudo udevadm trigger";

/// udev rule that lets the logged-in user access Arduino boards; its file must sort before 73.
pub const ACCESS_RULE: &str = "SUBSYSTEM==\"tty\", ATTRS{idVendor}==\"2341|2a03\", TAG+=\"uaccess\"";

impl PortError {
    fn opening(trouble: PortTrouble, path: &Path, cause: impl Into<String>, fix: impl Into<String>) -> Self {
        let what = format!("cannot open port \"{}\"", path.display());
        Self { trouble, what, cause: cause.into(), fix: fix.into(), command: None }
    }

    /// Explains a failed attempt to open a port.
    pub(super) fn of(path: &Path, error: &serialport::Error, ports: &[PortInfo]) -> Self {
        match error.kind() {
            serialport::ErrorKind::Io(Io::PermissionDenied) => Self::permission(path),
            serialport::ErrorKind::Io(Io::NotFound) => Self::not_found(path, ports),
            // Windows says so of a port in use as well, and its ports are no files.
            serialport::ErrorKind::NoDevice if path.exists() || ports.iter().any(|port| port.path == path) => {
                Self::busy(path)
            }
            serialport::ErrorKind::NoDevice => Self::not_found(path, ports),
            _ if path.is_dir() || is_no_terminal(&error.description) => {
                let fix = format!("Choose another{}", listing(ports));
                Self::opening(PortTrouble::NotSerial, path, "it is not a serial port", fix)
            }
            _ => {
                let fix = "Unplug the board, plug it in again, then connect";
                Self::opening(PortTrouble::System, path, error.description.clone(), fix)
            }
        }
    }

    pub(super) fn not_found(path: &Path, ports: &[PortInfo]) -> Self {
        let fix = format!("Is the board plugged in? Choose another port{}", listing(ports));
        Self::opening(PortTrouble::NotFound, path, "no such port", fix)
    }

    fn permission(path: &Path) -> Self {
        let Some(group) = group_of(path) else {
            let fix = "Ask your administrator for access to serial ports";
            return Self::opening(PortTrouble::Permission, path, "permission denied", fix);
        };
        let command = format!("sudo usermod -aG {group} $USER");
        let cause = format!("permission denied; only the group {group} is allowed");
        let fix = format!(
            "Run `{command}`, then log out and in again. Or allow the logged-in user: put the udev rule {ACCESS_RULE} into \
             /etc/udev/rules.d/70-palpate.rules, and plug the board in again"
        );
        Self { command: Some(command), ..Self::opening(PortTrouble::Permission, path, cause, fix) }
    }

    fn busy(path: &Path) -> Self {
        if is_running("ModemManager") {
            let fix = format!(
                "Close the Arduino Serial Monitor and other programs on the port, then connect. In the first half minute it \
                 may be ModemManager, which probes each new port: wait, or add the udev rule {MODEM_MANAGER_RULE} and plug \
                 the board in again"
            );
            let command = Some(MODEM_MANAGER_COMMAND.to_owned());
            let cause = "it is open in another program, or ModemManager is probing it";
            return Self { command, ..Self::opening(PortTrouble::Busy, path, cause, fix) };
        }
        let fix = "Close the Arduino Serial Monitor and other programs on the port, then connect";
        Self::opening(PortTrouble::Busy, path, "it is open in another program", fix)
    }

    pub(super) fn several(ports: &[PortInfo]) -> Self {
        Self {
            trouble: PortTrouble::Several,
            what: "cannot choose a port".to_owned(),
            cause: "several look like the gripper's board".to_owned(),
            fix: format!("Name one{}", listing(ports)),
            command: None,
        }
    }

    pub(super) fn no_board(ports: &[PortInfo]) -> Self {
        Self {
            trouble: PortTrouble::NoBoard,
            what: "no gripper found".to_owned(),
            cause: "no port looks like its board".to_owned(),
            fix: format!("Plug it in, or choose a port{}", listing(ports)),
            command: None,
        }
    }

    pub(super) fn capture(path: &Path, cause: impl Into<String>) -> Self {
        Self {
            trouble: PortTrouble::Capture,
            what: format!("cannot replay \"{}\"", path.display()),
            cause: cause.into(),
            fix: "Choose a port, or a file of captured bytes".to_owned(),
            command: None,
        }
    }
}

/// The ports of this computer, for the end of a sentence.
fn listing(ports: &[PortInfo]) -> String {
    if ports.is_empty() {
        return "; this computer has none".to_owned();
    }
    let ports: Vec<String> = ports.iter().map(|p| format!("{} {}", p.path.display(), p.title)).collect();
    format!(": {}", ports.join(", "))
}

fn is_no_terminal(description: &str) -> bool {
    let text = description.to_ascii_lowercase();
    text.contains("typewriter") || text.contains("inappropriate ioctl")
}

/// The group that a device belongs to; elsewhere none can be joined by a command that all systems have.
#[cfg(target_os = "linux")]
fn group_of(path: &Path) -> Option<String> {
    use std::os::unix::fs::MetadataExt;
    let gid = std::fs::metadata(path).ok()?.gid().to_string();
    let groups = std::fs::read_to_string("/etc/group").ok()?;
    let line = groups.lines().find(|line| line.split(':').nth(2) == Some(gid.as_str()))?;
    // No user should join root's group.
    line.split(':').next().filter(|name| *name != "root").map(str::to_owned)
}

#[cfg(not(target_os = "linux"))]
fn group_of(_path: &Path) -> Option<String> {
    None
}

/// True where a program of this name is running (Linux).
pub fn is_running(program: &str) -> bool {
    let Ok(processes) = std::fs::read_dir("/proc") else { return false };
    let comm = |entry: std::fs::DirEntry| std::fs::read_to_string(entry.path().join("comm")).unwrap_or_default();
    // The system cuts names after fifteen letters.
    let short: String = program.chars().take(15).collect();
    processes.flatten().any(|entry| comm(entry).trim_end() == short)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    #[test]
    fn a_listed_port_that_does_not_open_is_busy() {
        let com = PortInfo::new("COM3".to_owned(), &serialport::SerialPortType::PciPort);
        let error = serialport::Error::new(serialport::ErrorKind::NoDevice, "Access is denied.");
        let trouble = |path: &str| PortError::of(Path::new(path), &error, std::slice::from_ref(&com)).trouble;
        assert_eq!((trouble("COM3"), trouble("COM4")), (PortTrouble::Busy, PortTrouble::NotFound));
    }

    #[cfg(target_os = "linux")]
    fn error(kind: serialport::ErrorKind, text: &str) -> PortError {
        // A file that exists wherever tests run.
        PortError::of(&PathBuf::from("/proc/self/comm"), &serialport::Error::new(kind, text), &[])
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn troubles_are_told_apart_with_cause_and_fix() {
        let busy = error(serialport::ErrorKind::NoDevice, "Device or resource busy");
        assert!(busy.trouble == PortTrouble::Busy && busy.to_string().contains("comm\": it is"));
        let gone = PortError::of(
            Path::new("/dev/ttyACM77"),
            &serialport::Error::new(serialport::ErrorKind::Io(Io::NotFound), "No such file"),
            &[],
        );
        assert!(gone.trouble == PortTrouble::NotFound && gone.fix.contains("plugged in"));
        let denied = error(serialport::ErrorKind::Io(Io::PermissionDenied), "Permission denied");
        assert!(denied.trouble == PortTrouble::Permission && denied.cause.contains("permission denied"));
        assert_eq!(error(serialport::ErrorKind::Unknown, "Not a typewriter").trouble, PortTrouble::NotSerial);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_group_that_owns_a_port_is_named() {
        // /etc/passwd is root's; the terminal of last resort belongs to a group of its own on most systems.
        let groups = ["/dev/tty", "/dev/ptmx", "/etc/passwd"].map(|path| group_of(Path::new(path)));
        assert!(groups.iter().flatten().all(|group| !group.is_empty() && group != "root"), "{groups:?}");
        let own = std::fs::read_to_string("/proc/self/comm").unwrap_or_default();
        assert!(is_running(own.trim_end()) && !is_running("no such program"));
    }
}
