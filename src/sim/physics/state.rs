//! State of a simulation. All of it can be saved and restored; scratch memory is elsewhere.

use super::effects::continued;
use super::model::PhysicsModel;
use super::placement::Placement;
use crate::gripper::Sway;
use glam::{DQuat, DVec3};
use palpate_geometry::Pose;

/// State of both fingers, the object, and the skin at every place of contact.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Joint angles, left finger then right, from palm to tip (rad).
    pub q: Vec<f64>,
    /// Shape of each finger out of its plane; none where they stay in it.
    pub sways: [Sway; 2],
    /// Joint rates (rad/s), then for a free object its velocity (m/s) and angular velocity (rad/s) in the gripper
    /// frame, then the rates of both sways.
    pub velocity: Vec<f64>,
    /// The object's centre of mass and the axes of its frame, in the gripper frame.
    pub(super) body: Pose,
    /// Time since the start (s).
    pub(super) time: f64,
    /// Displacement (m) and velocity (m/s) of a hand that moves, in the gripper frame; see `effects/shaking.rs`.
    pub(super) hand: [DVec3; 2],
    /// Contacts of the last step.
    pub(super) touched: ContactMemory,
    /// Length of that step (s); zero before the first.
    pub(super) lag_h: f64,
    /// Pressure in the chambers, and in the line that filled them last (bar), where chambers lag behind the line.
    pub(super) chamber_bar: f64,
    pub(super) filled_from_bar: f64,
    /// Angle by which each joint has crept (rad); empty where joints do not.
    pub(super) crept: Vec<f64>,
}

/// Shear of the skin and normal impulse at each place of contact: zero wherever nothing was touched.
#[derive(Debug, PartialEq)]
pub(super) struct ContactMemory {
    /// Shear (m), in the axes of the segment (or of the gripper, for the object on its support).
    pub(super) shear: Vec<DVec3>,
    /// Normal impulse (N s).
    pub(super) impulses: Vec<f64>,
    /// Places that were touched: the others are neither cleared nor copied.
    places: Vec<u32>,
}

/// With the room that later contacts need.
impl Clone for ContactMemory {
    fn clone(&self) -> Self {
        let mut places = Vec::with_capacity(self.shear.len());
        places.extend_from_slice(&self.places);
        Self { shear: self.shear.clone(), impulses: self.impulses.clone(), places }
    }
}

impl ContactMemory {
    fn new(places: usize) -> Self {
        Self { shear: vec![DVec3::ZERO; places], impulses: vec![0.0; places], places: Vec::with_capacity(places) }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        for place in self.places.drain(..) {
            self.shear[place as usize] = DVec3::ZERO;
            self.impulses[place as usize] = 0.0;
        }
    }

    /// Remembers a place of contact.
    pub(super) fn remember(&mut self, place: u32, shear: DVec3, impulse: f64) {
        self.shear[place as usize] = shear;
        self.impulses[place as usize] = impulse;
        self.places.push(place);
    }

    fn copy_from(&mut self, other: &Self) {
        self.clear();
        for place in &other.places {
            self.remember(*place, other.shear[*place as usize], other.impulses[*place as usize]);
        }
    }

    /// Goes on in a straight line, by `share` of the way from `start` to here. Impulses stay.
    fn go_on_from(&mut self, start: &Self, share: f64) {
        for place in self.places.iter().map(|place| *place as usize) {
            // Newly touched skin has no shear yet.
            if self.impulses[place] > 0.0 && start.impulses[place] > 0.0 {
                let now = self.shear[place];
                self.shear[place] = now + (now - start.shear[place]) * share;
            }
        }
    }
}

impl State {
    /// Fingers straight, everything at rest.
    pub fn new(model: &PhysicsModel, placement: &Placement) -> Self {
        let body = match (&model.body, placement.world_from_object) {
            (Some(body), Some(world_from_object)) => {
                let gripper_from_object = model.world_from_gripper.inverse() * world_from_object;
                Pose { position: gripper_from_object.point(body.centre), rotation: gripper_from_object.rotation }
            }
            _ => Pose::IDENTITY,
        };
        Self {
            q: vec![0.0; model.joint_count()],
            sways: [Sway::NONE; 2],
            velocity: vec![0.0; model.unknowns()],
            body,
            time: 0.0,
            hand: [DVec3::ZERO; 2],
            touched: ContactMemory::new(model.sites()),
            lag_h: 0.0,
            chamber_bar: 0.0,
            filled_from_bar: 0.0,
            crept: vec![0.0; if model.relaxation.is_some() { model.joint_count() } else { 0 }],
        }
    }

    /// The object's frame in the world; absent for an empty hand.
    pub fn world_from_object(&self, model: &PhysicsModel) -> Option<Pose> {
        let body = model.body.as_ref()?;
        let gripper_from_object =
            Pose { position: self.body.position - self.body.rotation * body.centre, rotation: self.body.rotation };
        let moved = Pose { position: gripper_from_object.position + self.hand[0], ..gripper_from_object };
        Some(model.world_from_gripper * moved)
    }

