//! From points of contact to taxels. rapier's segments are rigid: they touch an object in a few points, wherever these
//! happen to be found. Such a force is spread over the skin by the pad's own law.
//!
//! For every loaded segment the object is pushed on into the skin by a depth delta, the same for all its taxels, until
//!
//! ```text
//! sum over taxels  f_t(c_t + delta) = F
//! ```
//!
//! with F rapier's force along the segment's inward axis, f_t the law of a contact spring and c_t the overlap of the
//! undeformed skin with the object, negative where they are apart. Shear is shared out in proportion. The sum over a
//! segment is rapier's force; where on the segment it acts is the pad's answer, not rapier's.

use super::world::Touch;
use crate::frame::TaxelLoad;
use crate::gripper::{Finger, FingerPlane, PadLaw, SegmentPose, Side, TaxelGrid};
use glam::DVec3;

/// Taxels and their segments.
#[derive(Clone, Debug)]
pub(super) struct Skin {
    grid: TaxelGrid,
    finger: Finger,
    law: PadLaw,
    /// Taxels of one pad by the N + 1 segments that carry them.
    by_segment: Vec<Vec<usize>>,
}

/// Halvings of the interval that holds delta: 60 exhaust the digits of a number.
const HALVINGS: usize = 60;

impl Skin {
    pub(super) fn new(finger: &Finger, law: PadLaw, grid: TaxelGrid) -> Self {
        let mut by_segment = vec![Vec::new(); finger.joints + 1];
        for taxel in 0..grid.count() {
            by_segment[grid.segment(taxel, finger.joints)].push(taxel);
        }
        Self { grid, finger: finger.clone(), law, by_segment }
    }

    /// Overlap of the undeformed skin over a taxel with a surface at distance `gap` (m).
    fn overlap(&self, plane: &FingerPlane, segments: &[SegmentPose], taxel: usize, gap: &impl Fn(DVec3) -> f64) -> f64 {
        let (segment, along) = self.grid.place(taxel, &self.finger);
        let skin = segments[segment].point(along, self.grid.height(taxel));
        -gap(plane.point(skin, self.grid.across(taxel)))
    }

    /// Deepest overlap of the skin of one finger (m), zero where nothing is touched.
    pub(super) fn deepest(&self, plane: &FingerPlane, segments: &[SegmentPose], gap: &impl Fn(DVec3) -> f64) -> f64 {
        (0..self.grid.count()).map(|taxel| self.overlap(plane, segments, taxel, gap)).fold(0.0, f64::max)
    }

    /// Loads on the taxels of one finger, from the forces on its segments.
    pub(super) fn loads(
        &self,
        plane: &FingerPlane,
        segments: &[SegmentPose],
        touches: &[Vec<Touch>],
        gap: &impl Fn(DVec3) -> f64,
        side: Side,
    ) -> Vec<TaxelLoad> {
        let first = side.index() * self.grid.count();
        let mut loads = Vec::new();
        for ((segment, touches), taxels) in segments.iter().zip(touches).zip(&self.by_segment) {
            let [along, inward] = [segment.along, segment.inward()].map(|axis| plane.direction(axis));
            // Contacts behind the neutral axis, as at the end of the tip, load no taxel.
            let axis = plane.point(segment.start, 0.0);
            let on_pad = |touch: &&Touch| (touch.point - axis).dot(inward) > 0.0;
            let force: DVec3 = touches.iter().filter(on_pad).map(|touch| touch.force).sum();
            let pressing = -force.dot(inward);
            if pressing <= 0.0 || taxels.is_empty() {
                continue;
            }
            let overlaps: Vec<f64> = taxels.iter().map(|taxel| self.overlap(plane, segments, *taxel, gap)).collect();
            for (taxel, normal) in taxels.iter().zip(self.spread(taxels, &overlaps, pressing)) {
                if normal > 0.0 {
                    let share = normal / pressing;
                    loads.push(TaxelLoad {
                        taxel: (first + taxel) as u16,
                        normal: normal as f32,
                        along: (share * force.dot(along)) as f32,
                        across: (share * force.y) as f32,
                    });
                }
            }
        }
        loads.sort_by_key(|load| load.taxel);
        loads
    }

