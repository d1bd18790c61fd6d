//! The held object: loaded model, and its description for display.

use super::messages::ObjectCard;
use palpate_sim::objects::{LoadOptions, ObjectModel, capital_title};
use palpate_sim::scene::Scene;
use std::sync::Arc;
use std::time::SystemTime;

/// Identity and source of the loaded object: loading again is skipped when nothing about it changed.
pub(super) struct LoadedObject {
    pub(super) source: String,
    pub(super) name: Option<String>,
    pub(super) options: LoadOptions,
    /// Time and length of its file: a file that was exported again is loaded again.
    pub(super) stamp: Option<(SystemTime, u64)>,
    pub(super) model: Option<Arc<ObjectModel>>,
}

/// Modification time and length of a file; none for a built-in object.
pub(super) fn stamp_of(source: &str) -> Option<(SystemTime, u64)> {
    let metadata = std::fs::metadata(source).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

/// Description of an object in a scene.
pub(super) fn card_of(model: &ObjectModel, scene: &Scene) -> ObjectCard {
    ObjectCard {
        content: model.content,
        name: model.name.clone(),
        title: capital_title(&model.name),
        class: model.class,
        mass: model.mass.mass,
        friction: scene.object.friction.value().unwrap_or(model.friction),
        size: model.bounds.size(),
    }
}
