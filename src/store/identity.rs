//! Identity of grasps: one grasp is one trial, recorded alone or in several collections.
//!
//! A grasp has the identity of its header ([`TrialHeader::identity`]). Early trials do not record the object's files and the
//! physics; their identity is a hash of their frames.

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

/// Oldest complete trial with this identity that is not deleted.
pub(super) fn known(connection: &Connection, header: &TrialHeader) -> rusqlite::Result<Option<TrialId>> {
    let Some(identity) = header.identity() else { return Ok(None) };
    let sql = "SELECT min(id) FROM trials WHERE identity = ?1 AND state = 'complete' AND deleted IS NULL";
    connection.query_row(sql, [identity], |row| row.get(0)).optional().map(Option::flatten)
}

/// Adds a trial to a collection other than its own.
pub(super) fn add_to(transaction: &Transaction<'_>, id: TrialId, collection: Option<&str>) -> rusqlite::Result<()> {
    let sql = "INSERT OR IGNORE INTO memberships (trial, collection)
        SELECT id, ?2 FROM trials WHERE id = ?1 AND ?2 IS NOT NULL AND collection IS NOT ?2";
    transaction.execute(sql, params![id, collection]).map(drop)
}
