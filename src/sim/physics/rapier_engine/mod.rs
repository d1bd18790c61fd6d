//! The second engine: the same scene in rapier3d, for comparison. It shares no solver, no contact law and no collision
//! detection with Palpate's own step, and writes the same frames on the same clock.
//!
//! Fingers are multibody chains of rigid segments with springs from `set_spring` (springs made of motors do not
//! converge), joint damping from the scene, and the actuation torque as the rest angle of the springs. Numbers are
//! single precision, in units of 50 mm. Of each tick rapier makes four small steps of four sweeps.
//!
//! # What differs, and why
//!
//! | | Palpate | rapier | seen in free grasps at standard accuracy |
//! |---|---|---|---|
//! | free bend | M / k | M / k to 1e-5 | nothing |
//! | skin | compresses by millimetres, stiffening | rigid; overlap is pushed out | hold force 3 to 7 % higher, joints 0.05 to 0.15 degrees RMS apart |
//! | friction | shear springs with a slip limit | sticks or slides | fixed objects: hold force 12 to 27 % lower, joints 0.2 to 0.3 degrees apart, since what touches first cannot yield along the skin |
//! | tip | round contact springs | an edge with a chamfer | flat and small things are touched up to 50 ms later; lip balm, syringe and push button, thinner than 20 mm, end in another grasp or none |
//! | contacts | some tens of taxels | one to four points on a segment | taxels: see `loads` |
//! | cost | 10 to 20 ms | 160 to 250 ms | 4 s of a grasp |
//!
//! Not in it: error control (a tolerance gives standard steps), the order of accuracy of Palpate's two stages, effects
//! that are plug-ins of Palpate's step, and contact between the fingers.
//!
//! # Soft bodies
//!
//! rapier 0.36 has tetrahedral soft bodies (feature `fem`). Measured in November 2026, for a clamped rubber beam of
//! 100 x 20 x 20 mm with the finger's E I = 4.2e-3 N m² and a force across its tip, against Euler-Bernoulli and the
//! elastica; deflection and its error at F L² / E I = 0.2, in units of 50 mm:
//!
//! | particles | error | CPU per step of 1/300 s | |
//! |---|---|---|---|
//! | 11 x 3 x 3 | -34 % | 0.8 ms | |
//! | 21 x 3 x 3 | -21 % | 1.8 ms | -18 % at load 1, -6 % at load 4; the same within 1 % for steps of 1/60 to 1/4800 s |
//! | 21 x 5 x 5 | -10.4 % | 7 ms | -14 % at Poisson's ratio 0.45, -19 % at 0.49, which is rubber's |
//! | 41 x 5 x 5 | -6.1 % | 16 ms | |
//!
//! In metres the same beams from 21 x 3 x 3 on fly away at the speed limit, finite and without an error; solved by
//! constraint rows instead, they come out 20 to 240 % too soft and keep swinging. Linear tetrahedra lock in bending and
//! near incompressibility, so that a soft finger at 1 % would take some 10⁵ particles: they are no reference for a
//! finger or for a soft object here, and Palpate does not use them.

mod loads;
mod world;

use super::chain::{BothSegments, ChainModel, turning};
use super::effects::plan;
use super::engine::{Engine, SimulationError};
use super::environment::Environment;
use super::hessian::Lanes;
use super::placement::Placement;
use super::simulation::Refinement;
use super::step::NotFinite;
use crate::frame::{Frame, Plan, Quality};
use crate::gripper::{Actuation, FingerPlane, Phase, SegmentPose, Side, Sway};
use crate::objects::ObjectModel;
use crate::scene::{Accuracy, Clock, Effect, Scene, SupportKind};
use glam::{DVec2, DVec3};
use loads::Skin;
use palpate_geometry::{DistanceField, Pose};
use world::{Hand, Touch};

/// Effects that this engine always or never has.
const SETTLED: [(Effect, bool, &str); 7] = [
    (Effect::FingerInertia, true, "rapier's chains always have inertia"),
    (Effect::FingerContact, false, "rapier's fingers do not meet each other here"),
    (Effect::PneumaticLag, false, "rapier follows the line pressure without lag"),
    (Effect::Creep, false, "rapier's springs do not creep"),
    (Effect::Shaking, false, "rapier's hand stays where it is"),
    (Effect::SoftObject, false, "rapier's objects are rigid"),
    (Effect::OutOfPlane, false, "rapier's fingers stay in their planes"),
];

