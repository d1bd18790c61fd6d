//! Tables of the store and their versions. Every table and every change to one stands here.
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

use super::checksum::add_to_old;
use super::identity::identify_old;
use super::new_file::unfinished;
use super::store_error::StoreError;
use rusqlite::{Connection, OpenFlags, Transaction};
use std::path::{Path, PathBuf};

/// "Palp" in ASCII, in the header of the SQLite file.
pub(super) const APPLICATION_ID: i32 = 0x5061_6c70;

/// Version of the tables below. A store from a newer program is refused, an older one is updated.
pub(super) const SCHEMA_VERSION: i32 = MIGRATIONS.len() as i32;

/// Each makes the next version out of the one before; the first makes the tables.
pub(super) const MIGRATIONS: [&str; 15] = [
    "CREATE TABLE trials (
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
        deleted TEXT
     );
     CREATE TABLE chunks (
        trial INTEGER NOT NULL REFERENCES trials (id) ON DELETE CASCADE,
        number INTEGER NOT NULL,
        frames BLOB NOT NULL,
        PRIMARY KEY (trial, number)
     ) WITHOUT ROWID;
     CREATE INDEX trials_by_object ON trials (object);",
    "ALTER TABLE trials ADD COLUMN collection TEXT;
     CREATE UNIQUE INDEX trials_by_collection ON trials (collection, object, seed) WHERE collection IS NOT NULL;",
    "ALTER TABLE trials ADD COLUMN size TEXT;
     ALTER TABLE trials ADD COLUMN shape TEXT;
     CREATE TABLE readings (
        trial INTEGER PRIMARY KEY REFERENCES trials (id) ON DELETE CASCADE,
        channels TEXT NOT NULL,
        samples BLOB NOT NULL
     );",
    "ALTER TABLE trials ADD COLUMN plan TEXT NOT NULL DEFAULT '[]';",
    "CREATE TABLE board_trials (
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
     ) WITHOUT ROWID;",
    "CREATE TABLE calibrations (
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
     ) WITHOUT ROWID;",
    "ALTER TABLE trials ADD COLUMN note TEXT NOT NULL DEFAULT '';
     ALTER TABLE trials ADD COLUMN tags TEXT NOT NULL DEFAULT '[]';
     ALTER TABLE trials ADD COLUMN unsure INTEGER NOT NULL DEFAULT 0;
     ALTER TABLE trials ADD COLUMN reviewed INTEGER NOT NULL DEFAULT 0;
     CREATE TABLE guesses (
        trial INTEGER PRIMARY KEY REFERENCES trials (id) ON DELETE CASCADE,
        model TEXT NOT NULL,
        pmf TEXT NOT NULL
     );
     CREATE TABLE label_plan (
        only INTEGER PRIMARY KEY CHECK (only = 1),
        plan TEXT NOT NULL
     );",
    // `trial` and `undoes` are uids, which merging keeps.
    "CREATE TABLE journal (
        number INTEGER PRIMARY KEY AUTOINCREMENT,
        uid TEXT NOT NULL UNIQUE DEFAULT (lower(hex(randomblob(16)))),
        at TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        trial TEXT,
        undoes TEXT,
        undoable INTEGER NOT NULL,
        writer TEXT NOT NULL,
        merged INTEGER NOT NULL DEFAULT 0,
        entry TEXT NOT NULL
     );
     CREATE INDEX journal_by_trial ON journal (trial);
     CREATE TRIGGER journal_is_not_altered BEFORE UPDATE ON journal
     BEGIN SELECT raise(ABORT, 'the journal is only added to'); END;
     CREATE TRIGGER journal_is_not_shortened BEFORE DELETE ON journal
     BEGIN SELECT raise(ABORT, 'the journal is only added to'); END;",
    // `calibration` is a uid, `zero` an angle (rad) or a conductance (S).
    "CREATE TABLE tares (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        uid TEXT NOT NULL UNIQUE DEFAULT (lower(hex(randomblob(16)))),
        taken TEXT NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
        part TEXT NOT NULL,
        version INTEGER NOT NULL,
        calibration TEXT NOT NULL,
        zero REAL NOT NULL
     );
     CREATE INDEX tares_by_part ON tares (part, calibration);
     CREATE TRIGGER tares_are_not_altered BEFORE UPDATE ON tares
     BEGIN SELECT raise(ABORT, 'tares are only added to'); END;
     CREATE TRIGGER tares_are_not_shortened BEFORE DELETE ON tares
     BEGIN SELECT raise(ABORT, 'tares are only added to'); END;",
    "ALTER TABLE chunks ADD COLUMN checksum INTEGER;
     ALTER TABLE readings ADD COLUMN checksum INTEGER;
     ALTER TABLE board_chunks ADD COLUMN checksum INTEGER;
     ALTER TABLE board_chunks ADD COLUMN bytes_checksum INTEGER;
     ALTER TABLE journal DROP COLUMN writer;",
    // JSON: the grasps before it, as the recogniser judged them; phases as a person corrected them.
    "ALTER TABLE trials ADD COLUMN earlier TEXT;
     ALTER TABLE trials ADD COLUMN phases TEXT NOT NULL DEFAULT 'null';",
    // Names the changes that were made, and are undone, together.
    "ALTER TABLE journal ADD COLUMN batch TEXT;",
    // `origin` is JSON; `identity` is equal for equal grasps. The module `identity` fills it in for older trials.
    "ALTER TABLE trials ADD COLUMN origin TEXT;
     ALTER TABLE trials ADD COLUMN identity TEXT;
     CREATE INDEX trials_by_identity ON trials (identity) WHERE identity IS NOT NULL;
     CREATE TABLE memberships (
        trial INTEGER NOT NULL REFERENCES trials (id) ON DELETE CASCADE,
        collection TEXT NOT NULL,
        PRIMARY KEY (trial, collection)
     ) WITHOUT ROWID;
     CREATE INDEX memberships_by_collection ON memberships (collection);",
    // 1 for a trial of the demo log; see the module `demo_log`.
    "ALTER TABLE trials ADD COLUMN demo INTEGER NOT NULL DEFAULT 0;
     CREATE INDEX trials_of_demo_log ON trials (demo) WHERE demo = 1;",
    // The module `checksum` fills them in for older trials. The indexes count chunks without reading their blobs.
    "CREATE INDEX chunks_by_trial ON chunks (trial, number);
     CREATE INDEX board_chunks_by_trial ON board_chunks (trial, number);
     ALTER TABLE trials ADD COLUMN chunks INTEGER NOT NULL DEFAULT 0;
     ALTER TABLE trials ADD COLUMN checksum INTEGER;
     ALTER TABLE board_trials ADD COLUMN checksum INTEGER;",
];

