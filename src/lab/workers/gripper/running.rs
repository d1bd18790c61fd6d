//! A trial that goes on: what is recorded, what the control box is to do, and where it stands.

use super::messages::{EndedTrial, LEAD_S, TrialPart, TrialRequest, TrialView};
use super::recent::Recent;
use crate::gripper::Conductor;
use crate::recording::{BoardRecorder, BoardTrialPlan};
use palpate_device::serial::{LinkEvent, LinkStatus};
use palpate_device::wire::Heard;
use palpate_sim::gripper::{Phase, Programme};
use palpate_sim::scene::Scene;
use palpate_store::labels::cadence_line;
use palpate_store::{Store, StoreError};
use palpate_tactile::capture::Captured;
use palpate_tactile::trial::Control;
use palpate_tactile::trial::PhaseMark;

/// What came before the button was pressed and belongs to the trial (s).
pub(super) const BEFORE_S: f64 = 0.3;
/// What is recorded when the programme is done (s).
const SETTLE_S: f64 = 0.4;
/// Length that is reserved for a trial of unknown length (s).
const FREE_S: f64 = 60.0;

/// A trial that goes on.
pub(super) struct Running {
    request: TrialRequest,
    recorder: BoardRecorder,
    conductor: Conductor,
    programme: Programme,
    tick_s: f64,
    /// When the closing will begin or began (s); none where nobody says.
    pub(super) closing_s: Option<f64>,
    /// When the first reading was taken (s).
    pub(super) began_s: f64,
    phase: Option<Phase>,
    /// Commanded line pressure (bar), where this program commands it.
    line_bar: Option<f64>,
    notes: Vec<String>,
    /// It began with what the fingers did, and ends with it.
    by_itself: bool,
    /// Why it cannot go on.
    cut: Option<String>,
}

impl Running {
    /// Begins to record what was heard from `from_s` on. The control box of a conducted trial begins a
    /// while after the store has taken it.
    pub(super) fn begin(
        store: &mut Store,
        request: TrialRequest,
        scene: &Scene,
        status: &LinkStatus,
        recent: &Recent,
        from_s: f64,
        now_s: impl Fn() -> f64,
    ) -> Result<Self, StoreError> {
        let tick_s = 1.0 / f64::from(scene.timing.actuation_hz.max(1));
        let programme = scene.programme.clone();
        let conducted = request.control != Control::Free;
        let length_s = LEAD_S + tick_s * f64::from(programme.total_ticks()) + SETTLE_S;
        let plan = BoardTrialPlan {
            object: request.object.clone().unwrap_or_default(),
            scene: scene.to_toml(),
            seconds: Some(if conducted { length_s } else { FREE_S }),
        };
        let before = recent.since(from_s);
        let first = before.iter().find_map(|event| match event {
            LinkEvent::Heard(Heard::Reading(reading)) => Some(reading.t_s),
            LinkEvent::Heard(_) | LinkEvent::Captured(_) => None,
        });
        let began_s = first.unwrap_or(from_s);
        let mut recorder = BoardRecorder::begin(store, &plan, status, began_s)?;
        before.into_iter().for_each(|event| recorder.take(event));
        let closing_s = conducted.then(|| now_s() + LEAD_S);
        let conductor = Conductor::new(request.control, 1.0 / tick_s, closing_s.unwrap_or(began_s));
        Ok(Self {
            request,
            recorder,
            conductor,
            programme,
            tick_s,
            closing_s,
            began_s,
            phase: None,
            line_bar: None,
            notes: Vec::new(),
            by_itself: false,
            cut: None,
        })
    }

    /// Takes in what the link has heard.
    pub(super) fn take(&mut self, event: LinkEvent) {
        match &event {
            LinkEvent::Heard(Heard::Said(text)) if text.starts_with("refused") => {
                let cause = format!("the board said: {text}");
                self.note(cause.clone());
                self.cut(cause);
            }
            LinkEvent::Heard(Heard::Said(text)) if text.starts_with("vent") => {
                let cause = format!("the board vented by itself ({text})");
                self.recorder.interrupt(&cause);
                self.cut(cause);
            }
            LinkEvent::Captured(Captured::Interrupted { cause, .. }) => self.cut(cause.clone()),
            LinkEvent::Heard(_) | LinkEvent::Captured(_) => {}
        }
        self.recorder.take(event);
    }

    /// What the fingers do is no longer what they are told to: where this program drives them, it must not go on as if
    /// nothing had happened, with a leap of pressure.
    pub(super) fn cut(&mut self, cause: String) {
        if self.is_driven() {
            self.cut.get_or_insert(cause);
        }
    }

    /// Why it cannot go on.
    pub(super) fn why_cut(&self) -> Option<&str> {
        self.cut.as_deref()
    }

