//! The SQLite store. A write-ahead log, so that a kill at any moment loses at most the chunk being written and never
//! harms another trial, and so that several programs can work on one store.
//!
//! ```text
//! trials   one row each: what is known of a trial; `state` is 'recording' until its last chunk is in
//! chunks   its frames, about a second each, as described in `blob`
//! readings channels of an imported trial, which has no frames
//! calibrations, mountings, parts: what is known of the real gripper's sensors; see `calibrations`
//! tares    what those showed at rest; see `tares`
//! board_*  what the board of a real gripper sent; see `board_trials`
//! guesses, label_plan, journal: labels and who changed what; see `labels` and `journal`
//! ```
//!
//! Deleting marks; purging removes. Chunks are only ever added.

use super::blob::{decode_frames, encode_frames};
use super::board_trials::BOARD_TABLES;
use super::calibrations::CALIBRATION_TABLES;
use super::journal::{Change, JOURNAL_TABLES, JournalView, change, newest};
use super::label_repository::LABEL_TABLES;
use super::store_error::{StoreError, fault, plain};
use super::tares::TARE_TABLES;
use crate::labels::{FlagRemark, flaws};
use palpate_geometry::Pose;
use palpate_sim::frame::{Frame, Quality};
use palpate_tactile::trial::TrialId;
use palpate_tactile::trial::{Trial, TrialInfo};
use rusqlite::{Connection, OptionalExtension, Transaction, TransactionBehavior, params};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// "Palp" in ASCII, in the header of the SQLite file.
pub(super) const APPLICATION_ID: i32 = 0x5061_6c70;
/// Version of the tables below. A store from a newer program is refused, an older one is brought up to date.
pub(super) const SCHEMA_VERSION: i32 = MIGRATIONS.len() as i32;
/// How long to wait for another program that is writing.
pub(super) const PATIENCE: Duration = Duration::from_secs(10);
/// Samples per chunk when a whole trial is stored at once: about a second.
const FRAMES_PER_CHUNK: usize = 75;

/// What makes each version out of the one before; the first makes the tables.
const MIGRATIONS: [&str; 9] = [
    TABLES,
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
    BOARD_TABLES,
    CALIBRATION_TABLES,
    LABEL_TABLES,
    JOURNAL_TABLES,
    TARE_TABLES,
];

pub(super) const TABLES: &str = "
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
        deleted TEXT
    );
    CREATE TABLE chunks (
        trial INTEGER NOT NULL REFERENCES trials (id) ON DELETE CASCADE,
        number INTEGER NOT NULL,
        frames BLOB NOT NULL,
        PRIMARY KEY (trial, number)
    ) WITHOUT ROWID;
    CREATE INDEX trials_by_object ON trials (object);
";

/// A trial as lists show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrialRow {
    /// Its number.
    pub id: TrialId,
    /// When it began, UTC.
    pub created: String,
    /// `recording`, or `complete`.
    pub state: String,
    /// Where it came from.
    pub rig: String,
    /// Name of the object; empty where nobody has said yet what it is of.
    pub object: String,
    /// Seed of the pose.
    pub seed: u64,
    /// The data set it was made for, if any.
    pub collection: Option<String>,
    /// Size and shape of the object where they came with the trial.
    pub properties: Option<(String, String)>,
    /// Samples stored.
    pub samples: i64,
    /// Whether it stayed finite and converged.
    pub sound: bool,
    /// How many warnings it carries.
    pub warnings: usize,
    /// What somebody noted of it.
    pub note: String,
    /// Its tags.
    pub tags: Vec<String>,
    /// Whoever gave its label was not sure.
    pub unsure: bool,
    /// What is wrong with it, where it is one of the real gripper.
    pub flags: Vec<FlagRemark>,
    /// When it was deleted, if it was.
    pub deleted: Option<String>,
}

/// An open store.
#[derive(Debug)]
pub struct Store {
    pub(super) connection: Connection,
    path: PathBuf,
    warnings: Vec<String>,
    pub(super) journal: JournalView,
}

impl Store {
    /// Where the store lies when nobody says otherwise: the platform's folder for application data.
    pub fn default_path() -> PathBuf {
        match directories::ProjectDirs::from("", "", "palpate") {
            Some(folders) => folders.data_dir().join("trials.sqlite"),
            None => PathBuf::from("palpate-trials.sqlite"),
        }
    }

