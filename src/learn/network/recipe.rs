//! Settings of a network and its training.

use super::training::Training;
use crate::fitting::{Fitting, LearnError};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Structure and training of a network.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Rate of time steps, to which readings are averaged (Hz).
    pub rate_hz: f32,
    /// LSTM units of each macro-layer.
    pub units: usize,
    /// Width of the first fully connected layer; zero to omit it.
    pub hidden: usize,
    /// True to estimate size and shape in a first stage (section III).
    pub two_stages: bool,
    /// True to feed back the PMF of earlier grasps (section III).
    pub iterated: bool,
    /// Number of parts for cross-fitting, each of which is held out once.
    pub parts: usize,
    /// True to train both stages on all grasps, the second on outputs of first stages for held-out grasps; false to train
    /// each stage on one half of the grasps, as in the paper (section V-C).
    pub cross_fitted: bool,
    /// True to augment by exchanging left and right.
    pub mirror: bool,
    /// Standard deviation of the noise added to inputs while training, in standard deviations of the input.
    pub noise: f32,
    /// True for the network as the paper has it: channels are only standardised, stage two reads the size and shape that
    /// stage one decides after the whole grasp, PMFs are those of the softmax, and of earlier grasps only the PMF is read.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub strict: bool,
    pub training: Training,
}

/// Sampling rate of the paper: 300 samples in 4 s (Hz).
const PAPER_RATE_HZ: f32 = 75.0;

impl Recipe {
    /// The macro-layer alone (Fig. 2a).
    pub const fn macro_layer() -> Self {
        Self {
            rate_hz: 8.0,
            units: 128,
            hidden: 64,
            two_stages: false,
            iterated: false,
            parts: 3,
            cross_fitted: false,
            mirror: true,
            noise: 0.2,
            strict: false,
            training: Training {
                epochs: 180,
                batch: 32,
                learning_rate: 5e-3,
                weight_decay: 0.1,
                dropout: 0.5,
                smoothing: 0.0,
                early_read_outs: 10,
                early_share: 0.5,
                longest_gradient: 1.0,
                long_memory: false,
            },
        }
    }

    /// The macro-layer as the paper has it. The paper leaves open how it was trained; see
    /// [`deviations`](Self::deviations) for what is not left open.
    pub const fn paper_macro_layer() -> Self {
        let base = Self::macro_layer();
        let training = Training {
            epochs: 60,
            learning_rate: 3e-3,
            weight_decay: 0.01,
            early_read_outs: 0,
            long_memory: true,
            ..base.training
        };
        Self { rate_hz: PAPER_RATE_HZ, parts: 2, mirror: false, noise: 0.0, strict: true, training, ..base }
    }

    /// The dual-stage LSTM as the paper has it (Fig. 2b).
    pub const fn paper_dual_stage() -> Self {
        Self { two_stages: true, ..Self::paper_macro_layer() }
    }

    /// The iterated dual-stage LSTM as the paper has it (Fig. 2c).
    pub const fn paper_iterated() -> Self {
        Self { iterated: true, ..Self::paper_dual_stage() }
    }

    /// The four-layer network of Zuo et al., which the paper builds on: fewer units, no first fully connected layer, more
    /// dropout.
    pub const fn zuo() -> Self {
        let base = Self::paper_macro_layer();
        Self { units: 64, hidden: 0, training: Training { dropout: 0.6, ..base.training }, ..base }
    }

    /// A plain LSTM with one output at the end.
    pub const fn plain_lstm() -> Self {
        let base = Self::macro_layer();
        let training = Training { dropout: 0.0, early_read_outs: 0, weight_decay: 0.01, ..base.training };
        Self { hidden: 0, mirror: false, noise: 0.0, training, ..base }
    }

    /// The paper's dual-stage LSTM (Fig. 2b).
    pub const fn dual_stage() -> Self {
        Self { two_stages: true, ..Self::macro_layer() }
    }

    /// The paper's iterated dual-stage LSTM (Fig. 2c).
    pub const fn iterated() -> Self {
        Self { iterated: true, ..Self::dual_stage() }
    }

    /// The same network, trained by cross-fitting.
    pub const fn cross_fitted(self) -> Self {
        Self { cross_fitted: true, ..self }
    }

    /// Fine-tuning with further inputs: an eighth of the epochs, a tenth of the learning rate.
    pub(super) fn refining(&self) -> Training {
        let base = &self.training;
        Training { epochs: base.epochs.div_ceil(8), learning_rate: 0.1 * base.learning_rate, ..*base }
    }

