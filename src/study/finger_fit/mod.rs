//! Fit of the simulated finger to a real one: stiffness, damping, pressure-torque curve and lag, from a few recorded
//! grasps.
//!
//! The model is simulated under the recorded line pressure; `least_squares` minimises the differences of its curvature
//! and force from the recording. Parameters, in logarithms: bending stiffness EI, damping time, torques at points of the
//! curve every 0.2 bar; and the filling time of the chambers. Nuisance parameters, within the limits of their
//! calibrations: gain and offset of the strips, gain of the pads, load of the pads by bending, start of each recording.
//!
//! **Identifiability.** In free bending the shape depends only on the ratio of torque to stiffness. The scale follows from
//! the finger's weight and inertia: with closes alone, EI and torques are as uncertain as the mass, and more so the
//! stiffer the finger. A press on a calibrated pad measures a force, and with it the scale. The intervals show what the
//! data determine.

mod course;
mod fitted_model;
mod gap;
mod least_squares;
mod observation;
mod recorded;
#[cfg(test)]
mod tests;
mod watched;

pub use course::FingerMotion;
pub use gap::{ChannelGap, ConstantGap, SimulationGap, simulation_gap};
pub use least_squares::MOST_STEPS;
pub use observation::Observation;
pub use recorded::{RecordedGraspError, RecordedGrasps};
pub use watched::FitWatch;

use fitted_model::{
    DAMPING, FittedModel, LAG, PAD_BENDING, PAD_GAIN, SHIFT, STIFFNESS, STRIP_GAIN, STRIP_OFFSET, TORQUES,
};
use least_squares::{Minimum, Prior, minimise};
use palpate_geometry::units::three_digits;
use palpate_sim::gripper::{BUILD, FittedRanges, GripperModel};
use palpate_sim::physics::SimulationError;
use serde::Serialize;
use std::sync::atomic::AtomicBool;
use watched::Watched;

/// Standard deviations of the sensors' gains and offsets, left and right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trust {
    /// Gain of the strips, as a share.
    pub strip_gain: [f64; 2],
    /// Gain of the pads, as a share.
    pub pad_gain: [f64; 2],
}

impl Default for Trust {
    /// A careful calibration: strips within 1 %, pads within 5 %.
    fn default() -> Self {
        Self { strip_gain: [0.01; 2], pad_gain: [0.05; 2] }
    }
}

/// Identifiability of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Certainty {
    /// Within a tenth of itself.
    Well,
    /// Within a half.
    Roughly,
    /// Not identifiable from the data.
    Hardly,
}

/// One parameter with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Name: a key of the scene, or a ratio.
    pub name: String,
    pub unit: &'static str,
    /// Its most likely value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
    /// Identifiability.
    pub known: Certainty,
}

/// Remaining difference between fitted model and recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Remainder {
    /// The recording.
    pub name: String,
    /// Root mean square over both strips (1/m).
    pub curvature_per_m: f64,
    /// Root mean square over both pads as a share of the force; null where no force was usable.
    pub force_share: Option<f64>,
    /// Delay of its begin against its time stamps (s).
    pub shift_s: f64,
}

/// Result of a fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FingerFit {
    /// The gripper of the first recording's scene, with the fitted finger.
    pub gripper: GripperModel,
    /// Estimates, with intervals.
    pub estimates: Vec<Estimate>,
    /// Each recording against its fitted model.
    pub remainders: Vec<Remainder>,
    /// Width of the intervals relative to noise alone, a measure of model error.
    pub widened: f64,
    /// Steps that the fit took.
    pub steps: u32,
    /// Remarks, in sentences.
    pub remarks: Vec<String>,
    /// Curvature over time, recorded and fitted, of each finger of each recording.
    #[serde(skip)]
    pub courses: Vec<FingerMotion>,
}

