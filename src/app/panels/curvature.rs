//! Curvature of both fingers over time.

use super::PanelContext;
use crate::app::actions::Action;
use crate::app::plots::{TimePlot, show};
use palpate_tactile::Quantity;

pub(super) fn ui(ui: &mut egui::Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    let curves = super::pressure::curves_of(context, Quantity::Curvature, 1.0);
    show(ui, context, actions, &TimePlot { id: "curvature", unit: "1/m", curves, least: [0.0, 8.0] });
}
