//! Anybody's recorded grasps from one CSV file: one row per sample, one column per sensor channel.
//!
//! ```text
//! trial,label,t_s,pressure_left [Pa],pressure_right [Pa]
//! 1,apple,0.00,102.5,99.1
//! 1,apple,0.01,103.0,99.4
//! 2,lemon,0.00,101.9,98.7
//! 2,lemon,0.01,110.2,97.5
//! ```
//!
//! - Needed are `trial` (any name, one per grasp), `label` (what was held) and `t_s` (s); `size` (tiny, large) and
//!   `shape` (cubic, cylindrical, spherical) may follow. Every other column is a channel. The order is free, capitals
//!   do not matter for these five, and a unit in brackets after a name is not part of it.
//! - Fields are separated by commas, semicolons or tabs. With the latter two, numbers may have decimal commas.
//! - Rows of a trial need not stand together, but its times rise. Of equal times the last row counts.
//! - A missing reading is an empty field or `nan`, and is interpolated. A column without any number is left out.
//! - Trials at another rate than most, or with uneven times, are resampled; even trials stay exactly as they are.
//!
//! What was changed is told in [`Import::warnings`]; what cannot be understood is an [`ImportError`] with its line. The
//! limits below bound the memory that any file can ask for.

mod columns;
mod fields;
mod import_error;
mod resample;
mod rows;
mod source;
mod trials;

#[cfg(test)]
mod error_tests;
#[cfg(test)]
mod property_tests;
#[cfg(test)]
mod tests;

pub use import_error::{ImportError, ImportFault};

use columns::Columns;
use csv::ByteRecord;
use fields::Numbers;
use import_error::Located;
use palpate_tactile::Signals;
use rows::Rows;
use source::Source;
use std::io::Read;
use std::path::Path;

/// Files larger than this are refused (bytes).
const LARGEST_FILE: u64 = 2 << 30;

/// Rows longer than this are refused (bytes): two hundred channels take a few thousand.
const LONGEST_ROW: u64 = 1 << 20;

/// Names longer than this are refused (characters).
const LONGEST_NAME: usize = 200;

/// More channels than this are refused.
const MOST_CHANNELS: usize = 200;

/// More trials than this are refused.
const MOST_TRIALS: usize = 1_000_000;

/// Longer trials are refused (samples), before and after resampling: at 100 Hz, almost three hours.
const MOST_SAMPLES: usize = 1_000_000;

/// More readings in all are refused, before and after resampling: they take 0.8 GB.
const MOST_VALUES: usize = 200_000_000;

/// Times beyond this are refused (s). Seconds since 1970 are below it, milliseconds since 1970 above; and a double
/// still tells milliseconds apart.
const FARTHEST_TIME_S: f64 = 1e11;

/// What a file of grasps holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The trials, in the order in which they begin in the file, all with the same channels.
    pub trials: Vec<ImportedTrial>,
    /// What was changed or looks doubtful, one sentence each.
    pub warnings: Vec<String>,
}

/// One recorded grasp from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedTrial {
    /// What the file calls it.
    pub name: String,
    /// What was held, as written.
    pub label: String,
    /// Size of the object, where the file says it for the label: `tiny` or `large`.
    pub size: Option<String>,
    /// Shape of the object, where the file says it for the label: `cubic`, `cylindrical` or `spherical`.
    pub shape: Option<String>,
    /// The readings: at least two samples, all finite, times as in the file or even from its first one on.
    pub signals: Signals,
}

/// Reads a file of grasps.
pub fn read_trials_csv(path: &Path) -> Result<Import, ImportError> {
    let name = path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
    let fail = |fault| ImportError { name: name.clone(), line: None, fault };
    let unreadable = |cause: std::io::Error| fail(ImportFault::Unreadable { cause: cause.to_string() });
    let file = std::fs::File::open(path).map_err(unreadable)?;
    if file.metadata().map_err(unreadable)?.len() > LARGEST_FILE {
        return Err(fail(ImportFault::FileTooLarge));
    }
    read_trials(file, &name)
}

/// Reads grasps from wherever they come; `name` stands in error messages.
pub fn read_trials(reader: impl Read, name: &str) -> Result<Import, ImportError> {
    let located = |Located { line, fault }| ImportError { name: name.to_owned(), line, fault };
    read_all(Source::new(reader)).map_err(located)
}

fn read_all<R: Read>(mut source: Source<R>) -> Result<Import, Located> {
    let separator = columns::separator(source.head().map_err(source::fault)?);
    let numbers = Numbers { decimal_comma: separator != b',' };
    let mut reader =
        csv::ReaderBuilder::new().delimiter(separator).has_headers(false).flexible(true).from_reader(source);
    let mut record = ByteRecord::new();
    let Some(line) = next_row(&mut reader, &mut record)? else {
        return Err(ImportFault::Empty { what: "header" }.into());
    };
    let columns = Columns::find(&record).map_err(|fault| fault.at(line))?;
    let mut rows = Rows::new(&columns, numbers);
    while let Some(line) = next_row(&mut reader, &mut record)? {
        rows.add(line, &record)?;
    }
    if rows.trials.is_empty() {
        return Err(ImportFault::Empty { what: "row below its header" }.into());
    }
    let mut warnings = Vec::new();
    if let Some(first) = columns.nameless.first() {
        let others = columns.nameless.len() - 1;
        let others = if others > 0 { format!(" (and {others} more)") } else { String::new() };
        warnings.push(format!("column {first}{others} has no name in the header and was left out"));
    }
    let names: Vec<String> = columns.channels.iter().map(|(_, name)| name.clone()).collect();
    let trials = trials::finish(rows, &names, &mut warnings)?;
    Ok(Import { trials, warnings })
}

/// Reads the next row that is not blank and returns the line on which it begins, or `None` at the end.
fn next_row<R: Read>(reader: &mut csv::Reader<Source<R>>, record: &mut ByteRecord) -> Result<Option<u64>, Located> {
    loop {
        reader.get_mut().row_begins();
        // Where reading stops is the line after the row; where it starts may be a blank line before it.
        let more = reader.read_byte_record(record);
        let breaks = record.as_slice().iter().filter(|byte| **byte == b'\n').count() as u64;
        let line = reader.position().line().saturating_sub(1 + breaks).max(1);
        match more {
            Ok(false) => return Ok(None),
            Ok(true) if columns::is_blank(record) => {}
            Ok(true) => return Ok(Some(line)),
            Err(error) => {
                let fault = match error.into_kind() {
                    csv::ErrorKind::Io(cause) => source::fault(cause),
                    other => ImportFault::Unreadable { cause: format!("{other:?}") },
                };
                return Err(fault.into());
            }
        }
    }
}
