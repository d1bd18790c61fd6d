//! Range of each channel, and how much it follows the channel that is converted before it.

use palpate_tactile::board::Reading;

/// Change within [`WITHIN_S`] that counts as movement (counts): far more than noise, a few degrees of bend.
const MOVES: f64 = 40.0;

/// Duration of a change (s): a hand takes several times as long to bend a finger.
const WITHIN_S: f64 = 0.2;

/// Changes that are remembered.
const MOST_CHANGES: usize = 1000;

/// Range of one channel, and its correlation with the one before it.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelTrace {
    /// Readings with a number.
    pub numbers: u64,
    /// Readings without one.
    pub without: u64,
    /// Least count.
    pub least: f64,
    /// Largest count.
    pub most: f64,
    /// Least count over the count of the channel before it at that time.
    least_share: f64,
    /// Time (s), count of the channel before, and own count, from which changes are counted.
    from: Option<[f64; 3]>,
    /// Own change over that of the channel before, wherever that one moves.
    slopes: Vec<f64>,
}

impl Default for ChannelTrace {
    fn default() -> Self {
        let (least, most) = (f64::INFINITY, f64::NEG_INFINITY);
        Self { numbers: 0, without: 0, least, most, least_share: 0.0, from: None, slopes: Vec::new() }
    }
}

impl ChannelTrace {
    fn add(&mut self, t: f64, count: Option<f32>, before: Option<f32>) {
        let Some(y) = count.map(f64::from) else {
            self.without += 1;
            self.from = None;
            return;
        };
        self.numbers += 1;
        self.most = self.most.max(y);
        let is_least = y < self.least;
        self.least = self.least.min(y);
        let Some(x) = before.map(f64::from) else { return };
        if is_least {
            self.least_share = y / x;
        }
        let [since, from_x, from_y] = *self.from.get_or_insert([t, x, y]);
        let moved = (x - from_x).abs() > MOVES;
        if moved && self.slopes.len() < MOST_CHANGES {
            self.slopes.push((y - from_y) / (x - from_x));
        }
        if moved || t - since >= WITHIN_S {
            self.from = Some([t, x, y]);
        }
    }

    /// Share of the channel before that it follows, if it does: at its least it reads that share, and at times, when the
    /// other moves and nothing else happens, it moves by about that share. A pad that is pressed all the time reads one too,
    /// but does not move with it; one that is pressed by a closing finger moves far more.
    pub fn takes(&self) -> Option<f64> {
        let share = self.least_share;
        let like = |slope: &&f64| (**slope - share).abs() < 0.5 * share;
        let alike = self.slopes.iter().filter(like).count();
        let often = alike >= FEWEST && alike * 10 >= self.slopes.len();
        (often && share.is_finite()).then_some(share)
    }
}

/// Changes that must be alike.
const FEWEST: usize = 4;

/// All channels, in the order in which the board reads them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelTraces {
    /// One for each.
    pub channels: Vec<ChannelTrace>,
}

impl ChannelTraces {
    /// Takes in a reading.
    pub fn add(&mut self, reading: &Reading) {
        let width = reading.counts.len();
        self.channels.resize(self.channels.len().max(width), ChannelTrace::default());
        for (channel, trace) in self.channels.iter_mut().enumerate().take(width) {
            let before = channel.checked_sub(1).and_then(|before| reading.counts[before]);
            trace.add(reading.t_s, reading.counts[channel], before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn traces(rows: impl Iterator<Item = [Option<f32>; 3]>) -> ChannelTraces {
        let mut traces = ChannelTraces::default();
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
        let bent = |k: u8| 1000.0 + 7.0 * f32::from(k.min(99));
        let found = traces((0..200_u8).map(|k| [Some(bent(k)), Some(0.2 * bent(k) + press(k)), Some(50.0)]));
        let share = found.channels[1].takes().expect("it does");
        assert!((share - 0.2).abs() < 1e-4);
        assert_eq!((found.channels[0].takes(), found.channels[2].takes()), (None, None));
        assert_eq!((found.channels[0].least, found.channels[0].most), (1000.0, 1693.0));
    }

    #[test]
    fn a_channel_that_is_held_or_goes_its_own_way_takes_nothing() {
        let bent = |k: u8| 1000.0 + 7.0 * f32::from(k);
        let found = traces((0..100_u8).map(|k| [Some(bent(k)), Some(300.0), Some(300.0 + 10.0 * f32::from(k))]));
        assert_eq!((found.channels[1].takes(), found.channels[2].takes()), (None, None));
        let closing = traces((0..100_u8).map(|k| [Some(bent(k)), Some(200.0 + 2.0 * bent(k)), None]));
        assert_eq!(closing.channels[1].takes(), Some(2.2), "what no multiplexer does is left to the check");
    }

    #[test]
    fn readings_without_a_number_are_counted_and_no_more() {
        let found = traces((0..4_u8).map(|k| [Some(1.0), (k > 0).then_some(2.0), None]));
        assert_eq!((found.channels[1].numbers, found.channels[1].without), (3, 1));
        assert_eq!((found.channels[2].numbers, found.channels[2].without), (0, 4));
    }
}
