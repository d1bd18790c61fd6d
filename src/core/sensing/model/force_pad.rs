//! The force-sensing pad that reads force or pressure: Ohmite FSR07CE (paper, section IV-B).
//!
//! Below a threshold it does not conduct. Above, its conductance follows a power law, G = a F^b, until it saturates.
//! It is read in a divider with R_m to ground, share = G R_m / (1 + G R_m), amplified so that the converter meets its
//! rail where the pad saturates. Loads are counted here as shares u of the load that saturates the nominal pad:
//! G = G_full u^b.
//!
//! Recordings of the real gripper know three levels: idle, touched, and saturated soon after the touch. No circuit or
//! curve of it is published, so the load that saturates is assumed, and a setting: [`PhysicalLike::full_force`] and
//! [`PhysicalLike::full_pressure`]. Pads of this kind saturate by pressure, small contacts first (Interlink's guide).
//! The calibration knows the nominal a and b: two points of a straight line in logarithms.

use super::converter::Converter;
use super::physical_like::PhysicalLike;
use super::sampling::SAMPLE_HZ;
use super::streams::Streams;

/// Least force that a pad feels, left and right (N). Data sheet: less than 15 g, 0.15 N, actuates. The right is assumed
/// a third duller.
const LEAST_FORCE: [f64; 2] = [0.15, 0.20];

/// Least pressure that a pad feels, left and right (Pa): 15 g on the 170 mm² of the pad are 0.9 kPa.
const LEAST_PRESSURE: [f64; 2] = [0.9e3, 1.2e3];

/// From the least load that a pad feels to the one that saturates it, in the unit of its channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PadRange {
    least: [f64; 2],
    full: f64,
}

impl PadRange {
    /// Of a pad that is read as force (N).
    pub(super) fn force(settings: &PhysicalLike) -> Self {
        Self { least: LEAST_FORCE, full: settings.full_force }
    }

    /// Of a pad that is read as pressure (Pa).
    pub(super) fn pressure(settings: &PhysicalLike) -> Self {
        Self { least: LEAST_PRESSURE, full: settings.full_pressure }
    }
}

/// Share of the load that reaches the pad, left and right. Assumed: the right pad is mounted as poorly as its strip.
const REACHING: [f64; 2] = [1.0, 0.7];

/// Conductance at the load that saturates, G_full (S): 6 kOhm at 1 N (Interlink 402, the table of Adafruit; there is
/// none for the FSR07).
const FULL_SIEMENS: f64 = 1.0 / 6e3;

/// Exponent b from part to part: 0.8 to 1 (the same table; Interlink's guide). The nominal part is in the middle.
const EXPONENT: [f64; 2] = [0.8, 1.0];

/// How far a part's conductance is from nominal, at most, as a share of it (data sheet, parts of one batch).
const GAIN_TOLERANCE: f64 = 0.04;

/// Deviation of the conductance from grasp to grasp (data sheet, single part repeatability).
const SLIP: f64 = 0.02;

/// How much more an unloading pad reads than a loading one, as a share of the load (data sheet).
const HYSTERESIS: f64 = 0.05;

/// Growth of the conductance for every tenfold time under load (data sheet, 1 % per log time).
const DRIFT_PER_DECADE: f64 = 0.01;

/// Time under load at which that growth sets in (s). Assumed; a data sheet counts from hours.
const DRIFT_FROM_S: f64 = 0.1;

/// Resistor of the divider, R_m (ohm): the value recommended for the lowest tenth of the pad's range.
const DIVIDER_OHM: f64 = 4.7e3;

/// Voltage over R_m at the load that saturates, as a share of the supply.
const FULL_SHARE: f64 = DIVIDER_OHM * FULL_SIEMENS / (1.0 + DIVIDER_OHM * FULL_SIEMENS);

/// The exponent that the calibration believes in.
const NOMINAL_EXPONENT: f64 = 0.5 * (EXPONENT[0] + EXPONENT[1]);

/// One pad on its finger during one grasp.
#[derive(Clone, Debug)]
pub(super) struct ForcePad {
    full: f64,
    threshold: Option<f64>,
    reaching: f64,
    /// Conductance over nominal.
    gain: f64,
    exponent: f64,
    hysteretic: bool,
    drifts: bool,
    saturates: bool,
    /// The load that shows, with hysteresis.
    shown: f64,
    /// How long it has conducted (s).
    loaded_s: f64,
    converter: Converter,
}

impl ForcePad {
    /// The pad of a channel.
    pub(super) fn new(settings: &PhysicalLike, range: PadRange, side: usize, streams: Streams<'_>) -> Self {
        let mounted = if settings.asymmetry { side } else { 0 };
        let slip = if settings.slip { 1.0 + SLIP * streams.of_trial("slip").normal() } else { 1.0 };
        let (part, exponent) = if settings.parts {
            let off = streams.of_gripper("gain").within(-GAIN_TOLERANCE, GAIN_TOLERANCE);
            (1.0 + off, streams.of_gripper("exponent").within(EXPONENT[0], EXPONENT[1]))
        } else {
            (1.0, NOMINAL_EXPONENT)
        };
        Self {
            full: range.full,
            threshold: settings.threshold.then_some(range.least[mounted]),
            reaching: REACHING[mounted],
            gain: part * slip,
            exponent,
            hysteretic: settings.hysteresis,
            drifts: settings.drift,
            saturates: settings.saturation,
            shown: 0.0,
            loaded_s: 0.0,
            converter: Converter::new(settings, streams),
        }
    }

