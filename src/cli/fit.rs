//! `palpate fit`: estimates stiffness, damping, torque curve and lag of a real finger from recorded grasps.

use super::prelude::*;
use palpate_geometry::units::three_digits;
use palpate_store::CalibrationId;
use palpate_study::{Certainty, FingerFit, RecordedGrasps, fit_finger};

/// Arguments of `palpate fit`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  palpate fit 12 13 --out fitted.toml
  palpate fit 12 13 14 --strip-gain 3 --pad-gain 5 --json")]
pub(super) struct FitArguments {
    #[command(flatten)]
    recorded: RecordedArguments,
    /// Standard deviation of the strips' gain (%).
    #[arg(long, value_name = "PERCENT")]
    strip_gain: Option<f64>,
    /// Standard deviation of the pads' gain (%).
    #[arg(long, value_name = "PERCENT")]
    pad_gain: Option<f64>,
    /// Scene file to write, with the fitted gripper.
    #[arg(long, value_name = "FILE.toml", value_parser = file_of(&[FileKind::Scene]))]
    out: Option<PathBuf>,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Recorded grasps beside which the finger is simulated.
#[derive(Debug, clap::Args)]
pub(super) struct RecordedArguments {
    /// Trial numbers: a few empty closes, and presses against a fixed object.
    #[arg(required = true)]
    trials: Vec<TrialId>,
    #[command(flatten)]
    scene: Option<SceneArguments>,
    /// Calibration numbers to use instead of the newest of each part.
    #[arg(long, value_name = "ID,..", value_delimiter = ',')]
    calibrations: Vec<CalibrationId>,
}

impl RecordedArguments {
    /// Reads them, and warns of what is doubtful.
    pub(super) fn read(&self, store: Option<&Path>) -> Result<RecordedGrasps, Failure> {
        let store = read_store(store)?;
        // Only the gripper of the scene is used.
        let scene = self.scene.as_ref().map(|scene| scene.scene(None)).transpose()?;
        let gripper = scene.as_ref().map(|scene| &scene.gripper);
        let mut recorded = RecordedGrasps::default();
        for id in &self.trials {
            recorded.add(&store, *id, gripper, &self.calibrations)?;
        }
        recorded.warnings.iter().for_each(|warning| warn(warning));
        Ok(recorded)
    }
}

/// Output of `--json`.
#[derive(Serialize)]
struct FitReport {
    #[serde(flatten)]
    fit: FingerFit,
    trials: Vec<TrialId>,
    #[serde(skip)]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: &FitArguments, store: Option<&Path>) -> Result<(), Failure> {
    if let Some(path) = &arguments.out {
        check_new(path, FileKind::Scene)?;
    }
    let RecordedGrasps { observations, mut trust, .. } = arguments.recorded.read(store)?;
    for (given, gains) in [(arguments.strip_gain, &mut trust.strip_gain), (arguments.pad_gain, &mut trust.pad_gain)] {
        if let Some(percent) = given {
            if !(0.01..=100.0).contains(&percent) {
                return Err(format!("a standard deviation of {percent} % is out of range; write 0.01 to 100").into());
            }
            *gains = [0.01 * percent; 2];
        }
    }
    let fit = fit_finger(&observations, &trust)?;
    if let Some(path) = &arguments.out {
        let mut scene = observations[0].scene.clone();
        scene.gripper = fit.gripper.clone();
        write_new(path, FileKind::Scene, scene.to_toml().as_bytes())?;
    }
    FitReport { fit, trials: arguments.recorded.trials.clone(), out: arguments.out.clone() }.print(arguments.json)
}

impl Report for FitReport {
    fn text(&self, page: &mut Page) {
        let estimates = self.fit.estimates.iter().map(|estimate| {
            let [value, low, high] = [estimate.value, estimate.low, estimate.high].map(three_digits);
            let known = match estimate.known {
                Certainty::Well => "well known",
                Certainty::Roughly => "roughly known",
                Certainty::Hardly => "hardly known",
            };
            [estimate.name.clone(), value, format!("{low} to {high}"), estimate.unit.to_owned(), known.to_owned()]
        });
        page.table(&["parameter", "value", "95 %", "unit", ""], estimates);
        page.line("");
        let remainders = self.fit.remainders.iter().map(|left| {
            let force = left.force_share.map_or_else(|| "–".to_owned(), |share| format!("{:.1} %", 100.0 * share));
            let curvature = format!("{} 1/m", three_digits(left.curvature_per_m));
            [left.name.clone(), curvature, force, format!("{:+.0} ms", 1e3 * left.shift_s)]
        });
        page.table(&["residual (RMS)", "curvature", "force", "delay"], remainders);
        self.fit.remarks.iter().for_each(|remark| page.warn(remark));
        if let Some(path) = &self.out {
            let (path, what) = (path.display(), "a scene with the fitted gripper");
            page.line(format!("written: {path}, {what}; palpate help gripper says how a model learns its grasps"));
        }
    }
}