/// Error of a fit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FingerFitError {
    #[error("nothing to fit: name recorded trials, such as empty closes and presses against a fixed object")]
    Nothing,
    #[error("{name} has no curvature of either finger: is its flex strip calibrated? See `palpate calibrate list`")]
    NoCurvature {
        /// The recording.
        name: String,
    },
    #[error("{name} hardly moves the fingers ({} 1/m at {} bar): record closes to half a bar and more", three_digits(*curvature), three_digits(*bar))]
    NoMotion {
        /// The recording.
        name: String,
        /// Most curvature (1/m).
        curvature: f64,
        /// Highest pressure (bar).
        bar: f64,
    },
    #[error("{name} lasts {} s: recordings of 0.5 to 60 s can be fitted", three_digits(*duration_s))]
    Length {
        /// The recording.
        name: String,
        /// Its length (s).
        duration_s: f64,
    },
    #[error("the fit was stopped; nothing was changed")]
    Stopped,
    #[error("{name} cannot be simulated with the fitted finger: {cause}")]
    Simulation {
        /// The recording.
        name: String,
        cause: SimulationError,
    },
    #[error(
        "the parameters cannot be identified from these recordings: add an empty close to a higher pressure, or a press \
         against a fixed object"
    )]
    NotIdentifiable,
}

/// Largest distance between points of the torque curve (bar). Curvature between the points cannot be fitted; it widens
/// the intervals.
const KNOT_BAR: f64 = 0.2;

/// Fewest and most points of the torque curve besides zero; each costs one simulation of every recording per step.
const KNOTS: [f64; 2] = [2.0, 8.0];

/// Prior deviation of the finger's parameters from their start, in logarithms: a factor of 4.5, hardly a constraint.
const OPEN: f64 = 1.5;

/// Usual filling time (s).
const USUAL_LAG: Prior = Prior { mean: 0.05, deviation: 0.3 };

/// Deviation of a strip's zero after a tare (1/m): 0.3 degrees.
const OFFSET: f64 = 0.1;

/// Deviation of the load of a pad by bending, beyond its calibrated zero, per curvature (N m): 0.15 N at 15 1/m, which a
/// pad's threshold may hide in an empty close.
const PRELOAD: f64 = 0.01;

/// Deviation of the start of a recording (s): half an actuation tick.
const START: f64 = 0.03;

/// Half width of a 95 % interval, in deviations.
const HALF: f64 = 1.96;

/// Least curvature that a recording must reach (1/m).
const LEAST_CURVATURE: f64 = 2.0;

/// Fits the finger to recordings, starting at the gripper of the first one's scene.
pub fn fit_finger(observations: &[Observation], trust: &Trust) -> Result<FingerFit, FingerFitError> {
    fit_finger_watched(observations, trust, &FitWatch { progress: &|_| (), stop: &AtomicBool::new(false) })
}

/// The same with progress and cancellation.
pub fn fit_finger_watched(
    observations: &[Observation],
    trust: &Trust,
    watch: &FitWatch<'_>,
) -> Result<FingerFit, FingerFitError> {
    let first = observations.first().ok_or(FingerFitError::Nothing)?;
    observations.iter().try_for_each(usable)?;
    let knots = knots_of(observations);
    let mut fitted = FittedModel::new(observations, knots.clone());
    let (start, priors) = beginning(&first.scene.gripper, &knots, observations.len(), trust);
    let minimum = minimise(&mut Watched::new(&mut fitted, watch), &start, &priors)?;
    let mut gripper = fitted.gripper(&first.scene.gripper, &minimum.x);
    gripper.fitted = Some(ranges(&minimum, &knots));
    let estimates = estimates(&minimum, &knots);
    let remainders = remainders(observations, &fitted, &minimum);
    let remarks = remarks(first, &fitted, &minimum, &estimates, &remainders);
    let courses = course::courses(observations, &fitted, &minimum.residuals);
    let Minimum { widened, steps, .. } = minimum;
    Ok(FingerFit { gripper, estimates, remainders, widened, steps, remarks, courses })
}

/// Pressures of the torque curve's points (bar).
fn knots_of(observations: &[Observation]) -> Vec<f64> {
    let peak = observations.iter().map(Observation::peak_bar).fold(0.0, f64::max);
    let count = (peak / KNOT_BAR - 1e-6).ceil().clamp(KNOTS[0], KNOTS[1]);
    (1..=count as u32).map(|k| peak * f64::from(k) / count).collect()
}

fn usable(seen: &Observation) -> Result<(), FingerFitError> {
    let name = seen.name.clone();
    let tracks = seen.tracks();
    if !tracks.iter().any(|track| !track.is_force) {
        return Err(FingerFitError::NoCurvature { name });
    }
    let duration_s = seen.duration();
    if !(0.5..=60.0).contains(&duration_s) {
        return Err(FingerFitError::Length { name, duration_s });
    }
    let bends = tracks.iter().filter(|track| !track.is_force);
    let all = bends.flat_map(|track| (0..seen.signals.len()).map(|k| f64::from(seen.signals.row(k)[track.column])));
    let (curvature, bar) = (all.fold(0.0, f64::max), seen.peak_bar());
    if curvature < LEAST_CURVATURE || bar <= 0.0 {
        return Err(FingerFitError::NoMotion { name, curvature, bar });
    }
    Ok(())
}

