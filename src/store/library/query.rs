//! Search and filters of the library, the same in the window and on the command line.

use super::order::TrialOrder;
use super::quality::TrialQuality;
use super::{LibraryTrial, Store, StoreError, TrialPlace};
use crate::labels::{Flag, UnknownWord};
use palpate_tactile::trial::{TrialId, TrialSource};
use std::collections::BTreeSet;
use std::str::FromStr;

/// A local day.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Day {
    /// So many days ago; today is 0.
    Ago(u32),
    /// A date: `2026-11-21`.
    Date(String),
}

impl Day {
    /// The date: `2026-11-21`.
    pub fn date(&self, store: &Store) -> Result<String, StoreError> {
        match self {
            Self::Ago(days) => store.local_day(*days),
            Self::Date(date) => Ok(date.clone()),
        }
    }
}

impl FromStr for Day {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        let text = text.trim();
        let digits = |part: &str, length: usize| part.len() == length && part.bytes().all(|b| b.is_ascii_digit());
        let is_date = matches!(text.split('-').collect::<Vec<_>>()[..], [year, month, day]
            if digits(year, 4) && digits(month, 2) && digits(day, 2)
                && ("01"..="12").contains(&month) && ("01"..="31").contains(&day));
        if is_date {
            return Ok(Self::Date(text.to_owned()));
        }
        let ago = text.strip_suffix('d').and_then(|days| days.parse().ok());
        match (text.to_ascii_lowercase().as_str(), ago) {
            ("today", _) => Ok(Self::Ago(0)),
            ("yesterday", _) => Ok(Self::Ago(1)),
            (_, Some(days)) => Ok(Self::Ago(days)),
            _ => Err(UnknownWord {
                text: text.to_owned(),
                what: "day",
                choices: "today, yesterday, days ago as 7d, or a date as 2026-11-21".to_owned(),
            }),
        }
    }
}

impl std::fmt::Display for Day {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Ago(0) => write!(f, "today"),
            Self::Ago(1) => write!(f, "yesterday"),
            Self::Ago(days) => write!(f, "{days}d"),
            Self::Date(date) => write!(f, "{date}"),
        }
    }
}

/// Which trials are shown as to deletion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shown {
    /// Those that are kept.
    #[default]
    Kept,
    /// Deleted ones.
    Discarded,
    /// Both.
    All,
}

/// Search, filters and order of trials. A trial matches when it passes all of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrialQuery {
    /// These trials only, those of data sets too.
    pub only: Option<BTreeSet<TrialId>>,
    /// Words that must all occur in title, object, number, note, tags, collection or sensors.
    pub search: String,
    /// Name or title of the object or label.
    pub object: Option<String>,
    /// Without a label.
    pub unlabelled: bool,
    /// Origin.
    pub source: Option<TrialSource>,
    /// In the store, or in the demo log.
    pub place: Option<TrialPlace>,
    /// Has this tag.
    pub tag: Option<String>,
    /// Has this flag.
    pub flag: Option<Flag>,
    pub quality: Option<TrialQuality>,
    /// Preset of poses.
    pub preset: Option<String>,
    /// Text in the names of the sensors.
    pub sensors: Option<String>,
    /// Data set.
    pub collection: Option<String>,
    /// Leaves out trials that were simulated for data sets, unless one of these is asked for.
    pub without_collected: bool,
    /// Begun on this day or later.
    pub since: Option<Day>,
    /// Begun on this day or earlier.
    pub until: Option<Day>,
    /// As to deletion.
    pub shown: Shown,
    pub order: TrialOrder,
}

impl TrialQuery {
    /// The same order without search and filters.
    pub fn cleared(&self) -> Self {
        Self { order: self.order, without_collected: self.without_collected, ..Self::default() }
    }

    /// True where it leaves out trials that were simulated for data sets.
    pub fn hides_collected(&self) -> bool {
        self.without_collected && self.collection.is_none() && self.only.is_none()
    }

    /// True where it leaves anything out but deleted trials.
    pub fn is_filtered(&self) -> bool {
        *self != self.cleared()
    }

    /// The query with its words and days worked out.
    pub(super) fn matcher(&self, store: &Store) -> Result<Matcher<'_>, StoreError> {
        let lower = |text: &Option<String>| text.as_ref().map(|text| text.trim().to_lowercase());
        let day = |day: &Option<Day>| day.as_ref().map(|day| day.date(store)).transpose();
        Ok(Matcher {
            query: self,
            words: self.search.to_lowercase().split_whitespace().map(str::to_owned).collect(),
            object: lower(&self.object),
            sensors: lower(&self.sensors),
            since: day(&self.since)?,
            until: day(&self.until)?,
        })
    }
}

/// A query that trials are compared with.
pub(super) struct Matcher<'a> {
    query: &'a TrialQuery,
    words: Vec<String>,
    object: Option<String>,
    sensors: Option<String>,
    since: Option<String>,
    until: Option<String>,
}

impl Matcher<'_> {
    pub(super) fn matches(&self, trial: &LibraryTrial) -> bool {
        let (query, row) = (self.query, &trial.row);
        let shown = match query.shown {
            Shown::Kept => row.deleted.is_none(),
            Shown::Discarded => row.deleted.is_some(),
            Shown::All => true,
        };
        let day = row.local.get(..10).unwrap_or_default();
        shown
            && query.only.as_ref().is_none_or(|only| only.contains(&row.id))
            && (!query.unlabelled || row.object.is_empty())
            && query.source.is_none_or(|source| row.source == source)
            && query.place.is_none_or(|place| row.place == place)
            && query.quality.is_none_or(|quality| TrialQuality::of(row) == quality)
            && query.flag.is_none_or(|flag| row.flags.iter().any(|found| found.flag == flag))
            && query.tag.as_ref().is_none_or(|tag| row.tags.contains(tag))
            && query.preset.as_ref().is_none_or(|name| row.preset.is_some_and(|own| own.eq_ignore_ascii_case(name)))
            && query.collection.as_ref().is_none_or(|name| row.collections().any(|own| own == name))
            && !(query.hides_collected() && row.is_collected())
            && self.since.as_ref().is_none_or(|since| day >= since.as_str())
            && self.until.as_ref().is_none_or(|until| day <= until.as_str())
            && self.object.as_ref().is_none_or(|name| is_named(trial, name))
            && self.sensors.as_ref().is_none_or(|text| row.sensors.to_lowercase().contains(text))
            && self.words.iter().all(|word| trial.words.contains(word.as_str()))
    }
}

/// True where a text in lower case is the name or the title of the trial's object.
fn is_named(trial: &LibraryTrial, text: &str) -> bool {
    trial.row.object.to_lowercase() == text || trial.title.to_lowercase() == text
}
