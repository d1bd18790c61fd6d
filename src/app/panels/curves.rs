//! Curves over time: curvature, pressure and force of both fingers, other channels, line pressure, and raw counts.

use crate::app::actions::Actions;
use crate::app::plots::{PlotCurve, TimePlot, channel_curves, show};
use crate::app::shown::DisplayedData;
use egui::Ui;
use palpate_geometry::palette::Trace;
use palpate_tactile::board::{Sensor, SensorKind};
use palpate_tactile::{Quantity, unit_of_channel};

/// Range of values whose quantity is not known.
const ANY_RANGE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

pub(super) fn curvature_ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let (curves, unit) = channel_curves(data, Quantity::Curvature, (1.0, "1/m"));
    show(ui, data, actions, TimePlot { id: "curvature", unit, curves, least: [0.0, 8.0] });
}

pub(super) fn pressure_ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let (curves, unit) = channel_curves(data, Quantity::Pressure, (1e-3, "kPa"));
    show(ui, data, actions, TimePlot { id: "pressure", unit, curves, least: [0.0, 10.0] });
}

pub(super) fn force_ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let (curves, unit) = channel_curves(data, Quantity::Force, (1.0, "N"));
    show(ui, data, actions, TimePlot { id: "force", unit, curves, least: [0.0, 0.5] });
}

/// Channels that are neither curvature nor pressure nor force: a plot for each unit.
pub(super) fn other_ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let (curves, counts) = channel_curves(data, Quantity::Raw { dimension: None, measures: None }, (1.0, ""));
    let mut plots: Vec<(&str, Vec<PlotCurve>)> = Vec::new();
    for curve in curves {
        let unit = curve.channel.as_ref().map_or(counts, |(name, _)| unit_of_channel(name).1);
        match plots.iter_mut().find(|(other, _)| *other == unit) {
            Some((_, curves)) => curves.push(curve),
            None => plots.push((unit, vec![curve])),
        }
    }
    if plots.is_empty() {
        ui.weak("No other channels. Sensors of kind raw and other columns of imported tables appear here.");
    }
    let height = (ui.available_height() - ui.spacing().item_spacing.y * plots.len() as f32) / plots.len().max(1) as f32;
    for (unit, curves) in plots {
        let id = format!("other channels {unit}");
        ui.allocate_ui(egui::vec2(ui.available_width(), height), |ui| {
            show(ui, data, actions, TimePlot { id: &id, unit, curves, least: ANY_RANGE });
        });
    }
}

pub(super) fn line_pressure_ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
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

/// Raw ADC counts of the real gripper's board, channel by channel.
pub(super) fn counts_ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let Some(board) = data.board() else {
        ui.weak("Raw ADC counts. Connect the board in the panel Gripper, or open a trial of it.");
        return;
    };
    let derived = data.channels().iter().filter(|channel| channel.is_some()).count();
    let curves = board.channels.iter().enumerate().map(|(place, name)| {
        let sensor = board.sensor_of(place);
        let (trace, dashed) = look(sensor, place);
        PlotCurve {
            name: name.clone(),
            trace,
            dashed,
            values: Box::new(move |trace, k| trace.channels.get(derived + place)?.get(k).map(|v| f64::from(*v))),
            half_width: Box::new(|_, _| None),
            channel: None,
        }
    });
    let curves = curves.collect();
    show(ui, data, actions, TimePlot { id: "counts", unit: "counts", curves, least: [0.0, 100.0] });
}

/// Colour and dash: those of the sensor; other channels take turns.
fn look(sensor: Option<Sensor>, place: usize) -> (Trace, bool) {
    match sensor.map(|sensor| (sensor.kind(), sensor.finger() != "left")) {
        Some((SensorKind::Flex, dashed)) => (Trace::Curvature, dashed),
        Some((SensorKind::Pad, dashed)) => (Trace::Pressure, dashed),
        Some((SensorKind::Raw, _)) | None => {
            ([Trace::Line, Trace::CurvatureDistal, Trace::PressureDistal][place % 3], place % 2 == 1)
        }
    }
}
