//! The SQLite store: its connection, and the trials in it. A write-ahead log, so that a kill at any moment loses at
//! most the chunk being written and never harms another trial, and so that several programs can share one store.
//!
//! Tables are in `schema`. Each group of tables beside trials has a repository: [`Store::labels`],
//! [`Store::journal`], [`Store::calibrations`].
//!
//! Deleting marks a trial; purging removes it. Chunks are only ever added.

use super::checksum::{add_functions, add_triggers, is_intact};
use super::demo_log::{TrialPlace, keep, log, place_of};
use super::file_kind::PARTS;
use super::frame_blob::encode_frames;
use super::identity::{Stored, add_to, known};
use super::log_file::has_lost_changes;
use super::open_file::OpenFile;
use super::schema::{APPLICATION_ID, SCHEMA_VERSION, make_tables};
use super::store_error::{BUSY_TIMEOUT, StoreError, fault, plain, row_fault};
use palpate_geometry::Pose;
use palpate_sim::frame::{Frame, Plan, Quality};
use palpate_sim::scene::Scene;
use palpate_tactile::trial::{
    SimulatedData, SimulatedTrial, Trial, TrialData, TrialHeader, TrialId, TrialSource, UnknownSource,
};
use rusqlite::{
    Connection, ErrorCode, OpenFlags, OptionalExtension, Params, Row, Transaction, TransactionBehavior, params,
};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A view or trigger of others, or a table of which a view has the name.
const FOREIGN_PARTS: &str = "SELECT name FROM sqlite_master WHERE type = 'view' OR type = 'trigger' AND name NOT IN (
    'tares_are_not_altered', 'tares_are_not_shortened', 'journal_is_not_altered', 'journal_is_not_shortened')
    OR type = 'index' AND sql LIKE '%UNIQUE%' AND name <> 'trials_by_collection' LIMIT 1";

/// Samples per chunk: about a second.
const FRAMES_PER_CHUNK: usize = 75;

/// An open store.
#[derive(Debug)]
pub struct Store {
    pub(super) connection: Connection,
    path: PathBuf,
    file: OpenFile,
    warnings: Vec<String>,
    /// It is read as a file that nobody changes.
    is_unchanging: bool,
}

/// Name by which SQLite takes a file for unchanging, and needs no log beside it.
fn unchanging(file: &Path) -> String {
    let escaped = |byte: &u8| match byte {
        b'/' | b'.' | b'-' | b'_' | b'~' => char::from(*byte).to_string(),
        byte if byte.is_ascii_alphanumeric() => char::from(*byte).to_string(),
        byte => format!("%{byte:02x}"),
    };
    let path: String = file.as_os_str().as_encoded_bytes().iter().map(escaped).collect();
    format!("file:{path}?immutable=1")
}

/// SQLite's log beside a store (`-wal`), or the index of it (`-shm`).
fn beside(file: &Path, ending: &str) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

impl Store {
    /// Default path of the store: the platform's folder for application data, on Windows the one that does not follow the user
    /// to other computers.
    pub fn default_path() -> PathBuf {
        match directories::ProjectDirs::from("", "", "palpate") {
            Some(folders) => folders.data_local_dir().join("trials.sqlite"),
            None => PathBuf::from("palpate-trials.sqlite"),
        }
    }

