//! Weight of the object: it rests on its support, and friction has to carry it when that is taken away.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use palpate_geometry::units::three_digits;

pub(super) const RULE: Rule = Rule {
    about: "The object has weight: it rests, slips and falls.",
    number: "weight / grip force",
    threshold: 1e-4, // a hundredth of a gram in the default gripper; lighter things go where the fingers push them
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let Some(object) = situation.free_object() else {
        let facts = "no object can move".to_owned();
        return Ruling { possible: false, number: 0.0, facts };
    };
    let (weight, grip) = (object.mass.mass * situation.scene.world.gravity, situation.grip_force());
    let facts = format!("it weighs {} N, the fingers press with up to {} N", three_digits(weight), three_digits(grip));
    Ruling { possible: true, number: ratio(weight, grip), facts }
}
