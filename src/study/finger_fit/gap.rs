//! How far simulation and recordings are apart: per channel, with the finger as it is and fitted, and which constants would
//! close most of it.

use super::fitted_model::{DAMPING, FittedModel, LAG, PAD_BENDING, PAD_GAIN, SHIFT, STIFFNESS, STRIP_GAIN, TORQUES};
use super::least_squares::{Prior, Problem, minimise};
use super::observation::Observation;
use super::watched::{FitWatch, Watched};
use super::{FingerFitError, Trust, beginning, knots_of, usable};
use palpate_learn::evaluation::answer;
use palpate_learn::{Class, Dataset, Example, Fitting, Labels, Sequence, SplitPlan, method};
use palpate_sim::gripper::Side;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Shifts that are tried for the lag of a channel (s).
const SHIFTS: [f64; 2] = [0.2, 0.005];
/// Parts of a recording whose means tell it from its simulation: noise is not to tell.
const PARTS: usize = 20;
/// Fewest recordings that are told apart from their simulations.
const FEWEST: usize = 10;
/// What tells them apart, and its folds.
const TELLING: (&str, usize) = ("extra-trees", 5);

/// How far simulation and recordings are apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulationGap {
    pub channels: Vec<ChannelGap>,
    /// Constants and what each alone would leave, the best first.
    pub constants: Vec<ConstantGap>,
}

/// One channel; each pair is with the finger as it is, and fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelGap {
    /// `curvature_left`.
    pub name: String,
    pub unit: &'static str,
    /// Mean of simulated minus recorded readings, in the unit.
    pub bias: [f64; 2],
    /// Root mean square of the difference, in the unit.
    pub rmse: [f64; 2],
    /// Time by which the simulation is late (s).
    pub lag_s: [f64; 2],
    /// Share of grasps that a learner tells right as recorded or simulated, by this channel; a half is chance. None for fewer
    /// than ten recordings.
    pub told_apart: [Option<f64>; 2],
}

/// A constant, fitted alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConstantGap {
    pub name: &'static str,
    /// Share of the squared difference that is left, in units of the noise.
    pub left: f64,
}

/// Parameters that are fitted alone, by a name.
fn constants(of_finger: usize, recordings: usize) -> [(&'static str, Range<usize>); 8] {
    let sensor = |first: usize, count: usize| of_finger + first..of_finger + first + count;
    [
        ("gripper.finger.bending_stiffness", STIFFNESS..STIFFNESS + 1),
        ("gripper.finger.damping_time", DAMPING..DAMPING + 1),
        ("gripper.actuation.filling_time", LAG..LAG + 1),
        ("gripper.actuation.curve", TORQUES..of_finger),
        ("gain and zero of the strips", sensor(STRIP_GAIN, PAD_GAIN - STRIP_GAIN)),
        ("gain of the pads", sensor(PAD_GAIN, PAD_BENDING - PAD_GAIN)),
        ("load of the pads by bending", sensor(PAD_BENDING, SHIFT - PAD_BENDING)),
        ("time stamps of the recordings", sensor(SHIFT, recordings)),
    ]
}

/// Compares recordings with their simulations, before and after a fit to them.
pub fn simulation_gap(
    observations: &[Observation],
    trust: &Trust,
    watch: &FitWatch<'_>,
) -> Result<SimulationGap, FingerFitError> {
    let first = observations.first().ok_or(FingerFitError::Nothing)?;
    observations.iter().try_for_each(usable)?;
    let knots = knots_of(observations);
    let mut model = FittedModel::new(observations, knots.clone());
    let (mut start, priors) = beginning(&first.scene.gripper, &knots, observations.len(), trust);
    // The finger as it is: a fit starts with some filling time.
    start[LAG] = first.scene.gripper.actuation.filling_time;
    let constants = constants(model.of_finger(), observations.len());
    let rounds = (constants.len() + 1) as f64;
    let mut done = 0.0;
    let mut fitted = |model: &mut FittedModel<'_>, free: Vec<usize>| {
        let progress = |steps: f64| (watch.progress)((done + (steps / f64::from(super::MOST_STEPS)).min(1.0)) / rounds);
        let watch = FitWatch { progress: &progress, stop: watch.stop };
        let free_priors: Vec<Prior> = free.iter().map(|j| priors[*j]).collect();
        let begin: Vec<f64> = free.iter().map(|j| start[*j]).collect();
        // Torques are kept as ratios to the stiffness: a stiffness by itself leaves the torques.
        let ratios = if free == [STIFFNESS] { TORQUES..model.of_finger() } else { 0..0 };
        let mut only = Only { problem: model, x: start.clone(), free, ratios };
        let minimum = minimise(&mut Watched::new(&mut only, &watch), &begin, &free_priors)?;
        let whole = only.whole(&minimum.x);
        done += 1.0;
        Ok::<_, FingerFitError>((whole, squares(&minimum.residuals)))
    };
    let (best, _) = fitted(&mut model, (0..start.len()).collect())?;
    let before = squares(&model.residuals(&start)?);
    let mut closed = Vec::new();
    for (name, range) in constants {
        let (_, after) = fitted(&mut model, range.collect())?;
        closed.push(ConstantGap { name, left: after / before.max(f64::MIN_POSITIVE) });
    }
    closed.sort_by(|a, b| a.left.total_cmp(&b.left));
    let mut channels: BTreeMap<Place, [Differences; 2]> = BTreeMap::new();
    for (which, x) in [&start, &best].into_iter().enumerate() {
        for (place, own) in differences(&mut model, observations, x)? {
            channels.entry(place).or_default()[which] = own;
        }
    }
    Ok(SimulationGap {
        channels: channels.iter().map(|(place, pair)| ChannelGap::of(*place, pair)).collect(),
        constants: closed,
    })
}

