//! Time is counted in whole ticks. One tick is one solver step, or a span that a tolerance divides; every sample and
//! every actuation step falls on a tick, so the rate is a multiple of lcm(sample_hz, actuation_hz): 150 Hz for the
//! paper's 75 and 10 Hz.

use super::Accuracy;
use serde::{Deserialize, Serialize};

/// Rates and duration of a trial (paper, section IV-A: f_s = 75 Hz, f_a = 10 Hz, T = 4 s).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Timing {
    /// Samples per second.
    pub sample_hz: u32,
    /// Changes of commanded pressure per second.
    pub actuation_hz: u32,
    /// Length of a trial, T (s).
    pub duration_s: f64,
}

impl Default for Timing {
    fn default() -> Self {
        Self { sample_hz: 75, actuation_hz: 10, duration_s: 4.0 }
    }
}

/// A tick rate on which samples and actuation both fall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    pub ticks_per_second: u32,
    /// Ticks from one sample to the next.
    pub ticks_per_sample: u32,
    /// Ticks from one actuation step to the next.
    pub ticks_per_actuation: u32,
    /// Samples in a trial.
    pub samples: u32,
}

/// Tick rates above this are refused: they come from rates with no common measure, such as 997 and 10 Hz.
pub(super) const FASTEST_COMMON_HZ: u32 = 10_000;

/// Solver steps in one trial beyond which a scene is refused.
pub(super) const MOST_TICKS: u64 = 50_000_000;

impl Timing {
    /// The smallest rate that both rates divide (Hz).
    pub fn common_hz(&self) -> u64 {
        let (a, b) = (u64::from(self.sample_hz.max(1)), u64::from(self.actuation_hz.max(1)));
        a / greatest_common_divisor(a, b) * b
    }

    /// The clock for an accuracy. Sample k (from 0) is taken at t = (k + 1) / sample_hz, after the step.
    pub fn clock(&self, accuracy: Accuracy) -> Clock {
        let common = self.common_hz().min(u64::from(FASTEST_COMMON_HZ)) as u32;
        let steps = accuracy.least_hz().div_ceil(common);
        let ticks_per_second = common * steps;
        Clock {
            ticks_per_second,
            ticks_per_sample: ticks_per_second / self.sample_hz.max(1),
            ticks_per_actuation: ticks_per_second / self.actuation_hz.max(1),
            samples: (self.duration_s * f64::from(self.sample_hz)).round() as u32,
        }
    }
}

impl Clock {
    /// The same with `factor` times as many ticks.
    #[must_use]
    pub fn refined(&self, factor: u32) -> Self {
        Self {
            ticks_per_second: self.ticks_per_second * factor,
            ticks_per_sample: self.ticks_per_sample * factor,
            ticks_per_actuation: self.ticks_per_actuation * factor,
            samples: self.samples,
        }
    }

    /// Length of one tick (s): the step h, or the span within which a tolerance chooses steps.
    pub fn step(&self) -> f64 {
        1.0 / f64::from(self.ticks_per_second)
    }

    /// Time of a tick (s).
    pub fn seconds(&self, tick: u64) -> f64 {
        tick as f64 / f64::from(self.ticks_per_second)
    }

    /// Ticks in a whole trial.
    pub fn total_ticks(&self) -> u64 {
        u64::from(self.samples) * u64::from(self.ticks_per_sample)
    }
}

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_rates_meet_at_150_hz() {
        let timing = Timing::default();
        assert_eq!(timing.common_hz(), 150);
        let clock = timing.clock(Accuracy::Standard);
        assert_eq!((clock.ticks_per_second, clock.ticks_per_sample, clock.ticks_per_actuation), (300, 4, 30));
        assert_eq!((clock.samples, clock.total_ticks()), (300, 1200));
        assert_eq!(timing.clock(Accuracy::Draft).ticks_per_second, 150);
        assert_eq!(timing.clock(Accuracy::Reference).ticks_per_second, 9600);
    }

    #[test]
    fn other_rates_still_meet() {
        let timing = Timing { sample_hz: 50, actuation_hz: 20, duration_s: 1.5 };
        let clock = timing.clock(Accuracy::Standard);
        assert_eq!((clock.ticks_per_second, clock.ticks_per_sample, clock.ticks_per_actuation), (300, 6, 15));
        assert_eq!(clock.samples, 75);
    }
}
