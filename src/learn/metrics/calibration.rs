//! Calibration of the probabilities of a recogniser.
//!
//! Confidence is the probability of the likeliest class (the first of equals), a hit is that class being the truth.
//! The expected calibration error is the mean gap between confidence and accuracy over bins of trials of like
//! confidence. The bins hold equal numbers of trials (Nixon et al., *Measuring calibration in deep learning*, 2019):
//! bins of equal width leave most of them nearly empty for a confident recogniser. Few trials make it read high even
//! for a calibrated one (about 0.08 at 16 trials a bin), so compare it at equal numbers of trials and bins only.

use serde::{Deserialize, Serialize};

/// Bins of the expected calibration error, unless there is a reason for other: the number used in most publications.
pub const CALIBRATION_BINS: usize = 10;

/// Least probability that the log-likelihood believes: a single f32 underflow would make it infinite. One trial
/// costs 27.6 nat at most; a higher floor hides overconfidence, a lower one lets single trials rule the mean.
pub const PROBABILITY_FLOOR: f64 = 1e-12;

/// How far from one a row of probabilities may sum. A softmax in f32 over a hundred classes stays within 1e-5.
const SUM_TOLERANCE: f64 = 1e-4;

/// Probabilities over the classes given for each of at least one trial, beside the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecasts<'a> {
    rows: Vec<Forecast<'a>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Forecast<'a> {
    truth: usize,
    probabilities: &'a [f64],
    confidence: f64,
    hit: bool,
}

/// One bin of the reliability curve; a calibrated recogniser has accuracy equal to confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReliabilityPoint {
    /// Mean confidence of the trials in the bin, 0 to 1.
    pub confidence: f64,
    /// Share of them that were hits, 0 to 1.
    pub accuracy: f64,
    /// Trials in the bin, at least one.
    pub trials: usize,
}

/// Verdicts above a confidence threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Confident {
    /// Share of all trials whose confidence reaches the threshold, 0 to 1.
    pub share: f64,
    /// Share of wrong ones among them, 0 to 1; `None` if no trial is confident.
    pub wrong: Option<f64>,
}

impl<'a> Forecasts<'a> {
    /// Pairs each trial's class with its row of probabilities.
    ///
    /// `None` without trials, if the lengths differ, or if a row is not a distribution over the same classes as the
    /// first: finite, not negative, with a sum of one to 1e-4, and with the truth among its classes.
    pub fn new(truth: &[usize], probabilities: &'a [Vec<f64>]) -> Option<Self> {
        let classes = probabilities.first()?.len();
        if truth.len() != probabilities.len() || probabilities.iter().any(|row| row.len() != classes) {
            return None;
        }
        let rows = truth.iter().zip(probabilities).map(|(&truth, row)| Forecast::new(truth, row));
        Some(Self { rows: rows.collect::<Option<_>>()? })
    }

    /// Selects trials, with repetition; `None` for no trials or an index out of range.
    pub fn at(&self, trials: &[usize]) -> Option<Self> {
        let rows: Vec<_> = trials.iter().map(|&trial| self.rows.get(trial).copied()).collect::<Option<_>>()?;
        (!rows.is_empty()).then_some(Self { rows })
    }

    /// Expected calibration error over equal-mass bins, 0 to 1; see [`Self::reliability`] for the bins.
    pub fn calibration_error(&self, bins: usize) -> f64 {
        let gaps = self.reliability(bins).into_iter();
        gaps.map(|bin| bin.trials as f64 * (bin.accuracy - bin.confidence).abs()).sum::<f64>() / self.rows.len() as f64
    }