    /// Opens a store, making it and its folder where they do not exist.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder)
                .map_err(|e| StoreError::Folder { path: folder.to_owned(), cause: e.to_string() })?;
        }
        let connection =
            Connection::open(path).map_err(|e| StoreError::Open { path: path.to_owned(), cause: plain(&e) })?;
        let (path, journal) = (path.to_owned(), JournalView::default());
        let mut store = Self { connection, path, warnings: Vec::new(), journal };
        store.prepare()?;
        Ok(store)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What is not as it should be about the store, in sentences.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn prepare(&mut self) -> Result<(), StoreError> {
        let path = self.path.clone();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        self.set_patience(PATIENCE)?;
        self.check_identity()?;
        // The log lives in shared memory, which network file systems do not have.
        let mode = if on_network_file_system(&self.path) {
            self.warnings.push(format!(
                "\"{}\" lies on a network file system: write-ahead logging is off, so keep to one program at a time",
                self.path.display()
            ));
            "DELETE"
        } else {
            "WAL"
        };
        self.set_journal(mode)?;
        self.connection.pragma_update(None, "synchronous", "NORMAL").map_err(fault)?;
        self.connection.pragma_update(None, "foreign_keys", true).map_err(fault)?;
        let transaction = self.write()?;
        let version: i32 = transaction.pragma_query_value(None, "user_version", |row| row.get(0)).map_err(fault)?;
        if version == 0 {
            transaction.pragma_update(None, "application_id", APPLICATION_ID).map_err(fault)?;
        }
        for migration in MIGRATIONS.iter().skip(usize::try_from(version).unwrap_or(0)) {
            transaction.execute_batch(migration).map_err(fault)?;
        }
        if version < SCHEMA_VERSION {
            transaction.pragma_update(None, "user_version", SCHEMA_VERSION).map_err(fault)?;
        }
        let seen = newest(&transaction).map_err(fault)?;
        transaction.commit().map_err(fault)?;
        self.journal.seen = seen;
        Ok(())
    }

    /// Changing the journal takes the lock without waiting for it, so that two programs which make one store together
    /// would trip over each other; hence the waiting is done here.
    fn set_journal(&self, mode: &str) -> Result<(), StoreError> {
        let start = Instant::now();
        loop {
            match self.connection.pragma_update(None, "journal_mode", mode).map_err(|e| self.fault(&e)) {
                Err(StoreError::Busy) if start.elapsed() < PATIENCE => std::thread::sleep(Duration::from_millis(5)),
                outcome => return outcome,
            }
        }
    }

    /// How long it waits for another program that writes.
    fn set_patience(&self, patience: Duration) -> Result<(), StoreError> {
        self.connection.busy_timeout(patience).map_err(|e| self.fault(&e))
    }

    /// Does what can wait for later better than now: [`StoreError::Busy`] at once while another program writes.
    pub fn at_once<T>(&mut self, work: impl FnOnce(&mut Self) -> Result<T, StoreError>) -> Result<T, StoreError> {
        self.set_patience(Duration::ZERO)?;
        let done = work(self);
        self.set_patience(PATIENCE)?;
        done
    }

    /// Refuses files of other programs and of newer versions, before anything is written.
    fn check_identity(&self) -> Result<(), StoreError> {
        let read = |pragma: &str| {
            self.connection.pragma_query_value(None, pragma, |row| row.get::<_, i32>(0)).map_err(|e| self.fault(&e))
        };
        // Tables first: another program may be making the store just now, and gives it tables and name at once.
        let tables: i64 = self
            .connection
            .query_row("SELECT count(*) FROM sqlite_master", [], |row| row.get(0))
            .map_err(|e| self.fault(&e))?;
        let (application, version) = (read("application_id")?, read("user_version")?);
        if application != APPLICATION_ID && tables > 0 {
            return Err(StoreError::Foreign { path: self.path.clone() });
        }
        if version > SCHEMA_VERSION {
            return Err(StoreError::Newer { path: self.path.clone(), found: version });
        }
        Ok(())
    }

    fn fault(&self, error: &rusqlite::Error) -> StoreError {
        fault(&self.path, error)
    }

    /// A transaction that takes the write lock at once, so that it cannot fail half-way for want of it.
    pub(super) fn write(&mut self) -> Result<Transaction<'_>, StoreError> {
        let path = self.path.clone();
        self.connection.transaction_with_behavior(TransactionBehavior::Immediate).map_err(|e| fault(&path, &e))
    }

    /// The time now, UTC, as trials are dated: `2026-11-21T15:36:00.123Z`.
    pub fn now(&self) -> Result<String, StoreError> {
        let sql = "SELECT strftime('%Y-%m-%dT%H:%M:%fZ', 'now')";
        self.connection.query_row(sql, [], |row| row.get(0)).map_err(|e| fault(&self.path, &e))
    }

    /// Begins a trial; frames follow with [`Store::append`].
    pub fn begin(&mut self, info: &TrialInfo) -> Result<TrialId, StoreError> {
        let path = self.path.clone();
        let transaction = self.write()?;
        let id = insert_info(&transaction, info).map_err(|e| fault(&path, &e))?;
        transaction.commit().map_err(|e| fault(&path, &e))?;
        Ok(id)
    }

    /// Adds frames to a trial that is being recorded; once this returns, a kill cannot lose them.
    pub fn append(&mut self, id: TrialId, frames: &[Frame]) -> Result<(), StoreError> {
        if frames.is_empty() {
            return Ok(());
        }
        let path = self.path.clone();
        let transaction = self.write()?;
        insert_chunk(&transaction, id, frames).map_err(|e| fault(&path, &e))?;
        transaction.commit().map_err(|e| fault(&path, &e))
    }

    /// Ends a trial: its quality and warnings are now known.
    pub fn finish(&mut self, id: TrialId, quality: &Quality, warnings: &[String]) -> Result<(), StoreError> {
        let path = self.path.clone();
        let transaction = self.write()?;
        set_complete(&transaction, id, quality, warnings).map_err(|e| fault(&path, &e))?;
        transaction.commit().map_err(|e| fault(&path, &e))
    }

    /// Stores a whole trial, all or nothing.
    pub fn insert(&mut self, trial: &Trial) -> Result<TrialId, StoreError> {
        let path = self.path.clone();
        let transaction = self.write()?;
        let id = insert_whole(&transaction, trial).map_err(|e| fault(&path, &e))?;
        transaction.commit().map_err(|e| fault(&path, &e))?;
        Ok(id)
    }

    /// Stores the trials of a collection, all or nothing, but for those that are there already; returns how many.
    pub fn insert_collected<'a>(&mut self, trials: impl Iterator<Item = &'a Trial>) -> Result<u32, StoreError> {
        let path = self.path.clone();
        let transaction = self.write()?;
        let mut stored = 0;
        for trial in trials {
            if !is_collected(&transaction, &trial.info).map_err(|e| fault(&path, &e))? {
                insert_whole(&transaction, trial).map_err(|e| fault(&path, &e))?;
                stored += 1;
            }
        }
        transaction.commit().map_err(|e| fault(&path, &e))?;
        Ok(stored)
    }

    /// Object and seed of every trial of a collection, deleted ones too: what is not wanted is not made again.
    pub fn collected(&self, collection: &str) -> Result<BTreeSet<(String, u64)>, StoreError> {
        let sql = "SELECT object, seed FROM trials WHERE collection = ?1";
        let rows = self.connection.prepare(sql).and_then(|mut statement| {
            statement.query_map([collection], |row| Ok((row.get(0)?, row.get::<_, i64>(1)?.cast_unsigned())))?.collect()
        });
        rows.map_err(|e| self.fault(&e))
    }

    /// All trials, oldest first; deleted ones only when asked for.
    pub fn list(&self, with_deleted: bool) -> Result<Vec<TrialRow>, StoreError> {
        let sql = "SELECT id, created, state, rig, object, seed, samples, quality, warnings, deleted, \
                   collection, size, shape, note, tags, unsure, CASE WHEN json_valid(about) THEN about ->> '$.flags' END
                   FROM trials LEFT JOIN board_trials ON board_trials.trial = trials.id
                   WHERE ?1 OR deleted IS NULL ORDER BY id";
        let rows = self.connection.prepare(sql).and_then(|mut statement| {
            statement
                .query_map([with_deleted], |row| {
                    let quality: Option<Quality> = serde_json::from_str(&row.get::<_, String>(7)?).ok();
                    let warnings: Vec<String> = json_or_default(&row.get::<_, String>(8)?);
                    let object: String = row.get(4)?;
                    let flags = json_or_default(&row.get::<_, Option<String>>(16)?.unwrap_or_default());
                    Ok(TrialRow {
                        note: row.get(13)?,
                        tags: json_or_default(&row.get::<_, String>(14)?),
                        unsure: row.get(15)?,
                        flags: flaws(flags, Some(&object)),
                        id: row.get(0)?,
                        created: row.get(1)?,
                        state: row.get(2)?,
                        rig: row.get(3)?,
                        object,
                        seed: row.get::<_, i64>(5)?.cast_unsigned(),
                        collection: row.get(10)?,
                        properties: row.get::<_, Option<String>>(11)?.zip(row.get(12)?),
                        samples: row.get(6)?,
                        sound: quality.is_some_and(|quality| quality.is_sound()),
                        warnings: warnings.len(),
                        deleted: row.get(9)?,
                    })
                })?
                .collect()
        });
        rows.map_err(|e| self.fault(&e))
    }

    /// One trial with its frames.
    pub fn load(&self, id: TrialId) -> Result<Trial, StoreError> {
        Ok(Trial { info: self.load_info(id)?, frames: self.load_frames(id)? })
    }

    fn load_info(&self, id: TrialId) -> Result<TrialInfo, StoreError> {
        let sql = "SELECT rig, object, seed, scene, world_from_gripper, quality, warnings, version, \
                   collection, plan FROM trials WHERE id = ?1 AND deleted IS NULL";
        type Columns = (String, String, i64, String, [String; 4], String, Option<String>);
        let found: Option<Columns> = self
            .connection
            .query_row(sql, [id], |row| {
                let texts = [row.get(4)?, row.get(5)?, row.get(6)?, row.get(9)?];
                Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, texts, row.get(7)?, row.get(8)?))
            })
            .optional()
            .map_err(|e| self.fault(&e))?;
        let Some((rig, object, seed, scene, [pose, quality, warnings, plan], version, collection)) = found else {
            return Err(self.no_trial(id));
        };
        let bad = |e: serde_json::Error| StoreError::BadInfo { id, cause: e.to_string() };
        Ok(TrialInfo {
            rig,
            object,
            seed: seed.cast_unsigned(),
            collection,
            scene,
            world_from_gripper: serde_json::from_str::<Pose>(&pose).map_err(bad)?,
            plan: serde_json::from_str(&plan).map_err(bad)?,
            quality: serde_json::from_str(&quality).map_err(bad)?,
            warnings: serde_json::from_str(&warnings).map_err(bad)?,
            version,
        })
    }

    fn load_frames(&self, id: TrialId) -> Result<Vec<Frame>, StoreError> {
        let sql = "SELECT number, frames FROM chunks WHERE trial = ?1 ORDER BY number";
        let chunks: Vec<(i64, Vec<u8>)> = self
            .connection
            .prepare(sql)
            .and_then(|mut statement| statement.query_map([id], |row| Ok((row.get(0)?, row.get(1)?)))?.collect())
            .map_err(|e| self.fault(&e))?;
        let mut frames = Vec::new();
        for (chunk, bytes) in chunks {
            frames.extend(decode_frames(&bytes).map_err(|cause| StoreError::Damaged { id, chunk, cause })?);
        }
        Ok(frames)
    }

    pub(super) fn no_trial(&self, id: TrialId) -> StoreError {
        let sql = "SELECT deleted IS NOT NULL FROM trials WHERE id = ?1";
        match self.connection.query_row(sql, [id], |row| row.get::<_, bool>(0)) {
            Ok(true) => StoreError::NoTrial { id, hint: ": it was deleted; `palpate trials restore` brings it back" },
            Ok(false) => StoreError::NotDeleted { id },
            Err(_) => StoreError::NoTrial { id, hint: "" },
        }
    }

    /// Marks trials as deleted, all or none of them. They can be restored until they are purged.
    pub fn delete(&mut self, ids: &[TrialId]) -> Result<(), StoreError> {
        self.change_each(ids, &Change::Discarded)
    }

    /// Takes deletions back, all or none of them.
    pub fn restore(&mut self, ids: &[TrialId]) -> Result<(), StoreError> {
        self.change_each(ids, &Change::Restored)
    }

    fn change_each(&mut self, ids: &[TrialId], what: &Change) -> Result<(), StoreError> {
        let (path, writer) = (self.path.clone(), self.journal.writer.clone());
        let transaction = self.write()?;
        let mut missing = None;
        for id in ids {
            if !change(&transaction, &writer, *id, what, None).map_err(|e| fault(&path, &e))? {
                missing = Some(*id);
                break;
            }
        }
        if let Some(id) = missing {
            transaction.rollback().map_err(|e| fault(&path, &e))?;
            return Err(self.no_trial(id));
        }
        transaction.commit().map_err(|e| fault(&path, &e))
    }

    /// Removes all trials marked as deleted for good; returns how many.
    pub fn purge(&mut self) -> Result<usize, StoreError> {
        let path = self.path.clone();
        let transaction = self.write()?;
        let removed =
            transaction.execute("DELETE FROM trials WHERE deleted IS NOT NULL", []).map_err(|e| fault(&path, &e))?;
        transaction.commit().map_err(|e| fault(&path, &e))?;
        Ok(removed)
    }
}

