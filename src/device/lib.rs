//! Sensor boards: bytes in, readings out; line pressure out.
//!
//! # Terms
//!
//! A **board** on a serial **port** sends lines of counts. The **protocol** decodes them to **readings** with time
//! stamps, **gaps** where readings are missing, and **replies**. A **link** reads a port in threads of its own and keeps
//! the bytes. The **doctor** finds faults between board and computer. The **emulator** imitates board, gripper and
//! control box, with random sensors and optional faults.
//!
//! # Modules, lowest layer first
//!
//! A module imports only from lower layers.
//!
//! | layer | module | holds |
//! |---|---|---|
//! | 0 | [`protocol`] | serial parsing: bytes to readings, gaps and replies; clock, checksums, saturation |
//! | 1 | [`serial`] | ports, links, errors with cause and fix |
//! | 1 | [`emulator`] | emulated gripper on a pseudo-terminal: firmware, hand, faults |
//! | 2 | [`doctor`] | diagnosis of port, stream and sensors; crosstalk test |
//!
//! # Example
//!
//! ```
//! use palpate_device::protocol::{BoardEvent, Decoder};
//!
//! let (mut decoder, mut events) = (Decoder::default(), Vec::new());
//! for sample in 0..20 {
//!     let line = format!("{},512,498,33,41\n", sample * 10); // ms, two strips, two pads
//!     decoder.push(line.as_bytes(), f64::from(sample) * 0.01, &mut events);
//! }
//! let readings = events.iter().filter(|event| matches!(event, BoardEvent::Reading(_))).count();
//! assert!(readings >= 10);
//! ```

pub mod doctor;
pub mod emulator;
pub mod protocol;
pub mod serial;
