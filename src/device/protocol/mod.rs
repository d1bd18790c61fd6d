//! The wire: bytes of a sensor board to stamped readings. No ports and no threads here; bytes and their times of arrival
//! go in, and memory is bounded whatever they are.
//!
//! ```text
//! bytes -> lines -> checksum -> fields -> shape -> clock -> readings, gaps, remarks
//!         (lines)  (checksum)  (fields)  (shape)  (clock, delay_line, counters)
//! ```
//!
//! Not read: binary frames (COBS). Text at 1 kHz and 8 channels is 70 kB/s, which USB carries with ease.

mod cadence;
mod capture;
mod checksum;
mod clock;
mod columns;
mod counters;
mod decoder;
#[cfg(test)]
mod decoder_tests;
mod delay_line;
mod fields;
mod handshake;
mod line_log;
mod lines;
mod reply;
mod saturation;
mod shape;

pub use capture::CaptureReader;
pub use checksum::checksum;
pub use decoder::{DecodedEvent, Decoder};
pub use line_log::{ConsoleLine, LineKind};
pub use lines::MAX_LINE;
pub use reply::BoardReply;
pub use saturation::{AdcRange, Saturation};
