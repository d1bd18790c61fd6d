//! Line pressure over time.

use crate::app::actions::Actions;
use crate::app::plots::{PlotCurve, TimePlot, show};
use crate::app::shown::DisplayedData;
use palpate_geometry::palette::Trace;

pub(super) fn ui(ui: &mut egui::Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let curve = PlotCurve {
        name: "line".to_owned(),
        trace: Trace::Line,
        dashed: false,
        values: Box::new(|trace, k| trace.line_bar.get(k).copied()),
        half_width: Box::new(|_, _| None),
        channel: None,
    };
    show(ui, data, actions, TimePlot { id: "line pressure", unit: "bar", curves: vec![curve], least: [0.0, 1.0] });
}
