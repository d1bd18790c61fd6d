//! The block of the Hessian between the two fingers, which exists only while they touch each other.
//!
//! A contact between segment a of the left finger and segment b of the right one, with Hessian G at the arm r,
//! subtracts S_i' J' G J S_j for every joint i before a and j before b, J = [1, -[r]x]. First everything is summed per
//! joint of the left and segment of the right finger, then from the tip of the right finger inward.

use super::contact::{Acting, Against};
use super::model::PhysicsModel;
use super::spatial::Spatial;
use super::workspace::Workspace;

/// Couples the fingers, or takes them apart.
pub(super) fn prepare_coupling(ws: &mut Workspace) {
    ws.hessian.couple(ws.fingers_meet);
}

/// Fills the block.
pub(super) fn fill_coupling(model: &PhysicsModel, ws: &mut Workspace) {
    if !ws.fingers_meet {
        return;
    }
    if let Some(space) = ws.space.take() {
        space.fill_coupling(model, ws);
        ws.space = Some(space);
        return;
    }
    let n = model.chain.joints;
    ws.coupling.fill(Spatial::default());
    for contact in &ws.contacts {
        let (Acting::Segment(acting), Against::Finger(against)) = (contact.acting, contact.against) else { continue };
        let (left, right) = (acting.min(against) as usize, acting.max(against) as usize - (n + 1));
        let hessian = contact.hessian(ws.step);
        for i in 0..left {
            let linear = hessian * ws.columns[i].of(0).linear_at(contact.arm);
            let wrench = Spatial { linear, angular: contact.arm.cross(linear) };
            let sum = &mut ws.coupling[i * (n + 1) + right];
            *sum = sum.plus(&wrench);
        }
    }
    for i in 0..n {
        let mut beyond = Spatial::default();
        for j in (0..n).rev() {
            beyond = beyond.plus(&ws.coupling[i * (n + 1) + j + 1]);
            *ws.hessian.at_mut(n + j, i) = -ws.columns[j].of(1).dot(&beyond);
        }
    }
}
