//! Inspection: the stored trial that is open, trials beside it for comparison, and the time that is shown.

use super::App;
use super::view::{Mode, ViewSource, ViewState};
use crate::app::playback::{Playback, Seek};
use crate::app::shown::{ComparedTrace, Inspected, Pinned};
use crate::app::traces::{GraspTrace, TraceHistory};
use palpate_lab::inspection::{Alignment, Keep, MeanTrial, OpenOptions, OpenTrial, PhaseSpan, TouchPhase};
use palpate_lab::workers::{Command, Job, OpenRequest};
use palpate_learn::Models;
use palpate_store::labels::TrialEdit;
use palpate_tactile::trial::{TrialId, TrialSource};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most trials compared at once: more curves cannot be told apart, and their memory stays bounded.
pub(in crate::app) const MOST_PINNED: usize = 60;

/// Which comparison was built last.
#[derive(Clone, Debug, Default, PartialEq)]
struct ComparisonKey {
    names: Vec<String>,
    /// Stored trial that is shown: it has its own curves.
    shown: Option<TrialId>,
    origin_s: f64,
    alignment: Alignment,
    spread: bool,
    revision: u64,
}

/// State of inspection in the window.
pub struct InspectFeature {
    opener: Job<OpenRequest, OpenTrial>,
    /// Trial that was asked for last.
    pub(super) wanted: Option<TrialId>,
    open: Option<Arc<OpenTrial>>,
    pub(super) history: TraceHistory,
    pub(in crate::app) pinned: Vec<Pinned>,
    /// Trials that are being opened to be compared.
    awaited: Vec<TrialId>,
    /// Rises with each change of the pinned trials.
    revision: u64,
    key: ComparisonKey,
    pub(super) compared: Vec<ComparedTrace>,
    /// Origin of time of compared trials.
    pub(in crate::app) alignment: Alignment,
    /// Mean and spread of each class in place of each compared trial.
    pub spread: bool,
    /// Phases of the grasp that is shown.
    pub(super) phases: Vec<PhaseSpan>,
    /// Cursor in the stored trial, and in the past of the live gripper.
    stored: Playback,
    live: Playback,
    /// How trials are opened, with the models in use.
    pub(super) options: OpenOptions,
    /// Source that was shown before the trial.
    before: ViewSource,
    /// Number of the simulation's grasp at the last look.
    grasp: u64,
    moved_at: Option<f64>,
    /// The newest trial is opened once the library is read.
    opens_newest: bool,
    /// The newest trial when one was opened beside the live gripper; a newer one takes its place.
    newest_then: Option<TrialId>,
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
            phases: Vec::new(),
            stored: Playback::default(),
            live: Playback::default(),
            options,
            before: ViewSource::default(),
            grasp: 0,
            moved_at: None,
            opens_newest: false,
            newest_then: None,
        }
    }

    /// True once, where the newest trial is still to be opened.
    pub(super) fn takes_newest(&mut self) -> bool {
        std::mem::take(&mut self.opens_newest) && self.wanted.is_none()
    }

    /// Trial that is open or being opened.
    pub(super) fn wanted(&self) -> Option<TrialId> {
        self.wanted
    }

    /// True while a trial is being opened.
    pub(in crate::app) fn is_opening(&self) -> bool {
        self.wanted.is_some() && self.open.as_ref().map(|open| open.id) != self.wanted
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
        let cursor_s = self.stored.cursor_s.or_else(|| trial.last_of(TouchPhase::Hold)).unwrap_or(trial.span_s()[1]);
        Some(Inspected { trial, cursor_s, pinned: &self.pinned })
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
            // As it was held, with the answer to the whole grasp.
            self.stored = Playback { speed: self.stored.speed, ..Playback::default() };
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
        let Self { pinned, awaited, .. } = self;
        let pinned = pinned.iter().map(|pinned| pinned.trial.id).filter(|id| !awaited.contains(id));
        let pinned: Vec<TrialId> = pinned.collect();
        self.awaited.extend(pinned);
        self.awaited.iter().for_each(|id| self.ask(*id, Keep::Channels));
    }

    fn ask(&self, id: TrialId, keep: Keep) {
        self.opener.start(OpenRequest { id, options: OpenOptions { keep, ..self.options.clone() } });
    }

    fn show_live(&self, view: &mut ViewState) {
        if view.source == ViewSource::Trial {
            view.source = self.before;
        }
    }

    /// Closes the trial.
    fn close(&mut self) {
        self.wanted = None;
        self.open = None;
        self.history.clear();
        self.revision += 1;
    }

    /// No longer compares a trial.
    pub(in crate::app) fn unpin(&mut self, id: TrialId) {
        self.pinned.retain(|pinned| pinned.trial.id != id);
        self.awaited.retain(|awaited| *awaited != id);
        self.revision += 1;
    }

    /// No longer compares any trial.
    pub(in crate::app) fn unpin_all(&mut self) {
        self.pinned.clear();
        self.awaited.clear();
        self.revision += 1;
    }

    /// Takes in the phases of what is shown, and builds the curves of compared trials again where something has changed.
    /// `names` are the columns of the trace that is shown, `shown` is its stored trial.
    pub(super) fn compare(&mut self, names: Vec<String>, phases: Vec<PhaseSpan>, shown: Option<TrialId>) {
        let origin_s = self.alignment.origin_of(&phases).unwrap_or(0.0);
        self.phases = phases;
        let Self { alignment, spread, revision, .. } = *self;
        let key = ComparisonKey { names, shown, origin_s, alignment, spread, revision };
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
            let (name, short) = (format!("{}, trial {}", trial.title, trial.id), trial.id.to_string());
            ComparedTrace { name, short, colour: pinned.colour, trace, spread: Vec::new() }
        };
        // A trial without any of the channels shown has no curve.
        let has_curves = |pinned: &&Pinned| key.names.iter().any(|name| pinned.trial.column(name).is_some());
        let others = self.pinned.iter().filter(|pinned| Some(pinned.trial.id) != key.shown);
        others.filter(has_curves).map(compared).collect()
    }

    fn means(&self, key: &ComparisonKey) -> Vec<ComparedTrace> {
        let mut classes: BTreeMap<(&str, bool), (usize, Vec<&OpenTrial>)> = BTreeMap::new();
        for pinned in &self.pinned {
            let real = pinned.trial.source != TrialSource::Simulated;
            // The first of its trials gives the colour.
            let class = classes.entry((pinned.trial.title.as_str(), real)).or_insert((pinned.colour, Vec::new()));
            class.1.push(&pinned.trial);
        }
        let compared = |((title, real), (colour, trials)): ((&str, bool), (usize, Vec<&OpenTrial>))| {
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
            let (name, short) = (format!("{title}, {source}, mean of {}", trials.len()), title.to_owned());
            Some(ComparedTrace { name, short, colour, trace, spread })
        };
        classes.into_iter().filter_map(compared).collect()
    }
}

