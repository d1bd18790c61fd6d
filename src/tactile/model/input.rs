//! The analogue input of a channel: the converter of [`crate::electronics`] with its noise.

use super::physical_like::PhysicalLike;
use super::streams::{Stream, Streams};
use crate::electronics::Converter;

/// Deviation of the noise (counts). Assumed: two counts, with long unshielded wires and no averaging.
const NOISE_COUNTS: f64 = 2.0;

/// One analogue input.
#[derive(Clone, Debug)]
pub(super) struct Input {
    noise: Option<Stream>,
    converter: Converter,
}

impl Input {
    /// The input of a channel.
    pub(super) fn new(settings: &PhysicalLike, streams: Streams<'_>) -> Self {
        let converter = Converter { whole_counts: settings.counts, ..Converter::DUE };
        Self { noise: settings.noise.then(|| streams.of_trial("noise")), converter }
    }

    /// True when it adds nothing to a voltage and takes nothing away.
    pub(super) fn is_perfect(&self) -> bool {
        self.noise.is_none() && !self.converter.whole_counts
    }

    /// Reading of a voltage, within the range of the converter; both as shares of the supply.
    pub(super) fn read(&mut self, share: f64) -> f64 {
        let noise = self.noise.as_mut().map_or(0.0, |noise| NOISE_COUNTS * noise.normal());
        self.converter.share(share, noise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_alone_has_its_deviation() {
        let input = |noise, counts| {
            let settings = PhysicalLike { noise, counts, ..PhysicalLike::OFF };
            Input::new(&settings, Streams { gripper: 0, trial: 0, channel: "curvature_left" })
        };
        let mut noisy = input(true, false);
        let off = |_| (noisy.read(0.5) - 0.5) * Converter::DUE.levels;
        let square = (0..4000).map(off).map(|x| x * x).sum::<f64>() / 4000.0;
        assert!((square.sqrt() - NOISE_COUNTS).abs() < 0.1, "{square}");
        assert!(input(false, false).is_perfect() && !noisy.is_perfect());
        assert_eq!(input(false, true).read(0.5 + 1e-9), 0.5);
    }
}
