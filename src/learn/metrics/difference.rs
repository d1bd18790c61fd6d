//! Significance tests of the difference between recognisers; every p-value is two-sided.

use serde::{Deserialize, Serialize};
use statrs::distribution::{Binomial, DiscreteCDF};

/// McNemar's exact test (Psychometrika 12:153, 1947): two models on one test set.
///
/// Trials on which both are right or both are wrong say nothing. If the models are equally good, each of the others
/// is right for the first or the second with even chance: p is twice the smaller binomial tail, at most 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct McNemar {
    /// Trials that only the first model got right.
    pub only_first: u32,
    /// Trials that only the second model got right.
    pub only_second: u32,
}

impl McNemar {
    /// Compares two models' decisions for the same trials; `None` if the lengths differ.
    pub fn of(truth: &[usize], first: &[Option<usize>], second: &[Option<usize>]) -> Option<Self> {
        if truth.len() != first.len() || truth.len() != second.len() {
            return None;
        }
        let mut counts = Self::default();
        for ((truth, first), second) in truth.iter().zip(first).zip(second) {
            match (*first == Some(*truth), *second == Some(*truth)) {
                (true, false) => counts.only_first += 1,
                (false, true) => counts.only_second += 1,
                (true, true) | (false, false) => {}
            }
        }
        Some(counts)
    }

    /// Chance, for equally good models, of a difference at least as large; 1 if they never disagree.
    pub fn p_value(&self) -> f64 {
        let disagreed = u64::from(self.only_first) + u64::from(self.only_second);
        let fewer = u64::from(self.only_first.min(self.only_second));
        Binomial::new(0.5, disagreed).map_or(1.0, |fair| (2.0 * fair.cdf(fewer)).min(1.0))
    }
}

/// Holm's step-down adjustment (Scandinavian Journal of Statistics 6:65, 1979) of the p-values of a family of tests.
///
/// Rejecting where the adjusted value is at most alpha keeps the chance of any false rejection at alpha. Adjusted
/// values stand in the order given; values outside 0 to 1 are clamped, NaN (a test that failed) counts as 1.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let p_value = |test: usize| if p_values[test].is_nan() { 1.0 } else { p_values[test].clamp(0.0, 1.0) };
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_value(a).total_cmp(&p_value(b)));
    let mut adjusted = vec![0.0; p_values.len()];
    let mut least = 0.0_f64;
    for (rank, &test) in order.iter().enumerate() {
        let remaining = (p_values.len() - rank) as f64;
        least = least.max(remaining * p_value(test)).min(1.0);
        adjusted[test] = least;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn mcnemar_agrees_with_statsmodels() {
        // from statsmodels.stats.contingency_tables import mcnemar
        // mcnemar([[0, b], [c, 0]], exact=True).pvalue
        for (only_first, only_second, expected) in [
            (3, 11, 0.057373046875),
            (0, 5, 0.0625),
            (25, 40, 0.08168153394154003),
            (7, 7, 1.0),
            (1, 0, 1.0),
            (400, 470, 0.019267052848609047),
            (5200, 5000, 0.04878796312682234),
        ] {
            let p = McNemar { only_first, only_second }.p_value();
            assert!((p - expected).abs() < 1e-10, "{only_first} {only_second}: {p} {expected}");
        }
        assert_eq!(McNemar::default().p_value(), 1.0);
    }

    #[test]
    fn only_disagreement_counts() {
        let truth = [0, 1, 2, 0, 1];
        let first = [Some(0), Some(1), Some(2), None, Some(0)];
        let second = [Some(0), Some(0), None, Some(0), None];
        let counts = McNemar::of(&truth, &first, &second);
        assert_eq!(counts, Some(McNemar { only_first: 2, only_second: 1 }));
        assert_eq!(McNemar::of(&truth, &first, &second[1..]), None);
    }

    #[test]
    fn holm_agrees_with_statsmodels() {
        // multipletests([0.01, 0.04, 0.03, 0.005, 0.5], method="holm")[1]
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005, 0.5]);
        for (got, expected) in adjusted.iter().zip([0.04, 0.09, 0.09, 0.025, 0.5]) {
            assert!((got - expected).abs() < 1e-15, "{adjusted:?}");
        }
        assert_eq!(holm(&[]), Vec::<f64>::new());
        assert_eq!(holm(&[f64::NAN, -1.0, 0.9]), [1.0, 0.0, 1.0]);
    }

    proptest! {
        #[test]
        fn holm_keeps_order_and_only_raises(p_values in prop::collection::vec(0.0..=1.0_f64, 1..20)) {
            let adjusted = holm(&p_values);
            let smallest = p_values.iter().copied().fold(1.0, f64::min);
            let bonferroni = (smallest * p_values.len() as f64).min(1.0);
            prop_assert_eq!(adjusted.iter().copied().fold(1.0, f64::min), bonferroni);
            for (i, p) in p_values.iter().enumerate() {
                prop_assert!(adjusted[i] >= *p && adjusted[i] <= 1.0);
                for (j, other) in p_values.iter().enumerate() {
                    prop_assert!(p > other || adjusted[i] <= adjusted[j]);
                }
            }
        }

        #[test]
        fn mcnemar_is_symmetric(only_first in 0u32..400, only_second in 0u32..400) {
            let p = McNemar { only_first, only_second }.p_value();
            prop_assert!((0.0..=1.0).contains(&p));
            prop_assert_eq!(p, McNemar { only_first: only_second, only_second: only_first }.p_value());
        }
    }
}
