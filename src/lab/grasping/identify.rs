//! Identification of an object by successive grasps: live verdict, belief after each grasp, and the decision to stop.
//! Shared by window, commands and both grippers.

use super::felt_geometry::FeltGeometry;
use super::row::Row;
use crate::datasets::SensorView;
use palpate_geometry::units::{read_in, shown};
use palpate_learn::{
    Belief, GeometryEncoder, Labels, LiveRecogniser, Measured, Model, ModelError, OTHER, Pmf, Sequence, Shipped,
    Signatures, StopReason, StopRule, Verdict,
};
use palpate_sim::gripper::{GripperModel, Phase};
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Between;
use palpate_tactile::trial::EarlierGrasps;
use palpate_tactile::{Channel, LayoutError, Quantity};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Reason why a model does not fit a gripper.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// The model was made for imported channels, or for a layout that does not exist.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The model reads other channels than the gripper has.
    #[error("{cause}{}", fits.map_or_else(String::new, |fits| format!("; models/{} would fit", fits.model_file())))]
    Channels {
        /// The difference.
        cause: ModelError,
        /// The shipped model whose channels the gripper has.
        fits: Option<Shipped>,
    },
}

/// A finished grasp as a model read it, and the model's answers.
#[derive(Clone, Debug)]
pub struct RecognisedGrasp {
    /// The model.
    pub model: Arc<Model>,
    /// Readings in the model's channels.
    pub grasp: Sequence,
    /// Start of the hold (s), where known.
    pub hold_s: Option<f64>,
    /// Belief after this grasp and those of the same object before it.
    pub belief: Belief,
}

impl PartialEq for RecognisedGrasp {
    /// Two are equal if the same model read the same.
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
            || (Arc::ptr_eq(&self.model, &other.model)
                && (&self.grasp, self.hold_s, &self.belief) == (&other.grasp, other.hold_s, &other.belief))
    }
}

impl RecognisedGrasp {
    /// Recognises a grasp that no other came before.
    pub fn alone(model: Arc<Model>, grasp: Sequence, hold_s: Option<f64>) -> Self {
        let mut belief = Belief::default();
        let alone = model.recogniser.recognise(&grasp, None).pmf;
        let prior = model.card.prior();
        let with = prior.map(|prior| model.recogniser.recognise(&grasp, Some(&prior)).pmf);
        belief.add(with.unwrap_or_else(|| alone.clone()), alone);
        Self { model, grasp, hold_s, belief }
    }

    /// Belief before this grasp; before the first one, [`palpate_learn::ModelCard::prior`].
    pub fn before(&self) -> Option<Pmf> {
        self.belief.steps().iter().rev().nth(1).cloned().or_else(|| self.model.card.prior())
    }
}

/// A model at work on successive grasps of one object.
pub struct Identification {
    model: Arc<Model>,
    labels: Arc<Labels>,
    /// Belief before the first grasp.
    prior: Option<Pmf>,
    rule: StopRule,
    /// Column of each channel of the model in a row.
    columns: Vec<usize>,
    /// The newest row in the model's channels.
    columned: Vec<f32>,
    live: Option<Box<dyn LiveRecogniser>>,
    /// Readings of the running grasp, for a verdict on this grasp alone.
    readings: Sequence,
    belief: Belief,
    /// Start of the hold in the running grasp (s).
    hold_s: Option<f64>,
    /// The last finished grasp.
    last: Option<Arc<RecognisedGrasp>>,
    /// The newest verdict on the running grasp.
    verdict: Option<Verdict>,
    geometry: FeltGeometry,
    /// How the running grasp began far from those that the model learned, where it did.
    unlike: Option<String>,
    /// The hold has ended; later rows are ignored.
    closed: bool,
    decision: Option<StopReason>,
    /// Threshold at the decision.
    decided_at: f64,
    /// The object between two grasps. The model's sets hold for rounds like those that calibrated them.
    between: Between,
}

