//! Zeros: `palpate calibrate tare` stores the present ones, `palpate calibrate drift` shows those of stored trials.

use super::super::Failure;
use super::super::setup::within;
use super::super::terminal::{say, say_json, table, warn};
use super::guided;
use palpate_store::labels::shown_title;
use palpate_store::{Store, StoredTare};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::{Drift, DriftLevel, Readout};
use palpate_tactile::trial::{TrialId, TrialSource};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `palpate calibrate tare`.
#[derive(Debug, clap::Args)]
pub(super) struct TareArguments {
    /// Port, or file of captured bytes (default: the only likely port).
    #[arg(long, value_name = "PORT|FILE")]
    port: Option<PathBuf>,
    /// Duration of the measurement at rest (s).
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = within(0.3..=60.0))]
    seconds: f64,
    /// Print the zeros without storing them.
    #[arg(long)]
    dry_run: bool,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Arguments of `palpate calibrate drift`.
#[derive(Debug, clap::Args)]
pub(super) struct DriftArguments {
    /// Trial numbers (default: all trials of the real gripper).
    trials: Vec<TrialId>,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub(super) json: bool,
}

/// Output of `tare --json`.
#[derive(Serialize)]
struct TareReport {
    drift: Vec<Drift>,
    /// Stored zero; none with `--dry-run`.
    stored: Option<StoredTare>,
    warnings: Vec<String>,
}

pub(super) fn tare(arguments: &TareArguments, store: &mut Store) -> Result<(), Failure> {
    let serving = store.calibrations().serving(None, &[])?;
    if serving.calibrations.is_empty() {
        let why = serving.warnings.first().cloned().unwrap_or_default();
        return Err(format!("no mounted part is calibrated, so there is no zero: {why}").into());
    }
    let (board, readings) = guided::watch(arguments.port.as_deref(), arguments.seconds)?;
    let readout = Readout::new(&board, &serving.calibrations)?;
    let drift = readout.drift(&readout.zero_from(&readings));
    let zero = readout.tare(&readings)?;
    let stored = if arguments.dry_run { None } else { Some(store.calibrations().add_tare(&zero)?) };
    let warnings = [readout.warnings(), &serving.warnings].concat();
    if arguments.json {
        return say_json(&TareReport { drift, stored, warnings });
    }
    let rows: Vec<Vec<String>> = drift
        .iter()
        .map(|drift| vec![drift.sensor.label().to_owned(), drift.with_unit(), drift.badge().to_owned(), to_do(drift)])
        .collect();
    table(&["sensor", "drift", "", ""], &rows)?;
    warnings.iter().for_each(|warning| warn(warning));
    match stored {
        None => say("not stored"),
        Some(stored) => {
            let versions = stored.parts.iter().map(|part| format!("\"{}\" version {}", part.part, part.version));
            let versions: Vec<String> = versions.collect();
            say(format!("stored as the zero of {}, until their next calibration", versions.join(", ")))
        }
    }
}

/// Advice for a drifted zero.
fn to_do(drift: &Drift) -> String {
    let what = match (drift.level, drift.sensor.is_flex()) {
        (DriftLevel::Steady, _) => "nothing to do",
        (DriftLevel::Moved, _) => "corrected from now on; calibrate again if it drifts further",
        (DriftLevel::TooFar, true) => "not corrected: straighten the finger, or check whether the strip has slipped",
        (DriftLevel::TooFar, false) => "not corrected: free the pad, or check whether it is pinched",
    };
    what.to_owned()
}

/// One trial in the output of `drift --json`.
#[derive(Serialize)]
struct DriftRow {
    trial: TrialId,
    created: String,
    object: String,
    drift: Vec<Drift>,
}

pub(super) fn drift(arguments: &DriftArguments, store: &Store) -> Result<(), Failure> {
    let rows: Vec<DriftRow> = store
        .list(false)?
        .into_iter()
        .filter(|row| {
            row.source == TrialSource::Recorded && (arguments.trials.is_empty() || arguments.trials.contains(&row.id))
        })
        .map(|row| -> Result<DriftRow, Failure> {
            let read = store.board_signals(row.id, &[])?;
            let drift = read.map_or_else(Vec::new, |read| read.derived.drift);
            Ok(DriftRow { trial: row.id, created: row.created, object: row.object, drift })
        })
        .collect::<Result<_, _>>()?;
    if let Some(id) = arguments.trials.iter().find(|id| rows.iter().all(|row| row.trial != **id)) {
        return Err(format!("no trial {id} of the real gripper: see `palpate trials list`").into());
    }
    if arguments.json {
        return say_json(&rows);
    }
    if rows.is_empty() {
        return say("no trials of the real gripper yet: `palpate record` records one");
    }
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let of = |sensor: Sensor| row.drift.iter().find(|drift| drift.sensor == sensor);
            let cell =
                |sensor| of(sensor).map_or_else(|| "–".to_owned(), |d| format!("{} {}", d.with_unit(), d.badge()));
            let date = row.created.chars().take(19).collect::<String>().replace('T', " ");
            let start = [row.trial.to_string(), date, shown_title(&row.object)];
            start.into_iter().chain(Sensor::ALL.map(cell)).collect()
        })
        .collect();
    let names = Sensor::ALL.map(Sensor::channel);
    table(&["trial", "recorded (UTC)", "object", names[0], names[1], names[2], names[3]], &cells)?;
    if let Some(tare) = store.calibrations().tare()? {
        for part in &tare.parts {
            let date = part.taken.chars().take(19).collect::<String>().replace('T', " ");
            say(format!("\"{}\", the {}: tare {} of {date} applies", part.part, part.sensor.label(), part.version))?;
        }
    }
    Ok(())
}
