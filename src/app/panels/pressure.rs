//! Pressure on both pads over time, and the curves of any channel for the other plots.

use super::PanelContext;
use crate::app::actions::Action;
use crate::app::plots::{Curve, TimePlot, show};
use palpate_lab::grasping::band_half_width;
use palpate_sim::gripper::Side;
use palpate_geometry::palette::Trace;
use palpate_tactile::{Channel, Quantity};

pub(super) fn ui(ui: &mut egui::Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    let curves = curves_of(context, Quantity::Pressure, 1e-3);
    show(ui, context, actions, &TimePlot { id: "pressure", unit: "kPa", curves, least: [0.0, 10.0] });
}

/// The curves of all channels of one kind, their values multiplied by `factor`.
pub(super) fn curves_of(context: &PanelContext<'_>, quantity: Quantity, factor: f64) -> Vec<Curve> {
    let channels = context.channels().iter().enumerate();
    channels
        .filter(|(_, channel)| channel.quantity == quantity)
        .map(|(index, channel)| Curve {
            name: label(channel),
            trace: trace_of(channel),
            dashed: channel.side == Side::Right,
            values: Box::new(move |trace, k| trace.channels.get(index)?.get(k).map(|value| f64::from(*value) * factor)),
            half_width: Box::new(move |trace, k| {
                band_half_width(&trace.t, trace.errors.get(index)?, k).map(|half| half * factor)
            }),
        })
        .collect()
}

/// Place and finger, with a word on the line's look, since the legend shows only its colour.
fn label(channel: &Channel) -> String {
    let name = channel.name();
    let place = name.trim_start_matches(channel.quantity.name()).trim_start_matches('_').replace('_', " ");
    if channel.side == Side::Right { format!("{place}, dashed") } else { place }
}

/// The shade for where on the finger the channel reads.
fn trace_of(channel: &Channel) -> Trace {
    let distal = channel.span.ends().0 >= 0.5;
    match (channel.quantity, distal) {
        (Quantity::Curvature, false) => Trace::Curvature,
        (Quantity::Curvature, true) => Trace::CurvatureDistal,
        (Quantity::Pressure | Quantity::Force, false) => Trace::Pressure,
        (Quantity::Pressure | Quantity::Force, true) => Trace::PressureDistal,
    }
}
