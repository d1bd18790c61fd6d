//! Folder of trained models.

use palpate_learn::{ModelCard, ModelError};
use palpate_store::Store;
use std::path::{Path, PathBuf};

/// Folder of trained models, beside the default store.
pub fn models_folder() -> PathBuf {
    let store = Store::default_path();
    store.parent().map_or_else(|| PathBuf::from("models"), |folder| folder.join("models"))
}

/// Makes the folder of trained models, which is the program's own, where there is none yet.
pub fn make_models_folder(folder: &Path) -> Result<(), ModelError> {
    std::fs::create_dir_all(folder)
        .map_err(|cause| ModelError::Unwritable { path: folder.to_owned(), cause: cause.to_string() })
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
