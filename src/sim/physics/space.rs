//! Fingers in space: the chain where it also bends sideways and twists.
//!
//! A finger then has two unknowns more, the rates of its sideways curvature a and of its twist b (see
//! [`crate::gripper::Sway`]). Everything beyond joint i moves with its column S_i per unit of its rate, and with its
//! shares T_i of both rates, so that segment k moves with the sum of S_i q_i' + T_i (a', b') over the joints i before
//! it. All of it is taken in the layout as it is bent and twisted, in six dimensions; with J_k the columns of segment k,
//!
//! ```text
//! A = sum over segments of J_k' M_k J_k + h C + h² K          H = A + sum over contacts
//! ```
//!
//! with M_k the inertia of segment k about the reference point, as a block like those that contacts add up to. C and K
//! are diagonal: by virtual work K_a = EI sum (1 - s/L)² l and K_b = GJ L, and C is K times the finger's damping time.
//! Forces of inertia that grow with the square of the rates are explicit, as in `chain`, and as carefully bounded.
//!
//! The four unknowns stand last, in the border of the Hessian: a and b of the left finger, then of the right one.

use super::contact::{Acting, Against};
use super::model::PhysicsModel;
use super::state::State;
use super::step::Drive;
use super::workspace::{Block, LinkBlocks, Spatial, Workspace};
use crate::gripper::{Finger, JointAxes, Pad, SegmentFrame, Sway, bend_in_space, sway_shares};
use glam::{DMat3, DVec3};

/// Unknowns of both fingers out of their planes.
pub(super) const SWAYS: usize = 4;

/// What a finger resists out of its plane; both fingers share it. Pairs are of sideways curvature and of twist.
#[derive(Clone, Debug)]
pub(super) struct Sideways {
    /// Angle of each joint per unit of both (m).
    shares: Vec<[f64; 2]>,
    /// Sums of the above (m): the tip turns by these.
    pub(super) turns: [f64; 2],
    /// K_a (N m³) and K_b (N m³): moment per unit, times the shares.
    pub(super) stiffness: [f64; 2],
    damping: [f64; 2],
    /// Inertia of each segment about its centre, along, across and inward (kg m²).
    inertias: Vec<DVec3>,
}

impl Sideways {
    /// `stiffness`: bending sideways and torsion (N m²).
    pub(super) fn new(finger: &Finger, pad: &Pad, [bending, torsion]: [f64; 2]) -> Self {
        let lengths: Vec<f64> = finger.segment_lengths().collect();
        let shares: Vec<[f64; 2]> = sway_shares(&lengths).collect();
        let sum = |of: &dyn Fn(&[f64; 2]) -> f64| shares.iter().map(of).sum::<f64>();
        let each = finger.segment_length();
        let stiffness = [bending * sum(&|s| s[0] * s[0] / each), torsion * sum(&|s| s[1] * s[1] / each)];
        let thickness = finger.back + pad.thickness;
        let squares = |a: f64, b: f64| (a * a + b * b) / 12.0;
        let inertias = lengths.iter().map(|l| {
            let mass = finger.mass * l / finger.length;
            DVec3::new(squares(finger.width, thickness), squares(*l, thickness), squares(*l, finger.width)) * mass
        });
        Self {
            turns: [sum(&|s| s[0]), sum(&|s| s[1])],
            stiffness,
            damping: stiffness.map(|k| finger.damping_time * k),
            inertias: inertias.collect(),
            shares,
        }
    }

    /// Diagonal of h C + h² K.
    fn resistance(&self, h: f64, which: usize) -> f64 {
        h * self.damping[which] + h * h * self.stiffness[which]
    }

    /// Resistance of the dampers to rates.
    pub(super) fn resisted(&self, rates: [f64; 2]) -> [f64; 2] {
        [self.damping[0] * rates[0], self.damping[1] * rates[1]]
    }

    /// Elastic energy of a finger (J).
    pub(super) fn energy(&self, sway: Sway) -> f64 {
        0.5 * sway.to_array().iter().zip(self.stiffness).map(|(x, k)| k * x * x).sum::<f64>()
    }

    /// Moments that shapes out of the plane stand under, summed, the larger of two states (N m); and elastic energy in
    /// the first (J).
    pub(super) fn strain(&self, before: &State, after: &State) -> (f64, f64) {
        let mut moments = 0.0;
        for (before, after) in before.sways.iter().zip(&after.sways) {
            for (which, (x, y)) in before.to_array().into_iter().zip(after.to_array()).enumerate() {
                moments += self.stiffness[which] / self.turns[which] * x.abs().max(y.abs());
            }
        }
        (moments, before.sways.iter().map(|sway| self.energy(*sway)).sum())
    }

