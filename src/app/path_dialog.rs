//! File dialog, inside the window: a path, and the files of its folder. It needs nothing of the desktop.

use crate::app::features::files::Question;
use crate::app::widgets::{failure_ui, focus_field, text_field, wrapped};
use egui::{Button, Id, Key, Modal, RichText, ScrollArea, Ui};
use std::path::{Path, PathBuf, is_separator};

/// An open dialog.
pub(super) struct PathDialog {
    pub(super) question: Question,
    path: String,
    /// Why the path cannot be used.
    refused: Option<String>,
    /// File that is replaced if it is chosen once more.
    replaced: Option<PathBuf>,
    /// What was typed behind the folder: it narrows the list.
    typed: String,
    /// Contents of a folder, and when they were read.
    listing: Option<(PathBuf, Vec<Row>)>,
    fresh: bool,
}

/// File or folder in the list.
#[derive(Clone)]
struct Row {
    name: String,
    folder: bool,
}

/// The path that begins anew in a text: `/b/c` in `/a//b/c`.
fn restarted(text: &str) -> &str {
    let is_drive = |at: usize| {
        let letter = text[..at].chars().next_back().filter(char::is_ascii_alphabetic);
        letter.is_some() && text[at..].starts_with(":\\")
    };
    let drive = (2..text.len()).rev().find(|at| text.is_char_boundary(*at) && is_drive(*at)).map(|at| at - 1);
    let root = text.rfind("//").filter(|at| *at > 0).map(|at| at + 1);
    &text[drive.or(root).unwrap_or(0)..]
}

/// End of a dialog.
pub(super) enum Closed {
    Cancelled,
    Answered(PathBuf),
}

/// Most entries of a folder that are listed.
const MOST_ROWS: usize = 2000;

impl PathDialog {
    /// A dialog that begins in `folder`.
    pub(super) fn new(question: Question, folder: &Path) -> Self {
        let path = folder.join(question.name.as_deref().unwrap_or_default()).to_string_lossy().into_owned();
        Self { question, path, refused: None, replaced: None, typed: String::new(), listing: None, fresh: true }
    }

    /// Draws the dialog; returns its end.
    pub(super) fn ui(&mut self, ctx: &egui::Context) -> Option<Closed> {
        let (title, saves) = (self.question.title, self.question.name.is_some());
        let mut closed = None;
        let modal = Modal::new(egui::Id::unique("path dialog")).show(ctx, |ui| {
            let room = ui.ctx().content_rect().size();
            ui.set_width((room.x - 60.0).min(560.0));
            ui.heading(title);
            let formats = match self.question.extensions {
                many @ [_, _, ..] if saves => format!(" Its ending is the format: .{}.", many.join(", .")),
                _ => String::new(),
            };
            let hint = format!("Write or paste a path, or choose from its folder.{formats}");
            wrapped(ui, RichText::new(hint).small().weak());
            let id = Id::unique("path of a file");
            let field = text_field(&mut self.path, id).hint_text("path of a file");
            let response = ui.add(field);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Path"));
            if std::mem::take(&mut self.fresh) {
                // Behind the path that a click has written, not where the cursor was in the one before.
                focus_field(ui, id);
            }
            if response.changed() {
                // A whole path, pasted behind the folder, stands for itself.
                self.path = restarted(&self.path).to_owned();
                self.typed = split(&self.path).1;
                (self.refused, self.replaced) = (None, None);
            }
            let mut done = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            done |= self.list_ui(ui, (room.y - 260.0).clamp(60.0, 300.0));
            if let Some(refused) = &self.refused {
                failure_ui(ui, refused);
            }
            ui.horizontal(|ui| {
                let text = match (saves, &self.replaced) {
                    (true, Some(_)) => "Replace",
                    (true, None) => "Save",
                    (false, _) => "Open",
                };
                done |= ui.add(Button::new(text)).clicked();
                if ui.button("Cancel").clicked() {
                    closed = Some(Closed::Cancelled);
                }
            });
            if done {
                match self.check(saves) {
                    Ok(Some(path)) => closed = Some(Closed::Answered(path)),
                    Ok(None) => {}
                    Err(refused) => self.refused = Some(refused),
                }
                self.fresh = closed.is_none();
            }
        });
        if modal.should_close() { Some(closed.unwrap_or(Closed::Cancelled)) } else { closed }
    }

