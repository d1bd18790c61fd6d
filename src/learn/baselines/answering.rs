//! [`Trunk`](super::convolution::Trunk) and a linear layer behind it, for answers: plain arrays with the batch normalisation in
//! the weights. A live answer takes a tenth of the time that it takes in candle, whose tensors cost more than the numbers in
//! them.

use super::candle_network::{STEPS, Variables};
use super::convolution::{CHANNELS, DENSE, KERNELS, NORM_EPSILON};
use super::felt_steps::Views;
use crate::network::{Matrix, add_row_product, gelu, multiply};
use candle_core::{Error, Result};

/// The network.
pub(super) struct Answering {
    convolutions: [Dense; 3],
    dense: Dense,
    last: Dense,
}

/// A linear layer.
struct Dense {
    /// `[inputs][outputs]`.
    weights: Vec<f32>,
    bias: Vec<f32>,
}

/// Outputs for a grasp: means over its views.
pub(super) struct Outputs {
    /// Values before the last layer, [`DENSE`].
    pub(super) inner: Vec<f32>,
    /// Outputs of the last layer.
    pub(super) outer: Vec<f32>,
}

impl Answering {
    /// Takes the variables of a trained network whose last layer has this name.
    pub(super) fn new<N>(network: &Variables<N>, last: &str) -> Result<Self> {
        let array = |name: &str| -> Result<Vec<f32>> {
            let missing = || Error::Msg(format!("the network has no variable {name}"));
            network.by_name.get(name).ok_or_else(missing)?.flatten_all()?.to_vec1()
        };
        let layer = |name: &str| -> Result<Dense> {
            let norm = |part: &str| array(&format!("{name}.norm.{part}"));
            let (mean, variance, gain, shift) =
                (norm("running_mean")?, norm("running_var")?, norm("weight")?, norm("bias")?);
            let factors: Vec<f32> =
                gain.iter().zip(&variance).map(|(g, v)| g / (v + NORM_EPSILON as f32).sqrt()).collect();
            let bias = shift.iter().zip(&mean).zip(&factors).map(|((shift, mean), f)| shift - mean * f).collect();
            let mut own = Dense::new(&array(&format!("{name}.linear.weight"))?, bias);
            let rows = own.weights.chunks_exact_mut(factors.len());
            rows.for_each(|row| row.iter_mut().zip(&factors).for_each(|(w, f)| *w *= f));
            Ok(own)
        };
        let convolution = |number: usize| layer(&format!("convolution.{number}"));
        Ok(Self {
            convolutions: [convolution(0)?, convolution(1)?, convolution(2)?],
            dense: layer("dense")?,
            last: Dense::new(&array(&format!("{last}.weight"))?, array(&format!("{last}.bias"))?),
        })
    }

    /// Computes the outputs for a grasp.
    pub(super) fn outputs(&self, views: &Views) -> Outputs {
        let mut means = Outputs { inner: vec![0.0; DENSE], outer: vec![0.0; self.last.bias.len()] };
        let share = 1.0 / views.inputs.len().max(1) as f32;
        for view in &views.inputs {
            let Outputs { inner, outer } = self.of_view(view);
            let both = [(&mut means.inner, inner), (&mut means.outer, outer)];
            both.into_iter().for_each(|(mean, x)| mean.iter_mut().zip(x).for_each(|(mean, x)| *mean += share * x));
        }
        means
    }

