//! Inspection: the stored trial that is open, trials beside it for comparison, and the time that is shown.

use crate::app::features::view::ViewState;
use crate::app::modes::mode::Mode;
use crate::app::notices::Notices;
use crate::app::playback::{Playback, Seek};
use crate::app::traces::{GraspTrace, TraceHistory};
use crate::app::view_source::ViewSource;
use palpate_lab::inspection::{Alignment, Keep, MeanTrial, OpenOptions, OpenTrial, PhaseSpan, TouchPhase};
use palpate_lab::workers::{Job, LabelView, OpenRequest};
use palpate_learn::Models;
use palpate_store::labels::TrialEdit;
use palpate_tactile::trial::{TrialId, TrialSource};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most trials compared at once: more curves cannot be told apart, and their memory stays bounded.
pub(in crate::app) const MOST_PINNED: usize = 60;

/// Action on stored trials in Inspect mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InspectAction {
    /// Open a stored trial in Inspect mode.
    Open(TrialId),
    /// Open a stored trial in the present mode.
    Show(TrialId),
    /// Close the trial; the live gripper is shown again.
    Close,
    /// Compare a trial with the one that is shown, or no longer.
    Pin(TrialId),
    /// No longer compare a trial.
    Unpin(TrialId),
    /// No longer compare any trial.
    UnpinAll,
    /// Move the cursor.
    Seek(Seek),
    /// Play or pause.
    TogglePlaying,
    /// Set the speed, as a multiple of real time.
    SetSpeed(f64),
    /// Change to the next faster or slower speed.
    ChangeSpeed(isize),
    /// Repeat the part between the marks, or stop that.
    ToggleRepeat,
    /// Put mark A (0) or B (1) at the cursor; there already, it is taken away.
    PutMark(usize),
    /// Correct the beginning of a phase of the open trial (s).
    MovePhase(TouchPhase, f64),
    /// Origin of time of compared trials.
    Align(Alignment),
    /// Show mean and spread of each class in place of each compared trial.
    ShowSpread(bool),
}

/// A trial beside the one that is shown.
#[derive(Clone, Debug)]
pub struct Pinned {
    /// The trial.
    pub trial: Arc<OpenTrial>,
    /// Number of its colour.
    pub colour: usize,
}

/// A curve bundle that plots draw beside the one shown: a pinned trial, or the mean of a class.
#[derive(Clone, Debug)]
pub struct ComparedTrace {
    /// Name: `Tomato, trial 12`, or `Tomato, mean of 5`.
    pub name: String,
    /// Number of its colour.
    pub colour: usize,
    /// Values in the columns of the trace shown, on its time.
    pub trace: GraspTrace,
    /// Standard deviation of each column; empty for a single trial.
    pub spread: Vec<Vec<f32>>,
}

/// The open trial, the time shown, and trials compared with it.
#[derive(Clone, Copy)]
pub struct Inspected<'a> {
    /// The trial.
    pub trial: &'a Arc<OpenTrial>,
    /// Time that is shown (s).
    pub cursor_s: f64,
    /// Trials to compare with.
    pub pinned: &'a [Pinned],
}

/// Which comparison was built last.
#[derive(Clone, Debug, Default, PartialEq)]
struct ComparisonKey {
    names: Vec<String>,
    origin_s: f64,
    alignment: Alignment,
    spread: bool,
    revision: u64,
}

/// State of inspection in the window.
pub(in crate::app) struct InspectFeature {
    opener: Job<OpenRequest, OpenTrial>,
    /// Trial that was asked for last.
    wanted: Option<TrialId>,
    open: Option<Arc<OpenTrial>>,
    history: TraceHistory,
    pinned: Vec<Pinned>,
    /// Trials that are being opened to be compared.
    awaited: Vec<TrialId>,
    /// Rises with each change of the pinned trials.
    revision: u64,
    key: ComparisonKey,
    compared: Vec<ComparedTrace>,
    alignment: Alignment,
    spread: bool,
    /// Cursor in the stored trial, and in the past of the live gripper.
    stored: Playback,
    live: Playback,
    /// How trials are opened, with the models in use.
    options: OpenOptions,
    /// Source that was shown before the trial.
    before: ViewSource,
    /// Number of the simulation's grasp at the last look.
    grasp: u64,
    moved_at: Option<f64>,
}

