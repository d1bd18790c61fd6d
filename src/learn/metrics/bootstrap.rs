//! Bootstrap intervals over trials (Efron and Tibshirani, *An introduction to the bootstrap*, chapters 8 and 13).
//!
//! The trials of one object resemble each other, so each object is a stratum: a resample draws, with replacement, as
//! many trials from every object as it has. The interval runs between the 2.5 % and 97.5 % points of the statistic
//! over resamples. It speaks for new trials with these same objects and these trained models: neither other objects
//! nor other training runs are in it. With n trials per object it is too narrow by about sqrt((n - 1) / n), 5 % at
//! n = 10, and an object with a single trial adds nothing to its width.
//!
//! Trials of one session resemble each other, too. Where there are several sessions, whole sessions are drawn instead of trials
//! (Davison and Hinkley, *Bootstrap methods and their application*, section 3.8); sessions with a single object each are drawn
//! within that object. The interval then speaks for new sessions; with few of them it is too narrow by the same formula.
//!
//! Two models are compared on the same resamples. What makes a trial hard for both then cancels in the difference,
//! which is settled by fewer trials than two separate intervals that do not overlap would take.

use super::{Interval, LEVEL};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Settings of the resampling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bootstrap {
    /// Number of resamples. At 2000 the ends vary between seeds by 1.5 % of the width (one standard deviation).
    pub resamples: usize,
    /// Seed of the draws; the same seed gives the same interval everywhere.
    pub seed: u64,
}

impl Default for Bootstrap {
    fn default() -> Self {
        Self { resamples: 2000, seed: 0 }
    }
}

/// Share of the resamples on which the statistic must be defined. With fewer, the interval would describe unusual draws only.
const DEFINED: f64 = 0.95;

impl Bootstrap {
    /// Interval of a statistic that is computed from trial numbers, which repeat within a resample.
    ///
    /// `objects` holds the object of each trial. `None` without trials or resamples, or where the statistic is
    /// undefined (`None` or not finite) on the trials as they are or on more than 5 % of the resamples.
    pub fn interval(&self, objects: &[usize], statistic: impl Fn(&[usize]) -> Option<f64>) -> Option<Interval> {
        self.over_sessions(objects, &[], statistic)
    }

    /// The same with whole sessions drawn. `sessions` holds the session of each trial. Trials are drawn where it is empty, or
    /// where there are no two sessions to draw from.
    pub fn over_sessions(
        &self,
        objects: &[usize],
        sessions: &[u32],
        statistic: impl Fn(&[usize]) -> Option<f64>,
    ) -> Option<Interval> {
        let statistic = |trials: &[usize]| statistic(trials).filter(|value| value.is_finite());
        if objects.is_empty() {
            return None;
        }
        let mut trials: Vec<usize> = (0..objects.len()).collect();
        let estimate = statistic(&trials)?;
        let strata = of_sessions(objects, sessions).unwrap_or_else(|| {
            let mut strata: BTreeMap<usize, Vec<Vec<usize>>> = BTreeMap::new();
            for (trial, &object) in objects.iter().enumerate() {
                strata.entry(object).or_default().push(vec![trial]);
            }
            strata.into_values().collect()
        });
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut values = Vec::new();
        for _ in 0..self.resamples {
            trials.clear();
            for stratum in &strata {
                for _ in stratum {
                    trials.extend(&stratum[rng.random_range(0..stratum.len())]);
                }
            }
            values.extend(statistic(&trials));
        }
        if (values.len() as f64) < DEFINED * self.resamples as f64 {
            return None;
        }
        values.sort_by(f64::total_cmp);
        let tail = 0.5 * (1.0 - LEVEL);
        Some(Interval { estimate, low: quantile(&values, tail)?, high: quantile(&values, 1.0 - tail)? })
    }

    /// Interval of the first model's statistic minus the second's, both on the same trials in every resample.
    pub fn difference(
        &self,
        (objects, sessions): (&[usize], &[u32]),
        first: impl Fn(&[usize]) -> Option<f64>,
        second: impl Fn(&[usize]) -> Option<f64>,
    ) -> Option<Interval> {
        self.over_sessions(objects, sessions, |trials| Some(first(trials)? - second(trials)?))
    }
}

