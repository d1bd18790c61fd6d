//! A macro-layer, or a committee of several that began from other weights, with temperatures that make its
//! probabilities honest at every step, fitted on answers to grasps it had not seen. A committee's scores are the means
//! of its members', and its temperatures are those of the means: members that are honest each for themselves are too
//! modest together.
//!
//! A first network learns without a sixth of the grasps and answers them, then the one that is kept learns from
//! everything. Cross-fitting besides leaves out each of several larger parts once, so that every grasp has answers from
//! a network that has not seen it: these are what a next stage can learn from.

use super::super::{FitError, Fitting, Pmf};
use super::macro_layer::{LiveMacroLayer, MacroLayer, MacroShape};
use super::training::{Lesson, Lessons, Training, train, train_on};
use std::ops::Range;

/// Networks and their temperatures.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Calibrated {
    /// At least one, all of one shape.
    pub(super) members: Vec<MacroLayer>,
    /// One temperature per group and step; the last holds for later steps.
    pub(super) temperatures: Vec<Vec<f32>>,
}

/// What is learned from, with random access to the sequences as they are answered: without augmentation.
pub(super) trait Material: Lessons + Sync {
    /// Inputs of a sequence as they will be met later, `[steps][inputs]`.
    fn inputs(&self, k: usize) -> &[f32];

    /// True class in each group.
    fn targets(&self, k: usize) -> &[usize];
}

/// How a network is fitted.
#[derive(Clone, Debug)]
pub(super) struct Plan<'a> {
    pub(super) shape: MacroShape,
    /// How many networks.
    pub(super) members: usize,
    pub(super) training: &'a Training,
    /// For each lesson a number; those of number zero are held back for calibration.
    pub(super) held_back: &'a [usize],
    pub(super) seed: u64,
    /// Which share of the whole fit this is.
    pub(super) share: Range<f64>,
}

/// Scores at every step, `[steps][outputs]`, of grasps by networks that have not seen them; none where there is none.
pub(super) type HeldBack = Vec<Option<Vec<f32>>>;

/// Some of the lessons.
struct Without<'a> {
    material: &'a dyn Material,
    kept: Vec<usize>,
}

impl Lessons for Without<'_> {
    fn count(&self) -> usize {
        self.kept.len()
    }

    fn draw(&self, k: usize, random: &mut dyn rand::Rng, lesson: &mut Lesson) {
        self.material.draw(self.kept[k], random, lesson);
    }
}

impl Calibrated {
    /// Learns from everything, calibrated on a part that was held back first. Gives scores of the grasps that were.
    pub(super) fn fit(
        plan: &Plan<'_>,
        material: &dyn Material,
        fitting: &Fitting<'_>,
    ) -> Result<(Self, HeldBack), FitError> {
        let (middle, seed) = (0.5 * (plan.share.start + plan.share.end), plan.seed);
        let first = Plan { share: plan.share.start..middle, ..plan.clone() };
        let fold_of = plan.held_back;
        let members = first.learn(material, fitting, seed, &|k| fold_of[k] != 0)?;
        let mut held_back: HeldBack = vec![None; material.count()];
        for (k, held) in held_back.iter_mut().enumerate().filter(|(k, _)| fold_of[*k] == 0) {
            *held = Some(scores_at_every_step(&members, material.inputs(k)));
        }
        let second = Plan { share: middle..plan.share.end, ..plan.clone() };
        let members = second.learn(material, fitting, seed + 1, &|_| true)?;
        let answered: Vec<(&[f32], &[usize])> = held_back
            .iter()
            .enumerate()
            .filter_map(|(k, held)| Some((held.as_deref()?, material.targets(k))))
            .collect();
        let temperatures = fit_temperatures(&answered, &plan.shape.groups);
        Ok((Self { members, temperatures }, held_back))
    }

    /// Scores of every grasp by a network that has learned from the other parts only.
    pub(super) fn cross_fit(
        plan: &Plan<'_>,
        (part_of, parts): (&[usize], usize),
        material: &dyn Material,
        fitting: &Fitting<'_>,
    ) -> Result<HeldBack, FitError> {
        let mut held_back: HeldBack = vec![None; material.count()];
        let share = (plan.share.end - plan.share.start) / parts.max(1) as f64;
        for part in 0..parts {
            let from = plan.share.start + share * part as f64;
            let one = Plan { share: from..from + share, ..plan.clone() };
            let members = one.learn(material, fitting, plan.seed + 10 + part as u64, &|k| part_of[k] != part)?;
            for (k, held) in held_back.iter_mut().enumerate().filter(|(k, _)| part_of[*k] == part) {
                *held = Some(scores_at_every_step(&members, material.inputs(k)));
            }
        }
        Ok(held_back)
    }

