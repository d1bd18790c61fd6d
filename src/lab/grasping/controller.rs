//! The grasp controller: one state machine for every grasp, simulated, real or replayed.
//!
//! ```text
//! Lead --> Phase(Close) --> Phase(Hold) --> Phase(Release) --> Settle --> over
//!   \___________\_______________\________________\______________________/ abort: the cause is kept
//! ```
//!
//! The controller does not depend on the kind of gripper: the caller passes the time on the gripper's clock and gets
//! back the line pressure to set now. An untimed grasp ([`Control::Free`]) has no pressure programme; the caller
//! reports its phases, if known, through [`GraspController::observe_phase`].

use super::pressure_watch::PressureWatch;
use crate::gripper::GripperEvent;
use palpate_device::protocol::{BoardEvent, BoardReply};
use palpate_sim::gripper::{Phase, Programme};
use palpate_sim::scene::Scene;
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::{Control, PhaseMark};

/// Rest before a real hand closes (s): the zeros are taken there, and an operator gets ready.
pub const LEAD_S: f64 = 1.5;
/// Recording of a real hand after the programme (s).
const SETTLE_S: f64 = 0.4;
/// A programme that is later than this continues from where it was, so the pressure does not jump (s).
const LATE_S: f64 = 0.25;

/// Course of a grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspPlan {
    /// Actuation: by board, by hand or untimed.
    pub control: Control,
    /// Line pressure over actuation ticks.
    pub programme: Programme,
    /// Actuation ticks per second (1/s).
    pub actuation_hz: f64,
    /// Rest before the programme begins (s).
    pub lead_s: f64,
    /// Recording after the programme ends (s).
    pub settle_s: f64,
    /// Length of an untimed grasp (s); none until something else ends it.
    pub length_s: Option<f64>,
}

impl GraspPlan {
    /// A simulated grasp: the programme begins at once, and the trial ends with the simulation.
    pub fn simulated(scene: &Scene) -> Self {
        Self { lead_s: 0.0, settle_s: f64::INFINITY, ..Self::recorded(scene, Control::Driven) }
    }

    /// A grasp of the real gripper.
    pub fn recorded(scene: &Scene, control: Control) -> Self {
        Self {
            control,
            programme: scene.programme.clone(),
            actuation_hz: f64::from(scene.timing.actuation_hz.max(1)),
            lead_s: LEAD_S,
            settle_s: SETTLE_S,
            length_s: None,
        }
    }

    /// Length from the beginning of the rest to the end (s), where it is known.
    pub fn total_s(&self) -> Option<f64> {
        match self.control {
            Control::Free => self.length_s,
            Control::ByHand | Control::Driven => Some(self.lead_s + self.programme_s() + self.settle_s),
        }
    }

    fn programme_s(&self) -> f64 {
        f64::from(self.programme.total_ticks()) / self.actuation_hz
    }
}

/// Stage of a grasp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GraspStage {
    /// Rest before the closing.
    Lead,
    /// A phase of the programme.
    Phase(Phase),
    /// Rest after the programme, still recorded.
    Settle,
    /// Untimed, and no phase known.
    Free,
}

/// A change of line pressure that is due.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureCommand {
    /// Line pressure (bar).
    pub bar: f64,
    /// Phase of the programme.
    pub phase: Phase,
    /// Time on the gripper's clock (s).
    pub at_s: f64,
}

/// Takes one grasp from rest to rest.
#[derive(Clone, Debug)]
pub struct GraspController {
    plan: GraspPlan,
    began_s: f64,
    /// Time of actuation tick 0 (s); a delay of the programme is added.
    programme_s: f64,
    /// The newest actuation tick.
    tick: Option<u32>,
    command: Option<(f64, Phase)>,
    phase: Option<Phase>,
    closing_s: Option<f64>,
    abort: Option<String>,
    /// Checks of the board that drives real fingers; none for simulated and hand-driven grasps.
    watch: Option<PressureWatch>,
}

