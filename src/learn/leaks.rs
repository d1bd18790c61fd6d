//! Leakage: whether a data set gives its labels away by something else than touch, by its readings before anything is touched or
//! by the length of its trials.
//!
//! Both are asked of two learners that find different things, extra-trees and the nearest neighbour, by cross-validated
//! balanced accuracy; the larger of the two counts. Under permuted labels the same is repeated (a permutation test: Good,
//! *Permutation, Parametric and Bootstrap Tests of Hypotheses*, 2005), until one permutation does as well, or all do worse.

use crate::data::{Dataset, Sequence};
use crate::forest::{Examples, Forest, ForestSettings, Table};
use crate::gaps;
use crate::rows::RowModel as _;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Longest part of a rest that is read (s).
pub const LEAK_REST_S: f32 = 0.3;
/// Fewest trials of a class that is asked for, and of all.
const FEWEST: [usize; 2] = [5, 20];
/// Folds of the cross-validation.
const FOLDS: usize = 5;
/// Permutations of the labels: with all of them worse, p is one in a thousand.
const PERMUTATIONS: usize = 999;
/// Part of the way from chance to certainty that an accuracy has to exceed for a warning.
const EXCESS: f64 = 0.1;
/// The same is known after so many permutations where the accuracy is so many of their deviations above their mean.
const SOON: (usize, f64) = (99, 6.0);
/// Trees of a forest.
const TREES: usize = 10;
/// Channels that are named at most.
const NAMED: usize = 5;

/// What gives the labels away.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LeakSource {
    /// Readings of the rest before the touch.
    Rest,
    /// Duration and number of samples.
    Length,
}

/// Outcome of one check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeakCheck {
    pub source: LeakSource,
    /// Balanced accuracy of the better learner; none where there were too few trials.
    pub accuracy: Option<f64>,
    /// That of guessing.
    pub chance: f64,
    /// The label can be told: p is at most 0.001, and the accuracy exceeds chance by a tenth of what is left.
    pub leaks: bool,
    /// Samples of each trial, and their duration (s).
    pub samples: usize,
    pub seconds: f32,
    /// Channels that tell the label by themselves, the best first.
    pub channels: Vec<String>,
}

impl std::fmt::Display for LeakCheck {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let chance = percent(self.chance);
        match (self.source, self.accuracy) {
            (LeakSource::Rest, None) => {
                write!(f, "leak check: not checked, too few trials or no readings before the touch")
            }
            (LeakSource::Length, None) => write!(f, "length check: not checked, too few trials"),
            (LeakSource::Rest, Some(share)) if self.leaks => write!(
                f,
                "The object can be told before it is touched ({}, chance {chance}; by {}): the recordings differ in something \
                 else than touch. Record the objects in turn and tare before each; `palpate evaluate --rezero` takes out what \
                 is constant",
                percent(share),
                if self.channels.is_empty() {
                    "several channels together".to_owned()
                } else {
                    self.channels.join(", ")
                }
            ),
            (LeakSource::Length, Some(share)) if self.leaks => write!(
                f,
                "The object can be told by the length of its trials alone ({}, chance {chance}): cut all trials alike, as \
                 `palpate evaluate --cut` does",
                percent(share)
            ),
            (LeakSource::Rest, Some(share)) => {
                write!(f, "leak check: {} before the touch, chance {chance}: no sign of a leak", percent(share))
            }
            (LeakSource::Length, Some(share)) => {
                write!(f, "length check: {} by the length alone, chance {chance}: no sign of a leak", percent(share))
            }
        }
    }
}

