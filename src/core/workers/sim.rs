//! The simulation's thread: it owns the rig, keeps pace with the clock on the wall, and publishes what it sees.

use super::latest::Latest;
use super::messages::{Command, FinishedGrasp, Notice, ObjectCard, Snapshot, Status, TraceRow, Wake};
use super::recorder::{Recorder, RecorderNotice};
use crate::grasping::{GraspRun, GraspSummary, PoseJitter, jittered, prepare};
use crate::objects::{LoadOptions, ObjectModel, catalogue};
use crate::picture::Stage;
use crate::rig::SimRig;
use crate::scene::Scene;
use crate::sensing::{Channel, PressureArea, SensorLayout, Sensors};
use crate::trial::Frame;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What a simulation worker starts from.
pub struct SimWorkerSetup {
    /// The first scene.
    pub scene: Scene,
    /// Sensor layout of the traces.
    pub layout: SensorLayout,
    /// Where trials are stored.
    pub store: PathBuf,
    /// Whether trials are stored from the start.
    pub recording: bool,
    /// Grasps in a round.
    pub grasps: u32,
    /// Whether time passes from the start.
    pub playing: bool,
    /// Called when there is something new.
    pub wake: Wake,
}

/// Commands that wait at most; more are refused rather than queued without end.
const MOST_COMMANDS: usize = 256;
/// Trace rows that wait at most: two minutes at 75 Hz. A reader that sleeps longer finds a gap.
const MOST_ROWS: usize = 9000;
/// Pause between two grasps of a round.
const BETWEEN_GRASPS: Duration = Duration::from_millis(600);
/// Longest time spent stepping before something is published.
const BUDGET: Duration = Duration::from_millis(12);
/// Being later than this counts as unable to keep up: the clock is set anew instead of being chased.
const LATEST: f64 = 0.25;
/// Time over which the actual speed is measured.
const SPEED_WINDOW: Duration = Duration::from_millis(500);

/// A handle on the simulation's thread. Dropping it ends the thread and waits for it.
#[derive(Debug)]
pub struct SimWorker {
    commands: SyncSender<Command>,
    snapshots: Arc<Latest<Snapshot>>,
    rows: Receiver<TraceRow>,
    rows_lost: Arc<AtomicBool>,
    notices: Receiver<Notice>,
    thread: Option<JoinHandle<()>>,
}

impl SimWorker {
    /// Starts the thread.
    pub fn start(setup: SimWorkerSetup) -> std::io::Result<Self> {
        let (commands, inbox) = sync_channel(MOST_COMMANDS);
        let (row_sender, rows) = sync_channel(MOST_ROWS);
        let (notice_sender, notices) = channel();
        let snapshots = Arc::new(Latest::default());
        let rows_lost = Arc::new(AtomicBool::new(false));
        let outlets = Outlets {
            snapshots: Arc::clone(&snapshots),
            rows: row_sender,
            rows_lost: Arc::clone(&rows_lost),
            notices: notice_sender,
            wake: Arc::clone(&setup.wake),
        };
        let thread = std::thread::Builder::new().name("sim".to_owned()).spawn(move || {
            let last_words = (outlets.notices.clone(), Arc::clone(&outlets.wake));
            // A panic becomes a message; the window stays.
            let outcome =
                std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| Session::run(setup, outlets, &inbox)));
            if outcome.is_err() {
                let text =
                    "the simulation stopped through a fault of the program; restart Palpate and report what you did";
                // If nobody listens any more, nobody needs to know.
                let _heard = last_words.0.send(Notice::Failed(text.to_owned()));
                last_words.1();
            }
        })?;
        Ok(Self { commands, snapshots, rows, rows_lost, notices, thread: Some(thread) })
    }

    /// Sends a command; false when too many are waiting or the thread has ended.
    pub fn send(&self, command: Command) -> bool {
        self.commands.try_send(command).is_ok()
    }

    /// The newest snapshot; absent until the first scene has been loaded.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.snapshots.get()
    }

    /// Trace rows since the last call, in order.
    pub fn rows(&self) -> impl Iterator<Item = TraceRow> + '_ {
        self.rows.try_iter()
    }

    /// True once after rows had to be dropped because nobody read them.
    pub fn take_rows_lost(&self) -> bool {
        self.rows_lost.swap(false, Ordering::Relaxed)
    }

    /// Notices since the last call, in order.
    pub fn notices(&self) -> impl Iterator<Item = Notice> + '_ {
        self.notices.try_iter()
    }
}

