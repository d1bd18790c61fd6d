//! Random scenes over wide ranges: convergence of every step, and correctness of the answers without a flag.
//!
//! Each scene closes and holds; then it is computed again with a quarter of the step. If the results differ, the first is
//! wrong, and *silently* wrong if no flag was raised. Some scenes have no right answer: their result depends on a shift of
//! a micrometre at the start, at any step; these are counted separately.

use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::{Drive, SteppedScene};
use palpate_sim::scene::{Auto, Scene, SupportKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Duration of a scene (s): closing takes half a second at most, the rest is hold.
const DURATION: f64 = 1.5;
/// Largest difference of joint angles between equal answers (rad): about 1.1 degrees, of eight at 1 bar.
const SAME_ANGLE: f64 = 0.02;
/// Largest distance of objects between equal answers (m).
const SAME_PLACE: f64 = 2e-3;
/// An object this far from its start, or this far below it, has left the hand; its position is ignored (m).
const GONE: f64 = 0.15;
const FALLEN: f64 = 0.03;
/// Refinement of the second computation.
const FINER: f64 = 4.0;
/// Perturbation of the start that must not change the result (m).
const PUSH: f64 = 1e-6;

/// A random scene.
#[derive(Clone, Debug)]
pub struct RandomScene {
    /// Gripper, support and materials.
    pub scene: Scene,
    /// Grasped object.
    pub object: ObjectModel,
    /// Step (s).
    pub h: f64,
    /// Torque at the end of closing (N m).
    torque: f64,
    /// Duration of closing (s); zero for a step.
    closing: f64,
    /// Factor on the torque for a while at the start of the hold.
    jump: f64,
}

impl RandomScene {
    /// Draws the scene of a seed and a number.
    pub fn draw(seed: u64, number: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let mut power = |low: f64, high: f64| 10f64.powf(random.random_range(low..high));
        let mut scene = Scene::default();
        let finger = &mut scene.gripper.finger;
        finger.bending_stiffness *= power(-2.0, 2.0);
        scene.gripper.pad.modulus *= power(-2.0, 3.0);
        let (mass, h) = (power(-4.0, 1.0), power(-3.3, -1.3));
        let (damping, closing) = (power(-4.0, -0.5), power(-2.0, -0.3));
        let [a, b, c] = [power(-2.4, -1.5), power(-2.4, -1.5), power(-2.4, -1.5)];
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        let bend = between(0.02, 0.4);
        let torque = bend * scene.gripper.finger.joint_stiffness();
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
        let shape = match random.random_range(0..4) {
            0 => Primitive::Sphere { radius: a },
            1 => Primitive::Cuboid { half: DVec3::new(a, b, c) },
            2 => Primitive::Cylinder { radius: a, half_length: b },
            _ => Primitive::Capsule { radius: a, half_length: b },
        };
        let mut object = ObjectModel::from_primitive("it", shape, 400.0, mu);
        object.mass = object.mass.with_mass(mass);
        Self { scene, object, h, torque, closing, jump }
    }

    /// Number of steps.
    pub fn steps(&self) -> u64 {
        (DURATION / self.h).round() as u64
    }

    /// Drive at a time (s).
    pub fn drive(&self, t: f64) -> Drive {
        let rise = if self.closing > 0.0 { (t / self.closing).min(1.0) } else { 1.0 };
        let jump = if (0.6..0.7).contains(&t) { self.jump } else { 1.0 };
        Drive { torque: self.torque * rise * jump, ..Drive::default() }
    }

    /// Computes the scene with a step (s), the object shifted by `push` (m) at the start.
    fn run(&self, h: f64, push: f64) -> Ran {
        let mut run = SteppedScene::new(&self.scene, Some(&self.object), h);
        run.shift_object(DVec3::new(push, push, 0.0));
        let start = run.object_centre();
        let mut ran = Ran::default();
        for k in 0..(DURATION / h).round() as u64 {
            match run.step(&self.drive(k as f64 * h)) {
                Ok(report) => {
                    ran.newton += u64::from(report.newton_iterations);
                    ran.newton_max = ran.newton_max.max(report.newton_iterations);
                    ran.friction.push(report.friction_residual as f32);
                    ran.travel = ran.travel.max(travel(&run));
                }
                Err(_) => {
                    ran.finite = false;
                    break;
                }
            }
        }
        ran.steps = run.steps;
        ran.missed = run.missed;
        ran.static_residual = run.static_residual();
        ran.speed = run.object_velocity().0.length();
        let moved = run.object_centre() - start;
        ran.place = (moved.length() < GONE && moved.z > -FALLEN).then_some(moved);
        ran.q = run.state.q;
        ran
    }
}

/// Largest displacement in the last step, of the object or a fingertip (m).
fn travel(run: &SteppedScene) -> f64 {
    let (joints, joint_count) = (&run.state.velocity, run.state.q.len());
    let n = joint_count / 2;
    // A tip is no farther from a joint than the finger is long.
    let turn = |finger: usize| joints[finger * n..(finger + 1) * n].iter().map(|rate| rate.abs()).sum::<f64>();
    let tips = turn(0).max(turn(1)) * run.finger_length();
    tips.max(run.object_velocity().0.length()) * run.h
}

/// Result of a run.
struct Ran {
    finite: bool,
    steps: u64,
    missed: u64,
    newton: u64,
    newton_max: u32,
    /// Outer friction residual of every step.
    friction: Vec<f32>,
    static_residual: f64,
    /// Largest displacement in one step (m).
    travel: f64,
    /// Speed of the object at the end (m/s).
    speed: f64,
    q: Vec<f64>,
    /// Displacement of the object; absent if it left the hand.
    place: Option<DVec3>,
}

impl Default for Ran {
    fn default() -> Self {
        Self {
            finite: true,
            steps: 0,
            missed: 0,
            newton: 0,
            newton_max: 0,
            friction: Vec::new(),
            static_residual: 0.0,
            travel: 0.0,
            speed: 0.0,
            q: Vec::new(),
            place: None,
        }
    }
}

impl Ran {
    /// True if two runs give the same answer.
    fn agrees(&self, other: &Self) -> bool {
        let angle = self.q.iter().zip(&other.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let place = match (self.place, other.place) {
            (Some(a), Some(b)) => (a - b).length() <= SAME_PLACE,
            (None, None) => true,
            _ => false,
        };
        angle <= SAME_ANGLE && place
    }

    fn worst_friction(&self) -> f64 {
        f64::from(self.friction.iter().copied().fold(0.0, f32::max))
    }
}

/// Summary of a scene computed twice.
struct Judged {
    number: u64,
    /// Step (s).
    h: f64,
    coarse: Ran,
    fine_steps: u64,
    wrong: bool,
    /// The result depends on a shift of a micrometre, with the fine step too.
    no_answer: bool,
}

impl Judged {
    fn new(seed: u64, number: u64) -> Self {
        let scene = RandomScene::draw(seed, number);
        let (coarse, fine) = (scene.run(scene.h, 0.0), scene.run(scene.h / FINER, 0.0));
        let wrong = !(coarse.finite && fine.finite && coarse.agrees(&fine));
        let no_answer = wrong && !scene.run(scene.h / FINER, PUSH).agrees(&fine);
        Self { number, h: scene.h, coarse, fine_steps: fine.steps, wrong, no_answer }
    }

    fn is_silently_wrong(&self) -> bool {
        self.wrong && !self.no_answer && !raised(self, &Flags::CHOSEN)
    }
}

/// Thresholds above which an answer is flagged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Flags {
    /// Largest outer friction residual of any step.
    pub friction_residual: f64,
    /// Static residual at the end of the hold.
    pub static_residual: f64,
    /// Largest displacement of the object or a fingertip in one step (m).
    pub travel: f64,
}

impl Flags {
    /// Sensitive thresholds.
    pub const SHARP: Self = Self { friction_residual: 0.5, static_residual: 3e-3, travel: 8e-3 };
    /// Chosen thresholds, tuned on seed 1; [`RandomReport::flags`] has their recall.
    pub const CHOSEN: Self = Self { friction_residual: 2.0, static_residual: 0.02, travel: 16e-3 };
    /// Insensitive thresholds.
    pub const BLUNT: Self = Self { friction_residual: 10.0, static_residual: 0.1, travel: 64e-3 };
}

fn step_rows(judged: &[Judged]) -> Vec<StepRow> {
    let mut shortest = 0.0;
    STEP_ROWS
        .iter()
        .map(|longest| {
            let those: Vec<&Judged> = judged.iter().filter(|j| j.h > shortest && j.h <= *longest).collect();
            shortest = *longest;
            let count = |is: &dyn Fn(&Judged) -> bool| those.iter().filter(|j| is(j)).count();
            StepRow {
                longest_s: *longest,
                scenes: those.len(),
                wrong: count(&|j| j.wrong),
                no_answer: count(&|j| j.no_answer),
                silently_wrong: count(&Judged::is_silently_wrong),
            }
        })
        .collect()
}

/// Detection performance of a flag.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FlagRow {
    /// The flag and its limit.
    pub flag: String,
    /// Share of the wrong answers that are flagged.
    pub recall: f64,
    /// Share of the right answers that are flagged.
    pub false_alarms: f64,
}

