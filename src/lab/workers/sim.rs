//! Handle of the simulation thread: commands in, snapshots, trace rows and notices out.

use super::ghost::{GhostGrasp, GhostRequest, ghost_job};
use super::job::Job;
use super::latest::Latest;
use super::messages::{Command, MeasuredAccuracy, NotSent, Notice, SimWorkerSetup, Snapshot, TraceRow};
use super::simulation_session::{Outlets, Session};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Maximum number of queued commands; further ones are refused.
const MOST_COMMANDS: usize = 256;
/// Maximum number of queued trace rows: two minutes at 75 Hz. A slower reader finds a gap.
const MOST_ROWS: usize = 9000;

/// Handle of the simulation thread. Dropping it ends the thread and waits for pending writes.
pub struct SimWorker {
    commands: SyncSender<Command>,
    snapshots: Arc<Latest<Snapshot>>,
    accuracy: Arc<Latest<MeasuredAccuracy>>,
    rows: Receiver<TraceRow>,
    rows_lost: Arc<AtomicBool>,
    loading: Arc<AtomicBool>,
    notices: Receiver<Notice>,
    ghost: Arc<Job<GhostRequest, GhostGrasp>>,
    thread: Option<JoinHandle<()>>,
}

impl SimWorker {
    /// Starts the thread.
    pub fn start(setup: SimWorkerSetup) -> std::io::Result<Self> {
        let (commands, inbox) = sync_channel(MOST_COMMANDS);
        let (row_sender, rows) = sync_channel(MOST_ROWS);
        let (notice_sender, notices) = channel();
        let snapshots = Arc::new(Latest::default());
        let accuracy = Arc::new(Latest::default());
        let ghost = Arc::new(ghost_job(Arc::clone(&setup.wake)));
        let [rows_lost, loading] = [(); 2].map(|()| Arc::new(AtomicBool::new(false)));
        let outlets = Outlets {
            snapshots: Arc::clone(&snapshots),
            accuracy: Arc::clone(&accuracy),
            rows: row_sender,
            rows_lost: Arc::clone(&rows_lost),
            loading: Arc::clone(&loading),
            notices: notice_sender,
            ghost: Arc::clone(&ghost),
            wake: Arc::clone(&setup.wake),
        };
        let thread = std::thread::Builder::new().name("sim".to_owned()).spawn(move || {
            let last_words = (outlets.notices.clone(), Arc::clone(&outlets.wake));
            // A panic becomes a message; the window stays.
            let outcome =
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| Session::run(setup, outlets, &inbox)));
            if outcome.is_err() {
                let text =
                    "the simulation stopped because of a fault in the program; restart Palpate and report what you did";
                // The window may be closed.
                let _sent = last_words.0.send(Notice::Failed(text.to_owned()));
                last_words.1();
            }
        })?;
        Ok(Self { commands, snapshots, accuracy, rows, rows_lost, loading, notices, ghost, thread: Some(thread) })
    }

    /// Sends a command.
    pub fn send(&self, command: Command) -> Result<(), NotSent> {
        self.commands.try_send(command).map_err(|error| match error {
            TrySendError::Full(_) => NotSent::Busy,
            TrySendError::Disconnected(_) => NotSent::Gone,
        })
    }

    /// The newest snapshot; absent until the first scene has been loaded.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.snapshots.get()
    }

    /// Cost and error of the accuracy of the last measured scene.
    pub fn accuracy(&self) -> Option<Arc<MeasuredAccuracy>> {
        self.accuracy.get()
    }

    /// Trace rows since the last call, in order.
    pub fn rows(&self) -> impl Iterator<Item = TraceRow> + '_ {
        self.rows.try_iter()
    }

    /// The newest grasp that the other engine has computed; compare its number with that of the snapshot.
    pub fn ghost(&self) -> Option<Arc<GhostGrasp>> {
        self.ghost.outcome()
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

impl Drop for SimWorker {
    fn drop(&mut self) {
        let wait = || std::thread::sleep(Duration::from_millis(1));
        // Loading a large file cannot be interrupted; a window that closes does not wait for it.
        let loading = || self.loading.load(Ordering::Relaxed);
        while self.send(Command::Quit) == Err(NotSent::Busy) && !loading() {
            wait();
        }
        if let Some(thread) = self.thread.take() {
            while !thread.is_finished() && !loading() {
                wait();
            }
            if thread.is_finished() {
                // A panic in the thread has been reported already.
                let _ended = thread.join();
            }
        }
    }
}
