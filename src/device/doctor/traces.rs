//! Range of each channel, whether it is constant while others move, and how much it follows the channel that is
//! converted before it.

use palpate_tactile::board::Reading;

/// Change within [`WITHIN_S`] that counts as movement (counts): far more than noise, a few degrees of bend.
const MOVES: f64 = 40.0;

/// Duration of a change (s): a hand takes several times as long to bend a finger.
const WITHIN_S: f64 = 0.2;

/// Change there and back within two readings that no hand makes (counts).
const SPIKE: f64 = 1200.0;

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
    /// Some counts had decimals.
    pub decimals: bool,
    /// Each count was larger than the one before.
    pub rises: bool,
    /// Single counts that were far from those before and after them.
    pub spikes: u64,
    last: f64,
    jump: f64,
    /// Newest count, and the time (s) since which it is exactly that.
    still: Option<[f64; 2]>,
    /// Count from which movement is measured, and when it last moved (s).
    rested: Option<f64>,
    moved_s: f64,
    /// Least count over the count of the channel before it at that time.
    least_share: f64,
    /// Time (s), count of the channel before, and own count, from which changes are counted.
    from: Option<[f64; 3]>,
    /// Own change over that of the channel before, wherever that one moves.
    slopes: Vec<f64>,
}

impl Default for ChannelTrace {
    fn default() -> Self {
        Self {
            numbers: 0,
            without: 0,
            least: f64::INFINITY,
            most: f64::NEG_INFINITY,
            decimals: false,
            rises: true,
            spikes: 0,
            last: f64::NEG_INFINITY,
            jump: 0.0,
            still: None,
            rested: None,
            moved_s: f64::NEG_INFINITY,
            least_share: 0.0,
            from: None,
            slopes: Vec::new(),
        }
    }
}

impl ChannelTrace {
    fn add(&mut self, t: f64, count: Option<f32>, before: Option<f32>) {
        let Some(y) = count.map(f64::from) else {
            self.without += 1;
            (self.from, self.still) = (None, None);
            return;
        };
        self.numbers += 1;
        self.decimals |= y.fract() != 0.0;
        self.rises &= y > self.last;
        let jump = if self.last.is_finite() { y - self.last } else { 0.0 };
        self.spikes += u64::from(jump.abs() > SPIKE && self.jump.abs() > SPIKE && jump * self.jump < 0.0);
        (self.jump, self.last) = (jump, y);
        if self.still.is_none_or(|[count, _]| count != y) {
            self.still = Some([y, t]);
        }
        if (y - *self.rested.get_or_insert(y)).abs() > MOVES {
            (self.rested, self.moved_s) = (Some(y), t);
        }
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

    /// Difference of its largest and least count.
    pub fn range(&self) -> f64 {
        (self.most - self.least).max(0.0)
    }

    /// True where it moved by more than noise.
    pub fn moves(&self) -> bool {
        self.range() > MOVES
    }

    /// Share of the channel before that this channel follows, if it does: its least reading is that share, and it often
    /// moves by about that share when the other moves. A pad that is pressed all the time also reads a share, but does
    /// not move with the other; a pad that is pressed by a closing finger moves far more.
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
    /// One trace per channel.
    pub channels: Vec<ChannelTrace>,
    /// Times of the first and the newest reading, and of their arrival (s).
    span: Option<[[f64; 2]; 2]>,
}

/// A channel whose count was constant for this long (s) is stuck, if others moved meanwhile: noise moves every
/// converter by a count.
const STUCK_S: f64 = 1.0;
/// The count must also be constant for this share of the time: a strip at rest beside one that moves may be quiet.
const STUCK_SHARE: f64 = 2.0 / 3.0;

impl ChannelTraces {
    /// Takes in a reading.
    pub fn add(&mut self, reading: &Reading) {
        let now = [reading.t_s, reading.arrived_s];
        self.span.get_or_insert([now; 2])[1] = now;
        let width = reading.counts.len();
        self.channels.resize(self.channels.len().max(width), ChannelTrace::default());
        for (channel, trace) in self.channels.iter_mut().enumerate().take(width) {
            let before = channel.checked_sub(1).and_then(|before| reading.counts[before]);
            trace.add(reading.t_s, reading.counts[channel], before);
        }
    }

    /// Time from the first reading to the newest (s).
    pub fn seconds(&self) -> f64 {
        self.span.map_or(0.0, |[first, newest]| newest[0] - first[0])
    }

    /// Time from the arrival of the first reading to that of the newest (s).
    pub fn arrived_within_s(&self) -> f64 {
        self.span.map_or(0.0, |[first, newest]| newest[1] - first[1])
    }

    /// Count at which a channel was constant while others moved, and for how long (s).
    pub fn stuck(&self, channel: usize) -> Option<[f64; 2]> {
        let least_s = STUCK_S.max(STUCK_SHARE * self.seconds());
        self.constant(channel, |_| true).filter(|[_, lasted]| *lasted >= least_s)
    }

    /// Newest count of a channel that is exactly as before while one of these others moved, and for how long (s).
    pub fn constant(&self, channel: usize, others: impl Fn(usize) -> bool) -> Option<[f64; 2]> {
        let [count, since] = self.channels.get(channel)?.still?;
        let moved = |(other, trace): (usize, &ChannelTrace)| other != channel && others(other) && trace.moved_s > since;
        let is_constant = self.channels.iter().enumerate().any(moved);
        is_constant.then_some([count, self.span?[1][0] - since])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn traces(rows: impl Iterator<Item = [Option<f32>; 3]>) -> ChannelTraces {
        let mut traces = ChannelTraces::default();
        for (k, counts) in (0u16..).zip(rows) {
            let reading = Reading {
                t_s: 0.02 * f64::from(k),
                arrived_s: 0.0,
                seq: None,
                counts: counts.to_vec(),
                line_bar: None,
            };
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
    fn a_channel_that_stands_still_while_another_moves_is_stuck() {
        let still = |from: u8, step: f32| {
            let own = |k: u8| if k < from { 1400.0 + f32::from(k % 2) } else { 1433.0 };
            traces((0..200_u8).map(|k| [Some(1000.0 + step * f32::from(k)), Some(own(k)), None])).stuck(1)
        };
        let [count, seconds] = still(0, 5.0).expect("it is");
        assert!(count == 1433.0 && (seconds - 3.98).abs() < 1e-9, "{seconds}");
        assert!(still(50, 5.0).is_some_and(|[_, seconds]| (seconds - 2.98).abs() < 1e-9), "stuck from some moment on");
        assert_eq!(still(150, 5.0), None, "it may rest");
        assert_eq!(still(0, 0.1), None, "nothing moved");
        let alive = traces((0..200_u8).map(|k| [Some(5.0 * f32::from(k)), Some(1433.0 + f32::from(k % 2)), None]));
        assert_eq!((alive.stuck(1), alive.stuck(0), alive.stuck(2)), (None, None, None));
    }

    #[test]
    fn readings_without_a_number_are_counted_and_no_more() {
        let found = traces((0..4_u8).map(|k| [Some(1.0), (k > 0).then_some(2.0), None]));
        assert_eq!((found.channels[1].numbers, found.channels[1].without), (3, 1));
        assert_eq!((found.channels[2].numbers, found.channels[2].without), (0, 4));
    }
}
