//! Files: opening, dropping and saving, and pictures of the 3-D view.

use super::App;
use crate::app::export::{ExportRequest, export_job};
use palpate_exchange::Mapping;
use palpate_geometry::palette::{SHOWN_SERIES, Theme};
use palpate_lab::inspection::{FigureOptions, OpenOptions, OpenTrial, comparison_figure};
use palpate_lab::workers::{Job, Wake};
use palpate_sim::scene::Scene;
use palpate_store::{FileKind, write_whole};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is done with a path that was chosen.
type WithPath = Box<dyn FnOnce(&mut App, PathBuf)>;

/// File to ask for, and what is done with it.
pub(in crate::app) struct Question {
    pub(in crate::app) title: &'static str,
    /// Extensions of the files.
    pub(in crate::app) extensions: &'static [&'static str],
    /// Name proposed for a file to write; none for one to read.
    pub(in crate::app) name: Option<String>,
    then: WithPath,
}

impl Question {
    /// The path; a file to write gets an extension where it has none.
    fn whole(&self, path: PathBuf) -> PathBuf {
        let writes = self.name.is_some() && path.extension().is_none();
        if writes { path.with_extension(self.extensions[0]) } else { path }
    }
}

/// State of files in the window.
pub(in crate::app) struct FileFeature {
    /// File that is to be asked for now.
    pub(in crate::app) question: Option<Question>,
    /// Folder of the file chosen last.
    folder: Option<PathBuf>,
    exports: Job<(PathBuf, ExportRequest), String>,
    /// File whose trials are to be imported now.
    pub(in crate::app) import: Option<(PathBuf, Wake)>,
    /// Profile that the import dialog is to use now.
    pub(in crate::app) profile: Option<PathBuf>,
    wake: Wake,
    /// All labelled trials are exported as soon as the store has their labels.
    labelled: bool,
}

impl FileFeature {
    pub(in crate::app) fn new(wake: Wake) -> Self {
        let exports = export_job(Arc::clone(&wake));
        Self { question: None, folder: None, exports, import: None, profile: None, wake, labelled: false }
    }

    /// Folder that a dialog begins in: that of the file chosen last, or the working folder.
    pub(in crate::app) fn folder(&self) -> PathBuf {
        let home = || std::env::current_dir().ok().or_else(std::env::home_dir);
        self.folder.clone().filter(|folder| folder.is_dir()).or_else(home).unwrap_or_default()
    }

    fn ask(
        &mut self,
        title: &'static str,
        extensions: &'static [&'static str],
        name: Option<String>,
        then: impl FnOnce(&mut App, PathBuf) + 'static,
    ) {
        self.question = Some(Question { title, extensions, name, then: Box::new(then) });
    }

    /// Asks where to write this.
    pub(in crate::app) fn export(&mut self, request: ExportRequest) {
        let name = request.name();
        self.export_as(&name, request);
    }

    /// The same, under a name of its own, without ending.
    fn export_as(&mut self, name: &str, request: ExportRequest) {
        let (title, extensions) = match request {
            ExportRequest::Figure(..) => ("Export figure", &["svg", "png"][..]),
            ExportRequest::View3d(..) => ("Save picture", &["png"][..]),
            ExportRequest::Table(_) => ("Export table", &["csv"][..]),
            ExportRequest::Trials { .. } | ExportRequest::Labelled(_) => {
                ("Export trials", &["mcap", "npz", "parquet", "csv"][..])
            }
        };
        let name = Some(format!("{name}.{}", extensions[0]));
        self.ask(title, extensions, name, |app, path| _ = app.files.exports.start((path, request)));
    }
}

/// Endings of the files that hold trials.
const ENDINGS: &[&str] = &["csv", "tsv", "txt", "mcap", "npz", "parquet"];

fn holds_trials(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    ENDINGS.contains(&ending.as_str())
}

