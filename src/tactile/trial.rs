//! Trials: recorded grasps. Raw quantities only; curvature, pressure and every sensor layout are derived from them
//! later.

use crate::Signals;
use crate::board::{Board, Detected, Gap, Reading};
use crate::cadence::Cadence;
use palpate_geometry::Pose;
use palpate_sim::PHYSICS_VERSION;
use palpate_sim::frame::{Frame, Plan, Quality};
use palpate_sim::gripper::Phase;
use palpate_sim::scene::Scene;
use serde::{Deserialize, Serialize, Serializer};

/// Names a trial within its store.
pub type TrialId = i64;

/// Begin of a phase on a real gripper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseMark {
    /// Begin, on the clock of the readings (s).
    pub from_s: f64,
    pub phase: Phase,
    /// Commanded line pressure (bar), where this program commands it.
    pub line_bar: Option<f64>,
}

/// Origin of a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrialSource {
    /// A simulated gripper.
    #[default]
    Simulated,
    /// A real gripper.
    Recorded,
    /// A file of another program.
    Imported,
}

/// A text that names no [`TrialSource`] of this version.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown source \"{0}\"; choose sim, serial or import")]
pub struct UnknownSource(
    /// The text.
    pub String,
);

impl TrialSource {
    /// All sources.
    pub const ALL: [Self; 3] = [Self::Simulated, Self::Recorded, Self::Imported];

    /// Name in stores, in JSON and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Simulated => "sim",
            Self::Recorded => "serial",
            Self::Imported => "import",
        }
    }

    /// Name in sentences.
    pub fn title(self) -> &'static str {
        match self {
            Self::Simulated => "simulated",
            Self::Recorded => "recorded",
            Self::Imported => "imported",
        }
    }
}

impl std::fmt::Display for TrialSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for TrialSource {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl std::str::FromStr for TrialSource {
    type Err = UnknownSource;

    fn from_str(name: &str) -> Result<Self, UnknownSource> {
        Self::ALL.into_iter().find(|source| source.name() == name).ok_or_else(|| UnknownSource(name.to_owned()))
    }
}

/// Facts that trials of all sources have.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialHeader {
    /// Name of the object; empty while unlabelled.
    pub object: String,
    /// Seed from which the pose was drawn; 0 where the scene's own pose was used.
    pub seed: u64,
    /// The data set it was made for, if any; within one, object and seed name a trial.
    pub collection: Option<String>,
    /// Scene: the default one where none was stored.
    pub scene: Scene,
    /// Warnings: values guessed, meshes repaired, recording cut short.
    pub warnings: Vec<String>,
    /// Version of the program that made it.
    pub version: String,
    /// Grasps of the same object before it, where a recogniser has judged them.
    pub earlier: Option<EarlierGrasps>,
    /// Phases that a person corrected; none where they are as measured.
    pub phases: Option<CorrectedPhases>,
    /// What a simulated grasp was computed from; none for other trials and those of early versions.
    pub origin: Option<GraspOrigin>,
}

/// Beginnings of the phases of a grasp as a person set them (s, from the beginning of the trial); a phase without one is as
/// measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CorrectedPhases {
    /// The fingers begin to close.
    pub closing: Option<f64>,
    /// A finger touches the object.
    pub contact: Option<f64>,
    /// The line pressure stays.
    pub hold: Option<f64>,
    /// The line pressure falls.
    pub release: Option<f64>,
}

/// What a simulated grasp was computed from, beside its scene and seed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GraspOrigin {
    /// Version of the physics.
    pub physics: u32,
    /// Hash of the object's files; 0 for an empty hand.
    pub object: u64,
    /// Hash of the pulls at the object; 0 without any.
    #[serde(default)]
    pub pulls: u64,
    /// Identity of the grasp before, if the object has stayed as that one released it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<String>,
}

impl GraspOrigin {
    /// What a reader of the trial has to know where it comes from other physics than this version's.
    pub fn other_physics(&self) -> Option<String> {
        let older = if self.physics < PHYSICS_VERSION { "older" } else { "newer" };
        (self.physics != PHYSICS_VERSION).then(|| {
            format!(
                "Simulated with {older} physics ({}, this version has {PHYSICS_VERSION}): shown as it was; simulated again, it \
                 gives other values.",
                self.physics
            )
        })
    }
}