impl Drop for SimWorker {
    fn drop(&mut self) {
        // With a full queue the thread is busy; it sees the closed channel when it gets there.
        while let Err(TrySendError::Full(_)) = self.commands.try_send(Command::Quit) {
            std::thread::sleep(Duration::from_millis(1));
        }
        if let Some(thread) = self.thread.take() {
            let _ended = thread.join();
        }
    }
}

struct Outlets {
    snapshots: Arc<Latest<Snapshot>>,
    rows: SyncSender<TraceRow>,
    rows_lost: Arc<AtomicBool>,
    notices: Sender<Notice>,
    wake: Wake,
}

impl Outlets {
    fn tell(&self, notice: Notice) {
        // The window may have gone; then there is nobody to tell.
        let _heard = self.notices.send(notice);
        (self.wake)();
    }
}

/// The grasp that is going on.
struct Current {
    run: GraspRun<SimRig>,
    scene: Arc<Scene>,
    stage: Arc<Stage>,
    sensors: Sensors,
    frame: Arc<Frame>,
    ended: bool,
}

/// Which object is loaded, and from what: loading again is skipped when nothing about it changed.
struct LoadedObject {
    source: String,
    options: LoadOptions,
    model: Option<Arc<ObjectModel>>,
}

struct Session {
    outlets: Outlets,
    recorder: Option<Recorder>,
    layout: SensorLayout,
    nominal: Scene,
    object: Option<LoadedObject>,
    current: Option<Current>,
    card: Option<Arc<ObjectCard>>,
    channels: Arc<[Channel]>,
    status: Status,
    last: Option<Arc<FinishedGrasp>>,
    revision: u64,
    grasp: u64,
    seed: u64,
    pace: Pace,
    next_grasp_at: Option<Instant>,
    recorder_busy: bool,
}

/// Keeps simulated time level with the wall's, at some speed.
struct Pace {
    wall: Instant,
    simulated: f64,
    measured_from: (Instant, f64),
}

impl Pace {
    fn starting_at(simulated: f64) -> Self {
        let now = Instant::now();
        Self { wall: now, simulated, measured_from: (now, simulated) }
    }

    /// Simulated time that should have been reached by now.
    fn due(&self, speed: f64) -> f64 {
        self.simulated + self.wall.elapsed().as_secs_f64() * speed
    }
}

impl Session {
    fn run(setup: SimWorkerSetup, outlets: Outlets, inbox: &Receiver<Command>) {
        let recorder_outlets = (outlets.notices.clone(), Arc::clone(&outlets.wake));
        let recorder = Recorder::start(setup.store, move |notice| {
            let notice = match notice {
                RecorderNotice::Stored(id) => Notice::Stored(id),
                RecorderNotice::Failed(text) => Notice::Failed(text),
            };
            let _heard = recorder_outlets.0.send(notice);
            (recorder_outlets.1)();
        });
        let recorder = match recorder {
            Ok(recorder) => Some(recorder),
            Err(error) => {
                outlets.tell(Notice::Failed(format!("trials cannot be stored: {error}")));
                None
            }
        };
        let mut session = Self {
            recorder,
            layout: setup.layout,
            nominal: setup.scene,
            object: None,
            current: None,
            card: None,
            channels: Arc::from([]),
            status: Status {
                playing: setup.playing,
                target_speed: 1.0,
                grasps: setup.grasps.max(1),
                recording: setup.recording,
                ..Status::default()
            },
            last: None,
            revision: 0,
            grasp: 0,
            seed: 0,
            pace: Pace::starting_at(0.0),
            next_grasp_at: None,
            recorder_busy: false,
            outlets,
        };
        session.begin_round();
        while session.wait_and_obey(inbox) {
            session.advance();
        }
        session.drop_recording();
    }

    /// Waits until something is due or a command comes; false at the end.
    fn wait_and_obey(&mut self, inbox: &Receiver<Command>) -> bool {
        let first = match self.time_to_wait() {
            Some(wait) => match inbox.recv_timeout(wait) {
                Ok(command) => Some(command),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => return false,
            },
            None => match inbox.recv() {
                Ok(command) => Some(command),
                Err(_closed) => return false,
            },
        };
        let waiting: Vec<Command> = first.into_iter().chain(inbox.try_iter()).collect();
        // Of several scenes in a row only the last matters: sliders send many.
        let last_scene = waiting.iter().rposition(|c| matches!(c, Command::SetScene(_)));
        for (k, command) in waiting.into_iter().enumerate() {
            match command {
                Command::Quit => return false,
                Command::SetScene(_) if Some(k) != last_scene => {}
                other => self.obey(other),
            }
        }
        true
    }

