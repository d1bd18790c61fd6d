//! Saturated channels: at an end of the converter's range, or without numbers; and whether counts fit that range.

/// State of a channel whose counts do not depend on its sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Saturation {
    /// Zero counts: the pin is at ground.
    Low,
    /// Full scale: the pin is at the reference voltage, or above.
    High,
    /// `nan`, a word or nothing where a number should be.
    NoNumber,
}

/// A channel counts as saturated after this long at an end (s).
const AFTER_S: f64 = 0.5;
/// Counts within this share of the range of an end are at it: 8 of 4096, 2 of 1024. Open or shorted inputs pick up noise,
/// half of which the end cuts off. With a deviation of 2 counts of 12 bits, and no average taken, one reading in a thousand
/// is 6 counts away, one in 300 000 more than 8; the mean of eight conversions is never more than 3 away. With 10 bits,
/// the same noise goes 2 counts far, or half a count. A sound pad under its largest load (49 N) is 100 counts away beside 4.7 kΩ,
/// and 48 beside 10.
const NEAR: f32 = 1.0 / 512.0;
/// Full scale of the Due as our firmware sets it up.
pub(super) const FULL_12_BIT: u32 = 4095;
/// Default full scale of `analogRead`.
pub(super) const FULL_10_BIT: u32 = 1023;
/// Time of readings after which their largest count shows the range of the converter (s): a close and a release.
const WATCHED_S: f64 = 5.0;
/// Below this count nothing is connected, and the range is unknown.
const ANYTHING: f32 = 128.0;
/// Readings in a row beyond the full scale that show a wider converter: one alone may be a damaged number.
const BELIEVED: u32 = 3;

/// Whether the counts fit the converter's range: as the handshake states it, else 12 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AdcRange {
    /// The counts fit, or too few have come.
    #[default]
    Fits,
    /// A flex strip never exceeds 10 bits; with 12 it is above a quarter of the range. A sketch may forget
    /// `analogReadResolution`.
    LooksTenBit,
    /// The counts exceed the range.
    Exceeded,
}

/// Watches the counts.
#[derive(Clone, Debug, Default)]
pub struct SaturationWatch {
    channels: Vec<Channel>,
    now_s: f64,
    /// First reading (s).
    since_s: Option<f64>,
    /// Largest count of a flex strip.
    strip: f32,
    /// Readings in a row beyond the full scale.
    beyond: u32,
    full_scale: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    /// The end of the range that it is at, and since when (s).
    at: Option<(Saturation, f64)>,
}

impl SaturationWatch {
    /// Takes in counts of a converter with this full scale. A channel that was not sent is not saturated.
    pub fn add(&mut self, counts: &[Option<f32>], sent: &[bool], t_s: f64, full_scale: u32) {
        self.channels.resize(counts.len(), Channel::default());
        self.now_s = t_s;
        let full = full_scale as f32;
        let near = NEAR * (full + 1.0);
        for ((channel, count), sent) in self.channels.iter_mut().zip(counts).zip(sent) {
            let state = match count {
                // Values beyond do not come from this converter.
                Some(count) if *count > full + near => None,
                Some(count) if *count >= full - near => Some(Saturation::High),
                Some(count) if *count <= near => Some(Saturation::Low),
                None if *sent => Some(Saturation::NoNumber),
                Some(_) | None => None,
            };
            channel.at = state.map(|state| match channel.at {
                Some((before, since)) if before == state => (state, since),
                _ => (state, t_s),
            });
        }
    }

    /// Saturation of each channel.
    pub(super) fn at(&self) -> Vec<Option<Saturation>> {
        self.lasting(AFTER_S)
    }

    /// Saturation of each channel that has lasted for so long (s).
    pub fn lasting(&self, after_s: f64) -> Vec<Option<Saturation>> {
        let found = |(state, since): (Saturation, f64)| (self.now_s - since > after_s).then_some(state);
        self.channels.iter().map(|channel| channel.at.and_then(found)).collect()
    }

    /// Takes in the largest counts of a reading, of the strips and of all sensors.
    pub(super) fn add_range(&mut self, [strip, largest]: &[f32; 2], t_s: f64, full_scale: u32) {
        self.now_s = t_s;
        self.since_s.get_or_insert(t_s);
        self.strip = self.strip.max(*strip);
        if self.full_scale != full_scale {
            (self.full_scale, self.beyond) = (full_scale, 0);
        }
        if self.beyond < BELIEVED {
            self.beyond = if *largest > full_scale as f32 { self.beyond + 1 } else { 0 };
        }
    }

