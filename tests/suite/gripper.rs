//! The thread that owns the board of the real gripper: one link for the live view, trials, recognition and a calibration,
//! tried on the emulated gripper with a clock of its own.

use crate::calibration::{calibrated, parts};
use crate::scripted;
use crate::streams;
use palpate_device::emulator::{EmulatorSetup, HandPlan, HiddenParts, parse_faults};
use palpate_lab::grasping::{GraspStage, LEAD_S};
use palpate_lab::gripper::{Listen, NotOpened};
use palpate_lab::recording::TrialRequest;
use palpate_lab::workers::{
    CalibrationCommand, CalibrationPlan, Examine, ExamineRequest, GripperCommand, GripperSetup, GripperView,
    GripperWorker, Notice, TraceRow,
};
use palpate_sim::gripper::Phase;
use palpate_sim::gripper::Side;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::{Accuracy, Scene};
use palpate_store::Store;
use palpate_store::labels::Flag;
use palpate_tactile::board::{Sensor, SensorList};
use palpate_tactile::trial::{BoardLog, Control};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use tempfile::TempDir;

/// A worker on the emulated gripper, and what it has said.
pub(crate) struct Desk {
    worker: GripperWorker,
    woken: Receiver<()>,
    store: PathBuf,
    notices: Vec<Notice>,
    rows: Vec<TraceRow>,
    folder: TempDir,
}

/// Views after which something that was waited for will not come any more.
const MOST_VIEWS: u32 = 3000;

/// A look at the emulated gripper takes this long in truth.
pub(crate) const FAST: Duration = Duration::from_micros(100);
/// A look when its time is the time of the clock.
pub(crate) const TRUE_TO_TIME: Duration = Duration::from_millis(10);

pub(crate) fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.solver.accuracy = Accuracy::Draft;
    scene
}

/// The emulated gripper, waiting to be driven.
pub(crate) fn board(parts: &HiddenParts) -> Listen {
    emulated(parts, None, FAST, 30)
}

/// The emulated gripper, grasping by itself.
fn moving(parts: &HiddenParts) -> Listen {
    emulated(parts, Some(7.0), FAST, 30)
}

pub(crate) fn emulated(parts: &HiddenParts, grasp_every_s: Option<f64>, look: Duration, most_steps: u8) -> Listen {
    let parts = parts.clone();
    Arc::new(move |port, _| {
        if let Some(port) = port {
            return Err(format!("there is no {}", port.display()).into());
        }
        Ok(Box::new(streams::emulated(setup(&parts, grasp_every_s, most_steps), look)))
    })
}

fn setup(parts: &HiddenParts, grasp_every_s: Option<f64>, most_steps: u8) -> EmulatorSetup {
    let hand = HandPlan {
        sensors: SensorList::default(),
        scene: scene(),
        objects: vec![EMPTY.to_owned()],
        seed: 1,
        grasp_every_s,
        script: vec![],
    };
    let (parts, faults) = (parts.clone(), vec![]);
    EmulatorSetup { hand, parts, rate_hz: 50, channels: 4, most_steps, clock_start_us: 0, faults, seed: 1 }
}

impl Desk {
    pub(crate) fn on(listen: Listen) -> Self {
        Self::with(listen, tempfile::tempdir().unwrap(), "trials.sqlite")
    }

    fn with(listen: Listen, folder: TempDir, store: &str) -> Self {
        let store = folder.path().join(store);
        let (wake, woken) = channel();
        let worker = GripperWorker::start(GripperSetup {
            scene: scene(),
            store: store.clone(),
            model: Some(scripted::model()),
            grasps: 4,
            listen,
            wake: Arc::new(move || {
                // The test may have stopped listening.
                let _heard = wake.send(());
            }),
        });
        Self { worker: worker.unwrap(), woken, store, notices: Vec::new(), rows: Vec::new(), folder }
    }

    pub(crate) fn command(&self, command: GripperCommand) {
        self.worker.send(command);
    }