    /// Goes on learning from other material, from where it is; its temperatures stay.
    pub(super) fn refine(
        &mut self,
        material: &dyn Material,
        training: &Training,
        seed: u64,
        share: Range<f64>,
        fitting: &Fitting<'_>,
    ) -> Result<(), FitError> {
        let of_each = (share.end - share.start) / self.members.len() as f64;
        for (member, layer) in self.members.iter_mut().enumerate() {
            let from = share.start + of_each * member as f64;
            let mut go_on = following(fitting, from, of_each, training.epochs);
            train_on(layer, material, training, seed_of(seed, member), &mut go_on);
            fitting.check()?;
        }
        Ok(())
    }

    /// Sizes of every member.
    pub(super) fn shape(&self) -> &MacroShape {
        self.members[0].shape()
    }

    /// Changes every member.
    pub(super) fn change(&mut self, change: impl Fn(&MacroLayer) -> MacroLayer) {
        self.members.iter_mut().for_each(|layer| *layer = change(layer));
    }

    /// Honest probabilities from scores after a step, one PMF per group.
    pub(super) fn honest(&self, scores: &[f32], step: usize) -> Vec<Pmf> {
        honest(scores, &self.shape().groups, &self.temperatures, step)
    }

    /// Temperature of the first group at the end.
    pub(super) fn last_temperature(&self) -> f32 {
        self.temperatures.first().and_then(|of_group| of_group.last()).copied().unwrap_or(1.0)
    }
}

impl Plan<'_> {
    /// Every member learns from some of the material.
    fn learn(
        &self,
        material: &dyn Material,
        fitting: &Fitting<'_>,
        seed: u64,
        keeps: &dyn Fn(usize) -> bool,
    ) -> Result<Vec<MacroLayer>, FitError> {
        let lessons = Without { material, kept: (0..material.count()).filter(|k| keeps(*k)).collect() };
        let share = (self.share.end - self.share.start) / self.members.max(1) as f64;
        let learned = |member: usize| {
            let from = self.share.start + share * member as f64;
            let mut go_on = following(fitting, from, share, self.training.epochs);
            let layer = train(self.shape.clone(), &lessons, self.training, seed_of(seed, member), &mut go_on);
            fitting.check().map(|()| layer)
        };
        (0..self.members.max(1)).map(learned).collect()
    }
}

/// Members differ by their seeds alone.
fn seed_of(seed: u64, member: usize) -> u64 {
    seed.wrapping_add(1_000_003 * member as u64)
}

/// Passes progress on, and stops where that is asked for.
fn following<'a>(
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

fn honest(scores: &[f32], groups: &[usize], temperatures: &[Vec<f32>], step: usize) -> Vec<Pmf> {
    let mut rest = scores;
    groups
        .iter()
        .zip(temperatures)
        .map(|(&classes, of_group)| {
            let (own, others) = rest.split_at(classes);
            rest = others;
            let temperature = temperature(of_group, step);
            Pmf::from_scores(own.iter().map(|s| f64::from(*s) / temperature))
        })
        .collect()
}

/// Scores of one sequence after each of its steps, `[steps][outputs]`.
fn scores_at_every_step(members: &[MacroLayer], x: &[f32]) -> Vec<f32> {
    let mut live = LiveCommittee::new(members);
    x.chunks_exact(members[0].shape().inputs).flat_map(|row| live.step(row, &[]).to_vec()).collect()
}

/// Stretches of a grasp over which one temperature is fitted.
const STRETCHES: usize = 8;
/// Temperatures tried: from a half to eight.
const TRIED: usize = 60;

/// Temperatures per group and step that make held-back answers most likely. Fitted over stretches of a grasp, joined
/// by straight lines.
fn fit_temperatures(answered: &[(&[f32], &[usize])], groups: &[usize]) -> Vec<Vec<f32>> {
    let outputs: usize = groups.iter().sum();
    let steps = answered.iter().map(|(scores, _)| scores.len() / outputs.max(1)).max().unwrap_or(0);
    let mut from = 0;
    let mut of_groups = Vec::new();
    for (group, &classes) in groups.iter().enumerate() {
        let stretch = |number: usize| number * steps / STRETCHES..(number + 1) * steps / STRETCHES;
        let knots: Vec<f64> = (0..STRETCHES)
            .map(|number| {
                let rows: Vec<(&[f32], usize)> = answered
                    .iter()
                    .flat_map(|(scores, targets)| {
                        let place = stretch(number);
                        let rows = scores.chunks_exact(outputs).skip(place.start).take(place.len());
                        rows.map(|row| (&row[from..from + classes], targets[group]))
                    })
                    .collect();
                best_temperature(&rows)
            })
            .collect();
        from += classes;
        of_groups
            .push((0..steps.max(1)).map(|step| joined(&knots, (step as f64 + 0.5) / steps.max(1) as f64)).collect());
    }
    of_groups
}

