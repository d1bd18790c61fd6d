//! Training of a macro-layer: AdamW with a one-cycle learning rate, on one thread; one seed determines the result.

use super::macro_layer::{Batch, MacroLayer, MacroShape, Pass, ReadOut, Regular};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Numbered training sequences, augmented anew whenever they are drawn.
pub(super) trait TrainingSet {
    /// Number of sequences.
    fn count(&self) -> usize;

    /// Number of steps of the longest sequence.
    fn longest(&self) -> usize;

    /// Writes an augmented copy of sequence `k`.
    fn draw(&self, k: usize, random: &mut dyn Rng, drawn: &mut TrainingSequence);
}

/// One augmented sequence and its targets.
#[derive(Clone, Debug, Default)]
pub(super) struct TrainingSequence {
    /// Inputs, `[steps][inputs]`.
    pub(super) x: Vec<f32>,
    /// True class in each group.
    pub(super) targets: Vec<usize>,
    /// Logarithm of the prior probability of each output; empty without a prior.
    pub(super) log_prior: Vec<f32>,
}

/// Settings of the training of a network.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Passes over the training set.
    pub epochs: usize,
    /// Sequences per optimiser step.
    pub batch: usize,
    /// Peak learning rate.
    pub learning_rate: f64,
    /// Weight decay per step and unit of learning rate.
    pub weight_decay: f64,
    /// Dropout share of the hidden layer, 0 to 0.95.
    pub dropout: f32,
    /// Label smoothing: share of each target spread over all classes.
    pub smoothing: f32,
    /// Number of additional outputs before the last step that enter the loss.
    pub early_read_outs: usize,
    /// Their share of the loss.
    pub early_share: f32,
    /// Largest norm of a gradient; longer ones are scaled down.
    pub longest_gradient: f64,
    /// True for units that begin with memories of all lengths up to the longest sequence (chrono initialisation, Tallec and
    /// Ollivier 2018), false for forget gates with a bias of one, which remember for a few steps.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub long_memory: bool,
}

/// Share of the training in which the learning rate rises.
const WARM_UP: f64 = 0.3;

impl Training {
    /// Learning rate at a share of the training: half a cosine up from peak / 25, another down to 1e-4 peak.
    fn rate(&self, share: f64) -> f64 {
        let half_cosine = |from: f64, to: f64, x: f64| from + (to - from) * 0.5 * (1.0 - (PI * x).cos());
        let peak = self.learning_rate;
        if share < WARM_UP {
            half_cosine(peak / 25.0, peak, share / WARM_UP)
        } else {
            half_cosine(peak, peak * 1e-4, (share - WARM_UP) / (1.0 - WARM_UP))
        }
    }
}

/// Trains a network from random parameters. `go_on` gets the number and mean loss of each epoch and returns false to stop.
pub(super) fn train(
    shape: MacroShape,
    set: &dyn TrainingSet,
    training: &Training,
    seed: u64,
    go_on: &mut dyn FnMut(usize, f64) -> bool,
) -> MacroLayer {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut layer = MacroLayer::new(shape, &mut random);
    if training.long_memory {
        layer.remember(set.longest(), &mut random);
    }
    train_on(&mut layer, set, training, seed ^ 0x7ea1, go_on);
    layer
}

/// Continues training a network.
pub(super) fn train_on(
    layer: &mut MacroLayer,
    set: &dyn TrainingSet,
    training: &Training,
    seed: u64,
    go_on: &mut dyn FnMut(usize, f64) -> bool,
) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut pass = Pass::new(layer.shape());
    let mut optimiser = AdamW::new(layer.values().len());
    let mut gradient = vec![0.0; layer.values().len()];
    let (mut batch, mut drawn) = (Batch::default(), vec![TrainingSequence::default(); training.batch.max(1)]);
    let mut order: Vec<usize> = (0..set.count()).collect();
    let steps = training.epochs * order.len().div_ceil(training.batch.max(1));
    let regular = Regular { dropout: training.dropout, smoothing: training.smoothing };
    let mut taken = 0;
    for epoch in 0..training.epochs {
        order.shuffle(&mut random);
        let mut sum = 0.0;
        for group in order.chunks(training.batch.max(1)) {
            for (k, sequence) in group.iter().zip(&mut drawn) {
                set.draw(*k, &mut random, sequence);
            }
            fill(&mut batch, &drawn[..group.len()], layer.shape().inputs, training);
            let loss = layer.loss(&batch, regular, &mut random, &mut gradient, &mut pass);
            sum += loss * group.len() as f64;
            shorten(&mut gradient, training.longest_gradient);
            optimiser.step(
                layer.values_mut(),
                &gradient,
                training.rate(taken as f64 / steps as f64),
                training.weight_decay,
            );
            taken += 1;
        }
        if !go_on(epoch, sum / order.len().max(1) as f64) {
            break;
        }
    }
}

