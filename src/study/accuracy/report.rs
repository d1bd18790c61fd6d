//! Results of the study: medians over poses and shapes, the front, the floor and the knee.

use super::continuum::Continuum;
use super::measure::GraspSample;
use super::plan::{AccuracySetting, SettingFamily};
use crate::frame::rounded;
use palpate_learn::metrics::Interval;
use serde::{Deserialize, Serialize};

/// What accuracy costs, and what it is worth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AccuracyStudy {
    /// Names of the objects.
    pub objects: Vec<String>,
    /// Poses of each object, free and fixed alike.
    pub poses: u64,
    /// One row per setting.
    pub rows: Vec<AccuracyRow>,
    /// Recognition by models trained on grasps of several settings; empty where it was not compared.
    pub recognition: Vec<RecognitionRow>,
    /// Pad and finger beside finite elements; absent in results from before they were compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub continuum: Option<Continuum>,
}

/// Cost and error of one setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AccuracyRow {
    #[serde(flatten)]
    pub setting: AccuracySetting,
    /// Results by kind of scene.
    pub groups: Vec<GroupCost>,
}

/// A kind of scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SceneGroup {
    /// Free objects.
    Free,
    /// Fixed objects.
    Fixed,
    /// Free objects of closed form.
    FreePrimitives,
    /// Free objects with a mesh.
    FreeMeshes,
    /// Fixed objects of closed form.
    FixedPrimitives,
    /// Fixed objects with a mesh.
    FixedMeshes,
}

impl SceneGroup {
    /// All groups.
    pub const ALL: [Self; 6] =
        [Self::Free, Self::Fixed, Self::FreePrimitives, Self::FreeMeshes, Self::FixedPrimitives, Self::FixedMeshes];

    /// Name in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Fixed => "fixed",
            Self::FreePrimitives => "free, closed form",
            Self::FreeMeshes => "free, mesh",
            Self::FixedPrimitives => "fixed, closed form",
            Self::FixedMeshes => "fixed, mesh",
        }
    }

    /// Group of all scenes with objects fixed or free.
    pub fn of(fixed: bool) -> Self {
        if fixed { Self::Fixed } else { Self::Free }
    }

    fn holds(self, kind: SceneKind) -> bool {
        let SceneKind { fixed, mesh } = kind;
        match self {
            Self::Free => !fixed,
            Self::Fixed => fixed,
            Self::FreePrimitives => !fixed && !mesh,
            Self::FreeMeshes => !fixed && mesh,
            Self::FixedPrimitives => fixed && !mesh,
            Self::FixedMeshes => fixed && mesh,
        }
    }
}

/// Kind of a measured scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneKind {
    pub(super) fixed: bool,
    pub(super) mesh: bool,
}

/// Cost and error over the scenes of a group.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroupCost {
    /// Kind of scene.
    pub group: SceneGroup,
    pub grasps: usize,
    /// Grasps that report a fault, or end with the object elsewhere.
    pub failed: usize,
    /// CPU time of a grasp (ms).
    pub cpu_ms: Spread,
    /// Error of curvature (1/m).
    pub curvature_per_m: Spread,
    /// Error of force (N).
    pub force_n: Spread,
}

/// Median and quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct Spread {
    /// Lower quartile.
    pub low: f64,
    pub median: f64,
    /// Upper quartile.
    pub high: f64,
}

impl From<[f64; 3]> for Spread {
    fn from([low, median, high]: [f64; 3]) -> Self {
        Self { low, median, high }
    }
}

impl From<Spread> for [f64; 3] {
    fn from(spread: Spread) -> Self {
        [spread.low, spread.median, spread.high]
    }
}

impl Spread {
    /// Quartiles of values, to three digits.
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * values.len().saturating_sub(1) as f64;
            let (below, above) = (values.get(place.floor() as usize), values.get(place.ceil() as usize));
            let (Some(below), Some(above)) = (below, above) else { return 0.0 };
            rounded(below + (above - below) * place.fract())
        };
        Self { low: at(0.25), median: at(0.5), high: at(0.75) }
    }
}

