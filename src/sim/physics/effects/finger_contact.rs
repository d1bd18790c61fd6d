//! Finger against finger: the contact springs of each pad meet the other finger's skin; see `physics/finger_pair.rs`.
//!
//! Where `auto` finds that the pads cannot meet, a guard still computes how far they protrude towards each other. The
//! guard is cheap; with the effect on, it also skips the search while the fingers are apart.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use crate::frame::Plan;
use crate::gripper::BentFinger;
use crate::scene::{Effect, Setting};
use palpate_geometry::units::mm;

pub(super) const RULE: Rule = Rule {
    about: "The pads of the two fingers touch each other instead of passing through.",
    number: "reach of a finger / room it has",
    threshold: 1.0,
    ruling,
};

/// Stages of the closing at which the reach is looked at.
const STAGES: usize = 20;

fn ruling(situation: &Situation<'_>) -> Ruling {
    let gripper = situation.gripper();
    let half_gap = gripper.half_gap();
    // Fingers that wrap around an object come no farther than its middle, less what of it is in between.
    let between = situation.object.map_or(0.0, |o| 0.5 * o.bounds.size().min_element());
    let (reach, room) = (reach(situation), half_gap + between);
    let facts = if between > 0.0 {
        let (half_gap, between) = (mm(half_gap), mm(between));
        format!(
            "a pad reaches {:.0} mm inward; it is {half_gap:.0} mm to the middle, and {between:.0} mm of the object are \
             in the way",
            mm(reach)
        )
    } else {
        format!("a pad reaches {:.0} mm inward; it is {:.0} mm to the middle", mm(reach), mm(room))
    };
    Ruling { possible: true, number: ratio(reach, room), facts }
}

/// Largest inward reach of a freely bending finger's skin up to the programme's peak (m).
fn reach(situation: &Situation<'_>) -> f64 {
    let finger = situation.finger();
    let limit = finger.curvature_limit * finger.segment_length();
    let peak = (situation.peak_torque() / finger.joint_stiffness()).min(limit);
    let thickness = situation.gripper().pad.thickness;
    let furthest = |stage: usize| -> f64 {
        let bent = BentFinger::new(finger, &vec![peak * stage as f64 / STAGES as f64; finger.joints]);
        let ends = bent.segments.iter().zip(&bent.lengths).map(|(s, length)| s.point(*length, thickness).x);
        ends.fold(0.0, f64::max)
    };
    (0..=STAGES).map(furthest).fold(0.0, f64::max)
}

/// Treatment of contact between the fingers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::physics) enum FingerContact {
    /// Fingers pass through each other, as set in the scene.
    Never,
    /// No contact expected; it is turned on if they come near each other, with a note in the trial.
    Guarded,
    /// Contact is computed.
    Always,
}

impl FingerContact {
    pub(in crate::physics) fn planned(plan: &Plan) -> Self {
        match plan.effects.iter().find(|effect| effect.name == Effect::FingerContact.name()) {
            Some(effect) if effect.on => Self::Always,
            Some(effect) if effect.setting == Setting::Auto.name() => Self::Guarded,
            _ => Self::Never,
        }
    }
}
