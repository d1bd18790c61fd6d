//! Trials of a real gripper in the store: the bytes that its board sent, and the readings parsed from them.

use super::checksum::{BYTES, READINGS};
use super::chunks::all_there;
use super::reading_blob::{decode_readings, encode_readings};
use super::store::{Store, count_chunk, insert_recorded, json, set_complete};
use super::store_error::{StoreError, row_fault};
use crate::labels::{FlagRemark, Sparkline};
use palpate_sim::frame::Quality;
use palpate_tactile::board::{Gap, Reading};
use palpate_tactile::capture::{CAPTURE_MAGIC, Captured, read_record};
use palpate_tactile::trial::{BoardCourse, BoardLog, TrialHeader, TrialId};
use rusqlite::{OptionalExtension, Row, Transaction, params};
use serde::{Deserialize, Serialize};

/// Description of a trial of a real gripper, besides its readings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct BoardInfo {
    /// Name of the port.
    pub port: String,
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
    pub readings: Vec<Reading>,
    pub gaps: Vec<Gap>,
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
        let id = self.in_transaction(|transaction| {
            let id = insert_recorded(transaction, header)?;
            set_about(transaction, id, about).map(|()| id)
        })?;
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
        let sql = "WITH new (uid, number) AS (SELECT uid, chunks FROM trials WHERE id = ?1)
            INSERT INTO board_chunks (trial, number, readings, gaps, bytes, checksum, bytes_checksum)
            VALUES (?1, (SELECT number FROM new), ?2, ?3, ?4, (SELECT checksum(uid, number, ?2, ?3) FROM new),
                (SELECT checksum(uid, number, ?4) FROM new))";
        self.in_transaction(|transaction| {
            transaction.execute(sql, params![id, readings, gaps, bytes])?;
            count_chunk(transaction, id, chunk.readings.len())?;
            set_about(transaction, id, about)
        })
    }

    /// Ends a trial of a real gripper.
    pub fn finish_board(&mut self, id: TrialId, about: &BoardInfo, warnings: &[String]) -> Result<(), StoreError> {
        self.in_transaction(|transaction| {
            set_about(transaction, id, about)?;
            set_complete(transaction, id, &Quality::default(), warnings)
        })
    }

    /// Data of a trial of a real gripper, without its header; none for a trial of another kind.
    pub fn board_log(&self, id: TrialId) -> Result<Option<BoardLog>, StoreError> {
        let Some(about) = self.board_info(id)? else { return Ok(None) };
        let (chunks, samples) = self
            .read_chunks(id, &READINGS, |row| Ok((row.get::<_, Vec<u8>>(0)?, row.get_ref(1)?.as_bytes()?.to_vec())))?;
        let mut log = BoardLog { course: about.course, ..BoardLog::default() };
        for (chunk, (readings, gaps)) in chunks {
            let damaged = |what: &str| StoreError::bad_info(id, format!("{what} of its part {chunk}"));
            log.readings.extend(decode_readings(&readings).ok_or_else(|| damaged("the readings"))?);
            log.gaps.extend(serde_json::from_slice::<Vec<Gap>>(&gaps).map_err(|_json| damaged("the gaps"))?);
        }
        all_there(id, READINGS.what, log.readings.len(), samples)?;
        // Earlier readings have no count for channels that appeared later.
        for reading in &mut log.readings {
            reading.counts.resize(log.course.board.channels.len(), None);
        }
        Ok(Some(log))
    }

    /// Description of a trial of a real gripper; none for a trial of another kind.
    pub fn board_info(&self, id: TrialId) -> Result<Option<BoardInfo>, StoreError> {
        let sql = "SELECT about, checksum(uid, about) IS board_trials.checksum FROM board_trials
                   JOIN trials ON trials.id = trial WHERE trial = ?1 AND deleted IS NULL";
        let columns = |row: &Row<'_>| Ok((row.get::<_, String>(0)?, row.get::<_, bool>(1)?));
        let found = self.connection.query_row(sql, [id], columns).optional();
        let Some((about, intact)) = found.map_err(|e| row_fault(self.path(), id, &e))? else { return Ok(None) };
        let about = serde_json::from_str(&about).map_err(|e| StoreError::bad_info(id, e))?;
        if intact { Ok(Some(about)) } else { Err(StoreError::altered(id)) }
    }

    /// Bytes of a trial as received, as a capture file; none for a trial of another kind.
    pub fn board_bytes(&self, id: TrialId) -> Result<Option<Vec<u8>>, StoreError> {
        if self.board_info(id)?.is_none() {
            return Ok(None);
        }
        let (chunks, _) = self.read_chunks(id, &BYTES, |row| row.get::<_, Vec<u8>>(0))?;
        let mut file = CAPTURE_MAGIC.to_vec();
        file.extend(chunks.into_iter().flat_map(|(_, bytes)| bytes));
        // A kill leaves no part of a record: records must be whole.
        let mut records = &file[CAPTURE_MAGIC.len()..];
        let whole =
            std::iter::from_fn(|| read_record(&mut records).transpose()).try_for_each(|record| record.map(drop));
        match whole {
            Ok(()) => Ok(Some(file)),
            Err(error) => Err(StoreError::bad_info(id, error)),
        }
    }
}

/// Stores the description of a trial of a real gripper.
fn set_about(transaction: &Transaction<'_>, id: TrialId, about: &BoardInfo) -> rusqlite::Result<()> {
    let sql =
        "INSERT INTO board_trials (trial, about, checksum) SELECT id, ?2, checksum(uid, ?2) FROM trials WHERE id = ?1
               ON CONFLICT (trial) DO UPDATE SET about = excluded.about, checksum = excluded.checksum";
    transaction.prepare_cached(sql)?.execute(params![id, json(about)]).map(drop)
}
