//! The one way to write what a person names: a file or folder that appears whole or not at all, under a temporary name of its
//! own until it is renamed, and that replaces nothing of another kind.

use super::file_kind::{FileKind, check_target};
use std::collections::hash_map::RandomState;
use std::fs::File;
use std::hash::BuildHasher as _;
use std::io::{self, BufWriter, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file being written. Dropped before [`NewFile::finish`], it leaves nothing.
#[derive(Debug)]
pub struct NewFile {
    path: PathBuf,
    kind: FileKind,
    unfinished: PathBuf,
    out: Option<BufWriter<File>>,
}

impl NewFile {
    /// Begins a file. Its folder must exist, and what has its name already must be of the same kind.
    pub fn create(path: &Path, kind: FileKind) -> io::Result<Self> {
        check_target(path, kind)?;
        let (unfinished, file) = exclusively(path, |name| File::create_new(name))?;
        Ok(Self { path: path.to_owned(), kind, unfinished, out: Some(BufWriter::new(file)) })
    }

    /// Name that it has until it is finished, for another program to write.
    pub fn unfinished(&self) -> &Path {
        &self.unfinished
    }

    /// Gives the file its name, replacing one of its kind, or a symbolic link, that had it.
    pub fn finish(self) -> io::Result<()> {
        self.appear().map(drop)
    }

    /// The same, for others to read while more is written.
    pub fn appear(mut self) -> io::Result<File> {
        let out = self.out.take().ok_or_else(closed)?;
        let written = out.into_inner().map_err(io::IntoInnerError::into_error).and_then(|file| {
            // A store may have appeared there meanwhile.
            check_target(&self.path, self.kind)?;
            std::fs::rename(&self.unfinished, &self.path).map(|()| file)
        });
        written.inspect_err(|_cause| self.remove())
    }

    fn remove(&self) {
        // Nothing more can be done about remains that cannot be removed.
        let _gone = std::fs::remove_file(&self.unfinished);
    }

    fn out(&mut self) -> io::Result<&mut BufWriter<File>> {
        self.out.as_mut().ok_or_else(closed)
    }
}

fn closed() -> io::Error {
    io::Error::other("the file is closed")
}

/// Writes a whole file.
pub fn write_whole(path: &Path, kind: FileKind, bytes: &[u8]) -> io::Result<()> {
    let mut file = NewFile::create(path, kind)?;
    file.write_all(bytes)?;
    file.finish()
}

/// A folder being filled. Dropped before [`NewFolder::finish`], it leaves nothing.
#[derive(Debug)]
pub struct NewFolder {
    path: PathBuf,
    unfinished: PathBuf,
}

impl NewFolder {
    /// Begins a folder, in the place of an empty one or of none.
    pub fn create(path: &Path) -> io::Result<Self> {
        let (unfinished, ()) = exclusively(path, |name| std::fs::create_dir(name))?;
        Ok(Self { path: path.to_owned(), unfinished })
    }

    /// Where its files are written.
    pub fn unfinished(&self) -> &Path {
        &self.unfinished
    }

    /// Gives the folder its name. It replaces an empty folder, but nothing else.
    pub fn finish(self) -> io::Result<()> {
        if self.path.is_dir() {
            std::fs::remove_dir(&self.path)?;
        }
        std::fs::rename(&self.unfinished, &self.path)
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        // Gone where it was finished.
        let _gone = std::fs::remove_dir_all(&self.unfinished);
    }
}

/// A name beside a path, on the same disk, that nobody else has.
fn unfinished(path: &Path) -> PathBuf {
    path.with_file_name(format!(".palpate-{:016x}.unfinished", RandomState::new().hash_one(path)))
}

/// Makes something under such a name; it must fail where something has the name.
fn exclusively<T>(path: &Path, make: impl Fn(&Path) -> io::Result<T>) -> io::Result<(PathBuf, T)> {
    loop {
        let name = unfinished(path);
        match make(&name) {
            Err(cause) if cause.kind() == ErrorKind::AlreadyExists => {}
            made => return made.map(|made| (name, made)),
        }
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out()?.flush()
    }
}

impl Seek for NewFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
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

    fn names(folder: &Path) -> io::Result<Vec<String>> {
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned())).collect()
    }

    #[test]
    fn a_file_appears_whole_or_not_at_all() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("out.csv");
        std::fs::write(&path, b"a,old")?;
        let mut file = NewFile::create(&path, FileKind::Csv)?;
        file.write_all(b"half")?;
        assert!(names(folder.path())?.iter().all(|name| name == "out.csv" || name.starts_with(".palpate-")));
        drop(file);
        assert_eq!(std::fs::read(&path)?, b"a,old");
        write_whole(&path, FileKind::Csv, b"a,whole")?;
        assert_eq!((std::fs::read(&path)?.as_slice(), names(folder.path())?.len()), (&b"a,whole"[..], 1));
        let file = NewFile::create(&path, FileKind::Csv)?;
        std::fs::write(&path, b"SQLite format 3\0")?;
        assert!(file.finish().is_err(), "a store appeared meanwhile");
        assert_eq!((std::fs::read(&path)?.len(), names(folder.path())?.len()), (16, 1));
        assert!(NewFile::create(&folder.path().join("no/such/folder.csv"), FileKind::Csv).is_err());
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_replaced_and_what_it_leads_to_stays() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let (path, target) = (folder.path().join("link.png"), folder.path().join("mine.txt"));
        std::fs::write(&target, "mine")?;
        std::os::unix::fs::symlink(&target, &path)?;
        NewFile::create(&path, FileKind::Png)?.appear()?.write_all(b"\x89PNG")?;
        assert!(path.symlink_metadata()?.is_file() && std::fs::read(&path)? == b"\x89PNG");
        assert_eq!(std::fs::read(&target)?, b"mine");
        Ok(())
    }

    #[test]
    fn a_folder_replaces_an_empty_one_alone() -> io::Result<()> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("set/");
        let filled = || -> io::Result<NewFolder> {
            let new = NewFolder::create(&path)?;
            std::fs::write(new.unfinished().join("a.csv"), "a,b")?;
            Ok(new)
        };
        drop(filled()?);
        assert_eq!(names(folder.path())?.len(), 0);
        std::fs::create_dir(&path)?;
        filled()?.finish()?;
        assert!(filled()?.finish().is_err());
        assert_eq!((names(folder.path())?, names(&path)?), (vec!["set".to_owned()], vec!["a.csv".to_owned()]));
        Ok(())
    }
}