    /// Waits until everything stands as wanted.
    pub(crate) fn until(&mut self, wanted: impl Fn(&GripperView) -> bool) -> Arc<GripperView> {
        // The thread wakes whoever listens thirty times a second: this many are minutes.
        for _ in 0..MOST_VIEWS {
            self.notices.extend(self.worker.notices());
            self.rows.extend(self.worker.rows());
            if let Some(view) = self.worker.view().filter(|view| wanted(view)) {
                return view;
            }
            self.woken.recv_timeout(Duration::from_secs(600)).expect("the thread is alive");
        }
        panic!(
            "never so: {:?}, {:?}",
            self.notices,
            self.worker.view().map(|view| GripperView { console: Arc::new([]), ..(*view).clone() })
        )
    }

    fn until_said(&mut self, text: &str) {
        for _ in 0..MOST_VIEWS {
            self.notices.extend(self.worker.notices());
            if self.notices.iter().any(|notice| format!("{notice:?}").contains(text)) {
                return;
            }
            self.woken.recv_timeout(Duration::from_secs(600)).expect("the thread is alive");
        }
        panic!("never said: {text}; {:?}", self.notices)
    }

    pub(crate) fn connect(&mut self) {
        self.command(GripperCommand::Connect(None));
        self.until(|view| view.latest.is_some());
    }

    /// A whole trial.
    fn trial(&mut self, control: Control, adds: bool) -> i64 {
        let before = self.worker.view().and_then(|view| view.ended.as_ref().map(|ended| ended.id));
        self.command(GripperCommand::Begin(TrialRequest {
            object: Some("lemon".to_owned()),
            length_s: None,
            control,
            adds,
        }));
        self.until(|view| view.trial.is_some());
        let ended = self.until(|view| view.trial.is_none() && view.ended.as_ref().map(|e| e.id) != before);
        ended.ended.as_ref().unwrap().id
    }

    pub(crate) fn store(&self) -> Store {
        Store::open(&self.store).unwrap()
    }
}

pub(crate) fn store_calibrations(path: &Path, parts: &HiddenParts) {
    let store = Store::open(path).unwrap();
    for (sensor, calibration) in calibrated(parts, 1).1 {
        store.calibrations().add(&calibration.record).unwrap();
        store.calibrations().mount(sensor, &calibration.record.part).unwrap();
    }
}

/// The trial that is recorded has its number.
fn numbered(view: &GripperView) -> bool {
    view.trial.as_ref().is_some_and(|trial| trial.id.is_some())
}

/// Number of the trial that ended last.
fn ended(view: &GripperView) -> Option<i64> {
    view.ended.as_ref().map(|ended| ended.id)
}

/// True for readings every 20 ms. On a busy machine the first lines arrive late, and one that does not moves the line of times:
/// a few steps are shorter.
fn is_even(trial: &BoardLog) -> bool {
    let steps = || trial.readings.windows(2).map(|pair| pair[1].t_s - pair[0].t_s);
    steps().all(|step| step > 0.0) && steps().filter(|step| (step - 0.02).abs() >= 2e-3).count() < 5
}

