//! Contact forces as arrows: one for each loaded segment, the force on the finger.

use glam::DVec3;
use palpate_geometry::Pose;
use palpate_geometry::drawing::Arrow;
use palpate_geometry::palette::pressure_colour;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};

/// Length of the arrow of one newton (m).
const METRES_PER_NEWTON: f64 = 0.07;
/// Arrows are no longer than this (m), so that a hard squeeze does not leave the picture.
const LONGEST: f64 = 0.09;
/// Forces below this are not drawn (N).
const FAINTEST: f64 = 0.01;
/// Force that has the brightest colour (N).
const FULL_SCALE: f64 = 0.5;
/// Radius of a shaft (m).
const RADIUS: f32 = 0.0010;

/// Arrows from the places of contact along the force that the object exerts on the finger.
pub(super) fn arrows(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame) -> Vec<Arrow> {
    let grid = gripper.taxels();
    let mut arrows = Vec::new();
    for side in Side::BOTH {
        let placed = frame.placed(gripper, side);
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO, 0.0); placed.lengths.len()];
        for (taxel, load) in frame.loads(side, grid.count()) {
            let (segment_index, along) = grid.place(taxel, &gripper.finger);
            let force = f64::from(load.normal);
            let skin = grid.height(taxel) - grid.compression(taxel, force);
            let place = placed.point(segment_index, along, grid.across(taxel), skin);
            let vector = placed.axes(segment_index) * DVec3::new(f64::from(load.along), f64::from(load.across), -force);
            let (sum, moment, weight) = &mut sums[segment_index];
            *sum += vector;
            *moment += place * force;
            *weight += force;
        }
        for (force, moment, weight) in sums {
            let size = force.length();
            if size < FAINTEST || weight <= 0.0 {
                continue;
            }
            let from = world_from_gripper.point(moment / weight);
            let reach = world_from_gripper.direction(force) * (METRES_PER_NEWTON * size).min(LONGEST) / size;
            arrows.push(Arrow {
                from: from.as_vec3(),
                to: (from + reach).as_vec3(),
                radius: RADIUS,
                // The lower third of the map is too dark for a thin line.
                colour: pressure_colour(0.35 + 0.65 * (size / FULL_SCALE) as f32),
            });
        }
    }
    arrows
}