impl GraspController {
    /// Starts a grasp at `now_s` on the gripper's clock.
    pub fn new(plan: GraspPlan, now_s: f64) -> Self {
        let programme_s = now_s + plan.lead_s;
        let closing_s = (plan.control != Control::Free).then_some(programme_s);
        Self {
            plan,
            began_s: now_s,
            programme_s,
            tick: None,
            command: None,
            phase: None,
            closing_s,
            abort: None,
            watch: None,
        }
    }

    /// The plan.
    pub fn plan(&self) -> &GraspPlan {
        &self.plan
    }

    /// Time at which the closing begins or began (s); none if unknown.
    pub fn closing_s(&self) -> Option<f64> {
        self.closing_s
    }

    /// The line pressure to set at `now_s`, if it differs from the previous one. If the caller is up to 0.25 s late,
    /// the missed actuation ticks are skipped; if it is later, the programme is delayed by that time, so the pressure
    /// does not jump.
    pub fn command(&mut self, now_s: f64) -> Option<PressureCommand> {
        if self.plan.control == Control::Free || self.abort.is_some() || now_s < self.programme_s {
            return None;
        }
        let next = self.tick.map_or(0, |tick| tick + 1);
        let late_s = now_s - self.programme_s - f64::from(next) / self.plan.actuation_hz;
        if late_s > LATE_S {
            self.programme_s += late_s;
        }
        let tick = ((now_s - self.programme_s) * self.plan.actuation_hz + 1e-6) as u32;
        if self.tick.replace(tick) == Some(tick) {
            return None;
        }
        let (bar, phase) = self.plan.programme.command(tick);
        if self.command.replace((bar, phase)) == Some((bar, phase)) {
            return None;
        }
        if let Some(watch) = &mut self.watch {
            watch.command(bar, now_s);
        }
        Some(PressureCommand { bar, phase, at_s: now_s })
    }

    /// Goes from the present pressure to `bar`, up at the pace of the programme and down at the next tick, and stays there.
    pub fn aim(&mut self, bar: f64, now_s: f64) {
        let programme = &mut self.plan.programme;
        if self.tick.is_some() && programme.peak_bar == bar {
            return;
        }
        (programme.peak_bar, programme.hold_ticks) = (bar, u32::MAX);
        let on_bar = self.command.map_or(0.0, |(bar, _)| bar).min(bar);
        let ticks = (on_bar / programme.close_bar_per_tick + 1e-9) as u32;
        self.tick = ticks.checked_sub(1);
        self.programme_s = now_s - self.tick.map_or(0.0, f64::from) / self.plan.actuation_hz;
    }

    /// Starts the checks of the board that drives the fingers; it was told to vent at `now_s`.
    pub fn watch_board(&mut self, now_s: f64) {
        self.watch = Some(PressureWatch::new(now_s));
    }

    /// Aborts if a reply or reading of a watched board is overdue at `now_s`. All its events up to then must have been
    /// observed.
    pub fn check_board(&mut self, now_s: f64) {
        if let Some(Err(fault)) = self.watch.as_ref().map(|watch| watch.check(now_s)) {
            self.abort(fault.to_string());
        }
    }

    /// The mark that a command leaves in the trial. By hand only the phase is known, not the pressure.
    pub fn mark(&self, command: &PressureCommand) -> PhaseMark {
        let driven = self.plan.control == Control::Driven;
        PhaseMark { from_s: command.at_s, phase: command.phase, line_bar: driven.then_some(command.bar) }
    }

    /// Records that a phase began; returns it if it is new. A further `Close` after an earlier phase is not new:
    /// fingers may pause while they close.
    pub fn observe_phase(&mut self, mark: &PhaseMark) -> Option<Phase> {
        let phase = mark.phase;
        let again = phase == Phase::Close && self.phase.is_some();
        let new = self.phase != Some(phase) && !again;
        if new && phase == Phase::Close {
            self.closing_s = Some(mark.from_s);
        }
        self.phase = Some(phase);
        new.then_some(phase)
    }

