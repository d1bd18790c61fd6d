//! Calibration of a part: its measured points, and the curve through them.

use super::flex_curve::FlexCurve;
use super::input::Input;
use super::pad_curve::{BendingZero, PadCurve};
use super::point::Point;
use super::{CalibrationFault, RangeEnd};
use crate::sensor_list::{Sensor, SensorKind};
use serde::{Deserialize, Serialize};

/// Longest name of a part that is kept (characters).
const LONGEST_NAME: usize = 80;

/// Measured points of a part: the form in which calibrations are stored and exchanged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Name of the part, such as the number written on it.
    pub part: String,
    pub kind: SensorKind,
    /// The input and converter it was measured with.
    pub input: Input,
    /// The known angles (rad) or forces (N), and what was read.
    pub points: Vec<Point>,
    /// Bending zero of a pad, where an empty close was recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending: Option<BendingZero>,
    /// True where the angles or forces were not set but assumed; see [`super::EmptyHand`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub assumed: bool,
    /// Note by the user or the program.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
}

/// The curve through the points.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Curve {
    /// Of a flex strip.
    Flex(FlexCurve),
    /// Of a force pad.
    Pad(PadCurve),
}

/// A record with the curve fitted to it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Measured points.
    #[serde(flatten)]
    pub record: Record,
    /// Fitted curve.
    pub curve: Curve,
    /// Remarks, in sentences.
    pub warnings: Vec<String>,
}

impl Calibration {
    /// Fits the curve; refuses what such a part cannot be.
    pub fn fit(record: Record) -> Result<Self, CalibrationFault> {
        if record.part.trim().is_empty() || record.part.chars().count() > LONGEST_NAME {
            return Err(CalibrationFault(
                "the part needs a name, such as the number written on it: calibrations belong to parts, and parts get swapped"
                    .to_owned(),
            ));
        }
        let (curve, warnings) = match record.kind {
            SensorKind::Flex => {
                let (curve, warnings) = FlexCurve::fit(&record.points, &record.input, record.assumed)?;
                (Curve::Flex(curve), warnings)
            }
            SensorKind::Pad => {
                let (curve, warnings) = PadCurve::fit(&record.points, &record.input)?;
                (Curve::Pad(curve), warnings)
            }
            SensorKind::Raw => {
                return Err(CalibrationFault(format!("\"{}\" is a raw sensor, which has no calibration", record.part)));
            }
        };
        match &record.bending {
            Some(_) if record.kind == SensorKind::Flex => Err(CalibrationFault::no_bending()),
            Some(bending) if !bending.is_possible() => Err(CalibrationFault::bending_too_short(0, 0.0)),
            _ => Ok(Self { record, curve, warnings }),
        }
    }

    /// Refuses to be used for a sensor of the other kind.
    pub fn check_fits(&self, sensor: Sensor) -> Result<(), CalibrationFault> {
        let wanted = sensor.kind();
        if self.record.kind == wanted {
            return Ok(());
        }
        let (made, part, place) = (self.record.kind.label(), &self.record.part, sensor.label());
        Err(CalibrationFault(format!("\"{part}\" is calibrated as a {made}, but the {place} is a {}", wanted.label())))
    }

    /// Angle (rad) or force (N) of a reading, without any zero. None where the reading
    /// is at an end of the range; a pad that does not conduct is unloaded.
    pub fn stimulus(&self, input: &Input, counts: f64) -> Option<f64> {
        match (&self.curve, input.range_end(counts)) {
            (Curve::Flex(curve), None) => Some(curve.angle(input.ohm(counts))),
            (Curve::Pad(curve), None | Some(RangeEnd::Open)) => {
                Some(curve.force(input.siemens(counts) - curve.idle_siemens))
            }
            (Curve::Flex(_), Some(_)) | (Curve::Pad(_), Some(RangeEnd::Short)) => None,
        }
    }

    /// Residuals of its points, in the same order, read less set: in rad, or as a share of the force; none where a
    /// pad did not conduct.
    pub fn residuals(&self) -> Vec<Option<f64>> {
        match &self.curve {
            Curve::Flex(curve) => curve.residuals.iter().map(|r| Some(*r)).collect(),
            Curve::Pad(curve) => curve.residuals.clone(),
        }
    }

    /// Half-width of the 95 % interval of its gain as a share, at the middle of the usual range; none
    /// where the points do not determine it.
    pub fn gain_interval(&self) -> Option<f64> {
        match &self.curve {
            Curve::Flex(curve) => curve.gain_interval(),
            Curve::Pad(curve) => curve.force_interval(1.0),
        }
    }

    /// Least and largest angle (rad) or force (N) that it was calibrated with.
    pub fn range(&self) -> [f64; 2] {
        let set = self.record.points.iter().map(|point| point.stimulus);
        [set.clone().fold(f64::INFINITY, f64::min), set.fold(f64::NEG_INFINITY, f64::max)]
    }

    /// One-line summary of the fit.
    pub fn summary(&self) -> String {
        let often = |interval: Option<f64>, unit: &str| {
            interval.map_or_else(|| ", interval unknown".to_owned(), |half| format!(" ± {half:.2} {unit} (95 %)"))
        };
        match &self.curve {
            Curve::Flex(curve) => {
                let middle = std::f64::consts::FRAC_PI_4;
                format!(
                    "{:.2} kΩ flat, {:.2} times that at 90 degrees; 45 degrees{}",
                    curve.flat_ohm * 1e-3,
                    curve.bent_over_flat(),
                    often(curve.angle_interval(middle).map(f64::to_degrees), "degrees")
                )
            }
            Curve::Pad(curve) => format!(
                "G = {:.1} µS (F / 1 N)^{:.3} from {:.2} N; 1 N{}",
                curve.gain * 1e6,
                curve.exponent,
                curve.threshold,
                often(curve.force_interval(1.0), "N")
            ),
        }
    }
}
