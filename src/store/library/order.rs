//! Order of the library by one of its columns.

use super::LibraryTrial;
use super::quality::TrialQuality;
use crate::labels::UnknownWord;
use palpate_tactile::trial::TrialId;
use std::collections::{HashMap, HashSet};
use std::hash::Hash;
use std::str::FromStr;
use std::sync::Arc;

/// Column of the library.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrialColumn {
    /// Number.
    Id,
    /// Title of the object.
    Object,
    /// Time of the beginning.
    #[default]
    Date,
    /// Origin.
    Source,
    /// Preset of poses.
    Preset,
    Sensors,
    /// Quality, the best first.
    Quality,
    Tags,
    Note,
    /// Number of samples.
    Samples,
}

impl TrialColumn {
    /// All columns.
    pub const ALL: [Self; 10] = [
        Self::Id,
        Self::Object,
        Self::Date,
        Self::Source,
        Self::Preset,
        Self::Sensors,
        Self::Quality,
        Self::Tags,
        Self::Note,
        Self::Samples,
    ];

    /// Name on screen and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Id => "id",
            Self::Object => "object",
            Self::Date => "date",
            Self::Source => "source",
            Self::Preset => "preset",
            Self::Sensors => "sensors",
            Self::Quality => "quality",
            Self::Tags => "tags",
            Self::Note => "note",
            Self::Samples => "samples",
        }
    }
}

impl FromStr for TrialColumn {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        UnknownWord::choose(text, "column", Self::ALL.map(|column| (column.name(), column)))
    }
}

/// Order of trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrialOrder {
    /// Column that counts; trials alike in it stand by their numbers.
    pub column: TrialColumn,
    /// Last first.
    pub descending: bool,
}

impl Default for TrialOrder {
    /// The newest first.
    fn default() -> Self {
        Self { column: TrialColumn::Date, descending: true }
    }
}

/// Places of trials in the order of a column: those alike have the same.
fn ranks(trials: &[Arc<LibraryTrial>], column: TrialColumn) -> Vec<u64> {
    match column {
        // `sorted` orders them by date and number.
        TrialColumn::Id | TrialColumn::Date => vec![0; trials.len()],
        TrialColumn::Object => ranks_of(trials.iter().map(|trial| trial.lower_title())),
        TrialColumn::Source => ranks_of(trials.iter().map(|trial| (trial.row.source.name(), trial.row.place.name()))),
        TrialColumn::Preset => ranks_of(trials.iter().map(|trial| trial.row.preset.unwrap_or_default())),
        TrialColumn::Sensors => ranks_of(trials.iter().map(|trial| trial.row.sensors.as_str())),
        TrialColumn::Quality => trials.iter().map(|trial| TrialQuality::of(&trial.row) as u64).collect(),
        TrialColumn::Tags => ranks_of(trials.iter().map(|trial| trial.row.tags.as_slice())),
        TrialColumn::Note => ranks_of(trials.iter().map(|trial| trial.row.note.as_str())),
        TrialColumn::Samples => trials.iter().map(|trial| trial.row.samples.max(0).cast_unsigned()).collect(),
    }
}

/// Ranks of values. Few differ, as a rule: only those are compared with each other.
fn ranks_of<T: Copy + Ord + Hash>(values: impl Iterator<Item = T> + Clone) -> Vec<u64> {
    let distinct: HashSet<T> = values.clone().collect();
    let mut ordered: Vec<T> = distinct.into_iter().collect();
    ordered.sort_unstable();
    let rank: HashMap<T, u64> = ordered.into_iter().zip(0..).collect();
    values.map(|value| rank[&value]).collect()
}

impl TrialOrder {
    /// Trials in this order.
    pub(super) fn sorted(self, trials: &[Arc<LibraryTrial>]) -> Vec<Arc<LibraryTrial>> {
        let ranked = ranks(trials, self.column).into_iter().zip(trials).enumerate();
        let mut keys: Vec<(u64, &str, TrialId, usize)> = ranked
            .map(|(at, (rank, trial))| {
                let date = if self.column == TrialColumn::Date { trial.row.created.as_str() } else { "" };
                (rank, date, trial.row.id, at)
            })
            .collect();
        // Almost in order by date and number, and where most are alike: the stable sort finds that.
        keys.sort();
        if self.descending {
            keys.reverse();
        }
        keys.iter().map(|(.., at)| Arc::clone(&trials[*at])).collect()
    }
}
