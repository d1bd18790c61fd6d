//! The flex strip that reads curvature: Spectra Symbol FS-L-0055-253-ST (paper, section IV-B), see
//! [`crate::electronics`].
//!
//! Calibration in two points: flat, where R0 of each part is measured, for it is off by up to 30 %; and 90 degrees,
//! where the nominal rise is believed. What a part rises more or less stays as an error of gain.

use super::input::Input;
use super::physical_like::PhysicalLike;
use super::sampling::SAMPLE_HZ;
use super::streams::Streams;
use crate::electronics::{Divider, FlexStrip, StripPart};
use std::f64::consts::PI;

/// Share of the bend that reaches the strip, left and right. In recordings of the real gripper the left curvature
/// reads up to 47 degrees and the right up to 32 where both fingers bend alike. An empty grasp reads 43 to 44 degrees
/// on the left, and 14.3 1/m, the bend of the simulated finger at 1 bar, makes 45 over the strip: so the left is whole.
const REACHING: [f64; 2] = [1.0, 32.0 / 47.0];

/// Range of that share on any gripper. Assumed: from a strip that is glued half loose to one that bends over a corner.
const ANY_REACHING: [f64; 2] = [0.6, 1.05];

/// Deviation of the share that reaches the strip, from grasp to grasp. Assumed: with the drift below it explains why
/// empty grasps of the real gripper differ by a degree in 44.
const SLIP: f64 = 0.005;

/// Deviation of the rest angle from grasp to grasp (rad): 0.3 degrees, assumed for the same reason.
const REST_DRIFT: f64 = 0.3 * PI / 180.0;

/// One strip on its finger during one grasp, and its calibration.
#[derive(Clone, Debug)]
pub(super) struct ReadStrip {
    strip: FlexStrip,
    divider: Divider,
    input: Input,
    /// Gain by which readings are divided: 1 unless an empty close has shown it.
    known_gain: f64,
}

impl ReadStrip {
    /// The strip of a channel.
    pub(super) fn new(settings: &PhysicalLike, side: usize, streams: Streams<'_>) -> Self {
        let mounting = if settings.drawn {
            streams.of_gripper("reaching").within(ANY_REACHING[0], ANY_REACHING[1])
        } else if settings.asymmetry {
            REACHING[side]
        } else {
            1.0
        };
        let slip = if settings.slip { 1.0 + SLIP * streams.of_trial("slip").normal() } else { 1.0 };
        let [least, most] = StripPart::BENT_OVER_FLAT;
        let (flat_ohm, rise_per_rad) = if settings.parts {
            let off = streams.of_gripper("flat").within(-StripPart::FLAT_TOLERANCE, StripPart::FLAT_TOLERANCE);
            let bent_over_flat = streams.of_gripper("bent").within(least, most);
            (StripPart::NOMINAL_OHM * (1.0 + off), StripPart::rise(bent_over_flat))
        } else {
            (StripPart::NOMINAL_OHM, StripPart::nominal_rise())
        };
        let rest_drift = if settings.drift { REST_DRIFT * streams.of_trial("drift").normal() } else { 0.0 };
        let rest = rest_drift * StripPart::nominal_rise();
        let part = StripPart { flat_ohm, rise_per_rad, reaching: mounting * slip, rest };
        let mut strip = FlexStrip::new(part, SAMPLE_HZ);
        strip.one_way = settings.threshold;
        strip.folds = settings.saturation;
        strip.creeps = settings.hysteresis;
        let known_gain = if settings.closed_empty {
            let slip = if settings.slip { 1.0 + SLIP * streams.of_gripper("slip").normal() } else { 1.0 };
            mounting * slip * rise_per_rad / StripPart::nominal_rise()
        } else {
            1.0
        };
        let divider = Divider::of_strip(StripPart::DIVIDER_OHM);
        Self { strip, divider, input: Input::new(settings, streams), known_gain }
    }

    /// The curvature (1/m) that is reported of a true one at the next sample.
    pub(super) fn read(&mut self, kappa: f64) -> f64 {
        let relative = self.strip.relative(kappa);
        let relative = self.convert(relative);
        (relative - 1.0) / (self.known_gain * StripPart::nominal_rise() * StripPart::ACTIVE_LENGTH)
    }

    /// A resistance through divider and converter and back, both relative to flat.
    fn convert(&mut self, relative: f64) -> f64 {
        if self.input.is_perfect() {
            return relative;
        }
        let flat_ohm = self.strip.part.flat_ohm;
        let share = self.input.read(self.divider.share_of_ohm(flat_ohm * relative.max(0.0)));
        self.divider.ohm(share) / flat_ohm
    }

    /// Gain of this part under the nominal calibration: 1 is right.
    #[cfg(test)]
    pub(super) fn gain(&self) -> f64 {
        self.strip.part.reaching * self.strip.part.rise_per_rad / StripPart::nominal_rise()
    }
}

#[cfg(test)]
mod tests {
    use super::super::physical_like::GRIPPER;
    use super::*;

    fn strip(settings: &PhysicalLike) -> ReadStrip {
        ReadStrip::new(settings, 0, Streams { gripper: 1, trial: 1, channel: "curvature_left" })
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
    fn an_empty_close_shows_the_gain_of_any_strip() {
        let errors = |settings: fn(u64) -> PhysicalLike| {
            let error = |gripper: u64| {
                let still = PhysicalLike { noise: false, hysteresis: false, drift: false, ..settings(gripper) };
                let streams = Streams { gripper, trial: 5, channel: "curvature_left" };
                (ReadStrip::new(&still, 0, streams).read(10.0) / 10.0 - 1.0).abs()
            };
            (0..50).map(error).sum::<f64>() / 50.0
        };
        let (known, unknown) =
            (errors(PhysicalLike::any), errors(|g| PhysicalLike { closed_empty: false, ..PhysicalLike::any(g) }));
        assert!(known < 0.01 && unknown > 0.08, "{known} {unknown}");
    }

    #[test]
    fn delayed_parts_settle_in_the_end() {
        let mut strip = strip(&PhysicalLike { hysteresis: true, ..PhysicalLike::OFF });
        assert!(strip.read(0.0).abs() < 1e-12, "starts at rest");
        let step: Vec<f64> = (0..200).map(|_| strip.read(10.0)).collect();
        assert!(step.windows(2).all(|w| w[0] <= w[1]));
        assert!((9.6..9.65).contains(&step[0]) && (step[199] - 10.0).abs() < 1e-3);
        let released = strip.read(0.0);
        assert!((0.3..0.4).contains(&released), "some of the bend stays for a while: {released}");
    }

    #[test]
    fn the_default_gripper_has_parts_that_match_the_real_one() {
        let gain = |gripper, side: usize| {
            let settings = PhysicalLike { asymmetry: true, parts: true, ..PhysicalLike::OFF };
            let channel = ["curvature_left", "curvature_right"][side];
            ReadStrip::new(&settings, side, Streams { gripper, trial: 0, channel }).gain()
        };
        let right = |g: &u64| (0..2).all(|side| (gain(*g, side) / REACHING[side] - 1.0).abs() < 0.02);
        assert_eq!((0..).find(right), Some(GRIPPER));
        assert!((gain(GRIPPER, 1) / gain(GRIPPER, 0) - 0.68).abs() < 0.03);
    }
}
