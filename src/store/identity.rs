//! Identity of grasps: one grasp is one trial, recorded alone or in several collections.
//!
//! A grasp of this version has the identity of its header ([`TrialHeader::identity`]). Trials of older versions do not
//! record the object's files and the physics; their identity is a hash of their frames, so that copies among them are
//! found.

use palpate_sim::fingerprint;
use palpate_tactile::trial::{TrialHeader, TrialId};
use rusqlite::{Connection, OptionalExtension, Transaction, params};

/// Outcome of storing a grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stored {
    /// It has this number now.
    New(TrialId),
    /// This trial holds the same grasp; nothing was stored.
    Known(TrialId),
    /// The same, and it moved from the demo log to the store.
    Kept(TrialId),
}

impl Stored {
    /// Number of the trial that holds the grasp.
    pub fn id(self) -> TrialId {
        match self {
            Self::New(id) | Self::Known(id) | Self::Kept(id) => id,
        }
    }

    /// True where it was stored.
    pub fn is_new(self) -> bool {
        matches!(self, Self::New(_))
    }
}

/// Oldest complete trial with this identity that is not deleted, other than `but`.
pub(super) fn known(connection: &Connection, header: &TrialHeader, but: TrialId) -> rusqlite::Result<Option<TrialId>> {
    let Some(identity) = header.identity() else { return Ok(None) };
    let sql = "SELECT min(id) FROM trials
        WHERE identity = ?1 AND state = 'complete' AND deleted IS NULL AND id <> ?2";
    connection.query_row(sql, params![identity, but], |row| row.get(0)).optional().map(Option::flatten)
}

/// Adds a trial to a collection other than its own.
pub(super) fn add_to(transaction: &Transaction<'_>, id: TrialId, collection: Option<&str>) -> rusqlite::Result<()> {
    let sql = "INSERT OR IGNORE INTO memberships (trial, collection)
        SELECT id, ?2 FROM trials WHERE id = ?1 AND ?2 IS NOT NULL AND collection IS NOT ?2";
    transaction.execute(sql, params![id, collection]).map(drop)
}

/// Gives simulated trials of older versions an identity.
pub(super) fn identify_old(transaction: &Transaction<'_>) -> rusqlite::Result<()> {
    let sql = "SELECT id, object, seed FROM trials WHERE rig = 'sim' AND state = 'complete' AND identity IS NULL";
    let trials: Vec<(TrialId, String, i64)> = transaction
        .prepare(sql)?
        .query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?
        .collect::<Result<_, _>>()?;
    let mut chunks = transaction.prepare(
        "SELECT length(frames), checksum, CASE WHEN checksum IS NULL THEN frames END FROM chunks
         WHERE trial = ?1 ORDER BY number",
    )?;
    let mut set = transaction.prepare("UPDATE trials SET identity = ?2 WHERE id = ?1")?;
    for (id, object, seed) in trials {
        let summed = chunks.query_map([id], |row| {
            let (length, stored, frames) =
                (row.get::<_, i64>(0)?, row.get::<_, Option<u32>>(1)?, row.get::<_, Option<Vec<u8>>>(2)?);
            let sum = frames.map_or_else(|| stored.unwrap_or_default(), |frames| super::checksum::of_bytes([&*frames]));
            Ok([length.to_le_bytes(), u64::from(sum).to_le_bytes()])
        })?;
        let sums: Vec<[[u8; 8]; 2]> = summed.collect::<Result<_, _>>()?;
        // Without frames nothing tells one trial from another.
        if !sums.is_empty() {
            let seed = seed.to_le_bytes();
            let parts =
                [object.as_bytes(), &seed].into_iter().chain(sums.as_flattened().iter().map(<[u8; 8]>::as_slice));
            set.execute(params![id, format!("frames-{:016x}", fingerprint(parts))])?;
        }
    }
    Ok(())
}
