//! The real gripper: a board on a serial port that reports its sensors and may drive the control box. Lines to the
//! board: `P 0.55` sets the line pressure (bar), `K` keeps it, `V` vents.

use super::{BoardStream, Gripper, GripperError, GripperEvent};
use palpate_device::protocol::BoardEvent;
use palpate_device::serial::SendError;
use palpate_sim::gripper::Phase;
use std::collections::VecDeque;
use std::time::Duration;

/// Interval of keep-alive lines (s): the board vents after a second without a line.
const KEEP_ALIVE_S: f64 = 0.4;

/// A board behind a stream. Dropping it vents the fingers if this program had set a pressure.
pub struct SerialGripper {
    stream: Box<dyn BoardStream>,
    waiting: VecDeque<BoardEvent>,
    /// The last event of a batch was delivered.
    tick_due: bool,
    bar: f64,
    sent_s: f64,
    looked_s: f64,
}

impl SerialGripper {
    /// Wraps an open stream.
    pub fn new(stream: Box<dyn BoardStream>) -> Self {
        Self { stream, waiting: VecDeque::new(), tick_due: false, bar: 0.0, sent_s: 0.0, looked_s: 0.0 }
    }

    /// When the stream was looked at last (s): what had arrived by then was delivered before the next tick.
    pub fn looked_s(&self) -> f64 {
        self.looked_s
    }

    /// The stream: status, console.
    pub fn stream(&self) -> &dyn BoardStream {
        self.stream.as_ref()
    }

    /// Sends a line to the board.
    pub fn send(&mut self, line: &str) -> Result<(), SendError> {
        self.sent_s = self.stream.now_s();
        self.stream.send(line)
    }

    /// Keeps the board from venting while the pressure stays.
    fn keep_alive(&mut self) -> Result<(), GripperError> {
        if self.bar > 0.0 && self.stream.now_s() - self.sent_s >= KEEP_ALIVE_S {
            self.send("K")?;
        }
        Ok(())
    }
}

impl Gripper for SerialGripper {
    fn now_s(&self) -> f64 {
        self.stream.now_s()
    }

    fn next_event(&mut self, patience: Duration) -> Result<GripperEvent, GripperError> {
        // A tick follows each batch, so that a fast board cannot hold up the pressure.
        if std::mem::take(&mut self.tick_due) {
            return Ok(GripperEvent::Tick);
        }
        if self.waiting.is_empty() {
            self.keep_alive()?;
            self.waiting = self.stream.take(patience).into();
            self.looked_s = self.stream.now_s();
        }
        let event = self.waiting.pop_front();
        self.tick_due = event.is_some() && self.waiting.is_empty();
        Ok(match event {
            Some(event) => GripperEvent::Board(event),
            None if self.stream.is_over() => GripperEvent::Finished,
            None => GripperEvent::Tick,
        })
    }

    fn set_pressure(&mut self, bar: f64, _phase: Phase) -> Result<(), GripperError> {
        self.bar = bar;
        Ok(self.send(&format!("P {bar:.2}"))?)
    }

    fn vent(&mut self) -> Result<(), GripperError> {
        self.bar = 0.0;
        Ok(self.send("V")?)
    }

    fn cut_short(&self) -> Option<String> {
        self.stream.status().state.cut_short().map(str::to_owned)
    }
}

impl Drop for SerialGripper {
    fn drop(&mut self) {
        if self.bar > 0.0
            && let Err(error) = self.vent()
        {
            // The board vents within a second.
            tracing::debug!("{error}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::{GraspController, GraspPlan};
    use palpate_device::protocol::ConsoleLine;
    use palpate_device::serial::{BoardKind, LinkState, LinkStatus, PortInfo};
    use palpate_sim::scene::Scene;
    use palpate_tactile::board::{Board, Reading};
    use palpate_tactile::cadence::Cadence;
    use palpate_tactile::trial::Control;
    use std::sync::{Arc, Mutex};

    /// A board that sends two readings with each look, which takes 10 ms of its clock, and keeps the lines that it gets.
    struct FakeBoard {
        t_s: f64,
        lines: Arc<Mutex<Vec<(f64, String)>>>,
    }

    impl BoardStream for FakeBoard {
        fn take(&mut self, _patience: Duration) -> Vec<BoardEvent> {
            self.t_s += 0.01;
            let reading = |t_s| Reading { t_s, arrived_s: t_s, seq: None, counts: vec![], line_bar: None };
            [self.t_s - 0.005, self.t_s].map(|t_s| BoardEvent::Reading(reading(t_s))).into()
        }

        fn status(&self) -> LinkStatus {
            LinkStatus {
                state: LinkState::Listening,
                port: PortInfo { path: "fake".into(), title: String::new(), usb: None, kind: BoardKind::default() },
                baud: Some(115_200),
                board: Board::default(),
                detected: None,
                cadence: Cadence::default(),
                saturation: Vec::new(),
                adc_range: palpate_device::protocol::AdcRange::default(),
                reconnects: 0,
                now_s: self.t_s,
                dropped: [0; 2],
            }
        }

        fn now_s(&self) -> f64 {
            self.t_s
        }

        fn send(&mut self, line: &str) -> Result<(), SendError> {
            self.lines.lock().expect("no panic").push((self.t_s, line.to_owned()));
            Ok(())
        }

        fn console(&self) -> Vec<ConsoleLine> {
            Vec::new()
        }

        fn is_over(&self) -> bool {
            false
        }
    }

    #[test]
    fn a_driven_programme_is_sent_line_by_line_kept_alive_and_vented() {
        let lines = Arc::new(Mutex::new(Vec::new()));
        let mut gripper = SerialGripper::new(Box::new(FakeBoard { t_s: 0.0, lines: Arc::clone(&lines) }));
        let mut controller = GraspController::new(GraspPlan::recorded(&Scene::default(), Control::Driven), 0.0);
        let (mut readings, mut ticks) = (0i32, 0i32);
        // Up to the middle of the hold: then the gripper is dropped under pressure.
        while gripper.now_s() < 4.4 {
            match gripper.next_event(Duration::ZERO).expect("an open port") {
                GripperEvent::Board(_) => readings += 1,
                GripperEvent::Tick => ticks += 1,
                GripperEvent::Sampled(_) | GripperEvent::Signals { .. } | GripperEvent::Finished => {
                    panic!("not of a board")
                }
            }
            if let Some(command) = controller.command(gripper.now_s()) {
                gripper.set_pressure(command.bar, command.phase).expect("an open port");
            }
        }
        drop(gripper);
        assert!(readings > 800 && (2 * ticks - readings).abs() <= 2, "{readings} readings, {ticks} ticks");
        let lines = lines.lock().expect("no panic").clone();
        let texts: Vec<&str> = lines.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!((texts[0], texts[19], texts.last().copied()), ("P 0.05", "P 1.00", Some("V")));
        assert_eq!(texts.iter().filter(|text| **text == "K").count(), 2, "{texts:?}");
        // The board vents after a second of silence.
        assert!(lines.windows(2).all(|pair| pair[1].0 - pair[0].0 < 0.5), "{lines:?}");
    }
}