    /// Becomes another state of the same model, without allocating.
    pub(super) fn copy_from(&mut self, other: &Self) {
        let Self { q, sways, velocity, body, time, hand, touched, lag_h, chamber_bar, filled_from_bar, crept } = other;
        self.q.copy_from_slice(q);
        self.sways = *sways;
        self.velocity.copy_from_slice(velocity);
        self.body = *body;
        self.time = *time;
        self.hand = *hand;
        self.touched.copy_from(touched);
        self.lag_h = *lag_h;
        self.chamber_bar = *chamber_bar;
        self.filled_from_bar = *filled_from_bar;
        self.crept.copy_from_slice(crept);
    }

    /// Goes on in a straight line, by `share` of the way from `start` to here. Normal impulses are no path and stay.
    ///
    /// A turning object is advanced in angular momentum rather than in angular velocity, so that free flight conserves
    /// it.
    pub(super) fn go_on_from(&mut self, start: &Self, share: f64, model: &PhysicsModel) {
        let momentum = self.angular_momentum(model);
        let momentum = momentum + (momentum - start.angular_momentum(model)) * share;
        for (now, before) in self.q.iter_mut().zip(&start.q).chain(self.velocity.iter_mut().zip(&start.velocity)) {
            *now += share * (*now - before);
        }
        for (now, before) in self.sways.iter_mut().zip(start.sways) {
            now.curvature += share * (now.curvature - before.curvature);
            now.twist += share * (now.twist - before.twist);
        }
        for (now, before) in self.crept.iter_mut().zip(&start.crept) {
            *now += share * (*now - before);
        }
        self.time += (self.time - start.time) * share;
        for (now, before) in self.hand.iter_mut().zip(start.hand) {
            *now += (*now - before) * share;
        }
        self.chamber_bar = continued(start.chamber_bar, self.chamber_bar, self.filled_from_bar, share);
        self.body.position += (self.body.position - start.body.position) * share;
        let turn = rotation_vector(self.body.rotation * start.body.rotation.inverse());
        self.body.rotation = (DQuat::from_scaled_axis(turn * share) * self.body.rotation).normalize();
        if let Some(body) = model.free_body() {
            let axes = self.body.matrix();
            let spin = axes * (body.inverse_inertia * (axes.transpose() * momentum));
            self.set_spin(model, spin);
        }
        self.touched.go_on_from(&start.touched, share);
    }

    /// Normal impulse to expect at a place of contact in a step of `h` (s): that of the last step, at the same force.
    pub(super) fn expected_impulse(&self, site: usize, h: f64) -> f64 {
        // Steps of equal length give a factor of exactly one.
        if self.lag_h > 0.0 { self.touched.impulses[site] * (h / self.lag_h) } else { 0.0 }
    }

    /// Bound of the relative speed of a finger's axis and the object (m/s).
    pub(super) fn fastest(&self, model: &PhysicsModel) -> f64 {
        let n = model.chain.joints;
        let length: f64 = model.chain.lengths.iter().sum();
        let mut fastest = 0.0f64;
        for rates in self.velocity[..2 * n].chunks_exact(n) {
            let (mut tip, mut beyond) = (0.0, length + model.skin.thickness);
            for (rate, l) in rates.iter().zip(&model.chain.lengths) {
                beyond -= l;
                tip += rate.abs() * beyond;
            }
            fastest = fastest.max(tip);
        }
        if let Some(sideways) = &model.sideways {
            fastest += sideways.fastest(&self.sway_rates(model), &model.chain.lengths, model.skin.thickness);
        }
        let (linear, angular) = self.body_velocity(model);
        let object = model.free_body().map_or(0.0, |body| linear.length() + angular.length() * body.radius);
        fastest + object
    }

    /// Linear and angular velocity of a free object in the gripper frame (m/s, rad/s); zero otherwise.
    pub(super) fn body_velocity(&self, model: &PhysicsModel) -> (DVec3, DVec3) {
        match self.velocity.get(model.joint_count()..model.first_sway()) {
            Some([x, y, z, a, b, c]) => (DVec3::new(*x, *y, *z), DVec3::new(*a, *b, *c)),
            _ => (DVec3::ZERO, DVec3::ZERO),
        }
    }

    fn set_spin(&mut self, model: &PhysicsModel, spin: DVec3) {
        let from = model.joint_count() + 3;
        self.velocity[from..from + 3].copy_from_slice(&spin.to_array());
    }

    /// Rates of a finger's sway (1/(m s), rad/(m s)); zero where it stays in its plane.
    pub(super) fn sway_rates_of(&self, model: &PhysicsModel, finger: usize) -> [f64; 2] {
        let from = model.first_sway() + 2 * finger;
        self.velocity.get(from..from + 2).map_or([0.0; 2], |rates| [rates[0], rates[1]])
    }

