//! The real gripper: its thread and its traces, and the simulation that closes its fingers with it.

use super::App;
use super::view::ViewSource;
use crate::app::traces::TraceHistory;
use palpate_lab::grasping::GraspStage;
use palpate_lab::recording::TrialRequest;
use palpate_lab::workers::{Command, GripperCommand, GripperView, GripperWorker, Notice, TrialView};
use palpate_serve::{Clients, Desk, DeskSetup};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_store::TrialPlace;
use palpate_tactile::board::SensorList;
use palpate_tactile::trial::Control;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::Instant;

/// Most grasps of an object: the paper's plateau is at three to four.
pub(in crate::app) const GRASPS: u32 = 4;

/// State of the real gripper in the window.
pub struct GripperFeature {
    /// Dropped before the worker.
    served: Option<Served>,
    pub(super) worker: GripperWorker,
    /// Its newest state, as of this frame.
    pub(in crate::app) view: Option<Arc<GripperView>>,
    pub(in crate::app) traces: TraceHistory,
    connected: bool,
    /// It is, and sends no readings.
    silent: bool,
    /// The simulation waits for the gripper: it is connected, and not the simulation is looked at.
    followed: bool,
    /// When the last reading came.
    heard: Instant,
    /// Part of the trial at the last look.
    part: Option<GraspStage>,
    /// Recording and number of grasps of the simulation before it began to follow the gripper.
    before_following: (Option<TrialPlace>, u32),
    /// Scene that the gripper's thread has.
    scene: Scene,
    /// Scene from before the empty hand is shown to adapt to.
    before_adapting: Option<Scene>,
}

/// Other programs that control the gripper, until this is dropped.
struct Served {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Served {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        // A panic in the thread has printed itself.
        let _ended = self.thread.take().map(JoinHandle::join);
    }
}

impl GripperFeature {
    /// `scene` is the one that the worker was started with.
    pub(in crate::app) fn new(worker: GripperWorker, scene: Scene) -> Self {
        Self {
            served: None,
            worker,
            view: None,
            traces: TraceHistory::default(),
            connected: false,
            silent: false,
            followed: false,
            heard: Instant::now(),
            part: None,
            before_following: (Some(TrialPlace::DemoLog), GRASPS),
            scene,
            before_adapting: None,
        }
    }

    /// Sends a command to the gripper; returns its number.
    pub fn send(&self, command: GripperCommand) -> u64 {
        self.worker.send(command)
    }

    /// Time for which a connected board has sent no readings (s); none while they come. What was read before is not so any more.
    pub(in crate::app) fn silent_s(&self) -> Option<u64> {
        self.view.as_ref()?.is_silent().then(|| self.heard.elapsed().as_secs())
    }

    /// Vents the fingers, where a board is connected.
    pub(in crate::app) fn stop(&self) {
        if self.connected {
            self.worker.send(GripperCommand::Vent);
        }
    }
}

impl App {
    /// Takes the sensors of a gripper file.
    pub(in crate::app) fn set_gripper_file(&mut self, path: &Path) {
        match SensorList::from_file(path) {
            Ok(sensors) => _ = self.gripper.send(GripperCommand::SetSensors(sensors)),
            Err(cause) => self.notices.error(cause),
        }
    }

    /// Takes in rows and notices since the last frame, and lets the simulation follow.
    pub(super) fn poll_gripper(&mut self) {
        let Self { gripper, simulation, notices, .. } = self;
        if gripper.scene != simulation.scene {
            gripper.scene = simulation.scene.clone();
            gripper.worker.send(GripperCommand::SetScene(Box::new(gripper.scene.clone())));
        }
        if gripper.worker.take_rows_lost() {
            gripper.traces.clear();
        }
        for row in gripper.worker.rows() {
            gripper.heard = Instant::now();
            gripper.traces.push(&row);
        }
        for notice in gripper.worker.notices() {
            match notice {
                Notice::Failed(text) => notices.failed("gripper", text),
                other => notices.show(other),
            }
        }
        gripper.view = gripper.worker.view();
        let Some(now) = gripper.view.clone() else { return };
        // Grasps read through other calibrations are not comparable.
        gripper.traces.forget_before(now.calibrated);
        if gripper.silent != now.is_silent() {
            gripper.silent = now.is_silent();
            // What was said without its readings is no longer so.
            if !now.is_silent() {
                self.notices.done("gripper");
            }
        }
        if gripper.connected != now.is_connected() {
            gripper.connected = now.is_connected();
            if now.is_connected() {
                self.notices.done("gripper");
            }
            self.view.source = if now.is_connected() { ViewSource::Gripper } else { ViewSource::Simulation };
            self.labelling.show_again();
        }
        let followed = match self.view.source {
            ViewSource::Simulation => false,
            ViewSource::Gripper => self.gripper.connected,
            ViewSource::Trial => self.gripper.connected && self.gripper.followed,
        };
        if std::mem::replace(&mut self.gripper.followed, followed) != followed {
            self.hand_over();
        }
        self.show_empty(now.trial.as_ref().is_some_and(|trial| trial.adapting));
        let part = now.trial.as_ref().map(|trial| trial.stage);
        let before = std::mem::replace(&mut self.gripper.part, part);
        let begins = before != part;
        if begins && before.is_none() {
            // It says itself how it ends.
            self.notices.done("gripper");
        }
        if begins && part == Some(GraspStage::Phase(Phase::Close)) && self.view.ghost && followed {
            // The simulated fingers close beside the real ones.
            for command in [Command::SetSpeed(1.0), Command::Reset, Command::Play] {
                self.simulation.send(command);
            }
        }
    }

