//! Labelling in the window: hands actions to the [`LabellingSession`] and carries out its effects.

use crate::app::features::gripper::GripperFeature;
use crate::app::features::inspect::InspectAction;
use crate::app::features::simulation::SimulationFeature;
use crate::app::features::view::ViewState;
use crate::app::modes::mode::Mode;
use crate::app::notices::Notices;
use palpate_lab::workers::{
    Command, GripperCommand, GripperView, LabelCommand, LabelView, LabelWorker, LabellingAction, LabellingEffect,
    LabellingSession, SessionContext, TrialInSight,
};
use palpate_tactile::trial::TrialId;
use std::path::PathBuf;

/// State of labelling in the window.
pub(in crate::app) struct LabellingFeature {
    labels: LabelWorker,
    session: LabellingSession,
    /// Stored trial that is shown because the card asks about it.
    shown: Option<TrialId>,
}

impl LabellingFeature {
    pub(in crate::app) fn new(labels: LabelWorker, store: PathBuf) -> Self {
        labels.send(LabelCommand::Refresh);
        Self { labels, session: LabellingSession::new(store), shown: None }
    }

    pub(in crate::app) fn worker(&self) -> &LabelWorker {
        &self.labels
    }

    pub(in crate::app) fn session(&self) -> &LabellingSession {
        &self.session
    }

    /// Reads the store again.
    pub(in crate::app) fn refresh(&self) {
        self.labels.send(LabelCommand::Refresh);
    }

    /// True while the model's prediction is hidden.
    pub(in crate::app) fn hides_prediction(
        &self,
        gripper: Option<&GripperView>,
        labels: Option<&LabelView>,
        view: &ViewState,
    ) -> bool {
        self.session.hides_prediction(&context(&self.labels, gripper, labels, view))
    }

    /// Updates the session with gripper and labels. Returns how the stored trial that the card asks about comes into sight.
    pub(in crate::app) fn gather(
        &mut self,
        gripper: &mut GripperFeature,
        simulation: &mut SimulationFeature,
        view: &mut ViewState,
        notices: &mut Notices,
    ) -> Option<InspectAction> {
        let (seen, labels) = (gripper.worker().view(), self.labels.view());
        let now = context(&self.labels, seen.as_deref(), labels.as_deref(), view);
        let effects = self.session.observe(&now);
        let next = self.session.next_known_object(&now);
        let in_sight = self.session.in_sight(&now);
        gripper.keep_trial_in_sight(in_sight == TrialInSight::Last);
        self.carry_out(effects, gripper, view, notices);
        self.labels.notices().for_each(|notice| notices.show(notice));
        // The simulation shows the next object of the plan.
        if let Some(next) = next.filter(|name| *name != simulation.scene().object.source) {
            simulation.open(&next, notices);
            simulation.send(Command::Pause, notices);
        }
        let stored = match in_sight {
            TrialInSight::Stored(id) => Some(id),
            TrialInSight::Live | TrialInSight::Last => None,
        };
        if std::mem::replace(&mut self.shown, stored) == stored {
            return None;
        }
        // Inspect mode shows the open trial again.
        let closes = || (view.mode != Mode::Inspect).then_some(InspectAction::Close);
        stored.map(InspectAction::Show).or_else(closes)
    }

    pub(in crate::app) fn apply(
        &mut self,
        action: LabellingAction,
        gripper: &GripperFeature,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        let (seen, labels) = (gripper.worker().view(), self.labels.view());
        let now = context(&self.labels, seen.as_deref(), labels.as_deref(), view);
        let effects = self.session.apply(action, &now);
        self.carry_out(effects, gripper, view, notices);
    }

    fn carry_out(
        &mut self,
        effects: Vec<LabellingEffect>,
        gripper: &GripperFeature,
        view: &mut ViewState,
        notices: &mut Notices,
    ) {
        for effect in effects {
            match effect {
                LabellingEffect::Edit(command) => _ = self.labels.send(command),
                LabellingEffect::BeginTrial(request) => {
                    let number = gripper.worker().send(GripperCommand::Begin(request));
                    self.session.trial_requested(number);
                }
                LabellingEffect::DiscardRunning => {
                    gripper.worker().send(GripperCommand::Discard);
                }
                LabellingEffect::SetBlind(blind) => view.blind = blind,
                LabellingEffect::Inform(text) => notices.info(text),
            }
        }
    }
}

fn context<'a>(
    worker: &LabelWorker,
    gripper: Option<&'a GripperView>,
    labels: Option<&'a LabelView>,
    view: &ViewState,
) -> SessionContext<'a> {
    SessionContext {
        gripper,
        labels,
        settled: worker.is_settled(),
        labelling: view.mode == Mode::Label,
        blind: view.blind,
        control: view.control,
    }
}
