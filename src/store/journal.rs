//! The journal: who changed what of which trial, and when. Entries are only ever added, in the transaction of the change
//! they tell of; undoing adds one as well. SQLite itself refuses to alter or remove them.
//!
//! What can be undone is read from it, so that undoing works after a restart. Two programs may work on one store: each
//! undoes what was there when it came and what it did itself, and nothing that the other has changed since.

use super::store::{Store, json};
use super::store_error::{StoreError, fault};
use crate::labels::{Guess, LabelPlan, shown_name};
use palpate_tactile::trial::TrialId;
use rusqlite::{OptionalExtension, Row, Transaction, params};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::OnceLock;
use std::time::SystemTime;

/// The table, and what keeps it as it is. `undoes` names an entry by its uid, which merging leaves as it is.
pub(super) const JOURNAL_TABLES: &str = "
    CREATE TABLE journal (
        number INTEGER PRIMARY KEY AUTOINCREMENT,
        uid TEXT NOT NULL UNIQUE DEFAULT (lower(hex(randomblob(16)))),
        at TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        trial TEXT,
        undoes TEXT,
        undoable INTEGER NOT NULL,
        writer TEXT NOT NULL,
        merged INTEGER NOT NULL DEFAULT 0,
        entry TEXT NOT NULL
    );
    CREATE INDEX journal_by_trial ON journal (trial);
    CREATE TRIGGER journal_is_not_altered BEFORE UPDATE ON journal
    BEGIN SELECT raise(ABORT, 'the journal is only added to'); END;
    CREATE TRIGGER journal_is_not_shortened BEFORE DELETE ON journal
    BEGIN SELECT raise(ABORT, 'the journal is only added to'); END;
";

/// Copies what is told of the trials that come from another store; part of merging.
pub(super) const COPY_JOURNAL: &str = "
    INSERT INTO main.journal (uid, at, trial, undoes, undoable, writer, merged, entry)
    SELECT told.uid, told.at, told.trial, told.undoes, told.undoable, told.writer, 1, told.entry
    FROM temp.incoming
    JOIN other.trials AS theirs ON theirs.id = incoming.id
    JOIN other.journal AS told ON told.trial = theirs.uid
    WHERE told.uid NOT IN (SELECT uid FROM main.journal) ORDER BY told.number;
";

/// What was changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "what", rename_all = "kebab-case")]
pub enum Change {
    /// The label of a trial; none is unlabelled.
    Label {
        /// Before.
        from: Option<String>,
        /// After.
        to: Option<String>,
    },
    /// A trial was discarded.
    Discarded,
    /// A discarded trial was taken back.
    Restored,
    /// The note on a trial.
    Note {
        /// Before.
        from: String,
        /// After.
        to: String,
    },
    /// The tags of a trial.
    Tags {
        /// Before.
        from: Vec<String>,
        /// After.
        to: Vec<String>,
    },
    /// Whether the label is doubted by whoever gave it.
    Unsure {
        /// Before.
        from: bool,
        /// After.
        to: bool,
    },
    /// What a model said of a trial.
    Guess {
        /// What.
        guess: Guess,
    },
    /// Somebody looked at a trial again and left its label.
    Reviewed,
    /// The plan.
    Plan {
        /// Before.
        from: LabelPlan,
        /// After.
        to: LabelPlan,
    },
}

impl Change {
    /// What takes it back; none where there is no taking back.
    fn inverse(&self) -> Option<Self> {
        Some(match self.clone() {
            Self::Label { from, to } => Self::Label { from: to, to: from },
            Self::Discarded => Self::Restored,
            Self::Restored => Self::Discarded,
            Self::Note { from, to } => Self::Note { from: to, to: from },
            Self::Tags { from, to } => Self::Tags { from: to, to: from },
            Self::Unsure { from, to } => Self::Unsure { from: to, to: from },
            Self::Guess { .. } | Self::Reviewed | Self::Plan { .. } => return None,
        })
    }

    /// True where nothing changes.
    fn is_idle(&self) -> bool {
        match self {
            Self::Label { from, to } => from == to,
            Self::Note { from, to } => from == to,
            Self::Tags { from, to } => from == to,
            Self::Unsure { from, to } => from == to,
            Self::Plan { from, to } => from == to,
            Self::Discarded | Self::Restored | Self::Guess { .. } | Self::Reviewed => false,
        }
    }

