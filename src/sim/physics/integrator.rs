//! Methods that make a step of h out of convex steps.
//!
//! - Euler: the convex step itself. First order; it damps like an additional c = h k in every joint.
//! - SDIRK2 (Alexander 1977): two convex steps of gamma h, gamma = 1 - 1/sqrt(2), the second of which starts from the
//!   state that the slope of the first leads to:
//!
//! ```text
//! x1 = x0 + gamma h f(x1)                                     a convex step of gamma h from x0
//! x2 = x0 + (1 - gamma) h f(x1) + gamma h f(x2)               a convex step of gamma h from x1 + (1/gamma - 2)(x1 - x0)
//! ```
//!
//!   Second order and L-stable, and it needs no memory of earlier steps. Each stage holds the geometry expected at its
//!   end, so that nothing lags; see [`super::step`].
//!
//! The error of a step is the difference to a method of another order that is made of the same velocities: for SDIRK2
//! of third order, with the weights b1 = 1 / (6 gamma (1 - gamma)), b2 = 1/2 - b1 gamma and b0 = 1 - b1 - b2 of the two
//! stages and of the start; for Euler the trapezoidal rule.
//!
//! Also tried, and not kept: subtracting h k or h k / 2 from the damping (half the error in curvature at 1/150 s, the
//! same in force, first order still), BDF2 (no gain above 1/600 s), Richardson's extrapolation of Euler (half as good
//! as SDIRK2 at equal cost), an error from taking each step whole and in halves (three times the cost).

use super::model::PhysicsModel;
use super::sideways::SWAYS;
use super::state::State;
use super::step::{Drive, NotFinite, StepReport, step};
use super::workspace::Workspace;
use crate::scene::IntegrationMethod;
use glam::DVec3;
use std::f64::consts::FRAC_1_SQRT_2;

const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;

/// Inputs of a step besides state and length.
pub(super) struct Surroundings<'a> {
    pub(super) model: &'a PhysicsModel,
    pub(super) ws: &'a mut Workspace,
    pub(super) drive: &'a Drive,
}

impl Surroundings<'_> {
    /// A convex step.
    pub(super) fn step(&mut self, state: &mut State, h: f64) -> Result<StepReport, NotFinite> {
        step(self.model, state, self.ws, self.drive, h)
    }
}

/// A method with the memory it needs.
#[derive(Clone, Debug)]
pub(super) struct Integrator {
    method: IntegrationMethod,
    start: State,
    /// Velocities at the end of the first stage.
    middle: Vec<f64>,
    /// Velocity of the hand there (m/s).
    middle_hand: DVec3,
}

/// A step that was taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct AcceptedStep {
    pub(super) report: StepReport,
    /// Estimated error; see [`Integrator`].
    pub(super) error: f64,
}

impl Integrator {
    pub(super) fn new(method: IntegrationMethod, state: &State) -> Self {
        Self { method, start: state.clone(), middle: state.velocity.clone(), middle_hand: DVec3::ZERO }
    }

    /// Order of convergence where motion is smooth.
    pub(super) fn order(&self) -> i32 {
        self.method.order()
    }

    /// Convex minimisations in a step.
    pub(super) fn solves(&self) -> u64 {
        match self.method {
            IntegrationMethod::Euler => 1,
            IntegrationMethod::Sdirk2 => 2,
        }
    }

    /// Advances the state by one step of `h` (s).
    pub(super) fn advance(
        &mut self,
        within: &mut Surroundings<'_>,
        state: &mut State,
        h: f64,
    ) -> Result<AcceptedStep, NotFinite> {
        self.start.copy_from(state);
        match self.method {
            IntegrationMethod::Euler => {
                let report = within.step(state, h)?;
                // The step less the trapezoidal rule: h (v1 - v0) / 2.
                let weights = [-0.5 * h, 0.0, 0.5 * h];
                Ok(AcceptedStep { report, error: self.error(state, within.model, weights) })
            }
            IntegrationMethod::Sdirk2 => {
                let first = within.step(state, GAMMA * h)?;
                self.middle.copy_from_slice(&state.velocity);
                self.middle_hand = state.hand[1];
                state.go_on_from(&self.start, 1.0 / GAMMA - 2.0, within.model);
                let second = within.step(state, GAMMA * h)?;
                let b1 = 1.0 / (6.0 * GAMMA * (1.0 - GAMMA));
                let b2 = 0.5 - b1 * GAMMA;
                let weights = [1.0 - b1 - b2, b1 - (1.0 - GAMMA), b2 - GAMMA].map(|b| b * h);
                Ok(AcceptedStep { report: first.followed_by(&second), error: self.error(state, within.model, weights) })
            }
        }
    }

    /// Size of the sum of velocities at start, after the first stage and now, with weights (s): the largest change of
    /// a joint angle, of the turn of a tip out of its plane or of the object's orientation (rad), of a fingertip or of the
    /// object's position, and of the place of a hand that moves, as shares of a finger's length.
    fn error(&self, state: &State, model: &PhysicsModel, weights: [f64; 3]) -> f64 {
        let n = model.chain.joints;
        let length: f64 = model.chain.lengths.iter().sum();
        let at = |k: usize| {
            weights[0] * self.start.velocity[k] + weights[1] * self.middle[k] + weights[2] * state.velocity[k]
        };
        let mut largest = 0.0f64;
        for finger in 0..2 {
            let (mut tip, mut beyond) = (0.0, length);
            for i in 0..n {
                beyond -= model.chain.lengths[i];
                let angle = at(finger * n + i);
                largest = largest.max(angle.abs());
                tip += angle * beyond;
            }
            largest = largest.max(tip.abs() / length);
        }
        if model.free_body().is_some() {
            let three = |k: usize| DVec3::new(at(k), at(k + 1), at(k + 2)).length();
            largest = largest.max(three(2 * n) / length).max(three(2 * n + 3));
        }
        if let Some(sideways) = &model.sideways {
            for k in 0..SWAYS {
                largest = largest.max(at(model.first_sway() + k).abs() * sideways.turns[k % 2]);
            }
        }
        if model.hand_motion.is_some() {
            let velocities = [self.start.hand[1], self.middle_hand, state.hand[1]];
            let way: DVec3 = velocities.iter().zip(weights).map(|(velocity, weight)| *velocity * weight).sum();
            largest = largest.max(way.length() / length);
        }
        if largest.is_finite() { largest } else { f64::INFINITY }
    }
}
