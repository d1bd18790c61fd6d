//! Asking for files. The dialog runs in a thread of its own, since the window must go on drawing, and answers through a
//! channel. Where a desktop has no dialog there is a field to paste a path into, and files can be dropped.

use super::actions::{Answer, Message};
use palpate_sim::scene::Scene;
use std::path::PathBuf;
use std::sync::mpsc::Sender;

/// What a file is asked for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Ask {
    /// An object to open.
    Object,
    /// Where to write a scene.
    SaveScene(Box<Scene>),
    /// Where to write a picture.
    SavePicture,
}

/// Opens a dialog; the answer comes later, or never when the user changes their mind.
pub(super) fn ask(what: Ask, answers: &Sender<Answer>, wake: impl Fn() + Send + 'static) {
    let answers = answers.clone();
    let failed = answers.clone();
    let started = std::thread::Builder::new().name("file dialog".to_owned()).spawn(move || {
        if let Some(answer) = run(what) {
            // The window may have been closed meanwhile.
            let _heard = answers.send(answer);
            wake();
        }
    });
    if let Err(error) = started {
        let text = format!("the file dialog could not be opened ({error}); paste a path or drop a file instead");
        let _heard = failed.send(Answer::Tell(Message::Error(text)));
    }
}

fn run(what: Ask) -> Option<Answer> {
    let dialog = rfd::FileDialog::new();
    match what {
        Ask::Object => {
            let path = dialog.set_title("Open an object or a scene");
            let path = path.add_filter("URDF, OBJ, STL, scene", &["urdf", "obj", "stl", "xml", "toml"]);
            path.pick_file().map(Answer::Open)
        }
        Ask::SaveScene(scene) => {
            let dialog = dialog.set_title("Save the scene").set_file_name("scene.toml").add_filter("TOML", &["toml"]);
            dialog.save_file().map(|path| Answer::SaveScene(with_extension(path, "toml"), scene))
        }
        Ask::SavePicture => {
            let dialog = dialog.set_title("Save a picture").set_file_name("palpate.png").add_filter("PNG", &["png"]);
            dialog.save_file().map(|path| Answer::SavePicture(with_extension(path, "png")))
        }
    }
}

fn with_extension(path: PathBuf, extension: &str) -> PathBuf {
    if path.extension().is_some() { path } else { path.with_extension(extension) }
}
