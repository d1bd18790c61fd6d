//! What a finger resists when it bends sideways and twists.

use crate::gripper::{Finger, Pad, Sway, sway_shares};
use glam::DVec3;

/// Unknowns of both fingers out of their planes.
pub(super) const SWAYS: usize = 4;

/// What a finger resists out of its plane; both fingers share it. Pairs are of sideways curvature and of twist.
#[derive(Clone, Debug)]
pub(super) struct Sideways {
    /// Angle of each joint per unit of both (m).
    pub(super) shares: Vec<[f64; 2]>,
    /// Sums of the above (m): the tip turns by these.
    pub(super) turns: [f64; 2],
    /// K_a (N m³) and K_b (N m³): moment per unit, times the shares.
    pub(super) stiffness: [f64; 2],
    damping: [f64; 2],
    /// Inertia of each segment about its centre, along, across and inward (kg m²).
    pub(super) inertias: Vec<DVec3>,
}

impl Sideways {
    /// `stiffness`: bending sideways and torsion (N m²).
    pub(super) fn new(finger: &Finger, pad: &Pad, [bending, torsion]: [f64; 2]) -> Self {
        let lengths: Vec<f64> = finger.segment_lengths().collect();
        let shares: Vec<[f64; 2]> = sway_shares(&lengths).collect();
        let sum = |of: &dyn Fn(&[f64; 2]) -> f64| shares.iter().map(of).sum::<f64>();
        let each = finger.segment_length();
        let stiffness = [bending * sum(&|s| s[0] * s[0] / each), torsion * sum(&|s| s[1] * s[1] / each)];
        let thickness = finger.back + pad.thickness;
        let squares = |a: f64, b: f64| (a * a + b * b) / 12.0;
        let inertias = lengths.iter().map(|l| {
            let mass = finger.mass * l / finger.length;
            DVec3::new(squares(finger.width, thickness), squares(*l, thickness), squares(*l, finger.width)) * mass
        });
        Self {
            turns: [sum(&|s| s[0]), sum(&|s| s[1])],
            stiffness,
            damping: stiffness.map(|k| finger.damping_time * k),
            inertias: inertias.collect(),
            shares,
        }
    }

    /// Diagonal of h C + h² K.
    pub(super) fn resistance(&self, h: f64, which: usize) -> f64 {
        h * self.damping[which] + h * h * self.stiffness[which]
    }

    /// Resistance of the dampers to rates.
    pub(super) fn resisted(&self, rates: [f64; 2]) -> [f64; 2] {
        [self.damping[0] * rates[0], self.damping[1] * rates[1]]
    }

    /// Elastic energy of a finger (J).
    pub(super) fn energy(&self, sway: Sway) -> f64 {
        0.5 * sway.to_array().iter().zip(self.stiffness).map(|(x, k)| k * x * x).sum::<f64>()
    }

    /// Moments that shapes out of the plane stand under, summed, the larger of two states (N m); and elastic energy in
    /// the first (J).
    pub(super) fn strain(&self, before: &[Sway; 2], after: &[Sway; 2]) -> (f64, f64) {
        let mut moments = 0.0;
        for (before, after) in before.iter().zip(after) {
            for (which, (x, y)) in before.to_array().into_iter().zip(after.to_array()).enumerate() {
                moments += self.stiffness[which] / self.turns[which] * x.abs().max(y.abs());
            }
        }
        (moments, before.iter().map(|sway| self.energy(*sway)).sum())
    }

    /// Bound of the turn of any segment (rad/s), from its rates.
    pub(super) fn turning(&self, rates: [f64; 2]) -> f64 {
        self.turns[0] * rates[0].abs() + self.turns[1] * rates[1].abs()
    }

    /// Bound of the speed (m/s) of any point of a finger within `reach` (m) of its tip's axis, from its rates.
    pub(super) fn fastest(&self, rates: &[f64], lengths: &[f64], reach: f64) -> f64 {
        let mut beyond = lengths.iter().sum::<f64>() + reach;
        let arms = self.shares.iter().zip(lengths).map(|(shares, l)| {
            beyond -= l;
            (shares[0] * rates[0].abs() + shares[1] * rates[1].abs()) * beyond
        });
        arms.sum()
    }
}
