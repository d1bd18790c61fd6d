//! Observation of the board for diagnostics, through the link that the gripper thread already holds: a port cannot be
//! opened twice.

use crate::gripper::BoardStream;
use palpate_device::doctor::{Examination, Observations};
use palpate_device::serial::LinkStatus;
use palpate_tactile::board::Reading;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

/// Request to observe the board for some time.
#[derive(Clone, Debug)]
pub struct ObserveRequest {
    seconds: f64,
    stop: Arc<AtomicBool>,
    observed: Sender<Observations>,
}

impl ObserveRequest {
    /// Asks for an observation of `seconds` (s), ended early by `stop`; the receiver gets the result.
    pub(super) fn new(seconds: f64, stop: Arc<AtomicBool>) -> (Self, Receiver<Observations>) {
        let (observed, receiver) = channel();
        (Self { seconds, stop, observed }, receiver)
    }
}

/// Observation in progress.
pub(super) struct Observing {
    request: ObserveRequest,
    look: Examination,
}

impl Observing {
    /// Begins to observe a link that stands like this.
    pub(super) fn new(request: ObserveRequest, before: LinkStatus) -> Self {
        Self { request, look: Examination::begin(Some(before)) }
    }

    pub(super) fn add(&mut self, reading: &Reading) {
        self.look.add(reading);
    }

    /// True when the time is over or the requester stopped it.
    pub(super) fn is_over(&self) -> bool {
        self.request.stop.load(Ordering::Relaxed) || self.look.is_enough(self.request.seconds)
    }

    /// Sends the result to the requester.
    pub(super) fn finish(self, stream: &dyn BoardStream) {
        // The requester may have ended.
        let _sent = self.request.observed.send(self.look.observed(stream.status(), &stream.console()));
    }
}
