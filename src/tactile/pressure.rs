//! Load on a stretch of a pad, and its pressure P = F / A.
//!
//! A pad of the real gripper measures its force; its pressure is that over its sensing area, whatever touches it. The
//! contact pressure of simulations (paper, section IV-A1) is force over the area of the contact.
//!
//! The paper takes for A the convex hull of the contact points. That area jumps by half when one more row of taxels
//! touches, and is zero, the pressure undefined, while a single row or point touches. The participation area
//!
//!   A = (sum f)² / sum(f² / a)
//!
//! is defined whenever there is a force: it is the area of n equally loaded taxels, and grows smoothly as load
//! spreads. Sum of taxel pressure times area is the force exactly.

use super::electronics::PadPart;
use super::{SignalDefinition, Span};
use glam::DVec2;
use palpate_geometry::convex_hull_area;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::{Side, TaxelGrid};

/// Areas up to this are rounding errors of a hull around a row (m²); taxels are a thousand times larger.
const LEAST_AREA: f64 = 1e-9;

/// The loaded part of a stretch of one pad.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactPatch {
    force: f64,
    sum_of_squares_over_area: f64,
    points: Vec<DVec2>,
}

impl ContactPatch {
    /// Gathers the loads on a span of one pad. Taxels that are pulled rather than pushed count as unloaded.
    pub fn new(frame: &Frame, side: Side, grid: &TaxelGrid, span: &Span) -> Self {
        let length = grid.row_pitch() * grid.rows as f64;
        let area = grid.area();
        let mut patch = Self::default();
        for (taxel, load) in frame.loads(side, grid.count()) {
            let (arc, force) = (grid.arc(taxel), f64::from(load.normal));
            if force > 0.0 && span.holds(arc / length) {
                patch.force += force;
                patch.sum_of_squares_over_area += force * force / area;
                patch.points.push(DVec2::new(arc, grid.across(taxel)));
            }
        }
        patch
    }

    /// Total normal force, F (N).
    pub fn force(&self) -> f64 {
        self.force
    }

    /// Participation area (m²); zero without load.
    pub fn participation_area(&self) -> f64 {
        if self.force > 0.0 { self.force * self.force / self.sum_of_squares_over_area } else { 0.0 }
    }

    /// Area of the convex hull of the loaded taxels' middles on the unrolled pad (m²).
    pub fn hull_area(&self) -> f64 {
        convex_hull_area(&mut self.points.clone())
    }

    /// Pressure (Pa): zero without load, `None` where load spans no area.
    pub fn pressure(&self, signals: SignalDefinition) -> Option<f64> {
        if self.force == 0.0 {
            return Some(0.0);
        }
        let area = match signals {
            SignalDefinition::Parts => PadPart::ACTIVE_AREA,
            SignalDefinition::Contact => self.participation_area(),
            SignalDefinition::Hull => self.hull_area(),
        };
        (area > LEAST_AREA).then(|| self.force / area)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::frame::TaxelLoad;
    use palpate_sim::gripper::{Finger, Pad, Phase};

    fn patch(loads: &[(usize, f32)]) -> (ContactPatch, TaxelGrid) {
        let grid = TaxelGrid::new(&Finger::default(), &Pad::default());
        let frame = Frame {
            sample: 0,
            t: 0.0,
            line_bar: 0.0,
            phase: Phase::Hold,
            q: vec![0.0; 20],
            sways: [palpate_sim::gripper::Sway::NONE; 2],
            hand: glam::DVec3::ZERO,
            world_from_object: None,
            taxels: loads
                .iter()
                .map(|&(taxel, normal)| TaxelLoad { taxel: taxel as u16, normal, along: 0.0, across: 0.0 })
                .collect(),
        };
        (ContactPatch::new(&frame, Side::Left, &grid, &Span::WHOLE), grid)
    }

    #[test]
    fn equal_loads_participate_with_their_whole_area() {
        // The contact patch of a cube: six rows of four taxels, all alike.
        let loads: Vec<(usize, f32)> = (80..104).map(|taxel| (taxel, 0.25)).collect();
        let (patch, grid) = patch(&loads);
        assert!((patch.force() - 6.0).abs() < 1e-12);
        assert!((patch.participation_area() - 24.0 * grid.area()).abs() < 1e-15);
        let pressure = patch.pressure(SignalDefinition::Contact).expect("loaded");
        assert!((pressure - 0.25 / grid.area()).abs() < 1e-9);
        // The hull runs through taxel middles: five row pitches by three column pitches.
        let hull = 15.0 * grid.area();
        let pad = patch.pressure(SignalDefinition::Parts).expect("always defined");
        assert!((pad * 169.717e-6 - 6.0).abs() < 1e-4, "{pad}");
        assert!((patch.pressure(SignalDefinition::Hull).expect("has an area") - 6.0 / hull).abs() < 1e-9);
    }

    #[test]
    fn a_single_row_has_no_hull_but_a_pressure() {
        let (patch, _) = patch(&[(80, 0.1), (81, 0.2), (82, 0.2), (83, 0.1)]);
        assert_eq!(patch.pressure(SignalDefinition::Hull), None);
        assert!(patch.pressure(SignalDefinition::Contact).is_some_and(|p| p > 0.0));
        // Points in a row but for rounding.
        let points = [(0.0, 0.1), (0.3, 0.4), (0.6, 0.7 + 1e-16)].map(|(x, y)| 0.01 * DVec2::new(x, y));
        let row = ContactPatch { points: points.to_vec(), ..patch };
        assert!(row.hull_area() < LEAST_AREA && row.pressure(SignalDefinition::Hull).is_none());
    }

    #[test]
    fn no_load_is_no_pressure() {
        let (patch, _) = patch(&[(5, -0.1)]);
        assert_eq!(patch.pressure(SignalDefinition::Hull), Some(0.0));
        assert_eq!(patch.pressure(SignalDefinition::Contact), Some(0.0));
    }
}
