//! Timing of a stream of readings: rate, jitter, losses, unreadable lines.

use serde::{Deserialize, Serialize};

/// Timing statistics of a stream.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Cadence {
    /// Readings so far.
    pub samples: u64,
    /// Readings that the board took and that did not arrive, as far as they can be counted.
    pub lost: u64,
    /// Lines that could not be read.
    pub bad_lines: u64,
    pub gaps: u64,
    /// Restarts of the board while it was connected, as its clock and its numbers show them.
    pub restarts: u64,
    /// Bytes so far.
    pub bytes: u64,
    /// Readings per second, lately (1/s).
    pub rate_hz: f64,
    /// 95th percentile of how far the time between two readings is from the usual (ms); by the board's clock where it
    /// sends one, else by arrival.
    pub jitter_p95_ms: f64,
    /// 95th percentile of how much later than the quickest readings arrive (ms).
    pub delay_p95_ms: f64,
    /// Drift of the board's clock against this computer's (ppm); none where it sends no time.
    pub drift_ppm: Option<f64>,
    /// Share of the last second's lines that could not be read.
    pub bad_share: f64,
    /// Share of the last second's bytes that are text.
    pub printable_share: f64,
    /// More than a fifth of the lines were unreadable for a whole second.
    pub troubled: bool,
}

impl Cadence {
    /// These statistics, with counters counted from `before` on.
    pub fn since(&self, before: &Self) -> Self {
        Self {
            samples: self.samples.saturating_sub(before.samples),
            lost: self.lost.saturating_sub(before.lost),
            bad_lines: self.bad_lines.saturating_sub(before.bad_lines),
            gaps: self.gaps.saturating_sub(before.gaps),
            restarts: self.restarts.saturating_sub(before.restarts),
            bytes: self.bytes.saturating_sub(before.bytes),
            ..self.clone()
        }
    }
}
