//! The object moves. Six more unknowns, and the reason why a real grasp is easier to recognise: the object aligns
//! itself.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use palpate_geometry::units::three_digits;

pub(super) const RULE: Rule = Rule {
    about: "The object moves when it is pushed, instead of being held in place.",
    number: "grip force / weight",
    threshold: 0.0, // however weak the grip: the user decides whether the object is held
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let Some(object) = situation.object else {
        return Ruling { possible: false, number: 0.0, facts: "there is no object".to_owned() };
    };
    let (grip, weight) = (situation.grip_force(), object.mass.mass * situation.scene.world.gravity);
    let forces = format!("the fingers press with up to {} N, it weighs {} N", three_digits(grip), three_digits(weight));
    let (fixed, facts) = match situation.scene.object.fixed {
        true => (true, format!("object.fixed holds it in place; {forces}")),
        false => (false, format!("it rests freely; {forces}")),
    };
    let number = if fixed { 0.0 } else { ratio(grip, weight) };
    Ruling { possible: !fixed, number, facts }
}
