//! What is known of all parts: list, show, export, import, mount, withdraw.

use super::super::Failure;
use super::super::terminal::{say, say_json, table, warn};
use super::{parse_sensor, tell, zero};
use palpate_store::{CalibrationId, Store, StoredCalibration};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::Calibration;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Subcommand)]
pub(super) enum What {
    /// All calibrations, oldest first, and which parts sit where.
    List {
        /// Only those of this part.
        #[arg(long, value_name = "NAME")]
        part: Option<String>,
        /// Print JSON instead of a table.
        #[arg(long)]
        json: bool,
    },
    /// One calibration with its points and residuals.
    Show {
        /// Its number.
        id: CalibrationId,
        /// Print JSON instead of text.
        #[arg(long)]
        json: bool,
    },
    /// Write calibrations into a JSON file.
    Export {
        /// Their numbers; all where there are none.
        ids: Vec<CalibrationId>,
        /// The file.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Take calibrations in from JSON files; what is here already is not taken twice.
    Import {
        /// The files.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Note that a part sits in a place from now on: after parts were swapped.
    Mount {
        /// Where: flexL, flexR, fsrL or fsrR.
        #[arg(value_parser = parse_sensor)]
        sensor: Sensor,
        /// Name of the part.
        part: String,
    },
    /// Take the zero of all sensors now, with the hand open and left alone; it serves until a part is calibrated anew.
    Tare(zero::TareArguments),
    /// How far the zeros of stored trials have moved from their calibrations.
    Drift(zero::DriftArguments),
    /// Let a calibration serve no trial any more, unless it is asked for; the one before it serves again.
    Withdraw {
        /// Its number.
        id: CalibrationId,
    },
    /// Take a withdrawal back.
    Restore {
        /// Its number.
        id: CalibrationId,
    },
}

pub(super) fn run(what: &What, store: &mut Store) -> Result<(), Failure> {
    match what {
        What::List { part, json } => list(store, part.as_deref(), *json),
        What::Show { id, json } => show(store, *id, *json),
        What::Export { ids, out } => export(store, ids, out),
        What::Import { files } => files.iter().try_for_each(|file| import(store, file)),
        What::Mount { sensor, part } => mount(store, *sensor, part.trim()),
        What::Tare(arguments) => zero::tare(arguments, store),
        What::Drift(arguments) => zero::drift(arguments, store),
        What::Withdraw { id } => {
            store.calibrations().withdraw(*id, true)?;
            say(format!("calibration {id} serves no more; `palpate calibrate restore {id}` takes that back"))
        }
        What::Restore { id } => {
            store.calibrations().withdraw(*id, false)?;
            say(format!("calibration {id} serves again"))
        }
    }
}

/// What `list --json` prints.
#[derive(Serialize)]
struct Listed {
    /// Which part sits where, by channel.
    mounted: std::collections::BTreeMap<&'static str, String>,
    calibrations: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    #[serde(flatten)]
    stored: StoredCalibration,
    /// What came out; absent where its points make no calibration.
    summary: Option<String>,
    /// Why not.
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
    let listed = Listed { mounted: mounted.collect(), calibrations: rows.collect() };
    if json {
        return say_json(&listed);
    }
    for (channel, part) in &listed.mounted {
        say(format!("{channel:<6}is \"{part}\""))?;
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
                (None, Some(_)) => "serves nothing: ".to_owned(),
                (None, None) => String::new(),
            };
            let came_out = summary.as_ref().or(fault.as_ref()).cloned().unwrap_or_default();
            vec![
                stored.id.to_string(),
                stored.record.part.clone(),
                stored.version.to_string(),
                stored.created.chars().take(19).collect::<String>().replace('T', " "),
                stored.record.kind.label().to_owned(),
                format!("{remark}{came_out}"),
            ]
        })
        .collect();
    table(&["id", "part", "version", "made (UTC)", "kind", ""], &cells)
}

fn show(store: &Store, id: CalibrationId, json: bool) -> Result<(), Failure> {
    let stored = store.calibrations().get(id)?;
    let calibration = Calibration::fit(stored.record.clone())?;
    if json {
        #[derive(Serialize)]
        struct Shown<'a> {
            id: CalibrationId,
            version: i64,
            created: &'a str,
            withdrawn: Option<&'a str>,
            #[serde(flatten)]
            calibration: &'a Calibration,
        }
        let StoredCalibration { version, created, withdrawn, .. } = &stored;
        let withdrawn = withdrawn.as_deref();
        return say_json(&Shown { id, version: *version, created, withdrawn, calibration: &calibration });
    }
    let StoredCalibration { version, created, record, withdrawn, .. } = &stored;
    say(format!("calibration {id}: {} \"{}\", version {version}, made {created}", record.kind.label(), record.part))?;
    tell(&calibration)?;
    if let Some(bending) = &record.bending {
        say(format!("its zero is known up to a curvature of {:.1} 1/m", bending.reaches()))?;
    }
    if !record.note.is_empty() {
        say(&record.note)?;
    }
    if withdrawn.is_some() {
        warn("it was withdrawn");
    }
    Ok(())
}

fn export(store: &Store, ids: &[CalibrationId], out: &Path) -> Result<(), Failure> {
    let chosen = match ids {
        [] => store.calibrations().list(None)?,
        ids => ids.iter().map(|id| store.calibrations().get(*id)).collect::<Result<_, _>>()?,
    };
    let text = serde_json::to_string_pretty(&chosen)?;
    std::fs::write(out, text + "\n").map_err(|e| format!("cannot write \"{}\": {e}", out.display()))?;
    say(format!("{}: {} calibration(s)", out.display(), chosen.len()))
}

/// Files larger than this hold no calibrations (bytes).
const LARGEST_FILE: u64 = 1 << 24;

fn import(store: &mut Store, file: &Path) -> Result<(), Failure> {
    let refuse = |cause: String| format!("cannot take in \"{}\": {cause}", file.display());
    let size = std::fs::metadata(file).map_err(|e| refuse(e.to_string()))?.len();
    if size > LARGEST_FILE {
        return Err(refuse(format!("{size} bytes is too large for calibrations")).into());
    }
    let text = std::fs::read_to_string(file).map_err(|e| refuse(e.to_string()))?;
    let others: Vec<StoredCalibration> = serde_json::from_str(&text)
        .map_err(|e| refuse(format!("it is no list of calibrations as `palpate calibrate export` writes it ({e})")))?;
    for other in &others {
        Calibration::fit(other.record.clone())
            .map_err(|fault| refuse(format!("the calibration of \"{}\": {fault}", other.record.part)))?;
    }
    let added = store.calibrations().import(&others)?;
    say(format!("{}: {added} calibration(s) added, {} were here already", file.display(), others.len() - added))
}

fn mount(store: &mut Store, sensor: Sensor, part: &str) -> Result<(), Failure> {
    if part.is_empty() {
        return Err("the part needs a name".into());
    }
    store.calibrations().mount(sensor, part)?;
    say(format!("\"{part}\" is the {} from now on", sensor.label()))?;
    let serving = store.calibrations().serving(None, &[])?;
    serving.warnings.iter().filter(|warning| warning.contains(sensor.label())).for_each(|warning| warn(warning));
    Ok(())
}