#[test]
fn a_driven_trial_is_recorded_with_its_rest_and_its_phases() {
    let mut desk = Desk::on(board(&parts(1, false)));
    desk.connect();
    let id = desk.trial(Control::Driven, false);
    let trial = desk.store().board_log(id).unwrap().unwrap();
    let mark = |phase: Phase| trial.course.phases.iter().find(|mark| mark.phase == phase).unwrap().from_s;
    let (close, hold, release) = (mark(Phase::Close), mark(Phase::Hold), mark(Phase::Release));
    assert!((hold - close - 2.0).abs() < 0.15 && (release - hold - 1.0).abs() < 0.15, "{close} {hold} {release}");
    let first = trial.readings.first().unwrap().t_s;
    assert!((1.5..2.2).contains(&(close - first)), "{}", close - first);
    assert!(is_even(&trial));
    assert!(trial.gaps.is_empty() && trial.course.cadence.lost == 0);
    let most = trial.readings.iter().filter_map(|reading| reading.line_bar).fold(0.0, f64::max);
    assert!((most - 1.0).abs() < 1e-9, "{most} bar");
    assert!(trial.readings.last().unwrap().line_bar < Some(0.01), "vented at the end");
    // What was plotted: a stretch that is only watched, the trial from its rest on, and watching again.
    desk.until(|view| view.grasp == 3);
    let own: Vec<&TraceRow> = desk.rows.iter().filter(|row| row.grasp == 2).collect();
    assert!(own.iter().all(|row| !row.rolling && row.sample.values.len() == 6 + 4));
    let [first_s, last_s] = [own[0], own[own.len() - 1]].map(|row| row.sample.t_s);
    // Its times are those of the stored trial.
    let began_s = trial.course.began_s;
    assert!((0.0..0.9).contains(&first_s) && last_s > close - began_s + 3.9, "{first_s} to {last_s}");
    assert!((own[own.len() - 1].closing_s - (close - began_s)).abs() < 1e-9, "{close} {began_s}");
    assert!(desk.rows.iter().filter(|row| row.grasp == 1).all(|row| row.rolling));
}

#[test]
fn stop_vents_ends_the_trial_and_says_so() {
    let mut desk = Desk::on(board(&parts(1, false)));
    desk.command(GripperCommand::Vent);
    desk.until_said("no board is connected: vent at the control box");
    desk.connect();
    desk.command(GripperCommand::Begin(TrialRequest {
        object: None,
        length_s: None,
        control: Control::Driven,
        adds: false,
    }));
    desk.until(|view| view.latest.as_ref().is_some_and(|latest| latest.line_bar > Some(0.3)));
    desk.command(GripperCommand::Vent);
    let view = desk.until(|view| view.trial.is_none() && view.ended.is_some());
    desk.until_said("Vent sent");
    let ended = view.ended.clone().unwrap();
    assert!(!ended.discarded && ended.warnings.iter().any(|text| text.contains("vented by the user")), "{ended:?}");
    desk.until(|view| view.latest.as_ref().is_some_and(|latest| latest.line_bar < Some(0.01)));
    let released = |mark: &palpate_tactile::trial::PhaseMark| mark.phase == Phase::Release;
    assert!(!desk.store().board_info(ended.id).unwrap().unwrap().course.phases.iter().any(released));
}

#[test]
fn fingers_are_not_left_under_pressure_when_a_trial_breaks_off() {
    // What waits is written about once a second of the clock, which must come before the trial's end.
    let mut desk = Desk::on(emulated(&parts(1, false), None, TRUE_TO_TIME, 30));
    desk.connect();
    desk.command(GripperCommand::Begin(TrialRequest {
        object: None,
        length_s: None,
        control: Control::Driven,
        adds: false,
    }));
    let pressed = desk.until(|view| view.latest.as_ref().is_some_and(|latest| latest.line_bar > Some(0.3)));
    // Another program throws it away for good: nothing more can be written of it.
    let id = pressed.trial.as_ref().and_then(|trial| trial.id).unwrap();
    let mut store = desk.store();
    store.delete(&[id]).unwrap();
    store.purge().unwrap();
    desk.until_said("recording stopped");
    let view = desk.until(|view| view.latest.as_ref().is_some_and(|latest| latest.line_bar < Some(0.01)));
    // It was told to, and did not wait until it missed us.
    assert!(!view.console.iter().any(|line| line.text.contains("watchdog")), "{:?}", view.console);
    assert!(view.trial.is_none() && view.is_connected());
    desk.trial(Control::Driven, false);
}

