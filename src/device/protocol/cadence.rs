//! Rate, jitter, losses and unreadable lines of a stream over the last seconds, in bounded memory.

use super::clock::Stamp;
use palpate_tactile::cadence::Cadence;
use std::collections::VecDeque;

/// Steps between readings that are remembered: twenty seconds at 50 Hz, one at 1 kHz.
const STEPS: usize = 1024;
/// The rate is measured over this long (s), or over the steps that are remembered where those are fewer.
const RATE_SPAN_S: f64 = 5.0;
/// A second in bins of a tenth.
const BINS: usize = 10;
const BIN_S: f64 = 0.1;
/// More unreadable lines than this share, over a whole second, are worth a banner.
const BAD_SHARE: f64 = 0.2;
/// Fewer lines in a second say nothing about shares.
const LINES_NEEDED: u64 = 5;

/// Statistics of a stream.
#[derive(Clone, Debug, Default)]
pub(super) struct Meter {
    samples: u64,
    lost: u64,
    bad_lines: u64,
    gaps: u64,
    restarts: u64,
    bytes: u64,
    steps: VecDeque<Step>,
    bins: VecDeque<Bin>,
    troubled: bool,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    /// Time since the reading before (s), where it is known.
    step_s: Option<f64>,
    /// No reading is missing in between.
    whole: bool,
    delay_s: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    number: u64,
    good: u64,
    bad: u64,
    bytes: u64,
    printable: u64,
}

impl Meter {
    /// A reading that arrived at `arrived_s` (s).
    pub(super) fn reading(&mut self, stamp: &Stamp, arrived_s: f64) {
        self.samples += 1;
        if self.steps.len() == STEPS {
            self.steps.pop_front();
        }
        let whole = stamp.missing == Some(0);
        self.steps.push_back(Step { step_s: stamp.step_s, whole, delay_s: arrived_s - stamp.t_s });
        self.bin(arrived_s).good += 1;
    }

    pub(super) fn readings(&self) -> u64 {
        self.samples
    }

    pub(super) fn bad_line(&mut self, arrived_s: f64) {
        self.bad_lines += 1;
        self.bin(arrived_s).bad += 1;
    }

    /// Forgets unreadable lines from before the first reading: they came at another baud rate.
    pub(super) fn forget_start(&mut self) {
        if self.samples == 0 {
            *self = Self { bytes: self.bytes, ..Self::default() };
        }
    }

    pub(super) fn gap(&mut self, lost: Option<u64>) {
        self.gaps += 1;
        self.lost = self.lost.saturating_add(lost.unwrap_or(0));
    }

    pub(super) fn restart(&mut self) {
        self.restarts += 1;
    }

    pub(super) fn bytes(&mut self, bytes: &[u8], arrived_s: f64) {
        let printable = bytes.iter().filter(|b| b.is_ascii_graphic() || b" \t\r\n".contains(b)).count();
        self.bytes += bytes.len() as u64;
        let bin = self.bin(arrived_s);
        bin.bytes += bytes.len() as u64;
        bin.printable += printable as u64;
    }

    /// The bin of this moment; older ones than a second are let go, and the second before is judged.
    fn bin(&mut self, arrived_s: f64) -> &mut Bin {
        let number = (arrived_s.max(0.0) / BIN_S) as u64;
        if self.bins.back().is_none_or(|bin| bin.number < number) {
            self.judge(number);
            self.bins.retain(|bin| bin.number + BINS as u64 > number);
            self.bins.push_back(Bin { number, ..Bin::default() });
        }
        // There is one; a clock that steps back continues in the newest.
        let newest = self.bins.len() - 1;
        &mut self.bins[newest]
    }

    /// Whether the whole second before bin `number` was troubled.
    fn judge(&mut self, number: u64) {
        let whole = self.bins.front().is_some_and(|first| first.number + BINS as u64 <= number);
        let sum = self.sum();
        let enough = sum.good + sum.bad >= LINES_NEEDED;
        let bad = sum.bad as f64 > BAD_SHARE * (sum.good + sum.bad) as f64;
        if whole || !bad {
            self.troubled = enough && bad;
        }
    }

    fn sum(&self) -> Bin {
        self.bins.iter().fold(Bin::default(), |sum, bin| Bin {
            number: bin.number,
            good: sum.good + bin.good,
            bad: sum.bad + bin.bad,
            bytes: sum.bytes + bin.bytes,
            printable: sum.printable + bin.printable,
        })
    }