impl Dataset {
    /// Asks whether the labels can be told before the touch, and by the length of the trials. Where a trial has no rest of its
    /// own, its first 0.3 s are taken for it.
    pub fn leak_checks(&self, seed: u64) -> [LeakCheck; 2] {
        let kept = self.asked();
        let truth: Vec<usize> = kept.iter().map(|k| self.examples[*k].class).collect();
        let rests: Vec<Sequence> = kept.iter().map(|k| self.rest_of(*k)).collect();
        let samples = rests.iter().map(Sequence::len).min().unwrap_or(0);
        let width = self.channels.len();
        let rows: Vec<Vec<f32>> = rests.iter().map(|rest| described(&rest.values[..samples * width], width)).collect();
        let mut seconds: Vec<f32> =
            rests.iter().filter_map(|rest| Some(rest.t_s[..samples].last()? - rest.t_s[0])).collect();
        seconds.sort_by(f32::total_cmp);
        let seconds = seconds.get(seconds.len() / 2).copied().unwrap_or(0.0);
        let mut rest = Question::new(&rows, &truth, seed).answered(LeakSource::Rest);
        (rest.samples, rest.seconds) = (samples, seconds);
        if rest.leaks {
            let least = rest.chance + EXCESS * (1.0 - rest.chance);
            let alone = |channel: usize| {
                let own = |row: &Vec<f32>| row.iter().skip(channel).step_by(width).copied().collect::<Vec<f32>>();
                Question::new(&rows.iter().map(own).collect::<Vec<_>>(), &truth, seed).accuracy(&truth)
            };
            let mut told: Vec<(f64, &String)> = (0..width).map(|k| (alone(k), &self.channels[k])).collect();
            told.retain(|(share, _)| *share >= least);
            told.sort_by(|a, b| b.0.total_cmp(&a.0));
            rest.channels = told.into_iter().take(NAMED).map(|(_, name)| name.clone()).collect();
        }
        let length = |k: &usize| {
            let grasp = &self.examples[*k].grasp;
            let lasts = grasp.t_s.last().zip(grasp.t_s.first()).map_or(0.0, |(last, first)| last - first);
            vec![lasts, grasp.len() as f32]
        };
        let lengths: Vec<Vec<f32>> = kept.iter().map(length).collect();
        [rest, Question::new(&lengths, &truth, seed).answered(LeakSource::Length)]
    }

    /// Subtracts the mean of the first half of each trial's rest, and leaves the second half to be checked.
    pub fn rezeroed(&self) -> Self {
        let width = self.channels.len();
        let mut own = self.clone();
        for (k, example) in own.examples.iter_mut().enumerate() {
            let rest = self.rest_of(k);
            let half = rest.len().div_ceil(2);
            if half == 0 {
                continue;
            }
            let mean =
                |channel: usize| rest.values.iter().skip(channel).step_by(width).take(half).sum::<f32>() / half as f32;
            let means: Vec<f32> = (0..width).map(mean).collect();
            let less = |sequence: &Sequence, from: usize| Sequence {
                t_s: sequence.t_s[from..].to_vec(),
                values: sequence.values[from * width..]
                    .iter()
                    .zip(means.iter().cycle())
                    .map(|(x, mean)| x - mean)
                    .collect(),
            };
            example.rest = Some(less(&rest, half).into());
            example.grasp = less(&example.grasp, 0).into();
            example.further.iter_mut().for_each(|grasp| *grasp = less(grasp, 0).into());
        }
        own
    }

    /// Trials of classes that have enough of them.
    fn asked(&self) -> Vec<usize> {
        let mut kept: Vec<usize> = self.by_class().into_iter().filter(|own| own.len() >= FEWEST[0]).flatten().collect();
        kept.sort_unstable();
        kept
    }

    /// The readings of a trial before the touch.
    fn rest_of(&self, k: usize) -> Sequence {
        let example = &self.examples[k];
        let whole = example.rest.as_ref().unwrap_or(&example.grasp);
        let from = whole.t_s.first().copied().unwrap_or(0.0);
        // A sample that rounding puts just beyond the end counts.
        gaps::filled(whole).until(from + LEAK_REST_S + 1e-4)
    }
}

/// Readings of a rest, sample by sample, and their means.
fn described(values: &[f32], width: usize) -> Vec<f32> {
    let samples = values.len() / width.max(1);
    if samples == 0 {
        return Vec::new();
    }
    let mean = |channel: usize| values.iter().skip(channel).step_by(width).sum::<f32>() / samples as f32;
    values.iter().copied().chain((0..width).map(mean)).collect()
}

/// Whether rows of features tell labels.
struct Question<'a> {
    values: Vec<f32>,
    columns: usize,
    truth: &'a [usize],
    classes: usize,
    fold: Vec<usize>,
    /// The nearest row of another fold.
    nearest: Vec<usize>,
    seed: u64,
}

impl<'a> Question<'a> {
    fn new(rows: &[Vec<f32>], truth: &'a [usize], seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // Folds that know no labels fit every permutation of them.
        let mut fold: Vec<usize> = (0..rows.len()).map(|k| k % FOLDS).collect();
        fold.shuffle(&mut random);
        let nearest = nearest_rows(&standardised(rows), &fold);
        let columns = rows.first().map_or(0, Vec::len);
        let classes = truth.iter().max().map_or(0, |most| most + 1);
        Self { values: rows.concat(), columns, truth, classes, fold, nearest, seed }
    }

