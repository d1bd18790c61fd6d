//! Times of readings on this computer's clock, and the number missing between two. From the board's clock where it sends one
//! (`t_us`, `ms`), else from its sequence numbers, else from counted lines: each is a count of equal steps, which a
//! [`DelayLine`] maps onto the times of arrival, so that readings that arrive in a bunch are spread out again.

use super::counters::{DeviceTime, Sequence, Step};
use super::delay_line::DelayLine;
use palpate_tactile::board::TimeSource;
use std::collections::VecDeque;

/// Counters of one line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Counters {
    /// The board's time, and its unit (s).
    pub(super) time: Option<(f64, f64)>,
    /// Its sequence number.
    pub(super) seq: Option<f64>,
    /// Unreadable lines since the last good one.
    pub(super) unreadable: u64,
}

/// Time stamp of one line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stamp {
    /// Time of the reading (s).
    pub(super) t_s: f64,
    /// Its unwrapped number.
    pub(super) seq: Option<u64>,
    /// The board restarted.
    pub(super) restarted: bool,
    /// Readings missing before this one; none where unknown.
    pub(super) missing: Option<u64>,
    /// Time since the reading before (s): by the board's clock, else by arrival. None after a restart or an unknown loss.
    pub(super) step_s: Option<f64>,
}

/// A mapped time this far in the future shows that the board's clock restarted (s).
const FUTURE_S: f64 = 1.0;
/// Without any counter, a silence this long is a gap (s); a shorter one may be a busy host.
const SILENCE_S: f64 = 0.3;
/// Without any counter: lines later than this share of the period, for [`LATE_FOR_S`], follow a loss.
const LATE_SHARE: f64 = 0.6;
/// How long lines must be late before one counts as lost (s).
const LATE_FOR_S: f64 = 1.0;
/// Factor, and number of steps, by which a sequence number may run ahead of the time.
const AHEAD: f64 = 2.0;
/// Least step between two readings (s).
const LEAST_STEP_S: f64 = 1e-6;

/// Clock of one stream.
#[derive(Clone, Debug)]
pub(super) struct StreamClock {
    source: TimeSource,
    time: Option<DeviceTime>,
    sequence: Sequence,
    line: DelayLine,
    period: Period,
    last: Option<Last>,
    /// Lines counted, for [`TimeSource::Arrival`].
    counted: f64,
    /// Since when every line was late, and by how little at least (s).
    late: Option<(f64, f64)>,
    /// The connection was lost since the last reading.
    broken: bool,
    /// The counters of the previous line contradicted each other.
    doubted: bool,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    t_s: f64,
    arrived_s: f64,
    x: f64,
}

impl Default for StreamClock {
    fn default() -> Self {
        Self {
            source: TimeSource::Arrival,
            time: None,
            sequence: Sequence::default(),
            line: DelayLine::new(None),
            period: Period::default(),
            last: None,
            counted: 0.0,
            late: None,
            broken: false,
            doubted: false,
        }
    }
}

impl StreamClock {
    /// Source of the times.
    pub(super) fn source(&self) -> TimeSource {
        self.source
    }

    /// Drift of the board's clock against this computer's, as a ratio less one; none without timestamps.
    pub(super) fn drift(&self) -> Option<f64> {
        let gain = self.line.gain().filter(|_| self.source == TimeSource::Device)?;
        Some(1.0 / gain - 1.0)
    }

    /// Marks an interruption: counted lines do not show what was lost meanwhile.
    pub(super) fn interrupt(&mut self) {
        self.broken = true;
    }

    /// Stamps the next reading; none where its counters contradict each other: one has lost a digit.
    pub(super) fn stamp(&mut self, counters: &Counters, arrived_s: f64) -> Option<Stamp> {
        let source = match counters {
            Counters { time: Some(_), .. } => TimeSource::Device,
            Counters { seq: Some(_), .. } => TimeSource::Sequence,
            _ => TimeSource::Arrival,
        };
        if source != self.source {
            self.restart(source);
        }
        let before = (self.sequence, self.time);
        let step = counters.seq.map(|seq| self.sequence.step(seq));
        let mut x = self.count(counters, arrived_s);
        let elsewhere = source == TimeSource::Device && self.is_elsewhere(x, arrived_s);
        if self.is_contradiction(step, elsewhere, x) && !std::mem::replace(&mut self.doubted, true) {
            (self.sequence, self.time) = before;
            return None;
        }
        self.doubted = false;
        let restarted = elsewhere || step == Some(Step::Restarted);
        if restarted {
            self.restart(source);
            x = self.count(counters, arrived_s);
        }
        let broken = std::mem::take(&mut self.broken) && source == TimeSource::Arrival;
        let missing = if restarted || broken { None } else { self.missing(counters, step, x, arrived_s) };
        if source == TimeSource::Arrival && missing.is_none() {
            // The count is meaningless after an unknown loss.
            self.line = DelayLine::new(None);
        }
        self.line.add(x, arrived_s);
        let t_s = self.place(x, arrived_s);
        if let Some(last) = self.last.filter(|_| !restarted && missing == Some(0)) {
            let x_step = x - last.x;
            self.period.add(match source {
                TimeSource::Device => x_step,
                TimeSource::Sequence | TimeSource::Arrival => self.line.gain().unwrap_or(arrived_s - last.arrived_s),
            });
        }
        let step_s = self.last.filter(|_| missing.is_some()).map(|last| match source {
            TimeSource::Device => (x - last.x) * self.line.gain().unwrap_or(1.0),
            TimeSource::Sequence | TimeSource::Arrival => arrived_s - last.arrived_s,
        });
        self.last = Some(Last { t_s, arrived_s, x });
        let seq = counters.seq.map(|_| self.sequence.running());
        Some(Stamp { t_s, seq, restarted, missing, step_s })
    }

