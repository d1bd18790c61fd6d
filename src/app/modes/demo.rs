//! Demo mode: grasp and recognise, live.

use super::{ModeKind, split, tabs};
use crate::app::actions::{Act, key, key_where};
use crate::app::features::App;
use crate::app::features::view::Mode;
use crate::app::playback::Seek;
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};
use palpate_lab::workers::Command;

pub(super) const KIND: ModeKind = ModeKind {
    mode: Mode::Demo,
    title: "Demo",
    about: "Grasp and recognise, live (Ctrl+1)",
    layout,
    open: key(Modifiers::COMMAND, Key::Num1, "Demo mode", |app| app.set_mode(Mode::Demo)),
    keys: KEYS,
    search: None,
};

const NONE: Modifiers = Modifiers::NONE;

const KEYS: &[Act] = &[
    key(NONE, Key::N, "next object", App::next_object),
    key_where(NONE, Key::M, "one more grasp (raise the threshold first)", |app| {
        if !app.shown().one_more() {
            return Err("One more grasp follows a higher threshold: raise it after a verdict, above the probability \
                        reached.");
        }
        app.simulation.send(Command::GraspOnceMore);
        Ok(())
    }),
    key_where(NONE, Key::K, "keep the last grasp: from the demo log to the store", |app| {
        let logged = app.logged().ok_or("The last grasp is not in the demo log.")?;
        app.library.keep(logged.trial);
        Ok(())
    }),
    key_where(NONE, Key::ArrowUp, "higher threshold", |app| move_threshold(app, 1.0)),
    key_where(NONE, Key::ArrowDown, "lower threshold", |app| move_threshold(app, -1.0)),
    key(NONE, Key::Home, "first sample", |app| app.seek(Seek::Start)),
];

/// Change of the threshold by one key press; above 99 % a tenth of it.
const STEP: f64 = 0.01;

fn move_threshold(app: &mut App, sign: f64) -> Result<(), &'static str> {
    let view = app.shown().recognised().and_then(|recognised| recognised.view);
    let now = view.ok_or("Recognition is off: there is no threshold.")?.rule.threshold;
    let fine = now + 1e-6 * sign > 0.99;
    let next = now + sign * if fine { 0.1 * STEP } else { STEP };
    // Whole steps, also after many.
    let steps = if fine { 1e3 } else { 1e2 };
    app.set_threshold((next * steps).round() / steps);
    Ok(())
}

/// Objects and scene left, the view over two plots in the middle, results right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let left = tabs(tiles, &["objects", "scene"]);
    let [view, curvature] = ["view", "curvature"].map(|name| tabs(tiles, &[name]));
    let loads = tabs(tiles, &["pressure", "force", "line", "other"]);
    let right = tabs(tiles, &["recognition", "why", "grasp", "effects", "accuracy", "gripper"]);
    let middle = split(tiles, LinearDir::Vertical, [(view, 0.58), (curvature, 0.21), (loads, 0.21)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.185), (middle, 0.555), (right, 0.26)])
}
