//! Folder of trained models.

use palpate_learn::{Model, ModelCard, ModelError};
use palpate_store::{FileKind, NewFile, Store, check_target};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// Folder of trained models, beside the default store.
pub fn models_folder() -> PathBuf {
    let store = Store::default_path();
    store.parent().map_or_else(|| PathBuf::from("models"), |folder| folder.join("models"))
}

/// Makes the folder of trained models, which is the program's own, where there is none yet.
pub fn make_models_folder(folder: &Path) -> Result<(), ModelError> {
    std::fs::create_dir_all(folder).map_err(|cause| unwritable(folder, &cause))
}

/// Refuses a path whose model, or the card beside it, would replace something else.
pub fn check_model_path(path: &Path) -> Result<(), ModelError> {
    let (card, hub_card) = (ModelCard::path_beside(path), ModelCard::hub_path_beside(path));
    check_target(&hub_card, HUB_CARD).map_err(|cause| unwritable(&hub_card, &cause))?;
    check_target(path, FileKind::Model).map_err(|cause| unwritable(path, &cause))?;
    check_target(&card, FileKind::Json).map_err(|cause| unwritable(&card, &cause))?;
    if card == path {
        return Err(unwritable(path, &"its card would have the same name; choose one that ends in .safetensors"));
    }
    if card.exists() && ModelCard::beside(path).is_err() {
        let cause = "there is a file of this name which is no card of a model; choose another name for the model";
        return Err(unwritable(&card, &cause));
    }
    Ok(())
}

/// Cards of models for hubs.
const HUB_CARD: FileKind =
    FileKind::Other { title: "card of a model", endings: &["md"], begin: ModelCard::HUB_BEGIN.as_bytes() };

/// Writes a model, and its cards for people and for hubs beside it, into a folder that exists.
pub fn save_model(model: &Model, path: &Path) -> Result<(), ModelError> {
    check_model_path(path)?;
    let (card, hub_card) = (ModelCard::path_beside(path), ModelCard::hub_path_beside(path));
    let written = |path: &Path, kind, bytes: &[u8]| {
        let write = || {
            let mut file = NewFile::create(path, kind)?;
            file.write_all(bytes)?;
            Ok(file)
        };
        write().map_err(|cause: io::Error| unwritable(path, &cause))
    };
    let new_model = written(path, FileKind::Model, &model.to_bytes()?)?;
    let new_card = written(&card, FileKind::Json, model.card_text()?.as_bytes())?;
    let new_hub_card = written(&hub_card, HUB_CARD, model.card.hub_text().as_bytes())?;
    new_model.finish().map_err(|cause| unwritable(path, &cause))?;
    new_card.finish().map_err(|cause| unwritable(&card, &cause))?;
    new_hub_card.finish().map_err(|cause| unwritable(&hub_card, &cause))
}

fn unwritable(path: &Path, cause: &dyn std::fmt::Display) -> ModelError {
    ModelError(format!("cannot write \"{}\": {cause}", path.display()))
}

/// Model file with its description.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedModel {
    /// Path of the file.
    pub path: PathBuf,
    /// Summary from the card beside it; a note if there is none.
    pub about: String,
}

/// Largest number of models listed.
const MOST_LISTED: usize = 50;

/// Lists the models in a folder, newest first; empty if the folder does not exist.
pub fn saved_models(folder: &Path) -> Vec<SavedModel> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_model = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "safetensors");
    let mut found: Vec<(Option<std::time::SystemTime>, PathBuf)> = files
        .map(|file| (file.metadata().and_then(|data| data.modified()).ok(), file.path()))
        .filter(|(_, path)| is_model(path))
        .collect();
    found.sort_by(|a, b| b.cmp(a));
    let about = |path: &Path| ModelCard::beside(path).map_or_else(|_| "no card".to_owned(), |c| c.described());
    found.into_iter().take(MOST_LISTED).map(|(_, path)| SavedModel { about: about(&path), path }).collect()
}

/// Path for a new model, named after its method and a time in the store's format; does not exist yet.
pub fn new_model_path(folder: &Path, method: &str, now: &str) -> PathBuf {
    // 2026-11-21T15:36:00.123Z is 2026-11-21-153600.
    let date: String = now.chars().take(19).filter(|c| *c != ':').map(|c| if c == 'T' { '-' } else { c }).collect();
    let name = |number: u32| match number {
        1 => format!("{method}-{date}.safetensors"),
        _ => format!("{method}-{date}-{number}.safetensors"),
    };
    let free = (1..1000).map(|number| folder.join(name(number))).find(|path| !path.exists());
    free.unwrap_or_else(|| folder.join(name(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_paths_have_method_and_time_and_are_unused() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        let now = "2026-11-21T15:36:00.123Z";
        let first = new_model_path(folder.path(), "knn", now);
        assert!(first.ends_with("knn-2026-11-21-153600.safetensors"), "{first:?}");
        std::fs::write(&first, "x")?;
        let second = new_model_path(folder.path(), "knn", now);
        assert!(second.ends_with("knn-2026-11-21-153600-2.safetensors"), "{second:?}");
        std::fs::write(folder.path().join("notes.txt"), "x")?;
        let found = saved_models(folder.path());
        assert!(found.len() == 1 && found[0].path == first && found[0].about == "no card", "{found:?}");
        assert_eq!(saved_models(&folder.path().join("gone")), []);
        Ok(())
    }
}
