//! Evaluation of a recogniser on test grasps: single and successive grasps, stage one, calibration, cost.

use crate::belief::{Belief, Round, StopReason, StopRule};
use crate::data::{Class, Dataset, Example};
use crate::metrics::{Bootstrap, CALIBRATION_BINS, Confusion, Forecasts, Interval, draws_sessions};
use crate::pmf::Pmf;
use crate::recogniser::{Recogniser, Verdict};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::collections::BTreeMap;

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
    /// 95 % interval of the macro F1, by bootstrap over sessions where there are several, else over trials within objects.
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

impl Evaluation {
    /// Results for the card of a model; `test` says on what they were measured.
    pub fn metrics(&self, test: &str) -> serde_json::Value {
        serde_json::json!({
            "test": test,
            "trials": self.trials,
            "f1_macro": self.f1_macro,
            "ci95": self.ci95,
            "macro_accuracy": self.macro_accuracy,
            "f1_by_grasps": self.f1_by_grasps,
            "stage_one": self.stage_one,
            "ece": self.ece,
            "stopping": self.stopping,
        })
    }
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

/// Finds for each test grasp those of the same object that follow it, as indices; the same for every recogniser. Where
/// objects stayed as released, these are the grasps that were made next, until the object was placed anew; where it was
/// placed anew for every grasp, they are drawn at random.
fn successions(data: &Dataset, seed: u64) -> Vec<Vec<usize>> {
    let by_class = data.by_class();
    let mut successions = vec![Vec::new(); data.examples.len()];
    for members in by_class.iter().filter(|members| members.iter().any(|k| data.examples[*k].after.is_some())) {
        for succession in data.successions(members) {
            for (n, k) in succession.iter().enumerate() {
                successions[*k] = succession[n..].iter().copied().take(MOST_GRASPS).collect();
            }
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for (first, succession) in successions.iter_mut().enumerate().filter(|(_, succession)| succession.is_empty()) {
        let members = &by_class[data.examples[first].class];
        let mut others: Vec<usize> = members.iter().copied().filter(|k| *k != first).collect();
        others.shuffle(&mut random);
        *succession = std::iter::once(first).chain(others).take(MOST_GRASPS).collect();
    }
    successions
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

/// Largest number of successive grasps that at least one round of each class reaches.
pub fn most_grasps(rounds: &[Round]) -> usize {
    let mut of_class: BTreeMap<usize, usize> = BTreeMap::new();
    for round in rounds {
        let most = of_class.entry(round.truth).or_default();
        *most = (*most).max(round.belief.grasps());
    }
    of_class.into_values().min().unwrap_or(0)
}

/// Computes the macro F1 after each number of grasps, over the classes that occur and the rounds that are long enough.
pub fn f1_by_grasps(classes: usize, rounds: &[Round]) -> Vec<f64> {
    let of = |grasps: usize| {
        let pairs = rounds.iter().filter_map(|r| Some((r.truth, Some(r.belief.steps().get(grasps)?.top().0))));
        Confusion::from_pairs(classes, pairs).and_then(|c| c.f1_over_occurring()).unwrap_or(0.0)
    };
    (0..most_grasps(rounds)).map(of).collect()
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
    evaluate_stopped(data, answers, rounds, &stops(recogniser, rounds, stop), stop, bootstrap)
}

/// The same for answers of several recognisers, each tested on its own split: `data` holds the test grasps of all splits,
/// one after the other. The interval is over trials, however often each was tested.
pub fn evaluate_stopped(
    data: &Dataset,
    answers: &Answers,
    rounds: &[Round],
    stops: &[Stop],
    stop: StopRule,
    bootstrap: &Bootstrap,
) -> Option<Evaluation> {
    let classes = data.labels.classes.len();
    let truth = &answers.truth;
    let decided: Vec<Option<usize>> = answers.verdicts.iter().map(|v| Some(v.pmf.top().0)).collect();
    let confusion = Confusion::of(classes, truth, &decided)?;
    let scores = confusion.scores_over_occurring()?;
    let probabilities: Vec<Vec<f64>> = answers.verdicts.iter().map(|v| v.pmf.probabilities().to_vec()).collect();
    let forecasts = Forecasts::new(truth, &probabilities)?;
    let (of_trial, truth_of_trial) = trials(data);
    let sessions: Vec<u32> = of_trial.iter().map(|tests| data.examples[tests[0]].session).collect();
    let of_trials = |trials: &[usize]| {
        let tests = trials.iter().flat_map(|trial| &of_trial[*trial]);
        Confusion::from_pairs(classes, tests.map(|k| (truth[*k], decided[*k])))?.f1_over_occurring()
    };
    let Interval { low, high, .. } = bootstrap.over_sessions(&truth_of_trial, &sessions, of_trials)?;
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
        stopping: stopping(stops),
        step_us: answers.step_us,
        trials: of_trial.len(),
        confusion,
    })
}

/// Indices of the test grasps of each trial, which may have been tested several times, in different splits; and the class
/// of each trial.
fn trials(data: &Dataset) -> (Vec<Vec<usize>>, Vec<usize>) {
    let mut at: BTreeMap<(i64, usize), usize> = BTreeMap::new();
    let (mut of_trial, mut truth): (Vec<Vec<usize>>, Vec<usize>) = (Vec::new(), Vec::new());
    for (k, example) in data.examples.iter().enumerate() {
        let trial = *at.entry((example.id, example.class)).or_insert_with(|| {
            of_trial.push(Vec::new());
            truth.push(example.class);
            of_trial.len() - 1
        });
        of_trial[trial].push(k);
    }
    (of_trial, truth)
}

fn stage_one(data: &Dataset, verdicts: &[Verdict]) -> Option<StageOneScores> {
    let labels = &data.labels;
    let f1 = |count: usize, pick: &dyn Fn(&Class) -> Option<usize>, pmf: &dyn Fn(&Verdict) -> Option<&Pmf>| {
        let pairs = data.examples.iter().zip(verdicts).filter_map(|(example, verdict)| {
            Some((pick(&labels.classes[example.class])?, Some(pmf(verdict)?.top().0)))
        });
        Confusion::from_pairs(count, pairs)?.f1_over_occurring()
    };
    Some(StageOneScores {
        size_f1: f1(labels.sizes.len(), &|c| c.size, &|v| v.properties.as_ref().map(|p| &p.size))?,
        shape_f1: f1(labels.shapes.len(), &|c| c.shape, &|v| v.properties.as_ref().map(|p| &p.shape))?,
    })
}

/// What intervals are over, where there are several sessions.
pub fn interval_words(data: &Dataset) -> &'static str {
    match draws_sessions(&data.truth(), &data.sessions()) {
        true => "intervals are over whole sessions",
        false => "each object has a session of its own: intervals are over trials, and too narrow for new sessions",
    }
}

/// End of a round by the stop rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop {
    /// Number of grasps.
    pub grasps: usize,
    pub reason: StopReason,
    /// The most likely class is the true one.
    pub correct: bool,
}

