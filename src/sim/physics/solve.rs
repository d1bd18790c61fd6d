//! The convex minimisation of a step, by Newton's method.
//!
//! v+ = argmin  1/2 v' A v - r' v + sum over contacts l_c(J_c v) + sum over joints l_j(v),   A = M + h C + h² K
//!
//! which is the problem of the module page with the square completed: r = A v*. The Hessian is exact, the line
//! search works on the derivative alone (no potential is ever evaluated), and the start is the last velocity. Each
//! l is convex, so the minimum is unique and Newton with this search cannot cycle.
//!
//! Layout of the unknowns: joint rates of the left finger, of the right finger, then for a free object its linear
//! and angular velocity. Contact Hessians are summed per segment (6 x 6) before they go to joints: beyond joint i
//! everything moves with column S_i, so that H_ij = S_i' (sum of blocks from the tip to the farther joint) S_j.

use super::contact::{Acting, Against, Contact, ContactStep};
use super::coupling::{fill_coupling, prepare_coupling};
use super::hessian::{Lanes, multiply};
use super::model::PhysicsModel;
use super::spatial::{Block, Spatial};
use super::workspace::{LinkBlocks, Planar, PlanarBlock, Workspace};
use glam::DVec3;

/// Statistics of a minimisation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SolveReport {
    pub(super) iterations: u32,
    pub(super) line_search_steps: u32,
    pub(super) converged: bool,
    /// Largest imbalance; `None` where it converged.
    pub(super) unbalanced: Option<Unbalanced>,
}

/// Forces that did not balance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unbalanced {
    /// Index of the unknown: joint rates of both fingers, then the six velocities of a free object. See
    /// [`super::State::place_of`].
    pub unknown: u32,
    /// Residual there over the residual that the tolerance allows.
    pub excess: f64,
}

impl Unbalanced {
    /// The one that is farther from balance, if any is.
    pub(super) fn worse(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        match (one, other) {
            (Some(a), Some(b)) => Some(if b.excess > a.excess { b } else { a }),
            (a, b) => a.or(b),
        }
    }
}

/// A gradient this small compared with nothing at all counts as zero.
const ABSOLUTE_TOLERANCE: f64 = 1e-13;

/// After an iteration a gradient this small, as a share of the contact forces, gives slip limits that are better than what
/// lagging costs them.
const ENOUGH_FOR_LIMITS: f64 = 1e-3;

/// Share of the gradient that an iteration may leave if the next one is to use the same Hessian: to fill and to factorise it
/// costs more than two iterations without.
const STILL_GOOD: f64 = 0.1;

const STALE_SHARE: f64 = 0.1;

