//! Labels of trials in the store, and what goes with them. Every change is told to the journal in the same transaction.
//!
//! ```text
//! trials       object (empty: unlabelled), note, tags, unsure, reviewed
//! guesses      what a model said of a trial when its label was given
//! label_plan   how many trials of each object are wanted: one row, or none for the usual plan
//! journal      see `journal`
//! ```

use super::board_trials::BOARD_RIG;
use super::journal::{Change, LabelState, append, change, state_of};
use super::store::{Store, json};
use super::store_error::{StoreError, fault};
use crate::labels::{Guess, LabelPlan, class_name};
use palpate_tactile::trial::TrialId;
use rusqlite::{Connection, OptionalExtension, params};

/// The tables above, but for the journal.
pub(super) const LABEL_TABLES: &str = "
    ALTER TABLE trials ADD COLUMN note TEXT NOT NULL DEFAULT '';
    ALTER TABLE trials ADD COLUMN tags TEXT NOT NULL DEFAULT '[]';
    ALTER TABLE trials ADD COLUMN unsure INTEGER NOT NULL DEFAULT 0;
    ALTER TABLE trials ADD COLUMN reviewed INTEGER NOT NULL DEFAULT 0;
    CREATE TABLE guesses (
        trial INTEGER PRIMARY KEY REFERENCES trials (id) ON DELETE CASCADE,
        model TEXT NOT NULL,
        pmf TEXT NOT NULL
    );
    CREATE TABLE label_plan (
        only INTEGER PRIMARY KEY CHECK (only = 1),
        plan TEXT NOT NULL
    );
";

/// Copies guesses with the trials of another store; part of merging. The plan is a matter of each store.
pub(super) const COPY_GUESSES: &str = "
    INSERT INTO main.guesses (trial, model, pmf)
    SELECT ours.id, guesses.model, guesses.pmf FROM temp.incoming
    JOIN other.trials AS theirs ON theirs.id = incoming.id
    JOIN main.trials AS ours ON ours.uid = theirs.uid
    JOIN other.guesses AS guesses ON guesses.trial = theirs.id;
";

/// Most characters of a note.
const LONGEST_NOTE: usize = 4000;

/// How far probabilities may be from summing to one: those of a model are rounded when they are written.
const PMF_TOLERANCE: f64 = 1e-3;

impl Store {
    /// Gives a trial of the real gripper its label, or another one.
    pub fn label_trial(&mut self, id: TrialId, object: &str) -> Result<(), StoreError> {
        let label = class_name(object)?;
        self.change_trial(id, |state| {
            let from = Some(state.object.clone()).filter(|name| !name.is_empty());
            // Of others it is known what they are of: it was simulated, or came with the file.
            (state.rig == BOARD_RIG).then_some(Change::Label { from, to: Some(label) })
        })
    }

    /// Sets what is noted of a trial; an empty text removes it.
    pub fn set_note(&mut self, id: TrialId, note: &str) -> Result<(), StoreError> {
        let note = note.trim().to_owned();
        let length = note.chars().count();
        if length > LONGEST_NOTE {
            return Err(StoreError::LongNote { length, most: LONGEST_NOTE });
        }
        self.change_trial(id, |state| Some(Change::Note { from: state.note.clone(), to: note }))
    }

    /// Sets the tags of a trial; each is such a text as a label may be, and counts once.
    pub fn set_tags(&mut self, id: TrialId, tags: &[String]) -> Result<(), StoreError> {
        let mut to: Vec<String> = Vec::new();
        for tag in tags {
            let tag = class_name(tag)?;
            if !to.contains(&tag) {
                to.push(tag);
            }
        }
        self.change_trial(id, |state| Some(Change::Tags { from: state.tags.clone(), to }))
    }

    /// Marks a label as doubted by whoever gave it, or takes that back.
    pub fn set_unsure(&mut self, id: TrialId, unsure: bool) -> Result<(), StoreError> {
        self.change_trial(id, |state| Some(Change::Unsure { from: state.unsure, to: unsure }))
    }

