//! Features of the window: each file has the state of one, and what can be done with it. [`App`] owns them all.
//!
//! What touches one feature alone is a method of that feature. What touches several, or tells the user something, is a
//! method of [`App`], in the file of the feature that it belongs to.

pub(super) mod files;
pub(super) mod gripper;
pub(super) mod inspect;
pub(super) mod labelling;
pub(super) mod library;
pub(super) mod notices;
pub(super) mod presenter;
pub(super) mod recognition;
pub(super) mod simulation;
pub(super) mod studies;
pub(super) mod tools;
pub(super) mod view;

use crate::app::frame_rate::FrameRate;
use crate::app::shown::{ComparedTrials, DisplayedData};
use crate::app::thumbnails::Thumbnails;
use crate::app::traces::TraceHistory;
use files::FileFeature;
use gripper::GripperFeature;
use inspect::InspectFeature;
use labelling::LabellingFeature;
use library::LibraryFeature;
use notices::Notices;
use palpate_lab::workers::{GripperView, LabelView, Snapshot};
use palpate_tactile::trial::TrialSource;
use presenter::PresenterFeature;
use recognition::RecognitionFeature;
use simulation::SimulationFeature;
use std::path::PathBuf;
use studies::Studies;
use tools::GripperTools;
use view::{ViewSource, ViewState};

/// State of the window: all its features.
pub struct App {
    pub(super) ctx: egui::Context,
    /// Camera, theme, layout and settings.
    pub view: ViewState,
    pub(super) notices: Notices,
    /// Simulated gripper and its scene.
    pub simulation: SimulationFeature,
    /// Real gripper.
    pub gripper: GripperFeature,
    pub(super) labelling: LabellingFeature,
    /// Trial library.
    pub library: LibraryFeature,
    pub(super) recognition: RecognitionFeature,
    /// Stored trials that are open or compared.
    pub inspect: InspectFeature,
    pub(super) tools: GripperTools,
    /// Studies of the paper.
    pub studies: Studies,
    pub(super) presenter: PresenterFeature,
    /// Opening and saving.
    pub(super) files: FileFeature,
    pub(super) thumbnails: Thumbnails,
    /// Name of the graphics driver; absent when the 3-D view cannot be drawn.
    pub(super) driver: Option<String>,
    /// Frame rate and resolution of the moving 3-D view.
    pub(super) frame_rate: FrameRate,
    pub(super) store: PathBuf,
    /// Panel that is to be brought to the front, in a mode that has it.
    pub(super) wanted_panel: Option<&'static str>,
}

impl App {
    /// Newest state of the simulation; absent until the first object is loaded.
    pub(super) fn snapshot(&self) -> Option<&Snapshot> {
        self.simulation.snapshot.as_deref()
    }

    /// Newest state of the real gripper; absent until its thread has begun.
    pub(super) fn gripper_view(&self) -> Option<&GripperView> {
        self.gripper.view.as_deref()
    }

    /// Labels, plan and journal; absent until the store has been read.
    pub(super) fn labels(&self) -> Option<&LabelView> {
        self.labelling.labels.as_deref()
    }

    /// Data that are shown.
    pub(super) fn shown(&self) -> DisplayedData<'_> {
        DisplayedData {
            source: self.view.source,
            view: &self.view,
            snapshot: self.snapshot(),
            gripper: self.gripper_view(),
            inspected: self.inspect.inspected(),
            opening: self.inspect.is_opening(),
            playback: self.inspect.playback(self.view.source),
            traces: self.traces(),
            scene: &self.simulation.scene,
            last_hold: self.simulation.last_hold(),
            last_trial: self.simulation.last_trial.map(|(id, _)| id),
            phases: &self.inspect.phases,
            comparison: ComparedTrials {
                pinned: &self.inspect.pinned,
                // Beside a grasp of the demo or of the gripper they are curves without a name.
                traces: if self.view.mode == view::Mode::Inspect { &self.inspect.compared } else { &[] },
                alignment: self.inspect.alignment,
                spread: self.inspect.spread,
            },
            blind: self.labelling.blind,
            learned_otherwise: self.view.source == ViewSource::Simulation
                && self.snapshot().is_some_and(|snapshot| {
                    self.recognition.is_learned_otherwise(snapshot.truth(), snapshot.scene.holds_object())
                }),
            learned_name: self.inspect.inspected().filter(|_| self.view.source == ViewSource::Trial).and_then(|own| {
                // Labels name what a real gripper held.
                let simulated = own.trial.source == TrialSource::Simulated;
                simulated.then(|| self.name_of_learned(&own.trial.header.scene.object.source))?
            }),
            other_fingers: match self.view.source {
                ViewSource::Simulation => self.recognition.has_other_fingers(&self.simulation.scene),
                ViewSource::Trial => self.inspect.inspected().is_some_and(|own| own.trial.other_fingers),
                ViewSource::Gripper => false,
            },
        }
    }

    /// Traces of the source that is shown.
    pub(super) fn traces(&self) -> &TraceHistory {
        match self.view.source {
            ViewSource::Simulation => &self.simulation.traces,
            ViewSource::Gripper => &self.gripper.traces,
            ViewSource::Trial => &self.inspect.history,
        }
    }

    /// True while the picture moves.
    pub(super) fn moves(&self) -> bool {
        let shown = self.shown();
        let live = shown.source == ViewSource::Simulation && !shown.looks_back();
        let simulates = live && shown.snapshot.is_some_and(|snapshot| snapshot.status.playing);
        shown.playback.playing || simulates
    }

    /// Share of the pixels along each side that the 3-D view has now: all of them while it does not move.
    pub(super) fn resolution(&self) -> f32 {
        if self.moves() { self.frame_rate.share() } else { 1.0 }
    }

    /// Updates each feature once per frame.
    pub(super) fn poll(&mut self) {
        self.poll_simulation();
        self.poll_presenter();
        self.poll_gripper();
        self.poll_labelling();
        self.poll_library();
        self.poll_studies();
        self.poll_recognition();
        self.poll_files();
        let learned = self.recognition.learned_from(self.simulation.scene.holds_object());
        self.thumbnails.poll(&self.ctx, &self.view.recent, learned);
        self.poll_inspection();
        let shown = self.shown();
        let (names, phases) = (shown.column_names(), shown.find_phases());
        let own = shown.shown_trial().map(|own| own.trial.id);
        // Values beside the plots are those of a time that they show.
        let plotted = shown.time_span();
        let span = shown.traces.current().map_or([0.0; 2], |trace| {
            let [from, to] = trace.span();
            [from.max(plotted[0]), to]
        });
        self.inspect.move_cursor(&self.ctx, self.view.source, span);
        self.inspect.compare(names, phases, own);
    }
}
