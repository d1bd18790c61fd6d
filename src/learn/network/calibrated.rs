//! Calibrated networks: a macro-layer, and temperatures per time step that calibrate its probabilities.
//!
//! Temperatures are fitted to held-out grasps: a first network is trained without a sixth of the grasps and evaluated on
//! them; the final one is trained on all. Cross-fitting leaves out each of several larger parts once, so that every grasp
//! has scores of a network that was not trained on it; the next stage is trained on these.

use super::macro_layer::{LiveMacroLayer, MacroLayer, MacroShape};
use super::training::{Training, TrainingSequence, TrainingSet, train, train_on};
use super::training_set::StageInputs;
use crate::fitting::{Fitting, LearnError};
use crate::pmf::Pmf;
use crate::temperature::{Temperatures, best_temperature};
use std::ops::Range;

/// A network and its temperatures.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Calibrated {
    pub(super) layer: MacroLayer,
    /// `[groups][steps]`; the last step applies to later ones. Empty without calibration.
    pub(super) temperatures: Vec<Vec<f32>>,
}

/// Settings of one fit.
#[derive(Clone, Debug)]
pub(super) struct Plan<'a> {
    pub(super) shape: MacroShape,
    pub(super) training: &'a Training,
    /// Part of each sequence; part 0 is held out for calibration. `None` for networks that are not calibrated.
    pub(super) held_out: Option<&'a [usize]>,
    pub(super) seed: u64,
    /// Progress of the whole fit at the start and end of this one.
    pub(super) share: Range<f64>,
}

/// Scores of each grasp, `[steps][outputs]`, by a network not trained on it; `None` for grasps that were never held out.
pub(super) type HeldOut = Vec<Option<Vec<f32>>>;

/// Some of the sequences of a stage.
struct Subset<'a> {
    inputs: &'a StageInputs,
    kept: Vec<usize>,
}

impl TrainingSet for Subset<'_> {
    fn count(&self) -> usize {
        self.kept.len()
    }

    fn longest(&self) -> usize {
        self.inputs.longest()
    }

    fn draw(&self, k: usize, random: &mut dyn rand::Rng, drawn: &mut TrainingSequence) {
        self.inputs.draw(self.kept[k], random, drawn);
    }
}

impl Calibrated {
    /// Trains on all sequences, with temperatures from held-out ones. Returns also the scores of the held-out ones.
    pub(super) fn fit(
        plan: &Plan<'_>,
        inputs: &StageInputs,
        fitting: &Fitting<'_>,
    ) -> Result<(Self, HeldOut), LearnError> {
        let (middle, seed) = (0.5 * (plan.share.start + plan.share.end), plan.seed);
        let mut held_out: HeldOut = vec![None; inputs.count()];
        let Some(fold_of) = plan.held_out else {
            let layer = plan.train(inputs, fitting, seed, &|_| true)?;
            return Ok((Self { layer, temperatures: Vec::new() }, held_out));
        };
        let first = Plan { share: plan.share.start..middle, ..plan.clone() };
        let layer = first.train(inputs, fitting, seed, &|k| fold_of[k] != 0)?;
        for (k, held) in held_out.iter_mut().enumerate().filter(|(k, _)| fold_of[*k] == 0) {
            *held = Some(scores_at_every_step(&layer, &inputs.sequences[k]));
        }
        let second = Plan { share: middle..plan.share.end, ..plan.clone() };
        let layer = second.train(inputs, fitting, seed + 1, &|_| true)?;
        let answered: Vec<(&[f32], &[usize])> = held_out
            .iter()
            .enumerate()
            .filter_map(|(k, held)| Some((held.as_deref()?, inputs.targets[k].as_slice())))
            .collect();
        let temperatures = fit_temperatures(&answered, &plan.shape.groups);
        Ok((Self { layer, temperatures }, held_out))
    }

