//! Times of events from their times of arrival. Events tick on a clock of their own, x (seconds of a board, or a plain
//! count), and arrive late, by a delay that is never negative and sometimes minimal:
//!
//! ```text
//! arrival = offset + gain x + delay,   delay >= 0
//! ```
//!
//! Offset and gain are fitted to the points of least delay. Those lie along the lower convex hull of (x, arrival), which no
//! late point can bend, however many there are; its edge under the middle of the points is the line from which the sum of
//! all delays is least. Least squares over the points near that edge averages what noise is left. This is the method
//! of strawlab's triggerbox, with the hull in place of its rejection of outliers.

use std::collections::VecDeque;

/// Length of a stretch, of which only the point of least delay is kept (s).
const STRETCH_S: f64 = 0.25;
/// How many stretches are remembered: a minute, in which a quartz's drift is steady and 200 ppm come to 12 ms.
const STRETCHES: usize = 256;
/// Points that stand less above the hull's edge than this take part in the average (s): the jitter of a USB poll.
const NEAR_S: f64 = 1.5e-3;

/// A line under arrival times.
#[derive(Clone, Debug)]
pub(super) struct DelayLine {
    /// The gain, where it is known beforehand within [`DelayLine::GAIN_SLACK`]: 1 for a clock in seconds.
    nominal: Option<f64>,
    /// The first point; all others are relative to it, so that no digits are lost to large numbers.
    origin: Option<(f64, f64)>,
    /// The point of least delay of each stretch.
    points: VecDeque<(f64, f64)>,
    /// The best of the stretch that is going on, and when that ends.
    open: Option<((f64, f64), f64)>,
    offset: f64,
    gain: Option<f64>,
}

impl DelayLine {
    /// How far a gain may be from the nominal one: ceramic resonators are off by half a percent.
    const GAIN_SLACK: f64 = 0.01;
    /// A gain is fitted once the points span this time (s); over shorter times jitter dominates.
    const GAIN_SPAN_S: f64 = 5.0;
    /// Span of the points after which a gain is fitted if there is no nominal gain (s).
    const FREE_SPAN_S: f64 = 1.0;

    pub(super) fn new(nominal: Option<f64>) -> Self {
        Self { nominal, origin: None, points: VecDeque::new(), open: None, offset: 0.0, gain: nominal }
    }

    /// Time of an event at `x` on its own clock (s); none while too little is known.
    pub(super) fn at(&self, x: f64) -> Option<f64> {
        let (x0, arrived0) = self.origin?;
        Some(arrived0 + self.offset + self.gain? * (x - x0))
    }

    /// Seconds per unit of x, once known.
    pub(super) fn gain(&self) -> Option<f64> {
        self.gain
    }

    /// Takes in the arrival of an event at `x` (s).
    pub(super) fn add(&mut self, x: f64, arrived: f64) {
        let (x0, arrived0) = *self.origin.get_or_insert((x, arrived));
        let point = (x - x0, arrived - arrived0);
        // An earlier arrival than the line allows moves it at once: nothing arrives before it happens.
        if let Some(gain) = self.gain {
            self.offset = self.offset.min(point.1 - gain * point.0);
        }
        let slope = self.gain.unwrap_or(0.0);
        let delay = |p: (f64, f64)| p.1 - slope * p.0;
        match &mut self.open {
            Some((best, until)) if point.1 < *until => {
                // Without a gain there is no telling which is late; the first stands for all.
                if self.gain.is_some() && delay(point) < delay(*best) {
                    *best = point;
                }
            }
            open => {
                let closed = open.replace((point, point.1 + STRETCH_S));
                if let Some((best, _)) = closed {
                    self.points.push_back(best);
                    if self.points.len() > STRETCHES {
                        self.points.pop_front();
                    }
                    self.fit();
                }
            }
        }
    }

    fn fit(&mut self) {
        let (Some(first), Some(last)) = (self.points.front(), self.points.back()) else { return };
        let needed = if self.nominal.is_some() { Self::GAIN_SPAN_S } else { Self::FREE_SPAN_S };
        if last.1 - first.1 >= needed
            && let Some((offset, gain)) = line_under(self.points.make_contiguous())
            && gain > 0.0
            && self.nominal.is_none_or(|nominal| (gain / nominal - 1.0).abs() <= Self::GAIN_SLACK)
        {
            (self.offset, self.gain) = (offset, Some(gain));
        } else if let Some(gain) = self.gain {
            self.offset = self.points.iter().map(|p| p.1 - gain * p.0).fold(f64::INFINITY, f64::min);
        }
    }
}