/// The plan as rapier carries it out.
fn simulated(mut plan: Plan) -> Plan {
    for effect in &mut plan.effects {
        if let Some((_, on, why)) = SETTLED.iter().find(|(settled, _, _)| settled.name() == effect.name)
            && effect.on != *on
        {
            effect.on = *on;
            effect.reason = format!("{why}; {}", effect.reason);
        }
    }
    plan
}

/// A gripper and an object simulated by rapier3d.
#[derive(Clone, Debug)]
pub struct RapierSimulation {
    hand: Hand,
    plan: Plan,
    skin: Skin,
    chain: ChainModel,
    planes: [FingerPlane; 2],
    environment: Environment,
    field: Option<DistanceField>,
    world_from_gripper: Pose,
    /// Gravity in the gripper frame (m/s²).
    gravity: DVec3,
    clock: Clock,
    actuation: Actuation,
    tick: u64,
    line_bar: f64,
    phase: Phase,
    /// Force on the object in the gripper frame (N).
    pull: DVec3,
}

impl RapierSimulation {
    /// Sets up a scene at rest; placement comes with what had to be moved to make room.
    pub fn new(scene: &Scene, object: Option<&ObjectModel>) -> (Self, Placement) {
        Self::refined(scene, object, Refinement::None)
    }

    /// The same, or a companion in half the steps. rapier controls no error: under a tolerance it takes standard steps.
    pub fn refined(scene: &Scene, object: Option<&ObjectModel>, refinement: Refinement) -> (Self, Placement) {
        let placement = Placement::new(scene, object);
        let accuracy = match scene.solver.accuracy.tolerance() {
            Some(_) => Accuracy::Standard,
            None => scene.solver.accuracy,
        };
        let parts = if refinement == Refinement::Refined { 2 } else { 1 };
        let clock = scene.timing.clock(accuracy).refined(parts);
        let gripper = &scene.gripper;
        let plan = simulated(plan(scene, object, &placement));
        let is_on = |effect: Effect| plan.is_on(effect.name());
        let weight = if is_on(Effect::FingerGravity) { scene.world.gravity } else { 0.0 };
        let down = DVec3::new(0.0, 0.0, -weight);
        let mut support = scene.support.clone();
        if !is_on(Effect::Support) {
            support.kind = SupportKind::None;
        }
        let simulation = Self {
            hand: Hand::new(scene, object, &placement, &plan, clock.step()),
            plan,
            skin: Skin::new(&gripper.finger, gripper.pad.law, gripper.taxels()),
            chain: ChainModel::new(&gripper.finger, &gripper.pad),
            planes: Side::BOTH.map(|side| gripper.plane(side)),
            environment: Environment::new(&support, &placement.world_from_gripper),
            field: object.map(|object| object.field.clone()),
            world_from_gripper: placement.world_from_gripper,
            gravity: placement.world_from_gripper.inverse().direction(down),
            clock,
            actuation: gripper.actuation.clone(),
            tick: 0,
            line_bar: 0.0,
            phase: Phase::Close,
            pull: DVec3::ZERO,
        };
        (simulation, placement)
    }

    /// Joint angles, left finger then right, from palm to tip (rad).
    fn angles(&self) -> Vec<f64> {
        self.hand.angles().collect()
    }

    /// The segments of a finger bent by its share of all joint angles.
    fn segments(&self, side: Side, q: &[f64]) -> Vec<SegmentPose> {
        let n = self.chain.joints;
        let mut segments = vec![SegmentPose::default(); n + 1];
        self.chain.bend(&q[side.index() * n..(side.index() + 1) * n], &mut segments);
        segments
    }

