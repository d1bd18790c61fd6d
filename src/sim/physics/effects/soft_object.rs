//! An object with a soft surface: a shell of thickness t and modulus E_o around a rigid core, in series with whatever
//! presses on it.
//!
//! Under each contact spring lies a column of the shell with the same cross-section a, of stiffness k_o = E_o a / t
//! (a Winkler foundation, as the pad itself). Two springs in series with the law of the pad, k and H of the pad, k_o
//! and t of the shell, are to second order in the force a spring of that law with
//!
//! ```text
//! 1 / k_s = 1 / k + 1 / k_o          1 / (k_s² H_s) = 1 / (k² H) + 1 / (k_o² t)
//! ```
//!
//! which is exact for the linear law at any modulus, and for the neo-Hookean law where both moduli are equal. In shear
//! both give way with a third of their stiffness.
//!
//! Columns do not hold on to their neighbours, which makes them too soft where little more than a point is pressed.
//! Against finite elements (`tests/peers/soft_sphere.py`: a ball of 40 mm between plates, Poisson's ratio 0.3), pushed
//! in by 1 and 2 mm, a shell of 5 mm is 20 and 11 % too soft, one of 10 mm 33 and 22 %. A ball that is soft to the middle
//! presses like a shell of a quarter of its diameter: 18 % less at 1 mm, 4 % more at 2 mm.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use crate::objects::ObjectModel;
use crate::physics::contact::SHEAR_SHARE;
use crate::scene::{Scene, Softness, SupportKind};
use palpate_geometry::units::{mm, three_digits};
use std::f64::consts::PI;

pub(super) const RULE: Rule = Rule {
    about: "The surface of a soft object gives way.",
    number: "give of the object's shell / give of the pad",
    threshold: 0.01, // tuned by `palpate study effects`: changes are seen from 0.04 on
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let Some(softness) = situation.object.and_then(|object| situation.scene.softness(object)) else {
        let facts = "the object is rigid: neither its file nor object.modulus gives a modulus".to_owned();
        return Ruling { possible: false, number: 0.0, facts };
    };
    let pad = &situation.gripper().pad;
    let facts = format!(
        "{:.1} mm of {} kPa around the object, {:.1} mm of {} kPa on the fingers",
        mm(softness.thickness),
        three_digits(softness.modulus * 1e-3),
        mm(pad.thickness),
        three_digits(pad.modulus * 1e-3)
    );
    let number = ratio(softness.thickness / softness.modulus, pad.thickness / pad.modulus);
    Ruling { possible: true, number, facts }
}

/// The shell as contact springs meet it.
#[derive(Clone, Copy, Debug)]
pub(in crate::physics) struct Shell {
    softness: Softness,
    /// Modulus of the pad (Pa): stiffness times height of a contact spring over it is its cross-section.
    pad_modulus: f64,
}

impl Shell {
    pub(in crate::physics) fn new(scene: &Scene, object: Option<&ObjectModel>) -> Option<Self> {
        let softness = scene.softness(object?)?;
        Some(Self { softness, pad_modulus: scene.gripper.pad.modulus })
    }

    /// Stiffness (N/m) of the shell under a contact spring of the pad, given the spring's stiffness (N/m) and rest
    /// length (m) along its axis.
    pub(in crate::physics) fn under(&self, stiffness: f64, height: f64) -> f64 {
        let Softness { modulus, thickness } = self.softness;
        modulus * (stiffness * height / self.pad_modulus) / thickness
    }

    /// Stiffness (N/m) and rest length (m) of a spring in series with a column of the shell.
    pub(in crate::physics) fn in_series(&self, (k, height): (f64, f64), shell: f64) -> (f64, f64) {
        let both = series(k, shell);
        let stiffening = 1.0 / (k * k * height) + 1.0 / (shell * shell * self.softness.thickness);
        (both, 1.0 / (both * both * stiffening))
    }

    /// Stiffness in shear (N/m) of a pad's in series with a column of the shell.
    pub(in crate::physics) fn shear_in_series(shear: f64, shell: f64) -> f64 {
        series(shear, SHEAR_SHARE * shell)
    }

    /// Stiffness (N/m) of one of `points` that an object rests on, in series with the shell over the face of the
    /// support.
    pub(in crate::physics) fn on_support(&self, k: f64, points: f64, scene: &Scene, object: &ObjectModel) -> f64 {
        let size = object.bounds.size();
        let face = match scene.support.kind {
            SupportKind::Pedestal => (PI * scene.support.radius.powi(2)).min(size.x * size.y),
            SupportKind::Table | SupportKind::None => size.x * size.y,
        };
        series(k, self.softness.modulus * face / (self.softness.thickness * points))
    }
}

fn series(a: f64, b: f64) -> f64 {
    a * b / (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gripper::PadLaw;

    fn shell(modulus: f64, thickness: f64) -> Shell {
        Shell { softness: Softness { modulus, thickness }, pad_modulus: 1e5 }
    }

    /// Compression (m) of pad and shell one after the other under a force (N).
    fn one_after_the_other(law: PadLaw, pad: (f64, f64), column: (f64, f64), force: f64) -> f64 {
        law.compression(pad.0, pad.1, force) + law.compression(column.0, column.1, force)
    }

    #[test]
    fn two_springs_in_series_give_way_one_after_the_other() {
        let pad = (156.0, 0.008);
        // Exact: the linear law at any modulus, the neo-Hookean one at equal moduli, up to four fifths of the height.
        for (law, modulus, thickness) in
            [(PadLaw::Linear, 3e3, 0.02), (PadLaw::Linear, 1e7, 0.003), (PadLaw::NeoHookean, 1e5, 0.012)]
        {
            let shell = shell(modulus, thickness);
            let under = shell.under(pad.0, pad.1);
            let both = shell.in_series(pad, under);
            for share in [0.01, 0.2, 0.8] {
                let force = law.force(both.0, both.1, share * both.1).0;
                let want = one_after_the_other(law, pad, (under, thickness), force);
                assert!((share * both.1 / want - 1.0).abs() < 1e-9, "{law:?} {modulus} {share}");
            }
        }
        // To second order: at unequal moduli within 2 % up to a quarter of the softer one's height.
        for modulus in [2e4, 5e4, 2e5, 5e5] {
            let shell = shell(modulus, 0.010);
            let under = shell.under(pad.0, pad.1);
            let both = shell.in_series(pad, under);
            for share in [0.01, 0.1, 0.25] {
                let softer = if modulus < 1e5 { (under, 0.010) } else { pad };
                let force = PadLaw::NeoHookean.force(softer.0, softer.1, share * softer.1).0;
                let want = one_after_the_other(PadLaw::NeoHookean, pad, (under, 0.010), force);
                let got = PadLaw::NeoHookean.compression(both.0, both.1, force);
                assert!((got / want - 1.0).abs() < 0.02, "{modulus} {share}: {got} instead of {want}");
            }
        }
    }

    #[test]
    fn a_shell_that_is_hardly_there_changes_nothing() {
        let shell = shell(1e15, 0.01);
        let both = shell.in_series((156.0, 0.008), shell.under(156.0, 0.008));
        assert!((both.0 / 156.0 - 1.0).abs() < 1e-8 && (both.1 / 0.008 - 1.0).abs() < 1e-8);
        assert!((Shell::shear_in_series(52.0, 1e15) / 52.0 - 1.0).abs() < 1e-8);
    }
}