/// Start values and priors of the parameters.
fn beginning(gripper: &GripperModel, knots: &[f64], recordings: usize, trust: &Trust) -> (Vec<f64>, Vec<Prior>) {
    let open = |value: f64| Prior { mean: value.max(1e-6).ln(), deviation: OPEN };
    let mut priors = vec![open(gripper.finger.bending_stiffness), open(gripper.finger.damping_time), USUAL_LAG];
    let stiffness = gripper.finger.bending_stiffness;
    priors.extend(knots.iter().map(|bar| open(gripper.actuation.torque(*bar) / stiffness)));
    let known = |deviation: f64| Prior { mean: 0.0, deviation: deviation.max(1e-4) };
    priors.extend(trust.strip_gain.map(known));
    priors.extend([OFFSET; 2].map(known));
    priors.extend(trust.pad_gain.map(known));
    priors.extend([PRELOAD; 2].map(known));
    priors.extend(std::iter::repeat_n(known(START), recordings));
    let mut start: Vec<f64> = priors.iter().map(|prior| prior.mean).collect();
    start[LAG] = gripper.actuation.filling_time.max(0.02);
    (start, priors)
}

fn estimates(minimum: &Minimum, knots: &[f64]) -> Vec<Estimate> {
    let deviation = |j: usize| minimum.covariance[j][j].max(0.0).sqrt();
    let in_logarithms = |name: String, unit: &'static str, x: f64, deviation: f64| {
        let half = HALF * deviation;
        Estimate {
            name,
            unit,
            value: x.exp(),
            low: (x - half).exp(),
            high: (x + half).exp(),
            known: Certainty::within(half),
        }
    };
    let of =
        |name: &str, unit: &'static str, j: usize| in_logarithms(name.to_owned(), unit, minimum.x[j], deviation(j));
    let mut estimates = vec![
        of("gripper.finger.bending_stiffness", "N m²", STIFFNESS),
        of("gripper.finger.damping_time", "s", DAMPING),
    ];
    let (lag, half) = (minimum.x[LAG], HALF * deviation(LAG));
    estimates.push(Estimate {
        name: "gripper.actuation.filling_time".to_owned(),
        unit: "s",
        value: lag,
        low: (lag - half).max(0.0),
        high: lag + half,
        // A lag near zero is judged against a sample of the real gripper, not against itself.
        known: Certainty::within(half / lag.max(0.1)),
    });
    let covariance = &minimum.covariance;
    for (k, bar) in knots.iter().enumerate() {
        let ratio = TORQUES + k;
        let variance = covariance[ratio][ratio] + covariance[STIFFNESS][STIFFNESS] + 2.0 * covariance[ratio][STIFFNESS];
        let torque = minimum.x[ratio] + minimum.x[STIFFNESS];
        estimates.push(in_logarithms(format!("torque at {bar:.2} bar"), "N m", torque, variance.max(0.0).sqrt()));
    }
    let peak = knots.last().copied().unwrap_or(0.0);
    estimates.push(of(&format!("torque at {peak:.2} bar / bending stiffness"), "1/m", TORQUES + knots.len() - 1));
    estimates
}

/// What the fit leaves open: 95 % intervals, but none wider than the range of any gripper of this kind.
fn ranges(minimum: &Minimum, knots: &[f64]) -> FittedRanges {
    let half = |j: usize| HALF * minimum.covariance[j][j].max(0.0).sqrt();
    let about = |half: f64, [low, high]: [f64; 2]| [(-half).exp().max(low), half.exp().min(high)];
    let lag = half(LAG);
    FittedRanges {
        stiffness: about(half(STIFFNESS), BUILD.stiffness),
        torque_per_stiffness: about(half(TORQUES + knots.len() - 1), BUILD.torque),
        filling_s: [-lag.min(minimum.x[LAG].max(0.0)), lag.min(BUILD.filling_s[1])],
    }
}

impl Certainty {
    /// From half the width of an interval as a share.
    fn within(share: f64) -> Self {
        match share {
            share if share <= 0.1 => Self::Well,
            share if share <= 0.5 => Self::Roughly,
            _ => Self::Hardly,
        }
    }
}

