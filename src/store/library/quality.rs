//! Quality of trials in one word.

use crate::TrialRow;
use crate::labels::UnknownWord;
use std::str::FromStr;

/// Quality of a trial in one word, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrialQuality {
    /// Nothing to remark.
    Sound,
    /// Sound, with warnings or flags, or not recorded to its end.
    Warned,
    /// Data sets exclude it.
    Unsound,
    /// Not what was stored: it can only be deleted, or taken from a backup.
    Damaged,
}

impl TrialQuality {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Sound, Self::Warned, Self::Unsound, Self::Damaged];

    /// Quality of a trial.
    pub fn of(row: &TrialRow) -> Self {
        if row.damaged {
            Self::Damaged
        } else if !row.sound {
            Self::Unsound
        } else if row.warnings > 0 || !row.flags.is_empty() || row.state != "complete" {
            Self::Warned
        } else {
            Self::Sound
        }
    }

    /// Name on screen and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sound => "sound",
            Self::Warned => "warned",
            Self::Unsound => "unsound",
            Self::Damaged => "damaged",
        }
    }
}

impl FromStr for TrialQuality {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        UnknownWord::choose(text, "quality", Self::ALL.map(|quality| (quality.name(), quality)))
    }
}
