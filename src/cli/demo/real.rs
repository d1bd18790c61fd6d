//! The demo with the real gripper: it closes on whatever is put between the fingers until that is recognised.

use super::super::Failure;
use super::super::interrupt::stop_flag;
use super::super::link;
use super::super::recognise::{load_model, named, warn_of_perfect_sensors};
use super::super::setup::open_store;
use super::super::terminal::{note, say, say_json, typed_lines, warn};
use super::{DemoArguments, Touched, grasps_in_words, likely};
use palpate_device::serial::LinkOptions;
use palpate_lab::datasets::{SensorView, trial_signals};
use palpate_lab::grasping::{Advisor, Identification, Row};
use palpate_lab::gripper::SerialGripper;
use palpate_lab::recording::{TrialRequest, record};
use palpate_learn::{OTHER, Shipped, StopReason, StopRule};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::{class_of, titled};
use palpate_store::Store;
use palpate_store::labels::class_name;
use palpate_tactile::board::Sensor;
use palpate_tactile::trial::{Control, TrialId, TrialSource};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::IsTerminal as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Answer to Ctrl+C.
const STOPPED: &str = "stopped; the trials so far are stored";
/// Time between two looks at the keyboard.
const POLL: Duration = Duration::from_millis(50);

/// Output of `--json`.
#[derive(Serialize)]
struct Report {
    /// Object in the hand, where it was named.
    truth: Option<String>,
    /// Recognised class, or `unknown`.
    decided: String,
    /// `sure`, `grasp-limit` or `unknown`.
    stopped_because: &'static str,
    threshold: f64,
    grasps: Vec<GraspReport>,
}

/// One grasp.
#[derive(Serialize)]
struct GraspReport {
    trial_id: TrialId,
    touch: Option<Touched>,
    /// Belief after this grasp and those before it.
    pmf: BTreeMap<String, f64>,
}

pub(super) fn run(arguments: &DemoArguments, port: &Path, store: Option<&Path>) -> Result<(), Failure> {
    let scene = arguments.scene.scene(None)?;
    let truth = arguments.object.as_deref().map(|name| class_name(class_of(name))).transpose()?;
    let model = Arc::new(load_model(arguments.model.as_deref(), Shipped::AnyGripper)?);
    warn_of_perfect_sensors(&model);
    let store = open_store(store)?;
    refuse_uncalibrated(&store, port)?;
    let stop = stop_flag()?;
    let options = LinkOptions { path: Some(port.to_owned()), ..LinkOptions::default() };
    let link = link::open(&options, link::USUAL_WAIT_S, || stop.load(Ordering::Relaxed))?;
    let mut gripper = SerialGripper::new(Box::new(link));
    let rule = StopRule { threshold: arguments.threshold, most_grasps: arguments.grasps as usize };
    let mut identification = Identification::new(Arc::clone(&model), rule);
    let keys = std::io::stdin().is_terminal().then(typed_lines).transpose()?;
    let mut grasps: Vec<GraspReport> = Vec::new();
    let mut advisor = Advisor::default();
    let stopped = loop {
        if let Some(keys) = &keys {
            match identification.last().and_then(|last| advisor.advice(last)) {
                None if grasps.is_empty() => note("Put an object between the open fingers and press Enter."),
                Some(by) => note(&format!("To learn most from the next grasp: {}. Then press Enter.", by.of_object())),
                None => note("Turn the object a little and press Enter."),
            }
            wait_for_enter(keys, &stop)?;
        }
        let adds = !grasps.is_empty();
        let request = TrialRequest { object: truth.clone(), control: Control::Driven, length_s: None, adds };
        let recording = record(&mut gripper, &scene, request, store.path().to_owned(), &stop, &mut |_progress| ())?;
        if stop.load(Ordering::Relaxed) {
            return Err(STOPPED.into());
        }
        if let Some(cause) = recording.aborted {
            return Err(format!("the hand did not close: {cause}").into());
        }
        let trial_id = recording.trial.id;
        recognise(&mut identification, &store, trial_id)?;
        let pmf = identification.belief().now().map(|pmf| named(&model, pmf)).unwrap_or_default();
        let report = GraspReport { trial_id, touch: Touched::of(&identification), pmf };
        if !arguments.json {
            print_grasp(grasps.len() + 1, &report)?;
        }
        grasps.push(report);
        if let Some(reason) = identification.decision() {
            break reason;
        }
    };
    let decided = identification.view().decided().unwrap_or("unknown").to_owned();
    let report = Report { truth, decided, stopped_because: stopped.name(), threshold: rule.threshold, grasps };
    if arguments.json { say_json(&report) } else { print_conclusion(&report, stopped) }
}

/// Refuses a gripper without calibrations, whose readings mean nothing yet.
fn refuse_uncalibrated(store: &Store, port: &Path) -> Result<(), Failure> {
    let serving = store.calibrations().serving(None, &[])?;
    let missing: Vec<&str> = Sensor::ALL
        .into_iter()
        .filter(|sensor| !serving.calibrations.iter().any(|(own, _)| own == sensor))
        .map(Sensor::label)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let (missing, port) = (missing.join(", "), port.display());
    Err(format!("not calibrated: {missing}. `palpate adapt --port {port}` does it by one close of the empty hand")
        .into())
}

fn wait_for_enter(keys: &std::sync::mpsc::Receiver<String>, stop: &AtomicBool) -> Result<(), Failure> {
    use std::sync::mpsc::RecvTimeoutError;
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
fn recognise(identification: &mut Identification, store: &Store, id: TrialId) -> Result<(), Failure> {
    let view = SensorView::of_model(&identification.model().card);
    let read = trial_signals(store, id, TrialSource::Recorded, &view)?;
    identification.begin_grasp(read.signals.channels.iter().cloned().enumerate())?;
    for (k, t_s) in read.signals.t_s.iter().enumerate() {
        let phase = read.hold_s.map(|hold_s| if *t_s < hold_s { Phase::Close } else { Phase::Hold });
        let row = Row { t_s: *t_s, line_bar: f64::NAN, phase, values: read.signals.row(k).into() };
        identification.push(*t_s, &row);
    }
    identification.end_grasp();
    Ok(())
}

fn print_grasp(number: usize, report: &GraspReport) -> Result<(), Failure> {
    say(format!("Grasp {number} (trial {}).", report.trial_id))?;
    match &report.touch {
        Some(touch) => say(format!("  Felt: {touch}."))?,
        None => warn("nothing was touched"),
    }
    say(format!("  Most likely: {}.", likely(&report.pmf)))
}

fn print_conclusion(report: &Report, stopped: StopReason) -> Result<(), Failure> {
    let count = report.grasps.len();
    let grasps = grasps_in_words(count);
    let decided = titled(&report.decided);
    let found = match stopped {
        _ if report.decided == OTHER => format!("None of the known objects, after {grasps}."),
        StopReason::Sure => format!("Recognised after {grasps}: {decided}."),
        StopReason::GraspLimit => format!("Grasp limit reached ({count}). Best guess: {decided}."),
        StopReason::Unknown => format!("Unknown object after {grasps}."),
    };
    let verdict = report.truth.as_ref().map(|truth| match (*truth == report.decided, titled(truth)) {
        (true, _) => " Correct.".to_owned(),
        (false, truth) => format!(" In the hand: {truth}."),
    });
    say(format!("{found}{}", verdict.unwrap_or_default()))
}
