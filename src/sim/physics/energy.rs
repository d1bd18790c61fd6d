//! Mechanical energy of a state, and the work that a drive does: what a step must never gain beyond.

use super::detect::detect;
use super::effects::work_of_motion;
use super::integrator::Surroundings;
use super::model::PhysicsModel;
use super::solve::segment_velocities;
use super::state::State;
use super::step::{Drive, gather_dynamics, lay_out};
use super::workspace::Workspace;
use glam::DVec3;

/// Mechanical energy, and what part of it cannot run away.
#[derive(Clone, Copy, Debug)]
pub(super) struct Energy {
    /// In motion, bent joints, compressed and sheared skin, and height in gravity (J).
    pub(super) total: f64,
    /// Of it, in the turning of a free object (J). Its angular momentum is carried over exactly, which bounds it.
    pub(super) spin: f64,
}

/// Mechanical energy of a state. What was in the workspace is lost.
pub(super) fn mechanical_energy(model: &PhysicsModel, state: &State, ws: &mut Workspace) -> Energy {
    // At h = 0, A is the inertia alone.
    ws.step.h = 0.0;
    lay_out(model, state, ws);
    gather_dynamics(model, state, ws, &Drive::default());
    segment_velocities(model, &state.velocity, ws);
    detect(model, state, ws);
    let n = model.chain.joints;
    let (mut total, mut spin) = (0.0, 0.0);
    if let (Some(space), Some(sideways)) = (&mut ws.space, &model.sideways) {
        total += space.kinetic_energy(model, &state.velocity);
        total += state.sways.iter().map(|sway| sideways.energy(*sway)).sum::<f64>();
    }
    for finger in 0..2 {
        let rates = &state.velocity[finger * n..(finger + 1) * n];
        for i in 0..n {
            if ws.space.is_none() {
                let row = &ws.finger_matrix[i * n..(i + 1) * n];
                let row: f64 = row.iter().zip(rates).map(|(a, b)| a.as_array()[finger] * b).sum();
                total += 0.5 * rates[i] * row;
            }
            let q = state.q[finger * n + i];
            if let Some(relaxation) = &model.relaxation {
                total -= relaxation.energy_lost(q, state.crept[finger * n + i]);
            }
            let beyond = (q.abs() - model.chain.angle_limit).max(0.0);
            total += 0.5 * (model.chain.stiffness * q * q + model.chain.limit_stiffness * beyond * beyond);
        }
        let segments = &ws.segments[finger * (n + 1)..(finger + 1) * (n + 1)];
        for link in 1..=n {
            let centre = match &ws.space {
                Some(space) => space.centre(model, finger, link),
                None => model.planes[finger].point(model.chain.centre(segments, link), 0.0),
            };
            total -= model.chain.masses[link] * model.finger_gravity.dot(centre);
        }
    }
    if let Some(body) = model.free_body() {
        let (linear, angular) = state.body_velocity(model);
        spin = 0.5 * angular.dot(ws.body_inertia * angular);
        total += 0.5 * body.mass * linear.length_squared() + spin;
        total -= body.mass * model.object_gravity.dot(state.body.position);
    }
    for contact in &ws.contacts {
        let skin = contact.law.energy(contact.stiffness, contact.height, contact.compression);
        total += skin + 0.5 * contact.shear_stiffness * contact.shear.length_squared();
    }
    Energy { total, spin }
}

/// Work that is done on the way from one state to another (J), by the drive and by a hand that moves. Where chambers lag
/// it is what the pressure at the end would do; while they fill or empty, that is more than they did.
pub(super) fn work_done(within: &Surroundings<'_>, from: &State, to: &State, ws: &mut Workspace) -> f64 {
    let (model, drive) = (within.model, within.drive);
    let torque = model.chamber.as_ref().map_or(drive.torque, |chamber| chamber.torque(to.chamber_bar));
    let bent: f64 = to.q.iter().sum::<f64>() - from.q.iter().sum::<f64>();
    let pulled = drive.object_force.dot(to.body.position - from.body.position);
    let mut work = torque * bent + pulled;
    let n = model.chain.joints;
    // Tips, and the sum of mass times place (kg m) of all that inertia acts on.
    let mut places = |state: &State| {
        let mut moments = model.free_body().map_or(DVec3::ZERO, |body| state.body.position * body.mass);
        if let Some(space) = &mut ws.space {
            space.lay_out(model, &state.q, state.sways, DVec3::ZERO);
            let tips = [0, 1].map(|finger| {
                for (link, mass) in model.chain.masses.iter().enumerate() {
                    moments += space.centre(model, finger, link) * *mass;
                }
                space.tip(model, finger)
            });
            return (tips, moments);
        }
        let tips = [0, 1].map(|finger| {
            let plane = &model.planes[finger];
            let segments = &mut ws.segments[finger * (n + 1)..(finger + 1) * (n + 1)];
            let tip = model.chain.bend(&state.q[finger * n..(finger + 1) * n], segments);
            for (link, mass) in model.chain.masses.iter().enumerate() {
                moments += plane.point(model.chain.centre(segments, link), 0.0) * *mass;
            }
            plane.point(tip, 0.0)
        });
        (tips, moments)
    };
    let (before, after) = (places(from), places(to));
    for finger in 0..2 {
        work += drive.tip_force[finger].dot(after.0[finger] - before.0[finger]);
    }
    work + work_of_motion((from, to), within.ws.force_of_world(), after.1 - before.1)
}
