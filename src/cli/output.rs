//! Files that commands write: whole or not at all, into folders that exist.

use super::Failure;
use palpate_store::NewFile;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Writes a file.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let write = || {
        let mut file = NewFile::create(path)?;
        file.write_all(bytes)?;
        file.finish()
    };
    check_folder(path)?;
    write().map_err(|cause: std::io::Error| format!("cannot write \"{}\": {cause}", path.display()).into())
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
            Err(format!("cannot write \"{path}\": there is no folder \"{folder}\". Create it, or choose another --out")
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
