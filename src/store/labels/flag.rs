//! Flags: what may be wrong with a recorded trial.

use palpate_sim::objects::EMPTY;
use palpate_tactile::cadence::Cadence;
use serde::{Deserialize, Serialize};

/// What may be wrong with a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Flag {
    /// Nothing was felt.
    NoContact,
    /// A sensor reached the end of its range.
    Saturated,
    /// Something is missing inside.
    Interrupted,
    /// The board did not keep time.
    Cadence,
}

impl Flag {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::NoContact, Self::Saturated, Self::Interrupted, Self::Cadence];

    /// What it is called on screen.
    pub fn label(self) -> &'static str {
        match self {
            Self::NoContact => "no contact",
            Self::Saturated => "saturated",
            Self::Interrupted => "interrupted",
            Self::Cadence => "cadence",
        }
    }
}

/// A flag and why it was raised.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlagRemark {
    /// The flag.
    pub flag: Flag,
    /// A sentence with the numbers.
    pub remark: String,
}

/// Those flags that are a flaw of a trial of this object: an empty hand feels nothing, and should not.
pub fn flaws(flags: Vec<FlagRemark>, object: Option<&str>) -> Vec<FlagRemark> {
    flags.into_iter().filter(|found| found.flag != Flag::NoContact || object != Some(EMPTY)).collect()
}

/// How well a board kept time, in a sentence.
pub fn cadence_line(cadence: &Cadence) -> String {
    let Cadence { rate_hz, jitter_p95_ms, lost, .. } = cadence;
    format!("{rate_hz:.2} Hz, jitter {jitter_p95_ms:.1} ms, {lost} lost")
}
