//! A gripper that is not there: fingers from the physics, sensors from the electronics, a board that prints what the
//! firmware prints, and a pseudo-terminal that a host opens like any port. What it is made of is hidden, and can be told.
//!
//! | file | holds |
//! |---|---|
//! | `hand` | what the fingers do: by themselves, driven by a host, or on the bench by a script |
//! | `parts` | strips, pads, dividers: the hidden values |
//! | `board` | the firmware, statement by statement |
//! | `gripper` | all of them, and the line with its faults; no port, no clock of its own |
//! | `port` | the pseudo-terminal and its link (Unix) |

mod board;
mod faults;
mod gripper;
mod hand;
mod parts;
#[cfg(unix)]
mod port;
mod script;
#[cfg(test)]
mod tests;
mod uart;

pub use board::{BoardSetup, FirmwareBoard, OVERSAMPLE, WATCHDOG_US};
pub use faults::{Fault, FaultKind, fault_help, parse_faults};
pub use gripper::{EmulatedGripper, EmulatorEvent, EmulatorEventKind, EmulatorSetup};
pub use hand::HandPlan;
pub use parts::{HiddenParts, PadSetup, Stimulus, StripSetup};
#[cfg(unix)]
pub use port::{PortSetup, ServeError, serve};
pub use script::{ScriptError, Step, parse_script, parse_step};
pub use uart::misread;
