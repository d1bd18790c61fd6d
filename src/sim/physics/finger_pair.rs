//! Geometry and stiffness of two fingers in contact with each other.
//!
//! Two pads that press on each other are two contact springs in series, and every place of contact is found twice, once
//! from either side. A contact spring that overlaps the other skin by x is therefore given half the force at half the
//! compression:
//!
//! ```text
//!   f(x) = 1/2 f_{k,H}(x / 2) = f_{k/4, 2H}(x)          exactly, for the linear and the neo-Hookean law
//! ```
//!
//! so that both sides together press with f_{k,H}(x / 2), as one pad does that is pushed x / 2 into a rigid plane
//! midway. Neither finger is preferred: a mirrored scene stays mirrored. Forces act on both fingers at the same point.
//!
//! The other finger is seen unrolled: the nearest segment gives a point's arc length s and its height eta above the
//! neutral axis, and in (s, eta) the finger is a box whose corners are as round as the ends of its contact springs.
//! Where fingers leave their planes, length and height are those of the nearest segment as it is turned in space. Across,
//! the skin is as high as where the spring that meets it sits on its own pad, so that a motion across does no work on the
//! crown, and the box ends at the sides: fingers far enough beside each other pass.

use super::model::PhysicsModel;
use super::workspace::Workspace;
use crate::gripper::{FingerPlane, SegmentFrame, SegmentPose};
use glam::{DVec2, DVec3};

/// Contact spring of a pad against another contact spring like it, as seen from one of them: small-strain stiffness
/// (N/m) and rest length (m). See the top of this file.
pub(super) fn in_series(stiffness: f64, height: f64) -> (f64, f64) {
    (0.25 * stiffness, 2.0 * height)
}

/// Inward protrusion of each finger from its own straight neutral axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fronts {
    /// Of the most inward segment (m).
    segments: [f64; 2],
    /// More than that by which the round skin at a bent joint protrudes, at most (m).
    joints: [f64; 2],
}

impl Fronts {
    pub(super) fn new(model: &PhysicsModel, ws: &Workspace) -> Self {
        let n = model.chain.joints;
        let links = |finger: usize| finger * (n + 1)..(finger + 1) * (n + 1);
        let protruding = |finger: usize| {
            let own = links(finger).zip(&model.chain.lengths);
            own.map(|(link, l)| front(model, finger, (&ws.segments[link], ws.frames().get(link), *l)))
                .fold(f64::NEG_INFINITY, f64::max)
        };
        let rounding = |finger: usize| {
            let straightness = ws.segments[links(finger)].windows(2).map(|pair| pair[0].along.dot(pair[1].along));
            model.skin.thickness.max(model.skin.back) * (1.0 - straightness.fold(1.0, f64::min))
        };
        Self { segments: [0, 1].map(protruding), joints: [0, 1].map(rounding) }
    }

    /// Distance of a finger's point from the other's skin, at least (m), where the fingers stay in their planes.
    pub(super) fn least_distance(&self, model: &PhysicsModel, finger: usize, point: DVec3) -> f64 {
        let plane = &model.planes[finger];
        let other = self.segments[1 - finger] + self.joints[1 - finger];
        plane.half_gap - plane.sign * point.x - other
    }

    /// True where this segment of a finger may come within `margin` (m) of any of the other finger.
    pub(super) fn may_meet(
        &self,
        model: &PhysicsModel,
        finger: usize,
        segment: (&SegmentPose, Option<&SegmentFrame>, f64),
        margin: f64,
    ) -> bool {
        front(model, finger, segment) + self.segments[1 - finger] + margin > 2.0 * model.planes[finger].half_gap
    }

    /// Clearance between the fingers, seen from the side (m).
    pub(super) fn clearance(&self, model: &PhysicsModel) -> f64 {
        2.0 * model.planes[0].half_gap - self.segments[0] - self.segments[1]
    }
}

