//! Sampling of a data set: the rate and the end of its readings.

use palpate_tactile::Signals;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// End of the readings of a grasp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cut {
    /// End of the hold. The release differs between classes only by residues of integrators and dampers.
    #[default]
    HoldEnd,
    /// End of the trial, with the release.
    Whole,
    /// This time after the start of the closing (s).
    Seconds(f64),
}

/// A text that names no [`Cut`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write hold-end, whole or a positive number of seconds")]
pub struct NoCut;

impl FromStr for Cut {
    type Err = NoCut;

    fn from_str(text: &str) -> Result<Self, NoCut> {
        match text {
            "hold-end" => Ok(Self::HoldEnd),
            "whole" => Ok(Self::Whole),
            number => {
                let seconds = number.parse().ok().filter(|seconds: &f64| *seconds > 0.0 && seconds.is_finite());
                seconds.map(Self::Seconds).ok_or(NoCut)
            }
        }
    }
}

impl std::fmt::Display for Cut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::HoldEnd => f.write_str("hold-end"),
            Self::Whole => f.write_str("whole"),
            Self::Seconds(seconds) => write!(f, "{seconds}"),
        }
    }
}

impl Cut {
    /// End of the readings (s) where the hold ends at this time.
    pub(super) fn end(self, hold_end_s: f64) -> f64 {
        match self {
            Self::HoldEnd => hold_end_s,
            Self::Whole => f64::INFINITY,
            Self::Seconds(seconds) => seconds,
        }
    }
}

/// Reads signals at another rate (Hz), linearly between samples; unchanged without one.
pub(super) fn resampled(signals: Signals, rate_hz: Option<f64>) -> Signals {
    let (Some(rate_hz), Some(&first), Some(&last)) = (rate_hz, signals.t_s.first(), signals.t_s.last()) else {
        return signals;
    };
    let mut even = Signals { channels: signals.channels.clone(), ..Signals::default() };
    // A sample that rounding puts just beyond the end is the last one.
    let count = ((last - first) * rate_hz + 1e-6).floor() as usize;
    for k in 0..=count {
        let t = first + k as f64 / rate_hz;
        let after = signals.t_s.partition_point(|own| *own < t).min(signals.len() - 1);
        let before = after.saturating_sub(1);
        let (from, to) = (signals.t_s[before], signals.t_s[after]);
        let share = if to > from { ((t - from) / (to - from)).clamp(0.0, 1.0) as f32 } else { 1.0 };
        let between = signals.row(before).iter().zip(signals.row(after)).map(|(a, b)| a + share * (b - a));
        even.push(t, &between.collect::<Vec<f32>>());
    }
    even
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_stays_a_line_at_any_rate() {
        let mut line = Signals { channels: vec!["a".to_owned()], ..Signals::default() };
        for t in [0.0, 0.1, 0.25, 0.3, 0.5] {
            line.push(t, &[2.0 * t as f32 + 1.0]);
        }
        for (rate_hz, count) in [(10.0, 6), (75.0, 38), (2.0, 2), (1.0, 1)] {
            let even = resampled(line.clone(), Some(rate_hz));
            assert_eq!(even.len(), count, "{rate_hz}");
            for (k, t) in even.t_s.iter().enumerate() {
                assert!(
                    (t - k as f64 / rate_hz).abs() < 1e-12 && (even.row(k)[0] - (2.0 * *t as f32 + 1.0)).abs() < 1e-6
                );
            }
        }
        assert_eq!(resampled(line.clone(), None), line);
        let one = line.clone().until(0.0);
        assert_eq!(resampled(one.clone(), Some(50.0)), one);
        assert_eq!(resampled(Signals::default(), Some(50.0)), Signals::default());
    }

    #[test]
    fn cuts_are_written_as_they_are_read() {
        for (text, end) in [("hold-end", 3.0), ("whole", f64::INFINITY), ("1.5", 1.5)] {
            let cut: Cut = text.parse().unwrap();
            assert_eq!((cut.to_string(), cut.end(3.0)), (text.to_owned(), end));
        }
        assert!(["", "0", "-1", "inf", "end"].iter().all(|text| text.parse::<Cut>().is_err()));
    }
}
