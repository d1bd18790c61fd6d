//! A convolutional network over time, in plain candle.

use super::candle_network::{CandleNetwork, Pass, STEPS};
use candle_core::{Result, Tensor};
use candle_nn::{BatchNorm, Conv1d, Conv1dConfig, Linear, Module as _, ModuleT as _, VarBuilder};

/// Three convolutions and a dense layer, each with batch normalisation and GELU, then a linear layer.
pub(crate) struct Convolution {
    convolutions: [(Conv1d, BatchNorm); 3],
    dense: Linear,
    dense_norm: BatchNorm,
    last: Linear,
}

/// Channels of all convolutions.
const CHANNELS: usize = 48;
/// Kernel width and stride of each (steps).
const KERNELS: [(usize, usize); 3] = [(5, 1), (5, 2), (3, 2)];
/// Width of the dense layer.
const DENSE: usize = 128;
/// Share of values dropped before and after the dense layer.
const DROPOUT: f32 = 0.4;

impl CandleNetwork for Convolution {
    const REVISION: u32 = 2;

    fn new(inputs: usize, classes: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        let convolution = |number: usize| -> Result<(Conv1d, BatchNorm)> {
            let (kernel, stride) = KERNELS[number];
            let from = if number == 0 { inputs } else { CHANNELS };
            let config = Conv1dConfig { padding: kernel / 2, stride, ..Conv1dConfig::default() };
            let layer =
                candle_nn::conv1d(from, CHANNELS, kernel, config, variables.pp(format!("convolution.{number}")))?;
            let norm = candle_nn::batch_norm(CHANNELS, 1e-5, variables.pp(format!("norm.{number}")))?;
            Ok((layer, norm))
        };
        let steps = KERNELS.iter().fold(STEPS, |steps, (_, stride)| steps.div_ceil(*stride));
        Ok(Self {
            convolutions: [convolution(0)?, convolution(1)?, convolution(2)?],
            dense: candle_nn::linear(CHANNELS * steps, DENSE, variables.pp("dense"))?,
            dense_norm: candle_nn::batch_norm(DENSE, 1e-5, variables.pp("norm.dense"))?,
            last: candle_nn::linear(DENSE, classes, variables.pp("last"))?,
        })
    }

    fn scores(&self, x: &Tensor, pass: &mut Pass<'_>) -> Result<Tensor> {
        let mut x = x.clone();
        for (convolution, norm) in &self.convolutions {
            x = norm.forward_t(&convolution.forward(&x)?, pass.is_training())?.gelu()?;
        }
        let x = pass.dropout(&x.flatten_from(1)?, DROPOUT)?;
        let x = self.dense_norm.forward_t(&self.dense.forward(&x)?, pass.is_training())?.gelu()?;
        self.last.forward(&pass.dropout(&x, DROPOUT)?)
    }
}
