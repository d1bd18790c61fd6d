//! Table and pedestal: what the object rests on, and what fingertips may scrape along.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use crate::scene::SupportKind;
use palpate_geometry::units::mm;

pub(super) const RULE: Rule = Rule {
    about: "The table and the pedestal push back at the object and at the fingers.",
    number: "reach / distance of the support",
    threshold: 0.97, // fingers do not stretch; 3 % to spare for the round ends of the contact springs at the tip
    ruling,
};

/// A resting object stands on its support; this is how far off it counts as being (m), for a finite ratio.
const TOUCHING: f64 = 1e-4;

fn ruling(situation: &Situation<'_>) -> Ruling {
    let scene = situation.scene;
    let top = match scene.support.kind {
        SupportKind::None => {
            return Ruling { possible: false, number: 0.0, facts: "there is no support".to_owned() };
        }
        SupportKind::Table => 0.0,
        SupportKind::Pedestal => scene.support.height,
    };
    let gripper = situation.gripper();
    // No point of a finger gets farther from its root than the corner of the straight one.
    let reach = gripper.finger.length.hypot(gripper.pad.thickness.max(gripper.finger.back));
    let palm = situation.placement.world_from_gripper.position.z;
    let below = palm - top;
    let fingers = format!("the fingers reach {:.0} mm, it lies {:.0} mm below the palm", mm(reach), mm(below));
    if situation.free_object().is_some() {
        let facts = format!("the object rests on it; {fingers}");
        return Ruling { possible: true, number: ratio(reach, TOUCHING), facts };
    }
    Ruling { possible: true, number: ratio(reach, below.max(TOUCHING)), facts: fingers }
}
