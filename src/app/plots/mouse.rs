//! Mouse over a plot: time sought, time window.

use super::NARROWEST;
use egui::Ui;

/// Time that the mouse asks for: a click, or a drag without Shift.
pub(super) fn sought(ui: &Ui, response: &egui::Response, drag: &TimeDrag) -> Option<f64> {
    let dragged = response.dragged_by(egui::PointerButton::Primary) && !ui.input(|input| input.modifiers.shift);
    drag.pointer.filter(|_| response.clicked() || dragged)
}

/// Movement of the mouse over a plot, in time (s).
pub(super) struct TimeDrag {
    pub(super) pointer: Option<f64>,
    pub(super) dragged: f64,
    pub(super) width: f64,
}

/// New time window, where the mouse changes it.
pub(super) fn moved_window(
    ui: &Ui,
    response: &egui::Response,
    drag: &TimeDrag,
    [from, to]: [f64; 2],
    [first, last]: [f64; 2],
) -> Option<Option<[f64; 2]>> {
    if response.double_clicked() {
        return Some(None);
    }
    let shifted = |by: f64| {
        let by = by.clamp(first - from, (last - to).max(first - from));
        Some(Some([from + by, to + by]))
    };
    let shift = ui.input(|input| input.modifiers.shift);
    let panned = response.dragged() && (shift || !response.dragged_by(egui::PointerButton::Primary));
    if panned && drag.dragged != 0.0 {
        return shifted(-drag.dragged);
    }
    let wheel = ui.input(|i| i.smooth_scroll_delta().y);
    if response.hovered() && wheel != 0.0 {
        let about = drag.pointer?.clamp(from, to);
        let factor = (-f64::from(wheel) * 0.004).exp().max(NARROWEST / drag.width);
        let start = (about - (about - from) * factor).clamp(first, (last - NARROWEST).max(first));
        let end = (about + (to - about) * factor).clamp(start + NARROWEST, (start + NARROWEST).max(last));
        let whole = start <= first && end >= last;
        return Some((!whole).then_some([start, end]));
    }
    None
}