fn squares(residuals: &[f64]) -> f64 {
    residuals.iter().map(|residual| residual * residual).sum()
}

/// A problem of which only some parameters are free.
struct Only<'a, P> {
    problem: &'a mut P,
    /// All parameters, the others at their start.
    x: Vec<f64>,
    free: Vec<usize>,
    /// Logarithms of ratios to the stiffness that fall as it rises.
    ratios: Range<usize>,
}

impl<P: Problem> Only<'_, P> {
    fn whole(&self, x: &[f64]) -> Vec<f64> {
        let mut whole = self.x.clone();
        self.free.iter().zip(x).for_each(|(j, value)| whole[*j] = *value);
        let risen = whole[STIFFNESS] - self.x[STIFFNESS];
        whole[self.ratios.clone()].iter_mut().for_each(|ratio| *ratio -= risen);
        whole
    }
}

impl<P: Problem> Problem for Only<'_, P> {
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, FingerFitError> {
        let whole = self.whole(x);
        self.problem.residuals(&whole)
    }

    fn step(&self, parameter: usize) -> f64 {
        self.problem.step(self.free[parameter])
    }

    fn least(&self, parameter: usize) -> f64 {
        self.problem.least(self.free[parameter])
    }
}

/// Kind and finger of a channel: force, else curvature.
type Place = (bool, usize);

/// Samples of a channel of a recording: time (s), then the recorded and the simulated reading.
type Samples = Vec<(f64, [f64; 2])>;

/// Differences of one channel in all recordings.
#[derive(Clone, Debug, Default)]
struct Differences {
    /// Simulated minus recorded.
    off: Vec<f64>,
    lag_s: f64,
    /// Means over the parts of each recording: recorded, then simulated.
    means: Vec<[Vec<f32>; 2]>,
}

/// Differences of all channels at a point.
fn differences(
    model: &mut FittedModel<'_>,
    observations: &[Observation],
    x: &[f64],
) -> Result<BTreeMap<Place, Differences>, FingerFitError> {
    let residuals = model.residuals(x)?;
    let mut found: BTreeMap<Place, Differences> = BTreeMap::new();
    let mut series: BTreeMap<(Place, usize), Samples> = BTreeMap::new();
    for ((number, track, k), residual) in model.places().zip(&residuals) {
        let seen = &observations[number].signals;
        let value = f64::from(seen.row(k)[track.column]);
        let off = residual * track.deviation(value).unwrap_or(0.0);
        let place = (track.is_force, track.side.index());
        found.entry(place).or_default().off.push(off);
        series.entry((place, number)).or_default().push((seen.t_s[k], [value, value + off]));
    }
    for ((place, number), samples) in series {
        let duration = observations[number].duration().max(f64::MIN_POSITIVE);
        let means = [0, 1].map(|which| means(samples.iter().map(|(t, pair)| (t / duration, pair[which]))));
        found.entry(place).or_default().means.push(means);
    }
    let lags = lags(model, observations.len(), x)?;
    found.iter_mut().for_each(|(place, own)| own.lag_s = lags.get(place).copied().unwrap_or(0.0));
    Ok(found)
}