/// Scenes up to a length of step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepRow {
    /// Longest step (s); the row before holds the shortest.
    pub longest_s: f64,
    /// Scenes.
    pub scenes: usize,
    /// Answers that change with the step.
    pub wrong: usize,
    /// Of these, answers that a shift of a micrometre changes too.
    pub no_answer: usize,
    /// Other wrong answers without a flag.
    pub silently_wrong: usize,
}

/// Longest step of each row (s): standard, draft, and two beyond those of trials.
const STEP_ROWS: [f64; 4] = [1.0 / 300.0, 1.0 / 150.0, 0.02, 0.06];

/// Results of random scenes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RandomReport {
    /// Seed of the scenes.
    pub seed: u64,
    /// Scenes.
    pub scenes: usize,
    /// Steps, without those of the finer computation.
    pub steps: u64,
    /// Steps of the finer computation.
    pub finer_steps: u64,
    /// Scenes with a value that is not finite.
    pub non_finite: usize,
    /// Steps that missed the solver's tolerance.
    pub missed_steps: u64,
    /// Newton iterations per step.
    pub newton_mean: f64,
    /// Most Newton iterations in one step.
    pub newton_max: u32,
    /// Largest outer friction residual.
    pub friction_residual_max: f64,
    /// 99th percentile of the outer friction residual.
    pub friction_residual_p99: f64,
    /// Answers that change with the step.
    pub wrong: usize,
    /// Of these, answers that a shift of a micrometre changes too: no answer is right.
    pub no_answer: usize,
    /// Other wrong answers without a flag.
    pub silently_wrong: usize,
    /// Numbers of the first of these.
    pub examples: Vec<u64>,
    /// The same by length of step.
    pub by_step: Vec<StepRow>,
    /// The flags, singly and together, over all answers except those without a right one.
    pub flags: Vec<FlagRow>,
}

