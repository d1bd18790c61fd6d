//! The list of the checks: each is a function from observations to an outcome, which states what was seen.

use super::connection::{baud, busy, clock, firmware, lines, modem_manager, permission, port, rate, restarts, silence};
use super::outcome::Outcome;
use super::sensors::{bits, crosstalk, movement, open_circuit, saturation, sensors};
use super::{CheckFinding, CheckStatus, Observations, SKETCH};

/// One check.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    pub name: &'static str,
    /// What holds when it passes.
    pub about: &'static str,
    look: fn(&Observations) -> Outcome,
    next: Next,
}

/// Command to run next when a check finds something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    /// None.
    Nothing,
    /// List the ports.
    Ports,
    /// Upload the firmware.
    Upload,
    /// Run the doctor again, for longer.
    Again,
    /// Run the guided crosstalk test.
    Crosstalk,
}

impl Next {
    fn command(self, seen: &Observations) -> Option<String> {
        let port = seen.link.as_ref().map(|link| &link.port);
        let path = port.map(|port| quoted(&port.path.to_string_lossy()));
        match self {
            Self::Nothing => None,
            Self::Ports => Some("palpate record --list".to_owned()),
            Self::Upload => {
                // The two ports of a Due are two boards to the tools of Arduino.
                let write = format!("palpate doctor --sketch {SKETCH}");
                let due = port.filter(|port| port.usb.as_ref().is_some_and(|usb| matches!(usb.pid, 0x003d | 0x003e)));
                // A copied command must not upload to another board.
                let Some(due) = due else { return Some(write) };
                let (board, host) = match due.kind.native {
                    true => ("arduino_due_x", ""),
                    false => ("arduino_due_x_dbg", " --build-property compiler.cpp.extra_flags=-DHOST=Serial"),
                };
                let upload = format!("arduino-cli compile --upload --fqbn arduino:sam:{board}{host} --port {}", path?);
                Some(format!("{write} && {upload} {SKETCH}"))
            }
            Self::Crosstalk => Some(format!("palpate doctor {} --crosstalk", path?)),
            // A file does not get longer.
            Self::Again => {
                seen.link.as_ref()?.baud?;
                Some(format!("palpate doctor {} --seconds 20", path?))
            }
        }
    }
}

/// A path quoted for a shell.
fn quoted(path: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    if path.chars().all(plain) { path.to_owned() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

impl Check {
    /// Runs the check.
    pub fn look(&self, seen: &Observations) -> CheckFinding {
        let Outcome { verdict, seen: found, cause, fix, command } = (self.look)(seen);
        let worth_it = verdict >= CheckStatus::Note || (verdict == CheckStatus::NotChecked && cause.is_some());
        let command = command.or_else(|| self.next.command(seen).filter(|_| worth_it));
        CheckFinding { check: self.name, verdict, seen: found, cause, fix, command }
    }
}

/// All checks, in the order in which they are shown.
pub const CHECKS: &[Check] = &[
    Check { name: "port", about: "a board is connected", look: port, next: Next::Ports },
    Check { name: "permission", about: "you may open the port", look: permission, next: Next::Nothing },
    Check { name: "busy", about: "no other program has the port", look: busy, next: Next::Ports },
    Check {
        name: "modem-manager",
        about: "ModemManager leaves the port alone",
        look: modem_manager,
        next: Next::Nothing,
    },
    Check { name: "silence", about: "the board sends data", look: silence, next: Next::Upload },
    Check { name: "restarts", about: "the board does not restart", look: restarts, next: Next::Again },
    Check { name: "baud", about: "the baud rate is right", look: baud, next: Next::Again },
    Check { name: "lines", about: "lines are readable", look: lines, next: Next::Again },
    Check { name: "sensors", about: "the channels are those of the four sensors", look: sensors, next: Next::Upload },
    Check { name: "firmware", about: "the board identifies itself", look: firmware, next: Next::Upload },
    Check { name: "bits", about: "the converter has 12 bits", look: bits, next: Next::Upload },
    Check { name: "saturation", about: "no channel is saturated", look: saturation, next: Next::Again },
    Check { name: "open-circuit", about: "every sensor is connected", look: open_circuit, next: Next::Again },
    Check { name: "movement", about: "every strip moves with its finger", look: movement, next: Next::Again },
    Check { name: "crosstalk", about: "no channel bleeds into the next", look: crosstalk, next: Next::Crosstalk },
    Check { name: "rate", about: "samples arrive at the stated rate", look: rate, next: Next::Again },
    Check { name: "clock", about: "the board's clock is accurate", look: clock, next: Next::Upload },
];
