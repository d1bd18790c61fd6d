//! The recorder: the thread "recorder" writes simulated and real trials into the store. So neither a slow disk nor
//! another program's lock delays a grasp or the lines that keep a board from venting. Waiting data are written once a
//! second: if the program is killed, at most the last second is lost.

use super::board_writer::{BoardTrialPlan, BoardWriter, RecordedTrial};
use palpate_device::serial::{LinkEvent, LinkStatus};
use palpate_sim::frame::{Frame, Quality};
use palpate_store::{Store, StoreError, Stored, TrialPlace};
use palpate_tactile::trial::{PhaseMark, SimulatedTrial, TrialHeader, TrialId};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Frames that are gathered before they are written.
const CHUNK: usize = 75;
/// Readings wait no longer than this for being written.
const FLUSH_AFTER: Duration = Duration::from_millis(800);
/// Attempts on a store that another program writes to; each waits for ten seconds.
const MOST_ATTEMPTS: u32 = 6;

/// Reports of the recorder.
#[derive(Clone, Debug, PartialEq)]
pub enum RecorderNotice {
    /// A trial of the real gripper has begun and has this number.
    Begun(TrialId),
    /// A simulated trial is complete in the store.
    Stored(TrialId),
    /// The store already has this simulated grasp, as this trial; nothing was stored.
    Known(TrialId),
    /// The store had this grasp only in the demo log; that trial was moved to the store.
    Kept(TrialId),
    /// A simulated grasp was sent to the demo log: the trial that now holds it, and where that trial is.
    Logged(TrialId, TrialPlace),
    /// A trial of the real gripper is complete in the store.
    Recorded(Box<RecordedTrial>),
    /// A trial was discarded.
    Discarded(TrialId),
    /// Something about the trial was not stored; the trial itself is safe.
    Warning(String),
    /// A trial could not be stored completely; the sentence says why.
    Failed(String),
}

/// The end of a trial of the real gripper.
#[derive(Clone, Debug)]
pub struct BoardTrialEnd {
    /// Link at the end.
    pub status: LinkStatus,
    /// Remarks of the grasp, in sentences.
    pub notes: Vec<String>,
    /// A guess to store with it: name of the model, class probabilities.
    pub guess: Option<(String, Vec<(String, f64)>)>,
    /// The trial was given up.
    pub discarded: bool,
}

enum Message {
    Begin(TrialPlace, Box<SimulatedTrial>),
    Frame(Box<Frame>),
    Finish(Box<Quality>, Box<TrialHeader>),
    Discard,
    Replace(Box<SimulatedTrial>),
    BeginBoard(Box<BoardTrialPlan>),
    Board(Box<LinkEvent>),
    Mark(PhaseMark),
    Interrupted(String),
    FinishBoard(Box<BoardTrialEnd>),
}

/// Handle of the recorder's thread. Dropping it waits until everything is written.
#[derive(Debug)]
pub struct Recorder {
    messages: Option<Sender<Message>>,
    thread: Option<JoinHandle<()>>,
}

impl Recorder {
    /// Starts the thread. The store is opened when the first trial begins; `notify` is called from the thread.
    pub fn start(store: PathBuf, notify: impl Fn(RecorderNotice) + Send + 'static) -> std::io::Result<Self> {
        let (messages, inbox) = channel();
        let thread = std::thread::Builder::new().name("recorder".to_owned()).spawn(move || {
            let (trial, place, notify) = (OpenTrial::None, TrialPlace::default(), Box::new(notify));
            let mut writer = Writer { path: store, store: None, trial, place, last: None, notify };
            writer.work(&inbox);
        })?;
        Ok(Self { messages: Some(messages), thread: Some(thread) })
    }

    fn send(&self, message: Message) {
        if let Some(messages) = &self.messages {
            // The thread reports its own failure; later messages have nowhere to go.
            let _gone = messages.send(message);
        }
    }

    /// Begins a simulated trial in the store or in the demo log, without its frames.
    pub fn begin(&self, place: TrialPlace, trial: SimulatedTrial) {
        self.send(Message::Begin(place, Box::new(trial)));
    }

    /// Records the next frame of a simulated trial.
    pub fn frame(&self, frame: &Frame) {
        self.send(Message::Frame(Box::new(frame.clone())));
    }

    /// Ends a simulated trial.
    pub fn finish(&self, quality: &Quality, header: &TrialHeader) {
        self.send(Message::Finish(Box::new(quality.clone()), Box::new(header.clone())));
    }

