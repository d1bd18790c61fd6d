//! Inspect mode: look back on stored trials.

use super::mode::Mode;
use super::{ModeKind, split, tabs};
use crate::app::features::files::FileAction;
use crate::app::features::inspect::InspectAction;
use crate::app::features::library::LibraryAction;
use crate::app::features::view::ViewAction;
use crate::app::keys::binding::{Binding, key, typed_ahead};
use crate::app::playback::Seek;
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};
use palpate_lab::inspection::FigureOptions;
use palpate_store::labels::TrialEdit;

pub(super) const KIND: ModeKind = ModeKind {
    mode: Mode::Inspect,
    title: "Inspect",
    about: "Open, replay, compare and explain stored trials (Ctrl+2)",
    layout,
    open: key(Modifiers::COMMAND, Key::Num2, "Inspect mode", |_| Some(ViewAction::SetMode(Mode::Inspect).into())),
    keys: KEYS,
    typed: |ctx, context| {
        typed_ahead(ctx, context.picked.focus_search).map(|typed| LibraryAction::FocusSearch(typed).into())
    },
};

const KEYS: &[Binding] = &[
    key(Modifiers::NONE, Key::Slash, "search the library", |_| Some(LibraryAction::FocusSearch(String::new()).into())),
    // Those with more modifiers come first, so that they win.
    key(Modifiers::SHIFT, Key::ArrowUp, "select the trial above too", |_| Some(LibraryAction::Step(-1, true).into())),
    key(Modifiers::SHIFT, Key::ArrowDown, "select the trial below too", |_| Some(LibraryAction::Step(1, true).into())),
    key(Modifiers::NONE, Key::ArrowUp, "trial above", |_| Some(LibraryAction::Step(-1, false).into())),
    key(Modifiers::NONE, Key::ArrowDown, "trial below", |_| Some(LibraryAction::Step(1, false).into())),
    key(Modifiers::COMMAND, Key::A, "select all trials found", |_| Some(LibraryAction::SelectAll.into())),
    key(Modifiers::NONE, Key::Enter, "open the trial", |_| Some(LibraryAction::Open.into())),
    key(Modifiers::NONE, Key::P, "compare the selected trials, or no longer", |_| Some(LibraryAction::Pin.into())),
    key(Modifiers::NONE, Key::K, "keep the selected trials: from the demo log to the store", |_| {
        Some(LibraryAction::Edit(TrialEdit::Keep).into())
    }),
    key(Modifiers::NONE, Key::Delete, "discard the selected trials", |_| {
        Some(LibraryAction::Edit(TrialEdit::Discard).into())
    }),
    key(Modifiers::NONE, Key::Home, "first sample", |_| Some(InspectAction::Seek(Seek::Start).into())),
    key(Modifiers::SHIFT, Key::A, "mark A at the cursor", |_| Some(InspectAction::PutMark(0).into())),
    key(Modifiers::SHIFT, Key::B, "mark B at the cursor", |_| Some(InspectAction::PutMark(1).into())),
    key(Modifiers::COMMAND, Key::E, "export a figure of the trial and those compared with it", |_| {
        Some(FileAction::ExportFigure(FigureOptions::default()).into())
    }),
    key(Modifiers::NONE, Key::L, "repeat, between the marks where both are set", |_| {
        Some(InspectAction::ToggleRepeat.into())
    }),
    key(Modifiers::NONE, Key::M, "origin of compared trials: start or contact", |c| {
        Some(InspectAction::Align(c.next_alignment()).into())
    }),
    key(Modifiers::NONE, Key::S, "mean and spread of each class, or each trial", |c| {
        Some(InspectAction::ShowSpread(!c.comparison.spread).into())
    }),
];

/// Trials left, the view over plots in the middle, answers and facts right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let library = tabs(tiles, &["library"]);
    let compared = tabs(tiles, &["compared", "sensors"]);
    let left = split(tiles, LinearDir::Vertical, [(library, 0.72), (compared, 0.28)]);
    let [view, curvature] = [&["view"][..], &["curvature", "signature"]].map(|names| tabs(tiles, names));
    let loads = tabs(tiles, &["pressure", "force", "line", "counts", "hysteresis", "pads"]);
    let right = tabs(tiles, &["recognition", "why", "trial"]);
    let middle = split(tiles, LinearDir::Vertical, [(view, 0.42), (curvature, 0.29), (loads, 0.29)]);
    split(tiles, LinearDir::Horizontal, [(left, 0.22), (middle, 0.52), (right, 0.26)])
}
