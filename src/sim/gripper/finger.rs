//! One soft finger as a planar chain of N spring-loaded rotational joints (paper, section IV-A).
//!
//! Joints sit at the *middle* of equal segments of length l = L / N, so that the first half segment is fixed to
//! the palm and the last half segment is the tip: this layout converges at second order in N, where joints at
//! segment starts converge at first order only (tip-load error 0.25 % against 15.5 % at N = 10).

use super::Auto;
use serde::{Deserialize, Serialize};

/// Description of a finger. Defaults follow the SoMo project's calibrated soft finger: 100 mm long, 30 g, 0.42 N m/rad
/// per joint at N = 10, which is a bending stiffness of 4.2e-3 N m².
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Finger {
    /// Length from palm to tip, L (m).
    pub length: f64,
    /// Width across the bending plane (m).
    pub width: f64,
    /// Depth of the bellows behind the neutral axis (m).
    pub back: f64,
    /// Number of joints, N.
    pub joints: usize,
    /// Mass (kg), spread evenly along the length.
    pub mass: f64,
    /// Bending stiffness EI (N m²); each joint has k = EI / l.
    pub bending_stiffness: f64,
    /// Relaxation time c / k of every joint (s).
    pub damping_time: f64,
    /// Curvature at which the bellows close up and bending stops (1/m).
    pub curvature_limit: f64,
    /// Share of each joint's stiffness that a lasting load relaxes away.
    pub creep_share: f64,
    /// Time in which that share falls to 1/e of itself at a held angle (s).
    pub creep_time: f64,
    /// Stiffness out of the bending plane.
    pub sideways: Sideways,
}

/// Stiffness of a finger out of its bending plane. Give both or neither: `auto` is rigid.
///
/// For a solid rectangular section of width w, thickness t and bending stiffness EI, the sideways one is EI (w / t)²; see
/// [`Finger::of_solid_section`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Sideways {
    /// Bending stiffness sideways (N m²).
    pub bending_stiffness: Auto,
    /// Torsional stiffness GJ (N m²).
    pub torsional_stiffness: Auto,
}

impl Sideways {
    /// Both stiffnesses, bending and torsional (N m²); `None` where the finger is rigid out of its plane.
    pub fn stiffness(&self) -> Option<[f64; 2]> {
        Some([self.bending_stiffness.value()?, self.torsional_stiffness.value()?])
    }
}

impl Default for Finger {
    fn default() -> Self {
        Self {
            length: 0.100,
            width: 0.020,
            back: 0.012,
            joints: 10,
            mass: 0.030,
            bending_stiffness: 4.2e-3,
            damping_time: 0.02, // tuned: a released finger settles within two swings, as silicone does
            curvature_limit: 60.0, // tuned: bellows of 10 mm pitch and 12 mm depth touch at a radius of about 17 mm
            // Assumed, not measured: soft platinum silicones lose about a tenth of their stress over tens of seconds.
            creep_share: 0.10,
            creep_time: 30.0,
            sideways: Sideways::default(),
        }
    }
}

impl Finger {
    /// Fewest joints a finger may have.
    pub const FEWEST_JOINTS: u32 = 2;
    /// Most joints a finger may have.
    pub const MOST_JOINTS: u32 = 80;

    /// Stiffness out of the plane that a solid rectangular section of rubber would have, given the one in it: width w,
    /// thickness t of bellows and pad, G = E / 3; J after Roark, 3 % off at most.
    pub fn of_solid_section(&self, pad_thickness: f64) -> Sideways {
        let (w, t) = (self.width, self.back + pad_thickness);
        let modulus = self.bending_stiffness / (w * t.powi(3) / 12.0);
        let (long, short) = (w.max(t), w.min(t));
        let ratio = short / long;
        let torsion = long * short.powi(3) * (1.0 / 3.0 - 0.21 * ratio * (1.0 - ratio.powi(4) / 12.0));
        Sideways {
            bending_stiffness: Auto::Value(self.bending_stiffness * (w / t).powi(2)),
            torsional_stiffness: Auto::Value(modulus / 3.0 * torsion),
        }
    }

    /// Length of one full segment, l = L / N (m).
    pub fn segment_length(&self) -> f64 {
        self.length / self.joints as f64
    }

    /// Stiffness of each joint, k = EI / l (N m/rad).
    pub fn joint_stiffness(&self) -> f64 {
        self.bending_stiffness / self.segment_length()
    }

    /// Damping of each joint, c (N m s/rad).
    pub fn joint_damping(&self) -> f64 {
        self.damping_time * self.joint_stiffness()
    }

    /// Lengths of the N + 1 rigid segments (m): half, N - 1 whole, half.
    pub fn segment_lengths(&self) -> impl Iterator<Item = f64> + use<> {
        let (n, whole) = (self.joints, self.segment_length());
        (0..=n).map(move |j| if j == 0 || j == n { 0.5 * whole } else { whole })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_add_up_to_the_finger() {
        for joints in [2, 3, 10, 80] {
            let finger = Finger { joints, ..Finger::default() };
            let total: f64 = finger.segment_lengths().sum();
            assert_eq!(finger.segment_lengths().count(), joints + 1);
            assert!((total - finger.length).abs() < 1e-15);
        }
    }

    #[test]
    fn a_square_section_is_as_stiff_sideways_and_a_plate_twists_as_in_saint_venants_theory() {
        // Square: EI alike and J = 0.1406 a⁴, so that GJ = 0.5624 EI; thin plate: J = w t³ / 3, GJ = 4 / 3 EI.
        let square = Finger { width: 0.02, back: 0.012, ..Finger::default() };
        let [bending, torsion] = square.of_solid_section(0.008).stiffness().expect("given");
        assert!((bending / square.bending_stiffness - 1.0).abs() < 1e-12);
        assert!((torsion / square.bending_stiffness / 0.5624 - 1.0).abs() < 0.01, "{torsion}");
        let plate = Finger { width: 10.0, ..square };
        let [bending, torsion] = plate.of_solid_section(0.008).stiffness().expect("given");
        assert!((bending / plate.bending_stiffness / 250_000.0 - 1.0).abs() < 1e-9);
        assert!((torsion / plate.bending_stiffness / (4.0 / 3.0) - 1.0).abs() < 0.01);
    }

    #[test]
    fn the_default_joint_is_the_calibrated_one() {
        assert!((Finger::default().joint_stiffness() - 0.42).abs() < 1e-12);
    }
}
