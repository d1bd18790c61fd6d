//! Trials: recorded grasps. Raw quantities only; curvature, pressure and every sensor layout are derived from them later.

use palpate_geometry::Pose;
use palpate_sim::frame::{Frame, Plan, Quality};
use palpate_sim::gripper::Phase;
use serde::{Deserialize, Serialize};

/// Names a trial within its store.
pub type TrialId = i64;

/// From when on the control box of a real gripper did something.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseMark {
    /// On the clock of the readings (s).
    pub from_s: f64,
    /// What.
    pub phase: Phase,
    /// Commanded line pressure (bar), where this program commands it.
    pub line_bar: Option<f64>,
}

/// What is known of a trial besides its frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrialInfo {
    /// Where it came from: `sim` for a simulated gripper.
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
    /// Where the gripper was held.
    pub world_from_gripper: Pose,
    /// Which effects were simulated; empty for a trial that was not, and for old ones.
    #[serde(default)]
    pub plan: Plan,
    /// How far it can be trusted.
    pub quality: Quality,
    /// What was guessed, mended or cut short.
    pub warnings: Vec<String>,
    /// Version of the program that made it.
    pub version: String,
}

/// One recorded grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// What is known of it.
    pub info: TrialInfo,
    /// Its samples, in order.
    pub frames: Vec<Frame>,
}

/// Who moves the fingers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Control {
    /// Nobody, or nobody says: no phases are known.
    Free,
    /// A person at the control box, at the times of the programme.
    ByHand,
    /// This program, through the board.
    Driven,
}
