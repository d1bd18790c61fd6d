//! The flex strip that reads curvature: Spectra Symbol FS-L-0055-253-ST (paper, section IV-B).
//!
//! A strip of active length L on a finger of curvature kappa bends by theta = kappa L. Its resistance is linear in the
//! angle (paper), R = R0 (1 + s theta), and is read in a divider with R_f to the supply: share = R / (R + R_f).
//!
//! Calibration in two points: flat, where R0 of each part is measured, for it is off by up to 30 %; and 90 degrees,
//! where the nominal rise is believed. What a part rises more or less stays as an error of gain.

use super::converter::Converter;
use super::physical_like::PhysicalLike;
use super::sampling::SAMPLE_HZ;
use super::streams::Streams;
use std::f64::consts::{FRAC_PI_2, PI};

/// Active length, L (m): code 0055 of the order number.
const ACTIVE_LENGTH: f64 = 0.055_37;

/// Resistance of a flat strip, R0 (ohm): code 253.
const FLAT_OHM: f64 = 25e3;

/// How far a part's flat resistance is from nominal, at most, as a share of it (data sheet).
const FLAT_TOLERANCE: f64 = 0.30;

/// Resistance at 90 degrees over flat, from part to part: 2 (25 to 50 kOhm, amperka) to 2.5 (30 to 70 kOhm, SparkFun,
/// is 2.3). The nominal part is in the middle.
const BENT_OVER_FLAT: [f64; 2] = [2.0, 2.5];

/// The other resistor of the divider, R_f (ohm): near the root of flat times bent resistance, for the widest span.
const DIVIDER_OHM: f64 = 47e3;

/// Share of the bend that reaches the strip, left and right. In recordings of the real gripper the left curvature
/// reads up to 47 degrees and the right up to 32 where both fingers bend alike. An empty grasp reads 43 to 44 degrees
/// on the left, and 14.3 1/m, the bend of the simulated finger at 1 bar, makes 45 over the strip: so the left is whole.
const REACHING: [f64; 2] = [1.0, 32.0 / 47.0];

/// Deviation of the share that reaches the strip, from grasp to grasp. Assumed: with the drift below it explains why
/// empty grasps of the real gripper differ by a degree in 44.
const SLIP: f64 = 0.005;

/// Deviation of the rest angle from grasp to grasp (rad): 0.3 degrees, assumed for the same reason.
const REST_DRIFT: f64 = 0.3 * PI / 180.0;

/// Share of the bend that follows late, in the substrate's viscoelasticity. Assumed: a few per cent.
const CREEPING: f64 = 0.04;

/// Time constant of what follows late (s). Assumed: lasting about as long as a step of the closing.
const CREEP_S: f64 = 0.4;

/// Relative rise of resistance per angle, s (1/rad), of a part with a given resistance at 90 degrees over flat.
fn rise(bent_over_flat: f64) -> f64 {
    (bent_over_flat - 1.0) / FRAC_PI_2
}

/// The rise that the calibration believes in (1/rad).
fn nominal_rise() -> f64 {
    rise(0.5 * (BENT_OVER_FLAT[0] + BENT_OVER_FLAT[1]))
}

/// One strip on its finger during one grasp.
#[derive(Clone, Debug)]
pub(super) struct FlexStrip {
    reaching: f64,
    flat_ohm: f64,
    rise: f64,
    rest_drift: f64,
    one_way: bool,
    folds: bool,
    creeps: bool,
    /// What follows late has come so far (rad); `None` before the first sample.
    late: Option<f64>,
    converter: Converter,
}

impl FlexStrip {
    /// The strip of a channel.
    pub(super) fn new(settings: &PhysicalLike, side: usize, streams: Streams<'_>) -> Self {
        let mounting = if settings.asymmetry { REACHING[side] } else { 1.0 };
        let slip = if settings.slip { 1.0 + SLIP * streams.of_trial("slip").normal() } else { 1.0 };
        let [least, most] = BENT_OVER_FLAT;
        let (flat_ohm, rise) = if settings.parts {
            let off = streams.of_gripper("flat").within(-FLAT_TOLERANCE, FLAT_TOLERANCE);
            (FLAT_OHM * (1.0 + off), rise(streams.of_gripper("bent").within(least, most)))
        } else {
            (FLAT_OHM, nominal_rise())
        };
        Self {
            reaching: mounting * slip,
            flat_ohm,
            rise,
            rest_drift: if settings.drift { REST_DRIFT * streams.of_trial("drift").normal() } else { 0.0 },
            one_way: settings.threshold,
            folds: settings.saturation,
            creeps: settings.hysteresis,
            late: None,
            converter: Converter::new(settings, streams),
        }
    }