/// The first version with identities of grasps.
const IDENTITIES: i32 = 13;
/// The first version whose checksums cover rows.
const CHECKSUMS: i32 = 15;

/// Tables whose rows belong to a trial by their column `trial`; merging copies them with it.
pub(super) const TABLES_OF_A_TRIAL: [&str; 7] =
    ["chunks", "readings", "board_trials", "board_chunks", "parts", "guesses", "memberships"];

/// Updates the tables to this program's version, inside a transaction that holds the write lock. Copies the file first
/// where it has tables of an older version, and returns the copy.
pub(super) fn migrate(transaction: &Transaction<'_>, store: &Path) -> Result<Option<PathBuf>, StoreError> {
    let fault = |e: rusqlite::Error| super::store_error::fault(store, &e);
    let version: i32 = transaction.pragma_query_value(None, "user_version", |row| row.get(0)).map_err(fault)?;
    let mut copy = None;
    if version == 0 {
        transaction.pragma_update(None, "application_id", APPLICATION_ID).map_err(fault)?;
    } else if version < SCHEMA_VERSION {
        let path = free_name(store);
        copy_file(store, &path).map_err(|cause| StoreError::NotCopied { path: path.clone(), cause })?;
        copy = Some(path);
    }
    for migration in MIGRATIONS.iter().skip(usize::try_from(version).unwrap_or(0)) {
        transaction.execute_batch(migration).map_err(fault)?;
    }
    if (1..IDENTITIES).contains(&version) {
        identify_old(transaction).map_err(fault)?;
    }
    if (1..CHECKSUMS).contains(&version) {
        add_to_old(transaction).map_err(fault)?;
    }
    if version < SCHEMA_VERSION {
        transaction.pragma_update(None, "user_version", SCHEMA_VERSION).map_err(fault)?;
    }
    Ok(copy)
}

/// `trials.before-v15.sqlite` beside the store, or with a number where such a file exists.
fn free_name(store: &Path) -> PathBuf {
    let name = |suffix: String| store.with_extension(format!("before-v{SCHEMA_VERSION}{suffix}.sqlite"));
    let numbered = (2..).map(|number| name(format!("-{number}")));
    std::iter::once(name(String::new())).chain(numbered).find(|path| !path.exists()).unwrap_or_else(|| store.to_owned())
}

