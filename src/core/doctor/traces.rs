//! What each channel did while it was listened to: its range, and how much it changes with the one that is read before it.

use crate::board::Reading;

/// A channel that changes by more than this within [`WITHIN_S`] moves (counts): some seven times the noise of our firmware's.
const MOVES: f64 = 5.0;

/// Changes are looked at over this time (s): a sample at 50 Hz.
const WITHIN_S: f64 = 0.02;

/// One channel and how it changes with the one before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// Readings with a number.
    pub numbers: u64,
    /// Readings without one.
    pub without: u64,
    /// Least count.
    pub least: f64,
    /// Largest count.
    pub most: f64,
    /// Time (s), count of the channel before, and own count, from which changes are counted.
    from: Option<[f64; 3]>,
    /// Sums of dx², dy², dx dy over changes, where dx of the channel before is a move; and how many there were.
    changes: [f64; 3],
    moves: u64,
}

impl Default for Trace {
    fn default() -> Self {
        let (least, most) = (f64::INFINITY, f64::NEG_INFINITY);
        Self { numbers: 0, without: 0, least, most, from: None, changes: [0.0; 3], moves: 0 }
    }
}

impl Trace {
    fn add(&mut self, t: f64, count: Option<f32>, before: Option<f32>) {
        let Some(y) = count.map(f64::from) else {
            self.without += 1;
            self.from = None;
            return;
        };
        self.numbers += 1;
        (self.least, self.most) = (self.least.min(y), self.most.max(y));
        let Some(x) = before.map(f64::from) else { return };
        let [since, from_x, from_y] = *self.from.get_or_insert([t, x, y]);
        let (dx, dy) = (x - from_x, y - from_y);
        if dx.abs() > MOVES {
            self.moves += 1;
            for (sum, term) in self.changes.iter_mut().zip([dx * dx, dy * dy, dx * dy]) {
                *sum += term;
            }
        }
        if dx.abs() > MOVES || t - since >= WITHIN_S {
            self.from = Some([t, x, y]);
        }
    }

    /// Counts by which it changes for each count by which the channel before it does, and the correlation of these changes;
    /// none where one of the two does not move.
    pub fn following(&self) -> Option<(f64, f64)> {
        let [xx, yy, xy] = self.changes;
        (self.moves >= 5 && yy > 0.0).then(|| (xy / xx, xy / (xx * yy).sqrt()))
    }
}

/// All channels, in the order in which the board reads them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traces {
    /// One for each.
    pub channels: Vec<Trace>,
}

impl Traces {
    /// Takes in a reading.
    pub fn add(&mut self, reading: &Reading) {
        let width = reading.counts.len();
        self.channels.resize(self.channels.len().max(width), Trace::default());
        for (channel, trace) in self.channels.iter_mut().enumerate().take(width) {
            let before = channel.checked_sub(1).and_then(|before| reading.counts[before]);
            trace.add(reading.t_s, reading.counts[channel], before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn traces(rows: impl Iterator<Item = [Option<f32>; 3]>) -> Traces {
        let mut traces = Traces::default();
        for counts in rows {
            let reading = Reading { t_s: 0.0, arrived_s: 0.0, seq: None, counts: counts.to_vec(), line_bar: None };
            traces.add(&reading);
        }
        traces
    }

    #[test]
    fn a_channel_that_takes_a_fifth_of_the_one_before_is_seen_to() {
        // Pressed meanwhile, while the one before it rests: that is not its doing.
        let press = |k: u8| if (100..150).contains(&k) { 500.0 } else { 0.0 };
        let bent = |k: u8| 7.0 * f32::from(k.min(99));
        let told = traces((0..200_u8).map(|k| [Some(bent(k)), Some(7.0 + 0.2 * bent(k) + press(k)), Some(50.0)]));
        let (slope, correlation) = told.channels[1].following().expect("both move");
        assert!((slope - 0.2).abs() < 1e-4 && (correlation - 1.0).abs() < 1e-4);
        assert_eq!((told.channels[0].following(), told.channels[2].following()), (None, None));
        assert_eq!((told.channels[0].least, told.channels[0].most), (0.0, 693.0));
    }

    #[test]
    fn readings_without_a_number_are_counted_and_no_more() {
        let told = traces((0..4_u8).map(|k| [Some(1.0), (k > 0).then_some(2.0), None]));
        assert_eq!((told.channels[1].numbers, told.channels[1].without), (3, 1));
        assert_eq!((told.channels[2].numbers, told.channels[2].without), (0, 4));
    }
}
