//! Inertia of the fingers: they overshoot and swing. Without it A = h C + h² K, and a finger creeps from balance to
//! balance.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use palpate_geometry::units::three_digits;
use std::f64::consts::TAU;

pub(super) const RULE: Rule = Rule {
    about: "The fingers' mass makes them lag and swing.",
    number: "period of the slowest swing / closing time",
    threshold: 0.01, // a closing of a hundred swings: each step of pressure moves the finger by less than it settles in
    ruling,
};

/// First root of the clamped beam, beta L: omega = (beta L)² sqrt(E I / (m L³)).
const CANTILEVER_ROOT: f64 = 1.8751;

fn ruling(situation: &Situation<'_>) -> Ruling {
    let finger = situation.finger();
    let per_mass = finger.bending_stiffness / (finger.mass * finger.length.powi(3));
    let period = TAU / (CANTILEVER_ROOT.powi(2) * per_mass.sqrt());
    let closing = situation.closing_s();
    let facts = format!("a finger swings in {} s and closes in {} s", three_digits(period), three_digits(closing));
    Ruling { possible: true, number: ratio(period, closing), facts }
}
