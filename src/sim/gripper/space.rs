//! Forward kinematics of a finger that also bends sideways and twists.
//!
//! Out of its plane a finger has two shapes: a curvature that falls evenly from the palm to the tip, as that of a
//! cantilever under a force at its tip does, and an even twist. At arc length s
//!
//! ```text
//! sideways curvature  a (1 - s / L)          twist per length  b
//! ```
//!
//! Each joint of the planar chain turns by its share of both, in the axes of the finger as it is bent there: half its
//! angle q in the plane, then sideways about "inward", then about "along", then the other half of q. Turns are whole
//! rotations, so that no segment changes its length however far a finger goes.

use super::bend::{FingerPlane, SegmentPose, bend};
use super::{GripperModel, Side};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// Shape of a finger out of its plane. Signs are such that mirrored fingers have the same numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sway {
    /// Sideways curvature at the palm, a (1/m); positive moves the tip along the gripper's y.
    pub curvature: f64,
    /// Twist per length, b (rad/m); positive turns the pad's face against the gripper's y.
    pub twist: f64,
}

impl Sway {
    /// A finger that stays in its plane.
    pub const NONE: Self = Self { curvature: 0.0, twist: 0.0 };

    /// Both, in the order of the fields.
    pub fn to_array(self) -> [f64; 2] {
        [self.curvature, self.twist]
    }

    /// From both.
    pub fn from_array([curvature, twist]: [f64; 2]) -> Self {
        Self { curvature, twist }
    }
}

/// One rigid segment in the gripper frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SegmentFrame {
    /// Start: the palm for segment 0, joint j for segment j (m).
    pub start: DVec3,
    /// Unit vectors along the segment, across it and inward, as columns; a mirror image for the right finger.
    pub axes: DMat3,
}

impl SegmentFrame {
    /// A point along, across and inward of the segment's start (m).
    #[inline]
    pub fn point(&self, along: f64, across: f64, inward: f64) -> DVec3 {
        self.start + self.axes.x_axis * along + self.axes.y_axis * across + self.axes.z_axis * inward
    }
}

/// Place and axes of a joint in the gripper frame. Axes are rotation vectors per unit of each angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointAxes {
    /// The joint (m).
    pub place: DVec3,
    /// Bending in the plane: its first and its second half.
    pub bending: [DVec3; 2],
    pub sideways: DVec3,
    pub twist: DVec3,
}

/// Angles by which each of N joints turns per unit of sideways curvature and of twist (m): l (1 - s / L) and l.
///
/// `lengths` are those of the N + 1 segments.
pub fn sway_shares(lengths: &[f64]) -> impl Iterator<Item = [f64; 2]> + '_ {
    let joints = lengths.len() - 1;
    let length: f64 = lengths.iter().sum();
    let each = length / joints as f64;
    lengths[..joints].iter().scan(0.0, move |place, segment| {
        *place += segment;
        Some([each * (1.0 - *place / length), each])
    })
}

/// Lays out N + 1 segments and N joints bent by the joint angles `q` (rad) and a sway, whose share of each joint
/// `shares` lists (see [`sway_shares`]). `lengths` and `segments` have one entry more than the others.
pub fn bend_in_space(
    plane: &FingerPlane,
    (lengths, shares): (&[f64], &[[f64; 2]]),
    (q, sway): (&[f64], Sway),
    segments: &mut [SegmentFrame],
    joints: &mut [JointAxes],
) {
    let sign = plane.sign;
    let mut along = -DVec3::Z;
    let mut across = DVec3::Y;
    let mut inward = DVec3::X * sign;
    let mut start = DVec3::new(-sign * plane.half_gap, 0.0, 0.0);
    segments[0] = SegmentFrame { start, axes: DMat3::from_cols(along, across, inward) };
    for (j, joint) in joints.iter_mut().enumerate() {
        start += along * lengths[j];
        joint.place = start;
        let (sin, cos) = (0.5 * q[j]).sin_cos();
        joint.bending[0] = across * -sign;
        (along, inward) = (along * cos + inward * sin, inward * cos - along * sin);
        joint.sideways = inward * sign;
        let (sin_a, cos_a) = (sway.curvature * shares[j][0]).sin_cos();
        (along, across) = (along * cos_a + across * sin_a, across * cos_a - along * sin_a);
        joint.twist = along * sign;
        let (sin_b, cos_b) = (sway.twist * shares[j][1]).sin_cos();
        (inward, across) = (inward * cos_b - across * sin_b, across * cos_b + inward * sin_b);
        joint.bending[1] = across * -sign;
        (along, inward) = (along * cos + inward * sin, inward * cos - along * sin);
        segments[j + 1] = SegmentFrame { start, axes: DMat3::from_cols(along, across, inward) };
    }
}

