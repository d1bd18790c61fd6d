//! Errors of a calibration, each with the likely cause and a remedy.

use super::input::Input;
use palpate_geometry::units::three_digits as digits;

/// Error of a calibration with its likely cause and a remedy, as a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct CalibrationFault(pub(super) String);

impl CalibrationFault {
    /// An impossible divider.
    pub(super) fn divider(input: &Input) -> Self {
        let (ohm, volt) = (input.divider.fixed_ohm, input.reference_volt);
        Self(format!(
            "a divider of {ohm} ohm at {volt} V is not possible; give the fixed resistor in ohm, such as 47000 beside a \
             flex strip and 4700 beside a pad"
        ))
    }

    /// A bending zero for a sensor that is not a pad.
    pub(super) fn no_bending() -> Self {
        Self("only a pad has a zero that moves with the bending of its finger".to_owned())
    }

    /// A bending zero without a calibrated strip on the same finger.
    pub fn no_strip(strip: &str) -> Self {
        Self(format!(
            "the bending of the finger is measured by the {strip}, which is not calibrated: calibrate it first"
        ))
    }

    /// An empty close with too few usable readings, or too little curvature that they span (1/m).
    pub(super) fn bending_too_short(have: usize, span: f64) -> Self {
        Self(format!(
            "the empty close has {have} usable readings over {} 1/m of curvature: it must reach at least 5 1/m with the \
             finger's flex strip calibrated, without touching anything",
            digits(span)
        ))
    }

    /// A sensor without a channel, or with too few readings.
    pub(super) fn no_readings(sensor: &str) -> Self {
        Self(format!("the {sensor} has no channel on the board, or too few readings there"))
    }
}
