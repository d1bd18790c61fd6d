//! A file that appears whole or not at all: written under another name and renamed at the end.

use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file being written. Dropped before [`NewFile::finish`], it leaves nothing.
#[derive(Debug)]
pub struct NewFile {
    path: PathBuf,
    unfinished: PathBuf,
    out: Option<BufWriter<File>>,
}

impl NewFile {
    /// Begins a file. Its folder must exist.
    pub fn create(path: &Path) -> std::io::Result<Self> {
        let unfinished = unfinished(path);
        let out = BufWriter::new(File::create(&unfinished)?);
        Ok(Self { path: path.to_owned(), unfinished, out: Some(out) })
    }

    /// Gives the file its name, replacing one that had it.
    pub fn finish(mut self) -> std::io::Result<()> {
        if let Some(out) = self.out.take() {
            // Closed first: some systems do not rename open files.
            drop(out.into_inner().map_err(std::io::IntoInnerError::into_error)?);
            std::fs::rename(&self.unfinished, &self.path).inspect_err(|_cause| self.remove())?;
        }
        Ok(())
    }

    fn remove(&self) {
        // Nothing more can be done about remains that cannot be removed.
        let _gone = std::fs::remove_file(&self.unfinished);
    }

    fn out(&mut self) -> std::io::Result<&mut BufWriter<File>> {
        self.out.as_mut().ok_or_else(|| std::io::Error::other("the file is closed"))
    }
}

/// Name of an unfinished file or folder beside its place, on the same disk.
pub fn unfinished(path: &Path) -> PathBuf {
    let name = path.file_name().map_or_else(|| "export".into(), |name| name.to_string_lossy().into_owned());
    path.with_file_name(format!(".{name}.{}.unfinished", std::process::id()))
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.out()?.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out()?.flush()
    }
}

impl Seek for NewFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.out()?.seek(to)
    }
}

impl Drop for NewFile {
    fn drop(&mut self) {
        if self.out.take().is_some() {
            self.remove();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_whole_or_not_at_all() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("out.bin");
        std::fs::write(&path, b"old")?;
        let mut file = NewFile::create(&path)?;
        file.write_all(b"half")?;
        drop(file);
        assert_eq!(std::fs::read(&path)?, b"old");
        let mut file = NewFile::create(&path)?;
        file.write_all(b"whole")?;
        file.finish()?;
        assert_eq!(std::fs::read(&path)?, b"whole");
        assert_eq!(std::fs::read_dir(folder.path())?.count(), 1);
        assert!(NewFile::create(&folder.path().join("no/such/folder.bin")).is_err());
        Ok(())
    }
}
