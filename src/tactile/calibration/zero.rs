//! Zeros of the sensors: tare, dynamic re-zero, and drift.
//!
//! Strips creep and pads are squeezed by their finger, so the reading of a finger at rest drifts. A [`Zero`] holds the
//! reading of each sensor without contact and pressure: taken on request it is a tare; taken from the window before
//! each trial's closing it is the dynamic calibration that the paper proposes in its outlook. It is subtracted, unless
//! it is so large that it must have another cause.

use crate::electronics::PadPart;
use crate::sensor_list::{Sensor, SensorKind};
use serde::{Deserialize, Serialize};

/// Readings at rest: the angle of a strip (rad), the conductance of a pad (S) or a raw value, in the order of the
/// gripper's sensors; none where it was not read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Zero {
    /// Offset of each sensor; of those beyond the end, none.
    pub offsets: Vec<Option<f64>>,
}

impl Zero {
    /// The offset of a sensor.
    pub fn of(&self, sensor: Sensor) -> Option<f64> {
        self.offsets.get(sensor.index()).copied().flatten()
    }

    /// Sets the offset of a sensor.
    pub fn set(&mut self, sensor: Sensor, offset: Option<f64>) {
        let most = self.offsets.len().max(sensor.index() + 1);
        self.offsets.resize(most, None);
        self.offsets[sensor.index()] = offset;
    }

    /// True where no sensor has an offset.
    pub fn is_none(&self) -> bool {
        self.offsets.iter().all(Option::is_none)
    }
}

/// Reason why readings give no tare.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unrest {
    #[error("only {have} readings arrived: check that the board is sending")]
    TooFew {
        /// Number of readings.
        have: usize,
    },
    #[error("the line pressure is {bar:.2} bar: vent, let the fingers come to rest, and try again")]
    Pressed {
        /// The line pressure (bar).
        bar: f64,
    },
    #[error("the {place} is moving: let the fingers come to rest, and try again", place = .sensor.label())]
    Moving {
        /// Sensor that moves.
        sensor: Sensor,
    },
}

/// Severity of a zero drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DriftLevel {
    /// Within the accuracy of a calibration.
    Steady,
    /// More than that; it is corrected.
    Moved,
    /// So far that it is no drift: it is not corrected.
    TooFar,
}

/// The zero of one sensor against its calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Drift {
    pub sensor: Sensor,
    /// Shift of the zero: an angle (rad), or the apparent force on a pad (N).
    pub moved: f64,
    /// Severity.
    pub level: DriftLevel,
}

/// Beyond this a strip's zero has moved (rad): 1 degree, what a calibration should reach.
const MOVED_RAD: f64 = std::f64::consts::PI / 180.0;
/// Beyond this it is no drift but a bent finger (rad): 15 degrees.
const TOO_FAR_RAD: f64 = 15.0 * MOVED_RAD;
/// Beyond this a pad's zero has moved (N): the pad's threshold.
const MOVED_N: f64 = PadPart::LEAST_FORCE;
/// Beyond this it is no drift but something on the pad (N).
const TOO_FAR_N: f64 = 1.0;

impl Drift {
    /// Judges how far a zero has moved.
    pub(super) fn of(sensor: Sensor, moved: f64) -> Self {
        let (least, most) = match sensor.kind() {
            SensorKind::Flex => (MOVED_RAD, TOO_FAR_RAD),
            SensorKind::Pad => (MOVED_N, TOO_FAR_N),
            // A raw value is read from its rest on, wherever that is.
            SensorKind::Raw => (f64::INFINITY, f64::INFINITY),
        };
        let level = match moved.abs() {
            off if off <= least => DriftLevel::Steady,
            off if off <= most => DriftLevel::Moved,
            _ => DriftLevel::TooFar,
        };
        Self { sensor, moved, level }
    }

    /// Short name of the level, for a badge.
    pub fn badge(&self) -> &'static str {
        match self.level {
            DriftLevel::Steady => "steady",
            DriftLevel::Moved => "moved",
            DriftLevel::TooFar => "too far",
        }
    }

    /// Shift with its unit: `+1.3°`, `0.2 N`.
    pub fn with_unit(&self) -> String {
        // No minus before zero.
        let rounded = |value: f64, steps: f64| (value * steps).round() / steps + 0.0;
        match self.sensor.kind() {
            SensorKind::Flex => format!("{:+.1}°", rounded(self.moved.to_degrees(), 10.0)),
            SensorKind::Pad => format!("{:.2} N", rounded(self.moved, 100.0)),
            SensorKind::Raw => format!("{:+.3}", rounded(self.moved, 1000.0)),
        }
    }

    /// Warning with a remedy; none where the zero is steady.
    pub fn remark(&self) -> Option<String> {
        let (place, moved) = (self.sensor.label(), self.with_unit());
        match self.level {
            DriftLevel::Steady => None,
            DriftLevel::Moved => {
                Some(format!("the zero of the {place} has moved by {moved} since it was calibrated; corrected"))
            }
            DriftLevel::TooFar if self.sensor.is_flex() => Some(format!(
                "the {place} shows {moved} before the closing: the finger was not at rest, or the strip has slipped; not \
                 corrected. Vent, wait, and calibrate it again if it stays"
            )),
            DriftLevel::TooFar => Some(format!(
                "the {place} shows {moved} before the closing: something touches it, or it is pinched; not corrected. \
                 Free it, and calibrate it again if it stays"
            )),
        }
    }
}
