//! One step: lay out the fingers, assemble the dynamics, find contacts, minimise, move.

use super::contact::{Acting, Outcome};
use super::detect::{detect, segment_axes};
use super::effects::{move_world, note_passing};
use super::hessian::{Lanes, multiply};
use super::model::PhysicsModel;
use super::solve::{Product, Unbalanced, minimise, multiply_by_a, relative_velocities, segment_velocities};
use super::space_step::gather;
use super::state::State;
use super::workspace::{Planar, Workspace};
use glam::{DQuat, DVec3};

/// Statistics of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Newton iterations taken.
    pub newton_iterations: u32,
    /// Slopes evaluated by the line search.
    pub line_search_steps: u32,
    /// True when the minimisation reached its tolerance.
    pub converged: bool,
    /// Contacts present, touching or about to.
    pub contacts: u32,
    /// The outer friction residual: by how much the lagged slip limits missed the true ones where they mattered,
    /// as a share of the sum of the true ones. Zero without friction forces.
    pub friction_residual: f64,
    /// Largest imbalance; absent where the minimisation reached its tolerance.
    pub unbalanced: Option<Unbalanced>,
}

impl StepReport {
    /// Of two steps in a row: sums, the worse of both, and the contacts of the second.
    pub(super) fn followed_by(&self, next: &Self) -> Self {
        Self {
            newton_iterations: self.newton_iterations + next.newton_iterations,
            line_search_steps: self.line_search_steps + next.line_search_steps,
            converged: self.converged && next.converged,
            contacts: next.contacts,
            friction_residual: self.friction_residual.max(next.friction_residual),
            unbalanced: Unbalanced::worse(self.unbalanced, next.unbalanced),
        }
    }
}

/// A step that must not be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{body} left the range of numbers; the samples before it are kept. Try a smaller time step or softer contact")]
pub struct NotFinite {
    /// Joint or body whose state is not finite.
    pub body: String,
}

/// External inputs of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// Actuation torque on every joint (N m), where the chambers do not lag.
    pub torque: f64,
    /// Line pressure (bar), where they do.
    pub line_bar: f64,
    /// Force pulling at each fingertip, left and right, in the gripper frame (N).
    pub tip_force: [DVec3; 2],
    /// Force pulling at the object's centre of mass, in the gripper frame (N).
    pub object_force: DVec3,
}

/// Advances the state by one step of `h` (s), which may differ from step to step. On failure the state is not to be
/// used any more; keep the last frame for the last good state.
pub fn step(
    model: &PhysicsModel,
    state: &mut State,
    ws: &mut Workspace,
    drive: &Drive,
    h: f64,
) -> Result<StepReport, NotFinite> {
    ws.step.h = h;
    note_passing(model, state, ws);
    let ahead = time_ahead(model, state, ws);
    lay_out_ahead(model, state, ahead, ws);
    let drive = fill_chamber(model, state, drive, h);
    gather_dynamics(model, state, ws, &drive);
    segment_velocities(model, &state.velocity, ws);
    detect(model, state, ws);
    relative_velocities(model, &state.velocity, ws, Product::OfVelocity);
    // Seen from the start of the step, along the normals ahead.
    for contact in &mut ws.contacts {
        contact.compression += ahead * contact.normal.dot(contact.velocity);
    }
    let solved = minimise(model, &state.q, &mut state.velocity, ws);
    if let Some(Unbalanced { unknown, excess: f64::MAX }) = solved.unbalanced {
        // Forces that are no numbers leave the velocities as they were, and the step without meaning.
        let body = state.not_finite(model).unwrap_or_else(|| State::place_of(model, unknown as usize));
        return Err(NotFinite { body });
    }
    let friction_residual = remember_contacts(model, state, ws);
    state.integrate(model, h);
    match state.not_finite(model) {
        Some(body) => Err(NotFinite { body }),
        None => Ok(StepReport {
            newton_iterations: solved.iterations,
            line_search_steps: solved.line_search_steps,
            converged: solved.converged,
            contacts: ws.contacts.len() as u32,
            friction_residual,
            unbalanced: solved.unbalanced,
        }),
    }
}

