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

use super::model::PhysicsModel;
use super::sideways::SWAYS;
use super::spatial::{Block, Spatial};
use crate::gripper::{JointAxes, SegmentFrame, Sway, bend_in_space};
use glam::{DMat3, DVec3};

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
    pub(super) masses: Vec<Block>,
    /// Loads on each segment.
    pub(super) loads: Vec<Spatial>,
    /// Velocities of each segment that are not those of the present iterate.
    velocities: Vec<Spatial>,
    /// h C + h² K, and the diagonal of A, of all joints and then of the sways.
    pub(super) resistance: Vec<f64>,
    diagonal: Vec<f64>,
}

/// Index in the arrays above and among the unknowns.
#[derive(Clone, Copy)]
pub(super) struct Places {
    pub(super) joints: usize,
    /// First unknown of the sways.
    pub(super) sways: usize,
}

impl Places {
    pub(super) fn new(model: &PhysicsModel) -> Self {
        Self { joints: model.chain.joints, sways: model.first_sway() }
    }

    pub(super) fn link(self, finger: usize, segment: usize) -> usize {
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
    pub(super) fn momentum(&mut self, model: &PhysicsModel, x: &[f64]) {
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
    pub(super) fn resist(
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
    pub(super) fn fill_masses(&mut self, model: &PhysicsModel, reference: DVec3) {
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

    /// Fills h C + h² K, and the diagonal of A.
    pub(super) fn fill_diagonal(&mut self, model: &PhysicsModel, h: f64) {
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
}

/// Inertia of a segment about its centre, in the gripper frame (kg m²).
fn inertia_of(frame: &SegmentFrame, own: DVec3) -> DMat3 {
    frame.axes * DMat3::from_diagonal(own) * frame.axes.transpose()
}
