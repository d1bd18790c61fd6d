//! Errors of a calibration, each with the likely cause and a remedy.

use palpate_geometry::units::three_digits as digits;

/// Error of a calibration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationFault {
    /// Impossible divider.
    #[error(
        "a divider of {ohm} ohm at {volt} V is not possible; give the fixed resistor in ohm, such as 47000 beside a flex \
         strip and 4700 beside a pad"
    )]
    Divider {
        /// Its resistor (ohm).
        ohm: f64,
        /// Its reference (V).
        volt: f64,
    },
    /// Too few points, or all of them close together.
    #[error("{0}")]
    TooFew(String),
    /// Point that such a sensor cannot give, or that contradicts the others.
    #[error("{0}")]
    BadPoint(String),
    /// Fitted curve outside the range of such parts.
    #[error("{0}")]
    ImplausiblePart(String),
    /// Calibration of one kind of sensor for the other.
    #[error("\"{part}\" is calibrated as a {made}, but the {place} is a {wanted}")]
    WrongKind {
        /// The part.
        part: String,
        /// Kind it was calibrated as.
        made: &'static str,
        /// Place where it is to be used.
        place: &'static str,
        /// Kind that the place needs.
        wanted: &'static str,
    },
    /// Bending zero for a sensor that is not a pad.
    #[error("only a pad has a zero that moves with the bending of its finger")]
    NoBending,
    /// Bending zero without a calibrated strip on the same finger.
    #[error("the bending of the finger is measured by the {strip}, which is not calibrated: calibrate it first")]
    NoStrip {
        /// The strip.
        strip: &'static str,
    },
    /// Empty close with too little bending.
    #[error(
        "the empty close has {have} usable readings over {} 1/m of curvature: it must reach at least 5 1/m with the \
         finger's flex strip calibrated, without touching anything", digits(*span)
    )]
    BendingTooShort {
        /// Usable readings.
        have: usize,
        /// Curvature that they span (1/m).
        span: f64,
    },
    /// Strip that hardly bends in an empty close.
    #[error(
        "the {strip} went from {rest:.0} to {bent:.0} counts only: the hand did not close, or the strip is loose, broken or on \
         another channel; `palpate doctor` looks at the signals"
    )]
    NotBent {
        /// The strip.
        strip: &'static str,
        /// Reading at rest (counts).
        rest: f64,
        /// Reading of the closed hand (counts).
        bent: f64,
    },
    /// Sensor without a channel, or with too few readings.
    #[error("the {sensor} has no channel on the board, or too few readings there")]
    NoReadings {
        /// The sensor.
        sensor: &'static str,
    },
    /// Part without a name.
    #[error(
        "the part needs a name, such as the number written on it: calibrations belong to parts, and parts get swapped"
    )]
    NoName,
}
