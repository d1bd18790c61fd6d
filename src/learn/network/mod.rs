//! Recurrent networks: the paper's macro-layer on an LSTM kernel of our own, its training, and the recognisers built
//! from it.
//!
//! | file | contents |
//! |---|---|
//! | `tactile_network.rs` | the recognisers: macro-layer, dual-stage LSTM, iterated dual-stage LSTM |
//! | `paper_network.rs` | the same as the paper has them, without our additions |
//! | `recipe.rs` | settings of a network and its training |
//! | `preparation.rs` | readings to inputs: time steps and scaling |
//! | `training_set.rs` | inputs of a stage and their augmentation |
//! | `calibrated.rs` | networks with calibrated probabilities, cross-fitting |
//! | `training.rs` | AdamW, learning-rate schedule, training loop |
//! | `macro_layer.rs`, `lstm.rs`, `gates.rs`, `gemm.rs` | the kernel, from layer to matrix product |

mod calibrated;
mod gates;
mod gemm;
#[cfg(test)]
mod gradient_tests;
mod lstm;
mod macro_layer;
mod paper_network;
mod preparation;
mod recipe;
mod tactile_network;
mod training;
mod training_set;

use crate::arrays::Arrays;
use crate::data::Dataset;
use crate::fitting::{Fitting, LearnError};
use crate::model::{LoadError, ModelCard};
use crate::recogniser::Recogniser;
use paper_network::PaperNetwork;
use tactile_network::TactileNetwork;

pub(crate) use gemm::{Matrix, multiply};
pub use macro_layer::{Batch, Block, LiveMacroLayer, MacroLayer, MacroShape, Pass, ReadOut, Regular};
pub(crate) use preparation::Preparation;
pub use recipe::Recipe;
pub use training::{AdamW, Training};

/// Version of the fit, part of the fingerprint.
const REVISION: u32 = 1;

/// Fits the network of a recipe. `method` is its title in errors.
pub(crate) fn fit(
    data: &Dataset,
    recipe: Recipe,
    method: &'static str,
    fitting: &Fitting<'_>,
) -> Result<Box<dyn Recogniser>, LearnError> {
    Ok(if recipe.strict {
        Box::new(PaperNetwork::fit(data, recipe, method, fitting)?)
    } else {
        Box::new(TactileNetwork::fit(data, recipe, method, fitting)?)
    })
}

/// Restores a network from a model file.
pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Box<dyn Recogniser>, LoadError> {
    Ok(if card.settings["recipe"]["strict"] == true {
        Box::new(PaperNetwork::load(card, arrays)?)
    } else {
        Box::new(TactileNetwork::load(card, arrays)?)
    })
}

/// Everything that decides a fit, besides the data, the seed and the options of the fit.
pub(crate) fn decided_by(recipe: &Recipe) -> serde_json::Value {
    let mut decided_by = serde_json::json!({ "recipe": recipe, "revision": REVISION });
    // Stored results have the fingerprints of 0.1.0, where a stage could have several networks.
    decided_by["recipe"]["members"] = 1.into();
    decided_by
}