    /// Forces of the contact springs (N) that add up to `total` (N).
    fn spread(&self, taxels: &[usize], overlaps: &[f64], total: f64) -> Vec<f64> {
        let forces = |delta: f64| -> Vec<f64> {
            let spring = |(taxel, overlap): (&usize, &f64)| {
                self.law.force(self.grid.stiffness(*taxel), self.grid.height(*taxel), overlap + delta).0
            };
            taxels.iter().zip(overlaps).map(spring).collect()
        };
        let sum = |delta: f64| forces(delta).iter().sum::<f64>();
        let mut low = -overlaps.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // Every contact spring stiffens, so that doubling the depth at least doubles the force.
        let mut reach = self.finger.length;
        while sum(low + reach) < total && reach.is_finite() {
            reach *= 2.0;
        }
        let mut high = low + reach;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if sum(middle) < total {
                low = middle;
            } else {
                high = middle;
            }
        }
        let found = forces(high);
        let scale = total / found.iter().sum::<f64>();
        found.into_iter().map(|force| force * scale).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gripper::GripperModel;
    use glam::DVec2;

    /// A straight left finger with a level plate over segment 3, and one point of contact there.
    fn plate_loads(force: DVec3, tilt: f64, inward: f64) -> Vec<TaxelLoad> {
        let gripper = GripperModel::default();
        let plane = gripper.plane(Side::Left);
        let lengths: Vec<f64> = gripper.finger.segment_lengths().collect();
        let mut segments = vec![SegmentPose::default(); 11];
        crate::gripper::bend(&lengths, &[0.0; 10], &mut segments);
        let skin = Skin::new(&gripper.finger, gripper.pad.law, gripper.taxels());
        let mut touches = vec![Vec::new(); 11];
        touches[3].push(Touch { link: 3, point: plane.point(DVec2::new(inward, 0.03), 0.0), force });
        let top = plane.point(DVec2::new(gripper.pad.thickness, 0.0), 0.0).x;
        skin.loads(&plane, &segments, &touches, &|p| top - p.x + tilt * (p.z + 0.03), Side::Left)
    }

    #[test]
    fn the_sum_over_a_segment_is_the_force_on_it() {
        let force = DVec3::new(-0.7, 0.1, 0.2);
        let loads = plate_loads(force, 0.0, 0.008);
        let sum = |part: fn(&TaxelLoad) -> f32| loads.iter().map(|l| f64::from(part(l))).sum::<f64>();
        assert!((sum(|l| l.normal) - 0.7).abs() < 1e-6);
        assert!((sum(|l| l.across) - 0.1).abs() < 1e-6 && (sum(|l| l.along) + 0.2).abs() < 1e-6);
        assert!(loads.iter().all(|l| (40..56).contains(&l.taxel)), "on segment 3");
    }

    #[test]
    fn a_level_plate_loads_all_rows_alike_and_a_tilted_one_the_nearest() {
        let level = plate_loads(DVec3::new(-4.0, 0.0, 0.0), 0.0, 0.008);
        assert_eq!(level.len(), 16);
        assert!((level[0].normal - level[12].normal).abs() < 1e-6);
        let tilted = plate_loads(DVec3::new(-4.0, 0.0, 0.0), 0.03, 0.008);
        let rows: Vec<f32> = tilted.chunks(4).map(|row| row.iter().map(|l| l.normal).sum()).collect();
        assert!(rows.windows(2).all(|pair| pair[1] > pair[0]), "{rows:?}");
    }

    #[test]
    fn the_end_of_the_tip_loads_no_taxel() {
        assert!(plate_loads(DVec3::new(-0.1, 0.0, 1.0), 0.0, -0.002).is_empty());
    }
}
