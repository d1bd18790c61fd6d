//! Order of the library by one of its columns.

use super::LibraryTrial;
use super::quality::TrialQuality;
use crate::labels::UnknownWord;
use palpate_tactile::trial::TrialId;
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
    /// Sensors.
    Sensors,
    /// Quality, the best first.
    Quality,
    /// Tags.
    Tags,
    /// Note.
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

/// Value that trials are ordered by. The first letters as a number decide almost every comparison of texts.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct SortKey<'a> {
    number: u64,
    text: &'a str,
    rest: &'a [String],
    id: TrialId,
}

impl<'a> SortKey<'a> {
    fn of(trial: &'a LibraryTrial, column: TrialColumn) -> Self {
        let row = &trial.row;
        let mut key = Self { number: 0, text: "", rest: &[], id: row.id };
        match column {
            TrialColumn::Id => {}
            TrialColumn::Object => key.set_text(trial.lower_title()),
            // The first eight letters are a year and a month: not worth a look.
            TrialColumn::Date => key.text = &row.created,
            TrialColumn::Source => key.set_text(row.source.name()),
            TrialColumn::Preset => key.set_text(row.preset.unwrap_or_default()),
            TrialColumn::Sensors => key.set_text(&row.sensors),
            TrialColumn::Quality => key.number = TrialQuality::of(row) as u64,
            TrialColumn::Tags => key.rest = &row.tags,
            TrialColumn::Note => key.set_text(&row.note),
            TrialColumn::Samples => key.number = row.samples.max(0).cast_unsigned(),
        }
        key
    }

    fn set_text(&mut self, text: &'a str) {
        let mut first = [0; 8];
        first.iter_mut().zip(text.bytes()).for_each(|(to, from)| *to = from);
        (self.number, self.text) = (u64::from_be_bytes(first), text);
    }
}

impl TrialOrder {
    /// Trials in this order.
    pub(super) fn sorted(self, trials: &[Arc<LibraryTrial>]) -> Vec<Arc<LibraryTrial>> {
        let mut keys: Vec<(SortKey<'_>, usize)> =
            trials.iter().enumerate().map(|(at, trial)| (SortKey::of(trial, self.column), at)).collect();
        // Almost in order for numbers and dates: the stable sort finds that.
        keys.sort();
        if self.descending {
            keys.reverse();
        }
        keys.iter().map(|(_, at)| Arc::clone(&trials[*at])).collect()
    }
}