    /// How long nothing is due; `None` for until a command comes.
    fn time_to_wait(&self) -> Option<Duration> {
        if !self.status.playing {
            return None;
        }
        if let Some(at) = self.next_grasp_at {
            return Some(at.saturating_duration_since(Instant::now()));
        }
        let current = self.current.as_ref().filter(|current| !current.ended)?;
        let sample = 1.0 / f64::from(current.scene.timing.sample_hz.max(1));
        let late = self.pace.due(self.status.target_speed) - (current.frame.t + sample);
        Some(Duration::from_secs_f64((-late / self.status.target_speed).clamp(0.0, 0.1)))
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::SetScene(scene) => {
                self.nominal = *scene;
                self.begin_round();
            }
            Command::Play => {
                self.status.playing = true;
                if self.status.finished {
                    self.begin_round();
                } else {
                    self.set_pace();
                }
            }
            Command::Pause => {
                self.status.playing = false;
                self.status.actual_speed = 0.0;
            }
            Command::Step => {
                self.status.playing = false;
                self.status.actual_speed = 0.0;
                self.take_frame();
            }
            Command::Reset => self.begin_round(),
            Command::SetSpeed(speed) => {
                self.status.target_speed = speed.clamp(1.0 / 64.0, 64.0);
                self.set_pace();
            }
            Command::SetGrasps(grasps) => self.status.grasps = grasps.max(1),
            Command::SetRecording(recording) => {
                self.status.recording = recording;
                if !recording {
                    self.drop_recording();
                }
            }
            Command::Pull(force) => {
                if let Some(current) = self.current.as_mut().filter(|_| force.is_finite()) {
                    current.run.rig_mut().pull_object(force);
                }
            }
            Command::Quit => {}
        }
        self.publish();
    }

    fn set_pace(&mut self) {
        self.pace = Pace::starting_at(self.current.as_ref().map_or(0.0, |current| current.frame.t));
    }

    /// The first grasp of a round, in the scene's own pose.
    fn begin_round(&mut self) {
        self.status.grasp_of_round = 0;
        self.begin_grasp();
    }

    fn begin_grasp(&mut self) {
        self.drop_recording();
        self.next_grasp_at = None;
        let Some(model) = self.load_object() else { return };
        self.status.finished = false;
        self.status.grasp_of_round += 1;
        let again = self.status.grasp_of_round > 1;
        self.seed = if again { self.seed + 1 } else { 0 };
        // The first grasp is the scene as written; the following ones come from random poses.
        let scene = if again {
            jittered(&self.nominal, model.as_deref(), PoseJitter::default(), self.seed).0
        } else {
            self.nominal.clone()
        };
        let sensors = match Sensors::new(&self.layout, &scene.gripper, PressureArea::Participation) {
            Ok(sensors) => sensors,
            Err(error) => return self.outlets.tell(Notice::Failed(error.to_string())),
        };
        let mut run = prepare(&scene, model.as_deref(), self.seed);
        if !again {
            for warning in &run.info().warnings {
                self.outlets.tell(Notice::Warning(warning.clone()));
            }
        }
        if self.status.recording
            && let Some(recorder) = &self.recorder
        {
            recorder.begin(run.info());
            self.recorder_busy = true;
        }
        self.grasp += 1;
        self.status.duration = scene.timing.duration_s;
        self.channels = sensors.channels().into();
        let stage = Arc::new(Stage::new(&scene, model.as_deref(), run.info().world_from_gripper));
        let frame = Arc::new(run.rig_mut().first_look());
        self.current = Some(Current { run, scene: Arc::new(scene), stage, sensors, frame, ended: false });
        self.pace = Pace::starting_at(0.0);
        self.publish();
    }

    /// The object of the nominal scene; the outer `None` when it cannot be had.
    fn load_object(&mut self) -> Option<Option<Arc<ObjectModel>>> {
        let (source, options) = (self.nominal.object.source.clone(), self.nominal.load_options());
        let known = self.object.as_ref().filter(|o| o.source == source && o.options == options);
        if let Some(known) = known {
            return Some(known.model.clone());
        }
        self.status.loading = Some(source.clone());
        self.publish();
        let loaded = self.nominal.load_object();
        self.status.loading = None;
        match loaded {
            Ok(model) => {
                let model = model.map(Arc::new);
                self.card = model.as_ref().map(|model| Arc::new(card_of(model)));
                self.object = Some(LoadedObject { source, options, model: model.clone() });
                Some(model)
            }
            Err(error) => {
                self.outlets.tell(Notice::Failed(error.to_string()));
                self.publish();
                None
            }
        }
    }

    /// Takes all samples that are due, within the budget.
    fn advance(&mut self) {
        if !self.status.playing {
            return;
        }
        if let Some(at) = self.next_grasp_at {
            if Instant::now() >= at {
                self.begin_grasp();
            }
            return;
        }
        let started = Instant::now();
        let mut any = false;
        while let Some(current) = self.current.as_ref().filter(|current| !current.ended) {
            let sample = 1.0 / f64::from(current.scene.timing.sample_hz.max(1));
            let due = self.pace.due(self.status.target_speed);
            if current.frame.t + sample > due {
                break;
            }
            if started.elapsed() > BUDGET {
                if due - current.frame.t > LATEST * self.status.target_speed {
                    self.pace.wall = Instant::now();
                    self.pace.simulated = current.frame.t;
                }
                break;
            }
            self.take_frame();
            any = true;
        }
        if any {
            self.measure_speed();
            self.publish();
        }
    }

    fn measure_speed(&mut self) {
        let Some(current) = &self.current else { return };
        let (wall, simulated) = self.pace.measured_from;
        let passed = wall.elapsed();
        if passed >= SPEED_WINDOW {
            self.status.actual_speed = (current.frame.t - simulated) / passed.as_secs_f64();
            self.pace.measured_from = (Instant::now(), current.frame.t);
        }
    }

    /// Runs on to the next sample and hands it to everybody.
    fn take_frame(&mut self) {
        let Some(current) = self.current.as_mut().filter(|current| !current.ended) else { return };
        let Some(frame) = current.run.next_frame().cloned() else { return self.end_grasp() };
        if self.recorder_busy
            && let Some(recorder) = &self.recorder
        {
            recorder.frame(&frame);
        }
        let values = current.sensors.read(&frame).into_iter().map(|v| v.map_or(f32::NAN, |v| v as f32)).collect();
        let row = TraceRow { grasp: self.grasp, t: frame.t, line_bar: frame.line_bar, values };
        current.frame = Arc::new(frame);
        if let Err(TrySendError::Full(_)) = self.outlets.rows.try_send(row) {
            self.outlets.rows_lost.store(true, Ordering::Relaxed);
        }
    }

    fn end_grasp(&mut self) {
        let Some(current) = self.current.as_mut() else { return };
        current.ended = true;
        let trial = current.run.clone().finish(&current.scene);
        let already_told = current.run.info().warnings.len();
        for warning in trial.info.warnings.iter().skip(already_told) {
            self.outlets.tell(Notice::Warning(warning.clone()));
        }
        if self.recorder_busy
            && let Some(recorder) = &self.recorder
        {
            recorder.finish(&trial.info.quality, &trial.info.warnings);
            self.recorder_busy = false;
        }
        let summary = GraspSummary::new(&trial, &current.scene);
        self.last = Some(Arc::new(FinishedGrasp { grasp: self.grasp, summary }));
        if self.status.grasp_of_round < self.status.grasps && trial.info.quality.finite {
            self.next_grasp_at = Some(Instant::now() + BETWEEN_GRASPS);
        } else {
            self.status.finished = true;
            self.status.playing = false;
        }
        self.status.actual_speed = 0.0;
        self.publish();
    }

    /// Gives up a trial that has not reached its end.
    fn drop_recording(&mut self) {
        if self.recorder_busy
            && let Some(recorder) = &self.recorder
        {
            recorder.discard();
        }
        self.recorder_busy = false;
    }

    fn publish(&mut self) {
        let Some(current) = &self.current else { return (self.outlets.wake)() };
        self.revision += 1;
        self.outlets.snapshots.publish(Arc::new(Snapshot {
            revision: self.revision,
            grasp: self.grasp,
            scene: Arc::clone(&current.scene),
            stage: Arc::clone(&current.stage),
            object: self.card.clone(),
            channels: Arc::clone(&self.channels),
            frame: Arc::clone(&current.frame),
            status: self.status.clone(),
            last: self.last.clone(),
        }));
        (self.outlets.wake)();
    }
}

