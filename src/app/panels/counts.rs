//! What the board of the real gripper counts, channel by channel, before any calibration.

use super::{PanelContext, Source};
use crate::app::actions::Action;
use crate::app::plots::{Curve, TimePlot, show};
use palpate_tactile::board::Sensor;
use palpate_geometry::palette::Trace;

pub(super) fn ui(ui: &mut egui::Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    let link = context.gripper.and_then(|gripper| gripper.link.as_ref());
    let Some(link) = link.filter(|_| context.source == Source::Gripper) else {
        ui.weak("Counts of the real gripper's board: connect it in the panel Gripper.");
        return;
    };
    let derived = context.channels().len();
    let curves = link.board.channels.iter().enumerate().map(|(place, name)| {
        let sensor = Sensor::ALL.into_iter().find(|sensor| link.board.channel_of(*sensor) == Some(place));
        let (trace, dashed) = look(sensor, place);
        Curve {
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

/// Sensors look as everywhere; channels that are wired to something else take turns.
fn look(sensor: Option<Sensor>, place: usize) -> (Trace, bool) {
    match sensor {
        Some(Sensor::FlexLeft) => (Trace::Curvature, false),
        Some(Sensor::FlexRight) => (Trace::Curvature, true),
        Some(Sensor::PadLeft) => (Trace::Pressure, false),
        Some(Sensor::PadRight) => (Trace::Pressure, true),
        None => ([Trace::Line, Trace::CurvatureDistal, Trace::PressureDistal][place % 3], place % 2 == 1),
    }
}
