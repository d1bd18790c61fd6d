//! Errors of the store, as sentences for the user.

use crate::labels::LabelError;
use palpate_tactile::trial::TrialId;
use rusqlite::ErrorCode;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long the store waits for another program that is writing, before [`StoreError::Busy`].
pub(super) const BUSY_TIMEOUT: Duration = Duration::from_secs(10);

/// With less free space than this a disk is full (bytes): SQLite's index of its log is 32 KiB.
const FULL: u64 = 64 << 10;

/// Error of a store: a variant where somebody acts on it.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    #[error("the store is busy: another program has been writing to it for {} s; try again", BUSY_TIMEOUT.as_secs())]
    Busy,
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
    #[error(
        "{what}. Take the store from a backup, or delete this trial: palpate trials delete {id}. Other trials are not \
         affected"
    )]
    Damaged {
        /// Number of the trial.
        id: TrialId,
        /// Damage, with the number of the trial.
        what: String,
    },
    #[error("{0}")]
    NotOfBoard(String),
    #[error("{0}")]
    Refused(String),
}

impl From<LabelError> for StoreError {
    fn from(error: LabelError) -> Self {
        Self::Refused(error.to_string())
    }
}

impl StoreError {
    /// A trial whose description cannot be read.
    pub(super) fn bad_info(id: TrialId, cause: impl Display) -> Self {
        Self::Damaged { id, what: format!("the description of trial {id} is damaged: {cause}") }
    }

    /// A trial whose row does not match its checksum.
    pub fn altered(id: TrialId) -> Self {
        Self::bad_info(id, "it does not match its checksum")
    }

    /// A trial whose data differ from their checksum.
    pub(super) fn checksum(id: TrialId, what: &str, chunk: i64) -> Self {
        Self::Damaged {
            id,
            what: format!("trial {id} is damaged: its {what}, part {chunk}, do not match their checksum"),
        }
    }

    /// A store that cannot be opened.
    pub(super) fn open(path: &Path, cause: impl Display) -> Self {
        Self::Refused(format!("cannot open the store \"{}\": {cause}", path.display()))
    }

    /// A trial that is not there, and where it might be.
    pub fn no_trial(id: TrialId, hint: &str) -> Self {
        Self::Refused(format!("no trial {id} in the store{hint}"))
    }

    /// A file of another program, or no database at all.
    pub(super) fn foreign(path: &Path) -> Self {
        Self::Refused(format!("\"{}\" is not a store of Palpate; choose another file with --store", path.display()))
    }

    /// True where one trial is damaged and others are not affected.
    pub fn is_damage(&self) -> bool {
        matches!(self, Self::Damaged { .. })
    }
}

/// Translates an error of reading the row of one trial.
pub(super) fn row_fault(path: &Path, id: TrialId, error: &rusqlite::Error) -> StoreError {
    match error.sqlite_error_code() {
        Some(_) => fault(path, error),
        None => StoreError::bad_info(id, error),
    }
}

/// Translates an error of SQLite.
pub(super) fn fault(path: &Path, error: &rusqlite::Error) -> StoreError {
    let full = "the disk with the store is full. Free some space and try again; trials stored earlier are safe";
    let path_name = path.display();
    match error.sqlite_error_code() {
        Some(ErrorCode::NotADatabase) => StoreError::foreign(path),
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => StoreError::Busy,
        Some(ErrorCode::DiskFull) => StoreError::Refused(full.to_owned()),
        // Without room for its log, SQLite cannot even read, and does not say why.
        Some(ErrorCode::SystemIoFailure) if is_full(path) => StoreError::Refused(full.to_owned()),
        Some(ErrorCode::ReadOnly) => StoreError::Refused(format!(
            "the store \"{path_name}\" cannot be written: it or its folder is read-only. Choose another with --store"
        )),
        Some(ErrorCode::DatabaseCorrupt) => StoreError::Refused(format!(
            "the store \"{path_name}\" is damaged or cut short. Take it from a backup; `sqlite3 FILE .recover` may save what is \
             left"
        )),
        Some(ErrorCode::CannotOpen | ErrorCode::PermissionDenied) => {
            StoreError::Refused(format!("the store \"{path_name}\" cannot be opened: it or its folder may not be read"))
        }
        Some(ErrorCode::SystemIoFailure) => StoreError::Refused(format!(
            "the disk with the store \"{path_name}\" does not answer as it should ({}); check it, and take a backup",
            plain(error)
        )),
        Some(ErrorCode::ConstraintViolation) => StoreError::Refused(format!(
            "the store \"{path_name}\" does not take this ({}); check the date of this computer, and that no other program \
             has changed the store",
            plain(error)
        )),
        _ => StoreError::Refused(format!(
            "the store \"{path_name}\" cannot be used ({}); it may be damaged, or changed by another program: take it from a \
             backup",
            plain(error)
        )),
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
