//! The handle on the gripper's thread: commands go in, views, trace rows and notices come out.

use super::messages::{GripperCommand, GripperView};
use super::observing;
use super::session::{GripperSession, Outlets};
use crate::gripper::Listen;
use crate::workers::{Examine, Latest, Notice, TraceRow, Wake};
use palpate_learn::Model;
use palpate_sim::scene::Scene;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel, sync_channel};
use std::thread::JoinHandle;

/// What the gripper's thread starts from.
pub struct GripperSetup {
    /// The gripper as it is modelled, and the programme of its control box.
    pub scene: Scene,
    /// Where trials and calibrations are stored.
    pub store: PathBuf,
    /// Recognises what is in the hand; without one nothing is recognised.
    pub model: Option<Arc<Model>>,
    /// Grasps that are made at most before it stops.
    pub grasps: u32,
    /// Opens ports.
    pub listen: Listen,
    /// Called when there is something new.
    pub wake: Wake,
}

/// Trace rows that wait at most: a minute and a half of the fastest board. A reader that sleeps longer finds a gap.
const MOST_ROWS: usize = 9000;

/// A handle on the gripper's thread. Dropping it vents, ends a trial that goes on, and gives the port back.
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
    /// Starts the thread. Nothing is connected to before that is wished for.
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
            // A panic becomes a message; the window stays, and the board vents by itself when it hears nothing more.
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                GripperSession::new(setup, outlets).run(&inbox);
            }));
            if outcome.is_err() {
                let text = "the gripper's thread stopped through a fault of the program; restart Palpate and report \
                            what you did";
                // If nobody listens any more, nobody needs to know.
                let _heard = last_words.0.send(Notice::Failed(text.to_owned()));
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

    /// Asks for something; how many commands that makes. [`GripperView::handled`] tells how many have been handled.
    pub fn command(&self, command: GripperCommand) -> u64 {
        if let Some(commands) = &self.commands {
            // A thread that has died has said so; the rest of the window works.
            let _heard = commands.send(command);
        }
        self.asked.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// What looks at the board for the doctor: at the link that is held here or, while none is, as `alone` does.
    pub fn examine(&self, alone: Examine) -> Examine {
        match &self.commands {
            Some(commands) => observing::shared(commands.clone(), Arc::clone(&self.view), alone),
            None => alone,
        }
    }

    /// Where everything stands; nothing before anything was wished for.
    pub fn view(&self) -> Option<Arc<GripperView>> {
        self.view.get()
    }

    /// Trace rows since the last call, in order.
    pub fn rows(&self) -> impl Iterator<Item = TraceRow> + '_ {
        self.rows.try_iter()
    }

    /// True once after rows had to be dropped because nobody read them.
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
