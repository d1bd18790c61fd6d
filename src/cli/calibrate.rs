//! `palpate calibrate`: calibrates parts of the real gripper at known angles and weights, and manages calibrations.

mod guided;
mod manage;
mod zero;

use super::prelude::*;
use palpate_exchange::read_points_csv;
use palpate_lab::workers::keep_calibration;
use palpate_store::CalibrationId;
use palpate_tactile::board::{Board, Sensor};
use palpate_tactile::calibration::{Calibration, Input, Record, SensorKind};

pub(super) use guided::weigh;

/// Arguments of `palpate calibrate`.
#[derive(Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:
  palpate calibrate flexL --part A7
  palpate calibrate fsrL --part P3 --empty-close 15
  palpate calibrate fsrL --part P3 --points p.csv --dry-run
  palpate calibrate list
  palpate calibrate tare

See also: palpate help gripper"
)]
pub(super) struct CalibrateArguments {
    #[command(subcommand)]
    command: Option<manage::CalibrateCommand>,
    /// Sensor: flexL, flexR, fsrL or fsrR, or another strip or pad of the gripper file.
    #[arg(required = true)]
    sensor: Option<String>,
    /// Name of the mounted part, such as the number written on it (default: the known one). Calibrations belong to parts,
    /// because parts get swapped.
    #[arg(long, value_name = "NAME")]
    part: Option<String>,
    /// Read the points from a CSV file with the columns angle_deg (or load_kg, load_g) and counts instead of from the
    /// board.
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,
    #[command(flatten)]
    live: guided::LiveArguments,
    /// Fixed resistor of the divider (ohm) (default: as the board reports, or 47000 for strips and 4700 for pads).
    #[arg(long, value_name = "OHM")]
    resistor: Option<f64>,
    /// Full scale of the converter (counts), for points from a file.
    #[arg(long, value_name = "COUNTS", default_value_t = 4095, value_parser = clap::value_parser!(u32).range(255..=16_777_215))]
    full_scale: u32,
    /// Note to store with the calibration.
    #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
    note: String,
    /// Print the result without storing it.
    #[arg(long)]
    dry_run: bool,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &CalibrateArguments, store: Option<&Path>) -> Result<(), Failure> {
    if let Some(command) = &arguments.command {
        return match existing_store_to_change(store)? {
            Some(mut store) => manage::run(command, &mut store),
            None if command.adds() => manage::run(command, &mut open_store(store)?),
            None => manage::without_store(command),
        };
    }
    // Made only where there is a calibration to keep.
    let known = existing_store_to_change(store)?;
    let sensors = known.as_ref().map(|store| store.calibrations().sensors()).transpose()?.unwrap_or_default();
    let name = arguments.sensor.as_deref().ok_or_else(|| format!("name the sensor: {}", sensors.names()))?;
    let sensor = sensor_called(sensors, name)?;
    let part = part_name(arguments, sensor, known.as_ref())?;
    if arguments.points.is_some() && arguments.live.empty_close.is_none() {
        arguments.live.refuse_beside_points()?;
    }
    let points = arguments.points.as_ref().map(|file| record_of_file(arguments, sensor, &part, file)).transpose()?;
    let record = match points {
        Some(record) if arguments.live.empty_close.is_none() => record,
        points => guided::record(arguments, sensor, &part, points, known.as_ref())?,
    };
    let calibration = Calibration::fit(Record { note: arguments.note.clone(), ..record })?;
    let stored = if arguments.dry_run {
        None
    } else {
        let mut store = known.map_or_else(|| open_store(store), Ok)?;
        Some(keep_calibration(&mut store, sensor, &calibration)?)
    };
    CalibrateReport {
        id: stored.as_ref().map(|stored| stored.id),
        version: stored.as_ref().map(|stored| stored.version),
        calibration,
        sensor,
    }
    .print(arguments.json)
}

/// Output of `--json`.
#[derive(Serialize)]
struct CalibrateReport {
    id: Option<CalibrationId>,
    version: Option<i64>,
    #[serde(flatten)]
    calibration: Calibration,
    #[serde(skip)]
    sensor: Sensor,
}

impl Report for CalibrateReport {
    fn text(&self, page: &mut Page) {
        points_text(&self.calibration, page);
        let (part, place) = (&self.calibration.record.part, self.sensor.label());
        page.line(match self.id.zip(self.version) {
            Some((id, version)) => {
                format!("stored as calibration {id}, version {version} of \"{part}\", mounted as the {place}")
            }
            None => "not stored".to_owned(),
        });
    }
}

fn part_name(arguments: &CalibrateArguments, sensor: Sensor, store: Option<&Store>) -> Result<String, Failure> {
    let mounted = || -> Result<Option<String>, Failure> {
        let Some(store) = store else { return Ok(None) };
        Ok(store.calibrations().part_in(sensor)?)
    };
    let name = match &arguments.part {
        Some(name) => Some(name.trim().to_owned()),
        None => mounted()?,
    };
    Ok(name.ok_or_else(|| {
        let (place, channel) = (sensor.label(), sensor.channel());
        format!("no part is known as the {place}: give it a name, as in palpate calibrate {channel} --part A7")
    })?)
}

fn record_of_file(arguments: &CalibrateArguments, sensor: Sensor, part: &str, file: &Path) -> Result<Record, Failure> {
    let kind = sensor.kind();
    let board = Board { full_scale: arguments.full_scale, ..Board::default() };
    let mut input = Input::on(&board, sensor);
    input.divider.fixed_ohm = arguments.resistor.unwrap_or(input.divider.fixed_ohm);
    let points = read_points_csv(file, kind)?;
    Ok(Record { part: part.to_owned(), kind, input, points, bending: None, assumed: false, note: String::new() })
}

/// The points with their residuals, and the summary.
fn points_text(calibration: &Calibration, page: &mut Page) {
    let Record { kind, input, points, .. } = &calibration.record;
    let (stimulus, off) = match kind {
        SensorKind::Flex => ("angle [deg]", "residual [deg]"),
        SensorKind::Pad | SensorKind::Raw => ("load [kg]", "residual [%]"),
    };
    let residual = |off: f64| match kind {
        SensorKind::Flex => format!("{:+.2}", off.to_degrees()),
        SensorKind::Pad | SensorKind::Raw => format!("{:+.1}", 100.0 * off),
    };
    let rows = points.iter().zip(calibration.residuals()).map(|(point, off)| {
        let ohm = input.ohm(point.counts);
        let kilo = if ohm < 1e6 { format!("{:.2}", ohm * 1e-3) } else { "open".to_owned() };
        let (shown, counts) = (format!("{:.3}", kind.shown(point.stimulus)), format!("{:.1}", point.counts));
        [shown, counts, kilo, off.map(residual).unwrap_or_default()]
    });
    page.table(&[stimulus, "counts", "kΩ", off], rows);
    page.line(calibration.summary());
    calibration.warnings.iter().for_each(|warning| page.warn(warning));
}
