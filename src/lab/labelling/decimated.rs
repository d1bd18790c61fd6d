//! A trial in bounded memory. Readings are kept until there are [`MOST`] of them; then every other one is let go, and from
//! then on only every second one is taken, and so on: a grasp of some seconds is kept whole at any rate, one of an hour
//! in steps of half a second or less.

use palpate_sim::gripper::Side;
use palpate_store::labels::{SPARKLINE_BINS, Sparkline};
use palpate_tactile::board::{Board, Reading, Sensor};

/// Readings that are kept, at most.
const MOST: usize = 8192;

/// Readings of a trial, fewer of them the longer it is.
#[derive(Clone, Debug, Default)]
pub struct Decimated {
    readings: Vec<Reading>,
    /// Every how many-th reading is taken, as a power of two.
    halvings: u32,
    heard: u64,
}

impl Decimated {
    /// Takes the next reading, if it is one of those to be kept.
    pub fn push(&mut self, reading: &Reading) {
        let taken = self.heard.is_multiple_of(1 << self.halvings.min(63));
        self.heard += 1;
        if !taken {
            return;
        }
        if self.readings.len() == MOST {
            let mut even = false;
            self.readings.retain(|_| {
                even = !even;
                even
            });
            self.halvings += 1;
        }
        self.readings.push(reading.clone());
    }

    /// What is kept, in order.
    pub fn readings(&self) -> &[Reading] {
        &self.readings
    }
}

/// The small picture of a trial.
pub fn sparkline(board: &Board, readings: &[Reading]) -> Sparkline {
    Side::BOTH.map(|side| {
        let sensors = match side {
            Side::Left => [Sensor::PadLeft, Sensor::FlexLeft],
            Side::Right => [Sensor::PadRight, Sensor::FlexRight],
        };
        match sensors.into_iter().find_map(|sensor| board.channel_of(sensor)) {
            Some(column) => bins(readings, column),
            None => Vec::new(),
        }
    })
}

fn bins(readings: &[Reading], column: usize) -> Vec<Option<f32>> {
    let (Some(first), Some(last)) = (readings.first(), readings.last()) else { return Vec::new() };
    let span = last.t_s - first.t_s;
    let mut sums = [(0.0f64, 0u32); SPARKLINE_BINS];
    for reading in readings {
        let share = if span > 0.0 { (reading.t_s - first.t_s) / span } else { 0.0 };
        let bin = ((share * SPARKLINE_BINS as f64) as usize).min(SPARKLINE_BINS - 1);
        if let Some(count) = reading.counts.get(column).copied().flatten() {
            sums[bin].0 += f64::from(count);
            sums[bin].1 += 1;
        }
    }
    // Tenths of a count are more than a picture of a few pixels shows.
    let mean = |(sum, n): (f64, u32)| (n > 0).then(|| ((10.0 * sum / f64::from(n)).round() / 10.0) as f32);
    sums.into_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(t_s: f64, pad: f32) -> Reading {
        let counts = vec![Some(1400.0), None, Some(pad), None];
        Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None }
    }

    #[test]
    fn memory_is_bounded_and_what_is_kept_is_evenly_spread() {
        let mut decimated = Decimated::default();
        let mut at_step = |to: u64| {
            for k in decimated.heard..to {
                decimated.push(&reading(k as f64, 0.0));
            }
            let times: Vec<f64> = decimated.readings().iter().map(|reading| reading.t_s).collect();
            (times.len(), times.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>())
        };
        assert!(at_step(MOST as u64).1.iter().all(|step| *step == 1.0), "a grasp is kept whole");
        let (kept, steps) = at_step(100_000);
        assert!(kept <= MOST && kept > MOST / 2, "{kept}");
        assert!(steps.iter().all(|step| *step == 16.0), "{steps:?}");
    }

    #[test]
    fn a_small_picture_holds_means_and_keeps_gaps() {
        // A second at 480 Hz: ten readings to a bin; nothing in the second half but its last reading.
        let readings: Vec<Reading> = (0..=480)
            .filter(|k| *k < 240 || *k == 480)
            .map(|k| reading(f64::from(k) / 480.0, (k / 10) as f32))
            .collect();
        let [left, right] = sparkline(&Board::default(), &readings);
        assert_eq!((left.len(), right.iter().flatten().count()), (SPARKLINE_BINS, 0));
        for (k, value) in left.iter().enumerate() {
            let want = if k < 24 { Some(k as f32) } else { None };
            assert_eq!(*value, if k == 47 { Some(48.0) } else { want }, "bin {k}");
        }
        let strips = Board { channels: vec!["flexL".to_owned()], ..Board::default() };
        assert_eq!(sparkline(&strips, &readings)[0][0], Some(1400.0));
        assert_eq!(sparkline(&strips, &[]), [Vec::new(), Vec::new()]);
    }
}
