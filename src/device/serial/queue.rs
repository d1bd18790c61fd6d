//! Queues between the threads of a link. They are bounded: what does not fit is counted and reported.

use crate::protocol::BoardEvent;
use palpate_tactile::board::Gap;
use palpate_tactile::capture::Captured;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Bytes that may wait to be decoded: a minute at 1 kHz and 8 channels.
const WAITING_BYTES: usize = 4 << 20;
/// Events that may wait to be taken: a minute at 1 kHz.
const WAITING_EVENTS: usize = 120_000;

/// Behaviour of a full queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WhenFull {
    /// Drop and count: a board does not wait.
    Drop,
    /// Wait for room: a file does.
    Wait,
}

/// A lock is only ever held for a few instructions that cannot fail; its data are valid even after a panic.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From the reader to the decoder.
#[derive(Debug)]
pub(super) struct ByteQueue {
    state: Mutex<Bytes>,
    changed: Condvar,
    when_full: WhenFull,
    room: usize,
}

#[derive(Debug, Default)]
struct Bytes {
    pieces: VecDeque<Captured>,
    size: usize,
    /// Bytes dropped since the last that were queued.
    dropped: u64,
    dropped_in_all: u64,
    closed: bool,
}

impl ByteQueue {
    pub(super) fn new(when_full: WhenFull) -> Self {
        Self { state: Mutex::default(), changed: Condvar::new(), when_full, room: WAITING_BYTES }
    }

