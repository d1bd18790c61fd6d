//! The real gripper as a rig: its board's readings, and its control box. The box is driven from here where the board
//! passes pressure on; else by hand, and the programme only says what should be done when. Time is this computer's.

use super::conductor::{Conductor, VENT};
use crate::gripper::{Event, Rig, RigError};
use palpate_device::protocol::DecodedEvent;
use palpate_device::serial::{LinkEvent, LinkState, LinkStatus, SerialLink};
use palpate_sim::frame::Quality;
use palpate_sim::gripper::Phase;
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::{Control, PhaseMark};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// What a recording on a real gripper is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SerialPlan {
    /// Who moves the fingers.
    pub control: Control,
    /// Actuation ticks per second (1/s).
    pub actuation_hz: f64,
    /// How long it takes (s); without it until it is stopped.
    pub seconds: Option<f64>,
}

/// How long the rig waits for the board at a time.
const PATIENCE: Duration = Duration::from_millis(20);
/// How long the board may take to send its first readings.
const FIRST_READING: Duration = Duration::from_secs(20);
/// The same where its bytes cannot be understood, all speeds tried.
const NONSENSE: Duration = Duration::from_secs(10);
/// The trial begins this long after the first reading (s): until then it is not known how late the first ones arrived.
const SETTLE_S: f64 = 0.5;
/// A board that is silent at the end is not waited for longer than this (s).
const LATE_S: f64 = 0.5;

/// The real gripper, from its first reading on. Dropping it vents.
#[derive(Debug)]
pub struct SerialRig {
    link: SerialLink,
    plan: SerialPlan,
    stop: Arc<AtomicBool>,
    began_s: f64,
    heard: VecDeque<LinkEvent>,
    marks: VecDeque<PhaseMark>,
    conductor: Conductor,
    notes: Vec<String>,
    over: bool,
    cut: bool,
}

impl SerialRig {
    /// Waits until the board speaks and the times of its readings have settled; the recording begins then.
    pub fn begin(link: SerialLink, plan: SerialPlan, stop: Arc<AtomicBool>) -> Result<Self, RigError> {
        let start = Instant::now();
        let mut heard = VecDeque::new();
        let mut first_s = None;
        let began_s = loop {
            heard.extend(link.take(PATIENCE));
            let LinkStatus { state, port, baud, cadence, .. } = link.status();
            first_s = first_s.or_else(|| heard.iter().find_map(reading_time));
            if let Some(first_s) = first_s {
                // Captured bytes keep the beginning that they were captured with.
                if baud.is_some() {
                    leave_out_before(&mut heard, first_s + SETTLE_S);
                }
                if let Some(t_s) = heard.iter().find_map(reading_time) {
                    break t_s;
                }
            }
            let nonsense = matches!(state, LinkState::Unreadable { .. }) && start.elapsed() > NONSENSE;
            if nonsense || start.elapsed() > FIRST_READING || stop.load(Ordering::Relaxed) || link.is_over() {
                let (path, why, bad) = (port.path.display(), state.sentence(), cadence.bad_lines);
                if baud.is_none() && link.is_over() {
                    return Err(RigError::Board(format!(
                        "no reading is in \"{path}\" ({bad} line(s) could not be read): it should hold bytes as a board \
                         sent them, such as `palpate trials export --labelled` writes"
                    )));
                }
                return Err(RigError::Board(format!("nothing was heard from \"{path}\": {why}")));
            }
        };
        let conductor = Conductor::new(plan.control, plan.actuation_hz, began_s);
        let (marks, notes) = (VecDeque::new(), Vec::new());
        Ok(Self { link, plan, stop, began_s, heard, marks, conductor, notes, over: false, cut: false })
    }

    /// When it began, on the clock of the readings (s).
    pub fn began_s(&self) -> f64 {
        self.began_s
    }

    /// The link to its board.
    pub fn link(&self) -> &SerialLink {
        &self.link
    }

    /// True where it ended a driven trial early, whose fingers did not do what they were told.
    pub fn was_cut(&self) -> bool {
        self.cut
    }

    fn end_s(&self) -> f64 {
        self.plan.seconds.map_or(f64::INFINITY, |seconds| self.began_s + seconds)
    }

