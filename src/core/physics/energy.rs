//! Mechanical energy of a state: what a passive gripper must never gain.

use super::detect::detect;
use super::model::Model;
use super::solve::segment_velocities;
use super::state::State;
use super::step::{Drive, gather_dynamics, lay_out};
use super::workspace::Workspace;

/// Kinetic energy, bending of the joints, compression and shear of the skin, and height in gravity (J).
pub(super) fn mechanical_energy(model: &Model, state: &State) -> f64 {
    // At h = 0, A is the inertia alone.
    let mut ws = Workspace::new(model);
    lay_out(model, state, &mut ws);
    gather_dynamics(model, state, &mut ws, &Drive::default());
    segment_velocities(model, &state.velocity, &mut ws);
    detect(model, state, &mut ws);
    let n = model.chain.joints;
    let mut energy = 0.0;
    for finger in 0..2 {
        let rates = &state.velocity[finger * n..(finger + 1) * n];
        let matrix = &ws.finger_matrix[finger * n * n..(finger + 1) * n * n];
        for i in 0..n {
            let row: f64 = matrix[i * n..(i + 1) * n].iter().zip(rates).map(|(a, b)| a * b).sum();
            energy += 0.5 * rates[i] * row;
            let q = state.q[finger * n + i];
            if let Some(relaxation) = &model.relaxation {
                energy -= relaxation.energy_lost(q, state.crept[finger * n + i]);
            }
            let beyond = (q.abs() - model.chain.angle_limit).max(0.0);
            energy += 0.5 * (model.chain.stiffness * q * q + model.chain.limit_stiffness * beyond * beyond);
        }
        let segments = &ws.segments[finger * (n + 1)..(finger + 1) * (n + 1)];
        for link in 1..=n {
            let centre = model.planes[finger].point(model.chain.centre(segments, link), 0.0);
            energy -= model.chain.masses[link] * model.finger_gravity.dot(centre);
        }
    }
    if let Some(body) = model.free_body() {
        let (linear, angular) = state.body_velocity(model);
        energy += 0.5 * body.mass * linear.length_squared() + 0.5 * angular.dot(ws.body_inertia * angular);
        energy -= body.mass * model.object_gravity.dot(state.body.position);
    }
    for contact in &ws.contacts {
        let skin = contact.law.energy(contact.stiffness, contact.height, contact.compression);
        energy += skin + 0.5 * contact.shear_stiffness() * contact.shear.length_squared();
    }
    energy
}
