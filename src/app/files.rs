//! File dialogs: the system's, in a thread of their own so that the window keeps drawing, or one inside the window where
//! the system has none. To ask for another file, add a [`Question`].

use crate::app::export::ExportRequest;
use palpate_sim::scene::Scene;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

/// File to ask for.
#[derive(Clone, Debug)]
pub(super) enum Question {
    /// Object or scene to open.
    Object,
    /// Where to save a scene.
    SaveScene(Box<Scene>),
    /// Where to export something.
    Export(Box<ExportRequest>),
}

/// Answer of a dialog or of a background job.
#[derive(Clone, Debug)]
pub(super) enum Answer {
    /// Open this file.
    Open(PathBuf),
    /// Save the scene here.
    SaveScene(PathBuf, Box<Scene>),
    /// Export it here.
    Export(PathBuf, Box<ExportRequest>),
    /// The system has no file dialog: ask inside the window.
    AskInside(Question),
}

/// Texts of a dialog, and the files it is about.
pub(super) struct Wording {
    pub(super) title: &'static str,
    /// Kind of the files, and their extensions.
    pub(super) kind: &'static str,
    pub(super) extensions: &'static [&'static str],
    /// Name proposed for a file to write; none for one to read.
    pub(super) name: Option<String>,
}

impl Question {
    pub(super) fn wording(&self) -> Wording {
        match self {
            Self::Object => Wording {
                title: "Open object or scene",
                kind: "URDF, OBJ, STL, scene",
                extensions: &["urdf", "obj", "stl", "xml", "toml"],
                name: None,
            },
            Self::SaveScene(scene) => Wording {
                title: "Save scene",
                kind: "TOML",
                extensions: &["toml"],
                name: Some(format!("{}_scene.toml", stem(&scene.object.source))),
            },
            Self::Export(request) => {
                let (title, kind, extensions) = match &**request {
                    ExportRequest::Figure(..) => ("Export figure", "SVG, PNG", &["svg", "png"][..]),
                    ExportRequest::View3d(..) => ("Save picture", "PNG", &["png"][..]),
                    ExportRequest::Trials(..) => ("Export trials", "MCAP, NPZ", &["mcap", "npz"][..]),
                };
                Wording { title, kind, extensions, name: Some(format!("palpate.{}", extensions[0])) }
            }
        }
    }

    pub(super) fn answer(self, path: PathBuf) -> Answer {
        let saves = self.wording().name.is_some();
        let extension = self.wording().extensions.first().copied().unwrap_or_default();
        let path = if saves && path.extension().is_none() { path.with_extension(extension) } else { path };
        match self {
            Self::Object => Answer::Open(path),
            Self::SaveScene(scene) => Answer::SaveScene(path, scene),
            Self::Export(request) => Answer::Export(path, request),
        }
    }
}

/// Name of an object in the name of a file.
fn stem(source: &str) -> &str {
    Path::new(source).file_stem().and_then(|stem| stem.to_str()).unwrap_or("palpate")
}

/// Nobody cancels a dialog so soon after it opened: there was none.
const NO_DIALOG: Duration = Duration::from_millis(400);

/// Opens the system's dialog. The answer comes later, or never if the user cancels; without a dialog it is to ask inside the
/// window.
pub(super) fn ask(question: Question, answers: &Sender<Answer>, wake: impl Fn() + Send + 'static) {
    let (sender, asked) = (answers.clone(), question.clone());
    let started = std::thread::Builder::new().name("file dialog".to_owned()).spawn(move || {
        let opened = Instant::now();
        let answer = match run(&asked) {
            Some(path) => asked.answer(path),
            None if opened.elapsed() < NO_DIALOG => Answer::AskInside(asked),
            None => return,
        };
        // The window may have been closed meanwhile.
        let _heard = sender.send(answer);
        wake();
    });
    if started.is_err() {
        let _heard = answers.send(Answer::AskInside(question));
    }
}

fn run(question: &Question) -> Option<PathBuf> {
    if !has_dialogs() {
        return None;
    }
    let Wording { title, kind, extensions, name } = question.wording();
    let dialog = rfd::FileDialog::new().set_title(title).add_filter(kind, extensions);
    match name {
        Some(name) => dialog.set_file_name(name).save_file(),
        None => dialog.pick_file(),
    }
}

/// False where the system certainly has no file dialog: neither a session bus, which the portal needs, nor zenity.
fn has_dialogs() -> bool {
    if !cfg!(target_os = "linux") {
        return true;
    }
    let bus = std::env::var_os("DBUS_SESSION_BUS_ADDRESS").is_some_and(|address| !address.is_empty());
    let socket = std::env::var_os("XDG_RUNTIME_DIR").is_some_and(|folder| Path::new(&folder).join("bus").exists());
    let paths = std::env::var_os("PATH").unwrap_or_default();
    bus || socket || std::env::split_paths(&paths).any(|folder| folder.join("zenity").is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_to_write_have_a_name_and_an_extension() {
        let question = Question::SaveScene(Box::default());
        assert_eq!(question.wording().name.as_deref(), Some("lemon_scene.toml"));
        let answer = question.answer(PathBuf::from("/tmp/mine"));
        assert!(matches!(answer, Answer::SaveScene(path, _) if path == Path::new("/tmp/mine.toml")));
        let answer = Question::Object.answer(PathBuf::from("/tmp/part"));
        assert!(matches!(answer, Answer::Open(path) if path == Path::new("/tmp/part")));
    }
}
