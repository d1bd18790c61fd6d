//! Chunks of a trial, read back in their order and checked: none is damaged, missing, or of another trial.

use super::checksum::{Chunks, FRAMES};
use super::frame_blob::{BlobError, decode_frames};
use super::store::Store;
use super::store_error::StoreError;
use palpate_sim::frame::Frame;
use palpate_tactile::trial::TrialId;
use rusqlite::Row;

impl Store {
    /// Frames of a simulated trial.
    pub(super) fn load_frames(&self, id: TrialId) -> Result<Vec<Frame>, StoreError> {
        let (chunks, samples) = self.read_chunks(id, &FRAMES, |row| row.get::<_, Vec<u8>>(0))?;
        let damaged = |chunk: i64, cause: &BlobError| StoreError::Damaged {
            id,
            what: format!("trial {id} is damaged in its part {chunk}: {cause}"),
        };
        let mut frames = Vec::new();
        for (chunk, bytes) in chunks {
            frames.extend(decode_frames(&bytes).map_err(|cause| damaged(chunk, &cause))?);
        }
        all_there(id, FRAMES.what, frames.len(), samples)?;
        Ok(frames)
    }

    /// All chunks of a trial with their numbers, and the number of samples that they should hold.
    pub(super) fn read_chunks<T>(
        &self,
        id: TrialId,
        kind: &Chunks,
        read: impl Fn(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<(Vec<(i64, T)>, i64), StoreError> {
        let fault = |e: rusqlite::Error| self.fault(&e);
        let Chunks { table, columns, what, .. } = kind;
        // One statement, so that a chunk that is being added is either counted and read or neither.
        let sql = format!(
            "SELECT {}, number, {}, trials.chunks, samples FROM trials LEFT JOIN {table} ON trial = id
             WHERE id = ?1 ORDER BY number",
            columns.join(", "),
            kind.intact("trials")
        );
        let [number, intact, count, samples] = [0, 1, 2, 3].map(|after| columns.len() + after);
        let mut statement = self.connection.prepare_cached(&sql).map_err(fault)?;
        let mut rows = statement.query([id]).map_err(fault)?;
        let (mut chunks, mut wanted) = (Vec::new(), (0, 0));
        while let Some(row) = rows.next().map_err(fault)? {
            wanted = (row.get(count).map_err(fault)?, row.get(samples).map_err(fault)?);
            let Some(chunk) = row.get(number).map_err(fault)? else { break };
            if !row.get::<_, bool>(intact).map_err(fault)? {
                return Err(StoreError::checksum(id, what, chunk));
            }
            chunks.push((chunk, read(row).map_err(fault)?));
        }
        all_there(id, "parts", chunks.len(), wanted.0)?;
        Ok((chunks, wanted.1))
    }
}

/// Refuses a trial that has lost something.
pub(super) fn all_there(id: TrialId, what: &str, found: usize, wanted: i64) -> Result<(), StoreError> {
    if i64::try_from(found) == Ok(wanted) {
        return Ok(());
    }
    Err(StoreError::Damaged { id, what: format!("trial {id} is damaged: {found} of its {wanted} {what} are left") })
}
