//! Grippers behind one interface: events out, line pressure in. Simulated, on a serial port, or replayed; the grasp
//! controller ([`crate::grasping::GraspController`]) drives all three alike.

mod emulated;
mod replayed;
mod serial;
mod simulated;
mod stream;

pub use emulated::{EmulatedStream, SharedEmulator};
pub use replayed::ReplayedGripper;
pub use serial::SerialGripper;
pub use simulated::SimulatedGripper;
pub use stream::{BoardStream, Listen, NotOpened, listen_to_port};

use palpate_device::protocol::BoardEvent;
use palpate_device::serial::SendError;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Phase;
use palpate_sim::physics::SimulationError;
use std::time::Duration;

/// The next event of a gripper.
#[derive(Clone, Debug, PartialEq)]
pub enum GripperEvent {
    /// Time has passed; the line pressure may be due.
    Tick,
    /// A sample of the simulation.
    Sampled(Frame),
    /// Bytes, a reading, a gap or a reply of a board.
    Board(BoardEvent),
    /// A sample of an imported trial.
    Signals {
        /// Its time (s).
        t_s: f64,
        /// A value per channel.
        values: Vec<f32>,
    },
    /// The end: no event follows.
    Finished,
}

/// A gripper that cannot go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GripperError {
    /// The simulation left the range of numbers.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A line could not be sent to the board.
    #[error(transparent)]
    Board(#[from] SendError),
}

/// A two-finger gripper that runs on a clock of its own.
pub trait Gripper {
    /// Its clock (s): simulated time, or the clock of the board's readings.
    fn now_s(&self) -> f64;

    /// The next event. Waits up to `patience` for a board, then returns [`GripperEvent::Tick`].
    fn next_event(&mut self, patience: Duration) -> Result<GripperEvent, GripperError>;

    /// Sets the line pressure (bar) from now on.
    fn set_pressure(&mut self, bar: f64, phase: Phase) -> Result<(), GripperError>;

    /// Lets the air out at once.
    fn vent(&mut self) -> Result<(), GripperError>;

    /// Why it ended early: damaged captured bytes.
    fn cut_short(&self) -> Option<String> {
        None
    }
}
