//! Handle of the gripper thread: commands in, views, trace rows and notices out.

use super::messages::{GripperCommand, GripperSetup, GripperView};
use super::observing::ObserveRequest;
use super::session::GripperSession;
use crate::workers::worker::Worker;
use crate::workers::{Examine, ExamineRequest};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// Interval between progress reports of diagnostics.
const REPORT_EVERY: Duration = Duration::from_millis(100);

/// Handle of the gripper thread. Dropping it vents, ends a running trial and closes the port.
pub type GripperWorker = Worker<GripperCommand, GripperView>;

impl GripperWorker {
    /// Starts the thread. It connects only on command. After a panic the board vents when no more lines arrive.
    pub fn start(setup: GripperSetup) -> std::io::Result<Self> {
        let wake = Arc::clone(&setup.wake);
        Self::spawn("gripper", "the gripper thread", wake, move |inbox, publisher| {
            GripperSession::new(setup, publisher).run(inbox);
        })
    }

    /// Examination of the board for the doctor: through the open link or, without one, by `alone`.
    pub fn examine(&self, alone: Examine) -> Examine {
        let (send, view) = (self.sender(), self.views());
        Arc::new(move |request: &ExamineRequest, proceed: &mut dyn FnMut(f64) -> bool| {
            if !view.get().is_some_and(|view| view.is_connected()) {
                return alone(request, proceed);
            }
            let stop = Arc::new(AtomicBool::new(false));
            let (command, observed) = ObserveRequest::new(request.seconds, Arc::clone(&stop));
            let began = Instant::now();
            if send(GripperCommand::Observe(command)).is_err() {
                return alone(request, proceed);
            }
            loop {
                match observed.recv_timeout(REPORT_EVERY) {
                    Ok(seen) => return seen,
                    // The observation was dropped because the port was closed: open it directly.
                    Err(RecvTimeoutError::Disconnected) => return alone(request, proceed),
                    Err(RecvTimeoutError::Timeout) if proceed(began.elapsed().as_secs_f64()) => {}
                    Err(RecvTimeoutError::Timeout) => stop.store(true, Ordering::Relaxed),
                }
            }
        })
    }
}
