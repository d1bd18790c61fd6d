//! Recorded grasps from one CSV file: one row per sample, one column per sensor channel.
//!
//! ```text
//! trial,label,t_s,pressure_left [Pa],pressure_right [Pa]
//! 1,apple,0.00,102.5,99.1
//! 1,apple,0.01,103.0,99.4
//! 2,lemon,0.00,101.9,98.7
//! 2,lemon,0.01,110.2,97.5
//! ```
//!
//! - Required are `trial` (any name, one per grasp), `label` (the object) and `t_s` (s); `size` (tiny, large) and `shape`
//!   (cubic, cylindrical, spherical) are optional. Every other column is a channel. Columns may have any order, capitals do
//!   not matter for these five, and a unit in brackets after a name is not part of it.
//! - Fields are separated by commas, semicolons or tabs. With the latter two, numbers may have decimal commas.
//! - Rows of different trials may alternate, but the times of a trial rise. Of equal times the last row counts.
//! - A missing reading is an empty field or `nan`, and is interpolated. A column without any number is left out.
//! - Trials at another rate than most, or with uneven times, are resampled; even trials stay unchanged.
//!
//! [`Import::warnings`] lists every change; an invalid file is an [`ImportError`] with its line. The limits below bound the
//! memory that any file can ask for.

mod date_time;
mod mend;
mod resample;
mod rows;
mod table;

#[cfg(test)]
mod error_tests;
#[cfg(test)]
mod property_tests;
#[cfg(test)]
mod tests;

use crate::format::{Import, ImportError, file_name};
use crate::mapping::Mapping;
use std::io::Read;
use std::path::Path;

/// Largest file (bytes).
const LARGEST_FILE: u64 = 2 << 30;

/// Longest row (bytes): two hundred channels take a few thousand.
const LONGEST_ROW: u64 = 1 << 20;

/// Longest name (characters).
const LONGEST_NAME: usize = 200;

/// Most channels.
const MOST_CHANNELS: usize = 200;

/// Most trials.
const MOST_TRIALS: usize = 1_000_000;

/// Longest trial (samples), before and after resampling: at 100 Hz, almost three hours.
const MOST_SAMPLES: usize = 1_000_000;

/// Most readings in all, before and after resampling: they take 0.8 GB.
const MOST_VALUES: usize = 200_000_000;

/// Latest time (s). Seconds since 1970 are below it, milliseconds since 1970 above; a double still resolves milliseconds.
const FARTHEST_TIME_S: f64 = 1e11;

/// Reads a file of grasps.
pub(super) fn read_file(path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
    let opened = palpate_geometry::open_regular(path).and_then(|file| Ok((file.metadata()?.len(), file)));
    let fault = match opened {
        Ok((length, _)) if length > LARGEST_FILE => table::file_too_large(),
        Ok((_, file)) => return read_csv(file, &file_name(path), mapping, &mapping.label_of(path)),
        Err(cause) => cause.to_string(),
    };
    Err(ImportError::of(path, fault))
}

/// Names of the columns of a file.
pub(super) fn columns_of(path: &Path, mapping: &Mapping) -> Result<Vec<String>, ImportError> {
    let file = palpate_geometry::open_regular(path).map_err(|cause| ImportError::of(path, cause))?;
    table::columns(file, mapping).map_err(|(line, fault)| ImportError { name: file_name(path), line, fault })
}

/// Reads grasps from any source; `name` stands in error messages, `label` is that of rows without one.
pub(super) fn read_csv(reader: impl Read, name: &str, mapping: &Mapping, label: &str) -> Result<Import, ImportError> {
    let mut warnings = Vec::new();
    let trials =
        rows::read_rows(reader, mapping, label, &mut warnings).and_then(|rows| mend::finish(rows, &mut warnings));
    match trials {
        Ok(trials) => Ok(Import { trials, warnings }),
        Err((line, fault)) => Err(ImportError { name: name.to_owned(), line, fault }),
    }
}

/// Reads grasps from text that was made of a file of another kind, which has no lines.
pub(crate) fn read_made(text: impl Read, name: &str, mapping: &Mapping, label: &str) -> Result<Import, ImportError> {
    read_csv(text, name, mapping, label).map_err(|error| ImportError { line: None, ..error })
}

/// The beginning of a text from the file, with control characters escaped.
fn brief(text: &str) -> String {
    const LENGTH: usize = 60;
    let mut shown: String = text.chars().take(LENGTH).flat_map(char::escape_debug).collect();
    if text.chars().nth(LENGTH).is_some() {
        shown.push_str("...");
    }
    shown
}
