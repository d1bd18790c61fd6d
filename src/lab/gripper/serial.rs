//! The real gripper: a board on a serial port that reports its sensors and may drive the control box. Lines to the
//! board: `P 0.55` sets the line pressure (bar), `K` keeps it, `V` vents.

use super::{BoardStream, Gripper, GripperError, GripperEvent};
use palpate_device::serial::{LinkEvent, SendError};
use palpate_sim::gripper::Phase;
use std::collections::VecDeque;
use std::time::Duration;

/// The board vents after a second without a line; this leaves it time (s).
const KEEP_ALIVE_S: f64 = 0.4;

/// A board behind a stream. Dropping it vents, where it was under pressure from here.
pub struct SerialGripper {
    stream: Box<dyn BoardStream>,
    waiting: VecDeque<LinkEvent>,
    /// The last event of a batch was delivered.
    tick_due: bool,
    bar: f64,
    sent_s: f64,
}

impl SerialGripper {
    /// Wraps an open stream.
    pub fn new(stream: Box<dyn BoardStream>) -> Self {
        Self { stream, waiting: VecDeque::new(), tick_due: false, bar: 0.0, sent_s: 0.0 }
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
