//! Weight of the fingers: a finger held out level carries m g L / 2 at its root.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use palpate_geometry::units::three_digits;

pub(super) const RULE: Rule = Rule {
    about: "The fingers' own weight bends them.",
    number: "gravity torque / actuation torque",
    threshold: 0.002, // tuned by `palpate study effects`; 0.2 degrees of the default finger's 82
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let finger = situation.finger();
    let weight = 0.5 * finger.mass * situation.scene.world.gravity * finger.length;
    let drive = situation.peak_torque();
    let facts = format!(
        "gravity turns a level finger with {} N·m, pressure turns it with up to {} N·m",
        three_digits(weight),
        three_digits(drive)
    );
    Ruling { possible: true, number: ratio(weight, drive), facts }
}