    fn restart(&mut self, source: TimeSource) {
        self.source = source;
        self.time = None;
        self.line = DelayLine::new((source == TimeSource::Device).then_some(1.0));
        self.late = None;
    }

    /// Count of equal steps at a line.
    fn count(&mut self, counters: &Counters, arrived_s: f64) -> f64 {
        match (self.source, counters.time) {
            (TimeSource::Device, Some((count, unit_s))) => {
                self.time.get_or_insert_with(|| DeviceTime::new(unit_s)).run_on(count)
            }
            (TimeSource::Sequence, _) => self.sequence.running() as f64,
            _ => {
                self.counted += 1.0 + counters.unreadable as f64;
                self.counted += self.slipped(arrived_s);
                self.counted
            }
        }
    }

    /// Error of the count of lines: lines that come late and stay late follow a loss; an early line shows that too many were
    /// counted as lost.
    fn slipped(&mut self, arrived_s: f64) -> f64 {
        let (Some(due), Some(period)) = (self.line.at(self.counted), self.line.gain()) else { return 0.0 };
        let delay = arrived_s - due;
        if delay.abs() < LATE_SHARE * period {
            self.late = None;
            return 0.0;
        }
        if delay < 0.0 {
            self.late = None;
            return (delay / period).round();
        }
        let (since, least) = self.late.unwrap_or((arrived_s, delay));
        let least = least.min(delay);
        if arrived_s - since < LATE_FOR_S {
            self.late = Some((since, least));
            return 0.0;
        }
        self.late = None;
        (least / period).round()
    }

    /// True where the board's clock shows an impossible time: it restarted.
    fn is_elsewhere(&self, x: f64, arrived_s: f64) -> bool {
        let backwards = self.last.is_some_and(|last| x < last.x);
        self.time.is_some() && (backwards || self.line.at(x).is_some_and(|t| t > arrived_s + FUTURE_S))
    }

    /// True where the board's number and time disagree: only one of them restarted, or the number ran far ahead.
    fn is_contradiction(&self, step: Option<Step>, elsewhere: bool, x: f64) -> bool {
        match (step, self.source, self.last, self.period.median()) {
            (Some(Step::Restarted), TimeSource::Device, Some(_), _) => !elsewhere,
            (Some(Step::On(_)), TimeSource::Device, Some(_), _) if elsewhere => true,
            (Some(Step::On(step)), TimeSource::Device, Some(last), Some(period)) => {
                step as f64 > AHEAD * (x - last.x) / period + AHEAD
            }
            _ => false,
        }
    }

    fn missing(&self, counters: &Counters, step: Option<Step>, x: f64, arrived_s: f64) -> Option<u64> {
        let Some(last) = self.last else { return Some(0) };
        match (step, self.source, self.period.median()) {
            (Some(Step::On(step)), ..) => Some(step.saturating_sub(1)),
            (_, TimeSource::Device, Some(period)) => Some((((x - last.x) / period).round() as u64).saturating_sub(1)),
            (_, TimeSource::Device, None) => Some(counters.unreadable),
            (_, _, period) => {
                let silence = SILENCE_S.max(5.0 * period.unwrap_or(0.0));
                (arrived_s - last.arrived_s <= silence).then_some(counters.unreadable)
            }
        }
    }

    /// Mapped time, never later than the arrival nor earlier than the reading before.
    fn place(&self, x: f64, arrived_s: f64) -> f64 {
        let mapped = self.line.at(x).map_or(arrived_s, |t| t.min(arrived_s));
        self.last.map_or(mapped, |last| mapped.max(last.t_s + LEAST_STEP_S))
    }
}

/// Median time between readings, which lost readings do not move.
#[derive(Clone, Debug, Default)]
struct Period {
    newest: VecDeque<f64>,
}

impl Period {
    const REMEMBERED: usize = 31;
    /// Least number for a median.
    const NEEDED: usize = 5;

    fn add(&mut self, step_s: f64) {
        if self.newest.len() == Self::REMEMBERED {
            self.newest.pop_front();
        }
        self.newest.push_back(step_s);
    }

