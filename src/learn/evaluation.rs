//! Evaluation of a recogniser on test grasps: single and successive grasps, stage one, calibration, cost.

use crate::belief::{Belief, StopReason, StopRule};
use crate::data::{Class, Dataset, Example};
use crate::metrics::{Bootstrap, CALIBRATION_BINS, Confusion, Forecasts, Interval, Scores};
use crate::pmf::Pmf;
use crate::recogniser::{Recogniser, Verdict};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Verdicts of a recogniser on the grasps of a data set, one by one.
#[derive(Clone, Debug)]
pub struct Answers {
    /// True classes.
    pub truth: Vec<usize>,
    /// Verdict on each grasp alone.
    pub verdicts: Vec<Verdict>,
    /// Mean CPU time per sample (µs).
    pub step_us: f64,
}

/// Test results of one model on one data set.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// Mean recall over classes.
    pub macro_accuracy: f64,
    /// Mean precision over classes.
    pub precision: f64,
    /// Mean F1 over classes.
    pub f1_macro: f64,
    /// 95 % interval of the macro F1, by bootstrap over trials within objects.
    pub ci95: [f64; 2],
    /// Expected calibration error over ten bins of equal mass.
    pub ece: f64,
    /// Mean negative log-likelihood of the true class (nat).
    pub nll: f64,
    /// Share of grasps whose true class is among the three most likely.
    pub top3: f64,
    /// Share of wrong verdicts among those above the confidence threshold; null if there are none.
    pub confident_wrong: Option<f64>,
    /// Share of verdicts above the confidence threshold.
    pub confident: f64,
    /// Macro F1 of size and shape; null without stage one.
    pub stage_one: Option<StageOneScores>,
    /// Macro F1 after one grasp, two, and so on.
    pub f1_by_grasps: Vec<f64>,
    /// Results of the stop rule.
    pub stopping: Stopping,
    /// CPU time per sample (µs).
    pub step_us: f64,
    /// Number of test grasps.
    pub trials: usize,
    /// Confusion matrix; rows: true class, columns: predicted.
    pub confusion: Confusion,
}

/// Macro F1 of stage one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StageOneScores {
    /// Of sizes.
    pub size_f1: f64,
    /// Of shapes.
    pub shape_f1: f64,
}

/// Results of the stop rule over successive grasps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stopping {
    /// Mean number of grasps until it stops.
    pub mean_grasps: f64,
    /// Share of rounds that reached the confidence threshold.
    pub sure: f64,
    /// Share of wrong decisions among those; null if there are none.
    pub sure_wrong: Option<f64>,
    /// Share of known objects rejected as unknown.
    pub unknown: f64,
    /// Share of right decisions; `unknown` counts as wrong.
    pub accuracy: f64,
}

/// Largest number of successive grasps evaluated.
pub const MOST_GRASPS: usize = 5;

/// Recognises each grasp of a data set alone.
pub fn answer(recogniser: &dyn Recogniser, data: &Dataset) -> Answers {
    let start = cpu_time::ThreadTime::now();
    let verdicts: Vec<Verdict> = data.examples.iter().map(|e| recogniser.recognise(&e.grasp, None)).collect();
    let samples: usize = data.examples.iter().map(|e| e.grasp.len()).sum();
    let step_us = start.elapsed().as_secs_f64() * 1e6 / samples.max(1) as f64;
    Answers { truth: data.truth(), verdicts, step_us }
}

/// Successive grasps of one object, with the belief after each.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// True class.
    pub truth: usize,
    /// Belief.
    pub belief: Belief,
}

/// Draws for each test grasp others of the same object to follow it, as indices; the same for every recogniser.
fn successions(data: &Dataset, seed: u64) -> Vec<Vec<usize>> {
    let by_class = data.by_class();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut after = |(first, example): (usize, &Example)| {
        let mut others: Vec<usize> = by_class[example.class].iter().copied().filter(|k| *k != first).collect();
        others.shuffle(&mut random);
        std::iter::once(first).chain(others).take(MOST_GRASPS).collect()
    };
    data.examples.iter().enumerate().map(&mut after).collect()
}

/// Runs successive grasps with feedback, one round starting at each test grasp.
pub fn rounds(recogniser: &dyn Recogniser, data: &Dataset, answers: &Answers, seed: u64) -> Vec<Round> {
    followed(data, answers, seed, |before, k| recogniser.recognise(&data.examples[k].grasp, Some(before)).pmf)
}

/// Runs the same rounds with grasps as independent observations (product of experts).
pub fn product_of_experts(data: &Dataset, answers: &Answers, seed: u64) -> Vec<Round> {
    followed(data, answers, seed, |before, k| before.times(&answers.verdicts[k].pmf))
}

fn followed(data: &Dataset, answers: &Answers, seed: u64, next: impl Fn(&Pmf, usize) -> Pmf) -> Vec<Round> {
    let follow = |grasps: Vec<usize>| {
        let mut belief = Belief::default();
        let truth = data.examples[grasps[0]].class;
        for k in grasps {
            let alone = answers.verdicts[k].pmf.clone();
            let with = belief.now().map_or_else(|| alone.clone(), |before| next(before, k));
            belief.add(with, alone);
        }
        Round { truth, belief }
    };
    successions(data, seed).into_iter().map(follow).collect()
}

/// Computes the macro F1 after each number of grasps, over the classes that occur.
pub fn f1_by_grasps(classes: usize, rounds: &[Round]) -> Vec<f64> {
    let of = |grasps: usize| {
        let pairs = rounds.iter().filter_map(|r| Some((r.truth, Some(r.belief.steps().get(grasps)?.top().0))));
        Confusion::from_pairs(classes, pairs).and_then(|c| f1_over_occurring(&c)).unwrap_or(0.0)
    };
    let most = rounds.iter().map(|r| r.belief.grasps()).min().unwrap_or(0);
    (0..most).map(of).collect()
}