/// Offset and gain of the line under points with rising x.
fn line_under(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let mut hull: Vec<(f64, f64)> = Vec::new();
    for &p in points {
        while let [.., a, b] = hull[..]
            && (b.0 - a.0) * (p.1 - a.1) <= (p.0 - a.0) * (b.1 - a.1)
        {
            hull.pop();
        }
        hull.push(p);
    }
    let middle = points.iter().map(|p| p.0).sum::<f64>() / points.len() as f64;
    let edge = hull.windows(2).find(|edge| edge[1].0 >= middle)?;
    let gain = (edge[1].1 - edge[0].1) / (edge[1].0 - edge[0].0);
    if !gain.is_finite() {
        return None;
    }
    let above = |p: &(f64, f64)| p.1 - edge[0].1 - gain * (p.0 - edge[0].0);
    let near: Vec<(f64, f64)> = points.iter().filter(|p| above(p) < NEAR_S).copied().collect();
    least_squares(&near).or(Some((edge[0].1 - gain * edge[0].0, gain)))
}

fn least_squares(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    // A handful of points at one end would turn the line about.
    if points.len() < 8 {
        return None;
    }
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / n, sum.1 + p.1 / n));
    let (xx, xy) = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + (p.0 - x).powi(2), sum.1 + (p.0 - x) * (p.1 - y)));
    let gain = xy / xx;
    gain.is_finite().then_some((y - gain * x, gain))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Delays of a USB bus (s): up to 2 ms, repeating without a pattern.
    fn delay(i: u32) -> f64 {
        f64::from(i.wrapping_mul(2_654_435_761) >> 8) / f64::from(1u32 << 24) * 2e-3
    }

    #[test]
    fn a_drift_of_200_ppm_is_found_through_jitter_and_bursts() {
        for drift in [200e-6, -200e-6, 0.0] {
            let mut line = DelayLine::new(Some(1.0));
            for i in 0..3000u32 {
                let device = 100.0 + 0.02 * f64::from(i);
                let happened = 5.0 + (1.0 + drift) * (device - 100.0);
                // Every tenth second the host is busy for 0.4 s and then receives everything at once.
                let stalled = if i % 500 < 20 { 0.02 * f64::from(20 - i % 500) } else { 0.0 };
                line.add(device, happened + delay(i) + stalled);
                if i > 400 {
                    let error = line.at(device).map(|t| t - happened);
                    assert!(error.is_some_and(|e| (-1e-4..2e-3).contains(&e)), "{drift} {i}: {error:?}");
                }
            }
            let ppm = line.gain().map(|gain| (gain - 1.0) * 1e6);
            assert!(ppm.is_some_and(|ppm| (ppm - drift * 1e6).abs() < 20.0), "{ppm:?}");
        }
    }

    #[test]
    fn without_a_clock_the_count_gives_the_period() {
        let mut line = DelayLine::new(None);
        for i in 0..1500u32 {
            let happened = 3.0 + 0.020_13 * f64::from(i);
            // BoardEvent in fives, as a busy host would.
            let burst = 0.020_13 * f64::from(4 - i % 5);
            line.add(f64::from(i), happened + burst + delay(i));
        }
        let gain = line.gain().unwrap_or_default();
        assert!((gain / 0.020_13 - 1.0).abs() < 2e-4, "{gain}");
        let error = line.at(1400.0).map(|t| t - (3.0 + 0.020_13 * 1400.0));
        assert!(error.is_some_and(|e| e.abs() < 3e-3), "{error:?}");
    }

    #[test]
    fn a_wrong_unit_is_not_taken_for_drift() {
        let mut line = DelayLine::new(Some(1.0));
        for i in 0..1000 {
            line.add(0.04 * f64::from(i), 0.02 * f64::from(i));
        }
        assert_eq!(line.gain(), Some(1.0));
    }
}
