//! Raw ADC counts of the real gripper's board, channel by channel.

use crate::app::actions::Actions;
use crate::app::context::PanelContext;
use crate::app::plots::{PlotCurve, TimePlot, show};
use crate::app::view_source::ViewSource;
use palpate_geometry::palette::Trace;
use palpate_tactile::board::Sensor;

pub(super) fn ui(ui: &mut egui::Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    let link = context.gripper.and_then(|gripper| gripper.link.as_ref());
    let Some(link) = link.filter(|_| context.source == ViewSource::Gripper) else {
        ui.weak("Raw ADC counts. Connect the board in the panel Gripper.");
        return;
    };
    let derived = context.shown().channels().len();
    let curves = link.board.channels.iter().enumerate().map(|(place, name)| {
        let sensor = Sensor::ALL.into_iter().find(|sensor| link.board.channel_of(*sensor) == Some(place));
        let (trace, dashed) = look(sensor, place);
        PlotCurve {
            name: if dashed { format!("{name}, dashed") } else { name.clone() },
            trace,
            dashed,
            values: Box::new(move |trace, k| trace.channels.get(derived + place)?.get(k).map(|v| f64::from(*v))),
            half_width: Box::new(|_, _| None),
        }
    });
    show(
        ui,
        context,
        actions,
        &TimePlot { id: "counts", unit: "counts", curves: curves.collect(), least: [0.0, 100.0] },
    );
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
