//! A flex strip, Spectra Symbol FS-L-0055-253-ST (paper, section IV-B): from the bend it lies on to its resistance.
//!
//! A strip of active length L on a finger of curvature kappa bends by theta = kappa L. Its resistance is linear in the
//! angle (paper), R = R0 (1 + s theta).

use palpate_sim::gripper::Strip;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};

/// One part, glued to its finger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StripPart {
    /// Resistance flat, R0 (ohm).
    pub flat_ohm: f64,
    /// Relative rise of resistance per angle, s (1/rad).
    pub rise_per_rad: f64,
    /// Share of the finger's bend that reaches it.
    pub reaching: f64,
    /// Shift of its resistance at rest, as a share of R0.
    pub rest: f64,
}

impl StripPart {
    /// Active length, L (m).
    pub const ACTIVE_LENGTH: f64 = Strip::ACTIVE_LENGTH;

    /// Resistance of a nominal flat part (ohm): code 253.
    pub const NOMINAL_OHM: f64 = 25e3;

    /// Tolerance of a part's flat resistance, as a share of the nominal (data sheet).
    pub const FLAT_TOLERANCE: f64 = 0.30;

    /// Resistance at 90 degrees over flat, from part to part: 2 (25 to 50 kΩ, amperka) to 2.5 (30 to 70 kΩ,
    /// SparkFun, is 2.3). The nominal part is in the middle.
    pub const BENT_OVER_FLAT: [f64; 2] = [2.0, 2.5];

    /// The other resistor of its divider (ohm): near the root of flat times bent resistance, for the widest span.
    pub const DIVIDER_OHM: f64 = 47e3;

    /// Relative rise of resistance per angle, s (1/rad), of a part with a given resistance at 90 degrees over flat.
    pub fn rise(bent_over_flat: f64) -> f64 {
        (bent_over_flat - 1.0) / FRAC_PI_2
    }

    /// That of the nominal part (1/rad).
    pub fn nominal_rise() -> f64 {
        Self::rise(0.5 * (Self::BENT_OVER_FLAT[0] + Self::BENT_OVER_FLAT[1]))
    }

    /// The nominal part, wholly bent with the finger.
    pub fn nominal() -> Self {
        Self { flat_ohm: Self::NOMINAL_OHM, rise_per_rad: Self::nominal_rise(), reaching: 1.0, rest: 0.0 }
    }
}

/// Share of the bend that follows late, in the substrate's viscoelasticity. Assumed: a few per cent.
const CREEPING: f64 = 0.04;

/// Time constant of what follows late (s). Assumed: lasting about as long as a step of the closing.
const CREEP_S: f64 = 0.4;

/// A strip that is read at regular times.
#[derive(Clone, Debug)]
pub struct FlexStrip {
    /// Part constants.
    pub part: StripPart,
    /// Bent backwards the ink is not stretched.
    pub one_way: bool,
    /// Folded back on itself it cannot be bent further.
    pub folds: bool,
    /// Part of a bend shows late.
    pub creeps: bool,
    /// Times per second at which it is read (1/s).
    pub rate_hz: f64,
    /// Present value of the delayed part (rad); `None` before the first sample.
    late: Option<f64>,
}

impl FlexStrip {
    /// A strip without faults, at rest.
    pub fn new(part: StripPart, rate_hz: f64) -> Self {
        Self { part, one_way: false, folds: false, creeps: false, rate_hz, late: None }
    }

    /// Its resistance over that of a flat one, R / R0, at the next reading on a finger of this curvature (1/m).
    pub fn relative(&mut self, kappa: f64) -> f64 {
        let bend = self.creep(kappa * StripPart::ACTIVE_LENGTH * self.part.reaching);
        let bend = if self.one_way { bend.max(0.0) } else { bend };
        let bend = if self.folds { bend.min(PI) } else { bend };
        1.0 + bend * self.part.rise_per_rad + self.part.rest
    }

    /// Its resistance (ohm) at the next reading.
    pub fn ohm(&mut self, kappa: f64) -> f64 {
        self.part.flat_ohm * self.relative(kappa).max(0.0)
    }

    /// The angle that shows of a bend (rad): most at once, the rest late, as in a standard linear solid.
    fn creep(&mut self, bend: f64) -> f64 {
        if !self.creeps {
            return bend;
        }
        let late = self.late.unwrap_or(bend);
        let late = late + (bend - late) * -(-1.0 / (self.rate_hz * CREEP_S)).exp_m1();
        self.late = Some(late);
        bend + CREEPING * (late - bend)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nominal_strip_is_between_two_and_two_and_a_half_times_as_high_at_a_right_angle() {
        let mut strip = FlexStrip::new(StripPart::nominal(), 50.0);
        assert_eq!(strip.ohm(0.0), 25e3);
        let right_angle = FRAC_PI_2 / StripPart::ACTIVE_LENGTH;
        assert!((right_angle - 28.4).abs() < 0.05);
        assert!((strip.ohm(right_angle) - 56.25e3).abs() < 1e-6);
    }

    #[test]
    fn delayed_parts_follow_time_and_not_the_number_of_readings() {
        let after = |rate_hz: f64, seconds: f64| {
            let mut strip = FlexStrip::new(StripPart::nominal(), rate_hz);
            strip.creeps = true;
            strip.relative(0.0);
            (0..(rate_hz * seconds) as u32).map(|_| strip.relative(10.0)).last().expect("some")
        };
        for seconds in [0.2, 0.4, 1.0] {
            assert!((after(50.0, seconds) - after(1000.0, seconds)).abs() < 1e-12);
        }
    }
}
