//! Messages of the simulation thread: commands in, snapshots, rows and notices out.

use crate::datasets::SensorView;
use crate::grasping::{AccuracyCost, GraspSummary, GripperMove, IdentificationView, Row};
use crate::picture::Stage;
use glam::DVec3;
use palpate_learn::Models;
use palpate_sim::frame::{Frame, Plan};
use palpate_sim::objects::{EMPTY, ObjectClass};
use palpate_sim::scene::{Accuracy, EngineKind, Scene};
use palpate_store::{Stored, TrialPlace};
use palpate_tactile::Channel;
use std::path::PathBuf;
use std::sync::Arc;

/// Called whenever there is something new to show.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Command to the simulation.
#[derive(Clone, Debug)]
pub enum Command {
    /// Grasp another scene, from its start.
    SetScene(Box<Scene>),
    /// Continue.
    Play,
    /// Pause.
    Pause,
    /// Advance by one sample, then pause.
    Step,
    /// Back to the start of this grasp.
    Reset,
    /// Simulation speed as a multiple of real time.
    SetSpeed(f64),
    /// Number of grasps in a round; with a model, the maximum.
    SetGrasps(u32),
    /// Probability from which a class counts as certain; clamped to [`super::THRESHOLDS`].
    SetThreshold(f64),
    /// Continue a decided round, if the threshold was since raised above the probability reached.
    GraspOnceMore,
    /// Sensors to read from now on; restarts the grasp. Only ideal sensors: models of real sensors are applied to
    /// finished trials.
    SetSensors(SensorView),
    /// Recogniser to use from now on; restarts the grasp.
    SetModels(Models),
    /// Whether the first grasp of each object too has a random pose instead of the pose of the scene; from the next
    /// scene on, whose poses begin with the first seeds again.
    SetFirstDrawn(bool),
    /// Place to record trials in from now on; without one, trials are not recorded.
    SetRecording(Option<TrialPlace>),
    /// Whether a refined run accompanies each grasp for the numerical error band; restarts the grasp.
    SetErrorBand(bool),
    /// Whether the other engine computes each grasp too, for [`super::SimWorker::ghost`].
    SetGhost(bool),
    /// Compute the last finished grasp again until three levels of accuracy agree, and show and store that result instead;
    /// pauses.
    ComputeAgain,
    /// Pull the object with this force (N, world axes); zero releases it.
    Pull(DVec3),
}

/// Notice of a thread to the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// A command is done.
    Info(String),
    /// Warning about the grasp.
    Warning(String),
    /// Failure, with what to try.
    Failed(String),
    /// A scene could not be set up; the previous one stays.
    SceneRefused(Box<Refusal>),
    /// A trial is in the store.
    Stored(Stored),
    /// A grasp was sent to the demo log: the trial that now holds it, and where that trial is.
    Logged(Stored, TrialPlace),
}

/// A scene that could not be set up.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// The scene.
    pub refused: Scene,
    /// The scene that stays instead.
    pub kept: Scene,
    /// Cause, in a sentence for the user.
    pub cause: String,
}

/// One sample for plots.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceRow {
    /// Number of its grasp; rises by one with each.
    pub grasp: u64,
    /// True outside of grasps: live view, of which plots show only the last seconds.
    pub rolling: bool,
    /// The sample, with its time since the beginning of the trial and a value per channel of the snapshot's list.
    pub sample: Row,
    /// Time at which the fingers begin or began to close (s); zero where unknown.
    pub closing_s: f64,
    /// Estimated numerical error of each value, in its unit; empty without a refined run.
    pub errors: Box<[f32]>,
    /// Fingers and object at that time; none for a real gripper.
    pub frame: Option<Arc<Frame>>,
    /// The recogniser's answer at that time, where it has one.
    pub answer: Option<Arc<IdentificationView>>,
}

/// Cost and error of the accuracy of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredAccuracy {
    /// The scene, in the pose it is written with.
    pub scene: Scene,
    /// CPU time, and the estimated error.
    pub cost: AccuracyCost,
}

/// A whole grasp, computed by another engine.
#[derive(Debug)]
pub struct GhostGrasp {
    /// The grasp it belongs to, as in [`TraceRow::grasp`].
    pub grasp: u64,
    /// Engine that computed it.
    pub engine: EngineKind,
    /// Its samples, the state before the first step included.
    pub frames: Vec<Frame>,
}

impl GhostGrasp {
    /// The sample at a time (s), or the last one before.
    pub fn at(&self, t: f64) -> Option<&Frame> {
        let after = self.frames.partition_point(|frame| frame.t <= t + 1e-9);
        after.checked_sub(1).and_then(|k| self.frames.get(k))
    }
}

