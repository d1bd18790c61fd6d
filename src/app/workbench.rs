//! Contents of the window: it starts the features, lets panels draw, and hands their actions to the features.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::files::{FileFeature, drop_hint};
use crate::app::features::gripper::{GRASPS, GripperFeature};
use crate::app::features::inspect::InspectFeature;
use crate::app::features::labelling::LabellingFeature;
use crate::app::features::library::LibraryFeature;
use crate::app::features::notices::Notices;
use crate::app::features::presenter::PresenterFeature;
use crate::app::features::recognition::RecognitionFeature;
use crate::app::features::simulation::SimulationFeature;
use crate::app::features::studies::Studies;
use crate::app::features::tools::{GripperTools, GripperToolsSetup};
use crate::app::features::view::{Mode, ViewSource, ViewState};
use crate::app::frame_rate::FrameRate;
use crate::app::import_dialog::{Asked, ImportDialog};
use crate::app::panels::PanelKind;
use crate::app::path_dialog::{Closed, PathDialog};
use crate::app::shown::Inspected;
use crate::app::startup::ThreadError;
use crate::app::theme::{self, colour};
use crate::app::thumbnails::Thumbnails;
use crate::app::tiling::{self, Tiling, panel_frame};
use crate::app::viewport::Viewport;
use crate::app::{bars, keys, manual, modes, palette, presenter};
use egui::{CentralPanel, Frame, Margin, Panel, Ui};
use egui_tiles::Tile;
use palpate_geometry::palette::Theme;
use palpate_lab::datasets::models_folder;
use palpate_lab::gripper::{Listen, listen_to_port};
use palpate_lab::workers::{
    Explainer, GripperSetup, GripperView, GripperWorker, LabelWorker, LibraryWorker, MeasuredAccuracy, SimWorker,
    SimWorkerSetup, Snapshot, Wake, examine_port, open_trial_job,
};
use palpate_learn::{ModelError, Models, Shipped};
use palpate_render::{describe_adapter, draws_in_software};
use palpate_sim::scene::Scene;
use palpate_store::TrialPlace;
use palpate_study::jobs::{Explain, effects_job, explain_scene, fit_trials};
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

/// Contents of the window: all features, and how they are drawn.
pub struct Workbench {
    app: App,
    path_dialog: Option<PathDialog>,
    import_dialog: Option<ImportDialog>,
    cleared: bool,
    /// Title of the window.
    title: String,
}

/// Width of the ring around the widget that has the keyboard (points).
const RING: f32 = 2.0;

/// Closes an open list when what is under it scrolls: it would stay over other rows.
fn leave_list(ctx: &egui::Context) {
    let scrolls = ctx.input(|i| i.events.iter().any(|event| matches!(event, egui::Event::MouseWheel { .. })));
    let layer = ctx.input(|i| i.pointer.hover_pos()).and_then(|place| ctx.layer_id_at(place));
    if scrolls && layer.is_none_or(|layer| layer.order < egui::Order::Foreground) {
        egui::Popup::close_all(ctx);
    }
}