/// Size of exported figures (points).
const FIGURE_SIZE: [u32; 2] = [900, 560];

impl App {
    /// Takes in the answer of the dialog.
    pub(in crate::app) fn answer(&mut self, question: Question, path: PathBuf) {
        let path = question.whole(path);
        self.files.folder = path.parent().map(Path::to_owned);
        (question.then)(self, path);
    }

    /// Takes in dropped files and ended exports since the last frame.
    pub(super) fn poll_files(&mut self) {
        for ended in self.files.exports.take() {
            match ended.outcome {
                Ok(said) => {
                    self.notices.done("file");
                    self.notices.info(said.as_str());
                }
                Err(cause) => self.notices.failed("file", cause.to_string()),
            }
        }
        if self.files.labelled && self.labelling.is_settled() {
            self.files.labelled = false;
            self.files.exports.start((self.export_folder(), ExportRequest::Labelled(self.store.clone())));
        }
        for file in self.ctx.input(|i| i.raw.dropped_files.clone()) {
            self.open_file(file.path());
        }
    }

    /// Grasps what a file holds, or imports its trials.
    pub fn open_file(&mut self, path: &Path) {
        if holds_trials(path) {
            self.files.import = Some((path.to_owned(), Arc::clone(&self.files.wake)));
        } else {
            self.open(&path.to_string_lossy());
        }
    }

    /// Imports trials of another program.
    pub(in crate::app) fn ask_for_trials(&mut self) {
        self.files.ask("Import trials", ENDINGS, None, |app, path| app.open_file(&path));
    }

    /// Opens an object or a scene.
    pub fn ask_for_object(&mut self) {
        let extensions = &["urdf", "obj", "stl", "xml", "toml"];
        self.files.ask("Open object or scene", extensions, None, |app, path| app.open(&path.to_string_lossy()));
    }

    /// Opens a gripper file.
    pub(in crate::app) fn ask_for_sensors(&mut self) {
        self.files.ask("Open gripper file", &["toml"], None, |app, path| app.set_gripper_file(&path));
    }

    pub(in crate::app) fn save_scene(&mut self) {
        self.save_scene_as(self.simulation.scene.clone());
    }

    pub(in crate::app) fn save_scene_as(&mut self, scene: Scene) {
        let stem = Path::new(&scene.object.source).file_stem().and_then(|stem| stem.to_str()).unwrap_or("palpate");
        let name = Some(format!("{stem}_scene.toml"));
        self.files.ask("Save scene", &["toml"], name, move |app, path| {
            match write_whole(&path, FileKind::Scene, scene.to_toml().as_bytes()) {
                Ok(()) => {
                    app.notices.done("file");
                    app.notices.info(format!("Scene saved as {}.", path.display()));
                }
                Err(error) => app.notices.failed("file", format!("Cannot write {}: {error}", path.display())),
            }
        });
    }

    /// Asks for a profile of an import.
    pub(in crate::app) fn open_profile(&mut self) {
        self.files.ask("Open import profile", &["toml"], None, |app, path| app.files.profile = Some(path));
    }

    /// Asks where to save the roles of columns as a profile.
    pub(in crate::app) fn save_profile(&mut self, mapping: &Mapping) {
        let text = mapping.to_toml();
        self.files.ask("Save import profile", &["toml"], Some("profile.toml".to_owned()), move |app, path| {
            let write =
                |text: String| write_whole(&path, Mapping::FILE, text.as_bytes()).map_err(|error| error.to_string());
            match text.and_then(write) {
                Ok(()) => app.notices.info(format!("Import profile saved as {}.", path.display())),
                Err(cause) => app.notices.failed("file", format!("Cannot write {}: {cause}", path.display())),
            }
        });
    }

