//! The paper's recurrent macro-layer (Fig. 2a): LSTM, fully connected, dropout, fully connected, softmax. Without the
//! first fully connected layer it is the four-layer network of Zuo et al. that the paper builds on.
//!
//! Outputs can be read after any step, so the same network serves during closing and at the end. Outputs may form
//! several groups, each with its own softmax: size and shape in stage one. For iterated recognition, the logarithms of
//! prior probabilities can be added to the outputs through a learned gain, so that the network starts as the product of
//! experts and learns corrections.

use super::gates;
use super::gemm::{Matrix, multiply};
use super::lstm::{LiveLstm, LiveState, LstmGradients, LstmWeights, LstmWorkspace};
use crate::arrays::{Arrays, ModelError};
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Shape of a macro-layer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MacroShape {
    /// Values per step.
    pub inputs: usize,
    /// LSTM units.
    pub units: usize,
    /// Width of the first fully connected layer; `None` in Zuo's network.
    pub hidden: Option<usize>,
    /// Outputs in each group; each group is a PMF.
    pub groups: Vec<usize>,
    /// True if log prior probabilities are added to the outputs.
    pub with_prior: bool,
}

/// Named block of parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Name, as in files.
    pub name: &'static str,
    /// Shape, row-major.
    pub shape: Vec<usize>,
    /// Range among all parameters.
    pub place: Range<usize>,
}

impl MacroShape {
    /// Number of outputs: the sum of the groups.
    pub fn outputs(&self) -> usize {
        self.groups.iter().sum()
    }

    /// Blocks of parameters, in memory order.
    pub fn blocks(&self) -> Vec<Block> {
        let (gates, outputs) = (4 * self.units, self.outputs());
        let mut parts = vec![
            ("lstm.weight_ih", vec![gates, self.inputs]),
            ("lstm.weight_hh", vec![gates, self.units]),
            ("lstm.bias", vec![gates]),
        ];
        if let Some(hidden) = self.hidden {
            parts.extend([("fc1.weight", vec![hidden, self.units]), ("fc1.bias", vec![hidden])]);
        }
        let last = self.hidden.unwrap_or(self.units);
        parts.extend([("fc2.weight", vec![outputs, last]), ("fc2.bias", vec![outputs])]);
        if self.with_prior {
            parts.push(("prior.gain", vec![1]));
        }
        let mut end = 0;
        parts
            .into_iter()
            .map(|(name, shape)| {
                let start = end;
                end += shape.iter().product::<usize>();
                Block { name, shape, place: start..end }
            })
            .collect()
    }

    /// True if a shape from a file has these inputs and groups of outputs, and a reasonable size.
    pub(super) fn fits(&self, inputs: usize, groups: &[usize]) -> bool {
        self.inputs == inputs
            && self.groups == groups
            && (1..=4096).contains(&self.units)
            && self.hidden.is_none_or(|hidden| (1..=4096).contains(&hidden))
            && groups.iter().all(|classes| *classes > 0)
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.blocks().last().map_or(0, |block| block.place.end)
    }
}

/// Macro-layer with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct MacroLayer {
    shape: MacroShape,
    blocks: Vec<Block>,
    values: Vec<f32>,
}

/// Batch of sequences with the places of their outputs.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Inputs, `[steps][sequences][inputs]`; shorter sequences are padded with any finite values.
    pub x: Vec<f32>,
    /// Steps of the longest sequence.
    pub steps: usize,
    /// Number of sequences.
    pub sequences: usize,
    /// Places of the outputs, in the order of steps.
    pub read_outs: Vec<ReadOut>,
    /// True class per sequence and group, `[sequences][groups]`; only for training.
    pub targets: Vec<usize>,
    /// Logarithms of the probabilities before, `[sequences][outputs]`; only with a prior.
    pub log_prior: Vec<f32>,
}

/// One place at which a batch is read out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadOut {
    /// After which step.
    pub step: usize,
    /// Of which sequence.
    pub sequence: usize,
    /// Its share in the loss; shares of a batch sum to one.
    pub weight: f32,
}

/// Regularisation of a training step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regular {
    /// Share of the first fully connected layer's outputs that is dropped.
    pub dropout: f32,
    /// Share of each target that is spread over all classes of its group.
    pub smoothing: f32,
}

