//! Recurrent networks: the macro-layer of the paper on a kernel of our own, how it is trained, and the recognisers made
//! of it.

mod calibrated;
mod gates;
mod gemm;
#[cfg(test)]
mod gradients;
mod lessons;
mod lstm;
mod macro_layer;
mod preparation;
mod recipe;
mod tactile;
mod training;

pub use macro_layer::{Batch, Block, LiveMacroLayer, MacroLayer, MacroShape, Pass, ReadOut, Regular};
pub use preparation::{Binner, Preparation, Scale, mirror};
pub use recipe::Recipe;
pub use tactile::TactileNetwork;
pub use training::{AdamW, Lesson, Lessons, Training, train, train_on};
