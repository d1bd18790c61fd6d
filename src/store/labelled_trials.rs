//! Lists of the real gripper's trials with their labels. Everything that a list shows is stored with the trial, so that
//! hundreds of them are read without decoding one.

use super::checksum::is_intact;
use super::label_repository::LabelRepository;
use super::store_error::StoreError;
use crate::labels::{FlagRemark, Guess, GuessTop, LabelledTrial, Sparkline, cadence_line, flaws};
use palpate_tactile::board::Board;
use palpate_tactile::cadence::Cadence;
use palpate_tactile::trial::TrialSource;
use rusqlite::Row;
use serde::Deserialize;

/// The part of `board_trials.about` that lists show.
#[derive(Deserialize, Default)]
#[serde(default)]
struct ListedInfo {
    cadence: Cadence,
    flags: Vec<FlagRemark>,
    sparkline: Sparkline,
    seconds: f64,
    board: Board,
}

/// A row; of a damaged one what can be read.
fn of_row(row: &Row<'_>) -> rusqlite::Result<LabelledTrial> {
    let unreadable =
        || Ok(LabelledTrial { id: row.get(0)?, discarded: row.get(9)?, damaged: true, ..Default::default() });
    read_intact(row).or_else(|_damage: rusqlite::Error| unreadable())
}

fn read_intact(row: &Row<'_>) -> rusqlite::Result<LabelledTrial> {
    let text = |column: usize| row.get::<_, String>(column);
    let shown: ListedInfo = serde_json::from_str(&text(11)?).unwrap_or_default();
    let object = Some(text(4)?).filter(|object| !object.is_empty());
    let guess = match (row.get::<_, Option<String>>(12)?, row.get::<_, Option<String>>(13)?) {
        (Some(model), Some(pmf)) => serde_json::from_str(&pmf).ok().map(|pmf| Guess { model, pmf }),
        _ => None,
    };
    let flags = flaws(shown.flags.clone(), object.as_deref());
    // A hand that felt nothing is empty, whatever a model makes of that: nobody has to review it.
    let is_surely_empty = shown.flags.len() > flags.len();
    let samples = row.get::<_, i64>(10)?.max(0).cast_unsigned();
    // Trials of early versions have no length: it follows from their rate.
    let by_rate = if shown.cadence.rate_hz > 0.0 { samples as f64 / shown.cadence.rate_hz } else { 0.0 };
    Ok(LabelledTrial {
        id: row.get(0)?,
        uid: row.get(1)?,
        created: row.get(2)?,
        complete: text(3)? == "complete",
        note: row.get(5)?,
        tags: serde_json::from_str(&text(6)?).unwrap_or_default(),
        unsure: row.get(7)?,
        flags,
        cadence: cadence_line(&shown.cadence),
        guess: guess.and_then(|guess| GuessTop::of(&guess, object.as_deref())),
        reviewed: row.get(8)? || is_surely_empty,
        samples,
        emulated: shown.board.emulated,
        seconds: if shown.seconds > 0.0 { shown.seconds } else { by_rate },
        discarded: row.get(9)?,
        damaged: !row.get::<_, bool>(14)?,
        sparkline: shown.sparkline,
        object,
    })
}

impl LabelRepository<'_> {
    /// All trials of the real gripper, oldest first; deleted ones too.
    pub fn trials(&self) -> Result<Vec<LabelledTrial>, StoreError> {
        let sql = format!(
            "SELECT trials.id, uid, created, state, object, note, tags, unsure, reviewed, deleted IS NOT NULL,
             samples, about, guesses.model, guesses.pmf, checksum(uid, about) IS board_trials.checksum AND {}
             FROM trials JOIN board_trials ON board_trials.trial = trials.id
             LEFT JOIN guesses ON guesses.trial = trials.id WHERE rig = ?1 ORDER BY trials.id",
            is_intact()
        );
        self.store.all(&sql, [TrialSource::Recorded.name()], of_row)
    }
}
