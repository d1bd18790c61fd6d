//! Random numbers, a stream for every sensor and effect: switching an effect off, or leaving a channel out, does not
//! change the numbers of the others.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The streams of one channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Streams<'a> {
    /// Names the gripper's parts.
    pub(super) gripper: u64,
    /// Names the grasp.
    pub(super) trial: u64,
    /// Name of the channel.
    pub(super) channel: &'a str,
}

impl Streams<'_> {
    /// Stream of an effect that is drawn once for a gripper.
    pub(super) fn of_gripper(&self, effect: &str) -> Stream {
        Stream::new(self.gripper, self.channel, effect)
    }

    /// Stream of an effect that is drawn for every grasp.
    pub(super) fn of_trial(&self, effect: &str) -> Stream {
        Stream::new(self.trial, self.channel, effect)
    }
}

/// An endless row of random numbers.
#[derive(Clone, Debug)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream that a seed, a channel and an effect name.
    pub fn new(seed: u64, channel: &str, effect: &str) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(fnv1a([channel, "/", effect]));
        Self(random)
    }

    /// A number from `low` to `high`, all equally likely.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// A number of the normal distribution with mean 0 and deviation 1 (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        // From (0, 1], so that the logarithm is finite.
        let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.0.random::<f64>()).cos()
    }
}

/// The 64-bit hash of Fowler, Noll and Vo, variant 1a: the same on every machine and with every compiler.
fn fnv1a<'a>(words: impl IntoIterator<Item = &'a str>) -> u64 {
    let bytes = words.into_iter().flat_map(str::bytes);
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_the_published_one() {
        assert_eq!(fnv1a([""]), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(["foo", "bar"]), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn streams_differ_by_seed_channel_and_effect() {
        let first = |seed, channel, effect| Stream::new(seed, channel, effect).normal();
        let one = first(1, "force_left", "noise");
        assert_eq!(one, first(1, "force_left", "noise"));
        assert_ne!(one, first(2, "force_left", "noise"));
        assert_ne!(one, first(1, "force_right", "noise"));
        assert_ne!(one, first(1, "force_left", "slip"));
    }

    #[test]
    fn normal_numbers_have_mean_0_and_deviation_1() {
        let mut stream = Stream::new(0, "", "");
        let drawn: Vec<f64> = (0..10_000).map(|_| stream.normal()).collect();
        let mean = drawn.iter().sum::<f64>() / 1e4;
        let square = drawn.iter().map(|x| x * x).sum::<f64>() / 1e4;
        // Deviations of these two are 0.010 and 0.014.
        assert!(mean.abs() < 0.04 && (square - 1.0).abs() < 0.06, "{mean} {square}");
    }
}
