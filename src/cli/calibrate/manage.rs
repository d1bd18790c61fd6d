//! Manages calibrations: list, show, export, import, mount, withdraw.

use super::super::Failure;
use super::super::output::{file_of, write_new};
use super::super::terminal::{say, say_json, table, warn};
use super::{parse_sensor, print, zero};
use palpate_store::{CalibrationId, FileKind, Store, StoredCalibration};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::Calibration;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Subcommand)]
pub(super) enum CalibrateCommand {
    /// List all calibrations, oldest first, and the mounted parts.
    List {
        /// Only calibrations of this part.
        #[arg(long, value_name = "NAME")]
        part: Option<String>,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// Show one calibration with its points and residuals.
    Show {
        /// Calibration number.
        id: CalibrationId,
        /// Print JSON instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Export calibrations to a JSON file.
    Export {
        /// Calibration numbers (default: all).
        ids: Vec<CalibrationId>,
        /// File to write.
        #[arg(long, value_name = "FILE.json", value_parser = file_of(&[FileKind::Json]))]
        out: PathBuf,
    },
    /// Import calibrations from JSON files, without duplicates.
    Import {
        /// JSON files.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Set which part is mounted in a place, after parts were swapped.
    Mount {
        /// Place: flexL, flexR, fsrL or fsrR.
        #[arg(value_parser = parse_sensor)]
        sensor: Sensor,
        /// Name of the part.
        part: String,
    },
    /// Store the present zero of all sensors, hand open and at rest; applies until the next calibration of a part.
    Tare(zero::TareArguments),
    /// Show how far the zeros of stored trials have drifted from their calibrations.
    Drift(zero::DriftArguments),
    /// Withdraw a calibration; the previous version applies again.
    Withdraw {
        /// Calibration number.
        id: CalibrationId,
    },
    /// Restore a withdrawn calibration.
    Restore {
        /// Calibration number.
        id: CalibrationId,
    },
}

impl CalibrateCommand {
    /// True for a command that has something to store where nothing is stored yet.
    pub(super) fn adds(&self) -> bool {
        matches!(self, Self::Import { .. } | Self::Mount { .. })
    }
}

/// Result of a command that adds nothing, where there is no store.
pub(super) fn without_store(command: &CalibrateCommand) -> Result<(), Failure> {
    let none = "no calibrations yet: `palpate help gripper` says how to calibrate";
    match command {
        CalibrateCommand::List { json: true, .. } => say_json(&ListReport::default()),
        CalibrateCommand::Drift(arguments) if arguments.json => say_json(&[(); 0]),
        CalibrateCommand::List { .. } | CalibrateCommand::Drift(_) => say(none),
        CalibrateCommand::Tare(_) => {
            Err("no calibrations yet, so there is no zero; `palpate help gripper` says how to calibrate".into())
        }
        _ => Err(none.into()),
    }
}

pub(super) fn run(command: &CalibrateCommand, store: &mut Store) -> Result<(), Failure> {
    match command {
        CalibrateCommand::List { part, json } => list(store, part.as_deref(), *json),
        CalibrateCommand::Show { id, json } => show(store, *id, *json),
        CalibrateCommand::Export { ids, out } => export(store, ids, out),
        CalibrateCommand::Import { files } => files.iter().try_for_each(|file| import(store, file)),
        CalibrateCommand::Mount { sensor, part } => mount(store, *sensor, part.trim()),
        CalibrateCommand::Tare(arguments) => zero::tare(arguments, store),
        CalibrateCommand::Drift(arguments) => zero::drift(arguments, store),
        CalibrateCommand::Withdraw { id } => {
            store.calibrations().withdraw(*id, true)?;
            say(format!("calibration {id} withdrawn; `palpate calibrate restore {id}` brings it back"))
        }
        CalibrateCommand::Restore { id } => {
            store.calibrations().withdraw(*id, false)?;
            say(format!("calibration {id} restored"))
        }
    }
}

/// Output of `list --json`.
#[derive(Default, Serialize)]
struct ListReport {
    /// Mounted parts by channel.
    mounted: std::collections::BTreeMap<&'static str, String>,
    calibrations: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    #[serde(flatten)]
    stored: StoredCalibration,
    /// Result; absent where the points make no calibration.
    summary: Option<String>,
    /// Why the points make no calibration.
    fault: Option<String>,
}

fn list(store: &Store, part: Option<&str>, json: bool) -> Result<(), Failure> {
    let parts = store.calibrations().mounted()?;
    let mounted = Sensor::ALL.into_iter().zip(parts).filter_map(|(sensor, part)| Some((sensor.channel(), part?)));
    let rows = store.calibrations().list(part)?.into_iter().map(|stored| {
        let fitted = Calibration::fit(stored.record.clone());
        let summary = fitted.as_ref().ok().map(Calibration::summary);
        Row { stored, summary, fault: fitted.err().map(|fault| fault.to_string()) }
    });
    let listed = ListReport { mounted: mounted.collect(), calibrations: rows.collect() };
    if json {
        return say_json(&listed);
    }
    for (channel, part) in &listed.mounted {
        say(format!("{channel:<6}\"{part}\""))?;
    }
    if listed.calibrations.is_empty() {
        return say("no calibrations yet: `palpate calibrate flexL --part A7` makes one");
    }
    let cells: Vec<Vec<String>> = listed
        .calibrations
        .iter()
        .map(|Row { stored, summary, fault }| {
            let remark = match (&stored.withdrawn, fault) {
                (Some(_), _) => "withdrawn: ".to_owned(),
                (None, Some(_)) => "unusable: ".to_owned(),
                (None, None) => String::new(),
            };
            let result = summary.as_ref().or(fault.as_ref()).cloned().unwrap_or_default();
            vec![
                stored.id.to_string(),
                stored.record.part.clone(),
                stored.version.to_string(),
                stored.created.chars().take(19).collect::<String>().replace('T', " "),
                stored.record.kind.label().to_owned(),
                format!("{remark}{result}"),
            ]
        })
        .collect();
    table(&["id", "part", "version", "made (UTC)", "kind", "result"], &cells)
}

fn show(store: &Store, id: CalibrationId, json: bool) -> Result<(), Failure> {
    let stored = store.calibrations().get(id)?;
    let calibration = Calibration::fit(stored.record.clone())?;
    if json {
        #[derive(Serialize)]
        struct Report<'a> {
            id: CalibrationId,
            version: i64,
            created: &'a str,
            withdrawn: Option<&'a str>,
            #[serde(flatten)]
            calibration: &'a Calibration,
        }
        let StoredCalibration { version, created, withdrawn, .. } = &stored;
        let withdrawn = withdrawn.as_deref();
        return say_json(&Report { id, version: *version, created, withdrawn, calibration: &calibration });
    }
    let StoredCalibration { version, created, record, withdrawn, .. } = &stored;
    say(format!("calibration {id}: {} \"{}\", version {version}, made {created}", record.kind.label(), record.part))?;
    print(&calibration)?;
    if let Some(bending) = &record.bending {
        say(format!("zero known up to a curvature of {:.1} 1/m", bending.reaches()))?;
    }
    if !record.note.is_empty() {
        say(&record.note)?;
    }
    if withdrawn.is_some() {
        warn("this calibration is withdrawn");
    }
    Ok(())
}

fn export(store: &Store, ids: &[CalibrationId], out: &Path) -> Result<(), Failure> {
    let chosen = match ids {
        [] => store.calibrations().list(None)?,
        ids => ids.iter().map(|id| store.calibrations().get(*id)).collect::<Result<_, _>>()?,
    };
    let text = serde_json::to_string_pretty(&chosen)?;
    write_new(out, FileKind::Json, (text + "\n").as_bytes())?;
    say(format!("{}: {} calibration(s)", out.display(), chosen.len()))
}

/// Largest accepted file (bytes).
const LARGEST_FILE: u64 = 1 << 24;

fn import(store: &mut Store, file: &Path) -> Result<(), Failure> {
    let refuse = |cause: String| format!("cannot import \"{}\": {cause}", file.display());
    let size = std::fs::metadata(file).map_err(|e| refuse(e.to_string()))?.len();
    if size > LARGEST_FILE {
        return Err(refuse(format!("{size} bytes are too many for calibrations")).into());
    }
    let text = std::fs::read_to_string(file).map_err(|e| refuse(e.to_string()))?;
    let others: Vec<StoredCalibration> = serde_json::from_str(&text)
        .map_err(|e| refuse(format!("not a list of calibrations as written by `palpate calibrate export` ({e})")))?;
    for other in &others {
        Calibration::fit(other.record.clone())
            .map_err(|fault| refuse(format!("the calibration of \"{}\": {fault}", other.record.part)))?;
    }
    let added = store.calibrations().import(&others)?;
    say(format!("{}: {added} calibration(s) added, {} already there", file.display(), others.len() - added))
}

fn mount(store: &mut Store, sensor: Sensor, part: &str) -> Result<(), Failure> {
    if part.is_empty() {
        return Err("the part needs a name".into());
    }
    store.calibrations().mount(sensor, part)?;
    say(format!("\"{part}\" mounted as the {}", sensor.label()))?;
    let serving = store.calibrations().serving(None, &[])?;
    serving.warnings.iter().filter(|warning| warning.contains(sensor.label())).for_each(|warning| warn(warning));
    Ok(())
}
