//! A random scene and its runs: fingers from soft to stiff, objects from 0.1 g to 10 kg, closed slowly or at once.
//!
//! It runs as a trial does: on the clock of samples, under a tolerance, with a hold as long as that of a trial, so that
//! a trial's flags apply.

use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_lab::grasping::{EndState, EndWatch, OtherRun, PUSH, Push};
use palpate_sim::frame::{Frame, Quality};
use palpate_sim::gripper::{Phase, TorquePoint};
use palpate_sim::objects::ObjectModel;
use palpate_sim::run::{SimEvent, SimRun};
use palpate_sim::scene::{Auto, Scene, Solver, SupportKind, Timing};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Samples and changes of pressure per second.
const SAMPLE_HZ: u32 = 75;
/// Beginning of the hold (s): closing takes half a second at most, and a jump of the pressure ends here.
const HOLD_S: f64 = 0.7;
/// Duration of a scene (s): the hold is as long as that of a trial.
const DURATION_S: f64 = 1.7;
/// Beginning of the jump of the pressure (s), where there is one.
const JUMP_S: f64 = 0.6;
/// Exponents of the drawn tolerances: 1e-5 to 1e-2, draft and standard among them.
const TOLERANCES: [f64; 2] = [-5.0, -2.0];

/// A random scene.
#[derive(Clone, Debug)]
pub struct RandomScene {
    /// Gripper, support and materials. Line pressure is measured in shares of the torque at the end of closing.
    pub scene: Scene,
    /// Grasped object.
    pub object: ObjectModel,
    /// Tolerance of a step.
    pub tolerance: f64,
    /// Duration of closing (s); zero for a step.
    closing: f64,
    /// Factor on the torque for a while before the hold.
    jump: f64,
    /// Largest distance of the object's surface from its centre (m).
    reach: f64,
}

impl RandomScene {
    /// Draws the scene of a seed and a number.
    pub fn draw(seed: u64, number: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let mut power = |low: f64, high: f64| 10f64.powf(random.random_range(low..high));
        let timing = Timing { sample_hz: SAMPLE_HZ, actuation_hz: SAMPLE_HZ, duration_s: DURATION_S };
        let mut scene = Scene { timing, ..Scene::default() };
        let finger = &mut scene.gripper.finger;
        finger.bending_stiffness *= power(-2.0, 2.0);
        scene.gripper.pad.modulus *= power(-2.0, 3.0);
        let (mass, tolerance) = (power(-4.0, 1.0), power(TOLERANCES[0], TOLERANCES[1]));
        let (damping, closing) = (power(-4.0, -0.5), power(-2.0, -0.3));
        let [a, b, c] = [power(-2.4, -1.5), power(-2.4, -1.5), power(-2.4, -1.5)];
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        let bend = between(0.02, 0.4);
        let torque = bend * scene.gripper.finger.joint_stiffness();
        scene.gripper.actuation.curve = [0.0, 1.0].map(|bar| TorquePoint { bar, torque: bar * torque }).to_vec();
        scene.gripper.pad.dissipation = between(0.0, 10.0);
        scene.gripper.mount.offset = [between(-0.01, 0.01), between(-0.01, 0.01), between(-0.005, 0.02)];
        let tumbled = [between(-180.0, 180.0), between(-180.0, 180.0), between(-180.0, 180.0)];
        scene.support.radius = between(0.006, 0.02);
        let mu = between(0.0, 5.0);
        let mut one_in = |n: u32| random.random_range(0..n) == 0;
        let mu = if one_in(10) { 0.0 } else { mu };
        scene.gripper.pad.friction = mu;
        scene.object.friction = Auto::Value(mu);
        scene.gripper.finger.damping_time = if one_in(5) { 0.0 } else { damping };
        scene.object.fixed = one_in(4);
        // Usually on a face; otherwise it topples.
        let lying = if one_in(2) { 90.0 } else { 0.0 };
        scene.object.rotation_deg = if one_in(5) { tumbled } else { [lying, 0.0, tumbled[2]] };
        scene.support.kind = if one_in(6) { SupportKind::Table } else { SupportKind::Pedestal };
        let (closing, jump) = (if one_in(4) { 0.0 } else { closing }, if one_in(5) { 20.0 } else { 1.0 });
        scene.gripper.finger.joints = random.random_range(3..=16);
        let (shape, reach) = match random.random_range(0..4) {
            0 => (Primitive::Sphere { radius: a }, a),
            1 => (Primitive::Cuboid { half: DVec3::new(a, b, c) }, DVec3::new(a, b, c).length()),
            2 => (Primitive::Cylinder { radius: a, half_length: b }, a.hypot(b)),
            _ => (Primitive::Capsule { radius: a, half_length: b }, a + b),
        };
        let mut object = ObjectModel::from_primitive("it", shape, 400.0, mu);
        object.mass = object.mass.with_mass(mass);
        Self { scene, object, tolerance, closing, jump, reach }
    }

    /// Line pressure at a time (s), as a share of that at the end of closing.
    fn pressure(&self, t: f64) -> f64 {
        let rise = if self.closing > 0.0 { (t / self.closing).min(1.0) } else { 1.0 };
        let jump = if (JUMP_S..HOLD_S).contains(&t) { self.jump } else { 1.0 };
        rise * jump
    }

