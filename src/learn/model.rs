//! A trained model: a recogniser and its card.

use crate::answer_sets::AnswerSets;
use crate::arrays::ModelError;
use crate::belief::{Belief, Rejection, StopRule};
use crate::data::{DataCard, Labels};
use crate::learned::LearnedGrasps;
use crate::pmf::Pmf;
use crate::recogniser::Recogniser;
use crate::signatures::Signatures;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Beginning of the names of channels with the contact pressure, which only simulations have.
const CONTACT_PRESSURE: &str = "contact_pressure_";

/// Description of a model: everything except its learned parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelCard {
    /// Key of the method.
    pub method: String,
    /// Input channels, in order.
    pub channels: Vec<String>,
    /// Classes, sizes and shapes it distinguishes.
    pub labels: Labels,
    /// Training data.
    pub data: DataCard,
    /// Grasps that it learned from.
    #[serde(default, skip_serializing_if = "LearnedGrasps::is_empty")]
    pub learned: LearnedGrasps,
    /// Classes that it learned after the others, by [`Model::taught`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub taught: Vec<String>,
    /// Hash of the files of each of these that was simulated, and where they lay.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub taught_from: BTreeMap<String, (u64, String)>,
    /// How well each of these was learned.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lessons: Vec<Lesson>,
    /// Settings chosen or found while fitting.
    pub settings: serde_json::Value,
    /// Fingerprint of the method that made it, [`crate::Method::fingerprint`]; absent in files of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingerprint: Option<String>,
    /// Differences from the network of the paper that the method stands for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub deviations: Vec<String>,
    /// Stop rule for successive grasps.
    pub stop: StopRule,
    /// Threshold that separates known from unknown objects.
    pub rejection: Option<Rejection>,
    /// Sets of classes with a promise, where they have been calibrated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer_sets: Option<AnswerSets>,
    /// Seed of the fit.
    pub seed: u64,
    /// True after a quick fit.
    #[serde(default)]
    pub quick: bool,
    /// Number of learned parameters.
    pub parameters: usize,
    /// CPU time of the fit (s).
    pub train_cpu_s: f64,
    /// Results on test grasps; null if not measured.
    #[serde(default)]
    pub metrics: serde_json::Value,
    /// Training grasps of each class in the signatures; absent without signatures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signature_grasps: Option<Vec<usize>>,
    /// Program version that trained it.
    pub version: String,
}

/// Test of a class right after it was learned from simulated grasps.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lesson {
    /// Class.
    pub name: String,
    /// Grasps that it was learned from.
    pub grasps: usize,
    /// Those of them in which the object left the hand, or was never touched.
    pub lost: usize,
    /// Further grasps, in poses of a scene by default.
    pub tested: usize,
    /// Those of them that are recognised, each on its own.
    pub recognised: usize,
    /// As many rounds of three of these grasps: those whose last answer is right. None where that was not tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after_three: Option<usize>,
    /// Classes that the others are taken for, each with the number of them.
    pub taken_for: BTreeMap<String, usize>,
}

impl ModelCard {
    /// How well a class was learned; none of one that was not tested.
    pub fn lesson(&self, name: &str) -> Option<&Lesson> {
        self.lessons.iter().find(|lesson| lesson.name == name)
    }

    /// Reads the method's own settings from the card.
    pub(crate) fn settings_as<T: DeserializeOwned>(&self) -> Result<T, ModelError> {
        serde_json::from_value(self.settings.clone())
            .map_err(|error| ModelError(format!("invalid settings on its card: {error}")))
    }
}

/// Recogniser with its card.
#[derive(Clone)]
pub struct Model {
    /// Description.
    pub card: ModelCard,
    pub recogniser: Arc<dyn Recogniser>,
    /// Class signatures; `None` in files of older versions.
    pub signatures: Option<Arc<Signatures>>,
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model").field("card", &self.card).finish_non_exhaustive()
    }
}

impl Model {
    /// Adds class signatures; the recogniser and its answers stay as they are.
    pub fn with_signatures(mut self, signatures: Option<Signatures>) -> Self {
        self.card.signature_grasps = signatures.as_ref().map(|signatures| signatures.grasps().to_vec());
        self.signatures = signatures.map(Arc::new);
        self
    }