    /// Handles an event of the gripper. A driven grasp is aborted if the board refuses a command, vents on its own,
    /// disconnects or fails a check of `PressureWatch`; it must not resume later with a jump of pressure. Returns the
    /// cause if the board vented or disconnected in a grasp that is not driven and therefore continues.
    pub fn observe(&mut self, event: &GripperEvent) -> Option<String> {
        let cause = match event {
            GripperEvent::Board(BoardEvent::Reply(BoardReply::Refused { reason })) => {
                self.abort(format!("the board refused a command ({reason})"));
                return None;
            }
            GripperEvent::Board(BoardEvent::Reply(BoardReply::Vented { cause })) => {
                format!("the board vented on its own ({cause})")
            }
            GripperEvent::Board(BoardEvent::Captured(Captured::Interrupted { cause, .. })) => cause.clone(),
            GripperEvent::Board(event) => {
                if let Some(Err(fault)) = self.watch.as_mut().map(|watch| watch.observe(event)) {
                    self.abort(fault.to_string());
                }
                return None;
            }
            GripperEvent::Sampled(_) | GripperEvent::Signals { .. } | GripperEvent::Tick | GripperEvent::Finished => {
                return None;
            }
        };
        self.abort(cause.clone());
        Some(cause).filter(|_| self.abort.is_none())
    }

    /// Aborts a driven grasp; others continue, because this program does not move their fingers. The first cause is kept.
    pub fn abort(&mut self, cause: String) {
        if self.plan.control == Control::Driven {
            self.abort.get_or_insert(cause);
        }
    }

    /// The cause of an abort.
    pub fn abort_cause(&self) -> Option<&str> {
        self.abort.as_deref()
    }

    /// Commanded line pressure (bar); none if this program does not command it.
    pub fn line_bar(&self) -> Option<f64> {
        self.command.filter(|_| self.plan.control == Control::Driven).map(|(bar, _)| bar)
    }

    /// Time at which the programme ends (s).
    fn programme_end_s(&self) -> Option<f64> {
        (self.plan.control != Control::Free).then(|| self.programme_s + self.plan.programme_s())
    }

    /// Time at which the grasp ends (s), if known.
    pub fn end_s(&self) -> Option<f64> {
        match self.programme_end_s() {
            Some(end_s) => Some(end_s + self.plan.settle_s),
            None => self.plan.length_s.map(|length_s| self.began_s + length_s),
        }
    }

    /// True after the end or an abort.
    pub fn is_over(&self, now_s: f64) -> bool {
        self.abort.is_some() || self.end_s().is_some_and(|end_s| now_s > end_s)
    }