/// Grasps of the same object before a trial, as a recogniser judged them: its answers to the trial build on them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EarlierGrasps {
    /// Description of the recogniser.
    pub model: String,
    /// Probabilities of its classes after each grasp: combined with the grasps before, and of the grasp alone.
    pub judged: Vec<[Vec<f64>; 2]>,
}

impl TrialHeader {
    /// Header of a trial made by this version, without seed, collection and warnings.
    pub fn new(object: &str, scene: Scene) -> Self {
        Self {
            object: object.to_owned(),
            seed: 0,
            collection: None,
            scene,
            warnings: Vec::new(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            earlier: None,
            phases: None,
            origin: None,
        }
    }

    /// Identity of a simulated grasp: equal for grasps of equal objects in equal scenes and poses, with equal seeds and
    /// pulls, by the same version of the physics, wherever the object's files lie. None where the origin is unknown.
    pub fn identity(&self) -> Option<String> {
        let GraspOrigin { physics, object, pulls, after: _ } = self.origin.as_ref()?;
        let numbers = [u64::from(*physics), *object, *pulls, self.seed].map(u64::to_le_bytes);
        let texts = [self.object.clone(), self.scene.differences()];
        let texts = texts.iter().map(String::as_bytes);
        let parts = texts.chain(numbers.iter().map(<[u8; 8]>::as_slice));
        Some(format!("{:016x}", palpate_sim::fingerprint(parts)))
    }
}

/// Data of a simulated trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedData {
    pub world_from_gripper: Pose,
    /// Effects simulated; empty for trials of early versions.
    pub plan: Plan,
    /// Numerical quality.
    pub quality: Quality,
    /// Samples, in order.
    pub frames: Vec<Frame>,
}

/// Board and course of a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct BoardCourse {
    pub board: Board,
    /// Detected format of its lines.
    pub detected: Option<Detected>,
    /// Beginning of the trial, on the clock of the readings (s).
    pub began_s: f64,
    /// Timing of the board; all zero while recording.
    pub cadence: Cadence,
    /// Number of reconnections during the trial.
    pub reconnects: u32,
    /// Phases of the grasp, where known.
    pub phases: Vec<PhaseMark>,
}

/// Data of a trial of a real gripper, as its board sent them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoardLog {
    pub course: BoardCourse,
    /// Readings, in order.
    pub readings: Vec<Reading>,
    /// Gaps: missing readings.
    pub gaps: Vec<Gap>,
}

/// Data of a trial, by source.
#[derive(Clone, Debug, PartialEq)]
pub enum TrialData {
    /// Simulated frames.
    Simulated(SimulatedData),
    /// Readings of a board.
    Recorded(BoardLog),
    /// Channels of a file.
    Imported(Signals),
}

/// One grasp: a header and its data.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial<D = TrialData> {
    /// Facts that trials of all sources have.
    pub header: TrialHeader,
    pub data: D,
}

/// A trial known to be simulated.
pub type SimulatedTrial = Trial<SimulatedData>;

impl Trial {
    /// Origin.
    pub fn source(&self) -> TrialSource {
        match self.data {
            TrialData::Simulated(_) => TrialSource::Simulated,
            TrialData::Recorded(_) => TrialSource::Recorded,
            TrialData::Imported(_) => TrialSource::Imported,
        }
    }

    /// Simulated samples; empty for other sources.
    pub fn frames(&self) -> &[Frame] {
        self.simulated().map_or(&[], |data| &data.frames)
    }

    /// Data of a simulated trial.
    pub fn simulated(&self) -> Option<&SimulatedData> {
        match &self.data {
            TrialData::Simulated(data) => Some(data),
            TrialData::Recorded(_) | TrialData::Imported(_) => None,
        }
    }
}

impl SimulatedTrial {
    /// Samples, in order.
    pub fn frames(&self) -> &[Frame] {
        &self.data.frames
    }
}

impl From<SimulatedTrial> for Trial {
    fn from(trial: SimulatedTrial) -> Self {
        Self { header: trial.header, data: TrialData::Simulated(trial.data) }
    }
}

/// Actuation of the fingers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Control {
    /// Untimed: no phases are known.
    Free,
    /// A person at the control box, at the times of the programme.
    ByHand,
    /// This program, through the board.
    Driven,
}