/// Scratch memory of forward and backward passes.
#[derive(Clone, Debug)]
pub struct Pass {
    lstm: LstmWorkspace,
    /// Hidden states at the read-outs, `[read-outs][units]`.
    read: Vec<f32>,
    d_read: Vec<f32>,
    /// Outputs of the first fully connected layer, `[read-outs][hidden]`.
    hidden: Vec<f32>,
    d_hidden: Vec<f32>,
    /// Factor of each of them: zero, or that of dropout.
    mask: Vec<f32>,
    /// Scores, then their gradients, `[read-outs][outputs]`.
    scores: Vec<f32>,
}

impl Pass {
    /// Creates scratch memory for networks of one shape.
    pub fn new(shape: &MacroShape) -> Self {
        let none = Vec::new;
        Self {
            lstm: LstmWorkspace::new(shape.inputs, shape.units),
            read: none(),
            d_read: none(),
            hidden: none(),
            d_hidden: none(),
            mask: none(),
            scores: none(),
        }
    }

    /// Scores (logits) of the last forward pass, `[read-outs][outputs]`.
    pub fn scores(&self) -> &[f32] {
        &self.scores
    }

    /// Number of subnormal gradients of the last backward pass.
    #[cfg(test)]
    pub(super) fn subnormal_gradients(&self) -> usize {
        self.lstm.subnormal_gradients()
    }
}

impl MacroLayer {
    /// Creates random parameters: uniform within one over the root of the fan-in, as in PyTorch, plus one on the biases of
    /// the forget gates, which preserves gradients over long sequences.
    pub fn new(shape: MacroShape, random: &mut impl Rng) -> Self {
        let blocks = shape.blocks();
        let mut values = vec![0.0; shape.parameters()];
        for block in &blocks {
            let fan_in = match block.name {
                "lstm.weight_ih" | "lstm.weight_hh" | "lstm.bias" | "fc1.weight" | "fc1.bias" => shape.units,
                _ => shape.hidden.unwrap_or(shape.units),
            };
            let most = 1.0 / (fan_in as f32).sqrt();
            values[block.place.clone()].fill_with(|| most * (2.0 * random.random::<f32>() - 1.0));
            match block.name {
                "lstm.bias" => {
                    let forget = block.place.start + shape.units..block.place.start + 2 * shape.units;
                    values[forget].iter_mut().for_each(|b| *b += 1.0);
                }
                "prior.gain" => values[block.place.clone()].fill(1.0),
                _ => {}
            }
        }
        Self { shape, blocks, values }
    }

    /// Sets the biases of the gates for memories of one to `longest` steps, spread uniformly over the units: a gate with bias
    /// b and inputs of mean zero forgets a share 1 - sigmoid(b) per step (chrono initialisation, Tallec and Ollivier, ICLR
    /// 2018, eq. 16).
    pub fn remember(&mut self, longest: usize, random: &mut impl Rng) {
        let units = self.shape.units;
        let Some(bias) = self.blocks.iter().find(|block| block.name == "lstm.bias").map(|block| block.place.clone())
        else {
            return;
        };
        let longest = longest.max(3) as f32;
        for unit in 0..units {
            let memory = ((longest - 2.0) * random.random::<f32>()).ln_1p();
            self.values[bias.start + unit] = -memory;
            self.values[bias.start + units + unit] = memory;
        }
    }

    /// Creates a macro-layer from parameters in the order of [`MacroShape::blocks`]; `None` if their number is wrong or one
    /// is not finite.
    pub fn from_values(shape: MacroShape, values: Vec<f32>) -> Option<Self> {
        let fits = values.len() == shape.parameters() && values.iter().all(|v| v.is_finite());
        fits.then(|| Self { blocks: shape.blocks(), shape, values })
    }

    /// Restores a layer from the arrays of a model file, which begin with its name.
    pub(super) fn load(shape: &MacroShape, name: &str, arrays: &Arrays) -> Result<Self, ModelError> {
        let mut values = Vec::new();
        for block in shape.blocks() {
            values.extend(arrays.f32s(&format!("{name}.{}", block.name), &block.shape)?);
        }
        Self::from_values(shape.clone(), values).ok_or_else(|| ModelError::card("the shape of the network"))
    }

