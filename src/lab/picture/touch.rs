//! The touch in full view: the camera comes nearer as the grip tightens, and a finger that hides its own pad turns translucent
//! there.

use glam::{DVec3, Vec3};
use palpate_geometry::Pose;
use palpate_geometry::drawing::{Camera, SoftFinger, Veil};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{GripperModel, Side};
use std::f32::consts::{FRAC_PI_2, PI};

/// Force on both pads at which the camera is half way (N).
const HALF_WAY: f32 = 0.05;
/// Share of the picture that is pad coloured by its load in the end; less where a large object would be cut, down to the
/// second.
const SHARES: [f32; 2] = [0.0150, 0.0128];
/// Area that is coloured over that of the coloured taxels, at least: colours are blended beyond them.
const SPREAD: f32 = 2.1;
/// Least and greatest height of the picture at the distance of the touch (m). The width is at least this share of the
/// object's largest side; so is the height, where that costs no colour, in pictures at least so much wider than high.
const HEIGHTS: [f32; 2] = [0.04, 0.11];
const OF_OBJECT: f32 = 0.95;
const WIDE: f32 = 1.5;
/// Forces on both pads between which the camera gives up the whole object for the load (N).
const FIRM: [f32; 2] = [0.12, 0.38];
/// Pressures between which a taxel comes to count as coloured, as shares of the largest.
const COLOURED: [f32; 2] = [0.015, 0.06];
/// Least height of the eye (m).
const ABOVE_GROUND: f32 = 0.006;
/// Yaw against the gripper, and pitch, in the end (rad): from the side, where a pad is seen from behind, and low, as
/// fingertips curl up.
const ANGLES: [f32; 2] = [-1.05, -0.16];
/// Pressure of a loaded taxel, as a share of the brightest colour.
const LOADED: f32 = 0.02;
/// Translucent stretch beyond the loaded taxels, towards the palm, whose bellows stand in the way, and the tip (m).
const MARGINS: [f32; 2] = [0.016, 0.006];
/// Force on a pad from which its finger is as clear as it gets (N).
const CLEAR: f32 = 0.012;
/// Distance of the touch from the ball around an object at which it is still the object's (m).
const NEAR_OBJECT: f32 = 0.006;

/// What both pads touch in a frame.
pub(super) struct Touch {
    pads: [LoadedPad; 2],
    /// Sum of the normal forces (N), and their middle (m).
    force: f32,
    middle: Vec3,
    /// Direction in which the left finger closes.
    closing: Vec3,
}

impl Touch {
    /// None where nothing is touched.
    pub(super) fn of(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame) -> Option<Self> {
        let pads = Side::BOTH.map(|side| LoadedPad::of(gripper, world_from_gripper, frame, side));
        let force = pads[0].force + pads[1].force;
        let middle = (pads[0].moment + pads[1].moment) / force;
        let closing = world_from_gripper.direction(DVec3::X).as_vec3();
        (force > 0.0).then_some(Self { pads, force, middle, closing })
    }

    /// Force on an object (N) that a ball about this place holds; none where the fingers touch something else, such as each
    /// other.
    pub(super) fn force_on(&self, object: Vec3, radius: f32) -> Option<f32> {
        (self.middle.distance(object) <= radius + NEAR_OBJECT).then_some(self.force)
    }
}