fn remainders(observations: &[Observation], fitted: &FittedModel<'_>, minimum: &Minimum) -> Vec<Remainder> {
    let mut sums = vec![[(0.0, 0u32); 2]; observations.len()];
    for ((number, track, k), residual) in fitted.places().zip(&minimum.residuals) {
        let value = f64::from(observations[number].signals.row(k)[track.column]);
        let off = residual * track.deviation(value).unwrap_or(0.0);
        let off = if track.is_force { off / value } else { off };
        let (sum, count) = &mut sums[number][usize::from(track.is_force)];
        (*sum, *count) = (*sum + off * off, *count + 1);
    }
    let mean = |(sum, count): (f64, u32)| (count > 0).then(|| (sum / f64::from(count)).sqrt());
    let shift = |number: usize| minimum.x[fitted.of_finger() + SHIFT + number];
    let each = observations.iter().zip(sums).enumerate();
    each.map(|(number, (seen, [curvature, force]))| Remainder {
        name: seen.name.clone(),
        curvature_per_m: mean(curvature).unwrap_or(0.0),
        force_share: mean(force),
        shift_s: shift(number),
    })
    .collect()
}

fn remarks(
    first: &Observation,
    fitted: &FittedModel<'_>,
    minimum: &Minimum,
    estimates: &[Estimate],
    remainders: &[Remainder],
) -> Vec<String> {
    let mut remarks = Vec::new();
    if !minimum.settled {
        remarks.push(
            "the fit did not converge: these are the numbers of its last step. Start closer with --scene".to_owned(),
        );
    }
    if remainders.iter().all(|remainder| remainder.force_share.is_none()) {
        let grams = 1e3 * first.scene.gripper.finger.mass;
        remarks.push(format!(
            "no force was measured, so stiffness and torques scale with the weight of the finger, {} g: 1 % more weight makes \
             both 1 % larger. Weigh the finger, or add presses with calibrated pads against a fixed object",
            three_digits(grams)
        ));
    }
    for estimate in estimates.iter().filter(|estimate| estimate.known == Certainty::Hardly) {
        let (name, low, high) = (&estimate.name, three_digits(estimate.low), three_digits(estimate.high));
        remarks.push(format!(
            "{name} cannot be identified from the recordings: any value from {low} to {high} {} fits",
            estimate.unit
        ));
    }
    if estimates[STIFFNESS].known != Certainty::Well
        && estimates.last().is_some_and(|ratio| ratio.known == Certainty::Well)
    {
        remarks.push("only the ratio of torque to stiffness is identifiable: change both together".to_owned());
    }
    remarks.extend(corrected_sensors(fitted, minimum));
    if minimum.widened > 5.0 {
        let factor = minimum.widened;
        remarks.push(format!(
            "the fitted model explains the recordings only in part: intervals are {factor:.0} times as wide as the noise would make \
             them. Check the residuals for contact in an empty close, a creeping strip, or a pressure other than commanded"
        ));
    }
    remarks
}

/// Remarks on sensors that the fit corrected by more than their calibration allows.
fn corrected_sensors(fitted: &FittedModel<'_>, minimum: &Minimum) -> Vec<String> {
    let sensor = |j: usize| minimum.x[fitted.of_finger() + j];
    let mut words = Vec::new();
    for (side, name) in ["left", "right"].into_iter().enumerate() {
        let strip = sensor(STRIP_GAIN + side).exp_m1();
        if strip.abs() > 0.03 {
            let percent = 100.0 * strip;
            words.push(format!("the {name} strip seems to read {percent:+.0} %: calibrate it again on its finger"));
        }
        let offset = sensor(STRIP_OFFSET + side);
        if offset.abs() > 3.0 * OFFSET {
            words.push(format!("the {name} strip seems to be {offset:+.2} 1/m off at rest: tare it"));
        }
        let bending = sensor(PAD_BENDING + side);
        if bending.abs() > 2.0 * PRELOAD {
            words.push(format!(
                "bending seems to load the {name} pad by {bending:.3} N for each 1/m: record an empty close for it"
            ));
        }
        let pad = sensor(PAD_GAIN + side).exp_m1();
        if pad.abs() > 0.15 {
            let percent = 100.0 * pad;
            words.push(format!("the {name} pad seems to read {percent:+.0} %: calibrate it again"));
        }
    }
    words
}
