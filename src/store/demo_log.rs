//! The demo log: the last grasps of the window's simulation that were not recorded into the store.
//!
//! It is a part of the same file, so that its trials are listed, opened and exported like all others. Data sets leave
//! them out, and each new one pushes out the oldest. A trial leaves it for the store when it is kept, changed by a
//! person, recorded again or collected.

use crate::labels::UnknownWord;
use palpate_tactile::trial::TrialId;
use rusqlite::{Connection, OptionalExtension, Transaction, params};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// Most trials in the demo log.
pub const DEMO_LOG_TRIALS: u32 = 1000;

/// Place of a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrialPlace {
    /// The store: it stays until it is deleted.
    #[default]
    Store,
    /// The demo log: newer grasps push it out.
    DemoLog,
}

impl TrialPlace {
    /// All places.
    pub const ALL: [Self; 2] = [Self::Store, Self::DemoLog];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Store => "store",
            Self::DemoLog => "demo-log",
        }
    }

    /// Name on screen.
    pub fn title(self) -> &'static str {
        match self {
            Self::Store => "store",
            Self::DemoLog => "demo log",
        }
    }

    /// By the column `demo`.
    pub(super) fn of_column(demo: bool) -> Self {
        if demo { Self::DemoLog } else { Self::Store }
    }
}

impl FromStr for TrialPlace {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        UnknownWord::choose(text, "place", Self::ALL.map(|place| (place.name(), place)))
    }
}

/// Place of a trial; none where there is no such trial.
pub(super) fn place_of(connection: &Connection, id: TrialId) -> rusqlite::Result<Option<TrialPlace>> {
    let demo = connection.prepare_cached("SELECT demo FROM trials WHERE id = ?1")?.query_row([id], |row| row.get(0));
    Ok(demo.optional()?.map(TrialPlace::of_column))
}

/// Moves a trial of the demo log to the store; false where it was not in the log.
pub(super) fn keep(transaction: &Transaction<'_>, id: TrialId) -> rusqlite::Result<bool> {
    Ok(transaction.execute("UPDATE trials SET demo = 0 WHERE id = ?1 AND demo = 1", [id])? == 1)
}

/// Puts a new trial into the demo log, and pushes out the oldest beyond [`DEMO_LOG_TRIALS`].
pub(super) fn log(transaction: &Transaction<'_>, id: TrialId) -> rusqlite::Result<()> {
    transaction.execute("UPDATE trials SET demo = 1 WHERE id = ?1", [id])?;
    // The index of the log ends in the number of the trial, and all other tables begin theirs with it.
    let sql = "DELETE FROM trials WHERE demo = 1 AND id <=
        (SELECT id FROM trials WHERE demo = 1 ORDER BY id DESC LIMIT 1 OFFSET ?1)";
    transaction.prepare_cached(sql)?.execute(params![DEMO_LOG_TRIALS]).map(drop)
}