/// Packs sequences into a time-major batch with their outputs in the order of steps.
fn fill(batch: &mut Batch, drawn: &[TrainingSequence], inputs: usize, training: &Training) {
    let lengths = || drawn.iter().map(|sequence| sequence.x.len() / inputs);
    (batch.steps, batch.sequences) = (lengths().max().unwrap_or(0), drawn.len());
    batch.x.clear();
    batch.x.resize(batch.steps * batch.sequences * inputs, 0.0);
    for (sequence, source) in drawn.iter().enumerate() {
        for (step, row) in source.x.chunks_exact(inputs).enumerate() {
            let at = (step * batch.sequences + sequence) * inputs;
            batch.x[at..at + inputs].copy_from_slice(row);
        }
    }
    let of_sequence = 1.0 / drawn.len().max(1) as f32;
    batch.read_outs.clear();
    for (sequence, steps) in lengths().enumerate().filter(|(_, steps)| *steps > 0) {
        let early = training.early_read_outs.min(steps - 1);
        let early_share = if early == 0 { 0.0 } else { training.early_share };
        for k in 0..early {
            // Spread evenly over the sequence.
            let step = (k + 1) * steps / (early + 1);
            let weight = of_sequence * early_share / early as f32;
            batch.read_outs.push(ReadOut { step: step.saturating_sub(1), sequence, weight });
        }
        batch.read_outs.push(ReadOut { step: steps - 1, sequence, weight: of_sequence * (1.0 - early_share) });
    }
    batch.read_outs.sort_by_key(|at| at.step);
    batch.targets.clear();
    batch.targets.extend(drawn.iter().flat_map(|sequence| &sequence.targets));
    batch.log_prior.clear();
    batch.log_prior.extend(drawn.iter().flat_map(|sequence| &sequence.log_prior));
}

/// Scales a gradient down to a largest norm.
fn shorten(gradient: &mut [f32], longest: f64) {
    let length = gradient.iter().map(|g| f64::from(*g) * f64::from(*g)).sum::<f64>().sqrt();
    if length > longest {
        let factor = (longest / length) as f32;
        gradient.iter_mut().for_each(|g| *g *= factor);
    }
}

/// Adam with decoupled weight decay (Loshchilov and Hutter 2019), as in PyTorch.
#[derive(Clone, Debug)]
pub struct AdamW {
    mean: Vec<f32>,
    square: Vec<f32>,
    steps: i32,
}

/// Replaces subnormal numbers, on which processors are slow, by zero.
fn flushed(x: f32) -> f32 {
    if x.abs() < f32::MIN_POSITIVE { 0.0 } else { x }
}

impl AdamW {
    const MEMORY: f32 = 0.9;
    const SQUARE_MEMORY: f32 = 0.999;
    const EPSILON: f32 = 1e-8;

    /// Creates the optimiser of a number of parameters.
    pub fn new(parameters: usize) -> Self {
        Self { mean: vec![0.0; parameters], square: vec![0.0; parameters], steps: 0 }
    }

    /// Updates values against their gradient, at a learning rate and weight decay.
    pub fn step(&mut self, values: &mut [f32], gradient: &[f32], rate: f64, decay: f64) {
        self.steps += 1;
        let unbias = 1.0 / (1.0 - Self::MEMORY.powi(self.steps));
        let unbias_square = 1.0 / (1.0 - Self::SQUARE_MEMORY.powi(self.steps));
        let (rate, keep) = (rate as f32, 1.0 - (rate * decay) as f32);
        for (((value, g), mean), square) in values.iter_mut().zip(gradient).zip(&mut self.mean).zip(&mut self.square) {
            *mean = flushed(Self::MEMORY * *mean + (1.0 - Self::MEMORY) * g);
            *square = flushed(Self::SQUARE_MEMORY * *square + (1.0 - Self::SQUARE_MEMORY) * g * g);
            *value = keep * *value - rate * *mean * unbias / ((*square * unbias_square).sqrt() + Self::EPSILON);
        }
    }
}
