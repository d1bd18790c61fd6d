//! The electronics of a sensorised gripper (paper, section IV-B): a part whose resistance follows its load or bend, a
//! divider to a voltage, a converter to counts.
//!
//! | step | flex strip | force pad |
//! |---|---|---|
//! | part | R = R0 (1 + s theta) | G = a F^b from a threshold on |
//! | divider | R_f to the supply, strip to ground | pad to the supply, R_m to ground |
//! | converter | count c of 2^bits stands for the share c / 2^bits of the supply | the same |
//!
//! Used by the sensor model of simulated trials ([`super::model`]) and by the emulator's sensors. Random and tuned
//! values are there; this module holds only the laws.

mod converter;
mod divider;
mod flex_strip;
mod force_pad;

pub use converter::Converter;
pub use divider::{Divider, Wiring};
pub use flex_strip::{FlexStrip, StripPart};
pub use force_pad::{ForcePad, PadPart};
