//! Contact forces on each finger, as arrows with numbers: the force across the pad, and the friction along it.

use super::PictureView;
use glam::{DVec3, Vec2, Vec3};
use palpate_geometry::Pose;
use palpate_geometry::drawing::{Align, Arrow, Overlay, Shape2};
use palpate_geometry::palette::{Rgb, Theme, pressure_colour};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};

/// Length of the arrow of one newton, and the greatest and the least length, as shares of the height of the picture at the
/// camera's target.
const PER_NEWTON: f64 = 0.26;
const LONGEST: f64 = 0.26;
const SHORTEST: f64 = 0.03;
/// Radius of a shaft, as a share of that height.
const RADIUS: f64 = 0.0042;
/// Forces below this are not drawn (N).
const FAINTEST: f64 = 0.01;
/// Force that has the brightest colour (N).
const FULL_SCALE: f64 = 0.5;
/// Height of the numbers (points), and their distance from the tips.
const TEXT: f32 = 15.0;
const GAP: f32 = 16.0;
/// Least distance of a number from the left and the upper edge (points).
const MARGIN: Vec2 = Vec2::new(60.0, 24.0);
/// Least height of a picture with numbers (points).
const LEAST_HEIGHT: f32 = 260.0;

/// Names of the forces.
const NORMAL: &str = "normal";
const FRICTION: &str = "friction";

/// Colour of friction; that of a force across the pad comes from the map of pressures.
fn friction_colour(theme: Theme) -> Rgb {
    match theme {
        Theme::Dark => Rgb(255, 126, 182),
        Theme::Light => Rgb(190, 24, 110),
    }
}

/// A force on a finger, from outside the finger on.
struct Force {
    from: DVec3,
    /// In the world (N).
    vector: DVec3,
    colour: Rgb,
    name: &'static str,
}

/// Arrows along the forces that the object exerts on the fingers.
pub(super) fn arrows(
    gripper: &GripperModel,
    world_from_gripper: &Pose,
    frame: &Frame,
    view: &PictureView,
) -> Vec<Arrow> {
    let height = f64::from(view.camera.height_at_target());
    let arrow = |force: &Force| Arrow {
        from: force.from.as_vec3(),
        to: tip(force, height),
        radius: (RADIUS * height) as f32,
        colour: force.colour,
    };
    forces(gripper, world_from_gripper, frame, view.theme).iter().map(arrow).collect()
}

/// Their numbers, beyond the tips.
pub(super) fn label(
    overlay: &mut Overlay,
    gripper: &GripperModel,
    world_from_gripper: &Pose,
    frame: &Frame,
    view: &PictureView,
) {
    if view.size.y < LEAST_HEIGHT {
        return;
    }
    let height = f64::from(view.camera.height_at_target());
    let colours = view.theme.colours();
    for force in forces(gripper, world_from_gripper, frame, view.theme) {
        let [from, to] = [force.from.as_vec3(), tip(&force, height)].map(|point| view.camera.project(point, view.size));
        let (Some(from), Some(to)) = (from, to) else { continue };
        let along = (to - from).normalize_or(Vec2::Y);
        let text = format!("{} {:.2}\u{2009}N", force.name, force.vector.length());
        // Beside steep arrows, beyond level ones.
        let room = 0.5 * TEXT * 0.5 * text.chars().count() as f32 * along.x.abs();
        let place = to + along * (GAP + room);
        // Above the scale bar and, on the left, the axes.
        let below = if place.x < 150.0 { 104.0 } else { 54.0 };
        let most = (view.size - Vec2::new(60.0, below)).max(MARGIN);
        let place = place.clamp(MARGIN, most);
        // The letters of this font are half as wide as high.
        let half = Vec2::new(0.26 * TEXT * text.chars().count() as f32 + 5.0, 0.5 * TEXT + 3.0);
        let plate =
            Shape2::Rectangle { min: place - half, max: place + half, colours: [colours.background; 2], opacity: 0.7 };
        overlay.shapes.push(plate);
        let ink = if force.name == FRICTION { force.colour } else { colours.text };
        overlay.text(place, Align::Centre, TEXT, ink, text);
    }
}

/// Point of the arrow of a force.
fn tip(force: &Force, height: f64) -> Vec3 {
    let size = force.vector.length();
    let length = height * (PER_NEWTON * size).clamp(SHORTEST, LONGEST);
    (force.from + force.vector / size * length).as_vec3()
}

/// The force across the pad and the friction along it, of each finger.
fn forces(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame, theme: Theme) -> Vec<Force> {
    let grid = gripper.taxels();
    let mut forces = Vec::new();
    // Outside the finger, so that the loaded pad is seen.
    let clear = gripper.pad.thickness + gripper.finger.back;
    for side in Side::BOTH {
        let placed = frame.placed(gripper, side);
        let (mut across, mut friction, mut moment, mut weight) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0.0);
        for (taxel, load) in frame.loads(side, grid.count()) {
            let (segment, along) = grid.place(taxel, &gripper.finger);
            let normal = f64::from(load.normal);
            let skin = grid.height(taxel) - grid.compression(taxel, normal);
            let axes = placed.axes(segment);
            across += axes * DVec3::new(0.0, 0.0, -normal);
            friction += axes * DVec3::new(f64::from(load.along), f64::from(load.across), 0.0);
            moment += placed.point(segment, along, grid.across(taxel), skin) * normal;
            weight += normal;
        }
        if weight < FAINTEST || across.length() < FAINTEST {
            continue;
        }
        let outwards = across.normalize();
        let from = world_from_gripper.point(moment / weight + outwards * clear);
        // The lower third of the map is too dark for a thin line.
        let colour = pressure_colour(0.35 + 0.65 * (across.length() / FULL_SCALE) as f32);
        forces.push(Force { from, vector: world_from_gripper.direction(across), colour, name: NORMAL });
        if friction.length() >= FAINTEST {
            let vector = world_from_gripper.direction(friction);
            forces.push(Force { from, vector, colour: friction_colour(theme), name: FRICTION });
        }
    }
    forces
}
