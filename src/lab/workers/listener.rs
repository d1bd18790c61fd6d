//! Recognition beside the simulation: it listens to the frames that are sampled, changes nothing about them, and says
//! when a round of grasps is enough.

use crate::grasping::{Identification, IdentificationView, IdentifyError, Row};
use palpate_learn::{Model, StopReason, StopRule};
use palpate_sim::gripper::GripperModel;
use palpate_tactile::Channel;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Thresholds that can be asked for: below a half two classes could both be certain, at one none ever would be.
pub const THRESHOLDS: RangeInclusive<f64> = 0.5..=0.999;

/// A model that listens to grasp after grasp.
pub(super) struct Listener {
    identification: Identification,
    rule: StopRule,
    /// Why it cannot listen in this scene.
    off: Option<Arc<str>>,
    /// The user has been told why, for this scene.
    told: bool,
    /// What can be shown, made anew when something has changed.
    view: Arc<IdentificationView>,
}

impl Listener {
    /// Stops as the model's card says, but after at most so many grasps.
    pub(super) fn new(model: Arc<Model>, most_grasps: u32) -> Self {
        let rule = StopRule { most_grasps: most_grasps as usize, ..model.card.stop };
        let identification = Identification::new(model, rule);
        let view = Arc::new(identification.view());
        Self { identification, rule, off: None, told: false, view }
    }

    /// Another scene is grasped.
    pub(super) fn another_scene(&mut self) {
        self.told = false;
        self.start_over();
    }

    /// Forgets the grasps so far.
    pub(super) fn start_over(&mut self) {
        self.identification.start_over();
        self.refresh();
    }

    /// The channels that the model reads on this gripper; none where it cannot.
    pub(super) fn channels_on(&self, gripper: &GripperModel) -> Vec<Channel> {
        self.identification.channels_on(gripper).unwrap_or_default()
    }

    /// Begins a grasp whose rows have these channels in these columns. The text, which comes once for each scene, says why nothing will be
    /// recognised; `place` says where.
    pub(super) fn begin_grasp<'a>(
        &mut self,
        columns: impl IntoIterator<Item = (usize, &'a Channel)>,
        place: &str,
    ) -> Option<String> {
        let begun = self.identification.begin_grasp(columns);
        self.begun(begun, place)
    }

    fn begun(&mut self, begun: Result<(), IdentifyError>, place: &str) -> Option<String> {
        self.refresh();
        let Err(cause) = begun else {
            self.off = None;
            return None;
        };
        let text = format!("nothing is recognised {place}: {cause}");
        self.off = Some(Arc::from(text.as_str()));
        (!std::mem::replace(&mut self.told, true)).then_some(text)
    }

    /// Listens to a row, `t` seconds after the closing began.
    pub(super) fn push(&mut self, t: f64, row: &Row) {
        if self.off.is_none() && self.identification.push(t, row) {
            self.refresh();
        }
    }

    /// The grasp is over.
    pub(super) fn end_grasp(&mut self) {
        if self.off.is_none() {
            self.identification.end_grasp();
            self.refresh();
        }
    }

    /// Takes a class as certain from this probability on; what lies outside of [`THRESHOLDS`] is brought inside.
    pub(super) fn set_threshold(&mut self, threshold: f64) {
        if threshold.is_finite() {
            self.rule.threshold = threshold.clamp(*THRESHOLDS.start(), *THRESHOLDS.end());
            self.apply_rule();
        }
    }

    /// Stops after so many grasps at the latest.
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

    /// Why no further grasp is needed, once it is so.
    pub(super) fn decision(&self) -> Option<StopReason> {
        self.identification.decision().filter(|_| self.off.is_none())
    }

    /// What the newest grasp was taken for: classes and their probabilities; none where nothing was heard.
    pub(super) fn guess(&self) -> Option<Vec<(String, f64)>> {
        let pmf = &self.identification.verdict().filter(|_| self.off.is_none())?.pmf;
        let names = self.identification.model().card.labels.classes.iter().map(|class| class.name.clone());
        Some(names.zip(pmf.probabilities().iter().copied()).collect())
    }

    /// What can be shown; nothing where it cannot listen.
    pub(super) fn view(&self) -> Option<Arc<IdentificationView>> {
        self.off.is_none().then(|| Arc::clone(&self.view))
    }

    /// Why it cannot listen in this scene.
    pub(super) fn why_off(&self) -> Option<Arc<str>> {
        self.off.clone()
    }
}
