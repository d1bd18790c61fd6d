//! The journal: every change of a label, note, tag, deletion or plan. Entries are only ever added, in the transaction
//! of their change; undoing adds one as well. SQLite triggers refuse to alter or remove them.
//!
//! Undo and redo are read from the journal, so that they work after a restart. Programs that share a store share its
//! history: undo takes back the last change, whichever program made it.

use super::store::{Store, json};
use super::store_error::StoreError;
use crate::labels::{Guess, LabelPlan, shown_title};
use palpate_tactile::trial::TrialId;
use rusqlite::{Row, Transaction, params};
use serde::{Deserialize, Serialize};

/// A change of a trial or of the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "what", rename_all = "kebab-case")]
pub enum Change {
    /// The label; none is unlabelled.
    Label {
        /// Before.
        from: Option<String>,
        /// After.
        to: Option<String>,
    },
    /// The trial was deleted.
    Discarded,
    /// The trial was restored.
    Restored,
    /// The note.
    Note {
        /// Before.
        from: String,
        /// After.
        to: String,
    },
    /// The tags.
    Tags {
        /// Before.
        from: Vec<String>,
        /// After.
        to: Vec<String>,
    },
    /// Whether the label is unsure.
    Unsure {
        /// Before.
        from: bool,
        /// After.
        to: bool,
    },
    /// The prediction of a model.
    Guess {
        /// The prediction.
        guess: Guess,
    },
    /// The label was reviewed and kept.
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
    /// The change that undoes this one; none where it cannot be undone.
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
        self.inverse().is_some_and(|inverse| inverse == *self)
    }

    /// The change in words.
    pub fn sentence(&self) -> String {
        let name = |label: &Option<String>| shown_title(label.as_deref().unwrap_or_default());
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
                Some((class, p)) => format!("{} predicted {} ({:.0} %)", guess.model, shown_title(class), 100.0 * p),
                None => format!("{} predicted nothing", guess.model),
            },
            Self::Reviewed => "label reviewed and kept".to_owned(),
            Self::Plan { to, .. } => {
                let wanted: u32 = to.objects.iter().map(|object| object.wanted).sum();
                format!("plan changed to {wanted} trials of {} objects", to.objects.len())
            }
        }
    }
}

/// Entry of the journal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JournalEntry {
    /// Rising number in this store.
    pub number: i64,
    /// Time, UTC.
    pub at: String,
    /// Identity of the trial in every store; none for a change of the plan.
    pub trial_uid: Option<String>,
    /// Number of the trial in this store; none once it is purged.
    pub trial: Option<TrialId>,
    /// The change.
    #[serde(flatten)]
    pub change: Change,
    /// Number of the entry that this one undoes.
    pub undoes: Option<i64>,
    /// Made in another store, which was merged into this one.
    pub merged: bool,
}

impl JournalEntry {
    /// The entry in words.
    pub fn sentence(&self) -> String {
        let trial = match (self.trial, &self.trial_uid) {
            (Some(id), _) => format!("trial {id}: "),
            (None, Some(uid)) => format!("trial {} (purged): ", uid.chars().take(8).collect::<String>()),
            (None, None) => String::new(),
        };
        let undoes = self.undoes.map_or_else(String::new, |number| format!(" (undoes {number})"));
        format!("{trial}{}{undoes}", self.change.sentence())
    }

    /// The change that this entry undid, in words.
    pub fn restored(&self) -> String {
        let again =
            Self { change: self.change.inverse().unwrap_or_else(|| self.change.clone()), undoes: None, ..self.clone() };
        again.sentence()
    }
}

/// The journal of a store.
#[derive(Clone, Copy, Debug)]
pub struct JournalRepository<'a> {
    store: &'a Store,
}

impl Store {
    /// The journal: all changes, undo and redo.
    pub fn journal(&self) -> JournalRepository<'_> {
        JournalRepository { store: self }
    }

    /// Marks trials as deleted, all or none of them. They can be restored until they are purged.
    pub fn delete(&mut self, ids: &[TrialId]) -> Result<(), StoreError> {
        self.change_each(ids, &Change::Discarded)
    }

    /// Restores deleted trials, all or none of them.
    pub fn restore(&mut self, ids: &[TrialId]) -> Result<(), StoreError> {
        self.change_each(ids, &Change::Restored)
    }

    fn change_each(&self, ids: &[TrialId], what: &Change) -> Result<(), StoreError> {
        let transaction = self.write()?;
        for id in ids {
            if !change(&transaction, *id, what, None).map_err(|e| self.fault(&e))? {
                return Err(self.no_trial(*id));
            }
        }
        transaction.commit().map_err(|e| self.fault(&e))
    }
}

/// Direction of a step through the history.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Direction {
    Undo,
    Redo,
}

const ENTRIES: &str = "SELECT journal.number, journal.at, journal.trial, trials.id, journal.entry, journal.merged,
    undone.number, journal.uid, journal.undoes
    FROM journal LEFT JOIN trials ON trials.uid = journal.trial LEFT JOIN journal AS undone ON undone.uid = journal.undoes";

