//! The journal: every change of a label, note, tag, deletion or plan, and every trial that a person keeps. Entries are only ever added, in the transaction
//! of their change; undoing adds one as well. SQLite triggers refuse to alter or remove them.
//!
//! Undo and redo are read from the journal, so that they work after a restart. Programs that share a store share its
//! history: undo takes back the last change, whichever program made it. Changes of many trials made together form a
//! batch: one step of undo and redo.

use super::store::{Store, json};
use super::store_error::StoreError;
use crate::labels::{Guess, LabelPlan, shown_name, shown_title};
use palpate_geometry::units::percent;
use palpate_sim::objects::object_title;
use palpate_tactile::trial::{CorrectedPhases, TrialId};
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
    /// The trial was moved from the demo log to the store.
    Kept,
    /// That was undone.
    ReturnedToLog,
    Note {
        /// Before.
        from: String,
        /// After.
        to: String,
    },
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
    /// Phases as a person corrected them; none is as measured.
    Phases {
        /// Before.
        from: Option<CorrectedPhases>,
        /// After.
        to: Option<CorrectedPhases>,
    },
    /// The prediction of a model.
    Guess {
        /// The prediction.
        guess: Guess,
    },
    /// The label was reviewed.
    Reviewed,
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
            Self::Kept => Self::ReturnedToLog,
            Self::ReturnedToLog => Self::Kept,
            Self::Note { from, to } => Self::Note { from: to, to: from },
            Self::Tags { from, to } => Self::Tags { from: to, to: from },
            Self::Unsure { from, to } => Self::Unsure { from: to, to: from },
            Self::Phases { from, to } => Self::Phases { from: to, to: from },
            Self::Guess { .. } | Self::Reviewed | Self::Plan { .. } => return None,
        })
    }

    /// True where nothing changes.
    pub(super) fn is_idle(&self) -> bool {
        self.inverse().is_some_and(|inverse| inverse == *self)
    }

    /// The change in words.
    pub fn sentence(&self) -> String {
        let name = |label: &Option<String>| object_title(shown_name(label.as_deref().unwrap_or_default()));
        match self {
            Self::Label { from: None, to } => format!("labelled {}", name(to)),
            Self::Label { from, to: None } => format!("label {} removed", name(from)),
            Self::Label { from, to } => format!("label {} → {}", name(from), name(to)),
            Self::Discarded => "discarded".to_owned(),
            Self::Restored => "restored".to_owned(),
            Self::Kept => "kept in the store".to_owned(),
            Self::ReturnedToLog => "back in the demo log".to_owned(),
            Self::Note { to, .. } if to.is_empty() => "note removed".to_owned(),
            Self::Note { to, .. } => format!("note \"{to}\""),
            Self::Tags { from, to } => {
                let quoted = |tags: &[String], others: &[String], done: &str| {
                    let new = tags.iter().filter(|tag| !others.contains(tag));
                    new.map(|tag| format!("tag \"{tag}\" {done}")).collect::<Vec<_>>()
                };
                [quoted(to, from, "added"), quoted(from, to, "removed")].concat().join(", ")
            }
            Self::Unsure { to: true, .. } => "label marked as unsure".to_owned(),
            Self::Unsure { to: false, .. } => "label no longer unsure".to_owned(),
            Self::Phases { to: Some(_), .. } => "phases corrected".to_owned(),
            Self::Phases { to: None, .. } => "phases as measured".to_owned(),
            Self::Guess { guess } => match guess.top() {
                Some((class, p)) => format!("{} predicted {}, {}", guess.model, shown_title(class), percent(*p)),
                None => format!("{} predicted nothing", guess.model),
            },
            Self::Reviewed => "label reviewed".to_owned(),
            Self::Plan { to, .. } => {
                let wanted: u32 = to.objects.iter().map(|object| object.wanted).sum();
                match to.objects.len() {
                    0 => "plan cleared".to_owned(),
                    1 => format!("plan changed to {wanted} trials of 1 object"),
                    objects => format!("plan changed to {wanted} trials of {objects} objects"),
                }
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
    #[serde(flatten)]
    pub change: Change,
    /// Number of the entry that this one undoes.
    pub undoes: Option<i64>,
    /// Made in another store, which was merged into this one.
    pub merged: bool,
    /// The same kind of change of other trials, made together with this one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<Self>,
}

/// Trials that a sentence names; more are counted.
const NAMED: usize = 4;

impl JournalEntry {
    /// The entry in words.
    pub fn sentence(&self) -> String {
        let undoes = self.undoes.map_or_else(String::new, |number| format!(" (undoes {number})"));
        format!("{}{}{undoes}", self.trials(), self.words())
    }

    /// The change that this entry undid, in words.
    pub fn restored(&self) -> String {
        let inverted = |entry: &Self| {
            let change = entry.change.inverse().unwrap_or_else(|| entry.change.clone());
            Self { change, undoes: None, others: Vec::new(), ..entry.clone() }
        };
        Self { others: self.others.iter().map(inverted).collect(), ..inverted(self) }.sentence()
    }

    /// The trials of the entry, before its words.
    fn trials(&self) -> String {
        let all = 1 + self.others.len();
        if all > NAMED {
            return format!("{all} trials: ");
        }
        let name = |entry: &Self| match (entry.trial, &entry.trial_uid) {
            (Some(id), _) => Some(id.to_string()),
            (None, Some(uid)) => Some(format!("{} (purged)", uid.chars().take(8).collect::<String>())),
            (None, None) => None,
        };
        let names: Vec<String> = std::iter::once(self).chain(&self.others).filter_map(name).collect();
        match names.len() {
            0 => String::new(),
            1 => format!("trial {}: ", names[0]),
            _ => format!("trials {}: ", names.join(", ")),
        }
    }

    /// The change; of several that differ, what they share.
    fn words(&self) -> String {
        let own = self.change.sentence();
        if self.others.iter().all(|other| other.change.sentence() == own) {
            return own;
        }
        let label = |entry: &Self| match &entry.change {
            Change::Label { to, .. } => Some(to.clone()),
            _ => None,
        };
        match (label(self), &self.change) {
            (Some(to), _) if self.others.iter().all(|other| label(other) == Some(to.clone())) => {
                format!("labelled {}", shown_title(to.as_deref().unwrap_or_default()))
            }
            (Some(_), _) => "labels changed".to_owned(),
            (None, Change::Tags { .. }) => "tags changed".to_owned(),
            (None, _) => "notes changed".to_owned(),
        }
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

    pub(super) fn change_each(&self, ids: &[TrialId], what: &Change) -> Result<(), StoreError> {
        let fault = |e: rusqlite::Error| self.fault(&e);
        let transaction = self.write()?;
        let batch = new_batch(&transaction, ids.len()).map_err(fault)?;
        for id in ids {
            let links = Links { batch: batch.as_deref(), undoes: None };
            if !change(&transaction, *id, what, links).map_err(fault)? {
                return Err(self.no_trial(*id));
            }
        }
        self.commit(transaction)
    }
}

/// Direction of a step through the history.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Direction {
    Undo,
    Redo,
}

const ENTRIES: &str = "SELECT journal.number, journal.at, journal.trial, trials.id, journal.entry, journal.merged,
    undone.number, journal.uid, journal.undoes, journal.batch
    FROM journal LEFT JOIN trials ON trials.uid = journal.trial LEFT JOIN journal AS undone ON undone.uid = journal.undoes";

/// An entry with what links entries to each other.
struct Record {
    entry: JournalEntry,
    uid: String,
    undoes: Option<String>,
    batch: Option<String>,
}

fn record_of(row: &Row<'_>) -> rusqlite::Result<Record> {
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
        others: Vec::new(),
    };
    Ok(Record { entry, uid: row.get(7)?, undoes: row.get(8)?, batch: row.get(9)? })
}

/// A change, or all changes of a batch.
type Step = Vec<Record>;

/// Adds a record to the last step where both belong to one batch, else as a step of its own.
fn gather(steps: &mut Vec<Step>, record: Record) {
    let is_same = |step: &&mut Step| record.batch.is_some() && step.first().is_some_and(|r| r.batch == record.batch);
    match steps.last_mut().filter(is_same) {
        Some(step) => step.push(record),
        None => steps.push(vec![record]),
    }
}

/// One entry for all records of a step, in their order.
fn joined(step: Step) -> Option<JournalEntry> {
    let mut entries = step.into_iter().map(|record| record.entry);
    let first = entries.next()?;
    Some(JournalEntry { others: entries.collect(), ..first })
}

impl JournalRepository<'_> {
    /// The newest entries, newest first; a batch is one entry.
    pub fn entries(&self, limit: usize) -> Result<Vec<JournalEntry>, StoreError> {
        let sql = format!("{ENTRIES} ORDER BY journal.number DESC");
        let steps = self.store.connection.prepare(&sql).and_then(|mut statement| {
            let mut steps = Vec::new();
            let mut records = statement.query_map([], record_of)?;
            while let Some(record) = records.next().transpose()? {
                gather(&mut steps, record);
                if steps.len() > limit {
                    steps.pop();
                    break;
                }
            }
            Ok(steps)
        });
        let oldest_first = |step: Step| joined(step.into_iter().rev().collect());
        Ok(steps.map_err(|e| self.store.fault(&e))?.into_iter().filter_map(oldest_first).collect())
    }

    /// Undoes the last change of a label, note, tag, doubt or deletion, of a batch all changes; the entry that was undone,
    /// or none at the end.
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
        let Some(step) = next_step(history(&transaction).map_err(fault)?, direction) else { return Ok(None) };
        let batch = new_batch(&transaction, step.len()).map_err(fault)?;
        for Record { entry, uid, .. } in &step {
            let (Some(id), Some(inverse)) = (entry.trial, entry.change.inverse()) else { continue };
            let links = Links { undoes: Some(uid), batch: batch.as_deref() };
            if !change(&transaction, id, &inverse, links).map_err(fault)? {
                let change = entry.change.sentence();
                return Err(StoreError::Refused(format!(
                    "cannot undo \"{change}\" of trial {id}: the trial has changed since"
                )));
            }
        }
        self.store.commit(transaction)?;
        Ok(joined(step))
    }
}

