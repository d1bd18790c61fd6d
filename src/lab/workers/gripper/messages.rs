//! What travels between the gripper's thread and a window: commands in, views out.

use super::calibrating::{CalibrationCommand, CalibrationView};
use super::crosstalk::{CrosstalkCommand, CrosstalkView};
use super::observing::ObserveRequest;
use crate::grasping::{GraspStage, IdentificationView};
use crate::gripper::{Listen, NotOpened};
use crate::recording::TrialRequest;
use crate::workers::messages::Wake;
use palpate_device::protocol::ConsoleLine;
use palpate_device::serial::{LinkStatus, PortInfo};
use palpate_learn::Model;
use palpate_sim::scene::Scene;
use palpate_tactile::Channel;
use palpate_tactile::calibration::{Drift, SensorEstimate};
use palpate_tactile::trial::TrialId;
use std::path::PathBuf;
use std::sync::Arc;

/// Initial state of the gripper thread.
pub struct GripperSetup {
    /// Model of the gripper, and the programme of its control box.
    pub scene: Scene,
    /// Store of trials and calibrations.
    pub store: PathBuf,
    /// Recognition model; none turns recognition off.
    pub model: Option<Arc<Model>>,
    /// Maximum number of grasps per object.
    pub grasps: u32,
    /// Opens ports.
    pub listen: Listen,
    /// Called when there is something new.
    pub wake: Wake,
}

/// What the gripper's thread can be told.
#[derive(Clone)]
pub enum GripperCommand {
    /// Look for ports anew.
    ListPorts,
    /// Listen to a port, a file of captured bytes, or without a name to the only likely port.
    Connect(Option<PathBuf>),
    /// Give the port back. A trial ends there.
    Disconnect,
    /// Vent the fingers at once. A trial ends there.
    Vent,
    /// Take what the sensors show now as zero: nothing may touch the fingers.
    Tare,
    /// The gripper as it is modelled, and the programme of its control box.
    SetScene(Box<Scene>),
    /// What recognises.
    SetModel(Option<Arc<Model>>),
    /// From which probability on a class is taken as certain.
    SetThreshold(f64),
    /// How many grasps are made at most before it stops.
    SetGrasps(u32),
    /// Another object is in the hand: the grasps so far count no more.
    AnotherObject,
    /// Begin a trial.
    Begin(TrialRequest),
    /// Begin and end trials by what the fingers do, from now on; or no more.
    Watch(Option<TrialRequest>),
    /// End the trial that goes on, and keep it.
    End,
    /// Give up the trial that goes on: it counts as discarded.
    Discard,
    /// Let the doctor look at the board.
    Observe(ObserveRequest),
    /// Something about a calibration.
    Calibrate(CalibrationCommand),
    /// Something about the doctor's crosstalk test.
    Crosstalk(CrosstalkCommand),
    /// End the thread.
    Quit,
}

/// The newest reading, and what it comes to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LatestReading {
    /// Counts by channel of the board.
    pub counts: Vec<Option<f32>>,
    /// Angle, curvature, force and pressure by the calibrations; nothing where there are none.
    pub felt: SensorEstimate,
    /// Which sensors, in the order of `Sensor::ALL`, show more than they were calibrated with.
    pub beyond: [bool; 4],
    /// Line pressure: as commanded, or as the board reports it (bar).
    pub line_bar: Option<f64>,
}

/// A trial that goes on.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialView {
    /// Its number; none before the store has given one.
    pub id: Option<TrialId>,
    /// The request.
    pub request: TrialRequest,
    /// Stage of the grasp.
    pub stage: GraspStage,
    /// How long this part will take from now (s), where it is known.
    pub left_s: Option<f64>,
    /// Time since the closing began; negative before it (s).
    pub t_s: f64,
    /// Length of the trial from the beginning of the closing (s), where it is known.
    pub length_s: Option<f64>,
    /// Readings so far.
    pub samples: u64,
}

impl TrialView {
    /// `trial 7`, or `trial` before it has a number.
    pub fn title(&self) -> String {
        self.id.map_or_else(|| "trial".to_owned(), |id| format!("trial {id}"))
    }
}

/// A trial that has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct EndedTrial {
    /// Its number.
    pub id: TrialId,
    /// What was asked for.
    pub request: TrialRequest,
    /// It was given up.
    pub discarded: bool,
    /// What should be known of it, in sentences.
    pub warnings: Vec<String>,
    /// How well the board kept time, in a line.
    pub cadence: String,
}

/// The newest state of everything about the real gripper.
#[derive(Clone, Debug, Default)]
pub struct GripperView {
    /// Rises with every change.
    pub revision: u64,
    /// Commands that have been handled, of those that were asked for; what is shown here came after them.
    pub handled: u64,
    /// The link; none while nothing is listened to.
    pub link: Option<LinkStatus>,
    /// Why the last port could not be opened.
    pub refused: Option<NotOpened>,
    /// The ports that were found last.
    pub ports: Vec<PortInfo>,
    /// The newest reading.
    pub latest: Option<LatestReading>,
    /// What the first values of trace rows are; counts by channel of the board follow.
    pub channels: Arc<[Channel]>,
    /// How far the zeros are from those of the calibrations.
    pub drift: Vec<Drift>,
    /// What is missing of the calibrations, in sentences.
    pub remarks: Vec<String>,
    /// The trial that goes on.
    pub trial: Option<TrialView>,
    /// What a trial would be that begins by itself.
    pub watching: Option<TrialRequest>,
    /// The last trial that ended.
    pub ended: Option<Arc<EndedTrial>>,
    /// Which stretch of trace rows is the newest.
    pub grasp: u64,
    /// What is recognised; absent without a model, and without the channels that it reads.
    pub identification: Option<Arc<IdentificationView>>,
    /// Why nothing is recognised.
    pub recognition_off: Option<Arc<str>>,
    /// Name of what recognises.
    pub model: Option<String>,
    /// A calibration.
    pub calibration: Option<Arc<CalibrationView>>,
    /// The doctor's crosstalk test.
    pub crosstalk: Option<Arc<CrosstalkView>>,
    /// The newest lines of the board.
    pub console: Arc<[ConsoleLine]>,
}

impl GripperView {
    /// True while a board is listened to.
    pub fn is_connected(&self) -> bool {
        self.link.is_some()
    }
}