/// A bent finger in the gripper frame, for those who need it now and then rather than in every step.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedFinger {
    /// Lengths of the N + 1 segments (m).
    pub lengths: Vec<f64>,
    shape: Shape,
}

#[derive(Clone, Debug, PartialEq)]
enum Shape {
    Planar(FingerPlane, Vec<SegmentPose>),
    InSpace(Vec<SegmentFrame>),
}

impl PlacedFinger {
    /// Bends a finger by N joint angles (rad) and a sway.
    pub fn new(gripper: &GripperModel, side: Side, q: &[f64], sway: Sway) -> Self {
        let lengths: Vec<f64> = gripper.finger.segment_lengths().collect();
        let plane = gripper.plane(side);
        let shape = if sway == Sway::NONE {
            let mut segments = vec![SegmentPose::default(); lengths.len()];
            bend(&lengths, q, &mut segments);
            Shape::Planar(plane, segments)
        } else {
            let shares: Vec<[f64; 2]> = sway_shares(&lengths).collect();
            let mut segments = vec![SegmentFrame::default(); lengths.len()];
            let mut joints = vec![JointAxes::default(); q.len()];
            bend_in_space(&plane, (&lengths, &shares), (q, sway), &mut segments, &mut joints);
            Shape::InSpace(segments)
        };
        Self { lengths, shape }
    }

    /// A point along, across and inward of a segment's start (m).
    pub fn point(&self, segment: usize, along: f64, across: f64, inward: f64) -> DVec3 {
        match &self.shape {
            Shape::Planar(plane, segments) => plane.point(segments[segment].point(along, inward), across),
            Shape::InSpace(segments) => segments[segment].point(along, across, inward),
        }
    }

    /// Unit vectors along a segment, across it and inward, as columns.
    pub fn axes(&self, segment: usize) -> DMat3 {
        match &self.shape {
            Shape::Planar(plane, segments) => {
                let SegmentPose { along, .. } = segments[segment];
                let inward = plane.direction(segments[segment].inward());
                DMat3::from_cols(plane.direction(along), DVec3::Y, inward)
            }
            Shape::InSpace(segments) => segments[segment].axes,
        }
    }