impl RandomReport {
    /// Share of the scenes that have a right answer and were silently given another.
    pub fn silently_wrong_rate(&self) -> f64 {
        self.silently_wrong as f64 / (self.scenes - self.no_answer).max(1) as f64
    }

    fn new(seed: u64, judged: &[Judged]) -> Self {
        let mut friction: Vec<f32> = judged.iter().flat_map(|j| j.coarse.friction.iter().copied()).collect();
        friction.sort_by(f32::total_cmp);
        let steps: u64 = judged.iter().map(|j| j.coarse.steps).sum();
        let newton: u64 = judged.iter().map(|j| j.coarse.newton).sum();
        let silent: Vec<u64> = judged.iter().filter(|j| j.is_silently_wrong()).map(|j| j.number).collect();
        Self {
            seed,
            scenes: judged.len(),
            steps,
            finer_steps: judged.iter().map(|j| j.fine_steps).sum(),
            non_finite: judged.iter().filter(|j| !j.coarse.finite).count(),
            missed_steps: judged.iter().map(|j| j.coarse.missed).sum(),
            newton_mean: newton as f64 / steps.max(1) as f64,
            newton_max: judged.iter().map(|j| j.coarse.newton_max).max().unwrap_or(0),
            friction_residual_max: f64::from(friction.last().copied().unwrap_or(0.0)),
            friction_residual_p99: f64::from(friction.get(friction.len() * 99 / 100).copied().unwrap_or(0.0)),
            wrong: judged.iter().filter(|j| j.wrong).count(),
            no_answer: judged.iter().filter(|j| j.no_answer).count(),
            silently_wrong: silent.len(),
            examples: silent.into_iter().take(10).collect(),
            by_step: step_rows(judged),
            flags: flag_rows(judged),
        }
    }
}

