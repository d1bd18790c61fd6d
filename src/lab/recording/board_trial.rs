//! A grasp of the real gripper that is being recorded: its controller and its recording. The command line and the
//! window begin, drive and end it through this.

use super::board_writer::BoardTrialPlan;
use super::recent::RecentEvents;
use super::recorder::{BoardTrialEnd, Recorder};
use crate::grasping::{GraspController, GraspPlan};
use crate::gripper::{Gripper, GripperEvent, SerialGripper};
use palpate_device::protocol::BoardEvent;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::{Control, PhaseMark};

/// Rest before an empty hand closes (s): time to take out what it holds.
const EMPTYING_S: f64 = 4.0;
/// Readings from before the start that belong to the trial (s).
pub(super) const BEFORE_S: f64 = 0.3;
/// Longest wait for readings of the last moments (s): on a busy computer they arrive up to this late.
const LATE_S: f64 = 5.0;

/// Request of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialRequest {
    /// Class of the object, where it is known beforehand.
    pub object: Option<String>,
    /// Actuation.
    pub control: Control,
    /// Length (s), where it differs from that of the programme.
    pub length_s: Option<f64>,
    /// Whether its answer is combined with those of earlier grasps of this object.
    pub adds: bool,
}

/// A grasp that is being recorded.
pub struct BoardTrialRecording {
    pub(crate) request: TrialRequest,
    pub(crate) controller: GraspController,
    /// Beginning of the trial, on the gripper's clock (s).
    pub(crate) began_s: f64,
    /// Readings so far.
    pub(crate) samples: u64,
    newest_s: f64,
    notes: Vec<String>,
    /// Begun and ended automatically.
    pub(crate) automatic: bool,
    over: bool,
}

impl BoardTrialRecording {
    /// Begins to record. The trial includes earlier events from `from_s` on or, without it, those of the last moments.
    pub fn begin(
        recorder: &Recorder,
        gripper: &mut SerialGripper,
        recent: &RecentEvents,
        scene: &Scene,
        request: TrialRequest,
        from_s: Option<f64>,
    ) -> Self {
        let now_s = gripper.now_s();
        let before = recent.since(from_s.unwrap_or(now_s - BEFORE_S));
        let began_s = before.iter().find_map(reading_time).unwrap_or(now_s);
        let usual = GraspPlan::recorded(scene, request.control);
        let lead_s = if request.object.as_deref() == Some(EMPTY) { EMPTYING_S } else { usual.lead_s };
        let plan = GraspPlan { length_s: request.length_s, lead_s, ..usual };
        let start_s = if request.control == Control::Free { began_s } else { now_s };
        recorder.begin_board(BoardTrialPlan {
            object: request.object.clone().unwrap_or_default(),
            scene: scene.clone(),
            seconds: plan.total_s(),
            status: gripper.stream().status(),
            began_s,
            control: request.control,
        });
        let mut recording = Self {
            request,
            controller: GraspController::new(plan, start_s),
            began_s,
            samples: 0,
            newest_s: began_s,
            notes: Vec::new(),
            automatic: from_s.is_some(),
            over: false,
        };
        before.into_iter().for_each(|event| recording.take(recorder, event));
        if recording.is_driven() {
            recording.vent_first(gripper);
        }
        recording
    }

    /// Vents fingers that will be driven, so that they rest before they close and a board that does not answer is
    /// noticed before there is pressure.
    fn vent_first(&mut self, gripper: &mut SerialGripper) {
        match gripper.vent() {
            Ok(()) => self.controller.watch_board(gripper.now_s()),
            Err(error) => self.controller.abort(error.to_string()),
        }
    }

    /// Records an event of the board, and lets it abort a driven grasp. Readings after the end are left out.
    pub fn take(&mut self, recorder: &Recorder, event: BoardEvent) {
        if let Some(t_s) = reading_time(&event) {
            self.over |= self.controller.end_s().is_some_and(|end_s| t_s >= end_s);
            self.newest_s = t_s;
        }
        if self.over {
            return;
        }
        self.samples += u64::from(reading_time(&event).is_some());
        let event = GripperEvent::Board(event);
        let interrupted = self.controller.observe(&event);
        let GripperEvent::Board(event) = event else { return };
        // An interruption of the stream is recorded with the bytes.
        if let Some(cause) = interrupted.filter(|_| !matches!(event, BoardEvent::Captured(_))) {
            recorder.interrupted(&cause);
        }
        recorder.board(event);
    }

    /// Sets the line pressure, after all events so far were handled. Returns the phase that begins, if any. Aborts the
    /// grasp if a line cannot be sent or a reply is overdue.
    pub fn drive(&mut self, recorder: &Recorder, gripper: &mut SerialGripper) -> Option<Phase> {
        self.controller.check_board(gripper.looked_s());
        let command = self.controller.command(gripper.now_s())?;
        if self.is_driven()
            && let Err(error) = gripper.set_pressure(command.bar, command.phase)
        {
            self.controller.abort(error.to_string());
        }
        let mark = self.controller.mark(&command);
        self.mark(recorder, mark)
    }

    /// Records that a phase began; returns it if it is new.
    pub fn mark(&mut self, recorder: &Recorder, mark: PhaseMark) -> Option<Phase> {
        recorder.mark(mark);
        self.controller.observe_phase(&mark)
    }

    /// Adds a remark to the trial, once.
    pub fn note(&mut self, text: String) {
        if !self.notes.contains(&text) {
            self.notes.push(text);
        }
    }

    /// True where readings came until the end of the programme or the length.
    pub fn is_complete(&self) -> bool {
        self.over
    }

    /// True at the end of the programme or the length, and after an abort.
    pub fn is_over(&self, gripper: &SerialGripper) -> bool {
        // Captured bytes keep their own time.
        let live = gripper.stream().status().baud.is_some();
        let now_s = if live { gripper.now_s() - LATE_S } else { self.newest_s };
        self.over || self.controller.is_over(now_s)
    }

    /// Vents driven fingers and ends the recording; the recorder reports the result.
    pub fn finish(
        mut self,
        recorder: &Recorder,
        gripper: &mut SerialGripper,
        discarded: bool,
        guess: Option<(String, Vec<(String, f64)>)>,
    ) {
        if self.is_driven() && gripper.vent().is_err() {
            self.note("the last vent could not be sent; the board vents within a second".to_owned());
        }
        if let Some(cause) = self.controller.abort_cause().map(str::to_owned) {
            recorder.interrupted(&cause);
            self.note(format!("ended early and vented: {cause}"));
        }
        recorder.finish_board(BoardTrialEnd { status: gripper.stream().status(), notes: self.notes, guess, discarded });
    }

    /// Whether this program sets the pressure.
    pub fn is_driven(&self) -> bool {
        self.request.control == Control::Driven
    }
}

/// Time of a reading (s); none for other events.
pub(super) fn reading_time(event: &BoardEvent) -> Option<f64> {
    event.reading().map(|reading| reading.t_s)
}
