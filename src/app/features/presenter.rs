//! Presenter mode: object after object in random poses, with a score. Its grasps go into the demo log.

use crate::app::features::simulation::{SimulationAction, SimulationFeature};
use crate::app::features::view::ViewState;
use crate::app::notices::Notices;
use crate::app::view_source::ViewSource;
use palpate_lab::grasping::Presentation;
use palpate_lab::workers::{Command, Snapshot};
use palpate_sim::scene::PoseSpread;
use palpate_store::TrialPlace;
use std::time::Duration;

/// Time for which a verdict is shown (s).
const VERDICT_S: f64 = 5.0;

/// Verdicts so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::app) struct Score {
    /// Right ones.
    pub(in crate::app) right: u32,
    /// Wrong ones.
    pub(in crate::app) wrong: u32,
}

impl Score {
    /// The count that a verdict belongs to; none for a round without one.
    fn count(&mut self, right: Option<bool>) -> Option<&mut u32> {
        right.map(|right| if right { &mut self.right } else { &mut self.wrong })
    }
}

/// State of presenter mode.
#[derive(Default)]
pub(in crate::app) struct PresenterFeature {
    /// Poses, and where grasps were recorded, as they were before; none outside of presenter mode.
    before: Option<(PoseSpread, Option<TrialPlace>)>,
    /// Presentations so far: each has another order of objects.
    presentations: u64,
    presentation: Presentation,
    score: Score,
    /// Number of the grasp that was judged last.
    judged: u64,
    /// The round that was judged last, by the number of the grasp before it, and its verdict.
    last: Option<(u64, Option<bool>)>,
    /// Threshold at the last look.
    threshold: Option<f64>,
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
        let presentations = self.presentations + 1;
        *self = Self {
            before: Some((scene.pose.clone(), snapshot.status.recording)),
            presentations,
            presentation: Presentation::new(presentations),
            judged: snapshot.grasp,
            ..Self::default()
        };
        view.source = ViewSource::Simulation;
        scene.pose = self.presentation.poses();
        for command in [Command::SetFirstDrawn(true), Command::SetRecording(Some(TrialPlace::DemoLog))] {
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
            self.judge(snapshot);
            self.next_at = Some(now + VERDICT_S);
        }
        // Whoever changes the threshold thinks about one more grasp.
        let threshold = snapshot.identification.as_ref().map(|view| view.rule.threshold);
        if std::mem::replace(&mut self.threshold, threshold) != threshold {
            self.next_at = self.next_at.map(|_| now + VERDICT_S);
        }
        // Another object or another grasp was asked for meanwhile.
        if !snapshot.status.finished {
            self.next_at = None;
        }
        let Some(left) = self.next_at.map(|next_at| next_at - now) else { return };
        if left <= 0.0 {
            self.bring_next(simulation, notices);
        } else {
            ctx.request_repaint_after(Duration::from_secs_f64(left));
        }
    }

    /// Counts a verdict; one after a further grasp replaces that of its round.
    fn judge(&mut self, snapshot: &Snapshot) {
        self.judged = snapshot.grasp;
        let grasps = snapshot.status.grasp_of_round;
        let round = snapshot.grasp.saturating_sub(u64::from(grasps));
        let right = snapshot.identification.as_ref().and_then(|view| view.is_right(snapshot.truth()));
        if let Some((before, right)) = self.last.replace((round, right))
            && before == round
            && let Some(count) = self.score.count(right)
        {
            *count -= 1;
        }
        if let Some(count) = self.score.count(right) {
            *count += 1;
        }
        self.presentation.take_note(grasps);
    }

    /// Brings the next object.
    pub(in crate::app) fn bring_next(&mut self, simulation: &mut SimulationFeature, notices: &mut Notices) {
        self.next_at = None;
        let object = self.presentation.next_object(&simulation.scene().object.source);
        simulation.open_in(object, self.presentation.poses(), notices);
    }
}
