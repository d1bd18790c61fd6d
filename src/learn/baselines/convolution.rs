//! A convolutional network over time, in plain candle.

use super::candle_network::{CandleNetwork, Pass, STEPS};
use candle_core::{Result, Tensor};
use candle_nn::{BatchNorm, Linear, Module as _, ModuleT as _, VarBuilder};

/// [`Trunk`], then a linear layer.
pub(crate) struct Convolution {
    trunk: Trunk,
    last: Linear,
}

/// Three convolutions and a dense layer, each with batch normalisation and GELU.
pub(super) struct Trunk {
    convolutions: [Layer; 3],
    dense: Layer,
}

/// Linear layer with batch normalisation and GELU; on the windows of a sequence, a convolution.
struct Layer {
    linear: Linear,
    norm: BatchNorm,
}

/// Channels of all convolutions.
pub(super) const CHANNELS: usize = 48;
/// Kernel width and stride of each (steps).
pub(super) const KERNELS: [(usize, usize); 3] = [(5, 1), (5, 2), (3, 2)];
/// Least variance that normalisation divides by.
pub(super) const NORM_EPSILON: f64 = 1e-5;
/// Width of the dense layer.
pub(super) const DENSE: usize = 128;
/// Share of values dropped before and after the dense layer.
const DROPOUT: f32 = 0.3;

impl Layer {
    fn new(from: usize, to: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        let linear = candle_nn::linear_no_bias(from, to, variables.pp("linear"))?;
        Ok(Self { linear, norm: candle_nn::batch_norm(to, NORM_EPSILON, variables.pp("norm"))? })
    }

    /// Rows `[rows][from]` to `[rows][to]`.
    fn forward(&self, rows: &Tensor, pass: &Pass<'_>) -> Result<Tensor> {
        self.norm.forward_t(&self.linear.forward(rows)?, pass.is_training())?.gelu()
    }
}

/// Windows of a sequence `[batch][steps][channels]` with zeros on both sides: `[batch][steps / stride][kernel * channels]`.
/// With a linear layer they are a convolution. candle's own `conv1d` is not used: its gradient of the kernel is wrong by as
/// much as its size (0.11.1, against finite differences).
fn windows(x: &Tensor, kernel: usize, stride: usize) -> Result<Tensor> {
    let steps = x.dim(1)?.div_ceil(stride);
    let padded = x.pad_with_zeros(1, kernel / 2, kernel / 2)?;
    let at = |offset: usize| {
        let taken: Vec<u32> = (0..steps).map(|step| (step * stride + offset) as u32).collect();
        padded.index_select(&Tensor::from_vec(taken, steps, x.device())?, 1)
    };
    Tensor::cat(&(0..kernel).map(at).collect::<Result<Vec<_>>>()?, 2)
}

impl Trunk {
    pub(super) fn new(inputs: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        let convolution = |number: usize| {
            let from = if number == 0 { inputs } else { CHANNELS };
            Layer::new(from * KERNELS[number].0, CHANNELS, &variables.pp(format!("convolution.{number}")))
        };
        let steps = KERNELS.iter().fold(STEPS, |steps, (_, stride)| steps.div_ceil(*stride));
        Ok(Self {
            convolutions: [convolution(0)?, convolution(1)?, convolution(2)?],
            dense: Layer::new(CHANNELS * steps, DENSE, &variables.pp("dense"))?,
        })
    }

    /// Inputs `[batch][inputs][STEPS]` to `[batch][DENSE]`. Training drops a share of the values before the dense layer.
    pub(super) fn forward(&self, x: &Tensor, dropout: f32, pass: &mut Pass<'_>) -> Result<Tensor> {
        let mut x = x.transpose(1, 2)?.contiguous()?;
        for (layer, (kernel, stride)) in self.convolutions.iter().zip(KERNELS) {
            let windows = windows(&x, kernel, stride)?;
            let (batch, steps, width) = windows.dims3()?;
            x = layer.forward(&windows.reshape((batch * steps, width))?, pass)?.reshape((batch, steps, CHANNELS))?;
        }
        let x = pass.dropout(&x.flatten_from(1)?, dropout)?;
        self.dense.forward(&x, pass)
    }
}

impl CandleNetwork for Convolution {
    const REVISION: u32 = 2;
    const RATE: f64 = 4e-3;

    fn new(inputs: usize, classes: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        Ok(Self {
            trunk: Trunk::new(inputs, variables)?,
            last: candle_nn::linear(DENSE, classes, variables.pp("last"))?,
        })
    }

    fn scores(&self, x: &Tensor, pass: &mut Pass<'_>) -> Result<Tensor> {
        let x = self.trunk.forward(x, DROPOUT, pass)?;
        self.last.forward(&pass.dropout(&x, DROPOUT)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::{Device, Var};

    #[test]
    fn gradients_of_a_convolution_are_those_of_finite_differences() -> Result<()> {
        let numbers =
            |count: usize| (0..count).map(|k| ((k * 7919 + 13) % 101) as f32 / 50.0 - 1.0).collect::<Vec<_>>();
        for (kernel, stride) in KERNELS {
            let x = Tensor::from_vec(numbers(2 * 9 * 3), (2, 9, 3), &Device::Cpu)?;
            let weights = numbers(3 * kernel * 4);
            let sum =
                |x: &Tensor, w: &Tensor| windows(x, kernel, stride)?.flatten_to(1)?.matmul(w)?.gelu()?.sqr()?.sum_all();
            let w = Var::from_vec(weights.clone(), (3 * kernel, 4), &Device::Cpu)?;
            let of_x = Var::from_tensor(&x)?;
            let gradients = sum(&of_x, &w)?.backward()?;
            for (var, is_input) in [(&of_x, true), (&w, false)] {
                let exact = gradients.get(var).expect("has a gradient").flatten_all()?.to_vec1::<f32>()?;
                let values = var.flatten_all()?.to_vec1::<f32>()?;
                for k in (0..values.len()).step_by(5) {
                    let moved = |by: f32| -> Result<f32> {
                        let mut values = values.clone();
                        values[k] += by;
                        let moved = Tensor::from_vec(values, var.dims(), &Device::Cpu)?;
                        if is_input { sum(&moved, &w) } else { sum(&x, &moved) }?.to_scalar()
                    };
                    let slope = (moved(0.01)? - moved(-0.01)?) / 0.02;
                    assert!((slope - exact[k]).abs() < 0.02 * (1.0 + slope.abs()), "{slope} and {}", exact[k]);
                }
            }
        }
        Ok(())
    }

    #[test]
    fn windows_are_padded_with_zeros() -> Result<()> {
        let x = Tensor::from_vec(vec![1_f32, 2.0, 3.0, 4.0, 5.0], (1, 5, 1), &Device::Cpu)?;
        let rows = windows(&x, 3, 2)?.squeeze(0)?.to_vec2::<f32>()?;
        assert_eq!(rows, [[0.0, 1.0, 2.0], [2.0, 3.0, 4.0], [4.0, 5.0, 0.0]]);
        Ok(())
    }
}
