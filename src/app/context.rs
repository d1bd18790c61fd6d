//! Read-only context of panels, bars and keys.

use crate::app::features::App;
use crate::app::features::library::LibrarySelection;
use crate::app::features::simulation::LoggedGrasp;
use crate::app::features::studies::Studies;
use crate::app::features::tools::GripperTools;
use crate::app::features::view::ViewState;
use crate::app::frame_rate::FrameRate;
use crate::app::playback::Playback;
use crate::app::shown::{ComparedTrials, Inspected, SourceData};
use crate::app::traces::TraceHistory;
use crate::app::view_source::ViewSource;
use palpate_lab::inspection::PhaseSpan;
use palpate_lab::study::Explanation;
use palpate_lab::study::accuracy::AccuracyStudy;
use palpate_lab::workers::{
    Explainer, GhostGrasp, GripperView, Job, LabelDraft, LabelView, LibraryView, MeasuredAccuracy, Snapshot,
};
use palpate_learn::Model;
use palpate_sim::scene::Scene;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Everything a panel may read.
pub struct PanelContext<'a> {
    app: &'a App,
    /// Newest state of the simulation; absent until the first object is loaded.
    pub(super) snapshot: Option<&'a Snapshot>,
    /// Cost and error of the last scene measured.
    pub(super) accuracy: Option<&'a MeasuredAccuracy>,
    /// Stored study of what accuracy costs; absent where it cannot be read.
    pub(super) stored_accuracy: Option<&'a AccuracyStudy>,
    /// Scene as set by the user.
    pub(super) scene: &'a Scene,
    /// The last grasp of the simulation, while it is in the demo log.
    pub(super) logged: Option<LoggedGrasp>,
    /// Measurement of the effects.
    pub(super) effects: &'a Job<Scene, Explanation>,
    /// Newest state of the real gripper; absent until its thread has begun.
    pub(super) gripper: Option<&'a GripperView>,
    /// Diagnostics, fit and training.
    pub(super) tools: &'a GripperTools,
    /// Studies of the paper.
    pub(super) studies: &'a Studies,
    /// Model that the real gripper uses.
    pub(super) gripper_model: Option<&'a Model>,
    /// Explanations of answers.
    pub(super) explainer: &'a Explainer,
    /// Labels, plan and journal; absent until the store has been read.
    pub(super) labels: Option<&'a LabelView>,
    /// Label being chosen.
    pub(super) draft: &'a LabelDraft,
    /// Trials of the library that were found; absent until they were asked for.
    pub(super) library: Option<&'a LibraryView>,
    /// Query and selection in the library.
    pub(super) picked: &'a LibrarySelection,
    /// The model's prediction is hidden until the label is given.
    pub(super) blind: bool,
    /// Source of the data that are shown.
    pub(super) source: ViewSource,
    /// Its traces.
    pub(super) traces: &'a TraceHistory,
    /// The stored trial that is open, and the time of it that is shown.
    pub(super) inspected: Option<Inspected<'a>>,
    /// A trial is being opened.
    pub(super) opening: bool,
    /// Comparison with other trials.
    pub(super) comparison: ComparedTrials<'a>,
    /// Cursor on the data that are shown.
    pub(super) playback: &'a Playback,
    /// Phases of the grasp that is shown, as far as they are known.
    pub(super) phases: &'a [PhaseSpan],
    /// View state.
    pub(super) view: &'a ViewState,
    /// Pictures of objects, by the name of a class or the path of a file.
    pub(super) thumbnails: &'a BTreeMap<String, egui::TextureHandle>,
    /// Name of the graphics driver; absent when the 3-D view cannot be drawn.
    pub(super) driver: Option<&'a str>,
    /// Frame rate and resolution of the moving 3-D view.
    pub(super) frame_rate: FrameRate,
}

impl<'a> PanelContext<'a> {
    pub(super) fn of(app: &'a App) -> Self {
        let shown = app.shown();
        Self {
            app,
            snapshot: shown.snapshot,
            accuracy: app.simulation.accuracy.as_deref(),
            stored_accuracy: app.simulation.stored_accuracy.as_ref(),
            scene: &app.simulation.scene,
            logged: app.logged(),
            effects: &app.simulation.effects,
            gripper: shown.gripper,
            tools: &app.tools,
            studies: &app.studies,
            gripper_model: app.recognition.gripper_model(),
            explainer: &app.recognition.explainer,
            labels: app.labels(),
            draft: app.labelling.session.draft(),
            library: app.library.view.as_deref(),
            picked: &app.library.selection,
            blind: shown.blind,
            source: shown.source,
            traces: shown.traces,
            inspected: shown.inspected,
            opening: shown.opening,
            comparison: shown.comparison,
            playback: shown.playback,
            phases: shown.phases,
            view: &app.view,
            thumbnails: app.thumbnails.textures(),
            driver: app.driver.as_deref(),
            frame_rate: app.frame_rate,
        }
    }

    /// Data that are shown.
    pub(super) fn shown(&self) -> SourceData<'a> {
        self.app.shown()
    }

    /// Last grasp of the other engine, where it is drawn.
    pub(super) fn ghost(&self) -> Option<Arc<GhostGrasp>> {
        self.app.simulation.ghost(&self.app.view)
    }

    /// Share of the pixels along each side that the 3-D view has now: all of them while it does not move.
    pub(super) fn resolution(&self) -> f32 {
        self.app.resolution()
    }
}