    /// The load that is reported of a true one at the next sample, in the channel's unit. A pull counts as no load.
    pub(super) fn read(&mut self, load: f64) -> f64 {
        let load = self.hysteresis(load.max(0.0));
        let conductance = self.conductance(load);
        self.full * self.convert(conductance).powf(1.0 / NOMINAL_EXPONENT)
    }

    /// The load that shows: rising with it, but falling only once it has fallen by the hysteresis.
    fn hysteresis(&mut self, load: f64) -> f64 {
        let most = if self.hysteretic { (1.0 + HYSTERESIS) * load } else { load };
        self.shown = self.shown.clamp(load, most);
        self.shown
    }

    /// Conductance under a load, as a share of the nominal one at saturation.
    fn conductance(&mut self, load: f64) -> f64 {
        if load <= 0.0 || self.threshold.is_some_and(|least| load < least) {
            self.loaded_s = 0.0;
            return 0.0;
        }
        let decades = if self.drifts { (1.0 + self.loaded_s / DRIFT_FROM_S).log10() } else { 0.0 };
        self.loaded_s += 1.0 / SAMPLE_HZ;
        let law = (load * self.reaching / self.full).powf(self.exponent);
        let conductance = self.gain * (1.0 + DRIFT_PER_DECADE * decades) * law;
        if self.saturates { conductance.min(1.0) } else { conductance }
    }

    /// A conductance through divider, amplifier and converter and back, both as shares of the one at saturation.
    fn convert(&mut self, conductance: f64) -> f64 {
        if self.converter.is_perfect() {
            return conductance;
        }
        let amplified = if self.saturates { 1.0 / FULL_SHARE } else { 1.0 };
        let ratio = DIVIDER_OHM * FULL_SIEMENS * conductance;
        let share = self.converter.read(amplified * ratio / (1.0 + ratio)) / amplified;
        share / (1.0 - share) / (DIVIDER_OHM * FULL_SIEMENS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ranges() -> [PadRange; 2] {
        [PadRange::force(&PhysicalLike::OFF), PadRange::pressure(&PhysicalLike::OFF)]
    }

    fn pad(settings: &PhysicalLike, range: PadRange, side: usize) -> ForcePad {
        ForcePad::new(settings, range, side, Streams { gripper: 1, trial: 1, channel: "force_left" })
    }

    #[test]
    fn its_characteristic_is_silent_then_rises_then_saturates() {
        let still = PhysicalLike { noise: false, hysteresis: false, drift: false, ..PhysicalLike::default() };
        for range in ranges() {
            for side in 0..2 {
                let mut pad = pad(&still, range, side);
                let reads: Vec<f64> = (0..300).map(|i| pad.read(0.01 * f64::from(i) * range.full)).collect();
                assert!(reads.windows(2).all(|w| w[0] <= w[1]));
                let least = (100.0 * range.least[side] / range.full).ceil() as usize;
                assert!(reads[..least].iter().all(|&r| r == 0.0) && reads[least + 1] > 0.02 * range.full);
                let most = reads[299];
                assert!((most / range.full - 1.0).abs() < 1e-3, "at the rail, {most}");
                let saturated = reads.iter().position(|&r| r == most).unwrap();
                assert!(saturated < [120, 170][side], "{saturated}");
            }
        }
    }

    #[test]
    fn an_ideal_pad_is_exact() {
        for range in ranges() {
            let mut ideal = pad(&PhysicalLike::OFF, range, 1);
            for load in [0.0, 1e-3, 0.2, 1.0, 30.0] {
                assert!((ideal.read(load * range.full) - load * range.full).abs() <= 1e-12 * range.full * load);
            }
            assert_eq!(ideal.read(-1.0), 0.0);
        }
    }

    #[test]
    fn unloading_reads_up_to_5_per_cent_more() {
        let mut pad = pad(&PhysicalLike { hysteresis: true, ..PhysicalLike::OFF }, ranges()[0], 0);
        for load in [0.1, 0.2, 0.4] {
            assert!((pad.read(load) - load).abs() < 1e-12);
        }
        assert!((pad.read(0.39) - 0.40).abs() < 1e-12, "not yet");
        assert!((pad.read(0.2) - 0.21).abs() < 1e-12);
        assert_eq!(pad.read(0.0), 0.0);
    }

    #[test]
    fn a_held_load_creeps_up_by_1_per_cent_a_decade_until_released() {
        let mut pad = pad(&PhysicalLike { drift: true, ..PhysicalLike::OFF }, ranges()[0], 0);
        let held: Vec<f64> = (0..=45).map(|_| pad.read(0.5)).collect();
        assert!((held[0] - 0.5).abs() < 1e-12);
        // 45 samples are 0.9 s: 1 + 0.9 / 0.1 is one decade.
        let grown = 1.01_f64.powf(1.0 / NOMINAL_EXPONENT);
        assert!((held[45] / 0.5 - grown).abs() < 1e-9);
        pad.read(0.0);
        assert!((pad.read(0.5) - 0.5).abs() < 1e-12);
    }
}
