//! `palpate adapt`: adapts to a real gripper without labels, by one close of its empty hand.

use super::Failure;
use super::calibrate::weigh;
use super::interrupt::stop_flag;
use super::link;
use super::setup::{open_store, within};
use super::terminal::{note, say, say_json, table, warn};
use palpate_device::serial::LinkOptions;
use palpate_geometry::units::three_digits;
use palpate_lab::grasping::{Adaptation, AdaptedSensor};
use palpate_lab::gripper::SerialGripper;
use palpate_lab::recording::{TrialRequest, record};
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::{Curve, KnownWeight};
use palpate_tactile::trial::{Control, TrialId};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

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
struct Report {
    trial: TrialId,
    line_bar: f64,
    modelled_curvature_per_m: f64,
    sensors: Vec<SensorReport>,
    warnings: Vec<String>,
    stored: bool,
}

#[derive(Serialize)]
struct SensorReport {
    channel: &'static str,
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
    let mut weights = [None; 2];
    if let Some(kg) = arguments.weight {
        for (weight, sensor) in weights.iter_mut().zip([Sensor::PadLeft, Sensor::PadRight]) {
            let point = weigh(arguments.port.as_deref(), sensor, kg, arguments.auto)?;
            *weight = Some(KnownWeight { force: point.stimulus, counts: point.counts });
        }
    }
    let (trial, adaptation) = match arguments.trial {
        Some(id) => (id, Adaptation::from_trial(&store, id, &scene, weights, arguments.replace)?),
        None => {
            let id = close_empty(arguments, &scene, store.path())?;
            (id, Adaptation::from_close(&mut store, id, &scene, weights, arguments.replace)?)
        }
    };
    if !arguments.dry_run {
        adaptation.keep(&store)?;
    }
    if arguments.json {
        say_json(&report(&adaptation, trial, !arguments.dry_run))?;
    } else {
        print(&adaptation, arguments)?;
    }
    if adaptation.is_complete() { Ok(()) } else { Err("not every sensor could be calibrated".into()) }
}

/// Records a close of the empty hand.
fn close_empty(arguments: &AdaptArguments, scene: &Scene, store: &Path) -> Result<TrialId, Failure> {
    let stop = stop_flag()?;
    let captured = arguments.port.as_deref().is_some_and(Path::is_file);
    let replay_speed = if captured { f64::INFINITY } else { 1.0 };
    let options = LinkOptions { path: arguments.port.clone(), replay_speed, ..LinkOptions::default() };
    let link = link::open(&options, link::USUAL_WAIT_S, || stop.load(Ordering::Relaxed))?;
    note("take everything out of the hand: it closes empty, without touching anything");
    let control = match (captured, arguments.by_hand) {
        (true, _) => Control::Free,
        (false, true) => Control::ByHand,
        (false, false) => Control::Driven,
    };
    let request = TrialRequest { object: Some(EMPTY.to_owned()), control, length_s: None, adds: false };
    let mut gripper = SerialGripper::new(Box::new(link));
    let recording = record(&mut gripper, scene, request, store.to_owned(), &stop, &mut |_progress| ())?;
    if stop.load(Ordering::Relaxed) {
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
            format!("{flat} kOhm flat, {:.2} times that at 90 degrees", curve.bent_over_flat())
        }
        Curve::Pad(curve) => {
            let bending = calibration.record.bending.as_ref().map(|own| own.preload(curve, own.reaches()));
            let shown = bending.map(|force| format!(", bending shows {} N, subtracted", three_digits(force)));
            format!("{} kOhm at 1 N{}", three_digits(1e-3 / curve.gain), shown.unwrap_or_default())
        }
    }
}

fn outcome(sensor: &AdaptedSensor) -> &'static str {
    match sensor {
        AdaptedSensor::Kept(_) => "kept",
        AdaptedSensor::Adapted(_) => "adapted",
        AdaptedSensor::Failed(_) => "failed",
    }
}

fn report(adaptation: &Adaptation, trial: TrialId, stored: bool) -> Report {
    let sensors = Sensor::ALL.into_iter().zip(&adaptation.sensors).map(|(sensor, adapted)| SensorReport {
        channel: sensor.channel(),
        part: adapted.calibration().map(|own| own.record.part.clone()),
        outcome: outcome(adapted),
        about: about(adapted),
    });
    Report {
        trial,
        line_bar: adaptation.bar,
        modelled_curvature_per_m: adaptation.modelled,
        sensors: sensors.collect(),
        warnings: adaptation.warnings.clone(),
        stored,
    }
}

fn print(adaptation: &Adaptation, arguments: &AdaptArguments) -> Result<(), Failure> {
    let rows: Vec<Vec<String>> = Sensor::ALL
        .into_iter()
        .zip(&adaptation.sensors)
        .map(|(sensor, adapted)| vec![sensor.label().to_owned(), outcome(adapted).to_owned(), about(adapted)])
        .collect();
    table(&["sensor", "", "calibration"], &rows)?;
    adaptation.warnings.iter().for_each(|warning| warn(warning));
    let pads = if arguments.weight.is_some() { "" } else { ", pads are nominal (--weight measures them)" };
    say(format!(
        "assumed: at {:.2} bar the fingers bend to {:.1} 1/m as the modelled one{}{pads}",
        adaptation.bar,
        adaptation.modelled,
        if arguments.scene.is_none() { " (`palpate fit` models yours)" } else { "" },
    ))?;
    if arguments.dry_run { say("not stored") } else { Ok(()) }
}
