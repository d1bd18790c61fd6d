//! The simulated gripper.

use super::{Gripper, GripperError, GripperEvent};
use palpate_geometry::Pose;
use palpate_sim::gripper::Phase;
use palpate_sim::run::{SimEvent, SimRun};
use std::time::Duration;

/// A simulation as a gripper. Time passes only in [`Gripper::next_event`].
#[derive(Clone, Debug)]
pub struct SimulatedGripper {
    pub(crate) run: SimRun,
    pub(crate) world_from_gripper: Pose,
    actuation_hz: f64,
    now_s: f64,
}

impl SimulatedGripper {
    /// Wraps a simulation of a gripper in this pose, whose line pressure may change `actuation_hz` times a second.
    pub fn new(run: SimRun, world_from_gripper: Pose, actuation_hz: f64) -> Self {
        Self { run, world_from_gripper, actuation_hz, now_s: 0.0 }
    }
}

impl Gripper for SimulatedGripper {
    fn now_s(&self) -> f64 {
        self.now_s
    }

    fn next_event(&mut self, _patience: Duration) -> Result<GripperEvent, GripperError> {
        Ok(match self.run.next_event()? {
            SimEvent::ActuationDue { tick } => {
                self.now_s = f64::from(tick) / self.actuation_hz;
                GripperEvent::Tick
            }
            SimEvent::Sampled(frame) => {
                self.now_s = frame.t;
                GripperEvent::Sampled(frame)
            }
            SimEvent::Finished => GripperEvent::Finished,
        })
    }

    fn set_pressure(&mut self, bar: f64, phase: Phase) -> Result<(), GripperError> {
        self.run.command(bar, phase);
        Ok(())
    }

    fn vent(&mut self) -> Result<(), GripperError> {
        self.set_pressure(0.0, Phase::Release)
    }
}