fn insert_whole(transaction: &Transaction<'_>, trial: &Trial) -> rusqlite::Result<TrialId> {
    let id = insert_info(transaction, &trial.info)?;
    for frames in trial.frames.chunks(FRAMES_PER_CHUNK) {
        insert_chunk(transaction, id, frames)?;
    }
    set_complete(transaction, id, &trial.info.quality, &trial.info.warnings)?;
    Ok(id)
}

/// True when another program has collected this trial meanwhile.
fn is_collected(transaction: &Transaction<'_>, info: &TrialInfo) -> rusqlite::Result<bool> {
    let sql = "SELECT EXISTS (SELECT 1 FROM trials WHERE collection = ?1 AND object = ?2 AND seed = ?3)";
    transaction.query_row(sql, params![info.collection, info.object, info.seed.cast_signed()], |row| row.get(0))
}

pub(super) fn insert_info(transaction: &Transaction<'_>, info: &TrialInfo) -> rusqlite::Result<TrialId> {
    transaction.execute(
        "INSERT INTO trials (rig, object, seed, scene, world_from_gripper, quality, warnings, version, collection, \
         plan) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
        params![
            info.rig,
            info.object,
            info.seed.cast_signed(),
            info.scene,
            json(&info.world_from_gripper),
            json(&info.quality),
            json(&info.warnings),
            info.version,
            info.collection,
            json(&info.plan),
        ],
    )?;
    Ok(transaction.last_insert_rowid())
}

