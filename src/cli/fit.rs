//! `palpate fit`: stiffness, damping, torque curve and lag of a real finger from recorded grasps.

use super::Failure;
use super::setup::{SceneArguments, open_store};
use super::terminal::{say, say_json, table, warn};
use palpate_core::objects::EMPTY;
use palpate_core::recording::{CalibrationId, Serving, Store, TrialId};
use palpate_core::scene::Scene;
use palpate_core::sensing::{PressureArea, SensorLayout, Sensors, Signals};
use palpate_core::study::{FingerFit, Known, Observation, Trust, fit_finger};
use palpate_core::units::three_digits;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `palpate fit`.
#[derive(Debug, clap::Args)]
pub(super) struct FitArguments {
    /// Numbers of the trials: a few empty closes, and presses against something held in place.
    #[arg(required = true)]
    trials: Vec<TrialId>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Use these calibrations instead of the newest ones of each part.
    #[arg(long, value_name = "ID,..", value_delimiter = ',')]
    calibrations: Vec<CalibrationId>,
    /// How well the strips' gain is known: one deviation (%).
    #[arg(long, value_name = "PERCENT")]
    strip_gain: Option<f64>,
    /// How well the pads' gain is known: one deviation (%).
    #[arg(long, value_name = "PERCENT")]
    pad_gain: Option<f64>,
    /// Write a scene with the fitted gripper.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// How well a strip's gain repeats once it is calibrated, as a share. Assumed: half a degree in 90.
const STRIP_REPEATS: f64 = 0.005;

/// How well a pad's gain repeats (data sheet, one deviation).
const PAD_REPEATS: f64 = 0.02;

/// What `--json` prints.
#[derive(Serialize)]
struct Told {
    #[serde(flatten)]
    fit: FingerFit,
    trials: Vec<TrialId>,
}

pub(super) fn run(arguments: &FitArguments, store: Option<&Path>) -> Result<(), Failure> {
    let store = open_store(store)?;
    let mut trust = Trust::default();
    let observations: Vec<Observation> =
        arguments.trials.iter().map(|id| observation(arguments, &store, *id, &mut trust)).collect::<Result<_, _>>()?;
    for (given, gains) in [(arguments.strip_gain, &mut trust.strip_gain), (arguments.pad_gain, &mut trust.pad_gain)] {
        if let Some(percent) = given {
            if !(0.01..=100.0).contains(&percent) {
                return Err(format!("a gain known to {percent} % is not possible; write 0.01 to 100").into());
            }
            *gains = [0.01 * percent; 2];
        }
    }
    let fit = fit_finger(&observations, &trust)?;
    if let Some(path) = &arguments.out {
        let mut scene = observations[0].scene.clone();
        scene.gripper = fit.gripper.clone();
        std::fs::write(path, scene.to_toml()).map_err(|e| format!("cannot write \"{}\": {e}", path.display()))?;
    }
    if arguments.json {
        return say_json(&Told { fit, trials: arguments.trials.clone() });
    }
    tell(&fit)?;
    match &arguments.out {
        Some(path) => say(format!("written {}: a scene with the fitted gripper", path.display())),
        None => Ok(()),
    }
}

/// A stored trial as the fit takes it.
fn observation(
    arguments: &FitArguments,
    store: &Store,
    id: TrialId,
    trust: &mut Trust,
) -> Result<Observation, Failure> {
    let info = store.load(id)?.info;
    // What was recorded elsewhere has no scene of its own.
    let own = if info.scene.is_empty() { Scene::default() } else { Scene::from_toml(&info.scene)? };
    let mut scene = own.clone();
    if arguments.scene.says_something() {
        // Of another scene only the gripper counts: what was grasped and how is the trial's.
        scene.gripper = arguments.scene.scene(None)?.gripper;
    }
    let object = if info.object == EMPTY { None } else { own.load_object()? };
    if object.is_some() && !own.holds_object() {
        warn(&format!("trial {id} grasps something that can move: presses against what is held in place tell more"));
    }
    let (signals, line) = if let Some(read) = store.board_signals(id, &arguments.calibrations)? {
        read.derived.warnings.iter().for_each(|warning| warn(&format!("trial {id}: {warning}")));
        trust_of(&read.serving, trust);
        (read.derived.signals, read.line)
    } else if let Some(signals) = store.readings(id)? {
        (signals, Observation::line_of(&own))
    } else {
        (clean_signals(&own, &store.load(id)?)?, Observation::line_of(&own))
    };
    let line = if line.is_empty() { Observation::line_of(&own) } else { line };
    Ok(Observation { name: format!("trial {id}"), signals, line, scene, object })
}

/// How well calibrations know the gain of their parts: what their points say, and no better than parts of these kinds repeat.
fn trust_of(serving: &Serving, trust: &mut Trust) {
    const HALF: f64 = 1.96;
    for (sensor, calibration) in &serving.calibrations {
        let (gains, usual) = match sensor.is_flex() {
            true => (&mut trust.strip_gain, STRIP_REPEATS),
            false => (&mut trust.pad_gain, PAD_REPEATS),
        };
        let told = calibration.gain_interval().map_or(2.0 * usual, |half| half / HALF);
        gains[*sensor as usize % 2] = told.max(usual);
    }
}

fn clean_signals(scene: &Scene, trial: &palpate_core::trial::Trial) -> Result<Signals, Failure> {
    let layout = SensorLayout::named("C1+F")?;
    Ok(Sensors::new(&layout, &scene.gripper, PressureArea::Participation)?.signals(trial))
}

fn tell(fit: &FingerFit) -> Result<(), Failure> {
    let known = |known: Known| match known {
        Known::Well => "well known",
        Known::Roughly => "roughly known",
        Known::Hardly => "hardly known",
    };
    let rows: Vec<Vec<String>> = fit
        .estimates
        .iter()
        .map(|estimate| {
            let [value, low, high] = [estimate.value, estimate.low, estimate.high].map(three_digits);
            vec![
                estimate.name.clone(),
                value,
                format!("{low} to {high}"),
                estimate.unit.to_owned(),
                known(estimate.known).to_owned(),
            ]
        })
        .collect();
    table(&["fitted", "value", "95 %", "unit", ""], &rows)?;
    say("")?;
    let rows: Vec<Vec<String>> = fit
        .remainders
        .iter()
        .map(|left| {
            let force = left.force_share.map_or_else(|| "–".to_owned(), |share| format!("{:.1} %", 100.0 * share));
            let shift = format!("{:+.0} ms", 1e3 * left.shift_s);
            vec![left.name.clone(), format!("{} 1/m", three_digits(left.curvature_per_m)), force, shift]
        })
        .collect();
    table(&["left over (rms)", "curvature", "force", "began late by"], &rows)?;
    fit.remarks.iter().for_each(|remark| warn(remark));
    Ok(())
}
