//! Source of the data that plots, 3-D view and recognition show: the simulated gripper, the real one, or a stored trial;
//! and the time of them that is shown.

use crate::app::features::view::{ViewSource, ViewState};
use crate::app::playback::Playback;
use crate::app::traces::{GraspTrace, TraceHistory};
use palpate_lab::grasping::{IdentificationView, LEAD_S};
use palpate_lab::inspection::{Alignment, OpenTrial, PhaseSpan, TouchPhase, phases_of_frames};
use palpate_lab::picture::Stage;
use palpate_lab::why::{Band, bands_for};
use palpate_lab::workers::{ExplainRequest, GripperView, ObjectCard, Snapshot};
use palpate_sim::frame::Frame;
use palpate_sim::objects::{capital_title, object_title};
use palpate_sim::scene::Scene;
use palpate_tactile::Channel;
use palpate_tactile::board::Board;
use palpate_tactile::model::SensorModel;
use palpate_tactile::trial::{Control, TrialId, TrialSource};
use std::sync::Arc;

/// Data of the source that is shown, and how they are shown.
#[derive(Clone, Copy)]
pub(super) struct DisplayedData<'a> {
    pub(super) source: ViewSource,
    pub(super) view: &'a ViewState,
    pub(super) snapshot: Option<&'a Snapshot>,
    pub(super) gripper: Option<&'a GripperView>,
    pub(super) inspected: Option<Inspected<'a>>,
    pub(super) playback: &'a Playback,
    pub(super) traces: &'a TraceHistory,
    pub(super) scene: &'a Scene,
    /// A trial is being opened.
    pub(super) opening: bool,
    /// The last hold of the simulated object, from its end until the next contact.
    pub(super) last_hold: Option<&'a HeldMoment>,
    /// Trial of the simulation's last grasp, where it was recorded.
    pub(super) last_trial: Option<TrialId>,
    /// Phases of the grasp, as far as they are known.
    pub(super) phases: &'a [PhaseSpan],
    /// Trials beside it.
    pub(super) comparison: ComparedTrials<'a>,
    /// The model's prediction is hidden until the label is given.
    pub(super) blind: bool,
    /// The object in the simulated hand was learned free and is fixed, or the other way round.
    pub(super) learned_otherwise: bool,
    /// Class as which a model has learned the file of the open trial.
    pub(super) learned_name: Option<&'a str>,
    /// The model has not learned the fingers that are simulated.
    pub(super) other_fingers: bool,
}

/// A trial beside the one that is shown.
#[derive(Clone, Debug)]
pub struct Pinned {
    pub trial: Arc<OpenTrial>,
    /// Number of its colour.
    pub colour: usize,
}

/// A curve bundle that plots draw beside the one shown: a pinned trial, or the mean of a class.
#[derive(Clone, Debug)]
pub struct ComparedTrace {
    /// Name: `Tomato, trial 12`, or `Tomato, mean of 5`.
    pub name: String,
    /// The same in a table: `12`, or `Tomato`.
    pub short: String,
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
    pub trial: &'a Arc<OpenTrial>,
    /// Time that is shown (s).
    pub cursor_s: f64,
    /// Trials to compare with.
    pub pinned: &'a [Pinned],
}

/// Trials beside the one that is shown.
#[derive(Clone, Copy)]
pub(super) struct ComparedTrials<'a> {
    /// The trials.
    pub(super) pinned: &'a [Pinned],
    /// Their curves, or those of their classes.
    pub(super) traces: &'a [ComparedTrace],
    /// Origin of time.
    pub(super) alignment: Alignment,
    /// Mean and spread of each class in place of each trial.
    pub(super) spread: bool,
}

/// Probability from which on the likeliest class of a running grasp has a band: before, it changes with every answer.
const LEAST_FOR_BANDS: f64 = 0.4;

/// Recognition of the source that is shown.
pub(super) struct Recognised<'a> {
    /// Newest answers; none while recognition is off.
    pub(super) view: Option<&'a Arc<IdentificationView>>,
    /// Why recognition is off.
    pub(super) off: Option<&'a str>,
    /// Class name and title of the object in the hand, where known.
    pub(super) truth: Option<(&'a str, String)>,
    /// The object had left the hand at the end of the hold.
    pub(super) nothing_held: bool,
    /// Text before the first answer.
    pub(super) waiting: &'static str,
    /// Text where another grasp is due.
    pub(super) again: &'static str,
    /// No further grasp follows automatically.
    pub(super) finished: bool,
}

