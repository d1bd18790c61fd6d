//! Flags: faults of recorded trials.

use super::unknown_word::UnknownWord;
use palpate_sim::objects::EMPTY;
use palpate_tactile::cadence::Cadence;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Fault of a recorded trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Flag {
    /// No sensor was touched.
    NoContact,
    /// The fingers were closed already when the recording began.
    LateStart,
    /// A sensor saturated.
    Saturated,
    /// Readings are missing.
    Interrupted,
    /// The board's sample times are irregular.
    Cadence,
    /// A sensor failed.
    SensorFault,
    /// Another trial holds the same grasp.
    Duplicate,
}

impl Flag {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::NoContact,
        Self::LateStart,
        Self::Saturated,
        Self::Interrupted,
        Self::Cadence,
        Self::SensorFault,
        Self::Duplicate,
    ];

    /// Name on screen.
    pub fn label(self) -> &'static str {
        match self {
            Self::NoContact => "no contact",
            Self::LateStart => "late start",
            Self::Saturated => "saturated",
            Self::Interrupted => "interrupted",
            Self::Cadence => "cadence",
            Self::SensorFault => "sensor fault",
            Self::Duplicate => "duplicate",
        }
    }
}

impl FromStr for Flag {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        UnknownWord::choose(&text.replace('-', " "), "flag", Self::ALL.map(|flag| (flag.label(), flag)))
    }
}

/// A flag and its reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlagRemark {
    /// Kind of fault.
    pub flag: Flag,
    /// Reason with numbers.
    pub remark: String,
}

/// Flags that are faults for this object: an empty hand has no contact.
pub fn flaws(flags: Vec<FlagRemark>, object: Option<&str>) -> Vec<FlagRemark> {
    flags.into_iter().filter(|found| found.flag != Flag::NoContact || object != Some(EMPTY)).collect()
}

/// Timing of a board in one line.
pub fn cadence_line(cadence: &Cadence) -> String {
    let Cadence { rate_hz, jitter_p95_ms, lost, .. } = cadence;
    format!("{rate_hz:.2} Hz, jitter {jitter_p95_ms:.1} ms, {lost} lost")
}
