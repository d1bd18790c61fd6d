//! The circle that each flex strip reads: one number, drawn through the middle of the strip along the finger.
//!
//! Curvature is 1 / radius (paper, section IV-A1). The finger follows the circle where it bends evenly; where it does not,
//! the gap between them is what the strip cannot tell.

use super::annotations::{Annotator, Plate};
use glam::{DVec3, Vec2};
use palpate_geometry::Pose;
use palpate_geometry::drawing::Align;
use palpate_geometry::palette::{Rgb, Trace};
use palpate_geometry::units;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};
use palpate_tactile::{Quantity, SensorLayout, Sensors, SignalDefinition};

/// Curvature below which a circle is too large to be seen as one (1/m).
const STRAIGHT: f64 = 0.5;
/// Length of the arc beyond each end of its strip (m), and of its pieces.
const BEYOND: f64 = 0.022;
const PIECE: f64 = 0.0025;
/// Width of the line and height of the number (points).
const WIDTH: f32 = 2.0;
const TEXT: f32 = 14.0;
/// Distance of a number from the finger's back (points).
const GAP: f32 = 14.0;
/// Least height of a picture with numbers (points).
const LEAST_HEIGHT: f32 = 240.0;

/// Number of a circle: where it is wanted, outside of the finger's back.
pub(super) struct CircleNumber {
    back: Vec2,
    outward: Vec2,
    curvature: f64,
    colour: Rgb,
}

/// Draws the circle of each strip of a layout, dashed on the right finger as its curves are; returns their numbers.
pub(super) fn add(
    annotator: &mut Annotator<'_>,
    layout: &SensorLayout,
    gripper: &GripperModel,
    world_from_gripper: &Pose,
    frame: &Frame,
) -> Vec<CircleNumber> {
    let Ok(sensors) = Sensors::new(layout, gripper, SignalDefinition::Parts) else { return Vec::new() };
    let mut numbers = Vec::new();
    let view = annotator.view;
    let on_picture = view.camera.projector(view.size);
    let values = sensors.read(frame);
    let strips = sensors.channels().iter().zip(values).filter(|(channel, _)| channel.quantity == Quantity::Curvature);
    for (channel, value) in strips {
        let Some(side) = channel.side() else { continue };
        let Some(curvature) = value.filter(|kappa| kappa.is_finite() && kappa.abs() >= STRAIGHT) else { continue };
        let stretch = sensors.stretch(channel);
        let trace = if stretch[0] < 0.45 * gripper.finger.length { Trace::Curvature } else { Trace::CurvatureDistal };
        let colour = trace.colour(view.theme);
        let points: Vec<Option<Vec2>> = arc(gripper, frame, side, stretch, curvature)
            .into_iter()
            .map(|point| on_picture(world_from_gripper.point(point).as_vec3()))
            .collect();
        for (k, pair) in points.windows(2).enumerate() {
            let dashed = side == Side::Right && k % 3 == 2;
            if let ([Some(a), Some(b)], false) = (pair, dashed) {
                annotator.overlay.line(*a, *b, WIDTH, colour);
            }
        }
        if let (Some(Some(begin)), Some(Some(middle)), Some(Some(end))) =
            (points.first(), points.get(points.len() / 2), points.last())
        {
            let outward = (*middle - 0.5 * (*begin + *end)).normalize_or(Vec2::X);
            let back = (gripper.finger.back as f32) * view.size.y / view.camera.height_at_target();
            numbers.push(CircleNumber { back: *middle + outward * back, outward, curvature, colour });
        }
    }
    numbers
}

/// Points of the circle of a curvature (1/m) that touches the finger in the middle of a stretch, from the palm's side to
/// the tip's and beyond (m).
fn arc(gripper: &GripperModel, frame: &Frame, side: Side, [from, to]: [f64; 2], curvature: f64) -> Vec<DVec3> {
    let placed = frame.placed(gripper, side);
    let middle = 0.5 * (from + to);
    let (mut segment, mut begins) = (0, 0.0);
    while segment + 1 < placed.lengths.len() && begins + placed.lengths[segment] < middle {
        begins += placed.lengths[segment];
        segment += 1;
    }
    let at = placed.point(segment, middle - begins, 0.0, 0.0);
    let axes = placed.axes(segment);
    let (along, inward) = (axes.x_axis, axes.z_axis);
    let half = 0.5 * (to - from) + BEYOND;
    let pieces = (2.0 * half / PIECE).ceil() as i32;
    (0..=pieces)
        .map(|k| {
            let s = half * (2.0 * f64::from(k) / f64::from(pieces) - 1.0);
            let angle = curvature * s;
            at + along * (angle.sin() / curvature) + inward * ((1.0 - angle.cos()) / curvature)
        })
        .collect()
}

/// Farthest that a number stands from where it is wanted (points).
const FARTHEST: f32 = 110.0;

/// Writes curvatures outside of the fingers' backs, or near by where they cover nothing: all of them, or none.
pub(super) fn add_numbers(annotator: &mut Annotator<'_>, numbers: &[CircleNumber]) {
    if annotator.view.size.y < LEAST_HEIGHT {
        return;
    }
    let mut placed: Vec<(Plate, String)> = Vec::new();
    for own in numbers {
        let text = match annotator.view.tenths {
            true => units::true_minus(&format!("{:.1}{}{}", own.curvature, units::SPACE, units::symbol("1/m"))),
            false => units::shown(own.curvature, "1/m"),
        };
        let half = Vec2::new(0.25 * TEXT * text.chars().count() as f32 + 5.0, 0.5 * TEXT + 3.0);
        let wanted = own.back + own.outward * (GAP + half.dot(own.outward.abs()));
        let Some(plate) = annotator.place(&[wanted], half, FARTHEST) else { return };
        if placed.iter().any(|(other, _)| other.meets(&plate)) {
            return;
        }
        placed.push((plate, text));
    }
    for ((plate, text), own) in placed.into_iter().zip(numbers) {
        annotator.add_plate(plate);
        annotator.overlay.text(plate.middle, Align::Centre, TEXT, own.colour, text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::evenly_bent;

    #[test]
    fn an_evenly_bent_finger_lies_on_its_circle() {
        let gripper = GripperModel::default();
        let frame = evenly_bent(&gripper, [Some(8.0), Some(8.0)]);
        for side in Side::BOTH {
            let arc = arc(&gripper, &frame, side, [0.022, 0.078], 8.0);
            let placed = frame.placed(&gripper, side);
            let far = (2..8).map(|segment| {
                let joint = placed.point(segment, 0.5 * placed.lengths[segment], 0.0, 0.0);
                arc.iter().map(|point| point.distance(joint)).fold(f64::INFINITY, f64::min)
            });
            // Half a piece of the arc, and the sag of a rigid segment.
            assert!(far.fold(0.0, f64::max) < 1.6e-3);
        }
    }
}
