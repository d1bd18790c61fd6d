//! Which trials a command is about: numbers, and the filters of the library.

use super::super::origin::OriginFilters;
use super::super::prelude::*;
use palpate_store::labels::Flag;
use palpate_store::{Library, Shown, TrialColumn, TrialOrder, TrialPlace, TrialQuality, TrialQuery};
use std::collections::BTreeSet;
use std::str::FromStr;

/// Filters, the same as those of the library in the window.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Filters")]
pub(super) struct Filters {
    /// Words that all occur in title, object, number, note, tags, collection or sensors.
    #[arg(long, value_name = "WORDS")]
    search: Option<String>,
    /// Object or label, by name or title.
    #[arg(long, visible_alias = "label", value_name = "NAME")]
    object: Option<String>,
    /// Without a label.
    #[arg(long)]
    unlabelled: bool,
    #[command(flatten)]
    origin: OriginFilters,
    /// With this flag: no-contact, late-start, saturated, interrupted, cadence, sensor-fault or duplicate.
    #[arg(long, value_name = "FLAG")]
    flag: Option<Flag>,
    /// Place: store or demo-log.
    #[arg(long, value_name = "NAME")]
    place: Option<TrialPlace>,
    /// Quality: sound, warned or unsound.
    #[arg(long, value_name = "NAME")]
    quality: Option<TrialQuality>,
    /// Text in the names of the parts or channels.
    #[arg(long, value_name = "TEXT")]
    sensors: Option<String>,
}

impl Filters {
    /// The query for the library, oldest first.
    pub(super) fn query(&self, shown: Shown) -> TrialQuery {
        let Self { search, object, unlabelled, origin, flag, place, quality, sensors } = self.clone();
        let OriginFilters { source, preset, collection, tag, since, until } = origin;
        TrialQuery {
            only: None,
            search: search.unwrap_or_default(),
            object,
            unlabelled,
            source,
            place,
            tag,
            flag,
            quality,
            preset,
            sensors,
            collection,
            without_collected: false,
            since,
            until,
            shown,
            order: TrialOrder { column: TrialColumn::Id, descending: false },
        }
    }
}

/// Trials that a command is about.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ChosenTrials {
    /// Trial numbers: 7, 3,7-9, or `matching` with filters.
    #[arg(required = true, value_name = "TRIALS")]
    ids: Vec<Numbers>,
    #[command(flatten)]
    filters: Filters,
}

impl ChosenTrials {
    pub(super) fn of(&self, store: &Store, shown: Shown) -> Result<Vec<TrialId>, Failure> {
        chosen(store, &self.ids, &self.filters, shown)
    }
}

/// Numbers of trials as they are written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Numbers {
    /// `matching`: all that match the filters.
    Matching,
    /// `7` or `3,7-9`: first and last of each part.
    Listed(Vec<(TrialId, TrialId)>),
}

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "matching" {
            return Ok(Self::Matching);
        }
        let number = |text: &str| text.parse::<TrialId>().ok().filter(|id| *id > 0);
        let part = |part: &str| {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            number(first).zip(number(last)).filter(|(first, last)| first <= last)
        };
        let parts: Option<Vec<_>> = text.split(',').map(part).collect();
        parts.map(Self::Listed).ok_or_else(|| "write 7, 3,7-9, or `matching` with a filter".to_owned())
    }
}

/// Trials that are listed and match the filters, each once. Single numbers that do not exist are kept for the command to
/// refuse; ranges take what there is.
pub(super) fn chosen(
    store: &Store,
    numbers: &[Numbers],
    filters: &Filters,
    shown: Shown,
) -> Result<Vec<TrialId>, Failure> {
    let query = filters.query(shown);
    let filtered = TrialQuery { shown: Shown::Kept, ..query.clone() }.is_filtered();
    if numbers.contains(&Numbers::Matching) && !filtered {
        return Err("`matching` needs a filter, such as --object lemon or --since today".into());
    }
    let singles = |numbers: &Numbers| matches!(numbers, Numbers::Listed(parts) if parts.iter().all(|(a, b)| a == b));
    let mut ids = Vec::new();
    let mut add = |id: TrialId| {
        if !ids.contains(&id) {
            ids.push(id);
        }
    };
    if !filtered && numbers.iter().all(singles) {
        let parts = numbers.iter().filter_map(|numbers| match numbers {
            Numbers::Listed(parts) => Some(parts),
            Numbers::Matching => None,
        });
        parts.flatten().for_each(|(id, _)| add(*id));
        return Ok(ids);
    }
    let found: BTreeSet<TrialId> = Library::read(store)?.find(store, &query)?.iter().map(|t| t.row.id).collect();
    for numbers in numbers {
        match numbers {
            Numbers::Matching => ids.extend(&found),
            Numbers::Listed(parts) => {
                parts.iter().for_each(|(first, last)| ids.extend(found.range(*first..=*last)));
            }
        }
    }
    let mut seen = BTreeSet::new();
    ids.retain(|id| seen.insert(*id));
    match ids.len() {
        0 => return Err("no trial matches; `palpate trials list` with the same filters shows none either".into()),
        1 => note("1 trial matches"),
        count => note(&format!("{count} trials match")),
    }
    Ok(ids)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_single_listed_or_those_that_match() {
        let read = |text: &str| text.parse::<Numbers>().ok();
        assert_eq!(read("7"), Some(Numbers::Listed(vec![(7, 7)])));
        assert_eq!(read("3,7-9"), Some(Numbers::Listed(vec![(3, 3), (7, 9)])));
        assert_eq!(read("matching"), Some(Numbers::Matching));
        for nonsense in ["", "0", "-3", "9-7", "3,,4", "all", "1.5"] {
            assert_eq!(read(nonsense), None, "{nonsense}");
        }
    }
}
