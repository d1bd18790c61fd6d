//! One contact as a convex term of the step's minimisation, after SAP (Castro et al. 2022) and irrotational
//! contact fields (Castro et al. 2023).
//!
//! A contact joins body A (a finger segment or the object) to body B (the object or the world). n points from B
//! to A, v is the velocity of A's point relative to B's, v_n = n . v, v_t = v - v_n n, x0 the compression at the
//! start of the step and xi the shear of the skin at the start of the step.
//!
//! - normal impulse    gamma(v_n) = h f(x0 - h v_n) (1 - d v_n)+
//!   with the pad law f and Hunt-Crossley dissipation d. It falls as v_n rises, so its potential is convex.
//! - friction          e = xi + (h + tau) v_t;  impulse -h k_t e while |h k_t e| <= mu gamma_lag, else
//!   -mu gamma_lag e/|e|: a shear spring with a damper of time tau beside it (Kelvin-Voigt), and a slip limit (a Huber
//!   function of e). The limit uses the normal impulse of the previous step or of the previous pass of the solver (it
//!   lags), not that of the current v: with a limit that depends on v, the friction impulse would not be the gradient
//!   of any potential.
//!
//! A shear spring keeps the object in place: a grasped object creeps 2e-7 mm/s, where velocity-regularised friction
//! lets it slide at 0.015 to 0.066 mm/s. The shear modulus of rubber is E / 3, hence k_t = k / 3.

use crate::gripper::PadLaw;
use glam::{DMat3, DVec3};

/// Counterpart of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Against {
    /// A finger segment against the object.
    Object,
    /// A finger segment, or the object, against the world.
    World,
    /// A finger segment against a segment of the other finger, counted as in [`Acting::Segment`].
    Finger(u32),
}

/// Body that the contact acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Acting {
    /// A finger segment, with index finger * (N + 1) + segment for N joints per finger.
    Segment(u32),
    /// The grasped object.
    Object,
}

/// A contact and its state within the solve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Index under which the shear and the normal impulse are remembered for the next step.
    pub(super) site: u32,
    /// Body A.
    pub(super) acting: Acting,
    /// Body B.
    pub(super) against: Against,
    /// From the reference point (the object's centre of mass) to the contact (m).
    pub(super) arm: DVec3,
    /// Unit normal, from B to A.
    pub(super) normal: DVec3,
    /// Compression at the start of the step (m); negative while apart.
    pub(super) compression: f64,
    /// Law of compression.
    pub(super) law: PadLaw,
    /// Small-strain stiffness along the normal (N/m).
    pub(super) stiffness: f64,
    /// Rest length of the contact spring along the normal (m).
    pub(super) height: f64,
    /// Stiffness of the skin in shear, k_t (N/m).
    pub(super) shear_stiffness: f64,
    /// Friction coefficient.
    pub(super) mu: f64,
    /// Slip limit mu gamma_lag (N s).
    pub(super) limit: f64,
    /// Shear at the start of the step, in the tangent plane (m).
    pub(super) shear: DVec3,
    /// Relative velocity at the current iterate (m/s).
    pub(super) velocity: DVec3,
    /// Its change along the search direction.
    pub(super) change: DVec3,
}

/// Constants shared by all contacts of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactStep {
    /// Step length, h (s).
    pub(super) h: f64,
    /// Dissipation, d (s/m).
    pub(super) dissipation: f64,
    /// Damping of the skin in shear, as a time, tau (s).
    pub(super) shear_damping_time: f64,
}

impl ContactStep {
    /// Factor of the velocity in the friction impulse, h + tau (s).
    fn shear_reach(self) -> f64 {
        self.h + self.shear_damping_time
    }
}

/// Shear stiffness of rubber as a share of its compressive stiffness: G / E of an incompressible solid.
pub(super) const SHEAR_SHARE: f64 = 1.0 / 3.0;

/// Share by which a slip limit that was brought up to date once may still be off.
const NEAR_ENOUGH: f64 = 0.1;

impl Contact {
    /// Normal impulse gamma (N s) and -d gamma / d v_n, both non-negative.
    #[inline]
    pub(super) fn normal_impulse(&self, step: ContactStep, v_n: f64) -> (f64, f64) {
        let ContactStep { h, dissipation: d, .. } = step;
        let damping = 1.0 - d * v_n;
        let compression = self.compression - h * v_n;
        if compression <= 0.0 || damping <= 0.0 {
            return (0.0, 0.0);
        }
        let (f, slope) = self.law.force(self.stiffness, self.height, compression);
        (h * f * damping, h * (h * slope * damping + d * f))
    }

    /// Gradient of the contact's potential with respect to v (N s): minus the impulse on A.
    #[inline]
    pub(super) fn gradient(&self, step: ContactStep, velocity: DVec3) -> DVec3 {
        let v_n = self.normal.dot(velocity);
        let (gamma, _) = self.normal_impulse(step, v_n);
        let mut gradient = self.normal * -gamma;
        if self.limit > 0.0 {
            let e = self.shear + (velocity - self.normal * v_n) * step.shear_reach();
            let pull = e * (step.h * self.shear_stiffness);
            let size = pull.length();
            gradient += if size <= self.limit { pull } else { pull * (self.limit / size) };
        }
        gradient
    }

