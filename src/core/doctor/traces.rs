//! What each channel did while it was listened to: its range, and how much it goes with the one that is read before it.

use crate::board::Reading;

/// Sums over one channel and the one before it.
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
    /// Sums of x, y, x², y², x y over readings in which both have a number; x is the channel before.
    sums: [f64; 5],
    pairs: u64,
}

impl Default for Trace {
    fn default() -> Self {
        let (least, most) = (f64::INFINITY, f64::NEG_INFINITY);
        Self { numbers: 0, without: 0, least, most, sums: [0.0; 5], pairs: 0 }
    }
}

impl Trace {
    fn add(&mut self, count: Option<f32>, before: Option<f32>) {
        let Some(y) = count.map(f64::from) else {
            self.without += 1;
            return;
        };
        self.numbers += 1;
        (self.least, self.most) = (self.least.min(y), self.most.max(y));
        if let Some(x) = before.map(f64::from) {
            self.pairs += 1;
            for (sum, term) in self.sums.iter_mut().zip([x, y, x * x, y * y, x * y]) {
                *sum += term;
            }
        }
    }

    /// Counts that it takes for each count of the channel before it, and the correlation of the two; none where one of them
    /// does not move.
    pub fn following(&self) -> Option<(f64, f64)> {
        let n = self.pairs as f64;
        let [x, y, xx, yy, xy] = self.sums.map(|sum| sum / n.max(1.0));
        let (variance_x, variance_y) = (xx - x * x, yy - y * y);
        let moves = self.pairs > 10 && variance_x.min(variance_y) > 1.0;
        moves.then(|| ((xy - x * y) / variance_x, (xy - x * y) / (variance_x * variance_y).sqrt()))
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
            trace.add(reading.counts[channel], before);
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
        let told = traces((0..100_u8).map(|k| [Some(f32::from(k)), Some(7.0 + 0.2 * f32::from(k)), Some(50.0)]));
        let (slope, correlation) = told.channels[1].following().expect("both move");
        assert!((slope - 0.2).abs() < 1e-4 && (correlation - 1.0).abs() < 1e-4);
        assert_eq!((told.channels[0].following(), told.channels[2].following()), (None, None));
        assert_eq!((told.channels[0].least, told.channels[0].most), (0.0, 99.0));
    }

    #[test]
    fn readings_without_a_number_are_counted_and_no_more() {
        let told = traces((0..4_u8).map(|k| [Some(1.0), (k > 0).then_some(2.0), None]));
        assert_eq!((told.channels[1].numbers, told.channels[1].without), (3, 1));
        assert_eq!((told.channels[2].numbers, told.channels[2].without), (0, 4));
    }
}
