//! Line pressure over time.

use crate::app::actions::Actions;
use crate::app::context::PanelContext;
use crate::app::plots::{PlotCurve, TimePlot, show};
use palpate_geometry::palette::Trace;

pub(super) fn ui(ui: &mut egui::Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    let curve = PlotCurve {
        name: "line".to_owned(),
        trace: Trace::Line,
        dashed: false,
        values: Box::new(|trace, k| trace.line_bar.get(k).copied()),
        half_width: Box::new(|_, _| None),
        channel: None,
    };
    show(ui, context, actions, TimePlot { id: "line pressure", unit: "bar", curves: vec![curve], least: [0.0, 1.0] });
}
