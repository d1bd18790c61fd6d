//! A simulated grasp in time: steps on a clock of whole ticks, pressure in, frames out.

use super::balance::static_residual;
use super::contact::{Acting, Against, Contact};
use super::detect::detect;
use super::effects::FingerContact;
use super::engine::{Engine, SimulationError};
use super::finger_pair::OtherFinger;
use super::integrator::Surroundings;
use super::model::PhysicsModel;
use super::placement::Placement;
use super::solve::{Unbalanced, segment_velocities};
use super::spatial::Spatial;
use super::state::State;
use super::step::{self, Drive, StepReport, segment_axes_of};
use super::stepper::Stepper;
use super::workspace::Workspace;
use crate::frame::{Frame, Imbalance, Plan, Quality, TaxelLoad};
use crate::gripper::{Actuation, Phase};
use crate::objects::ObjectModel;
use crate::scene::{Clock, Scene};
use glam::{DQuat, DVec3};
use palpate_geometry::Pose;

/// A gripper and an object being simulated. One tick of the clock is one solver step or, under a tolerance, as many as
/// it takes.
#[derive(Clone, Debug)]
pub struct Simulation {
    model: PhysicsModel,
    state: State,
    workspace: Workspace,
    clock: Clock,
    actuation: Actuation,
    tick: u64,
    line_bar: f64,
    phase: Phase,
    /// Forces from outside; the torque in it is not used.
    pulls: Drive,
    stepper: Stepper,
    /// The first step in which fingers that should not meet came near each other (its tick).
    met_at: Option<u64>,
    imbalance: Option<Imbalance>,
}

/// Refinement of a simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refinement {
    /// Steps as in the scene.
    None,
    /// More finely, to estimate an error from; see [`crate::scene::Solver::refined`].
    Refined,
}

impl Simulation {
    /// Sets up a scene at rest; placement comes with what had to be moved to make room.
    pub fn new(scene: &Scene, object: Option<&ObjectModel>) -> (Self, Placement) {
        Self::refined(scene, object, Refinement::None)
    }

    /// Sets up a scene with a refinement.
    pub fn refined(scene: &Scene, object: Option<&ObjectModel>, refinement: Refinement) -> (Self, Placement) {
        let placement = Placement::new(scene, object);
        let (parts, solver) = match refinement {
            Refinement::None => (1, scene.solver.clone()),
            Refinement::Refined => (2, scene.solver.refined()),
        };
        let clock = scene.timing.clock(solver.accuracy).refined(parts);
        let model = PhysicsModel::new(scene, object, &placement);
        let state = State::new(&model, &placement);
        // No step can be longer than from sample to sample; a finer simulation takes more.
        let longest = f64::from(clock.ticks_per_sample) * clock.step() / f64::from(parts);
        let stepper = Stepper::new(&model, &state, solver.method(), solver.step_tolerance(), longest);
        let simulation = Self {
            state,
            workspace: Workspace::new(&model),
            model,
            clock,
            actuation: scene.gripper.actuation.clone(),
            tick: 0,
            line_bar: 0.0,
            phase: Phase::Close,
            pulls: Drive::default(),
            stepper,
            met_at: None,
            imbalance: None,
        };
        (simulation, placement)
    }

    /// The clock that ticks count.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Ticks passed.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// The constants it runs on.
    pub fn model(&self) -> &PhysicsModel {
        &self.model
    }

    /// Joints, velocities, object.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// For tests that start from a pose of their own.
    #[cfg(test)]
    pub(super) fn state_mut(&mut self) -> &mut State {
        &mut self.state
    }

    /// Sets the line pressure (bar) from now on.
    pub fn command(&mut self, bar: f64, phase: Phase) {
        self.line_bar = bar;
        self.phase = phase;
    }

    /// Pulls at the object's centre of mass (N, world axes) from now on, as a user does with the mouse.
    pub fn pull_object(&mut self, force: DVec3) {
        self.pulls.object_force = self.model.world_from_gripper.inverse().direction(force);
    }

    /// Moves the object by a shift (m) and a turn about its centre of mass (axis times angle, rad), world axes.
    pub fn move_object(&mut self, shift: DVec3, turn: DVec3) {
        let gripper_from_world = self.model.world_from_gripper.inverse();
        let body = &mut self.state.body;
        body.position += gripper_from_world.direction(shift);
        let turn = DQuat::from_scaled_axis(gripper_from_world.direction(turn));
        body.rotation = (turn * body.rotation).normalize();
    }

    /// Advances by one tick; reports its last step.
    pub fn advance(&mut self) -> Result<StepReport, SimulationError> {
        self.advance_by(1)
    }

