//! A scene stepped by hand: steps of any length, any torque, any velocity to begin with. Closed-form tests and hard
//! cases are made of it; grasps run on [`super::Simulation`].

use super::balance::static_residual;
use super::chain::BothSegments;
use super::contact::{Acting, Against};
use super::explicit::explicit_step;
use super::hessian::{Hessian, Lanes};
use super::integrator::Surroundings;
use super::model::PhysicsModel;
use super::placement::Placement;
use super::state::State;
use super::step::{Drive, NotFinite, StepReport, step};
use super::stepper::Stepper;
use super::workspace::Workspace;
use crate::gripper::SegmentPose;
use crate::objects::ObjectModel;
use crate::scene::{Accuracy, Scene, Solver};
use glam::DVec3;

/// Method of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stepping {
    /// The convex step that grasps are made of.
    #[default]
    Convex,
    /// Semi-implicit Euler over the same forces, to compare with: springs and contacts at the start of the step.
    Explicit,
}

/// A scene at some moment, and what its steps came to.
#[derive(Clone, Debug)]
pub struct SteppedScene {
    pub(super) model: PhysicsModel,
    /// Joints, velocities, object; velocities may be set.
    pub state: State,
    pub(super) ws: Workspace,
    /// Length of a step (s).
    pub h: f64,
    /// Method of integration.
    pub stepping: Stepping,
    /// Steps taken.
    pub steps: u64,
    /// Of these, how many missed the solver's tolerance.
    pub missed: u64,
    drive: Drive,
    /// Divides each step under a tolerance.
    stepper: Option<Stepper>,
}

/// A loaded place of the skin in the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinForce {
    /// Between a finger and the object, rather than between one of them and the support.
    pub on_object: bool,
    /// Normal force (N).
    pub normal: f64,
    /// Size of the friction force (N).
    pub friction: f64,
    /// Coefficient of friction.
    pub mu: f64,
}

impl SteppedScene {
    /// A scene at rest that is going to be stepped by `h` (s).
    pub fn new(scene: &Scene, object: Option<&ObjectModel>, h: f64) -> Self {
        let placement = Placement::new(scene, object);
        Self::of(PhysicsModel::new(scene, object, &placement), &placement, h)
    }

    /// The same of a model that has been made before.
    pub(super) fn of(model: PhysicsModel, placement: &Placement, h: f64) -> Self {
        let state = State::new(&model, placement);
        let ws = Workspace::new(&model);
        let drive = Drive::default();
        Self { model, state, ws, h, stepping: Stepping::Convex, steps: 0, missed: 0, drive, stepper: None }
    }

    /// The same at an accuracy that a user may set: `h` (s) is its tick, which a tolerance divides.
    pub fn at(scene: &Scene, object: Option<&ObjectModel>, h: f64, accuracy: Accuracy) -> Self {
        let mut own = Self::new(scene, object, h);
        let solver = Solver { accuracy, ..scene.solver.clone() };
        let divided = |tolerance| Stepper::new(&own.model, &own.state, solver.method(), Some(tolerance), h);
        own.stepper = solver.step_tolerance().map(divided);
        own
    }

    /// Takes one step.
    pub fn step(&mut self, drive: &Drive) -> Result<StepReport, NotFinite> {
        self.drive = *drive;
        if let Some(stepper) = &mut self.stepper {
            let mut within = Surroundings { model: &self.model, ws: &mut self.ws, drive };
            let report = stepper.cover(&mut within, &mut self.state, self.h)?;
            self.steps += 1;
            self.missed = stepper.totals.unconverged;
            return Ok(report);
        }
        let take = match self.stepping {
            Stepping::Convex => step,
            Stepping::Explicit => explicit_step,
        };
        let report = take(&self.model, &mut self.state, &mut self.ws, drive, self.h)?;
        self.steps += 1;
        self.missed += u64::from(!report.converged);
        Ok(report)
    }

    /// Covers a span of time (s), rounded to whole steps, under a drive as a function of the time passed (s).
    pub fn cover(&mut self, span: f64, drive: impl Fn(f64) -> Drive) -> Result<(), NotFinite> {
        for k in 0..(span / self.h).round().max(1.0) as u64 {
            self.step(&drive(k as f64 * self.h))?;
        }
        Ok(())
    }

    /// The constants it runs on.
    pub fn model(&self) -> &PhysicsModel {
        &self.model
    }

    /// Tip of the left finger relative to its root, inward and along (m).
    pub fn tip(&self) -> (f64, f64) {
        let n = self.model.chain.joints;
        let mut segments = vec![SegmentPose::default(); n + 1];
        let tip = self.model.chain.bend(&self.state.q[..n], &mut segments);
        (tip.x, tip.y)
    }

