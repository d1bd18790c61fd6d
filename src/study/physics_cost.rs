//! Cost of a grasp: CPU time of one whole trial on one thread, and its error against a much finer trial, for scenes
//! from a fixed ball to a baked mesh.
//!
//! Times are CPU times of the thread, not wall-clock times, and medians of several runs, so that other load on the
//! machine has little influence. Compare them on one machine; do not assert them in a test.

use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_lab::grasping::{ErrorNorms, grasp, timed_grasp, truth_of};
use palpate_sim::objects::{ObjectError, ObjectModel};
use palpate_sim::scene::{Accuracy, Scene};
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Sensors, SignalDefinition};
use serde::Serialize;

/// Timed scene.
#[derive(Clone, Debug)]
pub struct BenchScene {
    /// Its name in tables.
    pub name: &'static str,
    /// Grasped object.
    pub object: ObjectModel,
    /// True if the object is fixed in place.
    pub fixed: bool,
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CostRow {
    pub scene: &'static str,
    pub accuracy: String,
    /// Step length (s); under a tolerance the mean.
    pub step_s: f64,
    /// CPU time of one trial (ms): the median over the runs.
    pub cpu_ms_median: f64,
    /// CPU time of one step (µs).
    pub us_per_step: f64,
    /// Mean Newton iterations per step.
    pub newton_mean: f64,
    /// Most Newton iterations in one step.
    pub newton_max: u32,
    /// Steps that missed the solver's tolerance.
    pub unconverged_steps: u64,
    /// Simulated time over CPU time.
    pub times_real_time: f64,
    /// Error against the reference.
    pub error: Option<ErrorNorms>,
}

/// Reference grasp of a scene, against which errors are measured.
pub fn physics_truth(bench: &BenchScene) -> SimulatedTrial {
    grasp(&truth_of(&bench.scene()), Some(&bench.object), 0)
}

impl BenchScene {
    fn scene(&self) -> Scene {
        let mut scene = Scene::default();
        scene.object.fixed = self.fixed;
        scene
    }
}

/// The scenes: closed-form distances fixed and free, a union of primitives, and a baked mesh.
pub fn bench_scenes() -> Result<Vec<BenchScene>, ObjectError> {
    let primitive =
        |name, shape, fixed| BenchScene { name, object: ObjectModel::from_primitive(name, shape, 400.0, 0.6), fixed };
    let sphere = Primitive::Sphere { radius: 0.025 };
    let cuboid = Primitive::Cuboid { half: DVec3::splat(0.020) };
    let cylinder = Primitive::Cylinder { radius: 0.0175, half_length: 0.030 };
    let mut scenes = vec![
        primitive("sphere_fixed", sphere, true),
        primitive("sphere_free", sphere, false),
        primitive("box_fixed", cuboid, true),
        primitive("box_free", cuboid, false),
        primitive("cylinder_free", cylinder, false),
    ];
    for (name, source) in [("mesh_free", "lemon"), ("union_free", "syringe")] {
        let mut scene = Scene::default();
        source.clone_into(&mut scene.object.source);
        if let Some(object) = scene.load_object()? {
            scenes.push(BenchScene { name, object, fixed: false });
        }
    }
    Ok(scenes)
}

/// Times `runs` trials of a scene, and compares the last with the reference grasp if one is given.
pub fn physics_cost(bench: &BenchScene, accuracy: Accuracy, runs: usize, truth: Option<&SimulatedTrial>) -> CostRow {
    let mut scene = bench.scene();
    scene.solver.accuracy = accuracy;
    let mut times = Vec::new();
    let mut last = None;
    for _ in 0..runs.max(1) {
        if let Some((trial, seconds)) = timed_grasp(&scene, Some(&bench.object), &|| false) {
            times.push(seconds);
            last = Some(trial);
        }
    }
    times.sort_by(f64::total_cmp);
    let median = times[times.len() / 2];
    let quality = last.as_ref().map(|trial| trial.data.quality.clone()).unwrap_or_default();
    let sensors = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Contact);
    let error = last.zip(truth).map(|(trial, truth)| ErrorNorms::between(&trial, truth, &sensors));
    let steps = quality.steps.max(1) as f64;
    CostRow {
        scene: bench.name,
        accuracy: accuracy.to_string(),
        step_s: scene.timing.duration_s / steps,
        cpu_ms_median: median * 1e3,
        us_per_step: median * 1e6 / steps,
        newton_mean: quality.newton_mean,
        newton_max: quality.newton_max,
        unconverged_steps: quality.unconverged_steps,
        times_real_time: scene.timing.duration_s / median,
        error,
    }
}