    /// Distance from a place in the gripper frame to the object or its support (m).
    fn gap(&self) -> impl Fn(DVec3) -> f64 + '_ {
        let object_from_gripper = self.hand.gripper_from_object().map(|pose| pose.inverse());
        move |p| {
            let to_object = match (&self.field, &object_from_gripper) {
                (Some(field), Some(object_from_gripper)) => field.distance(object_from_gripper.point(p)),
                _ => f64::INFINITY,
            };
            to_object.min(self.environment.distance(p))
        }
    }

    /// Forces on the segments of a finger, segment by segment.
    fn touches(&self, side: Side) -> Vec<Vec<Touch>> {
        let links = self.hand.links_per_finger();
        let mut by_segment = vec![Vec::new(); links];
        for touch in self.hand.touches() {
            if touch.link / links == side.index() {
                by_segment[touch.link % links].push(touch);
            }
        }
        by_segment
    }

    /// Largest joint torque not balanced by springs, gravity and contacts, as a share of the actuation torque.
    fn static_residual(&self) -> f64 {
        let torque = self.actuation.torque(self.line_bar);
        if torque == 0.0 {
            return 0.0;
        }
        let (n, q) = (self.chain.joints, self.angles());
        let mut largest = 0.0f64;
        for side in Side::BOTH {
            let plane = &self.planes[side.index()];
            let in_plane = |v: DVec3| DVec2::new(plane.sign * v.x, -v.z);
            let segments = self.segments(side, &q);
            let both: Vec<BothSegments> = segments.iter().map(|segment| BothSegments::pair(segment, segment)).collect();
            let (mut scratch, mut bias) = (vec![[Lanes::ZERO; 2]; n + 1], vec![0.0; n]);
            let gravity = in_plane(self.gravity).to_array().map(Lanes::splat);
            let put = |i: usize, lanes: Lanes| bias[i] = lanes.to_array()[0];
            self.chain.bias(&both, (|_| Lanes::ZERO, 0.0), gravity, &mut scratch, put);
            let touches = self.touches(side);
            for (i, bias) in bias.iter().enumerate() {
                let angle = q[side.index() * n + i];
                let joint = segments[i + 1].start;
                let contacts: f64 = touches[i + 1..]
                    .iter()
                    .flatten()
                    .map(|touch| {
                        let place = in_plane(touch.point) + DVec2::new(plane.half_gap, 0.0);
                        turning(place - joint, in_plane(touch.force))
                    })
                    .sum();
                if angle.abs() < self.chain.angle_limit {
                    largest = largest.max((torque - self.chain.stiffness * angle - bias + contacts).abs());
                }
            }
        }
        largest / torque.abs()
    }
}

impl Engine for RapierSimulation {
    fn clock(&self) -> Clock {
        self.clock
    }

    fn plan(&self) -> &Plan {
        &self.plan
    }

    fn tick(&self) -> u64 {
        self.tick
    }

    fn command(&mut self, bar: f64, phase: Phase) {
        (self.line_bar, self.phase) = (bar, phase);
        for side in Side::BOTH {
            self.hand.set_torque(side, self.actuation.torque(bar));
        }
    }

    fn pull_object(&mut self, force: DVec3) {
        self.pull = self.world_from_gripper.inverse().direction(force);
    }

    fn move_object(&mut self, shift: DVec3, turn: DVec3) {
        let gripper_from_world = self.world_from_gripper.inverse();
        self.hand.move_object(gripper_from_world.direction(shift), gripper_from_world.direction(turn));
    }

    fn advance_by(&mut self, ticks: u64) -> Result<(), SimulationError> {
        for _ in 0..ticks {
            self.hand.step(self.pull);
            if let Some(body) = self.hand.not_finite() {
                let (tick, seconds) = (self.tick, self.clock.seconds(self.tick));
                return Err(SimulationError { tick, seconds, cause: NotFinite { body } });
            }
            self.tick += 1;
        }
        Ok(())
    }

    fn frame(&self) -> Frame {
        let q = self.angles();
        let gap = self.gap();
        let mut taxels = Vec::new();
        for side in Side::BOTH {
            let (plane, segments) = (&self.planes[side.index()], self.segments(side, &q));
            taxels.extend(self.skin.loads(plane, &segments, &self.touches(side), &gap, side));
        }
        Frame {
            sample: (self.tick / u64::from(self.clock.ticks_per_sample)).saturating_sub(1) as u32,
            t: self.clock.seconds(self.tick),
            line_bar: self.line_bar,
            phase: self.phase,
            q,
            sways: [Sway::NONE; 2],
            hand: DVec3::ZERO,
            world_from_object: self.hand.gripper_from_object().map(|pose| self.world_from_gripper * pose),
            taxels,
        }
    }

    fn starting_overlap(&mut self) -> f64 {
        let (q, gap) = (self.angles(), self.gap());
        let depth = |side: Side| self.skin.deepest(&self.planes[side.index()], &self.segments(side, &q), &gap);
        Side::BOTH.map(depth).into_iter().fold(0.0, f64::max)
    }

    /// It counts none.
    fn solves(&self) -> u64 {
        0
    }