#[test]
fn trials_are_ended_begun_anew_and_given_up() {
    let mut desk = Desk::on(board(&parts(1, false)));
    let request = || TrialRequest { object: None, length_s: None, control: Control::ByHand, adds: false };
    desk.command(GripperCommand::Begin(request()));
    desk.until_said("connect the gripper first");
    desk.connect();
    desk.command(GripperCommand::Begin(request()));
    let first = desk.until(numbered).trial.clone().unwrap();
    // Time counts from the beginning of the recording, as when the trial is opened; 4.4 s from the closing on.
    let closing_s = first.length_s.unwrap() - 4.4;
    assert!((LEAD_S..LEAD_S + 0.35).contains(&closing_s), "{first:?}");
    // A busy machine may see it only after its lead.
    assert_eq!(first.stage == GraspStage::Lead, first.t_s < closing_s, "{first:?}");
    // Another begins: the first ends there and is kept.
    desk.command(GripperCommand::Begin(request()));
    let second = desk.until(|view| numbered(view) && view.trial.as_ref().is_some_and(|trial| trial.id != first.id));
    let second = second.trial.clone().unwrap().id;
    desk.command(GripperCommand::Discard);
    desk.until(|view| view.trial.is_none());
    desk.command(GripperCommand::Begin(TrialRequest { control: Control::Free, ..request() }));
    desk.until(|view| view.trial.as_ref().is_some_and(|trial| trial.t_s > 7.0));
    desk.command(GripperCommand::End);
    let free = desk.until(|view| view.trial.is_none() && ended(view) > second).ended.clone().unwrap().id;
    let rows = desk.store().list(true).unwrap();
    let deleted: Vec<(i64, bool)> = rows.iter().map(|row| (row.id, row.deleted.is_some())).collect();
    assert_eq!(deleted, [(first.id.unwrap(), false), (second.unwrap(), true), (free, false)]);
    // Closing the window ends what goes on.
    desk.command(GripperCommand::Begin(request()));
    desk.until(|view| view.trial.is_some());
    let Desk { worker, store, folder, .. } = desk;
    drop(worker);
    let store = Store::open(&store).unwrap();
    let last = store.list(false).unwrap().pop().unwrap();
    assert_eq!(last.state, "complete");
    let warnings = store.load(last.id).unwrap().header.warnings;
    assert!(warnings.iter().any(|text| text.contains("the window was closed")), "{warnings:?}");
    drop(folder);
}

#[test]
fn what_is_held_is_recognised_from_calibrated_sensors_grasp_by_grasp() {
    let parts = parts(1, false);
    let mut desk = Desk::on(board(&parts));
    desk.connect();
    desk.trial(Control::Driven, true);
    let view = desk.until(|view| view.recognition_off.is_some());
    assert!(
        view.recognition_off.as_deref().unwrap().contains("the sensors are not calibrated"),
        "{:?}",
        view.recognition_off
    );
    desk.command(GripperCommand::Disconnect);
    desk.until(|view| !view.is_connected());
    store_calibrations(&desk.store, &parts);
    desk.connect();
    desk.trial(Control::Driven, true);
    let once = desk.until(|view| view.identification.as_ref().is_some_and(|i| i.beliefs.len() == 1));
    assert!(once.recognition_off.is_none() && once.drift.len() == 4, "{:?}", once.drift);
    let mut grasps = 1;
    let decided = loop {
        grasps += 1;
        desk.trial(Control::Driven, true);
        let view = desk.until(|view| view.identification.as_ref().is_some_and(|i| i.beliefs.len() == grasps));
        if let Some(decided) = view.identification.as_ref().and_then(|i| i.decided().map(str::to_owned)) {
            break decided;
        }
    };
    assert_eq!((decided.as_str(), grasps), ("lemon", 3));
    // It has decided, so that the next grasp is of another object; and one that stands by itself starts over anyway.
    for adds in [true, false] {
        desk.trial(Control::Driven, adds);
        desk.until(|view| view.identification.as_ref().is_some_and(|i| i.beliefs.len() == 1));
    }
    // At rest the fingers are straight, and nothing presses; in a close they bend inward, both alike.
    let of_trial = desk.rows.iter().filter(|row| row.grasp == 5);
    let most = |k: usize| of_trial.clone().map(|row| row.sample.values[k]).fold(f32::MIN, f32::max);
    assert!(most(0) > 3.0 && (most(0) - most(1)).abs() < 0.5, "{} {}", most(0), most(1));
    desk.command(GripperCommand::Tare);
    let tared = desk.until(|view| {
        view.latest.as_ref().is_some_and(|l| l.estimate.curvature(Side::Left).is_some_and(|k| k.abs() < 0.3))
    });
    assert!(tared.latest.as_ref().unwrap().estimate.value(Sensor::PAD_LEFT).is_some_and(|force| force < 0.05));
}

