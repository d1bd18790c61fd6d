//! Calibration points: a known angle or weight, and the board's reading at it.

use super::CalibrationFault;
use super::input::{Input, RangeEnd};
use crate::sensor_list::SensorKind;
use palpate_geometry::units::{kg_of_load, three_digits};
use serde::{Deserialize, Serialize};

impl SensorKind {
    /// Name in messages.
    pub fn label(self) -> &'static str {
        match self {
            Self::Flex => "flex strip",
            Self::Pad => "pad",
            Self::Raw => "raw sensor",
        }
    }

    /// A known angle (rad) or force (N) in the unit in which people set it: degrees, or kilograms of load.
    pub fn shown(self, stimulus: f64) -> f64 {
        match self {
            Self::Flex => stimulus.to_degrees(),
            Self::Pad => kg_of_load(stimulus),
            Self::Raw => stimulus,
        }
    }

    /// The way back from what people set: degrees to rad, kilograms of load to N.
    pub fn stimulus(self, shown: f64) -> f64 {
        match self {
            Self::Flex => shown.to_radians(),
            Self::Pad => shown * palpate_geometry::units::STANDARD_GRAVITY,
            Self::Raw => shown,
        }
    }

    /// The unit of [`SensorKind::shown`].
    pub fn unit(self) -> &'static str {
        match self {
            Self::Flex => "degrees",
            Self::Pad => "kg",
            Self::Raw => "",
        }
    }

    /// A known angle or weight with its unit.
    pub fn with_unit(self, stimulus: f64) -> String {
        format!("{} {}", three_digits(self.shown(stimulus)), self.unit())
    }
}

/// One known angle or weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The angle (rad) or the force (N) that was set.
    pub stimulus: f64,
    /// Mean of the readings (counts).
    pub counts: f64,
    /// Standard deviation of a single reading (counts).
    #[serde(default)]
    pub spread: f64,
    /// Number of averaged readings.
    #[serde(default = "one")]
    pub readings: u32,
}

fn one() -> u32 {
    1
}

impl Point {
    /// Standard error of the mean (counts). A mean cannot be known better than a small part of a count, however many
    /// readings there are: the converter is not that linear.
    pub(super) fn error(&self) -> f64 {
        const BEST_COUNTS: f64 = 0.25;
        (self.spread / f64::from(self.readings.max(1)).sqrt()).max(BEST_COUNTS)
    }
}

/// Checks of every point, for both kinds of sensor.
pub(super) fn check(points: &[Point], kind: SensorKind, input: &Input, most: f64) -> Result<(), CalibrationFault> {
    if !input.is_possible() {
        return Err(CalibrationFault::divider(input));
    }
    let full_scale = input.full_scale;
    for Point { stimulus, counts, .. } in points {
        let at = kind.with_unit(*stimulus);
        // Rounding of values set in degrees or kilograms.
        if !(*stimulus >= -1e-9 && *stimulus <= most * (1.0 + 1e-9)) {
            let (kind, most) = (kind.label(), kind.with_unit(most));
            return Err(CalibrationFault(format!("{at} is outside the range of a {kind}: take 0 to {most}")));
        }
        if !(*counts >= 0.0 && *counts <= f64::from(full_scale)) {
            return Err(CalibrationFault(format!(
                "{counts} is not a reading of a converter that counts to {full_scale} (at {at})"
            )));
        }
        let fault = match (kind, input.range_end(*counts)) {
            // An unloaded pad does not conduct.
            (SensorKind::Pad, Some(RangeEnd::Open)) | (SensorKind::Raw, _) | (_, None) => continue,
            (SensorKind::Flex, Some(RangeEnd::Open)) => format!(
                "at {at} the strip reads {counts:.0} counts, the end of the range: its circuit is open. Check the solder \
                 tabs and the plug; a strip's crimp breaks when it is bent where the cable begins"
            ),
            (SensorKind::Flex, Some(RangeEnd::Short)) => format!(
                "at {at} the strip reads {counts:.0} counts: it is short-circuited, or its pin is connected to ground"
            ),
            (SensorKind::Pad, Some(RangeEnd::Short)) => format!(
                "at {at} the pad reads {counts:.0} counts, the end of the range: with {} kΩ in its divider it \
                 saturates. Take smaller weights, or a smaller resistor (3.3 kΩ)",
                three_digits(input.divider.fixed_ohm * 1e-3)
            ),
        };
        return Err(CalibrationFault(fault));
    }
    Ok(())
}

/// The points by rising stimulus, those that differ by less than `apart` of it put together as their mean.
pub(super) fn merged(points: &[Point], apart: f64) -> Vec<Point> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.stimulus.total_cmp(&b.stimulus));
    let mut groups: Vec<Vec<Point>> = Vec::new();
    for point in sorted {
        match groups.last_mut() {
            Some(group) if point.stimulus - group[0].stimulus < apart => group.push(point),
            _ => groups.push(vec![point]),
        }
    }
    groups
        .iter()
        .map(|group| {
            let mean = |of: &dyn Fn(&Point) -> f64| group.iter().map(of).sum::<f64>() / group.len() as f64;
            Point {
                stimulus: mean(&|p| p.stimulus),
                counts: mean(&|p| p.counts),
                spread: mean(&|p| p.spread),
                readings: group.iter().map(|p| p.readings).sum(),
            }
        })
        .collect()
}
