//! The whole window's contents: it owns the simulation's handle, the view state and the traces, lets panels draw, and
//! applies what they ask for.

mod files;
mod real;

use super::actions::{Action, Answer, Message};
use super::files::Ask;
use super::gripper_tools::{GripperTools, GripperToolsSetup, ToolWish};
use super::panels::{PanelContext, PanelKind, Source};
use super::theme::{self, colour};
use super::tiling::{Tiling, panel_frame};
use super::traces::Traces;
use super::view_state::ViewState;
use super::viewport::Viewport;
use super::{bars, keys};
use egui::{CentralPanel, Frame, Margin, Panel, Ui};
use egui_notify::Toasts;
use palpate_geometry::drawing::Camera;
use palpate_lab::grasping::{GraspStage, ObjectDeck};
use palpate_lab::gripper::Listen;
use palpate_lab::workers::{
    Command, EffectsWorker, Explain, GhostGrasp, GripperSetup, GripperView, GripperWish, GripperWorker, LabelView,
    LabelWish, Labeller, MeasuredAccuracy, NotSent, Notice, Refusal, SimWorker, SimWorkerSetup, Snapshot, TrainWish,
    TrainedModel, Wake, start_labeller,
};
use palpate_learn::Model;
use palpate_render::{Picture, describe_adapter};
use palpate_sim::frame::Frame as TrialFrame;
use palpate_sim::objects::{EMPTY, catalogue, thumbnail};
use palpate_sim::scene::Scene;
use palpate_tactile::SensorLayout;
use palpate_tactile::trial::TrialId;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// What a workbench starts from.
pub struct WorkbenchSetup<'a> {
    /// The first scene.
    pub scene: Scene,
    /// Where trials are stored.
    pub store: PathBuf,
    /// How the user looked at things last time.
    pub view: ViewState,
    /// Recognises what is in the hand; or why it cannot be had, which is told, and everything else works.
    pub model: Result<Arc<Model>, String>,
    /// Measures what effects cost and change.
    pub explain: Explain,
    /// Listens to the board of a real gripper.
    pub listen: Listen,
    /// What doctor, fit and training start from.
    pub tools: GripperToolsSetup,
    /// Whether the first grasp runs by itself.
    pub playing: bool,
    /// Asks for the window to be drawn again; called from other threads.
    pub wake: Wake,
    /// Where the 3-D view is drawn; without it the rest works.
    pub render_state: Option<&'a egui_wgpu::RenderState>,
}

/// Sensor layout of the live traces: the paper's simplest, with force.
const LIVE_LAYOUT: &str = "C1+F";
/// Grasps that are made before it stops, unless it is sure earlier: the paper's plateau is at three to four.
const GRASPS: u32 = 4;
/// Names the sequence of objects that come when any other may.
const DECK_SEED: u64 = 1;

/// Everything in the window.
pub struct Workbench {
    worker: SimWorker,
    effects: EffectsWorker,
    tools: GripperTools,
    /// The model that comes with the program.
    shipped: Option<Arc<Model>>,
    gripper: GripperWorker,
    labeller: Labeller,
    store: PathBuf,
    /// What came of wishes about labels has been told up to this number.
    labels_told: u64,
    /// The trial of the real gripper that ended last.
    trial_ended: Option<TrialId>,
    /// Traces of the real gripper.
    felt: Traces,
    /// The part of the trial that was seen last: the simulation closes its fingers with the real ones.
    trial_part: Option<GraspStage>,
    /// The wish by which the last trial was begun.
    begun_by: u64,
    connected: bool,
    /// Whether the simulation stored its trials, and how many grasps it made, before it became the gripper's twin.
    before_twin: Option<(bool, u32)>,
    wake: Wake,
    scene: Scene,
    /// A scene that the busy worker has not taken yet.
    unsent: bool,
    view: ViewState,
    traces: Traces,
    toasts: Toasts,
    thumbnails: BTreeMap<String, egui::TextureHandle>,
    driver: Option<String>,
    answers: (Sender<Answer>, Receiver<Answer>),
    /// What the user was told last, oldest first.
    messages: VecDeque<String>,
    /// The camera as it was last framed; while the user leaves it there, it follows the objects.
    framed: Option<Camera>,
    /// The object last seen in the hand: a built-in name or a file.
    seen: Option<String>,
    /// What comes next when anything may.
    deck: ObjectDeck,
}

