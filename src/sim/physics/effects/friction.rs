//! Friction wherever things touch. Its coefficient is the number: tangential over normal force.

use super::situation::Situation;
use super::{Rule, Ruling};

pub(super) const RULE: Rule = Rule {
    about: "Things that touch hold on to each other instead of sliding freely.",
    number: "tangential force / normal force",
    threshold: 0.01, // what oiled steel has; nothing here slides better
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let pad = situation.gripper().pad.friction;
    let support = situation.scene.support.friction;
    let surface = situation.object.map(|o| situation.scene.object.friction.value().unwrap_or(o.friction));
    let with_pad = (pad * surface.unwrap_or(support)).sqrt();
    let number = match surface {
        Some(surface) => with_pad.max((surface * support).sqrt()).max((pad * support).sqrt()),
        None => with_pad.max(pad),
    };
    let facts = match surface {
        Some(_) => format!("pad and object hold up to {with_pad:.2} of what presses them together"),
        None => format!("pad and pad hold up to {pad:.2} of what presses them together"),
    };
    Ruling { possible: true, number, facts }
}
