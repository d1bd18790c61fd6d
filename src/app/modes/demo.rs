//! Demo mode: grasp and recognise, live.

use super::mode::Mode;
use super::{ModeKind, split, tabs};
use crate::app::features::inspect::InspectAction;
use crate::app::features::recognition::RecognitionAction;
use crate::app::features::view::ViewAction;
use crate::app::keys::binding::{Binding, key};
use crate::app::playback::Seek;
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};

pub(super) const KIND: ModeKind = ModeKind {
    mode: Mode::Demo,
    title: "Demo",
    about: "Grasp and recognise, live (Ctrl+1)",
    layout,
    open: key(Modifiers::COMMAND, Key::Num1, "Demo mode", |_| Some(ViewAction::SetMode(Mode::Demo).into())),
    keys: KEYS,
    typed: |_, _| None,
};

const KEYS: &[Binding] = &[
    key(Modifiers::NONE, Key::N, "next object", |_| Some(RecognitionAction::NextObject.into())),
    key(Modifiers::NONE, Key::Home, "first sample", |_| Some(InspectAction::Seek(Seek::Start).into())),
];

/// Objects and scene left, the view over two plots in the middle, results right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let left = tabs(tiles, &["objects", "scene"]);
    let [view, curvature] = ["view", "curvature"].map(|name| tabs(tiles, &[name]));
    let loads = tabs(tiles, &["pressure", "force", "line"]);
    let right = tabs(tiles, &["recognition", "why", "grasp", "effects", "accuracy", "gripper"]);
    let middle = split(tiles, LinearDir::Vertical, [(view, 0.58), (curvature, 0.21), (loads, 0.21)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.185), (middle, 0.555), (right, 0.26)])
}