    /// Bound of the turn of any segment (rad/s), from its rates.
    pub(super) fn turning(&self, rates: [f64; 2]) -> f64 {
        self.turns[0] * rates[0].abs() + self.turns[1] * rates[1].abs()
    }

    /// Bound of the speed (m/s) of any point of a finger within `reach` (m) of its tip's axis, from its rates.
    pub(super) fn fastest(&self, rates: &[f64], lengths: &[f64], reach: f64) -> f64 {
        let mut beyond = lengths.iter().sum::<f64>() + reach;
        let arms = self.shares.iter().zip(lengths).map(|(shares, l)| {
            beyond -= l;
            (shares[0] * rates[0].abs() + shares[1] * rates[1].abs()) * beyond
        });
        arms.sum()
    }
}

/// Scratch memory of a step in space.
#[derive(Clone, Debug)]
pub(super) struct Space {
    /// Segments of both fingers.
    pub(super) frames: Vec<SegmentFrame>,
    joints: Vec<JointAxes>,
    /// S: velocity of everything beyond each joint of both fingers per unit of its rate, about the reference.
    pub(super) columns: Vec<Spatial>,
    /// T: the same by this joint's shares of sideways curvature and twist.
    sways: Vec<[Spatial; 2]>,
    /// Velocity of each segment per unit rate of sideways curvature and twist: sums of T.
    pub(super) carried: Vec<[Spatial; 2]>,
    /// Inertia of each segment about the reference; zero for fingers without.
    masses: Vec<Block>,
    /// Loads on each segment.
    pub(super) loads: Vec<Spatial>,
    /// Velocities of each segment that are not those of the present iterate.
    velocities: Vec<Spatial>,
    /// h C + h² K, and the diagonal of A, of all joints and then of the sways.
    resistance: Vec<f64>,
    diagonal: Vec<f64>,
}

/// Index in the arrays above and among the unknowns.
#[derive(Clone, Copy)]
struct Places {
    joints: usize,
    /// First unknown of the sways.
    sways: usize,
}

impl Places {
    fn new(model: &PhysicsModel) -> Self {
        Self { joints: model.chain.joints, sways: model.first_sway() }
    }

    fn link(self, finger: usize, segment: usize) -> usize {
        finger * (self.joints + 1) + segment
    }
}

impl Space {
    pub(super) fn new(model: &PhysicsModel) -> Self {
        let (joints, links) = (model.joint_count(), model.link_count());
        Self {
            frames: vec![SegmentFrame::default(); links],
            joints: vec![JointAxes::default(); joints],
            columns: vec![Spatial::default(); joints],
            sways: vec![[Spatial::default(); 2]; joints],
            carried: vec![[Spatial::default(); 2]; links],
            masses: vec![Block::ZERO; links],
            loads: vec![Spatial::default(); links],
            velocities: vec![Spatial::default(); links],
            resistance: vec![0.0; joints + SWAYS],
            diagonal: vec![0.0; joints + SWAYS],
        }
    }

    /// Lays out both fingers, and what moves with each joint.
    pub(super) fn lay_out(&mut self, model: &PhysicsModel, q: &[f64], sways: [Sway; 2], reference: DVec3) {
        let Some(sideways) = &model.sideways else { return };
        let n = model.chain.joints;
        let places = Places::new(model);
        for (finger, sway) in sways.into_iter().enumerate() {
            let own = finger * n..(finger + 1) * n;
            bend_in_space(
                &model.planes[finger],
                (&model.chain.lengths, &sideways.shares),
                (&q[own.clone()], sway),
                &mut self.frames[places.link(finger, 0)..=places.link(finger, n)],
                &mut self.joints[own],
            );
            let mut carried = [Spatial::default(); 2];
            self.carried[places.link(finger, 0)] = carried;
            for (i, shares) in sideways.shares.iter().enumerate() {
                let joint = &self.joints[finger * n + i];
                let arm = reference - joint.place;
                let turning = |axis: DVec3| Spatial { linear: axis.cross(arm), angular: axis };
                self.columns[finger * n + i] = turning((joint.bending[0] + joint.bending[1]) * 0.5);
                let sways = [turning(joint.sideways * shares[0]), turning(joint.twist * shares[1])];
                self.sways[finger * n + i] = sways;
                carried = [carried[0].plus(&sways[0]), carried[1].plus(&sways[1])];
                self.carried[places.link(finger, i + 1)] = carried;
            }
        }
    }

    /// Centre of mass of a segment (m).
    pub(super) fn centre(&self, model: &PhysicsModel, finger: usize, segment: usize) -> DVec3 {
        let half = 0.5 * model.chain.lengths[segment];
        self.frames[Places::new(model).link(finger, segment)].point(half, 0.0, 0.0)
    }

