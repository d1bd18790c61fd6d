//! Session of the simulation thread: owns the simulated gripper, keeps pace with real time and publishes snapshots.

mod beginning;
mod checks;
mod jobs;

use super::current::Current;
use super::held_object::LoadedObject;
use super::job::Job;
use super::live_recognition::LiveRecognition;
use super::messages::{
    Command, FinishedGrasp, GhostGrasp, MeasuredAccuracy, Notice, ObjectCard, Refusal, SimWorkerSetup, Snapshot,
    Status, TraceRow,
};
use super::pace::Pace;
use super::worker::{Inbox, Publisher, WorkerEnds};
use crate::datasets::SensorView;
use crate::grasping::{Advisor, EndState, GraspSummary, Row};
use crate::recording::{Recorder, RecorderNotice};
use jobs::{AccuracyRequest, CheckRequest, CheckResult, GhostRequest, Subject, accuracy_job, check_job, ghost_job};
use palpate_learn::Models;
use palpate_sim::frame::GraspFailure;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::ObjectError;
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::Scene;
use palpate_tactile::Channel;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Pause between two grasps of a round at speed one or slower; played faster, it is shorter too.
const BETWEEN_GRASPS: Duration = Duration::from_millis(600);
/// Longest time spent stepping before something is published.
const BUDGET: Duration = Duration::from_millis(12);
/// Being later than this counts as unable to keep up: the clock is set anew instead of being chased.
const LATEST: f64 = 0.25;

/// State of the thread.
pub(super) struct Session {
    publisher: Publisher<Snapshot>,
    recorder: Option<Recorder>,
    accuracy: Job<AccuracyRequest, MeasuredAccuracy>,
    /// The scene whose accuracy was last asked for.
    measured: Option<Scene>,
    checker: Job<CheckRequest, CheckResult>,
    ghost: Job<GhostRequest, GhostGrasp>,
    /// The last finished grasp, where it can be computed again.
    subject: Option<Subject>,
    models: Models,
    recognition: Option<LiveRecognition>,
    /// Probability from which a class counts as certain, in place of the model's own.
    threshold: Option<f64>,
    /// The first grasp of each object has a random pose too.
    first_drawn: bool,
    sensors: SensorView,
    nominal: Scene,
    object: Option<LoadedObject>,
    current: Option<Current>,
    card: Option<Arc<ObjectCard>>,
    channels: Arc<[Channel]>,
    status: Status,
    last: Option<Arc<FinishedGrasp>>,
    revision: u64,
    grasp: u64,
    /// Number of the first grasp of the scene.
    scene_since: u64,
    /// The scene's own pose has been grasped; random poses follow.
    own_pose_done: bool,
    /// Random poses drawn for this scene so far; the next one's seed is one more.
    poses_drawn: u64,
    /// Draws them; made when the first one is wanted.
    sampler: Option<PoseSampler>,
    pace: Pace,
    next_grasp_at: Option<Instant>,
    /// Whether grasps get a ghost.
    ghost_wanted: bool,
    /// Chooses poses, where the scene asks for it.
    advisor: Advisor,
}

impl Session {
    /// Runs until the window is closed.
    pub(super) fn run(setup: SimWorkerSetup, publisher: Publisher<Snapshot>, inbox: &Inbox<Command>) {
        let notifier = publisher.notifier.clone();
        let recorder = Recorder::start(setup.store, move |notice| {
            notifier.notify(match notice {
                RecorderNotice::Stored(stored) => Notice::Stored(stored),
                RecorderNotice::Logged(stored, place) => Notice::Logged(stored, place),
                RecorderNotice::Warning(text) => Notice::Warning(text),
                RecorderNotice::Failed(text) => Notice::Failed(text),
                // Only the real gripper's trials say so.
                RecorderNotice::Begun(_) | RecorderNotice::Recorded(_) => return,
            });
        });
        let recorder = publisher.or_notice("trials cannot be stored", recorder);
        let grasps = setup.grasps.max(1);
        let mut session = Self {
            recorder,
            accuracy: accuracy_job(inbox.waker()),
            measured: None,
            checker: check_job(inbox.waker()),
            ghost: ghost_job(inbox.waker()),
            subject: None,
            models: setup.models,
            recognition: None,
            threshold: None,
            first_drawn: false,
            sensors: setup.sensors,
            nominal: setup.scene,
            object: None,
            current: None,
            card: None,
            channels: Arc::from([]),
            status: Status {
                playing: setup.playing,
                target_speed: 1.0,
                grasps,
                recording: setup.recording,
                ..Status::default()
            },
            last: None,
            revision: 0,
            grasp: 0,
            scene_since: 1,
            own_pose_done: false,
            poses_drawn: 0,
            sampler: None,
            pace: Pace::starting_at(0.0),
            next_grasp_at: None,
            ghost_wanted: false,
            advisor: Advisor::default(),
            publisher,
        };
        session.begin_somehow();
        while session.wait_and_handle(inbox).is_ok() {
            session.advance();
        }
    }