    /// The check, without its channels.
    fn answered(&self, source: LeakSource) -> LeakCheck {
        let mut present = vec![false; self.classes];
        self.truth.iter().for_each(|class| present[*class] = true);
        let different = present.iter().filter(|own| **own).count();
        let chance = 1.0 / different.max(1) as f64;
        let few = different < 2 || self.truth.len() < FEWEST[1] || self.columns == 0;
        let accuracy = (!few).then(|| self.accuracy(self.truth));
        let leaks = accuracy.is_some_and(|own| own > chance + EXCESS * (1.0 - chance) && self.is_unlikely(own));
        LeakCheck { source, accuracy, chance, leaks, samples: 0, seconds: 0.0, channels: Vec::new() }
    }

    /// True where no permutation of the labels does as well.
    fn is_unlikely(&self, accuracy: f64) -> bool {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ 0x1eac);
        let mut labels = self.truth.to_vec();
        let (mut sum, mut squares) = (0.0, 0.0);
        for count in 1..=PERMUTATIONS {
            labels.shuffle(&mut random);
            let own = self.accuracy(&labels);
            if own >= accuracy {
                return false;
            }
            (sum, squares) = (sum + own, squares + own * own);
            let mean = sum / count as f64;
            let deviation = (squares / count as f64 - mean * mean).max(0.0).sqrt();
            if count == SOON.0 && accuracy > mean + SOON.1 * deviation {
                return true;
            }
        }
        true
    }

    /// Balanced accuracy of the better learner.
    fn accuracy(&self, labels: &[usize]) -> f64 {
        self.by_neighbour(labels).max(self.by_trees(labels))
    }

    fn by_neighbour(&self, labels: &[usize]) -> f64 {
        balanced(labels, &self.nearest.iter().map(|k| labels[*k]).collect::<Vec<_>>(), self.classes)
    }

    fn by_trees(&self, labels: &[usize]) -> f64 {
        let mut found = vec![usize::MAX; labels.len()];
        for fold in 0..FOLDS {
            let weights: Vec<f64> = self.fold.iter().map(|own| f64::from(u8::from(*own != fold))).collect();
            let table = Table { values: &self.values, columns: self.columns };
            let examples = Examples { table, labels, classes: self.classes, weights: Some(&weights) };
            let settings = ForestSettings { trees: TREES, seed: self.seed, ..ForestSettings::extra_trees() };
            let Ok(forest) = Forest::fit(&examples, &settings) else { return 0.0 };
            for (k, row) in self.values.chunks_exact(self.columns).enumerate().filter(|(k, _)| self.fold[*k] == fold) {
                let shares = forest.predict(row);
                found[k] = (0..self.classes).max_by(|a, b| shares[*a].total_cmp(&shares[*b])).unwrap_or(0);
            }
        }
        balanced(labels, &found, self.classes)
    }
}

/// Mean over the classes of the share of their rows that are found.
fn balanced(labels: &[usize], found: &[usize], classes: usize) -> f64 {
    let mut counts = vec![[0.0_f64; 2]; classes];
    for (label, found) in labels.iter().zip(found) {
        counts[*label][0] += 1.0;
        counts[*label][1] += f64::from(u8::from(label == found));
    }
    let shares: Vec<f64> = counts.iter().filter(|[all, _]| *all > 0.0).map(|[all, right]| right / all).collect();
    shares.iter().sum::<f64>() / shares.len().max(1) as f64
}

/// Columns with mean 0 and deviation 1; a column that never differs is 0.
fn standardised(rows: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let count = rows.len().max(1) as f32;
    let scale = |column: usize| {
        let mean = rows.iter().map(|row| row[column]).sum::<f32>() / count;
        let variance = rows.iter().map(|row| (row[column] - mean).powi(2)).sum::<f32>() / count;
        (mean, if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 })
    };
    let scales: Vec<(f32, f32)> = (0..rows.first().map_or(0, Vec::len)).map(scale).collect();
    rows.iter().map(|row| row.iter().zip(&scales).map(|(x, (mean, factor))| (x - mean) * factor).collect()).collect()
}

