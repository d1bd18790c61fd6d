//! A stored trial as a gripper: the same events in the same order, whatever pressure is set.

use super::{Gripper, GripperError, GripperEvent};
use palpate_device::protocol::BoardEvent;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Phase;
use palpate_tactile::trial::{BoardLog, Trial, TrialData};
use std::time::Duration;

/// The events of a trial, in order. Captured bytes in a file are replayed by [`super::listen_to_port`].
#[derive(Clone, Debug)]
pub struct ReplayedGripper {
    events: std::vec::IntoIter<GripperEvent>,
    now_s: f64,
}

impl ReplayedGripper {
    /// Replays frames, readings with their gaps, or samples of channels, in order of time.
    pub fn new(trial: Trial) -> Self {
        let events: Vec<GripperEvent> = match trial.data {
            TrialData::Simulated(data) => data.frames.into_iter().map(GripperEvent::Sampled).collect(),
            TrialData::Recorded(log) => events_of(log),
            TrialData::Imported(signals) => {
                let sample = |(k, t_s): (usize, &f64)| (*t_s, signals.row(k).to_vec());
                let samples = signals.t_s.iter().enumerate().map(sample);
                samples.map(|(t_s, values)| GripperEvent::Signals { t_s, values }).collect()
            }
        };
        Self { events: events.into_iter(), now_s: 0.0 }
    }
}

fn events_of(log: BoardLog) -> Vec<GripperEvent> {
    let mut timed: Vec<(f64, BoardEvent)> = vec![(f64::NEG_INFINITY, BoardEvent::Board(log.course.board))];
    timed.extend(log.gaps.into_iter().map(|gap| (gap.from_s.next_up(), BoardEvent::Gap(gap))));
    timed.extend(log.readings.into_iter().map(|reading| (reading.t_s, BoardEvent::Reading(reading))));
    timed.sort_by(|a, b| a.0.total_cmp(&b.0));
    timed.into_iter().map(|(_, event)| GripperEvent::Board(event)).collect()
}

impl Gripper for ReplayedGripper {
    fn now_s(&self) -> f64 {
        self.now_s
    }

    fn next_event(&mut self, _patience: Duration) -> Result<GripperEvent, GripperError> {
        let event = self.events.next().unwrap_or(GripperEvent::Finished);
        match &event {
            GripperEvent::Sampled(Frame { t: t_s, .. }) | GripperEvent::Signals { t_s, .. } => self.now_s = *t_s,
            GripperEvent::Board(BoardEvent::Reading(reading)) => self.now_s = reading.t_s,
            GripperEvent::Board(_) | GripperEvent::Tick | GripperEvent::Finished => {}
        }
        Ok(event)
    }

    fn set_pressure(&mut self, _bar: f64, _phase: Phase) -> Result<(), GripperError> {
        Ok(())
    }

    fn vent(&mut self) -> Result<(), GripperError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_sim::scene::Scene;
    use palpate_store::{BoardChunk, BoardInfo, ImportedTrial, Store};
    use palpate_tactile::Signals;
    use palpate_tactile::board::{Board, Gap, Reading};
    use palpate_tactile::trial::{BoardCourse, TrialHeader};

    fn events(trial: Trial) -> Vec<(f64, GripperEvent)> {
        let mut gripper = ReplayedGripper::new(trial);
        let next = || match gripper.next_event(Duration::ZERO).expect("never fails") {
            GripperEvent::Finished => None,
            event => Some((gripper.now_s(), event)),
        };
        std::iter::from_fn(next).collect()
    }

    #[test]
    fn stored_trials_of_each_source_replay_in_order() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let mut store = Store::open(&folder.path().join("trials.sqlite"))?;

        let mut scene = Scene::default();
        scene.timing.duration_s = 0.5;
        let simulated = grasp(&scene, None, 0);
        let id = store.insert(&simulated)?.id();
        let stored = store.load(id)?;
        let frames: Vec<_> = simulated.frames().iter().cloned().map(|f| (f.t, GripperEvent::Sampled(f))).collect();
        assert!(events(stored) == frames && !frames.is_empty());

        let reading = |t_s| Reading { t_s, arrived_s: t_s, seq: None, counts: vec![Some(7.0)], line_bar: None };
        let gap = Gap { from_s: 0.02, to_s: 0.06, lost: Some(1), cause: String::new() };
        let board = Board { channels: vec!["flexL".to_owned()], ..Board::default() };
        let readings = [0.0, 0.02, 0.06].map(reading);
        let info = BoardInfo {
            course: BoardCourse { board: board.clone(), ..BoardCourse::default() },
            ..BoardInfo::default()
        };
        let id = store.begin_board(&TrialHeader::new("lemon", Scene::default()), &info)?;
        let chunk = BoardChunk { readings: readings.to_vec(), gaps: vec![gap.clone()], ..BoardChunk::default() };
        store.append_board(id, &info, &chunk)?;
        let [first, second, third] = readings.map(BoardEvent::Reading);
        let expected = [BoardEvent::Board(board), first, second, BoardEvent::Gap(gap), third];
        let replayed = events(store.load(id)?);
        let times: Vec<f64> = replayed.iter().map(|(now_s, _)| *now_s).collect();
        assert_eq!(times, [0.0, 0.0, 0.02, 0.02, 0.06]);
        let replayed: Vec<GripperEvent> = replayed.into_iter().map(|(_, event)| event).collect();
        assert_eq!(replayed, expected.map(GripperEvent::Board));

        let signals = Signals { channels: vec!["p".to_owned()], t_s: vec![0.0, 0.1], values: vec![1.0, 2.0] };
        let (name, label) = ("1".to_owned(), "mug".to_owned());
        store.insert_imported(
            "mine",
            &[ImportedTrial { name, label, size: None, shape: None, session: None, signals }],
        )?;
        let sample = |t_s: f64, value: f32| (t_s, GripperEvent::Signals { t_s, values: vec![value] });
        assert_eq!(events(store.load(id + 1)?), [sample(0.0, 1.0), sample(0.1, 2.0)]);
        Ok(())
    }
}
