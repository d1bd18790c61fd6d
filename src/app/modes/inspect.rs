//! Inspect mode: look back on stored trials.

use super::{ModeKind, split, tabs};
use crate::app::actions::{Act, key};
use crate::app::features::App;
use crate::app::features::view::Mode;
use crate::app::playback::Seek;
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};
use palpate_lab::inspection::{Alignment, FigureOptions};
use palpate_store::labels::TrialEdit;

pub(super) const KIND: ModeKind = ModeKind {
    mode: Mode::Inspect,
    title: "Inspect",
    about: "Open, replay, compare and explain stored trials (Ctrl+2)",
    layout,
    open: key(Modifiers::COMMAND, Key::Num2, "Inspect mode", |app| app.set_mode(Mode::Inspect)),
    keys: KEYS,
    search: Some((|app| app.library.selection.focus_search, |app, typed| app.search_library(&typed))),
};

const NONE: Modifiers = Modifiers::NONE;
const SHIFT: Modifiers = Modifiers::SHIFT;
const COMMAND: Modifiers = Modifiers::COMMAND;

const KEYS: &[Act] = &[
    key(NONE, Key::Slash, "search the library", |app| app.search_library("")),
    // Those with more modifiers come first, so that they win.
    key(SHIFT, Key::ArrowUp, "select the trial above too", |app| app.library.step(-1, true)),
    key(SHIFT, Key::ArrowDown, "select the trial below too", |app| app.library.step(1, true)),
    key(NONE, Key::ArrowUp, "trial above", |app| app.library.step(-1, false)),
    key(NONE, Key::ArrowDown, "trial below", |app| app.library.step(1, false)),
    key(COMMAND, Key::A, "select all trials found", |app| app.library.select_all()),
    key(NONE, Key::Enter, "open the trial", App::open_selected),
    key(NONE, Key::P, "compare the selected trials, or no longer", App::pin_selected),
    key(NONE, Key::K, "keep the selected trials: from the demo log to the store", |app| {
        app.library.edit(TrialEdit::Keep);
    }),
    key(NONE, Key::Delete, "discard the selected trials", |app| app.library.edit(TrialEdit::Discard)),
    key(NONE, Key::Home, "first sample", |app| app.seek(Seek::Start)),
    key(SHIFT, Key::A, "mark A at the cursor", |app| app.put_mark(0)),
    key(SHIFT, Key::B, "mark B at the cursor", |app| app.put_mark(1)),
    key(SHIFT.plus(COMMAND), Key::E, "export the selected trials, or the one shown: MCAP, NPZ, Parquet, CSV", |app| {
        app.export_trials(false);
    }),
    key(COMMAND, Key::E, "export a figure of the trial and those compared with it", |app| {
        app.export_figure(FigureOptions::default());
    }),
    key(NONE, Key::L, "repeat, between the marks where both are set", App::toggle_repeat),
    key(NONE, Key::M, "origin of compared trials: start or contact", |app| {
        app.inspect.alignment = match app.inspect.alignment {
            Alignment::Closing => Alignment::Contact,
            Alignment::Contact => Alignment::Closing,
        };
        app.notices.info(format!("Compared trials are aligned at {}.", app.inspect.alignment.name()));
    }),
    key(NONE, Key::S, "mean and spread of each class, or each trial", |app| app.inspect.spread = !app.inspect.spread),
];

/// Trials left, the view over plots in the middle, answers and facts right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let library = tabs(tiles, &["library"]);
    let compared = tabs(tiles, &["compared", "sensors"]);
    let left = split(tiles, LinearDir::Vertical, [(library, 0.52), (compared, 0.48)]);
    let [view, curvature] = [&["view"][..], &["curvature", "signature"]].map(|names| tabs(tiles, names));
    let loads = tabs(tiles, &["pressure", "force", "line", "other", "counts", "hysteresis", "pads"]);
    let right = tabs(tiles, &["recognition", "why", "trial"]);
    let middle = split(tiles, LinearDir::Vertical, [(view, 0.42), (curvature, 0.29), (loads, 0.29)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.22), (middle, 0.52), (right, 0.26)])
}
