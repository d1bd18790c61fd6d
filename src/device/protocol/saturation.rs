//! Channels that stand at an end of the converter's range or have no numbers, and how far the converter counts.

/// Where a channel says nothing of its sensor: an end of the converter's range, or no number at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Saturation {
    /// No counts: the pin is at ground.
    Low,
    /// All of them: the pin is at the reference voltage, or above.
    High,
    /// `nan`, a word or nothing where a number should be.
    NoNumber,
}

/// A channel is told once it has stood at an end for this long (s).
const TOLD_AFTER_S: f64 = 0.5;
/// Counts within this share of the range of an end are at it: 8 of 4096, 2 of 1024. What is open or shorted picks up noise,
/// half of which the end cuts off. With a deviation of 2 counts of 12 bits, and no average taken, one reading in a thousand
/// is 6 counts away, one in 300 000 more than 8; the mean of eight conversions is never more than 3 away. With 10 bits,
/// the same noise goes 2 counts far, or half a count. A sound pad under its largest load (49 N) is 100 counts away beside 4.7 kOhm,
/// and 48 beside 10.
const NEAR: f32 = 1.0 / 512.0;
/// Full scale of the Due as our firmware sets it up.
pub(super) const FULL_12_BIT: u32 = 4095;
/// Full scale of `analogRead` when nobody asked for more.
pub(super) const FULL_10_BIT: u32 = 1023;
/// How long counts are watched before their largest says something of the converter (s): a close and a release.
const WATCHED_S: f64 = 5.0;
/// With less than this nothing is connected, and nothing can be said.
const ANYTHING: f32 = 128.0;

/// Largest counts of the converters that there are: 10, 12, 14, 16, 18, 20 and 24 bits.
const FULL_SCALES: [u32; 7] =
    [FULL_10_BIT, FULL_12_BIT, (1 << 14) - 1, (1 << 16) - 1, (1 << 18) - 1, (1 << 20) - 1, (1 << 24) - 1];
/// Readings in a row that are beyond a full scale before a larger one is believed: one alone may be a damaged number.
const BELIEVED: u32 = 3;
/// A strip that has not been beyond ten bits for this long (s) is read with ten: with 12 it is above a quarter of the range,
/// beside the resistor that it should have, from the first reading on.
const TEN_BITS_AFTER_S: f64 = 1.0;

/// How far a converter counts, by what it has sent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AdcRange {
    /// More than is said, or usual: at least three readings in a row were beyond.
    more: Option<u32>,
    /// Readings in a row that are beyond, and the least of them.
    beyond: Option<(u32, f32)>,
    /// Since when a strip is read (s).
    strip_since_s: Option<f64>,
    /// Readings in a row that are beyond ten bits; once there were enough, ten is out of the question.
    past_ten: u32,
    ten: bool,
}

impl AdcRange {
    /// Takes in the largest counts of a reading, of the strips and of all sensors. `said` is what the board says of its full
    /// scale.
    pub(super) fn add(&mut self, t_s: f64, strip: f32, largest: f32, said: Option<u32>) {
        let before = self.full_scale(said);
        self.beyond = match self.beyond {
            _ if largest <= before as f32 => None,
            None => Some((1, largest)),
            Some((count, least)) => Some((count + 1, least.min(largest))),
        };
        if let Some((BELIEVED.., least)) = self.beyond {
            self.more = FULL_SCALES.into_iter().find(|full_scale| least <= *full_scale as f32).or(self.more);
            self.beyond = None;
        }
        if largest > FULL_10_BIT as f32 {
            self.past_ten = self.past_ten.saturating_add(1);
            self.ten &= self.past_ten < BELIEVED;
        } else if self.past_ten < BELIEVED {
            self.past_ten = 0;
            if strip >= ANYTHING {
                self.ten = t_s - *self.strip_since_s.get_or_insert(t_s) >= TEN_BITS_AFTER_S;
            }
        }
    }

    /// The full scale: what is said, or else twelve bits, unless the counts tell otherwise.
    pub(super) fn full_scale(self, said: Option<u32>) -> u32 {
        let usual = if self.ten { FULL_10_BIT } else { FULL_12_BIT };
        said.unwrap_or(usual).max(self.more.unwrap_or(0))
    }
}

