//! Several macro-layers that answer together, with temperatures that make their probabilities honest at every step.
//!
//! Cross-fitted, each member is trained without one part of the data and answers for that part: so every training grasp
//! has answers from a network that has not seen it. These calibrate the temperatures, and are what the next stage
//! learns from.

use super::super::{FitError, Fitting, Pmf};
use super::macro_layer::{LiveMacroLayer, MacroLayer, MacroShape};
use super::training::{Lessons, Training, train};
use std::ops::Range;

/// Macro-layers of one shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Committee {
    /// Its members.
    pub members: Vec<MacroLayer>,
    /// One temperature per group and step; the last holds for later steps.
    pub temperatures: Vec<Vec<f32>>,
}

/// What is learned from, with random access to the sequences as they are answered: without augmentation.
pub(super) trait Material: Lessons + Sync {
    /// Inputs of a sequence as they will be met later, [steps][inputs].
    fn inputs(&self, k: usize) -> &[f32];

    /// True class in each group.
    fn targets(&self, k: usize) -> &[usize];

    /// Logarithms of the probabilities before, where there are any.
    fn log_prior(&self, k: usize) -> &[f32];
}

/// How a committee is fitted.
#[derive(Clone, Debug)]
pub(super) struct Plan<'a> {
    pub(super) shape: MacroShape,
    pub(super) training: &'a Training,
    /// Part of each lesson, and how many parts there are.
    pub(super) folds: (&'a [usize], usize),
    /// One member per part, each without it; otherwise one member that has seen everything.
    pub(super) cross_fitted: bool,
    pub(super) seed: u64,
    /// Which share of the whole fit this is.
    pub(super) share: Range<f64>,
}

/// Scores at every step, [steps][outputs], of grasps by networks that have not seen them; none where there is none.
pub(super) type HeldBack = Vec<Option<Vec<f32>>>;

/// Lessons without those of one part.
struct Without<'a> {
    material: &'a dyn Material,
    kept: Vec<usize>,
}

impl Lessons for Without<'_> {
    fn count(&self) -> usize {
        self.kept.len()
    }

    fn draw(&self, k: usize, random: &mut dyn rand::Rng, lesson: &mut super::Lesson) {
        self.material.draw(self.kept[k], random, lesson);
    }
}

impl Committee {
    /// Fits a committee; gives held-back scores too: of every grasp where it is cross-fitted, else of one part.
    pub(super) fn fit(
        plan: &Plan<'_>,
        material: &dyn Material,
        fitting: &Fitting<'_>,
    ) -> Result<(Self, HeldBack), FitError> {
        let (fold_of, parts) = plan.folds;
        let rounds: Vec<Option<usize>> =
            if plan.cross_fitted { (0..parts).map(Some).collect() } else { vec![Some(0), None] };
        let mut members = Vec::new();
        let mut held_back: HeldBack = vec![None; material.count()];
        for (round, without) in rounds.iter().enumerate() {
            let kept = (0..material.count()).filter(|k| Some(fold_of[*k]) != *without).collect();
            let lessons = Without { material, kept };
            let share = (plan.share.end - plan.share.start) / rounds.len() as f64;
            let from = plan.share.start + share * round as f64;
            let mut stopped = false;
            let layer = train(plan.shape.clone(), &lessons, plan.training, plan.seed + round as u64, &mut |epoch, _| {
                (fitting.progress)(from + share * (epoch + 1) as f64 / plan.training.epochs.max(1) as f64);
                stopped = fitting.check().is_err();
                !stopped
            });
            if stopped {
                return Err(FitError::Stopped);
            }
            for (k, held) in held_back.iter_mut().enumerate().filter(|(k, _)| Some(fold_of[*k]) == *without) {
                *held = Some(scores_at_every_step(&layer, material.inputs(k), material.log_prior(k)));
            }
            if plan.cross_fitted || without.is_none() {
                members.push(layer);
            }
        }
        let answered: Vec<(&[f32], &[usize])> = held_back
            .iter()
            .enumerate()
            .filter_map(|(k, held)| Some((held.as_deref()?, material.targets(k))))
            .collect();
        let temperatures = fit_temperatures(&answered, &plan.shape.groups);
        Ok((Self { members, temperatures }, held_back))
    }

    /// The members' shape.
    pub(super) fn shape(&self) -> &MacroShape {
        self.members[0].shape()
    }

    /// Honest probabilities from scores after a step, one PMF per group.
    pub(super) fn honest(&self, scores: &[f32], step: usize) -> Vec<Pmf> {
        honest(scores, &self.shape().groups, &self.temperatures, step)
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

/// Scores of one sequence after each of its steps, [steps][outputs].
fn scores_at_every_step(layer: &MacroLayer, x: &[f32], log_prior: &[f32]) -> Vec<f32> {
    let mut live = LiveMacroLayer::new(layer);
    x.chunks_exact(layer.shape().inputs).flat_map(|row| live.step(row, log_prior).to_vec()).collect()
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
        of_groups.push((0..steps.max(1)).map(|step| joined(&knots, (step as f64 + 0.5) / steps.max(1) as f64)).collect());
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

/// A committee that reads one sample at a time.
#[derive(Clone, Debug)]
pub(super) struct LiveCommittee {
    members: Vec<LiveMacroLayer>,
    groups: Vec<usize>,
    temperatures: Vec<Vec<f32>>,
    step: usize,
}

impl LiveCommittee {
    pub(super) fn new(committee: &Committee) -> Self {
        Self {
            members: committee.members.iter().map(LiveMacroLayer::new).collect(),
            groups: committee.shape().groups.clone(),
            temperatures: committee.temperatures.clone(),
            step: 0,
        }
    }

    pub(super) fn reset(&mut self) {
        self.members.iter_mut().for_each(LiveMacroLayer::reset);
        self.step = 0;
    }

    /// Takes in one sample; gives one PMF per group: the mean of the members' honest ones.
    pub(super) fn step(&mut self, x: &[f32], log_prior: &[f32]) -> Vec<Pmf> {
        let mut sums: Vec<Vec<f64>> = self.groups.iter().map(|classes| vec![0.0; *classes]).collect();
        for member in &mut self.members {
            let answers = honest(member.step(x, log_prior), &self.groups, &self.temperatures, self.step);
            for (sum, pmf) in sums.iter_mut().zip(answers) {
                sum.iter_mut().zip(pmf.probabilities()).for_each(|(s, p)| *s += p);
            }
        }
        self.step += 1;
        sums.into_iter().map(Pmf::from_weights).collect()
    }
}
