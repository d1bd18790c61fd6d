//! The network of the guide "A network in plain candle" in `assets/help/contributing.md`; a test compares both.

use super::candle_network::{CandleNetwork, Pass, STEPS};
use candle_core::{Result, Tensor};
use candle_nn::{Linear, Module as _, VarBuilder};

/// Two dense layers.
pub(crate) struct Perceptron {
    first: Linear,
    last: Linear,
}

impl CandleNetwork for Perceptron {
    const REVISION: u32 = 1;

    fn new(inputs: usize, classes: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        Ok(Self {
            first: candle_nn::linear(inputs * STEPS, 64, variables.pp("first"))?,
            last: candle_nn::linear(64, classes, variables.pp("last"))?,
        })
    }

    fn scores(&self, x: &Tensor, pass: &mut Pass<'_>) -> Result<Tensor> {
        let x = self.first.forward(&x.flatten_from(1)?)?.relu()?;
        self.last.forward(&pass.dropout(&x, 0.3)?)
    }
}
