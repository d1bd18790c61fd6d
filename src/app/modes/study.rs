//! Study mode: run studies, look at their figures, and open the trials behind them.

use super::{ModeKind, split, tabs};
use crate::app::actions::{Act, key, key_where};
use crate::app::features::App;
use crate::app::features::view::Mode;
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};
use palpate_study::StudySize;
use palpate_study::jobs::StudyRequest;

pub(super) const KIND: ModeKind = ModeKind {
    mode: Mode::Study,
    title: "Study",
    about: "Run the studies of the paper and open the trials behind their figures (Ctrl+4)",
    layout,
    open: key(Modifiers::COMMAND, Key::Num4, "Study mode", |app| app.set_mode(Mode::Study)),
    keys: KEYS,
    search: None,
};

const NONE: Modifiers = Modifiers::NONE;

const KEYS: &[Act] = &[
    // Those with more modifiers come first, so that they win.
    key(Modifiers::SHIFT, Key::Enter, "run the study in full", |app| run(app, StudySize::Full)),
    key(NONE, Key::Enter, "run the study in its quick form", |app| run(app, StudySize::Quick)),
    key_where(NONE, Key::Delete, "stop the running study, which can be resumed", |app| {
        app.studies.running().ok_or("No study is running.")?;
        app.studies.stop();
        Ok(())
    }),
    key(NONE, Key::ArrowUp, "study above", |app| app.studies.step(-1)),
    key(NONE, Key::ArrowDown, "study below", |app| app.studies.step(1)),
    key(Modifiers::COMMAND, Key::E, "export the figure that is shown", App::export_study_figure),
];

fn run(app: &mut App, size: StudySize) {
    let key = app.studies.chosen().card().key.to_owned();
    app.run_study(StudyRequest { key, size, anew: false });
}

/// Studies left, figures over tables in the middle, findings right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let [list, figure, tables, findings] =
        ["studies", "study-figure", "study-tables", "study-findings"].map(|name| tabs(tiles, &[name]));
    let middle = split(tiles, LinearDir::Vertical, [(figure, 0.66), (tables, 0.34)]);
    split(tiles, LinearDir::Horizontal, [(list, 0.23), (middle, 0.51), (findings, 0.26)])
}
