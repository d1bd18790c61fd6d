//! Recurrent networks: the paper's macro-layer on an LSTM kernel of our own, its training, and the recognisers built
//! from it.
//!
//! | file | contents |
//! |---|---|
//! | `tactile_network.rs` | the recognisers: macro-layer, dual-stage LSTM, iterated dual-stage LSTM |
//! | `recipe.rs` | settings of a network and its training |
//! | `preparation.rs` | readings to inputs: time steps and scaling |
//! | `training_set.rs` | inputs of a stage and their augmentation |
//! | `calibrated.rs` | committees with calibrated probabilities, cross-fitting |
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
mod tactile_network;
mod training;
mod training_set;

pub use macro_layer::{Batch, Block, LiveMacroLayer, MacroLayer, MacroShape, Pass, ReadOut, Regular};
pub(crate) use preparation::Preparation;
pub use recipe::Recipe;
pub use tactile_network::TactileNetwork;
pub use training::{AdamW, Training};
