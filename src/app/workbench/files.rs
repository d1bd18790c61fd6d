//! Files: what is opened, dropped and saved, and the picture of the 3-D view.

use super::{Workbench, ghost_of};
use crate::app::actions::{Answer, Message};
use crate::app::files::{Ask, ask};
use glam::Vec2;
use palpate_sim::objects::anchored;
use palpate_lab::picture::PictureView;
use palpate_sim::scene::Scene;
use palpate_lab::workers::{GhostGrasp, Snapshot};
use palpate_render::{DriverChoice, Gpu, Picture, Renderer};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Pixels per point of saved pictures.
const PICTURE_SCALE: f32 = 2.0;

impl Workbench {
    pub(super) fn ask(&mut self, what: Ask) {
        let wake = Arc::clone(&self.wake);
        ask(what, &self.answers.0, move || wake());
    }

    pub(super) fn take_answer(&mut self, ctx: &egui::Context, answer: Answer) {
        match answer {
            Answer::Open(path) => self.open(&path.to_string_lossy()),
            Answer::SaveScene(path, scene) => self.save_scene(&path, &scene),
            Answer::SavePicture(path) => self.save_picture(path),
            Answer::Tell(message) => self.tell(message),
        }
        ctx.request_repaint();
    }

    /// Grasps a built-in object, a file, or the scene in a scene file.
    pub(super) fn open(&mut self, source: &str) {
        if source.to_ascii_lowercase().ends_with(".toml") {
            match Scene::from_file(Path::new(source)) {
                Ok(scene) => self.set_scene(scene),
                Err(error) => self.tell(Message::Error(error.to_string())),
            }
            return;
        }
        let mut scene = self.scene.clone();
        scene.object.source = anchored(source);
        // Mass and size belong to the object that was there before.
        let fresh = Scene::default().object;
        scene.object.mass = fresh.mass;
        scene.object.friction = fresh.friction;
        scene.object.scale = fresh.scale;
        scene.object.rotation_deg = fresh.rotation_deg;
        self.set_scene(scene);
    }

    pub(super) fn save_scene(&mut self, path: &Path, scene: &Scene) {
        match std::fs::write(path, scene.to_toml()) {
            Ok(()) => self.tell(Message::Info(format!("scene saved as {}", path.display()))),
            Err(error) => self.tell(Message::Error(format!("cannot write {}: {error}", path.display()))),
        }
    }

    /// Draws the view once more, off-screen and twice as fine, in a thread of its own.
    pub(super) fn save_picture(&mut self, path: PathBuf) {
        let Some(snapshot) = self.worker.snapshot() else { return };
        let size = Vec2::new(800.0, 560.0);
        let view = PictureView {
            camera: self.view.camera,
            theme: self.view.theme,
            forces: self.view.forces,
            size,
            badge: Some("SIMULATED".to_owned()),
            ..PictureView::default()
        };
        let (answers, wake, ghost) = (self.answers.0.clone(), Arc::clone(&self.wake), self.ghost());
        let draw = move || {
            let drawn = draw_picture(&snapshot, ghost.as_deref(), &view, &path);
            let message = match drawn {
                Ok(()) => Message::Info(format!("picture saved as {}", path.display())),
                Err(text) => Message::Error(text),
            };
            let _heard = answers.send(Answer::Tell(message));
            wake();
        };
        if let Err(error) = std::thread::Builder::new().name("picture".to_owned()).spawn(draw) {
            self.tell(Message::Error(format!("the picture could not be drawn: {error}")));
        }
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
    if let Some(frame) = ghost_of(Some(snapshot), ghost) {
        list.ghosts = snapshot.stage.ghosts(frame, view.theme);
    }
    let picture = Picture::draw(&gpu, &mut renderer, &list, pixels, PICTURE_SCALE).map_err(|e| e.to_string())?;
    picture.save(path).map_err(|e| e.to_string())
}

/// While a file hovers over the window: what will happen when it is dropped.
pub(super) fn drop_hint(ctx: &egui::Context) {
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
