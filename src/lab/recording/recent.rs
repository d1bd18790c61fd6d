//! The last seconds of a stream: the rest before a trial belongs to it, because the zeros are taken there.

use palpate_device::protocol::BoardEvent;
use palpate_tactile::board::Reading;
use std::collections::VecDeque;

/// Length of the history (s).
const REMEMBERED_S: f64 = 2.0;
/// Events that are remembered at most: 2 s at 1 kHz, bytes and readings.
const MOST: usize = 6000;

/// The newest events, oldest first.
#[derive(Debug, Default)]
pub struct RecentEvents {
    events: VecDeque<BoardEvent>,
}

impl RecentEvents {
    /// Remembers an event.
    pub fn push(&mut self, event: &BoardEvent) {
        self.events.push_back(event.clone());
        let Some(now_s) = time_of(event) else { return };
        while self.events.len() > MOST || self.events.front().is_some_and(|e| is_before(e, now_s - REMEMBERED_S)) {
            self.events.pop_front();
        }
    }

    /// Everything from a time on, with the bytes of its first reading.
    pub fn since(&self, from_s: f64) -> Vec<BoardEvent> {
        let Some(first) = self.readings().position(|reading| reading.t_s >= from_s) else { return Vec::new() };
        let mut places = (0..self.events.len()).filter(|place| self.events[*place].reading().is_some());
        let place = places.nth(first).unwrap_or(0);
        // The bytes of a reading stand before it.
        let bytes = |event: &BoardEvent| matches!(event, BoardEvent::Captured(_));
        let begins = self.events.iter().take(place).rposition(bytes).unwrap_or(place);
        // Readings of the same piece from before the time stay out, and so does a gap that ended with the first reading.
        let first_s = self.readings().nth(first).map_or(from_s, |reading| reading.t_s);
        let early = |event: &BoardEvent| match event {
            BoardEvent::Reading(reading) => reading.t_s < from_s,
            BoardEvent::Gap(gap) => gap.to_s <= first_s,
            BoardEvent::Captured(_) | BoardEvent::Board(_) | BoardEvent::Reply(_) => false,
        };
        self.events.iter().skip(begins).filter(|event| !early(event)).cloned().collect()
    }

    /// Readings of the last so many seconds.
    pub fn last(&self, seconds: f64) -> Vec<Reading> {
        let now_s = self.readings().last().map_or(0.0, |last| last.t_s);
        self.between(now_s - seconds, f64::INFINITY)
    }

    /// Readings after one time and before another (s).
    pub fn between(&self, from_s: f64, to_s: f64) -> Vec<Reading> {
        self.readings().filter(|reading| reading.t_s > from_s && reading.t_s < to_s).cloned().collect()
    }

    fn readings(&self) -> impl Iterator<Item = &Reading> {
        self.events.iter().filter_map(BoardEvent::reading)
    }
}

/// Time of an event on the clock of the readings (s); none for events without a time.
fn time_of(event: &BoardEvent) -> Option<f64> {
    match event {
        BoardEvent::Reading(reading) => Some(reading.t_s),
        BoardEvent::Captured(piece) => Some(piece.arrived_s()),
        BoardEvent::Gap(_) | BoardEvent::Board(_) | BoardEvent::Reply(_) => None,
    }
}

fn is_before(event: &BoardEvent, t_s: f64) -> bool {
    time_of(event).is_none_or(|own| own < t_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_tactile::capture::Captured;

    #[test]
    fn what_came_before_is_given_with_its_bytes_and_is_bounded() {
        let mut recent = RecentEvents::default();
        for k in 0..100_000u32 {
            let t_s = 1e-3 * f64::from(k);
            if k % 10 == 0 {
                recent.push(&BoardEvent::Captured(Captured::Bytes { arrived_s: t_s, bytes: vec![0; 8] }));
            }
            let reading = Reading { t_s, arrived_s: t_s, seq: None, counts: vec![], line_bar: None };
            recent.push(&BoardEvent::Reading(reading));
        }
        assert!(recent.events.len() < 2300, "{}", recent.events.len());
        let since = recent.since(99.5055);
        assert!(matches!(&since[0], BoardEvent::Captured(piece) if (piece.arrived_s() - 99.5).abs() < 1e-9));
        assert!(matches!(&since[1], BoardEvent::Reading(reading) if (reading.t_s - 99.506).abs() < 1e-9));
        assert_eq!(recent.last(0.1).len(), 100);
        assert!(recent.since(200.0).is_empty());
    }
}