impl Recognised<'_> {
    /// Whether the decision is right, where there is one and the truth is known.
    pub(super) fn is_right(&self) -> Option<bool> {
        self.view?.is_right(self.truth.as_ref()?.0, self.nothing_held)
    }
}

/// Text where another grasp follows by itself.
const GRASPING_AGAIN: &str = "grasping again";

/// Picture of one time.
#[derive(Clone, Copy)]
pub(super) struct Moment<'a> {
    /// Number that differs between grasps and trials.
    pub(super) grasp: u64,
    pub(super) stage: &'a Stage,
    pub(super) frame: &'a Frame,
}

/// Bit in the numbers of stored trials, which those of grasps do not have.
const STORED: u64 = 1 << 63;

/// A moment at which an object was held.
pub(super) struct HeldMoment {
    pub(super) stage: Arc<Stage>,
    pub(super) frame: Arc<Frame>,
    pub(super) object: Option<Arc<ObjectCard>>,
}

/// Length of a live stream in the plots (s).
const ROLLING_S: f64 = 10.0;
/// Least length of a trial in the plots (s).
const TRIAL_S: f64 = 4.0;

impl<'a> DisplayedData<'a> {
    /// Time that is shown (s): the cursor, that at which a finished round is shown, or the newest sample.
    pub(super) fn time_s(&self) -> Option<f64> {
        let newest = || self.traces.current()?.t.last().copied();
        self.past_s().or_else(newest)
    }

    /// Time that is shown in place of the newest sample (s): the cursor, or that at which a finished round is shown.
    pub(super) fn past_s(&self) -> Option<f64> {
        self.playback.cursor_s.or_else(|| self.held_s())
    }

    /// Sample that is shown, or the last before it.
    pub(super) fn sample(&self) -> Option<usize> {
        self.traces.current()?.sample_at(self.time_s()?)
    }

    /// True while the past of a live gripper is shown.
    pub(super) fn looks_back(&self) -> bool {
        self.source != ViewSource::Trial && self.playback.cursor_s.is_some()
    }

