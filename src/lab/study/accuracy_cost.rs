//! Cost and error of an accuracy: CPU time of one grasp, and its remaining error.

use super::timed_grasp::timed_grasp;
use crate::grasping::{ErrorBand, ErrorNorms, prepare_refined};
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::Scene;
use palpate_tactile::Sensors;
use serde::Serialize;

/// CPU time and remaining error of a scene's accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AccuracyCost {
    /// CPU time of one trial on one thread (ms).
    pub cpu_ms: f64,
    /// Simulated time over CPU time.
    pub times_real_time: f64,
    /// Half-widths of the estimated numerical error band.
    pub error: ErrorNorms,
}

/// Runs a grasp and its refined run; `None` if it was cancelled or the grasp ended early.
pub fn accuracy_cost(
    scene: &Scene,
    object: Option<&ObjectModel>,
    cancelled: &dyn Fn() -> bool,
) -> Option<AccuracyCost> {
    let sensors = Sensors::whole_fingers(&scene.gripper);
    let (trial, cpu) = timed_grasp(scene, object, cancelled)?;
    let mut refined = prepare_refined(scene, object, 0);
    let mut band = ErrorBand::new(scene, sensors.channels().len());
    for frame in trial.frames() {
        let finer = refined.next_frame().filter(|_| !cancelled())?;
        band.push(frame.t, &sensors.read(frame), &sensors.read(finer));
    }
    let times_real_time = trial.frames().last()?.t / cpu.max(1e-9);
    Some(AccuracyCost { cpu_ms: cpu * 1e3, times_real_time, error: band.norms(&trial, &sensors) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;
    use palpate_sim::scene::Accuracy;

    #[test]
    fn accuracy_changes_the_error_and_cancelling_ends_the_run() {
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        let mut scene = Scene::default();
        scene.object.fixed = true;
        scene.timing.duration_s = 2.0;
        let mut at = |accuracy| {
            scene.solver.accuracy = accuracy;
            accuracy_cost(&scene, Some(&ball), &|| false).expect("not cancelled").error
        };
        let dial = [Accuracy::Draft, Accuracy::Standard, Accuracy::Tolerance(1e-5), Accuracy::Reference];
        let errors = dial.map(&mut at);
        for pair in errors.windows(2) {
            assert!(pair[1].curvature_per_m < 0.9 * pair[0].curvature_per_m, "{errors:?}");
            assert!(pair[1].force_n < pair[0].force_n && pair[1].pressure_pa < pair[0].pressure_pa, "{errors:?}");
            assert!(pair[1].curvature_share > 0.0 && pair[1].force_share < 0.2, "{errors:?}");
        }
        assert_eq!(accuracy_cost(&scene, Some(&ball), &|| true), None);
    }
}
