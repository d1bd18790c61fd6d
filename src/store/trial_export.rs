//! Export of one trial of any source, for the window and the command line.

use super::csv_export::{contacts_path, write_contacts_csv, write_signals_csv, write_trial_csv};
use super::labelled_export::{ExportError, export_board_trial, file_name_of};
use super::store::Store;
use crate::labels::{UnknownWord, shown_name};
use palpate_tactile::trial::{SimulatedTrial, Trial, TrialData, TrialId};
use palpate_tactile::{PressureArea, SensorLayout, Sensors};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Format of exported trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrialFormat {
    /// One CSV file per trial; see `palpate help formats`.
    Csv,
}

impl TrialFormat {
    /// All formats.
    pub const ALL: [Self; 1] = [Self::Csv];

    /// Name on screen and on the command line, and extension of its files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
        }
    }
}

impl FromStr for TrialFormat {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        UnknownWord::choose(text, "format", Self::ALL.map(|format| (format.name(), format)))
    }
}

/// Exports a trial to a file with the format's extension, or else into a folder under its own name; returns the path.
/// `layout` and `area` choose the channels of a simulated trial.
pub fn export_trial(
    store: &Store,
    id: TrialId,
    out: &Path,
    format: TrialFormat,
    (layout, area): (&SensorLayout, PressureArea),
) -> Result<PathBuf, ExportError> {
    let trial = store.load(id)?;
    let name = format!("trial_{id}_{}.{}", file_name_of(shown_name(&trial.header.object)), format.name());
    let is_file = out.extension().is_some_and(|extension| extension == format.name());
    let path = if is_file { out.to_owned() } else { out.join(name) };
    match format {
        TrialFormat::Csv => write_csv(store, id, trial, &path, (layout, area))?,
    }
    Ok(path)
}

fn write_csv(
    store: &Store,
    id: TrialId,
    Trial { header, data }: Trial,
    path: &Path,
    (layout, area): (&SensorLayout, PressureArea),
) -> Result<(), ExportError> {
    match data {
        TrialData::Recorded(_) => drop(export_board_trial(store, id, path)?),
        TrialData::Imported(signals) => write_signals_csv(path, &signals)?,
        TrialData::Simulated(data) => {
            let trial = SimulatedTrial { header, data };
            let scene = &trial.header.scene;
            let sensors = Sensors::new(layout, &scene.gripper, area)?;
            write_trial_csv(path, &trial, scene, &sensors)?;
            write_contacts_csv(&contacts_path(path), &trial, scene)?;
        }
    }
    Ok(())
}
