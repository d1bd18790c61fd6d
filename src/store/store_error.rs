//! What can go wrong with the store, in sentences for the user.

use super::blob::BlobError;
use super::calibrations::CalibrationId;
use super::disk::is_full;
use super::store::{PATIENCE, SCHEMA_VERSION};
use crate::labels::{ClassNameError, PlanError, shown_name};
use palpate_tactile::trial::TrialId;
use rusqlite::ErrorCode;
use std::path::{Path, PathBuf};

/// Why the store cannot do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The folder cannot be made.
    #[error("cannot make the folder \"{path}\" for the store: {cause}", path = path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        cause: String,
    },
    /// SQLite cannot open the file.
    #[error("cannot open the store \"{path}\": {cause}", path = path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What SQLite says.
        cause: String,
    },
    /// A file of another program, or no database at all.
    #[error("\"{path}\" is not a store of Palpate's; choose another file with --store", path = path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// Written by a newer program.
    #[error(
        "\"{path}\" was written by a newer Palpate (store version {found}, this program knows {SCHEMA_VERSION}); \
         update Palpate",
        path = path.display()
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: i32,
    },
    /// Another program has kept the store locked.
    #[error("the store is busy: another program has been writing to it for {} s; try again", PATIENCE.as_secs())]
    Busy,
    /// No space is left.
    #[error("the disk is full: the trial was not stored. Free some space and record again; earlier trials are safe")]
    DiskFull,
    /// Too little space is left to begin.
    #[error(
        "the disk with the store \"{path}\" has {free_mb} MB free; the trial may need {needed_mb} MB and was not begun. Free \
         some space, or choose another disk with --store",
        path = path.display()
    )]
    NoRoom {
        /// The store.
        path: PathBuf,
        /// What is free (MB).
        free_mb: u64,
        /// What may be needed (MB).
        needed_mb: u64,
    },
    /// The file cannot be written.
    #[error("the store \"{path}\" cannot be written: it or its folder is read-only", path = path.display())]
    ReadOnly {
        /// The file.
        path: PathBuf,
    },
    /// No such trial.
    #[error("there is no trial {id} in the store{hint}")]
    NoTrial {
        /// The number asked for.
        id: TrialId,
        /// Where it might be.
        hint: &'static str,
    },
    /// A trial to be restored that is there.
    #[error("trial {id} is not deleted")]
    NotDeleted {
        /// The trial.
        id: TrialId,
    },
    /// A trial whose frames cannot be read.
    #[error("trial {id} is damaged in its part {chunk}: {cause}")]
    Damaged {
        /// The trial.
        id: TrialId,
        /// Which chunk.
        chunk: i64,
        /// What is wrong with it.
        cause: BlobError,
    },
    /// A trial whose description cannot be read.
    #[error("the description of trial {id} is damaged: {cause}")]
    BadInfo {
        /// The trial.
        id: TrialId,
        /// What is wrong with it.
        cause: String,
    },
    /// No such calibration.
    #[error("there is no calibration {id} in the store; `palpate calibrate list` shows what is there")]
    NoCalibration {
        /// The number asked for.
        id: CalibrationId,
    },
    /// A calibration that cannot be read.
    #[error("calibration {id} is damaged: {cause}")]
    BadCalibration {
        /// The calibration.
        id: CalibrationId,
        /// What is wrong with it.
        cause: String,
    },
    /// A text that cannot be a label.
    #[error(transparent)]
    ClassName(#[from] ClassNameError),
    /// A plan that cannot be.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A trial whose label is not for people to give.
    #[error(
        "trial {id} is of \"{object}\" by itself (it comes from \"{rig}\"): only trials of the real gripper are labelled",
        object = shown_name(object)
    )]
    NotOfBoard {
        /// The trial.
        id: TrialId,
        /// What it is of.
        object: String,
        /// Where it comes from.
        rig: String,
    },
    /// A note that is no note any more.
    #[error("a note of {length} characters is too long: {most} are allowed; write what belongs elsewhere into a file")]
    LongNote {
        /// Its length (characters).
        length: usize,
        /// What is allowed (characters).
        most: usize,
    },
    /// Probabilities that are none.
    #[error("what \"{model}\" said is not kept: its probabilities do not lie between 0 and 1, or sum to {sum}")]
    BadGuess {
        /// The model.
        model: String,
        /// What they sum to.
        sum: f64,
    },
    /// Another program was there first.
    #[error(
        "\"{wanted}\" of trial {id} is not taken back: another program has changed the trial since ({since}). Look at it; \
         what was done before can still be taken back"
    )]
    ChangedMeanwhile {
        /// The trial.
        id: TrialId,
        /// What was to be taken back.
        wanted: String,
        /// What was done since.
        since: String,
    },
    /// Anything else SQLite reports.
    #[error("the store \"{path}\" reports: {cause}", path = path.display())]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// What SQLite says.
        cause: String,
    },
}

/// SQLite's faults in the words of this program.
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

pub(super) fn plain(error: &rusqlite::Error) -> String {
    match error {
        rusqlite::Error::SqliteFailure(_, Some(message)) => message.clone(),
        other => other.to_string(),
    }
}
