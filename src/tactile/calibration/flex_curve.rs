//! The flex strip: its resistance is linear in the angle over 0 to 90 degrees (paper, section IV-B),
//!
//!   R = R0 + s theta,
//!
//! fitted by least squares of the resistance on the angle, all points alike: the uncertainty of a point is that of
//! the angle set, not of the mean of its readings. The angle is spread evenly over the active length L of the strip, so
//! that the curvature is kappa = theta / L; a right angle is 28.4 1/m.
//!
//! Plausible parts follow the data sheet of the FS-L-0055-253-ST: 25 kΩ flat, off by 30 % at most; distributors
//! measure 2 to 2.5 times that at 90 degrees.

use super::CalibrationFault;
use super::input::Input;
use super::point::{Point, check, merged};
use super::straight_line::{StraightLine, WeightedPoint};
use crate::electronics::StripPart;
use crate::sensor_list::SensorKind;
use palpate_geometry::units::three_digits;
use serde::Serialize;
use std::f64::consts::FRAC_PI_2;

/// Flat resistance of such parts (ohm): 17.5 to 32.5 kΩ.
const FLAT_OHM: [f64; 2] = [
    StripPart::NOMINAL_OHM * (1.0 - StripPart::FLAT_TOLERANCE),
    StripPart::NOMINAL_OHM * (1.0 + StripPart::FLAT_TOLERANCE),
];

/// Resistance at 90 degrees over flat that is believed: wider than the 2 to 2.5 of distributors, for the strip may sit
/// on a finger that bends only in part along it.
const BENT_OVER_FLAT: [f64; 2] = [1.5, 3.5];

/// Two angles nearer to each other than this are one (rad): 5 degrees.
const APART: f64 = 5.0 / 90.0 * FRAC_PI_2;

/// Least difference between the smallest and the largest angle (rad): 45 degrees. Below, an error of one degree in
/// setting them makes two at 90.
const LEAST_SPAN: f64 = 0.5 * FRAC_PI_2;

/// Such a least difference if the angles are those of the modelled finger, which are not extrapolated (rad): 15
/// degrees.
const LEAST_ASSUMED_SPAN: f64 = LEAST_SPAN / 3.0;

/// A point this far off is mentioned (rad): 3 degrees, three times what a calibration should reach.
const WORTH_A_WORD: f64 = 3.0 / 90.0 * FRAC_PI_2;

/// A point this far off is refused (rad): 10 degrees.
const TOO_FAR: f64 = 10.0 / 90.0 * FRAC_PI_2;

/// A calibrated strip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlexCurve {
    /// Resistance of the flat strip, R0 (ohm).
    pub flat_ohm: f64,
    /// Rise with the angle, s (ohm/rad).
    pub ohm_per_rad: f64,
    /// Residual of each point, read less set (rad).
    pub residuals: Vec<f64>,
    /// The fit itself.
    line: StraightLine,
}

impl FlexCurve {
    /// Fits a strip; two points at least, a right angle apart if possible. Also returns remarks.
    pub(super) fn fit(points: &[Point], input: &Input, assumed: bool) -> Result<(Self, Vec<String>), CalibrationFault> {
        check(points, SensorKind::Flex, input, FRAC_PI_2)?;
        let distinct = merged(points, APART);
        if distinct.len() < 2 {
            return Err(CalibrationFault(format!(
                "{} of at least 2 different angles: take one with the finger straight and one bent by 90 degrees, better \
                 also 30 and 60",
                distinct.len()
            )));
        }
        let (least, most) = (distinct[0].stimulus, distinct[distinct.len() - 1].stimulus);
        if most - least < if assumed { LEAST_ASSUMED_SPAN } else { LEAST_SPAN } {
            let [from, to] = [least, most].map(|angle| SensorKind::Flex.with_unit(angle));
            return Err(CalibrationFault(format!(
                "the flex strip has points from {from} to {to} only: angles at least 45 degrees apart are needed, best 0 \
                 and 90"
            )));
        }
        rises(&distinct, input)?;
        let weighted = |p: &Point| WeightedPoint { x: p.stimulus, y: input.ohm(p.counts), weight: 1.0 };
        let line = StraightLine::through(&points.iter().map(weighted).collect::<Vec<_>>());
        // The points differ in angle, or else they would have been refused as too close: its numbers left the range.
        let line = line.ok_or_else(|| CalibrationFault::divider(input))?;
        let residuals = points.iter().map(|p| (input.ohm(p.counts) - line.at(p.stimulus)) / line.slope).collect();
        let curve = Self { flat_ohm: line.intercept, ohm_per_rad: line.slope, residuals, line };
        curve.is_such_a_part(input)?;
        let words = curve.remarks(points)?;
        Ok((curve, words))
    }

    /// Angle at a resistance (rad).
    pub fn angle(&self, ohm: f64) -> f64 {
        (ohm - self.flat_ohm) / self.ohm_per_rad
    }

