//! Read-only context of panels, bars and keys.

use crate::app::features::inspect::{ComparedTrace, Inspected, Pinned};
use crate::app::features::library::LibrarySelection;
use crate::app::features::tools::GripperTools;
use crate::app::features::view::ViewState;
use crate::app::playback::Playback;
use crate::app::shown::SourceData;
use crate::app::traces::TraceHistory;
use crate::app::view_source::ViewSource;
use palpate_lab::inspection::Alignment;
use palpate_lab::study::accuracy::AccuracyStudy;
use palpate_lab::workers::{
    EffectsWorker, GripperView, LabelDraft, LabelView, LibraryView, MeasuredAccuracy, SceneAccuracyJob, Snapshot,
};
use palpate_sim::frame::Frame;
use palpate_sim::scene::Scene;
use std::collections::BTreeMap;

/// Everything a panel may read.
pub struct PanelContext<'a> {
    /// Newest state of the simulation; absent until the first object is loaded.
    pub snapshot: Option<&'a Snapshot>,
    /// Cost and error of the last scene measured.
    pub accuracy: Option<&'a MeasuredAccuracy>,
    /// Measurement of what accuracy costs in a scene.
    pub scene_accuracy: &'a SceneAccuracyJob,
    /// Stored study of what accuracy costs; absent where it cannot be read.
    pub stored_accuracy: Option<&'a AccuracyStudy>,
    /// Scene as set by the user.
    pub scene: &'a Scene,
    /// Measurement of the effects.
    pub effects: &'a EffectsWorker,
    /// Frame of the other engine at the same time, where it is drawn.
    pub ghost: Option<&'a Frame>,
    /// Newest state of the real gripper; absent until its thread has begun.
    pub gripper: Option<&'a GripperView>,
    /// Diagnostics, fit and training.
    pub tools: &'a GripperTools,
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
    pub comparison: Comparison<'a>,
    /// Cursor on the data that are shown.
    pub(super) playback: &'a Playback,
    /// View state.
    pub view: &'a ViewState,
    /// Pictures of the built-in objects.
    pub thumbnails: &'a BTreeMap<String, egui::TextureHandle>,
    /// Name of the graphics driver; absent when the 3-D view cannot be drawn.
    pub driver: Option<&'a str>,
}

/// Trials beside the one that is shown.
#[derive(Clone, Copy)]
pub struct Comparison<'a> {
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
}
