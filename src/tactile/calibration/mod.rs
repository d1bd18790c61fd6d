//! From a board's counts to angle, curvature, force and pressure: the inverse of [`super::electronics`], with the
//! measured constants of the parts.
//!
//! ```text
//! counts --divider--> resistance R --- strip: R = R0 + s theta ---> angle theta --- / 55.37 mm --> curvature
//!                     conductance G -- pad:   G = a F^b ---------> force F ------- / 169.7 mm² -> pressure
//! ```
//!
//! A [`Record`] holds the readings of a part at known angles or weights; a [`Calibration`] is the curve fitted to it.
//! Only records are stored, so a better fit also applies to old records, and a better calibration to old trials:
//! [`Readout`] derives [`super::Signals`] from stored readings with the calibrations that it is given.
//!
//! Calibrations belong to parts, which have names, and not to places: parts get swapped. Calibrations that the data
//! sheets of such parts rule out are refused; see [`CalibrationFault`].

mod adapt;
mod empty_close;
mod fault;
mod flex_curve;
mod input;
mod pad_curve;
#[cfg(test)]
mod pad_curve_tests;
mod point;
mod procedure;
mod readout;
#[cfg(test)]
mod readout_tests;
mod record;
mod straight_line;
mod zero;

pub use crate::sensor_list::SensorKind;
pub use adapt::{EmptyHand, KnownWeight};
pub use empty_close::EmptyClose;
pub use fault::CalibrationFault;
pub use flex_curve::FlexCurve;
pub use input::{Input, RangeEnd};
pub use pad_curve::{BendingZero, PadCurve};
pub use point::Point;
pub use procedure::{Procedure, Unsettled, plan};
pub use readout::{Derived, Readout, SensorEstimate};
pub use record::{Calibration, Curve, Record};
pub use straight_line::StraightLine;
pub use zero::{Drift, DriftLevel, Unrest, Zero};
