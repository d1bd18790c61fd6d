//! Serial link to the gripper's board.

mod baud;
mod link;
#[cfg(all(test, unix))]
mod link_tests;
mod port_error;
mod ports;
mod queue;
mod reader;
mod replay;
mod scan;
mod shared;

pub use baud::{Baud, BaudError};
pub(crate) use link::is_capture;
pub use link::{LinkStatus, SendError, SerialLink};
pub use port_error::{ACCESS_RULE, MODEM_MANAGER_COMMAND, MODEM_MANAGER_RULE, PortError, PortTrouble, is_running};
pub use ports::{BoardKind, PortInfo, UsbIdentity, list_ports};
pub use shared::{LinkOptions, LinkState};
