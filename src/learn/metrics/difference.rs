//! Significance tests of the difference between recognisers; every p-value is two-sided.

use super::{Interval, LEVEL};
use serde::{Deserialize, Serialize};
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, StudentsT};

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

/// Outcome of [`corrected_t`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitTest {
    /// Mean difference over splits with its interval.
    pub difference: Interval,
    /// Corrected standard error of the mean; t is the mean over it.
    pub standard_error: f64,
    /// Chance, for equally good methods, of a mean difference at least as large.
    pub p_value: f64,
}

/// Corrected resampled t test of two methods over random splits (Nadeau and Bengio, Machine Learning 52:239, 2003).
///
/// Splits share training data, so their differences d are not independent, and the plain t test finds differences
/// where there are none. With k splits and n2 test trials for n1 training trials the corrected statistic is
///
///   t = mean(d) / sqrt((1 / k + n2 / n1) s²),   s² = sum (d - mean(d))² / (k - 1),   k - 1 degrees of freedom
///
/// `differences` holds one number per split: average over seeds within a split first, since other seeds on the same
/// split are no further split. `test_to_train` is n2 / n1. Where all differences are equal the interval has no width
/// and p is 0, or 1 if they are all zero. `None` for fewer than two splits or numbers that are not finite.
pub fn corrected_t(differences: &[f64], test_to_train: f64) -> Option<SplitTest> {
    let splits = differences.len() as f64;
    let freedom = splits - 1.0;
    if freedom < 1.0 || !(0.0..f64::INFINITY).contains(&test_to_train) {
        return None;
    }
    let mean = differences.iter().sum::<f64>() / splits;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / freedom;
    let standard_error = ((1.0 / splits + test_to_train) * variance).sqrt();
    if !mean.is_finite() || !standard_error.is_finite() {
        return None;
    }
    let student = StudentsT::new(0.0, 1.0, freedom).ok()?;
    let half_width = student.inverse_cdf(0.5 + 0.5 * LEVEL) * standard_error;
    let p_value = if mean == 0.0 { 1.0 } else { 2.0 * student.sf(mean.abs() / standard_error) };
    let difference = Interval { estimate: mean, low: mean - half_width, high: mean + half_width };
    Some(SplitTest { difference, standard_error, p_value })
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
    fn student_agrees_with_scipy() -> Result<(), statrs::distribution::StudentsTError> {
        // [(v, t.ppf(0.975, v), [2 * t.sf(x, v) for x in (0.001, 0.5, 2, 6, 40)]) for v in (1, 2, 4, 9, 49)]
        for (freedom, quantile, p_values) in [
            (
                1.0,
                12.706204736174694,
                [0.9993633804398159, 0.7048327646991335, 0.2951672353008665, 0.10513691342250688, 0.015912179824051624],
            ),
            (
                2.0,
                4.302652729749462,
                [0.9992928933955901, 2.0 / 3.0, 0.18350341907227397, 0.02667147321542477, 0.0006244146721847406],
            ),
            (
                4.0,
                2.7764451051977934,
                [0.99925000015625, 0.6433299631818633, 0.11611652351681556, 0.00388253704696051, 2.3340163226e-6],
            ),
            (
                9.0,
                2.262157162798205,
                [0.9992239303259733, 0.6290712998260263, 0.07655282377070101, 0.00020249932206764, 1.8982998e-11],
            ),
            (
                49.0,
                2.0095752371292392,
                [0.99920617576564, 0.6193131862101314, 0.05105914825741809, 2.3404303906210619e-7, 0.0],
            ),
        ] {
            let student = StudentsT::new(0.0, 1.0, freedom)?;
            assert!((student.inverse_cdf(0.975) - quantile).abs() < 1e-10 * quantile, "{freedom}");
            for (x, expected) in [0.001, 0.5, 2.0, 6.0, 40.0].into_iter().zip(p_values) {
                assert!((2.0 * student.sf(x) - expected).abs() < 1e-10, "{freedom} {x}");
            }
        }
        Ok(())
    }

    #[test]
    fn corrected_t_agrees_with_scipy() {
        // x = np.array([0.031, 0.012, -0.004, 0.025, 0.018]); k = len(x)
        // se = np.sqrt((1 / k + 0.25) * x.var(ddof=1))
        // 2 * t.sf(x.mean() / se, k - 1); t.interval(0.95, k - 1, x.mean(), se)
        let test = corrected_t(&[0.031, 0.012, -0.004, 0.025, 0.018], 0.25).expect("five splits");
        for (got, expected) in [
            (test.difference.estimate, 0.0164),
            (test.difference.low, -0.008678078075049792),
            (test.difference.high, 0.041478078075049794),
            (test.standard_error, 0.009032441530394758),
            (test.p_value, 0.1435965032112287),
        ] {
            assert!((got - expected).abs() < 1e-10, "{got} {expected}");
        }
    }

    #[test]
    fn equal_differences_and_missing_splits() {
        let none = corrected_t(&[0.0; 3], 0.25).expect("three splits");
        assert_eq!((none.p_value, none.difference), (1.0, Interval { estimate: 0.0, low: 0.0, high: 0.0 }));
        let always = corrected_t(&[0.5; 4], 0.25).expect("four splits");
        assert!(always.p_value == 0.0 && always.difference.excludes_zero());
        assert_eq!(corrected_t(&[], 0.25), None);
        assert_eq!(corrected_t(&[0.1], 0.25), None);
        assert_eq!(corrected_t(&[0.1, f64::NAN], 0.25), None);
        assert_eq!(corrected_t(&[0.1, 0.2], -1.0), None);
        assert_eq!(corrected_t(&[0.1, 0.2], f64::NAN), None);
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
        fn the_interval_excludes_zero_just_when_p_is_small(differences in prop::collection::vec(-1.0..2.0_f64, 2..12)) {
            let test = corrected_t(&differences, 0.25).expect("two splits");
            let undecided = (test.p_value - 0.05).abs() < 1e-9;
            prop_assert!(undecided || test.difference.excludes_zero() == (test.p_value < 0.05));
        }

        #[test]
        fn mcnemar_is_symmetric(only_first in 0u32..400, only_second in 0u32..400) {
            let p = McNemar { only_first, only_second }.p_value();
            prop_assert!((0.0..=1.0).contains(&p));
            prop_assert_eq!(p, McNemar { only_first: only_second, only_second: only_first }.p_value());
        }
    }
}
