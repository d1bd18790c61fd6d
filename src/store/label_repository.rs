//! Labels of trials in the store, and what belongs to them: notes, tags, predictions and the plan. Every change adds an
//! entry to the journal in the same transaction.

use super::journal::{Change, append, change};
use super::store::{Store, json, source_named};
use super::store_error::StoreError;
use crate::labels::{Guess, LabelPlan, class_name};
use palpate_tactile::trial::{TrialId, TrialSource};
use rusqlite::{Connection, OptionalExtension, Row, params};

/// Most characters of a note.
const LONGEST_NOTE: usize = 4000;

/// How far probabilities may be from summing to one: those of a model are rounded when they are written.
const PMF_TOLERANCE: f64 = 1e-3;

/// Labels, notes, tags, predictions and the plan of a store.
#[derive(Clone, Copy, Debug)]
pub struct LabelRepository<'a> {
    pub(super) store: &'a Store,
}

impl Store {
    /// Labels of trials and the plan.
    pub fn labels(&self) -> LabelRepository<'_> {
        LabelRepository { store: self }
    }
}

/// Labels of one trial.
struct LabelState {
    rig: String,
    object: String,
    note: String,
    tags: Vec<String>,
    unsure: bool,
    reviewed: bool,
}

fn state_of(row: &Row<'_>) -> rusqlite::Result<LabelState> {
    let tags = serde_json::from_str(&row.get::<_, String>(3)?).unwrap_or_default();
    let (unsure, reviewed) = (row.get(4)?, row.get(5)?);
    Ok(LabelState { rig: row.get(0)?, object: row.get(1)?, note: row.get(2)?, tags, unsure, reviewed })
}

impl LabelRepository<'_> {
    /// Labels a trial of the real gripper.
    pub fn set_label(&self, id: TrialId, object: &str) -> Result<(), StoreError> {
        let label = class_name(object)?;
        self.change_trial(id, |LabelState { rig, object, .. }| {
            // The object of simulated and imported trials is known.
            let origin = source_named(id, &rig)?;
            if origin != TrialSource::Recorded {
                return Err(StoreError::NotOfBoard { id, object, origin });
            }
            let from = Some(object).filter(|name| !name.is_empty());
            Ok(Some(Change::Label { from, to: Some(label) }))
        })
    }

    /// Sets the note on a trial; an empty text removes it.
    pub fn set_note(&self, id: TrialId, note: &str) -> Result<(), StoreError> {
        let to = note.trim().to_owned();
        let length = to.chars().count();
        if length > LONGEST_NOTE {
            return Err(StoreError::LongNote { length, most: LONGEST_NOTE });
        }
        self.change_trial(id, |state| Ok(Some(Change::Note { from: state.note, to })))
    }

    /// Sets the tags of a trial. Each must be a valid label; repeated ones count once.
    pub fn set_tags(&self, id: TrialId, tags: &[String]) -> Result<(), StoreError> {
        let mut to: Vec<String> = Vec::new();
        for tag in tags {
            let tag = class_name(tag)?;
            if !to.contains(&tag) {
                to.push(tag);
            }
        }
        self.change_trial(id, |state| Ok(Some(Change::Tags { from: state.tags, to })))
    }

    /// Marks a label as unsure, or removes the mark.
    pub fn set_unsure(&self, id: TrialId, unsure: bool) -> Result<(), StoreError> {
        self.change_trial(id, |state| Ok(Some(Change::Unsure { from: state.unsure, to: unsure })))
    }

    /// Stores the prediction of a model for a trial: classes and their probabilities, which sum to one.
    pub fn set_guess(&self, id: TrialId, model: &str, pmf: &[(String, f64)]) -> Result<(), StoreError> {
        let sum: f64 = pmf.iter().map(|(_, p)| p).sum();
        if !((sum - 1.0).abs() < PMF_TOLERANCE && pmf.iter().all(|(_, p)| (0.0..=1.0 + PMF_TOLERANCE).contains(p))) {
            return Err(StoreError::BadGuess { model: model.to_owned(), sum });
        }
        let guess = Guess { model: model.to_owned(), pmf: pmf.to_vec() };
        self.change_trial(id, |_state| Ok(Some(Change::Guess { guess })))
    }

    /// The prediction stored for a trial.
    pub fn guess(&self, id: TrialId) -> Result<Option<Guess>, StoreError> {
        let sql = "SELECT model, pmf FROM guesses WHERE trial = ?1";
        let columns = |row: &Row<'_>| Ok((row.get::<_, String>(0)?, row.get::<_, String>(1)?));
        let found = self.store.connection.query_row(sql, [id], columns).optional().map_err(|e| self.store.fault(&e))?;
        let bad = |e: serde_json::Error| StoreError::BadInfo { id, cause: format!("its prediction: {e}") };
        found.map(|(model, pmf)| Ok(Guess { model, pmf: serde_json::from_str(&pmf).map_err(bad)? })).transpose()
    }

    /// Marks a trial as reviewed: its label was checked and kept.
    pub fn mark_reviewed(&self, id: TrialId) -> Result<(), StoreError> {
        self.change_trial(id, |state| Ok((!state.reviewed).then_some(Change::Reviewed)))
    }

    /// How many trials of each object are wanted.
    pub fn plan(&self) -> Result<LabelPlan, StoreError> {
        plan_in(&self.store.connection).map_err(|e| self.store.fault(&e))
    }

    /// Sets how many trials of each object are wanted.
    pub fn set_plan(&self, plan: &LabelPlan) -> Result<(), StoreError> {
        let to = plan.checked()?;
        let fault = |e: rusqlite::Error| self.store.fault(&e);
        let transaction = self.store.write()?;
        let from = plan_in(&transaction).map_err(fault)?;
        if from == to {
            return Ok(());
        }
        let sql = "INSERT INTO label_plan (only, plan) VALUES (1, ?1) ON CONFLICT (only) DO UPDATE SET plan = ?1";
        transaction.execute(sql, params![json(&to)]).map_err(fault)?;
        append(&transaction, None, &Change::Plan { from, to }, None).map_err(fault)?;
        transaction.commit().map_err(fault)
    }

    /// Makes the change that follows from a trial's present state, if any.
    fn change_trial(
        &self,
        id: TrialId,
        follows: impl FnOnce(LabelState) -> Result<Option<Change>, StoreError>,
    ) -> Result<(), StoreError> {
        let fault = |e: rusqlite::Error| self.store.fault(&e);
        let transaction = self.store.write()?;
        let sql = "SELECT rig, object, note, tags, unsure, reviewed FROM trials WHERE id = ?1 AND deleted IS NULL";
        let state = transaction.query_row(sql, [id], state_of).optional().map_err(fault)?;
        if let Some(wanted) = follows(state.ok_or_else(|| self.store.no_trial(id))?)? {
            change(&transaction, id, &wanted, None).map_err(fault)?;
        }
        transaction.commit().map_err(fault)
    }
}

/// The plan of a store; the default where it has none, or one that cannot be read.
fn plan_in(connection: &Connection) -> rusqlite::Result<LabelPlan> {
    let found: Option<String> = connection.query_row("SELECT plan FROM label_plan", [], |row| row.get(0)).optional()?;
    let readable = |text: String| {
        let plan = serde_json::from_str(&text);
        plan.inspect_err(|error| tracing::warn!("the plan in the store cannot be read: {error}")).ok()
    };
    Ok(found.and_then(readable).unwrap_or_default())
}
