//! An estimate with its confidence interval.

use serde::{Deserialize, Serialize};

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
    /// True if the value lies in the interval, ends included.
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}
