//! The compliant pad on the inner side of a finger: a field of elastic contact springs ("taxels"), each pushed in along
//! its own axis, with a law that gets stiffer the more it is compressed.
//!
//! A contact spring of cross-section a and rest length H under compression x, stretch lambda = 1 - x / H:
//!
//! - linear:       f = (E a / H) x
//! - neo-Hookean:  f = (E a / 3) (1 / lambda² - lambda)   (uniaxial; Treloar, *The Physics of Rubber Elasticity*)
//!
//! Both have the same slope at x = 0. A linear pad has no bottom: enough torque pushes an object clean through it.
//! The neo-Hookean force grows without bound as x approaches H; beyond 95 % compression it is continued by its
//! tangent, so that any overlap, however deep, has a finite force and the law stays convex.

use serde::{Deserialize, Serialize};

/// Force law of a contact spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PadLaw {
    /// Force proportional to compression: an elastic (Winkler) foundation, for comparison with closed forms.
    Linear,
    /// Rubber in compression: stiffens towards its bottom.
    NeoHookean,
}

/// Description of a pad.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Pad {
    /// Height of the pad above the neutral axis, which is also the rest length of its contact springs, H (m).
    pub thickness: f64,
    /// Young's modulus E (Pa).
    pub modulus: f64,
    /// The law of compression.
    pub law: PadLaw,
    /// Radius of the crown across the pad (m): the middle stands proud by y² / (2 radius) at distance y.
    pub crown_radius: f64,
    /// Hunt-Crossley dissipation (s/m): force is multiplied by (1 - d v), v the speed of separation.
    pub dissipation: f64,
    /// Damping of the skin in shear, as a time (s): its shear resists like k_t (xi + time v).
    pub shear_damping_time: f64,
    /// Friction coefficient of the pad's skin against a surface of coefficient 1; combined as a geometric mean.
    pub friction: f64,
    /// Taxel rows along the finger; they are fixed by arc length and do not move when N changes.
    pub rows: usize,
    /// Taxel columns across the finger.
    pub columns: usize,
}

impl Default for Pad {
    fn default() -> Self {
        Self {
            thickness: 0.008,
            modulus: 1.0e5, // a soft silicone, Shore 00-30
            law: PadLaw::NeoHookean,
            crown_radius: 0.020,
            dissipation: 2.0,         // tuned: contact does not ring at 75 Hz sampling
            shear_damping_time: 2e-3, // a loss factor of 0.1 at 8 Hz, where held objects swing between the fingers
            friction: 1.0,
            rows: 40,
            columns: 4,
        }
    }
}

impl Pad {
    /// Height of the undeformed skin above the neutral axis at a distance `across` from the middle (m).
    pub fn height(&self, across: f64) -> f64 {
        self.thickness - across * across / (2.0 * self.crown_radius)
    }
}

/// Compression, as a share of the rest length, beyond which the neo-Hookean law is continued by its tangent.
const TANGENT_FROM: f64 = 0.95;

impl PadLaw {
    /// Force (N) and its slope (N/m) of a contact spring with small-strain stiffness `k` = E a / H (N/m) and rest
    /// length `height` (m) under compression `x` (m). Zero without compression.
    #[inline]
    pub fn force(self, k: f64, height: f64, x: f64) -> (f64, f64) {
        if x <= 0.0 {
            return (0.0, 0.0);
        }
        match self {
            Self::Linear => (k * x, k),
            Self::NeoHookean => {
                let strain = x / height;
                let lambda = 1.0 - strain.min(TANGENT_FROM);
                let inverse_square = 1.0 / (lambda * lambda);
                let slope = k / 3.0 * (1.0 + 2.0 * inverse_square / lambda);
                let force = k * height / 3.0 * (inverse_square - lambda);
                (force + slope * height * (strain - TANGENT_FROM).max(0.0), slope)
            }
        }
    }

    /// Elastic energy (J) of a contact spring under compression `x` (m): the integral of the force.
    pub fn energy(self, k: f64, height: f64, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        match self {
            Self::Linear => 0.5 * k * x * x,
            Self::NeoHookean => {
                let strain = x / height;
                let lambda = 1.0 - strain.min(TANGENT_FROM);
                let rubber = k * height * height / 3.0 * (1.0 / lambda + 0.5 * lambda * lambda - 1.5);
                let beyond = height * (strain - TANGENT_FROM).max(0.0);
                let (force, slope) = self.force(k, height, x.min(TANGENT_FROM * height));
                rubber + force * beyond + 0.5 * slope * beyond * beyond
            }
        }
    }

    /// Compression (m) under a steady force (N): the inverse of [`PadLaw::force`].
    pub fn compression(self, k: f64, height: f64, force: f64) -> f64 {
        if force <= 0.0 {
            return 0.0;
        }
        // The force is convex and grows at least as k x, so Newton from x = f / k falls monotonically.
        let mut x = force / k;
        for _ in 0..60 {
            let (f, slope) = self.force(k, height, x);
            let step = (f - force) / slope;
            x -= step;
            if step.abs() < 1e-12 * height {
                break;
            }
        }
        x.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: f64 = 156.0;
    const H: f64 = 0.008;

    #[test]
    fn half_compressed_rubber() {
        // lambda = 1/2: f = (E a / 3) (4 - 1/2), with E a = k H.
        let (force, _) = PadLaw::NeoHookean.force(K, H, H / 2.0);
        assert!((force - K * H * 3.5 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn the_laws_agree_for_small_strains() {
        let x = 1e-4 * H;
        let (rubber, _) = PadLaw::NeoHookean.force(K, H, x);
        assert!((rubber / (K * x) - 1.0).abs() < 2e-4);
    }

    #[test]
    fn force_grows_with_compression_without_jumps_and_slope_is_its_derivative() {
        for law in [PadLaw::Linear, PadLaw::NeoHookean] {
            let mut before = (0.0, 0.0);
            for i in 1..=4000 {
                let x = f64::from(i) * H / 2000.0;
                let now = law.force(K, H, x);
                let step = 1e-9;
                let slope = (law.force(K, H, x + step).0 - law.force(K, H, x - step).0) / (2.0 * step);
                assert!((slope / now.1 - 1.0).abs() < 1e-3, "{law:?} at {x}");
                assert!(now.0 > before.0 && now.1 >= before.1, "{law:?} is convex at {x}");
                before = now;
            }
        }
    }

    #[test]
    fn force_is_the_slope_of_the_energy() {
        for law in [PadLaw::Linear, PadLaw::NeoHookean] {
            for x in [1e-4, 2e-3, 0.006, 0.0075] {
                let step = 1e-7;
                let slope = (law.energy(K, H, x + step) - law.energy(K, H, x - step)) / (2.0 * step);
                assert!((slope / law.force(K, H, x).0 - 1.0).abs() < 1e-5, "{law:?} at {x}");
            }
        }
    }

    #[test]
    fn compression_inverts_force() {
        for law in [PadLaw::Linear, PadLaw::NeoHookean] {
            for x in [1e-6, 1e-4, 1e-3, 0.005, 0.0068, 0.0072, 0.02] {
                let (force, _) = law.force(K, H, x);
                assert!((law.compression(K, H, force) / x - 1.0).abs() < 1e-9, "{law:?} at {x}");
            }
            assert_eq!(law.compression(K, H, 0.0), 0.0);
        }
    }
}