/// True when any criterion flags an answer.
fn raised(judged: &Judged, flags: &Flags) -> bool {
    let ran = &judged.coarse;
    !ran.finite
        || ran.missed > 0
        || ran.worst_friction() > flags.friction_residual
        || ran.static_residual > flags.static_residual
        || ran.travel > flags.travel
}

fn flag_rows(judged: &[Judged]) -> Vec<FlagRow> {
    let row = |flag: String, is_raised: &dyn Fn(&Judged) -> bool| {
        let share = |wrong: bool| {
            let those: Vec<&Judged> = judged.iter().filter(|j| j.wrong == wrong && !j.no_answer).collect();
            those.iter().filter(|j| is_raised(j)).count() as f64 / those.len().max(1) as f64
        };
        FlagRow { flag, recall: share(true), false_alarms: share(false) }
    };
    let mut rows = vec![
        row("a number left the range".to_owned(), &|j| !j.coarse.finite),
        row("a step missed its tolerance".to_owned(), &|j| j.coarse.missed > 0),
    ];
    for limit in [0.5, 1.0, 2.0, 5.0, 10.0] {
        rows.push(row(format!("friction residual > {limit}"), &|j| j.coarse.worst_friction() > limit));
    }
    for limit in [0.001, 0.003, 0.01, 0.02, 0.05, 0.1] {
        rows.push(row(format!("static residual > {limit}"), &|j| j.coarse.static_residual > limit));
    }
    for limit in [1e-3, 0.1] {
        rows.push(row(format!("object faster than {limit} m/s at the end"), &|j| j.coarse.speed > limit));
    }
    for limit in [2e-3, 4e-3, 8e-3, 16e-3, 32e-3] {
        rows.push(row(format!("way in one step > {} mm", limit * 1e3), &|j| j.coarse.travel > limit));
    }
    for (name, flags) in [("sharp", Flags::SHARP), ("chosen", Flags::CHOSEN), ("blunt", Flags::BLUNT)] {
        let Flags { friction_residual, static_residual, travel } = flags;
        let limits = format!("friction > {friction_residual}, static > {static_residual}, way > {} mm", travel * 1e3);
        rows.push(row(format!("any, {name}: {limits}"), &|j| raised(j, &flags)));
    }
    rows
}

/// Computes random scenes, twice each, until they have taken `steps` steps together; `progress` receives how many of how
/// many scenes are done. The result does not depend on the number of threads.
pub fn random_scenes(seed: u64, steps: u64, threads: usize, progress: &(dyn Fn(usize, usize) + Sync)) -> RandomReport {
    let (mut scenes, mut planned) = (0, 0);
    while planned < steps {
        planned += RandomScene::draw(seed, scenes).steps();
        scenes += 1;
    }
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || {
        let mut judged = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed) as u64;
            if number >= scenes {
                return judged;
            }
            judged.push(Judged::new(seed, number));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, scenes as usize);
        }
    };
    let mut judged: Vec<Judged> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(work)).collect();
        // A panic in a thread is a bug: pass it on.
        let join = |thread: std::thread::ScopedJoinHandle<'_, _>| {
            thread.join().unwrap_or_else(|fault| std::panic::resume_unwind(fault))
        };
        threads.into_iter().flat_map(join).collect()
    });
    judged.sort_by_key(|j| j.number);
    RandomReport::new(seed, &judged)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_scenes_do_not_depend_on_threads_and_stay_finite() {
        let one = random_scenes(1, 4000, 1, &|_, _| ());
        assert_eq!(one, random_scenes(1, 4000, 2, &|_, _| ()));
        assert!(one.steps >= 4000 && one.finer_steps > 3 * one.steps);
        assert_eq!(one.non_finite, 0);
        assert_ne!(one.newton_mean, random_scenes(2, 4000, 1, &|_, _| ()).newton_mean);
    }
}
