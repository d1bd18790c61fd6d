//! Label mode: record and label trials of the real gripper, from the keyboard.

use super::mode::Mode;
use super::{ModeKind, split, tabs};
use crate::app::actions::Action;
use crate::app::features::gripper::GripperAction;
use crate::app::features::tools::ToolAction;
use crate::app::features::view::ViewAction;
use crate::app::keys::binding::{Binding, key, typed_ahead};
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};
use palpate_lab::workers::LabellingAction;

pub(super) const KIND: ModeKind = ModeKind {
    mode: Mode::Label,
    title: "Label",
    about: "Record and label trials of the real gripper (Ctrl+3)",
    layout,
    open: key(Modifiers::COMMAND, Key::Num3, "Label mode", |_| Some(ViewAction::SetMode(Mode::Label).into())),
    keys: KEYS,
    typed: |ctx, context| {
        typed_ahead(ctx, context.draft.focus_search).map(|typed| LabellingAction::FocusSearch(typed).into())
    },
};

const NONE: Modifiers = Modifiers::NONE;

const KEYS: &[Binding] = &[
    key(NONE, Key::N, "give the label and continue", |_| Some(LabellingAction::GiveLabel.into())),
    key(NONE, Key::Enter, "give the label", |_| Some(LabellingAction::GiveLabel.into())),
    key(NONE, Key::U, "mark the label as unsure", |_| Some(LabellingAction::ToggleUnsure.into())),
    key(NONE, Key::B, "blind: hide the model's prediction until the label is given", |_| {
        Some(LabellingAction::ToggleBlind.into())
    }),
    key(NONE, Key::M, "actuation: manual, board or untimed", |_| Some(GripperAction::NextControl.into())),
    key(NONE, Key::W, "detect trials automatically", |_| Some(GripperAction::ToggleWatch.into())),
    key(Modifiers::COMMAND, Key::E, "export all labelled trials", |_| Some(LabellingAction::Export.into())),
    key(Modifiers::COMMAND, Key::T, "train on all labelled trials", |_| Some(ToolAction::TrainAndUse.into())),
    key(NONE, Key::Slash, "find an object", |_| Some(LabellingAction::FocusSearch(String::new()).into())),
    key(NONE, Key::Num1, "choose the first object; 2 to 9: the others", |_| choose(0)),
    key(NONE, Key::Num2, "", |_| choose(1)),
    key(NONE, Key::Num3, "", |_| choose(2)),
    key(NONE, Key::Num4, "", |_| choose(3)),
    key(NONE, Key::Num5, "", |_| choose(4)),
    key(NONE, Key::Num6, "", |_| choose(5)),
    key(NONE, Key::Num7, "", |_| choose(6)),
    key(NONE, Key::Num8, "", |_| choose(7)),
    key(NONE, Key::Num9, "", |_| choose(8)),
    key(NONE, Key::ArrowUp, "previous trial", |_| Some(LabellingAction::Step(-1).into())),
    key(NONE, Key::ArrowDown, "next trial", |_| Some(LabellingAction::Step(1).into())),
    key(NONE, Key::Home, "newest unlabelled trial", |_| Some(LabellingAction::Select(None).into())),
];

fn choose(place: usize) -> Option<Action> {
    Some(LabellingAction::ChooseObject(place).into())
}

/// Plan and trials left, plots over the view in the middle, label and gripper right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let plan = tabs(tiles, &["plan"]);
    let trials = tabs(tiles, &["trials", "journal"]);
    let left = split(tiles, LinearDir::Vertical, [(plan, 0.45), (trials, 0.55)]);
    let [curvature, view] = ["curvature", "view"].map(|name| tabs(tiles, &[name]));
    let loads = tabs(tiles, &["pressure", "force", "line", "counts"]);
    let middle = split(tiles, LinearDir::Vertical, [(curvature, 0.28), (loads, 0.28), (view, 0.44)]);
    let label = tabs(tiles, &["label", "recognition", "why"]);
    let gripper = tabs(tiles, &["gripper", "calibration", "doctor", "fit", "training", "console"]);
    let right = split(tiles, LinearDir::Vertical, [(label, 0.56), (gripper, 0.44)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.22), (middle, 0.48), (right, 0.30)])
}