    /// Compares the model's channels with those available. The error names missing and unknown channels.
    pub fn check_channels(&self, channels: &[String]) -> Result<(), ModelError> {
        let own = &self.card.channels;
        if own == channels {
            return Ok(());
        }
        let only =
            |a: &[String], b: &[String]| -> Vec<String> { a.iter().filter(|c| !b.contains(c)).cloned().collect() };
        let (missing, extra) = (only(own, channels), only(channels, own));
        let mut parts = Vec::new();
        if !missing.is_empty() {
            parts.push(format!("it needs {}", missing.join(", ")));
        }
        if !extra.is_empty() {
            parts.push(format!("it does not know {}", extra.join(", ")));
        }
        if parts.is_empty() {
            parts.push(format!("the order differs; it reads {}", own.join(", ")));
        }
        let mut difference = parts.join(", and ");
        if missing.iter().any(|channel| channel.starts_with(CONTACT_PRESSURE)) {
            difference += ". Contact pressure exists only in simulations: no real gripper can run this model. Train one \
                           on the pads' pressure (--signals parts); simulated grasps need --signals contact";
        }
        Err(ModelError(format!("the model needs other channels: {difference}")))
    }
}

impl ModelCard {
    /// Reads a card. Cards of versions without [`DataCard::signals`] called the contact pressure of simulated grasps
    /// `pressure`, which now is what pads measure.
    pub(crate) fn parse(text: &str) -> serde_json::Result<Self> {
        let mut card: Self = serde_json::from_str(text)?;
        if card.data.signals.is_none() && card.data.sensors.is_some() {
            card.data.signals = Some("contact".to_owned());
            for channel in &mut card.channels {
                if let Some(place) = channel.strip_prefix("pressure_") {
                    *channel = format!("{CONTACT_PRESSURE}{place}");
                }
            }
        }
        Ok(card)
    }

    /// Belief before the first grasp: a third of the objects in the hand are taken to be [`crate::OTHER`], where that is a class.
    /// Recognisers answer as if it were as likely as each known object.
    pub fn prior(&self) -> Option<Pmf> {
        let classes = self.labels.classes.len();
        let (other, rest) = (self.labels.other()?, classes.saturating_sub(1).max(1) as f64);
        let share = |class| if class == other { 1.0 / 3.0 } else { 2.0 / 3.0 / rest };
        Some(Pmf::from_weights((0..classes).map(share)))
    }

    /// Sets that are calibrated by rounds whose object lay like this between two grasps, as in scene files.
    pub fn sets_of(&self, between: &str) -> Option<&AnswerSets> {
        self.answer_sets.as_ref().filter(|sets| sets.between == between)
    }

    /// Names of the classes that are left after grasps, where sets are calibrated for such rounds.
    pub fn left(&self, belief: &Belief, between: &str) -> Option<Vec<String>> {
        let left = self.sets_of(between)?.left(belief);
        let classes = self.labels.classes.iter().zip(left);
        Some(classes.filter(|(_, left)| *left).map(|(class, _)| class.name.clone()).collect())
    }

    /// True where it learned from simulated grasps through perfect sensors: on a real gripper most of its answers are wrong.
    pub fn learned_from_perfect_sensors(&self) -> bool {
        self.data.from_perfect_sensors()
    }

    /// False where it answers for fingers, by their hash, that it has not learned: most of its answers are wrong then. One
    /// that learned from any build of the gripper is not bound to its fingers.
    pub fn knows_fingers(&self, fingers: &Option<String>) -> bool {
        !self.learned_from_perfect_sensors() || self.data.has_fingers(fingers)
    }

    /// True where it reads channels that only simulations have.
    pub fn only_simulated(&self) -> bool {
        self.channels.iter().any(|channel| channel.starts_with(CONTACT_PRESSURE))
    }
}

/// Methods of version 0.1.0 that are gone; stored results still name them.
pub const REMOVED_METHODS: [&str; 4] = ["committee", "rusboost-samme", "measures-svm", "measures-forest"];

pub(crate) fn why_unknown(method: &str) -> &'static str {
    if REMOVED_METHODS.contains(&method) {
        "which was removed after version 0.1.0; train a model with another method (`palpate train --list`)"
    } else {
        "which this version does not know; update Palpate"
    }
}