/// Watches the counts.
#[derive(Clone, Debug, Default)]
pub(super) struct SaturationWatch {
    channels: Vec<Channel>,
    now_s: f64,
    since_s: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    /// The end at which it stands, and since when (s).
    at: Option<(Saturation, f64)>,
    largest: f32,
}

impl SaturationWatch {
    /// Takes in counts of a converter with this full scale. What is not sent at all says nothing.
    pub(super) fn add(&mut self, counts: &[Option<f32>], sent: &[bool], t_s: f64, full_scale: u32) {
        self.channels.resize(counts.len(), Channel::default());
        self.now_s = t_s;
        self.since_s.get_or_insert(t_s);
        let full = full_scale as f32;
        let near = NEAR * (full + 1.0);
        for ((channel, count), sent) in self.channels.iter_mut().zip(counts).zip(sent) {
            channel.largest = channel.largest.max(count.unwrap_or(0.0));
            let rail = match count {
                // What is beyond does not come from this converter.
                Some(count) if *count > full + near => None,
                Some(count) if *count >= full - near => Some(Saturation::High),
                Some(count) if *count <= near => Some(Saturation::Low),
                None if *sent => Some(Saturation::NoNumber),
                Some(_) | None => None,
            };
            channel.at = rail.map(|rail| match channel.at {
                Some((before, since)) if before == rail => (rail, since),
                _ => (rail, t_s),
            });
        }
    }

    /// The end at which each channel has stood for long.
    pub(super) fn at(&self) -> Vec<Option<Saturation>> {
        let told = |(rail, since): (Saturation, f64)| (self.now_s - since > TOLD_AFTER_S).then_some(rail);
        self.channels.iter().map(|channel| channel.at.and_then(told)).collect()
    }

    /// True where nothing was ever above what 10 bits can say.
    pub(super) fn looks_10_bit(&self) -> bool {
        let watched = self.since_s.is_some_and(|since| self.now_s - since >= WATCHED_S);
        let largest = self.channels.iter().map(|channel| channel.largest).fold(0.0, f32::max);
        watched && (ANYTHING..=FULL_10_BIT as f32).contains(&largest)
    }