/// The nearest row of another fold for each.
fn nearest_rows(rows: &[Vec<f32>], fold: &[usize]) -> Vec<usize> {
    let distance2 = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
    let nearest = |k: usize| {
        let others = (0..rows.len()).filter(|other| fold[*other] != fold[k]);
        others.min_by(|a, b| distance2(&rows[k], &rows[*a]).total_cmp(&distance2(&rows[k], &rows[*b]))).unwrap_or(k)
    };
    (0..rows.len()).map(nearest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{Class, Example, Labels};
    use rand::RngExt;

    /// Twelve trials of each of ten objects at 50 Hz: noise at rest, then a touch that differs. The rest of an object is
    /// shifted by `offset` deviations times its number, in the first of four channels.
    fn set(seed: u64, offset: f32, longer: usize) -> Dataset {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let class = |k: usize| Class { name: format!("object {k}"), size: None, shape: None };
        let labels = Labels { classes: (0..10).map(class).collect(), ..Labels::default() };
        let mut noise = || (0..12).map(|_| random.random::<f32>()).sum::<f32>() - 6.0;
        let mut example = |k: usize| {
            let (class, count) = (k % 10, 60 + longer * (k % 10));
            let t_s: Vec<f32> = (0..count).map(|n| 0.02 * n as f32).collect();
            let row = |t: f32| {
                let touch = (t - 0.5).max(0.0) * (1.0 + class as f32);
                [noise() + offset * class as f32 + touch, noise() + touch, noise(), noise()]
            };
            let values: Vec<f32> = t_s.iter().copied().flat_map(row).collect();
            Example { id: k as i64, class, grasp: Sequence { t_s, values }.into(), ..Example::default() }
        };
        let examples = (0..120).map(&mut example).collect();
        let channels = ["flex", "pad", "palm", "motor"].map(str::to_owned).to_vec();
        Dataset { channels, labels, examples, ..Dataset::default() }
    }

    #[test]
    fn sound_sets_do_not_warn() {
        let warned = (0..200).filter(|seed| set(*seed, 0.0, 0).leak_checks(1).iter().any(|check| check.leaks)).count();
        assert!(warned <= 1, "{warned} of 200");
    }

    #[test]
    fn an_offset_of_half_a_deviation_is_found_and_named() {
        let checks: Vec<LeakCheck> = (0..20).map(|seed| set(seed, 0.5, 0).leak_checks(1)[0].clone()).collect();
        let found = checks.iter().filter(|check| check.leaks && check.channels == ["flex"]).count();
        assert!(found >= 19, "{found} of 20: {checks:?}");
        assert_eq!((checks[0].samples, checks[0].chance), (16, 0.1));
        let text = checks[0].to_string();
        assert!(text.contains("before it is touched") && text.contains("chance 10 %; by flex"), "{text}");
    }

    #[test]
    fn a_constant_offset_goes_with_the_first_half_of_the_rest() {
        let own = set(3, 5.0, 0);
        assert!(own.leak_checks(1)[0].leaks);
        let rezeroed = own.rezeroed();
        let [rest, _] = rezeroed.leak_checks(1);
        assert!(!rest.leaks && rest.samples == 8, "{rest}");
        // The touch is still there.
        let last = |data: &Dataset, k: usize| *data.examples[k].grasp.values.last().expect("has some");
        assert!((0..10).all(|k| (last(&own, k) - last(&rezeroed, k)).abs() < 2.0));
    }

    #[test]
    fn the_length_of_a_trial_may_tell_its_label() {
        let [rest, length] = set(4, 0.0, 3).leak_checks(1);
        assert!(!rest.leaks && length.leaks && length.accuracy == Some(1.0), "{rest}; {length}");
        assert!(length.to_string().contains("by the length of its trials alone (100 %, chance 10 %)"));
    }

    #[test]
    fn too_few_trials_are_not_checked() {
        let own = set(5, 5.0, 0);
        for few in [0, 1, 19, 40] {
            let checks = own.part(&(0..few).collect::<Vec<_>>()).leak_checks(1);
            assert!(checks.iter().all(|check| check.accuracy.is_none() && !check.leaks), "{few}");
            assert!(checks[0].to_string().contains("not checked"));
        }
        assert!(own.part(&(0..50).collect::<Vec<_>>()).leak_checks(1)[0].accuracy.is_some());
        // Of trials that begin with the touch nothing is known.
        let mut without = own;
        without.examples[7].rest = Some(Sequence::default().into());
        let [rest, length] = without.leak_checks(1);
        assert!(rest.accuracy.is_none() && length.accuracy.is_some());
    }
}