    /// In words.
    pub fn sentence(&self) -> String {
        let name = |label: &Option<String>| shown_name(label.as_deref().unwrap_or_default()).to_owned();
        match self {
            Self::Label { from, to } => format!("label {} -> {}", name(from), name(to)),
            Self::Discarded => "discarded".to_owned(),
            Self::Restored => "restored".to_owned(),
            Self::Note { to, .. } if to.is_empty() => "note removed".to_owned(),
            Self::Note { to, .. } => format!("note \"{to}\""),
            Self::Tags { from, to } => format!("tags [{}] -> [{}]", from.join(", "), to.join(", ")),
            Self::Unsure { to: true, .. } => "label marked as unsure".to_owned(),
            Self::Unsure { to: false, .. } => "label no longer unsure".to_owned(),
            Self::Guess { guess } => match guess.top() {
                Some((class, p)) => format!("{} guessed {class} ({:.0} %)", guess.model, 100.0 * p),
                None => format!("{} had no guess", guess.model),
            },
            Self::Reviewed => "label looked at again and kept".to_owned(),
            Self::Plan { to, .. } => {
                let wanted: u32 = to.objects.iter().map(|object| object.wanted).sum();
                format!("plan changed to {wanted} trials of {} objects", to.objects.len())
            }
        }
    }
}

/// An entry of the journal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JournalEntry {
    /// Its number in this store, rising.
    pub number: i64,
    /// When, UTC.
    pub at: String,
    /// The trial it tells of, by its identity in every store; none where it tells of the plan.
    pub trial_uid: Option<String>,
    /// The trial's number in this store; none where it was removed for good.
    pub trial: Option<TrialId>,
    /// What was changed.
    #[serde(flatten)]
    pub change: Change,
    /// The number of the entry that this one takes back.
    pub undoes: Option<i64>,
    /// It was made in another store, which has been merged into this one.
    pub merged: bool,
}

impl JournalEntry {
    /// In words.
    pub fn sentence(&self) -> String {
        let trial = match (self.trial, &self.trial_uid) {
            (Some(id), _) => format!("trial {id}: "),
            (None, Some(uid)) => format!("trial {} (removed): ", uid.chars().take(8).collect::<String>()),
            (None, None) => String::new(),
        };
        let undoes = self.undoes.map_or_else(String::new, |number| format!(" (takes back {number})"));
        format!("{trial}{}{undoes}", self.change.sentence())
    }

    /// What it took back, in words, for an entry that takes another back.
    pub fn restored(&self) -> String {
        let again =
            Self { change: self.change.inverse().unwrap_or_else(|| self.change.clone()), undoes: None, ..self.clone() };
        again.sentence()
    }
}

/// Names this run of the program among those that write to a store.
fn this_program() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        format!("{}-{:x}", std::process::id(), now.as_nanos())
    })
}

/// What a store knows of the journal besides what is in it.
#[derive(Debug)]
pub(super) struct JournalView {
    /// The last entry that was there when the store was opened.
    pub(super) seen: i64,
    /// Who writes.
    pub(super) writer: String,
    /// Entries that could not be undone because another program has changed the same since; the next attempt goes on before
    /// them.
    given_up: BTreeSet<i64>,
}

impl Default for JournalView {
    fn default() -> Self {
        Self { seen: 0, writer: this_program().to_owned(), given_up: BTreeSet::new() }
    }
}

/// What undoing is about.
struct Done {
    number: i64,
    uid: String,
    trial: TrialId,
    undoes: Option<String>,
    mine: bool,
    change: Change,
}

/// Which way a step goes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Back,
    Forth,
}

const COLUMNS: &str =
    "journal.number, journal.at, journal.trial, trials.id, journal.entry, journal.merged, before.number";

fn entry_of(row: &Row<'_>) -> rusqlite::Result<JournalEntry> {
    let change = serde_json::from_str(&row.get::<_, String>(4)?);
    let damaged = |e| rusqlite::Error::FromSqlConversionFailure(4, rusqlite::types::Type::Text, Box::new(e));
    Ok(JournalEntry {
        number: row.get(0)?,
        at: row.get(1)?,
        trial_uid: row.get(2)?,
        trial: row.get(3)?,
        change: change.map_err(damaged)?,
        merged: row.get(5)?,
        undoes: row.get(6)?,
    })
}

/// Adds an entry.
pub(super) fn append(
    transaction: &Transaction<'_>,
    writer: &str,
    trial: Option<TrialId>,
    change: &Change,
    undoes: Option<&str>,
) -> rusqlite::Result<()> {
    let sql = "INSERT INTO journal (trial, undoes, undoable, writer, entry)
               VALUES ((SELECT uid FROM trials WHERE id = ?1), ?2, ?3, ?4, ?5)";
    transaction.execute(sql, params![trial, undoes, change.inverse().is_some(), writer, json(change)])?;
    Ok(())
}

