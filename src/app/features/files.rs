//! Files: opening, dropping and saving, and pictures of the 3-D view.

use crate::app::features::simulation::{SimulationFeature, ghost_frame};
use crate::app::features::view::ViewState;
use crate::app::files::{Answer, Question, ask};
use crate::app::notices::{Notices, UserMessage};
use glam::Vec2;
use palpate_lab::picture::PictureView;
use palpate_lab::workers::{GhostGrasp, Snapshot, Wake};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer};
use palpate_sim::scene::Scene;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Pixels per point of saved pictures.
const PICTURE_SCALE: f32 = 2.0;

/// Action on files. Each opens a file dialog.
#[derive(Clone, Debug)]
pub enum FileAction {
    /// Open an object or a scene.
    Open,
    /// Save the scene.
    SaveScene,
    /// Save another scene.
    SaveSceneAs(Box<Scene>),
    /// Save a picture of the 3-D view.
    SavePicture,
}

/// State of files in the window.
pub(in crate::app) struct FileFeature {
    answers: (Sender<Answer>, Receiver<Answer>),
    wake: Wake,
    /// File dialogs of the system are tried first.
    system_dialogs: bool,
    /// File to ask for inside the window.
    inside: Option<Question>,
    /// Folder of the file chosen last.
    folder: Option<PathBuf>,
}

impl FileFeature {
    pub(in crate::app) fn new(wake: Wake, system_dialogs: bool) -> Self {
        Self { answers: channel(), wake, system_dialogs, inside: None, folder: None }
    }

    /// File that is to be asked for inside the window now.
    pub(in crate::app) fn take_question(&mut self) -> Option<Question> {
        self.inside.take()
    }

    /// Folder that a dialog begins in: that of the file chosen last, or the working folder.
    pub(in crate::app) fn folder(&self) -> PathBuf {
        let home = || std::env::current_dir().ok().or_else(std::env::home_dir);
        self.folder.clone().filter(|folder| folder.is_dir()).or_else(home).unwrap_or_default()
    }

    /// Takes in the answer of a dialog inside the window.
    pub(in crate::app) fn answer(&self, answer: Answer) {
        // The channel is our own.
        let _sent = self.answers.0.send(answer);
    }

    pub(in crate::app) fn apply(&mut self, action: FileAction, simulation: &SimulationFeature) {
        let question = match action {
            FileAction::Open => Question::Object,
            FileAction::SaveScene => Question::SaveScene(Box::new(simulation.scene().clone())),
            FileAction::SaveSceneAs(scene) => Question::SaveScene(scene),
            FileAction::SavePicture => Question::SavePicture,
        };
        if !self.system_dialogs {
            self.inside = Some(question);
            return;
        }
        let wake = Arc::clone(&self.wake);
        ask(question, &self.answers.0, move || wake());
    }

    /// Takes in answers of dialogs and dropped files since the last frame.
    pub(in crate::app) fn gather(
        &mut self,
        ctx: &egui::Context,
        simulation: &mut SimulationFeature,
        view: &ViewState,
        notices: &mut Notices,
    ) {
        for answer in self.answers.1.try_iter().collect::<Vec<_>>() {
            if let Answer::Open(path) | Answer::SaveScene(path, _) | Answer::SavePicture(path) = &answer {
                self.folder = path.parent().map(Path::to_owned);
            }
            match answer {
                Answer::Open(path) => simulation.open(&path.to_string_lossy(), notices),
                Answer::SaveScene(path, scene) => save_scene(&path, &scene, notices),
                Answer::SavePicture(path) => self.save_picture(path, simulation, view, notices),
                Answer::AskInside(question) => {
                    self.system_dialogs = false;
                    self.inside = Some(question);
                }
                Answer::Tell(message) => notices.tell(message),
            }
            ctx.request_repaint();
        }
        for file in ctx.input(|i| i.raw.dropped_files.clone()) {
            simulation.open(&file.path().to_string_lossy(), notices);
        }
    }

    /// Draws the view once more, off-screen and at twice the resolution, in a thread of its own.
    fn save_picture(&self, path: PathBuf, simulation: &SimulationFeature, view: &ViewState, notices: &mut Notices) {
        let Some(snapshot) = simulation.worker().snapshot() else { return };
        let picture = PictureView {
            camera: view.camera,
            theme: view.theme,
            forces: view.forces,
            size: Vec2::new(800.0, 560.0),
            badge: Some("SIMULATED".to_owned()),
            ..PictureView::default()
        };
        let (answers, wake, ghost) = (self.answers.0.clone(), Arc::clone(&self.wake), simulation.ghost(view));
        let draw = move || {
            let drawn = draw_picture(&snapshot, ghost.as_deref(), &picture, &path);
            let message = match drawn {
                Ok(()) => UserMessage::Info(format!("Picture saved as {}.", path.display())),
                Err(text) => UserMessage::Error(text),
            };
            // The window may have been closed meanwhile.
            let _heard = answers.send(Answer::Tell(message));
            wake();
        };
        if let Err(error) = std::thread::Builder::new().name("picture".to_owned()).spawn(draw) {
            notices.error(format!("Cannot draw the picture: {error}"));
        }
    }
}

fn save_scene(path: &Path, scene: &Scene, notices: &mut Notices) {
    match std::fs::write(path, scene.to_toml()) {
        Ok(()) => notices.info(format!("Scene saved as {}.", path.display())),
        Err(error) => notices.error(format!("Cannot write {}: {error}", path.display())),
    }
}

fn draw_picture(
    snapshot: &Snapshot,
    ghost: Option<&GhostGrasp>,
    view: &PictureView,
    path: &Path,
) -> Result<(), String> {
    let gpu = Gpu::headless(DriverChoice::Any).map_err(|e| e.to_string())?;
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue);
    let pixels = [view.size.x, view.size.y].map(|side| (side * PICTURE_SCALE) as u32);
    let mut list = snapshot.stage.draw(&snapshot.frame, view);
    if let Some(frame) = ghost_frame(Some(snapshot), ghost) {
        list.ghosts = snapshot.stage.ghosts(frame, view.theme);
    }
    let picture = Picture::draw(&gpu, &mut renderer, &list, pixels, PICTURE_SCALE).map_err(|e| e.to_string())?;
    picture.save(path).map_err(|e| e.to_string())
}

/// Hint over the window while a file is dragged over it.
pub(in crate::app) fn drop_hint(ctx: &egui::Context) {
    if ctx.input(|i| i.raw.hovered_files.is_empty()) {
        return;
    }
    let rect = ctx.content_rect();
    let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop hint"));
    let painter = ctx.layer_painter(layer);
    painter.rect_filled(rect, 0.0, egui::Color32::from_black_alpha(150));
    let font = egui::FontId::proportional(22.0);
    let text = "Drop a URDF, OBJ, STL or scene file to grasp it";
    painter.text(rect.center(), egui::Align2::CENTER_CENTER, text, font, egui::Color32::WHITE);
}
