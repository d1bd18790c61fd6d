//! An estimate with its confidence interval.

use serde::{Deserialize, Serialize};
use statrs::distribution::{Beta, ContinuousCDF};

/// Coverage of every interval here: 95 %.
pub const LEVEL: f64 = 0.95;

/// An estimate with its two-sided interval of coverage [`LEVEL`], in the unit of the statistic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Statistic on the original trials.
    pub estimate: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Interval of a share that is estimated by `count` of `of` (Wilson 1927): sound for rare events and small samples.
    pub fn of_share(count: usize, of: usize) -> Self {
        /// Quantile of the normal distribution at 97.5 %, for a coverage of [`LEVEL`].
        const Z: f64 = 1.959_963_984_540_054;
        if of == 0 {
            return Self { estimate: 0.0, low: 0.0, high: 1.0 };
        }
        let (n, p) = (of as f64, count as f64 / of as f64);
        let (middle, scale) = (p + Z * Z / (2.0 * n), 1.0 + Z * Z / n);
        let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
        let low = if count == 0 { 0.0 } else { (middle - half) / scale };
        let high = if count == of { 1.0 } else { (middle + half) / scale };
        Self { estimate: p, low, high }
    }

    /// True if the value lies in the interval, ends included.
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Largest share that `count` of `of` are compatible with at an error rate: the one-sided upper bound of Clopper and Pearson
/// (1934).
pub fn largest_share(count: usize, of: usize, error: f64) -> f64 {
    if count >= of {
        return 1.0;
    }
    let bound = Beta::new(count as f64 + 1.0, (of - count) as f64);
    bound.map_or(1.0, |beta| beta.inverse_cdf(1.0 - error))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: `scipy.stats.beta.ppf(1 - error, count + 1, of - count)`.
    #[test]
    fn upper_bounds_agree_with_scipy() {
        for (count, of, error, bound) in
            [(0, 50, 0.05, 0.058_155_1), (3, 100, 0.05, 0.075_710_8), (5, 400, 0.005, 0.034_971_7)]
        {
            let own = largest_share(count, of, error);
            assert!((own - bound).abs() < 1e-6, "{count} of {of}: {own}");
        }
        assert_eq!([largest_share(0, 0, 0.05), largest_share(7, 7, 0.05)], [1.0; 2]);
    }

    /// Expected: `statsmodels.stats.proportion.proportion_confint(count, of, method="wilson")`.
    #[test]
    fn shares_have_wilson_intervals() {
        for (count, of, low, high) in [(5, 50, 0.043_476, 0.213_602), (1, 1000, 0.000_177, 0.005_644)] {
            let share = Interval::of_share(count, of);
            assert!((share.low - low).abs() < 2e-6 && (share.high - high).abs() < 2e-6, "{share:?}");
            assert!(share.holds(share.estimate));
        }
        let none = Interval::of_share(0, 2000);
        assert!(none.low == 0.0 && (none.high - 0.001_917).abs() < 2e-6, "{none:?}");
        assert_eq!(Interval::of_share(0, 0).high, 1.0);
    }
}
