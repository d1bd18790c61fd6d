//! The built-in objects: every folder of `assets/objects`, embedded. Adding one is adding a folder.
//!
//! Dimensions are real-world ones, chosen to match the names of the paper's objects, whose sizes it does not publish.
//! Objects lie as placed: z up, long side along y, so that the fingers close across it along x.

use super::files::inside;
use super::{ObjectClass, ShapeClass, SizeClass};
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
    use super::*;

    #[test]
    fn every_folder_is_a_sound_entry() {
        assert_eq!(catalogue().len(), FOLDERS.dirs().count());
        assert_eq!(catalogue().len(), 16);
        assert!(catalogue().windows(2).all(|pair| pair[0].name < pair[1].name));
    }

    #[test]
    fn nothing_outside_is_readable() {
        assert!(read_embedded(Path::new("../../Cargo.toml")).is_err());
        assert!(read_embedded(Path::new("lemon/facts.toml")).is_ok());
    }
}
