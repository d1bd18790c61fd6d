//! A chamber fills through a tube: P' = (Ps - P) / tau, Ps the line pressure.
//!
//! The line is constant over a step, so that the exact solution P+ = Ps + (P - Ps) exp(-h / tau) costs one exponential.
//! The torque is that of the pressure at the end of the step, as everything else in it.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use crate::gripper::Actuation;
use palpate_geometry::units::three_digits;

pub(super) const RULE: Rule = Rule {
    about: "The chambers take time to fill and to empty.",
    number: "filling time / time in which the pressure changes",
    threshold: 0.002, // tuned by `palpate study effects`: changes are seen from 0.005 on
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let filling = situation.gripper().actuation.filling_time;
    let changing = situation.closing_s().min(situation.release_s());
    let facts = if filling > 0.0 {
        format!("a chamber fills in {} s, the line changes within {} s", three_digits(filling), three_digits(changing))
    } else {
        "gripper.actuation.filling_time is 0: chambers fill at once".to_owned()
    };
    Ruling { possible: filling > 0.0, number: ratio(filling, changing), facts }
}

/// Chambers that lag behind the line; both fingers hang on the same line.
#[derive(Clone, Debug)]
pub(in crate::physics) struct Chamber {
    actuation: Actuation,
}

impl Chamber {
    pub(in crate::physics) fn new(actuation: &Actuation) -> Self {
        Self { actuation: actuation.clone() }
    }

    /// Pressure in a chamber (bar) after `h` seconds at a line pressure.
    pub(in crate::physics) fn filled(&self, bar: f64, line_bar: f64, h: f64) -> f64 {
        line_bar + (bar - line_bar) * (-h / self.actuation.filling_time).exp()
    }

    /// Torque on every joint (N m) at a pressure in the chamber (bar).
    pub(in crate::physics) fn torque(&self, bar: f64) -> f64 {
        self.actuation.torque(bar)
    }
}

/// Pressure (bar) after `share` as much time again, where it has gone from `before` to `now` towards `line`: no
/// straight line but the same exponential, so that a step made of stages is as exact as a single one.
pub(in crate::physics) fn continued(before: f64, now: f64, line: f64, share: f64) -> f64 {
    let left = (now - line) / (before - line);
    if left > 0.0 && left < 1.0 { line + (now - line) * left.powf(share) } else { now }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extrapolation_follows_the_exponential() {
        let chamber = chamber(0.1);
        let (before, line) = (0.2, 1.0);
        let now = chamber.filled(before, line, 0.03);
        assert!((continued(before, now, line, 1.5) - chamber.filled(before, line, 0.075)).abs() < 1e-15);
        assert_eq!((continued(1.0, 1.0, 1.0, 1.5), continued(0.0, 0.0, 0.0, 1.5)), (1.0, 0.0));
    }

    fn chamber(filling_time: f64) -> Chamber {
        Chamber::new(&Actuation { filling_time, ..Actuation::default() })
    }

    #[test]
    fn a_chamber_fills_exponentially_whatever_the_steps() {
        // P = Ps (1 - exp(-t / tau)), exactly: in 1000 steps, in 10, or in steps of any length.
        let (line, tau, t) = (0.8, 0.15, 0.4);
        let want = line * (1.0 - f64::exp(-t / tau));
        for steps in [1, 10, 1000] {
            let h = t / f64::from(steps);
            let got = (0..steps).fold(0.0, |bar, _| chamber(tau).filled(bar, line, h));
            assert!((got / want - 1.0).abs() < 1e-12, "{steps} steps: {got} instead of {want}");
        }
        let uneven = [0.1, 0.001, 0.25, 0.049];
        let got = uneven.iter().fold(0.0, |bar, h| chamber(tau).filled(bar, line, *h));
        assert!((got / want - 1.0).abs() < 1e-12);
    }

    #[test]
    fn without_a_filling_time_the_chamber_is_the_line() {
        assert_eq!(chamber(0.0).filled(0.2, 0.7, 1e-3), 0.7);
        assert_eq!(chamber(0.0).torque(0.7), Actuation::default().torque(0.7));
    }
}