    /// Computes the outputs for inputs `[inputs][STEPS]`.
    fn of_view(&self, view: &[f32]) -> Outputs {
        let inputs = view.len() / STEPS;
        let mut x: Vec<f32> = (0..STEPS).flat_map(|step| view.iter().skip(step).step_by(STEPS).copied()).collect();
        let mut channels = inputs;
        let mut windows = Vec::new();
        for (layer, (kernel, stride)) in self.convolutions.iter().zip(KERNELS) {
            let steps = fill_windows(&x, channels, (kernel, stride), &mut windows);
            x.clear();
            x.extend((0..steps).flat_map(|_| &layer.bias));
            let weights = Matrix::new(&layer.weights, kernel * channels, CHANNELS);
            multiply(Matrix::new(&windows, steps, kernel * channels), weights, 1.0, &mut x);
            gelu(&mut x);
            channels = CHANNELS;
        }
        let mut inner = self.dense.bias.clone();
        add_row_product(&x, &self.dense.weights, &mut inner);
        gelu(&mut inner);
        let mut outer = self.last.bias.clone();
        add_row_product(&inner, &self.last.weights, &mut outer);
        Outputs { inner, outer }
    }
}

impl Dense {
    /// Takes weights `[outputs][inputs]`.
    fn new(weights: &[f32], bias: Vec<f32>) -> Self {
        let inputs = weights.len() / bias.len().max(1);
        let column = |input: usize| weights.iter().skip(input).step_by(inputs).copied();
        Self { weights: (0..inputs).flat_map(column).collect(), bias }
    }
}

/// Windows of a sequence `[steps][channels]` with zeros on both sides, `[steps / stride][kernel * channels]`; returns their
/// number.
fn fill_windows(x: &[f32], channels: usize, (kernel, stride): (usize, usize), windows: &mut Vec<f32>) -> usize {
    let steps = x.len() / channels;
    let count = steps.div_ceil(stride);
    windows.clear();
    windows.resize(count * kernel * channels, 0.0);
    for (number, window) in windows.chunks_exact_mut(kernel * channels).enumerate() {
        let first = (number * stride) as isize - (kernel / 2) as isize;
        let (from, to) = (first.max(0) as usize, (first + kernel as isize).min(steps as isize) as usize);
        let at = (from as isize - first) as usize * channels;
        let taken = &x[from * channels..to * channels];
        window[at..at + taken.len()].copy_from_slice(taken);
    }
    count
}

#[cfg(test)]
mod tests {
    use super::super::candle_network::{CandleNetwork as _, Pass};
    use super::super::convolution::Convolution;
    use super::*;
    use candle_core::{Device, Tensor};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn answers_are_those_of_candle() -> Result<()> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let (inputs, classes) = (13, 7);
        let network = Variables::<Convolution>::new(inputs, classes, &mut random)?;
        // Normalisation as after training.
        for (_, var) in network.by_name.iter().filter(|(name, _)| name.contains("norm")) {
            let values = (0..var.elem_count()).map(|_| random.random_range(0.5_f32..2.0)).collect();
            var.set(&Tensor::from_vec(values, var.dims(), &Device::Cpu)?)?;
        }
        let answering = Answering::new(&network, "last")?;
        let mut scores = Vec::new();
        for _ in 0..2 {
            let view: Vec<f32> = (0..inputs * STEPS).map(|_| random.random_range(-2.0..2.0)).collect();
            let x = Tensor::from_slice(&view, (1, inputs, STEPS), &Device::Cpu)?;
            let expected: Vec<f32> = network.network.scores(&x, &mut Pass::answering())?.squeeze(0)?.to_vec1()?;
            let own = answering.outputs(&Views { inputs: vec![view.clone()], felt: STEPS });
            assert_eq!((own.inner.len(), own.outer.len()), (DENSE, classes));
            let off = own.outer.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 1e-4, "{:?} and {expected:?}", own.outer);
            scores.push((view, own.outer));
        }
        let [(first, a), (second, b)] = &scores[..] else { panic!("two views") };
        let both = answering.outputs(&Views { inputs: vec![first.clone(), second.clone()], felt: STEPS });
        assert!(both.outer.iter().zip(a).zip(b).all(|((both, a), b)| (both - 0.5 * (a + b)).abs() < 1e-5));
        assert!(Answering::new(&network, "first").is_err());
        Ok(())
    }
}