/// Makes a change and tells the journal of it. False where the trial is not as the change says it was.
pub(super) fn change(
    transaction: &Transaction<'_>,
    writer: &str,
    trial: TrialId,
    change: &Change,
    undoes: Option<&str>,
) -> rusqlite::Result<bool> {
    if change.is_idle() {
        return Ok(true);
    }
    let changed = apply(transaction, trial, change)? == 1;
    if changed {
        append(transaction, writer, Some(trial), change, undoes)?;
    }
    Ok(changed)
}

fn apply(transaction: &Transaction<'_>, trial: TrialId, change: &Change) -> rusqlite::Result<usize> {
    let set = |column: &str, from: &dyn rusqlite::ToSql, to: &dyn rusqlite::ToSql| {
        let sql = format!("UPDATE trials SET {column} = ?3 WHERE id = ?1 AND {column} = ?2 AND deleted IS NULL");
        transaction.execute(&sql, params![trial, from, to])
    };
    match change {
        Change::Label { from, to } => {
            let stored = |label: &Option<String>| label.clone().unwrap_or_default();
            set("object", &stored(from), &stored(to))
        }
        Change::Note { from, to } => set("note", from, to),
        Change::Tags { from, to } => set("tags", &json(from), &json(to)),
        Change::Unsure { from, to } => set("unsure", from, to),
        Change::Reviewed => set("reviewed", &false, &true),
        Change::Discarded => {
            let sql = "UPDATE trials SET deleted = strftime('%Y-%m-%dT%H:%M:%fZ', 'now')
                       WHERE id = ?1 AND deleted IS NULL";
            transaction.execute(sql, [trial])
        }
        Change::Restored => {
            transaction.execute("UPDATE trials SET deleted = NULL WHERE id = ?1 AND deleted IS NOT NULL", [trial])
        }
        Change::Guess { guess } => {
            let sql = "INSERT INTO guesses (trial, model, pmf) SELECT id, ?2, ?3 FROM trials
                       WHERE id = ?1 AND deleted IS NULL
                       ON CONFLICT (trial) DO UPDATE SET model = excluded.model, pmf = excluded.pmf";
            let changed = transaction.execute(sql, params![trial, guess.model, json(&guess.pmf)])?;
            // Another guess has not been looked at.
            transaction.execute("UPDATE trials SET reviewed = 0 WHERE id = ?1", [trial])?;
            Ok(changed)
        }
        // The plan is no trial's.
        Change::Plan { .. } => Ok(0),
    }
}

impl Store {
    /// The newest entries of the journal, newest first.
    pub fn journal(&self, limit: usize) -> Result<Vec<JournalEntry>, StoreError> {
        let sql = format!(
            "SELECT {COLUMNS} FROM journal LEFT JOIN trials ON trials.uid = journal.trial
             LEFT JOIN journal AS before ON before.uid = journal.undoes ORDER BY journal.number DESC LIMIT ?1"
        );
        let limit = i64::try_from(limit).unwrap_or(i64::MAX);
        let rows: rusqlite::Result<Vec<_>> =
            self.connection.prepare(&sql).and_then(|mut statement| statement.query_map([limit], entry_of)?.collect());
        rows.map_err(|e| fault(self.path(), &e))
    }

    /// Takes back the last change of a label, note, tag, doubt, or what is discarded; the entry that was taken back, or none
    /// where there is nothing left. What another program has changed since is left alone, with a word.
    pub fn undo(&mut self) -> Result<Option<JournalEntry>, StoreError> {
        self.step(Way::Back)
    }

    /// Does again what was taken back last, unless something else was done since; the entry that took it back.
    pub fn redo(&mut self) -> Result<Option<JournalEntry>, StoreError> {
        self.step(Way::Forth)
    }

