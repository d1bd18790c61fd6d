//! Contents of the window: it starts the features, lets panels draw, and hands their actions to the features.

use crate::app::actions::{Action, Actions};
use crate::app::bars;
use crate::app::context::{ComparedTrials, LoggedGrasp, PanelContext};
use crate::app::export::ExportRequest;
use crate::app::features::files::{FileAction, FileFeature, drop_hint};
use crate::app::features::gripper::GripperFeature;
use crate::app::features::inspect::{InspectAction, InspectFeature, Inspected};
use crate::app::features::labelling::LabellingFeature;
use crate::app::features::library::{LibraryAction, LibraryFeature};
use crate::app::features::presenter::PresenterFeature;
use crate::app::features::recognition::{Recognisers, RecognitionAction, RecognitionFeature};
use crate::app::features::simulation::{SimulationAction, SimulationFeature};
use crate::app::features::studies::Studies;
use crate::app::features::tools::{GripperTools, GripperToolsSetup};
use crate::app::features::view::{ViewAction, ViewState};
use crate::app::frame_rate::FrameRate;
use crate::app::keys;
use crate::app::modes;
use crate::app::notices::{Notices, Remedy};
use crate::app::palette;
use crate::app::panels::{PanelKind, view3d};
use crate::app::path_dialog::{Closed, PathDialog};
use crate::app::presenter;
use crate::app::startup::ThreadError;
use crate::app::theme::{self, colour};
use crate::app::thumbnails::Thumbnails;
use crate::app::tiling::{Tiling, panel_frame};
use crate::app::traces::{GraspTrace, TraceHistory};
use crate::app::view_source::ViewSource;
use crate::app::viewport::Viewport;
use egui::{CentralPanel, Frame, Margin, Panel, Ui};
use egui_tiles::Tile;
use palpate_geometry::palette::Theme;
use palpate_lab::datasets::models_folder;
use palpate_lab::gripper::{Listen, listen_to_port};
use palpate_lab::inspection::{FigureOptions, OpenTrial, PhaseSpan, comparison_figure};
use palpate_lab::workers::{
    Command, Explain, Explainer, GhostGrasp, GripperSetup, GripperView, GripperWorker, LabelCommand, LabelView,
    LabelWorker, LabellingAction, LibraryView, LibraryWorker, MeasuredAccuracy, SimWorker, SimWorkerSetup, Snapshot,
    Wake, effects_job, examine_port, explain_scene, fit_trials, open_trial_job,
};
use palpate_learn::{ModelError, Models, Shipped};
use palpate_render::{describe_adapter, draws_in_software};
use palpate_sim::scene::Scene;
use palpate_store::TrialPlace;
use palpate_tactile::trial::TrialId;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Parts that a workbench is started with.
pub struct WorkbenchSetup<'a> {
    /// First scene.
    pub scene: Scene,
    /// Store of trials.
    pub store: PathBuf,
    /// View state of the last run.
    pub view: ViewState,
    /// Recognition models, or why there are none; everything else works without.
    pub models: Result<Models, ModelError>,
    /// Measures cost and influence of effects.
    pub explain: Explain,
    /// Opens the port of a real gripper.
    pub listen: Listen,
    /// Parts of diagnostics, fit and training.
    pub tools: GripperToolsSetup,
    /// The first grasp starts automatically.
    pub playing: bool,
    /// Requests a redraw; called from other threads.
    pub wake: Wake,
    /// Device of the 3-D view; the rest works without.
    pub render_state: Option<&'a egui_wgpu::RenderState>,
    /// Each frame begins in the background colour of the theme, which then need not be painted: fills of the whole window take
    /// most of the time of a software rasteriser.
    pub cleared: bool,
}

