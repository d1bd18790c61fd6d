//! The list of the checks: what each needs, and how it judges.

use super::connection::{
    RATE_S, baud, busy, clock, firmware, lines, modem_manager, permission, port, rate, restarts, silence,
};
use super::evidence::Needs;
use super::sensors::{bits, crosstalk, movement, open_circuit, saturation, sensors};
use super::{CheckFinding, CheckStatus, Observations, SKETCH};
use Needs::{Counts, Nothing, Port, Readings};

/// One check.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    pub name: &'static str,
    /// What holds when it passes.
    pub about: &'static str,
    needs: Needs,
    next: Next,
}

/// A channel counts as saturated after half a second (s).
const ENDS_S: f64 = 1.0;

/// All checks, in the order in which they are shown.
pub const CHECKS: &[Check] = &[
    check("port", "a board is connected", Nothing(port), Next::Ports),
    check("permission", "you may open the port", Nothing(permission), Next::Nothing),
    check("busy", "no other program has the port", Nothing(busy), Next::Ports),
    check("modem-manager", "ModemManager leaves the port alone", Nothing(modem_manager), Next::Nothing),
    check("silence", "the board sends data", Port(silence), Next::Upload),
    check("restarts", "the board does not restart", Readings(0.0, restarts), Next::Again),
    check("baud", "the baud rate is right", Port(baud), Next::Again),
    check("lines", "lines are readable", Port(lines), Next::Again),
    check("sensors", "the channels are those of the four sensors", Readings(0.0, sensors), Next::Upload),
    check("firmware", "the board identifies itself", Readings(0.0, firmware), Next::Upload),
    check("bits", "the converter has 12 bits", Readings(0.0, bits), Next::Upload),
    check("saturation", "no channel is saturated", Counts(ENDS_S, saturation), Next::Again),
    check("open-circuit", "every sensor is connected", Counts(ENDS_S, open_circuit), Next::Again),
    check("movement", "every strip moves with its finger", Counts(ENDS_S, movement), Next::Again),
    check("crosstalk", "no channel bleeds into the next", Counts(ENDS_S, crosstalk), Next::Crosstalk),
    check("rate", "samples arrive at the stated rate", Readings(RATE_S, rate), Next::Again),
    check("clock", "the board's clock is accurate", Readings(0.0, clock), Next::Upload),
];

const fn check(name: &'static str, about: &'static str, needs: Needs, next: Next) -> Check {
    Check { name, about, needs, next }
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
        let found = self.needs.judged(seen);
        let worth_it =
            found.verdict >= CheckStatus::Note || (found.verdict == CheckStatus::NotChecked && found.cause.is_some());
        let next = || self.next.command(seen).filter(|_| worth_it);
        CheckFinding { check: self.name, command: found.command.clone().or_else(next), ..found }
    }
}
