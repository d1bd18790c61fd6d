//! The elastic contact springs of one finger: one under each taxel, and a few that guard the blunt end of the tip.

use crate::gripper::{Finger, FingerPlane, Pad, SegmentFrame, SegmentPose, TaxelGrid};
use glam::{DVec2, DVec3};
use std::ops::Range;

/// An elastic contact spring: a short rod with a round end that can be pushed in.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactSpring {
    /// The foot, along and inward of its segment's start, and from the middle of the finger across (m).
    foot: DVec2,
    foot_across: f64,
    /// Unit vector from the foot to the tip of the end: along, across, inward.
    axis: DVec3,
    /// Place of the taxel across the finger (m).
    pub(super) across: f64,
    /// Rest length from foot to skin, H (m).
    pub(super) height: f64,
    /// Small-strain stiffness, k = E a / H (N/m).
    pub(super) stiffness: f64,
}

impl ContactSpring {
    /// From a foot to a tip, both along, across and inward of the segment's start (m).
    fn new(foot: DVec3, tip: DVec3, stiffness: impl Fn(f64) -> f64) -> Self {
        let height = (tip - foot).length();
        Self {
            foot: DVec2::new(foot.x, foot.z),
            foot_across: foot.y,
            axis: (tip - foot) / height,
            across: tip.y,
            height,
            stiffness: stiffness(height),
        }
    }

    /// Foot and axis in the gripper frame.
    #[inline]
    pub(super) fn ray(&self, plane: &FingerPlane, segment: &SegmentPose) -> (DVec3, DVec3) {
        let axis = segment.along * self.axis.x + segment.inward() * self.axis.z;
        let foot = plane.point(segment.point(self.foot.x, self.foot.y), self.foot_across);
        (foot, plane.direction(axis) + DVec3::Y * self.axis.y)
    }

    /// The same on a finger that leaves its plane.
    #[inline(never)]
    pub(super) fn ray_in_space(&self, segment: &SegmentFrame) -> (DVec3, DVec3) {
        (segment.point(self.foot.x, self.foot_across, self.foot.y), segment.axes * self.axis)
    }
}

/// All contact springs of a finger, those of the pad first, in the order of the taxels.
#[derive(Clone, Debug)]
pub(super) struct ContactSprings {
    pub(super) all: Vec<ContactSpring>,
    /// Number of springs that belong to taxels.
    pub(super) on_pad: usize,
    /// Those carried by each of the N + 1 segments.
    by_segment: Vec<Range<usize>>,
    /// Radius of the round ends (m), at most half the length of a spring.
    pub(super) radius: f64,
    /// For each segment the radius of a ball about its middle that holds its contact springs (m).
    pub(super) reach: Vec<f64>,
}

/// Radius of the round ends as a share of the wider pitch. With less a needle sinks in between two columns (here by 22 % of
/// the pad), with more the footprint of a cylinder is wider beside that of a continuum (`palpate study accuracy`).
const END: f64 = 0.4;

/// Guards of the tip: rows across the thickness and columns across the width.
const TIP_ROWS: usize = 2;
const TIP_COLUMNS: usize = 3;

impl ContactSprings {
    pub(super) fn new(finger: &Finger, pad: &Pad, grid: &TaxelGrid) -> Self {
        let lengths: Vec<f64> = finger.segment_lengths().collect();
        let lowest = (0..grid.columns).map(|column| grid.height(column)).fold(pad.thickness, f64::min);
        let radius = (END * grid.row_pitch().max(grid.column_pitch())).min(0.5 * lowest);
        let mut all = Vec::with_capacity(grid.count() + TIP_ROWS * TIP_COLUMNS);
        let mut by_segment: Vec<Range<usize>> = Vec::with_capacity(lengths.len());
        for (j, length) in lengths.iter().enumerate() {
            let from = all.len();
            // Rows follow each other along the finger, so that a segment's taxels are neighbours.
            while all.len() < grid.count() && grid.segment(all.len(), finger.joints) == j {
                let taxel = all.len();
                let tip = DVec3::new(grid.place(taxel, finger).1, grid.across(taxel), grid.height(taxel));
                // Half the width of the round end at the foot, which stays within the finger.
                let beside = (radius * tip.z).sqrt();
                let along = if j == finger.joints { tip.x.min(length - beside) } else { tip.x };
                let across = tip.y.abs().min((0.5 * finger.width - beside).max(0.0)).copysign(tip.y);
                let foot = DVec3::new(along, across, 0.0);
                all.push(ContactSpring::new(foot, tip, |height| pad.modulus * grid.area() / height));
            }
            by_segment.push(from..all.len());
        }
        let on_pad = all.len();
        let last = finger.joints;
        all.extend(tip_guards(finger, pad, lengths[last]));
        by_segment[last].end = all.len();
        let half_width = 0.5 * finger.width;
        let depth = pad.thickness.max(finger.back);
        let reach = (0..lengths.len())
            .map(|j| {
                let along = if j == last { pad.thickness.max(0.5 * lengths[j]) } else { 0.5 * lengths[j] };
                (along * along + depth * depth + half_width * half_width).sqrt()
            })
            .collect();
        Self { on_pad, by_segment, radius, reach, all }
    }

    pub(super) fn of_segment(&self, j: usize) -> Range<usize> {
        self.by_segment[j].clone()
    }
}

/// Contact springs that look out of the blunt end, so that the tip does not sink into a table or the top of an object.
/// They guard the end of the bellows; the pad in front of them has its own contact springs.
fn tip_guards(finger: &Finger, pad: &Pad, last_length: f64) -> impl Iterator<Item = ContactSpring> {
    let (from, to) = (-finger.back, 0.0);
    let (width, height) = (finger.width, pad.thickness);
    let area = (finger.back + pad.thickness) * width / (TIP_ROWS * TIP_COLUMNS) as f64;
    (0..TIP_ROWS * TIP_COLUMNS).map(move |k| {
        let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let inward = from + (to - from) * share(k / TIP_COLUMNS, TIP_ROWS);
        let tip = DVec3::new(last_length, width * (share(k % TIP_COLUMNS, TIP_COLUMNS) - 0.5), inward);
        ContactSpring::new(tip - DVec3::X * height, tip, |height| pad.modulus * area / height)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_taxel_has_a_contact_spring_at_its_place() {
        let (finger, pad) = (Finger::default(), Pad::default());
        let plane = FingerPlane { sign: 1.0, half_gap: 0.04 };
        for joints in [2, 7, 10, 80] {
            let finger = Finger { joints, ..finger.clone() };
            let grid = TaxelGrid::new(&finger, &pad);
            let springs = ContactSprings::new(&finger, &pad, &grid);
            assert_eq!(springs.on_pad, grid.count());
            let mut segments = vec![SegmentPose::default(); joints + 1];
            let lengths: Vec<f64> = finger.segment_lengths().collect();
            crate::gripper::bend(&lengths, &vec![0.0; joints], &mut segments);
            for (j, segment) in segments.iter().enumerate() {
                for k in springs.of_segment(j).filter(|k| *k < springs.on_pad) {
                    let (foot, axis) = springs.all[k].ray(&plane, segment);
                    let want = plane.point(DVec2::new(grid.height(k), grid.arc(k)), grid.across(k));
                    assert!((foot + axis * springs.all[k].height).abs_diff_eq(want, 1e-12), "N = {joints}, {k}");
                }
            }
        }
    }
}