fn card_of(model: &ObjectModel) -> ObjectCard {
    let built_in = catalogue().iter().find(|b| b.name == model.name);
    ObjectCard {
        name: model.name.clone(),
        title: built_in.map_or_else(|| model.name.clone(), |b| b.title.clone()),
        class: model.class,
        mass: model.mass.mass,
        friction: model.friction,
        size: model.bounds.size(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use crate::recording::Store;

    struct Watched {
        worker: SimWorker,
        woken: Receiver<()>,
    }

    fn start(scene: Scene, store: PathBuf, grasps: u32) -> Watched {
        let (wake, woken) = channel();
        let wake: Wake = Arc::new(move || {
            // The test may have stopped listening.
            let _heard = wake.send(());
        });
        let layout = SensorLayout::named("C1").expect("in the catalogue");
        let setup = SimWorkerSetup { scene, layout, store, recording: true, grasps, playing: true, wake };
        Watched { worker: SimWorker::start(setup).expect("starts"), woken }
    }

    impl Watched {
        /// Waits, as long as it keeps waking us, until the snapshot is as wanted.
        fn until(&self, wanted: impl Fn(&Snapshot) -> bool) -> Arc<Snapshot> {
            loop {
                if let Some(snapshot) = self.worker.snapshot().filter(|s| wanted(s)) {
                    return snapshot;
                }
                self.woken.recv_timeout(Duration::from_secs(60)).expect("the worker is alive");
            }
        }
    }

    fn ball() -> Scene {
        let mut scene = Scene::default();
        "ball".clone_into(&mut scene.object.source);
        scene.timing.duration_s = 1.6;
        scene
    }

    #[test]
    fn a_watched_grasp_is_the_same_as_a_headless_one_and_is_stored() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("trials.sqlite");
        let watched = start(ball(), path.clone(), 2);
        assert!(watched.worker.send(Command::SetSpeed(64.0)));
        watched.until(|s| s.status.finished);
        let rows: Vec<TraceRow> = watched.worker.rows().collect();
        assert_eq!(rows.len(), 240, "two grasps of 120 samples, none lost");
        assert!(rows.windows(2).all(|w| (w[0].grasp, w[0].t) < (w[1].grasp, w[1].t)), "in order");
        assert!(!watched.worker.take_rows_lost());
        drop(watched);
        let store = Store::open(&path).expect("opens");
        assert_eq!(store.list(false).expect("lists").len(), 2);
        let object = ball().load_object().expect("loads");
        assert!(store.load(1).expect("whole") == grasp(&ball(), object.as_ref(), 0));
    }

    #[test]
    fn stepping_pausing_and_resetting() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("trials.sqlite");
        let watched = start(ball(), path.clone(), 1);
        watched.worker.send(Command::Pause);
        let paused = watched.until(|s| !s.status.playing);
        watched.worker.send(Command::Step);
        let stepped = watched.until(|s| s.frame.t > paused.frame.t);
        assert!((stepped.frame.t - paused.frame.t - 1.0 / 75.0).abs() < 1e-9);
        watched.worker.send(Command::Reset);
        let reset = watched.until(|s| s.grasp > stepped.grasp);
        assert_eq!(reset.frame.t, 0.0);
        drop(watched);
        let store = Store::open(&path).expect("opens");
        assert!(store.list(false).expect("lists").is_empty(), "unfinished trials are discarded");
    }

    #[test]
    fn a_scene_that_cannot_be_loaded_leaves_the_old_one() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let watched = start(ball(), folder.path().join("trials.sqlite"), 1);
        watched.until(|s| s.object.is_some());
        let mut missing = ball();
        "/nowhere/at/all.urdf".clone_into(&mut missing.object.source);
        watched.worker.send(Command::SetScene(Box::new(missing)));
        let notice = loop {
            if let Some(notice) = watched.worker.notices().find(|n| matches!(n, Notice::Failed(_))) {
                break notice;
            }
            watched.woken.recv_timeout(Duration::from_secs(60)).expect("the worker is alive");
        };
        assert!(matches!(notice, Notice::Failed(text) if text.contains("/nowhere/at/all.urdf")));
        assert!(watched.worker.snapshot().is_some_and(|s| s.object.as_ref().is_some_and(|o| o.name == "ball")));
    }
}
