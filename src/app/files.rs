//! File dialogs. Each runs in a thread of its own, so that the window keeps drawing, and answers through a channel.
//! Desktops without dialogs still have the field for a path, and files can be dropped.

use crate::app::notices::UserMessage;
use palpate_sim::scene::Scene;
use std::path::PathBuf;
use std::sync::mpsc::Sender;

/// File to ask for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Question {
    /// Object or scene to open.
    Object,
    /// Where to save a scene.
    SaveScene(Box<Scene>),
    /// Where to save a picture.
    SavePicture,
}

/// Answer of a dialog or of a background job.
#[derive(Clone, Debug)]
pub(super) enum Answer {
    /// Open this file.
    Open(PathBuf),
    /// Save the scene here.
    SaveScene(PathBuf, Box<Scene>),
    /// Save the picture here.
    SavePicture(PathBuf),
    /// Show a message.
    Tell(UserMessage),
}

/// Opens a dialog. The answer comes later, or never if the user cancels.
pub(super) fn ask(question: Question, answers: &Sender<Answer>, wake: impl Fn() + Send + 'static) {
    let answers = answers.clone();
    let failed = answers.clone();
    let started = std::thread::Builder::new().name("file dialog".to_owned()).spawn(move || {
        if let Some(answer) = run(question) {
            // The window may have been closed meanwhile.
            let _heard = answers.send(answer);
            wake();
        }
    });
    if let Err(error) = started {
        let text = format!("Cannot open the file dialog ({error}). Paste a path or drop a file instead.");
        let _heard = failed.send(Answer::Tell(UserMessage::Error(text)));
    }
}

fn run(question: Question) -> Option<Answer> {
    let dialog = rfd::FileDialog::new();
    match question {
        Question::Object => {
            let dialog = dialog.set_title("Open object or scene");
            let dialog = dialog.add_filter("URDF, OBJ, STL, scene", &["urdf", "obj", "stl", "xml", "toml"]);
            dialog.pick_file().map(Answer::Open)
        }
        Question::SaveScene(scene) => {
            let dialog = dialog.set_title("Save scene").set_file_name("scene.toml").add_filter("TOML", &["toml"]);
            dialog.save_file().map(|path| Answer::SaveScene(with_extension(path, "toml"), scene))
        }
        Question::SavePicture => {
            let dialog = dialog.set_title("Save picture").set_file_name("palpate.png").add_filter("PNG", &["png"]);
            dialog.save_file().map(|path| Answer::SavePicture(with_extension(path, "png")))
        }
    }
}

fn with_extension(path: PathBuf, extension: &str) -> PathBuf {
    if path.extension().is_some() { path } else { path.with_extension(extension) }
}
