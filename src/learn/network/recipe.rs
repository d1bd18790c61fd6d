//! Everything about a network that is chosen rather than learned.

use super::super::{FitError, Fitting};
use super::training::Training;
use serde::{Deserialize, Serialize};

/// How a network is built and trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Inputs per second: readings are averaged down to this.
    pub rate_hz: f32,
    /// LSTM units of each macro-layer.
    pub units: usize,
    /// Width of the first fully connected layer; zero leaves it out.
    pub hidden: usize,
    /// Networks of each stage that begin from other weights and answer together.
    #[serde(default = "one")]
    pub members: usize,
    /// Whether size and shape are learned first and handed on to the second stage.
    pub two_stages: bool,
    /// Whether the PMF of earlier grasps is fed back.
    pub iterated: bool,
    /// Parts of the data. Where networks are cross-fitted each is left out once; otherwise one is, for calibration.
    pub parts: usize,
    /// Whether both stages learn from all grasps, the second from answers of first stages that had not seen them;
    /// otherwise each stage has one half of the grasps, as in the paper (section V-C).
    pub cross_fitted: bool,
    /// Whether grasps are also shown with left and right exchanged.
    pub mirror: bool,
    /// Deviation of the noise added to inputs while training, in deviations of the input.
    pub noise: f32,
    /// How weights are found.
    pub training: Training,
}

/// Networks that can answer together.
pub(super) const MOST_MEMBERS: usize = 20;

/// Members where a file does not say.
pub(super) fn one() -> usize {
    1
}

impl Recipe {
    /// The macro-layer by itself (Fig. 2a).
    pub fn macro_layer() -> Self {
        Self {
            rate_hz: 8.0,
            units: 128,
            hidden: 64,
            members: 1,
            two_stages: false,
            iterated: false,
            parts: 3,
            cross_fitted: false,
            mirror: true,
            noise: 0.2,
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
            },
        }
    }

    /// Several macro-layers that answer together.
    pub fn committee() -> Self {
        Self { members: 4, ..Self::macro_layer() }
    }

    /// Zuo et al.'s four layers, from which the paper starts: fewer units, no first fully connected layer, more
    /// dropout.
    pub fn zuo() -> Self {
        let base = Self::macro_layer();
        Self { units: 64, hidden: 0, training: Training { dropout: 0.6, ..base.training.clone() }, ..base }
    }

    /// A plain LSTM: one layer and its read-out at the end, nothing else.
    pub fn plain_lstm() -> Self {
        let base = Self::macro_layer();
        let training = Training { dropout: 0.0, early_read_outs: 0, weight_decay: 0.01, ..base.training.clone() };
        Self { hidden: 0, mirror: false, noise: 0.0, training, ..base }
    }

    /// The dual-stage LSTM as the paper has it (Fig. 2b).
    pub fn dual_stage() -> Self {
        Self { two_stages: true, ..Self::macro_layer() }
    }

    /// The iterated dual-stage LSTM (Fig. 2c).
    pub fn iterated() -> Self {
        Self { iterated: true, ..Self::dual_stage() }
    }

    /// The same network by cross-fitting.
    pub fn cross_fitted(self) -> Self {
        Self { cross_fitted: true, ..self }
    }

    /// How a network that has learned from single grasps goes on learning with what earlier grasps said: a little, and
    /// gently.
    pub(super) fn refining(&self) -> Training {
        let base = &self.training;
        Training { epochs: base.epochs.div_ceil(8), learning_rate: 0.1 * base.learning_rate, ..base.clone() }
    }

    /// With the settings that were asked for instead of its own, and shorter where that was asked for.
    pub fn adjusted(self, fitting: &Fitting<'_>) -> Result<Self, FitError> {
        let mut value = serde_json::to_value(&self).map_err(|e| FitError::Failed { cause: e.to_string() })?;
        for (name, wanted) in &fitting.settings {
            let known = value.get(name).is_some();
            let place = if known { value.get_mut(name) } else { value["training"].get_mut(name) };
            let Some(place) = place.filter(|place| !place.is_object()) else {
                let cause = "there is no such setting; `palpate train --print-settings` lists them".to_owned();
                return Err(FitError::Setting { name: name.clone(), cause });
            };
            *place = wanted.clone();
        }
        let mut recipe: Self = serde_json::from_value(value)
            .map_err(|e| FitError::Setting { name: "of the network".to_owned(), cause: e.to_string() })?;
        if fitting.quick {
            recipe.units = recipe.units.min(32);
            recipe.hidden = recipe.hidden.min(32);
            recipe.parts = recipe.parts.min(2);
            recipe.members = recipe.members.min(2);
            recipe.training.epochs = recipe.training.epochs.min(40);
        }
        recipe.check()?;
        Ok(recipe)
    }

    /// Refuses what cannot work.
    pub fn check(&self) -> Result<(), FitError> {
        let within = |name: &str, value: f64, least: f64, most: f64| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                let cause = format!("{value} is not between {least} and {most}");
                Err(FitError::Setting { name: name.to_owned(), cause })
            }
        };
        let training = &self.training;
        within("rate_hz", f64::from(self.rate_hz), 0.1, 1000.0)?;
        within("units", self.units as f64, 1.0, 4096.0)?;
        within("hidden", self.hidden as f64, 0.0, 4096.0)?;
        within("members", self.members as f64, 1.0, MOST_MEMBERS as f64)?;
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
        within("longest_gradient", training.longest_gradient, 1e-6, 1e6)
    }
}
