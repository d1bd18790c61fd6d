//! What a study is to run on: its size, grasps, sensors and seed.

use crate::frame::{StudyCommand, StudySize};
use palpate_lab::datasets::{Cut, DatasetQuery, PhysicsVersion, SensorView};
use palpate_learn::Method;
use palpate_sim::objects::catalogue;
use palpate_sim::scene::{Between, Scene};
use palpate_tactile::model::SensorModel;

/// Grasps that a study wants, and the sensors that it reads them through.
#[derive(Clone, Debug, PartialEq)]
pub struct DataWanted {
    /// Gripper, programme and all else that is not named below.
    pub scene: Scene,
    /// Objects; those of the plan where the list is empty.
    pub objects: Vec<String>,
    /// Name of the pose preset.
    pub preset: String,
    /// True for objects that are fixed in place.
    pub fixed: bool,
    /// Treatment of the object between two grasps.
    pub between: Between,
    /// Grasps of each object.
    pub grasps: usize,
    /// Seed of the poses.
    pub poses: u64,
    /// How much the build of the gripper varies.
    pub build: f64,
    pub view: SensorView,
}

impl DataWanted {
    /// The same for a method: networks as the paper has them read whole grasps, the others until the end of the hold.
    pub fn read_by(mut self, method: &Method) -> Self {
        if method.is_strict() {
            self.view.cut = Cut::Whole;
        }
        self
    }
}

/// Plan of a study: everything that its results depend on, but the program.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyPlan {
    /// Amount of work.
    pub size: StudySize,
    /// Name of the pose preset of simulated grasps.
    pub preset: String,
    /// Sensor models that simulated grasps are read through.
    pub sensors: Vec<SensorModel>,
    /// Trials to read from the store; simulated ones are collected where there is none.
    pub query: Option<DatasetQuery>,
    /// Seed of fits, splits and draws.
    pub seed: u64,
}

/// Seed of the poses of collected grasps: not one that settings were chosen with.
pub(super) const POSES: u64 = 7;

/// Preset of all studies: objects that lie on any of their faces.
pub const STUDY_PRESET: &str = "B";

impl StudyPlan {
    /// The usual plan of a size: preset B, virtual and physical-like sensors.
    pub fn of_size(size: StudySize) -> Self {
        let (preset, sensors) = (STUDY_PRESET.to_owned(), SensorModel::BOTH.to_vec());
        Self { size, preset, sensors, query: None, seed: 1 }
    }

    /// What belongs to the size: of a full study, a quick one, or a sample.
    pub fn pick<T>(&self, full: T, quick: T, sample: T) -> T {
        match self.size {
            StudySize::Full => full,
            StudySize::Quick => quick,
            StudySize::Sample { .. } => sample,
        }
    }

    /// Grasps of each object: of a full study, of a quick one, or those of the sample.
    pub fn grasps(&self, full: usize, quick: usize) -> usize {
        match self.size {
            StudySize::Full => full,
            StudySize::Quick => quick,
            StudySize::Sample { trials, .. } => trials,
        }
    }

    /// True where fits are shortened; their results are not to be quoted.
    pub fn has_quick_fits(&self) -> bool {
        self.size != StudySize::Full
    }

    /// Built-in objects that are grasped: all sixteen, or some of a sample, spread over the catalogue.
    pub fn objects(&self) -> Vec<String> {
        let all: Vec<String> = catalogue().iter().map(|built_in| built_in.name.clone()).collect();
        match self.size {
            StudySize::Full | StudySize::Quick => all,
            StudySize::Sample { objects, .. } => {
                let count = objects.clamp(1, all.len());
                (0..count).map(|k| all[k * all.len() / count].clone()).collect()
            }
        }
    }

    /// Free objects that are put down anew for each grasp, read through the default layout.
    pub fn wanted(&self, grasps: usize, sensors: SensorModel) -> DataWanted {
        DataWanted {
            scene: Scene::default(),
            objects: Vec::new(),
            preset: self.preset.clone(),
            fixed: false,
            between: Between::Reposed,
            grasps,
            poses: POSES,
            build: 0.0,
            view: SensorView { sensors, ..SensorView::default() },
        }
    }

    /// The plan as stored with results: other plans do not continue them.
    pub(super) fn header(&self) -> serde_json::Value {
        serde_json::json!({
            "size": self.size,
            "preset": self.preset,
            "sensors": self.sensors,
            "query": self.query.as_ref().map(|query| format!("{query:?}")),
            "seed": self.seed,
        })
    }

    /// Origin of the grasps, for titles.
    pub(super) fn described(&self) -> String {
        match self.query {
            None => format!("preset {}", self.preset),
            Some(_) => "stored trials".to_owned(),
        }
    }

    /// The command line that runs a study with this plan.
    pub(super) fn command(&self, key: &str) -> StudyCommand {
        let (usual, query) = (Self::of_size(self.size), self.query.clone().unwrap_or_default());
        let sample = match self.size {
            StudySize::Sample { objects, trials } => format!(" (a sample of {objects} objects, {trials} trials)"),
            StudySize::Full | StudySize::Quick => String::new(),
        };
        let sensors = match self.sensors.as_slice() {
            [only] if self.query.is_none() => Some(only.name()),
            _ => None,
        };
        let physics = query.physics.map(|physics| match physics {
            PhysicsVersion::Known(version) => version.to_string(),
            PhysicsVersion::Unknown => "unknown".to_owned(),
        });
        let listed = |values: Vec<String>| (!values.is_empty()).then(|| values.join(","));
        StudyCommand::new(&format!("{key}{sample}"))
            .flag("quick", self.size == StudySize::Quick)
            .option("preset", (self.preset != usual.preset || query.preset.is_some()).then_some(&self.preset))
            .option("sensors", sensors)
            .option("collection", query.collection)
            .option("source", query.source)
            .option("tag", query.tag)
            .option("since", query.since)
            .option("until", query.until)
            .option("physics", physics)
            .option("calibration", listed(query.calibrations.iter().map(ToString::to_string).collect()))
            .option("objects", listed(query.objects))
            .flag("include-flagged", query.include_flagged)
            .option("seed", (self.seed != usual.seed).then_some(self.seed))
    }
}