    /// True where something is connected to a channel.
    pub(super) fn is_connected(&self, channel: usize) -> bool {
        self.channels.get(channel).is_some_and(|channel| channel.largest >= ANYTHING)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_tactile::electronics::Converter;
    use palpate_tactile::model::Stream;

    #[test]
    fn an_end_is_told_after_half_a_second() {
        let mut watch = SaturationWatch::default();
        for i in 0..100u32 {
            let t = 0.02 * f64::from(i);
            watch.add(
                &[Some(4095.0), Some(2000.0), None, Some(0.0), None],
                &[true, true, true, true, false],
                t,
                FULL_12_BIT,
            );
            let told = watch.at();
            assert_eq!(told[0], (t > 0.5).then_some(Saturation::High), "{t}");
            assert_eq!((told[1], told[2]), (None, (t > 0.5).then_some(Saturation::NoNumber)));
            assert_eq!(told[4], None, "it is not sent any more");
            assert_eq!(told[3], (t > 0.5).then_some(Saturation::Low), "{t}");
        }
        watch.add(
            &[Some(4000.0), Some(5000.0), Some(9.0), Some(9.0), None],
            &[true, true, true, true, false],
            3.0,
            FULL_12_BIT,
        );
        assert_eq!(watch.at(), [None; 5]);
    }

    /// Readings of shares of the supply at 50 Hz for ten seconds, and how often each end is told of each.
    fn told(levels: f64, average: u32, shares: [f64; 3]) -> [[u32; 2]; 3] {
        let converter = Converter { levels, ..Converter::DUE };
        let mut noise = Stream::new(1, "rails", "noise");
        let mut watch = SaturationWatch::default();
        let mut times = [[0; 2]; 3];
        for i in 0..500u32 {
            let counts = shares.map(|share| {
                let deviation = 2.0 * levels / Converter::DUE.levels;
                let sum: f64 = (0..average).map(|_| converter.counts(share, deviation * noise.normal())).sum();
                Some((sum / f64::from(average)) as f32)
            });
            watch.add(&counts, &[true; 3], 0.02 * f64::from(i), levels as u32 - 1);
            for (times, told) in times.iter_mut().zip(watch.at()) {
                times[0] += u32::from(told == Some(Saturation::Low));
                times[1] += u32::from(told == Some(Saturation::High));
            }
        }
        times
    }

    #[test]
    fn noise_hides_no_open_circuit_and_makes_none_of_a_sound_channel() {
        // A pad under its largest load beside 10 kOhm: 49 N, 1.04 times 49 / 6 mS.
        let ratio = 10.0 * 1.04 * 49.0 / 6.0;
        let pressed = ratio / (1.0 + ratio);
        for levels in [4096.0, 1024.0] {
            for average in [1, 8] {
                let [shorted, open, sound] = told(levels, average, [0.0, 1.0, pressed]);
                // All but the first half second, and never the other end.
                assert!(shorted[0] > 470 && shorted[1] == 0, "{levels} {average} {shorted:?}");
                assert!(open[1] > 470 && open[0] == 0, "{levels} {average} {open:?}");
                assert_eq!(sound, [0, 0], "{levels} {average}");
            }
        }
    }

    #[test]
    fn a_converter_reaches_as_far_as_three_readings_in_a_row() {
        let mut reach = AdcRange::default();
        let mut now = 0.0;
        let mut all = |said: Option<u32>, counts: &[f32]| {
            counts.iter().for_each(|count| {
                now += 0.02;
                reach.add(now, 0.0, *count, said);
            });
            reach.full_scale(said)
        };
        assert_eq!(all(None, &[1400.0, 1400.0, 14_325.0, 300.0, 9000.0, 9000.0]), 4095, "single ones were damaged");
        assert_eq!(all(None, &[300.0, 9000.0, 9000.0, 140_000.0]), 16_383, "the least of them tells");
        assert_eq!(all(None, &[2.0, 5e9, 5e9, 5e9]), 16_383, "no converter counts as far");
        assert_eq!(all(Some(65_535), &[9000.0]), 65_535);
        let mut said = AdcRange::default();
        (0..9).for_each(|k| said.add(f64::from(k), 1000.0, 1000.0, Some(4095)));
        assert_eq!(said.full_scale(Some(4095)), 4095, "a board that says so is believed");
    }

    #[test]
    fn ten_bits_are_told_by_strips_within_a_second_and_by_pads_never() {
        let full_scale = |strip: f32, pad: f32, last: &[f32]| {
            let mut reach = AdcRange::default();
            for k in 0..200u32 {
                reach.add(0.02 * f64::from(k), strip, strip.max(pad), None);
            }
            for (k, count) in (0u32..).zip(last) {
                reach.add(4.0 + 0.02 * f64::from(k), *count, *count, None);
            }
            reach.full_scale(None)
        };
        assert_eq!(full_scale(350.0, 0.0, &[]), 1023);
        assert_eq!(full_scale(1420.0, 0.0, &[]), 4095);
        assert_eq!(full_scale(0.0, 900.0, &[]), 4095, "pads may be anywhere");
        assert_eq!(full_scale(800.0, 0.0, &[1100.0]), 1023, "one was damaged");
        assert_eq!(full_scale(800.0, 0.0, &[1100.0; 3]), 4095, "a strip beside more than it should have, bent");
    }

    #[test]
    fn ten_bits_are_suspected_from_the_largest_count() {
        let largest = |count: f32, seconds: f64| {
            let mut watch = SaturationWatch::default();
            watch.add(&[Some(count)], &[true], 0.0, FULL_12_BIT);
            watch.add(&[Some(10.0)], &[true], seconds, FULL_12_BIT);
            assert_eq!((watch.is_connected(0), watch.is_connected(1)), (count >= 128.0, false));
            watch.looks_10_bit()
        };
        assert!(largest(668.0, 6.0));
        assert!(!largest(668.0, 2.0) && !largest(1400.0, 6.0) && !largest(3.0, 6.0));
    }
}
