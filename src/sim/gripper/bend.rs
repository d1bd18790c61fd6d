//! Forward kinematics of the planar chain: poses of the rigid segments of a bent finger.
//!
//! Finger plane: x points inward, to the other finger; y points from the palm to the tip; the origin is where the
//! neutral axis leaves the palm. At absolute angle theta a segment runs along (sin theta, cos theta), and the pad
//! faces along (cos theta, -sin theta).
//!
//! ```text
//!   palm ═══════▶ x (inward)
//!     │ segment 0, fixed          theta_0 = 0
//!     o joint 1                   theta_j = q_1 + .. + q_j
//!      \ segment 1
//!       o joint 2
//!   y    \ ..                     tip
//! ```

use super::{Finger, Side};
use glam::{DVec2, DVec3};

/// One rigid segment in the finger plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SegmentPose {
    /// Start: the palm for segment 0, joint j for segment j (m).
    pub start: DVec2,
    /// Unit vector from its start towards the tip.
    pub along: DVec2,
}

impl SegmentPose {
    /// Unit vector out of the pad.
    pub fn inward(&self) -> DVec2 {
        DVec2::new(self.along.y, -self.along.x)
    }

    /// A point `along` and `inward` of the segment's start (m).
    pub fn point(&self, along: f64, inward: f64) -> DVec2 {
        self.start + self.along * along + self.inward() * inward
    }
}

/// Lays out N + 1 segments bent by N joint angles `q` (rad); returns the tip (m).
///
/// `lengths` and `segments` have one entry more than `q`.
pub fn bend(lengths: &[f64], q: &[f64], segments: &mut [SegmentPose]) -> DVec2 {
    let mut start = DVec2::ZERO;
    let mut angle = 0.0f64;
    for (j, (segment, length)) in segments.iter_mut().zip(lengths).enumerate() {
        if j > 0 {
            angle += q[j - 1];
        }
        let (sin, cos) = angle.sin_cos();
        *segment = SegmentPose { start, along: DVec2::new(sin, cos) };
        start += segment.along * *length;
    }
    start
}

/// A bent finger, for those who need it now and then rather than in every step.
#[derive(Clone, Debug, PartialEq)]
pub struct BentFinger {
    /// The N + 1 segments.
    pub segments: Vec<SegmentPose>,
    /// Their lengths (m).
    pub lengths: Vec<f64>,
    /// The tip (m).
    pub tip: DVec2,
}

impl BentFinger {
    /// Bends a finger by N joint angles (rad).
    pub fn new(finger: &Finger, q: &[f64]) -> Self {
        let lengths: Vec<f64> = finger.segment_lengths().collect();
        let mut segments = vec![SegmentPose::default(); lengths.len()];
        let tip = bend(&lengths, q, &mut segments);
        Self { segments, lengths, tip }
    }

    /// The joints, from the palm to the tip (m).
    pub fn joints(&self) -> impl Iterator<Item = DVec2> + '_ {
        self.segments.iter().skip(1).map(|s| s.start)
    }
}

/// From the plane of one finger to the gripper frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerPlane {
    /// +1 for the left finger, -1 for the right.
    pub sign: f64,
    /// Distance of the neutral axis from the middle of the gripper when straight (m).
    pub half_gap: f64,
}

impl FingerPlane {
    /// The plane of a finger that stands `half_gap` (m) from the middle.
    pub fn new(side: Side, half_gap: f64) -> Self {
        Self { sign: side.closing_sign(), half_gap }
    }

    /// A point of the plane, shifted `across` the finger along y (m).
    #[inline]
    pub fn point(&self, p: DVec2, across: f64) -> DVec3 {
        DVec3::new(self.sign * (p.x - self.half_gap), across, -p.y)
    }

    /// A direction in the plane.
    #[inline]
    pub fn direction(&self, d: DVec2) -> DVec3 {
        DVec3::new(self.sign * d.x, 0.0, -d.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_in_the_middle() {
        let finger = Finger { joints: 2, length: 0.1, ..Finger::default() };
        let bent = BentFinger::new(&finger, &[std::f64::consts::FRAC_PI_2, 0.0]);
        // 25 mm down, then 75 mm inward.
        assert!(bent.tip.abs_diff_eq(DVec2::new(0.075, 0.025), 1e-15));
        assert!(bent.segments[1].inward().abs_diff_eq(DVec2::new(0.0, -1.0), 1e-15));
        assert_eq!(bent.joints().count(), 2);
    }

    #[test]
    fn the_two_planes_are_mirror_images() {
        let (p, d) = (DVec2::new(0.01, 0.04), DVec2::new(0.6, 0.8));
        let [left, right] = Side::BOTH.map(|side| FingerPlane::new(side, 0.05));
        let mirror = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
        assert_eq!(left.point(p, 0.002), mirror(right.point(p, 0.002)));
        assert_eq!(left.direction(d), mirror(right.direction(d)));
        assert_eq!(left.point(DVec2::ZERO, 0.0), DVec3::new(-0.05, 0.0, 0.0));
    }
}