    /// It began with what the fingers did.
    pub(super) fn began_by_itself(mut self, by_itself: bool) -> Self {
        self.by_itself = by_itself;
        self
    }

    /// Whether it begins and ends with what the fingers do.
    pub(super) fn is_by_itself(&self) -> bool {
        self.by_itself
    }

    /// Does what is due by now: the line for the board, and the phase that begins, if any.
    pub(super) fn conduct(&mut self, now_s: f64) -> (Option<String>, Option<Phase>) {
        let due = self.conductor.tick(now_s).map(|tick| self.programme.command(tick));
        let Some((mark, line)) = due.and_then(|(bar, phase)| self.conductor.command(bar, phase, now_s)) else {
            return (self.conductor.keep_alive(now_s).map(str::to_owned), None);
        };
        let new = self.mark(mark);
        (line, new)
    }

    /// Notes what the control box does; the phase, where it is a new one.
    pub(super) fn mark(&mut self, mark: PhaseMark) -> Option<Phase> {
        let phase = mark.phase;
        // Fingers that pause while they close go on closing: the zeros were taken before.
        let again = phase == Phase::Close && self.phase.is_some();
        let new = self.phase != Some(phase) && !again;
        if new && phase == Phase::Close {
            self.closing_s = Some(mark.from_s);
        }
        self.phase = Some(phase);
        self.line_bar = mark.line_bar;
        self.recorder.mark(mark);
        new.then_some(phase)
    }

    /// Something cuts it short.
    pub(super) fn interrupt(&mut self, cause: &str) {
        self.recorder.interrupt(cause);
    }

    /// Something that should be known of it.
    pub(super) fn note(&mut self, text: String) {
        if !self.notes.contains(&text) {
            self.notes.push(text);
        }
    }

    /// True when the programme is done and everything has come to rest.
    pub(super) fn is_over(&self, now_s: f64) -> bool {
        self.programme_ends_s().is_some_and(|end_s| now_s > end_s + SETTLE_S)
    }

    /// Writes what waits, where it is time.
    pub(super) fn flush(&mut self, store: &mut Store) -> Result<(), StoreError> {
        self.recorder.flush_if_due(store).map(|_due| ())
    }

    /// Ends it, and keeps it or gives it up.
    pub(super) fn finish(
        self,
        store: &mut Store,
        status: &LinkStatus,
        discarded: bool,
    ) -> Result<EndedTrial, StoreError> {
        let mut recorded = self.recorder.finish(store, status, self.notes)?;
        let given_up = discarded.then(|| store.delete(&[recorded.id]));
        let discarded = matches!(given_up, Some(Ok(())));
        if let Some(Err(error)) = given_up {
            recorded.warnings.push(format!("it could not be discarded: {error}"));
        }
        let cadence = cadence_line(&recorded.about.cadence);
        Ok(EndedTrial { id: recorded.id, request: self.request, discarded, warnings: recorded.warnings, cadence })
    }

    /// Line pressure as this program commands it (bar).
    pub(super) fn line_bar(&self) -> Option<f64> {
        self.line_bar
    }

    pub(super) fn request(&self) -> &TrialRequest {
        &self.request
    }

    /// Whether the fingers may be under pressure through this trial.
    pub(super) fn is_driven(&self) -> bool {
        self.request.control == Control::Driven
    }

    fn programme_ends_s(&self) -> Option<f64> {
        let conducted = self.request.control != Control::Free;
        conducted.then(|| self.conductor.from_s() + self.tick_s * f64::from(self.programme.total_ticks()))
    }

    pub(super) fn view(&self, now_s: f64) -> TrialView {
        let closing_s = self.closing_s.unwrap_or(self.began_s);
        let end_s = self.programme_ends_s();
        let (part, until_s) = match (end_s, self.phase) {
            (None, phase) => (phase.map_or(TrialPart::Free, TrialPart::Phase), None),
            (Some(end_s), _) if now_s >= end_s => (TrialPart::Settling, Some(end_s + SETTLE_S)),
            (Some(_), None) => (TrialPart::Ready, Some(closing_s)),
            (Some(end_s), Some(phase)) => {
                let began_s = self.conductor.from_s();
                let closed_s = began_s + self.tick_s * f64::from(self.programme.close_ticks());
                let until_s = match phase {
                    Phase::Close => closed_s,
                    Phase::Hold => closed_s + self.tick_s * f64::from(self.programme.hold_ticks),
                    Phase::Release => end_s,
                };
                (TrialPart::Phase(phase), Some(until_s))
            }
        };
        TrialView {
            id: self.recorder.id(),
            request: self.request.clone(),
            part,
            left_s: until_s.map(|until_s| (until_s - now_s).max(0.0)),
            t_s: now_s - closing_s,
            length_s: end_s.map(|end_s| end_s + SETTLE_S - closing_s),
            samples: self.recorder.samples(),
        }
    }
}