/// Macro F1 over the classes with trials.
fn f1_over_occurring(confusion: &Confusion) -> Option<f64> {
    scores_over_occurring(confusion).map(|scores| scores.f1)
}

fn scores_over_occurring(confusion: &Confusion) -> Option<Scores> {
    let occurring: Vec<usize> = (0..confusion.classes()).filter(|c| confusion.class(*c).trials > 0).collect();
    confusion.scores_over(&occurring)
}

/// Computes all test results; `None` without grasps.
pub fn evaluate(
    recogniser: &dyn Recogniser,
    data: &Dataset,
    answers: &Answers,
    rounds: &[Round],
    stop: StopRule,
    bootstrap: &Bootstrap,
) -> Option<Evaluation> {
    let classes = data.labels.classes.len();
    let truth = &answers.truth;
    let decided: Vec<Option<usize>> = answers.verdicts.iter().map(|v| Some(v.pmf.top().0)).collect();
    let confusion = Confusion::of(classes, truth, &decided)?;
    let scores = scores_over_occurring(&confusion)?;
    let probabilities: Vec<Vec<f64>> = answers.verdicts.iter().map(|v| v.pmf.probabilities().to_vec()).collect();
    let forecasts = Forecasts::new(truth, &probabilities)?;
    let of_trials = |trials: &[usize]| {
        let pairs = trials.iter().map(|k| (truth[*k], decided[*k]));
        f1_over_occurring(&Confusion::from_pairs(classes, pairs)?)
    };
    let Interval { low, high, .. } = bootstrap.interval(truth, of_trials)?;
    let confident = forecasts.confident(stop.threshold);
    Some(Evaluation {
        macro_accuracy: scores.macro_accuracy,
        precision: scores.precision,
        f1_macro: scores.f1,
        ci95: [low, high],
        ece: forecasts.calibration_error(CALIBRATION_BINS),
        nll: forecasts.negative_log_likelihood(),
        top3: forecasts.top_k_accuracy(3),
        confident_wrong: confident.wrong,
        confident: confident.share,
        stage_one: stage_one(data, &answers.verdicts),
        f1_by_grasps: f1_by_grasps(classes, rounds),
        stopping: stopping(recogniser, rounds, stop),
        step_us: answers.step_us,
        trials: truth.len(),
        confusion,
    })
}

fn stage_one(data: &Dataset, verdicts: &[Verdict]) -> Option<StageOneScores> {
    let labels = &data.labels;
    let f1 = |count: usize, pick: &dyn Fn(&Class) -> Option<usize>, pmf: &dyn Fn(&Verdict) -> Option<&Pmf>| {
        let pairs = data.examples.iter().zip(verdicts).filter_map(|(example, verdict)| {
            Some((pick(&labels.classes[example.class])?, Some(pmf(verdict)?.top().0)))
        });
        f1_over_occurring(&Confusion::from_pairs(count, pairs)?)
    };
    Some(StageOneScores {
        size_f1: f1(labels.sizes.len(), &|c| c.size, &|v| v.properties.as_ref().map(|p| &p.size))?,
        shape_f1: f1(labels.shapes.len(), &|c| c.shape, &|v| v.properties.as_ref().map(|p| &p.shape))?,
    })
}

fn stopping(recogniser: &dyn Recogniser, rounds: &[Round], stop: StopRule) -> Stopping {
    let (mut grasps, mut sure, mut sure_wrong, mut unknown, mut right) = (0, 0, 0, 0, 0);
    for round in rounds {
        let (belief, reason) = stopped(&round.belief, recogniser, stop);
        let correct = belief.now().is_some_and(|pmf| pmf.top().0 == round.truth);
        grasps += belief.grasps();
        match reason {
            StopReason::Unknown => unknown += 1,
            StopReason::Sure => {
                sure += 1;
                sure_wrong += usize::from(!correct);
            }
            StopReason::GraspLimit => {}
        }
        right += usize::from(correct && reason != StopReason::Unknown);
    }
    let share = |count: usize| count as f64 / rounds.len().max(1) as f64;
    Stopping {
        mean_grasps: share(grasps),
        sure: share(sure),
        sure_wrong: (sure > 0).then(|| sure_wrong as f64 / sure as f64),
        unknown: share(unknown),
        accuracy: share(right),
    }
}

/// Belief at which the rule stops, and the reason.
fn stopped(whole: &Belief, recogniser: &dyn Recogniser, stop: StopRule) -> (Belief, StopReason) {
    let mut belief = Belief::default();
    for (with, alone) in whole.pairs() {
        belief.add(with.clone(), alone.clone());
        if let Some(reason) = stop.judge(&belief, recogniser.rejection()) {
            return (belief, reason);
        }
    }
    (belief, StopReason::GraspLimit)
}

/// Computes the calibration error after a share of each grasp, 0 to 1; `None` without grasps.
pub fn prefix_calibration(recogniser: &dyn Recogniser, data: &Dataset, share: f32) -> Option<f64> {
    let cut = |example: &Example| {
        let end = example.grasp.t_s.last().copied().unwrap_or(0.0);
        recogniser.recognise(&example.grasp.until(share * end), None).pmf.probabilities().to_vec()
    };
    let probabilities: Vec<Vec<f64>> = data.examples.iter().map(cut).collect();
    Some(Forecasts::new(&data.truth(), &probabilities)?.calibration_error(CALIBRATION_BINS))
}
