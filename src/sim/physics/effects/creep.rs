//! Creep: a joint under lasting load keeps yielding, as silicone does. A standard linear solid in every joint:
//!
//! ```text
//!   torque = (1 - s) k q  +  s k e        e' = q' - e / tau
//!            spring          spring and dashpot in series (Maxwell), e the strain of its spring
//! ```
//!
//! k is the stiffness at once, (1 - s) k the final stiffness; s and tau are the finger's `creep_share` and
//! `creep_time`. Under a constant torque T, and at a held angle q0,
//!
//! - creep       q = T / ((1 - s) k) (1 - s exp(-(1 - s) t / tau))
//! - relaxation  T = q0 k ((1 - s) + s exp(-t / tau))
//!
//! Like everything else the branch is taken at the *end* of the step: e+ = e + h (v - e+ / tau) = a e + b v, with
//! a = 1 / (1 + h / tau) and b = h a. Its torque then joins the minimisation: it adds h s k b to the diagonal, which is
//! positive for every h, so that creep makes no step unstable. The state keeps the dashpot's angle q - e. (The exact
//! a = exp(-h / tau) is no better in single steps, and would make steps of two stages first order.)

use super::situation::Situation;
use super::{Rule, Ruling};
use crate::gripper::Finger;
use palpate_geometry::units::three_digits;

pub(super) const RULE: Rule = Rule {
    about: "Joints under lasting load keep yielding, as silicone does.",
    number: "stiffness that relaxes within the grasp / stiffness",
    threshold: 0.01, // tuned by `palpate study effects`: changes are seen from 0.02 on
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let finger = situation.finger();
    let (time, share) = (finger.creep_time, finger.creep_share);
    // While the fingers close, the load is there half of the time.
    let loaded = situation.hold_s() + 0.5 * situation.closing_s();
    let facts = format!(
        "the load lasts {} s; {} % of the stiffness relaxes in {} s",
        three_digits(loaded),
        three_digits(100.0 * share),
        three_digits(time)
    );
    Ruling { possible: share > 0.0, number: share * -(-loaded / time).exp_m1(), facts }
}

/// The Maxwell branch of every joint.
#[derive(Clone, Copy, Debug)]
pub(in crate::physics) struct Relaxation {
    /// Stiffness of its spring, s k (N m/rad).
    stiffness: f64,
    /// Relaxation time, tau (s).
    time: f64,
}

impl Relaxation {
    pub(in crate::physics) fn new(finger: &Finger) -> Self {
        Self { stiffness: finger.creep_share * finger.joint_stiffness(), time: finger.creep_time }
    }

    /// a and b of the module page.
    fn course(&self, h: f64) -> (f64, f64) {
        let a = 1.0 / (1.0 + h / self.time);
        (a, h * a)
    }

    /// Turns joints that were gathered with their whole stiffness k into joints that creep: `rhs` loses
    /// h s k (a e - q), and each diagonal entry of the matrix [`Self::diagonal_loss`].
    pub(in crate::physics) fn soften(&self, h: f64, q: &[f64], crept: &[f64], rhs: &mut [f64]) {
        let (a, _) = self.course(h);
        for ((rhs, q), crept) in rhs.iter_mut().zip(q).zip(crept) {
            *rhs += h * self.stiffness * (q - a * (q - crept));
        }
    }

    /// Loss of a diagonal entry in a step of `h` (s): h s k (h - b).
    pub(in crate::physics) fn diagonal_loss(&self, h: f64) -> f64 {
        let (_, b) = self.course(h);
        h * self.stiffness * (h - b)
    }

    /// Angle of the dashpot (rad) after a step that began at joint angle `q` and moved with `rate`.
    pub(in crate::physics) fn crept(&self, h: f64, q: f64, rate: f64, crept: f64) -> f64 {
        let (a, b) = self.course(h);
        q + h * rate - (a * (q - crept) + b * rate)
    }

    /// Elastic energy k q² / 2 of a joint without creep, less that of the crept joint (J).
    pub(in crate::physics) fn energy_lost(&self, q: f64, crept: f64) -> f64 {
        0.5 * self.stiffness * (q * q - (q - crept) * (q - crept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_angle_relaxes_exponentially() {
        let finger = Finger::default();
        let relaxation = Relaxation::new(&finger);
        let k = finger.joint_stiffness();
        let (q, t) = (0.1, 20.0);
        let want = q * k * ((1.0 - finger.creep_share) + finger.creep_share * f64::exp(-t / finger.creep_time));
        let error = |steps: u32| -> f64 {
            let crept = (0..steps).fold(0.0, |crept, _| relaxation.crept(t / f64::from(steps), q, 0.0, crept));
            ((k * q - relaxation.stiffness * crept) / want - 1.0).abs()
        };
        // 300 steps a second, as in a trial; and first order in h.
        assert!(error(6000) < 1e-5 && (1.9..2.1).contains(&(error(100) / error(200))), "{}", error(6000));
    }

    #[test]
    fn the_diagonal_stays_positive_at_any_step() {
        for (share, time) in [(0.99, 1e-3), (0.5, 1.0), (0.1, 1e6)] {
            let finger = Finger { creep_share: share, creep_time: time, ..Finger::default() };
            let k = finger.joint_stiffness();
            for h in [1e-6, 1e-3, 1.0, 1e3] {
                let diagonal = h * h * k - Relaxation::new(&finger).diagonal_loss(h);
                assert!(diagonal >= h * h * k * (1.0 - share) * (1.0 - 1e-12), "share {share}, time {time}, h {h}");
            }
        }
    }
}
