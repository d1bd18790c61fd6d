//! Grippers, simulated, real or replayed, behind one interface: command a pressure, read frames. Grasping, recording and
//! recognition are written once, against this trait.

mod conductor;
mod replay;
mod serial;
mod sim;

pub use conductor::{Conductor, VENT};
pub use replay::ReplayRig;
pub use serial::{SerialPlan, SerialRig};

use palpate_device::serial::LinkEvent;
use palpate_sim::frame::{Frame, Quality};
use palpate_sim::gripper::Phase;
use palpate_sim::physics::SimulationError;
use palpate_tactile::trial::PhaseMark;

/// What happens next on a rig.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The control box wants the pressure for this actuation tick.
    ActuationDue {
        /// Which tick, from 0.
        tick: u32,
    },
    /// A sample was taken.
    Sampled(Frame),
    /// A board said something, or its connection changed.
    Heard(LinkEvent),
    /// The control box of a real gripper does something else from now on.
    Commanded(PhaseMark),
    /// The trial is over.
    Finished,
}

/// Why a rig had to stop.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigError {
    /// The simulation left the range of numbers.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The board of the real gripper; the sentence says what is wrong and what to try.
    #[error("{0}")]
    Board(String),
}

/// A two-finger gripper that runs on a clock of its own.
pub trait Rig {
    /// Where its frames come from, as recorded with a trial: `sim`, `serial`, `replay`.
    fn name(&self) -> &'static str;

    /// Lets time pass until the next event.
    fn next_event(&mut self) -> Result<Event, RigError>;

    /// Sets the line pressure (bar) from now on.
    fn command(&mut self, bar: f64, phase: Phase);

    /// How far its frames so far can be trusted.
    fn quality(&self) -> Quality;

    /// What else should be known of its frames so far, in sentences.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
}
