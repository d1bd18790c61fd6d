//! Trials of a real gripper in the store: the bytes that its board sent, and the readings parsed from them.

use super::checksum::{checksum, is_intact};
use super::reading_blob::{decode_readings, encode_readings};
use super::store::{Store, insert_recorded, json, set_complete};
use super::store_error::{StoreError, fault};
use crate::labels::{FlagRemark, Sparkline};
use palpate_sim::frame::Quality;
use palpate_tactile::board::{Gap, Reading};
use palpate_tactile::capture::{CAPTURE_MAGIC, Captured, read_record};
use palpate_tactile::trial::{BoardCourse, BoardLog, TrialHeader, TrialId};
use rusqlite::{OptionalExtension, Row, params};
use serde::{Deserialize, Serialize};

/// Description of a trial of a real gripper, besides its readings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct BoardInfo {
    /// Name of the port.
    pub port: String,
    /// Board and course.
    #[serde(flatten)]
    pub course: BoardCourse,
    /// Time from the beginning to the last reading (s); zero in trials of early versions.
    pub seconds: f64,
    /// Flags, found when the recording ended.
    pub flags: Vec<FlagRemark>,
    /// Small plot, made when the recording ended.
    pub sparkline: Sparkline,
}

/// Data of a second or less.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoardChunk {
    /// Readings.
    pub readings: Vec<Reading>,
    /// Gaps.
    pub gaps: Vec<Gap>,
    /// Bytes.
    pub bytes: Vec<Captured>,
}

impl BoardChunk {
    /// True without any data.
    pub fn is_empty(&self) -> bool {
        self.readings.is_empty() && self.gaps.is_empty() && self.bytes.is_empty()
    }
}

impl Store {
    /// Begins a trial of a real gripper; chunks follow with [`Store::append_board`].
    pub fn begin_board(&mut self, header: &TrialHeader, about: &BoardInfo) -> Result<TrialId, StoreError> {
        let path = self.path().to_owned();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let transaction = self.write()?;
        let id = insert_recorded(&transaction, header).map_err(fault)?;
        let sql = "INSERT INTO board_trials (trial, about) VALUES (?1, ?2)";
        transaction.execute(sql, params![id, json(about)]).map_err(fault)?;
        transaction.commit().map_err(fault)?;
        self.calibrations().note_parts(id)?;
        Ok(id)
    }

    /// Adds data to a trial that is being recorded; once this returns, a kill cannot lose them.
    pub fn append_board(&mut self, id: TrialId, about: &BoardInfo, chunk: &BoardChunk) -> Result<(), StoreError> {
        if chunk.is_empty() {
            return Ok(());
        }
        let mut bytes = Vec::new();
        for piece in &chunk.bytes {
            // Writing into memory cannot fail.
            let _infallible = piece.write(&mut bytes);
        }
        let (readings, gaps) = (encode_readings(&chunk.readings), json(&chunk.gaps));
        let (readings_sum, bytes_sum) = (checksum(&[&readings, gaps.as_bytes()]), checksum(&[&bytes]));
        let path = self.path().to_owned();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        let transaction = self.write()?;
        transaction
            .execute(
                "INSERT INTO board_chunks (trial, number, readings, gaps, bytes, checksum, bytes_checksum) VALUES (?1,
                     (SELECT coalesce(max(number), -1) + 1 FROM board_chunks WHERE trial = ?1), ?2, ?3, ?4, ?5, ?6)",
                params![id, readings, gaps, bytes, readings_sum, bytes_sum],
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

    /// Data of a trial of a real gripper, without its header; none for a trial of another kind.
    pub fn board_log(&self, id: TrialId) -> Result<Option<BoardLog>, StoreError> {
        let Some(about) = self.board_info(id)? else { return Ok(None) };
        let sql =
            "SELECT number, readings, CAST(gaps AS BLOB), checksum FROM board_chunks WHERE trial = ?1 ORDER BY number";
        let columns = |row: &Row<'_>| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?));
        type Columns = (i64, Vec<u8>, Vec<u8>, Option<u32>);
        let chunks: Vec<Columns> = self
            .connection
            .prepare(sql)
            .and_then(|mut statement| statement.query_map([id], columns)?.collect())
            .map_err(|e| fault(self.path(), &e))?;
        let mut log = BoardLog { course: about.course, ..BoardLog::default() };
        for (chunk, readings, gaps, stored) in chunks {
            if !is_intact(stored, &[&readings, &gaps]) {
                return Err(StoreError::Checksum { id, what: "readings", chunk });
            }
            let damaged = |what: &str| StoreError::BadInfo { id, cause: format!("{what} of its part {chunk}") };
            log.readings.extend(decode_readings(&readings).ok_or_else(|| damaged("the readings"))?);
            log.gaps.extend(serde_json::from_slice::<Vec<Gap>>(&gaps).map_err(|_json| damaged("the gaps"))?);
        }
        // Earlier readings have no count for channels that appeared later.
        for reading in &mut log.readings {
            reading.counts.resize(log.course.board.channels.len(), None);
        }
        Ok(Some(log))
    }

    /// Description of a trial of a real gripper; none for a trial of another kind.
    pub fn board_info(&self, id: TrialId) -> Result<Option<BoardInfo>, StoreError> {
        let sql = "SELECT about FROM board_trials JOIN trials ON trials.id = trial
                   WHERE trial = ?1 AND deleted IS NULL";
        let about: Option<String> =
            self.connection.query_row(sql, [id], |row| row.get(0)).optional().map_err(|e| fault(self.path(), &e))?;
        let bad = |e: serde_json::Error| StoreError::BadInfo { id, cause: e.to_string() };
        about.map(|about| serde_json::from_str(&about).map_err(bad)).transpose()
    }

    /// Bytes of a trial as received, as a capture file; none for a trial of another kind.
    pub fn board_bytes(&self, id: TrialId) -> Result<Option<Vec<u8>>, StoreError> {
        if self.board_info(id)?.is_none() {
            return Ok(None);
        }
        let sql = "SELECT number, bytes, bytes_checksum FROM board_chunks WHERE trial = ?1 ORDER BY number";
        let chunks: Vec<(i64, Vec<u8>, Option<u32>)> = self
            .connection
            .prepare(sql)
            .and_then(|mut s| s.query_map([id], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?.collect())
            .map_err(|e| fault(self.path(), &e))?;
        let mut file = CAPTURE_MAGIC.to_vec();
        for (chunk, bytes, stored) in chunks {
            if !is_intact(stored, &[&bytes]) {
                return Err(StoreError::Checksum { id, what: "bytes", chunk });
            }
            file.extend(bytes);
        }
        // A kill leaves no part of a record: records must be whole.
        let mut records = &file[CAPTURE_MAGIC.len()..];
        let whole =
            std::iter::from_fn(|| read_record(&mut records).transpose()).try_for_each(|record| record.map(drop));
        match whole {
            Ok(()) => Ok(Some(file)),
            Err(error) => Err(StoreError::BadInfo { id, cause: error.to_string() }),
        }
    }
}