    /// Small changes of the start: along and about each axis, either way.
    pub(super) fn pushes(&self) -> [Push; 12] {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        std::array::from_fn(|k| {
            let along = axes[k % 3] * if k % 6 < 3 { PUSH } else { -PUSH };
            match k < 6 {
                true => Push { shift: along, turn: DVec3::ZERO },
                false => Push { shift: DVec3::ZERO, turn: along / self.reach },
            }
        })
    }

    /// Computes the scene to the end of its hold.
    pub(super) fn run(&self, solver: &Solver, push: Push) -> Ran {
        self.simulate(solver, push, MOST_SOLVES, false)
    }

    /// Computes it until its end is decided, or it has taken so many minimisations.
    pub(super) fn run_until_decided(&self, solver: &Solver, push: Push, most: u64) -> OtherRun {
        let Ran { end, quality } = self.simulate(solver, push, most, true);
        OtherRun { end, solves: quality.solves }
    }

    fn simulate(&self, solver: &Solver, push: Push, most_solves: u64, stops_once_decided: bool) -> Ran {
        let scene = Scene { solver: solver.clone(), ..self.scene.clone() };
        let (mut run, _) = SimRun::new(&scene, Some(&self.object));
        run.move_object(push.shift, push.turn);
        let start = run.first_look();
        let mut watch = EndWatch::new(start.clone());
        let mut frames: Vec<Frame> = vec![start];
        let mut finite = true;
        let end = loop {
            match run.next_event() {
                Ok(SimEvent::ActuationDue { tick }) => {
                    let t = f64::from(tick) / f64::from(SAMPLE_HZ);
                    let phase = if t < HOLD_S { Phase::Close } else { Phase::Hold };
                    run.command(self.pressure(t), phase);
                }
                Ok(SimEvent::Sampled(frame)) => {
                    let decided = watch.note(&frame);
                    frames.push(frame);
                    // Nothing that follows the loss of the object matters.
                    if let Some(end) = decided.filter(|end| stops_once_decided || *end == EndState::Lost) {
                        break Some(end);
                    }
                    if run.solves() > most_solves {
                        break None;
                    }
                }
                Ok(SimEvent::Finished) => break EndState::of(&frames),
                Err(_) => {
                    finite = false;
                    break None;
                }
            }
        };
        let mut quality = Quality { finite, ..run.quality() };
        if end == Some(EndState::Lost) {
            // It had no hold to come to rest in.
            quality.static_residual = 0.0;
        }
        Ran { end, quality }
    }
}

/// Minimisations after which a run is given up: a second of CPU time. Fingertips that graze a stiff edge can rattle there
/// at steps of the least length, and undamped fingers ring.
const MOST_SOLVES: u64 = 60_000;

/// Result of a run.
#[derive(Clone, Debug)]
pub(super) struct Ran {
    /// Absent where a number left the range and where the run was given up.
    pub(super) end: Option<EndState>,
    pub(super) quality: Quality,
}

impl Ran {
    /// True if both runs reach their end, and end alike.
    pub(super) fn ends_like(&self, other: &Self) -> bool {
        self.end.as_ref().zip(other.end.as_ref()).is_some_and(|(a, b)| a.is_like(b))
    }

    /// A run that is not computed because a coarser one was given up.
    pub(super) fn given_up() -> Self {
        Self { end: None, quality: Quality::default() }
    }

    /// True if the run reached its end.
    pub(super) fn has_ended(&self) -> bool {
        self.end.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sim::scene::Accuracy;

    #[test]
    fn pushes_are_six_shifts_and_six_turns() {
        let scene = RandomScene::draw(1, 0);
        let pushes = scene.pushes();
        let sum = pushes.iter().fold((DVec3::ZERO, DVec3::ZERO), |sum, p| (sum.0 + p.shift, sum.1 + p.turn));
        assert_eq!(sum, (DVec3::ZERO, DVec3::ZERO));
        for (k, push) in pushes.iter().enumerate() {
            assert_eq!(push.shift.length() + push.turn.length() * scene.reach, PUSH);
            assert!(pushes[..k].iter().all(|other| other != push));
        }
    }

    #[test]
    fn scenes_close_jump_and_hold() {
        let scenes: Vec<RandomScene> = (0..40).map(|number| RandomScene::draw(1, number)).collect();
        for scene in &scenes {
            assert!((1e-5..1e-2).contains(&scene.tolerance));
            assert_eq!((scene.pressure(HOLD_S), scene.pressure(DURATION_S)), (1.0, 1.0));
            let gripper = &scene.scene.gripper;
            let bend = gripper.actuation.torque(1.0) / gripper.finger.joint_stiffness() * gripper.finger.joints as f64;
            assert!((0.2..4.0).contains(&bend), "{bend} rad in all");
        }
        assert!(scenes.iter().any(|scene| scene.pressure(0.65) == 20.0));
        assert!(scenes.iter().any(|scene| scene.pressure(0.0) == 0.0 && scene.closing > 0.0));
        let solver = Solver { accuracy: Accuracy::Draft, ..Solver::default() };
        let [ran, again] = [(); 2].map(|()| scenes[0].run(&solver, Push::default()));
        assert!(ran.end == again.end && ran.quality == again.quality && ran.quality.steps >= 127);
        let moved = Push { shift: DVec3::new(0.003, 0.0, 0.0), turn: DVec3::ZERO };
        assert!(scenes[0].run(&solver, moved).end != ran.end);
    }
}