/// The newest of what other threads have published.
struct Shown {
    snapshot: Option<Arc<Snapshot>>,
    accuracy: Option<Arc<MeasuredAccuracy>>,
    ghost: Option<Arc<GhostGrasp>>,
    gripper: Option<Arc<GripperView>>,
    labels: Option<Arc<LabelView>>,
}

/// Letters in a line of a notice.
const TOAST_WIDTH: usize = 64;

/// Breaks a text into lines of at most so many letters, between words.
fn textwrap(text: &str, width: usize) -> String {
    let mut folded = String::new();
    let mut column = 0;
    for word in text.split(' ') {
        let letters = word.chars().count();
        if column > 0 && column + 1 + letters > width {
            folded.push('\n');
            column = 0;
        } else if column > 0 {
            folded.push(' ');
            column += 1;
        }
        folded.push_str(word);
        column += letters;
    }
    folded
}

/// Messages that are kept.
const MOST_MESSAGES: usize = 50;

impl Workbench {
    /// Starts the simulation and prepares the graphics.
    pub fn new(ctx: &egui::Context, setup: WorkbenchSetup<'_>) -> Result<Self, String> {
        let layout = SensorLayout::named(LIVE_LAYOUT).map_err(|e| e.to_string())?;
        let worker = SimWorker::start(SimWorkerSetup {
            scene: setup.scene.clone(),
            layout,
            store: setup.store.clone(),
            recording: true,
            grasps: GRASPS,
            model: setup.model.as_ref().ok().cloned(),
            playing: setup.playing,
            wake: Arc::clone(&setup.wake),
        })
        .map_err(|e| format!("the simulation could not be started: {e}"))?;
        let effects = EffectsWorker::start(setup.explain, Arc::clone(&setup.wake))
            .map_err(|e| format!("the measurement of effects could not be started: {e}"))?;
        let gripper = GripperWorker::start(GripperSetup {
            scene: setup.scene.clone(),
            store: setup.store.clone(),
            model: setup.model.as_ref().ok().cloned(),
            grasps: GRASPS,
            listen: setup.listen,
            wake: Arc::clone(&setup.wake),
        })
        .map_err(|e| format!("the gripper's thread could not be started: {e}"))?;
        let tools = GripperToolsSetup { examine: gripper.examine(setup.tools.examine), ..setup.tools };
        let tools = GripperTools::start(tools, &setup.store, &setup.wake)?;
        let labeller = start_labeller(setup.store.clone(), Arc::clone(&setup.wake))
            .map_err(|e| format!("the thread that keeps labels could not be started: {e}"))?;
        let driver = setup.render_state.map(|state| {
            Viewport::install(state);
            describe_adapter(&state.adapter.get_info())
        });
        let mut view = setup.view;
        view.check_layouts();
        theme::apply(ctx, view.theme);
        let mut workbench = Self {
            worker,
            effects,
            tools,
            shipped: setup.model.as_ref().ok().cloned(),
            gripper,
            labeller,
            store: setup.store,
            labels_told: 0,
            trial_ended: None,
            felt: Traces::default(),
            trial_part: None,
            begun_by: 0,
            connected: false,
            before_twin: None,
            wake: setup.wake,
            scene: setup.scene,
            unsent: false,
            view,
            traces: Traces::default(),
            // Not over what is recognised.
            toasts: Toasts::default().with_anchor(egui_notify::Anchor::BottomLeft).with_margin(egui::vec2(12.0, 56.0)),
            thumbnails: load_thumbnails(ctx),
            driver,
            answers: channel(),
            messages: VecDeque::new(),
            framed: None,
            seen: None,
            deck: ObjectDeck::new(DECK_SEED),
        };
        workbench.labeller.ask(LabelWish::Refresh);
        if workbench.view.ghost
            && let Err(cause) = workbench.worker.send(Command::SetGhost(true))
        {
            workbench.tell(Message::Warning(cause.to_string()));
        }
        // It is remembered again once it is loaded.
        if let Some(path) = workbench.view.gripper_model.take() {
            workbench.tools.grant(ToolWish::Train(TrainWish::Load(path)));
        }
        if let Err(cause) = setup.model {
            workbench.tell(Message::Error(format!("nothing will be recognised: {cause}")));
        }
        Ok(workbench)
    }

