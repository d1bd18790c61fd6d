//! The demo with the real gripper: it closes on whatever is put between the fingers until that is recognised.

use super::super::link;
use super::super::prelude::*;
use super::super::recognise::{load_model, warn_of_perfect_sensors};
use super::{DemoArguments, GraspReport, Hand, grasp_until_recognised};
use palpate_lab::datasets::{SensorView, trial_signals};
use palpate_lab::grasping::{Advisor, Identification, Row};
use palpate_lab::gripper::SerialGripper;
use palpate_lab::recording::{TrialRequest, record};
use palpate_learn::Shipped;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::class_of;
use palpate_sim::scene::Scene;
use palpate_store::labels::class_name;
use palpate_tactile::board::{Sensor, SensorKind};
use palpate_tactile::trial::{Control, TrialSource};
use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

/// Answer to Ctrl+C.
const STOPPED: &str = "stopped; the trials so far are stored";
/// Time between two looks at the keyboard.
const POLL: Duration = Duration::from_millis(50);

/// The real gripper.
struct RealHand {
    gripper: SerialGripper,
    scene: Scene,
    truth: Option<String>,
    store: Store,
    stop: Arc<AtomicBool>,
    /// Lines of the keyboard, on a terminal.
    keys: Option<Receiver<String>>,
    advisor: Advisor,
}

pub(super) fn run(arguments: &DemoArguments, port: &Path, store: Option<&Path>) -> Result<(), Failure> {
    let scene = arguments.scene.scene(None)?;
    let truth = arguments.object.as_deref().map(|name| class_name(class_of(name))).transpose()?;
    let model = Arc::new(load_model(arguments.model.as_deref(), Shipped::AnyGripper)?);
    warn_of_perfect_sensors(&model);
    let store = open_store(store)?;
    refuse_uncalibrated(&store, port)?;
    let stop = stop_flag()?;
    let link =
        link::open(&link::options(Some(port), false, store.calibrations().sensors()?), link::USUAL_WAIT_S, &stop)?;
    let keys = std::io::stdin().is_terminal().then(typed_lines).transpose()?;
    let gripper = SerialGripper::new(Box::new(link));
    let mut hand = RealHand { gripper, scene, truth: truth.clone(), store, stop, keys, advisor: Advisor::default() };
    grasp_until_recognised(&mut hand, &model, arguments, truth, (None, Between::Reposed))
}

impl Hand for RealHand {
    fn grasp(&mut self, identification: &mut Identification) -> Result<GraspReport, Failure> {
        let last = identification.last().cloned();
        if let Some(keys) = &self.keys {
            match last.as_ref().map(|last| self.advisor.advice(last)) {
                None => note("Put an object between the open fingers and press Enter."),
                Some(None) => note("Turn the object a little and press Enter."),
                Some(Some(by)) => {
                    note(&format!("To learn most from the next grasp: {}. Then press Enter.", by.of_object()));
                }
            }
            wait_for_enter(keys, &self.stop)?;
        }
        let (object, store) = (self.truth.clone(), self.store.path().to_owned());
        let request = TrialRequest { object, control: Control::Driven, length_s: None, adds: last.is_some() };
        let recording = record(&mut self.gripper, &self.scene, request, store, &self.stop, &mut |_progress| ())?;
        if self.stop.load(Ordering::Relaxed) {
            return Err(STOPPED.into());
        }
        if let Some(cause) = recording.aborted {
            return Err(format!("the hand did not close: {cause}").into());
        }
        let trial_id = recording.trial.id;
        read_trial(identification, &self.store, trial_id)?;
        if identification.view().measured.is_none() {
            warn("nothing was touched");
        }
        Ok(GraspReport { trial_id: Some(trial_id), ..GraspReport::default() })
    }
}

/// Refuses a gripper without calibrations, whose readings mean nothing yet.
fn refuse_uncalibrated(store: &Store, port: &Path) -> Result<(), Failure> {
    let serving = store.calibrations().serving(None, &[])?;
    let parts = store.calibrations().sensors()?.iter().filter(|sensor| sensor.kind() != SensorKind::Raw);
    let missing: Vec<String> =
        parts.filter(|sensor| !serving.calibrations.iter().any(|(own, _)| own == sensor)).map(Sensor::label).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let (missing, port) = (missing.join(", "), port.display());
    Err(format!("not calibrated: {missing}. `palpate adapt --port {port}` does it by one close of the empty hand")
        .into())
}

fn wait_for_enter(keys: &Receiver<String>, stop: &AtomicBool) -> Result<(), Failure> {
    loop {
        match keys.recv_timeout(POLL) {
            Ok(_line) => return Ok(()),
            Err(RecvTimeoutError::Timeout) if !stop.load(Ordering::Relaxed) => {}
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                return Err(STOPPED.into());
            }
        }
    }
}

/// Lets the model read a recorded trial.
fn read_trial(identification: &mut Identification, store: &Store, id: TrialId) -> Result<(), Failure> {
    let view = SensorView::of_model(&identification.model().card);
    let read = trial_signals(store, id, TrialSource::Recorded, &view)?;
    identification.begin_grasp(read.signals.channels.iter().cloned().enumerate())?;
    for (k, t_s) in read.signals.t_s.iter().enumerate() {
        let phase = read.hold_s.map(|hold_s| if *t_s < hold_s { Phase::Close } else { Phase::Hold });
        let row = Row { t_s: *t_s, line_bar: f64::NAN, phase, values: read.signals.row(k).into() };
        identification.push(*t_s, &row);
    }
    identification.unlike_at_start().iter().for_each(|text| warn(text));
    identification.end_grasp();
    Ok(())
}
