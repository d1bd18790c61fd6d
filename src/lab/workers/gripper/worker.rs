//! Handle of the gripper thread: commands in, views, trace rows and notices out.

use super::messages::{GripperCommand, GripperSetup, GripperView};
use super::observing::ObserveRequest;
use super::session::{GripperSession, Outlets};
use crate::workers::{Examine, ExamineRequest, Latest, Notice, TraceRow};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Maximum number of queued trace rows: a minute and a half of the fastest board. A slower reader finds a gap.
const MOST_ROWS: usize = 9000;

/// Interval between progress reports of diagnostics.
const REPORT_EVERY: Duration = Duration::from_millis(100);

/// Handle of the gripper thread. Dropping it vents, ends a running trial and closes the port.
#[derive(Debug)]
pub struct GripperWorker {
    /// Absent once the thread is being ended.
    commands: Option<Sender<GripperCommand>>,
    /// Commands so far.
    asked: AtomicU64,
    view: Arc<Latest<GripperView>>,
    rows: Receiver<TraceRow>,
    rows_lost: Arc<AtomicBool>,
    notices: Receiver<Notice>,
    thread: Option<JoinHandle<()>>,
}

impl GripperWorker {
    /// Starts the thread. It connects only on command.
    pub fn start(setup: GripperSetup) -> std::io::Result<Self> {
        let (commands, inbox) = channel();
        let (row_sender, rows) = sync_channel(MOST_ROWS);
        let (notice_sender, notices) = channel();
        let view = Arc::new(Latest::default());
        let rows_lost = Arc::new(AtomicBool::new(false));
        let outlets = Outlets {
            view: Arc::clone(&view),
            rows: row_sender,
            rows_lost: Arc::clone(&rows_lost),
            notices: notice_sender,
            wake: Arc::clone(&setup.wake),
        };
        let thread = std::thread::Builder::new().name("gripper".to_owned()).spawn(move || {
            let last_words = (outlets.notices.clone(), Arc::clone(&outlets.wake));
            // A panic becomes a message; the window stays, and the board vents when no more lines arrive.
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                GripperSession::new(setup, outlets).run(&inbox);
            }));
            if outcome.is_err() {
                let text = "the gripper thread stopped because of a fault in the program; restart Palpate and report \
                            what you did";
                // The window may be closed.
                let _sent = last_words.0.send(Notice::Failed(text.to_owned()));
                last_words.1();
            }
        })?;
        Ok(Self {
            commands: Some(commands),
            asked: AtomicU64::new(0),
            view,
            rows,
            rows_lost,
            notices,
            thread: Some(thread),
        })
    }

    /// Sends a command; returns the number of commands so far, to compare with [`GripperView::handled`].
    pub fn command(&self, command: GripperCommand) -> u64 {
        if let Some(commands) = &self.commands {
            // A thread that has failed has sent a notice; the rest of the window works.
            let _sent = commands.send(command);
        }
        self.asked.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Examination of the board for the doctor: through the open link or, without one, by `alone`.
    pub fn examine(&self, alone: Examine) -> Examine {
        match &self.commands {
            Some(commands) => observe_shared(commands.clone(), Arc::clone(&self.view), alone),
            None => alone,
        }
    }

    /// The newest view; none before the first one is published.
    pub fn view(&self) -> Option<Arc<GripperView>> {
        self.view.get()
    }

    /// Trace rows since the last call, in order.
    pub fn rows(&self) -> impl Iterator<Item = TraceRow> + '_ {
        self.rows.try_iter()
    }

    /// True once after rows had to be dropped because the queue was full.
    pub fn take_rows_lost(&self) -> bool {
        self.rows_lost.swap(false, Ordering::Relaxed)
    }

    /// Notices since the last call, in order.
    pub fn notices(&self) -> impl Iterator<Item = Notice> + '_ {
        self.notices.try_iter()
    }
}

impl Drop for GripperWorker {
    fn drop(&mut self) {
        self.command(GripperCommand::Quit);
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            let _ended = thread.join();
        }
    }
}

/// Observes the board through the link that the gripper thread holds; without a link, runs `alone`.
fn observe_shared(commands: Sender<GripperCommand>, view: Arc<Latest<GripperView>>, alone: Examine) -> Examine {
    Arc::new(move |request: &ExamineRequest, proceed: &mut dyn FnMut(f64) -> bool| {
        if !view.get().is_some_and(|view| view.is_connected()) {
            return alone(request, proceed);
        }
        let stop = Arc::new(AtomicBool::new(false));
        let (command, observed) = ObserveRequest::new(request.seconds, Arc::clone(&stop));
        let began = Instant::now();
        if commands.send(GripperCommand::Observe(command)).is_err() {
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