    /// How the user looks at things, to be remembered.
    pub fn view(&self) -> &ViewState {
        &self.view
    }

    /// The newest state of the simulation.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.worker.snapshot()
    }

    /// What the accuracy of the last scene that was measured costs and leaves.
    pub fn accuracy(&self) -> Option<Arc<MeasuredAccuracy>> {
        self.worker.accuracy()
    }

    /// What the user was told last, oldest first.
    pub fn messages(&self) -> &VecDeque<String> {
        &self.messages
    }

    /// Does what a panel could ask for.
    pub fn act(&mut self, ctx: &egui::Context, action: Action) {
        self.apply(ctx, action);
    }

    /// Draws everything once.
    pub fn ui(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.gather(&ctx);
        let shown = self.shown();
        if let Some(snapshot) = shown.snapshot.as_deref() {
            self.take_note_of_object(snapshot);
        }
        let mut actions = Vec::new();
        // The tree of panels is changed while it is drawn, so it is taken out for that time.
        let mode = self.view.mode;
        let mut layout = self.view.take_layout();
        let context = self.panel_context(&shown);
        actions.extend(keys::pressed(&ctx, &context));
        let colours = self.view.theme.colours();
        let bar = Frame::new().fill(colour(colours.raised)).inner_margin(Margin::symmetric(12, 6));
        Panel::top("top").exact_size(40.0).frame(bar).show(ui, |ui| bars::top(ui, &context, &mut actions));
        Panel::bottom("bottom").exact_size(44.0).frame(bar).show(ui, |ui| bars::bottom(ui, &context, &mut actions));
        let ground = Frame::new().fill(colour(colours.border));
        CentralPanel::default().frame(ground).show(ui, |ui| {
            layout.ui(&mut Tiling { context: &context, actions: &mut actions }, ui);
        });
        keys::sheet(&ctx, self.view.keys_shown, self.view.mode, &mut actions);
        files::drop_hint(&ctx);
        self.view.layouts.insert(mode, layout);
        for action in actions {
            self.apply(&ctx, action);
        }
        self.toasts.show(&ctx);
    }

    /// Draws one panel alone, as large as there is room.
    pub fn panel_ui(&mut self, ui: &mut Ui, panel: &PanelKind) {
        let ctx = ui.ctx().clone();
        self.gather(&ctx);
        let shown = self.shown();
        let mut actions = Vec::new();
        panel_frame(panel, self.view.theme).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            let context = self.panel_context(&shown);
            (panel.ui)(ui, &context, &mut actions);
        });
        for action in actions {
            self.apply(&ctx, action);
        }
    }

    /// The newest of everything, for one frame.
    fn shown(&self) -> Shown {
        Shown {
            snapshot: self.worker.snapshot(),
            accuracy: self.worker.accuracy(),
            ghost: self.ghost(),
            gripper: self.gripper.view(),
            labels: self.labeller.view(),
        }
    }

    /// What the other engine computed last, where it is to be shown.
    fn ghost(&self) -> Option<Arc<GhostGrasp>> {
        self.worker.ghost().filter(|_| self.view.ghost)
    }

    /// A new object is shown whole and, where it came from a file, remembered.
    fn take_note_of_object(&mut self, snapshot: &Snapshot) {
        let source = &snapshot.scene.object.source;
        if self.seen.as_ref() == Some(source) {
            return;
        }
        if self.framed.is_none_or(|camera| camera == self.view.camera) {
            self.frame_all(snapshot);
        }
        if source != EMPTY && !catalogue().iter().any(|b| b.name == *source) {
            self.view.remember_file(source);
        }
        self.seen = Some(source.clone());
    }

    fn panel_context<'a>(&'a self, shown: &'a Shown) -> PanelContext<'a> {
        let source = self.view.source;
        PanelContext {
            snapshot: shown.snapshot.as_deref(),
            accuracy: shown.accuracy.as_deref(),
            scene: &self.scene,
            effects: &self.effects,
            tools: &self.tools,
            gripper: shown.gripper.as_deref(),
            source,
            labels: shown.labels.as_deref(),
            blind: self.is_blind(shown),
            traces: match source {
                Source::Simulation => &self.traces,
                Source::Gripper => &self.felt,
            },
            view: &self.view,
            thumbnails: &self.thumbnails,
            driver: self.driver.as_deref(),
            ghost: ghost_of(shown.snapshot.as_deref(), shown.ghost.as_deref()),
        }
    }

    /// Takes in what other threads and the desktop have brought since the last frame.
    fn gather(&mut self, ctx: &egui::Context) {
        if self.worker.take_rows_lost() {
            self.traces.clear();
        }
        for row in self.worker.rows() {
            self.traces.push(&row);
        }
        self.gather_gripper();
        self.gather_labels();
        self.gather_training();
        let notices: Vec<Notice> = self.worker.notices().chain(self.gripper.notices()).collect();
        for notice in notices {
            match notice {
                Notice::Told(text) => self.tell(Message::Info(text)),
                Notice::Warning(text) => self.tell(Message::Warning(text)),
                Notice::Failed(text) => self.tell(Message::Error(text)),
                Notice::SceneRefused(refusal) => self.take_refusal(*refusal),
                Notice::Stored(id) => self.tell(Message::Info(format!("trial {id} stored"))),
            }
        }
        match self.tools.loaded() {
            Some(Ok(trained)) => self.use_model(&trained),
            Some(Err(cause)) => self.tell(Message::Error(format!("the real gripper keeps its model: {cause}"))),
            None => {}
        }
        let answers: Vec<Answer> = self.answers.1.try_iter().collect();
        for answer in answers {
            self.take_answer(ctx, answer);
        }
        let dropped = ctx.input(|i| i.raw.dropped_files.clone());
        for file in dropped {
            self.open(&file.path().to_string_lossy());
        }
        if self.unsent {
            self.send_scene();
        }
    }

    /// Lets a model listen to the real gripper from now on.
    fn use_model(&mut self, trained: &TrainedModel) {
        self.view.gripper_model = Some(trained.path.clone());
        self.gripper.wish(GripperWish::SetModel(Some(Arc::clone(&trained.model))));
        self.tell(Message::Info(format!("the real gripper is recognised by {}", trained.about)));
    }

    /// The scene before goes on, and list and settings should say so, unless something else has been asked for since.
    fn take_refusal(&mut self, refusal: Refusal) {
        if self.scene == refusal.refused {
            self.scene = refusal.kept;
        }
        self.tell(Message::Error(refusal.cause));
    }

    fn tell(&mut self, message: Message) {
        let (Message::Info(text) | Message::Warning(text) | Message::Error(text)) = &message;
        self.messages.push_back(text.clone());
        if self.messages.len() > MOST_MESSAGES {
            self.messages.pop_front();
        }
        // The notices take a line as long as they are told.
        let folded = |text: String| textwrap(&text, TOAST_WIDTH);
        // Long sentences stay until they have been read.
        let time = |text: &str| Duration::from_secs_f32(2.5 + 0.06 * text.len() as f32);
        match message {
            Message::Info(text) => {
                let duration = time(&text);
                self.toasts.info(folded(text)).duration(Some(duration)).show_progress_bar(false);
            }
            Message::Warning(text) => {
                let duration = time(&text);
                self.toasts.warning(folded(text)).duration(Some(duration)).show_progress_bar(false);
            }
            Message::Error(text) => {
                let duration = time(&text) * 2;
                self.toasts.error(folded(text)).duration(Some(duration)).show_progress_bar(false);
            }
        }
    }

    fn apply(&mut self, ctx: &egui::Context, action: Action) {
        match action {
            Action::Simulation(command) => {
                if let Err(cause) = self.worker.send(command) {
                    self.tell(Message::Warning(cause.to_string()));
                }
            }
            Action::SetScene(scene) => self.set_scene(*scene),
            Action::OpenObject(source) => self.open(&source),
            Action::NextObject if self.view.source == Source::Gripper => {
                self.gripper.wish(GripperWish::AnotherObject);
            }
            Action::NextObject => {
                let next = self.deck.next(&self.scene.object.source);
                self.open(next);
                self.apply(ctx, Action::Simulation(Command::Play));
            }
            Action::PickFile => self.ask(Ask::Object),
            Action::SaveScene => self.ask(Ask::SaveScene(Box::new(self.scene.clone()))),
            Action::SaveSceneAs(scene) => self.ask(Ask::SaveScene(scene)),
            Action::SavePicture => self.ask(Ask::SavePicture),
            Action::MeasureEffects => self.effects.ask(&self.scene),
            Action::Tool(wish) => self.tools.grant(wish),
            Action::UseModel(Some(path)) => self.tools.grant(ToolWish::Train(TrainWish::Load(path))),
            Action::UseModel(None) => {
                self.view.gripper_model = None;
                self.gripper.wish(GripperWish::SetModel(self.shipped.clone()));
            }
            Action::Gripper(wish) => {
                if let GripperWish::Connect(Some(port)) = &wish {
                    self.view.port = Some(port.clone());
                }
                self.gripper.wish(wish);
            }
            Action::Desk(action) => self.at_desk(action),
            Action::ToggleGripper => {
                self.gripper.wish(match self.connected {
                    true => GripperWish::Disconnect,
                    false => GripperWish::Connect(self.view.port.clone()),
                });
            }
            Action::Label(wish) => self.labeller.ask(wish),
            Action::Stop => {
                self.view.keys_shown = false;
                if self.connected {
                    self.gripper.wish(GripperWish::Vent);
                }
            }
            Action::SetControl(control) => self.view.control = control,
            Action::SetThreshold(threshold) => {
                self.gripper.wish(GripperWish::SetThreshold(threshold));
                self.apply(ctx, Action::Simulation(Command::SetThreshold(threshold)));
            }
            Action::SetMode(mode) => {
                self.view.mode = mode;
                self.labeller.ask(LabelWish::Refresh);
            }
            Action::Show(source) => self.view.source = source,
            Action::SetCamera(camera) => self.view.camera = camera,
            Action::FrameAll => {
                if let Some(snapshot) = self.worker.snapshot() {
                    self.frame_all(&snapshot);
                }
            }
            Action::SetTheme(theme) => {
                self.view.theme = theme;
                theme::apply(ctx, theme);
            }
            Action::SetForces(forces) => self.view.forces = forces,
            Action::SetGhost(ghost) => {
                self.view.ghost = ghost;
                self.apply(ctx, Action::Simulation(Command::SetGhost(ghost)));
            }
            Action::SetTimeWindow(window) => self.view.time_window = window,
            Action::ShowTruth(shown) => self.view.truth_shown = shown,
            Action::ShowKeys(shown) => self.view.keys_shown = shown,
            Action::ResetLayout => self.view.layouts.clear(),
            Action::Tell(message) => self.tell(message),
        }
        ctx.request_repaint();
    }

    fn frame_all(&mut self, snapshot: &Snapshot) {
        let (centre, radius) = snapshot.stage.bounds();
        self.view.camera = self.view.camera.framing(centre, radius);
        self.framed = Some(self.view.camera);
    }

    fn set_scene(&mut self, scene: Scene) {
        if let Err(error) = scene.check() {
            return self.tell(Message::Error(error.to_string()));
        }
        self.scene = scene;
        self.effects.give_up();
        self.gripper.wish(GripperWish::SetScene(Box::new(self.scene.clone())));
        self.send_scene();
    }

    fn send_scene(&mut self) {
        self.unsent = self.worker.send(Command::SetScene(Box::new(self.scene.clone()))) == Err(NotSent::Busy);
    }
}

/// The ghost's sample at the time of the snapshot's, if it belongs to the same grasp.
fn ghost_of<'a>(snapshot: Option<&Snapshot>, ghost: Option<&'a GhostGrasp>) -> Option<&'a TrialFrame> {
    let (snapshot, ghost) = (snapshot?, ghost?);
    ghost.at(snapshot.frame.t).filter(|_| ghost.grasp == snapshot.grasp)
}

/// Pictures of the built-in objects, as textures.
fn load_thumbnails(ctx: &egui::Context) -> BTreeMap<String, egui::TextureHandle> {
    let mut textures = BTreeMap::new();
    for built_in in catalogue() {
        if let Some(picture) = thumbnail(&built_in.name).and_then(|bytes| Picture::from_png(bytes).ok()) {
            let size = [picture.width as usize, picture.height as usize];
            let image = egui::ColorImage::from_rgba_unmultiplied(size, &picture.rgba);
            let texture = ctx.load_texture(&built_in.name, image, egui::TextureOptions::LINEAR);
            textures.insert(built_in.name.clone(), texture);
        }
    }
    textures
}