#[test]
fn a_pad_that_falls_silent_is_named_and_the_answer_goes_on_without_it() {
    let parts = parts(1, false);
    let faulty = |faults: &'static str| -> Listen {
        let parts = parts.clone();
        Arc::new(move |_, _| {
            let setup = EmulatorSetup { faults: parse_faults(faults).unwrap(), ..setup(&parts, None, 30) };
            Ok(Box::new(streams::emulated(setup, FAST)))
        })
    };
    let mut desk = Desk::on(faulty("nan=2@0"));
    store_calibrations(&desk.store, &parts);
    desk.connect();
    let trial = desk.trial(Control::Driven, true);
    let view = desk.until(|view| view.identification.as_ref().is_some_and(|i| i.beliefs.len() == 1));
    // The model reads pressure and force of each pad.
    assert_eq!(view.failed.as_deref(), Some("left pad silent: answering from 4 channels"));
    let flags = desk.store().board_info(trial).unwrap().unwrap().flags;
    let found = flags.iter().find(|found| found.flag == Flag::SensorFault).unwrap_or_else(|| panic!("{flags:?}"));
    assert!(found.remark.starts_with("left pad silent, found at "), "{found:?}");
    let read = desk.rows.iter().filter(|row| !row.rolling).map(|row| row.sample.values[2]);
    assert!(
        read.clone().count() > 100 && read.filter(|value| value.is_finite()).count() < 10,
        "plots show what was read"
    );
}

#[test]
fn a_calibration_shares_the_port_or_brings_its_own() {
    let mut desk = Desk::on(board(&parts(1, false)));
    let begin = |port: Option<&str>| {
        let port = port.map(PathBuf::from);
        let plan = CalibrationPlan { sensor: Sensor::FLEX_LEFT, part: "A7".to_owned(), port };
        GripperCommand::Calibrate(CalibrationCommand::Begin(plan))
    };
    let running = |view: &GripperView| view.calibration.running.is_some();
    desk.command(begin(Some("nowhere")));
    let failed = desk.until(|view| view.calibration.ended.is_some());
    let ended = failed.calibration.ended.clone();
    assert!(matches!(&ended, Some(Err(cause)) if cause.to_string() == "there is no nowhere"), "{ended:?}");
    desk.command(begin(None));
    // Twice at once: the second reading has not settled, and that is said.
    desk.until(|view| view.calibration.running.as_ref().is_some_and(|session| session.procedure().settled().is_ok()));
    for _ in 0..2 {
        desk.command(GripperCommand::Calibrate(CalibrationCommand::Take(0.0)));
    }
    desk.until(|view| {
        let not_taken = view.calibration.running.as_ref().and_then(|session| session.not_taken());
        not_taken.is_some_and(|text| text.starts_with("not taken: "))
    });
    desk.command(GripperCommand::Calibrate(CalibrationCommand::Stop));
    desk.until(|view| !running(view) && !view.is_connected());
    desk.connect();
    desk.command(begin(None));
    desk.until(running);
    desk.command(GripperCommand::Calibrate(CalibrationCommand::Stop));
    let view = desk.until(|view| !running(view));
    assert!(view.is_connected(), "the live view goes on");
}

