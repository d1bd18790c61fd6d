//! Read-only context of panels, bars and keys.

use crate::app::features::inspect::{ComparedTrace, Inspected, Pinned};
use crate::app::features::library::LibrarySelection;
use crate::app::features::studies::Studies;
use crate::app::features::tools::GripperTools;
use crate::app::features::view::ViewState;
use crate::app::frame_rate::FrameRate;
use crate::app::playback::Playback;
use crate::app::shown::SourceData;
use crate::app::traces::TraceHistory;
use crate::app::view_source::ViewSource;
use palpate_lab::inspection::{Alignment, PhaseSpan};
use palpate_lab::study::Explanation;
use palpate_lab::study::accuracy::AccuracyStudy;
use palpate_lab::why::{Band, bands_for};
use palpate_lab::workers::{
    ExplainRequest, Explainer, GhostGrasp, GripperView, Job, LabelDraft, LabelView, LibraryView, MeasuredAccuracy,
    Snapshot,
};
use palpate_learn::Model;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::{TrialId, TrialSource};
use std::collections::BTreeMap;

/// Probability from which on the likeliest class of a running grasp has a band: before, it changes with every answer.
const LEAST_FOR_BANDS: f64 = 0.4;

/// Everything a panel may read.
pub struct PanelContext<'a> {
    /// Newest state of the simulation; absent until the first object is loaded.
    pub snapshot: Option<&'a Snapshot>,
    /// Cost and error of the last scene measured.
    pub accuracy: Option<&'a MeasuredAccuracy>,
    /// Stored study of what accuracy costs; absent where it cannot be read.
    pub stored_accuracy: Option<&'a AccuracyStudy>,
    /// Scene as set by the user.
    pub scene: &'a Scene,
    /// The last grasp of the simulation, while it is in the demo log.
    pub logged: Option<LoggedGrasp>,
    /// Measurement of the effects.
    pub effects: &'a Job<Scene, Explanation>,
    /// Last grasp of the other engine, where it is drawn.
    pub ghost: Option<&'a GhostGrasp>,
    /// Newest state of the real gripper; absent until its thread has begun.
    pub gripper: Option<&'a GripperView>,
    /// Diagnostics, fit and training.
    pub tools: &'a GripperTools,
    /// Studies of the paper.
    pub studies: &'a Studies,
    /// Model that the real gripper uses.
    pub gripper_model: Option<&'a Model>,
    /// Explanations of answers.
    pub explainer: &'a Explainer,
    /// Labels, plan and journal; absent until the store has been read.
    pub labels: Option<&'a LabelView>,
    /// Label being chosen.
    pub draft: &'a LabelDraft,
    /// Trials of the library that were found; absent until they were asked for.
    pub library: Option<&'a LibraryView>,
    /// Query and selection in the library.
    pub picked: &'a LibrarySelection,
    /// The model's prediction is hidden until the label is given.
    pub blind: bool,
    /// Source of the data that are shown.
    pub source: ViewSource,
    /// Its traces.
    pub traces: &'a TraceHistory,
    /// The stored trial that is open, and the time of it that is shown.
    pub inspected: Option<Inspected<'a>>,
    /// A trial is being opened.
    pub opening: bool,
    /// Comparison with other trials.
    pub comparison: ComparedTrials<'a>,
    /// Cursor on the data that are shown.
    pub(super) playback: &'a Playback,
    /// Phases of the grasp that is shown, as far as they are known.
    pub phases: &'a [PhaseSpan],
    /// View state.
    pub view: &'a ViewState,
    /// Pictures of objects, by the name of a class or the path of a file.
    pub thumbnails: &'a BTreeMap<String, egui::TextureHandle>,
    /// Name of the graphics driver; absent when the 3-D view cannot be drawn.
    pub driver: Option<&'a str>,
    /// Frame rate and resolution of the moving 3-D view.
    pub(super) frame_rate: FrameRate,
}

/// A grasp in the demo log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoggedGrasp {
    /// Its trial.
    pub trial: TrialId,
    /// It has been moved to the store.
    pub kept: bool,
}

/// Trials beside the one that is shown.
#[derive(Clone, Copy)]
pub struct ComparedTrials<'a> {
    /// The trials.
    pub pinned: &'a [Pinned],
    /// Their curves, or those of their classes.
    pub traces: &'a [ComparedTrace],
    /// Origin of time.
    pub alignment: Alignment,
    /// Mean and spread of each class in place of each trial.
    pub spread: bool,
}

impl<'a> PanelContext<'a> {
    /// Data that are shown.
    pub(super) fn shown(&self) -> SourceData<'a> {
        let Self { source, snapshot, gripper, inspected, playback, traces, scene, .. } = *self;
        SourceData { source, snapshot, gripper, inspected, playback, traces, scene }
    }

    /// The other origin of time of compared trials.
    pub(super) fn next_alignment(&self) -> Alignment {
        match self.comparison.alignment {
            Alignment::Closing => Alignment::Contact,
            Alignment::Contact => Alignment::Closing,
        }
    }

    /// True where a raised threshold asks for one more grasp of the simulated object.
    pub(super) fn one_more(&self) -> bool {
        let finished = self.snapshot.filter(|snapshot| snapshot.status.finished);
        finished.and_then(|snapshot| snapshot.identification.as_ref()).is_some_and(|view| view.asks_for_more)
    }

    /// True while the picture moves.
    pub(super) fn moves(&self) -> bool {
        let live = self.source == ViewSource::Simulation && !self.shown().looks_back();
        let simulates = live && self.snapshot.is_some_and(|snapshot| snapshot.status.playing);
        self.playback.playing || simulates
    }

    /// Share of the pixels along each side that the 3-D view has now: all of them while it does not move.
    pub(super) fn resolution(&self) -> f32 {
        if self.moves() { self.frame_rate.share() } else { 1.0 }
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
        let Some(recognised) = self.shown().recognised() else {
            return Err("Waiting for the first grasp ..".to_owned());
        };
        let Some(view) = recognised.view else {
            let off = recognised.off.unwrap_or("there is no recognition model");
            return Err(format!("Recognition is off: {off}. Without an answer there is nothing to explain."));
        };
        let Some(grasp) = view.last.clone() else {
            let start = match self.source {
                ViewSource::Simulation => "press play (Space)",
                ViewSource::Gripper => "record a trial (R)",
                ViewSource::Trial => "open a trial",
            };
            return Err(format!("The explanation appears when a grasp ends: {start}."));
        };
        Ok(ExplainRequest { grasp, trial: None })
    }

    /// Mean and spread of the two likeliest classes in a channel, on the time of the plots; none while the answer is open or
    /// hidden, and for models without class signatures.
    pub fn bands_for(&self, channel: &str) -> Option<[Band; 2]> {
        let view = self.shown().recognised()?.view.filter(|_| !self.blind)?;
        let pmf = view.verdict.as_ref().map(|verdict| &verdict.pmf).or(view.beliefs.last())?;
        let open = view.listening && pmf.top().1 < LEAST_FOR_BANDS;
        let mut bands = bands_for(view.signatures.as_deref().filter(|_| !open)?, &view.labels, pmf, channel)?;
        // A recorded trial counts its time from the rest before the closing, a signature from the closing.
        let recorded = |own: &Inspected<'_>| own.trial.source == TrialSource::Recorded;
        if let Some(own) = self.inspected.filter(|own| self.source == ViewSource::Trial && recorded(own)) {
            let closing_s = Alignment::Closing.origin_s(own.trial);
            bands.iter_mut().flat_map(|band| &mut band.t_s).for_each(|t| *t += closing_s);
        }
        Some(bands)
    }
}