/// Description of the held object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectCard {
    /// Short name.
    pub name: String,
    /// Hash of its files.
    pub content: u64,
    /// Name for display.
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

/// State of the simulation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Object being loaded.
    pub loading: Option<String>,
    /// The simulation runs.
    pub playing: bool,
    /// The last grasp has ended.
    pub finished: bool,
    /// Target speed as a multiple of real time.
    pub target_speed: f64,
    /// Speed over the last half second or so; zero while paused.
    pub actual_speed: f64,
    /// Number of the grasp in this round, from 1.
    pub grasp_of_round: u32,
    /// Grasps in a round; with a model, the maximum.
    pub grasps: u32,
    /// Length of a trial (s).
    pub duration: f64,
    /// Where trials are recorded.
    pub recording: Option<TrialPlace>,
    /// A refined run computes the numerical error band.
    pub error_band: bool,
    /// What is being done to check the last finished grasp.
    pub checking: Option<Checking>,
    /// Move of the gripper that was chosen for this grasp, if any.
    pub guided: Option<GripperMove>,
    /// The pads do not touch the object at the end of this grasp's hold, or at the newest time in it.
    pub nothing_held: bool,
}

/// Check of how far a finished grasp can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Checking {
    /// Other runs are computed to compare with.
    Comparing,
    /// The grasp is computed again until three levels agree.
    ComputingAgain,
}

/// A grasp that has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedGrasp {
    /// Its number, as in [`TraceRow::grasp`].
    pub grasp: u64,
    /// Summary; its quality says how far it can be trusted.
    pub summary: GraspSummary,
    /// Accuracy that it was computed at.
    pub accuracy: Accuracy,
    /// False where it cannot be computed again more finely: the object was pulled by hand, or the engine controls no
    /// error.
    pub repeatable: bool,
}

/// The newest state of everything, to be drawn.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Rises with every new frame or change.
    pub revision: u64,
    /// The number of the grasp, as in [`TraceRow::grasp`].
    pub grasp: u64,
    /// Number of the first grasp of the scene: earlier ones had another object or other settings.
    pub scene_since: u64,
    /// The scene as it was set up, with this grasp's pose.
    pub scene: Arc<Scene>,
    /// Effects of this grasp, with the reason for each.
    pub plan: Arc<Plan>,
    /// Meshes for the picture.
    pub stage: Arc<Stage>,
    /// Held object; absent for an empty hand.
    pub object: Option<Arc<ObjectCard>>,
    /// Channels of trace rows.
    pub channels: Arc<[Channel]>,
    /// The newest frame.
    pub frame: Arc<Frame>,
    /// State of the simulation.
    pub status: Status,
    /// The last grasp that ended.
    pub last: Option<Arc<FinishedGrasp>>,
    /// Recognition; absent without a model, and where the model does not fit this gripper.
    pub identification: Option<Arc<IdentificationView>>,
    /// Reason why the model recognises nothing in this scene.
    pub recognition_off: Option<Arc<str>>,
    /// Cost and error of the accuracy of the last measured scene.
    pub accuracy: Option<Arc<MeasuredAccuracy>>,
    /// The newest grasp that the other engine has computed; its number tells which.
    pub ghost: Option<Arc<GhostGrasp>>,
}

impl Snapshot {
    /// Class name of the held object.
    pub fn truth(&self) -> &str {
        self.object.as_ref().map_or(EMPTY, |object| &object.name)
    }

    /// Whether the decision is right; none before it, and for a name that is given to an object that the model does not know.
    pub fn is_right(&self, view: &IdentificationView) -> Option<bool> {
        let is_known = view.labels.class(self.truth()).is_some();
        view.is_right(self.truth(), self.status.nothing_held).filter(|right| *right || is_known)
    }
}

/// Initial state of a simulation worker.
pub struct SimWorkerSetup {
    /// First scene.
    pub scene: Scene,
    /// Sensors of the traces.
    pub sensors: SensorView,
    /// Trial store.
    pub store: PathBuf,
    /// Where trials are recorded from the start.
    pub recording: Option<TrialPlace>,
    /// Grasps in a round. With a model this is the limit: a round ends once the object is recognised.
    pub grasps: u32,
    /// Recognition models; without one, such grasps are not recognised.
    pub models: Models,
    /// Whether the simulation runs from the start.
    pub playing: bool,
    /// Called when there is something new.
    pub wake: Wake,
}
