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
//! Both fingers bend in one plane, so that nothing moves across.

use super::model::PhysicsModel;
use crate::gripper::{FingerPlane, SegmentPose};
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
    pub(super) fn new(model: &PhysicsModel, segments: &[SegmentPose]) -> Self {
        let own = |finger: usize| &segments[finger * (model.chain.joints + 1)..][..=model.chain.joints];
        let protruding = |finger: usize| {
            let fronts = own(finger).iter().zip(&model.chain.lengths).map(|(s, l)| front(model, s, *l));
            fronts.fold(f64::NEG_INFINITY, f64::max)
        };
        let rounding = |finger: usize| {
            let straightness = own(finger).windows(2).map(|pair| pair[0].along.dot(pair[1].along));
            model.skin.thickness.max(model.skin.back) * (1.0 - straightness.fold(1.0, f64::min))
        };
        Self { segments: [0, 1].map(protruding), joints: [0, 1].map(rounding) }
    }

    /// Distance of a point from the other finger's skin, at least (m). `inward`: of the point, from the straight neutral
    /// axis of its own finger (m).
    pub(super) fn least_distance(&self, model: &PhysicsModel, finger: usize, inward: f64) -> f64 {
        let other = self.segments[1 - finger] + self.joints[1 - finger];
        2.0 * model.planes[finger].half_gap - other - inward
    }

    /// True where this segment of a finger may come within `margin` (m) of any of the other finger.
    pub(super) fn may_meet(
        &self,
        model: &PhysicsModel,
        finger: usize,
        segment: (&SegmentPose, f64),
        margin: f64,
    ) -> bool {
        front(model, segment.0, segment.1) + self.segments[1 - finger] + margin > 2.0 * model.planes[finger].half_gap
    }

    /// Clearance between the fingers, seen from the side (m).
    pub(super) fn clearance(&self, model: &PhysicsModel) -> f64 {
        2.0 * model.planes[0].half_gap - self.segments[0] - self.segments[1]
    }
}

/// Most inward point of a segment, pad and bellows included (m).
fn front(model: &PhysicsModel, segment: &SegmentPose, length: f64) -> f64 {
    let faces = model.skin.thickness * segment.inward().x;
    let back = -model.skin.back * segment.inward().x;
    segment.start.x + (length * segment.along.x).max(0.0) + faces.max(back)
}

/// A finger as the other one meets it.
pub(super) struct OtherFinger<'a> {
    model: &'a PhysicsModel,
    plane: FingerPlane,
    segments: &'a [SegmentPose],
}

/// A point seen from a finger.
struct Place {
    /// The nearest segment.
    segment: usize,
    /// Arc length from the tip, negative before it (m).
    beyond_tip: f64,
    /// Height above the neutral axis, towards the inner side (m).
    height: f64,
    /// Direction in which the height grows.
    up: DVec2,
}

impl<'a> OtherFinger<'a> {
    /// The finger opposite to `finger`.
    pub(super) fn opposite(model: &'a PhysicsModel, segments: &'a [SegmentPose], finger: usize) -> Self {
        let (other, n) = (1 - finger, model.chain.joints);
        let segments = &segments[other * (n + 1)..(other + 1) * (n + 1)];
        Self { model, plane: model.planes[other], segments }
    }

    /// A point of the gripper frame in the finger's plane.
    fn in_plane(&self, p: DVec3) -> DVec2 {
        DVec2::new(self.plane.sign * p.x + self.plane.half_gap, -p.z)
    }

    fn place(&self, p: DVec3) -> Place {
        let p = self.in_plane(p);
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
        Place { segment, beyond_tip: along - remaining, height: side * size, up }
    }

    /// Distance of a point beyond the core of the rounded box, along the finger and away from its middle (m).
    fn excess(&self, place: &Place, across: f64) -> (f64, f64, bool) {
        let skin = &self.model.skin;
        let radius = self.model.springs.radius;
        let front = place.height - (skin.height(across) - radius);
        let back = -place.height - (skin.back - radius).max(0.0);
        (place.beyond_tip + skin.last_row, front.max(back), front >= back)
    }

    /// Distance of a point from the skin (m), negative inside.
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        let (along, away, _) = self.excess(&self.place(p), p.y);
        self.beyond_core(along, away)
    }

    /// Distance from the skin (m), given that beyond the core along the finger and away from its middle (m).
    fn beyond_core(&self, along: f64, away: f64) -> f64 {
        let outside = along.max(0.0).hypot(away.max(0.0));
        outside + along.max(away).min(0.0) - self.model.springs.radius
    }

    /// Distance of a point from the skin (m), and outward normal of the skin nearest to it.
    pub(super) fn surface(&self, p: DVec3) -> (f64, DVec3) {
        let place = self.place(p);
        let (along, away, in_front) = self.excess(&place, p.y);
        let ahead = self.segments[place.segment].along;
        let up = if in_front { place.up } else { -place.up };
        let direction = match (along > 0.0, away > 0.0) {
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
        (self.beyond_core(along, away), self.plane.direction(direction))
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
        let column = cell(p.y / skin.width + 0.5, skin.columns);
        Some(row * skin.columns + column)
    }
}