/// The value at a share of the way along knots that stand in the middle of equal stretches.
fn joined(knots: &[f64], share: f64) -> f32 {
    let at = (share * knots.len() as f64 - 0.5).clamp(0.0, knots.len() as f64 - 1.0);
    let (low, rest) = (at.floor() as usize, at.fract());
    let high = (low + 1).min(knots.len() - 1);
    (knots[low] * (1.0 - rest) + knots[high] * rest) as f32
}

fn best_temperature(rows: &[(&[f32], usize)]) -> f64 {
    if rows.is_empty() {
        return 1.0;
    }
    let loss = |temperature: f64| -> f64 {
        let of_row = |(scores, target): &(&[f32], usize)| {
            let highest = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let scaled = |s: f32| f64::from(s - highest) / temperature;
            scores.iter().map(|s| scaled(*s).exp()).sum::<f64>().ln() - scaled(scores[*target])
        };
        rows.iter().map(of_row).sum()
    };
    let candidate = |k: usize| 0.5 * 16f64.powf(k as f64 / (TRIED - 1) as f64);
    (0..TRIED).map(candidate).min_by(|a, b| loss(*a).total_cmp(&loss(*b))).unwrap_or(1.0)
}

/// Members that read one sample at a time.
#[derive(Clone, Debug)]
struct LiveCommittee {
    members: Vec<LiveMacroLayer>,
    mean: Vec<f32>,
}

impl LiveCommittee {
    fn new(members: &[MacroLayer]) -> Self {
        let outputs = members.first().map_or(0, |layer| layer.shape().outputs());
        Self { members: members.iter().map(LiveMacroLayer::new).collect(), mean: vec![0.0; outputs] }
    }

    /// Mean scores after a sample.
    fn step(&mut self, x: &[f32], log_prior: &[f32]) -> &[f32] {
        let share = 1.0 / self.members.len().max(1) as f32;
        self.mean.fill(0.0);
        for member in &mut self.members {
            let scores = member.step(x, log_prior);
            self.mean.iter_mut().zip(scores).for_each(|(mean, score)| *mean += share * score);
        }
        &self.mean
    }
}

/// Calibrated networks that read one sample at a time.
#[derive(Clone, Debug)]
pub(super) struct LiveCalibrated {
    committee: LiveCommittee,
    groups: Vec<usize>,
    temperatures: Vec<Vec<f32>>,
    step: usize,
}

impl LiveCalibrated {
    pub(super) fn new(network: &Calibrated) -> Self {
        Self {
            committee: LiveCommittee::new(&network.members),
            groups: network.shape().groups.clone(),
            temperatures: network.temperatures.clone(),
            step: 0,
        }
    }

    pub(super) fn reset(&mut self) {
        self.committee.members.iter_mut().for_each(LiveMacroLayer::reset);
        self.step = 0;
    }

    /// Takes in one sample; gives one honest PMF per group.
    pub(super) fn step(&mut self, x: &[f32], log_prior: &[f32]) -> Vec<Pmf> {
        let answers = honest(self.committee.step(x, log_prior), &self.groups, &self.temperatures, self.step);
        self.step += 1;
        answers
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_temperature_that_was_put_in_is_found() {
        // Scores of a calibrated binary classifier, blown up threefold.
        let mut rows = Vec::new();
        for k in 0..400 {
            let p = 0.5 + 0.49 * (k as f32 / 400.0);
            let score = 3.0 * (p / (1.0 - p)).ln();
            rows.push(([score, 0.0], usize::from((k * 7919 % 1000) as f32 >= 1000.0 * p)));
        }
        let rows: Vec<(&[f32], usize)> = rows.iter().map(|(scores, target)| (&scores[..], *target)).collect();
        let found = best_temperature(&rows);
        assert!((found - 3.0).abs() < 0.4, "{found}");
    }

    #[test]
    fn knots_are_joined_by_lines() {
        let knots = [1.0, 3.0];
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0].map(|s| joined(&knots, s)), [1.0, 1.0, 2.0, 3.0, 3.0]);
    }
}