/// The drive at the end of the step, where chambers take time to fill.
fn fill_chamber(model: &PhysicsModel, state: &mut State, drive: &Drive, h: f64) -> Drive {
    match &model.chamber {
        Some(chamber) => {
            state.filled_from_bar = drive.line_bar;
            state.chamber_bar = chamber.filled(state.chamber_bar, drive.line_bar, h);
            Drive { torque: chamber.torque(state.chamber_bar), ..*drive }
        }
        None => *drive,
    }
}

/// Way (m) that nothing may go between the state and the geometry ahead of it.
const FARTHEST_AHEAD: f64 = 2e-3;

/// Time ahead (s) at which a step of `h` (s) sees geometry: its end, at the present velocities, or less where something
/// would go too far until then.
///
/// A step holds normals, arms and inertia. Taken from its start they lag behind the motion: two stages of SDIRK2 see
/// them 0.29 h late on average, which feeds energy into whatever swings (a button between two fingertips swings up and
/// falls out). Taken from where its end is expected they do not lag, and the second order is kept.
fn time_ahead(model: &PhysicsModel, state: &State, ws: &Workspace) -> f64 {
    let h = ws.step.h;
    let fastest = state.fastest(model) + ws.passing.velocity.length();
    if h * fastest <= FARTHEST_AHEAD { h } else { FARTHEST_AHEAD / fastest }
}

/// Places of the segments, and the velocity of everything beyond each joint per unit of its rate.
pub(super) fn lay_out(model: &PhysicsModel, state: &State, ws: &mut Workspace) {
    note_passing(model, state, ws);
    lay_out_ahead(model, state, 0.0, ws);
}

/// The same as they would be after a time (s) at the present velocities.
fn lay_out_ahead(model: &PhysicsModel, state: &State, ahead: f64, ws: &mut Workspace) {
    let n = model.chain.joints;
    move_world(model, ws, ahead);
    for ((place, q), rate) in ws.q.iter_mut().zip(&state.q).zip(&state.velocity) {
        *place = q + ahead * rate;
    }
    ws.body = state.body;
    if model.free_body().is_some() && ahead > 0.0 {
        let (linear, angular) = state.body_velocity(model);
        ws.body.position += linear * ahead;
        ws.body.rotation = (DQuat::from_scaled_axis(angular * ahead) * ws.body.rotation).normalize();
    }
    ws.reference = if model.body.is_some() { ws.body.position } else { DVec3::ZERO };
    if let Some(space) = &mut ws.space {
        space.lay_out(model, &ws.q, state.sways_ahead(model, ahead), ws.reference);
    }
    model.chain.bend_both(&ws.q, &mut ws.both);
    for (j, both) in ws.both.iter().enumerate() {
        (ws.segments[j], ws.segments[n + 1 + j]) = (both.of(0), both.of(1));
    }
    // Turning "along" towards "inward" is a rotation about along x inward = -sign y.
    let signs = Lanes::new(model.planes.map(|plane| plane.sign));
    let gaps = Lanes::new(model.planes.map(|plane| plane.half_gap));
    for (column, both) in ws.columns.iter_mut().zip(&ws.both[1..]) {
        let arm = [signs * ws.reference.x - both.start[0] + gaps, both.start[1] + ws.reference.z];
        *column = Planar([-signs * arm[1], arm[0], -signs]);
    }
}

/// Fills A, r and the product of A with the velocities.
pub(super) fn gather_dynamics(model: &PhysicsModel, state: &State, ws: &mut Workspace, drive: &Drive) {
    match model.sideways {
        Some(_) => gather(model, state, ws, (drive.torque, drive.tip_force)),
        None => gather_planar(model, state, ws, drive),
    }
    let (n, h) = (model.chain.joints, ws.step.h);
    if let Some(body) = model.free_body() {
        let (linear, angular) = state.body_velocity(model);
        let r = state.body.matrix();
        ws.body_inertia = r * body.inertia * r.transpose();
        let known_linear =
            (linear + (model.object_gravity - ws.passing.acceleration) * h) * body.mass + drive.object_force * h;
        // No gyroscopic torque: `State::integrate` carries the angular momentum over, which amounts to it.
        let known_angular = ws.body_inertia * angular;
        ws.rhs[2 * n..2 * n + 3].copy_from_slice(&known_linear.to_array());
        ws.rhs[2 * n + 3..2 * n + 6].copy_from_slice(&known_angular.to_array());
        ws.a_velocity[2 * n..2 * n + 3].copy_from_slice(&(linear * body.mass).to_array());
        ws.a_velocity[2 * n + 3..2 * n + 6].copy_from_slice(&known_angular.to_array());
    }
    if ws.space.is_some() {
        multiply_by_a(model, ws, &state.velocity, Product::OfVelocity);
    }
}

