//! Cost and error of an accuracy: CPU time of one grasp, and its remaining error.

use super::error_band::{ErrorBand, ErrorNorms};
use super::run::prepare_refined;
use super::timed_grasp::timed_grasp;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{EngineKind, Scene};
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Sensors, SignalDefinition};
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
    /// True where a finer tolerance does not remove the error: the object sticks or slips, rolls one way or the other.
    pub persists: bool,
}

/// Runs a grasp and its refined run; `None` if it was cancelled or the grasp ended early.
pub fn accuracy_cost(
    scene: &Scene,
    object: Option<&ObjectModel>,
    cancelled: &dyn Fn() -> bool,
) -> Option<AccuracyCost> {
    let sensors = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Parts);
    let (trial, cpu) = timed_grasp(scene, object, cancelled)?;
    let refined = prepare_refined(scene, object, 0).run_to_end(scene, cancelled)?;
    let mut band = ErrorBand::new(scene, sensors.channels().len());
    for (frame, finer) in trial.frames().iter().zip(refined.frames()) {
        band.push(frame.t, &sensors.read(frame), &sensors.read(finer));
    }
    let times_real_time = trial.frames().last()?.t / cpu.max(1e-9);
    Some(AccuracyCost {
        cpu_ms: cpu * 1e3,
        times_real_time,
        error: band.norms(&trial, &sensors),
        persists: persists(scene, object, [&trial, &refined], cancelled)?,
    })
}

/// Differences of curvature and force, as shares of their range, that are no errors of steps: between a grasp at 1e-4
/// and its refined run they are 0.05 % and 0.6 % where nothing slips.
const SLIPPED: [f64; 2] = [0.002, 0.015];
/// A difference that a tenth of the tolerance leaves at more than this share does not shrink with steps; others fall to
/// a quarter or half.
const LEFT: f64 = 0.5;

/// True where the refined run is far away, and a run finer still is as far from that. `None` if cancelled.
fn persists(
    scene: &Scene,
    object: Option<&ObjectModel>,
    [trial, refined]: [&SimulatedTrial; 2],
    cancelled: &dyn Fn() -> bool,
) -> Option<bool> {
    let far = |norms: &ErrorNorms| [norms.curvature_share > SLIPPED[0], norms.force_share > SLIPPED[1]];
    let first = ErrorNorms::of_whole_fingers(trial, refined);
    if scene.solver.engine != EngineKind::Palpate || !far(&first).contains(&true) {
        return Some(false);
    }
    let mut finer = scene.clone();
    finer.solver = scene.solver.refined();
    let second =
        ErrorNorms::of_whole_fingers(refined, &prepare_refined(&finer, object, 0).run_to_end(&finer, cancelled)?);
    let stays = [second.curvature_share > LEFT * first.curvature_share, second.force_share > LEFT * first.force_share];
    Some(far(&second).into_iter().zip(stays).any(|(far, stays)| far && stays))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;
    use palpate_sim::poses::PoseSampler;
    use palpate_sim::scene::{Accuracy, PosePreset};

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

    #[test]
    fn an_error_that_no_step_removes_is_told_from_one_that_shrinks() {
        // A free cylinder on its side rolls as it likes; the same held in place cannot.
        let mut scene = Scene { pose: PosePreset::named("B").expect("a preset").poses(), ..Scene::default() };
        "syringe".clone_into(&mut scene.object.source);
        let object = scene.load_object().expect("loads").expect("an object");
        let sampler = PoseSampler::new(&scene, Some(&object));
        let persisting = |fixed: bool| {
            let persists = |seed: &u64| {
                let mut drawn = sampler.draw(Some(&object), *seed).0;
                drawn.set_object_fixed(fixed);
                accuracy_cost(&drawn, Some(&object), &|| false).expect("not cancelled").persists
            };
            (1..=8).filter(persists).count()
        };
        let (free, fixed) = (persisting(false), persisting(true));
        assert!(free >= 3 && fixed <= 1, "{free} of 8 free, {fixed} of 8 fixed");
    }
}
