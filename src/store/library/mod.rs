//! The library: all trials in memory, read once and kept up to date, so that search, filters and order of 100 000 trials
//! take milliseconds.
//!
//! New trials have higher numbers, and most other changes of a row have an entry in the journal, so that few rows are
//! read again. Read again too are trials that were being recorded at the last look, the other copies of a changed
//! grasp, whose flag depends on it, trials that have joined a collection, and trials that have left the demo log.

mod counts;
mod order;
mod quality;
mod query;

pub use counts::{Counted, LibraryCounts};
pub use order::{TrialColumn, TrialOrder};
pub use quality::TrialQuality;
pub use query::{Day, Shown, TrialQuery};

use super::demo_log::TrialPlace;
use super::store::{Store, json};
use super::store_error::StoreError;
use super::trial_rows::TrialRow;
use crate::labels::shown_name;
use palpate_sim::objects::object_title;
use palpate_tactile::trial::TrialId;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A trial in the library.
#[derive(Clone, Debug, PartialEq)]
pub struct LibraryTrial {
    pub row: TrialRow,
    /// Title of its object, or `unlabelled`.
    pub title: Arc<str>,
    /// Everything that a search looks at, in lower case.
    words: Box<str>,
}

impl LibraryTrial {
    fn new(row: TrialRow, titles: &mut BTreeMap<String, Arc<str>>) -> Self {
        let title = match titles.get(&row.object) {
            Some(title) => Arc::clone(title),
            None => {
                let title: Arc<str> = object_title(shown_name(&row.object)).into();
                titles.insert(row.object.clone(), Arc::clone(&title));
                title
            }
        };
        let collection = row.collections().map(String::as_str).collect::<Vec<_>>().join(" ");
        let (id, tags) = (row.id.to_string(), row.tags.join(" "));
        let place = if row.place == TrialPlace::DemoLog { row.place.title() } else { "" };
        let words = [&*title, &row.object, &id, &row.note, &tags, &collection, &row.sensors, place].join("\n");
        Self { words: words.to_lowercase().into(), title, row }
    }

    /// The title in lower case, with which the words begin.
    fn lower_title(&self) -> &str {
        self.words.split_once('\n').map_or(&*self.words, |(title, _)| title)
    }

    /// Quality in one word.
    pub fn quality(&self) -> TrialQuality {
        TrialQuality::of(&self.row)
    }
}

/// All trials of a store.
#[derive(Debug, Default)]
pub struct Library {
    trials: BTreeMap<TrialId, Arc<LibraryTrial>>,
    titles: BTreeMap<String, Arc<str>>,
    /// Trials that were being recorded at the last look.
    recording: BTreeSet<TrialId>,
    /// Trials that were in the demo log at the last look.
    demo_log: BTreeSet<TrialId>,
    /// Last entry of the journal that is contained.
    journal: Option<i64>,
    /// Everything is read.
    complete: bool,
}

impl Library {
    /// The whole library of a store.
    pub fn read(store: &Store) -> Result<Self, StoreError> {
        let mut library = Self::default();
        while !library.read_on(store, usize::MAX)? {}
        Ok(library)
    }

    /// Reads the next older trials, at most this many, the newest first; true once all are read.
    pub fn read_on(&mut self, store: &Store, most: usize) -> Result<bool, StoreError> {
        if !self.complete {
            if self.journal.is_none() {
                self.journal = Some(last_entry(store)?);
            }
            let below = self.trials.keys().next().copied().unwrap_or(TrialId::MAX);
            let most = i64::try_from(most).unwrap_or(i64::MAX);
            let rows = store.rows("WHERE id < ?1 ORDER BY id DESC LIMIT ?2", [below, most])?;
            self.complete = rows.is_empty() || i64::try_from(rows.len()).is_ok_and(|read| read < most);
            self.take(rows);
        }
        Ok(self.complete)
    }

    /// Reads again what has changed since; true where something had.
    pub fn catch_up(&mut self, store: &Store) -> Result<bool, StoreError> {
        let (Some(journal), Some(oldest)) = (self.journal, self.trials.keys().next().copied()) else {
            self.complete = false;
            return Ok(true);
        };
        let newest = self.trials.keys().next_back().copied().unwrap_or(oldest);
        self.journal = Some(last_entry(store)?);
        let mut stale: BTreeSet<TrialId> = changed_since(store, journal)?;
        stale.extend(&self.recording);
        stale.extend(copies_of(store, &stale)?);
        stale.extend(self.joined(store)?);
        let left = self.left_demo_log(store)?;
        stale.extend(&left);
        stale.retain(|id| (oldest..=newest).contains(id));
        let mut rows = store.rows("WHERE id > ?1 ORDER BY id", [newest])?;
        rows.extend(store.rows("WHERE id IN (SELECT value FROM json_each(?1))", [json(&stale)])?);
        let read: BTreeSet<TrialId> = rows.iter().map(|row| row.id).collect();
        let mut changed = self.take(rows);
        changed |= self.forget(store, &left.difference(&read).copied().collect())?;
        if self.complete && count(store)? != self.trials.len() {
            let kept = ids(store)?;
            changed |= self.forget(store, &self.trials.keys().copied().filter(|id| !kept.contains(id)).collect())?;
        }
        Ok(changed)
    }