    /// The faster of both fingers' rates of sway.
    pub(super) fn sway_rates(&self, model: &PhysicsModel) -> [f64; 2] {
        let [left, right] = [0, 1].map(|finger| self.sway_rates_of(model, finger));
        [left[0].abs().max(right[0].abs()), left[1].abs().max(right[1].abs())]
    }

    /// Sways after a time (s) at the present rates.
    pub(super) fn sways_ahead(&self, model: &PhysicsModel, ahead: f64) -> [Sway; 2] {
        [0, 1].map(|finger| {
            let Sway { curvature, twist } = self.sways[finger];
            let [a, b] = self.sway_rates_of(model, finger);
            Sway { curvature: curvature + ahead * a, twist: twist + ahead * b }
        })
    }

    /// Angular momentum of a free object about its centre of mass, in the gripper frame (kg m²/s); zero otherwise.
    pub(super) fn angular_momentum(&self, model: &PhysicsModel) -> DVec3 {
        let Some(body) = model.free_body() else { return DVec3::ZERO };
        let axes = self.body.matrix();
        axes * (body.inertia * (axes.transpose() * self.body_velocity(model).1))
    }

    /// Moves joints and object by one step of `h` (s) at the current velocities.
    ///
    /// A turning object keeps its angular momentum L = I w while I turns with it: w+ = I+^-1 I w. To first order in h
    /// that is the gyroscopic torque, but the spin can never exceed |L| over the least moment of inertia, however
    /// long the step: an explicit torque flung light splinters out of the range of numbers.
    pub(super) fn integrate(&mut self, model: &PhysicsModel, h: f64) {
        if let Some(relaxation) = &model.relaxation {
            for ((crept, q), rate) in self.crept.iter_mut().zip(&self.q).zip(&self.velocity) {
                *crept = relaxation.crept(h, *q, *rate, *crept);
            }
        }
        self.time += h;
        if let Some(motion) = &model.hand_motion {
            let velocity = motion.at(self.time).velocity;
            self.hand = [self.hand[0] + velocity * h, velocity];
        }
        for (q, rate) in self.q.iter_mut().zip(&self.velocity) {
            *q += h * rate;
        }
        if model.sideways.is_some() {
            self.sways = self.sways_ahead(model, h);
        }
        if let Some(body) = model.free_body() {
            let (linear, angular) = self.body_velocity(model);
            self.body.position += linear * h;
            let before = self.body.matrix();
            self.body.rotation = (DQuat::from_scaled_axis(angular * h) * self.body.rotation).normalize();
            let after = self.body.matrix();
            let momentum = before * (body.inertia * (before.transpose() * angular));
            let spin = after * (body.inverse_inertia * (after.transpose() * momentum));
            self.set_spin(model, spin);
        }
    }

    /// The first number that is not finite, named for people; `None` when all is well.
    pub(super) fn not_finite(&self, model: &PhysicsModel) -> Option<String> {
        let n = model.chain.joints;
        let bad = |values: &[f64]| values.iter().position(|x| !x.is_finite());
        if let Some(i) = bad(&self.q).or_else(|| bad(&self.velocity[..2 * n])) {
            return Some(Self::place_of(model, i));
        }
        if model.sideways.is_some()
            && let Some(unknown) = self.sway_not_finite(model)
        {
            return Some(Self::place_of(model, unknown));
        }
        let (linear, angular) = self.body_velocity(model);
        let sound = self.body.is_finite() && linear.is_finite() && angular.is_finite();
        (!sound).then(|| Self::place_of(model, 2 * n))
    }

    /// The first unknown of a sway that is not finite.
    fn sway_not_finite(&self, model: &PhysicsModel) -> Option<usize> {
        let finite = |sway: &Sway| sway.curvature.is_finite() && sway.twist.is_finite();
        let rates = &self.velocity[model.first_sway()..];
        let shape = self.sways.iter().position(|sway| !finite(sway)).map(|finger| 2 * finger);
        shape.or_else(|| rates.iter().position(|rate| !rate.is_finite())).map(|k| model.first_sway() + k)
    }

    /// Display name of the joint or body that an unknown of the step belongs to.
    pub fn place_of(model: &PhysicsModel, unknown: usize) -> String {
        let n = model.chain.joints;
        match unknown / n {
            0 => format!("joint {} of the left finger", unknown + 1),
            1 => format!("joint {} of the right finger", unknown - n + 1),
            _ if unknown < model.first_sway() => "the object".to_owned(),
            _ if unknown < model.first_sway() + 2 => "the left finger, sideways".to_owned(),
            _ => "the right finger, sideways".to_owned(),
        }
    }
}

/// Axis times angle of a rotation (rad), the short way round.
fn rotation_vector(rotation: DQuat) -> DVec3 {
    let short = if rotation.w < 0.0 { -rotation } else { rotation };
    short.to_scaled_axis()
}