    /// Adds the layer to the arrays of a model file.
    pub(super) fn save(&self, name: &str, arrays: &mut Arrays) {
        for block in &self.blocks {
            arrays.put(format!("{name}.{}", block.name), &block.shape, self.values[block.place.clone()].to_vec());
        }
    }

    /// Adds inputs with zero weights.
    pub fn with_inputs(&self, more: usize) -> Self {
        let shape = MacroShape { inputs: self.shape.inputs + more, ..self.shape.clone() };
        let mut values = Vec::with_capacity(shape.parameters());
        for row in self.block("lstm.weight_ih").chunks_exact(self.shape.inputs) {
            values.extend_from_slice(row);
            values.extend(std::iter::repeat_n(0.0, more));
        }
        values.extend(self.blocks.iter().skip(1).flat_map(|block| &self.values[block.place.clone()]));
        Self { blocks: shape.blocks(), shape, values }
    }

    /// Adds a prior with a gain to the outputs.
    pub fn with_prior(&self, gain: f32) -> Self {
        let shape = MacroShape { with_prior: true, ..self.shape.clone() };
        let values = self.values.iter().copied().chain([gain]).collect();
        Self { blocks: shape.blocks(), shape, values }
    }

    /// Shape.
    pub fn shape(&self) -> &MacroShape {
        &self.shape
    }

