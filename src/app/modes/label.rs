//! Label mode: record and label trials of the real gripper, from the keyboard.

use super::{ModeKind, split, tabs};
use crate::app::actions::{Act, key};
use crate::app::features::App;
use crate::app::features::view::Mode;
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};
use palpate_lab::workers::LabellingAction;

pub(super) const KIND: ModeKind = ModeKind {
    mode: Mode::Label,
    title: "Label",
    about: "Record and label trials of the real gripper (Ctrl+3)",
    layout,
    open: key(COMMAND, Key::Num3, "Label mode", |app| app.set_mode(Mode::Label)),
    keys: KEYS,
    search: Some((
        |app| app.labelling.session.draft().focus_search,
        |app, typed| app.label(LabellingAction::FocusSearch(typed)),
    )),
};

const NONE: Modifiers = Modifiers::NONE;
const COMMAND: Modifiers = Modifiers::COMMAND;

const KEYS: &[Act] = &[
    key(NONE, Key::N, "give the label and continue", |app| app.label(LabellingAction::GiveLabel)),
    key(NONE, Key::Enter, "give the label", |app| app.label(LabellingAction::GiveLabel)),
    key(NONE, Key::U, "mark the label as unsure", |app| app.label(LabellingAction::ToggleUnsure)),
    key(NONE, Key::B, "blind: hide the model's prediction until the label is given", |app| {
        app.label(LabellingAction::ToggleBlind);
    }),
    key(NONE, Key::A, "actuation: manual, board or untimed", App::next_control),
    key(NONE, Key::W, "detect trials automatically", App::toggle_watch),
    key(COMMAND, Key::E, "export all labelled trials", App::export_labelled),
    key(COMMAND, Key::T, "train on all labelled trials", App::train_and_use),
    key(NONE, Key::Slash, "find an object", |app| app.label(LabellingAction::FocusSearch(String::new()))),
    key(NONE, Key::Num1, "choose the first object; 2 to 9: the others", |app| choose(app, 0)),
    key(NONE, Key::Num2, "", |app| choose(app, 1)),
    key(NONE, Key::Num3, "", |app| choose(app, 2)),
    key(NONE, Key::Num4, "", |app| choose(app, 3)),
    key(NONE, Key::Num5, "", |app| choose(app, 4)),
    key(NONE, Key::Num6, "", |app| choose(app, 5)),
    key(NONE, Key::Num7, "", |app| choose(app, 6)),
    key(NONE, Key::Num8, "", |app| choose(app, 7)),
    key(NONE, Key::Num9, "", |app| choose(app, 8)),
    key(NONE, Key::ArrowUp, "previous trial", |app| app.label(LabellingAction::Step(-1))),
    key(NONE, Key::ArrowDown, "next trial", |app| app.label(LabellingAction::Step(1))),
    key(NONE, Key::Home, "newest unlabelled trial", |app| app.label(LabellingAction::Select(None))),
];

fn choose(app: &mut App, place: usize) {
    app.label(LabellingAction::ChooseObject(place));
}

/// Plan and trials left, plots over the view in the middle, label and gripper right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let plan = tabs(tiles, &["plan"]);
    let trials = tabs(tiles, &["trials", "journal"]);
    let left = split(tiles, LinearDir::Vertical, [(plan, 0.45), (trials, 0.55)]);
    let [curvature, view] = ["curvature", "view"].map(|name| tabs(tiles, &[name]));
    let loads = tabs(tiles, &["pressure", "force", "line", "other", "counts"]);
    let middle = split(tiles, LinearDir::Vertical, [(curvature, 0.28), (loads, 0.28), (view, 0.44)]);
    let label = tabs(tiles, &["label", "recognition", "why"]);
    let gripper = tabs(tiles, &["gripper", "calibration", "doctor", "fit", "training", "console"]);
    let right = split(tiles, LinearDir::Vertical, [(label, 0.64), (gripper, 0.36)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.22), (middle, 0.48), (right, 0.30)])
}
