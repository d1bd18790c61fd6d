//! Contact forces on each finger, as arrows with numbers: the force across the pad, and the friction along it.

use super::PictureView;
use super::annotations::{Annotator, Plate};
use glam::{DVec3, Vec2, Vec3};
use palpate_geometry::Pose;
use palpate_geometry::drawing::{Align, Arrow};
use palpate_geometry::palette::{Rgb, Theme, pressure_colour};
use palpate_geometry::units;
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
/// Height of the numbers (points), of a line of them, and their distance from the tips.
const TEXT: f32 = 14.0;
const LINE: f32 = 18.0;
const GAP: f32 = 14.0;
/// Distance of the numbers from the edges (points), and height that is left to axes and scale bar below them.
const MARGIN: f32 = 10.0;
const FOOT: f32 = 50.0;
/// Height that is left to what stands above.
const HEAD: f32 = 48.0;
/// Least height of a picture with numbers (points).
const LEAST_HEIGHT: f32 = 260.0;

/// Colour of friction; that of a force across the pad comes from the map of pressures.
fn friction_colour(theme: Theme) -> Rgb {
    match theme {
        Theme::Dark => Rgb(255, 126, 182),
        Theme::Light => Rgb(190, 24, 110),
    }
}

/// Forces on a finger, from a place outside of it on (N).
struct Forces {
    side: Side,
    from: DVec3,
    /// Across the pad.
    normal: DVec3,
    /// Along the pad; none where it is too small to be drawn.
    friction: Option<DVec3>,
}

impl Forces {
    /// The colour of the normal force: the lower third of the map is too dark for a thin line.
    fn normal_colour(&self) -> Rgb {
        pressure_colour(0.35 + 0.65 * (self.normal.length() / FULL_SCALE) as f32)
    }
}

/// Arrows along the forces that the object exerts on the fingers.
pub(super) fn arrows(
    gripper: &GripperModel,
    world_from_gripper: &Pose,
    frame: &Frame,
    view: &PictureView,
) -> Vec<Arrow> {
    let height = f64::from(view.camera.height_at_target());
    let mut arrows = Vec::new();
    for forces in on_fingers(gripper, world_from_gripper, frame) {
        let mut arrow = |vector: DVec3, colour: Rgb| {
            let (from, to) = (forces.from.as_vec3(), tip(forces.from, vector, height));
            arrows.push(Arrow { from, to, radius: (RADIUS * height) as f32, colour });
        };
        arrow(forces.normal, forces.normal_colour());
        if let Some(friction) = forces.friction {
            arrow(friction, friction_colour(view.theme));
        }
    }
    arrows
}

/// Their numbers, beyond the tips: a plate for each finger.
pub(super) fn label(annotator: &mut Annotator<'_>, gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame) {
    let view = annotator.view;
    if view.size.y < LEAST_HEIGHT {
        return;
    }
    let height = f64::from(view.camera.height_at_target());
    let colours = view.theme.colours();
    for forces in on_fingers(gripper, world_from_gripper, frame) {
        let ends = [forces.from.as_vec3(), tip(forces.from, forces.normal, height)];
        let [Some(from), Some(to)] = ends.map(|point| view.camera.project(point, view.size)) else { continue };
        let letter = match forces.side {
            Side::Left => "L",
            Side::Right => "R",
        };
        let line = |name: &str, force: DVec3| format!("{letter}  {name} {}", units::shown(force.length(), "N"));
        let mut lines = vec![(line("normal", forces.normal), colours.text)];
        lines.extend(forces.friction.map(|force| (line("friction", force), friction_colour(view.theme))));
        // The letters of this font are half as wide as high.
        let letters = lines.iter().map(|(text, _)| text.chars().count()).max().unwrap_or_default();
        let half = Vec2::new(0.25 * TEXT * letters as f32 + 7.0, 0.5 * LINE * lines.len() as f32 + 2.0);
        let along = (to - from).normalize_or(Vec2::Y);
        let low = half + Vec2::new(MARGIN, HEAD);
        let high = (view.size - half - Vec2::new(MARGIN, FOOT)).max(low);
        // Beyond the tip, or else on either side of the arrow.
        let beyond = to + along * (GAP + half.x * along.x.abs() + half.y * along.y.abs());
        let aside = |sign: f32| {
            let edge = if sign < 0.0 { from.x.min(to.x) } else { from.x.max(to.x) };
            Vec2::new(edge + sign * (GAP + half.x), 0.5 * (from.y + to.y))
        };
        let over = Vec2::new(0.0, -2.5 * half.y);
        let places = [beyond, aside(-1.0), aside(1.0), aside(-1.0) + over, aside(1.0) + over];
        let plates = places.map(|place| Plate { middle: place.clamp(low, high), half });
        let on_arrow = [from, to, 0.5 * (from + to)];
        let suits = |plate: &&Plate| annotator.is_free(plate) && !on_arrow.iter().any(|place| plate.covers(*place));
        let plate = plates.iter().find(suits).copied().unwrap_or(plates[0]);
        let place = plate.middle;
        annotator.add_plate(plate);
        for (k, (text, ink)) in lines.into_iter().enumerate() {
            let at = Vec2::new(place.x - half.x + 7.0, place.y - half.y + 2.0 + LINE * (k as f32 + 0.5));
            annotator.overlay.text(at, Align::Left, TEXT, ink, text);
        }
    }
}

/// Point of the arrow of a force.
fn tip(from: DVec3, force: DVec3, height: f64) -> Vec3 {
    let size = force.length();
    let length = height * (PER_NEWTON * size).clamp(SHORTEST, LONGEST);
    (from + force / size * length).as_vec3()
}

/// The force across the pad and the friction along it, of each finger that is touched.
fn on_fingers(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame) -> Vec<Forces> {
    let grid = gripper.taxels();
    // Outside the finger, so that the loaded pad is seen.
    let clear = gripper.pad.thickness + gripper.finger.back;
    let mut all = Vec::new();
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
        let from = world_from_gripper.point(moment / weight + across.normalize() * clear);
        let friction = Some(friction).filter(|force| force.length() >= FAINTEST);
        let friction = friction.map(|force| world_from_gripper.direction(force));
        all.push(Forces { side, from, normal: world_from_gripper.direction(across), friction });
    }
    all
}
