//! The emulated gripper: fingers from the physics, sensors from the electronics, a board that runs the firmware, and a
//! pseudo-terminal that a host opens like any port. Its sensors' values are hidden, and can be printed.
//!
//! | file | holds |
//! |---|---|
//! | `hand` | the fingers: driven by a programme, a host, or a bench script |
//! | `parts` | strips, pads, dividers: the hidden values |
//! | `firmware` | the board's firmware, compiled from `assets/firmware/due_gripper` |
//! | `gripper` | all of them, and the line with its faults; no port, no clock of its own |
//! | `port` | the pseudo-terminal and its link (Unix) |

mod event;
mod faults;
mod firmware;
#[cfg(test)]
mod firmware_tests;
mod gripper;
mod hand;
mod parts;
#[cfg(unix)]
mod port;
mod script;
#[cfg(test)]
mod tests;
mod uart;

pub use event::{EmulatorError, EmulatorEvent, EmulatorEventKind};
pub use faults::{EmulatedFault, FaultKind, fault_help, parse_faults};
pub use gripper::{EmulatedGripper, EmulatorSetup};
pub use hand::HandPlan;
pub use parts::{HiddenParts, PadSetup, StripSetup};
#[cfg(unix)]
pub use port::{PortSetup, serve};
pub use script::{Step, parse_script};
pub use uart::misread;
