//! Files that commands write: whole or not at all, into folders that exist.

use super::Failure;
use clap::builder::{PathBufValueParser, TypedValueParser};
use palpate_exchange::FORMATS;
use palpate_store::{FileKind, check_target, write_whole};
use std::path::{Path, PathBuf};

/// Writes a file.
pub(super) fn write_new(path: &Path, kind: FileKind, bytes: &[u8]) -> Result<(), Failure> {
    write_whole(path, kind, bytes).map_err(|cause| cannot(path, &cause))
}

/// Failure to write a file or folder.
pub(super) fn cannot(path: &Path, cause: &std::io::Error) -> Failure {
    format!("cannot write \"{}\": {cause}", path.display()).into()
}

/// Parser of the name of a file to write, whose ending stands for one of these kinds.
pub(super) fn file_of(kinds: &'static [FileKind]) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| checked(path, kinds, false))
}

/// Parser of the name of a file of one of these kinds, or of a folder.
pub(super) fn file_or_folder(kinds: &'static [FileKind]) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| checked(path, kinds, true))
}

/// Parser of the name of a file or folder for trials.
pub(super) fn trials_target() -> impl TypedValueParser<Value = PathBuf> {
    let kinds: Vec<FileKind> = FORMATS.iter().map(|format| format.kind()).collect();
    PathBufValueParser::new().try_map(move |path| checked(path, &kinds, true))
}

const UNKNOWN: &str = "no format has this ending; ";

/// Refuses a name with an ending that none of the kinds has. A folder's name has none, unless the folder exists, or nothing but
/// a folder can be meant: then only the ending of a known kind is refused.
fn checked(path: PathBuf, kinds: &[FileKind], folder: bool) -> Result<PathBuf, String> {
    let is_file = || {
        let others = FORMATS.iter().map(|format| format.kind());
        FileKind::of(&path, &FileKind::ALL.into_iter().chain(others).collect::<Vec<_>>()).is_some()
    };
    let is_folder = || names_folder(&path) || (kinds.is_empty() && !is_file());
    if FileKind::of(&path, kinds).is_some() || (folder && is_folder()) {
        return Ok(path);
    }
    if kinds.is_empty() {
        return Err("it is the name of a file; choose that of a folder".to_owned());
    }
    let mut choices: Vec<String> =
        kinds.iter().flat_map(|kind| kind.endings()).map(|ending| format!(".{ending}")).collect();
    choices.dedup();
    choices.extend(folder.then(|| "a folder, whose name has no ending".to_owned()));
    Err(format!("{UNKNOWN}choose {}", choices.join(", ")))
}

/// True for a name without ending, and for that of a folder.
pub(super) fn names_folder(path: &Path) -> bool {
    path.extension().is_none() || path.is_dir() || path.to_string_lossy().ends_with(std::path::is_separator)
}

/// Refuses, before any work is done for it, a path in a folder that does not exist, or in the place of something else.
pub(super) fn check_new(path: &Path, kind: FileKind) -> Result<(), Failure> {
    check_folder(path)?;
    check_replaced(path, kind)
}

/// Refuses a path in the place of something else.
pub(super) fn check_replaced(path: &Path, kind: FileKind) -> Result<(), Failure> {
    check_target(path, kind).map_err(|cause| cannot(path, &cause))
}

/// Makes a folder that the user named for files, but not the folders above it.
pub(super) fn make_folder(folder: &Path) -> Result<(), Failure> {
    match std::fs::create_dir(folder) {
        Err(_) if folder.is_dir() => Ok(()),
        Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => check_folder(folder),
        made => made.map_err(|cause| format!("cannot make the folder \"{}\": {cause}", folder.display()).into()),
    }
}

/// Refuses a path in a folder that does not exist, before any work is done for it.
pub(super) fn check_folder(path: &Path) -> Result<(), Failure> {
    match path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
        Some(folder) => {
            let (path, folder) = (path.display(), folder.display());
            Err(format!(
                "cannot write \"{path}\": there is no folder \"{folder}\". Create it, or choose another folder"
            )
            .into())
        }
        None => Ok(()),
    }
}

/// A folder in the system's place for temporary files, which is removed at the end.
pub(super) struct TemporaryFolder(PathBuf);

impl TemporaryFolder {
    pub(super) fn new() -> Result<Self, Failure> {
        let path = std::env::temp_dir().join(format!("palpate-window-{}", std::process::id()));
        std::fs::create_dir_all(&path)?;
        Ok(Self(path))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        // The system removes what is left behind.
        let _gone = std::fs::remove_dir_all(&self.0);
    }
}
