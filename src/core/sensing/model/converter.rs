//! The analogue input that reads a divider: an Arduino Due with 12 bits over 3.3 V, 0.806 mV a count.
//!
//! Voltages are given as shares of the 3.3 V. Count c stands for c / 4096, so that no reading says that the whole
//! supply is across the divider, which no finite resistance explains.

use super::physical_like::PhysicalLike;
use super::streams::{Stream, Streams};

/// Counts over the supply: 12 bits (SAM3X; 3.3 V / 4096 = 0.806 mV).
const COUNTS: f64 = 4096.0;

/// Deviation of the noise (counts). Assumed: two counts, with long unshielded wires and no averaging.
const NOISE_COUNTS: f64 = 2.0;

/// One analogue input.
#[derive(Clone, Debug)]
pub(super) struct Converter {
    noise: Option<Stream>,
    whole_counts: bool,
}

impl Converter {
    /// The input of a channel.
    pub(super) fn new(settings: &PhysicalLike, streams: Streams<'_>) -> Self {
        Self { noise: settings.noise.then(|| streams.of_trial("noise")), whole_counts: settings.counts }
    }

    /// True when it adds nothing to a voltage and takes nothing away.
    pub(super) fn is_perfect(&self) -> bool {
        self.noise.is_none() && !self.whole_counts
    }

    /// What a voltage is read as, between the rails; both as shares of the supply.
    pub(super) fn read(&mut self, share: f64) -> f64 {
        let noise = self.noise.as_mut().map_or(0.0, |noise| NOISE_COUNTS * noise.normal());
        let counts = share * COUNTS + noise;
        let counts = if self.whole_counts { counts.floor() } else { counts };
        counts.clamp(0.0, COUNTS - 1.0) / COUNTS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn converter(noise: bool, counts: bool) -> Converter {
        let settings = PhysicalLike { noise, counts, ..PhysicalLike::OFF };
        Converter::new(&settings, Streams { gripper: 0, trial: 0, channel: "curvature_left" })
    }

    #[test]
    fn readings_are_whole_counts_between_the_rails() {
        let mut noisy = converter(true, true);
        for i in -10..=110 {
            let read = noisy.read(f64::from(i) / 100.0) * COUNTS;
            assert!(read.fract() == 0.0 && (0.0..=4095.0).contains(&read), "{read}");
        }
    }

    #[test]
    fn a_count_is_806_microvolts() {
        let mut quiet = converter(false, true);
        assert_eq!(quiet.read(100.9 * 0.000_806 / 3.3) * COUNTS, 100.0);
        assert_eq!(quiet.read(1.0) * COUNTS, 4095.0);
    }

    #[test]
    fn noise_alone_has_its_deviation() {
        let mut noisy = converter(true, false);
        let off = |_| (noisy.read(0.5) - 0.5) * COUNTS;
        let square = (0..4000).map(off).map(|x| x * x).sum::<f64>() / 4000.0;
        assert!((square.sqrt() - NOISE_COUNTS).abs() < 0.1, "{square}");
        assert!(converter(false, false).is_perfect() && !noisy.is_perfect());
    }
}
