//! Study mode: run the studies of the paper, look at their figures, and open the trials behind them.

use super::mode::Mode;
use super::{ModeKind, split, tabs};
use crate::app::actions::Action;
use crate::app::context::PanelContext;
use crate::app::features::files::FileAction;
use crate::app::features::studies::StudyAction;
use crate::app::features::view::ViewAction;
use crate::app::keys::binding::{Binding, key};
use egui::{Key, Modifiers};
use egui_tiles::{LinearDir, TileId, Tiles};
use palpate_lab::study::paper::StudySize;
use palpate_lab::workers::StudyRequest;

pub(super) const KIND: ModeKind = ModeKind {
    mode: Mode::Study,
    title: "Study",
    about: "Run the studies of the paper and open the trials behind their figures (Ctrl+4)",
    layout,
    open: key(Modifiers::COMMAND, Key::Num4, "Study mode", |_| Some(ViewAction::SetMode(Mode::Study).into())),
    keys: KEYS,
    typed: |_, _| None,
};

const KEYS: &[Binding] = &[
    // Those with more modifiers come first, so that they win.
    key(Modifiers::SHIFT, Key::Enter, "run the study in full", |c| run(c, StudySize::Full)),
    key(Modifiers::NONE, Key::Enter, "run the study in its quick form", |c| run(c, StudySize::Quick)),
    key(Modifiers::NONE, Key::Delete, "stop the running study, which can be resumed", |c| {
        c.studies.running()?;
        Some(StudyAction::Stop.into())
    })
    .otherwise("No study is running."),
    key(Modifiers::NONE, Key::ArrowUp, "study above", |_| Some(StudyAction::Step(-1).into())),
    key(Modifiers::NONE, Key::ArrowDown, "study below", |_| Some(StudyAction::Step(1).into())),
    key(Modifiers::COMMAND, Key::E, "export the figure that is shown", |_| Some(FileAction::ExportStudyFigure.into())),
];

fn run(context: &PanelContext<'_>, size: StudySize) -> Option<Action> {
    let key = context.studies.chosen().card().key.to_owned();
    Some(StudyAction::Run(StudyRequest { key, size, anew: false }).into())
}

/// Studies left, figures over tables in the middle, findings right.
fn layout(tiles: &mut Tiles<String>) -> TileId {
    let [list, figure, tables, findings] =
        ["studies", "study-figure", "study-tables", "study-findings"].map(|name| tabs(tiles, &[name]));
    let middle = split(tiles, LinearDir::Vertical, [(figure, 0.66), (tables, 0.34)]);
    split(tiles, LinearDir::Horizontal, [(list, 0.23), (middle, 0.51), (findings, 0.26)])
}
