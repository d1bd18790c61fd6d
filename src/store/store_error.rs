//! Errors of the store, as sentences for the user.

use super::frame_blob::BlobError;
use crate::labels::{ClassNameError, PlanError, shown_name};
use palpate_sim::scene::SceneError;
use palpate_tactile::trial::{TrialId, TrialSource};
use rusqlite::ErrorCode;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long the store waits for another program that is writing, before [`StoreError::Busy`].
pub(super) const BUSY_TIMEOUT: Duration = Duration::from_secs(10);

/// With less free space than this a disk is full (bytes): SQLite's index of its log is 32 KiB.
const FULL: u64 = 64 << 10;

/// Error of a store.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The folder cannot be made.
    #[error("cannot create the folder \"{path}\" for the store: {cause}; choose another place with --store", path = path.display())]
    Folder {
        /// Path of the folder.
        path: PathBuf,
        /// Message of the system.
        cause: String,
    },
    /// SQLite cannot open the file.
    #[error("cannot open the store \"{path}\": {cause}", path = path.display())]
    Open {
        /// Path of the store.
        path: PathBuf,
        /// Message of SQLite.
        cause: String,
    },
    /// A file of another program, or no database at all.
    #[error("\"{path}\" is not a store of Palpate; choose another file with --store", path = path.display())]
    Foreign {
        /// Path of the file.
        path: PathBuf,
    },
    /// Written by a newer program.
    #[error(
        "\"{path}\" was written by a newer Palpate (store version {found}, this program reads up to {known}); update \
         Palpate",
        path = path.display()
    )]
    Newer {
        /// Path of the store.
        path: PathBuf,
        /// Its version.
        found: i32,
        /// Newest version that this program reads.
        known: i32,
    },
    /// Written before the tables were released.
    #[error(
        "\"{path}\" was made by an earlier development version of Palpate (store version {found}, this program reads {known}). \
         Commit 29b20e5 still converts it: git checkout 29b20e5 && cargo run --release -- trials list --store \"{path}\"",
        path = path.display()
    )]
    Older {
        /// Path of the store.
        path: PathBuf,
        /// Its version.
        found: i32,
        /// Version that this program reads.
        known: i32,
    },
    /// Another program keeps the store locked.
    #[error("the store is busy: another program has been writing to it for {} s; try again", BUSY_TIMEOUT.as_secs())]
    Busy,
    /// The disk is full.
    #[error("the disk with the store is full. Free some space and try again; trials stored earlier are safe")]
    DiskFull,
    /// The file was deleted, replaced or cut short while it was open.
    #[error(
        "the store \"{path}\" was {event} while it was open: new trials are not in it. Put it back or choose another with \
         --store, then start Palpate again",
        path = path.display()
    )]
    FileLost {
        /// Path of the store.
        path: PathBuf,
        /// Its fate.
        event: &'static str,
    },
    /// Too little space to begin a trial.
    #[error(
        "the disk with the store \"{path}\" has {free_mb} MB free; the trial may need {needed_mb} MB and was not begun. Free \
         some space, or choose another disk with --store",
        path = path.display()
    )]
    NoRoom {
        /// Path of the store.
        path: PathBuf,
        /// Free space (MB).
        free_mb: u64,
        /// Space that may be needed (MB).
        needed_mb: u64,
    },
    /// The file is read-only.
    #[error("the store \"{path}\" cannot be written: it or its folder is read-only. Choose another with --store", path = path.display())]
    ReadOnly {
        /// Path of the store.
        path: PathBuf,
    },
    /// No such trial.
    #[error("no trial {id} in the store{hint}")]
    NoTrial {
        /// Number of the trial.
        id: TrialId,
        /// Where it might be.
        hint: &'static str,
    },
    /// A trial to be restored that is not deleted.
    #[error("trial {id} is not deleted: nothing to restore")]
    NotDeleted {
        /// Number of the trial.
        id: TrialId,
    },
    /// A trial whose frames cannot be decoded.
    #[error("trial {id} is damaged in its part {chunk}: {cause}. {}", remedy(*id))]
    Damaged {
        /// Number of the trial.
        id: TrialId,
        /// Number of the chunk.
        chunk: i64,
        /// Error of the decoder.
        cause: BlobError,
    },
    /// A trial whose data differ from their checksum.
    #[error("trial {id} is damaged: its {what}, part {chunk}, do not match their checksum. {}", remedy(*id))]
    Checksum {
        /// Number of the trial.
        id: TrialId,
        /// Which of its data.
        what: &'static str,
        /// Number of the chunk.
        chunk: i64,
    },
    /// A trial that has lost some of its data.
    #[error("trial {id} is damaged: {found} of its {wanted} {what} are left. {}", remedy(*id))]
    Incomplete {
        /// Number of the trial.
        id: TrialId,
        /// Which of its data.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        wanted: i64,
    },
    /// A trial whose description cannot be read.
    #[error("the description of trial {id} is damaged: {cause}. {}", remedy(*id))]
    BadInfo {
        /// Number of the trial.
        id: TrialId,
        /// Cause.
        cause: String,
    },
    /// A trial whose scene this version cannot read.
    #[error("the scene stored with trial {id} cannot be read: {cause}")]
    Scene {
        /// Number of the trial.
        id: TrialId,
        /// Cause.
        cause: SceneError,
    },
    /// A trial of a source that only a newer program knows.
    #[error("trial {id} comes from \"{name}\", which this version does not know; update Palpate")]
    UnknownSource {
        /// Number of the trial.
        id: TrialId,
        /// Name of its source.
        name: String,
    },
    /// No such calibration.
    #[error("no calibration {id} in the store; `palpate calibrate list` shows all")]
    NoCalibration {
        /// Number of the calibration.
        id: i64,
    },
    /// A calibration that cannot be read.
    #[error("calibration {id} is damaged: {cause}. Withdraw it with `palpate calibrate withdraw {id}`")]
    BadCalibration {
        /// Number of the calibration.
        id: i64,
        /// Cause.
        cause: String,
    },
    /// A text that cannot be a label.
    #[error(transparent)]
    ClassName(#[from] ClassNameError),
    /// An invalid plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A trial whose label cannot be changed.
    #[error(
        "trial {id} is of \"{object}\" and comes from \"{from}\": only trials of the real gripper can be labelled",
        object = shown_name(object),
        from = origin
    )]
    NotOfBoard {
        /// Number of the trial.
        id: TrialId,
        /// Its object.
        object: String,
        /// Its origin.
        origin: TrialSource,
    },
    /// A note that is too long.
    #[error("the note has {length} characters, {most} are allowed; keep longer texts in a file")]
    LongNote {
        /// Its length (characters).
        length: usize,
        /// The limit (characters).
        most: usize,
    },
    /// Invalid probabilities.
    #[error("the prediction of \"{model}\" is not stored: its probabilities are outside 0 to 1, or sum to {sum}")]
    BadGuess {
        /// Name of the model.
        model: String,
        /// Sum of the probabilities.
        sum: f64,
    },
    /// A trial that has changed outside the journal.
    #[error("cannot undo \"{change}\" of trial {id}: the trial has changed since")]
    ChangedMeanwhile {
        /// Number of the trial.
        id: TrialId,
        /// The change to be undone.
        change: String,
    },
    /// Any other error of SQLite.
    #[error("SQLite error in the store \"{path}\": {cause}", path = path.display())]
    Sqlite {
        /// Path of the store.
        path: PathBuf,
        /// Message of SQLite.
        cause: String,
    },
}