    /// All parameters, in the order of [`MacroShape::blocks`].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// All parameters, mutable, for an optimiser.
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }

    fn block(&self, name: &str) -> &[f32] {
        let block = self.blocks.iter().find(|b| b.name == name);
        block.map_or(&[], |b| &self.values[b.place.clone()])
    }

    fn lstm_weights(&self) -> LstmWeights<'_> {
        LstmWeights { w: self.block("lstm.weight_ih"), u: self.block("lstm.weight_hh"), b: self.block("lstm.bias") }
    }

    /// Runs a batch forward and leaves the scores in `pass`; `dropout` is a share and its random generator.
    fn forward(&self, batch: &Batch, dropout: Option<(f32, &mut dyn Rng)>, pass: &mut Pass) {
        let (shape, count) = (&self.shape, batch.read_outs.len());
        pass.lstm.forward(self.lstm_weights(), &batch.x, batch.steps, batch.sequences);
        pass.read.clear();
        for at in &batch.read_outs {
            let states = pass.lstm.hidden(at.step);
            pass.read.extend_from_slice(&states[at.sequence * shape.units..(at.sequence + 1) * shape.units]);
        }
        let (last, width) = match shape.hidden {
            Some(hidden) => {
                fill_rows(&mut pass.hidden, self.block("fc1.bias"), count);
                let weights = Matrix::new(self.block("fc1.weight"), hidden, shape.units).t();
                multiply(Matrix::new(&pass.read, count, shape.units), weights, 1.0, &mut pass.hidden);
                (&mut pass.hidden, hidden)
            }
            None => {
                pass.hidden.clone_from(&pass.read);
                (&mut pass.hidden, shape.units)
            }
        };
        pass.mask.clear();
        pass.mask.resize(last.len(), 1.0);
        if let Some((share, random)) = dropout {
            let keep = 1.0 / (1.0 - share);
            pass.mask.fill_with(|| if random.random::<f32>() < share { 0.0 } else { keep });
        }
        for (value, factor) in last.iter_mut().zip(&mut pass.mask) {
            // ReLU of the first fully connected layer.
            if shape.hidden.is_some() && *value <= 0.0 {
                *factor = 0.0;
            }
            *value *= *factor;
        }
        let outputs = shape.outputs();
        fill_rows(&mut pass.scores, self.block("fc2.bias"), count);
        let weights = Matrix::new(self.block("fc2.weight"), outputs, width).t();
        multiply(Matrix::new(last, count, width), weights, 1.0, &mut pass.scores);
        if let [gain] = self.block("prior.gain") {
            for (row, at) in pass.scores.chunks_exact_mut(outputs).zip(&batch.read_outs) {
                let prior = &batch.log_prior[at.sequence * outputs..(at.sequence + 1) * outputs];
                row.iter_mut().zip(prior).for_each(|(score, log)| *score += gain * log);
            }
        }
    }

    /// Computes the scores (logits) at the read-outs of a batch, `[read-outs][outputs]`, and leaves them in `pass`.
    pub fn score(&self, batch: &Batch, pass: &mut Pass) {
        self.forward(batch, None, pass);
    }

    /// Computes the weighted cross-entropy of a batch; overwrites `gradient` with its gradient for all parameters.
    pub fn loss(
        &self,
        batch: &Batch,
        regular: Regular,
        random: &mut dyn Rng,
        gradient: &mut [f32],
        pass: &mut Pass,
    ) -> f64 {
        let dropout = (regular.dropout > 0.0).then_some((regular.dropout, random));
        self.forward(batch, dropout, pass);
        let loss = self.score_gradients(batch, regular.smoothing, pass);
        let (shape, count, outputs) = (&self.shape, batch.read_outs.len(), self.shape.outputs());
        let mut parts = split(gradient, &self.blocks);
        if shape.with_prior {
            let mut of_gain = 0.0;
            for (row, at) in pass.scores.chunks_exact(outputs).zip(&batch.read_outs) {
                let prior = &batch.log_prior[at.sequence * outputs..(at.sequence + 1) * outputs];
                of_gain += row.iter().zip(prior).map(|(d, log)| d * log).sum::<f32>();
            }
            parts.of("prior.gain")[0] = of_gain;
        }
        let width = shape.hidden.unwrap_or(shape.units);
        let d_scores = Matrix::new(&pass.scores, count, outputs);
        multiply(d_scores.t(), Matrix::new(&pass.hidden, count, width), 0.0, parts.of("fc2.weight"));
        sum_rows(&pass.scores, parts.of("fc2.bias"));
        pass.d_hidden.resize(count * width, 0.0);
        multiply(d_scores, Matrix::new(self.block("fc2.weight"), outputs, width), 0.0, &mut pass.d_hidden);
        pass.d_hidden.iter_mut().zip(&pass.mask).for_each(|(d, factor)| *d *= factor);
        if let Some(hidden) = shape.hidden {
            let d_hidden = Matrix::new(&pass.d_hidden, count, hidden);
            multiply(d_hidden.t(), Matrix::new(&pass.read, count, shape.units), 0.0, parts.of("fc1.weight"));
            sum_rows(&pass.d_hidden, parts.of("fc1.bias"));
            pass.d_read.resize(count * shape.units, 0.0);
            let weights = Matrix::new(self.block("fc1.weight"), hidden, shape.units);
            multiply(d_hidden, weights, 0.0, &mut pass.d_read);
        } else {
            std::mem::swap(&mut pass.d_read, &mut pass.d_hidden);
        }
        let [w, u, b] = ["lstm.weight_ih", "lstm.weight_hh", "lstm.bias"].map(|name| parts.take(name));
        let (units, d_read) = (shape.units, &pass.d_read);
        // Read-outs are sorted by step and visited from the last.
        let mut left = batch.read_outs.len();
        let read_out = |step: usize, dh: &mut [f32]| {
            while left > 0 && batch.read_outs[left - 1].step == step {
                left -= 1;
                let to = &mut dh[batch.read_outs[left].sequence * units..][..units];
                to.iter_mut().zip(&d_read[left * units..]).for_each(|(sum, d)| *sum += d);
            }
        };
        pass.lstm.backward(self.lstm_weights(), &batch.x, read_out, &mut LstmGradients { w, u, b });
        loss
    }

    /// Replaces the scores by the gradient of the loss with respect to them.
    fn score_gradients(&self, batch: &Batch, smoothing: f32, pass: &mut Pass) -> f64 {
        debug_assert!(batch.read_outs.is_sorted_by_key(|at| at.step));
        let groups = &self.shape.groups;
        let mut loss = 0.0;
        for (row, at) in pass.scores.chunks_exact_mut(self.shape.outputs()).zip(&batch.read_outs) {
            let mut row = row;
            for (group, &classes) in groups.iter().enumerate() {
                let (scores, rest) = row.split_at_mut(classes);
                row = rest;
                let target = batch.targets[at.sequence * groups.len() + group];
                let highest = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                let log_sum = highest + scores.iter().map(|s| gates::exp(s - highest)).sum::<f32>().ln();
                let spread = smoothing / classes as f32;
                for (class, score) in scores.iter_mut().enumerate() {
                    let wanted = spread + if class == target { 1.0 - smoothing } else { 0.0 };
                    loss += f64::from(at.weight * wanted * (log_sum - *score));
                    *score = at.weight * (gates::exp(*score - log_sum) - wanted);
                }
            }
        }
        loss
    }
}