#[test]
fn the_doctor_looks_at_the_link_that_is_held() {
    let mut desk = Desk::on(board(&parts(1, false)));
    let alone: Examine = Arc::new(|_, _| panic!("the port is held: it cannot be opened again"));
    let look = desk.worker.examine(alone);
    desk.connect();
    let request = ExamineRequest { port: None, seconds: 0.3, sensors: SensorList::default() };
    let mut found = 0;
    let seen = look(&request, &mut |_| {
        found += 1;
        true
    });
    assert!(found > 0 && seen.listened_s >= 0.3 && seen.traces.channels.len() == 4);
    assert!(seen.link.is_some_and(|link| link.board.firmware.is_some()), "it has said who it is");
    // One that is given up ends before its time, with what was seen so far.
    let seen = look(&ExamineRequest { port: None, seconds: 1e6, sensors: SensorList::default() }, &mut |_| false);
    assert!(seen.listened_s < 1e3 && seen.traces.channels.len() == 4);
}

#[test]
fn trials_begin_and_end_by_themselves_with_their_phases() {
    let parts = parts(1, false);
    let mut desk = Desk::on(moving(&parts));
    store_calibrations(&desk.store, &parts);
    let request = TrialRequest { object: None, length_s: None, control: Control::Free, adds: false };
    desk.connect();
    desk.command(GripperCommand::Watch(Some(request)));
    for number in 1..=2 {
        desk.until_said(&format!("Stored(New({number}))"));
        let store = desk.store();
        let trial = store.board_log(number).unwrap().unwrap();
        let phases: Vec<Phase> = trial.course.phases.iter().map(|mark| mark.phase).collect();
        assert_eq!(phases, [Phase::Close, Phase::Hold, Phase::Release], "trial {number}");
        let rest = trial.course.phases[0].from_s - trial.readings[0].t_s;
        assert!((0.2..1.0).contains(&rest), "{rest} s of rest");
        assert!(is_even(&trial));
        // It was heard from its closing on, though that was found out a little later.
        assert!(store.labels().guess(number).unwrap().is_some_and(|guess| guess.pmf.len() == 17));
    }
    desk.until(|view| view.identification.as_ref().is_some_and(|own| own.beliefs.len() == 1 && own.verdict.is_some()));
    // Switched off in the middle of a trial: it ends, and is kept.
    let running = desk.until(|view| view.trial.as_ref().is_some_and(|trial| trial.samples > 20));
    assert!(running.trial.as_ref().is_some_and(|trial| trial.automatic));
    desk.command(GripperCommand::Watch(None));
    let ended = desk.until(|view| view.watching.is_none() && view.trial.is_none());
    assert!(ended.ended.as_ref().is_some_and(|ended| !ended.discarded));
}

#[test]
fn a_driven_trial_ends_when_the_board_does_not_do_what_it_is_told() {
    // Half a bar at most, where the programme goes up to one.
    let mut desk = Desk::on(emulated(&parts(1, false), None, FAST, 10));
    desk.connect();
    let id = desk.trial(Control::Driven, false);
    desk.until_said("trial ended: the board refused a command (above-maximum");
    desk.until(|view| view.latest.as_ref().is_some_and(|latest| latest.line_bar < Some(0.01)));
    let trial = desk.store().board_log(id).unwrap().unwrap();
    // The refused step is the last that it was told.
    let most = trial.course.phases.iter().filter_map(|mark| mark.line_bar).fold(0.0, f64::max);
    assert!((most - 0.55).abs() < 1e-9, "{most} bar");
    assert!(trial.readings.iter().all(|reading| reading.line_bar <= Some(0.501)));
    let rows = desk.rows.iter().filter(|row| row.grasp == 2);
    assert!(rows.map(|row| row.sample.line_bar).all(|bar| bar.is_nan() || bar < 0.501), "the board knows better");
}

#[test]
fn a_trial_that_was_asked_for_is_not_taken_over_by_what_the_fingers_do() {
    let mut desk = Desk::on(moving(&parts(1, false)));
    let request = TrialRequest { object: None, length_s: None, control: Control::Free, adds: false };
    desk.connect();
    desk.until(|view| view.latest.as_ref().is_some_and(|latest| latest.line_bar < Some(0.01)));
    desk.command(GripperCommand::Watch(Some(request.clone())));
    desk.command(GripperCommand::Begin(request));
    let id = desk.until(numbered).trial.as_ref().unwrap().id;
    // A whole grasp passes.
    for pressed in [true, false] {
        let is = |bar: Option<f64>| if pressed { bar > Some(0.5) } else { bar < Some(0.01) };
        let view = desk.until(|view| view.latest.as_ref().is_some_and(|latest| is(latest.line_bar)));
        assert_eq!(view.trial.as_ref().map(|trial| trial.id), Some(id));
    }
    desk.command(GripperCommand::End);
    let ended = desk.until(|view| view.ended.is_some()).ended.clone().unwrap();
    assert_eq!(Some(ended.id), id);
}

