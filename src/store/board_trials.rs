//! Trials of a real gripper in the store: what its board sent, byte by byte, and the readings that were made of it.
//!
//! ```text
//! board_trials  one row to a trial: what is known of its board and of how well it kept time
//! board_chunks  its readings, gaps and bytes, a second at most to a chunk, only ever added
//! ```

use super::board_blob::{decode_readings, encode_readings};
use super::store::{Store, insert_info, json, set_complete};
use super::store_error::{StoreError, fault};
use crate::labels::{FlagRemark, Sparkline};
use palpate_sim::frame::Quality;
use palpate_tactile::board::Detected;
use palpate_tactile::board::{Board, Gap, Reading};
use palpate_tactile::cadence::Cadence;
use palpate_tactile::capture::{CAPTURE_MAGIC, Captured, read_record};
use palpate_tactile::trial::TrialId;
use palpate_tactile::trial::{PhaseMark, TrialInfo};
use rusqlite::{OptionalExtension, params};
use serde::{Deserialize, Serialize};

/// The tables of trials of a real gripper.
pub(super) const BOARD_TABLES: &str = "
    CREATE TABLE board_trials (
        trial INTEGER PRIMARY KEY REFERENCES trials (id) ON DELETE CASCADE,
        about TEXT NOT NULL
    );
    CREATE TABLE board_chunks (
        trial INTEGER NOT NULL REFERENCES trials (id) ON DELETE CASCADE,
        number INTEGER NOT NULL,
        readings BLOB NOT NULL,
        gaps TEXT NOT NULL,
        bytes BLOB NOT NULL,
        PRIMARY KEY (trial, number)
    ) WITHOUT ROWID;
";

/// Copies the trials of another store; part of merging.
pub(super) const COPY_BOARD_TRIALS: &str = "
    INSERT INTO main.board_trials (trial, about)
    SELECT ours.id, board.about FROM temp.incoming
    JOIN other.trials AS theirs ON theirs.id = incoming.id
    JOIN main.trials AS ours ON ours.uid = theirs.uid
    JOIN other.board_trials AS board ON board.trial = theirs.id;
    INSERT INTO main.board_chunks (trial, number, readings, gaps, bytes)
    SELECT ours.id, chunks.number, chunks.readings, chunks.gaps, chunks.bytes FROM temp.incoming
    JOIN other.trials AS theirs ON theirs.id = incoming.id
    JOIN main.trials AS ours ON ours.uid = theirs.uid
    JOIN other.board_chunks AS chunks ON chunks.trial = theirs.id;
";

/// The rig of trials that were recorded from a board.
pub const BOARD_RIG: &str = "serial";

/// What is known of a trial of a real gripper besides its readings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct BoardInfo {
    /// What was listened to, in words.
    pub port: String,
    /// The board.
    pub board: Board,
    /// How its lines were read.
    pub detected: Option<Detected>,
    /// When the trial began, on the clock of the readings (s).
    pub began_s: f64,
    /// How well the board kept time during the trial; all zero while it is being recorded.
    pub cadence: Cadence,
    /// How often the connection was taken up again during the trial.
    pub reconnects: u32,
    /// The phases of the grasp, where they are known.
    pub phases: Vec<PhaseMark>,
    /// From its beginning to its last reading (s); zero for trials from before it was kept.
    pub seconds: f64,
    /// What is wrong with it, whatever it is of; found when it ended.
    pub flags: Vec<FlagRemark>,
    /// A small picture of it, made when it ended.
    pub sparkline: Sparkline,
}

/// A trial of a real gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardTrial {
    /// What is known of it.
    pub about: BoardInfo,
    /// Its readings, in order.
    pub readings: Vec<Reading>,
    /// Where readings are missing.
    pub gaps: Vec<Gap>,
}

/// What came within a second or less.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoardChunk {
    /// Readings.
    pub readings: Vec<Reading>,
    /// Gaps.
    pub gaps: Vec<Gap>,
    /// The bytes.
    pub bytes: Vec<Captured>,
}

impl BoardChunk {
    /// True where nothing came.
    pub fn is_empty(&self) -> bool {
        self.readings.is_empty() && self.gaps.is_empty() && self.bytes.is_empty()
    }
}

impl Store {
    /// Begins a trial of a real gripper; chunks follow with [`Store::append_board`].
    pub fn begin_board(&mut self, info: &TrialInfo, about: &BoardInfo) -> Result<TrialId, StoreError> {
        let path = self.path().to_owned();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let transaction = self.write()?;
        let id = insert_info(&transaction, info).map_err(fault)?;
        let sql = "INSERT INTO board_trials (trial, about) VALUES (?1, ?2)";
        transaction.execute(sql, params![id, json(about)]).map_err(fault)?;
        transaction.commit().map_err(fault)?;
        self.note_parts(id)?;
        Ok(id)
    }