/// Fills A and r of fingers that stay in their planes.
fn gather_planar(model: &PhysicsModel, state: &State, ws: &mut Workspace, drive: &Drive) {
    let (n, h) = (model.chain.joints, ws.step.h);
    if model.finger_inertia {
        model.chain.inertia(&ws.both, &mut ws.finger_matrix);
    } else {
        ws.finger_matrix.fill(Lanes::ZERO);
    }
    let in_planes =
        |v: [DVec3; 2]| [Lanes::new([0, 1].map(|k| model.planes[k].sign * v[k].x)), Lanes::new(v.map(|v| -v.z))];
    let gravity = in_planes([model.finger_gravity - ws.passing.acceleration; 2]);
    let pull = in_planes(drive.tip_force);
    let last = &ws.both[n];
    let tip = [0, 1].map(|k| last.start[k] + last.along[k] * model.chain.lengths[n]);
    let moving = f64::from(u8::from(model.finger_inertia));
    let rates = |i: usize| Lanes::new([state.velocity[i], state.velocity[n + i]]) * moving;
    let (both, rhs) = (&ws.both, &mut ws.rhs);
    model.chain.bias(both, (rates, h), gravity, &mut ws.accelerations, |i, bias| {
        let [x, y] = both[i + 1].start;
        let load = (tip[1] - y) * pull[0] - (tip[0] - x) * pull[1] + drive.torque;
        let bent = Lanes::new([state.q[i], state.q[n + i]]) * model.chain.stiffness;
        [rhs[i], rhs[n + i]] = ((load - bent - bias) * h).to_array();
    });
    if let Some(relaxation) = &model.relaxation {
        relaxation.soften(h, &state.q, &state.crept, &mut ws.rhs[..2 * n]);
    }
    ws.a_velocity[..2 * n].fill(0.0);
    if model.finger_inertia {
        let (matrix, velocity) = (&ws.finger_matrix, &state.velocity[..2 * n]);
        multiply(matrix, velocity, &mut ws.rates, |k, momentum| ws.a_velocity[k] = momentum);
    }
    let lost = model.relaxation.as_ref().map_or(0.0, |relaxation| relaxation.diagonal_loss(h));
    let diagonal = h * model.chain.damping + h * h * model.chain.stiffness - lost;
    for ((known, momentum), rate) in ws.rhs.iter_mut().zip(&mut ws.a_velocity).zip(&state.velocity[..2 * n]) {
        *known += *momentum;
        *momentum += diagonal * rate;
    }
    for entry in ws.finger_matrix.iter_mut().step_by(n + 1) {
        *entry += diagonal;
    }
}

/// Friction limits that add up to less than this (N) are too small for a meaningful mismatch.
const FELT_FRICTION: f64 = 0.01;

/// Keeps shear and normal impulse of each contact for the next step; returns the outer friction residual.
pub(super) fn remember_contacts(model: &PhysicsModel, state: &mut State, ws: &Workspace) -> f64 {
    state.touched.clear();
    state.lag_h = ws.step.h;
    let (mut mismatch, mut total) = (0.0, 0.0);
    for contact in &ws.contacts {
        let Outcome { impulse, mut shear, missed, truth } = contact.outcome(ws.step);
        if let Acting::Segment(link) = contact.acting
            && shear != DVec3::ZERO
        {
            shear = segment_axes_of(model, ws, link).transpose() * shear;
        }
        state.touched.remember(contact.site, shear, impulse);
        mismatch += missed;
        total += truth;
    }
    mismatch / total.max(FELT_FRICTION * ws.step.h)
}

/// Axes of a segment in the gripper frame, as columns: along, across, inward.
pub(super) fn segment_axes_of(model: &PhysicsModel, ws: &Workspace, link: u32) -> glam::DMat3 {
    if let Some(frame) = ws.frames().get(link as usize) {
        return frame.axes;
    }
    let plane = &model.planes[link as usize / (model.chain.joints + 1)];
    segment_axes(plane, &ws.segments[link as usize])
}
