//! Unwrapped counters of a board: its time and its sequence numbers.

/// Unwrapped clock of the board; a `u32` of microseconds wraps after 71.6 minutes.
#[derive(Clone, Copy, Debug)]
pub(super) struct DeviceTime {
    /// Seconds per count.
    unit_s: f64,
    last: u64,
    /// What the wraps so far add up to.
    carried: u64,
}

/// Where a `u32` is full.
const FULL: u64 = 1 << 32;

impl DeviceTime {
    pub(super) fn new(unit_s: f64) -> Self {
        Self { unit_s, last: 0, carried: 0 }
    }

    /// The board's time since it was at zero (s).
    pub(super) fn run_on(&mut self, count: f64) -> f64 {
        // Milliseconds may have a fraction that matters.
        let whole = count.max(0.0) as u64;
        // Wider counters do not wrap within a day's work; a narrow one that falls back has wrapped.
        if whole < self.last && self.last < FULL && self.carried < u64::MAX / 2 {
            self.carried += FULL;
        }
        self.last = whole;
        ((whole + self.carried) as f64 + count.fract()) * self.unit_s
    }
}

/// Unwrapped sequence numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sequence {
    last: Option<u64>,
    /// The largest seen: a counter that has passed 255 is no `u8`.
    largest: u64,
    running: u64,
}

/// Step of a sequence number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Forward by this many: 1 without a loss.
    On(u64),
    /// Back to the beginning: the board restarted.
    Restarted,
}

impl Sequence {
    /// Takes in the next number.
    pub(super) fn step(&mut self, count: f64) -> Step {
        let next = count.max(0.0) as u64;
        let last = self.last.replace(next);
        self.largest = self.largest.max(next);
        let step = match last {
            None => {
                self.running = next;
                return Step::On(1);
            }
            Some(last) if next >= last => Some(next - last),
            Some(last) => self.wrapped(last, next),
        };
        match step {
            Some(step) => {
                self.running = self.running.saturating_add(step);
                Step::On(step)
            }
            None => {
                self.running = self.running.saturating_add(1);
                self.largest = next;
                Step::Restarted
            }
        }
    }

    /// The number of the newest, run on over wraps and restarts.
    pub(super) fn running(&self) -> u64 {
        self.running
    }

    /// How far on it is over a wrap of 8, 16 or 32 bits, where it was nearly full and is nearly empty.
    fn wrapped(&self, last: u64, next: u64) -> Option<u64> {
        [8, 16, 32].into_iter().map(|bits| 1u64 << bits).find_map(|full| {
            let fits = self.largest < full && last >= full - full / 16 && next < full / 16;
            fits.then(|| next + full - last)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn microseconds_run_on_over_their_wrap() {
        let mut time = DeviceTime::new(1e-6);
        let before = time.run_on(4_294_960_000.0);
        let after = time.run_on(12_704.0);
        assert!((after - before - 0.02).abs() < 1e-9, "{before} {after}");
        let mut ms = DeviceTime::new(1e-3);
        assert!((ms.run_on(20.5) - 0.0205).abs() < 1e-12);
    }

    #[test]
    fn sequence_numbers_run_on_over_their_wrap_and_restarts_are_told() {
        let mut sequence = Sequence::default();
        let steps: Vec<Step> = [65_534.0, 65_535.0, 2.0, 3.0, 0.0, 1.0].map(|count| sequence.step(count)).into();
        assert_eq!(steps, [Step::On(1), Step::On(1), Step::On(3), Step::On(1), Step::Restarted, Step::On(1)]);
        assert_eq!(sequence.running(), 65_534 + 7);
        let mut wide = Sequence::default();
        assert_eq!(wide.step(4_294_967_295.0), Step::On(1));
        assert_eq!(wide.step(0.0), Step::On(1));
        let mut narrow = Sequence::default();
        assert_eq!(narrow.step(255.0), Step::On(1));
        assert_eq!(narrow.step(0.0), Step::On(1));
    }
}