    /// The curvature (1/m) that is reported of a true one at the next sample.
    pub(super) fn read(&mut self, kappa: f64) -> f64 {
        let bend = self.creep(kappa * ACTIVE_LENGTH * self.reaching);
        // Bent backwards the ink is not stretched; folded back on itself it cannot be bent further.
        let bend = if self.one_way { bend.max(0.0) } else { bend };
        let bend = if self.folds { bend.min(PI) } else { bend };
        let relative = self.convert(1.0 + bend * self.rise + self.rest_drift * nominal_rise());
        (relative - 1.0) / (nominal_rise() * ACTIVE_LENGTH)
    }

    /// The angle that shows of a bend (rad): most at once, the rest late, as in a standard linear solid.
    fn creep(&mut self, bend: f64) -> f64 {
        if !self.creeps {
            return bend;
        }
        let late = self.late.unwrap_or(bend);
        let late = late + (bend - late) * -(-1.0 / (SAMPLE_HZ * CREEP_S)).exp_m1();
        self.late = Some(late);
        bend + CREEPING * (late - bend)
    }

    /// A resistance through divider and converter and back, both relative to flat.
    fn convert(&mut self, relative: f64) -> f64 {
        if self.converter.is_perfect() {
            return relative;
        }
        let ohm = self.flat_ohm * relative.max(0.0);
        let share = self.converter.read(ohm / (ohm + DIVIDER_OHM));
        DIVIDER_OHM * share / (1.0 - share) / self.flat_ohm
    }

    /// What the calibration makes of this part's rise: 1 is right.
    #[cfg(test)]
    pub(super) fn gain(&self) -> f64 {
        self.reaching * self.rise / nominal_rise()
    }
}

#[cfg(test)]
mod tests {
    use super::super::physical_like::GRIPPER;
    use super::*;

    fn strip(settings: &PhysicalLike) -> FlexStrip {
        FlexStrip::new(settings, 0, Streams { gripper: 1, trial: 1, channel: "curvature_left" })
    }

    #[test]
    fn its_characteristic_rises_within_its_range() {
        let still = PhysicalLike { noise: false, hysteresis: false, ..PhysicalLike::default() };
        let mut strip = strip(&still);
        let readings: Vec<f64> = (-10..=70).map(|kappa| strip.read(f64::from(kappa))).collect();
        assert!(readings.windows(2).all(|w| w[0] <= w[1]));
        // Level backwards and beyond a fold at pi / L = 56.7 1/m, rising in between.
        assert!(readings[10..66].windows(2).all(|w| w[0] < w[1]));
        assert_eq!((readings[0], readings[67]), (readings[10], readings[80]));
    }

    #[test]
    fn an_ideal_strip_is_exact_and_counts_cost_little() {
        let mut ideal = strip(&PhysicalLike::OFF);
        let mut counted = strip(&PhysicalLike { counts: true, ..PhysicalLike::OFF });
        for kappa in [-5.0, 0.0, 3.0, 28.4, 40.0] {
            assert!((ideal.read(kappa) - kappa).abs() < 1e-12);
            // A right angle, 28.4 1/m, spans some 800 counts.
            assert!((counted.read(kappa) - kappa).abs() < 0.06, "{kappa}");
        }
    }

    #[test]
    fn what_follows_late_arrives_in_the_end() {
        let mut strip = strip(&PhysicalLike { hysteresis: true, ..PhysicalLike::OFF });
        assert!(strip.read(0.0).abs() < 1e-12, "starts at rest");
        let step: Vec<f64> = (0..200).map(|_| strip.read(10.0)).collect();
        assert!(step.windows(2).all(|w| w[0] <= w[1]));
        assert!((9.6..9.65).contains(&step[0]) && (step[199] - 10.0).abs() < 1e-3);
        let released = strip.read(0.0);
        assert!((0.3..0.4).contains(&released), "some of the bend stays for a while: {released}");
    }

    #[test]
    fn the_default_gripper_has_parts_that_keep_what_is_known_of_the_real_one() {
        let gain = |gripper, side: usize| {
            let settings = PhysicalLike { asymmetry: true, parts: true, ..PhysicalLike::OFF };
            let channel = ["curvature_left", "curvature_right"][side];
            FlexStrip::new(&settings, side, Streams { gripper, trial: 0, channel }).gain()
        };
        let right = |g: &u64| (0..2).all(|side| (gain(*g, side) / REACHING[side] - 1.0).abs() < 0.02);
        assert_eq!((0..).find(right), Some(GRIPPER));
        assert!((gain(GRIPPER, 1) / gain(GRIPPER, 0) - 0.68).abs() < 0.03);
    }
}