    /// Exports a figure of the trial that is open and of those compared with it; heat maps are those of the open trial.
    pub(in crate::app) fn export_figure(&mut self, options: FigureOptions) {
        let own = self.inspect.inspected().map(|own| own.trial.as_ref());
        let others = self.inspect.pinned.iter().filter(|pinned| own.is_none_or(|own| own.id != pinned.trial.id));
        let others = others.filter(|_| options.heat.is_none()).map(|own| (own.trial.as_ref(), own.colour));
        let shown = own.into_iter().map(|own| (own, SHOWN_SERIES));
        let (trials, colours): (Vec<&OpenTrial>, Vec<usize>) = shown.chain(others).unzip();
        if trials.is_empty() {
            let text = "Figures are made of stored trials: open one in Inspect mode, or compare some (P).";
            return self.notices.warning(text);
        }
        let (align, mean) = (self.inspect.alignment, self.inspect.spread);
        match comparison_figure(&trials, &FigureOptions { align, mean, colours, ..options }) {
            Ok(figure) => self.files.export(ExportRequest::Figure(figure, Theme::Light, FIGURE_SIZE)),
            Err(cause) => self.notices.warning(cause.to_string()),
        }
    }

    /// Exports the figure of a study that is shown.
    pub(in crate::app) fn export_study_figure(&mut self) {
        match self.studies.exported() {
            Some(linked) => {
                let request = ExportRequest::Figure(linked.figure, Theme::Light, linked.size);
                self.files.export_as(&linked.name, request);
            }
            None => self.notices.warning("There is no figure: run the study first."),
        }
    }

    /// Exports a table of a study.
    pub(in crate::app) fn export_table(&mut self, name: &str, text: String) {
        self.files.export_as(name, ExportRequest::Table(text));
    }

    /// Exports the trials selected in the library, or else the one shown, into one file, with the force on every taxel where
    /// this is wanted.
    pub(in crate::app) fn export_trials(&mut self, taxels: bool) {
        let mut ids = self.library.selection.ids();
        if ids.is_empty() {
            ids.extend(self.library.selection.shown);
        }
        if ids.is_empty() {
            return self.notices.warning("Select trials in the library first.");
        }
        let (store, options) = (self.store.clone(), self.inspect.options.clone());
        self.files.export(ExportRequest::Trials { store, ids, options, taxels });
    }

    /// Exports the trials selected in the library as CSV, into a folder beside the store.
    pub(in crate::app) fn export_tables(&mut self) {
        let (store, ids) = (self.store.clone(), self.library.selection.ids());
        let request = ExportRequest::Trials { store, ids, options: OpenOptions::default(), taxels: false };
        self.files.exports.start((self.export_folder(), request));
    }

    /// Exports all labelled trials into a folder beside the store.
    pub(in crate::app) fn export_labelled(&mut self) {
        self.files.labelled = true;
    }

    fn export_folder(&self) -> PathBuf {
        self.store.with_file_name("export")
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
    let text =
        "Drop a URDF, OBJ, STL or scene file to grasp it, or a CSV, MCAP, NPZ or Parquet file to import its trials";
    painter.text(rect.center(), egui::Align2::CENTER_CENTER, text, font, egui::Color32::WHITE);
}

#[cfg(test)]
pub(in crate::app) mod tests {
    use super::*;

    /// Asks for a file, or where to write one of this name.
    pub(in crate::app) fn question(name: Option<&str>) -> Question {
        let name = name.map(str::to_owned);
        Question { title: "", extensions: &["svg", "png"], name, then: Box::new(|_, _| ()) }
    }

    #[test]
    fn files_to_write_have_an_extension() {
        let whole = |name, path: &str| question(name).whole(PathBuf::from(path));
        assert_eq!(whole(Some("palpate.svg"), "/tmp/mine"), Path::new("/tmp/mine.svg"));
        assert_eq!(whole(Some("palpate.svg"), "/tmp/mine.png"), Path::new("/tmp/mine.png"));
        assert_eq!(whole(None, "/tmp/part"), Path::new("/tmp/part"));
    }
}