/// A camera moved towards the middle of what the pads touch, for pictures of this width over height, of an object whose
/// largest side is `extent` (m).
pub(super) fn nearer(camera: Camera, touch: &Touch, extent: f32, aspect: f32) -> Camera {
    let Touch { pads, force, middle, closing } = touch;
    let tightness = (force / HALF_WAY).powf(1.5);
    let share = tightness / (1.0 + tightness);
    // One of the fingers is seen from behind, whichever is nearer.
    let from_side = closing.y.atan2(closing.x) + ANGLES[0];
    let turn = (from_side - camera.yaw + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2;
    let [yaw, pitch] = [camera.yaw + turn, ANGLES[1]];
    // What its pad shows of colour there decides how near.
    let towards_eye = Camera { yaw, pitch, ..camera }.axes()[2];
    let shown = pads.iter().map(|pad| pad.area_from_behind(towards_eye)).fold(0.0, f32::max);
    let [usual, farthest] = SHARES.map(|share| (SPREAD * shown / (share * aspect)).sqrt());
    let whole = usual.max(OF_OBJECT * extent * (WIDE / aspect).max(1.0)).clamp(HEIGHTS[0], HEIGHTS[1]);
    let near = whole.min(farthest).max(OF_OBJECT * extent / aspect).clamp(HEIGHTS[0], HEIGHTS[1]);
    // A light touch loads little of a pad: it is no reason to come nearer than the grip will.
    let height = whole * (near / whole).powf(smoothstep(FIRM[0], FIRM[1], *force));
    let nearest = height / (2.0 * (0.5 * camera.angle_of_view).tan());
    let target = camera.target.lerp(*middle, share);
    let distance = camera.distance * (nearest / camera.distance).powf(share);
    // Not below the ground.
    let lowest = ((ABOVE_GROUND - target.z) / distance).clamp(-1.0, 1.0).asin();
    Camera {
        target,
        distance,
        yaw: camera.yaw + share * turn,
        pitch: (camera.pitch + share * (pitch - camera.pitch)).max(lowest),
        ..camera
    }
}

/// Load on a pad.
struct LoadedPad {
    /// Sum of the normal forces (N), and their moment about the origin of the world (N m).
    force: f32,
    moment: Vec3,
    /// For each loaded taxel the area that is coloured (m²), and the direction out of the pad.
    coloured: Vec<(f32, Vec3)>,
}

impl LoadedPad {
    fn of(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame, side: Side) -> Self {
        let grid = gripper.taxels();
        let placed = frame.placed(gripper, side);
        let largest = frame.loads(side, grid.count()).map(|(_, load)| load.normal).fold(0.0, f32::max);
        let mut pad = Self { force: 0.0, moment: Vec3::ZERO, coloured: Vec::new() };
        for (taxel, load) in frame.loads(side, grid.count()) {
            let (segment, along) = grid.place(taxel, &gripper.finger);
            let normal = load.normal.max(0.0);
            let at = placed.point(segment, along, grid.across(taxel), grid.height(taxel));
            pad.force += normal;
            pad.moment += world_from_gripper.point(at).as_vec3() * normal;
            let coloured = smoothstep(COLOURED[0], COLOURED[1], normal / largest.max(f32::MIN_POSITIVE));
            let outwards = world_from_gripper.direction(placed.axes(segment).z_axis).as_vec3();
            pad.coloured.push((grid.area() as f32 * coloured, outwards));
        }
        pad
    }

    /// Coloured area as seen through the back of the finger (m²).
    fn area_from_behind(&self, towards_eye: Vec3) -> f32 {
        self.coloured.iter().map(|(area, outwards)| area * (-outwards.dot(towards_eye)).max(0.0)).sum()
    }
}

/// Makes a finger translucent where its back hides its loaded pad from the camera.
pub(super) fn clear_the_view(finger: &mut SoftFinger, camera: &Camera) {
    let (rows, columns) = (finger.taxels.rows as usize, finger.taxels.columns as usize);
    let Some(length) = finger.frames.last().map(|frame| frame.arc).filter(|_| rows > 0 && columns > 0) else { return };
    let loads: Vec<f32> = finger
        .taxels
        .loads
        .chunks_exact(columns)
        .map(|row| row.iter().map(|load| load[0]).fold(0.0, f32::max))
        .collect();
    let loaded = |load: &f32| *load > LOADED * finger.full_scale;
    let (Some(first), Some(last)) = (loads.iter().position(loaded), loads.iter().rposition(loaded)) else { return };
    let arc = |row: usize| length * row as f32 / rows as f32;
    let stretch = [arc(first) - MARGINS[0], arc(last + 1) + MARGINS[1]];
    let middle = 0.5 * (arc(first) + arc(last + 1));
    let near = |frame: &&palpate_geometry::drawing::FingerFrame| (frame.arc - middle).abs();
    let Some(frame) = finger.frames.iter().min_by(|a, b| near(a).total_cmp(&near(b))) else { return };
    let towards_eye: Vec3 =
        if camera.parallel { camera.axes()[2] } else { (camera.eye() - frame.position).normalize_or_zero() };
    // From behind; seen from the side there is nothing to clear.
    let behind = smoothstep(0.05, 0.25, -frame.inward.dot(towards_eye));
    let area = finger.section.width * length / (rows * columns) as f32;
    let force: f32 = finger.taxels.loads.iter().map(|load| load[0] * area).sum();
    finger.veil = Veil { stretch, clearness: behind * smoothstep(0.0, CLEAR, force) };
}

fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let share = ((x - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
