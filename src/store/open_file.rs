//! The file of an open store. Where somebody deletes, replaces or cuts it while it is open, SQLite goes on writing to what
//! nobody can find any more; this notices.

use super::store_error::StoreError;
use std::cell::Cell;
use std::fs::Metadata;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// The file as it was when it was looked at last.
#[derive(Debug)]
pub(super) struct OpenFile {
    path: PathBuf,
    identity: Identity,
    /// Length (bytes); a store becomes shorter only as a whole, by [`Store::purge`](crate::Store::purge).
    length: Cell<u64>,
}

impl OpenFile {
    /// The file at an absolute path, which has just been opened.
    pub(super) fn at(path: PathBuf) -> Result<Self, StoreError> {
        let file = std::fs::metadata(&path);
        let file = file.map_err(|e| StoreError::open(&path, e))?;
        Ok(Self { path, identity: identity(&file), length: Cell::new(file.len()) })
    }

    /// Absolute path of the file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Fails where the path does not lead to the whole file any more.
    pub(super) fn check(&self) -> Result<(), StoreError> {
        let lost = |event| StoreError::FileLost { path: self.path.clone(), event };
        let file = std::fs::metadata(&self.path).map_err(|_gone| lost("deleted or moved"))?;
        if identity(&file) != self.identity {
            return Err(lost("replaced by another file"));
        }
        if file.len() < self.length.get() && stated_length(&self.path) != Some(file.len()) {
            return Err(lost("cut short"));
        }
        self.length.set(file.len());
        Ok(())
    }
}

/// Length of a database that its header states (bytes): the size of a page and the number of pages.
fn stated_length(path: &Path) -> Option<u64> {
    let mut header = [0; 32];
    std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut header)).ok()?;
    let page = match u16::from_be_bytes([header[16], header[17]]) {
        1 => 65_536,
        size => u64::from(size),
    };
    Some(page * u64::from(u32::from_be_bytes([header[28], header[29], header[30], header[31]])))
}

/// Device and number of a file.
#[cfg(unix)]
type Identity = (u64, u64);
#[cfg(unix)]
fn identity(file: &Metadata) -> Identity {
    use std::os::unix::fs::MetadataExt as _;
    (file.dev(), file.ino())
}

/// Windows lets nobody delete or replace a file that SQLite has open.
#[cfg(not(unix))]
type Identity = ();
#[cfg(not(unix))]
fn identity(_file: &Metadata) -> Identity {}