impl std::fmt::Debug for Identification {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Identification").field("belief", &self.belief).field("decision", &self.decision).finish()
    }
}

/// View of an identification.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentificationView {
    /// Classes, sizes and shapes.
    pub labels: Arc<Labels>,
    /// Stop rule.
    pub rule: StopRule,
    /// The newest verdict on the running or last grasp; none before the first readings.
    pub verdict: Option<Verdict>,
    /// Whether the readings serve to estimate the object's geometry.
    pub measures_geometry: bool,
    /// The grasp began far from those that the model learned: its answers mean little, and nothing is measured.
    pub unlike: bool,
    /// The newest estimate of it; none before the first contact.
    pub measured: Option<Arc<Measured>>,
    /// True while the fingers close and hold, and the answer still changes.
    pub listening: bool,
    /// Belief after each finished grasp.
    pub beliefs: Vec<Pmf>,
    /// Reason to stop, once there is one.
    pub decision: Option<StopReason>,
    /// Classes that are left after the finished grasps, where the model's sets are calibrated for such grasps.
    pub left: Option<Vec<bool>>,
    /// The threshold has since been raised above the probability reached: one more grasp may decide anew.
    pub asks_for_more: bool,
    /// True where the model learned from perfect sensors, which no real gripper has.
    pub from_perfect_sensors: bool,
    /// Class signatures of the model, where its file has them.
    pub signatures: Option<Arc<Signatures>>,
    /// The last finished grasp of this object.
    pub last: Option<Arc<RecognisedGrasp>>,
}

impl IdentificationView {
    /// Decided name: a class or `unknown`; none before the decision.
    pub fn decided(&self) -> Option<&str> {
        let belief = self.beliefs.last()?;
        Some(match self.decision? {
            StopReason::Unknown => "unknown",
            StopReason::Sure | StopReason::GraspLimit => &self.labels.classes[belief.top().0].name,
        })
    }

    /// True where the decision is that the object is none of the known ones.
    pub fn is_unknown(&self) -> bool {
        self.decision == Some(StopReason::Unknown) || self.decided() == Some(OTHER)
    }

    /// True where the decision is right; none before it. "Unknown" and "other" are right for an object that is no class, an
    /// empty hand also for an object that has left it (`nothing_held`).
    pub fn is_right(&self, truth: &str, nothing_held: bool) -> Option<bool> {
        let decided = self.decided()?;
        if self.is_unknown() {
            return Some(self.labels.class(truth).is_none());
        }
        Some(decided == truth || nothing_held && decided == EMPTY)
    }
}

impl Identification {
    /// Ready for the first grasp.
    pub fn new(model: Arc<Model>, rule: StopRule) -> Self {
        let live = model.recogniser.live();
        Self {
            labels: Arc::new(model.card.labels.clone()),
            prior: model.card.prior(),
            model,
            rule,
            columns: Vec::new(),
            columned: Vec::new(),
            live,
            readings: Sequence::default(),
            hold_s: None,
            last: None,
            belief: Belief::default(),
            verdict: None,
            geometry: FeltGeometry::default(),
            unlike: None,
            closed: true,
            decision: None,
            decided_at: 0.0,
            between: Between::default(),
        }
    }

    /// The model at work.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Forgets all grasps: another object is in the hand.
    pub fn start_over(&mut self) {
        self.belief = Belief::default();
        self.last = None;
        self.verdict = None;
        self.geometry.forget();
        self.unlike = None;
        self.decision = None;
        self.closed = true;
    }

    /// Continues after grasps that this model judged before; false, and without effect, after those of another model.
    pub fn resume(&mut self, earlier: &EarlierGrasps) -> bool {
        let same = earlier.model == self.model.card.described();
        let resumed = same.then(|| Belief::resumed(&earlier.judged, self.labels.classes.len())).flatten();
        let Some(belief) = resumed else { return false };
        self.belief = belief;
        true
    }

