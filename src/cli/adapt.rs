//! `palpate adapt`: adapts to a real gripper without labels, by one close of its empty hand.

use super::calibrate::weigh;
use super::link;
use super::prelude::*;
use palpate_geometry::units::three_digits;
use palpate_lab::grasping::{Adaptation, AdaptedSensor};
use palpate_lab::gripper::SerialGripper;
use palpate_lab::recording::{TrialRequest, record};
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_store::labels::TrialEdit;
use palpate_tactile::board::SensorKind;
use palpate_tactile::calibration::{Curve, KnownWeight};
use palpate_tactile::trial::Control;

/// Arguments of `palpate adapt`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate adapt
  palpate adapt --port /dev/ttyACM0 --scene fitted.toml
  palpate adapt --by-hand
  palpate adapt --trial 12 --replace

Then: palpate demo --port /dev/ttyACM0

See also: palpate help gripper")]
pub(super) struct AdaptArguments {
    /// Port, or file of captured bytes (default: the only likely port).
    #[arg(long, value_name = "PORT|FILE")]
    port: Option<PathBuf>,
    /// Use this stored trial of the empty hand instead of recording one.
    #[arg(long, value_name = "ID", conflicts_with_all = ["port", "by_hand", "weight"])]
    trial: Option<TrialId>,
    /// You close the empty hand by the control box, in the phases of the programme, from the first reading on.
    #[arg(long)]
    by_hand: bool,
    /// First lay this known weight on each pad (kg).
    #[arg(long, value_name = "KG", value_parser = within(0.02..=0.5))]
    weight: Option<f64>,
    /// Take the readings of the weights as soon as they have settled, instead of on Enter.
    #[arg(long, requires = "weight")]
    auto: bool,
    /// Scene file with the gripper and its programme, such as `palpate fit` writes (default: the default scene).
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Also replace calibrations that were made by hand, at known angles and weights.
    #[arg(long)]
    replace: bool,
    /// Print the result without storing calibrations.
    #[arg(long)]
    dry_run: bool,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Serialize)]
struct AdaptReport {
    trial: TrialId,
    line_bar: f64,
    modelled_curvature_per_m: f64,
    sensors: Vec<SensorReport>,
    warnings: Vec<String>,
    stored: bool,
    /// What was assumed, in a sentence.
    #[serde(skip)]
    assumed: String,
}

#[derive(Serialize)]
struct SensorReport {
    channel: &'static str,
    #[serde(skip)]
    label: String,
    part: Option<String>,
    /// `kept`, `adapted` or `failed`.
    outcome: &'static str,
    /// The calibration, or why there is none.
    about: String,
}

pub(super) fn run(arguments: &AdaptArguments, store: Option<&Path>) -> Result<(), Failure> {
    let scene = match &arguments.scene {
        Some(path) => Scene::named_or_from_file(path)?,
        None => Scene::default(),
    };
    let mut store = open_store(store)?;
    let sensors = store.calibrations().sensors()?;
    let mut weights = Vec::new();
    if let Some(kg) = arguments.weight {
        for sensor in sensors.of_kind(SensorKind::Pad) {
            let point = weigh(arguments.port.as_deref(), sensor, kg, arguments.auto)?;
            weights.push((sensor, KnownWeight { force: point.stimulus, counts: point.counts }));
        }
    }
    let (trial, adaptation) = match arguments.trial {
        Some(id) => (id, Adaptation::from_trial(&store, id, &scene, &weights, arguments.replace)?),
        None => {
            let id = close_empty(arguments, &scene, &store)?;
            (id, Adaptation::from_close(&mut store, id, &scene, &weights, arguments.replace)?)
        }
    };
    if !arguments.dry_run {
        adaptation.keep(&store)?;
    }
    report(&adaptation, trial, arguments).print(arguments.json)?;
    if adaptation.is_complete() { Ok(()) } else { Err("not every sensor could be calibrated".into()) }
}

