//! Sensors drawn on the fingers: flex strips along the back and outlines of the pads, in the colours of their traces.

use palpate_geometry::drawing::{FingerSensors, SensorStrip};
use palpate_geometry::palette::{Theme, Trace};
use palpate_sim::gripper::{GripperModel, Side};
use palpate_tactile::{Quantity, SensorLayout, Sensors, SignalDefinition};

/// Sensors of a layout on a finger of this gripper; none for a layout that does not fit it. Both fingers have the same.
pub(super) fn on_finger(layout: &SensorLayout, gripper: &GripperModel, theme: Theme) -> FingerSensors {
    let Ok(sensors) = Sensors::new(layout, gripper, SignalDefinition::Parts) else { return FingerSensors::default() };
    let of = |quantity: Quantity| {
        let channels = sensors.channels().iter();
        channels.filter(move |channel| channel.side() == Some(Side::Left) && channel.quantity == quantity)
    };
    let colours = [Trace::Curvature, Trace::CurvatureDistal].map(|trace| trace.colour(theme));
    let strip = |(k, channel)| SensorStrip {
        stretch: sensors.stretch(channel).map(|metres| metres as f32),
        colour: colours[usize::min(k, 1)],
    };
    FingerSensors {
        strips: of(Quantity::Curvature).enumerate().map(strip).collect(),
        pads: of(Quantity::Pressure).count() as u32,
        pad_colours: [Trace::Pressure, Trace::PressureDistal].map(|trace| trace.colour(theme)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layout_has_its_strips_and_pads() {
        let gripper = GripperModel::default();
        let drawn = |name| on_finger(&SensorLayout::named(name).expect("known"), &gripper, Theme::Dark);
        let simplest = drawn("C1");
        assert_eq!((simplest.strips.len(), simplest.pads), (1, 1));
        let [from, to] = simplest.strips[0].stretch;
        assert!((from - 0.02223).abs() < 1e-5 && (to - 0.0776).abs() < 1e-5, "{from} {to}");
        let fine = drawn("C8");
        assert_eq!((fine.strips.len(), fine.pads), (2, gripper.finger.joints as u32));
        assert_eq!(fine.strips[1].stretch, [0.05, 0.1]);
        assert_ne!(fine.strips[0].colour, fine.strips[1].colour);
    }
}
