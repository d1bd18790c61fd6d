//! Curves of the channels of one quantity, for the plots.

use crate::app::context::PanelContext;
use crate::app::plots::PlotCurve;
use palpate_geometry::palette::Trace;
use palpate_lab::grasping::band_half_width;
use palpate_sim::gripper::Side;
use palpate_tactile::{Channel, Quantity};

/// Curves of all channels of a quantity, their values multiplied by `factor`.
pub(super) fn channel_curves(context: &PanelContext<'_>, quantity: Quantity, factor: f64) -> Vec<PlotCurve> {
    let channels = context.shown().channels().iter().enumerate();
    channels
        .filter(|(_, channel)| channel.quantity == quantity)
        .map(|(index, channel)| PlotCurve {
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

/// Span and finger; the legend shows only colours, so the name mentions a dashed line.
fn label(channel: &Channel) -> String {
    let name = channel.name();
    let place = name.trim_start_matches(channel.quantity.name()).trim_start_matches('_').replace('_', " ");
    if channel.side == Side::Right { format!("{place}, dashed") } else { place }
}

/// Colour by quantity and span.
fn trace_of(channel: &Channel) -> Trace {
    let distal = channel.span.ends().0 >= 0.5;
    match (channel.quantity, distal) {
        (Quantity::Curvature, false) => Trace::Curvature,
        (Quantity::Curvature, true) => Trace::CurvatureDistal,
        (Quantity::Pressure | Quantity::Force, false) => Trace::Pressure,
        (Quantity::Pressure | Quantity::Force, true) => Trace::PressureDistal,
    }
}
