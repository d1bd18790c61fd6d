//! Files of studies in a folder: finished units, results, tables and figures.

use super::report::{LinkedFigure, StudyTable};
use super::result_file::ResultFileError;
use super::stored_study::StoredStudy;
use palpate_lab::grasping::Shard;
use palpate_store::{FileKind, write_whole};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io;
use std::path::{Path, PathBuf};

/// Folder of results: that of the command line, or one of those beside the store, which the window uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StudyFolder(PathBuf);

impl StudyFolder {
    /// A folder; it is made when something is written.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self(path.into())
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// File of finished units of a study.
    pub fn units(&self, key: &str) -> PathBuf {
        self.0.join(format!("{key}.jsonl"))
    }

    /// File of finished units of a part of a study.
    pub fn part(&self, key: &str, shard: Shard) -> PathBuf {
        match shard {
            Shard::WHOLE => self.units(key),
            shard => self.0.join(format!("{key}.{}.jsonl", shard.to_string().replace('/', "-of-"))),
        }
    }

    fn result(&self, key: &str) -> PathBuf {
        self.0.join(format!("{key}.json"))
    }

    /// True where a study has finished units.
    pub fn has_begun(&self, key: &str) -> bool {
        self.units(key).is_file()
    }

    /// Removes the finished units of a study; its result stays until there is a new one.
    pub fn forget_units(&self, key: &str) -> Result<(), ResultFileError> {
        let path = self.units(key);
        match std::fs::remove_file(&path) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                Err(ResultFileError::File { attempt: "remove", path, cause })
            }
            _ => Ok(()),
        }
    }

    /// Result of a study; none where it is not finished.
    pub fn read<R: Serialize + DeserializeOwned>(&self, key: &str) -> Result<Option<StoredStudy<R>>, ResultFileError> {
        let path = self.result(key);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(cause) => return Err(ResultFileError::File { attempt: "read", path, cause }),
        };
        let parsed = StoredStudy::parse(&text).map_err(io::Error::from);
        parsed.map(Some).map_err(|cause| ResultFileError::File { attempt: "read", path, cause })
    }

    /// Writes a result, each of its tables (CSV) and each of its figures, which `draw` draws as SVG. Returns the names of
    /// the files.
    pub fn write<R: Serialize + DeserializeOwned>(
        &self,
        key: &str,
        stored: &StoredStudy<R>,
        tables: &[StudyTable],
        figures: impl IntoIterator<Item = LinkedFigure>,
        draw: &dyn Fn(&LinkedFigure) -> io::Result<String>,
    ) -> Result<Vec<String>, ResultFileError> {
        let mut names = vec![format!("{key}.json")];
        stored.write(&self.result(key))?;
        let mut put = |name: String, kind: FileKind, text: io::Result<String>| {
            let path = self.0.join(&name);
            let written = text.and_then(|text| write_whole(&path, kind, text.as_bytes()));
            names.push(name);
            written.map_err(|cause| ResultFileError::File { attempt: "write", path, cause })
        };
        for table in tables {
            put(format!("{}.csv", table.name), FileKind::Csv, Ok(table.csv()))?;
        }
        for linked in figures {
            let linked = linked.with_note(&stored.plain_origin());
            put(format!("{}.svg", linked.name), FileKind::Svg, draw(&linked))?;
        }
        Ok(names)
    }
}