#[test]
fn a_port_that_another_program_has_is_opened_when_that_lets_it_go() {
    let tries = AtomicU32::new(0);
    let free = board(&parts(1, false));
    let mut desk = Desk::on(Arc::new(move |port, sensors| match tries.fetch_add(1, Ordering::Relaxed) {
        0 | 1 => Err(NotOpened { may_pass: true, ..NotOpened::from("it is open in another program".to_owned()) }),
        _ => free(port, sensors),
    }));
    desk.command(GripperCommand::Connect(None));
    desk.until_said("it is open in another program; retrying each second");
    let view = desk.until(|view| view.latest.is_some());
    assert!(view.refused.is_none() && view.is_connected());
    // What does not pass is not tried again.
    desk.command(GripperCommand::Connect(Some("/dev/nothing".into())));
    let view = desk.until(|view| view.refused.is_some());
    let refused = view.refused.as_ref().map(|refused| refused.text.as_str());
    assert_eq!((refused, view.is_connected()), (Some("there is no /dev/nothing"), false));
}

#[test]
fn zeros_are_taken_from_open_hands_alone() {
    let parts = parts(1, false);
    let mut desk = Desk::on(moving(&parts));
    store_calibrations(&desk.store, &parts);
    desk.connect();
    desk.until(|view| view.latest.as_ref().is_some_and(|latest| latest.line_bar > Some(0.3)));
    desk.command(GripperCommand::Tare);
    desk.until_said("bar: vent, let the fingers");
    desk.command(GripperCommand::Begin(TrialRequest {
        object: None,
        length_s: None,
        control: Control::Free,
        adds: false,
    }));
    desk.command(GripperCommand::Tare);
    desk.until_said("not tared: a trial is running");
    assert!(desk.store().calibrations().tare().unwrap().is_none());
}

#[test]
fn a_hand_that_is_not_the_calibrated_one_is_noticed_at_rest() {
    let (calibrated, other) = (parts(1, false), parts(7, false));
    let mut desk = Desk::on(board(&other));
    store_calibrations(&desk.store, &calibrated);
    desk.connect();
    desk.until_said("not the hand that was calibrated? At rest it reads");
    let view = desk.until(|view| !view.remarks.is_empty());
    assert!(view.remarks[0].contains("flex strip"), "{:?}", view.remarks);
    // The hand that was calibrated fits.
    let mut desk = Desk::on(board(&calibrated));
    store_calibrations(&desk.store, &calibrated);
    desk.connect();
    desk.trial(Control::Driven, true);
    let view = desk.until(|view| view.drift.len() == 4);
    assert!(view.remarks.iter().all(|remark| !remark.contains("not the hand")), "{:?}", view.remarks);
}

#[test]
fn a_store_that_cannot_be_written_ends_a_trial_before_the_fingers_close() {
    // Written before the thread starts, which looks into the store at once.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("notes.txt"), "not a store".repeat(100)).unwrap();
    let mut desk = Desk::with(board(&parts(1, false)), folder, "notes.txt");
    desk.connect();
    desk.command(GripperCommand::Begin(TrialRequest {
        object: None,
        length_s: None,
        control: Control::Driven,
        adds: false,
    }));
    desk.until_said("not a store");
    let view = desk.until(|view| view.trial.is_none());
    assert!(
        view.is_connected() && desk.rows.iter().all(|row| row.sample.line_bar.is_nan() || row.sample.line_bar <= 0.01)
    );
    desk.command(GripperCommand::Disconnect);
    desk.until(|view| !view.is_connected());
}