    /// Lets other programs control the gripper beside the window, through the same commands.
    pub fn serve(&mut self, desk: DeskSetup, clients: Clients) {
        let desk = Desk::new(desk, clients, |wake| self.gripper.worker.tap(wake));
        let stop = Arc::<AtomicBool>::default();
        let stopped = Arc::clone(&stop);
        let serving = move || _ = desk.serve(|| !stopped.load(Ordering::Relaxed));
        match Builder::new().name("serve".to_owned()).spawn(serving) {
            Ok(thread) => self.gripper.served = Some(Served { stop, thread: Some(thread) }),
            Err(cause) => self.notices.show(Notice::Failed(format!("Other programs are not served: {cause}"))),
        }
    }

    /// Connects to a port; without one, to the first gripper that is found.
    pub fn connect(&mut self, port: Option<PathBuf>) {
        if port.is_some() {
            self.view.port.clone_from(&port);
        }
        self.gripper.send(GripperCommand::Connect(port));
    }

    /// Connects to the last port, or disconnects.
    pub(in crate::app) fn toggle_connection(&mut self) {
        self.gripper.send(match self.gripper.connected {
            true => GripperCommand::Disconnect,
            false => GripperCommand::Connect(self.view.port.clone()),
        });
    }

    /// Actuation of the next trial: the one chosen, or the board's where nobody can move the fingers by hand.
    pub(in crate::app) fn control(&self) -> Control {
        let driven_only = self.gripper_view().is_some_and(|gripper| gripper.driven_only);
        if driven_only && self.view.control == Control::ByHand { Control::Driven } else { self.view.control }
    }

    /// Changes to the next actuation.
    pub(in crate::app) fn next_control(&mut self) {
        let before = self.control();
        let now = CONTROLS.iter().position(|control| *control == before).unwrap_or(0);
        self.view.control = CONTROLS[(now + 1) % CONTROLS.len()];
        self.view.control = self.control();
        self.notices.info(format!("Actuation: {}.", control_title(self.view.control)));
    }

    /// Detects trials from the movement of the fingers, or stops that.
    pub(in crate::app) fn toggle_watch(&mut self) {
        let watching = self.gripper_view().is_some_and(|gripper| gripper.watching.is_some());
        let request = TrialRequest { object: None, length_s: None, control: Control::Free, adds: false };
        self.gripper.send(GripperCommand::Watch((!watching).then_some(request)));
        let state = if watching { "press R to record" } else { "detected automatically" };
        self.notices.info(format!("Trials: {state}."));
    }

    /// Shows the empty hand while a close to adapt to is recorded, and then the scene from before.
    fn show_empty(&mut self, adapting: bool) {
        match (adapting, self.gripper.before_adapting.take()) {
            (true, None) => {
                self.gripper.before_adapting = Some(self.simulation.scene.clone());
                self.simulation.use_scene(self.simulation.scene_with(EMPTY));
            }
            (true, before) => self.gripper.before_adapting = before,
            (false, Some(before)) => self.simulation.use_scene(before),
            (false, None) => {}
        }
    }

    /// While a gripper is connected and shown, the simulation waits for it and stores nothing.
    fn hand_over(&mut self) {
        let commands = if self.gripper.followed {
            // Nothing is known yet where the window opens with a gripper.
            let now = self.snapshot().map(|snapshot| (snapshot.status.recording, snapshot.status.grasps));
            let known = now.filter(|(recording, _)| recording.is_some());
            self.gripper.before_following = known.unwrap_or(self.gripper.before_following);
            vec![Command::SetRecording(None), Command::SetGrasps(1), Command::Reset, Command::Pause]
        } else {
            let (recording, grasps) = self.gripper.before_following;
            vec![Command::SetRecording(recording), Command::SetGrasps(grasps)]
        };
        commands.into_iter().for_each(|command| self.simulation.send(command));
    }
}

/// Actuations, in the order of the key A.
pub(in crate::app) const CONTROLS: [Control; 3] = [Control::ByHand, Control::Driven, Control::Free];

/// Name of an actuation.
pub(in crate::app) fn control_title(control: Control) -> &'static str {
    match control {
        Control::ByHand => "manual",
        Control::Driven => "board",
        Control::Free => "untimed",
    }
}

/// Instruction for the person at the control box.
pub(in crate::app) fn instruction(trial: &TrialView) -> &'static str {
    let by_hand = trial.request.control == Control::ByHand;
    match trial.stage {
        _ if by_hand && trial.emulated => "Recording: the emulated hand moves by itself",
        GraspStage::Lead if by_hand => "Get ready to close",
        GraspStage::Lead => "At rest",
        GraspStage::Phase(Phase::Close) if by_hand => "CLOSE: raise the pressure",
        GraspStage::Phase(Phase::Close) => "Closing",
        GraspStage::Phase(Phase::Hold) if by_hand => "HOLD: keep the pressure",
        GraspStage::Phase(Phase::Hold) => "Holding",
        GraspStage::Phase(Phase::Release) if by_hand => "RELEASE: lower the pressure",
        GraspStage::Phase(Phase::Release) => "Releasing",
        GraspStage::Settle => "Settling",
        GraspStage::Free => "Recording",
    }
}
