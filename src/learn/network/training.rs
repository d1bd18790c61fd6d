//! Training a macro-layer: AdamW on a one-cycle schedule, one thread, every random number from one seed.

use super::macro_layer::{Batch, MacroLayer, MacroShape, Pass, ReadOut, Regular};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// What a network learns from: numbered lessons, each drawn anew whenever it is its turn.
pub trait Lessons {
    /// How many there are.
    fn count(&self) -> usize;

    /// Writes lesson `k` as it is to be learned this time.
    fn draw(&self, k: usize, random: &mut dyn Rng, lesson: &mut Lesson);
}

/// One sequence and what it is.
#[derive(Clone, Debug, Default)]
pub struct Lesson {
    /// Inputs, `[steps][inputs]`.
    pub x: Vec<f32>,
    /// True class in each group.
    pub targets: Vec<usize>,
    /// Logarithms of the probabilities before, one per output; only with a prior.
    pub log_prior: Vec<f32>,
}

/// How a network is trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Times every lesson is taken.
    pub epochs: usize,
    /// Lessons per step of the optimiser.
    pub batch: usize,
    /// Highest learning rate of the cycle.
    pub learning_rate: f64,
    /// Share of each weight that decays per step and unit of learning rate.
    pub weight_decay: f64,
    /// Share of the hidden layer that is dropped.
    pub dropout: f32,
    /// Share of each target that is spread over all classes.
    pub smoothing: f32,
    /// Read-outs before the last at which an answer is asked for as well.
    pub early_read_outs: usize,
    /// Share of the loss that those have together.
    pub early_share: f32,
    /// Gradients longer than this are shortened to it.
    pub longest_gradient: f64,
}

/// Share of a run in which the learning rate rises.
const WARM_UP: f64 = 0.3;

impl Training {
    /// Learning rate at a share of the run: up along half a cosine from a 25th, down along another to almost nothing.
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

/// Trains a network from random parameters. `go_on` hears of every epoch with its mean loss, and may end the run.
pub fn train(
    shape: MacroShape,
    lessons: &dyn Lessons,
    training: &Training,
    seed: u64,
    go_on: &mut dyn FnMut(usize, f64) -> bool,
) -> MacroLayer {
    let mut layer = MacroLayer::new(shape, &mut ChaCha8Rng::seed_from_u64(seed));
    train_on(&mut layer, lessons, training, seed ^ 0x7ea1, go_on);
    layer
}

/// Goes on training a network from where it is.
pub fn train_on(
    layer: &mut MacroLayer,
    lessons: &dyn Lessons,
    training: &Training,
    seed: u64,
    go_on: &mut dyn FnMut(usize, f64) -> bool,
) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut pass = Pass::new(layer.shape());
    let mut optimiser = AdamW::new(layer.values().len());
    let mut gradient = vec![0.0; layer.values().len()];
    let (mut batch, mut drawn) = (Batch::default(), vec![Lesson::default(); training.batch.max(1)]);
    let mut order: Vec<usize> = (0..lessons.count()).collect();
    let steps = training.epochs * order.len().div_ceil(training.batch.max(1));
    let regular = Regular { dropout: training.dropout, smoothing: training.smoothing };
    let mut taken = 0;
    for epoch in 0..training.epochs {
        order.shuffle(&mut random);
        let mut sum = 0.0;
        for group in order.chunks(training.batch.max(1)) {
            for (k, lesson) in group.iter().zip(&mut drawn) {
                lessons.draw(*k, &mut random, lesson);
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

/// Lays lessons side by side, time-major, with their read-outs in the order of steps.
fn fill(batch: &mut Batch, lessons: &[Lesson], inputs: usize, training: &Training) {
    let lengths = || lessons.iter().map(|lesson| lesson.x.len() / inputs);
    (batch.steps, batch.sequences) = (lengths().max().unwrap_or(0), lessons.len());
    batch.x.clear();
    batch.x.resize(batch.steps * batch.sequences * inputs, 0.0);
    for (sequence, lesson) in lessons.iter().enumerate() {
        for (step, row) in lesson.x.chunks_exact(inputs).enumerate() {
            let at = (step * batch.sequences + sequence) * inputs;
            batch.x[at..at + inputs].copy_from_slice(row);
        }
    }
    let of_lesson = 1.0 / lessons.len().max(1) as f32;
    batch.read_outs.clear();
    for (sequence, steps) in lengths().enumerate().filter(|(_, steps)| *steps > 0) {
        let early = training.early_read_outs.min(steps - 1);
        let early_share = if early == 0 { 0.0 } else { training.early_share };
        for k in 0..early {
            // Evenly over the whole sequence.
            let step = (k + 1) * steps / (early + 1);
            let weight = of_lesson * early_share / early as f32;
            batch.read_outs.push(ReadOut { step: step.saturating_sub(1), sequence, weight });
        }
        batch.read_outs.push(ReadOut { step: steps - 1, sequence, weight: of_lesson * (1.0 - early_share) });
    }
    batch.read_outs.sort_by_key(|at| at.step);
    batch.targets.clear();
    batch.targets.extend(lessons.iter().flat_map(|lesson| &lesson.targets));
    batch.log_prior.clear();
    batch.log_prior.extend(lessons.iter().flat_map(|lesson| &lesson.log_prior));
}

fn shorten(gradient: &mut [f32], longest: f64) {
    let length = gradient.iter().map(|g| f64::from(*g) * f64::from(*g)).sum::<f64>().sqrt();
    if length > longest {
        let factor = (longest / length) as f32;
        gradient.iter_mut().for_each(|g| *g *= factor);
    }
}

/// Adam with weight decay apart from the gradient (Loshchilov and Hutter 2019), in PyTorch's form.
#[derive(Clone, Debug)]
pub struct AdamW {
    mean: Vec<f32>,
    square: Vec<f32>,
    steps: i32,
}

/// Means that fade away are dropped before they become subnormal, on which processors are slow.
fn audible(x: f32) -> f32 {
    if x.abs() < f32::MIN_POSITIVE { 0.0 } else { x }
}

impl AdamW {
    const MEMORY: f32 = 0.9;
    const SQUARE_MEMORY: f32 = 0.999;
    const EPSILON: f32 = 1e-8;

    /// For so many parameters.
    pub fn new(parameters: usize) -> Self {
        Self { mean: vec![0.0; parameters], square: vec![0.0; parameters], steps: 0 }
    }

    /// Moves values against a gradient.
    pub fn step(&mut self, values: &mut [f32], gradient: &[f32], rate: f64, decay: f64) {
        self.steps += 1;
        let unbias = 1.0 / (1.0 - Self::MEMORY.powi(self.steps));
        let unbias_square = 1.0 / (1.0 - Self::SQUARE_MEMORY.powi(self.steps));
        let (rate, keep) = (rate as f32, 1.0 - (rate * decay) as f32);
        for (((value, g), mean), square) in values.iter_mut().zip(gradient).zip(&mut self.mean).zip(&mut self.square) {
            *mean = audible(Self::MEMORY * *mean + (1.0 - Self::MEMORY) * g);
            *square = audible(Self::SQUARE_MEMORY * *square + (1.0 - Self::SQUARE_MEMORY) * g * g);
            *value = keep * *value - rate * *mean * unbias / ((*square * unbias_square).sqrt() + Self::EPSILON);
        }
    }
}