    /// Hessian of the contact's potential with respect to v (kg), symmetric and positive semi-definite.
    #[inline]
    pub(super) fn hessian(&self, step: ContactStep) -> DMat3 {
        let n = self.normal;
        let v_n = n.dot(self.velocity);
        let (_, along_normal) = self.normal_impulse(step, v_n);
        // Tangential part: `all` times the tangent projector, less `radial` along the direction of slip.
        let (mut all, mut radial, mut slip) = (0.0, 0.0, DVec3::ZERO);
        if self.limit > 0.0 {
            let reach = step.shear_reach();
            let e = self.shear + (self.velocity - n * v_n) * reach;
            let stiffness = self.shear_stiffness;
            let size = e.length();
            if step.h * stiffness * size <= self.limit {
                all = step.h * reach * stiffness;
            } else {
                all = reach * self.limit / size;
                radial = all;
                slip = e / size;
            }
        }
        let column =
            |k: DVec3, n_k: f64, slip_k: f64| k * all + n * ((along_normal - all) * n_k) - slip * (radial * slip_k);
        DMat3::from_cols(column(DVec3::X, n.x, slip.x), column(DVec3::Y, n.y, slip.y), column(DVec3::Z, n.z, slip.z))
    }

    /// Brings the slip limit up to date with the normal impulse at the current iterate; true where that changes the friction.
    /// From the second time on it goes half the way: a limit that is too high leaves too low an impulse, and the next one
    /// would be as wrong the other way.
    pub(super) fn relag(&mut self, step: ContactStep, again: bool) -> bool {
        let v_n = self.normal.dot(self.velocity);
        let latest = self.mu * self.normal_impulse(step, v_n).0;
        if again && (latest - self.limit).abs() <= NEAR_ENOUGH * self.limit {
            return false;
        }
        let limit = if again { 0.5 * (latest + self.limit) } else { latest };
        let least = std::mem::replace(&mut self.limit, limit).min(limit);
        let e = self.shear + (self.velocity - self.normal * v_n) * step.shear_reach();
        step.h * self.shear_stiffness * e.length() > least
    }

    /// Force on A (N): its normal size, and its tangential part.
    pub(super) fn force(&self, step: ContactStep) -> (f64, DVec3) {
        let (gamma, _) = self.normal_impulse(step, self.normal.dot(self.velocity));
        let tangential = -(self.gradient(step, self.velocity) + self.normal * gamma);
        (gamma / step.h, tangential / step.h)
    }

    /// What the step leaves.
    pub(super) fn outcome(&self, step: ContactStep) -> Outcome {
        let v_n = self.normal.dot(self.velocity);
        let (impulse, _) = self.normal_impulse(step, v_n);
        let truth = self.mu * impulse;
        if self.limit <= 0.0 {
            // No friction was applied, so the whole true limit counts as missed.
            return Outcome { impulse, shear: DVec3::ZERO, missed: truth, truth };
        }
        let sliding = self.velocity - self.normal * v_n;
        let stiffness = step.h * self.shear_stiffness;
        let e = self.shear + sliding * step.h;
        let pull = stiffness * e.length();
        let shear = if pull > self.limit { e * (self.limit / pull) } else { e };
        let damped = stiffness * (e + sliding * step.shear_damping_time).length();
        let used = damped.min(self.limit);
        let missed = if used >= self.limit * (1.0 - 1e-9) { (used - truth).abs() } else { (used - truth).max(0.0) };
        Outcome { impulse, shear, missed, truth }
    }
}

/// What a step leaves of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    /// Normal impulse (N s).
    pub(super) impulse: f64,
    /// Shear of the skin (m), as far as friction lets it go.
    pub(super) shear: DVec3,
    /// Error of the lagged slip limit as far as it changed the friction, and the true limit (N s).
    pub(super) missed: f64,
    pub(super) truth: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: ContactStep = ContactStep { h: 1.0 / 300.0, dissipation: 2.0, shear_damping_time: 5e-4 };

    fn contact() -> Contact {
        Contact {
            site: 0,
            acting: Acting::Object,
            against: Against::World,
            arm: DVec3::ZERO,
            normal: DVec3::new(0.6, 0.0, 0.8),
            compression: 1e-3,
            law: PadLaw::NeoHookean,
            stiffness: 156.0,
            height: 0.008,
            shear_stiffness: 52.0,
            mu: 0.8,
            limit: 2e-4,
            shear: DVec3::new(4e-4, 1e-4, -3e-4),
            velocity: DVec3::ZERO,
            change: DVec3::ZERO,
        }
    }

    #[test]
    fn the_hessian_is_the_slope_of_the_gradient() {
        // Sticking, slipping, apart, and separating faster than dissipation allows.
        for (velocity, limit) in [
            (DVec3::new(0.01, -0.02, 0.03), 1.0),
            (DVec3::new(0.3, 0.4, -0.1), 1e-5),
            (DVec3::new(1.0, 0.0, 1.0), 1e-5),
            (DVec3::new(0.02, 0.03, -0.05), 0.0),
        ] {
            let mut c = Contact { limit, velocity, ..contact() };
            let step = 1e-6;
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let slope = (c.gradient(STEP, velocity + axis * step) - c.gradient(STEP, velocity - axis * step))
                    / (2.0 * step);
                assert!(slope.abs_diff_eq(c.hessian(STEP) * axis, 1e-6), "{velocity} {limit}");
            }
            c.relag(STEP, false);
            assert!(c.limit >= 0.0);
        }
    }

    #[test]
    fn friction_stays_within_its_limit_and_opposes_slip() {
        let c = Contact { limit: 1e-5, velocity: DVec3::new(0.0, 0.5, 0.0), ..contact() };
        let (_, tangential) = c.force(STEP);
        assert!((tangential.length() * STEP.h / c.limit - 1.0).abs() < 1e-12);
        assert!(tangential.y < 0.0);
        let (normal, frictionless) = Contact { limit: 0.0, ..c }.force(STEP);
        assert!(normal > 0.0 && frictionless.length() < 1e-18);
    }

    #[test]
    fn a_contact_never_pulls() {
        let c = Contact { velocity: DVec3::new(3.0, 0.0, 3.0), ..contact() };
        assert_eq!(c.force(STEP).0, 0.0);
    }
}
