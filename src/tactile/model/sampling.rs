//! The clock of the sensing box, and clean signals between their samples.
//!
//! The box reads at 50 Hz (paper, section IV-B). It reports sample k at k / 50 s after its start, but reads it a
//! little off: the recording starts by hand or by a message, and a loop on a microcontroller is not exact.

use super::streams::Stream;
use crate::Signals;

/// Samples per second (Hz) (paper, section IV-B).
pub const SAMPLE_HZ: f64 = 50.0;

/// Largest offset of the recording's start from the closing (s). Assumed: half an actuation tick of the
/// simulated gripper.
const START_OFFSET_S: f64 = 0.05;

/// Largest jitter of a sample (s). Assumed: a tenth of the sampling period.
const JITTER_S: f64 = 0.002;

/// Length at which a recording is cut (s). A grasp lasts seconds; a wrong time cannot fill the memory.
const LONGEST_S: f64 = 600.0;

/// Reported and actual time of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instant {
    /// As reported (s).
    pub(super) t: f64,
    /// In truth (s).
    pub(super) taken: f64,
}

/// The instants of a recording as long as the clean one. Without `jitter`, samples are taken at the reported times.
pub(super) fn instants(clean: &Signals, jitter: bool, seed: u64) -> Vec<Instant> {
    let (Some(&start), Some(&end)) = (clean.t_s.first(), clean.t_s.last()) else { return Vec::new() };
    // A hair more, so that the last of evenly divided time counts.
    let periods = ((end - start).min(LONGEST_S) * SAMPLE_HZ + 1e-6).floor().max(0.0) as u32;
    let offset = Stream::new(seed, "clock", "start").within(-START_OFFSET_S, START_OFFSET_S);
    let mut jitters = Stream::new(seed, "clock", "jitter");
    (0..=periods)
        .map(|k| {
            let t = start + f64::from(k) / SAMPLE_HZ;
            let error = if jitter { offset + jitters.within(-JITTER_S, JITTER_S) } else { 0.0 };
            Instant { t, taken: t + error }
        })
        .collect()
}

/// One channel of clean signals as a function of time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trace<'a> {
    signals: &'a Signals,
    column: usize,
}

impl<'a> Trace<'a> {
    /// Channel number `column`.
    pub(super) fn new(signals: &'a Signals, column: usize) -> Self {
        Self { signals, column }
    }

    /// Its value at a time (s): straight between samples, level before the first and after the last.
    pub(super) fn at(&self, t: f64) -> f64 {
        let times = &self.signals.t_s;
        let last = times.len().saturating_sub(1);
        let after = times.partition_point(|&sample| sample <= t).min(last);
        let before = after.saturating_sub(1);
        let (from, to) = (self.sample(before), self.sample(after));
        let gap = times[after] - times[before];
        let share = if gap > 0.0 { ((t - times[before]) / gap).clamp(0.0, 1.0) } else { 0.0 };
        from + (to - from) * share
    }

    /// Value of one sample; a reading that is no number counts as none.
    fn sample(&self, sample: usize) -> f64 {
        let value = self.signals.row(sample)[self.column];
        if value.is_finite() { f64::from(value) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals(samples: &[(f64, f32)]) -> Signals {
        let mut signals = Signals { channels: vec!["force_left".to_owned()], ..Signals::default() };
        samples.iter().for_each(|&(t, value)| signals.push(t, &[value]));
        signals
    }

    #[test]
    fn a_trace_is_straight_between_its_samples_and_level_outside() {
        let signals = signals(&[(1.0, 0.0), (2.0, 4.0), (4.0, 2.0)]);
        let trace = Trace::new(&signals, 0);
        for (t, want) in [(0.0, 0.0), (1.0, 0.0), (1.25, 1.0), (2.0, 4.0), (3.0, 3.0), (4.0, 2.0), (9.0, 2.0)] {
            assert_eq!(trace.at(t), want, "{t}");
        }
    }

    #[test]
    fn the_clock_runs_at_50_hz_and_is_read_a_little_off() {
        let signals = signals(&[(0.5, 0.0), (4.5, 1.0)]);
        let exact = instants(&signals, false, 3);
        let off = instants(&signals, true, 3);
        assert_eq!((exact.len(), off.len()), (201, 201));
        for (k, (exact, off)) in exact.iter().zip(&off).enumerate() {
            assert!((exact.t - 0.5 - 0.02 * k as f64).abs() < 1e-12);
            assert_eq!((exact.taken, off.t), (exact.t, exact.t));
            assert!((off.taken - off.t).abs() <= START_OFFSET_S + JITTER_S);
        }
        assert!(off.windows(2).all(|w| (w[1].taken - w[0].taken - 0.02).abs() <= 2.0 * JITTER_S + 1e-12));
        assert_ne!(off, instants(&signals, true, 4));
    }

    #[test]
    fn one_sample_stays_one_and_the_longest_recording_is_cut() {
        assert_eq!(instants(&signals(&[(2.0, 1.0)]), false, 0), [Instant { t: 2.0, taken: 2.0 }]);
        assert_eq!(instants(&signals(&[]), true, 0), []);
        assert_eq!(instants(&signals(&[(0.0, 1.0), (1e12, 1.0)]), true, 0).len(), 30_001);
    }
}