impl App {
    /// Takes in opened trials.
    pub(super) fn poll_inspection(&mut self) {
        let grasp = self.snapshot().map_or(0, |snapshot| snapshot.grasp);
        let Self { inspect, view, .. } = self;
        if std::mem::replace(&mut inspect.grasp, grasp) != grasp && view.source == ViewSource::Simulation {
            inspect.follow_live();
        }
        if inspect.options.sensors != view.sensors {
            inspect.options.sensors = view.sensors.clone();
            inspect.open_again();
        }
        for ended in inspect.opener.take() {
            let (id, scenery) = (ended.command.id, ended.command.options.keep == Keep::Scenery);
            // Asked for through other sensors before, and asked for again since.
            if ended.command.options.sensors != inspect.options.sensors {
                continue;
            }
            match ended.outcome {
                Ok(trial) if scenery => {
                    self.notices.done("trial");
                    inspect.take_open(trial);
                }
                Ok(trial) => inspect.take_pinned(trial),
                Err(cause) => {
                    inspect.awaited.retain(|awaited| *awaited != id);
                    if inspect.wanted == Some(id) && scenery {
                        inspect.wanted = inspect.open.as_ref().map(|open| open.id);
                        if inspect.open.is_none() {
                            inspect.show_live(view);
                        }
                    }
                    self.notices.failed("trial", format!("Trial {id} cannot be opened: {cause}"));
                }
            }
        }
    }

    /// Opens a stored trial in Inspect mode.
    pub fn open_trial(&mut self, id: TrialId) {
        self.view.mode = Mode::Inspect;
        self.show_trial(id);
    }

    /// Opens a stored trial in the present mode.
    pub(super) fn show_trial(&mut self, id: TrialId) {
        if self.view.source != ViewSource::Trial {
            self.inspect.newest_then = self.newest_trial();
            self.inspect.before = self.view.source;
        }
        let Self { inspect, view, .. } = self;
        view.source = ViewSource::Trial;
        view.time_window = None;
        if inspect.wanted == Some(id) && inspect.open.is_some() {
            return;
        }
        inspect.wanted = Some(id);
        inspect.ask(id, Keep::Scenery);
        self.library.follow(id);
    }