    /// Opens a store; creates it and its folder where they do not exist.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(|e| {
                let folder = folder.display();
                StoreError::Refused(format!(
                    "cannot create the folder \"{folder}\" for the store: {e}; choose another place with --store"
                ))
            })?;
        }
        let mut store = Self::connect(path, OpenFlags::SQLITE_OPEN_CREATE)?;
        store.prepare()?;
        Ok(store)
    }

    /// Opens a store that exists, to read it: nothing is written, and another program that writes is not waited for. A store in
    /// a folder that cannot be written is read as well.
    pub fn open_to_read(path: &Path) -> Result<Self, StoreError> {
        let mut store = Self::connect(path, OpenFlags::empty())?;
        let readable =
            |store: &Self| store.connection.query_row("SELECT count(*) FROM sqlite_master", [], |_row| Ok(()));
        // A file that may not be written gets nothing beside it that its owner could not remove; what another program keeps there
        // is used.
        let is_foreign = std::fs::OpenOptions::new().write(true).open(store.file.path()).is_err()
            && !beside(store.file.path(), "-shm").exists();
        let refused =
            || Err(rusqlite::Error::SqliteFailure(rusqlite::ffi::Error::new(rusqlite::ffi::SQLITE_READONLY), None));
        if let Err(error) = if is_foreign { refused() } else { readable(&store) } {
            // Without a place for its log SQLite reads only what it may take for unchanging.
            let codes = [ErrorCode::CannotOpen, ErrorCode::ReadOnly, ErrorCode::PermissionDenied];
            if !error.sqlite_error_code().is_some_and(|code| codes.contains(&code)) {
                return Err(store.fault(&error));
            }
            let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_URI;
            let opened = Connection::open_with_flags(unchanging(store.file.path()), flags);
            store.connection = opened.map_err(|e| StoreError::open(path, plain(&e)))?;
            store.is_unchanging = true;
            if std::fs::metadata(beside(store.file.path(), "-wal")).is_ok_and(|log| log.len() > 0) {
                store.warnings.push(format!(
                    "\"{}\" is read-only and was not closed properly: its newest trials cannot be read; open it once where it \
                     can be written",
                    path.display()
                ));
            }
        }
        store.set_busy_timeout(BUSY_TIMEOUT)?;
        store.check_identity()?;
        let fault = |e: rusqlite::Error| store.fault(&e);
        store.connection.pragma_update(None, "query_only", true).map_err(fault)?;
        add_functions(&store.connection).map_err(fault)?;
        Ok(store)
    }

    fn connect(path: &Path, flags: OpenFlags) -> Result<Self, StoreError> {
        // SQLite takes relative names such as `:memory:` and `file:a` for something else than files.
        let file = std::path::absolute(path).map_err(|e| StoreError::open(path, e))?;
        // SQLite waits for ever for a pipe that has the name of its log.
        let parts = PARTS.map(|ending| beside(&file, ending));
        if let Some(part) = parts.iter().find(|part| std::fs::metadata(part).is_ok_and(|own| !own.is_file())) {
            let part = part.display();
            return Err(StoreError::Refused(format!(
                "\"{part}\" beside the store is not a regular file; move it away"
            )));
        }
        let flags =
            flags | OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_URI;
        let lost = has_lost_changes(&beside(&file, "-wal")).then(|| {
            format!(
                "the log of \"{}\" is damaged: what was stored last, behind the damage, is lost; compare it with a backup",
                path.display()
            )
        });
        let connection = Connection::open_with_flags(&file, flags).map_err(|e| StoreError::open(path, plain(&e)))?;
        let file = OpenFile::at(file)?;
        let warnings = lost.into_iter().collect();
        Ok(Self { connection, path: path.to_owned(), file, warnings, is_unchanging: false })
    }

    /// Name of the file for SQLite, byte for byte.
    pub(super) fn name_to_attach(&self) -> Vec<u8> {
        match self.is_unchanging {
            true => unchanging(self.file.path()).into_bytes(),
            false => self.file.path().as_os_str().as_encoded_bytes().to_vec(),
        }
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Absolute path of the file.
    pub(super) fn file(&self) -> &Path {
        self.file.path()
    }

    /// Warnings from opening the store, one sentence each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn prepare(&mut self) -> Result<(), StoreError> {
        let path = self.path.clone();
        let fault = |e: rusqlite::Error| fault(&path, &e);
        self.set_busy_timeout(BUSY_TIMEOUT)?;
        self.check_identity()?;
        // The log lives in shared memory, which network file systems do not have.
        let mode = if on_network_file_system(&self.path) {
            self.warnings.push(format!(
                "\"{}\" is on a network file system: write-ahead logging is off, so use one program at a time",
                self.path.display()
            ));
            "DELETE"
        } else {
            "WAL"
        };
        self.set_journal(mode)?;
        self.connection.pragma_update(None, "synchronous", "NORMAL").map_err(fault)?;
        self.connection.pragma_update(None, "foreign_keys", true).map_err(fault)?;
        add_functions(&self.connection).map_err(fault)?;
        let transaction = self.write()?;
        make_tables(&transaction, &path)?;
        self.commit(transaction)?;
        add_triggers(&self.connection).map_err(fault)
    }

    /// Sets SQLite's journal mode. SQLite takes this lock without waiting for it; this waits, so that two programs can
    /// create one store together.
    fn set_journal(&self, mode: &str) -> Result<(), StoreError> {
        let start = Instant::now();
        loop {
            match self.connection.pragma_update(None, "journal_mode", mode).map_err(|e| self.fault(&e)) {
                Err(StoreError::Busy) if start.elapsed() < BUSY_TIMEOUT => std::thread::sleep(Duration::from_millis(5)),
                outcome => return outcome,
            }
        }
    }

    /// Sets how long to wait for another program that is writing.
    fn set_busy_timeout(&self, timeout: Duration) -> Result<(), StoreError> {
        self.connection.busy_timeout(timeout).map_err(|e| self.fault(&e))
    }

    /// Does some work without waiting: [`StoreError::Busy`] at once while another program is writing.
    pub fn at_once<T>(&mut self, work: impl FnOnce(&mut Self) -> Result<T, StoreError>) -> Result<T, StoreError> {
        self.set_busy_timeout(Duration::ZERO)?;
        let done = work(self);
        self.set_busy_timeout(BUSY_TIMEOUT)?;
        done
    }

    /// Refuses files of other programs and of other versions, before anything is written.
    fn check_identity(&self) -> Result<(), StoreError> {
        let read = |pragma: &str| {
            self.connection.pragma_query_value(None, pragma, |row| row.get::<_, i32>(0)).map_err(|e| self.fault(&e))
        };
        // Tables first: another program may be making the store just now, and gives it tables and name at once.
        let tables: i64 = self
            .connection
            .query_row("SELECT count(*) FROM sqlite_master", [], |row| row.get(0))
            .map_err(|e| self.fault(&e))?;
        let foreign: Option<String> =
            self.connection.query_row(FOREIGN_PARTS, [], |row| row.get(0)).optional().map_err(|e| self.fault(&e))?;
        let (application, version) = (read("application_id")?, read("user_version")?);
        let path = self.path.display();
        if application != APPLICATION_ID && tables > 0 {
            return Err(StoreError::foreign(&self.path));
        }
        if version > SCHEMA_VERSION {
            return Err(StoreError::Refused(format!(
                "\"{path}\" was written by a newer Palpate (store version {version}, this program reads up to \
                 {SCHEMA_VERSION}); update Palpate"
            )));
        }
        if version < SCHEMA_VERSION && tables > 0 {
            return Err(StoreError::Refused(format!(
                "\"{path}\" was made by an earlier development version of Palpate (store version {version}, this program \
                 reads {SCHEMA_VERSION}). Commit 29b20e5 still converts it: git checkout 29b20e5 && cargo run --release -- \
                 trials list --store \"{path}\""
            )));
        }
        match foreign {
            Some(name) => Err(StoreError::Refused(format!(
                "\"{path}\" holds \"{name}\", a view, trigger or unique index that is not of Palpate, which could change what is read or \
                 written; take the store from a backup, or choose another file with --store"
            ))),
            None => Ok(()),
        }
    }

    /// Translates an error of SQLite.
    pub(super) fn fault(&self, error: &rusqlite::Error) -> StoreError {
        fault(&self.path, error)
    }

    /// Begins a transaction that takes the write lock at once, so that it cannot fail half-way without it.
    pub(super) fn write(&self) -> Result<Transaction<'_>, StoreError> {
        let begun = Transaction::new_unchecked(&self.connection, TransactionBehavior::Immediate);
        let transaction = begun.map_err(|e| self.fault(&e))?;
        self.file.check()?;
        Ok(transaction)
    }

    /// Does some work in a transaction: all of it or nothing.
    pub(super) fn in_transaction<T>(
        &self,
        work: impl FnOnce(&Transaction<'_>) -> rusqlite::Result<T>,
    ) -> Result<T, StoreError> {
        let transaction = self.write()?;
        let done = work(&transaction).map_err(|e| self.fault(&e))?;
        self.commit(transaction)?;
        Ok(done)
    }

    /// The first row of a query, if any.
    pub(super) fn first<T>(
        &self,
        sql: &str,
        values: impl Params,
        read: impl FnOnce(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Option<T>, StoreError> {
        let found = self.connection.prepare_cached(sql).and_then(|mut found| found.query_row(values, read).optional());
        found.map_err(|e| self.fault(&e))
    }

    /// All rows of a query.
    pub(super) fn all<T, C: FromIterator<T>>(
        &self,
        sql: &str,
        values: impl Params,
        read: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<C, StoreError> {
        let found = self.connection.prepare_cached(sql).and_then(|mut found| found.query_map(values, read)?.collect());
        found.map_err(|e| self.fault(&e))
    }

    /// Commits a transaction. An error where the file is no longer the one that was opened: what was written is lost then.
    pub(super) fn commit(&self, transaction: Transaction<'_>) -> Result<(), StoreError> {
        transaction.commit().map_err(|e| self.fault(&e))?;
        self.file.check()
    }

    /// Current time, UTC, in the format of [`TrialRow::created`](crate::TrialRow::created): `2026-11-21T15:36:00.123Z`.
    pub fn now(&self) -> Result<String, StoreError> {
        let sql = "SELECT strftime('%Y-%m-%dT%H:%M:%fZ', 'now')";
        self.connection.query_row(sql, [], |row| row.get(0)).map_err(|e| self.fault(&e))
    }

    /// The local day this many days ago: `2026-11-21`.
    pub fn local_day(&self, days_ago: u32) -> Result<String, StoreError> {
        let sql = "SELECT date('now', 'localtime', ?1)";
        let day = self.connection.query_row(sql, [format!("-{days_ago} days")], |row| row.get(0));
        day.map_err(|e| self.fault(&e))
    }

    /// A number that changes whenever another connection, of this or another program, has changed the store.
    pub fn data_version(&self) -> Result<i64, StoreError> {
        let version = self.connection.pragma_query_value(None, "data_version", |row| row.get(0));
        version.map_err(|e| self.fault(&e))
    }

    /// Place of a trial.
    pub fn place(&self, id: TrialId) -> Result<TrialPlace, StoreError> {
        place_of(&self.connection, id).map_err(|e| self.fault(&e))?.ok_or_else(|| self.no_trial(id))
    }

    /// Gives up a trial that another replaces: one of the demo log is removed, any other marked as deleted.
    pub fn give_up(&mut self, id: TrialId) -> Result<(), StoreError> {
        let removed = self.connection.execute("DELETE FROM trials WHERE id = ?1 AND demo = 1", [id]);
        if removed.map_err(|e| self.fault(&e))? == 0 {
            self.delete(&[id])?;
        }
        Ok(())
    }

    /// Notes anew how far a simulated trial can be trusted, once other runs of it have ended.
    pub fn note_quality(&mut self, id: TrialId, quality: &Quality) -> Result<(), StoreError> {
        let sql = "UPDATE trials SET quality = ?2 WHERE id = ?1";
        self.connection.execute(sql, params![id, json(quality)]).map_err(|e| self.fault(&e))?;
        Ok(())
    }

    /// Stores a whole simulated trial, all or nothing, unless another trial holds the same grasp.
    pub fn insert(&mut self, trial: &SimulatedTrial) -> Result<Stored, StoreError> {
        self.insert_in(TrialPlace::Store, trial)
    }

    /// The same in the store or in the demo log.
    pub fn insert_in(&mut self, place: TrialPlace, trial: &SimulatedTrial) -> Result<Stored, StoreError> {
        self.in_transaction(|transaction| match known(transaction, &trial.header)? {
            Some(id) => held(transaction, id, place),
            None => insert_whole(transaction, trial, place).map(Stored::New),
        })
    }

    /// Stores the trials of a collection that are not in the store yet, all or nothing; returns how many. A grasp that another
    /// trial holds is added to the collection instead.
    pub fn insert_collected<'a>(
        &mut self,
        trials: impl Iterator<Item = &'a SimulatedTrial>,
    ) -> Result<u32, StoreError> {
        self.in_transaction(|transaction| {
            let mut stored = 0;
            for trial in trials {
                let header = &trial.header;
                if is_collected(transaction, header)? {
                    continue;
                }
                match known(transaction, header)? {
                    Some(id) => {
                        add_to(transaction, id, header.collection.as_deref())?;
                        keep(transaction, id)?;
                    }
                    None => {
                        insert_whole(transaction, trial, TrialPlace::Store)?;
                        stored += 1;
                    }
                }
            }
            Ok(stored)
        })
    }

    /// Object and seed of every trial of a collection; deleted ones too, so that they are not made again.
    pub fn collected(&self, collection: &str) -> Result<BTreeSet<(String, u64)>, StoreError> {
        let sql = "SELECT object, seed FROM trials WHERE collection = ?1 UNION SELECT object, seed FROM trials
            JOIN memberships ON memberships.trial = trials.id WHERE memberships.collection = ?1";
        self.all(sql, [collection], object_and_seed)
    }

    /// Time of a trial's beginning, UTC.
    pub fn created(&self, id: TrialId) -> Result<String, StoreError> {
        let sql = "SELECT created FROM trials WHERE id = ?1";
        self.first(sql, [id], |row| row.get(0))?.ok_or_else(|| self.no_trial(id))
    }

    /// One trial with its data.
    pub fn load(&self, id: TrialId) -> Result<Trial, StoreError> {
        let StoredHeader { source, header, simulation } = self.load_header(id)?;
        let missing = |what: &str| StoreError::bad_info(id, format!("it has no {what}"));
        let data = match source {
            TrialSource::Simulated => {
                let bad = |e: serde_json::Error| StoreError::bad_info(id, e);
                let [pose, quality, plan] = simulation;
                TrialData::Simulated(SimulatedData {
                    world_from_gripper: serde_json::from_str(&pose).map_err(bad)?,
                    plan: serde_json::from_str(&plan).map_err(bad)?,
                    quality: serde_json::from_str(&quality).map_err(bad)?,
                    frames: self.load_frames(id)?,
                })
            }
            TrialSource::Recorded => TrialData::Recorded(self.board_log(id)?.ok_or_else(|| missing("board"))?),
            TrialSource::Imported => {
                TrialData::Imported(self.readings(id)?.ok_or_else(|| missing("channels"))?.filled())
            }
        };
        Ok(Trial { header, data })
    }

    /// Header of a trial, with its source and the columns that only simulated trials use.
    fn load_header(&self, id: TrialId) -> Result<StoredHeader, StoreError> {
        let sql = format!(
            "SELECT rig, object, seed, scene, world_from_gripper, quality, warnings, version, collection, plan, earlier, phases,
             origin, {} FROM trials WHERE id = ?1 AND deleted IS NULL",
            is_intact()
        );
        let read = |row: &Row<'_>| Ok((row.get(13)?, HeaderColumns::of(row)?));
        let found =
            self.connection.query_row(&sql, [id], read).optional().map_err(|e| row_fault(&self.path, id, &e))?;
        let (intact, columns) = found.ok_or_else(|| self.no_trial(id))?;
        match columns.header(id) {
            header if intact => header,
            Ok(_) => Err(StoreError::altered(id)),
            Err(error) => Err(StoreError::bad_info(id, error)),
        }
    }

    pub(super) fn no_trial(&self, id: TrialId) -> StoreError {
        let sql = "SELECT deleted IS NOT NULL FROM trials WHERE id = ?1";
        match self.connection.query_row(sql, [id], |row| row.get::<_, bool>(0)) {
            Ok(true) => StoreError::no_trial(id, ": it was deleted; `palpate trials restore` brings it back"),
            Ok(false) => StoreError::Refused(format!("trial {id} is not deleted: nothing to restore")),
            Err(_) => StoreError::no_trial(id, ""),
        }
    }

    /// Removes all deleted trials for good, and gives their space back; returns how many.
    pub fn purge(&mut self) -> Result<usize, StoreError> {
        let sql = "DELETE FROM trials WHERE deleted IS NOT NULL";
        let purged = self.in_transaction(|transaction| transaction.execute(sql, []))?;
        // While another program reads, or the disk has no room for a copy, the space is used again by later trials.
        let shrunk = self.connection.execute_batch("VACUUM; PRAGMA wal_checkpoint(TRUNCATE)");
        if let Err(cause) = shrunk {
            self.warnings
                .push(format!("the file did not become smaller ({}); later trials use its space", plain(&cause)));
        }
        Ok(purged)
    }
}

/// Outcome for a place whose grasp this trial holds already.
fn held(transaction: &Transaction<'_>, id: TrialId, place: TrialPlace) -> rusqlite::Result<Stored> {
    let kept = place == TrialPlace::Store && keep(transaction, id)?;
    Ok(if kept { Stored::Kept(id) } else { Stored::Known(id) })
}

fn insert_whole(transaction: &Transaction<'_>, trial: &SimulatedTrial, place: TrialPlace) -> rusqlite::Result<TrialId> {
    let SimulatedData { world_from_gripper, plan, quality, frames } = &trial.data;
    let id = insert_header(transaction, TrialSource::Simulated, &trial.header, (world_from_gripper, quality, plan))?;
    if place == TrialPlace::DemoLog {
        log(transaction, id)?;
    }
    for frames in frames.chunks(FRAMES_PER_CHUNK) {
        insert_chunk(transaction, id, frames)?;
    }
    set_complete(transaction, id, quality, &trial.header.warnings)?;
    Ok(id)
}

/// True when another program has collected this trial in the meantime.
fn is_collected(transaction: &Transaction<'_>, header: &TrialHeader) -> rusqlite::Result<bool> {
    let sql = "SELECT EXISTS (SELECT 1 FROM trials WHERE collection = ?1 AND object = ?2 AND seed = ?3)
        OR EXISTS (SELECT 1 FROM trials JOIN memberships ON memberships.trial = trials.id
            WHERE memberships.collection = ?1 AND object = ?2 AND seed = ?3)
        OR EXISTS (SELECT 1 FROM trials WHERE identity = ?4 AND (collection = ?1 OR EXISTS (
            SELECT 1 FROM memberships WHERE memberships.trial = trials.id AND memberships.collection = ?1)))";
    let seed = header.seed.cast_signed();
    transaction.query_row(sql, params![header.collection, header.object, seed, header.identity()], |row| row.get(0))
}

/// Header of a stored trial.
struct StoredHeader {
    source: TrialSource,
    header: TrialHeader,
    /// JSON of pose, quality and plan.
    simulation: [String; 3],
}

/// Columns of a header as they are stored.
struct HeaderColumns {
    rig: String,
    object: String,
    seed: i64,
    scene: String,
    simulation: [String; 3],
    warnings: String,
    version: String,
    optional: [Option<String>; 4],
}

impl HeaderColumns {
    fn of(row: &Row<'_>) -> rusqlite::Result<Self> {
        let (rig, object, seed, scene) = (row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?);
        let simulation = [row.get(4)?, row.get(5)?, row.get(9)?];
        let optional = [row.get(8)?, row.get(10)?, row.get(11)?, row.get(12)?];
        Ok(Self { rig, object, seed, scene, simulation, warnings: row.get(6)?, version: row.get(7)?, optional })
    }

    fn header(self, id: TrialId) -> Result<StoredHeader, StoreError> {
        let [collection, earlier, phases, origin] = self.optional;
        let scene = |cause| StoreError::Refused(format!("the scene stored with trial {id} cannot be read: {cause}"));
        let bad = |e: serde_json::Error| StoreError::bad_info(id, e);
        let header = TrialHeader {
            object: self.object,
            seed: self.seed.cast_unsigned(),
            collection,
            // An empty text, as imported trials have, is the default scene.
            scene: Scene::from_toml(&self.scene).map_err(scene)?,
            warnings: serde_json::from_str(&self.warnings).map_err(bad)?,
            version: self.version,
            earlier: earlier.as_deref().and_then(|earlier| serde_json::from_str(earlier).ok()),
            phases: phases.as_deref().and_then(|phases| serde_json::from_str(phases).ok()).flatten(),
            origin: origin.as_deref().and_then(|origin| serde_json::from_str(origin).ok()),
        };
        Ok(StoredHeader { source: source_named(id, &self.rig)?, header, simulation: self.simulation })
    }
}

/// Source of a trial by its stored name.
pub(super) fn source_named(id: TrialId, name: &str) -> Result<TrialSource, StoreError> {
    name.parse().map_err(|UnknownSource(name)| {
        StoreError::Refused(format!(
            "trial {id} comes from \"{name}\", which this version does not know; update Palpate"
        ))
    })
}

/// Begins a recorded trial. Columns that only simulated trials use get neutral values.
pub(super) fn insert_recorded(transaction: &Transaction<'_>, header: &TrialHeader) -> rusqlite::Result<TrialId> {
    let unused = (&Pose::IDENTITY, &Quality::default(), &Plan::default());
    insert_header(transaction, TrialSource::Recorded, header, unused)
}

fn insert_header(
    transaction: &Transaction<'_>,
    source: TrialSource,
    header: &TrialHeader,
    (world_from_gripper, quality, plan): (&Pose, &Quality, &Plan),
) -> rusqlite::Result<TrialId> {
    transaction.execute(
        "INSERT INTO trials (rig, object, seed, scene, world_from_gripper, quality, warnings, version, collection, \
         plan, earlier, origin, identity) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13)",
        params![
            source.name(),
            header.object,
            header.seed.cast_signed(),
            header.scene.to_toml(),
            json(world_from_gripper),
            json(quality),
            json(&header.warnings),
            header.version,
            header.collection,
            json(plan),
            header.earlier.as_ref().map(json),
            header.origin.as_ref().map(json),
            header.identity(),
        ],
    )?;
    Ok(transaction.last_insert_rowid())
}

/// JSON of the few types that are stored as text.
pub(super) fn json<T: Serialize + ?Sized>(value: &T) -> String {
    serde_json::to_string(value).expect("plain structs with text keys always have a JSON form")
}

fn insert_chunk(transaction: &Transaction<'_>, id: TrialId, frames: &[Frame]) -> rusqlite::Result<()> {
    let sql = "WITH new (uid, number) AS (SELECT uid, chunks FROM trials WHERE id = ?1)
        INSERT INTO chunks (trial, number, frames, checksum)
        VALUES (?1, (SELECT number FROM new), ?2, (SELECT checksum(uid, number, ?2) FROM new))";
    transaction.execute(sql, params![id, encode_frames(frames)])?;
    count_chunk(transaction, id, frames.len())
}

/// Counts a chunk that was added, and its samples.
pub(super) fn count_chunk(transaction: &Transaction<'_>, id: TrialId, samples: usize) -> rusqlite::Result<()> {
    let sql = "UPDATE trials SET samples = samples + ?2, chunks = chunks + 1 WHERE id = ?1";
    transaction.execute(sql, params![id, samples as i64]).map(drop)
}

/// Object and seed of a trial; a damaged name is that of no object.
fn object_and_seed(row: &Row<'_>) -> rusqlite::Result<(String, u64)> {
    let object = row.get_ref(0)?.as_bytes().map_or_else(|_| String::new(), |name| String::from_utf8_lossy(name).into());
    Ok((object, row.get::<_, i64>(1)?.cast_unsigned()))
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

/// True for a file on a network file system, as far as the system reports it (Linux).
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