    /// Whether the counts so far fit the range.
    pub(super) fn adc_range(&self) -> AdcRange {
        let watched = self.since_s.is_some_and(|since| self.now_s - since >= WATCHED_S);
        if self.beyond >= BELIEVED {
            AdcRange::Exceeded
        } else if watched && self.full_scale > FULL_10_BIT && (ANYTHING..=FULL_10_BIT as f32).contains(&self.strip) {
            AdcRange::LooksTenBit
        } else {
            AdcRange::Fits
        }
    }

    /// The stream was interrupted: another sketch may be on the board.
    pub(super) fn interrupt(&mut self) {
        (self.since_s, self.strip, self.beyond) = (None, 0.0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_tactile::electronics::Converter;
    use palpate_tactile::model::Stream;

    #[test]
    fn an_end_is_reported_after_half_a_second() {
        let mut watch = SaturationWatch::default();
        for i in 0..100u32 {
            let t = 0.02 * f64::from(i);
            watch.add(
                &[Some(4095.0), Some(2000.0), None, Some(0.0), None],
                &[true, true, true, true, false],
                t,
                FULL_12_BIT,
            );
            let found = watch.at();
            assert_eq!(found[0], (t > 0.5).then_some(Saturation::High), "{t}");
            assert_eq!((found[1], found[2]), (None, (t > 0.5).then_some(Saturation::NoNumber)));
            assert_eq!(found[4], None, "it is not sent any more");
            assert_eq!(found[3], (t > 0.5).then_some(Saturation::Low), "{t}");
        }
        watch.add(
            &[Some(4000.0), Some(5000.0), Some(9.0), Some(9.0), None],
            &[true, true, true, true, false],
            3.0,
            FULL_12_BIT,
        );
        assert_eq!(watch.at(), [None; 5]);
    }

    /// How often each end is reported of each channel, in ten seconds of readings at 50 Hz.
    fn found(levels: f64, average: u32, shares: [f64; 3]) -> [[u32; 2]; 3] {
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
            for (times, found) in times.iter_mut().zip(watch.at()) {
                times[0] += u32::from(found == Some(Saturation::Low));
                times[1] += u32::from(found == Some(Saturation::High));
            }
        }
        times
    }

    #[test]
    fn noise_hides_no_open_circuit_and_makes_none_of_a_sound_channel() {
        // A pad under its largest load beside 10 kΩ: 49 N, 1.04 times 49 / 6 mS.
        let ratio = 10.0 * 1.04 * 49.0 / 6.0;
        let pressed = ratio / (1.0 + ratio);
        for levels in [4096.0, 1024.0] {
            for average in [1, 8] {
                let [shorted, open, sound] = found(levels, average, [0.0, 1.0, pressed]);
                // All but the first half second, and never the other end.
                assert!(shorted[0] > 470 && shorted[1] == 0, "{levels} {average} {shorted:?}");
                assert!(open[1] > 470 && open[0] == 0, "{levels} {average} {open:?}");
                assert_eq!(sound, [0, 0], "{levels} {average}");
            }
        }
    }

    #[test]
    fn ten_bits_are_suspected_from_a_strip_and_a_wider_converter_from_three_readings() {
        let range = |full_scale: u32, largest: [f32; 2], seconds: u32| {
            let mut watch = SaturationWatch::default();
            (0..=50 * seconds).for_each(|k| watch.add_range(&largest, 0.02 * f64::from(k), full_scale));
            watch.adc_range()
        };
        assert_eq!(range(FULL_12_BIT, [668.0; 2], 6), AdcRange::LooksTenBit);
        assert_eq!(range(FULL_12_BIT, [668.0; 2], 2), AdcRange::Fits, "too early to say");
        assert_eq!(range(FULL_10_BIT, [668.0; 2], 6), AdcRange::Fits, "as stated");
        for largest in [[1400.0; 2], [3.0; 2], [0.0, 900.0]] {
            assert_eq!(range(FULL_12_BIT, largest, 6), AdcRange::Fits, "{largest:?}");
        }
        assert_eq!(range(FULL_12_BIT, [0.0, 5000.0], 6), AdcRange::Exceeded);
        assert_eq!(range(65_535, [0.0, 5000.0], 6), AdcRange::Fits);
        let mut watch = SaturationWatch::default();
        for largest in [9000.0, 300.0, 9000.0, 9000.0] {
            watch.add_range(&[0.0, largest], 0.0, FULL_12_BIT);
        }
        assert_eq!(watch.adc_range(), AdcRange::Fits, "single ones were damaged");
    }
}