/// True where [`Bootstrap::over_sessions`] draws sessions, and not trials.
pub fn draws_sessions(objects: &[usize], sessions: &[u32]) -> bool {
    of_sessions(objects, sessions).is_some()
}

/// The trials of each session: strata of sessions with a single object each, by object, and of those with several. None where
/// each stratum has one session.
fn of_sessions(objects: &[usize], sessions: &[u32]) -> Option<Vec<Vec<Vec<usize>>>> {
    let mut by_session: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (trial, &session) in sessions.iter().enumerate() {
        by_session.entry(session).or_default().push(trial);
    }
    let mut strata: BTreeMap<Option<usize>, Vec<Vec<usize>>> = BTreeMap::new();
    for trials in by_session.into_values() {
        let first = objects[trials[0]];
        let only = trials.iter().all(|trial| objects[*trial] == first).then_some(first);
        strata.entry(only).or_default().push(trials);
    }
    strata.values().any(|sessions| sessions.len() > 1).then(|| strata.into_values().collect())
}

/// The value below which a share of the sorted values lies, linear between them (`numpy.quantile`).
fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let place = share * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (sorted.get(place.floor() as usize)?, sorted.get(place.ceil() as usize)?);
    Some(below + (above - below) * place.fract())
}

#[cfg(test)]
mod tests {
    use super::super::Confusion;
    use super::*;
    use proptest::prelude::*;

    fn mean_of(values: &[f64]) -> impl Fn(&[usize]) -> Option<f64> {
        |trials| Some(trials.iter().map(|&trial| values[trial]).sum::<f64>() / trials.len() as f64)
    }

    #[test]
    fn quantiles_agree_with_numpy() {
        // np.quantile([3, 1, 4, 1, 5, 9, 2, 6], [0.025, 0.5, 0.975])
        let sorted = [1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 9.0];
        for (share, expected) in [(0.025, 1.0), (0.5, 3.5), (0.975, 8.475)] {
            assert!(quantile(&sorted, share).is_some_and(|value| (value - expected).abs() < 1e-14), "{share}");
        }
        assert_eq!((quantile(&[], 0.5), quantile(&[7.0], 0.975)), (None, Some(7.0)));
    }

    #[test]
    fn the_interval_of_a_mean_is_two_standard_errors_each_way() {
        // Two objects, one always recognised, the other every second time of 200: s = sqrt(0.25 * 200) / 400.
        let hits: Vec<f64> = (0..400).map(|trial| if trial % 4 == 0 { 0.0 } else { 1.0 }).collect();
        let objects: Vec<usize> = (0..400).map(|trial| trial % 2).collect();
        let interval = Bootstrap { resamples: 20_000, seed: 1 }.interval(&objects, mean_of(&hits)).expect("defined");
        let half_width = 1.96 * 50_f64.sqrt() / 400.0;
        assert_eq!(interval.estimate, 0.75);
        assert!((interval.low - 0.75 + half_width).abs() < 0.003, "{interval:?} {half_width}");
        assert!((interval.high - 0.75 - half_width).abs() < 0.003, "{interval:?} {half_width}");
    }

    #[test]
    fn a_shared_difficulty_cancels_in_the_difference() {
        // The second model misses what the first misses and one trial in twenty more.
        let first: Vec<f64> = (0..200).map(|trial| if trial % 2 == 0 { 0.0 } else { 1.0 }).collect();
        let second: Vec<f64> = (0..200).map(|trial| if trial % 20 == 1 { 0.0 } else { first[trial] }).collect();
        let (bootstrap, objects) = (Bootstrap::default(), [0; 200]);
        let difference = bootstrap.difference((&objects, &[]), mean_of(&first), mean_of(&second)).expect("defined");
        assert!((difference.estimate - 0.05).abs() < 1e-12 && !difference.holds(0.0), "{difference:?}");
        let alone = bootstrap.interval(&objects, mean_of(&first)).expect("defined");
        assert!(alone.high - alone.low > 2.0 * (difference.high - difference.low));
        let same = bootstrap.difference((&objects, &[]), mean_of(&first), mean_of(&first)).expect("defined");
        assert_eq!(same, Interval { estimate: 0.0, low: 0.0, high: 0.0 });
    }