    /// Scores every sequence by a network trained on the other parts only.
    pub(super) fn cross_fit(
        plan: &Plan<'_>,
        (part_of, parts): (&[usize], usize),
        inputs: &StageInputs,
        fitting: &Fitting<'_>,
    ) -> Result<HeldOut, LearnError> {
        let mut held_out: HeldOut = vec![None; inputs.count()];
        let share = (plan.share.end - plan.share.start) / parts.max(1) as f64;
        for part in 0..parts {
            let from = plan.share.start + share * part as f64;
            let one = Plan { share: from..from + share, ..plan.clone() };
            let layer = one.train(inputs, fitting, plan.seed + 10 + part as u64, &|k| part_of[k] != part)?;
            for (k, held) in held_out.iter_mut().enumerate().filter(|(k, _)| part_of[*k] == part) {
                *held = Some(scores_at_every_step(&layer, &inputs.sequences[k]));
            }
        }
        Ok(held_out)
    }

    /// Continues training on other inputs; temperatures stay.
    pub(super) fn refine(
        &mut self,
        inputs: &StageInputs,
        training: &Training,
        seed: u64,
        share: Range<f64>,
        fitting: &Fitting<'_>,
    ) -> Result<(), LearnError> {
        let mut go_on = progress_of(fitting, share.start, share.end - share.start, training.epochs);
        train_on(&mut self.layer, inputs, training, seed, &mut go_on);
        fitting.check()
    }

    /// Shape of the network.
    pub(super) fn shape(&self) -> &MacroShape {
        self.layer.shape()
    }

    /// Scores of one sequence after each of its steps, `[steps][outputs]`.
    pub(super) fn scores(&self, x: &[f32]) -> Vec<f32> {
        scores_at_every_step(&self.layer, x)
    }

    /// PMF of each group after the last step of a sequence; `None` for an empty one.
    pub(super) fn pmfs_after(&self, x: &[f32]) -> Option<Vec<Pmf>> {
        pmfs_at_the_end(&self.scores(x), &self.shape().groups, &self.temperatures)
    }

    /// Calibrated PMF of each group from the scores after a step.
    pub(super) fn pmfs(&self, scores: &[f32], step: usize) -> Vec<Pmf> {
        calibrated_pmfs(scores, &self.shape().groups, &self.temperatures, step)
    }

    /// Temperature of the first group at the last step.
    pub(super) fn last_temperature(&self) -> f32 {
        self.temperatures.first().and_then(|of_group| of_group.last()).copied().unwrap_or(1.0)
    }
}

impl Plan<'_> {
    /// Trains a network on some of the sequences.
    fn train(
        &self,
        inputs: &StageInputs,
        fitting: &Fitting<'_>,
        seed: u64,
        keeps: &dyn Fn(usize) -> bool,
    ) -> Result<MacroLayer, LearnError> {
        let subset = Subset { inputs, kept: (0..inputs.count()).filter(|k| keeps(*k)).collect() };
        let mut go_on = progress_of(fitting, self.share.start, self.share.end - self.share.start, self.training.epochs);
        let layer = train(self.shape.clone(), &subset, self.training, seed, &mut go_on);
        fitting.check().map(|()| layer)
    }
}

/// Callback of the training loop: reports progress, and stops on request.
fn progress_of<'a>(
    fitting: &'a Fitting<'_>,
    from: f64,
    share: f64,
    epochs: usize,
) -> impl FnMut(usize, f64) -> bool + 'a {
    move |epoch, _| {
        (fitting.progress)(from + share * (epoch + 1) as f64 / epochs.max(1) as f64);
        fitting.check().is_ok()
    }
}

/// Temperature of a group at a step.
fn temperature(of_group: &[f32], step: usize) -> f64 {
    of_group.get(step.min(of_group.len().saturating_sub(1))).map_or(1.0, |t| f64::from(*t))
}

fn calibrated_pmfs(scores: &[f32], groups: &[usize], temperatures: &[Vec<f32>], step: usize) -> Vec<Pmf> {
    let mut rest = scores;
    groups
        .iter()
        .enumerate()
        .map(|(group, &classes)| {
            let (own, others) = rest.split_at(classes);
            rest = others;
            let temperature = temperatures.get(group).map_or(1.0, |of_group| temperature(of_group, step));
            Pmf::from_scores(own.iter().map(|s| f64::from(*s) / temperature))
        })
        .collect()
}

