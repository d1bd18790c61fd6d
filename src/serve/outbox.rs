//! What is to be written to a client. Answers are kept, samples only the newest: what a client does not read is its own loss.

use crate::messages::{Event, Outgoing};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Samples that wait at most: 40 seconds at 50 Hz.
const MOST_SAMPLES: usize = 2000;
/// Bytes of answers that wait at most; a client that leaves more unread is disconnected.
const MOST_BYTES: usize = 4 << 20;

/// Lines that wait for one client.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    state: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Waiting {
    answers: VecDeque<String>,
    bytes: usize,
    samples: VecDeque<Arc<str>>,
    /// Samples dropped since the last that were written.
    lost: u64,
    /// No more lines come; those that wait are still written.
    closed: bool,
    /// The connection is to be cut.
    cut: bool,
}

impl Outbox {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds an answer, or an event of which none may be lost.
    pub(crate) fn answer(&self, message: &Outgoing) {
        let line = message.line();
        let mut state = self.lock();
        if state.bytes + line.len() > MOST_BYTES {
            (state.closed, state.cut) = (true, true);
        } else if !state.closed {
            state.bytes += line.len();
            state.answers.push_back(line);
        }
        drop(state);
        self.changed.notify_all();
    }

    /// Adds a sample; drops the oldest where too many wait.
    pub(crate) fn sample(&self, line: &Arc<str>) {
        let mut state = self.lock();
        if !state.closed {
            state.samples.push_back(Arc::clone(line));
        }
        while state.samples.len() > MOST_SAMPLES {
            state.samples.pop_front();
            state.lost += 1;
        }
        drop(state);
        self.changed.notify_all();
    }

    /// No more lines come.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// The client does not read its answers.
    pub(crate) fn is_cut(&self) -> bool {
        self.lock().cut
    }

    /// Takes the lines that wait, once there are some; none at the end.
    pub(crate) fn take(&self) -> Option<Vec<u8>> {
        let mut state = self.lock();
        while state.answers.is_empty() && state.samples.is_empty() && !state.closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if state.cut || (state.answers.is_empty() && state.samples.is_empty()) {
            return None;
        }
        let mut bytes = Vec::new();
        state.bytes = 0;
        state.answers.drain(..).for_each(|line| bytes.extend_from_slice(line.as_bytes()));
        if let samples @ 1.. = std::mem::take(&mut state.lost) {
            bytes.extend_from_slice(Outgoing::Event(Event::Lost { samples }).line().as_bytes());
        }
        state.samples.drain(..).for_each(|line| bytes.extend_from_slice(line.as_bytes()));
        Some(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::Answer;
    use serde_json::Value;

    #[test]
    fn unread_samples_are_dropped_and_counted_and_answers_are_kept() {
        let outbox = Outbox::default();
        let answer = |id: u64| Outgoing::to(Value::from(id), Ok(Answer::default()));
        for k in 0..MOST_SAMPLES + 7 {
            outbox.sample(&Arc::from(format!("{k}\n")));
            outbox.answer(&answer(k as u64));
        }
        let text = String::from_utf8(outbox.take().expect("open")).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), MOST_SAMPLES + 7 + 1 + MOST_SAMPLES);
        assert_eq!(lines[MOST_SAMPLES + 7], r#"{"event":"lost","samples":7}"#);
        assert_eq!((lines[MOST_SAMPLES + 8], lines[0]), ("7", r#"{"id":0,"answer":{}}"#));
        outbox.sample(&Arc::from("8\n"));
        outbox.close();
        assert_eq!(outbox.take().as_deref(), Some("8\n".as_bytes()), "what waits is still written");
        assert_eq!(outbox.take(), None);
    }

    #[test]
    fn a_client_that_reads_no_answers_is_cut() {
        let outbox = Outbox::default();
        let long = Outgoing::to(Value::from("x".repeat(1 << 16)), Ok(Answer::default()));
        (0..100).for_each(|_| outbox.answer(&long));
        assert!(outbox.is_cut() && outbox.take().is_none());
    }
}