/// Records a close of the empty hand.
fn close_empty(arguments: &AdaptArguments, scene: &Scene, store: &Store) -> Result<TrialId, Failure> {
    let stop = stop_flag()?;
    let port = arguments.port.as_deref();
    let link = link::open(&link::options(port, true, store.calibrations().sensors()?), link::USUAL_WAIT_S, &stop)?;
    note("take everything out of the hand: it closes empty, without touching anything");
    let control = match (port.is_some_and(Path::is_file), arguments.by_hand) {
        (true, _) => Control::Free,
        (false, true) => Control::ByHand,
        (false, false) => Control::Driven,
    };
    let request = TrialRequest { object: Some(EMPTY.to_owned()), control, length_s: None, adds: false };
    let mut gripper = SerialGripper::new(Box::new(link));
    let recording = record(&mut gripper, scene, request, store.path().to_owned(), &stop, &mut |_progress| ())?;
    let stopped = stop.load(Ordering::Relaxed);
    if stopped || recording.aborted.is_some() {
        store.labels().edit(&[recording.trial.id], &TrialEdit::Discard)?;
    }
    if stopped {
        return Err("stopped; no calibration was stored".into());
    }
    match recording.aborted {
        Some(cause) => Err(format!(
            "the hand did not close: {cause}. Where the board does not drive the hand, close it yourself with --by-hand"
        )
        .into()),
        None => Ok(recording.trial.id),
    }
}

/// A calibration in a few words.
fn about(sensor: &AdaptedSensor) -> String {
    let calibration = match sensor {
        AdaptedSensor::Failed(fault) => return fault.to_string(),
        AdaptedSensor::Kept(calibration) | AdaptedSensor::Adapted(calibration) => calibration,
    };
    match &calibration.curve {
        Curve::Flex(curve) => {
            let flat = three_digits(curve.flat_ohm * 1e-3);
            format!("{flat} kΩ flat, {:.2} times that at 90 degrees", curve.bent_over_flat())
        }
        Curve::Pad(curve) => {
            let bending = calibration.record.bending.as_ref().map(|own| own.preload(curve, own.reaches()));
            let shown = bending.map(|force| format!(", bending shows {} N, subtracted", three_digits(force)));
            format!("{} kΩ at 1 N{}", three_digits(1e-3 / curve.gain), shown.unwrap_or_default())
        }
    }
}

fn report(adaptation: &Adaptation, trial: TrialId, arguments: &AdaptArguments) -> AdaptReport {
    let sensors = adaptation.sensors.iter().map(|(sensor, adapted)| SensorReport {
        channel: sensor.channel(),
        label: sensor.label(),
        part: adapted.calibration().map(|own| own.record.part.clone()),
        outcome: match adapted {
            AdaptedSensor::Kept(_) => "kept",
            AdaptedSensor::Adapted(_) => "adapted",
            AdaptedSensor::Failed(_) => "failed",
        },
        about: about(adapted),
    });
    let pads = if arguments.weight.is_some() { "" } else { ", pads are nominal (--weight measures them)" };
    let scene = if arguments.scene.is_none() { " (`palpate fit` models yours)" } else { "" };
    let (bar, modelled) = (adaptation.bar, adaptation.modelled);
    AdaptReport {
        trial,
        line_bar: bar,
        modelled_curvature_per_m: modelled,
        sensors: sensors.collect(),
        warnings: adaptation.warnings.clone(),
        stored: !arguments.dry_run,
        assumed: format!("at {bar:.2} bar the fingers bend to {modelled:.1} 1/m as the modelled one{scene}{pads}"),
    }
}

impl Report for AdaptReport {
    fn text(&self, page: &mut Page) {
        let row = |sensor: &SensorReport| [&sensor.label, sensor.outcome, &sensor.about].map(str::to_owned);
        page.table(&["sensor", "", "calibration"], self.sensors.iter().map(row));
        self.warnings.iter().for_each(|warning| page.warn(warning));
        page.line(format!("assumed: {}", self.assumed));
        if !self.stored {
            page.line("not stored");
        }
    }
}
