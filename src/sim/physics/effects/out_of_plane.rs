//! Fingers that bend sideways and twist under loads from the side; what that does to a step is in `physics/space.rs`.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use crate::gripper::Finger;
use palpate_geometry::units::three_digits;

pub(super) const RULE: Rule = Rule {
    about: "Fingers bend sideways and twist.",
    number: "sideways way of the tip or of the pad's edge / length of the finger",
    threshold: 0.005, // tuned by `palpate study effects`: changes are seen from 0.01 on
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let finger = situation.finger();
    let Some([bending, torsion]) = finger.sideways.stiffness() else {
        let facts = "gripper.finger.sideways is not given: the fingers are rigid out of their planes".to_owned();
        return Ruling { possible: false, number: 0.0, facts };
    };
    let Finger { length, width, .. } = *finger;
    let force = situation.grip_force();
    let offset = force * length.powi(3) / (3.0 * bending);
    // The grip at a quarter of the width beside the axis.
    let twist = force * 0.25 * width * length / torsion;
    let facts = format!(
        "{} N across a tip would move it by {} mm, {} N beside its middle twist it by {} degrees",
        three_digits(force),
        three_digits(1e3 * offset),
        three_digits(force),
        three_digits(twist.to_degrees())
    );
    Ruling { possible: true, number: ratio(offset.max(0.5 * width * twist), length), facts }
}