    /// The joints, from the palm to the tip (m).
    pub fn joints(&self) -> impl Iterator<Item = DVec3> + '_ {
        (1..self.lengths.len()).map(|segment| self.point(segment, 0.0, 0.0, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Finger;
    use super::*;

    fn laid_out(side: Side, q: &[f64], sway: Sway) -> (Vec<SegmentFrame>, Vec<JointAxes>) {
        let lengths: Vec<f64> = Finger { joints: q.len(), ..Finger::default() }.segment_lengths().collect();
        let shares: Vec<[f64; 2]> = sway_shares(&lengths).collect();
        let plane = FingerPlane::new(side, 0.05);
        let mut segments = vec![SegmentFrame::default(); q.len() + 1];
        let mut joints = vec![JointAxes::default(); q.len()];
        bend_in_space(&plane, (&lengths, &shares), (q, sway), &mut segments, &mut joints);
        (segments, joints)
    }

    #[test]
    fn without_sway_it_is_the_planar_chain() {
        let q: Vec<f64> = (0..10).map(|i| 0.3 - 0.05 * f64::from(i)).collect();
        let lengths: Vec<f64> = Finger::default().segment_lengths().collect();
        let mut planar = vec![SegmentPose::default(); 11];
        bend(&lengths, &q, &mut planar);
        for side in Side::BOTH {
            let plane = FingerPlane::new(side, 0.05);
            let (segments, _) = laid_out(side, &q, Sway::NONE);
            for (segment, planar) in segments.iter().zip(&planar) {
                assert!(
                    segment
                        .point(0.003, 0.002, 0.001)
                        .abs_diff_eq(plane.point(planar.point(0.003, 0.001), 0.002), 1e-15)
                );
            }
        }
    }

    #[test]
    fn fingers_are_mirror_images_and_positive_numbers_go_where_they_say() {
        let mirror = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
        let sway = Sway { curvature: 3.0, twist: -2.0 };
        let [left, right] = Side::BOTH.map(|side| laid_out(side, &[0.1; 10], sway).0);
        for (left, right) in left.iter().zip(&right) {
            assert!(left.point(0.004, 0.003, 0.008).abs_diff_eq(mirror(right.point(0.004, 0.003, 0.008)), 1e-15));
        }
        // Half of a / 2 L² of a cantilever's slope: the tip goes by a L² / 3, along y.
        let bent = laid_out(Side::Left, &[0.0; 40], Sway { curvature: 0.3, twist: 0.0 }).0;
        assert!((bent[40].point(0.00125, 0.0, 0.0).y / (0.3 * 0.01 / 3.0) - 1.0).abs() < 1e-3);
        let turned = laid_out(Side::Left, &[0.0; 40], Sway { curvature: 0.0, twist: 2.0 }).0;
        assert!(turned[40].axes.z_axis.abs_diff_eq(DVec3::new(0.2f64.cos(), -(0.2f64.sin()), 0.0), 1e-12));
    }

    #[test]
    fn joint_axes_are_the_slopes_of_the_layout() {
        let q = [0.3, -0.1, 0.2, 0.4];
        let sway = Sway { curvature: 6.0, twist: -9.0 };
        let step = 1e-6;
        for side in Side::BOTH {
            let (_, joints) = laid_out(side, &q, sway);
            let tip = |q: &[f64], sway| laid_out(side, q, sway).0[4].point(0.01, 0.004, 0.008);
            let at = tip(&q, sway);
            for j in 0..4 {
                let moved = |by: f64| {
                    let mut q = q;
                    q[j] += by;
                    tip(&q, sway)
                };
                let axis = 0.5 * (joints[j].bending[0] + joints[j].bending[1]);
                let slope = (moved(step) - moved(-step)) / (2.0 * step);
                assert!(slope.abs_diff_eq(axis.cross(at - joints[j].place), 1e-10), "{side:?} joint {j}");
            }
            let lengths: Vec<f64> = Finger { joints: 4, ..Finger::default() }.segment_lengths().collect();
            let sums = joints.iter().zip(sway_shares(&lengths)).fold([DVec3::ZERO; 2], |sums, (joint, shares)| {
                let arm = at - joint.place;
                [sums[0] + joint.sideways.cross(arm) * shares[0], sums[1] + joint.twist.cross(arm) * shares[1]]
            });
            let curved = |by: f64| tip(&q, Sway { curvature: sway.curvature + by, ..sway });
            let twisted = |by: f64| tip(&q, Sway { twist: sway.twist + by, ..sway });
            assert!(((curved(step) - curved(-step)) / (2.0 * step)).abs_diff_eq(sums[0], 1e-10));
            assert!(((twisted(step) - twisted(-step)) / (2.0 * step)).abs_diff_eq(sums[1], 1e-10));
        }
    }
}
