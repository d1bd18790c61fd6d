//! A semi-implicit Euler step over the same forces, to be compared with: what the convex step is for. No trial can be
//! made with it.
//!
//! ```text
//! v+ = v + h M⁻¹ (tau - K q - C v - b + J' f),   q+ = q + h v+
//! ```
//!
//! Springs, dampers, joint limits and contacts are taken at the *start* of the step. Without damping it is stable up to
//! h = 2 / omega_max and diverges beyond, omega_max² being the largest eigenvalue of M⁻¹ K.

use super::contact::ContactStep;
use super::detect::detect;
use super::hessian::Lanes;
use super::model::PhysicsModel;
use super::solve::{Product, fill_gradient, relative_velocities, segment_velocities};
use super::state::State;
use super::step::{Drive, NotFinite, StepReport, gather_dynamics, lay_out, remember_contacts};
use super::workspace::Workspace;

/// Impulses over a step this short, divided by it, are forces at an instant (s).
const INSTANT: f64 = 1e-9;

/// Advances the state by an explicit step of `h` (s).
pub(super) fn explicit_step(
    model: &PhysicsModel,
    state: &mut State,
    ws: &mut Workspace,
    drive: &Drive,
    h: f64,
) -> Result<StepReport, NotFinite> {
    ws.step.h = h;
    lay_out(model, state, ws);
    segment_velocities(model, &state.velocity, ws);
    detect(model, state, ws);
    relative_velocities(model, &state.velocity, ws, Product::OfVelocity);
    // r at h = 1 less r at h = 0 is what drives and resists, without dampers; at h = 0, A is M and r is M v.
    ws.step.h = 1.0;
    gather_dynamics(model, state, ws, drive);
    let driven = ws.rhs.clone();
    ws.step.h = 0.0;
    gather_dynamics(model, state, ws, drive);
    let mut force: Vec<f64> = driven.iter().zip(&ws.rhs).map(|(at_one, at_zero)| at_one - at_zero).collect();
    for (force, rate) in force.iter_mut().zip(&state.velocity[..model.joint_count()]) {
        *force -= model.chain.damping * rate;
    }
    if let Some(sideways) = &model.sideways {
        let resisted = [0, 1].map(|finger| sideways.resisted(state.sway_rates_of(model, finger)));
        for (force, resisted) in force[model.first_sway()..].iter_mut().zip(resisted.iter().flatten()) {
            *force -= resisted;
        }
    }
    for (force, impulse) in force.iter_mut().zip(contact_and_limit_impulses(model, state, ws)) {
        *force += impulse / INSTANT;
    }
    fill_inertia(model, ws);
    ws.hessian.factorise();
    ws.hessian.solve(&mut force);
    for (velocity, change) in state.velocity.iter_mut().zip(&force) {
        *velocity += h * change;
    }
    ws.step.h = h;
    for contact in &mut ws.contacts {
        contact.limit *= h / INSTANT;
    }
    let friction_residual = remember_contacts(model, state, ws);
    state.integrate(model, h);
    match state.not_finite(model) {
        Some(body) => Err(NotFinite { body }),
        None => Ok(StepReport {
            converged: true,
            contacts: ws.contacts.len() as u32,
            friction_residual,
            ..StepReport::default()
        }),
    }
}

/// Impulses of contacts and joint limits over an instant, from the present state. Leaves slip limits for that instant.
fn contact_and_limit_impulses(model: &PhysicsModel, state: &State, ws: &mut Workspace) -> Vec<f64> {
    let instant = ContactStep { h: INSTANT, ..ws.step };
    ws.step = instant;
    for contact in &mut ws.contacts {
        contact.relag(instant, false);
    }
    // The gradient of the step's minimisation, with momentum left out, is minus the impulses.
    let known = std::mem::replace(&mut ws.rhs, vec![0.0; model.unknowns()]);
    ws.a_velocity.fill(0.0);
    fill_gradient(model, &state.q, &state.velocity, ws);
    ws.rhs = known;
    ws.gradient.iter().map(|g| -g).collect()
}

/// M in the place of the Hessian.
fn fill_inertia(model: &PhysicsModel, ws: &mut Workspace) {
    let n = model.chain.joints;
    ws.hessian.couple(false);
    if let Some(space) = ws.space.take() {
        space.fill_hessian(model, ws, false);
        ws.space = Some(space);
    } else {
        for i in 0..n {
            ws.hessian.row_mut(i).copy_from_slice(&ws.finger_matrix[i * n..][..=i]);
            ws.hessian.border_mut(i).fill(Lanes::ZERO);
        }
    }
    if let Some(body) = model.free_body() {
        for a in 0..6 {
            for b in 0..=a {
                *ws.hessian.at_mut(2 * n + a, 2 * n + b) = 0.0;
            }
        }
        for a in 0..3 {
            *ws.hessian.at_mut(2 * n + a, 2 * n + a) = body.mass;
            for b in 0..=a {
                *ws.hessian.at_mut(2 * n + 3 + a, 2 * n + 3 + b) = ws.body_inertia.col(b)[a];
            }
        }
    }
}
