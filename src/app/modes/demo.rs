//! Demo mode: grasp and recognise, live.

use super::mode::Mode;
use super::{ModeKind, split, tabs};
use crate::app::actions::Action;
use crate::app::context::PanelContext;
use crate::app::features::inspect::InspectAction;
use crate::app::features::library::LibraryAction;
use crate::app::features::recognition::RecognitionAction;
use crate::app::features::view::ViewAction;
use crate::app::keys::binding::{Binding, key};
use crate::app::playback::Seek;
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};
use palpate_lab::workers::Command;

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
    key(Modifiers::NONE, Key::M, "one more grasp, where the threshold is raised after a verdict", |c| {
        c.one_more().then(|| Command::GraspOnceMore.into())
    })
    .otherwise("One more grasp follows a higher threshold: raise it after a verdict, above the probability reached."),
    key(Modifiers::NONE, Key::K, "keep the last grasp: from the demo log to the store", |c| {
        Some(LibraryAction::Keep(c.logged?.trial).into())
    })
    .otherwise("The last grasp is not in the demo log."),
    key(Modifiers::NONE, Key::ArrowUp, "higher threshold", |c| threshold(c, 1.0)).otherwise(OFF),
    key(Modifiers::NONE, Key::ArrowDown, "lower threshold", |c| threshold(c, -1.0)).otherwise(OFF),
    key(Modifiers::NONE, Key::Home, "first sample", |_| Some(InspectAction::Seek(Seek::Start).into())),
];

const OFF: &str = "Recognition is off: there is no threshold.";

/// Change of the threshold by one key press; above 99 % a tenth of it.
const STEP: f64 = 0.01;

fn threshold(context: &PanelContext<'_>, sign: f64) -> Option<Action> {
    let now = context.shown().recognised()?.view?.rule.threshold;
    let fine = now + 1e-6 * sign > 0.99;
    let next = now + sign * if fine { 0.1 * STEP } else { STEP };
    // Whole steps, also after many.
    let steps = if fine { 1e3 } else { 1e2 };
    Some(RecognitionAction::SetThreshold((next * steps).round() / steps).into())
}

/// Objects and scene left, the view over two plots in the middle, results right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let left = tabs(tiles, &["objects", "scene"]);
    let [view, curvature] = ["view", "curvature"].map(|name| tabs(tiles, &[name]));
    let loads = tabs(tiles, &["pressure", "force", "line"]);
    let right = tabs(tiles, &["recognition", "why", "grasp", "effects", "accuracy", "gripper"]);
    let middle = split(tiles, LinearDir::Vertical, [(view, 0.58), (curvature, 0.21), (loads, 0.21)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.185), (middle, 0.555), (right, 0.26)])
}