    /// Lists the folder of the path; true where a file was chosen twice.
    fn list_ui(&mut self, ui: &mut Ui, height: f32) -> bool {
        let (folder, _) = split(&self.path);
        if self.listing.as_ref().is_none_or(|(listed, _)| *listed != folder) {
            self.listing = Some((folder.clone(), rows(&folder, self.question.extensions)));
            self.typed = split(&self.path).1;
        }
        let Some((_, all)) = &self.listing else { return false };
        // A name that is being typed narrows the list of files to read.
        let narrows = self.question.name.is_none() && !self.typed.is_empty();
        let begun = self.typed.to_lowercase();
        let fits = |row: &&Row| !narrows || row.name.to_lowercase().starts_with(&begun);
        let listed: Vec<Row> = all.iter().filter(fits).cloned().collect();
        let (mut chosen, mut done) = (None, false);
        ScrollArea::vertical().max_height(height).min_scrolled_height(height).auto_shrink([false, true]).show(
            ui,
            |ui| {
                if let Some(above) = folder.parent()
                    && ui.selectable_label(false, "..  (folder above)").clicked()
                {
                    chosen = Some(above.join(""));
                }
                for row in &listed {
                    let text = if row.folder { format!("{}/", row.name) } else { row.name.clone() };
                    let response = ui.selectable_label(false, text);
                    if response.clicked() || response.double_clicked() {
                        done |= response.double_clicked() && !row.folder;
                        let path = folder.join(&row.name);
                        chosen = Some(if row.folder { path.join("") } else { path });
                    }
                }
                if listed.is_empty() {
                    ui.weak("No such files here.");
                }
            },
        );
        if let Some(path) = chosen {
            let name =
                self.question.name.as_deref().filter(|_| path.as_os_str().to_string_lossy().ends_with(is_separator));
            self.path = path.join(name.unwrap_or_default()).to_string_lossy().into_owned();
            (self.refused, self.replaced, self.fresh) = (None, None, true);
            if name.is_none() && !path.is_dir() {
                self.path = path.to_string_lossy().into_owned();
            }
        }
        done
    }

    /// Path that is meant, `None` where it is to be confirmed, or why it cannot be used.
    fn check(&mut self, saves: bool) -> Result<Option<PathBuf>, String> {
        let text = self.path.trim().trim_matches(['"', '\'']);
        if text.is_empty() {
            return Err("Write a path.".to_owned());
        }
        let path = from_home(text);
        if path.is_dir() {
            return Err(format!("{} is a folder: add the name of a file.", path.display()));
        }
        if !saves {
            let exists = path.is_file();
            return if exists { Ok(Some(path)) } else { Err(format!("There is no file {}.", path.display())) };
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            return Err(format!("There is no folder {}. Create it first, or choose another.", folder.display()));
        }
        if path.exists() && self.replaced.as_ref() != Some(&path) {
            let text = format!("{} exists. Replace it?", path.display());
            self.replaced = Some(path);
            self.refused = Some(text);
            return Ok(None);
        }
        Ok(Some(path))
    }
}

/// A path that may begin with `~`.
fn from_home(text: &str) -> PathBuf {
    let home = text.strip_prefix("~/").and_then(|rest| Some(std::env::home_dir()?.join(rest)));
    home.unwrap_or_else(|| PathBuf::from(text))
}

/// Folder of a path, and the name after it.
fn split(path: &str) -> (PathBuf, String) {
    let path = from_home(path.trim());
    if path.as_os_str().to_string_lossy().ends_with(is_separator) || path.is_dir() {
        return (path, String::new());
    }
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    (path.parent().map(Path::to_owned).unwrap_or_default(), name)
}

/// Folders, then files with these extensions, by name.
fn rows(folder: &Path, extensions: &[&str]) -> Vec<Row> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let fits = |name: &str| {
        let extension = Path::new(name).extension().and_then(|extension| extension.to_str());
        extension.is_some_and(|own| extensions.contains(&own.to_lowercase().as_str()))
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let named = entries.map(|entry| (entry.file_name().to_string_lossy().into_owned(), entry.path().is_dir()));
    let mut rows: Vec<Row> = named
        .filter(|(name, folder)| !name.starts_with('.') && (*folder || fits(name)))
        .map(|(name, folder)| Row { name, folder })
        .take(MOST_ROWS)
        .collect();
    rows.sort_by_key(|row| (!row.folder, row.name.to_lowercase()));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::features::files::tests::question;
    #[test]
    fn a_path_pasted_behind_the_folder_stands_for_itself() {
        for (text, path) in [
            ("/home/me//data/mug.obj", "/data/mug.obj"),
            ("/home/me/mug.obj", "/home/me/mug.obj"),
            ("//server/share/mug.obj", "//server/share/mug.obj"),
            ("C:\\me\\D:\\mug.obj", "D:\\mug.obj"),
            ("C:\\me\\mug.obj", "C:\\me\\mug.obj"),
            ("/tmp/a:\u{e9}", "/tmp/a:\u{e9}"),
            ("", ""),
        ] {
            assert_eq!(restarted(text), path, "{text}");
        }
    }

    #[test]
    fn a_path_is_checked_before_it_is_used() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut dialog = PathDialog::new(question(Some("palpate.svg")), folder.path());
        let own = folder.path().join("palpate.svg");
        assert_eq!(dialog.check(true), Ok(Some(own.clone())));
        // An existing file is replaced only after a second look.
        std::fs::write(&own, "old").expect("writes");
        assert_eq!(dialog.check(true), Ok(None));
        assert_eq!(dialog.check(true), Ok(Some(own)));
        dialog.path = folder.path().join("not/there.png").to_string_lossy().into_owned();
        assert!(dialog.check(true).is_err_and(|why| why.contains("no folder")));
        dialog.path = folder.path().to_string_lossy().into_owned();
        assert!(dialog.check(false).is_err_and(|why| why.contains("is a folder")));
        dialog.path = folder.path().join("none.obj").to_string_lossy().into_owned();
        assert!(dialog.check(false).is_err_and(|why| why.contains("no file")));
        let names: Vec<String> = rows(folder.path(), &["svg"]).into_iter().map(|row| row.name).collect();
        assert_eq!(names, ["palpate.svg"]);
    }
}