/// Copies the committed content of a store through a connection of its own; the copy appears whole or not at all.
fn copy_file(store: &Path, copy: &Path) -> Result<(), String> {
    let unfinished = unfinished(copy);
    let copied = Connection::open_with_flags(store, OpenFlags::SQLITE_OPEN_READ_ONLY)
        .and_then(|reader| reader.execute("VACUUM INTO ?1", [unfinished.to_string_lossy()]))
        .map_err(|e| super::store_error::plain(&e))
        .and_then(|_| std::fs::rename(&unfinished, copy).map_err(|e| e.to_string()));
    copied.inspect_err(|_| {
        // Nothing to add to the message where the remains cannot be removed either.
        let _gone = std::fs::remove_file(&unfinished);
    })
}

#[cfg(test)]
mod tests {
    use super::super::store::Store;
    use super::*;

    fn old_store(folder: &Path, version: usize) -> Result<PathBuf, rusqlite::Error> {
        let path = folder.join("trials.sqlite");
        let old = Connection::open(&path)?;
        for migration in &MIGRATIONS[..version] {
            old.execute_batch(migration)?;
        }
        old.pragma_update(None, "application_id", APPLICATION_ID)?;
        old.pragma_update(None, "user_version", version as i32)?;
        old.execute_batch(
            "INSERT INTO trials (state, rig, object, seed, scene, world_from_gripper, quality, warnings, version)
             VALUES ('complete', 'sim', 'ball', 3, '', '{\"position\":[0,0,0],\"rotation\":[0,0,0,1]}', '{}', '[]', '0')",
        )?;
        Ok(path)
    }

    fn version_of(path: &Path) -> Result<i32, rusqlite::Error> {
        Connection::open(path)?.pragma_query_value(None, "user_version", |row| row.get(0))
    }

    #[test]
    fn every_older_version_is_copied_and_updated() -> Result<(), Box<dyn std::error::Error>> {
        for version in 1..MIGRATIONS.len() {
            let folder = tempfile::tempdir()?;
            let path = old_store(folder.path(), version)?;
            let store = Store::open(&path)?;
            assert_eq!(store.load(1)?.header.seed, 3);
            let copy = folder.path().join(format!("trials.before-v{SCHEMA_VERSION}.sqlite"));
            assert!(store.warnings()[0].contains(&*copy.to_string_lossy()), "{:?}", store.warnings());
            assert_eq!((version_of(&copy)?, version_of(&path)?), (version as i32, SCHEMA_VERSION));
            let trials: i64 =
                Connection::open(&copy)?.query_row("SELECT count(*) FROM trials", [], |row| row.get(0))?;
            assert_eq!(trials, 1, "the copy is whole");
            let again = Store::open(&path)?;
            assert!(again.warnings().is_empty() && again.list(false)?.len() == 1, "updated only once");
            assert_eq!(
                std::fs::read_dir(folder.path())?
                    .filter_map(Result::ok)
                    .filter(|e| e.path().extension().is_some_and(|x| x == "sqlite"))
                    .count(),
                2
            );
        }
        Ok(())
    }

    #[test]
    fn an_earlier_copy_is_not_overwritten() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = old_store(folder.path(), 9)?;
        let earlier = folder.path().join(format!("trials.before-v{SCHEMA_VERSION}.sqlite"));
        std::fs::write(&earlier, "mine")?;
        Store::open(&path)?;
        assert_eq!(std::fs::read(&earlier)?, b"mine");
        assert_eq!(version_of(&folder.path().join(format!("trials.before-v{SCHEMA_VERSION}-2.sqlite")))?, 9);
        Ok(())
    }

    #[test]
    fn without_a_copy_nothing_is_updated() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        // The name of the copy would be too long for a file.
        let path = folder.path().join(format!("{}.sqlite", "a".repeat(240)));
        std::fs::rename(old_store(folder.path(), 9)?, &path)?;
        let refused = Store::open(&path).expect_err("no copy");
        assert!(matches!(refused, StoreError::NotCopied { .. }), "{refused}");
        assert_eq!(version_of(&path)?, 9);
        let left = std::fs::read_dir(folder.path())?.filter_map(Result::ok).map(|entry| entry.file_name());
        assert!(left.into_iter().all(|name| !name.to_string_lossy().contains("unfinished")), "nothing is left");
        Ok(())
    }
}
