//! Live recognition: reads rows of successive grasps and decides when a round of grasps is complete.

use crate::grasping::{Identification, IdentificationView, RecognisedGrasp, Row};
use palpate_learn::{Model, StopReason, StopRule};
use palpate_sim::gripper::GripperModel;
use palpate_sim::scene::Between;
use palpate_tactile::Channel;
use palpate_tactile::trial::EarlierGrasps;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Range of the threshold: below a half two classes could both be certain, at one none could.
pub const THRESHOLDS: RangeInclusive<f64> = 0.5..=0.999;

/// Live recogniser of successive grasps.
pub(super) struct LiveRecognition {
    identification: Identification,
    rule: StopRule,
    /// Reason why it is off in this scene.
    off: Option<Arc<str>>,
    /// The reason was reported for this scene.
    warned: bool,
    /// The beginning of this grasp was compared with those that the model learned.
    compared: bool,
    /// View, updated with each change.
    view: Arc<IdentificationView>,
}

impl LiveRecognition {
    /// Stops as the model's card says, but after at most so many grasps.
    pub(super) fn new(model: Arc<Model>, most_grasps: u32) -> Self {
        let rule = StopRule { most_grasps: most_grasps as usize, ..model.card.stop };
        let identification = Identification::new(model, rule);
        let view = Arc::new(identification.view());
        Self { identification, rule, off: None, warned: false, compared: false, view }
    }

    /// True where it asks this model.
    pub(super) fn follows(&self, model: &Arc<Model>) -> bool {
        std::ptr::eq(self.identification.model(), model.as_ref())
    }

    /// Another scene is grasped.
    pub(super) fn another_scene(&mut self) {
        self.warned = false;
        self.start_over();
    }

    /// Forgets the grasps so far.
    pub(super) fn start_over(&mut self) {
        self.identification.start_over();
        // A round that went on beyond the limit has raised it.
        self.apply_rule();
    }

    /// Takes the decision back, where a raised threshold asks for another grasp; true where it does.
    pub(super) fn go_on(&mut self) -> bool {
        let asked = self.off.is_none() && self.identification.asks_for_more();
        if asked {
            self.identification.go_on();
            self.refresh();
        }
        asked
    }

    /// Names of the channels that the model reads.
    pub(super) fn channels(&self) -> &[String] {
        &self.identification.model().card.channels
    }

    /// The channels that the model reads on this gripper; none where it cannot.
    pub(super) fn channels_on(&self, gripper: &GripperModel) -> Vec<Channel> {
        self.identification.channels_on(gripper).unwrap_or_default()
    }

    /// Sets how the object lies between two grasps.
    pub(super) fn set_between(&mut self, between: Between) {
        self.identification.set_between(between);
    }

    /// Begins a grasp whose rows have these channels in these columns. Returns once per scene the
    /// reason why nothing is recognised: the channels that the model misses, or `cause` in their place where it is known.
    pub(super) fn begin_grasp(
        &mut self,
        columns: impl IntoIterator<Item = (usize, String)>,
        cause: Option<&str>,
    ) -> Option<String> {
        let begun = self.identification.begin_grasp(columns);
        self.compared = false;
        self.refresh();
        let Err(missing) = begun else {
            self.off = None;
            return None;
        };
        let text = format!("no recognition: {}", cause.map_or_else(|| missing.to_string(), str::to_owned));
        self.off = Some(Arc::from(text.as_str()));
        (!std::mem::replace(&mut self.warned, true)).then_some(text)
    }

    /// Adds a row, `t` seconds after the closing began. Returns once per scene how readings differ from those of the model.
    pub(super) fn push(&mut self, t: f64, row: &Row) -> Option<String> {
        if self.off.is_none() && self.identification.push(t, row) {
            self.refresh();
        }
        if self.warned || std::mem::replace(&mut self.compared, true) {
            return None;
        }
        let unlike = self.identification.unlike_at_start();
        self.warned = unlike.is_some();
        unlike
    }

    /// The grasp is over.
    pub(super) fn end_grasp(&mut self) {
        if self.off.is_none() {
            self.identification.end_grasp();
            self.refresh();
        }
    }

    /// Sets the probability from which a class counts as certain, clamped to [`THRESHOLDS`].
    pub(super) fn set_threshold(&mut self, threshold: f64) {
        if threshold.is_finite() {
            self.rule.threshold = threshold.clamp(*THRESHOLDS.start(), *THRESHOLDS.end());
            self.apply_rule();
        }
    }

    /// Sets the maximum number of grasps.
    pub(super) fn set_most_grasps(&mut self, grasps: u32) {
        self.rule.most_grasps = grasps as usize;
        self.apply_rule();
    }

    fn apply_rule(&mut self) {
        self.identification.set_rule(self.rule);
        self.refresh();
    }

    fn refresh(&mut self) {
        self.view = Arc::new(self.identification.view());
    }

    /// The grasps so far, for the trial that builds on them.
    pub(super) fn earlier(&self) -> Option<EarlierGrasps> {
        self.identification.earlier().filter(|_| self.off.is_none())
    }

    /// The last finished grasp of this object.
    pub(super) fn last(&self) -> Option<Arc<RecognisedGrasp>> {
        self.view.last.clone().filter(|_| self.off.is_none())
    }

    /// Reason to stop grasping, once there is one.
    pub(super) fn decision(&self) -> Option<StopReason> {
        self.identification.decision().filter(|_| self.off.is_none())
    }

    /// Prediction for the newest grasp: classes and their probabilities; none without readings.
    pub(super) fn guess(&self) -> Option<Vec<(String, f64)>> {
        let pmf = &self.identification.verdict().filter(|_| self.off.is_none())?.pmf;
        let names = self.identification.model().card.labels.classes.iter().map(|class| class.name.clone());
        Some(names.zip(pmf.probabilities().iter().copied()).collect())
    }

    /// The view; none while off.
    pub(super) fn view(&self) -> Option<Arc<IdentificationView>> {
        self.off.is_none().then(|| Arc::clone(&self.view))
    }

    /// Reason why it is off in this scene.
    pub(super) fn why_off(&self) -> Option<Arc<str>> {
        self.off.clone()
    }
}
