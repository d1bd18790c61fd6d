//! The elastic contact springs of one finger: one under each taxel, and a few that guard the blunt end of the tip.

use crate::gripper::{Finger, Pad, SegmentFrame, SegmentPose, TaxelGrid};
use glam::{DVec2, DVec3};
use std::ops::Range;

/// An elastic contact spring: a short rod with a round end that can be pushed in along its axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactSpring {
    /// The foot, along and inward of its segment's start (m).
    foot: DVec2,
    /// Distance across the finger (m).
    pub(super) across: f64,
    /// True where it points out of the tip rather than out of the pad.
    points_ahead: bool,
    /// Rest length from foot to skin, H (m).
    pub(super) height: f64,
    /// Small-strain stiffness, k = E a / H (N/m).
    pub(super) stiffness: f64,
}

impl ContactSpring {
    /// Foot and axis in the finger plane.
    #[inline]
    pub(super) fn ray(&self, segment: &SegmentPose) -> (DVec2, DVec2) {
        let axis = if self.points_ahead { segment.along } else { segment.inward() };
        (segment.point(self.foot.x, self.foot.y), axis)
    }

    /// Foot and axis in space.
    #[inline(never)]
    pub(super) fn ray_in_space(&self, segment: &SegmentFrame) -> (DVec3, DVec3) {
        let axis = if self.points_ahead { segment.axes.x_axis } else { segment.axes.z_axis };
        (segment.point(self.foot.x, self.across, self.foot.y), axis)
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
    /// Radius of the round ends (m): half the wider pitch, so that a needle cannot pass between neighbours.
    pub(super) radius: f64,
    /// For each segment the radius of a ball about its middle that holds its contact springs (m).
    pub(super) reach: Vec<f64>,
}

/// Guards of the tip: rows across the thickness and columns across the width.
const TIP_ROWS: usize = 2;
const TIP_COLUMNS: usize = 3;

impl ContactSprings {
    pub(super) fn new(finger: &Finger, pad: &Pad, grid: &TaxelGrid) -> Self {
        let lengths: Vec<f64> = finger.segment_lengths().collect();
        let mut all = Vec::with_capacity(grid.count() + TIP_ROWS * TIP_COLUMNS);
        let mut by_segment: Vec<Range<usize>> = Vec::with_capacity(lengths.len());
        for j in 0..lengths.len() {
            let from = all.len();
            // Rows follow each other along the finger, so that a segment's taxels are neighbours.
            while all.len() < grid.count() && grid.segment(all.len(), finger.joints) == j {
                let taxel = all.len();
                all.push(ContactSpring {
                    foot: DVec2::new(grid.place(taxel, finger).1, 0.0),
                    across: grid.across(taxel),
                    points_ahead: false,
                    height: grid.height(taxel),
                    stiffness: grid.stiffness(taxel),
                });
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
        Self {
            on_pad,
            by_segment,
            radius: 0.5 * grid.row_pitch().max(grid.column_pitch()).min(pad.thickness),
            reach,
            all,
        }
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
    let stiffness = pad.modulus * area / height;
    (0..TIP_ROWS * TIP_COLUMNS).map(move |k| {
        let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let inward = from + (to - from) * share(k / TIP_COLUMNS, TIP_ROWS);
        ContactSpring {
            foot: DVec2::new(last_length - height, inward),
            across: width * (share(k % TIP_COLUMNS, TIP_COLUMNS) - 0.5),
            points_ahead: true,
            height,
            stiffness,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_taxel_has_a_contact_spring_at_its_place() {
        let (finger, pad) = (Finger::default(), Pad::default());
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
                    let (foot, axis) = springs.all[k].ray(segment);
                    assert!((foot.y - grid.arc(k)).abs() < 1e-12 && axis == DVec2::X, "N = {joints}, {k}");
                }
            }
        }
    }
}
