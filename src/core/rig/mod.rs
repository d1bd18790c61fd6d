//! Grippers, simulated or replayed, behind one interface: command a pressure, read frames. Grasping, recording and
//! recognition are written once, against this trait.

mod replay;
pub mod serial;
mod sim;

pub use replay::ReplayRig;
pub use sim::SimRig;

use crate::gripper::Phase;
use crate::physics::SimulationError;
use crate::trial::{Frame, Quality};

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
    /// The trial is over.
    Finished,
}

/// Why a rig had to stop.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigError {
    /// The simulation left the range of numbers.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// A two-finger gripper that runs on a clock of its own.
pub trait Rig {
    /// Where its frames come from, as recorded with a trial: `sim`, `replay`.
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