    /// The grasps so far, for [`Self::resume`]; none before the first.
    pub fn earlier(&self) -> Option<EarlierGrasps> {
        let judged = self.belief.judged();
        (!judged.is_empty()).then(|| EarlierGrasps { model: self.model.card.described(), judged })
    }

    /// Sets how the object lies between two grasps.
    pub fn set_between(&mut self, between: Between) {
        self.between = between;
    }

    /// Sets the stop rule. A decision is kept; between two grasps the new rule may end the round.
    pub fn set_rule(&mut self, rule: StopRule) {
        self.rule = rule;
        if self.closed && self.decision.is_none() {
            self.decide();
        }
    }

    fn decide(&mut self) {
        self.decision = self.rule.judge(&self.belief, self.model.card.rejection.as_ref());
        self.decided_at = self.rule.threshold;
    }

    /// True if the threshold was raised after the decision, above the probability reached.
    pub fn asks_for_more(&self) -> bool {
        let reaches = |belief: &Pmf| belief.top().1 >= self.rule.threshold;
        let raised = self.decision.is_some() && self.rule.threshold > self.decided_at;
        raised && self.belief.now().is_some_and(|belief| !reaches(belief))
    }

    /// Takes the decision back: another grasp of the same object follows, even if the limit of grasps was reached.
    pub fn go_on(&mut self) {
        if self.decision.take().is_some() {
            self.rule.most_grasps = self.rule.most_grasps.max(self.belief.grasps() + 1);
        }
    }

    /// Channels on this gripper, among them those that the model reads.
    pub fn channels_on(&self, gripper: &GripperModel) -> Result<Vec<Channel>, IdentifyError> {
        let view = SensorView::of_model(&self.model.card);
        Ok(view.sensor_layout()?.shown(view.signals).channels(gripper, view.signals)?)
    }

    /// Begins another grasp of the same object, on a gripper whose rows have these channels in these columns; rows follow
    /// with [`Self::push`].
    pub fn begin_grasp(&mut self, columns: impl IntoIterator<Item = (usize, String)>) -> Result<(), IdentifyError> {
        self.closed = true;
        let named: BTreeMap<String, usize> = columns.into_iter().map(|(place, name)| (name, place)).collect();
        let wanted = &self.model.card.channels;
        self.columns = wanted.iter().filter_map(|name| named.get(name).copied()).collect();
        let found: Vec<String> = wanted.iter().filter(|name| named.contains_key(*name)).cloned().collect();
        // Readings that suit the model suit the encoder for such sensors.
        let shipped = Shipped::of(&self.model.card.data);
        self.model.check_channels(&found).map_err(|cause| {
            let read = |encoder: &GeometryEncoder| encoder.channels().iter().all(|name| named.contains_key(name));
            let fits = shipped.encoder().is_ok_and(|encoder| read(&encoder)).then_some(shipped);
            IdentifyError::Channels { cause, fits }
        })?;
        self.readings = Sequence::default();
        self.unlike = None;
        self.hold_s = None;
        self.verdict = None;
        self.geometry.begin(shipped, &named);
        self.closed = false;
        if let Some(live) = &mut self.live {
            live.begin(self.belief.now().or(self.prior.as_ref()));
        }
        Ok(())
    }

    /// Takes in a row of the grasp, `t` seconds after its closing began; true when there is a new answer. The release ends
    /// the grasp. A row in which a channel is undefined is skipped.
    pub fn push(&mut self, t: f64, row: &Row) -> bool {
        if self.closed {
            return false;
        }
        if row.phase == Some(Phase::Release) {
            self.end_grasp();
            return true;
        }
        if row.phase == Some(Phase::Hold) {
            self.hold_s.get_or_insert(t);
        }
        self.columned.clear();
        self.columned.extend(self.columns.iter().map(|column| row.values[*column]));
        if self.columned.iter().any(|value| value.is_nan()) {
            return false;
        }
        self.readings.t_s.push(t as f32);
        self.readings.values.extend_from_slice(&self.columned);
        if self.readings.t_s.len() == 1 {
            self.unlike = self.far_at_start();
        }
        let answer = self.live.as_mut().and_then(|live| live.push(t as f32, &self.columned));
        let new = answer.is_some();
        self.verdict = answer.or_else(|| self.verdict.take());
        let measured = self.geometry.push(t, row);
        new || measured
    }