    /// Advances by some ticks, within which nothing is sampled or commanded; reports the last step.
    pub fn advance_by(&mut self, ticks: u64) -> Result<StepReport, SimulationError> {
        let drive = Drive { torque: self.actuation.torque(self.line_bar), line_bar: self.line_bar, ..self.pulls };
        let at_once = if self.stepper.is_controlled() { ticks } else { 1 };
        let mut report = StepReport::default();
        for _ in 0..ticks / at_once.max(1) {
            let mut within = Surroundings { model: &self.model, ws: &mut self.workspace, drive: &drive };
            let span = at_once as f64 * self.clock.step();
            let taken = self.stepper.cover(&mut within, &mut self.state, span);
            report = taken.map_err(|cause| SimulationError {
                tick: self.tick,
                seconds: self.clock.seconds(self.tick),
                cause,
            })?;
            self.note_imbalance();
            if self.workspace.fingers_meet && self.met_at.is_none() {
                self.met_at = Some(self.tick);
            }
            self.tick += at_once;
        }
        Ok(report)
    }

    /// Remembers the first step that missed its tolerance, and the place of the worst.
    fn note_imbalance(&mut self) {
        let Some(Unbalanced { unknown, excess }) = self.stepper.totals.unbalanced.take() else { return };
        let known = self.imbalance.take();
        self.imbalance = match known {
            Some(known) if known.worst_excess >= excess => Some(known),
            known => {
                let (first_tick, first_s) =
                    known.map_or((self.tick, self.clock.seconds(self.tick)), |known| (known.first_tick, known.first_s));
                let worst_at = State::place_of(&self.model, unknown as usize);
                Some(Imbalance { first_tick, first_s, worst_at, worst_excess: excess })
            }
        };
    }

    /// Deepest compression of a contact spring before the first step (m).
    pub fn starting_overlap(&mut self) -> f64 {
        step::lay_out(&self.model, &self.state, &mut self.workspace);
        segment_velocities(&self.model, &self.state.velocity, &mut self.workspace);
        detect(&self.model, &self.state, &mut self.workspace);
        let on_finger = |c: &&Contact| matches!(c.acting, Acting::Segment(_));
        let contacts = self.workspace.contacts.iter().filter(on_finger);
        let deepest = contacts.map(|c| c.compression).fold(0.0, f64::max);
        self.workspace.contacts.clear();
        deepest
    }

    /// Time at which finger contact left out by `auto` was turned on because the fingers came near each other (s);
    /// `None` if never.
    pub fn finger_contact_turned_on(&self) -> Option<f64> {
        let guarded = self.model.finger_contact == FingerContact::Guarded;
        self.met_at.filter(|_| guarded).map(|tick| self.clock.seconds(tick))
    }

    /// Sample of the present state.
    pub fn frame(&self) -> Frame {
        Frame {
            sample: (self.tick / u64::from(self.clock.ticks_per_sample)).saturating_sub(1) as u32,
            t: self.clock.seconds(self.tick),
            line_bar: self.line_bar,
            phase: self.phase,
            q: self.state.q.clone(),
            sways: self.state.sways,
            hand: self.model.world_from_gripper.direction(self.state.hand[0]),
            world_from_object: self.world_from_object(),
            taxels: self.taxel_loads(),
        }
    }

    /// The object's frame in the world.
    pub fn world_from_object(&self) -> Option<Pose> {
        self.state.world_from_object(&self.model)
    }

    /// Statistics of the steps so far; the static residual is that of this moment.
    pub fn quality(&self) -> Quality {
        let totals = &self.stepper.totals;
        Quality {
            finite: true,
            converged: totals.unconverged == 0,
            steps: totals.steps,
            rejected_steps: totals.rejected,
            missed_steps: totals.missed,
            least_step_s: totals.shortest.unwrap_or_default(),
            solves: totals.solves,
            unconverged_steps: totals.unconverged,
            newton_mean: totals.newton as f64 / totals.solves.max(1) as f64,
            newton_max: totals.newton_max,
            friction_residual: totals.friction_residual,
            static_residual: self.static_residual(),
            imbalance: self.imbalance.clone(),
            ..Quality::default()
        }
    }

    /// Contacts that press on a taxel in the last step: side, spring, link and the force on it (N).
    fn pressed(&self) -> impl Iterator<Item = (&Contact, usize, usize, u32, DVec3)> {
        self.workspace.contacts.iter().filter_map(|contact| {
            let Acting::Segment(link) = contact.acting else { return None };
            let (side, spring) = self.model.spring_at(contact.site);
            let (normal, tangential) = contact.force(self.workspace.step);
            (normal > 0.0).then(|| (contact, side, spring, link, contact.normal * normal + tangential))
        })
    }

    /// Forces on the loaded taxels in the last step.
    fn taxel_loads(&self) -> Vec<TaxelLoad> {
        let springs = &self.model.springs;
        let mut loads: Vec<TaxelLoad> = Vec::new();
        for (contact, side, spring, link, force) in self.pressed() {
            loads.extend(self.taxel_load(side, spring, link, force));
            if let Against::Finger(other) = contact.against {
                let met = OtherFinger::opposite(&self.model, &self.workspace, side, springs.all[spring].across);
                let taxel = met.taxel(contact.arm + self.workspace.reference);
                loads.extend(taxel.and_then(|taxel| self.taxel_load(1 - side, taxel, other, -force)));
            }
        }
        loads.sort_by_key(|load| load.taxel);
        loads.dedup_by(|next, kept| {
            let same = next.taxel == kept.taxel;
            if same {
                kept.normal += next.normal;
                kept.along += next.along;
                kept.across += next.across;
            }
            same
        });
        loads
    }

