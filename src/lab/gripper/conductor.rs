//! What the control box of a real gripper is to do, and when: actuation ticks by this computer's clock, the lines that
//! tell the board, and the marks that tell the trial.

use palpate_sim::gripper::Phase;
use palpate_tactile::trial::{Control, PhaseMark};

/// The board vents when it hears nothing for a second; this leaves it time (s).
const KEEP_ALIVE_S: f64 = 0.4;

/// Behind the clock by more than this, a programme goes on from where it was, later: the pressure takes no leap (s).
const LATE_S: f64 = 0.25;

/// The line that vents the fingers.
pub const VENT: &str = "V";

/// Takes a control box through a programme.
#[derive(Clone, Debug)]
pub struct Conductor {
    control: Control,
    actuation_hz: f64,
    from_s: f64,
    asked: Option<u32>,
    commanded: Option<(f64, Phase)>,
    sent_s: f64,
}

impl Conductor {
    /// Actuation tick 0 begins at `from_s`, on the clock of the readings (s).
    pub fn new(control: Control, actuation_hz: f64, from_s: f64) -> Self {
        Self { control, actuation_hz, from_s, asked: None, commanded: None, sent_s: from_s }
    }

    /// The actuation tick that is due and was not asked for. A few that were slept through are left out; after more of
    /// them, or where the first comes late, the programme is that much later.
    pub fn tick(&mut self, now_s: f64) -> Option<u32> {
        if self.control == Control::Free || now_s < self.from_s {
            return None;
        }
        let next = self.asked.map_or(0, |asked| asked + 1);
        let late_s = now_s - self.from_s - f64::from(next) / self.actuation_hz;
        if late_s > LATE_S {
            self.from_s += late_s;
        }
        let tick = ((now_s - self.from_s) * self.actuation_hz + 1e-6) as u32;
        (self.asked != Some(tick)).then(|| {
            self.asked = Some(tick);
            tick
        })
    }

    /// Sets the pressure (bar): what to note, and what to tell the board; nothing where it stays as it is.
    pub fn command(&mut self, bar: f64, phase: Phase, now_s: f64) -> Option<(PhaseMark, Option<String>)> {
        if self.commanded == Some((bar, phase)) {
            return None;
        }
        self.commanded = Some((bar, phase));
        let driven = self.control == Control::Driven;
        let line = driven.then(|| {
            self.sent_s = now_s;
            format!("P {bar:.2}")
        });
        // The board tells the pressure itself where it knows it; by hand, the programme's is only what was wished for.
        Some((PhaseMark { from_s: now_s, phase, line_bar: driven.then_some(bar) }, line))
    }

    /// What keeps the board from venting while the pressure stays, where it is time to say it.
    pub fn keep_alive(&mut self, now_s: f64) -> Option<&'static str> {
        let pressed = self.commanded.is_some_and(|(bar, _)| bar > 0.0);
        let due = self.control == Control::Driven && pressed && now_s - self.sent_s >= KEEP_ALIVE_S;
        due.then(|| {
            self.sent_s = now_s;
            "K"
        })
    }

    /// When tick 0 was or will be (s); where the programme is late, later ticks count from a later time.
    pub fn from_s(&self) -> f64 {
        self.from_s
    }

    /// Who moves the fingers.
    pub fn control(&self) -> Control {
        self.control
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::gripper::Programme;

    #[test]
    fn a_programme_is_told_line_by_line_and_kept_alive_while_it_holds() {
        let programme = Programme::default();
        let mut conductor = Conductor::new(Control::Driven, 10.0, 2.0);
        let (mut marks, mut lines) = (Vec::new(), Vec::new());
        for ms in 0..7000u32 {
            let now_s = 1e-3 * f64::from(ms);
            if let Some((bar, phase)) = conductor.tick(now_s).map(|tick| programme.command(tick))
                && let Some((mark, line)) = conductor.command(bar, phase, now_s)
            {
                marks.push(mark);
                lines.extend(line);
            }
            lines.extend(conductor.keep_alive(now_s).map(str::to_owned));
        }
        assert_eq!((marks[0].from_s, marks[0].phase, marks[0].line_bar), (2.0, Phase::Close, Some(0.05)));
        // Twenty steps up, one hold, ten down; twice kept alive within the second of the hold.
        assert_eq!(marks.len(), 31);
        assert_eq!(lines.iter().filter(|line| *line == "K").count(), 2);
        assert_eq!(
            (lines[0].as_str(), lines[19].as_str(), lines.last().map(String::as_str)),
            ("P 0.05", "P 1.00", Some("P 0.00"))
        );
        let mut by_hand = Conductor::new(Control::ByHand, 10.0, 0.0);
        let (mark, line) = by_hand.command(0.05, Phase::Close, 0.0).expect("something new");
        assert_eq!((mark.line_bar, line, by_hand.keep_alive(9.0)), (None, None, None));
        // However late it begins, and however long it sleeps: no leap.
        let mut late = Conductor::new(Control::Driven, 10.0, 2.0);
        let told: Vec<(u32, f64)> =
            [5.0, 5.1, 5.2, 8.0, 8.1].map(|now_s| (late.tick(now_s).unwrap_or(99), late.from_s())).into();
        let ticks: Vec<u32> = told.iter().map(|(tick, _)| *tick).collect();
        assert_eq!(ticks, [0, 1, 2, 3, 4]);
        assert!((told[0].1 - 5.0).abs() < 1e-9 && (told[4].1 - 7.7).abs() < 1e-9, "{told:?}");
        assert_eq!(Conductor::new(Control::Free, 10.0, 0.0).tick(1.0), None);
    }
}
