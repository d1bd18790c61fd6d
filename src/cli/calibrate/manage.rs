//! Manages calibrations: list, show, export, import, mount, withdraw.

use super::super::prelude::*;
use super::{points_text, zero};
use palpate_store::{CalibrationId, StoredCalibration};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::Calibration;

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
        /// Place: a strip or pad of the gripper, such as flexL.
        sensor: String,
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
    match command {
        CalibrateCommand::List { json, .. } => ListReport::default().print(*json),
        CalibrateCommand::Drift(arguments) => zero::DriftReport::default().print(arguments.json),
        CalibrateCommand::Tare(_) => {
            Err("no calibrations yet, so there is no zero; `palpate help gripper` says how to calibrate".into())
        }
        _ => Err("no calibrations yet: `palpate help gripper` says how to calibrate".into()),
    }
}

pub(super) fn run(command: &CalibrateCommand, store: &mut Store) -> Result<(), Failure> {
    match command {
        CalibrateCommand::List { part, json } => ListReport::new(store, part.as_deref())?.print(*json),
        CalibrateCommand::Show { id, json } => show(store, *id)?.print(*json),
        CalibrateCommand::Export { ids, out } => export(store, ids, out),
        CalibrateCommand::Import { files } => files.iter().try_for_each(|file| import(store, file)),
        CalibrateCommand::Mount { sensor, part } => {
            let sensor = sensor_called(store.calibrations().sensors()?, sensor)?;
            mount(store, sensor, part.trim())
        }
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

impl ListReport {
    fn new(store: &Store, part: Option<&str>) -> Result<Self, Failure> {
        let parts = store.calibrations().mounted()?;
        let mounted = store
            .calibrations()
            .sensors()?
            .iter()
            .zip(parts)
            .filter_map(|(sensor, part)| Some((sensor.channel(), part?)));
        let rows = store.calibrations().list(part)?.into_iter().map(|stored| {
            let fitted = Calibration::fit(stored.record.clone());
            let summary = fitted.as_ref().ok().map(Calibration::summary);
            Row { stored, summary, fault: fitted.err().map(|fault| fault.to_string()) }
        });
        Ok(Self { mounted: mounted.collect(), calibrations: rows.collect() })
    }
}

impl Report for ListReport {
    fn text(&self, page: &mut Page) {
        for (channel, part) in &self.mounted {
            page.line(format!("{channel:<6}\"{part}\""));
        }
        if self.calibrations.is_empty() {
            return page.line("no calibrations yet: `palpate calibrate flexL --part A7` makes one");
        }
        let row = |Row { stored, summary, fault }: &Row| {
            let remark = match (&stored.withdrawn, fault) {
                (Some(_), _) => "withdrawn: ",
                (None, Some(_)) => "unusable: ",
                (None, None) => "",
            };
            let result = format!("{remark}{}", summary.as_ref().or(fault.as_ref()).map_or("", String::as_str));
            let (part, kind) = (stored.record.part.clone(), stored.record.kind.label().to_owned());
            [stored.id.to_string(), part, stored.version.to_string(), date(&stored.created), kind, result]
        };
        page.table(&["id", "part", "version", "made (UTC)", "kind", "result"], self.calibrations.iter().map(row));
    }
}

/// Output of `show --json`.
#[derive(Serialize)]
struct ShowReport {
    id: CalibrationId,
    version: i64,
    created: String,
    withdrawn: Option<String>,
    #[serde(flatten)]
    calibration: Calibration,
}

fn show(store: &Store, id: CalibrationId) -> Result<ShowReport, Failure> {
    let StoredCalibration { version, created, withdrawn, record, .. } = store.calibrations().get(id)?;
    Ok(ShowReport { id, version, created, withdrawn, calibration: Calibration::fit(record)? })
}

impl Report for ShowReport {
    fn text(&self, page: &mut Page) {
        let Self { id, version, created, withdrawn, calibration } = self;
        let record = &calibration.record;
        let (kind, part) = (record.kind.label(), &record.part);
        page.line(format!("calibration {id}: {kind} \"{part}\", version {version}, made {created}"));
        points_text(calibration, page);
        if let Some(bending) = &record.bending {
            page.line(format!("zero known up to a curvature of {:.1} 1/m", bending.reaches()));
        }
        if !record.note.is_empty() {
            page.line(&record.note);
        }
        if withdrawn.is_some() {
            page.warn("this calibration is withdrawn");
        }
    }
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
    let text = palpate_geometry::read_text(file, LARGEST_FILE).map_err(|e| refuse(e.to_string()))?;
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
    serving.warnings.iter().filter(|warning| warning.contains(&sensor.label())).for_each(|warning| warn(warning));
    Ok(())
}
