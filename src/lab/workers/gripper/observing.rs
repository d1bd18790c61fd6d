//! Observation of the board for diagnostics, through the link that the gripper thread already holds: a port cannot be
//! opened twice.

use crate::gripper::BoardStream;
use palpate_device::doctor::{ChannelTraces, Observations, example_of, is_enough};
use palpate_device::serial::{LinkStatus, is_running, list_ports};
use palpate_tactile::board::Reading;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Instant;

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
    began: Instant,
    /// The link by then: what came before is not part of it.
    before: LinkStatus,
    traces: ChannelTraces,
}

impl Observing {
    pub(super) fn new(request: ObserveRequest, before: LinkStatus) -> Self {
        Self { request, began: Instant::now(), before, traces: ChannelTraces::default() }
    }

    pub(super) fn add(&mut self, reading: &Reading) {
        self.traces.add(reading);
    }

    /// True when the time is over or the requester stopped it.
    pub(super) fn is_over(&self) -> bool {
        let waited_s = self.began.elapsed().as_secs_f64();
        self.request.stop.load(Ordering::Relaxed) || is_enough(&self.traces, waited_s, self.request.seconds)
    }

    /// Sends the result to the requester.
    pub(super) fn finish(self, stream: &dyn BoardStream) {
        let mut link = stream.status();
        link.cadence = link.cadence.since(&self.before.cadence);
        link.reconnects = link.reconnects.saturating_sub(self.before.reconnects);
        let observations = Observations {
            ports: list_ports(),
            refused: None,
            modem_manager: is_running("ModemManager"),
            link: Some(link),
            listened_s: self.began.elapsed().as_secs_f64(),
            traces: self.traces,
            example: example_of(&stream.console()),
        };
        // The requester may have ended.
        let _sent = self.request.observed.send(observations);
    }
}
