//! Settings that the accuracy study compares, as what `--set` takes, and how much it measures.

use palpate_sim::scene::{Accuracy, EngineKind, Integrator, Scene, SceneError, Solver};
use serde::{Deserialize, Serialize};

/// A setting that trades accuracy for time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AccuracySetting {
    /// Family, a line of the picture.
    pub family: SettingFamily,
    /// Name in the picture: `standard`, `1/300 s`, `N = 5`.
    pub name: String,
    /// Values of `--set`, `key=value`.
    pub set: Vec<String>,
}

/// Settings that differ in one quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SettingFamily {
    /// Tolerance of the method of second order.
    Tolerance,
    /// Tolerance of implicit Euler.
    EulerTolerance,
    /// Fixed steps of implicit Euler.
    EulerSteps,
    /// Fixed steps of rapier.
    Rapier,
    /// Number of joints of a finger.
    Joints,
    /// Number of contact springs of a pad.
    Taxels,
}

impl SettingFamily {
    /// All families.
    pub const ALL: [Self; 6] =
        [Self::Tolerance, Self::EulerTolerance, Self::EulerSteps, Self::Rapier, Self::Joints, Self::Taxels];

    /// Name in legends and tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::Tolerance => "tolerance (SDIRK2)",
            Self::EulerTolerance => "tolerance (Euler)",
            Self::EulerSteps => "fixed steps (Euler)",
            Self::Rapier => "fixed steps (rapier)",
            Self::Joints => "joints N",
            Self::Taxels => "taxels",
        }
    }

    /// Number of its colour in figures.
    pub fn colour(self) -> usize {
        match self {
            Self::Tolerance => 0,
            Self::EulerSteps => 1,
            Self::Joints => 2,
            Self::Rapier => 3,
            Self::EulerTolerance => 4,
            Self::Taxels => 5,
        }
    }

    /// True where errors are those of motion, against the same model. Those of the model itself are measured against a
    /// finer model.
    pub fn is_of_motion(self) -> bool {
        !matches!(self, Self::Joints | Self::Taxels)
    }

    /// Settings of the grasp that errors of this family are measured against, beside a tight tolerance: none for errors
    /// of motion.
    pub(super) fn finer_model(self) -> &'static [&'static str] {
        match self {
            Self::Tolerance | Self::EulerTolerance | Self::EulerSteps | Self::Rapier => &[],
            Self::Joints => &["gripper.finger.joints=40"],
            Self::Taxels => &["gripper.pad.rows=120", "gripper.pad.columns=12"],
        }
    }
}

impl AccuracySetting {
    fn new(family: SettingFamily, name: &str, set: &[&str]) -> Self {
        Self { family, name: name.to_owned(), set: set.iter().map(|s| (*s).to_owned()).collect() }
    }

    /// A scene with this setting. Engine, method and accuracy are the defaults where it does not name them; everything
    /// else stays.
    pub fn adopted(&self, scene: &Scene) -> Result<Scene, SceneError> {
        let mut scene = scene.clone();
        let solver = Solver::default();
        (scene.solver.engine, scene.solver.integrator) = (EngineKind::default(), Integrator::Auto);
        scene.solver.accuracy = solver.accuracy;
        scene.with_settings(&self.set)
    }

    /// Tolerance of the second-order method; `None` for other families.
    pub fn tolerance(&self) -> Option<f64> {
        let accuracy = self.set.first()?.strip_prefix("solver.accuracy=")?.parse::<Accuracy>().ok()?;
        (self.family == SettingFamily::Tolerance).then(|| accuracy.step_tolerance())
    }

    /// True for the setting of a scene that nobody changed.
    pub fn is_default(&self) -> bool {
        self.set == ["solver.accuracy=standard"]
    }

    /// The setting on a command line.
    pub fn on_command_line(&self) -> String {
        self.set.iter().map(|set| format!("--set {set}")).collect::<Vec<_>>().join(" ")
    }
}

/// Settings, scenes and amount of an accuracy study.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AccuracyPlan {
    /// Compared settings.
    pub settings: Vec<AccuracySetting>,
    /// Names of built-in objects.
    pub objects: Vec<String>,
    /// Poses of each object, free and fixed alike; the first is seed 1 of preset M.
    pub poses: u64,
    /// What accuracy is worth for recognition.
    pub recognition: RecognitionPlan,
}

/// Settings, methods and amount of the comparison of recognition.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecognitionPlan {
    /// Settings of training grasps.
    pub settings: Vec<AccuracySetting>,
    /// Setting of test grasps.
    pub test: AccuracySetting,
    /// Keys of methods.
    pub methods: Vec<String>,
    /// Name of the pose preset.
    pub preset: String,
    /// Training grasps of each object.
    pub train_grasps: u64,
    /// Test grasps of each object.
    pub test_grasps: u64,
    /// Epochs of networks; a third of the usual number shows the same differences.
    pub epochs: u32,
}

/// Three closed-form shapes and three meshes.
const OBJECTS: [&str; 6] = ["ball", "cube", "cylinder", "lemon", "tomato", "case"];

