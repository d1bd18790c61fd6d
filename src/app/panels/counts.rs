//! Raw ADC counts of the real gripper's board, channel by channel.

use crate::app::actions::Actions;
use crate::app::plots::{PlotCurve, TimePlot, show};
use crate::app::shown::DisplayedData;
use palpate_geometry::palette::Trace;
use palpate_tactile::board::Sensor;

pub(super) fn ui(ui: &mut egui::Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let Some(board) = data.board() else {
        ui.weak("Raw ADC counts. Connect the board in the panel Gripper, or open a trial of it.");
        return;
    };
    let derived = data.channels().iter().filter(|channel| channel.is_some()).count();
    let curves = board.channels.iter().enumerate().map(|(place, name)| {
        let sensor = Sensor::ALL.into_iter().find(|sensor| board.channel_of(*sensor) == Some(place));
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
    match sensor {
        Some(Sensor::FlexLeft) => (Trace::Curvature, false),
        Some(Sensor::FlexRight) => (Trace::Curvature, true),
        Some(Sensor::PadLeft) => (Trace::Pressure, false),
        Some(Sensor::PadRight) => (Trace::Pressure, true),
        None => ([Trace::Line, Trace::CurvatureDistal, Trace::PressureDistal][place % 3], place % 2 == 1),
    }
}
