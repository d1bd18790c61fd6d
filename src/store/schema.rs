//! Tables of the store. Every table stands here.
//!
//! ```text
//! trials       one row per trial; `state` is 'recording' until its last chunk is stored
//! chunks       frames of a simulated trial, about a second each; see `frame_blob`
//! readings     channels of an imported trial
//! board_trials one row per trial of a real gripper: its board, cadence and flags
//! board_chunks readings, gaps and bytes of such a trial, at most a second each
//! calibrations one row per calibration of a part, never changed except to withdraw it
//! mountings    which part was mounted in which place, and since when
//! parts        which parts a trial was recorded with
//! tares        zeros of parts, each taken through one calibration
//! guesses      prediction of a model for a trial, made when its label was given
//! label_plan   how many trials of each object are wanted: one row, or none for the default plan
//! memberships  further collections of a trial, whose grasp they share
//! journal      every change of a label, note, tag, deletion, place or plan; only ever added to
//! ```
//!
//! Rows of trials and chunks carry a CRC-32 in a column beside them; see `checksum`.

use super::store_error::{StoreError, fault};
use rusqlite::Transaction;
use std::path::Path;

/// "Palp" in ASCII, in the header of the SQLite file.
pub(super) const APPLICATION_ID: i32 = 0x5061_6c70;

/// Number of the tables below in the SQLite file, the first that is released. Development counted up to it; older stores are
/// refused, as are those of newer programs.
pub(super) const SCHEMA_VERSION: i32 = 15;