    /// Waits until something is due or a command comes; an error at the end.
    fn wait_and_handle(&mut self, inbox: &Inbox<Command>) -> Result<(), WorkerEnds> {
        let (mut waiting, mut next) = (Vec::new(), inbox.next(self.time_to_grasp()));
        while let Ok(Some(command)) = next {
            waiting.push(command);
            next = inbox.next(Some(Duration::ZERO));
        }
        // Of several scenes in a row only the last matters: sliders send many.
        let last_scene = waiting.iter().rposition(|command| matches!(command, Command::SetScene(_)));
        for (k, command) in waiting.into_iter().enumerate() {
            if last_scene == Some(k) || !matches!(command, Command::SetScene(_)) {
                self.handle(command);
            }
        }
        next.map(|_nothing| ())
    }

    /// Time until the simulation goes on; `None` while it is paused.
    fn time_to_grasp(&self) -> Option<Duration> {
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

    fn handle(&mut self, command: Command) {
        match command {
            Command::SetScene(scene) => self.set_scene(*scene),
            Command::Play => {
                self.status.playing = true;
                if self.status.finished {
                    // The next poses are new ones, not those of the round before.
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
                // From the end of a grasp a step leads to the next one of its round.
                if self.next_grasp_at.take().is_some() {
                    self.begin_grasp();
                } else {
                    self.take_frame();
                }
            }
            Command::Reset => {
                self.own_pose_done = false;
                self.begin_round();
            }
            Command::SetSpeed(speed) => {
                self.status.target_speed = speed.clamp(1.0 / 64.0, 64.0);
                self.set_pace();
            }
            Command::SetGrasps(grasps) => {
                self.status.grasps = grasps.max(1);
                if let Some(recognition) = &mut self.recognition {
                    recognition.set_most_grasps(self.status.grasps);
                }
                self.reconsider();
            }
            Command::SetThreshold(threshold) => {
                self.threshold = Some(threshold);
                if let Some(recognition) = &mut self.recognition {
                    recognition.set_threshold(threshold);
                }
                self.reconsider();
            }
            Command::GraspOnceMore => self.grasp_once_more(),
            Command::SetFirstDrawn(drawn) => {
                self.first_drawn = drawn;
                self.poses_drawn = 0;
            }
            Command::SetRecording(recording) => {
                self.status.recording = recording;
                // The running grasp is stored in the place that was chosen when it began.
                if let Some(current) = self.current.as_mut().filter(|_| recording.is_none()) {
                    current.recorded = None;
                }
            }
            Command::SetErrorBand(shown) => {
                if std::mem::replace(&mut self.status.error_band, shown) != shown {
                    self.own_pose_done = false;
                    self.begin_round();
                }
            }
            Command::ComputeAgain => self.compute_again(),
            Command::Pull(force) => {
                if let Some(current) = self.current.as_mut().filter(|c| force.is_finite() && !c.ended) {
                    current.pull(force);
                }
            }
            Command::SetSensors(sensors) => {
                if std::mem::replace(&mut self.sensors, sensors.clone()) != sensors {
                    self.own_pose_done = false;
                    self.begin_round();
                }
            }
            Command::SetModels(models) => {
                self.models = models;
                self.own_pose_done = false;
                self.begin_round();
            }
            Command::SetGhost(wanted) => {
                self.ghost_wanted = wanted;
                self.begin_ghost();
            }
        }
        self.publish();
    }

    fn set_pace(&mut self) {
        self.pace = Pace::starting_at(self.current.as_ref().map_or(0.0, |current| current.frame.t));
    }

    /// Grasps another scene; where it cannot be had, the current grasp continues.
    fn set_scene(&mut self, scene: Scene) {
        if let Err(cause) = self.load_object(&scene) {
            return self.refuse(scene, &cause);
        }
        self.nominal = scene;
        // Results of another scene say nothing about this one.
        self.last = None;
        self.begin_check(None);
        self.scene_since = self.grasp + 1;
        if let Some(recognition) = &mut self.recognition {
            recognition.another_scene();
        }
        self.sampler = None;
        self.own_pose_done = self.first_drawn;
        if !self.first_drawn {
            self.poses_drawn = 0;
        }
        // An object chosen after the last grasp is grasped at once.
        self.status.playing |= self.status.finished;
        self.begin_round();
    }

    fn refuse(&self, refused: Scene, cause: &ObjectError) {
        let refusal = Refusal { refused, kept: self.nominal.clone(), cause: cause.to_string() };
        self.publisher.notify(Notice::SceneRefused(Box::new(refusal)));
    }

    /// Takes all samples that are due, within the budget.
    fn advance(&mut self) {
        self.take_results();
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
                    self.pace.give_way(current.frame.t);
                }
                break;
            }
            self.take_frame();
            any = true;
        }
        if any {
            if let Some(current) = &self.current {
                self.status.actual_speed = self.pace.measured(current.frame.t).unwrap_or(self.status.actual_speed);
            }
            self.publish();
        }
    }

    /// Runs to the next sample and passes it to plots and recogniser.
    fn take_frame(&mut self) {
        let Some(current) = self.current.as_mut().filter(|current| !current.ended) else { return };
        let Some(frame) = current.run.next_frame().cloned() else { return self.end_grasp() };
        let read = current.reader.read(&frame);
        let mut sample = Row::of_values(&frame, &read);
        if let Some(warning) = self.recognition.as_mut().and_then(|own| own.push(sample.t_s, &sample)) {
            self.publisher.notify(Notice::Warning(warning));
        }
        let plotted = self.channels.len();
        let errors = current.refined_run.as_mut().map(|c| c.errors(frame.t, &read, &current.reader));
        let errors: Box<[f32]> = errors.unwrap_or_default().into_iter().take(plotted).collect();
        let frame = Arc::new(frame);
        current.frame = Arc::clone(&frame);
        if frame.phase == Phase::Hold {
            self.status.nothing_held = self.card.is_some() && current.stage.force_on_object(&frame).is_none();
        }
        sample.values = sample.values[..plotted].into();
        let answer = self.recognition.as_ref().and_then(LiveRecognition::view);
        let (grasp, frame) = (self.grasp, Some(frame));
        self.publisher.row(TraceRow { grasp, rolling: false, sample, closing_s: 0.0, errors, frame, answer });
    }

    fn end_grasp(&mut self) {
        let Some(current) = self.current.as_mut() else { return };
        current.ended = true;
        let mut trial = current.run.finish(&current.scene);
        // A support close to the object may have been touched instead.
        self.status.nothing_held |= trial.data.quality.failure == Some(GraspFailure::NeverTouched);
        trial.header.earlier.clone_from(&current.earlier);
        for warning in trial.header.warnings.iter().skip(current.warned) {
            self.publisher.notify(Notice::Warning(warning.clone()));
        }
        let subject = Subject {
            grasp: self.grasp,
            scene: Arc::clone(&current.scene),
            object: self.object.as_ref().and_then(|object| object.model.clone()),
            seed: trial.header.seed,
            end: EndState::of(trial.frames()),
            recorded: current.recorded.is_some(),
        };
        let repeatable = !current.pulled && current.scene.solver.finer().is_some();
        let summary = GraspSummary::new(&trial, &current.scene);
        let accuracy = current.scene.solver.accuracy;
        self.last = Some(Arc::new(FinishedGrasp { grasp: self.grasp, summary, accuracy, repeatable }));
        let finite = trial.data.quality.finite;
        if let (Some(place), Some(recorder)) = (current.recorded, &self.recorder) {
            recorder.store(place, trial);
        }
        self.begin_check(Some(subject).filter(|_| repeatable));
        self.status.actual_speed = 0.0;
        if finite {
            if let Some(recognition) = &mut self.recognition {
                recognition.end_grasp();
            }
            let pause = BETWEEN_GRASPS.div_f64(self.status.target_speed.max(1.0));
            self.next_grasp_at = Some(Instant::now() + pause);
            self.reconsider();
        } else {
            self.end_round();
        }
        self.publish();
    }

    /// Between two grasps: is another one needed?
    fn reconsider(&mut self) {
        let decided = self.recognition.as_ref().is_some_and(|recognition| recognition.decision().is_some());
        if self.next_grasp_at.is_some() && (decided || self.status.grasp_of_round >= self.status.grasps) {
            self.end_round();
        }
    }

    /// Continues a round that has ended, where a raised threshold asks for it.
    fn grasp_once_more(&mut self) {
        if self.status.finished && self.recognition.as_mut().is_some_and(LiveRecognition::go_on) {
            self.status.playing = true;
            self.begin_grasp();
        }
    }

    fn end_round(&mut self) {
        self.next_grasp_at = None;
        self.status.finished = true;
        self.status.playing = false;
    }

    fn publish(&mut self) {
        let Some(current) = &self.current else { return self.publisher.wake() };
        self.revision += 1;
        self.publisher.publish(Snapshot {
            revision: self.revision,
            grasp: self.grasp,
            scene_since: self.scene_since,
            scene: Arc::clone(&current.scene),
            plan: Arc::clone(&current.plan),
            stage: Arc::clone(&current.stage),
            object: self.card.clone(),
            channels: Arc::clone(&self.channels),
            frame: Arc::clone(&current.frame),
            status: self.status.clone(),
            last: self.last.clone(),
            identification: self.recognition.as_ref().and_then(LiveRecognition::view),
            recognition_off: self.recognition.as_ref().and_then(LiveRecognition::why_off),
            accuracy: self.accuracy.outcome(),
            ghost: self.ghost.outcome(),
        });
    }
}