/// JSON of the few types that are stored as text.
pub(super) fn json<T: Serialize + ?Sized>(value: &T) -> String {
    serde_json::to_string(value).expect("plain structs with text keys always have a JSON form")
}

fn insert_chunk(transaction: &Transaction<'_>, id: TrialId, frames: &[Frame]) -> rusqlite::Result<()> {
    transaction.execute(
        "INSERT INTO chunks (trial, number, frames) \
         VALUES (?1, (SELECT coalesce(max(number), -1) + 1 FROM chunks WHERE trial = ?1), ?2)",
        params![id, encode_frames(frames)],
    )?;
    transaction.execute("UPDATE trials SET samples = samples + ?2 WHERE id = ?1", params![id, frames.len() as i64])?;
    Ok(())
}

pub(super) fn set_complete(
    transaction: &Transaction<'_>,
    id: TrialId,
    quality: &Quality,
    warnings: &[String],
) -> rusqlite::Result<()> {
    transaction.execute(
        "UPDATE trials SET state = 'complete', quality = ?2, warnings = ?3 WHERE id = ?1",
        params![id, json(quality), json(warnings)],
    )?;
    Ok(())
}

fn json_or_default<T: Default + serde::de::DeserializeOwned>(text: &str) -> T {
    serde_json::from_str(text).unwrap_or_default()
}

/// True where the file's mount is a network file system, as far as the system tells (Linux).
fn on_network_file_system(path: &Path) -> bool {
    const NETWORK: [&str; 9] = ["nfs", "nfs4", "cifs", "smb3", "smbfs", "fuse.sshfs", "afs", "lustre", "beegfs"];
    let Ok(mounts) = std::fs::read_to_string("/proc/self/mounts") else {
        return false;
    };
    let absolute = path.parent().and_then(|p| p.canonicalize().ok()).unwrap_or_else(|| path.to_owned());
    mounts
        .lines()
        .filter_map(|line| {
            let mut fields = line.split(' ').skip(1);
            Some((fields.next()?.replace("\\040", " "), fields.next()?))
        })
        .filter(|(point, _)| absolute.starts_with(point))
        // The deepest mount point that holds the file; of equals the last one mounted.
        .max_by_key(|(point, _)| point.len())
        .is_some_and(|(_, kind)| NETWORK.contains(&kind))
}