    pub(super) fn push(&self, piece: Captured) {
        let size = size_of_piece(&piece);
        let mut state = lock(&self.state);
        while self.when_full == WhenFull::Wait && state.size + size > self.room && !state.closed {
            let waited = self.changed.wait_timeout(state, Duration::from_millis(50));
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        if state.size + size > self.room {
            state.dropped += size as u64;
            state.dropped_in_all += size as u64;
            return;
        }
        if let n @ 1.. = std::mem::take(&mut state.dropped) {
            let cause = format!("this computer was too slow: {n} bytes were dropped");
            let mark = Captured::Interrupted { at_s: piece.arrived_s(), cause };
            state.pieces.push_back(mark);
        }
        state.size += size;
        state.pieces.push_back(piece);
        drop(state);
        self.changed.notify_all();
    }

    /// Takes everything that waits, once there is something; none at the end.
    pub(super) fn take(&self) -> Option<VecDeque<Captured>> {
        let mut state = lock(&self.state);
        while state.pieces.is_empty() && !state.closed {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        let pieces = std::mem::take(&mut state.pieces);
        state.size = 0;
        drop(state);
        self.changed.notify_all();
        (!pieces.is_empty()).then_some(pieces)
    }

    pub(super) fn close(&self) {
        lock(&self.state).closed = true;
        self.changed.notify_all();
    }

    pub(super) fn dropped_bytes(&self) -> u64 {
        lock(&self.state).dropped_in_all
    }
}

fn size_of_piece(piece: &Captured) -> usize {
    match piece {
        Captured::Bytes { bytes, .. } => bytes.len(),
        Captured::Interrupted { cause, .. } => cause.len(),
    }
}

/// From the decoder to the receiver.
#[derive(Debug)]
pub(super) struct EventQueue {
    state: Mutex<Events>,
    changed: Condvar,
    when_full: WhenFull,
    room: usize,
}

#[derive(Debug, Default)]
struct Events {
    events: VecDeque<BoardEvent>,
    /// Readings dropped since the last call of `take`, and the time of the first of them (s).
    dropped: Option<(u64, f64)>,
    dropped_in_all: u64,
    /// Time of the last reading that `take` returned (s).
    taken_s: Option<f64>,
    closed: bool,
}

impl EventQueue {
    pub(super) fn new(when_full: WhenFull) -> Self {
        Self::with_room(when_full, WAITING_EVENTS)
    }

    fn with_room(when_full: WhenFull, room: usize) -> Self {
        Self { state: Mutex::default(), changed: Condvar::new(), when_full, room }
    }

    pub(super) fn push(&self, events: impl Iterator<Item = BoardEvent>) {
        let mut state = lock(&self.state);
        while self.when_full == WhenFull::Wait && state.events.len() >= self.room && !state.closed {
            let waited = self.changed.wait_timeout(state, Duration::from_millis(50));
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        state.events.extend(events);
        // A board's description is small and rare, and later receivers need it.
        let mut kept = Vec::new();
        while state.events.len() > self.room {
            match state.events.pop_front() {
                Some(BoardEvent::Reading(reading)) => {
                    let (count, from_s) = state.dropped.unwrap_or((0, reading.t_s));
                    state.dropped = Some((count + 1, from_s));
                    state.dropped_in_all += 1;
                }
                Some(board @ BoardEvent::Board(_)) => kept = vec![board],
                _ => {}
            }
        }
        for board in kept {
            state.events.push_front(board);
        }
        drop(state);
        self.changed.notify_all();
    }

    /// Takes everything that waits; if nothing does, waits up to a time.
    pub(super) fn take(&self, patience: Duration) -> Vec<BoardEvent> {
        let mut state = lock(&self.state);
        if state.events.is_empty() && !state.closed {
            let waited = self.changed.wait_timeout_while(state, patience, |s| s.events.is_empty() && !s.closed);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let mut events: Vec<BoardEvent> = state.events.drain(..).collect();
        let times: Vec<f64> = events.iter().filter_map(|event| Some(event.reading()?.t_s)).collect();
        if let Some((lost, from_s)) = state.dropped.take() {
            let gap = Gap {
                from_s: state.taken_s.unwrap_or(from_s),
                to_s: times.first().copied().unwrap_or(from_s),
                lost: Some(lost),
                cause: "this computer was too slow: readings were dropped".to_owned(),
            };
            events.insert(0, BoardEvent::Gap(gap));
        }
        state.taken_s = times.last().copied().or(state.taken_s);
        drop(state);
        self.changed.notify_all();
        events
    }

    /// Ends the queue.
    pub(super) fn close(&self) {
        lock(&self.state).closed = true;
        self.changed.notify_all();
    }

    /// True when nothing waits and there will be nothing more.
    pub(super) fn is_over(&self) -> bool {
        let state = lock(&self.state);
        state.closed && state.events.is_empty()
    }

    pub(super) fn dropped_readings(&self) -> u64 {
        lock(&self.state).dropped_in_all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_tactile::board::{Board, Reading};

    fn reading(i: u32) -> BoardEvent {
        let t_s = f64::from(i);
        BoardEvent::Reading(Reading { t_s, arrived_s: t_s, seq: None, counts: vec![], line_bar: None })
    }

    #[test]
    fn readings_that_nobody_takes_become_one_gap() {
        let queue = EventQueue::with_room(WhenFull::Drop, 10);
        queue.push([BoardEvent::Board(Board::default()), reading(0)].into_iter());
        assert_eq!(queue.take(Duration::ZERO).len(), 2);
        for i in 1..=100 {
            queue.push(std::iter::once(reading(i)));
        }
        let events = queue.take(Duration::ZERO);
        assert_eq!(events.len(), 11);
        let BoardEvent::Gap(gap) = &events[0] else { panic!("{events:?}") };
        assert_eq!((gap.from_s, gap.to_s, gap.lost), (0.0, 91.0, Some(90)));
        assert!(queue.dropped_readings() == 90 && queue.take(Duration::ZERO).is_empty());
    }

    #[test]
    fn bytes_that_find_no_room_leave_a_mark() {
        let queue = ByteQueue { room: 100, ..ByteQueue::new(WhenFull::Drop) };
        let piece = |t| Captured::Bytes { arrived_s: t, bytes: vec![0; 40] };
        for i in 0..5 {
            queue.push(piece(f64::from(i)));
        }
        assert_eq!(queue.take().map(|pieces| pieces.len()), Some(2));
        queue.push(piece(9.0));
        let pieces: Vec<Captured> = queue.take().into_iter().flatten().collect();
        assert!(matches!(&pieces[0], Captured::Interrupted { cause, .. } if cause.contains("120 bytes")), "{pieces:?}");
        assert_eq!((pieces.len(), queue.dropped_bytes()), (2, 120));
        queue.close();
        assert_eq!(queue.take(), None);
    }
}
