//! Observation of the board for diagnostics, through the link that the gripper thread already holds: a port cannot be
//! opened twice.

use palpate_device::doctor::{ChannelTraces, Observations};
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
    traces: ChannelTraces,
}

impl Observing {
    pub(super) fn new(request: ObserveRequest) -> Self {
        Self { request, began: Instant::now(), traces: ChannelTraces::default() }
    }

    pub(super) fn add(&mut self, reading: &Reading) {
        self.traces.add(reading);
    }

    /// True when the time is over or the requester stopped it.
    pub(super) fn is_over(&self) -> bool {
        self.request.stop.load(Ordering::Relaxed) || self.began.elapsed().as_secs_f64() >= self.request.seconds
    }

    /// Sends the result to the requester.
    pub(super) fn finish(self, link: LinkStatus) {
        let observations = Observations {
            ports: list_ports(),
            refused: None,
            modem_manager: is_running("ModemManager"),
            link: Some(link),
            listened_s: self.began.elapsed().as_secs_f64(),
            traces: self.traces,
        };
        // The requester may have ended.
        let _sent = self.request.observed.send(observations);
    }
}
