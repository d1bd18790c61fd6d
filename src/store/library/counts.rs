//! What the filters of the library offer, and how many trials each would show.

use super::{LibraryTrial, TrialPlace};
use std::collections::BTreeMap;

/// A value and the number of trials that have it.
pub type Counted = (String, usize);

/// Counts of the library; deleted trials count in `discarded` alone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LibraryCounts {
    /// Trials that are not deleted.
    pub kept: usize,
    /// Those without a label.
    pub unlabelled: usize,
    /// Deleted trials.
    pub discarded: usize,
    /// Trials of the demo log.
    pub demo_log: usize,
    /// Trials that were simulated for data sets.
    pub collected: usize,
    /// Names of objects, most frequent first.
    pub objects: Vec<Counted>,
    /// Tags, most frequent first.
    pub tags: Vec<Counted>,
    /// Collections, most frequent first.
    pub collections: Vec<Counted>,
}

impl LibraryCounts {
    pub(super) fn of<'a>(trials: impl Iterator<Item = &'a LibraryTrial>) -> Self {
        let mut counts = Self::default();
        let (mut objects, mut tags, mut collections) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for LibraryTrial { row, .. } in trials {
            if row.deleted.is_some() {
                counts.discarded += 1;
                continue;
            }
            counts.kept += 1;
            counts.demo_log += usize::from(row.place == TrialPlace::DemoLog);
            counts.collected += usize::from(row.is_collected());
            if row.object.is_empty() {
                counts.unlabelled += 1;
            } else {
                count(&mut objects, &row.object);
            }
            row.tags.iter().for_each(|tag| count(&mut tags, tag));
            row.collection.iter().for_each(|name| count(&mut collections, name));
        }
        [counts.objects, counts.tags, counts.collections] = [objects, tags, collections].map(sorted);
        counts
    }
}

fn count<'a>(counts: &mut BTreeMap<&'a str, usize>, name: &'a str) {
    *counts.entry(name).or_default() += 1;
}

fn sorted(counts: BTreeMap<&str, usize>) -> Vec<Counted> {
    let mut counts: Vec<Counted> = counts.into_iter().map(|(name, count)| (name.to_owned(), count)).collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    counts
}