/// Everything that can be undone or that undid something, oldest first; without merged entries and purged trials.
fn history(transaction: &Transaction<'_>) -> rusqlite::Result<Vec<Step>> {
    let sql = format!(
        "{ENTRIES} WHERE journal.undoable AND NOT journal.merged AND trials.id IS NOT NULL ORDER BY journal.number"
    );
    let mut steps = Vec::new();
    for record in transaction.prepare(&sql)?.query_map([], record_of)? {
        gather(&mut steps, record?);
    }
    Ok(steps)
}

/// The step to be inverted next. Undoing a change allows to redo it, and the other way round; any other change ends redo.
fn next_step(history: Vec<Step>, direction: Direction) -> Option<Step> {
    let (mut undo, mut redo): (Vec<Step>, Vec<Step>) = (Vec::new(), Vec::new());
    for step in history {
        // Every entry of a batch undoes another entry of one batch.
        let undone = step.iter().find_map(|record| record.undoes.clone());
        let place = |stack: &[Step]| {
            let undone = undone.as_ref()?;
            stack.iter().rposition(|other| other.iter().any(|record| record.uid == *undone))
        };
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

/// Links of an entry to others, by their uids.
#[derive(Clone, Copy, Default)]
pub(super) struct Links<'a> {
    /// Entry that this one undoes.
    pub(super) undoes: Option<&'a str>,
    /// Batch that it belongs to.
    pub(super) batch: Option<&'a str>,
}

/// Name of a new batch; none for a single change.
pub(super) fn new_batch(transaction: &Transaction<'_>, changes: usize) -> rusqlite::Result<Option<String>> {
    let name = || transaction.query_row("SELECT lower(hex(randomblob(16)))", [], |row| row.get(0));
    (changes > 1).then(name).transpose()
}

/// Adds an entry.
pub(super) fn append(
    transaction: &Transaction<'_>,
    trial: Option<TrialId>,
    change: &Change,
    Links { undoes, batch }: Links<'_>,
) -> rusqlite::Result<()> {
    let sql = "INSERT INTO journal (trial, undoes, undoable, entry, batch)
               VALUES ((SELECT uid FROM trials WHERE id = ?1), ?2, ?3, ?4, ?5)";
    let columns = params![trial, undoes, change.inverse().is_some(), json(change), batch];
    transaction.prepare_cached(sql)?.execute(columns)?;
    Ok(())
}

/// Makes a change and adds its entry. False where the trial differs from the state that the change starts from.
pub(super) fn change(
    transaction: &Transaction<'_>,
    trial: TrialId,
    change: &Change,
    links: Links<'_>,
) -> rusqlite::Result<bool> {
    if change.is_idle() {
        return Ok(true);
    }
    let changed = apply(transaction, trial, change)? == 1;
    if changed {
        append(transaction, Some(trial), change, links)?;
    }
    Ok(changed)
}

const UNREVIEWED: &str = "UPDATE trials SET reviewed = 0 WHERE id = ?1";

fn apply(transaction: &Transaction<'_>, trial: TrialId, change: &Change) -> rusqlite::Result<usize> {
    let set = |column: &str, from: &dyn rusqlite::ToSql, to: &dyn rusqlite::ToSql| {
        // What a person has worked on leaves the demo log, where it would be lost.
        let sql =
            format!("UPDATE trials SET {column} = ?3, demo = 0 WHERE id = ?1 AND {column} = ?2 AND deleted IS NULL");
        transaction.prepare_cached(&sql)?.execute(params![trial, from, to])
    };
    match change {
        Change::Label { from, to } => {
            let stored = |label: &Option<String>| label.clone().unwrap_or_default();
            let changed = set("object", &stored(from), &stored(to))?;
            // Nobody has reviewed this label, also where it comes back by undo.
            if changed == 1 {
                transaction.execute(UNREVIEWED, [trial])?;
            }
            Ok(changed)
        }
        Change::Note { from, to } => set("note", from, to),
        Change::Tags { from, to } => set("tags", &json(from), &json(to)),
        Change::Unsure { from, to } => set("unsure", from, to),
        Change::Phases { from, to } => set("phases", &json(from), &json(to)),
        Change::Reviewed => set("reviewed", &false, &true),
        Change::Discarded => {
            let sql = "UPDATE trials SET deleted = strftime('%Y-%m-%dT%H:%M:%fZ', 'now')
                       WHERE id = ?1 AND deleted IS NULL";
            transaction.prepare_cached(sql)?.execute([trial])
        }
        Change::Restored => {
            let sql = "UPDATE trials SET deleted = NULL WHERE id = ?1 AND deleted IS NOT NULL";
            transaction.prepare_cached(sql)?.execute([trial])
        }
        Change::Kept => {
            let sql = "UPDATE trials SET demo = 0 WHERE id = ?1 AND demo = 1 AND deleted IS NULL";
            transaction.prepare_cached(sql)?.execute([trial])
        }
        Change::ReturnedToLog => {
            // One that has joined a collection since stays in the store.
            let sql =
                "UPDATE trials SET demo = NOT EXISTS (SELECT 1 FROM memberships WHERE memberships.trial = trials.id)
                       WHERE id = ?1 AND demo = 0 AND deleted IS NULL";
            transaction.prepare_cached(sql)?.execute([trial])
        }
        Change::Guess { guess } => {
            let sql = "INSERT INTO guesses (trial, model, pmf) SELECT id, ?2, ?3 FROM trials
                       WHERE id = ?1 AND deleted IS NULL
                       ON CONFLICT (trial) DO UPDATE SET model = excluded.model, pmf = excluded.pmf";
            let changed = transaction.execute(sql, params![trial, guess.model, json(&guess.pmf)])?;
            // A new prediction has not been reviewed.
            transaction.execute(UNREVIEWED, [trial])?;
            Ok(changed)
        }
        // The plan belongs to no trial.
        Change::Plan { .. } => Ok(0),
    }
}
