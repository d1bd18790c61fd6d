//! Labels of trials in the store, and what belongs to them: notes, tags, predictions and the plan. Every change adds an
//! entry to the journal in the same transaction.

use super::checksum::is_intact;
use super::demo_log::TrialPlace;
use super::journal::{Change, Links, append, change, new_batch};
use super::store::{Store, json, source_named};
use super::store_error::{StoreError, row_fault};
use crate::labels::{Edited, Guess, LabelError, LabelPlan, TrialEdit, class_name, shown_name};
use palpate_tactile::trial::{CorrectedPhases, TrialId, TrialSource};
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

/// State of the labels: two that are equal show the same lists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelRevision {
    /// Last entry of the journal.
    entry: i64,
    /// Number of trials of the real gripper.
    trials: i64,
    /// The newest of them and how far it is.
    newest: Option<(TrialId, String)>,
}

/// Labels of one trial.
struct LabelState {
    rig: String,
    object: String,
    note: String,
    tags: Vec<String>,
    unsure: bool,
    reviewed: bool,
    phases: Option<CorrectedPhases>,
    place: TrialPlace,
    intact: bool,
}

fn state_of(row: &Row<'_>) -> rusqlite::Result<LabelState> {
    let tags = serde_json::from_str(&row.get::<_, String>(3)?).unwrap_or_default();
    let (unsure, reviewed) = (row.get(4)?, row.get(5)?);
    let phases = serde_json::from_str(&row.get::<_, String>(6)?).unwrap_or_default();
    let (place, intact) = (TrialPlace::of_column(row.get(7)?), row.get(8)?);
    let (rig, object, note) = (row.get(0)?, row.get(1)?, row.get(2)?);
    Ok(LabelState { rig, object, note, tags, unsure, reviewed, phases, place, intact })
}

