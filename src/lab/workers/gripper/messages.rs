//! Messages of the gripper thread: commands in, views out.

use super::calibrating::CalibrationCommand;
use super::guided::{CalibrationView, CrosstalkCommand, CrosstalkView};
use super::observing::ObserveRequest;
use crate::grasping::{GraspStage, IdentificationView};
use crate::gripper::{Listen, NotOpened};
use crate::recording::TrialRequest;
use crate::workers::messages::Wake;
use palpate_device::protocol::ConsoleLine;
use palpate_device::serial::{LinkState, LinkStatus, PortInfo};
use palpate_learn::Model;
use palpate_sim::scene::Scene;
use palpate_store::labels::FlagRemark;
use palpate_tactile::Channel;
use palpate_tactile::board::{Sensor, SensorList};
use palpate_tactile::calibration::{Drift, SensorEstimate};
use palpate_tactile::trial::{Control, TrialId};
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

/// Command to the gripper thread.
#[derive(Clone)]
pub enum GripperCommand {
    /// Read these sensors from now on; the store remembers them.
    SetSensors(SensorList),
    /// List the ports again.
    ListPorts,
    /// Open a port or a file of captured bytes; without a name, the only likely port.
    Connect(Option<PathBuf>),
    /// Close the port; ends a running trial.
    Disconnect,
    /// Vent the fingers at once; ends a running trial.
    Vent,
    /// Tare: take the present readings as zero. Nothing may touch the fingers.
    Tare,
    /// Set the model of the gripper and the programme of its control box.
    SetScene(Box<Scene>),
    /// Set the recognition model; none turns recognition off.
    SetModel(Option<Arc<Model>>),
    /// Probability from which a class counts as certain.
    SetThreshold(f64),
    /// Start over with another object; earlier grasps no longer count.
    AnotherObject,
    /// Move the line pressure to this value (bar; none for that of the programme), up at the pace of the programme and down at
    /// once, and keep it there until it is moved again or vented; not while a trial is driven.
    Press(Option<f64>),
    /// Begin a trial.
    Begin(TrialRequest),
    /// Record a close of the empty hand and calibrate the sensors by it, but not those that were calibrated by hand.
    Adapt(Control),
    /// Begin and end trials automatically when the fingers move; none turns this off.
    Watch(Option<TrialRequest>),
    /// End the running trial and keep it.
    End,
    /// End the running trial and discard it.
    Discard,
    /// Observe the board for the doctor.
    Observe(ObserveRequest),
    /// Calibration.
    Calibrate(CalibrationCommand),
    /// Crosstalk test.
    Crosstalk(CrosstalkCommand),
}

/// The newest reading, raw and converted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LatestReading {
    /// Counts by channel of the board.
    pub counts: Vec<Option<f32>>,
    /// Angle, curvature, force and pressure by the calibrations; empty without calibrations.
    pub estimate: SensorEstimate,
    /// Sensors outside their calibrated range.
    pub beyond: Vec<Sensor>,
    /// Line pressure: as commanded, or as the board reports it (bar).
    pub line_bar: Option<f64>,
}

/// Running trial.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialView {
    /// Its number; none before the store has given one.
    pub id: Option<TrialId>,
    /// The request.
    pub request: TrialRequest,
    /// Stage of the grasp.
    pub stage: GraspStage,
    /// Time left in this stage (s), where known; of an emulated hand that moves by itself, in the trial.
    pub left_s: Option<f64>,
    /// Time since its beginning (s).
    pub t_s: f64,
    /// Length (s), where it is known.
    pub length_s: Option<f64>,
    /// Readings so far.
    pub samples: u64,
    /// Detected from the movement of the fingers.
    pub automatic: bool,
    /// A close of the empty hand, to adapt to.
    pub adapting: bool,
    /// The gripper is emulated: nobody raises its pressure by hand.
    pub emulated: bool,
}

impl TrialView {
    /// `trial 7`, or `trial` before it has a number.
    pub fn title(&self) -> String {
        self.id.map_or_else(|| "trial".to_owned(), |id| format!("trial {id}"))
    }
}

/// Finished trial.
#[derive(Clone, Debug, PartialEq)]
pub struct EndedTrial {
    /// Its number.
    pub id: TrialId,
    /// The request.
    pub request: TrialRequest,
    /// True where it was discarded.
    pub discarded: bool,
    /// True where readings came until the end of the programme or the length.
    pub complete: bool,
    /// Flags that are faults for its object.
    pub flags: Vec<FlagRemark>,
    /// Warnings, in sentences.
    pub warnings: Vec<String>,
    /// Timing statistics of the board, in a line.
    pub cadence: String,
}

/// State of the real gripper.
#[derive(Clone, Debug, Default)]
pub struct GripperView {
    /// Rises with every change.
    pub revision: u64,
    /// Number of commands handled before this view.
    pub handled: u64,
    /// The link; none while disconnected.
    pub link: Option<LinkStatus>,
    /// Reason why the last port could not be opened.
    pub refused: Option<NotOpened>,
    /// Ports found last.
    pub ports: Vec<PortInfo>,
    /// The newest reading.
    pub latest: Option<LatestReading>,
    /// Sensors of the gripper that the store remembers.
    pub sensors: SensorList,
    /// Channels of the first values of trace rows; counts by channel of the board follow.
    pub channels: Arc<[Channel]>,
    /// Drift of the zeros since calibration.
    pub drift: Vec<Drift>,
    /// Remarks on missing calibrations, in sentences.
    pub remarks: Vec<String>,
    /// Line pressure that is kept outside of driven trials (bar).
    pub kept_bar: Option<f64>,
    /// Only the board moves the fingers: an emulated hand that was vented or driven no longer moves by itself, and nobody has a
    /// valve to move it with.
    pub driven_only: bool,
    /// Running trial.
    pub trial: Option<TrialView>,
    /// Request of automatic trials; none while they are off.
    pub watching: Option<TrialRequest>,
    /// Last finished trial.
    pub ended: Option<Arc<EndedTrial>>,
    /// Number of the newest stretch of trace rows.
    pub grasp: u64,
    /// Number of the first one with the present calibrations.
    pub calibrated: u64,
    /// Recognition; absent without a model, and without the channels that it reads.
    pub identification: Option<Arc<IdentificationView>>,
    /// Reason why recognition is off.
    pub recognition_off: Option<Arc<str>>,
    /// Sensors that have failed, and from what is answered: `left pad silent: answering from 3 channels`.
    pub failed: Option<Arc<str>>,
    /// Name of the recognition model.
    pub model: Option<String>,
    /// A calibration.
    pub calibration: CalibrationView,
    /// The doctor's crosstalk test.
    pub crosstalk: CrosstalkView,
    /// The newest lines of the board.
    pub console: Arc<[ConsoleLine]>,
}

impl GripperView {
    /// State of the link, in a sentence; empty while disconnected.
    pub fn link_state(&self) -> String {
        self.link.as_ref().map(|link| link.state.sentence()).unwrap_or_default()
    }

    /// True while a board is connected.
    pub fn is_connected(&self) -> bool {
        self.link.is_some()
    }

    /// True while the board that is connected is an emulated one.
    pub fn is_emulated(&self) -> bool {
        self.link.as_ref().is_some_and(|link| link.board.emulated)
    }

    /// True while a connected board sends no readings.
    pub fn is_silent(&self) -> bool {
        self.link.as_ref().is_some_and(|link| link.state != LinkState::Listening)
    }
}