    /// Resistance at an angle (ohm).
    pub fn ohm(&self, angle: f64) -> f64 {
        self.flat_ohm + self.ohm_per_rad * angle
    }

    /// Half the width of the 95 % interval of the calibration at an angle (rad); none with two points.
    pub fn angle_interval(&self, angle: f64) -> Option<f64> {
        Some(self.line.interval_at(angle)? / self.ohm_per_rad)
    }

    /// Half the width of the 95 % interval of its gain, as a share of it; none with two points.
    pub fn gain_interval(&self) -> Option<f64> {
        Some(self.line.slope_interval()? / self.ohm_per_rad)
    }

    /// Resistance at 90 degrees over flat.
    pub fn bent_over_flat(&self) -> f64 {
        self.ohm(FRAC_PI_2) / self.flat_ohm
    }

    fn is_such_a_part(&self, input: &Input) -> Result<(), CalibrationFault> {
        let within = |[least, most]: [f64; 2], value: f64| value >= least && value <= most;
        if !within(FLAT_OHM, self.flat_ohm) {
            let resistor = input.divider.fixed_ohm;
            let [low, high] = FLAT_OHM.map(|flat| three_digits(1e-3 * resistor * flat / self.flat_ohm));
            let said = three_digits(1e-3 * resistor);
            return Err(CalibrationFault(format!(
                "the flat strip comes out at {} kΩ, but such parts have 17.5 to 32.5: the resistor beside it is not the \
                 {said} kΩ entered but {low} to {high}, or it is another part",
                three_digits(self.flat_ohm * 1e-3)
            )));
        }
        let ratio = self.bent_over_flat();
        if !within(BENT_OVER_FLAT, ratio) {
            let hint = if ratio < BENT_OVER_FLAT[0] {
                "it slips on the finger, is bent only in part, or bends towards its wrong side"
            } else {
                "the angles are smaller than what was bent, or the part is damaged"
            };
            return Err(CalibrationFault(format!(
                "bent by 90 degrees the strip comes out at {} times its flat resistance, but such parts rise to 1.5 to 3.5 \
                 times: {hint}",
                three_digits(ratio)
            )));
        }
        Ok(())
    }

    fn remarks(&self, points: &[Point]) -> Result<Vec<String>, CalibrationFault> {
        let mut words = Vec::new();
        if points.len() == 2 {
            words.push("two points fit any line: take a third one to check the fit".to_owned());
        }
        let worst = points.iter().zip(&self.residuals).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let Some((point, residual)) = worst else { return Ok(words) };
        let (at, off) =
            (SensorKind::Flex.with_unit(point.stimulus), format!("{:.1} degrees", residual.to_degrees().abs()));
        if residual.abs() > TOO_FAR {
            return Err(CalibrationFault(format!("{at} is {off} off the curve through the others: take it again")));
        }
        if residual.abs() > WORTH_A_WORD {
            words.push(format!("{at} is {off} off the line; take it again if the strip may have slipped"));
        }
        Ok(words)
    }
}

