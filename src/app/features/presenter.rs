//! Presenter mode: object after object in random poses, with a score. Its grasps go into the demo log.

use super::App;
use super::view::ViewSource;
use palpate_lab::grasping::Presentation;
use palpate_lab::workers::{Command, GripperView, Snapshot};
use palpate_sim::scene::{PoseSpread, Scene};
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
    /// Poses, where grasps were recorded, and what was shown, as they were before; none outside of presenter mode.
    before: Option<(PoseSpread, Option<TrialPlace>, ViewSource)>,
    /// Presentations so far: each has another order of objects.
    presentations: u64,
    presentation: Presentation,
    pub(in crate::app) score: Score,
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
    /// Counts a verdict; one after a further grasp replaces that of its round.
    fn judge(&mut self, snapshot: &Snapshot) {
        self.judged = snapshot.grasp;
        let grasps = snapshot.status.grasp_of_round;
        let round = snapshot.grasp.saturating_sub(u64::from(grasps));
        let right = snapshot.identification.as_ref().and_then(|view| snapshot.is_right(view));
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
}

impl App {
    /// Begins or ends, counts verdicts, and brings the next object.
    pub(super) fn poll_presenter(&mut self) {
        let Some(snapshot) = self.simulation.snapshot.clone() else { return };
        match (self.view.presents, self.presenter.before.is_some()) {
            (true, false) => self.begin_presentation(&snapshot),
            (false, true) => self.end_presentation(),
            (false, false) => {}
            (true, true) => self.go_on_presenting(&snapshot),
        }
    }

    fn begin_presentation(&mut self, snapshot: &Snapshot) {
        let mut scene = self.simulation.scene.clone();
        let presentations = self.presenter.presentations + 1;
        self.presenter = PresenterFeature {
            before: Some((scene.pose.clone(), snapshot.status.recording, self.view.source)),
            presentations,
            presentation: Presentation::new(presentations),
            judged: snapshot.grasp,
            ..PresenterFeature::default()
        };
        self.view.source = ViewSource::Simulation;
        scene.pose = self.presenter.presentation.poses();
        self.simulation.send(Command::SetFirstDrawn(true));
        self.simulation.send(Command::SetRecording(Some(TrialPlace::DemoLog)));
        self.set_scene(scene);
        self.simulation.send(Command::Play);
    }

    fn end_presentation(&mut self) {
        let Some((pose, recording, source)) = self.presenter.before.take() else { return };
        // A gripper may have left meanwhile.
        let is_there = source != ViewSource::Gripper || self.gripper_view().is_some_and(GripperView::is_connected);
        self.view.source = if is_there { source } else { ViewSource::Simulation };
        self.simulation.send(Command::SetFirstDrawn(false));
        self.simulation.send(Command::SetRecording(recording));
        self.set_scene(Scene { pose, ..self.simulation.scene.clone() });
    }

    fn go_on_presenting(&mut self, snapshot: &Snapshot) {
        let now = self.ctx.input(|input| input.time);
        let own = &mut self.presenter;
        if snapshot.status.finished && snapshot.grasp > own.judged {
            own.judge(snapshot);
            own.next_at = Some(now + VERDICT_S);
        }
        // Whoever changes the threshold thinks about one more grasp.
        let threshold = snapshot.identification.as_ref().map(|view| view.rule.threshold);
        if std::mem::replace(&mut own.threshold, threshold) != threshold {
            own.next_at = own.next_at.map(|_| now + VERDICT_S);
        }
        // Another object or another grasp was asked for meanwhile.
        if !snapshot.status.finished {
            own.next_at = None;
        }
        let Some(left) = own.next_at.map(|next_at| next_at - now) else { return };
        if left <= 0.0 {
            self.present_next();
        } else {
            self.ctx.request_repaint_after(Duration::from_secs_f64(left));
        }
    }

    /// Brings the next object, in random poses.
    pub(super) fn present_next(&mut self) {
        self.presenter.next_at = None;
        let object = self.presenter.presentation.next_object(&self.simulation.scene.object.source);
        let pose = self.presenter.presentation.poses();
        self.set_scene(Scene { pose, ..self.simulation.scene_with(object) });
        self.simulation.send(Command::Play);
    }
}
