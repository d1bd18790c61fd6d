//! Small pictures of trials, and long trials decimated to a bounded number of readings.

use palpate_sim::gripper::Side;
use palpate_store::labels::{SPARKLINE_BINS, Sparkline};
use palpate_tactile::board::{Board, Reading, Sensor};

/// Readings that flags and pictures are made from, at most.
const MOST: usize = 8192;

/// Every reading of a short trial; of a longer one every second, fourth, .. so that at most `MOST` are left.
pub fn decimated(readings: &[Reading]) -> Vec<Reading> {
    let mut step = 1;
    while readings.len().div_ceil(step) > MOST {
        step *= 2;
    }
    readings.iter().step_by(step).cloned().collect()
}

/// Sparkline of a trial: the mean count of each finger in each bin of its time.
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
    fn short_trials_stay_whole_and_long_ones_are_decimated_evenly() {
        let readings: Vec<Reading> = (0..100_000).map(|k| reading(f64::from(k), 0.0)).collect();
        assert_eq!(decimated(&readings[..MOST]).len(), MOST);
        let kept = decimated(&readings);
        assert!(kept.len() <= MOST && kept.len() > MOST / 2, "{}", kept.len());
        assert!(kept.windows(2).all(|pair| pair[1].t_s - pair[0].t_s == 16.0));
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
