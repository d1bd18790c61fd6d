//! The doctor at the link that the gripper's thread holds already: a port cannot be opened twice.

use super::messages::{GripperCommand, GripperView};
use crate::workers::diagnostics_job::{Examine, ExamineRequest};
use crate::workers::latest::Latest;
use palpate_device::doctor::{ChannelTraces, Observations};
use palpate_device::serial::{LinkStatus, is_running, list_ports};
use palpate_tactile::board::Reading;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// How often whoever waits is told how long the board has been listened to.
const TOLD_EVERY: Duration = Duration::from_millis(100);

/// A look at the board, wanted by somebody.
#[derive(Clone, Debug)]
pub struct ObserveRequest {
    seconds: f64,
    stop: Arc<AtomicBool>,
    seen: Sender<Observations>,
}

/// A look at the board that goes on.
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

    /// True when it has seen enough.
    pub(super) fn is_over(&self) -> bool {
        self.request.stop.load(Ordering::Relaxed) || self.began.elapsed().as_secs_f64() >= self.request.seconds
    }

    /// Hands over what was seen.
    pub(super) fn finish(self, link: LinkStatus) {
        let seen = Observations {
            ports: list_ports(),
            refused: None,
            modem_manager: is_running("ModemManager"),
            link: Some(link),
            listened_s: self.began.elapsed().as_secs_f64(),
            traces: self.traces,
        };
        // Whoever asked may have gone.
        let _heard = self.request.seen.send(seen);
    }
}

/// Looks at the link that the gripper's thread holds; while it holds none, looks as `alone` does.
pub(super) fn shared(commands: Sender<GripperCommand>, view: Arc<Latest<GripperView>>, alone: Examine) -> Examine {
    Arc::new(move |request: &ExamineRequest, goes_on: &mut dyn FnMut(f64) -> bool| {
        if !view.get().is_some_and(|view| view.is_connected()) {
            return alone(request, goes_on);
        }
        let (seen, observed) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let command = ObserveRequest { seconds: request.seconds, stop: Arc::clone(&stop), seen };
        let began = Instant::now();
        if commands.send(GripperCommand::Observe(command)).is_err() {
            return alone(request, goes_on);
        }
        loop {
            match observed.recv_timeout(TOLD_EVERY) {
                Ok(seen) => return seen,
                // It was given up: the port was given back, and can be looked at.
                Err(RecvTimeoutError::Disconnected) => return alone(request, goes_on),
                Err(RecvTimeoutError::Timeout) if goes_on(began.elapsed().as_secs_f64()) => {}
                Err(RecvTimeoutError::Timeout) => stop.store(true, Ordering::Relaxed),
            }
        }
    })
}
