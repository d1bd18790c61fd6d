//! The analogue input that reads a divider: an Arduino Due with 12 bits over 3.3 V, 0.806 mV a count.
//!
//! Voltages are given as shares of the 3.3 V. Count c stands for c / 4096, so that no reading means that the whole
//! supply is across the divider, which no finite resistance explains.

/// An analogue input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    /// Counts over the supply, a power of two: 4096 for 12 bits (SAM3X; 3.3 V / 4096 = 0.806 mV).
    pub levels: f64,
    /// True for whole counts, false for exact values.
    pub whole_counts: bool,
}

impl Converter {
    /// That of the Due, set to 12 bits.
    pub const DUE: Self = Self { levels: 4096.0, whole_counts: true };

    /// Reading of a voltage within the converter's range (counts). `noise` is added to the voltage (counts).
    pub fn counts(&self, share: f64, noise: f64) -> f64 {
        let counts = share * self.levels + noise;
        let counts = if self.whole_counts { counts.floor() } else { counts };
        counts.clamp(0.0, self.levels - 1.0)
    }

    /// The same as a share of the supply.
    pub fn share(&self, share: f64, noise: f64) -> f64 {
        self.counts(share, noise) / self.levels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_are_whole_counts_within_full_scale() {
        for i in -10..=110 {
            let read = Converter::DUE.counts(f64::from(i) / 100.0, 0.3);
            assert!(read.fract() == 0.0 && (0.0..=4095.0).contains(&read), "{read}");
        }
    }

    #[test]
    fn a_count_is_806_microvolts() {
        assert_eq!(Converter::DUE.counts(100.9 * 0.000_806 / 3.3, 0.0), 100.0);
        assert_eq!(Converter::DUE.counts(1.0, 0.0), 4095.0);
        let ten_bits = Converter { levels: 1024.0, ..Converter::DUE };
        assert_eq!((ten_bits.counts(0.5, 0.0), ten_bits.counts(1.0, 0.0)), (512.0, 1023.0));
    }
}
