//! Trials as files of other programs: CSV, MCAP, NPZ, Parquet and data sets of LeRobot.
//!
//! [`FORMATS`] is the one list of formats: command line and window read it. To add a format, write a file with its
//! [`TrialFormat`] and add it to the list.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | `mapping` | which columns of a table are which, profiles of other programs |
//! | 0 | `series` | readings of channels at their own times, and their table |
//! | 0 | `parquet_table` | tables of Parquet, written |
//! | 0 | `glb` | a grasp as an animated model of glTF |
//! | 0 | `taxels` | force on every taxel of both pads, and its place |
//! | 1 | `format` | the trait [`TrialFormat`], what is written and read, errors |
//! | 2 | `content` | a stored trial as other programs see it |
//! | 3 | `card` | cards of data sets, for hubs |
//! | 3 | `urdf` | the gripper for viewers of ROS |
//! | 4 | `csv_files` | CSV of trials, of labelled trials and of calibration points |
//! | 5 | `npz_import` | arrays of numpy as trials |
//! | 6 | `npz`, `parquet` | arrays and tables |
//! | 6 | `mcap` | messages of ROS 2 |
//! | 7 | `lerobot` | data sets of LeRobot |
//!
//! # Example
//!
//! ```
//! use palpate_exchange::{Mapping, read_trials};
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("grasps.csv");
//! std::fs::write(&path, "trial,label,t_s,grip [N]\n1,mug,0.0,0\n1,mug,0.1,2.5\n")?;
//! let import = read_trials(&path, &Mapping::default())?;
//! assert_eq!(import.trials[0].signals.channels, ["grip [N]"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod card;
mod content;
mod csv_files;
mod format;
mod glb;
mod lerobot;
mod mapping;
mod mcap;
mod npz;
mod npz_import;
mod parquet;
mod parquet_table;
mod series;
mod taxels;
#[cfg(test)]
mod tests;
mod urdf;

pub use csv_files::{
    Exported, PointsError, contacts_path, export_labelled, file_name_of, read_points_csv, write_contacts_csv,
    write_trial_csv,
};
pub use format::{ExchangeError, Import, ImportError, TrialExport, TrialFormat, Written};
pub use glb::glb;
pub use lerobot::write_lerobot;
pub use mapping::{Mapping, PROFILES, SPLIT_GAP_S, plain_name};
pub use parquet::is_contained;

use palpate_geometry::{open_regular, other_content};
use palpate_store::{FileKind, Store, StoreError, TrialQuality};
use palpate_tactile::trial::TrialId;
use std::collections::BTreeSet;
use std::io::Read as _;
use std::path::Path;

/// CSV: a file for each trial.
pub const CSV: &dyn TrialFormat = &csv_files::Csv;

/// All formats.
pub const FORMATS: &[&dyn TrialFormat] = &[CSV, &mcap::Mcap, &npz::Npz, &parquet::Parquet];

/// The format that the ending of a name stands for; CSV for a name without ending, which is that of a folder.
pub fn format_of(path: &Path) -> Option<&'static dyn TrialFormat> {
    let named = FORMATS.iter().copied().find(|format| FileKind::of(path, &[format.kind()]).is_some());
    named.or_else(|| path.extension().is_none().then_some(CSV))
}

/// Writes trials in the format that the path stands for.
pub fn write_trials(export: &TrialExport<'_>, path: &Path) -> Result<Written, ExchangeError> {
    let format = format_of(path).ok_or_else(|| {
        let known: Vec<&str> = FORMATS.iter().flat_map(|format| format.kind().endings()).copied().collect();
        let (path, known) = (path.display(), known.join(", "));
        ExchangeError::Refused(format!("no format for \"{path}\": its extension has to be {known}"))
    })?;
    format.write(export, path)
}

/// Reads the trials of a file, as CSV where its ending stands for no format. The mapping says which columns are which; its
/// label, or else the name of the file, is that of trials without one.
pub fn read_trials(path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
    mapping.check().map_err(|fault| ImportError::of(path, fault))?;
    let format = format_of(path).unwrap_or(CSV);
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    if let Some((_, what)) = OTHER_FILES.iter().find(|(endings, _)| endings.iter().any(|own| ending == *own)) {
        return Err(ImportError::of(path, what));
    }
    // An archive of NumPy is a ZIP archive by right.
    if format.kind().endings() != ["npz"] {
        let head = first_bytes(path).map_err(|cause| ImportError::of(path, cause))?;
        if let Some(what) = other_content(&head) {
            return Err(ImportError::of(path, what));
        }
    }
    let mut import = format.read(path, mapping)?;
    import.trials.iter_mut().for_each(|trial| mapping.rezero(&mut trial.signals));
    Ok(import)
}

/// Names of the columns of a file that a mapping gives roles; none where the format gives them.
pub fn columns_of(path: &Path, mapping: &Mapping) -> Result<Vec<String>, ImportError> {
    format_of(path).unwrap_or(CSV).columns(path, mapping)
}

/// Files that hold trials in forms that are not read, and what to do.
const OTHER_FILES: [(&[&str], &str); 3] = [
    (&["db3"], "it is a bag of SQLite; convert it with `ros2 bag convert` and storage_id: mcap"),
    (&["bag"], "it is a bag of ROS 1; convert it to MCAP with messages of ROS 2"),
    (&["xlsx", "xls", "ods"], "it is a spreadsheet; save the sheet as CSV"),
];

/// The beginning of a file.
fn first_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    open_regular(path)?.take(200).read_to_end(&mut head)?;
    Ok(head)
}

/// Trials that are sound, and those that diverged, did not converge or did not come to rest: a file of another program would
/// not show that. Damaged trials count as sound; they say what is wrong where they are read.
pub fn sound_ones(store: &Store, ids: &[TrialId]) -> Result<(Vec<TrialId>, Vec<TrialId>), StoreError> {
    let rows = store.list(false)?;
    let unsound: BTreeSet<TrialId> =
        rows.iter().filter(|row| TrialQuality::of(row) == TrialQuality::Unsound).map(|row| row.id).collect();
    Ok(ids.iter().partition(|id| !unsound.contains(id)))
}