    /// rapier sweeps a fixed number of times and reports no residual: every step counts as converged, and the static
    /// residual tells how far it was not.
    fn quality(&self) -> Quality {
        let (steps, least_step_s) = (self.tick, self.clock.step());
        Quality { steps, least_step_s, static_residual: self.static_residual(), ..Quality::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;

    fn ball() -> ObjectModel {
        ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6)
    }

    /// Runs the programme up to a time (s), a frame every tenth of a second.
    fn run_to(simulation: &mut RapierSimulation, scene: &Scene, seconds: f64) -> Vec<Frame> {
        let per_actuation = u64::from(simulation.clock.ticks_per_actuation);
        let mut frames = Vec::new();
        while simulation.clock.seconds(simulation.tick) < seconds {
            if simulation.tick.is_multiple_of(per_actuation) {
                let (bar, phase) = scene.programme.command((simulation.tick / per_actuation) as u32);
                simulation.command(bar, phase);
                frames.push(simulation.frame());
            }
            simulation.advance_by(1).expect("finite");
        }
        frames.push(simulation.frame());
        frames
    }

    #[test]
    fn a_free_finger_bends_by_moment_over_stiffness() {
        for joints in [5, 10] {
            let mut scene = Scene::default();
            scene.world.gravity = 0.0;
            scene.support.kind = SupportKind::None;
            scene.gripper.mount.opening = 0.3;
            scene.gripper.finger.joints = joints;
            let (mut simulation, _) = RapierSimulation::new(&scene, None);
            scene.programme.close_bar_per_tick = 1.0;
            run_to(&mut simulation, &scene, 1.0);
            let want = 0.06 / scene.gripper.finger.joint_stiffness();
            for q in simulation.angles() {
                // Single precision; 1e-5 of 8 degrees are 0.0001 degrees.
                assert!((q / want - 1.0).abs() < 1e-5, "N = {joints}: {q} instead of {want}");
            }
            assert!(simulation.static_residual() < 1e-5);
        }
    }

    #[test]
    fn fingers_carry_the_ball_that_they_have_lifted() {
        let (scene, ball) = (Scene::default(), ball());
        let (mut simulation, placement) = RapierSimulation::new(&scene, Some(&ball));
        let frames = run_to(&mut simulation, &scene, 2.9);
        let start = placement.world_from_object.expect("a ball").position.z;
        let risen = frames[29].world_from_object.expect("a ball").position.z - start;
        assert!(risen > 1e-3, "the ball rose by {risen} m");
        let on_fingers: DVec3 = simulation.hand.touches().iter().map(|touch| touch.force).sum();
        let weight = ball.mass.mass * scene.world.gravity;
        assert!((-on_fingers.z / weight - 1.0).abs() < 0.01, "{on_fingers} N carry {weight} N");
        assert!(on_fingers.truncate().length() < 0.02 * weight, "{on_fingers}");
        // Taxels carry the same force as segments.
        let frame = simulation.frame();
        let squeeze: f64 = Side::BOTH.iter().map(|side| frame.normal_force(*side, 160)).sum();
        assert!(squeeze > 5.0 * weight && squeeze < 1.5, "{squeeze} N");
        assert!(simulation.static_residual() < 1e-2, "{}", simulation.static_residual());
    }

    #[test]
    fn the_same_scene_gives_the_same_frames_and_a_copy_continues_alike() {
        let (scene, ball) = (Scene::default(), ball());
        let [mut a, mut b] = [(); 2].map(|()| RapierSimulation::new(&scene, Some(&ball)).0);
        assert_eq!(run_to(&mut a, &scene, 0.9), run_to(&mut b, &scene, 0.9));
        let copy = a.clone();
        assert_eq!(a.frame(), copy.frame());
    }

    #[test]
    fn a_body_that_is_not_finite_is_named() {
        let (mut simulation, _) = RapierSimulation::new(&Scene::default(), Some(&ball()));
        simulation.pull_object(DVec3::splat(1e300));
        let error = simulation.advance_by(1).expect_err("infinite");
        assert!(error.to_string().contains("the object"), "{error}");
    }

    #[test]
    fn a_start_inside_the_object_is_measured() {
        let mut scene = Scene::default();
        scene.gripper.mount.offset = [0.032, 0.0, 0.0];
        let (mut simulation, _) = RapierSimulation::new(&scene, Some(&ball()));
        let depth = simulation.starting_overlap();
        // The skin over the nearest columns, 2.5 mm off the middle, lies 0.5 mm farther from the ball.
        assert!((depth - 0.0095).abs() < 1e-4, "{depth} m");
    }
}
