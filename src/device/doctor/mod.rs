//! What is wrong between the gripper's board and this computer: one look at the port, then a list of checks, each a small
//! function from what was seen to a finding with cause and fix. A terminal and a window show the same list.
//!
//! To add a check, write it in `checks` and add one line to [`CHECKS`].

mod checks;
mod crosstalk;
mod examine;
#[cfg(test)]
mod tests;
mod traces;
mod wiring;

pub use checks::{CHECKS, Check};
pub use crosstalk::{Bleed, CrosstalkTest};
pub use examine::examine;
pub use traces::{ChannelTrace, ChannelTraces};
pub use wiring::{SKETCH, SketchError, WIRING_PAGE, WIRING_RULES, Wire, wires, write_sketch};

use crate::serial::{LinkStatus, PortError, PortInfo};
use serde::Serialize;

/// What a check came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CheckStatus {
    /// Nothing could be seen, because of what an earlier check found, or because nothing moved.
    Skipped,
    /// As it should be.
    Passed,
    /// Nothing is wrong, but it is worth knowing.
    Note,
    /// Something is wrong.
    Failed,
}

impl CheckStatus {
    /// In a word or two.
    pub fn name(self) -> &'static str {
        match self {
            Self::Skipped => "skipped",
            Self::Passed => "ok",
            Self::Note => "note",
            Self::Failed => "FAILED",
        }
    }
}

/// What a check found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckFinding {
    /// Name of the check.
    pub check: &'static str,
    /// What it came to.
    pub verdict: CheckStatus,
    /// What was seen, in a sentence.
    pub seen: String,
    /// Why that is so, where something is wrong or worth knowing.
    pub cause: Option<String>,
    /// What to do about it.
    pub fix: Option<String>,
    /// A command that does it, to be copied.
    pub command: Option<String>,
}

/// Everything that the checks look at.
#[derive(Clone, Debug)]
pub struct Observations {
    /// The ports that there are.
    pub ports: Vec<PortInfo>,
    /// Why none could be chosen or opened; none where one was.
    pub refused: Option<PortError>,
    /// ModemManager runs.
    pub modem_manager: bool,
    /// How the link stood at the end; none where it was not opened.
    pub link: Option<LinkStatus>,
    /// How long it was listened to (s).
    pub listened_s: f64,
    /// What was read meanwhile.
    pub traces: ChannelTraces,
}

/// How long to listen where nobody says (s): enough to bend a finger and press each pad.
pub const USUAL_LISTEN_S: f64 = 8.0;

/// True where nothing is wrong.
pub fn is_sound(found: &[CheckFinding]) -> bool {
    found.iter().all(|finding| finding.verdict != CheckStatus::Failed)
}

/// In a sentence: how much is wrong.
pub fn summary(found: &[CheckFinding]) -> String {
    match found.iter().filter(|finding| finding.verdict == CheckStatus::Failed).count() {
        0 => "nothing is wrong".to_owned(),
        1 => "one thing is wrong".to_owned(),
        more => format!("{more} things are wrong"),
    }
}

/// All checks, in the order in which they are told.
pub fn findings(seen: &Observations) -> Vec<CheckFinding> {
    CHECKS.iter().map(|check| check.look(seen)).collect()
}
