//! A hand that lifts what it holds and shakes it. In the hand's frame, where fingers and object move, that is a uniform
//! force of inertia -m a, and table and pedestal that move the other way:
//!
//! ```text
//! g' = g - a                        on fingers and object
//! world' = world - place            place and velocity of all that does not hang on the hand
//! ```
//!
//! The hand does not turn, so that there are no Coriolis or centrifugal forces. Its velocity is the prescribed one at the
//! end of each step; acceleration and place are what the step makes of it, a = (v+ - v) / h and place+ = place + h v+,
//! as for all that moves in it. What lies still in the world so lies still to the last digit, whatever the step.

use super::situation::Situation;
use super::{Rule, Ruling, ratio};
use crate::physics::environment::Passing;
use crate::physics::model::PhysicsModel;
use crate::physics::state::State;
use crate::physics::workspace::Workspace;
use glam::DVec3;
use palpate_geometry::units::three_digits;

pub(super) const RULE: Rule = Rule {
    about: "The hand lifts what it holds and shakes it.",
    number: "inertial force / grip force",
    threshold: 0.01, // tuned by `palpate study effects`: changes are seen from 0.05 on
    ruling,
};

fn ruling(situation: &Situation<'_>) -> Ruling {
    let Some(motion) = situation.scene.hand_motion() else {
        let facts = "shaking.amplitude is 0: the hand stays where it is".to_owned();
        return Ruling { possible: false, number: 0.0, facts };
    };
    let carried = situation.finger().mass + situation.free_object().map_or(0.0, |object| object.mass.mass);
    let (force, grip) = (carried * motion.peak_acceleration(), situation.grip_force());
    let facts = format!(
        "it is moved with up to {} m/s², which takes {} N; the fingers press with up to {} N",
        three_digits(motion.peak_acceleration()),
        three_digits(force),
        three_digits(grip)
    );
    Ruling { possible: true, number: ratio(force, grip), facts }
}

/// Notes how the surroundings pass by in the step that begins.
pub(in crate::physics) fn note_passing(model: &PhysicsModel, state: &State, ws: &mut Workspace) {
    let Some(motion) = &model.hand_motion else { return };
    let h = ws.step.h;
    let [place, velocity] = state.hand;
    let end = motion.at(state.time + h).velocity;
    let acceleration = if h > 0.0 { (end - velocity) / h } else { DVec3::ZERO };
    ws.passing = Passing { place: -place, velocity: -end, acceleration };
}

/// Puts table and pedestal where they are after a time within the step (s).
pub(in crate::physics) fn move_world(model: &PhysicsModel, ws: &mut Workspace, ahead: f64) {
    if let Some(moved) = &mut ws.moved_world {
        moved.shifted(&model.environment, ws.passing.place + ws.passing.velocity * ahead);
    }
}

/// Work (J) of inertia and of the moving surroundings on the way from one state to another: `force` is that of the
/// surroundings in the last step (N), `moved` the sum of mass times way of all that inertia acts on (kg m).
pub(in crate::physics) fn work_of_motion((from, to): (&State, &State), force: DVec3, moved: DVec3) -> f64 {
    let h = to.time - from.time;
    if h <= 0.0 {
        return 0.0;
    }
    force.dot(from.hand[0] - to.hand[0]) - (to.hand[1] - from.hand[1]).dot(moved) / h
}
