//! Files: opening, dropping and saving, and pictures of the 3-D view.

use super::App;
use crate::app::export::{ExportRequest, export_job};
use crate::app::files::{Answer, Question};
use crate::app::notices::Notices;
use palpate_geometry::palette::Theme;
use palpate_lab::inspection::{FigureOptions, OpenTrial, comparison_figure};
use palpate_lab::workers::{Job, Wake};
use palpate_sim::scene::Scene;
use palpate_store::{FileKind, write_whole};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// State of files in the window.
pub struct FileFeature {
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

    /// Asks for a file.
    pub(in crate::app) fn ask(&mut self, question: Question) {
        self.question = Some(question);
    }

    /// Asks where to write this.
    pub(in crate::app) fn export(&mut self, request: ExportRequest) {
        self.ask(Question::Export(Box::new(request)));
    }
}

/// Size of exported figures (points).
const FIGURE_SIZE: [u32; 2] = [900, 560];

impl App {
    /// Takes in the answer of the dialog and dropped files since the last frame.
    pub(super) fn poll_files(&mut self) {
        if let Some(answer) = self.files.answer.take() {
            let (Answer::Open(path) | Answer::SaveScene(path, _) | Answer::Export(path, _)) = &answer;
            self.files.folder = path.parent().map(Path::to_owned);
            match answer {
                Answer::Open(path) => self.open(&path.to_string_lossy()),
                Answer::SaveScene(path, scene) => save_scene(&path, &scene, &mut self.notices),
                Answer::Export(path, request) => _ = self.files.exports.start((path, *request)),
            }
            self.ctx.request_repaint();
        }
        for ended in self.files.exports.take() {
            match ended.outcome {
                Ok(_written) => self.notices.info(format!("Saved as {}.", ended.command.0.display())),
                Err(cause) => self.notices.error(cause.to_string()),
            }
        }
        for file in self.ctx.input(|i| i.raw.dropped_files.clone()) {
            self.open(&file.path().to_string_lossy());
        }
    }

    /// Opens an object or a scene.
    pub fn ask_for_object(&mut self) {
        self.files.ask(Question::Object);
    }

    pub(in crate::app) fn save_scene(&mut self) {
        self.files.ask(Question::SaveScene(Box::new(self.simulation.scene.clone())));
    }

    /// Exports a figure of the trial that is open and of those compared with it.
    pub(in crate::app) fn export_figure(&mut self, options: FigureOptions) {
        let Some(own) = self.inspect.inspected() else {
            return self.notices.warning("Figures are made of stored trials: open one in Inspect mode.");
        };
        let others = own.pinned.iter().map(|pinned| &pinned.trial).filter(|trial| trial.id != own.trial.id);
        let trials: Vec<&OpenTrial> = std::iter::once(own.trial).chain(others).map(Arc::as_ref).collect();
        let (align, mean) = (self.inspect.alignment, self.inspect.spread);
        match comparison_figure(&trials, &FigureOptions { align, mean, ..options }) {
            Ok(figure) => self.files.export(ExportRequest::Figure(figure, Theme::Light, FIGURE_SIZE)),
            Err(cause) => self.notices.warning(cause.to_string()),
        }
    }

    /// Exports the figure of a study that is shown.
    pub(in crate::app) fn export_study_figure(&mut self) {
        match self.studies.exported() {
            Some(linked) => self.files.export(ExportRequest::Figure(linked.figure, Theme::Light, linked.size)),
            None => self.notices.warning("There is no figure: run the study first."),
        }
    }

    /// Exports the trials selected in the library into one file.
    pub(in crate::app) fn export_trials(&mut self) {
        let ids = self.library.selection.ids();
        if ids.is_empty() {
            return self.notices.warning("Select trials in the library first.");
        }
        self.files.export(ExportRequest::Trials(self.store.clone(), ids, self.inspect.options.clone()));
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