    /// Forgets trials that are no longer in the store, and reads the other copies of their grasps again; true where there were
    /// any.
    fn forget(&mut self, store: &Store, gone: &BTreeSet<TrialId>) -> Result<bool, StoreError> {
        let identities: Vec<String> =
            gone.iter().filter_map(|id| self.trials.remove(id).and_then(|trial| trial.row.identity.clone())).collect();
        self.recording.retain(|id| !gone.contains(id));
        self.demo_log.retain(|id| !gone.contains(id));
        if !identities.is_empty() {
            let mut copies = store.rows("WHERE identity IN (SELECT value FROM json_each(?1))", [json(&identities)])?;
            copies.retain(|row| self.trials.contains_key(&row.id));
            self.take(copies);
        }
        Ok(!gone.is_empty())
    }

    /// Trials that have left the demo log since they were read: kept, or pushed out by newer ones.
    fn left_demo_log(&self, store: &Store) -> Result<BTreeSet<TrialId>, StoreError> {
        let logged: BTreeSet<TrialId> = store.all("SELECT id FROM trials WHERE demo = 1", [], |row| row.get(0))?;
        Ok(self.demo_log.difference(&logged).copied().collect())
    }

    /// Trials that have joined a further collection since they were read.
    fn joined(&self, store: &Store) -> Result<BTreeSet<TrialId>, StoreError> {
        let sql = "SELECT trial, count(*) FROM memberships GROUP BY trial";
        let members: Vec<(TrialId, i64)> = store.all(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
        let other = |(id, count): &(TrialId, i64)| {
            self.trials.get(id).is_some_and(|trial| usize::try_from(*count) != Ok(trial.row.also_in.len()))
        };
        Ok(members.into_iter().filter(other).map(|(id, _)| id).collect())
    }

    /// True where a row was new or other than before.
    fn take(&mut self, rows: Vec<TrialRow>) -> bool {
        let mut changed = false;
        for row in rows {
            let id = row.id;
            if row.state == "complete" {
                self.recording.remove(&id);
            } else {
                self.recording.insert(id);
            }
            match row.place {
                TrialPlace::DemoLog => self.demo_log.insert(id),
                TrialPlace::Store => self.demo_log.remove(&id),
            };
            if self.trials.get(&id).is_none_or(|known| known.row != row) {
                self.trials.insert(id, Arc::new(LibraryTrial::new(row, &mut self.titles)));
                changed = true;
            }
        }
        changed
    }

    /// Trials that match a query, in its order.
    pub fn find(&self, store: &Store, query: &TrialQuery) -> Result<Vec<Arc<LibraryTrial>>, StoreError> {
        let matcher = query.matcher(store)?;
        let found: Vec<Arc<LibraryTrial>> =
            self.trials.values().filter(|trial| matcher.matches(trial)).cloned().collect();
        Ok(query.order.sorted(&found))
    }

    /// All trials, oldest first; deleted ones too.
    pub fn rows(&self) -> impl Iterator<Item = &TrialRow> {
        self.trials.values().map(|trial| &trial.row)
    }

    /// A trial by its number.
    pub fn trial(&self, id: TrialId) -> Option<&Arc<LibraryTrial>> {
        self.trials.get(&id)
    }

    /// Counts of what filters offer.
    pub fn counts(&self) -> LibraryCounts {
        LibraryCounts::of(self.trials.values().map(|trial| &**trial))
    }

    /// True once everything is read.
    pub fn is_complete(&self) -> bool {
        self.complete
    }
}

fn last_entry(store: &Store) -> Result<i64, StoreError> {
    let sql = "SELECT coalesce(max(number), 0) FROM journal";
    store.connection.query_row(sql, [], |row| row.get(0)).map_err(|e| store.fault(&e))
}

/// Trials that have entries in the journal after this one.
fn changed_since(store: &Store, entry: i64) -> Result<BTreeSet<TrialId>, StoreError> {
    let sql = "SELECT trials.id FROM journal JOIN trials ON trials.uid = journal.trial WHERE journal.number > ?1";
    store.all(sql, [entry], |row| row.get(0))
}

/// Trials that hold the same grasps as these.
fn copies_of(store: &Store, trials: &BTreeSet<TrialId>) -> Result<BTreeSet<TrialId>, StoreError> {
    let sql = "SELECT other.id FROM trials JOIN trials AS other ON other.identity = trials.identity
        WHERE trials.id IN (SELECT value FROM json_each(?1))";
    store.all(sql, [json(trials)], |row| row.get(0))
}

fn count(store: &Store) -> Result<usize, StoreError> {
    let count = store.connection.query_row("SELECT count(*) FROM trials", [], |row| row.get::<_, i64>(0));
    count.map(|count| usize::try_from(count).unwrap_or(0)).map_err(|e| store.fault(&e))
}

fn ids(store: &Store) -> Result<BTreeSet<TrialId>, StoreError> {
    store.all("SELECT id FROM trials", [], |row| row.get(0))
}
