//! Zeros: `palpate calibrate tare` stores the present ones, `palpate calibrate drift` shows those of stored trials.

use super::super::prelude::*;
use super::guided;
use palpate_store::labels::shown_title;
use palpate_store::{PartTare, StoredTare};
use palpate_tactile::calibration::{Drift, DriftLevel, Readout};
use palpate_tactile::trial::TrialSource;

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
    let (board, readings) =
        guided::watch(arguments.port.as_deref(), arguments.seconds, store.calibrations().sensors()?)?;
    let readout = Readout::new(&board, &serving.calibrations)?;
    let drift = readout.drift(&readout.zero_from(&readings));
    let zero = readout.tare(&readings)?;
    let stored = if arguments.dry_run { None } else { Some(store.calibrations().add_tare(&zero)?) };
    let warnings = [readout.warnings(), &serving.warnings].concat();
    TareReport { drift, stored, warnings }.print(arguments.json)
}

impl Report for TareReport {
    fn text(&self, page: &mut Page) {
        let row = |drift: &Drift| {
            [drift.sensor.label(), drift.with_unit(), drift.badge().to_owned(), to_do(drift).to_owned()]
        };
        page.table(&["sensor", "drift", "", ""], self.drift.iter().map(row));
        self.warnings.iter().for_each(|warning| page.warn(warning));
        let Some(stored) = &self.stored else { return page.line("not stored") };
        let versions = stored.parts.iter().map(|part| format!("\"{}\" version {}", part.part, part.version));
        let versions: Vec<String> = versions.collect();
        page.line(format!("stored as the zero of {}, until their next calibration", versions.join(", ")));
    }
}

/// Advice for a drifted zero.
fn to_do(drift: &Drift) -> &'static str {
    match (drift.level, drift.sensor.is_flex()) {
        (DriftLevel::Steady, _) => "nothing to do",
        (DriftLevel::Moved, _) => "corrected from now on; calibrate again if it drifts further",
        (DriftLevel::TooFar, true) => "not corrected: straighten the finger, or check whether the strip has slipped",
        (DriftLevel::TooFar, false) => "not corrected: free the pad, or check whether it is pinched",
    }
}

/// Output of `drift --json`.
#[derive(Default, Serialize)]
#[serde(transparent)]
pub(super) struct DriftReport {
    rows: Vec<DriftRow>,
    /// Tares that apply.
    #[serde(skip)]
    tares: Vec<PartTare>,
}

/// One trial in it.
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
    let tares = store.calibrations().tare()?.map(|tare| tare.parts).unwrap_or_default();
    DriftReport { rows, tares }.print(arguments.json)
}

impl Report for DriftReport {
    fn text(&self, page: &mut Page) {
        if self.rows.is_empty() {
            return page.line("no trials of the real gripper yet: `palpate record` records one");
        }
        let mut names: Vec<&str> = Vec::new();
        for drift in self.rows.iter().flat_map(|row| &row.drift) {
            if !names.contains(&drift.sensor.channel()) {
                names.push(drift.sensor.channel());
            }
        }
        let row = |row: &DriftRow| {
            let drift = |name: &&str| {
                let drift = row.drift.iter().find(|drift| drift.sensor.channel() == *name);
                drift.map_or_else(|| "–".to_owned(), |drift| format!("{} {}", drift.with_unit(), drift.badge()))
            };
            let first = [row.trial.to_string(), date(&row.created), shown_title(&row.object)];
            first.into_iter().chain(names.iter().map(drift)).collect::<Vec<String>>()
        };
        let header: Vec<&str> =
            ["trial", "recorded (UTC)", "object"].into_iter().chain(names.iter().copied()).collect();
        page.table(&header, self.rows.iter().map(row));
        for part in &self.tares {
            let (place, version, date) = (part.sensor.label(), part.version, date(&part.taken));
            page.line(format!("\"{}\", the {place}: tare {version} of {date} applies", part.part));
        }
    }
}