impl LabelRepository<'_> {
    /// Changes trials, all or none of them; one undo takes all changes back. Of several trials, a label leaves out those
    /// whose object is known.
    pub fn edit(&self, ids: &[TrialId], edit: &TrialEdit) -> Result<Edited, StoreError> {
        match edit {
            TrialEdit::Label(object) => {
                let to = class_name(object)?;
                self.change_trials(ids, |id, state| label_change(id, state, to.clone()))
            }
            TrialEdit::Note(note) => {
                let to = note.trim().to_owned();
                let length = to.chars().count();
                if length > LONGEST_NOTE {
                    return Err(StoreError::Refused(format!(
                        "the note has {length} characters, {LONGEST_NOTE} are allowed; keep longer texts in a file"
                    )));
                }
                self.change_trials(ids, |_, state| Ok(Some(Change::Note { from: state.note, to: to.clone() })))
            }
            TrialEdit::Tags(tags) => {
                let tags = checked(tags)?;
                self.change_trials(ids, |_, state| Ok(Some(tag_change(state, |_| false, &tags))))
            }
            TrialEdit::Tag(tags) => {
                let tags = checked(tags)?;
                self.change_trials(ids, |_, state| Ok(Some(tag_change(state, |_| true, &tags))))
            }
            TrialEdit::Untag(tags) => {
                let tags = checked(tags)?;
                self.change_trials(ids, |_, state| Ok(Some(tag_change(state, |tag| !tags.contains(tag), &[]))))
            }
            TrialEdit::Unsure(unsure) => {
                self.change_trials(ids, |_, state| Ok(Some(Change::Unsure { from: state.unsure, to: *unsure })))
            }
            TrialEdit::Phases(phases) => {
                self.change_trials(ids, |_, state| Ok(Some(Change::Phases { from: state.phases, to: *phases })))
            }
            TrialEdit::Discard => self.change_deletion(ids, &Change::Discarded),
            TrialEdit::Restore => self.change_deletion(ids, &Change::Restored),
            TrialEdit::Keep => {
                self.change_trials(ids, |_, state| Ok((state.place == TrialPlace::DemoLog).then_some(Change::Kept)))
            }
        }
    }

    /// Labels a trial of the real gripper.
    pub fn set_label(&self, id: TrialId, object: &str) -> Result<(), StoreError> {
        self.edit(&[id], &TrialEdit::Label(object.to_owned())).map(drop)
    }

    /// Sets the note on a trial; an empty text removes it.
    pub fn set_note(&self, id: TrialId, note: &str) -> Result<(), StoreError> {
        self.edit(&[id], &TrialEdit::Note(note.to_owned())).map(drop)
    }

    /// Sets the tags of a trial. Each must be a valid label; repeated ones count once.
    pub fn set_tags(&self, id: TrialId, tags: &[String]) -> Result<(), StoreError> {
        self.edit(&[id], &TrialEdit::Tags(tags.to_vec())).map(drop)
    }

    /// Marks a label as unsure, or removes the mark.
    pub fn set_unsure(&self, id: TrialId, unsure: bool) -> Result<(), StoreError> {
        self.edit(&[id], &TrialEdit::Unsure(unsure)).map(drop)
    }

    /// Stores the prediction of a model for a trial: classes and their probabilities, which sum to one.
    pub fn set_guess(&self, id: TrialId, model: &str, pmf: &[(String, f64)]) -> Result<(), StoreError> {
        let sum: f64 = pmf.iter().map(|(_, p)| p).sum();
        if !((sum - 1.0).abs() < PMF_TOLERANCE && pmf.iter().all(|(_, p)| (0.0..=1.0 + PMF_TOLERANCE).contains(p))) {
            return Err(StoreError::Refused(format!(
                "the prediction of \"{model}\" is not stored: its probabilities are outside 0 to 1, or sum to {sum}"
            )));
        }
        let guess = Guess { model: model.to_owned(), pmf: pmf.to_vec() };
        self.change_trials(&[id], |_, _state| Ok(Some(Change::Guess { guess: guess.clone() }))).map(drop)
    }

    /// The prediction stored for a trial.
    pub fn guess(&self, id: TrialId) -> Result<Option<Guess>, StoreError> {
        let sql = "SELECT model, pmf FROM guesses WHERE trial = ?1";
        let columns = |row: &Row<'_>| Ok((row.get::<_, String>(0)?, row.get::<_, String>(1)?));
        let found = self.store.first(sql, [id], columns)?;
        let bad = |e: serde_json::Error| StoreError::bad_info(id, format!("its prediction: {e}"));
        found.map(|(model, pmf)| Ok(Guess { model, pmf: serde_json::from_str(&pmf).map_err(bad)? })).transpose()
    }

    /// Marks a trial as reviewed: its label was checked and kept.
    pub fn mark_reviewed(&self, id: TrialId) -> Result<(), StoreError> {
        self.change_trials(&[id], |_, state| Ok((!state.reviewed).then_some(Change::Reviewed))).map(drop)
    }

    /// The present state of labels, plan and recorded trials, which is cheaper to read than the lists.
    pub fn revision(&self) -> Result<LabelRevision, StoreError> {
        let number = |sql: &str| self.store.connection.query_row(sql, [], |row| row.get(0));
        let newest = "SELECT id, state FROM trials JOIN board_trials ON trial = id ORDER BY trial DESC LIMIT 1";
        let read = || -> rusqlite::Result<LabelRevision> {
            Ok(LabelRevision {
                entry: number("SELECT coalesce(max(number), 0) FROM journal")?,
                trials: number("SELECT count(*) FROM board_trials")?,
                newest: self.store.connection.query_row(newest, [], |row| Ok((row.get(0)?, row.get(1)?))).optional()?,
            })
        };
        read().map_err(|e| self.store.fault(&e))
    }

    /// How many trials of each object are wanted.
    pub fn plan(&self) -> Result<LabelPlan, StoreError> {
        plan_in(&self.store.connection).map_err(|e| self.store.fault(&e))
    }

    /// Sets how many trials of each object are wanted.
    pub fn set_plan(&self, plan: &LabelPlan) -> Result<(), StoreError> {
        let to = plan.checked()?;
        let sql = "INSERT INTO label_plan (only, plan) VALUES (1, ?1) ON CONFLICT (only) DO UPDATE SET plan = ?1";
        self.store.in_transaction(|transaction| {
            let from = plan_in(transaction)?;
            if from == to {
                return Ok(());
            }
            transaction.execute(sql, params![json(&to)])?;
            append(transaction, None, &Change::Plan { from, to }, Links::default())
        })
    }

    /// Makes the changes that follow from the present states of trials, all or none. A known object is an error only where
    /// it leaves nothing to change.
    fn change_trials(
        &self,
        ids: &[TrialId],
        follows: impl Fn(TrialId, LabelState) -> Result<Option<Change>, StoreError>,
    ) -> Result<Edited, StoreError> {
        let fault = |e: rusqlite::Error| self.store.fault(&e);
        let transaction = self.store.write()?;
        let batch = new_batch(&transaction, ids.len()).map_err(fault)?;
        let links = Links { undoes: None, batch: batch.as_deref() };
        let mut edited = Edited::default();
        let sql = format!(
            "SELECT rig, object, note, tags, unsure, reviewed, phases, demo, {} FROM trials WHERE id = ?1 AND deleted IS NULL",
            is_intact()
        );
        for id in ids {
            let state =
                transaction.prepare_cached(&sql).and_then(|mut found| found.query_row([id], state_of).optional());
            let state = state.map_err(|e| row_fault(self.store.path(), *id, &e))?;
            let state = state.ok_or_else(|| self.store.no_trial(*id))?;
            if !state.intact {
                return Err(StoreError::altered(*id));
            }
            let wanted = match follows(*id, state) {
                Err(StoreError::NotOfBoard(_)) if edited.known + 1 < ids.len() => {
                    edited.known += 1;
                    continue;
                }
                wanted => wanted?,
            };
            let Some(wanted) = wanted.filter(|change| !change.is_idle()) else { continue };
            edited.changed += usize::from(change(&transaction, *id, &wanted, links).map_err(fault)?);
        }
        self.store.commit(transaction)?;
        Ok(edited)
    }

    fn change_deletion(&self, ids: &[TrialId], what: &Change) -> Result<Edited, StoreError> {
        self.store.change_each(ids, what)?;
        Ok(Edited { changed: ids.len(), known: 0 })
    }
}

/// Change of a label. The object of simulated and imported trials is known.
fn label_change(id: TrialId, state: LabelState, to: String) -> Result<Option<Change>, StoreError> {
    let LabelState { rig, object, .. } = state;
    let origin = source_named(id, &rig)?;
    if origin != TrialSource::Recorded {
        return Err(StoreError::NotOfBoard(format!(
            "trial {id} is of \"{}\" and comes from \"{origin}\": only trials of the real gripper can be labelled",
            shown_name(&object)
        )));
    }
    let from = Some(object).filter(|name| !name.is_empty());
    Ok(Some(Change::Label { from, to: Some(to) }))
}

/// Tags as they are stored.
fn checked(tags: &[String]) -> Result<Vec<String>, LabelError> {
    tags.iter().map(|tag| class_name(tag)).collect()
}

/// Change of tags: those that are kept, then new ones, each once.
fn tag_change(state: LabelState, keeps: impl Fn(&String) -> bool, new: &[String]) -> Change {
    let from = state.tags;
    let mut to: Vec<String> = Vec::new();
    for tag in from.iter().filter(|tag| keeps(tag)).chain(new) {
        if !to.contains(tag) {
            to.push(tag.clone());
        }
    }
    Change::Tags { from, to }
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