/// Most inward point of a segment, pad and bellows included (m).
fn front(
    model: &PhysicsModel,
    finger: usize,
    (segment, frame, length): (&SegmentPose, Option<&SegmentFrame>, f64),
) -> f64 {
    if let Some(frame) = frame {
        let plane = &model.planes[finger];
        let inward = |v: DVec3| plane.sign * v.x;
        let [along, across, up] = [frame.axes.x_axis, frame.axes.y_axis, frame.axes.z_axis].map(inward);
        let faces = (model.skin.thickness * up).max(-model.skin.back * up);
        let edge = 0.5 * model.skin.width * across.abs();
        return inward(frame.start) + plane.half_gap + (length * along).max(0.0) + faces + edge;
    }
    let faces = model.skin.thickness * segment.inward().x;
    let back = -model.skin.back * segment.inward().x;
    segment.start.x + (length * segment.along.x).max(0.0) + faces.max(back)
}

/// A finger as the other one meets it.
pub(super) struct OtherFinger<'a> {
    model: &'a PhysicsModel,
    plane: FingerPlane,
    segments: &'a [SegmentPose],
    /// The same in space; none where it stays in its plane.
    frames: &'a [SegmentFrame],
    /// Distance from the middle of its pad of the contact spring that meets it (m).
    met_at: f64,
}

/// A point seen from a finger.
struct Place {
    /// The nearest segment.
    segment: usize,
    /// Arc length from the tip, negative before it (m).
    beyond_tip: f64,
    /// Distance from the middle of the pad, along y where the finger stays in its plane (m).
    across: f64,
    /// Height above the neutral axis, towards the inner side (m).
    height: f64,
    /// Directions in which the height and the arc length grow.
    up: DVec3,
    ahead: DVec3,
}

impl<'a> OtherFinger<'a> {
    /// The finger opposite to `finger`, as a contact spring at `met_at` across its pad (m) meets it.
    pub(super) fn opposite(model: &'a PhysicsModel, ws: &'a Workspace, finger: usize, met_at: f64) -> Self {
        let (other, n) = (1 - finger, model.chain.joints);
        let links = other * (n + 1)..(other + 1) * (n + 1);
        let frames = ws.frames().get(links.clone()).unwrap_or_default();
        Self { model, plane: model.planes[other], segments: &ws.segments[links], frames, met_at }
    }

    /// A point of the gripper frame in the finger's plane.
    fn in_plane(&self, p: DVec3) -> DVec2 {
        DVec2::new(self.plane.sign * p.x + self.plane.half_gap, -p.z)
    }

    fn place(&self, at: DVec3) -> Place {
        if !self.frames.is_empty() {
            return self.place_in_space(at);
        }
        let p = self.in_plane(at);
        let (lengths, last) = (&self.model.chain.lengths, self.segments.len() - 1);
        let mut nearest = (f64::INFINITY, 0, 0.0, DVec2::ZERO);
        for (j, segment) in self.segments.iter().enumerate() {
            let from_start = p - segment.start;
            let along = from_start.dot(segment.along);
            // The first segment extends into the palm, the last one beyond the tip.
            let low = if j == 0 { f64::NEG_INFINITY } else { 0.0 };
            let high = if j == last { f64::INFINITY } else { lengths[j] };
            let within = along.clamp(low, high);
            let offset = from_start - segment.along * within;
            let squared = offset.length_squared();
            if squared < nearest.0 {
                nearest = (squared, j, within, offset);
            }
        }
        let (squared, segment, along, offset) = nearest;
        let inward = self.segments[segment].inward();
        let side = if offset.dot(inward) < 0.0 { -1.0 } else { 1.0 };
        let size = squared.sqrt();
        // On the axis itself the offset has no direction.
        let up = if size > 1e-12 { offset * (side / size) } else { inward };
        let remaining: f64 = lengths[segment..].iter().sum();
        let direction = |d: DVec2| self.plane.direction(d);
        Place {
            segment,
            beyond_tip: along - remaining,
            across: at.y,
            height: side * size,
            up: direction(up),
            ahead: direction(self.segments[segment].along),
        }
    }

