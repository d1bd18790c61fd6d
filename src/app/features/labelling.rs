//! Labelling in the window: hands actions to the [`LabellingSession`] and carries out its effects.

use super::App;
use super::view::Mode;
use palpate_lab::workers::{
    Command, GripperCommand, LabelCommand, LabelView, LabelWorker, LabellingAction, LabellingEffect, LabellingSession,
    SessionContext, TrialInSight,
};
use palpate_store::labels::TrialEdit;
use palpate_tactile::trial::TrialId;
use std::sync::Arc;

/// State of labelling in the window.
pub(in crate::app) struct LabellingFeature {
    worker: LabelWorker,
    /// Labels, plan and journal, as of this frame.
    pub(in crate::app) labels: Option<Arc<LabelView>>,
    pub(in crate::app) session: LabellingSession,
    /// The model's prediction is hidden.
    pub(in crate::app) blind: bool,
    /// Stored trial that is shown because the card asks about it.
    shown: Option<TrialId>,
}

impl LabellingFeature {
    pub(in crate::app) fn new(worker: LabelWorker) -> Self {
        worker.send(LabelCommand::Refresh);
        Self { worker, labels: None, session: LabellingSession::default(), blind: false, shown: None }
    }

    /// The trial that the card asks about is shown, whatever was shown meanwhile.
    pub(super) fn show_again(&mut self) {
        self.shown = None;
    }

    /// Reads the store again.
    pub(super) fn refresh(&self) {
        self.worker.send(LabelCommand::Refresh);
    }

    /// True when the store has all labels that were given.
    pub(super) fn is_settled(&self) -> bool {
        self.worker.is_settled()
    }
}

impl App {
    /// Updates the session with gripper and labels, and shows the stored trial that its card asks about.
    pub(super) fn poll_labelling(&mut self) {
        let before = std::mem::replace(&mut self.labelling.labels, self.labelling.worker.view());
        let (effects, next, in_sight, blind) = self.in_session(|session, now| {
            let effects = session.observe(now);
            (effects, session.next_known_object(now), session.in_sight(now), session.hides_prediction(now))
        });
        self.labelling.blind = blind;
        // The last trial stays in the plots, while rows after it are only watched.
        self.gripper.traces.hold_grasp(in_sight == TrialInSight::Last);
        self.carry_out(effects);
        let Self { labelling, notices, .. } = self;
        labelling.worker.notices().for_each(|notice| notices.show(notice));
        // The simulation shows the next object of the plan.
        if let Some(next) = next.filter(|name| *name != self.simulation.scene.object.source) {
            self.grasp_object(&next);
            self.simulation.send(Command::Pause);
        }
        if before.as_ref().map(Arc::as_ptr) != self.labelling.labels.as_ref().map(Arc::as_ptr) {
            self.labels_changed();
        }
        let stored = match in_sight {
            TrialInSight::Stored(id) => Some(id),
            TrialInSight::Live | TrialInSight::Last => None,
        };
        match (std::mem::replace(&mut self.labelling.shown, stored) == stored, stored) {
            (true, _) => {}
            (false, Some(id)) => self.show_trial(id),
            // Inspect mode shows the open trial again.
            (false, None) if self.view.mode != Mode::Inspect => self.close_trial(),
            (false, None) => {}
        }
    }

    /// Does something in the labelling session.
    pub fn label(&mut self, action: LabellingAction) {
        if matches!(action, LabellingAction::FocusSearch(_)) {
            self.show_panel("label");
        } else {
            self.notices.changed();
        }
        let effects = self.in_session(|session, now| session.apply(action, now));
        self.carry_out(effects);
    }

    /// Changes labels or plan.
    pub fn edit_labels(&mut self, command: LabelCommand) {
        self.label(LabellingAction::Edit(command));
    }

    /// Lets the session look at gripper and labels as they are now.
    fn in_session<R>(&mut self, act: impl FnOnce(&mut LabellingSession, &SessionContext<'_>) -> R) -> R {
        // Read first: labels that come meanwhile show the outcome of no fewer commands.
        let settled = self.labelling.worker.is_settled();
        let (gripper, labels) = (self.gripper.worker.view(), self.labelling.worker.view());
        let control = self.control();
        let now = SessionContext {
            gripper: gripper.as_deref(),
            labels: labels.as_deref(),
            settled,
            labelling: self.view.mode == Mode::Label,
            blind: self.view.blind,
            control,
        };
        act(&mut self.labelling.session, &now)
    }

    fn carry_out(&mut self, effects: Vec<LabellingEffect>) {
        for effect in effects {
            match effect {
                LabellingEffect::Edit(command) => {
                    let ended = self.gripper_view().and_then(|gripper| gripper.ended.as_ref()).map(|ended| ended.id);
                    // Nor does the answer to it stand any longer.
                    if matches!(&command, LabelCommand::Edit(id, TrialEdit::Discard) if Some(*id) == ended) {
                        self.gripper.send(GripperCommand::AnotherObject);
                        self.gripper.traces.discard();
                    }
                    self.labelling.worker.send(command);
                }
                LabellingEffect::BeginTrial(request) => {
                    let number = self.gripper.send(GripperCommand::Begin(request));
                    self.labelling.session.trial_requested(number);
                }
                LabellingEffect::DiscardRunning => {
                    self.gripper.send(GripperCommand::Discard);
                    self.gripper.traces.discard();
                }
                LabellingEffect::SetBlind(blind) => self.view.blind = blind,
                LabellingEffect::Inform(text) => self.notices.info(text),
            }
        }
    }
}
