//! Curvature of both fingers over time.

use crate::app::actions::Actions;
use crate::app::channel_curves::channel_curves;
use crate::app::plots::{TimePlot, show};
use crate::app::shown::DisplayedData;
use palpate_tactile::Quantity;

pub(super) fn ui(ui: &mut egui::Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let (curves, unit) = channel_curves(data, Quantity::Curvature, (1.0, "1/m"));
    show(ui, data, actions, TimePlot { id: "curvature", unit, curves, least: [0.0, 8.0] });
}
