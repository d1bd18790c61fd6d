//! Channels that stand at an end of the converter's range, and converters that seem to have fewer bits than expected.

/// An end of the converter's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rail {
    /// No counts: the pin is at ground.
    Low,
    /// All of them: the pin is at the reference voltage, or above.
    High,
}

/// A channel is told once it has stood at an end for this long (s).
const TOLD_AFTER_S: f64 = 0.5;
/// Counts within this of an end are at it: what is open picks up noise, and the mean of several conversions that are cut off
/// at the end falls short of it.
const NEAR: f32 = 3.0;
/// Full scale of the Due as our firmware sets it up.
const FULL_12_BIT: u32 = 4095;
/// Full scale of `analogRead` when nobody asked for more.
const FULL_10_BIT: f32 = 1023.0;
/// How long counts are watched before their largest says something of the converter (s): a close and a release.
const WATCHED_S: f64 = 5.0;
/// With less than this nothing is connected, and nothing can be said.
const ANYTHING: f32 = 128.0;

/// Watches the counts.
#[derive(Clone, Debug, Default)]
pub(super) struct RailWatch {
    channels: Vec<Option<(Rail, f64)>>,
    now_s: f64,
    since_s: Option<f64>,
    largest: f32,
}

impl RailWatch {
    /// Takes in counts; the full scale where the board has said it.
    pub(super) fn add(&mut self, counts: &[Option<f32>], t_s: f64, full_scale: Option<u32>) {
        self.channels.resize(counts.len(), None);
        self.now_s = t_s;
        self.since_s.get_or_insert(t_s);
        let ten_bit = full_scale.is_none() && self.looks_10_bit();
        let full = if ten_bit { FULL_10_BIT } else { full_scale.unwrap_or(FULL_12_BIT) as f32 };
        for (channel, count) in self.channels.iter_mut().zip(counts) {
            self.largest = self.largest.max(count.unwrap_or(0.0));
            let rail = match count {
                Some(count) if *count >= full - NEAR => Some(Rail::High),
                Some(count) if *count <= NEAR => Some(Rail::Low),
                _ => None,
            };
            *channel = rail.map(|rail| match *channel {
                Some((before, since)) if before == rail => (rail, since),
                _ => (rail, t_s),
            });
        }
    }

    /// The end at which each channel has stood for long.
    pub(super) fn at(&self) -> Vec<Option<Rail>> {
        let told = |(rail, since): (Rail, f64)| (self.now_s - since > TOLD_AFTER_S).then_some(rail);
        self.channels.iter().map(|channel| channel.and_then(told)).collect()
    }

    /// True where nothing was ever above what 10 bits can say.
    pub(super) fn looks_10_bit(&self) -> bool {
        let watched = self.since_s.is_some_and(|since| self.now_s - since >= WATCHED_S);
        watched && (ANYTHING..=FULL_10_BIT).contains(&self.largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_is_told_after_half_a_second() {
        let mut watch = RailWatch::default();
        for i in 0..100u32 {
            let t = 0.02 * f64::from(i);
            watch.add(&[Some(4095.0), Some(2000.0), None, Some(0.0)], t, Some(4095));
            let told = watch.at();
            assert_eq!(told[0], (t > 0.5).then_some(Rail::High), "{t}");
            assert_eq!((told[1], told[2]), (None, None));
            assert_eq!(told[3], (t > 0.5).then_some(Rail::Low), "{t}");
        }
        watch.add(&[Some(4000.0), None, None, None], 3.0, Some(4095));
        assert_eq!(watch.at(), [None; 4]);
    }

    #[test]
    fn ten_bits_are_suspected_from_the_largest_count() {
        let largest = |count: f32, seconds: f64| {
            let mut watch = RailWatch::default();
            watch.add(&[Some(count)], 0.0, None);
            watch.add(&[Some(10.0)], seconds, None);
            watch.looks_10_bit()
        };
        assert!(largest(668.0, 6.0));
        assert!(!largest(668.0, 2.0) && !largest(1400.0, 6.0) && !largest(3.0, 6.0));
    }
}
