//! The simulated gripper as a rig.

use super::{Event, Rig, RigError};
use palpate_sim::frame::Quality;
use palpate_sim::gripper::Phase;
use palpate_sim::run::{SimEvent, SimRun};

impl Rig for SimRun {
    fn name(&self) -> &'static str {
        "sim"
    }

    fn next_event(&mut self) -> Result<Event, RigError> {
        Ok(match Self::next_event(self)? {
            SimEvent::ActuationDue { tick } => Event::ActuationDue { tick },
            SimEvent::Sampled(frame) => Event::Sampled(frame),
            SimEvent::Finished => Event::Finished,
        })
    }

    fn command(&mut self, bar: f64, phase: Phase) {
        Self::command(self, bar, phase);
    }

    fn quality(&self) -> Quality {
        Self::quality(self)
    }

    fn notes(&self) -> Vec<String> {
        Self::notes(self)
    }
}
