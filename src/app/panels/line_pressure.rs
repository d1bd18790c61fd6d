//! Commanded line pressure over time.

use super::PanelContext;
use crate::app::actions::Action;
use crate::app::plots::{Curve, TimePlot, show};
use palpate_geometry::palette::Trace;

pub(super) fn ui(ui: &mut egui::Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    let curve = Curve {
        name: "line".to_owned(),
        trace: Trace::Line,
        dashed: false,
        values: Box::new(|trace, k| trace.line_bar.get(k).copied()),
        half_width: Box::new(|_, _| None),
    };
    show(ui, context, actions, &TimePlot { id: "line pressure", unit: "bar", curves: vec![curve], least: [0.0, 1.0] });
}