impl WorkbenchSetup<'_> {
    /// The parts of the program: the shipped models, real ports, the folder of models. The first grasp starts at once; there is
    /// no 3-D view.
    pub fn new(scene: Scene, store: PathBuf, view: ViewState, wake: Wake) -> Self {
        Self {
            scene,
            store,
            view,
            models: Models::shipped(),
            explain: Arc::new(explain_scene),
            listen: Arc::new(listen_to_port),
            tools: GripperToolsSetup {
                examine: Arc::new(examine_port),
                fit: Arc::new(fit_trials),
                models: models_folder(),
            },
            playing: true,
            wake,
            render_state: None,
            cleared: false,
        }
    }
}

/// Most grasps of an object: the paper's plateau is at three to four.
const GRASPS: u32 = 4;

/// Contents of the window.
pub struct Workbench {
    view: ViewState,
    notices: Notices,
    simulation: SimulationFeature,
    gripper: GripperFeature,
    labelling: LabellingFeature,
    library: LibraryFeature,
    recognition: RecognitionFeature,
    inspect: InspectFeature,
    tools: GripperTools,
    studies: Studies,
    presenter: PresenterFeature,
    files: FileFeature,
    path_dialog: Option<PathDialog>,
    thumbnails: Thumbnails,
    driver: Option<String>,
    frame_rate: FrameRate,
    cleared: bool,
    store: PathBuf,
    /// Labels at the last look.
    labels_seen: Option<Arc<LabelView>>,
    /// Phases of the grasp that is shown.
    phases: Vec<PhaseSpan>,
}

/// Size of exported figures (points).
const FIGURE_SIZE: [u32; 2] = [900, 560];

/// Newest states published by other threads, for one frame.
struct Published {
    snapshot: Option<Arc<Snapshot>>,
    accuracy: Option<Arc<MeasuredAccuracy>>,
    ghost: Option<Arc<GhostGrasp>>,
    gripper: Option<Arc<GripperView>>,
    labels: Option<Arc<LabelView>>,
    library: Option<Arc<LibraryView>>,
}

impl Workbench {
    /// Starts all threads and prepares the graphics.
    pub fn new(ctx: &egui::Context, setup: WorkbenchSetup<'_>) -> Result<Self, ThreadError> {
        let WorkbenchSetup { scene, store, mut view, explain, listen, playing, wake, .. } = setup;
        let (models, without) = match setup.models {
            Ok(models) => (models, None),
            Err(cause) => (Models::default(), Some(cause)),
        };
        // Before the other threads, so that it opens the store first and can report what an update did to the file.
        let labels =
            LabelWorker::start(store.clone(), Arc::clone(&wake)).map_err(ThreadError::of("the labelling thread"))?;
        let labelling = LabellingFeature::new(labels, store.clone());
        let library =
            LibraryWorker::start(store.clone(), Arc::clone(&wake)).map_err(ThreadError::of("the trial library"))?;
        let worker = SimWorker::start(SimWorkerSetup {
            scene: scene.clone(),
            sensors: view.sensors.clone(),
            store: store.clone(),
            recording: Some(TrialPlace::DemoLog),
            grasps: GRASPS,
            models: models.clone(),
            playing,
            wake: Arc::clone(&wake),
        });
        let effects = effects_job(explain, Arc::clone(&wake));
        let worker = worker.map_err(ThreadError::of("the simulation"))?;
        let simulation = SimulationFeature::new(worker, effects, scene.clone());
        let gripper = GripperWorker::start(GripperSetup {
            scene: scene.clone(),
            store: store.clone(),
            model: models.of(Shipped::AnyGripper).cloned(),
            grasps: GRASPS,
            listen,
            wake: Arc::clone(&wake),
        })
        .map_err(ThreadError::of("the gripper's thread"))?;
        let inspect = InspectFeature::new(open_trial_job(store.clone(), Arc::clone(&wake)), models.clone(), GRASPS);
        let tools = GripperToolsSetup { examine: gripper.examine(setup.tools.examine), ..setup.tools };
        let tools = GripperTools::new(tools, &store, &wake);
        let studies = Studies::new(&store, &wake);
        let adapter = setup.render_state.map(|state| {
            Viewport::install(state);
            state.adapter.get_info()
        });
        // Layouts of other versions are forgotten.
        view.layouts.retain(|mode, layout| modes::is_complete(*mode, layout));
        theme::apply(ctx, view.theme);
        // Keys for the scale are ours, so that it is remembered.
        ctx.options_mut(|options| options.zoom_with_keyboard = false);
        view.apply(ctx, ViewAction::SetScale(view.scale), None);
        let explainer = Explainer::new(store.clone(), &wake);
        let recognition = RecognitionFeature::new(models, explainer, &tools, &mut view);
        let thumbnails = Thumbnails::new(ctx, Arc::clone(&wake));
        let mut workbench = Self {
            view,
            notices: Notices::default(),
            simulation,
            gripper: GripperFeature::new(gripper, scene),
            labelling,
            library: LibraryFeature::new(library),
            recognition,
            inspect,
            tools,
            studies,
            presenter: PresenterFeature::default(),
            files: FileFeature::new(wake),
            path_dialog: None,
            thumbnails,
            driver: adapter.as_ref().map(describe_adapter),
            frame_rate: FrameRate::new(adapter.as_ref().is_some_and(draws_in_software)),
            cleared: setup.cleared,
            store,
            labels_seen: None,
            phases: Vec::new(),
        };
        if workbench.view.ghost {
            workbench.act(ctx, SimulationAction::SetGhost(true));
        }
        if let Some(cause) = without {
            workbench.notices.error(format!("Recognition is off: {cause}"));
        }
        Ok(workbench)
    }