impl InspectFeature {
    pub(in crate::app) fn new(opener: Job<OpenRequest, OpenTrial>, models: Models, grasps: u32) -> Self {
        let options = OpenOptions { models, grasps: Some(grasps), ..OpenOptions::default() };
        Self {
            opener,
            wanted: None,
            open: None,
            history: TraceHistory::default(),
            pinned: Vec::new(),
            awaited: Vec::new(),
            revision: 0,
            key: ComparisonKey::default(),
            compared: Vec::new(),
            alignment: Alignment::default(),
            spread: false,
            stored: Playback::default(),
            live: Playback::default(),
            options,
            before: ViewSource::default(),
            grasp: 0,
            moved_at: None,
        }
    }

    /// How trials are opened, with the models in use.
    pub(in crate::app) fn options(&self) -> &OpenOptions {
        &self.options
    }

    /// True while a trial is being opened.
    pub(in crate::app) fn is_opening(&self) -> bool {
        self.wanted.is_some() && self.open.as_ref().map(|open| open.id) != self.wanted
    }

    /// Traces of the open trial.
    pub(in crate::app) fn history(&self) -> &TraceHistory {
        &self.history
    }

    pub(in crate::app) fn compared(&self) -> &[ComparedTrace] {
        &self.compared
    }

    pub(in crate::app) fn alignment(&self) -> Alignment {
        self.alignment
    }

    pub(in crate::app) fn shows_spread(&self) -> bool {
        self.spread
    }

    /// Cursor on the data that are shown.
    pub(in crate::app) fn playback(&self, source: ViewSource) -> &Playback {
        match source {
            ViewSource::Trial => &self.stored,
            ViewSource::Simulation | ViewSource::Gripper => &self.live,
        }
    }

