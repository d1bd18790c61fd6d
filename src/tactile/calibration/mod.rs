//! From a board's counts to angle, curvature, force and pressure: [`super::electronics`] run backwards, with what was
//! measured of the parts.
//!
//! ```text
//! counts --divider--> resistance R --- strip: R = R0 + s theta ---> angle theta --- / 55.37 mm --> curvature
//!                     conductance G -- pad:   G = a F^b ---------> force F ------- / 169.7 mm² -> pressure
//! ```
//!
//! A [`Record`] is what was measured of a part at known angles or weights; a [`Calibration`] is the curve fitted to it.
//! Only records are stored, so that a better fit serves old ones too, as a better calibration serves old trials:
//! [`Readout`] derives [`super::Signals`] from stored readings with whatever calibrations it is given.
//!
//! Calibrations belong to parts, which have names, and not to places: parts get swapped. What is known of parts of
//! these kinds from data sheets is used to refuse calibrations that cannot be; see [`CalibrationFault`].

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

pub use adapt::{EmptyHand, KnownWeight};
pub use empty_close::EmptyClose;
pub use fault::CalibrationFault;
pub use flex_curve::FlexCurve;
pub use input::{Input, RangeEnd};
pub use pad_curve::{BendingZero, PadCurve};
pub use point::{Point, SensorKind};
pub use procedure::{Procedure, Unsettled, plan};
pub use readout::{Derived, Readout, SensorEstimate};
pub use record::{Calibration, Curve, Record};
pub use straight_line::StraightLine;
pub use zero::{Drift, DriftLevel, Unrest, Zero};
