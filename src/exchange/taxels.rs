//! Taxels of both pads of a simulated gripper, as the formats write them: the force on each and its place.
//!
//! Axes are fingers (left, right), rows from the palm to the tip, and columns towards the gripper's positive y. A normal
//! force presses into the pad; shear acts on the finger, towards higher rows and towards higher columns.

use glam::DVec3;
use palpate_sim::frame::{Frame, TaxelLoad};
use palpate_sim::gripper::{GripperModel, Side, TaxelGrid};

/// Names of arrays and columns: normal force (N), shear (N), place (m).
pub(crate) const NORMAL: &str = "taxel_normal";
pub(crate) const SHEAR: &str = "taxel_shear";
pub(crate) const POSITION: &str = "taxel_position";

/// True for what is no channel but the taxels of this program.
pub(crate) fn is_taxels(name: &str) -> bool {
    [NORMAL, SHEAR, POSITION].contains(&name)
}

/// Taxels of a gripper.
pub(crate) struct Taxels<'a> {
    gripper: &'a GripperModel,
    grid: TaxelGrid,
}

/// A loaded taxel.
pub(crate) struct LoadedTaxel {
    /// Segment that carries it, and its number on its pad.
    pub(crate) segment: usize,
    pub(crate) taxel: usize,
    pub(crate) load: TaxelLoad,
    /// Its place on the undeformed skin, in the gripper (m): the skin is indented by at most the pad's thickness.
    pub(crate) place: DVec3,
    /// Force on the finger, in the gripper's axes (N).
    pub(crate) force: DVec3,
}

impl<'a> Taxels<'a> {
    pub(crate) fn of(gripper: &'a GripperModel) -> Self {
        Self { gripper, grid: gripper.taxels() }
    }

    /// Fingers, rows and columns.
    pub(crate) fn shape(&self) -> [usize; 3] {
        [Side::BOTH.len(), self.grid.rows, self.grid.columns]
    }

    /// Taxels on both pads.
    pub(crate) fn count(&self) -> usize {
        self.shape().iter().product()
    }

    /// Force on every taxel (N): normal, towards the tip, across.
    pub(crate) fn forces(&self, frame: &Frame) -> Vec<[f32; 3]> {
        let mut forces = vec![[0.0; 3]; self.count()];
        for TaxelLoad { taxel, normal, along, across } in &frame.taxels {
            if let Some(force) = forces.get_mut(usize::from(*taxel)) {
                *force = [*normal, *along, *across];
            }
        }
        forces
    }

    /// Place of every taxel's skin on the straight finger (m), in the frame of its first segment: x out of the pad, z from the
    /// palm to the tip.
    pub(crate) fn positions(&self) -> Vec<[f64; 3]> {
        let place = |side: Side, taxel: usize| {
            [self.grid.height(taxel), -side.closing_sign() * self.grid.across(taxel), self.grid.arc(taxel)]
        };
        Side::BOTH.into_iter().flat_map(|side| (0..self.grid.count()).map(move |taxel| place(side, taxel))).collect()
    }

    /// Loaded taxels of a finger.
    pub(crate) fn loaded(&self, frame: &Frame, side: Side) -> impl Iterator<Item = LoadedTaxel> {
        let finger = frame.placed(self.gripper, side);
        frame.loads(side, self.grid.count()).map(move |(taxel, load)| {
            let (segment, along) = self.grid.place(taxel, &self.gripper.finger);
            let place = finger.point(segment, along, self.grid.across(taxel), self.grid.height(taxel));
            let force = finger.axes(segment) * DVec3::from([load.along, load.across, -load.normal].map(f64::from));
            LoadedTaxel { segment, taxel, load, place, force }
        })
    }
}