    /// Tip of a finger (m).
    pub(super) fn tip(&self, model: &PhysicsModel, finger: usize) -> DVec3 {
        let n = model.chain.joints;
        self.frames[Places::new(model).link(finger, n)].point(model.chain.lengths[n], 0.0, 0.0)
    }

    /// Velocity of each segment for the unknowns `x`.
    pub(super) fn segment_velocities(&self, model: &PhysicsModel, x: &[f64], velocities: &mut [Spatial]) {
        let places = Places::new(model);
        for finger in 0..2 {
            let [a, b] = [0, 1].map(|which| x[places.sways + 2 * finger + which]);
            let mut velocity = Spatial::default();
            velocities[places.link(finger, 0)] = velocity;
            for i in 0..places.joints {
                let j = finger * places.joints + i;
                let [bent, twisted] = &self.sways[j];
                velocity = velocity.plus(&self.columns[j].scaled(x[j])).plus(&bent.scaled(a)).plus(&twisted.scaled(b));
                velocities[places.link(finger, i + 1)] = velocity;
            }
        }
    }

    /// Power of the loads on the segments per unit of each unknown.
    pub(super) fn project(&self, model: &PhysicsModel, mut put: impl FnMut(usize, f64)) {
        let places = Places::new(model);
        for finger in 0..2 {
            let (mut beyond, mut sway) = (Spatial::default(), [0.0; 2]);
            for i in (0..places.joints).rev() {
                let j = finger * places.joints + i;
                beyond = beyond.plus(&self.loads[places.link(finger, i + 1)]);
                put(j, self.columns[j].dot(&beyond));
                for (sum, motion) in sway.iter_mut().zip(&self.sways[j]) {
                    *sum += motion.dot(&beyond);
                }
            }
            for (which, load) in sway.into_iter().enumerate() {
                put(places.sways + 2 * finger + which, load);
            }
        }
    }

    /// Adds a load to a segment.
    #[inline]
    pub(super) fn add_load(&mut self, link: usize, load: &Spatial) {
        let sum = &mut self.loads[link];
        *sum = sum.plus(load);
    }

    /// Product of A with the unknowns `x`, as far as they are the fingers'.
    pub(super) fn multiply_by_a(&mut self, model: &PhysicsModel, x: &[f64], out: &mut [f64]) {
        self.momentum(model, x);
        self.project(model, |k, momentum| out[k] = momentum);
        self.each_unknown(model, |k, resistance| out[k] += resistance * x[k]);
    }

    /// Fills the loads with the momenta of the segments for the unknowns `x`.
    fn momentum(&mut self, model: &PhysicsModel, x: &[f64]) {
        let mut velocities = std::mem::take(&mut self.velocities);
        self.segment_velocities(model, x, &mut velocities);
        for ((load, mass), velocity) in self.loads.iter_mut().zip(&self.masses).zip(&velocities) {
            *load = mass.times(velocity);
        }
        self.velocities = velocities;
    }

    /// Hands over h C + h² K of every unknown of the fingers.
    fn each_unknown(&self, model: &PhysicsModel, mut put: impl FnMut(usize, f64)) {
        let joints = model.joint_count();
        for (k, resistance) in self.resistance.iter().enumerate() {
            put(if k < joints { k } else { model.first_sway() + k - joints }, *resistance);
        }
    }

    /// Diagonal entry of A; none for unknowns that are not the fingers'.
    #[inline(never)]
    pub(super) fn diagonal(&self, model: &PhysicsModel, k: usize) -> Option<f64> {
        let joints = model.joint_count();
        let place = if k < joints { k } else { joints + k.checked_sub(model.first_sway())? };
        self.diagonal.get(place).copied()
    }

    /// Kinetic energy (J).
    pub(super) fn kinetic_energy(&mut self, model: &PhysicsModel, x: &[f64]) -> f64 {
        self.momentum(model, x);
        self.velocities.iter().zip(&self.loads).map(|(velocity, momentum)| 0.5 * velocity.dot(momentum)).sum()
    }

