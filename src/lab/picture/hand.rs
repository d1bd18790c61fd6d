//! The home view: the whole hand, from the palm to the tips of both fingers, with what it holds and the pedestal. The camera
//! turns so far that a pad faces it, and no farther.

use super::annotations::{MARGIN, Plate, SCALE_BAR, legend_room, shows_legends};
use super::forces::reach;
use super::reconstructed::evenly_bent;
use super::{PictureView, Stage};
use glam::{DVec3, Vec2, Vec3};
use palpate_geometry::drawing::{Camera, PictureRoom};
use palpate_geometry::{Pose, SurfaceMesh};
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Side;
use std::f32::consts::{FRAC_PI_2, PI};

/// Directions in which the outline of a mesh is looked for: of a ball, at most 2 % of its radius lie beyond.
const DIRECTIONS: u32 = 96;
/// Share of the picture that is left free at each edge, and height of buttons or badge above (points), at most that share.
const FREE: f32 = 0.06;
const HEAD: f32 = 48.0;
const MOST_HEAD: f32 = 0.28;
/// Yaw of the camera from beside the hand (rad): nearer to 0 no pad faces it, farther off one finger hides the other.
const FACING: [f32; 2] = [0.5, 0.8];
/// An object that is farther from the palm, in lengths of a finger, is not followed.
const FARTHEST: f32 = 2.5;
/// Least height of an inset (points), and its greatest as shares of the height and of the width of the picture; its width over
/// its height.
const LEAST: f32 = 112.0;
const MOST: [f32; 2] = [0.42, 0.34];
const SHAPE: f32 = 4.0 / 3.0;
/// Sizes that are tried where it would cover the hand.
const SMALLER: [f32; 7] = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4];
/// Height below which there is none (points).
const TOO_SMALL: f32 = 48.0;

/// Points of a mesh, the farthest in each direction.
pub(super) fn outline(mesh: &SurfaceMesh) -> Vec<Vec3> {
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    let direction = |k: u32| {
        let z = 1.0 - (2.0 * k as f32 + 1.0) / DIRECTIONS as f32;
        (Vec2::from_angle(golden * k as f32) * (1.0 - z * z).sqrt()).extend(z)
    };
    let points = || mesh.vertices.iter().map(|vertex| Vec3::from(vertex.position));
    let farthest = |along: Vec3| points().max_by(|a, b| a.dot(along).total_cmp(&b.dot(along)));
    let mut found: Vec<Vec3> = Vec::new();
    for point in (0..DIRECTIONS).filter_map(|k| farthest(direction(k))) {
        if !found.contains(&point) {
            found.push(point);
        }
    }
    found
}

/// Outlines of the rigid parts of a picture, each in its own frame.
#[derive(Clone, Debug)]
pub(super) struct Outlines {
    pub(super) palm: Vec<Vec3>,
    pub(super) object: Vec<Vec3>,
    pub(super) pedestal: Vec<Vec3>,
}

impl Stage {
    /// Outline of all that the home view shows: the fingers as they are, and straight, so that it stands still as they bend.
    pub(super) fn hand_points(&self, frame: &Frame) -> Vec<Vec3> {
        let placed = |pose: &Pose, points: &[Vec3]| -> Vec<Vec3> {
            points.iter().map(|point| pose.point(point.as_dvec3()).as_vec3()).collect()
        };
        let hand = frame.world_from_gripper(&self.world_from_gripper);
        let mut points = placed(&hand, &self.outlines.palm);
        points.extend(&self.outlines.pedestal);
        for shape in [frame, &evenly_bent(&self.gripper, [None; 2])] {
            points.extend(self.finger_corners(shape).map(|point| hand.point(point).as_vec3()));
        }
        if let Some(pose) = &frame.world_from_object {
            let reach = f64::from(FARTHEST) * self.gripper.finger.length;
            let position = hand.position + (pose.position - hand.position).clamp_length_max(reach);
            points.extend(placed(&Pose { position, ..*pose }, &self.outlines.object));
        }
        points
    }

    /// Points of the fingers, in between their corners too, and outlines of the palm and of what they hold, in the world (m).
    pub(super) fn held_points(&self, frame: &Frame) -> Vec<Vec3> {
        let hand = frame.world_from_gripper(&self.world_from_gripper);
        let corners: Vec<DVec3> = self.finger_corners(frame).collect();
        // Each segment begins and ends with four corners.
        let middles = corners.chunks_exact(8).flat_map(|segment| (0..4).map(|k| 0.5 * (segment[k] + segment[k + 4])));
        let palm = self.outlines.palm.iter().map(|point| point.as_dvec3());
        let mut points: Vec<Vec3> =
            corners.iter().copied().chain(middles).chain(palm).map(|point| hand.point(point).as_vec3()).collect();
        let object = frame.world_from_object.iter();
        points
            .extend(object.flat_map(|pose| self.outlines.object.iter().map(|at| pose.point(at.as_dvec3()).as_vec3())));
        points
    }