    /// Accuracy against confidence in bins of equal mass, from the least confident to the most.
    ///
    /// Bin sizes differ by one at most, the larger first; there are never more bins than trials, nor fewer than one.
    /// Trials of equal confidence share their hits evenly, so that their order does not matter.
    pub fn reliability(&self, bins: usize) -> Vec<ReliabilityPoint> {
        let mut sorted: Vec<(f64, f64)> =
            self.rows.iter().map(|row| (row.confidence, f64::from(u8::from(row.hit)))).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        for tied in sorted.chunk_by_mut(|a, b| a.0 == b.0) {
            let accuracy = tied.iter().map(|trial| trial.1).sum::<f64>() / tied.len() as f64;
            tied.iter_mut().for_each(|trial| trial.1 = accuracy);
        }
        let bins = bins.clamp(1, sorted.len());
        let (size, larger) = (sorted.len() / bins, sorted.len() % bins);
        let mut rest = sorted.as_slice();
        let next_bin = |bin| {
            let (here, after) = rest.split_at(size + usize::from(bin < larger));
            rest = after;
            let mean = |pick: fn(&(f64, f64)) -> f64| here.iter().map(pick).sum::<f64>() / here.len() as f64;
            ReliabilityPoint { confidence: mean(|t| t.0), accuracy: mean(|t| t.1), trials: here.len() }
        };
        (0..bins).map(next_bin).collect()
    }

    /// Mean negative log-likelihood of the truth (nat), at most -ln [`PROBABILITY_FLOOR`].
    pub fn negative_log_likelihood(&self) -> f64 {
        // Rounding may leave a probability just above one, whose surprise is none.
        self.mean(|row| -row.probabilities[row.truth].clamp(PROBABILITY_FLOOR, 1.0).ln())
    }

    /// Share of trials whose truth is among the `k` likeliest classes, lower class numbers first among equals.
    pub fn top_k_accuracy(&self, k: usize) -> f64 {
        self.mean(|row| f64::from(u8::from(row.rank() < k)))
    }

    /// How many answers reach a confidence threshold (0 to 1), and how many of those are wrong.
    pub fn confident(&self, threshold: f64) -> Confident {
        let confident: Vec<_> = self.rows.iter().filter(|row| row.confidence >= threshold).collect();
        let wrong = confident.iter().filter(|row| !row.hit).count();
        Confident {
            share: confident.len() as f64 / self.rows.len() as f64,
            wrong: (!confident.is_empty()).then(|| wrong as f64 / confident.len() as f64),
        }
    }

    fn mean(&self, value: impl Fn(&Forecast<'_>) -> f64) -> f64 {
        self.rows.iter().map(value).sum::<f64>() / self.rows.len() as f64
    }
}

impl<'a> Forecast<'a> {
    fn new(truth: usize, probabilities: &'a [f64]) -> Option<Self> {
        let valid = probabilities.iter().all(|p| p.is_finite() && *p >= 0.0);
        if !valid || (probabilities.iter().sum::<f64>() - 1.0).abs() > SUM_TOLERANCE || truth >= probabilities.len() {
            return None;
        }
        let confidence = probabilities.iter().copied().fold(0.0, f64::max).min(1.0);
        let mut row = Self { truth, probabilities, confidence, hit: false };
        row.hit = row.rank() == 0;
        Some(row)
    }