/// Minimises over `velocity`, starting from it. Needs the workspace's dynamics with the product of A and the velocities, and
/// contacts with their relative velocities at the start; leaves those at the solution.
pub(super) fn minimise(model: &PhysicsModel, q: &[f64], velocity: &mut [f64], ws: &mut Workspace) -> SolveReport {
    let mut report = SolveReport::default();
    let mut passes = 0;
    prepare_coupling(ws);
    fill_weights(model, ws);
    // The Hessian of an earlier step of this length is tried first.
    let same = ws.factor_of == Some((ws.step.h, ws.fingers_meet));
    let mut before = if same { f64::INFINITY } else { 0.0 };
    let known = ws.weighted_size(&ws.a_velocity).max(ws.weighted_size(&ws.rhs));
    let mut fresh = true;
    let mut size = fill_gradient(model, q, velocity, ws);
    loop {
        let allowed = ABSOLUTE_TOLERANCE + model.tolerance * size.contacts.max(known);
        if !size.gradient.is_finite() {
            report.unbalanced = Some(farthest_from_balance(model, ws, allowed));
            return report;
        }
        let close_enough = if fresh { allowed } else { STALE_SHARE * allowed };
        if size.gradient <= close_enough && passes == model.relag_passes {
            report.converged = true;
            return report;
        }
        let enough = if report.iterations > 0 { ENOUGH_FOR_LIMITS * size.contacts } else { 0.0 };
        if size.gradient <= allowed.max(enough) && passes < model.relag_passes {
            passes += 1;
            let step = ws.step;
            let changed =
                ws.contacts.iter_mut().fold(false, |changed, contact| contact.relag(step, passes > 1) | changed);
            if changed {
                size = fill_gradient(model, q, velocity, ws);
            }
            continue;
        }
        if report.iterations == model.max_iterations {
            report.unbalanced = Some(farthest_from_balance(model, ws, allowed));
            return report;
        }
        report.iterations += 1;
        fresh = size.gradient > STILL_GOOD * before;
        if fresh {
            fill_hessian(model, q, velocity, ws);
            fill_coupling(model, ws);
            ws.hessian.factorise();
            ws.factor_of = Some((ws.step.h, ws.fingers_meet));
        }
        before = size.gradient;
        for (d, g) in ws.direction.iter_mut().zip(&ws.gradient) {
            *d = -g;
        }
        ws.hessian.solve(&mut ws.direction);
        let direction = std::mem::take(&mut ws.direction);
        multiply_by_a(model, ws, &direction, Product::OfDirection);
        relative_velocities(model, &direction, ws, Product::OfDirection);
        ws.direction = direction;
        let slopes = [dot(&ws.direction, &ws.gradient), 0.0];
        // The whole step is nearly always taken: its gradient is needed then anyway.
        take_share(velocity, ws, 1.0);
        size = fill_gradient(model, q, velocity, ws);
        let slopes = [slopes[0], dot(&ws.direction, &ws.gradient)];
        let quadratic = dot(&ws.direction, &ws.a_direction);
        report.line_search_steps += 1;
        if !(slopes[1] <= ENOUGH_DESCENT * -slopes[0] || slopes[1] <= 1e-14 * quadratic) {
            take_share(velocity, ws, -1.0);
            let share = line_search(model, q, velocity, ws, slopes, &mut report.line_search_steps);
            take_share(velocity, ws, share);
            size = fill_gradient(model, q, velocity, ws);
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Moves by a share of the direction.
fn take_share(velocity: &mut [f64], ws: &mut Workspace, share: f64) {
    for (v, d) in velocity.iter_mut().zip(&ws.direction) {
        *v += share * d;
    }
    for (v, d) in ws.a_velocity.iter_mut().zip(&ws.a_direction) {
        *v += share * d;
    }
    for contact in &mut ws.contacts {
        contact.velocity += contact.change * share;
    }
}

/// Vector of a matrix product, which selects the output.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Product {
    OfVelocity,
    OfDirection,
}

pub(super) fn multiply_by_a(model: &PhysicsModel, ws: &mut Workspace, x: &[f64], which: Product) {
    let n = model.chain.joints;
    let out = match which {
        Product::OfVelocity => &mut ws.a_velocity,
        Product::OfDirection => &mut ws.a_direction,
    };
    match &mut ws.space {
        Some(space) => space.multiply_by_a(model, x, out),
        None => multiply(&ws.finger_matrix, &x[..2 * n], &mut ws.rates, |k, value| out[k] = value),
    }
    if let Some(body) = model.free_body() {
        let linear = object_part(x, 2 * n).linear * body.mass;
        let angular = ws.body_inertia * object_part(x, 2 * n).angular;
        write_object_part(out, 2 * n, &Spatial { linear, angular });
    }
}

fn object_part(x: &[f64], from: usize) -> Spatial {
    match x.get(from..from + 6) {
        Some([a, b, c, d, e, f]) => Spatial { linear: DVec3::new(*a, *b, *c), angular: DVec3::new(*d, *e, *f) },
        _ => Spatial::default(),
    }
}

fn write_object_part(out: &mut [f64], from: usize, value: &Spatial) {
    out[from..from + 3].copy_from_slice(&value.linear.to_array());
    out[from + 3..from + 6].copy_from_slice(&value.angular.to_array());
}

/// Velocities of all segments, and from them the relative velocity of each contact.
pub(super) fn relative_velocities(model: &PhysicsModel, x: &[f64], ws: &mut Workspace, which: Product) {
    segment_velocities(model, x, ws);
    let object = object_part(x, model.joint_count());
    for contact in &mut ws.contacts {
        let acting = match contact.acting {
            Acting::Segment(link) => ws.spatial[link as usize].linear_at(contact.arm),
            Acting::Object => object.linear_at(contact.arm),
        };
        let relative = match contact.against {
            Against::Object => acting - object.linear_at(contact.arm),
            Against::World => match which {
                Product::OfVelocity => acting - ws.passing.velocity,
                Product::OfDirection => acting,
            },
            Against::Finger(other) => acting - ws.spatial[other as usize].linear_at(contact.arm),
        };
        match which {
            Product::OfVelocity => contact.velocity = relative,
            Product::OfDirection => contact.change = relative,
        }
    }
}

/// Velocity of each segment for joint rates `x`, about the reference point.
pub(super) fn segment_velocities(model: &PhysicsModel, x: &[f64], ws: &mut Workspace) {
    if let Some(space) = &ws.space {
        space.segment_velocities(model, x, &mut ws.spatial);
        return;
    }
    let n = model.chain.joints;
    let (left, right) = ws.spatial.split_at_mut(n + 1);
    let mut velocity = Planar::default();
    (left[0], right[0]) = (Spatial::default(), Spatial::default());
    for (i, column) in ws.columns.iter().enumerate() {
        let rates = Lanes::new([x[i], x[n + i]]);
        velocity = velocity.plus(&Planar(column.0.map(|lanes| lanes * rates)));
        (left[i + 1], right[i + 1]) = (velocity.of(0), velocity.of(1));
    }
}

/// Sizes of the gradient and of the contact forces in it, in the norm of the diagonal of A.
pub(super) struct Size {
    gradient: f64,
    contacts: f64,
}

/// Hands over the load of each contact on the segments (by link) it acts on, found by the finger's own contact springs (0)
/// or by those of the other one (1); returns the sum that acts on the object.
#[inline]
fn add_up(n: usize, contacts: &[Contact], step: ContactStep, mut add: impl FnMut(usize, usize, &Spatial)) -> Spatial {
    let (mut on_object, mut by_fingers) = (Spatial::default(), [Spatial::default(); 2]);
    for contact in contacts {
        let linear = contact.gradient(step, contact.velocity);
        let load = Spatial { linear, angular: contact.arm.cross(linear) };
        match contact.acting {
            Acting::Segment(link) => {
                add(link as usize, 0, &load);
                match contact.against {
                    Against::Object => {
                        let by_finger = &mut by_fingers[link as usize / (n + 1)];
                        *by_finger = by_finger.plus(&load);
                    }
                    Against::World => (),
                    Against::Finger(other) => add(other as usize, 1, &load.scaled(-1.0)),
                }
            }
            Acting::Object => on_object = on_object.plus(&load),
        }
    }
    on_object.plus(&by_fingers[0].plus(&by_fingers[1]).scaled(-1.0))
}

pub(super) fn fill_gradient(model: &PhysicsModel, q: &[f64], velocity: &[f64], ws: &mut Workspace) -> Size {
    let n = model.chain.joints;
    let Workspace { contacts, loads, space, step, .. } = ws;
    let on_object = match space {
        Some(space) => {
            space.loads.fill(Spatial::default());
            add_up(n, contacts, *step, |link, _, load| space.add_load(link, load))
        }
        None => {
            loads.fill([Planar::default(); 2]);
            add_up(n, contacts, *step, |link, found, load| loads[link % (n + 1)][found].add_to(link / (n + 1), load))
        }
    };
    for ((g, a), r) in ws.gradient.iter_mut().zip(&ws.a_velocity).zip(&ws.rhs) {
        *g = a - r;
    }
    let mut contact_size = 0.0;
    if let Some(space) = &ws.space {
        space.project(model, |k, from_contacts| {
            let h = ws.step.h;
            let limit = if k < 2 * n { h * model.chain.limit_torque(q[k] + h * velocity[k]).0 } else { 0.0 };
            let load = from_contacts + limit;
            ws.gradient[k] += load;
            contact_size += load * load * ws.weights[k];
        });
    } else {
        let h = ws.step.h;
        let mut beyond = Planar::default();
        let mut size = Lanes::ZERO;
        for i in (0..n).rev() {
            let [own, met] = &ws.loads[i + 1];
            beyond = beyond.plus(own);
            if ws.fingers_meet {
                beyond = beyond.plus(met);
            }
            let both = |x: &[f64]| Lanes::new([x[i], x[n + i]]);
            let limits = (both(q) + both(velocity) * h).to_array().map(|end| h * model.chain.limit_torque(end).0);
            let load = ws.columns[i].dot(&beyond) + Lanes::new(limits);
            size += load * load * both(&ws.weights);
            [ws.gradient[i], ws.gradient[n + i]] = (both(&ws.gradient) + load).to_array();
        }
        contact_size += size.reduce_add();
    }
    if model.free_body().is_some() {
        let wrench = [on_object.linear.to_array(), on_object.angular.to_array()];
        for (i, w) in wrench.iter().flatten().enumerate() {
            ws.gradient[2 * n + i] += w;
            contact_size += w * w * ws.weights[2 * n + i];
        }
    }
    Size { gradient: ws.weighted_size(&ws.gradient), contacts: contact_size.sqrt() }
}

/// The unknown with the largest share in the gradient, or the first whose share is no number at all.
fn farthest_from_balance(model: &PhysicsModel, ws: &Workspace, allowed: f64) -> Unbalanced {
    let size = |k: usize| (ws.gradient[k] * ws.gradient[k] / diagonal(model, ws, k)).sqrt();
    let sizes = (0..ws.gradient.len()).map(|k| (k, if size(k).is_finite() { size(k) } else { f64::MAX }));
    let (unknown, largest) = sizes.fold((0, 0.0), |worst, next| if next.1 > worst.1 { next } else { worst });
    let excess = largest / allowed;
    Unbalanced { unknown: unknown as u32, excess: if excess.is_finite() { excess } else { f64::MAX } }
}

/// Diagonal entry of A.
#[inline]
pub(super) fn diagonal(model: &PhysicsModel, ws: &Workspace, k: usize) -> f64 {
    let n = model.chain.joints;
    if let Some(space) = &ws.space
        && let Some(entry) = space.diagonal(model, k)
    {
        return entry;
    }
    if k < 2 * n {
        let (finger, i) = (k / n, k % n);
        ws.finger_matrix[i * n + i].as_array()[finger]
    } else {
        let mass = model.body.as_ref().map_or(1.0, |body| body.mass);
        match k - 2 * n {
            3 => ws.body_inertia.x_axis.x,
            4 => ws.body_inertia.y_axis.y,
            5 => ws.body_inertia.z_axis.z,
            _ => mass,
        }
    }
}

/// One over the diagonal of A.
fn fill_weights(model: &PhysicsModel, ws: &mut Workspace) {
    let n = if ws.space.is_some() { 0 } else { model.chain.joints };
    for i in 0..n {
        [ws.weights[i], ws.weights[n + i]] = (Lanes::ONE / ws.finger_matrix[i * n + i]).to_array();
    }
    for k in 2 * n..ws.weights.len() {
        ws.weights[k] = 1.0 / diagonal(model, ws, k);
    }
}

pub(super) fn fill_hessian(model: &PhysicsModel, q: &[f64], velocity: &[f64], ws: &mut Workspace) {
    let on_object = sum_blocks(ws);
    let (n, h) = (model.chain.joints, ws.step.h);
    let limit = |k: usize| h * h * model.chain.limit_torque(q[k] + h * velocity[k]).1;
    if let Some(space) = ws.space.take() {
        space.fill_hessian(model, ws, true);
        ws.space = Some(space);
        for i in 0..n {
            ws.hessian.row_mut(i)[i] += Lanes::new([limit(i), limit(n + i)]);
        }
    } else {
        fill_planar(model, limit, ws);
    }
    if let Some(body) = model.free_body() {
        for a in 0..3 {
            for b in 0..=a {
                let mass = if a == b { body.mass } else { 0.0 };
                *ws.hessian.at_mut(2 * n + a, 2 * n + b) = mass + on_object.linear.col(b)[a];
                let inertia = ws.body_inertia.col(b)[a];
                *ws.hessian.at_mut(2 * n + 3 + a, 2 * n + 3 + b) = inertia + on_object.angular.col(b)[a];
            }
            for b in 0..3 {
                *ws.hessian.at_mut(2 * n + 3 + a, 2 * n + b) = on_object.mixed.col(b)[a];
            }
        }
    }
}

/// Rows of fingers that stay in their planes, and what couples them to the object.
#[inline]
fn fill_planar(model: &PhysicsModel, limit: impl Fn(usize) -> f64, ws: &mut Workspace) {
    let n = model.chain.joints;
    let couples = model.free_body().is_some();
    let mut beyond = PlanarBlock::default();
    let mut beyond_object = [Block::ZERO; 2];
    for i in (0..n).rev() {
        for (finger, beyond_object) in beyond_object.iter_mut().enumerate() {
            let link = finger * (n + 1) + i + 1;
            if ws.loaded[link] {
                let LinkBlocks { object, world, met } = &ws.blocks[link];
                beyond.add_to(finger, object);
                beyond.add_to(finger, world);
                if ws.fingers_meet {
                    beyond.add_to(finger, met);
                }
                beyond_object.add(object);
            }
        }
        let column = &ws.columns[i];
        let moved = beyond.times(column);
        let row = ws.hessian.row_mut(i);
        let matrix = &ws.finger_matrix[i * n..][..=i];
        for ((row, matrix), column) in row.iter_mut().zip(matrix).zip(&ws.columns) {
            *row = *matrix + column.dot(&moved);
        }
        row[i] += Lanes::new([limit(i), limit(n + i)]);
        if couples {
            let left = beyond_object[0].times(&column.of(0)).to_array();
            let right = beyond_object[1].times(&column.of(1)).to_array();
            for ((entry, left), right) in ws.hessian.border_mut(i).iter_mut().zip(left).zip(right) {
                *entry = Lanes::new([-left, -right]);
            }
        }
    }
}

/// Sums contact Hessians per segment; returns the sum that acts on the object.
fn sum_blocks(ws: &mut Workspace) -> Block {
    for (block, loaded) in ws.blocks.iter_mut().zip(&mut ws.loaded) {
        if std::mem::take(loaded) {
            *block = LinkBlocks::ZERO;
        }
    }
    let mut on_object = Block::ZERO;
    for contact in &ws.contacts {
        let hessian = contact.hessian(ws.step);
        if let Acting::Segment(link) = contact.acting {
            ws.loaded[link as usize] = true;
        }
        match (contact.acting, contact.against) {
            (Acting::Segment(link), Against::Object) => {
                ws.blocks[link as usize].object.add_at(&hessian, contact.arm);
            }
            (Acting::Segment(link), Against::World) => {
                ws.blocks[link as usize].world.add_at(&hessian, contact.arm);
            }
            (Acting::Segment(link), Against::Finger(other)) => {
                ws.blocks[link as usize].world.add_at(&hessian, contact.arm);
                ws.loaded[other as usize] = true;
                ws.blocks[other as usize].met.add_at(&hessian, contact.arm);
            }
            (Acting::Object, _) => on_object.add_at(&hessian, contact.arm),
        }
    }
    for (block, _) in ws.blocks.iter().zip(&ws.loaded).filter(|(_, loaded)| **loaded) {
        on_object.add(&block.object);
    }
    on_object
}

/// A step is taken whole when the slope at its end has fallen to this share of the slope at its start.
const ENOUGH_DESCENT: f64 = 0.5;
/// The slope at which a bracketed search stops, as a share of the slope at the start.
const FLAT_ENOUGH: f64 = 0.05;
/// Bisections after which the bracket is narrower than any velocity that matters.
const MOST_SEARCH_STEPS: u32 = 60;

/// Share of a direction where the slope along it vanishes, given the slopes at its start and at its end.
fn line_search(
    model: &PhysicsModel,
    q: &[f64],
    velocity: &[f64],
    ws: &Workspace,
    [start, end]: [f64; 2],
    steps: &mut u32,
) -> f64 {
    let quadratic = dot(&ws.direction, &ws.a_direction);
    let linear = dot(&ws.direction, &ws.a_velocity) - dot(&ws.direction, &ws.rhs);
    let h = ws.step.h;
    let mut slope_at = |share: f64| -> f64 {
        *steps += 1;
        let along = |c: &Contact| c.gradient(ws.step, c.velocity + c.change * share).dot(c.change);
        let contacts: f64 = ws.contacts.iter().map(along).sum();
        let limits: f64 = (0..model.joint_count())
            .map(|k| {
                let end = q[k] + h * (velocity[k] + share * ws.direction[k]);
                h * model.chain.limit_torque(end).0 * ws.direction[k]
            })
            .sum();
        linear + share * quadratic + contacts + limits
    };
    // Regula falsi (Illinois), with every fourth step a bisection.
    let (mut low, mut at_low, mut high, mut at_high) = (0.0, start, 1.0, end);
    let mut last_side = 0;
    for k in 1..=MOST_SEARCH_STEPS {
        let secant = (low * at_high - high * at_low) / (at_high - at_low);
        let inside = secant > low && secant < high;
        let share = if k % 4 == 0 || !inside { 0.5 * (low + high) } else { secant };
        let slope = slope_at(share);
        if slope.abs() <= FLAT_ENOUGH * -start {
            return share;
        }
        if slope > 0.0 {
            (high, at_high) = (share, slope);
            if last_side == 1 {
                at_low *= 0.5;
            }
            last_side = 1;
        } else {
            (low, at_low) = (share, slope);
            if last_side == -1 {
                at_high *= 0.5;
            }
            last_side = -1;
        }
    }
    low
}
