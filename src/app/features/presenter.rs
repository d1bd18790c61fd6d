//! Presenter mode: object after object in random poses, with a score.

use crate::app::features::simulation::{SimulationAction, SimulationFeature};
use crate::app::features::view::ViewState;
use crate::app::notices::Notices;
use crate::app::view_source::ViewSource;
use palpate_lab::workers::{Command, Snapshot};
use palpate_sim::scene::{PosePreset, PoseSpread};
use std::time::Duration;

/// Time for which a verdict is shown (s).
const VERDICT_S: f64 = 5.0;
/// The preset of poses: hard enough that some objects need several grasps.
const PRESET: &str = "B";

/// Verdicts so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::app) struct Score {
    /// Right ones.
    pub(in crate::app) right: u32,
    /// Wrong ones.
    pub(in crate::app) wrong: u32,
}

/// State of presenter mode.
#[derive(Default)]
pub(in crate::app) struct PresenterFeature {
    /// Poses and recording as they were before; none outside of presenter mode.
    before: Option<(PoseSpread, bool)>,
    score: Score,
    /// Number of the grasp that was judged last.
    judged: u64,
    /// When the next object comes, on the clock of the window (s).
    next_at: Option<f64>,
}

impl PresenterFeature {
    /// Verdicts so far.
    pub(in crate::app) fn score(&self) -> Score {
        self.score
    }

    /// Begins or ends, counts verdicts, and brings the next object.
    pub(in crate::app) fn gather(
        &mut self,
        ctx: &egui::Context,
        simulation: &mut SimulationFeature,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        let Some(snapshot) = simulation.worker().snapshot() else { return };
        match (view.presents, self.before.is_some()) {
            (true, false) => self.begin(&snapshot, simulation, view, notices),
            (false, true) => self.end(simulation, view, notices),
            (false, false) => {}
            (true, true) => self.go_on(ctx, &snapshot, simulation, notices),
        }
    }

    fn begin(
        &mut self,
        snapshot: &Snapshot,
        simulation: &mut SimulationFeature,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        let mut scene = simulation.scene().clone();
        let recording = snapshot.status.recording;
        *self = Self { before: Some((scene.pose.clone(), recording)), judged: snapshot.grasp, ..Self::default() };
        view.source = ViewSource::Simulation;
        if let Some(preset) = PosePreset::named(PRESET) {
            scene.pose = preset.poses();
        }
        for command in [Command::SetFirstDrawn(true), Command::SetRecording(false)] {
            simulation.send(command, notices);
        }
        simulation.apply(SimulationAction::SetScene(Box::new(scene)), view, notices);
        simulation.send(Command::Play, notices);
    }

    fn end(&mut self, simulation: &mut SimulationFeature, view: &mut ViewState, notices: &mut Notices) {
        let Some((pose, recording)) = self.before.take() else { return };
        let mut scene = simulation.scene().clone();
        scene.pose = pose;
        simulation.send(Command::SetFirstDrawn(false), notices);
        simulation.send(Command::SetRecording(recording), notices);
        simulation.apply(SimulationAction::SetScene(Box::new(scene)), view, notices);
    }

    fn go_on(
        &mut self,
        ctx: &egui::Context,
        snapshot: &Snapshot,
        simulation: &mut SimulationFeature,
        notices: &mut Notices,
    ) {
        let now = ctx.input(|input| input.time);
        if snapshot.status.finished && snapshot.grasp > self.judged {
            self.judged = snapshot.grasp;
            self.next_at = Some(now + VERDICT_S);
            match snapshot.identification.as_ref().and_then(|view| view.is_right(snapshot.truth())) {
                Some(true) => self.score.right += 1,
                Some(false) => self.score.wrong += 1,
                None => {}
            }
        }
        // Another object or another grasp was asked for meanwhile.
        if !snapshot.status.finished {
            self.next_at = None;
        }
        let Some(left) = self.next_at.map(|next_at| next_at - now) else { return };
        if left <= 0.0 {
            self.next_at = None;
            simulation.open_next(notices);
        } else {
            ctx.request_repaint_after(Duration::from_secs_f64(left));
        }
    }
}