    #[test]
    fn sessions_that_differ_widen_the_interval() {
        // Ten sessions of twenty trials; all trials of a session are alike, so that ten draws are all that is known.
        let (objects, sessions): (Vec<usize>, Vec<u32>) = (0..200).map(|trial| (trial % 4, trial as u32 / 20)).unzip();
        let hits: Vec<f64> = sessions.iter().map(|session| f64::from(session % 2)).collect();
        let bootstrap = Bootstrap { resamples: 20_000, seed: 1 };
        let width = |sessions: &[u32]| {
            let interval = bootstrap.over_sessions(&objects, sessions, mean_of(&hits)).expect("defined");
            assert_eq!(interval.estimate, 0.5);
            interval.high - interval.low
        };
        // 2 * 1.96 * sqrt(0.25 / n), in steps of a tenth for sessions.
        assert!((width(&[]) - 0.139).abs() < 0.01 && (width(&sessions) - 0.6).abs() < 0.05, "{}", width(&sessions));
        // A session for each object, or one for all, tells nothing of sessions.
        let by_object: Vec<u32> = objects.iter().map(|object| *object as u32).collect();
        assert_eq!([width(&by_object), width(&[3; 200])], [width(&[]); 2]);
        let drawn = [&sessions, &by_object, &vec![]].map(|sessions| draws_sessions(&objects, sessions));
        assert_eq!(drawn, [true, false, false]);
    }

    #[test]
    fn the_undefined_has_no_interval() {
        let bootstrap = Bootstrap { resamples: 100, seed: 0 };
        assert_eq!(bootstrap.interval(&[], |_| Some(1.0)), None);
        assert_eq!(bootstrap.interval(&[0, 0], |_| None), None);
        assert_eq!(bootstrap.interval(&[0, 0], |_| Some(f64::NAN)), None);
        assert_eq!(Bootstrap { resamples: 0, seed: 0 }.interval(&[0, 0], |_| Some(1.0)), None);
        // Defined on the trials as they are, but on half of the resamples only.
        assert_eq!(bootstrap.interval(&[0, 0], |trials| (trials[0] != trials[1]).then_some(1.0)), None);
    }

    #[test]
    fn intervals_cover_the_truth_as_often_as_they_say() {
        // Macro-accuracy of a recogniser whose chance of being right is known for each of eight objects.
        const CHANCES: [f64; 8] = [0.95, 0.9, 0.85, 0.8, 0.7, 0.65, 0.6, 0.5];
        const REPETITIONS: u64 = 300;
        let truth: Vec<usize> = (0..8 * 30).map(|trial| trial % 8).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let covers = |seed: &u64| {
            let decided: Vec<_> =
                truth.iter().map(|&object| rng.random_bool(CHANCES[object]).then_some(object)).collect();
            let statistic = |trials: &[usize]| {
                Confusion::from_pairs(8, trials.iter().map(|&trial| (truth[trial], decided[trial])))?.macro_accuracy()
            };
            let interval = Bootstrap { resamples: 400, seed: *seed }.interval(&truth, statistic);
            interval.is_some_and(|interval| interval.holds(CHANCES.iter().sum::<f64>() / 8.0))
        };
        let covered = (0..REPETITIONS).filter(covers).count() as f64 / REPETITIONS as f64;
        assert!((0.90..=0.99).contains(&covered), "{covered}");
    }

    proptest! {
        #[test]
        fn a_symmetric_sample_has_its_mean_inside(half in prop::collection::vec(-1.0..1.0_f64, 2..30), seed: u64) {
            let values: Vec<f64> = half.iter().flat_map(|value| [*value, -value]).collect();
            let interval = Bootstrap { resamples: 400, seed }.interval(&vec![0; values.len()], mean_of(&values));
            let again = Bootstrap { resamples: 400, seed }.interval(&vec![0; values.len()], mean_of(&values));
            prop_assert_eq!(interval, again);
            prop_assert!(interval.is_some_and(|interval| interval.holds(interval.estimate)));
        }
    }
}