    /// Keeps what a model said of a trial: classes and their probabilities, which sum to one.
    pub fn set_guess(&mut self, id: TrialId, model: &str, pmf: &[(String, f64)]) -> Result<(), StoreError> {
        let sum: f64 = pmf.iter().map(|(_, p)| p).sum();
        if !((sum - 1.0).abs() < PMF_TOLERANCE && pmf.iter().all(|(_, p)| (0.0..=1.0 + PMF_TOLERANCE).contains(p))) {
            return Err(StoreError::BadGuess { model: model.to_owned(), sum });
        }
        let guess = Guess { model: model.to_owned(), pmf: pmf.to_vec() };
        self.change_trial(id, |_state| Some(Change::Guess { guess }))
    }

    /// What a model said of a trial when its label was given.
    pub fn guess(&self, id: TrialId) -> Result<Option<Guess>, StoreError> {
        let sql = "SELECT model, pmf FROM guesses WHERE trial = ?1";
        let found: Option<(String, String)> = self
            .connection
            .query_row(sql, [id], |row| Ok((row.get(0)?, row.get(1)?)))
            .optional()
            .map_err(|e| fault(self.path(), &e))?;
        let bad = |e: serde_json::Error| StoreError::BadInfo { id, cause: format!("its guess: {e}") };
        found.map(|(model, pmf)| Ok(Guess { model, pmf: serde_json::from_str(&pmf).map_err(bad)? })).transpose()
    }

    /// Notes that somebody has looked at a trial again and keeps its label.
    pub fn mark_reviewed(&mut self, id: TrialId) -> Result<(), StoreError> {
        self.change_trial(id, |state| if state.reviewed { Some(keeps(state)) } else { Some(Change::Reviewed) })
    }

    /// Discards a trial: it stays until it is purged, but no list shows it and no data set takes it.
    pub fn discard_trial(&mut self, id: TrialId) -> Result<(), StoreError> {
        self.delete(&[id])
    }

    /// Takes a discarded trial back.
    pub fn restore_trial(&mut self, id: TrialId) -> Result<(), StoreError> {
        self.restore(&[id])
    }

    /// How many trials of each object are wanted.
    pub fn label_plan(&self) -> Result<LabelPlan, StoreError> {
        plan_in(&self.connection).map_err(|e| fault(self.path(), &e))
    }

    /// Sets how many trials of each object are wanted.
    pub fn set_label_plan(&mut self, plan: &LabelPlan) -> Result<(), StoreError> {
        let to = plan.checked()?;
        let (path, writer) = (self.path().to_owned(), self.journal.writer.clone());
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let transaction = self.write()?;
        let from = plan_in(&transaction).map_err(fault)?;
        if from == to {
            return Ok(());
        }
        let sql = "INSERT INTO label_plan (only, plan) VALUES (1, ?1) ON CONFLICT (only) DO UPDATE SET plan = ?1";
        transaction.execute(sql, params![json(&to)]).map_err(fault)?;
        append(&transaction, &writer, None, &Change::Plan { from, to }, None).map_err(fault)?;
        transaction.commit().map_err(fault)
    }

    /// Makes the change that follows from a trial's state; none where such a change cannot be made of this trial.
    fn change_trial(
        &mut self,
        id: TrialId,
        follows: impl FnOnce(&LabelState) -> Option<Change>,
    ) -> Result<(), StoreError> {
        let (path, writer) = (self.path().to_owned(), self.journal.writer.clone());
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let transaction = self.write()?;
        let Some(state) = state_of(&transaction, id).map_err(fault)? else {
            drop(transaction);
            return Err(self.no_trial(id));
        };
        let Some(wanted) = follows(&state) else {
            return Err(StoreError::NotOfBoard { id, object: state.object, rig: state.rig });
        };
        change(&transaction, &writer, id, &wanted, None).map_err(fault)?;
        transaction.commit().map_err(fault)
    }
}

/// The plan of a store; the usual one where it has none, or one that cannot be read.
fn plan_in(connection: &Connection) -> rusqlite::Result<LabelPlan> {
    let sql = "SELECT plan FROM label_plan";
    let found: Option<String> = connection.query_row(sql, [], |row| row.get(0)).optional()?;
    let readable = |text: String| {
        let plan = serde_json::from_str(&text);
        plan.inspect_err(|error| tracing::warn!("the plan in the store cannot be read: {error}")).ok()
    };
    Ok(found.and_then(readable).unwrap_or_default())
}

/// A change that changes nothing.
fn keeps(state: &LabelState) -> Change {
    Change::Unsure { from: state.unsure, to: state.unsure }
}
