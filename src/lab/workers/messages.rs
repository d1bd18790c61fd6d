//! What travels between the simulation's thread and whoever watches it: commands in, snapshots, rows and notices out.

use crate::grasping::{GraspSummary, IdentificationView, Row};
use crate::picture::Stage;
use crate::study::AccuracyCost;
use glam::DVec3;
use palpate_learn::Model;
use palpate_sim::frame::{Frame, Plan};
use palpate_sim::objects::{EMPTY, ObjectClass};
use palpate_sim::scene::Scene;
use palpate_tactile::trial::TrialId;
use palpate_tactile::{Channel, SensorLayout};
use std::path::PathBuf;
use std::sync::Arc;

/// Called whenever there is something new to show.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// What the simulation can be told.
#[derive(Clone, Debug)]
pub enum Command {
    /// Grasp another scene, from its start.
    SetScene(Box<Scene>),
    /// Go on.
    Play,
    /// Stand still.
    Pause,
    /// Advance by one sample, then stand still.
    Step,
    /// Back to the start of this grasp.
    Reset,
    /// Seconds of simulation per second on the wall.
    SetSpeed(f64),
    /// How many grasps to make before stopping; with a model, at most.
    SetGrasps(u32),
    /// From which probability on a class is taken as certain; brought inside of [`super::THRESHOLDS`].
    SetThreshold(f64),
    /// Whether trials are stored.
    SetRecording(bool),
    /// Whether a companion runs along for the numerical error band; the grasp begins anew.
    SetErrorBand(bool),
    /// Whether the other engine computes each grasp too, for [`super::SimWorker::ghost`].
    SetGhost(bool),
    /// Pull at the object with this force (N, world axes); zero lets go.
    Pull(DVec3),
    /// End the thread.
    Quit,
}

/// What the simulation tells besides pictures and traces.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// Something that was asked for is done.
    Info(String),
    /// Something about the grasp that the user should know.
    Warning(String),
    /// Something failed; the sentence says what, and what to try.
    Failed(String),
    /// A scene could not be set up; the one before goes on.
    SceneRefused(Box<Refusal>),
    /// A trial is in the store.
    Stored(TrialId),
}

/// A scene that could not be set up.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// The scene.
    pub refused: Scene,
    /// The scene that goes on instead.
    pub kept: Scene,
    /// Why, in a sentence for the user.
    pub cause: String,
}

/// Why a command was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotSent {
    /// Too many are waiting.
    #[error("the simulation is busy; try again in a moment")]
    Busy,
    /// The thread has ended.
    #[error("the simulation has stopped; restart Palpate")]
    Gone,
}

/// One sample as plots need it.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceRow {
    /// Which grasp it belongs to; rises by one with each.
    pub grasp: u64,
    /// It belongs to no grasp: the gripper is watched, and what is long ago is of no interest.
    pub rolling: bool,
    /// Time in the grasp (s).
    pub t: f64,
    /// Line pressure (bar).
    pub line_bar: f64,
    /// One value per channel of the snapshot's list; NaN where undefined.
    pub values: Box<[f32]>,
    /// Estimated numerical error of each value, in its unit; empty without a companion.
    pub errors: Box<[f32]>,
}

impl TraceRow {
    /// A row of a board in its place: time counts from `from_s`.
    pub(super) fn placed(row: Row, grasp: u64, from_s: f64, rolling: bool) -> Self {
        Self { grasp, rolling, t: row.t_s - from_s, line_bar: row.line_bar, values: row.values, errors: Box::default() }
    }
}

/// What the accuracy of a scene costs and leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredAccuracy {
    /// The scene, in the pose it is written with.
    pub scene: Scene,
    /// CPU time, and the estimated error.
    pub cost: AccuracyCost,
}

/// What is known of the object in the hand.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectCard {
    /// Short name.
    pub name: String,
    /// What people call it.
    pub title: String,
    /// Size and shape class, where known.
    pub class: Option<ObjectClass>,
    /// Mass (kg).
    pub mass: f64,
    /// Friction coefficient.
    pub friction: f64,
    /// Extents (m).
    pub size: DVec3,
}

/// Where the simulation stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// An object that is being loaded.
    pub loading: Option<String>,
    /// Time passes.
    pub playing: bool,
    /// The last grasp has ended.
    pub finished: bool,
    /// Wanted speed, as a multiple of real time.
    pub target_speed: f64,
    /// Speed over the last half second or so; zero while standing still.
    pub actual_speed: f64,
    /// Which grasp of this round, from 1.
    pub grasp_of_round: u32,
    /// Grasps in a round; with a model the most.
    pub grasps: u32,
    /// Length of a trial (s).
    pub duration: f64,
    /// Trials are being stored.
    pub recording: bool,
    /// A companion runs along for the numerical error band.
    pub error_band: bool,
}

/// A grasp that has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedGrasp {
    /// Its number, as in [`TraceRow::grasp`].
    pub grasp: u64,
    /// What it came to.
    pub summary: GraspSummary,
}

/// The newest state of everything, to be drawn.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Rises with every new frame or change.
    pub revision: u64,
    /// The number of the grasp, as in [`TraceRow::grasp`].
    pub grasp: u64,
    /// The scene as it was set up, with this grasp's pose.
    pub scene: Arc<Scene>,
    /// Which effects this grasp takes into account, and why.
    pub plan: Arc<Plan>,
    /// Meshes for the picture.
    pub stage: Arc<Stage>,
    /// What is in the hand; absent for an empty hand.
    pub object: Option<Arc<ObjectCard>>,
    /// What the values of trace rows are.
    pub channels: Arc<[Channel]>,
    /// The newest frame.
    pub frame: Arc<Frame>,
    /// Where the simulation stands.
    pub status: Status,
    /// The last grasp that ended.
    pub last: Option<Arc<FinishedGrasp>>,
    /// What is recognised; absent without a model, and where it cannot read this gripper.
    pub identification: Option<Arc<IdentificationView>>,
    /// Why nothing is recognised in this scene, where there is a model.
    pub recognition_off: Option<Arc<str>>,
}

impl Snapshot {
    /// What is in the hand in truth, by the name that classes have.
    pub fn truth(&self) -> &str {
        self.object.as_ref().map_or(EMPTY, |object| &object.name)
    }
}

/// Initial state of a simulation worker.
pub struct SimWorkerSetup {
    /// First scene.
    pub scene: Scene,
    /// Sensor layout of the traces.
    pub layout: SensorLayout,
    /// Trial store.
    pub store: PathBuf,
    /// Whether trials are stored from the start.
    pub recording: bool,
    /// Grasps in a round. With a model this is the limit: a round ends once the object is recognised.
    pub grasps: u32,
    /// Recognition model; none turns recognition off.
    pub model: Option<Arc<Model>>,
    /// Whether the simulation runs from the start.
    pub playing: bool,
    /// Called when there is something new.
    pub wake: Wake,
}