    fn step(&mut self, way: Way) -> Result<Option<JournalEntry>, StoreError> {
        let path = self.path().to_owned();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let (seen, writer) = (self.journal.seen, self.journal.writer.clone());
        let given_up = self.journal.given_up.clone();
        let transaction = self.write()?;
        let all = undoable(&transaction, seen, &writer).map_err(fault)?;
        let Some(last) = last_of(&all, way, &given_up) else { return Ok(None) };
        let Some(inverse) = last.change.inverse() else { return Ok(None) };
        let whole = "SELECT {COLUMNS} FROM journal LEFT JOIN trials ON trials.uid = journal.trial
                     LEFT JOIN journal AS before ON before.uid = journal.undoes WHERE journal.number = ?1";
        let entry = transaction.query_row(&whole.replace("{COLUMNS}", COLUMNS), [last.number], entry_of);
        let entry = entry.map_err(fault)?;
        if change(&transaction, &writer, last.trial, &inverse, Some(&last.uid)).map_err(fault)? {
            transaction.commit().map_err(fault)?;
            return Ok(Some(entry));
        }
        let since = all.iter().rev().find(|other| other.trial == last.trial && !other.mine);
        let since = since.map(|other| other.change.sentence()).unwrap_or_else(|| "it is not as it was".to_owned());
        transaction.rollback().map_err(fault)?;
        let number = last.number;
        self.journal.given_up.insert(number);
        Err(StoreError::ChangedMeanwhile { id: last.trial, wanted: entry.change.sentence(), since })
    }
}

/// Everything that can be undone or that undid something, oldest first; not what came by merging, nor what is told of trials
/// that were removed for good.
fn undoable(transaction: &Transaction<'_>, seen: i64, writer: &str) -> rusqlite::Result<Vec<Done>> {
    let sql = "SELECT journal.number, journal.uid, trials.id, journal.undoes, journal.writer, journal.entry
               FROM journal JOIN trials ON trials.uid = journal.trial
               WHERE journal.undoable AND NOT journal.merged ORDER BY journal.number";
    let mut statement = transaction.prepare(sql)?;
    let rows = statement.query_map([], |row| {
        let number = row.get(0)?;
        let mine = number <= seen || row.get::<_, String>(4)? == writer;
        let change = serde_json::from_str(&row.get::<_, String>(5)?);
        let damaged = |e| rusqlite::Error::FromSqlConversionFailure(5, rusqlite::types::Type::Text, Box::new(e));
        let change = change.map_err(damaged)?;
        Ok(Done { number, uid: row.get(1)?, trial: row.get(2)?, undoes: row.get(3)?, mine, change })
    })?;
    rows.collect()
}

/// The entry to be taken back next, of those of this program. Taking back a change leaves it to be done again; taking that
/// back leaves it to be undone again; anything else leaves nothing to be done again.
fn last_of<'a>(all: &'a [Done], way: Way, given_up: &BTreeSet<i64>) -> Option<&'a Done> {
    let (mut back, mut forth): (Vec<&Done>, Vec<&Done>) = (Vec::new(), Vec::new());
    for done in all {
        let undone = |stack: &[&Done]| {
            let uid = done.undoes.as_ref()?;
            stack.iter().rposition(|other| other.uid == *uid)
        };
        if let Some(at) = undone(&back) {
            back.remove(at);
            forth.extend(done.mine.then_some(done));
        } else if let Some(at) = undone(&forth) {
            forth.remove(at);
            back.extend(done.mine.then_some(done));
        } else if done.mine {
            back.push(done);
            forth.clear();
        }
    }
    let stack = if way == Way::Back { back } else { forth };
    stack.into_iter().rev().find(|done| !given_up.contains(&done.number))
}

/// What a store knows when it is opened.
pub(super) fn newest(transaction: &Transaction<'_>) -> rusqlite::Result<i64> {
    transaction.query_row("SELECT coalesce(max(number), 0) FROM journal", [], |row| row.get(0))
}

/// The state of a trial that changes speak of, as it is now.
pub(super) struct LabelState {
    pub(super) rig: String,
    pub(super) object: String,
    pub(super) note: String,
    pub(super) tags: Vec<String>,
    pub(super) unsure: bool,
    pub(super) reviewed: bool,
}

/// Reads it; none for a trial that is not there or discarded.
pub(super) fn state_of(transaction: &Transaction<'_>, id: TrialId) -> rusqlite::Result<Option<LabelState>> {
    let sql = "SELECT rig, object, note, tags, unsure, reviewed FROM trials WHERE id = ?1 AND deleted IS NULL";
    let state = |row: &Row<'_>| {
        let tags = serde_json::from_str(&row.get::<_, String>(3)?).unwrap_or_default();
        let (unsure, reviewed) = (row.get(4)?, row.get(5)?);
        Ok(LabelState { rig: row.get(0)?, object: row.get(1)?, note: row.get(2)?, tags, unsure, reviewed })
    };
    transaction.query_row(sql, [id], state).optional()
}
