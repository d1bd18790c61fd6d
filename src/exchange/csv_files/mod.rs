//! CSV: a file for each trial, a folder for all labelled ones, and calibration points. `contacts.csv` and `bytes` stand
//! beside a trial.

mod board;
mod import;
#[cfg(test)]
mod kept_store_tests;
mod labelled;
mod points;
mod simulated;
mod writing;

pub(crate) use import::read_made;
pub use labelled::{Exported, export_labelled, file_name_of};
pub use points::{PointsError, read_points_csv};
pub use simulated::{contacts_path, write_contacts_csv, write_trial_csv};

use crate::format::{ExchangeError, Import, ImportError, TrialExport, TrialFormat, Written};
use crate::mapping::Mapping;
use labelled::export_board_trial;
use palpate_store::FileKind;
use palpate_store::labels::shown_name;
use palpate_tactile::Sensors;
use palpate_tactile::trial::{SimulatedTrial, Trial, TrialData, TrialId};
use std::path::{Path, PathBuf};

/// CSV of trials.
pub(crate) struct Csv;

impl TrialFormat for Csv {
    fn kind(&self) -> FileKind {
        FileKind::Csv
    }

    fn write(&self, export: &TrialExport<'_>, path: &Path) -> Result<Written, ExchangeError> {
        let is_file = FileKind::of(path, &[FileKind::Csv]).is_some();
        if export.taxels {
            let text =
                "CSV lists loaded taxels in .contacts.csv anyway; arrays of taxels go to .npz, .parquet or .mcap";
            return Err(ExchangeError::Refused(text.to_owned()));
        }
        if is_file && export.ids.len() > 1 {
            return Err(ExchangeError::Refused("several trials need a folder: --out FOLDER".to_owned()));
        }
        let mut written = Written { files: Vec::new(), left_out: Vec::new() };
        for id in export.numbers() {
            let id = id?;
            match write_trial(export, id, path, is_file) {
                Err(ExchangeError::Store(error)) if error.is_damage() && export.ids.len() > 1 => {
                    written.left_out.push((id, error.to_string()));
                }
                file => written.files.push(file?),
            }
        }
        Ok(written)
    }

    fn read(&self, path: &Path, mapping: &Mapping) -> Result<Import, ImportError> {
        import::read_file(path, mapping)
    }

    fn columns(&self, path: &Path, mapping: &Mapping) -> Result<Vec<String>, ImportError> {
        import::columns_of(path, mapping)
    }
}

/// Writes a trial to a file, or into a folder under its own name; returns the path.
fn write_trial(export: &TrialExport<'_>, id: TrialId, out: &Path, is_file: bool) -> Result<PathBuf, ExchangeError> {
    let Trial { header, data } = export.store.load(id)?;
    let name = format!("trial_{id}_{}.csv", file_name_of(shown_name(&header.object)));
    let path = if is_file { out.to_owned() } else { out.join(name) };
    match data {
        TrialData::Recorded(_) => drop(export_board_trial(export.store, id, &path)?),
        TrialData::Imported(filled) => {
            writing::write_signals_csv(&path, &export.store.readings(id)?.unwrap_or(filled))?;
        }
        TrialData::Simulated(data) => {
            let (trial, view) = (SimulatedTrial { header, data }, &export.options.sensors);
            let scene = &trial.header.scene;
            write_trial_csv(&path, &trial, scene, &Sensors::new(&view.shown()?, &scene.gripper, view.signals)?)?;
            write_contacts_csv(&contacts_path(&path), &trial, scene)?;
        }
    }
    Ok(path)
}