    /// Closes the trial; the live gripper is shown again.
    pub(in crate::app) fn close_trial(&mut self) {
        self.inspect.close();
        self.inspect.show_live(&mut self.view);
    }

    /// Shows the open trial in Inspect mode, or the newest where there is a newer one, unless one is being recorded; in the
    /// others the live gripper.
    pub(super) fn enter_mode(&mut self, mode: Mode) {
        let is_shown = self.view.source == ViewSource::Trial;
        if mode != Mode::Inspect {
            return self.inspect.show_live(&mut self.view);
        }
        // A grasp that is being recorded stays in sight.
        let live = self.gripper_view().is_some_and(|gripper| gripper.trial.is_some());
        let newest = self.newest_trial().filter(|_| !live);
        let newer = newest.filter(|_| !is_shown && newest != self.inspect.newest_then);
        let wanted = newer.or(self.inspect.wanted).or(newest);
        self.inspect.opens_newest = wanted.is_none() && !live;
        match wanted {
            Some(id) => self.show_trial(id),
            None => self.inspect.show_live(&mut self.view),
        }
    }

    /// Labels or phases in the store have changed: those of trials that were not simulated are read again.
    pub(super) fn labels_changed(&mut self) {
        let kept = |id: TrialId| self.labels().and_then(|view| view.trial(id)).is_none_or(|trial| !trial.discarded);
        let open = self.inspect.open.as_ref();
        if open.is_some_and(|open| open.source != TrialSource::Simulated && kept(open.id)) {
            self.inspect.open_again();
        }
    }

    /// Compares a trial with the one that is shown.
    pub fn pin(&mut self, id: TrialId) {
        let InspectFeature { pinned, awaited, .. } = &mut self.inspect;
        if pinned.iter().any(|pinned| pinned.trial.id == id) || awaited.contains(&id) {
            return;
        }
        if pinned.len() + awaited.len() >= MOST_PINNED {
            return self.notices.warning(format!("At most {MOST_PINNED} trials are compared at once."));
        }
        awaited.push(id);
        self.inspect.ask(id, Keep::Channels);
    }

    /// Corrects the beginning of a phase of the open trial (s).
    pub(in crate::app) fn move_phase(&mut self, phase: TouchPhase, from_s: f64) {
        if let Some(trial) = &self.inspect.open {
            self.library.edit_one(trial.id, TrialEdit::Phases(Some(trial.with_phase_at(phase, from_s))));
        }
    }

    /// Moves the cursor. Looking back pauses the simulation.
    pub fn seek(&mut self, to: Seek) {
        if self.view.source == ViewSource::Simulation {
            self.simulation.send(Command::Pause);
        }
        let live = self.view.source != ViewSource::Trial;
        let (times, shown) = (self.times(), self.shown().time_s());
        let playback = self.playback();
        playback.cursor_s = playback.cursor_s.or(shown);
        playback.seek(to, &times, live);
    }

    /// Plays or pauses.
    pub(in crate::app) fn toggle_playing(&mut self) {
        let times = self.times();
        let playback = self.playback();
        playback.toggle(span_of(&times));
        // At rest, time and values are those of one sample.
        if let Some(now) = playback.cursor_s.filter(|_| !playback.playing) {
            playback.seek(Seek::To(now), &times, false);
        }
    }

    /// Repeats the part between the marks, or stops that.
    pub(in crate::app) fn toggle_repeat(&mut self) {
        let span = span_of(&self.times());
        self.playback().toggle_repeat(span);
    }

    /// Puts mark A (0) or B (1) at the cursor; there already, it is taken away.
    pub(in crate::app) fn put_mark(&mut self, which: usize) {
        let at = self.shown().time_s().unwrap_or(0.0);
        let playback = self.playback();
        if let Some(mark) = playback.marks.get_mut(which) {
            *mark = if *mark == Some(at) { None } else { Some(at) };
        }
    }

    /// Cursor on the data that are shown.
    pub(in crate::app) fn playback(&mut self) -> &mut Playback {
        match self.view.source {
            ViewSource::Trial => &mut self.inspect.stored,
            ViewSource::Simulation | ViewSource::Gripper => &mut self.inspect.live,
        }
    }

    /// Times of the samples that are shown (s).
    fn times(&self) -> Vec<f64> {
        self.traces().current().map(|trace| trace.t.clone()).unwrap_or_default()
    }
}

/// First and last of some times (s).
fn span_of(times: &[f64]) -> [f64; 2] {
    [times.first(), times.last()].map(|t| t.copied().unwrap_or(0.0))
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