/// A strip that is bent further has more resistance.
fn rises(distinct: &[Point], input: &Input) -> Result<(), CalibrationFault> {
    for pair in distinct.windows(2) {
        let (before, after) = (input.ohm(pair[0].counts), input.ohm(pair[1].counts));
        if after <= before {
            let kilo = |ohm: f64| format!("{} kΩ", three_digits(ohm * 1e-3));
            let [from, to] = [0, 1].map(|i| SensorKind::Flex.with_unit(pair[i].stimulus));
            return Err(CalibrationFault(format!(
                "between {from} and {to} the resistance falls from {} to {}, but it must rise: the strip bends towards its \
                 wrong side, its input is wired the other way round, or two angles were mixed up",
                kilo(before),
                kilo(after)
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Board, Sensor};
    use crate::electronics::Divider;

    fn input() -> Input {
        Input::on(&Board::default(), Sensor::FLEX_LEFT)
    }

    /// Points of a strip with a flat resistance and a ratio at 90 degrees, behind some input.
    fn points(flat: f64, ratio: f64, degrees: &[f64], input: &Input) -> Vec<Point> {
        let ohm = |deg: f64| flat * (1.0 + (ratio - 1.0) * deg / 90.0);
        let point = |&deg: &f64| Point {
            stimulus: deg.to_radians(),
            counts: input.counts(ohm(deg)),
            spread: 0.0,
            readings: 50,
        };
        degrees.iter().map(point).collect()
    }

    fn fault(points: &[Point]) -> String {
        FlexCurve::fit(points, &input(), false).expect_err("refused").to_string()
    }

    #[test]
    fn a_straight_strip_is_found_exactly() -> Result<(), CalibrationFault> {
        for degrees in [&[0.0, 90.0][..], &[0.0, 30.0, 60.0, 90.0], &[10.0, 75.0]] {
            let (curve, _) = FlexCurve::fit(&points(22e3, 2.2, degrees, &input()), &input(), false)?;
            assert!((curve.flat_ohm - 22e3).abs() < 1e-6 && (curve.bent_over_flat() - 2.2).abs() < 1e-9);
            assert!((curve.angle(curve.ohm(0.7)) - 0.7).abs() < 1e-12);
        }
        let two = FlexCurve::fit(&points(22e3, 2.2, &[0.0, 90.0], &input()), &input(), false)?;
        assert!(two.0.angle_interval(1.0).is_none() && two.1[0].contains("two points"));
        Ok(())
    }

    #[test]
    fn an_interval_holds_the_truth_in_95_of_100_cases() -> Result<(), CalibrationFault> {
        // Angles set wrong by a degree or so: the interval at 45 degrees should hold the truth in 95 of 100.
        let mut held = 0;
        let mut drawn = 0x9e37_79b9_7f4a_7c15_u64;
        let mut wrong = || {
            // A sum of twelve even numbers is nearly normal; any generator will do.
            let mut even = || {
                drawn = drawn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (drawn >> 11) as f64 / (1u64 << 53) as f64
            };
            (0..12).map(|_| even()).sum::<f64>() - 6.0
        };
        for _ in 0..400 {
            let mut points = points(25e3, 2.3, &[0.0, 20.0, 45.0, 70.0, 90.0], &input());
            for point in &mut points {
                let ohm = 25e3 * (1.0 + 1.3 * (point.stimulus.to_degrees() + wrong()) / 90.0);
                point.counts = input().counts(ohm);
            }
            let (curve, _) = FlexCurve::fit(&points, &input(), false)?;
            let read = curve.angle(25e3 * (1.0 + 1.3 * 0.5));
            let half = curve.angle_interval(read).expect("five points");
            held += u32::from((read.to_degrees() - 45.0).abs() <= half.to_degrees());
        }
        // 380 expected, with a deviation of 4.4.
        assert!((365..=395).contains(&held), "{held} of 400");
        Ok(())
    }

    #[test]
    fn too_few_and_too_close_points_are_refused() {
        let of = |degrees: &[f64]| points(25e3, 2.2, degrees, &input());
        assert!(fault(&[]).contains("0 of at least 2 different angles"));
        assert!(fault(&of(&[0.0, 2.0, 4.0])).contains("1 of at least 2"));
        assert!(fault(&of(&[0.0, 30.0])).contains("45 degrees apart"));
        assert!(fault(&of(&[0.0, 120.0])).contains("outside"));
        assert!(fault(&of(&[0.0, f64::NAN])).contains("outside"));
    }

    #[test]
    fn a_wrong_resistor_is_reported_with_the_likely_range() {
        // Behind 10 kΩ instead of 47, a strip of 25 kΩ looks like one of 117.
        let actual = Input { divider: Divider::of_strip(10e3), ..input() };
        let text = fault(&points(25e3, 2.2, &[0.0, 45.0, 90.0], &actual));
        assert!(text.contains("117") || text.contains("118"), "{text}");
        assert!(text.contains("7") && text.contains("13.0"), "10 is between 7 and 13: {text}");
    }

    #[test]
    fn a_strip_the_wrong_way_round_is_named() {
        let swapped = Input { divider: Divider::of_pad(47e3), ..input() };
        assert!(fault(&points(25e3, 2.2, &[0.0, 45.0, 90.0], &swapped)).contains("wired the other way round"));
        assert!(fault(&points(25e3, 1.2, &[0.0, 45.0, 90.0], &input())).contains("slips"));
        let mut mixed = points(25e3, 2.2, &[0.0, 45.0, 90.0], &input());
        (mixed[1].counts, mixed[2].counts) = (mixed[2].counts, mixed[1].counts);
        assert!(fault(&mixed).contains("mixed up"));
    }

    #[test]
    fn broken_wires_and_slipped_points_are_named() {
        let mut open = points(25e3, 2.2, &[0.0, 45.0, 90.0], &input());
        open[2].counts = 4095.0;
        assert!(fault(&open).contains("open"));
        open[2].counts = 0.0;
        assert!(fault(&open).contains("short-circuited"));
        open[2].counts = 5000.0;
        assert!(fault(&open).contains("counts to 4095"));
        let slipped = |off: f64| {
            let mut points = points(25e3, 2.2, &[0.0, 30.0, 60.0, 90.0], &input());
            points[2].counts = input().counts(25e3 * (1.0 + 1.2 * (60.0 + off) / 90.0));
            points
        };
        assert!(fault(&slipped(25.0)).contains("take it again"));
        let (_, words) = FlexCurve::fit(&slipped(8.0), &input(), false).expect("still a calibration");
        assert!(words.len() == 1 && words[0].contains("60.0 degrees"), "{words:?}");
    }
}