impl AccuracyPlan {
    /// The whole study.
    pub fn full() -> Self {
        let recognition = RecognitionPlan {
            settings: trained(),
            test: reference(),
            methods: ["knn", "random-forest", "svm", "macro-layer"].map(str::to_owned).to_vec(),
            preset: "B".to_owned(),
            train_grasps: 40,
            test_grasps: 40,
            epochs: 60,
        };
        Self { settings: settings(), objects: OBJECTS.map(str::to_owned).to_vec(), poses: 32, recognition }
    }

    /// The same in less than a minute: fewer poses, and no settings that take long.
    pub fn quick() -> Self {
        let mut plan = Self::full();
        plan.poses = 2;
        plan.settings.retain(|setting| setting.name != SLOWEST_STEPS);
        plan.recognition
            .settings
            .retain(|setting| ["draft", "standard"].contains(&&*setting.name) || *setting == reference());
        plan.recognition.methods.truncate(3);
        (plan.recognition.train_grasps, plan.recognition.test_grasps) = (8, 8);
        plan
    }
}

/// The slowest fixed steps.
const SLOWEST_STEPS: &str = "1/9600 s";

fn tolerance(name: &str) -> AccuracySetting {
    AccuracySetting::new(SettingFamily::Tolerance, name, &[&format!("solver.accuracy={name}")])
}

fn reference() -> AccuracySetting {
    tolerance("reference")
}

fn euler(family: SettingFamily, name: &str, accuracy: &str) -> AccuracySetting {
    AccuracySetting::new(family, name, &[&format!("solver.accuracy={accuracy}"), "solver.integrator=euler"])
}

fn rapier(name: &str, accuracy: &str) -> AccuracySetting {
    let set = [format!("solver.accuracy={accuracy}"), "solver.engine=rapier".to_owned()];
    AccuracySetting { family: SettingFamily::Rapier, name: name.to_owned(), set: set.to_vec() }
}

fn joints(count: u32) -> AccuracySetting {
    let set = format!("gripper.finger.joints={count}");
    AccuracySetting::new(SettingFamily::Joints, &format!("N = {count}"), &[&set])
}

fn taxels(rows: u32, columns: u32) -> AccuracySetting {
    let set = [format!("gripper.pad.rows={rows}"), format!("gripper.pad.columns={columns}")];
    let name = format!("{rows} × {columns}");
    AccuracySetting { family: SettingFamily::Taxels, name, set: set.to_vec() }
}

fn settings() -> Vec<AccuracySetting> {
    let mut all: Vec<AccuracySetting> =
        ["draft", "3e-4", "standard", "3e-5", "1e-5", "3e-6", "reference"].map(tolerance).to_vec();
    all.extend(["1e-2", "1e-3", "1e-4"].map(|name| euler(SettingFamily::EulerTolerance, name, name)));
    let steps = [("1/150 s", "draft"), ("1/300 s", "standard"), (SLOWEST_STEPS, "reference")];
    all.extend(steps.map(|(name, accuracy)| euler(SettingFamily::EulerSteps, name, accuracy)));
    all.extend([rapier("1/150 s", "draft"), rapier("1/300 s", "standard")]);
    all.extend([5, 7, 10, 14, 20].map(joints));
    all.extend([(10, 1), (20, 2), (40, 4), (80, 8)].map(|(rows, columns)| taxels(rows, columns)));
    all
}

/// Settings of training grasps: cheap to dear, and other ways to be inaccurate.
fn trained() -> Vec<AccuracySetting> {
    let mut all: Vec<AccuracySetting> = ["draft", "standard", "1e-5", "reference"].map(tolerance).to_vec();
    all.push(euler(SettingFamily::EulerTolerance, "1e-2", "1e-2"));
    all.push(rapier("1/150 s", "draft"));
    all.extend([joints(5), taxels(10, 1)]);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_one_that_scenes_take() -> Result<(), SceneError> {
        let plan = AccuracyPlan::full();
        for setting in plan.settings.iter().chain(&plan.recognition.settings) {
            let mut scene = Scene::default();
            scene.solver.integrator = Integrator::Euler;
            scene.solver.engine = EngineKind::Rapier;
            let adopted = setting.adopted(&scene)?;
            assert_eq!(adopted == Scene::default(), setting.is_default() || has_default_model(setting), "{setting:?}");
            let finer: Vec<String> = setting.family.finer_model().iter().map(|set| (*set).to_owned()).collect();
            scene.with_settings(&finer)?;
        }
        assert_eq!(plan.settings.iter().filter(|setting| setting.is_default()).count(), 1);
        Ok(())
    }

    fn has_default_model(setting: &AccuracySetting) -> bool {
        ["N = 10", "40 × 4"].contains(&&*setting.name)
    }

    #[test]
    fn names_are_unique_within_a_family() {
        let settings = settings();
        for (n, one) in settings.iter().enumerate() {
            assert!(settings[..n].iter().all(|other| (other.family, &other.name) != (one.family, &one.name)));
        }
        assert!(AccuracyPlan::quick().settings.len() > 18);
    }
}