    /// Differences from the paper, section III, V-C and V-E, for people; none for strict recipes as they stand.
    pub fn deviations(&self) -> Vec<String> {
        let mut list = Vec::new();
        let mut differs = |yes: bool, what: &str| {
            if yes {
                list.push(what.to_owned());
            }
        };
        differs(
            (self.rate_hz - PAPER_RATE_HZ).abs() > f32::EPSILON,
            &format!("averages readings to {} steps a second; the paper reads 75 samples a second", self.rate_hz),
        );
        differs(
            !self.strict,
            "compresses channels that span decades and adds the deviation from the mean course of all grasps to each; the \
             paper reads the channels as they are",
        );
        differs(self.mirror, "mirrors half of the grasps while training; the paper augments nothing");
        differs(self.noise > 0.0, "adds noise to the readings while training; the paper augments nothing");
        differs(
            self.training.early_read_outs > 0,
            "also learns from outputs during the grasp; the paper reads out at the end",
        );
        differs(
            !self.strict,
            "calibrates probabilities by temperatures from held-out grasps; the paper takes them as they come",
        );
        if self.two_stages {
            differs(
                !self.strict,
                "gives stage two the PMFs of size and shape at every step; the paper gives the size and the shape that stage one \
                 decides (one-hot)",
            );
            differs(
                self.cross_fitted,
                "trains both stages on all grasps, the second on out-of-fold outputs of the first; the paper trains each on \
                 grasps of its own (40/40/20)",
            );
        }
        if self.iterated {
            differs(
                !self.strict,
                "adds the logarithm of the earlier PMF to the scores, starts as a product of experts and is only fine-tuned; the \
                 paper feeds the PMF in and learns the rest",
            );
            differs(
                !self.strict,
                "learns from the PMF of up to three earlier grasps; the paper learns from pairs of grasps",
            );
        }
        list
    }

    /// The same for this recipe with settings of a fit. A strict recipe names each setting that they change.
    pub(crate) fn deviations_with(self, settings: &Map<String, Value>) -> Result<Vec<String>, LearnError> {
        let changed = self.with(settings)?;
        if !self.strict {
            return Ok(changed.deviations());
        }
        let [before, after] = [self, changed].map(|recipe| serde_json::to_value(recipe).unwrap_or_default());
        let of = |value: &Value, name: &str| value.get(name).or_else(|| value["training"].get(name)).cloned();
        let changes = settings.iter().filter(|(name, _)| of(&before, name) != of(&after, name));
        let mut list: Vec<String> =
            changes.map(|(name, wanted)| format!("sets {name} to {wanted}, unlike the strict network")).collect();
        if !changed.strict {
            list.extend(changed.deviations());
        }
        Ok(list)
    }

    /// Applies the settings of a fit, and shortens it if quick. Refuses settings that are unknown or out of range.
    pub fn adjusted(self, fitting: &Fitting<'_>) -> Result<Self, LearnError> {
        let mut recipe = self.with(&fitting.settings)?;
        if fitting.quick {
            recipe.units = recipe.units.min(32);
            recipe.hidden = recipe.hidden.min(32);
            recipe.parts = recipe.parts.min(2);
            recipe.training.epochs = recipe.training.epochs.min(40);
        }
        recipe.check()?;
        Ok(recipe)
    }

    /// Replaces settings by name; refuses unknown ones.
    fn with(self, settings: &Map<String, Value>) -> Result<Self, LearnError> {
        let mut value = serde_json::to_value(self).map_err(LearnError::failed)?;
        for (name, wanted) in settings {
            let known = value.get(name).is_some();
            let place = if known { value.get_mut(name) } else { value["training"].get_mut(name) };
            let Some(place) = place.filter(|place| !place.is_object()) else {
                return Err(LearnError::setting(name, "no such setting; `palpate train --print-settings` lists them"));
            };
            *place = wanted.clone();
        }
        serde_json::from_value(value).map_err(|e| LearnError::setting("of the network", e))
    }

    /// Refuses values out of range.
    pub fn check(&self) -> Result<(), LearnError> {
        let within = |name: &str, value: f64, least: f64, most: f64| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                Err(LearnError::setting(name, format!("{value} is not between {least} and {most}")))
            }
        };
        let training = &self.training;
        within("rate_hz", f64::from(self.rate_hz), 0.1, 1000.0)?;
        within("units", self.units as f64, 1.0, 4096.0)?;
        within("hidden", self.hidden as f64, 0.0, 4096.0)?;
        within("parts", self.parts as f64, 2.0, 20.0)?;
        within("noise", f64::from(self.noise), 0.0, 10.0)?;
        within("epochs", training.epochs as f64, 1.0, 100_000.0)?;
        within("batch", training.batch as f64, 1.0, 4096.0)?;
        within("learning_rate", training.learning_rate, 1e-8, 10.0)?;
        within("weight_decay", training.weight_decay, 0.0, 10.0)?;
        within("dropout", f64::from(training.dropout), 0.0, 0.95)?;
        within("smoothing", f64::from(training.smoothing), 0.0, 0.9)?;
        within("early_read_outs", training.early_read_outs as f64, 0.0, 1000.0)?;
        within("early_share", f64::from(training.early_share), 0.0, 1.0)?;
        within("longest_gradient", training.longest_gradient, 1e-6, 1e6)?;
        if self.strict && self.cross_fitted {
            return Err(LearnError::setting("strict", "a strict network is not cross-fitted"));
        }
        Ok(())
    }
}