    /// Gives a simulated trial up: in the store it is marked as deleted, from the demo log it is removed.
    pub fn discard(&self) {
        self.send(Message::Discard);
    }

    /// Stores a simulated trial in place of the last finished one, which is given up.
    pub fn replace(&self, trial: SimulatedTrial) {
        self.send(Message::Replace(Box::new(trial)));
    }

    /// Begins a trial of the real gripper.
    pub fn begin_board(&self, plan: BoardTrialPlan) {
        self.send(Message::BeginBoard(Box::new(plan)));
    }

    /// Records an event of the board.
    pub fn board(&self, event: LinkEvent) {
        self.send(Message::Board(Box::new(event)));
    }

    /// Records a change of the control box.
    pub fn mark(&self, mark: PhaseMark) {
        self.send(Message::Mark(mark));
    }

    /// Records that the grasp was interrupted.
    pub fn interrupted(&self, cause: &str) {
        self.send(Message::Interrupted(cause.to_owned()));
    }

    /// Ends a trial of the real gripper; its flags are derived from the stored data.
    pub fn finish_board(&self, end: BoardTrialEnd) {
        self.send(Message::FinishBoard(Box::new(end)));
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.messages = None;
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has printed itself.
            let _ended = thread.join();
        }
    }
}

struct Writer {
    path: PathBuf,
    store: Option<Store>,
    trial: OpenTrial,
    /// Where the last simulated trial was begun.
    place: TrialPlace,
    /// The last simulated trial that was finished.
    last: Option<TrialId>,
    notify: Box<dyn Fn(RecorderNotice) + Send>,
}

/// The trial that is being recorded.
enum OpenTrial {
    None,
    /// Not in the store yet: a scene that is skipped within a second leaves nothing there.
    Announced(Box<SimulatedTrial>, Vec<Frame>),
    Simulated(TrialId, Vec<Frame>),
    Board(Box<BoardWriter>, Instant),
}

impl Writer {
    fn work(&mut self, inbox: &Receiver<Message>) {
        loop {
            let outcome = match inbox.recv_timeout(FLUSH_AFTER) {
                Ok(message) => self.take(message).and_then(|()| self.flush_if_due()),
                Err(RecvTimeoutError::Timeout) => self.flush_if_due(),
                Err(RecvTimeoutError::Disconnected) => return,
            };
            if let Err(error) = outcome {
                let text = match (std::mem::replace(&mut self.trial, OpenTrial::None), &error) {
                    // With the store file itself (`FileLost`) everything is lost, so the text does not say what was
                    // kept.
                    (OpenTrial::Board(board, _), error) if !matches!(error, StoreError::FileLost { .. }) => {
                        format!("{error}. {}", board.kept())
                    }
                    (_, error) => error.to_string(),
                };
                (self.notify)(RecorderNotice::Failed(text));
            }
        }
    }

    fn take(&mut self, message: Message) -> Result<(), StoreError> {
        match message {
            Message::Begin(place, trial) => {
                self.place = place;
                self.trial = OpenTrial::Announced(trial, Vec::new());
            }
            Message::Frame(frame) => {
                if let OpenTrial::Announced(_, waiting) | OpenTrial::Simulated(_, waiting) = &mut self.trial {
                    waiting.push(*frame);
                    if waiting.len() >= CHUNK {
                        self.write_frames()?;
                    }
                }
            }
            Message::Finish(quality, header) => {
                if let Some(id) = self.write_frames()? {
                    self.trial = OpenTrial::None;
                    let stored = self.with_store(|store| store.finish(id, &quality, &header))?;
                    self.last = Some(id).filter(|_| stored.is_new());
                    self.report(stored)?;
                }
            }
            Message::Discard => {
                if let OpenTrial::Simulated(id, _) = std::mem::replace(&mut self.trial, OpenTrial::None) {
                    self.with_store(|store| store.give_up(id))?;
                }
            }
            Message::Replace(trial) => {
                // The user may meanwhile have moved the last trial from the demo log to the store (Keep).
                if let Some(old) = self.last {
                    self.place = self.with_store(|store| store.place(old))?;
                }
                let place = self.place;
                let stored = self.with_store(|store| store.insert_in(place, &trial))?;
                if let Some(old) = std::mem::replace(&mut self.last, Some(stored.id()).filter(|_| stored.is_new())) {
                    self.with_store(|store| store.give_up(old))?;
                }
                self.report(stored)?;
            }
            Message::BeginBoard(plan) => {
                let writer = self.with_store(|store| BoardWriter::begin(store, &plan))?;
                (self.notify)(RecorderNotice::Begun(writer.id()));
                self.trial = OpenTrial::Board(Box::new(writer), Instant::now());
            }
            Message::Board(event) => self.with_board(|board| board.take(*event)),
            Message::Mark(mark) => self.with_board(|board| board.mark(mark)),
            Message::Interrupted(cause) => self.with_board(|board| board.interrupt(cause)),
            Message::FinishBoard(end) => self.finish_board(&end)?,
        }
        Ok(())
    }

