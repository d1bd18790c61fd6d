//! One grasp with its CPU time, and the reference grasp that errors are measured against.

use super::run::prepare;
use palpate_sim::objects::{ObjectError, ObjectModel};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Accuracy, EngineKind, Integrator, Scene};
use palpate_tactile::trial::SimulatedTrial;

/// A tolerance far below the accuracies compared with it: at 1e-7 the error in curvature is some 1e-4 1/m, a hundredth
/// of that of steps of 1/300 s.
const TRUTH: Accuracy = Accuracy::Tolerance(1e-7);

/// Runs a grasp to its end. Returns the trial with the CPU time of this thread (s); `None` if it was cancelled.
pub fn timed_grasp(
    scene: &Scene,
    object: Option<&ObjectModel>,
    cancelled: &dyn Fn() -> bool,
) -> Option<(SimulatedTrial, f64)> {
    let mut run = prepare(scene, object, 0);
    let start = cpu_time::ThreadTime::now();
    while run.next_frame().is_some() {
        if cancelled() {
            return None;
        }
    }
    let cpu_s = start.elapsed().as_secs_f64();
    Some((run.finish(scene), cpu_s))
}

/// An object of a scene by its name, with its poses; none for the empty hand.
pub fn posed_object(scene: &Scene, name: &str) -> Result<Option<(ObjectModel, PoseSampler)>, ObjectError> {
    let mut scene = scene.clone();
    name.clone_into(&mut scene.object.source);
    let object = scene.load_object()?;
    let sampler = PoseSampler::new(&scene, object.as_ref());
    Ok(object.map(|object| (object, sampler)))
}

/// The scene, computed so finely that its error does not count.
pub fn truth_of(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.solver.accuracy = TRUTH;
    scene.solver.integrator = Integrator::Auto;
    scene.solver.engine = EngineKind::Palpate;
    scene
}