/// Recognition by models trained on grasps of one setting and tested on reference grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecognitionRow {
    /// Setting of the training grasps.
    #[serde(flatten)]
    pub setting: AccuracySetting,
    /// CPU time of a training grasp (ms): the median.
    pub cpu_ms: f64,
    /// Training grasps.
    pub grasps: usize,
    /// Training grasps that were left out because they report a fault.
    pub left_out: usize,
    pub scores: Vec<MethodScore>,
}

/// Score of a method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodScore {
    /// Key of the method.
    pub method: String,
    /// Macro F1 on the test grasps, with its 95 % interval.
    pub f1: Interval,
    /// Macro F1 minus that of training on reference grasps, with the paired 95 % interval.
    pub gain: Interval,
}

/// Share of failed grasps from which on a setting counts as failed.
pub const FAILED_SHARE: f64 = 0.1;

impl GroupCost {
    pub(super) fn new(group: SceneGroup, samples: &[(SceneKind, GraspSample)]) -> Option<Self> {
        let own: Vec<&GraspSample> =
            samples.iter().filter(|(kind, _)| group.holds(*kind)).map(|(_, sample)| sample).collect();
        let spread = |value: &dyn Fn(&GraspSample) -> f64| Spread::of(own.iter().map(|sample| value(sample)).collect());
        (!own.is_empty()).then(|| Self {
            group,
            grasps: own.len(),
            failed: own.iter().filter(|sample| sample.failed()).count(),
            cpu_ms: spread(&|sample| sample.cpu_ms),
            curvature_per_m: spread(&|sample| sample.error.curvature_per_m),
            force_n: spread(&|sample| sample.error.force_n),
        })
    }

    /// True where too many grasps fail for the setting to be used.
    pub fn has_failed(&self) -> bool {
        self.failed as f64 > FAILED_SHARE * self.grasps as f64
    }
}

impl AccuracyRow {
    /// Results for a kind of scene.
    pub fn group(&self, group: SceneGroup) -> Option<&GroupCost> {
        self.groups.iter().find(|cost| cost.group == group)
    }
}

impl AccuracyStudy {
    /// Results of a family for a kind of scene, in the order of the plan.
    pub fn family(
        &self,
        family: SettingFamily,
        group: SceneGroup,
    ) -> impl Iterator<Item = (&AccuracySetting, &GroupCost)> {
        let own = self.rows.iter().filter(move |row| row.setting.family == family);
        own.filter_map(move |row| Some((&row.setting, row.group(group)?)))
    }

    /// The front: settings of motion that nothing cheaper is as accurate as, cheapest first.
    pub fn front(&self, group: SceneGroup) -> Vec<(&AccuracySetting, &GroupCost)> {
        let families = SettingFamily::ALL.into_iter().filter(|family| family.is_of_motion());
        let mut all: Vec<_> = families.flat_map(|family| self.family(family, group)).collect();
        all.retain(|(_, cost)| !cost.has_failed());
        all.sort_by(|a, b| a.1.cpu_ms.median.total_cmp(&b.1.cpu_ms.median));
        let mut least = f64::INFINITY;
        all.retain(|(_, cost)| {
            let better = cost.curvature_per_m.median < least;
            least = least.min(cost.curvature_per_m.median);
            better
        });
        all
    }

    /// Error of curvature that is left at `reference` (1/m): the floor of the method of second order.
    pub fn floor(&self, group: SceneGroup) -> Option<f64> {
        let mut reference = self.family(SettingFamily::Tolerance, group).filter(|(s, _)| s.name == "reference");
        reference.next().map(|(_, cost)| cost.curvature_per_m.median)
    }

    /// CPU time at one tolerance over that at another, for scenes with objects fixed or free.
    pub fn times_tolerance(&self, tolerance: f64, other: f64, fixed: bool) -> Option<f64> {
        let group = SceneGroup::of(fixed);
        let mut costs: Vec<[f64; 2]> = self
            .family(SettingFamily::Tolerance, group)
            .filter_map(|(setting, cost)| Some([setting.tolerance()?.ln(), cost.cpu_ms.median.ln()]))
            .filter(|cost| cost.iter().all(|value| value.is_finite()))
            .collect();
        costs.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let at = |tolerance: f64| {
            let (first, last) = (costs.first()?, costs.last()?);
            let x = tolerance.ln().clamp(first[0], last[0]);
            let above = costs.iter().position(|cost| cost[0] >= x)?;
            let ([x1, y1], [x0, y0]) = (costs[above], costs[above.saturating_sub(1)]);
            Some(if x1 > x0 { y0 + (y1 - y0) * (x - x0) / (x1 - x0) } else { y1 })
        };
        Some((at(tolerance)? - at(other)?).exp())
    }

