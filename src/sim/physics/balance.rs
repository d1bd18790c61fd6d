//! Static residual: the torque at each joint that neither springs, gravity nor contacts balance.

use super::contact::{Acting, Against, Contact};
use super::model::PhysicsModel;
use super::spatial::Spatial;
use super::state::State;
use super::step::{Drive, gather_dynamics, lay_out};
use super::workspace::Workspace;

/// The static residual |tau - K q - g + J'f|: the largest joint torque not balanced by springs, gravity and the
/// contacts of the last step, as a share of the actuation torque. Zero where nothing is driven.
pub(super) fn static_residual(model: &PhysicsModel, state: &State, ws: &Workspace, drive: &Drive) -> f64 {
    if drive.torque == 0.0 {
        return 0.0;
    }
    let n = model.chain.joints;
    let mut scratch = ws.clone();
    let mut at_rest = state.clone();
    at_rest.velocity.fill(0.0);
    lay_out(model, &at_rest, &mut scratch);
    gather_dynamics(model, &at_rest, &mut scratch, drive);
    if let (Some(space), Some(sideways)) = (&ws.space, &model.sideways) {
        let known = scratch.rhs.iter().map(|r| r / ws.step.h).collect();
        return space.imbalance(model, (sideways, ws), (&state.q, known)) / drive.torque.abs();
    }
    let mut largest = 0.0f64;
    for k in 0..2 * n {
        // At rest r holds h (torque - k q - gravity).
        let known = scratch.rhs[k] / ws.step.h;
        let from_contacts: f64 = ws.contacts.iter().filter_map(|contact| torque_on_joint(ws, contact, k, n)).sum();
        let limit = model.chain.limit_torque(state.q[k]).0;
        largest = largest.max((known + from_contacts - limit).abs());
    }
    largest / drive.torque.abs()
}

/// Torque of a contact on joint `k` of 2 `n` (N m), where it acts beyond it.
fn torque_on_joint(ws: &Workspace, contact: &Contact, k: usize, n: usize) -> Option<f64> {
    let sign = match (contact.acting, contact.against) {
        (Acting::Segment(link), _) if beyond_joint(link as usize, k, n) => 1.0,
        (_, Against::Finger(link)) if beyond_joint(link as usize, k, n) => -1.0,
        _ => return None,
    };
    let (normal, tangential) = contact.force(ws.step);
    let linear = (contact.normal * normal + tangential) * sign;
    Some(ws.columns[k % n].of(k / n).dot(&Spatial { linear, angular: contact.arm.cross(linear) }))
}

/// True when a segment lies beyond joint `k` (counted over both fingers of `n` joints).
fn beyond_joint(link: usize, k: usize, n: usize) -> bool {
    let (finger, segment) = (link / (n + 1), link % (n + 1));
    finger == k / n && segment > k % n
}