    /// The stage at `now_s`, and the time at which it ends (s) if known.
    pub fn stage(&self, now_s: f64) -> (GraspStage, Option<f64>) {
        let Some(end_s) = self.programme_end_s() else {
            return (self.phase.map_or(GraspStage::Free, GraspStage::Phase), self.end_s());
        };
        let ticks = |count: u32| self.programme_s + f64::from(count) / self.plan.actuation_hz;
        let closed = self.plan.programme.close_ticks();
        match self.phase {
            _ if now_s >= end_s => (GraspStage::Settle, Some(end_s + self.plan.settle_s)),
            None => (GraspStage::Lead, self.closing_s),
            Some(phase @ Phase::Close) => (GraspStage::Phase(phase), Some(ticks(closed))),
            Some(phase @ Phase::Hold) => {
                (GraspStage::Phase(phase), Some(ticks(closed.saturating_add(self.plan.programme.hold_ticks))))
            }
            Some(phase @ Phase::Release) => (GraspStage::Phase(phase), Some(end_s)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(control: Control) -> GraspPlan {
        GraspPlan::recorded(&Scene::default(), control)
    }

    #[test]
    fn an_aim_is_reached_step_by_step_and_kept() {
        let mut controller = GraspController::new(plan(Control::Driven), 0.0);
        let mut bars = vec![0.0];
        let mut now_s = 0.0;
        for bar in [0.3, 0.5, 0.5, 0.1, 0.0, 0.2] {
            controller.aim(bar, now_s);
            for _ in 0..10_000 {
                bars.extend(controller.command(now_s).map(|command| command.bar));
                now_s += 1e-3;
            }
            assert!(bars.last().is_some_and(|last| (last - bar).abs() < 1e-9), "{bar}: {bars:?}");
        }
        // Another phase at the same pressure is a command, too.
        bars.dedup_by(|next, last| (*next - *last).abs() < 1e-9);
        assert_eq!(bars.len(), 1 + 6 + 4 + 2 + 4, "{bars:?}");
        assert!(bars.windows(2).all(|pair| pair[1] - pair[0] < 0.05 + 1e-9), "{bars:?}");
    }

    #[test]
    fn a_programme_is_commanded_step_by_step_and_rests_before_and_after() {
        let mut controller = GraspController::new(plan(Control::Driven), 2.0);
        let mut marks = Vec::new();
        let mut stages = Vec::new();
        let mut now_s = 2.0;
        while !controller.is_over(now_s) {
            if let Some(command) = controller.command(now_s) {
                let mark = controller.mark(&command);
                controller.observe_phase(&mark);
                marks.push(mark);
            }
            let (stage, until_s) = controller.stage(now_s);
            if stages.last() != Some(&stage) {
                stages.push(stage);
            }
            assert!(until_s.is_some_and(|until_s| until_s >= now_s - 1e-9), "{stage:?}");
            now_s += 1e-3;
        }
        // Twenty steps up, one hold, ten down.
        assert_eq!(marks.len(), 31);
        assert!((marks[0].from_s - 3.5).abs() < 2e-3 && marks[0].line_bar == Some(0.05), "{:?}", marks[0]);
        assert_eq!(marks.last().and_then(|mark| mark.line_bar), Some(0.0));
        let phases = [Phase::Close, Phase::Hold, Phase::Release].map(GraspStage::Phase);
        assert_eq!(stages, [vec![GraspStage::Lead], phases.to_vec(), vec![GraspStage::Settle]].concat());
        assert!((now_s - (2.0 + LEAD_S + 4.0 + SETTLE_S)).abs() < 2e-3, "{now_s}");
    }

    #[test]
    fn a_late_programme_never_leaps() {
        let mut controller = GraspController::new(GraspPlan { lead_s: 0.0, ..plan(Control::Driven) }, 2.0);
        let bars: Vec<f64> = [5.0, 5.1, 5.2, 8.0, 8.1]
            .into_iter()
            .filter_map(|now_s| controller.command(now_s))
            .map(|c| c.bar)
            .collect();
        assert_eq!(bars.len(), 5);
        assert!(bars.windows(2).all(|pair| (pair[1] - pair[0] - 0.05).abs() < 1e-9), "{bars:?}");
    }

    #[test]
    fn what_the_board_says_aborts_driven_grasps_only() {
        let vented = BoardReply::Vented { cause: "watchdog".to_owned() };
        let vented = GripperEvent::Board(BoardEvent::Reply(vented));
        for (control, aborts) in [(Control::Driven, true), (Control::ByHand, false), (Control::Free, false)] {
            let mut controller = GraspController::new(plan(control), 0.0);
            let cause = "the board vented on its own (watchdog)";
            assert_eq!(controller.observe(&vented), (!aborts).then(|| cause.to_owned()));
            assert_eq!(controller.abort_cause(), aborts.then_some(cause), "{control:?}");
            assert_eq!(controller.is_over(0.0), aborts);
            assert_eq!(controller.command(9.0).is_none(), control != Control::ByHand, "{control:?}");
        }
    }

    #[test]
    fn an_untimed_grasp_has_the_phases_that_are_observed() {
        let mut controller = GraspController::new(GraspPlan { length_s: Some(9.0), ..plan(Control::Free) }, 1.0);
        assert_eq!((controller.stage(1.0), controller.closing_s()), ((GraspStage::Free, Some(10.0)), None));
        let mark = |from_s, phase| PhaseMark { from_s, phase, line_bar: None };
        assert_eq!(controller.observe_phase(&mark(1.5, Phase::Close)), Some(Phase::Close));
        assert_eq!(controller.observe_phase(&mark(1.7, Phase::Close)), None);
        assert_eq!(controller.observe_phase(&mark(2.0, Phase::Hold)), Some(Phase::Hold));
        assert_eq!(controller.observe_phase(&mark(2.1, Phase::Close)), None);
        assert_eq!(controller.closing_s(), Some(1.5));
        assert!(!controller.is_over(10.0) && controller.is_over(10.1));
    }
}
