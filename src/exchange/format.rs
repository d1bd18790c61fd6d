//! What a file format of trials is.

use crate::mapping::Mapping;
use palpate_lab::inspection::{OpenOptions, OpenTrialError};
use palpate_store::{FileKind, ImportedTrial, NewFile, NewFolder, Store, StoreError};
use palpate_tactile::LayoutError;
use palpate_tactile::trial::TrialId;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A file format of trials.
pub trait TrialFormat: Sync {
    /// Kind of its files, by whose ending it is chosen.
    fn kind(&self) -> FileKind;

    /// Writes trials to a file, which appears whole or not at all, or where each trial has its own, into a folder.
    fn write(&self, export: &TrialExport<'_>, path: &Path) -> Result<Written, ExchangeError>;

    /// Reads the trials of a file. The mapping gives columns their roles, and a label to a file that has none.
    fn read(&self, path: &Path, mapping: &Mapping) -> Result<Import, ImportError>;

    /// Names of the columns that a mapping gives roles; none where their roles are given.
    fn columns(&self, _path: &Path, _mapping: &Mapping) -> Result<Vec<String>, ImportError> {
        Ok(Vec::new())
    }
}

/// Trials to be written.
pub struct TrialExport<'a> {
    /// Store that has them.
    pub store: &'a Store,
    /// The trials.
    pub ids: &'a [TrialId],
    /// Sensors through which simulated trials are read, and the models whose answers are written where there is a place.
    pub options: &'a OpenOptions,
    /// Write the force on every taxel of simulated trials as well.
    pub taxels: bool,
    /// Asked before each trial; true ends the export.
    pub is_stopped: &'a dyn Fn() -> bool,
}

impl TrialExport<'_> {
    /// Numbers of the trials, one by one, until the export is stopped.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = Result<TrialId, ExchangeError>> {
        self.ids.iter().map(|id| if (self.is_stopped)() { Err(ExchangeError::Stopped) } else { Ok(*id) })
    }
}

/// Outcome of an export.
#[derive(Debug)]
pub struct Written {
    /// The files.
    pub files: Vec<PathBuf>,
    /// Damaged trials, with the reason.
    pub left_out: Vec<(TrialId, String)>,
}

impl Written {
    /// One file with all trials.
    pub(crate) fn whole(path: &Path) -> Self {
        Self { files: vec![path.to_owned()], left_out: Vec::new() }
    }
}

/// Trials of an imported file.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// Trials in the order in which they begin in the file.
    pub trials: Vec<ImportedTrial>,
    /// Changes and doubtful values, one sentence each.
    pub warnings: Vec<String>,
}

/// Reason why trials are not written.
#[derive(Debug, thiserror::Error)]
pub enum ExchangeError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Open(#[from] OpenTrialError),
    #[error(transparent)]
    Layout(#[from] LayoutError),
    #[error("{0}")]
    Refused(String),
    /// The user ended it.
    #[error("stopped; nothing was written")]
    Stopped,
}

impl ExchangeError {
    /// A file or folder that cannot be written.
    pub(crate) fn cannot_write(path: &Path, cause: &dyn Display) -> Self {
        Self::Refused(format!("cannot write \"{}\": {cause}", path.display()))
    }
}

/// Begins a file.
pub(crate) fn new_file(path: &Path, kind: FileKind) -> Result<NewFile, ExchangeError> {
    NewFile::create(path, kind).map_err(|cause| ExchangeError::cannot_write(path, &cause))
}

/// Begins a folder, in the place of an empty one or of none.
pub(crate) fn new_folder(folder: &Path) -> Result<NewFolder, ExchangeError> {
    if std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) || folder.is_file() {
        let folder = folder.display();
        return Err(ExchangeError::Refused(format!("\"{folder}\" is not empty; choose an empty or new folder")));
    }
    NewFolder::create(folder).map_err(|cause| ExchangeError::cannot_write(folder, &cause))
}

/// Error of an import, with its place in the file.
#[derive(Debug, thiserror::Error)]
#[error("cannot import \"{name}\"{}: {fault}", line.map(|n| format!(", line {n}")).unwrap_or_default())]
pub struct ImportError {
    /// Name of the file.
    pub name: String,
    /// Line, counted from 1, where the fault has one.
    pub line: Option<u64>,
    /// The fault, as a sentence with advice.
    pub fault: String,
}

impl ImportError {
    /// A fault without a line.
    pub(crate) fn new(name: &str, fault: impl Display) -> Self {
        Self { name: name.to_owned(), line: None, fault: fault.to_string() }
    }

    /// A fault of a file without a line.
    pub(crate) fn of(path: &Path, fault: impl Display) -> Self {
        Self::new(&file_name(path), fault)
    }
}

/// Name of a file without its folder.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}