/// Rings the widget that has the keyboard, whatever it is.
fn focus_ring(ctx: &egui::Context, theme: Theme) {
    let Some(focused) = ctx.memory(|memory| memory.focused()).and_then(|id| ctx.read_response(id)) else { return };
    if focused.interact_rect.is_positive() {
        let stroke = egui::Stroke::new(RING, colour(theme.colours().accent));
        let ring = focused.interact_rect.expand(0.5);
        ctx.layer_painter(focused.layer_id).rect_stroke(ring, 4.0, stroke, egui::StrokeKind::Inside);
    }
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
        let labelling = LabellingFeature::new(labels);
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
        theme::install_fonts(ctx);
        theme::apply(ctx, view.theme);
        // Keys for the scale are ours, so that it is remembered.
        ctx.options_mut(|options| options.zoom_with_keyboard = false);
        let explainer = Explainer::new(store.clone(), &wake);
        let recognition = RecognitionFeature::new(models, explainer, &tools, &mut view);
        let ghost = view.ghost;
        let mut app = App {
            ctx: ctx.clone(),
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
            files: FileFeature::new(Arc::clone(&wake)),
            thumbnails: Thumbnails::new(ctx, wake),
            driver: adapter.as_ref().map(describe_adapter),
            frame_rate: FrameRate::new(adapter.as_ref().is_some_and(draws_in_software)),
            store,
            wanted_panel: None,
        };
        app.set_scale(app.view.scale);
        if ghost {
            app.set_ghost(true);
        }
        if let Some(cause) = without {
            app.notices.error(format!("Recognition is off: {cause}"));
        }
        Ok(Self { app, path_dialog: None, import_dialog: None, cleared: setup.cleared, title: String::new() })
    }

    /// View state.
    pub fn view(&self) -> &ViewState {
        &self.app.view
    }

    /// The same, to be remembered: the sensors of a study's row are not.
    pub(in crate::app) fn kept_view(&self) -> ViewState {
        let view = self.app.view.clone();
        let sensors = self.app.studies.sensors_before().unwrap_or(&view.sensors).clone();
        ViewState { sensors, ..view }
    }

    /// Newest state of the simulation.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.app.simulation.worker.snapshot()
    }

    /// The stored trial that is open, the time shown, and trials compared with it.
    pub fn inspected(&self) -> Option<Inspected<'_>> {
        self.app.inspect.inspected()
    }

    /// Cost and error of the last scene measured.
    pub fn accuracy(&self) -> Option<Arc<MeasuredAccuracy>> {
        self.app.simulation.worker.accuracy()
    }

    /// Last messages to the user, oldest first.
    pub fn messages(&self) -> &VecDeque<String> {
        self.app.notices.messages()
    }

    /// Does something with the features.
    pub fn act(&mut self, action: impl FnOnce(&mut App)) {
        action(&mut self.app);
        if let Some(panel) = self.app.wanted_panel.take() {
            self.show_panel(panel);
        }
        self.app.ctx.request_repaint();
    }

    fn run(&mut self, actions: Actions) {
        actions.into_iter().for_each(|action| self.act(action));
    }

    /// Draws the window.
    pub fn ui(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.app.poll();
        let moves = self.app.moves();
        self.app.frame_rate.count(Instant::now(), moves);
        if !self.cleared {
            ui.painter().rect_filled(ui.max_rect(), 0.0, colour(self.app.view.theme.colours().background));
        }
        if self.app.view.presents {
            return self.present(ui);
        }
        if let Some(remedy) = self.app.notices.line(ui, self.app.view.theme) {
            self.act(remedy);
        }
        let mut actions = Actions::default();
        // The layout changes while it is drawn, so it is taken out for that time.
        let mode = self.app.view.mode;
        let mut layout = self.app.view.layouts.remove(&mode).unwrap_or_else(|| modes::default_layout(mode));
        let app = &self.app;
        keys::pressed(app, &mut actions);
        leave_list(&ctx);
        let colours = app.view.theme.colours();
        let bar = Frame::new().fill(colour(colours.raised)).inner_margin(Margin::symmetric(12, 6));
        Panel::top("top").exact_size(40.0).frame(bar).show(ui, |ui| bars::top(ui, app, &mut actions));
        // Studies have no time to move through.
        if mode != Mode::Study {
            Panel::bottom("bottom").exact_size(44.0).frame(bar).show(ui, |ui| bars::bottom(ui, app, &mut actions));
        }
        CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
            let mut tiling = Tiling { app, actions: &mut actions, chosen: None };
            let wide = tiling::fit_sides(&mut layout, ui.available_width());
            layout.ui(&mut tiling, ui);
            wide.into_iter().for_each(|shares| shares.restore(&mut layout));
            if let Some(chosen) = tiling.chosen {
                layout.make_active(|id, _| id == chosen);
            }
        });
        keys::sheet(app, mode, &mut actions);
        manual::ui(app, &mut actions);
        palette::ui(app, &mut actions);
        drop_hint(&ctx);
        focus_ring(&ctx, app.view.theme);
        self.title(&ctx);
        self.app.view.layouts.insert(mode, layout);
        self.run(actions);
        self.ask_for_file();
        self.import_trials();
    }

    /// Names the object or the trial in the title of the window.
    fn title(&mut self, ctx: &egui::Context) {
        let shown = self.app.shown();
        let subject = match shown.source {
            ViewSource::Trial => shown.inspected.map(|own| format!("{}, trial {}", own.trial.title, own.trial.id)),
            ViewSource::Gripper => {
                let emulated = shown.gripper.is_some_and(GripperView::is_emulated);
                Some(if emulated { "Emulated gripper" } else { "Real gripper" }.to_owned())
            }
            ViewSource::Simulation if !shown.view.truth_shown => None,
            ViewSource::Simulation => shown.snapshot.map(|snapshot| {
                snapshot.object.as_ref().map_or("Empty hand".to_owned(), |object| object.title.clone())
            }),
        };
        let title = subject.map_or_else(|| "Palpate".to_owned(), |subject| format!("{subject} - Palpate"));
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    /// Draws presenter mode.
    fn present(&mut self, ui: &Ui) {
        let message = self.app.notices.current(ui.ctx()).map(str::to_owned);
        let mut actions = Actions::default();
        keys::pressed(&self.app, &mut actions);
        presenter::ui(ui, &self.app, message.as_deref());
        self.run(actions);
    }

    /// Draws one panel alone, as large as there is room.
    pub fn panel_ui(&mut self, ui: &mut Ui, panel: &PanelKind) {
        self.app.poll();
        let mut actions = Actions::default();
        let ground = colour(self.app.view.theme.colours().background);
        panel_frame(panel).fill(ground).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            (panel.ui)(ui, &self.app, &mut actions);
        });
        self.run(actions);
    }

    /// Draws the file dialog, while there is one.
    fn ask_for_file(&mut self) {
        if let Some(question) = self.app.files.question.take() {
            self.path_dialog = Some(PathDialog::new(question, &self.app.files.folder()));
        }
        let closed = self.path_dialog.as_mut().and_then(|dialog| dialog.ui(&self.app.ctx));
        if let Some(closed) = closed {
            let question = self.path_dialog.take().map(|dialog| dialog.question);
            if let (Closed::Answered(path), Some(question)) = (closed, question) {
                self.app.answer(question, path);
            }
            self.app.ctx.request_repaint();
        }
    }

    /// Draws the import dialog, while there is one.
    fn import_trials(&mut self) {
        if let Some((path, wake)) = self.app.files.import.take() {
            self.import_dialog = Some(ImportDialog::new(path, self.app.store.clone(), wake));
        }
        // A file dialog that it asked for stands in its place.
        let Some(dialog) = self.import_dialog.as_mut().filter(|_| self.path_dialog.is_none()) else { return };
        if let Some(path) = self.app.files.profile.take() {
            dialog.open_profile(&path);
        }
        if let Some(asked) = dialog.ui(&self.app.ctx) {
            match asked {
                Asked::OpenProfile => self.app.open_profile(),
                Asked::SaveProfile(mapping) => self.app.save_profile(&mapping),
                Asked::Cancel => self.import_dialog = None,
                Asked::Imported(said) => {
                    self.import_dialog = None;
                    self.app.notices.info(said);
                }
            }
            self.app.ctx.request_repaint();
        }
    }

    /// Brings a panel to the front; opens a mode that has it where the present one has not.
    fn show_panel(&mut self, name: &str) {
        let view = &mut self.app.view;
        let others = modes::ALL.iter().map(|kind| kind.mode).filter(|mode| *mode != view.mode);
        for mode in std::iter::once(view.mode).chain(others).collect::<Vec<_>>() {
            let layout = view.layouts.entry(mode).or_insert_with(|| modes::default_layout(mode));
            if layout.make_active(|_, tile| matches!(tile, Tile::Pane(pane) if pane == name)) {
                view.mode = mode;
                return;
            }
        }
    }
}