    fn send(&mut self, line: &str) {
        if let Err(error) = self.link.send(line) {
            let note = format!("{line}: {error}");
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
            self.cut();
        }
    }

    /// The fingers do not do any more what they are told: where this program drives them, it must not go on as if nothing
    /// had happened, with a leap of pressure.
    fn cut(&mut self) {
        if self.plan.control == Control::Driven && !std::mem::replace(&mut self.over, true) {
            self.notes.push("ended early, and told to vent".to_owned());
            self.cut = true;
        }
    }

    /// What the next event is to those who listen.
    fn hear(&mut self, event: LinkEvent) -> Option<Event> {
        if reading_time(&event).is_some_and(|t_s| t_s >= self.end_s()) {
            self.over = true;
            return None;
        }
        if let LinkEvent::Decoded(DecodedEvent::Reply(reply)) = &event
            && reply.ends_control()
        {
            self.notes.push(format!("the board said: {reply}"));
            self.cut();
        }
        if matches!(event, LinkEvent::Captured(Captured::Interrupted { .. })) {
            self.cut();
        }
        Some(Event::Heard(event))
    }

    fn is_over(&self) -> bool {
        // Captured bytes keep their own time.
        let live = self.link.status().baud.is_some();
        let late = live && self.link.now_s() > self.end_s() + LATE_S;
        self.over || late || self.link.is_over() || self.stop.load(Ordering::Relaxed)
    }
}

/// Takes away readings from before a time, and what belongs to them; what is known of the board stays.
fn leave_out_before(heard: &mut VecDeque<LinkEvent>, from_s: f64) {
    let begins = heard.iter().position(|event| reading_time(event).is_some_and(|t_s| t_s >= from_s));
    let Some(mut begins) = begins else {
        heard.retain(|event| reading_time(event).is_none());
        return;
    };
    // The bytes of the first reading stand before it.
    if let Some(at) = heard.iter().take(begins).rposition(|event| matches!(event, LinkEvent::Captured(_))) {
        begins = at;
    }
    let mut place = 0;
    heard.retain(|event| {
        place += 1;
        place > begins || matches!(event, LinkEvent::Decoded(DecodedEvent::Board(_)))
    });
}

fn reading_time(event: &LinkEvent) -> Option<f64> {
    match event {
        LinkEvent::Decoded(DecodedEvent::Reading(reading)) => Some(reading.t_s),
        LinkEvent::Decoded(_) | LinkEvent::Captured(_) => None,
    }
}

impl Rig for SerialRig {
    fn name(&self) -> &'static str {
        "serial"
    }

    fn next_event(&mut self) -> Result<Event, RigError> {
        loop {
            if let Some(mark) = self.marks.pop_front() {
                return Ok(Event::Commanded(mark));
            }
            // Before the board is told anything, everything that it has said is heard: it may have vented.
            if self.heard.is_empty() {
                self.heard = self.link.take(Duration::ZERO).into();
            }
            if let Some(event) = self.heard.pop_front() {
                match self.hear(event) {
                    Some(event) => return Ok(event),
                    None => return Ok(Event::Finished),
                }
            }
            let now_s = self.link.now_s();
            if let Some(tick) = self.conductor.tick(now_s).filter(|_| !self.over) {
                return Ok(Event::ActuationDue { tick });
            }
            if self.is_over() {
                return Ok(Event::Finished);
            }
            if let Some(line) = self.conductor.keep_alive(now_s) {
                self.send(line);
            }
            self.heard = self.link.take(PATIENCE).into();
        }
    }

    fn command(&mut self, bar: f64, phase: Phase) {
        if let Some((mark, line)) = self.conductor.command(bar, phase, self.link.now_s()) {
            if let Some(line) = line {
                self.send(&line);
            }
            self.marks.push_back(mark);
        }
    }

    fn quality(&self) -> Quality {
        Quality::default()
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }
}

impl Drop for SerialRig {
    fn drop(&mut self) {
        if self.plan.control == Control::Driven
            && let Err(error) = self.link.send(VENT)
        {
            // A board that cannot be told vents by itself within a second.
            tracing::debug!("{error}");
        }
    }
}
