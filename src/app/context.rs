//! Read-only context of panels, bars and keys.

use crate::app::features::tools::GripperTools;
use crate::app::features::view::ViewState;
use crate::app::traces::TraceHistory;
use crate::app::view_source::{SourceData, ViewSource};
use palpate_lab::study::accuracy::AccuracyStudy;
use palpate_lab::workers::{
    EffectsWorker, GripperView, LabelDraft, LabelView, MeasuredAccuracy, SceneAccuracyJob, Snapshot,
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
    /// The model's prediction is hidden until the label is given.
    pub blind: bool,
    /// Gripper whose data are shown.
    pub source: ViewSource,
    /// Traces of that gripper.
    pub traces: &'a TraceHistory,
    /// View state.
    pub view: &'a ViewState,
    /// Pictures of the built-in objects.
    pub thumbnails: &'a BTreeMap<String, egui::TextureHandle>,
    /// Name of the graphics driver; absent when the 3-D view cannot be drawn.
    pub driver: Option<&'a str>,
}

impl<'a> PanelContext<'a> {
    /// Data of the gripper that is shown.
    pub(super) fn shown(&self) -> SourceData<'a> {
        let Self { source, snapshot, gripper, traces, scene, .. } = *self;
        SourceData { source, snapshot, gripper, traces, scene }
    }
}
