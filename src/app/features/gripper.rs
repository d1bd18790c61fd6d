//! The real gripper: its thread and its traces, and the simulation that closes its fingers with it.

use crate::app::features::simulation::SimulationFeature;
use crate::app::features::view::ViewState;
use crate::app::notices::Notices;
use crate::app::traces::TraceHistory;
use crate::app::view_source::ViewSource;
use palpate_lab::grasping::GraspStage;
use palpate_lab::recording::TrialRequest;
use palpate_lab::workers::{Command, GripperCommand, GripperWorker, TrialView};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_store::TrialPlace;
use palpate_tactile::trial::Control;

/// Action on the real gripper.
#[derive(Clone)]
pub enum GripperAction {
    /// Send a command to the gripper.
    Send(GripperCommand),
    /// Connect to the last port, or disconnect.
    ToggleConnection,
    /// Set the actuation.
    SetControl(Control),
    /// Change to the next actuation.
    NextControl,
    /// Detect trials from the movement of the fingers, or stop that.
    ToggleWatch,
}

/// State of the real gripper in the window.
pub(in crate::app) struct GripperFeature {
    worker: GripperWorker,
    traces: TraceHistory,
    connected: bool,
    /// Part of the trial at the last look.
    part: Option<GraspStage>,
    /// Recording and number of grasps of the simulation before it began to follow the gripper.
    before_following: Option<(Option<TrialPlace>, u32)>,
    /// Scene that the gripper's thread has.
    scene: Scene,
    /// Scene from before the empty hand is shown to adapt to.
    before_adapting: Option<Scene>,
}

impl GripperFeature {
    /// `scene` is the one that the worker was started with.
    pub(in crate::app) fn new(worker: GripperWorker, scene: Scene) -> Self {
        let traces = TraceHistory::default();
        Self { worker, traces, connected: false, part: None, before_following: None, scene, before_adapting: None }
    }

    pub(in crate::app) fn worker(&self) -> &GripperWorker {
        &self.worker
    }

    pub(in crate::app) fn traces(&self) -> &TraceHistory {
        &self.traces
    }

    /// Keeps the last trial in the plots, while rows after it are only watched.
    pub(in crate::app) fn keep_trial_in_sight(&mut self, kept: bool) {
        self.traces.hold_grasp(kept);
    }

    /// Takes in rows and notices since the last frame, and lets the simulation follow.
    pub(in crate::app) fn gather(
        &mut self,
        simulation: &mut SimulationFeature,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        if self.scene != *simulation.scene() {
            self.scene = simulation.scene().clone();
            self.worker.send(GripperCommand::SetScene(Box::new(self.scene.clone())));
        }
        if self.worker.take_rows_lost() {
            self.traces.clear();
        }
        for row in self.worker.rows() {
            self.traces.push(&row);
        }
        self.worker.notices().for_each(|notice| notices.show(notice));
        let Some(gripper) = self.worker.view() else { return };
        if self.connected != gripper.is_connected() {
            self.connected = gripper.is_connected();
            view.source = if self.connected { ViewSource::Gripper } else { ViewSource::Simulation };
            self.hand_over(simulation, notices);
        }
        self.show_empty(gripper.trial.as_ref().is_some_and(|trial| trial.adapting), simulation);
        let part = gripper.trial.as_ref().map(|trial| trial.stage);
        if self.part != part {
            self.part = part;
            if part == Some(GraspStage::Phase(Phase::Close)) {
                // The simulated fingers lie over the real ones.
                for command in [Command::SetSpeed(1.0), Command::Reset, Command::Play] {
                    simulation.send(command, notices);
                }
            }
        }
    }

    pub(in crate::app) fn apply(&mut self, action: GripperAction, view: &mut ViewState, notices: &mut Notices) {
        match action {
            GripperAction::Send(command) => {
                if let GripperCommand::Connect(Some(port)) = &command {
                    view.port = Some(port.clone());
                }
                self.worker.send(command);
            }
            GripperAction::ToggleConnection => {
                self.worker.send(match self.connected {
                    true => GripperCommand::Disconnect,
                    false => GripperCommand::Connect(view.port.clone()),
                });
            }
            GripperAction::SetControl(control) => view.control = control,
            GripperAction::NextControl => {
                let now = CONTROLS.iter().position(|control| *control == view.control).unwrap_or(0);
                view.control = CONTROLS[(now + 1) % CONTROLS.len()];
                notices.info(format!("Actuation: {}.", control_title(view.control)));
            }
            GripperAction::ToggleWatch => {
                let watching = self.worker.view().is_some_and(|gripper| gripper.watching.is_some());
                let request = TrialRequest { object: None, length_s: None, control: Control::Free, adds: false };
                self.worker.send(GripperCommand::Watch((!watching).then_some(request)));
                let state = if watching { "press R to record" } else { "detected automatically" };
                notices.info(format!("Trials: {state}."));
            }
        }
    }

    /// Shows the empty hand while a close to adapt to is recorded, and then the scene from before.
    fn show_empty(&mut self, adapting: bool, simulation: &mut SimulationFeature) {
        match (adapting, self.before_adapting.take()) {
            (true, None) => {
                self.before_adapting = Some(simulation.scene().clone());
                simulation.use_scene(simulation.scene_with(EMPTY));
            }
            (true, before) => self.before_adapting = before,
            (false, Some(before)) => simulation.use_scene(before),
            (false, None) => {}
        }
    }

    /// Vents the fingers, where a board is connected.
    pub(in crate::app) fn stop(&self) {
        if self.connected {
            self.worker.send(GripperCommand::Vent);
        }
    }

    /// While a gripper is connected, the simulation waits for it and stores nothing.
    fn hand_over(&mut self, simulation: &mut SimulationFeature, notices: &mut Notices) {
        let commands = if self.connected {
            let snapshot = simulation.worker().snapshot();
            let status = snapshot.map(|snapshot| snapshot.status.clone()).unwrap_or_default();
            self.before_following = Some((status.recording, status.grasps));
            vec![Command::SetRecording(None), Command::SetGrasps(1), Command::Reset, Command::Pause]
        } else {
            let before = self.before_following.take();
            before.map_or_else(Vec::new, |(recording, grasps)| {
                vec![Command::SetRecording(recording), Command::SetGrasps(grasps.max(1))]
            })
        };
        commands.into_iter().for_each(|command| simulation.send(command, notices));
    }
}

/// Actuations, in the order of the key M.
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