    /// Everything, as it stands.
    pub(super) fn cadence(&self, drift: Option<f64>) -> Cadence {
        let sum = self.sum();
        let lines = (sum.good + sum.bad).max(1) as f64;
        Cadence {
            samples: self.samples,
            lost: self.lost,
            bad_lines: self.bad_lines,
            gaps: self.gaps,
            restarts: self.restarts,
            bytes: self.bytes,
            rate_hz: self.rate(),
            jitter_p95_ms: self.jitter() * 1e3,
            delay_p95_ms: percentile_95(self.steps.iter().map(|step| step.delay_s).collect()) * 1e3,
            drift_ppm: drift.map(|drift| drift * 1e6),
            bad_share: sum.bad as f64 / lines,
            printable_share: if sum.bytes == 0 { 1.0 } else { sum.printable as f64 / sum.bytes as f64 },
            troubled: self.troubled,
        }
    }

    fn rate(&self) -> f64 {
        let (mut count, mut span) = (0u32, 0.0);
        for step in self.steps.iter().rev().filter_map(|step| step.step_s) {
            if span + step > RATE_SPAN_S {
                break;
            }
            count += 1;
            span += step;
        }
        if span > 0.0 { f64::from(count) / span } else { 0.0 }
    }

    fn jitter(&self) -> f64 {
        let mut steps: Vec<f64> = self.steps.iter().filter(|step| step.whole).filter_map(|step| step.step_s).collect();
        steps.sort_by(f64::total_cmp);
        let Some(usual) = steps.get(steps.len() / 2).copied() else { return 0.0 };
        percentile_95(steps.iter().map(|step| (step - usual).abs()).collect())
    }
}

fn percentile_95(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (0.95 * values.len() as f64) as usize;
    values.get(place.min(values.len().saturating_sub(1))).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(t_s: f64, step_s: Option<f64>, missing: u64) -> Stamp {
        Stamp { t_s, seq: None, restarted: false, missing: Some(missing), step_s }
    }

    #[test]
    fn rate_and_jitter_of_a_known_stream() {
        let mut meter = Meter::default();
        for i in 0..2000u32 {
            // Every tenth reading is 3 ms late: two steps in ten are off by 3 ms.
            let t = |i: u32| 0.02 * f64::from(i) + if i.is_multiple_of(10) { 3e-3 } else { 0.0 };
            let step = (i > 0).then(|| t(i) - t(i - 1));
            meter.reading(&stamp(t(i), step, 0), t(i) + 1e-3);
        }
        let cadence = meter.cadence(Some(2e-4));
        assert!((cadence.rate_hz - 50.0).abs() < 0.1, "{cadence:?}");
        assert!((cadence.jitter_p95_ms - 3.0).abs() < 1e-6, "{cadence:?}");
        assert!((cadence.delay_p95_ms - 1.0).abs() < 1e-6 && cadence.drift_ppm == Some(200.0), "{cadence:?}");
        assert!(meter.steps.len() == STEPS && meter.bins.len() <= BINS + 1);
    }

    #[test]
    fn a_gap_is_neither_jitter_nor_hidden() {
        let mut meter = Meter::default();
        for i in 0..100u32 {
            let t = 0.02 * f64::from(i) + if i < 50 { 0.0 } else { 1.0 };
            let (step, missing) = if i == 50 { (1.02, 50) } else { (0.02, 0) };
            if i == 50 {
                meter.gap(Some(missing));
            }
            meter.reading(&stamp(t, (i > 0).then_some(step), missing), t);
        }
        let cadence = meter.cadence(None);
        assert!(cadence.jitter_p95_ms < 1e-6 && cadence.lost == 50 && cadence.gaps == 1, "{cadence:?}");
        assert!((cadence.rate_hz - 99.0 / 2.98).abs() < 1e-6, "{cadence:?}");
    }

    #[test]
    fn a_banner_wants_a_fifth_of_the_lines_for_a_whole_second() {
        let run = |bad_from: f64, bad_to: f64, until: f64| {
            let mut meter = Meter::default();
            let mut i = 0;
            loop {
                let t = 0.02 * f64::from(i);
                if t > until {
                    return meter.cadence(None).troubled;
                }
                if t >= bad_from && t < bad_to && i % 3 == 0 {
                    meter.bad_line(t);
                } else {
                    meter.reading(&stamp(t, Some(0.02), 0), t);
                }
                i += 1;
            }
        };
        assert!(run(2.0, 9.0, 4.0));
        assert!(!run(2.0, 2.3, 2.5), "a short burst is no reason");
        assert!(!run(2.0, 3.5, 6.0), "and it goes away");
    }
}