    fn median(&self) -> Option<f64> {
        if self.newest.len() < Self::NEEDED {
            return None;
        }
        let mut sorted: Vec<f64> = self.newest.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().filter(|period| *period > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(clock: &mut StreamClock, counters: &Counters, arrived_s: f64) -> Stamp {
        clock.stamp(counters, arrived_s).expect("no contradiction")
    }

    fn at(us: f64, seq: f64) -> Counters {
        Counters { time: Some((us, 1e-6)), seq: Some(seq), unreadable: 0 }
    }

    #[test]
    fn microseconds_wrap_without_a_trace() {
        let mut clock = StreamClock::default();
        let start = 4_294_967_296.0 - 1e6;
        for i in 0..200u32 {
            let us = (start + 20_000.0 * f64::from(i)) % 4_294_967_296.0;
            let stamp = stamp(&mut clock, &at(us, f64::from(i)), 7.0 + 0.02 * f64::from(i));
            assert!(!stamp.restarted && stamp.missing == Some(0), "{i}: {stamp:?}");
            assert!((stamp.t_s - 7.0 - 0.02 * f64::from(i)).abs() < 1e-6, "{i}: {stamp:?}");
        }
    }

    #[test]
    fn a_restarted_board_is_noticed_by_its_clock_alone() {
        let mut clock = StreamClock::default();
        for i in 0..500u32 {
            let us = if i < 300 { 3e9 + 20_000.0 * f64::from(i) } else { 800_000.0 + 20_000.0 * f64::from(i - 300) };
            let counters = Counters { time: Some((us, 1e-6)), ..Counters::default() };
            let stamp = stamp(&mut clock, &counters, 0.02 * f64::from(i));
            assert_eq!(stamp.restarted, i == 300, "{i}: {stamp:?}");
        }
    }

    #[test]
    fn lost_readings_are_counted_by_number_or_by_time() {
        for with_seq in [true, false] {
            let mut clock = StreamClock::default();
            let mut missing = 0;
            for i in (0..1000u32).filter(|i| ![100, 200, 201, 202, 700].contains(i)) {
                let mut counters = at(20_000.0 * f64::from(i), f64::from(i));
                counters.seq = counters.seq.filter(|_| with_seq);
                missing += stamp(&mut clock, &counters, 0.02 * f64::from(i) + 0.001).missing.unwrap_or(99);
            }
            assert_eq!(missing, 5);
        }
    }

    #[test]
    fn bunched_lines_without_any_counter_were_not_taken_in_a_bunch() {
        let mut clock = StreamClock::default();
        let mut worst: f64 = 0.0;
        for i in 0..2000u32 {
            let happened = 0.02 * f64::from(i);
            let arrived = happened + 0.02 * f64::from(3 - i % 4);
            let stamp = stamp(&mut clock, &Counters::default(), arrived);
            assert_eq!(stamp.missing, Some(0));
            if i > 200 {
                worst = worst.max((stamp.t_s - happened).abs());
            }
        }
        assert!(worst < 2e-3, "{worst}");
    }

    #[test]
    fn lines_lost_without_any_counter_shift_the_count_within_two_seconds() {
        let mut clock = StreamClock::default();
        let mut last_error = f64::NAN;
        for i in (0..1000u32).filter(|i| !(300..305).contains(i)) {
            let arrived = 0.02 * f64::from(i);
            last_error = stamp(&mut clock, &Counters::default(), arrived).t_s - arrived;
            if i == 420 {
                assert!(last_error.abs() < 1e-3, "{last_error}");
            }
        }
        assert!(last_error.abs() < 1e-3, "{last_error}");
    }

    #[test]
    fn a_long_silence_without_any_counter_is_a_gap_of_unknown_size() {
        let mut clock = StreamClock::default();
        let missing: Vec<Option<u64>> = (0..300u32)
            .map(|i| 0.02 * f64::from(i) + if i < 150 { 0.0 } else { 2.0 })
            .map(|arrived_s| stamp(&mut clock, &Counters::default(), arrived_s).missing)
            .collect();
        assert_eq!(missing.iter().filter(|m| m.is_none()).count(), 1);
        assert_eq!(missing[150], None);
    }

    #[test]
    fn a_counter_that_lost_a_digit_costs_its_line_and_nothing_else() {
        let mut clock = StreamClock::default();
        let (mut refused, mut missing) = (Vec::new(), 0);
        for i in 0..400u32 {
            let (mut us, mut seq) = (1e6 + 20_000.0 * f64::from(i), f64::from(i));
            match i {
                100 => us /= 10.0,
                200 => us *= 10.0,
                250 => seq = 2.0,
                300 => seq *= 10.0,
                _ => {}
            }
            match clock.stamp(&at(us, seq), 0.02 * f64::from(i)) {
                None => refused.push(i),
                Some(stamp) => {
                    assert!(!stamp.restarted && (stamp.t_s - 0.02 * f64::from(i)).abs() < 1e-3, "{i}: {stamp:?}");
                    missing += stamp.missing.unwrap_or(99);
                }
            }
        }
        assert_eq!((refused, missing), (vec![100, 200, 250, 300], 4));
    }
}