    /// The open trial with its cursor and the trials compared; none without one.
    pub(in crate::app) fn inspected(&self) -> Option<Inspected<'_>> {
        let trial = self.open.as_ref()?;
        let cursor_s = self.stored.cursor_s.unwrap_or(trial.span_s()[1]);
        Some(Inspected { trial, cursor_s, pinned: &self.pinned })
    }

    pub(in crate::app) fn pinned(&self) -> &[Pinned] {
        &self.pinned
    }

    /// Reads trials by these models from now on.
    pub(in crate::app) fn set_models(&mut self, models: Models) {
        self.options.models = models;
        self.open_again();
    }

    /// The live gripper begins something new: its newest sample is shown again.
    fn follow_live(&mut self) {
        self.live = Playback { cursor_s: None, playing: false, repeated: None, marks: [None; 2], ..self.live.clone() };
    }

    /// Takes in opened trials, and moves the cursor. `grasp` is the number of the simulation's grasp.
    pub(in crate::app) fn gather(&mut self, grasp: u64, view: &mut ViewState, notices: &mut Notices) {
        if std::mem::replace(&mut self.grasp, grasp) != grasp && view.source == ViewSource::Simulation {
            self.follow_live();
        }
        if self.options.sensors != view.sensors {
            self.options.sensors = view.sensors.clone();
            self.open_again();
        }
        for ended in self.opener.take() {
            let (id, scenery) = (ended.command.id, ended.command.options.keep == Keep::Scenery);
            match ended.outcome {
                Ok(trial) if scenery => self.take_open(trial),
                Ok(trial) => self.take_pinned(trial),
                Err(cause) => {
                    self.awaited.retain(|awaited| *awaited != id);
                    if self.wanted == Some(id) && scenery {
                        self.wanted = self.open.as_ref().map(|open| open.id);
                        if self.open.is_none() {
                            self.show_live(view);
                        }
                    }
                    notices.error(format!("Trial {id} cannot be opened: {cause}"));
                }
            }
        }
    }

    /// Moves the cursor with time, within the samples shown.
    pub(in crate::app) fn move_cursor(&mut self, ctx: &egui::Context, source: ViewSource, span: [f64; 2]) {
        let now = ctx.input(|input| input.time);
        let elapsed_s = self.moved_at.replace(now).map_or(0.0, |before| now - before);
        let playback = if source == ViewSource::Trial { &mut self.stored } else { &mut self.live };
        playback.advance(elapsed_s, span);
        // A stream forgets its oldest samples.
        playback.cursor_s = playback.cursor_s.map(|t| t.max(span[0]));
        if playback.playing {
            ctx.request_repaint();
        }
    }

    fn take_open(&mut self, trial: Arc<OpenTrial>) {
        if self.wanted != Some(trial.id) {
            return;
        }
        let again = self.open.as_ref().is_some_and(|open| open.id == trial.id);
        self.history.clear();
        self.history.show(trace_of(&trial));
        if !again {
            self.stored =
                Playback { cursor_s: trial.last_of(TouchPhase::Hold), speed: self.stored.speed, ..Playback::default() };
        }
        self.open = Some(trial);
        self.revision += 1;
    }

    fn take_pinned(&mut self, trial: Arc<OpenTrial>) {
        let Some(place) = self.awaited.iter().position(|id| *id == trial.id) else { return };
        self.awaited.remove(place);
        self.revision += 1;
        if let Some(pinned) = self.pinned.iter_mut().find(|pinned| pinned.trial.id == trial.id) {
            pinned.trial = trial;
            return;
        }
        let taken = |colour: &usize| self.pinned.iter().any(|pinned| pinned.colour == *colour);
        let colour = (0..).find(|colour| !taken(colour)).unwrap_or(0);
        self.pinned.push(Pinned { trial, colour });
    }

    /// Opens everything once more, after a change of sensors or model.
    fn open_again(&mut self) {
        if let Some(id) = self.wanted {
            self.ask(id, Keep::Scenery);
        }
        let pinned: Vec<TrialId> = self.pinned.iter().map(|pinned| pinned.trial.id).collect();
        for id in pinned {
            self.awaited.push(id);
            self.ask(id, Keep::Channels);
        }
    }

    fn ask(&self, id: TrialId, keep: Keep) {
        self.opener.start(OpenRequest { id, options: OpenOptions { keep, ..self.options.clone() } });
    }

    /// Applies an action; returns the change of a stored trial that follows from it.
    pub(in crate::app) fn apply(
        &mut self,
        action: InspectAction,
        times: &[f64],
        view: &mut ViewState,
        notices: &mut Notices,
    ) -> Option<(TrialId, TrialEdit)> {
        let source = view.source;
        let live = source != ViewSource::Trial;
        let span = [times.first(), times.last()].map(|t| t.copied().unwrap_or(0.0));
        let playback = if live { &mut self.live } else { &mut self.stored };
        match action {
            InspectAction::Open(id) => {
                view.mode = Mode::Inspect;
                self.show(id, view);
            }
            InspectAction::Show(id) => self.show(id, view),
            InspectAction::Close => {
                self.wanted = None;
                self.open = None;
                self.history.clear();
                self.revision += 1;
                self.show_live(view);
            }
            InspectAction::Pin(id) => self.pin(id, notices),
            InspectAction::Unpin(id) => {
                self.pinned.retain(|pinned| pinned.trial.id != id);
                self.awaited.retain(|awaited| *awaited != id);
                self.revision += 1;
            }
            InspectAction::UnpinAll => {
                self.pinned.clear();
                self.awaited.clear();
                self.revision += 1;
            }
            InspectAction::Seek(to) => playback.seek(to, times, live),
            InspectAction::TogglePlaying => playback.toggle(span),
            InspectAction::SetSpeed(speed) => playback.speed = speed,
            InspectAction::ChangeSpeed(by) => playback.change_speed(by),
            InspectAction::ToggleRepeat => playback.toggle_repeat(span),
            InspectAction::PutMark(which) => {
                let at = playback.cursor_s.unwrap_or(span[1]);
                if let Some(mark) = playback.marks.get_mut(which) {
                    *mark = if *mark == Some(at) { None } else { Some(at) };
                }
            }
            InspectAction::MovePhase(phase, from_s) => {
                if let Some(trial) = &self.open {
                    return Some((trial.id, TrialEdit::Phases(Some(trial.with_phase_at(phase, from_s)))));
                }
            }
            InspectAction::Align(alignment) => self.alignment = alignment,
            InspectAction::ShowSpread(spread) => self.spread = spread,
        }
        None
    }

    /// Labels or phases in the store have changed: those of trials that were not simulated are read again.
    pub(in crate::app) fn labels_changed(&mut self, labels: &LabelView) {
        let kept = |id: TrialId| labels.trial(id).is_none_or(|trial| !trial.discarded);
        if self.open.as_ref().is_some_and(|open| open.source != TrialSource::Simulated && kept(open.id)) {
            self.open_again();
        }
    }

    /// Shows the open trial in Inspect mode, and the live gripper in the others.
    pub(in crate::app) fn enter_mode(&mut self, mode: Mode, view: &mut ViewState) {
        match (mode, self.wanted) {
            (Mode::Inspect, Some(id)) => self.show(id, view),
            (Mode::Inspect, None) | (Mode::Demo | Mode::Label | Mode::Study, _) => self.show_live(view),
        }
    }

    fn show_live(&self, view: &mut ViewState) {
        if view.source == ViewSource::Trial {
            view.source = self.before;
        }
    }

    fn show(&mut self, id: TrialId, view: &mut ViewState) {
        if view.source != ViewSource::Trial {
            self.before = view.source;
        }
        view.source = ViewSource::Trial;
        view.time_window = None;
        if self.wanted == Some(id) && self.open.is_some() {
            return;
        }
        self.wanted = Some(id);
        self.ask(id, Keep::Scenery);
    }

    fn pin(&mut self, id: TrialId, notices: &mut Notices) {
        if self.pinned.iter().any(|pinned| pinned.trial.id == id) || self.awaited.contains(&id) {
            return;
        }
        if self.pinned.len() + self.awaited.len() >= MOST_PINNED {
            return notices.warning(format!("At most {MOST_PINNED} trials are compared at once."));
        }
        self.awaited.push(id);
        self.ask(id, Keep::Channels);
    }

    /// Builds the curves of compared trials again where something has changed. `names` are the columns of the trace that is
    /// shown, `phases` its phases.
    pub(in crate::app) fn compare(&mut self, names: Vec<String>, phases: &[PhaseSpan]) {
        let origin_s = self.alignment.origin_of(phases).unwrap_or(0.0);
        let key =
            ComparisonKey { names, origin_s, alignment: self.alignment, spread: self.spread, revision: self.revision };
        if key == self.key {
            return;
        }
        self.compared = if self.spread { self.means(&key) } else { self.each(&key) };
        self.key = key;
    }

    fn each(&self, key: &ComparisonKey) -> Vec<ComparedTrace> {
        let compared = |pinned: &Pinned| {
            let trial = &pinned.trial;
            let shift = key.origin_s - key.alignment.origin_s(trial);
            let column = |name: &String| match trial.column(name) {
                Some(column) => column.values.clone(),
                None => vec![f32::NAN; trial.t_s.len()],
            };
            let trace = GraspTrace {
                grasp: trial.id.unsigned_abs(),
                t: trial.t_s.iter().map(|t| t + shift).collect(),
                line_bar: trial.line_bar.clone(),
                channels: key.names.iter().map(column).collect(),
                ..GraspTrace::default()
            };
            let name = format!("{}, trial {}", trial.title, trial.id);
            ComparedTrace { name, colour: pinned.colour, trace, spread: Vec::new() }
        };
        self.pinned.iter().map(compared).collect()
    }

    fn means(&self, key: &ComparisonKey) -> Vec<ComparedTrace> {
        let mut classes: BTreeMap<(&str, bool), Vec<&OpenTrial>> = BTreeMap::new();
        for pinned in &self.pinned {
            let real = pinned.trial.source != TrialSource::Simulated;
            classes.entry((pinned.trial.title.as_str(), real)).or_default().push(&pinned.trial);
        }
        let compared = |(colour, ((title, real), trials)): (usize, ((&str, bool), Vec<&OpenTrial>))| {
            let mean = MeanTrial::of(&trials, key.alignment)?;
            let empty = || vec![f32::NAN; mean.t_s.len()];
            let column = |name: &String| mean.columns.iter().find(|column| column.name == *name);
            let trace = GraspTrace {
                grasp: colour as u64,
                t: mean.t_s.iter().map(|t| t + key.origin_s).collect(),
                line_bar: mean.line_bar.clone(),
                channels: key.names.iter().map(|n| column(n).map_or_else(empty, |c| c.mean.clone())).collect(),
                ..GraspTrace::default()
            };
            let spread = key.names.iter().map(|n| column(n).map_or_else(empty, |c| c.spread.clone())).collect();
            let source = if real { "real" } else { "simulated" };
            Some(ComparedTrace { name: format!("{title}, {source}, mean of {}", trials.len()), colour, trace, spread })
        };
        classes.into_iter().enumerate().filter_map(compared).collect()
    }
}

/// Trace of an open trial.
fn trace_of(trial: &OpenTrial) -> GraspTrace {
    GraspTrace {
        grasp: trial.id.unsigned_abs(),
        t: trial.t_s.clone(),
        line_bar: trial.line_bar.clone(),
        channels: trial.columns.iter().map(|column| column.values.clone()).collect(),
        ..GraspTrace::default()
    }
}
