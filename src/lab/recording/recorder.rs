//! The recorder: the thread "recorder" writes simulated and real trials into the store. So neither a slow disk nor
//! another program's lock delays a grasp or the lines that keep a board from venting. Waiting data of a board are written once
//! a second: if the program is killed, at most the last second is lost. A simulated trial is stored at its end.

use super::board_writer::{BoardTrialPlan, BoardWriter, RecordedTrial};
use palpate_device::protocol::BoardEvent;
use palpate_device::serial::LinkStatus;
use palpate_sim::frame::Quality;
use palpate_store::{Store, StoreError, Stored, TrialPlace};
use palpate_tactile::trial::{PhaseMark, SimulatedTrial, TrialId};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Readings wait no longer than this for being written.
const FLUSH_AFTER: Duration = Duration::from_millis(800);
/// Attempts on a store that another program writes to; each waits for ten seconds.
const MOST_ATTEMPTS: u32 = 6;

/// Reports of the recorder.
#[derive(Clone, Debug, PartialEq)]
pub enum RecorderNotice {
    /// A trial of the real gripper has begun and has this number.
    Begun(TrialId),
    /// A simulated grasp was sent to the store.
    Stored(Stored),
    /// A simulated grasp was sent to the demo log: the trial that now holds it, and where that trial is.
    Logged(Stored, TrialPlace),
    /// A trial of the real gripper is complete in the store.
    Recorded(Box<RecordedTrial>),
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

/// Work for the thread.
type Work = Box<dyn FnOnce(&mut Writer) -> Result<(), StoreError> + Send>;

/// Handle of the recorder's thread. Dropping it waits until everything is written.
#[derive(Debug)]
pub struct Recorder {
    work: Option<Sender<Work>>,
    thread: Option<JoinHandle<()>>,
}

impl Recorder {
    /// Starts the thread. The store is opened when the first trial begins; `notify` is called from the thread.
    pub fn start(store: PathBuf, notify: impl Fn(RecorderNotice) + Send + 'static) -> std::io::Result<Self> {
        let (work, inbox) = channel();
        let thread = std::thread::Builder::new().name("recorder".to_owned()).spawn(move || {
            let (place, notify) = (TrialPlace::default(), Box::new(notify));
            let mut writer = Writer { path: store, store: None, board: None, place, last: None, notify };
            writer.work(&inbox);
        })?;
        Ok(Self { work: Some(work), thread: Some(thread) })
    }

    fn send(&self, task: impl FnOnce(&mut Writer) -> Result<(), StoreError> + Send + 'static) {
        if let Some(work) = &self.work {
            // The thread reports its own failure; later work has nowhere to go.
            let _gone = work.send(Box::new(task));
        }
    }

    fn send_board(&self, change: impl FnOnce(&mut BoardWriter) + Send + 'static) {
        self.send(|writer| {
            if let Some((board, _)) = &mut writer.board {
                change(board);
            }
            Ok(())
        });
    }

    /// Stores a simulated trial in the store or in the demo log.
    pub fn store(&self, place: TrialPlace, trial: SimulatedTrial) {
        self.send(move |writer| {
            let stored = writer.insert(place, &trial)?;
            writer.report(stored)
        });
    }

    /// Stores a simulated trial in place of the last finished one, which is given up.
    pub fn replace(&self, trial: SimulatedTrial) {
        self.send(move |writer| {
            let last = writer.last;
            // The user may meanwhile have moved the last trial from the demo log to the store (Keep).
            let place = match last {
                Some(old) => writer.with_store(|store| store.place(old))?,
                None => writer.place,
            };
            let stored = writer.insert(place, &trial)?;
            last.map_or(Ok(()), |old| writer.with_store(|store| store.give_up(old)))?;
            writer.report(stored)
        });
    }

    /// Notes what other runs of the last finished simulated trial say about it.
    pub fn note_quality(&self, quality: Quality) {
        self.send(move |writer| {
            let last = writer.last;
            last.map_or(Ok(()), |id| writer.with_store(|store| store.note_quality(id, &quality)))
        });
    }

    /// Begins a trial of the real gripper.
    pub fn begin_board(&self, plan: BoardTrialPlan) {
        self.send(move |writer| {
            let board = writer.with_store(|store| BoardWriter::begin(store, &plan))?;
            (writer.notify)(RecorderNotice::Begun(board.id()));
            writer.board = Some((board, Instant::now()));
            Ok(())
        });
    }

    /// Records an event of the board.
    pub fn board(&self, event: BoardEvent) {
        self.send_board(|board| board.take(event));
    }

    /// Records a change of the control box.
    pub fn mark(&self, mark: PhaseMark) {
        self.send_board(move |board| board.mark(mark));
    }

