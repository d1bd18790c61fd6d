//! Serial protocol: bytes of a sensor board to stamped readings, gaps and replies. Independent of ports and threads; memory
//! is bounded whatever the bytes.
//!
//! ```text
//! bytes -> lines -> checksum -> fields -> shape -> clock -> readings, gaps, replies
//!         (lines)  (checksum)  (fields)  (shape)  (clock, delay_line, counters)
//! ```
//!
//! Binary frames (COBS) are not supported: text at 1 kHz and 8 channels is 70 kB/s, which USB carries with ease.

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
pub use decoder::{BoardEvent, Decoder};
pub use line_log::{ConsoleLine, LineKind};
pub use lines::MAX_LINE;
pub use reply::BoardReply;
pub use saturation::{AdcRange, Saturation, SaturationWatch};