impl StoreError {
    /// A trial whose row does not match its checksum.
    pub(super) fn altered(id: TrialId) -> Self {
        Self::BadInfo { id, cause: "it does not match its checksum".to_owned() }
    }

    /// True where one trial is damaged and others are not affected.
    pub fn is_damage(&self) -> bool {
        matches!(self, Self::Damaged { .. } | Self::Checksum { .. } | Self::Incomplete { .. } | Self::BadInfo { .. })
    }
}

/// Advice for every kind of damage.
fn remedy(id: TrialId) -> String {
    format!(
        "Take the store from a backup, or delete this trial: palpate trials delete {id}. Other trials are not affected"
    )
}

/// Translates an error of reading the row of one trial.
pub(super) fn row_fault(path: &Path, id: TrialId, error: &rusqlite::Error) -> StoreError {
    match error.sqlite_error_code() {
        Some(_) => fault(path, error),
        None => StoreError::BadInfo { id, cause: error.to_string() },
    }
}

/// Translates an error of SQLite.
pub(super) fn fault(path: &Path, error: &rusqlite::Error) -> StoreError {
    match error.sqlite_error_code() {
        Some(ErrorCode::NotADatabase) => StoreError::Foreign { path: path.to_owned() },
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => StoreError::Busy,
        Some(ErrorCode::DiskFull) => StoreError::DiskFull,
        // Without room for its log, SQLite cannot even read, and does not say why.
        Some(ErrorCode::SystemIoFailure) if is_full(path) => StoreError::DiskFull,
        Some(ErrorCode::ReadOnly) => StoreError::ReadOnly { path: path.to_owned() },
        _ => StoreError::Sqlite { path: path.to_owned(), cause: plain(error) },
    }
}

/// Message of SQLite without rusqlite's codes.
pub(super) fn plain(error: &rusqlite::Error) -> String {
    match error {
        rusqlite::Error::SqliteFailure(_, Some(message)) => message.clone(),
        other => other.to_string(),
    }
}

/// True where the disk has no room for another page of a store.
fn is_full(store: &Path) -> bool {
    fs4::available_space(folder_of(store)).is_ok_and(|free| free < FULL)
}

/// Folder of a store.
pub(super) fn folder_of(store: &Path) -> &Path {
    store.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