    /// Outward deflection of the left fingertip (m); zero where it is bent inward.
    pub fn tip_sway(&self) -> f64 {
        (-self.tip().0).max(0.0)
    }

    /// Length of a finger (m).
    #[cfg(test)]
    pub(super) fn finger_length(&self) -> f64 {
        self.model.chain.lengths.iter().sum()
    }

    /// Stiffness of each joint (N m/rad).
    pub fn joint_stiffness(&self) -> f64 {
        self.model.chain.stiffness
    }

    /// Angle at which a joint's limit begins, either way (rad).
    pub fn angle_limit(&self) -> f64 {
        self.model.chain.angle_limit
    }

    /// Distance of each finger's root from the middle of the gripper (m).
    pub fn half_gap(&self) -> f64 {
        self.model.planes[0].half_gap
    }

    /// The object's centre of mass in the gripper frame (m).
    pub fn object_centre(&self) -> DVec3 {
        self.state.body.position
    }

    /// Linear and angular velocity of a free object in the gripper frame (m/s, rad/s); zero otherwise.
    pub fn object_velocity(&self) -> (DVec3, DVec3) {
        self.state.body_velocity(&self.model)
    }

    /// Gives a free object a linear and an angular velocity (m/s, rad/s).
    pub fn throw_object(&mut self, linear: DVec3, angular: DVec3) {
        let own = self.model.joint_count()..self.model.first_sway();
        if let Some(own) = self.state.velocity.get_mut(own).filter(|own| own.len() == 6) {
            own[..3].copy_from_slice(&linear.to_array());
            own[3..].copy_from_slice(&angular.to_array());
        }
    }

    /// Linear and angular momentum of a free object about its centre of mass (kg m/s, kg m²/s).
    pub fn object_momentum(&self) -> (DVec3, DVec3) {
        let mass = self.model.free_body().map_or(0.0, |body| body.mass);
        (self.object_velocity().0 * mass, self.state.angular_momentum(&self.model))
    }

    /// Kinetic, elastic and potential energy (J), the latter relative to the gripper's frame.
    pub fn energy(&self) -> f64 {
        super::energy::mechanical_energy(&self.model, &self.state, &mut Workspace::new(&self.model)).total
    }

    /// Deepest compression of any contact spring of a finger in the last step (m).
    pub fn deepest(&self) -> f64 {
        let on_finger = self.ws.contacts.iter().filter(|c| c.acting != Acting::Object);
        on_finger.map(|c| c.compression).fold(0.0, f64::max)
    }

    /// Forces at all loaded places in the last step.
    pub fn skin_forces(&self) -> impl Iterator<Item = SkinForce> {
        self.ws.contacts.iter().filter_map(|contact| {
            let (normal, tangential) = contact.force(self.ws.step);
            let on_object = contact.acting != Acting::Object && contact.against == Against::Object;
            let force = SkinForce { on_object, normal, friction: tangential.length(), mu: contact.mu };
            (normal > 0.0).then_some(force)
        })
    }

    /// Largest joint torque that is not accounted for, as a share of the actuation torque; see
    /// [`crate::frame::Quality::static_residual`].
    pub fn static_residual(&self) -> f64 {
        static_residual(&self.model, &self.state, &self.ws, &self.drive)
    }

    /// Largest natural frequency of the straight chain, sqrt of the largest eigenvalue of M⁻¹ K (rad/s): by power
    /// iteration, since K is k times the unit matrix.
    pub fn fastest_mode(&self) -> f64 {
        let n = self.model.chain.joints;
        let mut both = vec![BothSegments::default(); n + 1];
        self.model.chain.bend_both(&vec![0.0; 2 * n], &mut both);
        let mut inertia = vec![Lanes::ZERO; n * n];
        self.model.chain.inertia(&both, &mut inertia);
        let mut factor = Hessian::new(n, 0);
        for (i, row) in inertia.chunks_exact(n).enumerate() {
            factor.row_mut(i).copy_from_slice(&row[..=i]);
        }
        factor.factorise();
        // Both fingers alike.
        let mut x: Vec<f64> = (0..2 * n).map(|k| if (k % n).is_multiple_of(2) { 1.0 } else { -0.9 }).collect();
        let mut largest = 0.0;
        for _ in 0..300 {
            factor.solve(&mut x);
            largest = x[..n].iter().map(|x| x * x).sum::<f64>().sqrt();
            x.iter_mut().for_each(|x| *x /= largest);
        }
        (self.model.chain.stiffness * largest).sqrt()
    }
}