    /// Fills the loads with what inertia and gravity resist at zero acceleration of the unknowns `x`, less the forces at
    /// the tips. `gravity` is what falls freely (m/s²).
    fn resist(
        &mut self,
        model: &PhysicsModel,
        x: &[f64],
        (h, reference): (f64, DVec3),
        gravity: DVec3,
        tips: [DVec3; 2],
    ) {
        let Some(sideways) = &model.sideways else { return };
        let (places, chain) = (Places::new(model), &model.chain);
        let n = chain.joints;
        let mut velocities = std::mem::take(&mut self.velocities);
        self.segment_velocities(model, x, &mut velocities);
        for finger in 0..2 {
            let links = places.link(finger, 0)..=places.link(finger, n);
            // As `ChainModel::bias` bounds them.
            let fastest = velocities[links].iter().map(|v| v.angular.length()).fold(0.0, f64::max);
            let share = if model.finger_inertia { 1.0 / (1.0 + (h * fastest).powi(2)) } else { 0.0 };
            let rates = [0, 1].map(|which| x[places.sways + 2 * finger + which]);
            let (mut omega, mut turning, mut at_joint) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            self.loads[places.link(finger, 0)] = Spatial::default();
            for i in 0..n {
                let (joint, rate, shares) = (&self.joints[finger * n + i], x[finger * n + i], sideways.shares[i]);
                for turn in [
                    joint.bending[0] * (0.5 * rate),
                    joint.sideways * (shares[0] * rates[0]),
                    joint.twist * (shares[1] * rates[1]),
                    joint.bending[1] * (0.5 * rate),
                ] {
                    turning += omega.cross(turn);
                    omega += turn;
                }
                let link = places.link(finger, i + 1);
                let frame = &self.frames[link];
                let along = frame.axes.x_axis * chain.lengths[i + 1];
                let pull = turning.cross(along) + omega.cross(omega.cross(along));
                let centre = frame.start + along * 0.5;
                let force = ((at_joint + pull * 0.5) * share - gravity) * chain.masses[i + 1];
                let inertia = inertia_of(frame, sideways.inertias[i + 1]);
                let moment = (inertia * turning + omega.cross(inertia * omega)) * share;
                self.loads[link] = Spatial { linear: force, angular: (centre - reference).cross(force) + moment };
                at_joint += pull;
            }
            let (arm, force) = (self.tip(model, finger) - reference, -tips[finger]);
            self.add_load(places.link(finger, n), &Spatial { linear: force, angular: arm.cross(force) });
        }
        self.velocities = velocities;
    }

    /// Fills the blocks of inertia.
    fn fill_masses(&mut self, model: &PhysicsModel, reference: DVec3) {
        let Some(sideways) = model.sideways.as_ref().filter(|_| model.finger_inertia) else { return };
        let places = Places::new(model);
        for finger in 0..2 {
            for segment in 1..=places.joints {
                let link = places.link(finger, segment);
                let arm = self.centre(model, finger, segment) - reference;
                let mut block = Block::ZERO;
                block.add_at(&(DMat3::IDENTITY * model.chain.masses[segment]), arm);
                block.angular += inertia_of(&self.frames[link], sideways.inertias[segment]);
                self.masses[link] = block;
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

    /// Fills h C + h² K, and the diagonal of A.
    fn fill_diagonal(&mut self, model: &PhysicsModel, h: f64) {
        let Some(sideways) = &model.sideways else { return };
        let (n, places) = (model.chain.joints, Places::new(model));
        let lost = model.relaxation.as_ref().map_or(0.0, |relaxation| relaxation.diagonal_loss(h));
        self.resistance.fill(h * model.chain.damping + h * h * model.chain.stiffness - lost);
        for k in 0..SWAYS {
            self.resistance[2 * n + k] = sideways.resistance(h, k % 2);
        }
        self.diagonal.copy_from_slice(&self.resistance);
        for finger in 0..2 {
            let mut beyond = Block::ZERO;
            for i in (0..n).rev() {
                let (j, link) = (finger * n + i, places.link(finger, i + 1));
                beyond.add(&self.masses[link]);
                self.diagonal[j] += self.columns[j].dot(&beyond.times(&self.columns[j]));
                for (which, carried) in self.carried[link].iter().enumerate() {
                    self.diagonal[2 * n + 2 * finger + which] += carried.dot(&self.masses[link].times(carried));
                }
            }
        }
    }

    /// Fills A, and where `blocks` are given those of contacts, into the Hessian.
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
}

/// Inertia of a segment about its centre, in the gripper frame (kg m²).
fn inertia_of(frame: &SegmentFrame, own: DVec3) -> DMat3 {
    frame.axes * DMat3::from_diagonal(own) * frame.axes.transpose()
}

/// Fills A, and r of the fingers.
pub(super) fn gather(model: &PhysicsModel, state: &State, ws: &mut Workspace, drive: &Drive) {
    let (Some(sideways), Some(mut space)) = (&model.sideways, ws.space.take()) else { return };
    let (n, h, first_sway) = (model.chain.joints, ws.step.h, model.first_sway());
    space.fill_masses(model, ws.reference);
    space.fill_diagonal(model, h);
    let gravity = model.finger_gravity - ws.passing.acceleration;
    space.resist(model, &state.velocity, (h, ws.reference), gravity, drive.tip_force);
    space.project(model, |k, resisted| ws.rhs[k] = -h * resisted);
    for (k, q) in state.q.iter().enumerate() {
        ws.rhs[k] += h * (drive.torque - model.chain.stiffness * q);
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
