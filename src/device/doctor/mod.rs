//! Diagnosis of the connection to the gripper's board: the port is observed once, then a list of checks turns the
//! observations into findings with evidence, cause and fix. The terminal and the window show the same list.
//!
//! To add a check, write it in `connection` or `sensors` and add one line to [`CHECKS`]. A check that did not
//! get the data it needs has not passed: its outcome is "not checked".

mod checks;
mod connection;
mod crosstalk;
mod evidence;
mod examine;
mod sensors;
#[cfg(test)]
mod tests;
mod traces;
mod wiring;

pub use checks::{CHECKS, Check};
pub use crosstalk::{Bleed, CrosstalkTest};
pub use examine::{Examination, examine};
pub use traces::{ChannelTrace, ChannelTraces};
pub use wiring::{SKETCH, WIRING_PAGE, WIRING_RULES, Wire, check_firmware, firmware_header, wires, write_sketch};

use crate::protocol::ConsoleLine;
use crate::serial::{LinkStatus, PortError, PortInfo};
use serde::Serialize;

/// Why a board cannot be tested, or the sketch was not written, as a sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DoctorError(String);

/// Outcome of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CheckStatus {
    /// The check does not apply to this board or file.
    Skipped,
    /// Nothing is wrong.
    Passed,
    /// The check did not get the data it needs: no readings, too few, or nothing moved.
    NotChecked,
    /// Worth knowing.
    Note,
    /// Something is wrong.
    Failed,
}

impl CheckStatus {
    /// Its name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Skipped => "skipped",
            Self::Passed => "ok",
            Self::NotChecked => "not checked",
            Self::Note => "note",
            Self::Failed => "FAILED",
        }
    }
}

/// Result of a check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckFinding {
    /// Name of the check.
    pub check: &'static str,
    /// Its outcome.
    pub verdict: CheckStatus,
    /// Observation, in a sentence.
    pub seen: String,
    /// Likely cause, where something is wrong or worth knowing.
    pub cause: Option<String>,
    /// What to do.
    pub fix: Option<String>,
    /// Command that does it, to be copied.
    pub command: Option<String>,
}

/// Input of the checks.
#[derive(Clone, Debug)]
pub struct Observations {
    /// Ports of this computer.
    pub ports: Vec<PortInfo>,
    /// Why no port was opened.
    pub refused: Option<PortError>,
    /// ModemManager is running.
    pub modem_manager: bool,
    /// Status of the link at the end; none where it was not opened.
    pub link: Option<LinkStatus>,
    /// Duration (s).
    pub listened_s: f64,
    /// Readings, summed up per channel.
    pub traces: ChannelTraces,
    /// A line that could not be read, or the newest one.
    pub example: Option<ConsoleLine>,
}

/// Default duration (s): enough to bend a finger and press each pad.
pub const USUAL_LISTEN_S: f64 = 8.0;

/// True where no check failed.
pub fn is_sound(found: &[CheckFinding]) -> bool {
    found.iter().all(|finding| finding.verdict != CheckStatus::Failed)
}

/// Names of the checks that did not see what they need.
pub fn not_checked(found: &[CheckFinding]) -> Vec<&'static str> {
    let unseen = found.iter().filter(|finding| finding.verdict == CheckStatus::NotChecked);
    unseen.map(|finding| finding.check).collect()
}

/// Summary in a sentence. It says "no faults found" only where every check saw what it needs.
pub fn summary(found: &[CheckFinding]) -> String {
    match found.iter().filter(|finding| finding.verdict == CheckStatus::Failed).count() {
        0 => match not_checked(found).as_slice() {
            [] => "no faults found".to_owned(),
            unseen => format!("no fault in what was seen, but not checked: {}", unseen.join(", ")),
        },
        1 => "1 fault found".to_owned(),
        more => format!("{more} faults found"),
    }
}

/// Runs all checks.
pub fn findings(seen: &Observations) -> Vec<CheckFinding> {
    CHECKS.iter().map(|check| check.look(seen)).collect()
}
