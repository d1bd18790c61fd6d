//! Zeros of the sensors: tare, dynamic re-zero, and drift.
//!
//! Strips creep and pads are squeezed by their finger, so the reading of a finger at rest drifts. A [`Zero`] holds the
//! reading of each sensor without contact and pressure: taken on request it is a tare; taken from the window before
//! each trial's closing it is the dynamic calibration that the paper proposes in its outlook. It is subtracted, unless
//! it is so large that it must have another cause.

use crate::board::Sensor;
use crate::electronics::PadPart;
use serde::{Deserialize, Serialize};

/// Readings at rest: the angle of a strip (rad) or the conductance of a pad (S), in the order of [`Sensor::ALL`]; none
/// where it was not read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Zero {
    /// Offset of each sensor.
    pub offsets: [Option<f64>; 4],
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
        let (least, most) = if sensor.is_flex() { (MOVED_RAD, TOO_FAR_RAD) } else { (MOVED_N, TOO_FAR_N) };
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
        if self.sensor.is_flex() {
            format!("{:+.1}°", self.moved.to_degrees())
        } else {
            format!("{:.2} N", self.moved)
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
