//! A step of fingers in space: what `space` computes, put where the step of planar fingers puts its own.

use super::contact::{Acting, Against};
use super::model::PhysicsModel;
use super::sideways::Sideways;
use super::space::{Places, Space};
use super::spatial::{Block, Spatial};
use super::state::State;
use super::workspace::{LinkBlocks, Workspace};
use glam::DVec3;

impl Space {
    /// Fills A into the Hessian, and adds the blocks of contacts if asked to.
    pub(super) fn fill_hessian(&self, model: &PhysicsModel, ws: &mut Workspace, with_contacts: bool) {
        let places = Places::new(model);
        let (n, object) = (places.joints, if model.free_body().is_some() { 6 } else { 0 });
        for finger in 0..2 {
            let (mut beyond, mut beyond_object) = (Block::ZERO, Block::ZERO);
            let (mut swayed, mut sway_on_object) = ([Spatial::default(); 2], [Spatial::default(); 2]);
            let mut own = [[0.0; 2]; 2];
            for i in (0..n).rev() {
                let (j, link) = (finger * n + i, places.link(finger, i + 1));
                let carried = &self.carried[link];
                let mut block = self.masses[link];
                if with_contacts && ws.loaded[link] {
                    let LinkBlocks { object, world, met } = &ws.blocks[link];
                    block.add(object);
                    block.add(world);
                    if ws.fingers_meet {
                        block.add(met);
                    }
                    beyond_object.add(object);
                    for (sum, carried) in sway_on_object.iter_mut().zip(carried) {
                        *sum = sum.plus(&object.times(carried));
                    }
                }
                beyond.add(&block);
                for u in 0..2 {
                    let load = block.times(&carried[u]);
                    swayed[u] = swayed[u].plus(&load);
                    for v in 0..=u {
                        own[u][v] += carried[v].dot(&load);
                    }
                }
                let moved = beyond.times(&self.columns[j]);
                let row = ws.hessian.row_mut(i);
                for (entry, column) in row.iter_mut().zip(&self.columns[finger * n..]) {
                    entry.as_mut_array()[finger] = column.dot(&moved);
                }
                row[i].as_mut_array()[finger] += self.resistance[j];
                let border = ws.hessian.border_mut(i);
                let on_object = beyond_object.times(&self.columns[j]).to_array();
                for (entry, value) in border[..object].iter_mut().zip(on_object) {
                    entry.as_mut_array()[finger] = -value;
                }
                for (k, entry) in border[object..].iter_mut().enumerate() {
                    let value = if k / 2 == finger { self.columns[j].dot(&swayed[k % 2]) } else { 0.0 };
                    entry.as_mut_array()[finger] = value;
                }
            }
            for u in 0..2 {
                let row = places.sways + 2 * finger + u;
                for (k, value) in sway_on_object[u].to_array().into_iter().enumerate().take(object) {
                    *ws.hessian.at_mut(row, 2 * n + k) = -value;
                }
                for k in places.sways..=row {
                    let which = (k - places.sways) / 2;
                    *ws.hessian.at_mut(row, k) = if which == finger { own[u][(k - places.sways) % 2] } else { 0.0 };
                }
                *ws.hessian.at_mut(row, row) += self.resistance[2 * n + 2 * finger + u];
            }
        }
    }

