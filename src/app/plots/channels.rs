//! Curves of the channels of one quantity.

use super::PlotCurve;
use crate::app::shown::DisplayedData;
use crate::app::traces::GraspTrace;
use palpate_geometry::palette::Trace;
use palpate_lab::grasping::band_half_width;
use palpate_tactile::board::Board;
use palpate_tactile::{Channel, Quantity, unit_of_channel};

/// Curves of all channels of a quantity (of a pressure also the contact pressure), their values multiplied by `factor`, and
/// their unit; or the raw counts of their sensors, where those are chosen or are all that was read.
pub(in crate::app) fn channel_curves<'a>(
    data: &DisplayedData<'_>,
    quantity: Quantity,
    (factor, unit): (f64, &'a str),
) -> (Vec<PlotCurve>, &'a str) {
    let physical = physical_curves(data, quantity, factor);
    let nothing = || data.traces.current().is_some_and(|trace| is_empty(trace, &physical));
    match data.board().filter(|_| data.view.raw || nothing()) {
        Some(board) => (raw_curves(data, board, quantity), COUNTS),
        None => (physical, unit),
    }
}

/// Unit of raw readings.
pub(super) const COUNTS: &str = "counts";

/// No curve has a number in a trace that is more than a beginning.
pub(super) fn is_empty(trace: &GraspTrace, curves: &[PlotCurve]) -> bool {
    let number = |k: usize| curves.iter().any(|curve| (curve.values)(trace, k).is_some_and(f64::is_finite));
    trace.t.len() > 5 && !(0..trace.t.len()).any(number)
}

/// Curves of the counts of the sensors that measure a quantity.
fn raw_curves(data: &DisplayedData<'_>, board: &Board, quantity: Quantity) -> Vec<PlotCurve> {
    let derived = data.channels().iter().filter(|channel| channel.is_some()).count();
    let quantity = if quantity == Quantity::Force { Quantity::Pressure } else { quantity };
    let shown = board.sensors.channels().into_iter().filter(|channel| shows(quantity, channel)).enumerate();
    let curve = |(place, channel): (usize, Channel)| {
        let (trace, dashed) = look(&channel, place);
        let sensor = board.sensors.iter().find(|sensor| sensor.gives(&channel))?;
        let column = derived + board.channel_of(sensor)?;
        Some(PlotCurve {
            name: label(&channel),
            trace,
            dashed,
            values: Box::new(move |trace, k| trace.channels.get(column)?.get(k).map(|value| f64::from(*value))),
            half_width: Box::new(|_, _| None),
            channel: None,
        })
    };
    shown.filter_map(curve).collect()
}

/// Colour and dash: by quantity and span, dashed for all fingers but the left one. Raw channels, numbered by `place`, take
/// turns.
fn look(channel: &Channel, place: usize) -> (Trace, bool) {
    match channel.quantity {
        Quantity::Raw { .. } => (Trace::ALL[place % Trace::ALL.len()], place % 2 == 1),
        _ => (colour_of(channel), !channel.finger.is_empty() && channel.finger != "left"),
    }
}

fn physical_curves(data: &DisplayedData<'_>, quantity: Quantity, factor: f64) -> Vec<PlotCurve> {
    let channels = data.channels();
    let channels = channels.into_iter().enumerate().filter_map(|(index, channel)| Some((index, channel?)));
    channels
        .filter(|(_, channel)| shows(quantity, channel))
        .enumerate()
        .map(|(place, (index, channel))| {
            let (trace, dashed) = look(channel, place);
            PlotCurve {
                name: label(channel),
                trace,
                dashed,
                values: Box::new(move |trace, k| {
                    trace.channels.get(index)?.get(k).map(|value| f64::from(*value) * factor)
                }),
                half_width: Box::new(move |trace, k| {
                    band_half_width(&trace.t, trace.errors.get(index)?, k).map(|half| half * factor)
                }),
                channel: Some((channel.name(), factor)),
            }
        })
        .collect()
}

/// True where a channel measures a quantity; a contact pressure does in place of a pad's, and any raw channel of another.
pub(in crate::app) fn shows(quantity: Quantity, channel: &Channel) -> bool {
    let raw = |quantity: Quantity| matches!(quantity, Quantity::Raw { .. });
    channel.quantity == quantity
        || (quantity.is_pressure() && channel.quantity.is_pressure())
        || (raw(quantity) && raw(channel.quantity))
}

/// Finger and span.
fn label(channel: &Channel) -> String {
    let name = channel.name();
    if let Quantity::Raw { .. } = channel.quantity {
        return unit_of_channel(&name).0.to_owned();
    }
    let place = name.trim_start_matches(channel.quantity.name()).trim_start_matches('_').replace('_', " ");
    if channel.quantity == Quantity::ContactPressure { format!("contact, {place}") } else { place }
}

/// Colour by quantity and span.
pub(in crate::app) fn colour_of(channel: &Channel) -> Trace {
    let distal = channel.span.ends().0 >= 0.5;
    match (channel.quantity, distal) {
        (Quantity::Curvature, false) => Trace::Curvature,
        (Quantity::Curvature, true) => Trace::CurvatureDistal,
        (Quantity::Pressure | Quantity::ContactPressure | Quantity::Force, false) => Trace::Pressure,
        (Quantity::Pressure | Quantity::ContactPressure | Quantity::Force, true) => Trace::PressureDistal,
        (Quantity::Raw { .. }, _) => Trace::Line,
    }
}