    /// How many classes stand before the truth, by probability and then by number.
    fn rank(&self) -> usize {
        let own = self.probabilities[self.truth];
        let before = |&(class, &p): &(usize, &f64)| p > own || (p == own && class < self.truth);
        self.probabilities.iter().enumerate().filter(before).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TRUTH: [usize; 10] = [0, 1, 0, 2, 1, 0, 2, 1, 2, 2];

    fn probabilities() -> Vec<Vec<f64>> {
        [
            [0.7, 0.2, 0.1],
            [0.1, 0.6, 0.3],
            [0.31, 0.29, 0.4],
            [0.05, 0.9, 0.05],
            [0.25, 0.5, 0.25],
            [0.8, 0.15, 0.05],
            [0.2, 0.2, 0.6],
            [0.34, 0.33, 0.33],
            [0.02, 0.03, 0.95],
            [0.47, 0.1, 0.43],
        ]
        .map(Vec::from)
        .to_vec()
    }

    #[test]
    fn scores_agree_with_scikit_learn() {
        // log_loss(y, p, labels=[0,1,2])
        // [top_k_accuracy_score(y, p, k=k, labels=[0,1,2]) for k in (1, 2)]
        // conf = p.max(1); hit = p.argmax(1) == y; o = np.argsort(conf, kind="stable")
        // for n in (10, 4, 3): sum(len(i) * abs(conf[i].mean() - hit[i].mean()) for i in np.array_split(o, n)) / len(y)
        let rows = probabilities();
        let forecasts = Forecasts::new(&TRUTH, &rows).expect("valid rows");
        for (got, expected) in [
            (forecasts.negative_log_likelihood(), 0.8465458167605494),
            (forecasts.top_k_accuracy(1), 0.6),
            (forecasts.top_k_accuracy(2), 0.9),
            (forecasts.calibration_error(10), 0.396),
            (forecasts.calibration_error(4), 0.386),
            (forecasts.calibration_error(3), 0.246),
        ] {
            assert!((got - expected).abs() < 1e-14, "{got} {expected}");
        }
        let sizes: Vec<_> = forecasts.reliability(4).iter().map(|bin| bin.trials).collect();
        assert_eq!(sizes, [3, 3, 2, 2]);
    }

    #[test]
    fn confident_answers_may_be_wrong() {
        let rows = probabilities();
        let forecasts = Forecasts::new(&TRUTH, &rows).expect("valid rows");
        // 0.7, 0.9, 0.8 and 0.95 reach 0.7; the 0.9 is wrong.
        assert_eq!(forecasts.confident(0.7), Confident { share: 0.4, wrong: Some(0.25) });
        assert_eq!(forecasts.confident(0.99), Confident { share: 0.0, wrong: None });
    }

    #[test]
    fn impossible_is_punished_up_to_the_floor() {
        let rows = vec![vec![0.0, 1.0]];
        let forecasts = Forecasts::new(&[0], &rows).expect("a valid row");
        assert!((forecasts.negative_log_likelihood() + PROBABILITY_FLOOR.ln()).abs() < 1e-12);
        assert_eq!(forecasts.calibration_error(CALIBRATION_BINS), 1.0);
        let certain = vec![vec![1.0]];
        let forecasts = Forecasts::new(&[0], &certain).expect("a valid row");
        assert_eq!((forecasts.negative_log_likelihood(), forecasts.calibration_error(0)), (0.0, 0.0));
    }

    #[test]
    fn rows_that_are_no_distributions_are_refused() {
        for row in [vec![], vec![0.5, 0.4], vec![1.5, -0.5], vec![f64::NAN, 1.0], vec![f64::INFINITY]] {
            assert_eq!(Forecasts::new(&[0], &[row]), None);
        }
        assert_eq!(Forecasts::new(&[], &[]), None);
        assert_eq!(Forecasts::new(&[2], &[vec![0.5, 0.5]]), None);
        assert_eq!(Forecasts::new(&[0, 0], &[vec![1.0, 0.0], vec![1.0]]), None);
        let rows = probabilities();
        assert!(Forecasts::new(&TRUTH, &rows).is_some_and(|all| all.at(&[]).is_none() && all.at(&[10]).is_none()));
    }

    proptest! {
        #[test]
        fn scores_stay_in_range_and_ignore_order(
            rows in prop::collection::vec((0usize..3, prop::array::uniform3(1u8..5)), 1..40), bins in 0usize..50,
        ) {
            let truth: Vec<_> = rows.iter().map(|row| row.0).collect();
            let total = |counts: &[u8; 3]| counts.iter().map(|&count| f64::from(count)).sum::<f64>();
            let probabilities: Vec<Vec<f64>> =
                rows.iter().map(|(_, counts)| counts.map(|count| f64::from(count) / total(counts)).to_vec()).collect();
            let forecasts = Forecasts::new(&truth, &probabilities).expect("valid rows");
            let backwards = forecasts.at(&(0..rows.len()).rev().collect::<Vec<_>>()).expect("valid trials");
            let error = forecasts.calibration_error(bins);
            prop_assert!((0.0..=1.0).contains(&error) && (error - backwards.calibration_error(bins)).abs() < 1e-12);
            prop_assert!(forecasts.negative_log_likelihood() > 0.0);
            prop_assert_eq!(forecasts.top_k_accuracy(3), 1.0);
            prop_assert!(forecasts.top_k_accuracy(1) <= forecasts.top_k_accuracy(2));
            // One bin compares mean confidence with accuracy; finer bins can only find more.
            prop_assert!(error >= forecasts.calibration_error(1) - 1e-12);
        }
    }
}
