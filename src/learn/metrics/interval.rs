//! An estimate and the range it is believed to lie in.

use serde::{Deserialize, Serialize};

/// Coverage of every interval here: 95 %.
pub const LEVEL: f64 = 0.95;

/// An estimate with its two-sided interval of coverage [`LEVEL`], in the unit of the statistic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The statistic on the trials as they are.
    pub estimate: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Whether the value lies between the ends, which belong to the interval.
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Of an interval around a difference: whether its sign is settled.
    pub fn excludes_zero(&self) -> bool {
        !self.holds(0.0)
    }
}
