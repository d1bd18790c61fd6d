//! `palpate fit`: stiffness, damping, torque curve and lag of a real finger from recorded grasps.

use super::Failure;
use super::setup::{SceneArguments, open_store};
use super::terminal::{say, say_json, table, warn};
use palpate_store::CalibrationId;
use palpate_tactile::trial::TrialId;
use palpate_lab::study::{FingerFit, Known, RecordedGrasps, fit_finger};
use palpate_geometry::units::three_digits;
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

/// What `--json` prints.
#[derive(Serialize)]
struct Told {
    #[serde(flatten)]
    fit: FingerFit,
    trials: Vec<TrialId>,
}

pub(super) fn run(arguments: &FitArguments, store: Option<&Path>) -> Result<(), Failure> {
    let store = open_store(store)?;
    // Of another scene only the gripper counts.
    let scene = arguments.scene.says_something().then(|| arguments.scene.scene(None)).transpose()?;
    let gripper = scene.as_ref().map(|scene| &scene.gripper);
    let mut recorded = RecordedGrasps::default();
    for id in &arguments.trials {
        recorded.add(&store, *id, gripper, &arguments.calibrations)?;
    }
    let RecordedGrasps { observations, mut trust, warnings } = recorded;
    warnings.iter().for_each(|warning| warn(warning));
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