/// Means over equal parts; a part without samples has the mean before it.
fn means(samples: impl Iterator<Item = (f64, f64)>) -> Vec<f32> {
    let mut sums = [(0.0, 0u32); PARTS];
    for (share, value) in samples {
        let (sum, count) = &mut sums[((share * PARTS as f64) as usize).min(PARTS - 1)];
        (*sum, *count) = (*sum + value, *count + 1);
    }
    let mut last = 0.0;
    let mean = |(sum, count): (f64, u32)| {
        if count > 0 {
            last = (sum / f64::from(count)) as f32;
        }
        last
    };
    sums.into_iter().map(mean).collect()
}

/// Time by which each channel of the simulation is late (s): shifted back by it, the difference is least.
fn lags(model: &mut FittedModel<'_>, recordings: usize, x: &[f64]) -> Result<BTreeMap<Place, f64>, FingerFitError> {
    let [most, step] = SHIFTS;
    let first = model.of_finger() + SHIFT;
    let mut best: BTreeMap<Place, (f64, f64)> = BTreeMap::new();
    for k in 0..=(2.0 * most / step).round() as usize {
        let shift = -most + step * k as f64;
        let mut shifted = x.to_vec();
        shifted[first..first + recordings].iter_mut().for_each(|own| *own += shift);
        let residuals = model.residuals(&shifted)?;
        let mut sums: BTreeMap<Place, f64> = BTreeMap::new();
        for ((_, track, _), residual) in model.places().zip(&residuals) {
            *sums.entry((track.is_force, track.side.index())).or_default() += residual * residual;
        }
        for (place, sum) in sums {
            let own = best.entry(place).or_insert((f64::INFINITY, 0.0));
            // Of equal ones the smaller shift.
            if sum < own.0 || sum == own.0 && shift.abs() < own.1.abs() {
                *own = (sum, shift);
            }
        }
    }
    // A simulation that has to be shifted later is early.
    Ok(best.into_iter().map(|(place, (_, shift))| (place, 0.0 - (1e3 * shift).round() * 1e-3)).collect())
}

impl ChannelGap {
    fn of((is_force, side): Place, pair: &[Differences; 2]) -> Self {
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len().max(1) as f64;
        let (quantity, unit) = if is_force { ("force", "N") } else { ("curvature", "1/m") };
        let of = |pick: &dyn Fn(&Differences) -> f64| [pick(&pair[0]), pick(&pair[1])];
        Self {
            name: format!("{quantity}_{}", Side::BOTH[side].name()),
            unit,
            bias: of(&|own| mean(&own.off)),
            rmse: of(&|own| mean(&own.off.iter().map(|off| off * off).collect::<Vec<_>>()).sqrt()),
            lag_s: of(&|own| own.lag_s),
            told_apart: [told_apart(&pair[0].means), told_apart(&pair[1].means)],
        }
    }
}

/// Share of grasps that are told right as recorded or simulated, by cross-validation; none for too few.
fn told_apart(means: &[[Vec<f32>; 2]]) -> Option<f64> {
    if means.len() < FEWEST {
        return None;
    }
    let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
    let labels = Labels { classes: ["recorded", "simulated"].map(class).to_vec(), ..Labels::default() };
    let example = |(k, (class, values)): (usize, (usize, &Vec<f32>))| {
        let t_s = (0..PARTS).map(|part| part as f32 / PARTS as f32).collect();
        let grasp = Arc::new(Sequence { t_s, values: values.clone() });
        Example { id: k as i64, class, content: k as u64, grasp, ..Example::default() }
    };
    let all = means.iter().flat_map(|pair| pair.iter().enumerate());
    let examples = all.enumerate().map(example).collect();
    let data = Dataset { channels: vec!["channel".to_owned()], labels, examples, ..Dataset::default() };
    let stop = std::sync::atomic::AtomicBool::new(false);
    let (key, folds) = TELLING;
    let mut right = Vec::new();
    for split in (SplitPlan::Folds { folds }).splits(&data, 1, 1).ok()? {
        let model = method(key)?.train(&data.part(&split.all_training()), &Fitting::new(1, true, &stop)).ok()?;
        let answers = answer(model.recogniser.as_ref(), &data.part(&split.test));
        right.extend(answers.verdicts.iter().zip(&answers.truth).map(|(said, truth)| said.pmf.top().0 == *truth));
    }
    Some(right.iter().filter(|right| **right).count() as f64 / right.len().max(1) as f64)
}