    fn report(&mut self, stored: Stored) -> Result<(), StoreError> {
        let notice = match (self.place, stored) {
            (TrialPlace::DemoLog, stored) => {
                let id = stored.id();
                RecorderNotice::Logged(id, self.with_store(|store| store.place(id))?)
            }
            (TrialPlace::Store, Stored::New(id)) => RecorderNotice::Stored(id),
            (TrialPlace::Store, Stored::Known(id)) => RecorderNotice::Known(id),
            (TrialPlace::Store, Stored::Kept(id)) => RecorderNotice::Kept(id),
        };
        (self.notify)(notice);
        Ok(())
    }

    fn with_board(&mut self, change: impl FnOnce(&mut BoardWriter)) {
        if let OpenTrial::Board(board, _) = &mut self.trial {
            change(board);
        }
    }

    fn flush_if_due(&mut self) -> Result<(), StoreError> {
        if !matches!(&self.trial, OpenTrial::Board(_, written) if written.elapsed() >= FLUSH_AFTER) {
            return Ok(());
        }
        if let OpenTrial::Board(mut board, _) = std::mem::replace(&mut self.trial, OpenTrial::None) {
            let written = self.with_store(|store| board.flush(store));
            self.trial = OpenTrial::Board(board, Instant::now());
            return written;
        }
        Ok(())
    }

    fn finish_board(&mut self, end: &BoardTrialEnd) -> Result<(), StoreError> {
        // After a failure there is nothing to end.
        let OpenTrial::Board(mut board, _) = std::mem::replace(&mut self.trial, OpenTrial::None) else {
            return Ok(());
        };
        let recorded = self.with_store(|store| board.finish(store, &end.status, &end.notes));
        let recorded = recorded.inspect_err(|_| self.trial = OpenTrial::Board(board, Instant::now()))?;
        let id = recorded.id;
        if end.discarded {
            match self.with_store(|store| store.delete(&[id])) {
                Ok(()) => (self.notify)(RecorderNotice::Discarded(id)),
                Err(error) => (self.notify)(RecorderNotice::Warning(format!("trial {id} was not discarded: {error}"))),
            }
        }
        if let Some((model, pmf)) = &end.guess
            && let Err(error) = self.with_store(|store| store.labels().set_guess(id, model, pmf))
        {
            (self.notify)(RecorderNotice::Warning(format!("the model's guess was not stored: {error}")));
        }
        (self.notify)(RecorderNotice::Recorded(Box::new(recorded)));
        Ok(())
    }

    /// Writes the waiting frames, and begins the trial if it has not begun. Returns the number of the trial, if there
    /// is one.
    fn write_frames(&mut self) -> Result<Option<TrialId>, StoreError> {
        let (id, waiting) = match std::mem::replace(&mut self.trial, OpenTrial::None) {
            OpenTrial::Announced(trial, waiting) => {
                let place = self.place;
                (self.with_store(|store| store.begin_in(place, &trial))?, waiting)
            }
            OpenTrial::Simulated(id, waiting) => (id, waiting),
            other @ (OpenTrial::None | OpenTrial::Board(..)) => {
                self.trial = other;
                return Ok(None);
            }
        };
        self.with_store(|store| store.append(id, &waiting))?;
        self.trial = OpenTrial::Simulated(id, Vec::new());
        Ok(Some(id))
    }

    /// Runs `work` on the store and opens it first if needed. Tries for a minute while another program writes to it.
    fn with_store<T>(&mut self, mut work: impl FnMut(&mut Store) -> Result<T, StoreError>) -> Result<T, StoreError> {
        let store = match &mut self.store {
            Some(store) => store,
            empty @ None => empty.insert(Store::open(&self.path)?),
        };
        retry_while_busy(|| work(store))
    }
}

