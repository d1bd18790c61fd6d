//! Questions of the file dialog. To ask for another file, add a [`Question`].

use crate::app::export::ExportRequest;
use palpate_sim::scene::Scene;
use std::path::{Path, PathBuf};

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

/// Answer of the dialog.
#[derive(Clone, Debug)]
pub(super) enum Answer {
    /// Open this file.
    Open(PathBuf),
    /// Save the scene here.
    SaveScene(PathBuf, Box<Scene>),
    /// Export it here.
    Export(PathBuf, Box<ExportRequest>),
}

/// Texts of a dialog, and the files it is about.
pub(super) struct Wording {
    pub(super) title: &'static str,
    /// Extensions of the files.
    pub(super) extensions: &'static [&'static str],
    /// Name proposed for a file to write; none for one to read.
    pub(super) name: Option<String>,
}

impl Question {
    pub(super) fn wording(&self) -> Wording {
        match self {
            Self::Object => Wording {
                title: "Open object or scene",
                extensions: &["urdf", "obj", "stl", "xml", "toml"],
                name: None,
            },
            Self::SaveScene(scene) => Wording {
                title: "Save scene",
                extensions: &["toml"],
                name: Some(format!("{}_scene.toml", stem(&scene.object.source))),
            },
            Self::Export(request) => {
                let (title, extensions) = match &**request {
                    ExportRequest::Figure(..) => ("Export figure", &["svg", "png"][..]),
                    ExportRequest::View3d(..) => ("Save picture", &["png"][..]),
                    ExportRequest::Trials(..) => ("Export trials", &["mcap", "npz"][..]),
                };
                Wording { title, extensions, name: Some(format!("palpate.{}", extensions[0])) }
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
