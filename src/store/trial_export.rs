//! Export of one trial of any source, for the window and the command line.

use super::csv_export::{contacts_path, write_contacts_csv, write_signals_csv, write_trial_csv};
use super::file_kind::FileKind;
use super::labelled_export::{export_board_trial, file_name_of};
use super::store::Store;
use super::store_error::ExportError;
use crate::labels::shown_name;
use palpate_tactile::trial::{SimulatedTrial, Trial, TrialData, TrialId};
use palpate_tactile::{SensorLayout, Sensors, SignalDefinition};
use std::path::{Path, PathBuf};

/// Exports a trial as CSV: to a file with that extension, or else into a folder under its own name; returns the path.
/// `layout` and `signals` choose the channels of a simulated trial.
pub fn export_trial(
    store: &Store,
    id: TrialId,
    out: &Path,
    (layout, signals): (&SensorLayout, SignalDefinition),
) -> Result<PathBuf, ExportError> {
    let trial = store.load(id)?;
    let name = format!("trial_{id}_{}.csv", file_name_of(shown_name(&trial.header.object)));
    let is_file = FileKind::of(out, &[FileKind::Csv]).is_some();
    let path = if is_file { out.to_owned() } else { out.join(name) };
    write_csv(store, id, trial, &path, (layout, signals))?;
    Ok(path)
}

fn write_csv(
    store: &Store,
    id: TrialId,
    Trial { header, data }: Trial,
    path: &Path,
    (layout, signals): (&SensorLayout, SignalDefinition),
) -> Result<(), ExportError> {
    match data {
        TrialData::Recorded(_) => drop(export_board_trial(store, id, path)?),
        TrialData::Imported(signals) => write_signals_csv(path, &signals)?,
        TrialData::Simulated(data) => {
            let trial = SimulatedTrial { header, data };
            let scene = &trial.header.scene;
            let sensors = Sensors::new(layout, &scene.gripper, signals)?;
            write_trial_csv(path, &trial, scene, &sensors)?;
            write_contacts_csv(&contacts_path(path), &trial, scene)?;
        }
    }
    Ok(())
}