    /// View state, to be remembered.
    pub fn view(&self) -> &ViewState {
        &self.view
    }

    /// Newest state of the simulation.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.simulation.worker().snapshot()
    }

    /// The stored trial that is open, the time shown, and trials compared with it.
    pub fn inspected(&self) -> Option<Inspected<'_>> {
        self.inspect.inspected()
    }

    /// Cost and error of the last scene measured.
    pub fn accuracy(&self) -> Option<Arc<MeasuredAccuracy>> {
        self.simulation.worker().accuracy()
    }

    /// Last messages to the user, oldest first.
    pub fn messages(&self) -> &VecDeque<String> {
        self.notices.messages()
    }

    /// Applies an action.
    pub fn act(&mut self, ctx: &egui::Context, action: impl Into<Action>) {
        self.apply(ctx, action.into());
    }

    /// Draws the window.
    pub fn ui(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.gather(&ctx);
        let moves = self.context(&self.published()).moves();
        self.frame_rate.count(Instant::now(), moves);
        if !self.cleared {
            ui.painter().rect_filled(ui.max_rect(), 0.0, colour(self.view.theme.colours().background));
        }
        if self.view.presents {
            return self.present(ui);
        }
        let remedy = self.notices.line(ui, self.view.theme);
        if let Some(action) = remedy.map(action_of) {
            self.apply(&ctx, action);
        }
        let published = self.published();
        let mut actions = Actions::default();
        // The layout changes while it is drawn, so it is taken out for that time.
        let mode = self.view.mode;
        let mut layout = self.view.layouts.remove(&mode).unwrap_or_else(|| modes::default_layout(mode));
        let context = self.context(&published);
        keys::pressed(&ctx, &context, &mut actions);
        let colours = self.view.theme.colours();
        let bar = Frame::new().fill(colour(colours.raised)).inner_margin(Margin::symmetric(12, 6));
        Panel::top("top").exact_size(40.0).frame(bar).show(ui, |ui| bars::top(ui, &context, &mut actions));
        Panel::bottom("bottom").exact_size(44.0).frame(bar).show(ui, |ui| bars::bottom(ui, &context, &mut actions));
        CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
            let mut tiling = Tiling { context: &context, actions: &mut actions, chosen: None };
            layout.ui(&mut tiling, ui);
            if let Some(chosen) = tiling.chosen {
                layout.make_active(|id, _| id == chosen);
            }
        });
        keys::sheet(&ctx, self.view.keys_shown, mode, &mut actions);
        palette::ui(&ctx, &context, &mut actions);
        drop_hint(&ctx);
        self.view.layouts.insert(mode, layout);
        for action in actions {
            self.apply(&ctx, action);
        }
        self.ask_for_file(&ctx);
    }

    /// Draws presenter mode.
    fn present(&mut self, ui: &Ui) {
        let message = self.notices.current(ui.ctx()).map(str::to_owned);
        let published = self.published();
        let mut actions = Actions::default();
        let context = self.context(&published);
        keys::pressed(ui.ctx(), &context, &mut actions);
        presenter::ui(ui, &context, self.presenter.score(), message.as_deref());
        for action in actions {
            self.apply(ui.ctx(), action);
        }
    }

    /// Draws one panel alone, as large as there is room.
    pub fn panel_ui(&mut self, ui: &mut Ui, panel: &PanelKind) {
        let ctx = ui.ctx().clone();
        self.gather(&ctx);
        let published = self.published();
        let mut actions = Actions::default();
        let ground = colour(self.view.theme.colours().background);
        panel_frame(panel).fill(ground).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            (panel.ui)(ui, &self.context(&published), &mut actions);
        });
        for action in actions {
            self.apply(&ctx, action);
        }
    }

    fn published(&self) -> Published {
        Published {
            snapshot: self.simulation.worker().snapshot(),
            accuracy: self.simulation.worker().accuracy(),
            ghost: self.simulation.ghost(&self.view),
            gripper: self.gripper.worker().view(),
            labels: self.labelling.worker().view(),
            library: self.library.view(),
        }
    }

    fn context<'a>(&'a self, published: &'a Published) -> PanelContext<'a> {
        let Published { snapshot, accuracy, ghost, gripper, labels, library } = published;
        let (snapshot, gripper, labels) = (snapshot.as_deref(), gripper.as_deref(), labels.as_deref());
        let source = self.view.source;
        PanelContext {
            snapshot,
            accuracy: accuracy.as_deref(),
            stored_accuracy: self.simulation.stored_accuracy(),
            scene: self.simulation.scene(),
            logged: self.logged(),
            effects: self.simulation.effects(),
            ghost: ghost.as_deref(),
            gripper,
            tools: &self.tools,
            studies: &self.studies,
            gripper_model: self.recognition.gripper_model(),
            explainer: self.recognition.explainer(),
            labels,
            draft: self.labelling.session().draft(),
            library: library.as_deref(),
            picked: self.library.selection(),
            blind: self.labelling.hides_prediction(gripper, labels, &self.view),
            source,
            traces: self.traces(),
            inspected: self.inspect.inspected(),
            opening: self.inspect.is_opening(),
            comparison: ComparedTrials {
                pinned: self.inspect.pinned(),
                traces: self.inspect.compared(),
                alignment: self.inspect.alignment(),
                spread: self.inspect.shows_spread(),
            },
            playback: self.inspect.playback(source),
            phases: &self.phases,
            view: &self.view,
            thumbnails: self.thumbnails.textures(),
            driver: self.driver.as_deref(),
            frame_rate: self.frame_rate,
        }
    }

    fn logged(&self) -> Option<LoggedGrasp> {
        let trial = self.simulation.logged_trial()?;
        Some(LoggedGrasp { trial, kept: self.library.kept() == Some(trial) })
    }

    /// Traces of the source that is shown.
    fn traces(&self) -> &TraceHistory {
        match self.view.source {
            ViewSource::Simulation => self.simulation.traces(),
            ViewSource::Gripper => self.gripper.traces(),
            ViewSource::Trial => self.inspect.history(),
        }
    }

    /// Draws the file dialog, while there is one.
    fn ask_for_file(&mut self, ctx: &egui::Context) {
        if let Some(question) = self.files.take_question() {
            self.path_dialog = Some(PathDialog::new(question, &self.files.folder()));
        }
        let closed = self.path_dialog.as_mut().and_then(|dialog| dialog.ui(ctx));
        if let Some(closed) = closed {
            self.path_dialog = None;
            if let Closed::Answered(answer) = closed {
                self.files.answer(answer);
            }
            ctx.request_repaint();
        }
    }

    /// Brings a panel to the front; opens a mode that has it where the present one has not.
    fn show_panel(&mut self, name: &str) {
        let others = modes::ALL.iter().map(|kind| kind.mode).filter(|mode| *mode != self.view.mode);
        for mode in std::iter::once(self.view.mode).chain(others).collect::<Vec<_>>() {
            let layout = self.view.layouts.entry(mode).or_insert_with(|| modes::default_layout(mode));
            if layout.make_active(|_, tile| matches!(tile, Tile::Pane(pane) if pane == name)) {
                self.view.mode = mode;
                return;
            }
        }
    }

    /// What an action exports, or why it cannot; none for actions that export nothing.
    fn export_request(&self, ctx: &egui::Context, action: &FileAction) -> Option<Result<ExportRequest, String>> {
        match action {
            FileAction::Open | FileAction::SaveScene | FileAction::SaveSceneAs(_) => None,
            FileAction::SavePicture => {
                let published = self.published();
                let picture = view3d::exported(ctx, &self.context(&published));
                Some(picture.ok_or_else(|| "There is nothing to draw.".to_owned()))
            }
            FileAction::ExportFigure(options) => {
                let Some(own) = self.inspect.inspected() else {
                    return Some(Err("Figures are made of stored trials: open one in Inspect mode.".to_owned()));
                };
                let others = own.pinned.iter().map(|pinned| &pinned.trial).filter(|trial| trial.id != own.trial.id);
                let trials: Vec<&OpenTrial> = std::iter::once(own.trial).chain(others).map(Arc::as_ref).collect();
                let (align, mean) = (self.inspect.alignment(), self.inspect.shows_spread());
                let figure = comparison_figure(&trials, &FigureOptions { align, mean, ..options.clone() });
                let request = figure.map(|figure| ExportRequest::Figure(figure, Theme::Light, FIGURE_SIZE));
                Some(request.map_err(|cause| cause.to_string()))
            }
            FileAction::ExportStudyFigure => {
                let Some(linked) = self.studies.exported() else {
                    return Some(Err("There is no figure: run the study first.".to_owned()));
                };
                Some(Ok(ExportRequest::Figure(linked.figure, Theme::Light, linked.size)))
            }
            FileAction::ExportTrials => {
                let ids: Vec<TrialId> = self.library.selection().selected.iter().copied().collect();
                if ids.is_empty() {
                    return Some(Err("Select trials in the library first.".to_owned()));
                }
                Some(Ok(ExportRequest::Trials(self.store.clone(), ids, self.inspect.options().clone())))
            }
        }
    }

    /// Updates each feature once per frame.
    fn gather(&mut self, ctx: &egui::Context) {
        let Self { view, notices, simulation, gripper, labelling, library, .. } = self;
        let Self { recognition, inspect, tools, studies, files, thumbnails, presenter, .. } = self;
        simulation.gather(view, notices);
        presenter.gather(ctx, simulation, view, notices);
        gripper.gather(simulation, view, notices);
        if let Some(action) = labelling.gather(gripper, simulation, view, notices) {
            // Opens or closes a trial; no change of one follows.
            let _no_edit = inspect.apply(action, &[], view, notices);
        }
        library.gather(notices);
        studies.gather(notices);
        recognition.gather(&mut Recognisers { simulation, gripper, tools, inspect }, view, notices);
        files.gather(ctx, simulation, notices);
        thumbnails.gather(ctx, &view.recent);
        let labels = labelling.worker().view();
        if labels.as_ref().map(Arc::as_ptr) != self.labels_seen.as_ref().map(Arc::as_ptr) {
            if let Some(labels) = &labels {
                inspect.labels_changed(labels);
            }
            self.labels_seen = labels;
        }
        let grasp = simulation.worker().snapshot().map_or(0, |snapshot| snapshot.grasp);
        inspect.gather(grasp, view, notices);
        let published = self.published();
        let context = self.context(&published);
        let shown = context.shown();
        let (names, phases) = (shown.column_names(), shown.find_phases());
        let span = shown.traces.current().map_or([0.0; 2], GraspTrace::span);
        self.inspect.move_cursor(ctx, self.view.source, span);
        self.inspect.compare(names, &phases);
        self.phases = phases;
    }

    fn apply(&mut self, ctx: &egui::Context, action: Action) {
        if let Action::View(ViewAction::ShowPanel(name)) = action {
            self.show_panel(name);
            return ctx.request_repaint();
        }
        match &action {
            Action::Library(LibraryAction::FocusSearch(_)) => self.show_panel("library"),
            Action::Labelling(LabellingAction::FocusSearch(_)) => self.show_panel("label"),
            _ => {}
        }
        if let Action::File(action) = &action
            && let Some(request) = self.export_request(ctx, action)
        {
            match request {
                Ok(request) => self.files.export(request),
                Err(cause) => self.notices.warning(cause),
            }
            return ctx.request_repaint();
        }
        let times = match &action {
            Action::Inspect(_) => self.traces().current().map(|trace| trace.t.clone()).unwrap_or_default(),
            _ => Vec::new(),
        };
        let Self { view, notices, simulation, gripper, labelling, library, .. } = self;
        let Self { recognition, inspect, tools, studies, files, presenter, .. } = self;
        match action {
            Action::Simulation(action) => simulation.apply(action, view, notices),
            Action::Gripper(action) => gripper.apply(action, view, notices),
            Action::Labelling(action) => labelling.apply(action, gripper, view, notices),
            Action::Library(action) => {
                for action in library.apply(action) {
                    inspect.apply(action, &times, view, notices);
                }
            }
            // Presenter mode has a sequence of its own.
            Action::Recognition(RecognitionAction::NextObject) if view.presents => {
                presenter.bring_next(simulation, notices);
            }
            Action::Recognition(action) => {
                recognition.apply(action, &mut Recognisers { simulation, gripper, tools, inspect }, view, notices);
            }
            Action::Tool(action) => tools.apply(action, notices),
            Action::Study(action) => {
                for action in studies.apply(action, notices) {
                    inspect.apply(action, &times, view, notices);
                }
            }
            Action::Inspect(action) => {
                // Looking back pauses the simulation.
                if matches!(action, InspectAction::Seek(_)) && view.source == ViewSource::Simulation {
                    simulation.send(Command::Pause, notices);
                }
                if let Some((id, edit)) = inspect.apply(action, &times, view, notices) {
                    library.edit(id, edit);
                }
            }
            Action::View(action) => {
                if let ViewAction::SetSensors(sensors) = &action {
                    simulation.send(Command::SetSensors(sensors.clone()), notices);
                }
                if let ViewAction::SetMode(mode) = action {
                    labelling.refresh();
                    inspect.enter_mode(mode, view);
                }
                view.apply(ctx, action, simulation.worker().snapshot().as_deref());
            }
            Action::File(action) => files.apply(action, simulation),
            Action::Stop => {
                (view.keys_shown, view.palette_shown) = (false, false);
                if view.presents {
                    view.apply(ctx, ViewAction::Present(false), None);
                }
                gripper.stop();
            }
            Action::Tell(message) => notices.tell(message),
        }
        ctx.request_repaint();
    }
}

/// Action that carries out a remedy.
fn action_of(remedy: Remedy) -> Action {
    match remedy {
        Remedy::UseHull => SimulationAction::UseHull.into(),
        Remedy::TreatAsMillimetres => SimulationAction::SetScale(1e-3).into(),
        Remedy::TreatAsMetres => SimulationAction::SetScale(1.0).into(),
        Remedy::LocateFile => FileAction::Open.into(),
        Remedy::Calibrate => ViewAction::ShowPanel("calibration").into(),
        Remedy::UndoLabel => LabelCommand::Undo.into(),
    }
}
