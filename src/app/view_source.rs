//! Source of the data that plots and recognition show: the simulated gripper or the real one.

use crate::app::traces::{GraspTrace, TraceHistory};
use palpate_lab::grasping::{IdentificationView, LEAD_S};
use palpate_lab::workers::{GripperView, Snapshot};
use palpate_sim::objects::object_title;
use palpate_sim::scene::Scene;
use palpate_tactile::Channel;
use palpate_tactile::trial::Control;
use std::sync::Arc;

/// Gripper whose data are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewSource {
    /// The simulated one.
    #[default]
    Simulation,
    /// The real one.
    Gripper,
}

/// Data of the gripper that is shown.
#[derive(Clone, Copy)]
pub(super) struct SourceData<'a> {
    pub(super) source: ViewSource,
    pub(super) snapshot: Option<&'a Snapshot>,
    pub(super) gripper: Option<&'a GripperView>,
    pub(super) traces: &'a TraceHistory,
    pub(super) scene: &'a Scene,
}

/// Recognition of the gripper that is shown.
pub(super) struct Recognised<'a> {
    /// Newest answers; none while recognition is off.
    pub(super) view: Option<&'a Arc<IdentificationView>>,
    /// Why recognition is off.
    pub(super) off: Option<&'a str>,
    /// Class name and title of the object in the hand, where known.
    pub(super) truth: Option<(&'a str, String)>,
    /// Text before the first answer.
    pub(super) waiting: &'static str,
    /// No further grasp follows automatically.
    pub(super) finished: bool,
}

/// Length of a live stream in the plots (s).
const ROLLING_S: f64 = 10.0;
/// Least length of a trial in the plots (s).
const TRIAL_S: f64 = 4.0;

impl<'a> SourceData<'a> {
    /// Recognition, once the gripper has a state.
    pub(super) fn recognised(&self) -> Option<Recognised<'a>> {
        match self.source {
            ViewSource::Simulation => self.snapshot.map(|snapshot| {
                let truth = snapshot.truth();
                let title = snapshot.object.as_ref().map_or_else(|| object_title(truth), |object| object.title.clone());
                Recognised {
                    view: snapshot.identification.as_ref(),
                    off: snapshot.recognition_off.as_deref(),
                    truth: Some((truth, title)),
                    waiting: if snapshot.status.playing { "fingers closing" } else { "press play to start a grasp" },
                    finished: snapshot.status.finished,
                }
            }),
            ViewSource::Gripper => self.gripper.map(|gripper| Recognised {
                view: gripper.identification.as_ref(),
                off: gripper.recognition_off.as_deref(),
                truth: None,
                waiting: if gripper.trial.is_some() { "fingers closing" } else { "press R to start a grasp" },
                finished: false,
            }),
        }
    }

    /// Channels of the traces; counts of a board's channels may follow them.
    pub(super) fn channels(&self) -> &'a [Channel] {
        match self.source {
            ViewSource::Simulation => self.snapshot.map_or(&[], |snapshot| &snapshot.channels),
            ViewSource::Gripper => self.gripper.map_or(&[], |gripper| &gripper.channels),
        }
    }

    /// All the time that plots can show (s).
    pub(super) fn time_span(&self) -> [f64; 2] {
        match self.source {
            ViewSource::Simulation => [0.0, self.snapshot.map_or(4.0, |snapshot| snapshot.status.duration)],
            ViewSource::Gripper => gripper_span(self.traces.current()),
        }
    }

    /// Beginning and end of the hold (s), where known.
    pub(super) fn hold(&self) -> Option<[f64; 2]> {
        if self.source == ViewSource::Gripper {
            // Only timed trials follow the programme.
            let gripper = self.gripper?;
            let ended = || gripper.ended.as_ref().map(|ended| ended.request.control);
            let control = gripper.trial.as_ref().map(|trial| trial.request.control).or_else(ended);
            let rolling = self.traces.current().is_none_or(|trace| trace.rolling);
            if rolling || control.is_none_or(|control| control == Control::Free) {
                return None;
            }
        }
        let scene = match self.source {
            ViewSource::Simulation => &self.snapshot?.scene,
            ViewSource::Gripper => self.scene,
        };
        let tick = 1.0 / f64::from(scene.timing.actuation_hz.max(1));
        let closed = f64::from(scene.programme.close_ticks()) * tick;
        let released = (closed + f64::from(scene.programme.hold_ticks) * tick).min(self.time_span()[1]);
        (closed < released).then_some([closed, released])
    }
}

/// Time of a trial from its rest before closing on, or the last seconds of a stream (s).
fn gripper_span(trace: Option<&GraspTrace>) -> [f64; 2] {
    let last = |trace: &GraspTrace| trace.t.last().copied().unwrap_or(0.0);
    match trace {
        Some(trace) if !trace.rolling => {
            [trace.t.first().copied().unwrap_or(0.0).max(-LEAD_S), last(trace).max(TRIAL_S)]
        }
        Some(trace) => [last(trace).max(ROLLING_S) - ROLLING_S, last(trace).max(ROLLING_S)],
        None => [0.0, ROLLING_S],
    }
}