/// Tries again while another program writes to the store, a few times.
fn retry_while_busy<T>(mut write: impl FnMut() -> Result<T, StoreError>) -> Result<T, StoreError> {
    for _ in 1..MOST_ATTEMPTS {
        match write() {
            Err(StoreError::Busy) => {}
            outcome => return outcome,
        }
    }
    write()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_sim::scene::Scene;

    #[test]
    fn finished_trials_are_stored_and_discarded_ones_vanish() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("trials.sqlite");
        let (sender, notices) = channel();
        let recorder =
            Recorder::start(path.clone(), move |notice| sender.send(notice).expect("heard")).expect("starts");
        let trial = grasp(&Scene::default(), None, 3);
        for keep in [true, false] {
            recorder.begin(TrialPlace::Store, trial.clone());
            trial.frames().iter().for_each(|frame| recorder.frame(frame));
            if keep {
                recorder.finish(&trial.data.quality, &trial.header);
            } else {
                recorder.discard();
            }
        }
        drop(recorder);
        let RecorderNotice::Stored(id) = notices.recv().expect("a notice") else { panic!("stored") };
        let store = Store::open(&path).expect("opens");
        assert!(store.load(id).expect("whole") == trial.into());
        assert_eq!((store.list(false).expect("lists").len(), store.list(true).expect("lists").len()), (1, 2));
    }

    #[test]
    fn a_trial_that_is_computed_again_replaces_the_last_one() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("trials.sqlite");
        let recorder = Recorder::start(path.clone(), |_| ()).expect("starts");
        let trials = [3, 4].map(|seed| grasp(&Scene::default(), None, seed));
        for trial in &trials {
            recorder.begin(TrialPlace::Store, trial.clone());
            trial.frames().iter().for_each(|frame| recorder.frame(frame));
            recorder.finish(&trial.data.quality, &trial.header);
        }
        let again = grasp(&Scene::default(), None, 5);
        recorder.replace(again);
        drop(recorder);
        let store = Store::open(&path).expect("opens");
        let seeds = |all: bool| store.list(all).expect("lists").iter().map(|row| row.seed).collect::<Vec<_>>();
        assert_eq!((seeds(false), seeds(true)), (vec![3, 5], vec![3, 4, 5]));
    }

    #[test]
    fn the_same_grasp_is_stored_once_and_the_notice_names_its_trial() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("trials.sqlite");
        let (sender, notices) = channel();
        let recorder =
            Recorder::start(path.clone(), move |notice| sender.send(notice).expect("heard")).expect("starts");
        let same = grasp(&Scene::default(), None, 3);
        let mut pulled = same.clone();
        pulled.header.origin.as_mut().expect("simulated").pulls = 7;
        for trial in [&same, &same, &pulled] {
            recorder.begin(TrialPlace::Store, same.clone());
            trial.frames().iter().for_each(|frame| recorder.frame(frame));
            recorder.finish(&trial.data.quality, &trial.header);
        }
        drop(recorder);
        let all: Vec<RecorderNotice> = notices.try_iter().collect();
        assert!(
            matches!(all[..], [RecorderNotice::Stored(1), RecorderNotice::Known(1), RecorderNotice::Stored(_)]),
            "{all:?}"
        );
        let store = Store::open(&path).expect("opens");
        let rows = store.list(true).expect("lists");
        assert_eq!(rows.iter().map(|row| row.pulled).collect::<Vec<_>>(), [false, true]);
    }

    #[test]
    fn a_store_that_cannot_be_opened_is_reported_once_per_trial() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("notes.txt");
        std::fs::write(&path, "not a store".repeat(100)).expect("writes");
        let (sender, notices) = channel();
        let recorder = Recorder::start(path, move |notice| sender.send(notice).expect("heard")).expect("starts");
        let trial = grasp(&Scene::default(), None, 0);
        recorder.begin(TrialPlace::Store, trial.clone());
        trial.frames().iter().for_each(|frame| recorder.frame(frame));
        recorder.finish(&trial.data.quality, &trial.header);
        drop(recorder);
        let all: Vec<RecorderNotice> = notices.try_iter().collect();
        assert!(matches!(&all[..], [RecorderNotice::Failed(text)] if text.contains("not a store")), "{all:?}");
    }

    #[test]
    fn a_busy_store_is_tried_again_but_not_for_ever() {
        let attempts = |free_after: u32| {
            let mut attempts = 0;
            let outcome = retry_while_busy(|| {
                attempts += 1;
                if attempts > free_after { Ok(attempts) } else { Err(StoreError::Busy) }
            });
            (outcome.ok(), attempts)
        };
        assert_eq!((attempts(0), attempts(3), attempts(99)), ((Some(1), 1), (Some(4), 4), (None, 6)));
    }
}