    /// The same among segments in space: lengths are those in the axes of each segment.
    fn place_in_space(&self, p: DVec3) -> Place {
        let (lengths, last) = (&self.model.chain.lengths, self.frames.len() - 1);
        let mut nearest = (f64::INFINITY, 0, 0.0, DVec3::ZERO);
        for (j, frame) in self.frames.iter().enumerate() {
            let local = frame.axes.transpose() * (p - frame.start);
            let low = if j == 0 { f64::NEG_INFINITY } else { 0.0 };
            let high = if j == last { f64::INFINITY } else { lengths[j] };
            let within = local.x.clamp(low, high);
            let beside = (local.x - within).powi(2) + local.z.powi(2);
            if beside < nearest.0 {
                nearest = (beside, j, within, local);
            }
        }
        let (squared, segment, along, local) = nearest;
        let frame = &self.frames[segment];
        let side = if local.z < 0.0 { -1.0 } else { 1.0 };
        let size = squared.sqrt();
        let offset = frame.axes.x_axis * (local.x - along) + frame.axes.z_axis * local.z;
        let up = if size > 1e-12 { offset * (side / size) } else { frame.axes.z_axis };
        let remaining: f64 = lengths[segment..].iter().sum();
        let (across, ahead) = (local.y, frame.axes.x_axis);
        Place { segment, beyond_tip: along - remaining, across, height: side * size, up, ahead }
    }

    /// Distance of a point beyond the core of the rounded box, along the finger and away from its middle (m).
    fn excess(&self, place: &Place) -> (f64, f64, bool) {
        let skin = &self.model.skin;
        let radius = self.model.springs.radius;
        let front = place.height - (skin.height(self.met_at) - radius);
        let back = -place.height - (skin.back - radius).max(0.0);
        (place.beyond_tip + skin.last_row, front.max(back), front >= back)
    }

    /// Way of a point beyond the side of the core, and the direction out of it; only fingers in space have sides.
    fn beside(&self, place: &Place) -> (f64, DVec3) {
        match self.frames.get(place.segment) {
            Some(frame) => {
                let core = (0.5 * self.model.skin.width - self.model.springs.radius).max(0.0);
                ((place.across.abs() - core).max(0.0), frame.axes.y_axis * place.across.signum())
            }
            None => (0.0, DVec3::ZERO),
        }
    }

    /// Distance of a point from the skin (m), negative inside.
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        let place = self.place(p);
        let (along, away, _) = self.excess(&place);
        self.beyond_core(along, away, self.beside(&place).0)
    }

    /// Distance from the skin (m), given that beyond the core along the finger, away from its middle and beside it (m).
    fn beyond_core(&self, along: f64, away: f64, beside: f64) -> f64 {
        let mut outside = along.max(0.0).hypot(away.max(0.0));
        if beside > 0.0 {
            outside = outside.hypot(beside);
        }
        outside + along.max(away).min(0.0) - self.model.springs.radius
    }

    /// Distance of a point from the skin (m), and outward normal of the skin nearest to it.
    pub(super) fn surface(&self, p: DVec3) -> (f64, DVec3) {
        let place = self.place(p);
        let (along, away, in_front) = self.excess(&place);
        let ahead = place.ahead;
        let up = if in_front { place.up } else { -place.up };
        let in_profile = match (along > 0.0, away > 0.0) {
            (true, true) => (ahead * along + up * away).normalize_or(up),
            (true, false) => ahead,
            (false, true) => up,
            (false, false) => {
                if along > away {
                    ahead
                } else {
                    up
                }
            }
        };
        let (beside, out) = self.beside(&place);
        let distance = self.beyond_core(along, away, beside);
        if beside > 0.0 {
            // Within the profile the distance is a sum, outside of it that to an edge.
            let to_profile = along.max(0.0).hypot(away.max(0.0));
            let way = if to_profile > 0.0 { in_profile * to_profile + out * beside } else { in_profile + out };
            return (distance, way.normalize_or(up));
        }
        (distance, in_profile)
    }

    /// The segment that a point touches.
    pub(super) fn segment(&self, p: DVec3) -> usize {
        self.place(p).segment
    }

    /// The taxel that a point of the skin lies on; `None` on the bellows behind the pad.
    pub(super) fn taxel(&self, p: DVec3) -> Option<usize> {
        let place = self.place(p);
        let skin = &self.model.skin;
        if place.height < 0.0 {
            return None;
        }
        let length: f64 = self.model.chain.lengths.iter().sum();
        let cell = |share: f64, count: usize| ((share * count as f64).max(0.0) as usize).min(count - 1);
        let row = cell((place.beyond_tip + length) / length, skin.rows);
        let column = cell(place.across / skin.width + 0.5, skin.columns);
        Some(row * skin.columns + column)
    }
}
