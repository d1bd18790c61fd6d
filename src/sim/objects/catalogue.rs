//! The built-in objects: every folder of `assets/objects`, embedded. Adding one is adding a folder.

use super::files::inside;
use super::{EMPTY, ObjectClass, ShapeClass, SizeClass};
use include_dir::{Dir, include_dir};
use serde::Deserialize;
use std::path::Path;
use std::sync::OnceLock;

static FOLDERS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../../assets/objects");

/// Facts of a built-in object besides its URDF.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BuiltIn {
    /// The name of its folder.
    #[serde(skip)]
    pub name: String,
    /// Display name.
    pub title: String,
    /// The paper's size class.
    pub size: SizeClass,
    /// The paper's shape class.
    pub shape: ShapeClass,
    /// Friction coefficient of its surface.
    pub friction: f64,
}

impl BuiltIn {
    /// Size and shape class.
    pub fn class(&self) -> ObjectClass {
        ObjectClass { size: self.size, shape: self.shape }
    }
}

/// All built-in objects by name.
pub fn catalogue() -> &'static [BuiltIn] {
    static CATALOGUE: OnceLock<Vec<BuiltIn>> = OnceLock::new();
    CATALOGUE.get_or_init(|| {
        let mut all: Vec<BuiltIn> = FOLDERS.dirs().filter_map(|folder| facts_of(folder.path())).collect();
        all.sort_by(|a, b| a.name.cmp(&b.name));
        all
    })
}

fn facts_of(folder: &Path) -> Option<BuiltIn> {
    let name = folder.to_str()?.to_owned();
    let text = FOLDERS.get_file(folder.join("facts.toml"))?.contents_utf8()?;
    match toml::from_str::<BuiltIn>(text) {
        Ok(facts) => Some(BuiltIn { name, ..facts }),
        Err(error) => {
            tracing::warn!("built-in object \"{name}\" is left out: {error}");
            None
        }
    }
}

/// Name of the class of the object with this name or title; the text itself where there is none.
pub fn class_of(text: &str) -> &str {
    let text = text.trim();
    let is = |own: &str| own.to_lowercase() == text.to_lowercase();
    let built_in = catalogue().iter().find(|b| is(&b.name)).or_else(|| catalogue().iter().find(|b| is(&b.title)));
    built_in.map_or(if is("Empty hand") { EMPTY } else { text }, |b| b.name.as_str())
}

/// A small picture of a built-in object (PNG).
pub fn thumbnail(name: &str) -> Option<&'static [u8]> {
    Some(FOLDERS.get_file(Path::new(name).join("thumbnail.png"))?.contents())
}

/// A file of a built-in object, by a path relative to `assets/objects`.
pub(super) fn read_embedded(path: &Path) -> std::io::Result<Vec<u8>> {
    inside(path)
        .and_then(|path| FOLDERS.get_file(path))
        .map(|file| file.contents().to_vec())
        .ok_or_else(|| std::io::Error::from(std::io::ErrorKind::NotFound))
}

#[cfg(test)]
mod tests {
    use super::super::{object_title, titled};
    use super::*;

    #[test]
    fn every_folder_is_a_sound_entry() {
        assert_eq!(catalogue().len(), FOLDERS.dirs().count());
        assert_eq!(catalogue().len(), 16);
        assert!(catalogue().windows(2).all(|pair| pair[0].name < pair[1].name));
    }

    #[test]
    fn objects_have_one_title() {
        assert_eq!(
            ["bigball", "lemon", EMPTY, "garlic"].map(object_title),
            ["Tennis ball", "Lemon", "Empty hand", "garlic"]
        );
        assert_eq!(["bigball", "lemon"].map(titled), ["Tennis ball (bigball)", "Lemon"]);
        assert_eq!(
            ["tennis Ball", "ball", " Die ", "garlic"].map(class_of),
            ["bigball", "ball", "smallcube", "garlic"]
        );
        let mut titles: Vec<String> = catalogue().iter().map(|b| b.title.to_lowercase()).collect();
        titles.sort();
        titles.dedup();
        assert_eq!(titles.len(), catalogue().len());
    }

    #[test]
    fn nothing_outside_is_readable() {
        assert!(read_embedded(Path::new("../../Cargo.toml")).is_err());
        assert!(read_embedded(Path::new("lemon/facts.toml")).is_ok());
    }
}
