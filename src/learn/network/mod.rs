//! Recurrent networks: the paper's macro-layer on an LSTM kernel of our own, its training, and the recognisers built
//! from it.
//!
//! | file | contents |
//! |---|---|
//! | `two_stage.rs` | the recognisers: macro-layer, dual-stage LSTM, iterated dual-stage LSTM |
//! | `recipe.rs` | settings of a network and its training: strict as in the paper, or tuned |
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
mod preparation;
mod recipe;
mod training;
mod training_set;
mod two_stage;

use crate::arrays::{Arrays, ModelError};
use crate::data::Dataset;
use crate::fitting::{Fitting, LearnError};
use crate::model::ModelCard;
use crate::recogniser::Recogniser;
use two_stage::TwoStageNetwork;

pub(crate) use gates::{add_row_product, gelu};
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
    Ok(Box::new(TwoStageNetwork::fit(data, recipe, method, fitting)?))
}

/// Restores a network from a model file.
pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Box<dyn Recogniser>, ModelError> {
    Ok(Box::new(TwoStageNetwork::load(card, arrays)?))
}

/// Everything that decides a fit, besides the data, the seed and the options of the fit.
pub(crate) fn decided_by(recipe: &Recipe) -> serde_json::Value {
    let mut decided_by = serde_json::json!({ "recipe": recipe, "revision": REVISION });
    // Stored results have the fingerprints of 0.1.0, where a stage could have several networks.
    decided_by["recipe"]["members"] = 1.into();
    decided_by
}
