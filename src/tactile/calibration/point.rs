//! What a calibration is made from: a known angle or weight, and what the board read at it.

use super::Fault;
use super::input::{Input, RangeEnd};
use crate::board::Sensor;
use palpate_geometry::units::{kg_of_load, three_digits};
use serde::{Deserialize, Serialize};

/// The two kinds of sensors, each calibrated against another quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorKind {
    /// A strip that reads an angle.
    Flex,
    /// A pad that reads a force.
    Pad,
}

impl SensorKind {
    /// The kind of a sensor.
    pub fn of(sensor: Sensor) -> Self {
        if sensor.is_flex() { Self::Flex } else { Self::Pad }
    }

    /// What it is called in messages.
    pub fn label(self) -> &'static str {
        match self {
            Self::Flex => "flex strip",
            Self::Pad => "pad",
        }
    }

    /// A known angle (rad) or force (N) in the unit in which people set it: degrees, or kilograms of load.
    pub fn shown(self, stimulus: f64) -> f64 {
        match self {
            Self::Flex => stimulus.to_degrees(),
            Self::Pad => kg_of_load(stimulus),
        }
    }

    /// The way back from what people set: degrees to rad, kilograms of load to N.
    pub fn stimulus(self, shown: f64) -> f64 {
        match self {
            Self::Flex => shown.to_radians(),
            Self::Pad => shown * palpate_geometry::units::STANDARD_GRAVITY,
        }
    }

    /// The unit of [`SensorKind::shown`].
    pub fn unit(self) -> &'static str {
        match self {
            Self::Flex => "degrees",
            Self::Pad => "kg",
        }
    }

    /// A known angle or weight in words.
    pub fn told(self, stimulus: f64) -> String {
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
    /// How many readings were averaged.
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

/// What every point must fulfil, of whatever sensor.
pub(super) fn check(points: &[Point], kind: SensorKind, input: &Input, most: f64) -> Result<(), Fault> {
    if !input.is_possible() {
        return Err(Fault::Divider { ohm: input.divider.fixed_ohm, volt: input.reference_volt });
    }
    for point in points {
        let at = || kind.told(point.stimulus);
        // A hair more, for what was set in degrees or kilograms.
        if !(point.stimulus >= -1e-9 && point.stimulus <= most * (1.0 + 1e-9)) {
            return Err(Fault::OutOfRange { at: at(), most: kind.told(most), kind: kind.label() });
        }
        let full_scale = input.full_scale;
        if !(point.counts >= 0.0 && point.counts <= f64::from(full_scale)) {
            return Err(Fault::NotCounts { at: at(), counts: point.counts, full_scale });
        }
        match (kind, input.range_end(point.counts)) {
            // An unloaded pad does not conduct.
            (SensorKind::Pad, Some(RangeEnd::Open)) | (_, None) => {}
            (SensorKind::Flex, Some(RangeEnd::Open)) => {
                return Err(Fault::OpenCircuit { at: at(), counts: point.counts });
            }
            (SensorKind::Flex, Some(RangeEnd::Short)) => {
                return Err(Fault::ShortCircuit { at: at(), counts: point.counts });
            }
            (SensorKind::Pad, Some(RangeEnd::Short)) => {
                return Err(Fault::Saturated { at: at(), counts: point.counts, resistor_ohm: input.divider.fixed_ohm });
            }
        }
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
