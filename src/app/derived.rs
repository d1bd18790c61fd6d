//! What plots derive from their channels.

use serde::{Deserialize, Serialize};

/// What a plot shows of its channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Derivation {
    /// Their values.
    #[default]
    Values,
    /// Left and right finger together.
    Sum,
    /// Left finger less the right one.
    Difference,
    /// Change per second.
    Derivative,
}

impl Derivation {
    /// All.
    pub const ALL: [Self; 4] = [Self::Values, Self::Sum, Self::Difference, Self::Derivative];

    /// Name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Values => "values",
            Self::Sum => "left + right",
            Self::Difference => "left − right",
            Self::Derivative => "change per second",
        }
    }

    /// Unit of the derived values.
    pub(super) fn unit(self, unit: &str) -> String {
        match self {
            Self::Values | Self::Sum | Self::Difference => unit.to_owned(),
            Self::Derivative => format!("{unit}/s"),
        }
    }
}