    /// Corners of both fingers' segments, in the gripper frame (m).
    fn finger_corners(&self, frame: &Frame) -> impl Iterator<Item = DVec3> {
        let (finger, pad) = (&self.gripper.finger, self.gripper.pad.thickness);
        let half = 0.5 * finger.width;
        let corners = [[-half, -finger.back], [-half, pad], [half, -finger.back], [half, pad]];
        Side::BOTH.into_iter().flat_map(move |side| {
            let fingers = frame.placed(&self.gripper, side);
            let ends = |k: usize| [0.0, fingers.lengths[k]].map(|along| (k, along));
            let ends: Vec<(usize, f64)> = (0..fingers.lengths.len()).flat_map(ends).collect();
            let at = |(k, along)| corners.map(|[across, inward]| fingers.point(k, along, across, inward));
            ends.into_iter().flat_map(at).collect::<Vec<DVec3>>()
        })
    }

    /// Yaw of the home view (rad): that of the camera, turned by as little as it takes for a pad to face it.
    pub(super) fn home_yaw(&self, yaw: f32) -> f32 {
        let from_side = self.yaw_from_side(yaw);
        yaw + from_side.abs().clamp(FACING[0], FACING[1]).copysign(from_side) - from_side
    }

    /// Turn of a camera from the nearer side of the hand (rad), where both fingers are seen from beside.
    pub(super) fn yaw_from_side(&self, yaw: f32) -> f32 {
        let closing = self.world_from_gripper.direction(DVec3::X).as_vec3();
        (yaw - closing.y.atan2(closing.x) + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2
    }

    /// A camera moved so that a view shows the whole hand, beside buttons, legend and inset.
    pub(super) fn showing_hand(&self, camera: Camera, frame: &Frame, view: &PictureView) -> Camera {
        let head = if view.annotations { (HEAD / view.size.y).clamp(FREE, MOST_HEAD) } else { FREE };
        let taken = inset_size(view).map_or(0.0, |inset| inset.x + 2.0 * MARGIN);
        let room = PictureRoom {
            min: Vec2::new(FREE, head),
            max: Vec2::splat(1.0 - FREE),
            clear_of: 1.0 - taken / view.size.x,
        };
        camera.containing(&self.hand_points(frame), &room, view.size.x / view.size.y)
    }

    /// Where the inset of a view covers neither the hand, nor its arrows where there is room, nor other annotations: below the
    /// legend, or else in the lower corner; none where both are taken.
    pub(super) fn inset_place(&self, frame: &Frame, view: &PictureView) -> Option<Plate> {
        let size = inset_size(view)?;
        let right = view.size.x - MARGIN;
        let top = legend_room(view).y;
        let below_legend = size * ((view.size.y - SCALE_BAR - top) / size.y).clamp(SMALLER[SMALLER.len() - 1], 1.0);
        let usual = Plate::between(Vec2::new(right - below_legend.x, top), Vec2::new(right, top + below_legend.y));
        let low = Vec2::new(right, view.size.y - SCALE_BAR);
        let lower = SMALLER.into_iter().map(|share| Plate::between(low - share * size, low));
        let on_picture = view.camera.projector(view.size);
        let hand: Vec<Vec2> = self.hand_points(frame).into_iter().filter_map(&on_picture).collect();
        let world_from_gripper = frame.world_from_gripper(&self.world_from_gripper);
        let arrows = if view.forces { reach(&self.gripper, &world_from_gripper, frame, view) } else { Vec::new() };
        let arrows: Vec<Vec2> = arrows.into_iter().filter_map(&on_picture).collect();
        let is_free = |plate: &Plate| plate.half.y >= 0.5 * TOO_SMALL && !hand.iter().any(|place| plate.covers(*place));
        let beside = std::iter::once(usual).chain(lower).filter(is_free);
        beside.min_by_key(|plate| arrows.iter().filter(|place| plate.covers(**place)).count())
    }
}

/// Size of the inset of a view (points); none where it has none, or no room for one.
fn inset_size(view: &PictureView) -> Option<Vec2> {
    // An enlarged one may take more.
    let most = MOST.map(|share| share.max(0.8 * view.inset));
    let height = (view.inset * view.size.y).max(LEAST).min(most[0] * view.size.y).min(most[1] * view.size.x);
    (view.inset > 0.0 && shows_legends(view)).then(|| Vec2::new(SHAPE * height, height))
}
