//! Stored results of studies: small JSON files in the repository, from which manual, README and window take their
//! numbers.

use super::result_file::{ResultFileError, program};
use super::shipped::shipped_json;
use palpate_learn::REMOVED_METHODS;
use palpate_store::{FileKind, write_whole};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::path::Path;

/// Result of a study with its origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredStudy<R> {
    /// Command that repeats it.
    pub command: String,
    /// Version of the program, and a fingerprint of its physics.
    pub program: String,
    /// CPU time that it took (h).
    pub cpu_hours: f64,
    pub result: R,
}

impl<R: Serialize + DeserializeOwned> StoredStudy<R> {
    /// A result of this program.
    pub fn new(command: &str, cpu_hours: f64, result: R) -> Self {
        Self { command: command.to_owned(), program: program(), cpu_hours: rounded(cpu_hours), result }
    }

    /// Reads a stored result. Methods that are gone are marked with the last version that had them.
    pub fn parse(json: &str) -> Result<Self, serde_json::Error> {
        let mark = |json: String, key: &&str| json.replace(key, &format!("{key} (0.1.0)"));
        serde_json::from_str(&REMOVED_METHODS.iter().fold(json.to_owned(), mark))
    }

    /// The result of the full run of a study that comes with the program; none where it has not been run in full.
    pub fn shipped(key: &str) -> Result<Option<Self>, serde_json::Error> {
        shipped_json(key).map(Self::parse).transpose()
    }

    /// Writes it, an element of a list per line.
    pub fn write(&self, path: &Path) -> Result<(), ResultFileError> {
        let text = serde_json::to_string(self).map(|text| text.replace("},{", "},\n{"));
        let text = text.map_err(|cause| ResultFileError::Unwritable { cause })?;
        write_whole(path, FileKind::Json, (text + "\n").as_bytes()).map_err(|cause| ResultFileError::File {
            attempt: "write",
            path: path.to_owned(),
            cause,
        })
    }

    /// Origin of the result, as a line below a table or picture.
    pub fn origin(&self) -> String {
        let today = program();
        let older = if self.program == today { String::new() } else { format!(", not repeated with {today}") };
        format!("`{}`, {}, version {}{older}", self.command, cpu_cost(self.cpu_hours), self.program)
    }

    /// The origin without Markdown, for pictures and terminals.
    pub fn plain_origin(&self) -> String {
        self.origin().replace('`', "")
    }
}

/// CPU time in words (h).
pub fn cpu_cost(hours: f64) -> String {
    let minutes = hours * 60.0;
    if minutes < 2.0 {
        format!("{:.0} CPU seconds", minutes * 60.0)
    } else if minutes < 90.0 {
        format!("{minutes:.0} CPU minutes")
    } else {
        format!("{hours:.1} CPU hours")
    }
}

/// The command that repeats a study, with the options that differ from the usual ones.
#[derive(Clone, Debug)]
pub struct StudyCommand(String);

impl StudyCommand {
    /// `palpate study KEY`.
    pub fn new(key: &str) -> Self {
        Self(format!("palpate study {key}"))
    }

    /// With an option without a value, where it is given.
    #[must_use]
    pub fn flag(self, name: &str, is_given: bool) -> Self {
        if is_given { Self(format!("{} --{name}", self.0)) } else { self }
    }

    /// With an option and its value, where it has one.
    #[must_use]
    pub fn option(self, name: &str, value: Option<impl Display>) -> Self {
        match value {
            Some(value) => Self(format!("{} --{name} {value}", self.0)),
            None => self,
        }
    }

    /// The command.
    pub fn text(&self) -> &str {
        &self.0
    }
}

/// Part of a document between two comments, written from a stored result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeneratedSection {
    /// The document, below the root of the repository.
    pub document: &'static str,
    /// Name in the comments.
    pub name: &'static str,
    /// Its Markdown text.
    pub text: String,
}

impl GeneratedSection {
    /// The document with this section replaced; `None` where it has no such section.
    pub fn put_into(&self, document: &str) -> Option<String> {
        let begin = format!("<!-- {}: written by `cargo run -p palpate-workshop -- tables` -->\n", self.name);
        let end = format!("<!-- end of {} -->\n", self.name);
        let from = document.find(&begin)? + begin.len();
        let to = from + document[from..].find(&end)?;
        Some(format!("{}\n{}\n\n{}", &document[..from], self.text.trim(), &document[to..]))
    }
}

/// Three digits of a number, which is all that a stored result is good for.
pub(crate) fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// A table in Markdown.
pub fn markdown_table(header: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &mut dyn Iterator<Item = &str>| format!("| {} |", cells.collect::<Vec<_>>().join(" | "));
    let mut lines = vec![line(&mut header.iter().copied()), format!("|{}", "---|".repeat(header.len()))];
    lines.extend(rows.iter().map(|row| line(&mut row.iter().map(String::as_str))));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_replaced_and_the_rest_stays() {
        let section = GeneratedSection {
            document: "README.md",
            name: "cost",
            text: markdown_table(&["a", "b"], &[vec!["1".to_owned(), "2".to_owned()]]),
        };
        let begin = "<!-- cost: written by `cargo run -p palpate-workshop -- tables` -->\n";
        let document = format!("before\n{begin}old\n<!-- end of cost -->\nafter\n");
        let wanted = format!("before\n{begin}\n| a | b |\n|---|---|\n| 1 | 2 |\n\n<!-- end of cost -->\nafter\n");
        assert_eq!(section.put_into(&document).as_ref(), Some(&wanted));
        assert_eq!(section.put_into(&wanted).as_ref(), Some(&wanted));
        assert_eq!(section.put_into("no section"), None);
    }

    #[test]
    fn methods_that_are_gone_are_marked() -> Result<(), serde_json::Error> {
        let stored = StoredStudy::new("palpate study models", 1.0, ["svm", "measures-svm"].map(str::to_owned));
        let read = StoredStudy::<[String; 2]>::parse(&serde_json::to_string(&stored)?)?;
        assert_eq!(read.result, ["svm", "measures-svm (0.1.0)"]);
        Ok(())
    }

    #[test]
    fn a_stored_result_is_read_as_written() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("squares.json");
        let stored = StoredStudy::new("palpate study squares", 1.23456, vec![1.5, 2.25]);
        stored.write(&path)?;
        let text = std::fs::read_to_string(&path)?;
        assert_eq!(StoredStudy::parse(&text)?, stored);
        assert!(
            stored.origin().starts_with("`palpate study squares`, 74 CPU minutes, version "),
            "{}",
            stored.origin()
        );
        Ok(())
    }
}
