//! Stated error of a scene's accuracy: what the shipped full run of the study measured.

use super::plan::SettingFamily;
use super::report::{AccuracyStudy, SceneGroup};
use crate::frame::StoredStudy;
use palpate_sim::scene::{Accuracy, EngineKind, Integrator, Scene};
use serde::{Deserialize, Serialize};

/// Errors of motion over a grasp (root mean squares), below which three of four grasps of the study stay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StatedError {
    /// Curvature (1/m).
    pub curvature_per_m: f64,
    /// Normal force on a pad (N).
    pub force_n: f64,
    /// Name of the accuracy in the study: that of the scene, or the next coarser one.
    pub accuracy: String,
}

/// Stated error of a scene's motion; none for a method or a tolerance that the study has not measured.
pub fn stated_error(scene: &Scene) -> Option<StatedError> {
    if scene.solver.engine != EngineKind::Palpate || scene.solver.integrator == Integrator::Euler {
        return None;
    }
    let study = StoredStudy::<AccuracyStudy>::shipped("accuracy").ok().flatten()?.result;
    let wanted = scene.solver.accuracy.step_tolerance();
    let tolerance = |name: &str| name.parse().ok().map(Accuracy::step_tolerance);
    let rows = study.rows.iter().filter(|row| row.setting.family == SettingFamily::Tolerance);
    let coarser = rows.filter_map(|row| {
        let name = row.setting.name.trim_end_matches(", default");
        Some((tolerance(name).filter(|own| *own >= wanted * (1.0 - 1e-9))?, name, row))
    });
    let (_, name, row) = coarser.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let group = row.groups.iter().find(|cost| cost.group == SceneGroup::of(scene.holds_object()))?;
    Some(StatedError {
        curvature_per_m: group.curvature_per_m.high,
        force_n: group.force_n.high,
        accuracy: name.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_accuracy_has_its_own_error_or_that_of_the_next_coarser_one() {
        let stated = |accuracy: &str| {
            let mut scene = Scene::default();
            scene.solver.accuracy = accuracy.parse().expect("an accuracy");
            stated_error(&scene)
        };
        let [draft, standard, reference] =
            ["draft", "standard", "reference"].map(|name| stated(name).expect("measured"));
        assert!(draft.force_n > standard.force_n && standard.force_n > reference.force_n);
        assert!(draft.curvature_per_m > standard.curvature_per_m);
        assert_eq!(stated("2e-5").expect("measured").accuracy, "3e-5");
        assert_eq!((stated("1e-1"), standard.accuracy.as_str()), (None, "standard"));
        let mut fixed = Scene::default();
        fixed.object.fixed = !fixed.object.fixed;
        assert_ne!(stated_error(&fixed), stated_error(&Scene::default()));
    }
}