    /// The knee: cheapest training grasps with which no method is worse than with reference grasps, as far as their
    /// intervals tell.
    pub fn knee(&self) -> Option<&RecognitionRow> {
        let as_good = |row: &&RecognitionRow| !row.scores.is_empty() && row.scores.iter().all(|s| s.gain.high >= 0.0);
        self.recognition.iter().filter(as_good).min_by(|a, b| a.cpu_ms.total_cmp(&b.cpu_ms))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(family: SettingFamily, name: &str, cpu_ms: f64, error: f64, failed: usize) -> AccuracyRow {
        let spread = |median: f64| Spread { low: 0.5 * median, median, high: 2.0 * median };
        let (cpu_ms, curvature_per_m, force_n) = (spread(cpu_ms), spread(error), spread(error));
        let cost = GroupCost { group: SceneGroup::Free, grasps: 20, failed, cpu_ms, curvature_per_m, force_n };
        let set = vec![format!("solver.accuracy={name}")];
        AccuracyRow { setting: AccuracySetting { family, name: name.to_owned(), set }, groups: vec![cost] }
    }

    fn study() -> AccuracyStudy {
        let rows = vec![
            row(SettingFamily::Tolerance, "draft", 2.0, 0.01, 0),
            row(SettingFamily::Tolerance, "standard", 4.0, 0.002, 1),
            row(SettingFamily::Tolerance, "reference", 40.0, 0.0001, 0),
            row(SettingFamily::EulerSteps, "1/300 s", 3.0, 0.02, 0),
            row(SettingFamily::Rapier, "1/150 s", 1.0, 0.0001, 3),
            row(SettingFamily::Joints, "N = 5", 1.0, 1e-6, 0),
        ];
        AccuracyStudy { objects: vec!["ball".to_owned()], poses: 1, rows, recognition: Vec::new(), continuum: None }
    }

    #[test]
    fn the_front_has_what_nothing_cheaper_beats_and_nothing_that_fails() {
        let study = study();
        let names: Vec<&str> = study.front(SceneGroup::Free).iter().map(|(setting, _)| setting.name.as_str()).collect();
        assert_eq!(names, ["draft", "standard", "reference"]);
        assert!(study.front(SceneGroup::Fixed).is_empty());
        assert_eq!(study.floor(SceneGroup::Free), Some(0.0001));
        let times = |tolerance: f64, fixed| study.times_tolerance(tolerance, 1e-4, fixed);
        // From the table, between its rows, and beyond its end.
        assert!(times(1e-6, false).is_some_and(|factor| (factor - 10.0).abs() < 1e-9));
        assert!(times(1e-5, false).is_some_and(|factor| (factor - 10f64.sqrt()).abs() < 1e-9));
        assert_eq!(times(1e-9, false), times(1e-6, false));
        assert_eq!(times(1e-6, true), None);
    }

    #[test]
    fn the_knee_is_the_cheapest_as_good_as_the_reference() {
        let mut study = study();
        assert_eq!(study.knee(), None);
        let interval = |estimate: f64| Interval { estimate, low: estimate - 0.02, high: estimate + 0.02 };
        for (row, gain) in study.rows.iter().zip([-0.05, -0.01, 0.0]) {
            let score = MethodScore { method: "knn".to_owned(), f1: interval(0.8 + gain), gain: interval(gain) };
            let cpu_ms = row.groups[0].cpu_ms.median;
            let setting = row.setting.clone();
            study.recognition.push(RecognitionRow { setting, cpu_ms, grasps: 9, left_out: 0, scores: vec![score] });
        }
        assert_eq!(study.knee().map(|row| row.setting.name.as_str()), Some("standard"));
    }

    #[test]
    fn quartiles_have_three_digits() {
        let spread = Spread::of(vec![4.0, 1.0, 2.0, 3.00456]);
        assert_eq!(<[f64; 3]>::from(spread), [1.75, 2.5, 3.25]);
        assert_eq!(Spread::of(vec![]).median, 0.0);
    }
}