/// An entry with what links entries to each other.
struct Step {
    entry: JournalEntry,
    uid: String,
    undoes: Option<String>,
}

fn step_of(row: &Row<'_>) -> rusqlite::Result<Step> {
    let change = serde_json::from_str(&row.get::<_, String>(4)?);
    let damaged = |e| rusqlite::Error::FromSqlConversionFailure(4, rusqlite::types::Type::Text, Box::new(e));
    let entry = JournalEntry {
        number: row.get(0)?,
        at: row.get(1)?,
        trial_uid: row.get(2)?,
        trial: row.get(3)?,
        change: change.map_err(damaged)?,
        merged: row.get(5)?,
        undoes: row.get(6)?,
    };
    Ok(Step { entry, uid: row.get(7)?, undoes: row.get(8)? })
}

impl JournalRepository<'_> {
    /// The newest entries, newest first.
    pub fn entries(&self, limit: usize) -> Result<Vec<JournalEntry>, StoreError> {
        let sql = format!("{ENTRIES} ORDER BY journal.number DESC LIMIT ?1");
        let limit = i64::try_from(limit).unwrap_or(i64::MAX);
        let rows = self.store.connection.prepare(&sql).and_then(|mut statement| {
            statement.query_map([limit], |row| step_of(row).map(|step| step.entry))?.collect()
        });
        rows.map_err(|e| self.store.fault(&e))
    }

    /// Undoes the last change of a label, note, tag, doubt or deletion; the entry that was undone, or none at the end.
    pub fn undo(&self) -> Result<Option<JournalEntry>, StoreError> {
        self.step(Direction::Undo)
    }

    /// Redoes what was undone last, unless something else was changed since; the entry that had undone it.
    pub fn redo(&self) -> Result<Option<JournalEntry>, StoreError> {
        self.step(Direction::Redo)
    }

    fn step(&self, direction: Direction) -> Result<Option<JournalEntry>, StoreError> {
        let fault = |e: rusqlite::Error| self.store.fault(&e);
        let transaction = self.store.write()?;
        let last = next_step(history(&transaction).map_err(fault)?, direction);
        let Some(Step { entry, uid, .. }) = last else { return Ok(None) };
        let (Some(id), Some(inverse)) = (entry.trial, entry.change.inverse()) else { return Ok(None) };
        if !change(&transaction, id, &inverse, Some(&uid)).map_err(fault)? {
            return Err(StoreError::ChangedMeanwhile { id, change: entry.change.sentence() });
        }
        transaction.commit().map_err(fault)?;
        Ok(Some(entry))
    }
}

/// Everything that can be undone or that undid something, oldest first; without merged entries and purged trials.
fn history(transaction: &Transaction<'_>) -> rusqlite::Result<Vec<Step>> {
    let sql = format!(
        "{ENTRIES} WHERE journal.undoable AND NOT journal.merged AND trials.id IS NOT NULL ORDER BY journal.number"
    );
    transaction.prepare(&sql)?.query_map([], step_of)?.collect()
}

/// The entry to be inverted next. Undoing a change allows to redo it, and the other way round; any other change ends redo.
fn next_step(history: Vec<Step>, direction: Direction) -> Option<Step> {
    let (mut undo, mut redo): (Vec<Step>, Vec<Step>) = (Vec::new(), Vec::new());
    for step in history {
        let place = |stack: &[Step]| stack.iter().rposition(|other| Some(&other.uid) == step.undoes.as_ref());
        if let Some(at) = place(&undo) {
            undo.remove(at);
            redo.push(step);
        } else if let Some(at) = place(&redo) {
            redo.remove(at);
            undo.push(step);
        } else {
            undo.push(step);
            redo.clear();
        }
    }
    if direction == Direction::Undo { undo.pop() } else { redo.pop() }
}

/// Adds an entry.
pub(super) fn append(
    transaction: &Transaction<'_>,
    trial: Option<TrialId>,
    change: &Change,
    undoes: Option<&str>,
) -> rusqlite::Result<()> {
    let sql = "INSERT INTO journal (trial, undoes, undoable, entry)
               VALUES ((SELECT uid FROM trials WHERE id = ?1), ?2, ?3, ?4)";
    transaction.execute(sql, params![trial, undoes, change.inverse().is_some(), json(change)])?;
    Ok(())
}

/// Makes a change and adds its entry. False where the trial differs from the state that the change starts from.
pub(super) fn change(
    transaction: &Transaction<'_>,
    trial: TrialId,
    change: &Change,
    undoes: Option<&str>,
) -> rusqlite::Result<bool> {
    if change.is_idle() {
        return Ok(true);
    }
    let changed = apply(transaction, trial, change)? == 1;
    if changed {
        append(transaction, Some(trial), change, undoes)?;
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
            // A new prediction has not been reviewed.
            transaction.execute("UPDATE trials SET reviewed = 0 WHERE id = ?1", [trial])?;
            Ok(changed)
        }
        // The plan belongs to no trial.
        Change::Plan { .. } => Ok(0),
    }
}