    /// Adds what came to a trial that is being recorded; once this returns, a kill cannot lose it.
    pub fn append_board(&mut self, id: TrialId, about: &BoardInfo, chunk: &BoardChunk) -> Result<(), StoreError> {
        if chunk.is_empty() {
            return Ok(());
        }
        let mut bytes = Vec::new();
        for piece in &chunk.bytes {
            // Writing into memory cannot fail.
            let _infallible = piece.write(&mut bytes);
        }
        let path = self.path().to_owned();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let transaction = self.write()?;
        transaction
            .execute(
                "INSERT INTO board_chunks (trial, number, readings, gaps, bytes) VALUES (?1,
                     (SELECT coalesce(max(number), -1) + 1 FROM board_chunks WHERE trial = ?1), ?2, ?3, ?4)",
                params![id, encode_readings(&chunk.readings), json(&chunk.gaps), bytes],
            )
            .map_err(fault)?;
        let sql = "UPDATE trials SET samples = samples + ?2 WHERE id = ?1";
        transaction.execute(sql, params![id, chunk.readings.len() as i64]).map_err(fault)?;
        let sql = "UPDATE board_trials SET about = ?2 WHERE trial = ?1 AND about <> ?2";
        transaction.execute(sql, params![id, json(about)]).map_err(fault)?;
        transaction.commit().map_err(fault)
    }

    /// Ends a trial of a real gripper.
    pub fn finish_board(&mut self, id: TrialId, about: &BoardInfo, warnings: &[String]) -> Result<(), StoreError> {
        let path = self.path().to_owned();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let transaction = self.write()?;
        let sql = "UPDATE board_trials SET about = ?2 WHERE trial = ?1";
        transaction.execute(sql, params![id, json(about)]).map_err(fault)?;
        set_complete(&transaction, id, &Quality::default(), warnings).map_err(fault)?;
        transaction.commit().map_err(fault)
    }

    /// What a board sent during a trial; none for a trial of another kind.
    pub fn board_trial(&self, id: TrialId) -> Result<Option<BoardTrial>, StoreError> {
        let Some(about) = self.board_info(id)? else { return Ok(None) };
        let sql = "SELECT number, readings, gaps FROM board_chunks WHERE trial = ?1 ORDER BY number";
        let chunks: Vec<(i64, Vec<u8>, String)> = self
            .connection
            .prepare(sql)
            .and_then(|mut s| s.query_map([id], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?.collect())
            .map_err(|e| fault(self.path(), &e))?;
        let mut trial = BoardTrial { about, readings: Vec::new(), gaps: Vec::new() };
        for (number, readings, gaps) in chunks {
            let damaged = |what: &str| StoreError::BadInfo { id, cause: format!("{what} of its part {number}") };
            trial.readings.extend(decode_readings(&readings).ok_or_else(|| damaged("the readings"))?);
            trial.gaps.extend(serde_json::from_str::<Vec<Gap>>(&gaps).map_err(|_json| damaged("the gaps"))?);
        }
        // Readings from before a channel was known have no count for it.
        for reading in &mut trial.readings {
            reading.counts.resize(trial.about.board.channels.len(), None);
        }
        Ok(Some(trial))
    }

    /// What is known of the board of a trial; none for a trial of another kind.
    pub fn board_info(&self, id: TrialId) -> Result<Option<BoardInfo>, StoreError> {
        let sql = "SELECT about FROM board_trials JOIN trials ON trials.id = trial
                   WHERE trial = ?1 AND deleted IS NULL";
        let about: Option<String> =
            self.connection.query_row(sql, [id], |row| row.get(0)).optional().map_err(|e| fault(self.path(), &e))?;
        let bad = |e: serde_json::Error| StoreError::BadInfo { id, cause: e.to_string() };
        about.map(|about| serde_json::from_str(&about).map_err(bad)).transpose()
    }

    /// The bytes of a trial as they came, in the form of a captured file; none for a trial of another kind.
    pub fn board_bytes(&self, id: TrialId) -> Result<Option<Vec<u8>>, StoreError> {
        if self.board_info(id)?.is_none() {
            return Ok(None);
        }
        let sql = "SELECT bytes FROM board_chunks WHERE trial = ?1 ORDER BY number";
        let chunks: Vec<Vec<u8>> = self
            .connection
            .prepare(sql)
            .and_then(|mut statement| statement.query_map([id], |row| row.get(0))?.collect())
            .map_err(|e| fault(self.path(), &e))?;
        let file = [CAPTURE_MAGIC.as_slice(), &chunks.concat()].concat();
        // What a kill cut off is not there; what is there must be whole.
        let mut records = &file[CAPTURE_MAGIC.len()..];
        let whole =
            std::iter::from_fn(|| read_record(&mut records).transpose()).try_for_each(|record| record.map(drop));
        match whole {
            Ok(()) => Ok(Some(file)),
            Err(error) => Err(StoreError::BadInfo { id, cause: error.to_string() }),
        }
    }
}
