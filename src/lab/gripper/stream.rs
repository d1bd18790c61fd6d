//! Stream of a board: a port, a file of captured bytes, or a test stream.

use palpate_device::protocol::{BoardEvent, ConsoleLine};
use palpate_device::serial::{LinkOptions, LinkStatus, PortTrouble, SendError, SerialLink};
use palpate_tactile::board::SensorList;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Stream of a board.
pub trait BoardStream {
    /// Events since the last call; waits up to a time for the first one.
    fn take(&mut self, patience: Duration) -> Vec<BoardEvent>;

    /// Status of the link.
    fn status(&self) -> LinkStatus;

    /// The clock of its readings, now (s).
    fn now_s(&self) -> f64;

    /// Sends a line to the board.
    fn send(&mut self, line: &str) -> Result<(), SendError>;

    /// The newest lines as they came, oldest first.
    fn console(&self) -> Vec<ConsoleLine>;

    /// True when everything was taken and nothing more will come.
    fn is_over(&self) -> bool;
}

impl BoardStream for SerialLink {
    fn take(&mut self, patience: Duration) -> Vec<BoardEvent> {
        Self::take(self, patience)
    }

    fn status(&self) -> LinkStatus {
        Self::status(self)
    }

    fn now_s(&self) -> f64 {
        Self::now_s(self)
    }

    fn send(&mut self, line: &str) -> Result<(), SendError> {
        Self::send(self, line)
    }

    fn console(&self) -> Vec<ConsoleLine> {
        Self::console(self)
    }

    fn is_over(&self) -> bool {
        Self::is_over(self)
    }
}

/// Reason why a stream could not be opened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text}")]
pub struct NotOpened {
    /// Cause and fix, in a sentence.
    pub text: String,
    /// A command that fixes it, where there is one.
    pub command: Option<String>,
    /// Another program has the port open and may close it.
    pub may_pass: bool,
}

impl From<String> for NotOpened {
    fn from(text: String) -> Self {
        Self { text, command: None, may_pass: false }
    }
}

/// Opens a stream of a gripper with these sensors: a port, a file of captured bytes, or the only likely port.
pub type Listen = Arc<dyn Fn(Option<&Path>, SensorList) -> Result<Box<dyn BoardStream>, NotOpened> + Send + Sync>;

/// Opens a serial port of a gripper with these sensors.
pub fn listen_to_port(port: Option<&Path>, sensors: SensorList) -> Result<Box<dyn BoardStream>, NotOpened> {
    let options = LinkOptions { path: port.map(Path::to_owned), sensors, ..LinkOptions::default() };
    let link = SerialLink::open(&options).map_err(|error| NotOpened {
        text: error.to_string(),
        may_pass: error.trouble == PortTrouble::Busy,
        command: error.command,
    })?;
    Ok(Box::new(link))
}
