//! A recorded trial played again: the same frames, whatever is commanded.

use super::{Event, Rig, RigError};
use palpate_sim::frame::{Frame, Quality};
use palpate_sim::gripper::Phase;
use palpate_tactile::trial::Trial;

/// Plays the frames of a trial in order.
#[derive(Clone, Debug)]
pub struct ReplayRig {
    frames: std::vec::IntoIter<Frame>,
    quality: Quality,
}

impl ReplayRig {
    /// A rig that will sample what the trial holds.
    pub fn new(trial: Trial) -> Self {
        Self { frames: trial.frames.into_iter(), quality: trial.info.quality }
    }
}

impl Rig for ReplayRig {
    fn name(&self) -> &'static str {
        "replay"
    }

    fn next_event(&mut self) -> Result<Event, RigError> {
        Ok(self.frames.next().map_or(Event::Finished, Event::Sampled))
    }

    /// What happened has happened.
    fn command(&mut self, _bar: f64, _phase: Phase) {}

    fn quality(&self) -> Quality {
        self.quality.clone()
    }
}