fn fill_rows(rows: &mut Vec<f32>, row: &[f32], count: usize) {
    rows.clear();
    for _ in 0..count {
        rows.extend_from_slice(row);
    }
}

fn sum_rows(rows: &[f32], sums: &mut [f32]) {
    sums.fill(0.0);
    for row in rows.chunks_exact(sums.len()) {
        sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
    }
}

/// Flat gradient split into its named blocks.
struct Parts<'a>(Vec<(&'static str, &'a mut [f32])>);

fn split<'a>(mut flat: &'a mut [f32], blocks: &[Block]) -> Parts<'a> {
    let mut parts = Vec::new();
    for block in blocks {
        let (part, rest) = flat.split_at_mut(block.place.len());
        parts.push((block.name, part));
        flat = rest;
    }
    Parts(parts)
}

impl<'a> Parts<'a> {
    fn of(&mut self, name: &str) -> &mut [f32] {
        self.0.iter_mut().find(|(n, _)| *n == name).map_or(&mut [], |(_, part)| part)
    }

    fn take(&mut self, name: &str) -> &'a mut [f32] {
        let found = self.0.iter_mut().find(|(n, _)| *n == name);
        found.map_or(&mut [], |(_, part)| std::mem::take(part))
    }
}

/// Macro-layer that takes one sample at a time; a step allocates nothing.
#[derive(Clone, Debug)]
pub struct LiveMacroLayer {
    shape: MacroShape,
    lstm: LiveLstm,
    state: LiveState,
    /// `[units][hidden]`
    w1: Vec<f32>,
    b1: Vec<f32>,
    /// `[hidden][outputs]`
    w2: Vec<f32>,
    b2: Vec<f32>,
    gain: f32,
    hidden: Vec<f32>,
    scores: Vec<f32>,
}

impl LiveMacroLayer {
    /// Prepares for the first sample of a sequence.
    pub fn new(layer: &MacroLayer) -> Self {
        let shape = layer.shape.clone();
        let lstm = LiveLstm::new(layer.lstm_weights(), shape.inputs, shape.units);
        let transposed = |name: &str, columns: usize| -> Vec<f32> {
            let from = layer.block(name);
            (0..columns).flat_map(|j| from.iter().skip(j).step_by(columns).copied()).collect()
        };
        Self {
            state: lstm.start(),
            lstm,
            w1: transposed("fc1.weight", shape.units),
            b1: layer.block("fc1.bias").to_vec(),
            w2: transposed("fc2.weight", shape.hidden.unwrap_or(shape.units)),
            b2: layer.block("fc2.bias").to_vec(),
            gain: layer.block("prior.gain").first().copied().unwrap_or(0.0),
            hidden: vec![0.0; shape.hidden.unwrap_or(shape.units)],
            scores: vec![0.0; shape.outputs()],
            shape,
        }
    }

    /// Returns to the start of a sequence.
    pub fn reset(&mut self) {
        self.state.reset();
    }

    /// Takes one sample of all inputs; returns the scores (logits), one per output. `log_prior` has one value per output,
    /// or is empty.
    pub fn step(&mut self, x: &[f32], log_prior: &[f32]) -> &[f32] {
        self.lstm.step(&mut self.state, x);
        if self.shape.hidden.is_some() {
            self.hidden.copy_from_slice(&self.b1);
            gates::add_row_product(self.state.hidden(), &self.w1, &mut self.hidden);
            self.hidden.iter_mut().for_each(|v| *v = v.max(0.0));
        } else {
            self.hidden.copy_from_slice(self.state.hidden());
        }
        self.scores.copy_from_slice(&self.b2);
        gates::add_row_product(&self.hidden, &self.w2, &mut self.scores);
        for (score, log) in self.scores.iter_mut().zip(log_prior) {
            *score += self.gain * log;
        }
        &self.scores
    }
}