/// PMF of each group from scores after every step, `[steps][outputs]`, at the last one; `None` without steps.
pub(super) fn pmfs_at_the_end(scores: &[f32], groups: &[usize], temperatures: &[Vec<f32>]) -> Option<Vec<Pmf>> {
    let outputs: usize = groups.iter().sum();
    let last = (scores.len() / outputs).checked_sub(1)?;
    Some(calibrated_pmfs(&scores[last * outputs..], groups, temperatures, last))
}

fn scores_at_every_step(layer: &MacroLayer, x: &[f32]) -> Vec<f32> {
    let mut live = LiveMacroLayer::new(layer);
    x.chunks_exact(layer.shape().inputs).flat_map(|row| live.step(row, &[]).to_vec()).collect()
}

/// Number of equal sections of a grasp with one temperature each.
const SECTIONS: usize = 8;
/// Temperatures tried.
const TRIED: Temperatures = Temperatures { range: 0.5..=8.0, count: 60 };

/// Temperatures per group and step that maximise the likelihood of held-out scores: one per section, interpolated.
fn fit_temperatures(answered: &[(&[f32], &[usize])], groups: &[usize]) -> Vec<Vec<f32>> {
    let outputs: usize = groups.iter().sum();
    let steps = answered.iter().map(|(scores, _)| scores.len() / outputs.max(1)).max().unwrap_or(0);
    let mut from = 0;
    let mut of_groups = Vec::new();
    for (group, &classes) in groups.iter().enumerate() {
        let section = |number: usize| number * steps / SECTIONS..(number + 1) * steps / SECTIONS;
        let knots: Vec<f64> = (0..SECTIONS)
            .map(|number| {
                let rows: Vec<(&[f32], usize)> = answered
                    .iter()
                    .flat_map(|(scores, targets)| {
                        let place = section(number);
                        let rows = scores.chunks_exact(outputs).skip(place.start).take(place.len());
                        rows.map(|row| (&row[from..from + classes], targets[group]))
                    })
                    .collect();
                best_temperature(&rows, &TRIED).0
            })
            .collect();
        from += classes;
        of_groups.push(
            (0..steps.max(1)).map(|step| interpolated(&knots, (step as f64 + 0.5) / steps.max(1) as f64)).collect(),
        );
    }
    of_groups
}

/// Linear interpolation at a share of the way between knots in the middle of equal sections.
fn interpolated(knots: &[f64], share: f64) -> f32 {
    let at = (share * knots.len() as f64 - 0.5).clamp(0.0, knots.len() as f64 - 1.0);
    let (low, rest) = (at.floor() as usize, at.fract());
    let high = (low + 1).min(knots.len() - 1);
    (knots[low] * (1.0 - rest) + knots[high] * rest) as f32
}

/// Calibrated network that takes one sample at a time.
#[derive(Clone, Debug)]
pub(super) struct LiveCalibrated {
    layer: LiveMacroLayer,
    groups: Vec<usize>,
    temperatures: Vec<Vec<f32>>,
    step: usize,
}

impl LiveCalibrated {
    pub(super) fn new(network: &Calibrated) -> Self {
        Self {
            layer: LiveMacroLayer::new(&network.layer),
            groups: network.shape().groups.clone(),
            temperatures: network.temperatures.clone(),
            step: 0,
        }
    }

    pub(super) fn reset(&mut self) {
        self.layer.reset();
        self.step = 0;
    }

    /// Takes a sample; returns the calibrated PMF of each group.
    pub(super) fn step(&mut self, x: &[f32], log_prior: &[f32]) -> Vec<Pmf> {
        let pmfs = calibrated_pmfs(self.layer.step(x, log_prior), &self.groups, &self.temperatures, self.step);
        self.step += 1;
        pmfs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_are_interpolated_linearly() {
        let knots = [1.0, 3.0];
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0].map(|s| interpolated(&knots, s)), [1.0, 1.0, 2.0, 3.0, 3.0]);
    }
}
