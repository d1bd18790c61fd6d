//! Files: opening, dropping and saving, and pictures of the 3-D view.

use crate::app::export::{ExportRequest, export_job};
use crate::app::features::simulation::SimulationFeature;
use crate::app::files::{Answer, Question};
use crate::app::notices::Notices;
use palpate_lab::inspection::FigureOptions;
use palpate_lab::workers::{Job, Wake};
use palpate_sim::scene::Scene;
use palpate_store::{FileKind, write_whole};
use std::path::{Path, PathBuf};

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
    /// Export a figure of the trial that is open and of those compared with it.
    ExportFigure(FigureOptions),
    /// Export the figure of a study that is shown.
    ExportStudyFigure,
    /// Export the trials selected in the library into one file.
    ExportTrials,
}

/// State of files in the window.
pub(in crate::app) struct FileFeature {
    /// File to ask for.
    question: Option<Question>,
    answer: Option<Answer>,
    /// Folder of the file chosen last.
    folder: Option<PathBuf>,
    exports: Job<(PathBuf, ExportRequest), ()>,
}

impl FileFeature {
    pub(in crate::app) fn new(wake: Wake) -> Self {
        Self { question: None, answer: None, folder: None, exports: export_job(wake) }
    }

    /// File that is to be asked for now.
    pub(in crate::app) fn take_question(&mut self) -> Option<Question> {
        self.question.take()
    }

    /// Folder that a dialog begins in: that of the file chosen last, or the working folder.
    pub(in crate::app) fn folder(&self) -> PathBuf {
        let home = || std::env::current_dir().ok().or_else(std::env::home_dir);
        self.folder.clone().filter(|folder| folder.is_dir()).or_else(home).unwrap_or_default()
    }

    /// Takes in the answer of the dialog.
    pub(in crate::app) fn answer(&mut self, answer: Answer) {
        self.answer = Some(answer);
    }

    pub(in crate::app) fn apply(&mut self, action: FileAction, simulation: &SimulationFeature) {
        self.question = Some(match action {
            FileAction::Open => Question::Object,
            FileAction::SaveScene => Question::SaveScene(Box::new(simulation.scene().clone())),
            FileAction::SaveSceneAs(scene) => Question::SaveScene(scene),
            // Needs what the window shows: see `export`.
            FileAction::SavePicture
            | FileAction::ExportFigure(_)
            | FileAction::ExportStudyFigure
            | FileAction::ExportTrials => return,
        });
    }

    /// Asks where to write this.
    pub(in crate::app) fn export(&mut self, request: ExportRequest) {
        self.question = Some(Question::Export(Box::new(request)));
    }

    /// Takes in the answer of the dialog and dropped files since the last frame.
    pub(in crate::app) fn gather(
        &mut self,
        ctx: &egui::Context,
        simulation: &mut SimulationFeature,
        notices: &mut Notices,
    ) {
        if let Some(answer) = self.answer.take() {
            let (Answer::Open(path) | Answer::SaveScene(path, _) | Answer::Export(path, _)) = &answer;
            self.folder = path.parent().map(Path::to_owned);
            match answer {
                Answer::Open(path) => simulation.open(&path.to_string_lossy(), notices),
                Answer::SaveScene(path, scene) => save_scene(&path, &scene, notices),
                Answer::Export(path, request) => _ = self.exports.start((path, *request)),
            }
            ctx.request_repaint();
        }
        for ended in self.exports.take() {
            match ended.outcome {
                Ok(_written) => notices.info(format!("Saved as {}.", ended.command.0.display())),
                Err(cause) => notices.error(cause.to_string()),
            }
        }
        for file in ctx.input(|i| i.raw.dropped_files.clone()) {
            simulation.open(&file.path().to_string_lossy(), notices);
        }
    }
}

fn save_scene(path: &Path, scene: &Scene, notices: &mut Notices) {
    match write_whole(path, FileKind::Scene, scene.to_toml().as_bytes()) {
        Ok(()) => notices.info(format!("Scene saved as {}.", path.display())),
        Err(error) => notices.error(format!("Cannot write {}: {error}", path.display())),
    }
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