    /// Fingers and object at the time that is shown.
    pub(super) fn moment(&self) -> Option<Moment<'a>> {
        if self.source == ViewSource::Trial {
            let Inspected { trial, cursor_s, .. } = self.inspected?;
            let frame = trial.at(cursor_s)?.frame?;
            return Some(Moment { grasp: trial.id.unsigned_abs() | STORED, stage: trial.stage.as_deref()?, frame });
        }
        let snapshot = self.snapshot?;
        let past = || {
            let trace = self.traces.current().filter(|trace| trace.grasp == snapshot.grasp)?;
            trace.frames.get(trace.sample_at(self.past_s()?)?)?.as_deref()
        };
        let simulated = self.source == ViewSource::Simulation;
        let frame = past().filter(|_| simulated).unwrap_or(&snapshot.frame);
        Some(Moment { grasp: snapshot.grasp, stage: &snapshot.stage, frame })
    }

    /// The stored trial, where one is shown.
    pub(super) fn shown_trial(&self) -> Option<Inspected<'a>> {
        self.inspected.filter(|_| self.source == ViewSource::Trial)
    }

    /// Time at which the object of a finished round, or of a trial that was just opened, is shown: at the end of the hold (s),
    /// not fallen; where it has slipped out of the hand in a round by then, when it was held most firmly. None while grasps
    /// follow, and where the user looks at another time.
    pub(super) fn held_s(&self) -> Option<f64> {
        if let Some(own) = self.shown_trial().filter(|_| self.playback.cursor_s.is_none()) {
            return own.trial.last_of(TouchPhase::Hold);
        }
        let snapshot = self.snapshot.filter(|now| self.source == ViewSource::Simulation && now.status.finished)?;
        let [_, end] = self.hold().filter(|_| self.playback.cursor_s.is_none())?;
        let trace = self.traces.current().filter(|trace| trace.grasp == snapshot.grasp)?;
        let force = |frame: &Frame| snapshot.stage.force_on_object(frame);
        let before = || trace.frames.iter().flatten().take_while(|frame| frame.t <= end + 1e-9);
        if before().last().is_none_or(|frame| force(frame).is_some()) {
            return Some(end);
        }
        let firmest = before().filter_map(|frame| Some((frame.t, force(frame)?))).max_by(|a, b| a.1.total_cmp(&b.1));
        Some(firmest.map_or(end, |(t, _)| t))
    }

    /// The last hold, while the newest frame of the simulation is shown, and is no longer one.
    pub(super) fn last_hold(&self) -> Option<&'a HeldMoment> {
        self.last_hold.filter(|_| self.source == ViewSource::Simulation && self.past_s().is_none())
    }

    /// Answer of the recogniser in the past of a live gripper, where it is shown and has one.
    fn past_answer(&self) -> Option<&'a Arc<IdentificationView>> {
        self.playback.cursor_s?;
        self.traces.current()?.answers.get(self.sample()?)?.as_ref()
    }

    /// Newest answer to a live gripper, wherever the cursor is.
    pub(super) fn newest_answer(&self) -> Option<&'a Arc<IdentificationView>> {
        match self.source {
            ViewSource::Simulation => self.snapshot?.identification.as_ref(),
            ViewSource::Gripper => self.gripper?.identification.as_ref(),
            ViewSource::Trial => None,
        }
    }

    /// Phases of the grasp that is shown: as measured, or else the hold of the programme. They are found once per frame, for
    /// `phases`.
    pub(super) fn find_phases(&self) -> Vec<PhaseSpan> {
        let measured = match (self.source, self.traces.current(), self.snapshot) {
            (ViewSource::Trial, ..) => return self.inspected.map(|own| own.trial.phases.clone()).unwrap_or_default(),
            (ViewSource::Simulation, Some(trace), Some(snapshot)) => {
                phases_of_frames(trace.frames.iter().flatten().map(Arc::as_ref), &snapshot.scene.gripper)
            }
            (ViewSource::Simulation | ViewSource::Gripper, ..) => Vec::new(),
        };
        if !measured.is_empty() {
            return measured;
        }
        // As far as there are samples.
        let newest_s = self.traces.current().map_or(f64::NEG_INFINITY, |trace| trace.span()[1]);
        let hold =
            self.hold().map(|[from_s, to_s]| [from_s, to_s.min(newest_s)]).filter(|[from_s, to_s]| from_s < to_s);
        hold.map(|[from_s, to_s]| PhaseSpan { phase: TouchPhase::Hold, from_s, to_s }).into_iter().collect()
    }

    /// True where a stored trial or the past of a live gripper is shown.
    pub(super) fn replays(&self) -> bool {
        self.source == ViewSource::Trial || self.looks_back()
    }

    /// True where a raised threshold asks for one more grasp of the simulated object.
    pub(super) fn one_more(&self) -> bool {
        let finished = self.snapshot.filter(|snapshot| snapshot.status.finished);
        finished.and_then(|snapshot| snapshot.identification.as_ref()).is_some_and(|view| view.asks_for_more)
    }

    /// Last finished grasp of the gripper that is shown, or a sentence that says why there is none.
    pub(super) fn grasp_to_explain(&self) -> Result<ExplainRequest, String> {
        if let (ViewSource::Trial, Some(Inspected { trial, .. })) = (self.source, self.inspected) {
            // The answer to the whole grasp, wherever the cursor is.
            let last = trial.answers.last().and_then(|answer| answer.last.clone());
            let off = trial.recognition_off.as_deref().unwrap_or("the trial has no finished grasp");
            let grasp = last.ok_or_else(|| format!("No answer to explain: {off}."))?;
            return Ok(ExplainRequest { grasp, trial: Some(trial.id) });
        }
        let recognised = self.recognised().ok_or("Waiting for the first grasp …")?;
        let Some(view) = recognised.view else {
            let off = recognised.off.unwrap_or("there is no recognition model");
            return Err(format!("Recognition is off: {off}. Without an answer there is nothing to explain."));
        };
        // Also where the cursor is in the past.
        let Some(grasp) = self.newest_answer().unwrap_or(view).last.clone() else {
            let start = match self.source {
                ViewSource::Simulation if self.snapshot.is_some_and(|snapshot| snapshot.status.playing) => "",
                ViewSource::Simulation => ": press play (Space)",
                ViewSource::Gripper => ": record a trial (R)",
                ViewSource::Trial => ": open a trial",
            };
            return Err(format!("The explanation appears when a grasp ends{start}."));
        };
        Ok(ExplainRequest { grasp, trial: None })
    }

    /// Mean and spread of the two likeliest classes in a channel, on the time of the plots; none while the answer is open or
    /// hidden, and for models without class signatures.
    pub(super) fn bands_for(&self, channel: &str) -> Option<[Band; 2]> {
        let view = self.recognised()?.view.filter(|_| !self.blind)?;
        let pmf = view.verdict.as_ref().map(|verdict| &verdict.pmf).or(view.beliefs.last())?;
        let open = view.listening && pmf.top().1 < LEAST_FOR_BANDS;
        let mut bands = bands_for(view.signatures.as_deref().filter(|_| !open)?, &view.labels, pmf, channel)?;
        // A signature begins with the closing.
        let closing_s = self.closing_s();
        bands.iter_mut().flat_map(|band| &mut band.t_s).for_each(|t| *t += closing_s);
        Some(bands)
    }

    /// Time at which the closing begins (s): that of a real gripper is counted from the rest before it.
    fn closing_s(&self) -> f64 {
        match self.source {
            ViewSource::Simulation => 0.0,
            ViewSource::Gripper => self.traces.current().map_or(0.0, |trace| trace.closing_s),
            ViewSource::Trial => {
                let recorded = self.inspected.filter(|own| own.trial.source == TrialSource::Recorded);
                recorded.map_or(0.0, |own| Alignment::Closing.origin_s(own.trial))
            }
        }
    }

    /// Board of the real gripper or of a recorded trial, where one is shown.
    pub(super) fn board(&self) -> Option<&'a Board> {
        match self.source {
            ViewSource::Simulation => None,
            ViewSource::Gripper => self.gripper?.link.as_ref().map(|link| &link.board),
            ViewSource::Trial => self.inspected?.trial.board.as_ref(),
        }
    }

    /// True for a simulated trial that is read by sensors like the parts of a real gripper, and not by perfect ones.
    pub(super) fn reads_like_parts(&self) -> bool {
        let trial = self.inspected.filter(|_| self.source == ViewSource::Trial);
        self.view.sensors.sensors != SensorModel::Virtual && trial.is_some_and(|own| own.trial.simulated.is_some())
    }

    /// Names of the columns of the traces, as in files.
    pub(super) fn column_names(&self) -> Vec<String> {
        match self.source {
            ViewSource::Trial => {
                let columns = self.inspected.map(|own| own.trial.columns.iter().map(|c| c.name.clone()).collect());
                columns.unwrap_or_default()
            }
            ViewSource::Simulation | ViewSource::Gripper => {
                let board = self.gripper.filter(|_| self.source == ViewSource::Gripper);
                let counts = board.and_then(|gripper| gripper.link.as_ref()).map(|link| link.board.channels.clone());
                let channels =
                    self.channels().into_iter().map(|channel| channel.map_or_else(String::new, Channel::name));
                channels.chain(counts.unwrap_or_default()).collect()
            }
        }
    }

    /// Recognition, once the source has a state.
    pub(super) fn recognised(&self) -> Option<Recognised<'a>> {
        match self.source {
            ViewSource::Trial => self.inspected.map(|Inspected { trial, cursor_s, .. }| {
                // An object that was renamed since has its new name.
                let knows = |name: &str| trial.answers.last().is_some_and(|view| view.labels.class(name).is_some());
                let (object, title) = match self.learned_name.filter(|_| !knows(&trial.header.object)) {
                    Some(name) => (name, capital_title(name)),
                    None => (trial.header.object.as_str(), trial.title.clone()),
                };
                Recognised {
                    // Before the cursor is moved, the answer to the whole grasp.
                    view: match self.playback.cursor_s {
                        None => trial.answers.last(),
                        Some(_) => trial.at(cursor_s).and_then(|now| now.answer),
                    },
                    off: trial.recognition_off.as_deref(),
                    truth: (!object.is_empty()).then_some((object, title)),
                    nothing_held: trial.nothing_held(),
                    waiting: "Fingers closing",
                    again: GRASPING_AGAIN,
                    finished: true,
                }
            }),
            ViewSource::Simulation => self.snapshot.map(|snapshot| {
                let truth = snapshot.truth();
                let title = snapshot.object.as_ref().map_or_else(|| object_title(truth), |object| object.title.clone());
                Recognised {
                    view: self.past_answer().or(self.newest_answer()),
                    off: snapshot.recognition_off.as_deref(),
                    truth: Some((truth, title)),
                    nothing_held: snapshot.status.nothing_held,
                    waiting: if snapshot.status.playing { "Fingers closing" } else { "Press play to start a grasp" },
                    again: GRASPING_AGAIN,
                    finished: snapshot.status.finished,
                }
            }),
            ViewSource::Gripper => self.gripper.map(|gripper| Recognised {
                view: self.past_answer().or(self.newest_answer()),
                off: gripper.recognition_off.as_deref(),
                truth: None,
                nothing_held: false,
                waiting: match &gripper.trial {
                    Some(_) => "Fingers closing",
                    None if !gripper.remarks.is_empty() => "Sensors not calibrated: first Adapt (panel Gripper)",
                    None => "Press R to start a grasp",
                },
                again: "press R to grasp again",
                finished: false,
            }),
        }
    }

    /// Channels of the traces, column by column; none for columns without one, such as counts of a board.
    pub(super) fn channels(&self) -> Vec<Option<&'a Channel>> {
        match self.source {
            ViewSource::Simulation => self.snapshot.map(|snapshot| snapshot.channels.iter().map(Some).collect()),
            ViewSource::Gripper => self.gripper.map(|gripper| gripper.channels.iter().map(Some).collect()),
            ViewSource::Trial => {
                self.inspected.map(|own| own.trial.columns.iter().map(|column| column.channel.as_ref()).collect())
            }
        }
        .unwrap_or_default()
    }

    /// All the time that plots can show (s).
    pub(super) fn time_span(&self) -> [f64; 2] {
        match self.source {
            ViewSource::Simulation => [0.0, self.snapshot.map_or(4.0, |snapshot| snapshot.status.duration)],
            ViewSource::Gripper => gripper_span(self.traces.current()),
            ViewSource::Trial => self.inspected.map_or([0.0, 4.0], |own| own.trial.span_s()),
        }
    }

    /// Trial of the real gripper whose curves stay until the next one, while nothing is recorded.
    pub(super) fn recorded(&self) -> Option<TrialId> {
        let gripper = self.gripper.filter(|gripper| self.source == ViewSource::Gripper && gripper.trial.is_none())?;
        self.traces.current().filter(|trace| !trace.rolling)?;
        Some(gripper.ended.as_ref()?.id)
    }

    /// Beginning and end of the hold (s), where known.
    pub(super) fn hold(&self) -> Option<[f64; 2]> {
        if self.source == ViewSource::Trial {
            let phases = self.inspected.map(|own| own.trial.phases.as_slice())?;
            return phases.iter().find(|span| span.phase == TouchPhase::Hold).map(|span| [span.from_s, span.to_s]);
        }
        if self.source == ViewSource::Gripper {
            // Only timed trials follow the programme; an emulated hand that moves by itself has its own times.
            let gripper = self.gripper?;
            let ended = || gripper.ended.as_ref().map(|ended| ended.request.control);
            let control = gripper.trial.as_ref().map(|trial| trial.request.control).or_else(ended);
            let rolling = self.traces.current().is_none_or(|trace| trace.rolling);
            let follows = |control| control == Control::Driven || control == Control::ByHand && !gripper.is_emulated();
            if rolling || !control.is_some_and(follows) {
                return None;
            }
        }
        let scene = match self.source {
            ViewSource::Simulation => &self.snapshot?.scene,
            ViewSource::Gripper | ViewSource::Trial => self.scene,
        };
        let tick = 1.0 / f64::from(scene.timing.actuation_hz.max(1));
        let closed = f64::from(scene.programme.close_ticks()) * tick;
        let closed = closed + self.closing_s();
        let released = (closed + f64::from(scene.programme.hold_ticks) * tick).min(self.time_span()[1]);
        (closed < released).then_some([closed, released])
    }
}