    /// Says so where channels began far from what the model learned.
    pub fn unlike_at_start(&self) -> Option<String> {
        self.unlike.clone()
    }

    fn far_at_start(&self) -> Option<String> {
        let signatures = self.model.signatures.as_ref()?;
        let far = signatures.far_at_start(&self.readings.values);
        let (name, value, mean) = far.first()?;
        let (unit, factor) = read_in(Quantity::of_name(name).map_or("", |(quantity, _)| quantity.unit()));
        let [value, mean] = [value, mean].map(|value| match unit {
            "" => format!("{value:.0}"),
            unit => shown(factor * f64::from(*value), unit),
        });
        // A table may have been imported without the zero of its sensors.
        let remedy = match self.model.card.data.is_recorded() {
            true => ". Where it learned an imported table, import that anew with --rezero",
            false => "",
        };
        Some(format!(
            "{} of {} channels begin far from the grasps that the model learned ({}: {value}, there {mean}), so its answers mean \
             little{remedy}",
            far.len(),
            signatures.channels().len(),
            name.replace('_', " ")
        ))
    }

    /// Ends the grasp and adds its verdict to the belief; no effect on a grasp that has ended.
    pub fn end_grasp(&mut self) {
        if std::mem::replace(&mut self.closed, true) || self.readings.is_empty() {
            return;
        }
        let recogniser = &self.model.recogniser;
        let before = self.belief.now().or(self.prior.as_ref());
        let streamed = self.live.as_mut().and_then(|live| live.finish());
        let verdict = streamed.unwrap_or_else(|| recogniser.recognise(&self.readings, before));
        let alone = match before {
            Some(_) => recogniser.recognise(&self.readings, None).pmf,
            None => verdict.pmf.clone(),
        };
        self.belief.add(verdict.pmf.clone(), alone);
        self.verdict = Some(verdict);
        self.geometry.measure();
        self.last = Some(Arc::new(RecognisedGrasp {
            model: Arc::clone(&self.model),
            grasp: self.readings.clone(),
            hold_s: self.hold_s,
            belief: self.belief.clone(),
        }));
        self.decide();
    }

    /// Reason to stop, once there is one.
    pub fn decision(&self) -> Option<StopReason> {
        self.decision
    }

    /// Belief after the grasps so far.
    pub fn belief(&self) -> &Belief {
        &self.belief
    }

    /// The last finished grasp of this object.
    pub fn last(&self) -> Option<&Arc<RecognisedGrasp>> {
        self.last.as_ref()
    }

    /// The newest verdict on the running or last grasp.
    pub fn verdict(&self) -> Option<&Verdict> {
        self.verdict.as_ref()
    }

    /// The view.
    pub fn view(&self) -> IdentificationView {
        IdentificationView {
            labels: Arc::clone(&self.labels),
            rule: self.rule,
            verdict: self.verdict.clone(),
            measures_geometry: self.geometry.serves(),
            unlike: self.unlike.is_some(),
            measured: self.geometry.newest().filter(|_| self.unlike.is_none()),
            listening: !self.closed,
            beliefs: self.belief.steps().to_vec(),
            decision: self.decision,
            left: self.model.card.sets_of(self.between.name()).map(|sets| sets.left(&self.belief)),
            asks_for_more: self.asks_for_more(),
            from_perfect_sensors: self.model.card.learned_from_perfect_sensors(),
            signatures: self.model.signatures.clone(),
            last: self.last.clone(),
        }
    }
}