/// Makes the tables.
const TABLES: &str = "
    CREATE TABLE trials (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        uid TEXT NOT NULL UNIQUE DEFAULT (lower(hex(randomblob(16)))),
        created TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        state TEXT NOT NULL DEFAULT 'recording' CHECK (state IN ('recording', 'complete')),
        rig TEXT NOT NULL,
        object TEXT NOT NULL,
        seed INTEGER NOT NULL,
        scene TEXT NOT NULL,
        world_from_gripper TEXT NOT NULL,
        quality TEXT NOT NULL,
        warnings TEXT NOT NULL,
        version TEXT NOT NULL,
        samples INTEGER NOT NULL DEFAULT 0,
        deleted TEXT,
        collection TEXT,
        size TEXT,
        shape TEXT,
        plan TEXT NOT NULL DEFAULT '[]',
        note TEXT NOT NULL DEFAULT '',
        tags TEXT NOT NULL DEFAULT '[]',
        unsure INTEGER NOT NULL DEFAULT 0,
        reviewed INTEGER NOT NULL DEFAULT 0,
        earlier TEXT,  -- JSON: the grasps before it, as the recogniser judged them
        phases TEXT NOT NULL DEFAULT 'null',  -- JSON: as a person corrected them
        origin TEXT,  -- JSON
        identity TEXT,  -- equal for equal grasps
        demo INTEGER NOT NULL DEFAULT 0,  -- 1 for a trial of the demo log; see the module `demo_log`
        chunks INTEGER NOT NULL DEFAULT 0,
        checksum INTEGER
    );
    CREATE INDEX trials_by_object ON trials (object);
    CREATE UNIQUE INDEX trials_by_collection ON trials (collection, object, seed) WHERE collection IS NOT NULL;
    CREATE INDEX trials_by_identity ON trials (identity) WHERE identity IS NOT NULL;
    CREATE INDEX trials_of_demo_log ON trials (demo) WHERE demo = 1;
    CREATE TABLE chunks (
        trial INTEGER NOT NULL REFERENCES trials (id) ON DELETE CASCADE,
        number INTEGER NOT NULL,
        frames BLOB NOT NULL,
        checksum INTEGER,
        PRIMARY KEY (trial, number)
    ) WITHOUT ROWID;
    CREATE TABLE readings (
        trial INTEGER PRIMARY KEY REFERENCES trials (id) ON DELETE CASCADE,
        channels TEXT NOT NULL,
        samples BLOB NOT NULL,
        checksum INTEGER
    );
    CREATE TABLE board_trials (
        trial INTEGER PRIMARY KEY REFERENCES trials (id) ON DELETE CASCADE,
        about TEXT NOT NULL,
        checksum INTEGER
    );
    CREATE TABLE board_chunks (
        trial INTEGER NOT NULL REFERENCES trials (id) ON DELETE CASCADE,
        number INTEGER NOT NULL,
        readings BLOB NOT NULL,
        gaps TEXT NOT NULL,
        bytes BLOB NOT NULL,
        checksum INTEGER,
        bytes_checksum INTEGER,
        PRIMARY KEY (trial, number)
    ) WITHOUT ROWID;
    -- They count chunks without reading their blobs.
    CREATE INDEX chunks_by_trial ON chunks (trial, number);
    CREATE INDEX board_chunks_by_trial ON board_chunks (trial, number);
    CREATE TABLE calibrations (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        uid TEXT NOT NULL UNIQUE DEFAULT (lower(hex(randomblob(16)))),
        part TEXT NOT NULL,
        version INTEGER NOT NULL,
        created TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        withdrawn TEXT,
        record TEXT NOT NULL
    );
    CREATE INDEX calibrations_by_part ON calibrations (part);
    CREATE TABLE mountings (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        since TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        sensor TEXT NOT NULL,
        part TEXT NOT NULL
    );
    CREATE TABLE parts (
        trial INTEGER NOT NULL REFERENCES trials (id) ON DELETE CASCADE,
        sensor TEXT NOT NULL,
        part TEXT NOT NULL,
        PRIMARY KEY (trial, sensor)
    ) WITHOUT ROWID;
    CREATE TABLE tares (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        uid TEXT NOT NULL UNIQUE DEFAULT (lower(hex(randomblob(16)))),
        taken TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        part TEXT NOT NULL,
        version INTEGER NOT NULL,
        calibration TEXT NOT NULL,  -- a uid
        zero REAL NOT NULL  -- an angle (rad) or a conductance (S)
    );
    CREATE INDEX tares_by_part ON tares (part, calibration);
    CREATE TRIGGER tares_are_not_altered BEFORE UPDATE ON tares
    BEGIN SELECT raise(ABORT, 'tares are only added to'); END;
    CREATE TRIGGER tares_are_not_shortened BEFORE DELETE ON tares
    BEGIN SELECT raise(ABORT, 'tares are only added to'); END;
    CREATE TABLE guesses (
        trial INTEGER PRIMARY KEY REFERENCES trials (id) ON DELETE CASCADE,
        model TEXT NOT NULL,
        pmf TEXT NOT NULL
    );
    CREATE TABLE label_plan (
        only INTEGER PRIMARY KEY CHECK (only = 1),
        plan TEXT NOT NULL
    );
    CREATE TABLE memberships (
        trial INTEGER NOT NULL REFERENCES trials (id) ON DELETE CASCADE,
        collection TEXT NOT NULL,
        PRIMARY KEY (trial, collection)
    ) WITHOUT ROWID;
    CREATE INDEX memberships_by_collection ON memberships (collection);
    CREATE TABLE journal (
        number INTEGER PRIMARY KEY AUTOINCREMENT,
        uid TEXT NOT NULL UNIQUE DEFAULT (lower(hex(randomblob(16)))),
        at TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        trial TEXT,  -- a uid, which merging keeps
        undoes TEXT,  -- a uid
        undoable INTEGER NOT NULL,
        merged INTEGER NOT NULL DEFAULT 0,
        entry TEXT NOT NULL,
        batch TEXT  -- names the changes that were made, and are undone, together
    );
    CREATE INDEX journal_by_trial ON journal (trial);
    CREATE TRIGGER journal_is_not_altered BEFORE UPDATE ON journal
    BEGIN SELECT raise(ABORT, 'the journal is only added to'); END;
    CREATE TRIGGER journal_is_not_shortened BEFORE DELETE ON journal
    BEGIN SELECT raise(ABORT, 'the journal is only added to'); END;";

/// Tables whose rows belong to a trial by their column `trial`; merging copies them with it.
pub(super) const TABLES_OF_A_TRIAL: [&str; 7] =
    ["chunks", "readings", "board_trials", "board_chunks", "parts", "guesses", "memberships"];

/// Makes the tables of a new store, inside a transaction that holds the write lock.
pub(super) fn make_tables(transaction: &Transaction<'_>, store: &Path) -> Result<(), StoreError> {
    let make = || {
        if transaction.pragma_query_value(None, "user_version", |row| row.get::<_, i32>(0))? == 0 {
            transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
            transaction.execute_batch(TABLES)?;
            transaction.pragma_update(None, "user_version", SCHEMA_VERSION)?;
        }
        Ok(())
    };
    make().map_err(|e| fault(store, &e))
}