    /// Fills the entries between the two fingers, while they touch each other; see `coupling`.
    pub(super) fn fill_coupling(&self, model: &PhysicsModel, ws: &mut Workspace) {
        let places = Places::new(model);
        let (n, object) = (places.joints, places.sways - 2 * places.joints);
        for i in 0..n {
            for j in 0..n {
                *ws.hessian.at_mut(n + j, i) = 0.0;
            }
        }
        for contact in &ws.contacts {
            let (Acting::Segment(acting), Against::Finger(against)) = (contact.acting, contact.against) else {
                continue;
            };
            let links = [acting.min(against) as usize, acting.max(against) as usize];
            let hessian = contact.hessian(ws.step);
            let rights = [0, 1].map(|v| self.carried[links[1]][v].linear_at(contact.arm));
            let before = |finger: usize| 0..links[finger] - places.link(finger, 0);
            let couple = |left: DVec3, put: &mut dyn FnMut(Result<usize, usize>, f64)| {
                let force = hessian * left;
                for j in before(1) {
                    put(Ok(j), -self.columns[n + j].linear_at(contact.arm).dot(force));
                }
                for (v, right) in rights.iter().enumerate() {
                    put(Err(v), -right.dot(force));
                }
            };
            for i in before(0) {
                let left = self.columns[i].linear_at(contact.arm);
                couple(left, &mut |right, value| match right {
                    Ok(j) => *ws.hessian.at_mut(n + j, i) += value,
                    Err(v) => ws.hessian.border_mut(i)[object + 2 + v].as_mut_array()[0] += value,
                });
            }
            for u in 0..2 {
                let left = self.carried[links[0]][u].linear_at(contact.arm);
                couple(left, &mut |right, value| match right {
                    Ok(j) => ws.hessian.border_mut(j)[object + u].as_mut_array()[1] += value,
                    Err(v) => *ws.hessian.at_mut(places.sways + 2 + v, places.sways + u) += value,
                });
            }
        }
    }

    /// Largest torque of a joint, or mean moment out of the plane, that `known` ones, contacts and joint limits leave
    /// unbalanced (N m).
    pub(super) fn imbalance(
        &self,
        model: &PhysicsModel,
        (sideways, ws): (&Sideways, &Workspace),
        (q, known): (&[f64], Vec<f64>),
    ) -> f64 {
        let mut pressed = self.clone();
        pressed.loads.fill(Spatial::default());
        for contact in &ws.contacts {
            let (normal, tangential) = contact.force(ws.step);
            let linear = contact.normal * normal + tangential;
            let load = Spatial { linear, angular: contact.arm.cross(linear) };
            if let Acting::Segment(link) = contact.acting {
                pressed.add_load(link as usize, &load);
            }
            if let Against::Finger(link) = contact.against {
                pressed.add_load(link as usize, &load.scaled(-1.0));
            }
        }
        let (joints, mut largest) = (model.joint_count(), 0.0f64);
        pressed.project(model, |k, from_contacts| {
            let torque = known[k] + from_contacts;
            largest = largest.max(match k.checked_sub(model.first_sway()) {
                None => (torque - model.chain.limit_torque(q[k.min(joints - 1)]).0).abs(),
                Some(sway) => torque.abs() / sideways.turns[sway % 2],
            });
        });
        largest
    }
}

/// Fills A, and r of the fingers.
pub(super) fn gather(model: &PhysicsModel, state: &State, ws: &mut Workspace, (torque, tip_force): (f64, [DVec3; 2])) {
    let (Some(sideways), Some(mut space)) = (&model.sideways, ws.space.take()) else { return };
    let (n, h, first_sway) = (model.chain.joints, ws.step.h, model.first_sway());
    space.fill_masses(model, ws.reference);
    space.fill_diagonal(model, h);
    let gravity = model.finger_gravity - ws.passing.acceleration;
    space.resist(model, &state.velocity, (h, ws.reference), gravity, tip_force);
    space.project(model, |k, resisted| ws.rhs[k] = -h * resisted);
    for (k, q) in state.q.iter().enumerate() {
        ws.rhs[k] += h * (torque - model.chain.stiffness * q);
    }
    for (finger, sway) in state.sways.iter().enumerate() {
        for (which, x) in sway.to_array().into_iter().enumerate() {
            ws.rhs[first_sway + 2 * finger + which] -= h * sideways.stiffness[which] * x;
        }
    }
    if let Some(relaxation) = &model.relaxation {
        for joints in [0..n, n..2 * n] {
            relaxation.soften(h, &state.q[joints.clone()], &state.crept[joints.clone()], &mut ws.rhs[joints]);
        }
    }
    if model.finger_inertia {
        space.momentum(model, &state.velocity);
        space.project(model, |k, momentum| ws.rhs[k] += momentum);
    }
    ws.space = Some(space);
}
