//! Trials: recorded grasps. Raw quantities only; curvature, pressure and every sensor layout are derived from them
//! later.

use palpate_geometry::Pose;
use palpate_sim::frame::{Frame, Plan, Quality};
use palpate_sim::gripper::Phase;
use serde::{Deserialize, Serialize};

/// Names a trial within its store.
pub type TrialId = i64;

/// Begin of a phase on a real gripper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseMark {
    /// Begin, on the clock of the readings (s).
    pub from_s: f64,
    /// Phase.
    pub phase: Phase,
    /// Commanded line pressure (bar), where this program commands it.
    pub line_bar: Option<f64>,
}

/// Facts of a trial besides its frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrialInfo {
    /// Source: `sim` for a simulated gripper.
    pub rig: String,
    /// Name of the object.
    pub object: String,
    /// Seed from which the pose was drawn; 0 where the scene's own pose was used.
    pub seed: u64,
    /// The data set it was made for, if any; within one, object and seed name a trial.
    #[serde(default)]
    pub collection: Option<String>,
    /// The whole scene as TOML, every key written out.
    pub scene: String,
    /// Pose of the gripper in the world.
    pub world_from_gripper: Pose,
    /// Effects simulated; empty for real grippers and old trials.
    #[serde(default)]
    pub plan: Plan,
    /// Numerical quality.
    pub quality: Quality,
    /// Warnings: values guessed, meshes repaired, recording cut short.
    pub warnings: Vec<String>,
    /// Version of the program that made it.
    pub version: String,
}

/// One recorded grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Facts.
    pub info: TrialInfo,
    /// Its samples, in order.
    pub frames: Vec<Frame>,
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
