//! A stored trial as a gripper: the same events in the same order, whatever pressure is set.

use super::{Gripper, GripperError, GripperEvent};
use palpate_device::protocol::DecodedEvent;
use palpate_device::serial::LinkEvent;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Phase;
use palpate_store::BoardTrial;
use palpate_tactile::trial::Trial;
use std::time::Duration;

/// The events of a trial, in order. Captured bytes in a file are replayed by [`super::listen_to_port`].
#[derive(Clone, Debug)]
pub struct ReplayedGripper {
    events: std::vec::IntoIter<GripperEvent>,
    now_s: f64,
}

impl ReplayedGripper {
    /// Replays the frames of a simulated trial.
    pub fn of_frames(trial: Trial) -> Self {
        Self::new(trial.frames.into_iter().map(GripperEvent::Sampled).collect())
    }

    /// Replays the readings and gaps of a recorded trial, in order of time.
    pub fn of_readings(trial: BoardTrial) -> Self {
        let mut timed: Vec<(f64, DecodedEvent)> = vec![(f64::NEG_INFINITY, DecodedEvent::Board(trial.about.board))];
        timed.extend(trial.gaps.into_iter().map(|gap| (gap.from_s.next_up(), DecodedEvent::Gap(gap))));
        timed.extend(trial.readings.into_iter().map(|reading| (reading.t_s, DecodedEvent::Reading(reading))));
        timed.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self::new(timed.into_iter().map(|(_, event)| GripperEvent::Board(LinkEvent::Decoded(event))).collect())
    }

    fn new(events: Vec<GripperEvent>) -> Self {
        Self { events: events.into_iter(), now_s: 0.0 }
    }
}

impl Gripper for ReplayedGripper {
    fn now_s(&self) -> f64 {
        self.now_s
    }

    fn next_event(&mut self, _patience: Duration) -> Result<GripperEvent, GripperError> {
        let event = self.events.next().unwrap_or(GripperEvent::Finished);
        match &event {
            GripperEvent::Sampled(Frame { t, .. }) => self.now_s = *t,
            GripperEvent::Board(LinkEvent::Decoded(DecodedEvent::Reading(reading))) => self.now_s = reading.t_s,
            GripperEvent::Board(_) | GripperEvent::Tick | GripperEvent::Finished => {}
        }
        Ok(event)
    }

    fn set_pressure(&mut self, _bar: f64, _phase: Phase) -> Result<(), GripperError> {
        Ok(())
    }

    fn vent(&mut self) -> Result<(), GripperError> {
        Ok(())
    }
}
