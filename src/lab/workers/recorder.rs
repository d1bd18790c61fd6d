//! The recorder: a thread that writes frames into the store about once a second, so that neither a slow disk nor
//! another program's lock holds up the grasp, and a kill loses at most the last second.

use palpate_sim::frame::{Frame, Quality};
use palpate_store::{Store, StoreError};
use palpate_tactile::trial::TrialId;
use palpate_tactile::trial::TrialInfo;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

/// Frames that are gathered before they are written.
const CHUNK: usize = 75;

/// What the recorder tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RecorderNotice {
    /// A trial is complete in the store.
    Stored(TrialId),
    /// A trial could not be stored; the sentence says why and what to try.
    Failed(String),
}

enum Message {
    Begin(Box<TrialInfo>),
    Frame(Box<Frame>),
    Finish(Box<Quality>, Vec<String>),
    Discard,
}

/// A handle on the recorder's thread. Dropping it writes what has been handed over and waits for that.
#[derive(Debug)]
pub struct Recorder {
    messages: Option<Sender<Message>>,
    thread: Option<JoinHandle<()>>,
}

impl Recorder {
    /// Starts the thread. The store is opened when the first trial begins; `tell` is called from the thread.
    pub fn start(store: PathBuf, tell: impl Fn(RecorderNotice) + Send + 'static) -> std::io::Result<Self> {
        let (messages, inbox) = channel();
        let thread = std::thread::Builder::new().name("recorder".to_owned()).spawn(move || {
            Writer { path: store, store: None, trial: Open::None, waiting: Vec::new(), tell: Box::new(tell) }
                .work(&inbox);
        })?;
        Ok(Self { messages: Some(messages), thread: Some(thread) })
    }

    fn send(&self, message: Message) {
        if let Some(messages) = &self.messages {
            // A recorder that has failed has said so; frames after that have nowhere to go.
            let _gone = messages.send(message);
        }
    }

    /// Begins a trial.
    pub fn begin(&self, info: &TrialInfo) {
        self.send(Message::Begin(Box::new(info.clone())));
    }

    /// Hands over the next frame of the trial.
    pub fn frame(&self, frame: &Frame) {
        self.send(Message::Frame(Box::new(frame.clone())));
    }

    /// Ends the trial.
    pub fn finish(&self, quality: &Quality, warnings: &[String]) {
        self.send(Message::Finish(Box::new(quality.clone()), warnings.to_vec()));
    }

    /// Gives the trial up: it is marked as deleted.
    pub fn discard(&self) {
        self.send(Message::Discard);
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.messages = None;
        if let Some(thread) = self.thread.take() {
            // A panic in the thread has printed itself; there is nobody left to tell here.
            let _ended = thread.join();
        }
    }
}

struct Writer {
    path: PathBuf,
    store: Option<Store>,
    trial: Open,
    waiting: Vec<Frame>,
    tell: Box<dyn Fn(RecorderNotice) + Send>,
}

/// The trial being recorded.
enum Open {
    None,
    /// Nothing of it is in the store yet: scenes that are passed over within a second leave no trace.
    Announced(Box<TrialInfo>),
    /// Its first chunk is in.
    Begun(TrialId),
}

impl Writer {
    fn work(mut self, inbox: &Receiver<Message>) {
        while let Ok(message) = inbox.recv() {
            if let Err(error) = self.take(message) {
                self.trial = Open::None;
                self.waiting.clear();
                (self.tell)(RecorderNotice::Failed(error.to_string()));
            }
        }
    }

    fn take(&mut self, message: Message) -> Result<(), StoreError> {
        match message {
            Message::Begin(info) => {
                self.waiting.clear();
                self.trial = Open::Announced(info);
            }
            Message::Frame(frame) => {
                if !matches!(self.trial, Open::None) {
                    self.waiting.push(*frame);
                }
                if self.waiting.len() >= CHUNK {
                    self.write_waiting()?;
                }
            }
            Message::Finish(quality, warnings) => {
                if let Some(id) = self.write_waiting()? {
                    self.trial = Open::None;
                    self.store()?.finish(id, &quality, &warnings)?;
                    (self.tell)(RecorderNotice::Stored(id));
                }
            }
            Message::Discard => {
                self.waiting.clear();
                if let Open::Begun(id) = std::mem::replace(&mut self.trial, Open::None) {
                    self.store()?.delete(&[id])?;
                }
            }
        }
        Ok(())
    }

    /// Writes the frames that wait, beginning the trial where it has not been begun; its number, if there is one.
    fn write_waiting(&mut self) -> Result<Option<TrialId>, StoreError> {
        let waiting = std::mem::take(&mut self.waiting);
        let id = match std::mem::replace(&mut self.trial, Open::None) {
            Open::None => return Ok(None),
            Open::Announced(info) => self.store()?.begin(&info)?,
            Open::Begun(id) => id,
        };
        self.store()?.append(id, &waiting)?;
        self.trial = Open::Begun(id);
        Ok(Some(id))
    }

    fn store(&mut self) -> Result<&mut Store, StoreError> {
        match &mut self.store {
            Some(store) => Ok(store),
            empty @ None => Ok(empty.insert(Store::open(&self.path)?)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_sim::scene::Scene;

    #[test]
    fn what_is_handed_over_is_stored_and_discards_vanish() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("trials.sqlite");
        let (told, notices) = channel();
        let recorder = Recorder::start(path.clone(), move |notice| told.send(notice).expect("heard")).expect("starts");
        let trial = grasp(&Scene::default(), None, 3);
        for keep in [true, false] {
            recorder.begin(&trial.info);
            trial.frames.iter().for_each(|frame| recorder.frame(frame));
            if keep {
                recorder.finish(&trial.info.quality, &trial.info.warnings);
            } else {
                recorder.discard();
            }
        }
        drop(recorder);
        let RecorderNotice::Stored(id) = notices.recv().expect("a notice") else { panic!("stored") };
        let store = Store::open(&path).expect("opens");
        assert!(store.load(id).expect("whole") == trial);
        assert_eq!((store.list(false).expect("lists").len(), store.list(true).expect("lists").len()), (1, 2));
    }

    #[test]
    fn a_store_that_cannot_be_opened_is_reported_once_per_trial() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("notes.txt");
        std::fs::write(&path, "not a store".repeat(100)).expect("writes");
        let (told, notices) = channel();
        let recorder = Recorder::start(path, move |notice| told.send(notice).expect("heard")).expect("starts");
        let trial = grasp(&Scene::default(), None, 0);
        recorder.begin(&trial.info);
        trial.frames.iter().for_each(|frame| recorder.frame(frame));
        recorder.finish(&trial.info.quality, &[]);
        drop(recorder);
        let all: Vec<RecorderNotice> = notices.try_iter().collect();
        assert!(matches!(&all[..], [RecorderNotice::Failed(text)] if text.contains("not a store")), "{all:?}");
    }
}