/// Stops each round as the rule says.
pub fn stops(recogniser: &dyn Recogniser, rounds: &[Round], rule: StopRule) -> Vec<Stop> {
    let stop = |round: &Round| {
        let (belief, reason) = stopped(&round.belief, recogniser, rule);
        let correct = belief.now().is_some_and(|pmf| pmf.top().0 == round.truth);
        Stop { grasps: belief.grasps(), reason, correct }
    };
    rounds.iter().map(stop).collect()
}

fn stopping(stops: &[Stop]) -> Stopping {
    let count = |is: &dyn Fn(&Stop) -> bool| stops.iter().filter(|stop| is(stop)).count();
    let share = |count: usize| count as f64 / stops.len().max(1) as f64;
    let sure = count(&|stop| stop.reason == StopReason::Sure);
    let sure_wrong = count(&|stop| stop.reason == StopReason::Sure && !stop.correct);
    Stopping {
        mean_grasps: share(stops.iter().map(|stop| stop.grasps).sum()),
        sure: share(sure),
        sure_wrong: (sure > 0).then(|| sure_wrong as f64 / sure as f64),
        unknown: share(count(&|stop| stop.reason == StopReason::Unknown)),
        accuracy: share(count(&|stop| stop.correct && stop.reason != StopReason::Unknown)),
    }
}

/// Belief at which the rule stops, and the reason.
fn stopped(whole: &Belief, recogniser: &dyn Recogniser, stop: StopRule) -> (Belief, StopReason) {
    let mut beliefs = (1..=whole.grasps()).map(|grasps| whole.first(grasps));
    let end = beliefs.find_map(|belief| stop.judge(&belief, recogniser.rejection()).map(|reason| (belief, reason)));
    end.unwrap_or_else(|| (whole.clone(), StopReason::GraspLimit))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Labels;

    #[test]
    fn grasps_follow_as_they_were_made_where_the_object_stayed_and_at_random_where_it_was_placed_anew() {
        let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
        let labels = Labels { classes: vec![class("left"), class("placed")], ..Labels::default() };
        // The object of the first class was left three times and then placed anew; a grasp of its second round is missing.
        let after = [None, Some(1), Some(2), None, Some(9), None, None, None];
        let example = |(k, after): (usize, Option<i64>)| Example {
            id: k as i64 + 1,
            class: usize::from(k > 4),
            content: k as u64,
            after,
            ..Example::default()
        };
        let examples: Vec<Example> = after.into_iter().enumerate().map(example).collect();
        let data = Dataset { labels, examples, ..Dataset::default() };
        let found = successions(&data, 7);
        assert_eq!(found[..5], [vec![0, 1, 2], vec![1, 2], vec![2], vec![3], vec![4]]);
        for (k, grasps) in found.iter().enumerate().skip(5) {
            let mut sorted = grasps.clone();
            sorted.sort_unstable();
            assert_eq!((grasps[0], sorted), (k, vec![5, 6, 7]));
        }
        assert_eq!(found, successions(&data, 7));
    }

    #[test]
    fn scores_after_several_grasps_need_a_round_of_each_class() {
        let round = |truth: usize, grasps: usize| {
            let mut belief = Belief::default();
            (0..grasps).for_each(|_| belief.add(Pmf::uniform(2), Pmf::uniform(2)));
            Round { truth, belief }
        };
        assert_eq!(most_grasps(&[round(0, 3), round(0, 1), round(1, 2)]), 2);
        assert_eq!(most_grasps(&[]), 0);
        assert_eq!(f1_by_grasps(2, &[round(0, 3), round(0, 1), round(1, 2)]).len(), 2);
    }
}