/// Least time of a long rest that is shown (s).
const RESTED_S: f64 = 1.0;

/// Time of a trial from its rest before closing on, or the last seconds of a stream (s).
fn gripper_span(trace: Option<&GraspTrace>) -> [f64; 2] {
    let last = |trace: &GraspTrace| trace.t.last().copied().unwrap_or(0.0);
    match trace {
        Some(trace) if !trace.rolling => {
            // A longer rest is seen while it lasts.
            let from = (trace.closing_s - LEAD_S).min(last(trace) - RESTED_S);
            [trace.t.first().copied().unwrap_or(0.0).max(from), last(trace).max(trace.closing_s + TRIAL_S)]
        }
        Some(trace) => [last(trace).max(ROLLING_S) - ROLLING_S, last(trace).max(ROLLING_S)],
        None => [0.0, ROLLING_S],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_rest_is_seen_while_it_lasts() {
        let span = |last: f64| {
            let t: Vec<f64> = (0..).map(|k| 0.02 * f64::from(k)).take_while(|t| *t <= last).collect();
            gripper_span(Some(&GraspTrace { t, closing_s: 4.0, ..GraspTrace::default() }))
        };
        assert_eq!(span(0.0), [0.0, 4.0 + TRIAL_S]);
        assert!((span(2.0)[0] - 1.0).abs() < 1e-9, "{:?}", span(2.0));
        // Then as much of it as of any other.
        assert_eq!(span(5.0), [4.0 - LEAD_S, 4.0 + TRIAL_S]);
    }
}