    /// Normal force of each pad on the object (N); `None` where pads touch nothing else.
    fn force_on_object(&self) -> Option<[f64; 2]> {
        let load = |(_, side, spring, link, force)| self.taxel_load(side, spring, link, force).map(|load| (side, load));
        let more = |pressed: &(&Contact, usize, usize, u32, DVec3)| pressed.0.against != Against::Object;
        if !self.workspace.fingers_meet && self.pressed().filter(more).find_map(load).is_none() {
            return None;
        }
        let mut force = [0.0; 2];
        for (side, load) in self.pressed().filter(|pressed| !more(pressed)).filter_map(load) {
            force[side] += f64::from(load.normal);
        }
        Some(force)
    }

    /// The load of a spring, where it belongs to a taxel and the force pushes into the pad: what presses from behind is
    /// not sensed.
    fn taxel_load(&self, side: usize, spring: usize, link: u32, force: DVec3) -> Option<TaxelLoad> {
        let on_pad = self.model.springs.on_pad;
        let [along, across, inward] =
            (segment_axes_of(&self.model, &self.workspace, link).transpose() * force).to_array();
        (spring < on_pad && inward < 0.0).then(|| TaxelLoad {
            taxel: (side * on_pad + spring) as u16,
            normal: -inward as f32,
            along: along as f32,
            across: across as f32,
        })
    }

    /// Total force (N) and torque about its centre of mass (N m) that fingers and support exert on the object, in
    /// the gripper frame, in the last step.
    pub fn object_wrench(&self) -> (DVec3, DVec3) {
        let mut total = Spatial::default();
        for contact in &self.workspace.contacts {
            let (normal, tangential) = contact.force(self.workspace.step);
            let on_acting = contact.normal * normal + tangential;
            let on_object = match (contact.acting, contact.against) {
                (Acting::Object, _) => on_acting,
                (Acting::Segment(_), Against::Object) => -on_acting,
                (Acting::Segment(_), Against::World | Against::Finger(_)) => continue,
            };
            total = total.plus(&Spatial { linear: on_object, angular: contact.arm.cross(on_object) });
        }
        (total.linear, total.angular)
    }

    /// Deepest compression of any pad contact spring (m) and the largest ratio of friction to mu times normal force
    /// over loaded contacts, in the last step.
    #[cfg(test)]
    pub(super) fn contact_extremes(&self) -> (f64, f64) {
        let mut extremes = (0.0f64, 0.0f64);
        for contact in &self.workspace.contacts {
            let (normal, tangential) = contact.force(self.workspace.step);
            match (contact.acting, contact.against) {
                // Both pads share it.
                (_, Against::Finger(_)) => extremes.0 = extremes.0.max(0.5 * contact.compression),
                (Acting::Segment(_), _) => extremes.0 = extremes.0.max(contact.compression),
                (Acting::Object, _) => {}
            }
            if normal > 1e-3 && contact.mu > 0.0 {
                extremes.1 = extremes.1.max(tangential.length() / (contact.mu * normal));
            }
        }
        extremes
    }

    fn static_residual(&self) -> f64 {
        let bar = if self.model.chamber.is_some() { self.state.chamber_bar } else { self.line_bar };
        let drive = Drive { torque: self.actuation.torque(bar), ..self.pulls };
        let residual = static_residual(&self.model, &self.state, &self.workspace, &drive);
        match self.tick {
            0 => 0.0,
            // After a step that failed; a number that is none could not be stored.
            _ if !residual.is_finite() => f64::MAX,
            _ => residual,
        }
    }

    /// Kinetic, elastic and potential energy (J), the latter relative to the gripper's frame.
    pub fn energy(&self) -> f64 {
        super::energy::mechanical_energy(&self.model, &self.state, &mut Workspace::new(&self.model)).total
    }
}

impl Engine for Simulation {
    fn clock(&self) -> Clock {
        self.clock()
    }

    fn plan(&self) -> &Plan {
        self.model().plan()
    }

    fn finger_contact_turned_on(&self) -> Option<f64> {
        self.finger_contact_turned_on()
    }

    fn tick(&self) -> u64 {
        self.tick()
    }

    fn command(&mut self, bar: f64, phase: Phase) {
        self.command(bar, phase);
    }

    fn pull_object(&mut self, force: DVec3) {
        self.pull_object(force);
    }

    fn move_object(&mut self, shift: DVec3, turn: DVec3) {
        self.move_object(shift, turn);
    }

    fn advance_by(&mut self, ticks: u64) -> Result<(), SimulationError> {
        self.advance_by(ticks).map(|_report| ())
    }

    fn frame(&self) -> Frame {
        self.frame()
    }

    fn force_on_object(&self) -> Option<[f64; 2]> {
        self.force_on_object()
    }

    fn starting_overlap(&mut self) -> f64 {
        self.starting_overlap()
    }

    fn solves(&self) -> u64 {
        self.stepper.totals.solves
    }

    fn quality(&self) -> Quality {
        self.quality()
    }
}