    /// Records that the grasp was interrupted.
    pub fn interrupted(&self, cause: &str) {
        let cause = cause.to_owned();
        self.send_board(|board| board.interrupt(cause));
    }

    /// Ends a trial of the real gripper; its flags are derived from the stored data.
    pub fn finish_board(&self, end: BoardTrialEnd) {
        self.send(move |writer| writer.finish_board(&end));
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.work = None;
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has printed itself.
            let _ended = thread.join();
        }
    }
}

struct Writer {
    path: PathBuf,
    store: Option<Store>,
    /// The trial of a board that is being recorded, and when it was written last.
    board: Option<(BoardWriter, Instant)>,
    /// Where the last simulated trial was stored.
    place: TrialPlace,
    /// That trial, unless the store had the grasp.
    last: Option<TrialId>,
    notify: Box<dyn Fn(RecorderNotice) + Send>,
}

impl Writer {
    fn work(&mut self, inbox: &Receiver<Work>) {
        loop {
            let outcome = match inbox.recv_timeout(FLUSH_AFTER) {
                Ok(task) => task(self).and_then(|()| self.flush_if_due()),
                Err(RecvTimeoutError::Timeout) => self.flush_if_due(),
                Err(RecvTimeoutError::Disconnected) => return,
            };
            if let Err(error) = outcome {
                let text = match (self.board.take(), &error) {
                    // With the store file itself (`FileLost`) everything is lost, so the text does not say what was
                    // kept.
                    (Some((board, _)), error) if !matches!(error, StoreError::FileLost { .. }) => {
                        format!("{error}. {}", board.kept())
                    }
                    (_, error) => error.to_string(),
                };
                (self.notify)(RecorderNotice::Failed(text));
            }
        }
    }

    fn insert(&mut self, place: TrialPlace, trial: &SimulatedTrial) -> Result<Stored, StoreError> {
        let stored = self.with_store(|store| store.insert_in(place, trial))?;
        (self.place, self.last) = (place, Some(stored.id()).filter(|_| stored.is_new()));
        Ok(stored)
    }

    fn report(&mut self, stored: Stored) -> Result<(), StoreError> {
        let notice = match self.place {
            TrialPlace::DemoLog => RecorderNotice::Logged(stored, self.with_store(|store| store.place(stored.id()))?),
            TrialPlace::Store => RecorderNotice::Stored(stored),
        };
        (self.notify)(notice);
        Ok(())
    }

    fn flush_if_due(&mut self) -> Result<(), StoreError> {
        let Some((mut board, written)) = self.board.take() else { return Ok(()) };
        let is_due = written.elapsed() >= FLUSH_AFTER;
        let flushed = if is_due { self.with_store(|store| board.flush(store)) } else { Ok(()) };
        self.board = Some((board, if is_due { Instant::now() } else { written }));
        flushed
    }

    fn finish_board(&mut self, end: &BoardTrialEnd) -> Result<(), StoreError> {
        // After a failure there is nothing to end.
        let Some((mut board, _)) = self.board.take() else { return Ok(()) };
        let recorded = self.with_store(|store| board.finish(store, &end.status, &end.notes));
        let recorded = recorded.inspect_err(|_| self.board = Some((board, Instant::now())))?;
        let id = recorded.id;
        if end.discarded
            && let Err(error) = self.with_store(|store| store.delete(&[id]))
        {
            (self.notify)(RecorderNotice::Warning(format!("trial {id} was not discarded: {error}")));
        }
        if let Some((model, pmf)) = &end.guess
            && let Err(error) = self.with_store(|store| store.labels().set_guess(id, model, pmf))
        {
            (self.notify)(RecorderNotice::Warning(format!("the model's guess was not stored: {error}")));
        }
        (self.notify)(RecorderNotice::Recorded(Box::new(recorded)));
        Ok(())
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
    fn a_trial_that_is_computed_again_replaces_the_last_one() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("trials.sqlite");
        let recorder = Recorder::start(path.clone(), |_| ()).expect("starts");
        let trials = [3, 4].map(|seed| grasp(&Scene::default(), None, seed));
        trials.into_iter().for_each(|trial| recorder.store(TrialPlace::Store, trial));
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
            recorder.store(TrialPlace::Store, trial.clone());
        }
        drop(recorder);
        let all: Vec<RecorderNotice> = notices.try_iter().collect();
        assert!(
            matches!(
                all[..],
                [
                    RecorderNotice::Stored(Stored::New(1)),
                    RecorderNotice::Stored(Stored::Known(1)),
                    RecorderNotice::Stored(Stored::New(_))
                ]
            ),
            "{all:?}"
        );
        let store = Store::open(&path).expect("opens");
        assert!(store.load(1).expect("whole") == same.into());
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
        recorder.store(TrialPlace::Store, grasp(&Scene::default(), None, 0));
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
