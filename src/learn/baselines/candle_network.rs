//! Networks in plain candle: a network is one file that implements [`CandleNetwork`] and one line in the table of methods.
//! Inputs, training, files and answers are the same for all and live here.
//!
//! Every grasp is divided into [`STEPS`] equal steps of the median training grasp. Training draws each grasp or its mirror
//! image with some noise; answers average both views. A last network learns from all grasps; the temperature of its
//! probabilities comes from one that learned without a sixth of them.

use crate::arrays::{Arrays, ModelError};
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::model::ModelCard;
use crate::network::Preparation;
use crate::pmf::Pmf;
use crate::recogniser::{Recogniser, Verdict};
use crate::temperature::{Temperatures, best_temperature};
use candle_core::{DType, Device, Result, Tensor, Var};
use candle_nn::{AdamW, Optimizer as _, ParamsAdamW, VarBuilder, VarMap};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Time steps of the inputs.
pub(super) const STEPS: usize = 30;

/// Network in plain candle.
pub(crate) trait CandleNetwork: Sized + Send + Sync + 'static {
    /// Version of the network and its constants, part of the fingerprint: count it up whenever the code changes.
    const REVISION: u32;
    /// Passes over the training grasps.
    const EPOCHS: usize = 60;
    /// Highest learning rate.
    const RATE: f64 = 2e-3;
    /// Weight decay per unit of learning rate.
    const WEIGHT_DECAY: f64 = 0.05;
    /// Standard deviation of the noise on inputs while training; inputs have unit deviation.
    const NOISE: f32 = 0.15;

    /// Creates the layers. Inputs are `[batch][inputs][STEPS]`, outputs `[batch][classes]`.
    fn new(inputs: usize, classes: usize, variables: &VarBuilder<'_>) -> Result<Self>;

    /// Computes the score of each class.
    fn scores(&self, x: &Tensor, pass: &mut Pass<'_>) -> Result<Tensor>;
}

/// What a forward pass is for: training, with random numbers, or answering.
pub(crate) struct Pass<'a> {
    random: Option<&'a mut ChaCha8Rng>,
    /// Share of values dropped, where the training decides it.
    dropout: Option<f32>,
}

impl Pass<'_> {
    /// The pass of an answer.
    pub(super) fn answering() -> Self {
        Self { random: None, dropout: None }
    }

    /// True while training.
    pub(super) fn is_training(&self) -> bool {
        self.random.is_some()
    }

    /// Sets a share of the values to zero while training, or the share that the training decides. candle's own dropout cannot be seeded on the CPU.
    pub(super) fn dropout(&mut self, x: &Tensor, share: f32) -> Result<Tensor> {
        let share = self.dropout.unwrap_or(share);
        let Some(random) = &mut self.random else { return Ok(x.clone()) };
        let keep = 1.0 / (1.0 - share);
        let mask = (0..x.elem_count()).map(|_| if random.random::<f32>() < share { 0.0 } else { keep });
        x.mul(&Tensor::from_vec(mask.collect::<Vec<f32>>(), x.shape(), &Device::Cpu)?)
    }
}

/// Fitted network in plain candle.
pub(crate) struct Candle<N> {
    learned: Learned,
    classes: usize,
    network: Variables<N>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    preparation: Preparation,
    /// Counterpart of each input on the other finger; `None` if grasps cannot be mirrored.
    mirror: Option<Vec<usize>>,
    revision: u32,
    epochs: usize,
    temperature: f32,
}

/// Sequences per optimiser step.
const BATCH: usize = 32;
/// One in this many grasps is held out for calibration.
const CALIBRATION: usize = 6;
/// Share of the training in which the learning rate rises.
const WARM_UP: f64 = 0.25;
const TEMPERATURES: Temperatures = Temperatures { range: 0.1..=10.0, count: 100 };
/// Version of inputs and training, part of the fingerprint.
const REVISION: u32 = 1;

/// Network with its variables by name.
pub(super) struct Variables<N> {
    pub(super) network: N,
    pub(super) by_name: BTreeMap<String, Var>,
}

impl<N: CandleNetwork> Variables<N> {
    /// Creates a network whose weights are drawn uniformly within one over the root of the fan-in, in the order of their
    /// names; vectors keep the values that their layer gives them.
    pub(super) fn new(inputs: usize, classes: usize, random: &mut ChaCha8Rng) -> Result<Self> {
        let variables = VarMap::new();
        let builder = VarBuilder::from_varmap(&variables, DType::F32, &Device::Cpu);
        let network = N::new(inputs, classes, &builder)?;
        let named = variables.data().lock();
        let named = named.map_err(|_poisoned| candle_core::Error::Msg("the variables are locked".to_owned()))?;
        let by_name: BTreeMap<String, Var> = named.iter().map(|(name, var)| (name.clone(), var.clone())).collect();
        for (name, var) in &by_name {
            if var.dims().len() > 1 {
                let most = 1.0 / (var.dims().iter().skip(1).product::<usize>().max(1) as f32).sqrt();
                let values = (0..var.elem_count()).map(|_| most * (2.0 * random.random::<f32>() - 1.0));
                var.set(&Tensor::from_vec(values.collect::<Vec<f32>>(), var.dims(), &Device::Cpu)?)?;
            } else if name.ends_with("bias") {
                // Linear layers of candle draw their biases from a generator that cannot be seeded.
                var.set(&var.zeros_like()?)?;
            }
        }
        Ok(Self { network, by_name })
    }

    /// Sets the variables to the arrays of a model file, whose names begin with a prefix.
    pub(super) fn read(&self, arrays: &Arrays, prefix: &str) -> std::result::Result<(), ModelError> {
        for (name, var) in &self.by_name {
            let values = arrays.f32s(&format!("{prefix}{name}"), var.dims())?;
            let values = Tensor::from_slice(values, var.dims(), &Device::Cpu);
            values.and_then(|values| var.set(&values)).map_err(ModelError::failed)?;
        }
        Ok(())
    }

    /// The variables as the arrays of a model file.
    pub(super) fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        for (name, var) in &self.by_name {
            // Reading a tensor in the memory of the CPU does not fail.
            let values = var.as_tensor().flatten_all().and_then(|flat| flat.to_vec1()).unwrap_or_default();
            arrays.put(name.clone(), var.dims(), values);
        }
        arrays
    }

    /// Scores of sequences `[inputs][STEPS]`, one class after the other.
    fn scores(&self, sequences: &[&[f32]], width: usize) -> Result<Vec<Vec<f32>>> {
        let x: Vec<f32> = sequences.iter().flat_map(|sequence| sequence.iter().copied()).collect();
        let x = Tensor::from_vec(x, (sequences.len(), width, STEPS), &Device::Cpu)?;
        self.network.scores(&x, &mut Pass::answering())?.to_vec2()
    }
}

impl<N: CandleNetwork> Candle<N> {
    /// Fits the network and its temperature.
    pub(crate) fn fit(data: &Dataset, fitting: &Fitting<'_>) -> std::result::Result<Self, LearnError> {
        check_enough(data, 2)?;
        fitting.refuse_settings()?;
        let duration_s = data.median_duration_s().max(0.05);
        let preparation = Preparation::fit(data, (STEPS as f32 / duration_s).clamp(0.1, 1000.0));
        let mirror = preparation.mirror(&data.channels);
        let epochs = if fitting.quick { N::EPOCHS.div_ceil(2) } else { N::EPOCHS };
        let mut learned = Learned { preparation, mirror, revision: N::REVISION, epochs, temperature: 1.0 };
        let sequences: Vec<Vec<f32>> = data.examples.iter().map(|e| inputs(&learned, &e.grasp)).collect();
        let part_of = data.folds(CALIBRATION, fitting.seed ^ 0xca11b);
        let of = |inside: bool| (0..part_of.len()).filter(|k| (part_of[*k] == 0) == inside).collect::<Vec<usize>>();
        let work = Work { data, learned: &learned, sequences: &sequences, fitting };
        let first: Variables<N> = work.train(&of(false), 0.0).map_err(LearnError::failed)?;
        fitting.check()?;
        let answered: Vec<(Vec<f32>, usize)> = of(true)
            .into_iter()
            .map(|k| Ok((logarithms(&first, &learned, &sequences[k])?, data.examples[k].class)))
            .collect::<Result<_>>()
            .map_err(LearnError::failed)?;
        let answered: Vec<(&[f32], usize)> = answered.iter().map(|(scores, class)| (&scores[..], *class)).collect();
        let temperature = best_temperature(&answered, &TEMPERATURES).0;
        let network = work.train(&of(false).into_iter().chain(of(true)).collect::<Vec<_>>(), 0.5);
        let network = network.map_err(LearnError::failed)?;
        fitting.check()?;
        learned.temperature = temperature as f32;
        Ok(Self { learned, classes: data.labels.classes.len(), network })
    }

    /// Everything that decides a fit, besides the data, the seed and the options of the fit.
    pub(crate) fn decided_by() -> serde_json::Value {
        serde_json::json!({
            "revisions": [REVISION, N::REVISION],
            "training": [N::EPOCHS as f64, N::RATE, N::WEIGHT_DECAY, f64::from(N::NOISE), BATCH as f64],
        })
    }

    /// Restores a recogniser from a model file.
    pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> std::result::Result<Self, ModelError> {
        let learned: Learned = card.settings_as()?;
        if learned.revision != N::REVISION {
            return Err(ModelError::card("the version of the network"));
        }
        if !learned.preparation.is_sound(card.channels.len()) {
            return Err(ModelError::card("the input scaling"));
        }
        let width = learned.preparation.width();
        let is_place = |to: &usize| *to < width;
        if !learned.mirror.as_ref().is_none_or(|m| m.len() == width && m.iter().all(is_place)) {
            return Err(ModelError::card("the mirror image"));
        }
        if !TEMPERATURES.allows(learned.temperature) {
            return Err(ModelError::card("the temperature"));
        }
        let (classes, mut random) = (card.labels.classes.len(), ChaCha8Rng::seed_from_u64(0));
        let network = Variables::<N>::new(width, classes, &mut random).map_err(ModelError::failed)?;
        network.read(arrays, "")?;
        Ok(Self { learned, classes, network })
    }
}

/// Inputs of a grasp, `[inputs][STEPS]`, truncated or padded with the last step.
fn inputs(learned: &Learned, grasp: &Sequence) -> Vec<f32> {
    let width = learned.preparation.width();
    let rows = learned.preparation.inputs(grasp);
    let last = (rows.len() / width.max(1)).checked_sub(1);
    let at = |step: usize, input: usize| last.map_or(0.0, |last| rows[step.min(last) * width + input]);
    (0..width).flat_map(|input| (0..STEPS).map(move |step| at(step, input))).collect()
}

/// The same inputs with left and right exchanged.
pub(super) fn mirrored(mirror: &[usize], own: &[f32]) -> Vec<f32> {
    mirror.iter().flat_map(|from| own[from * STEPS..(from + 1) * STEPS].iter().copied()).collect()
}

/// Logarithms of the probabilities, not calibrated: means over both views.
fn logarithms<N: CandleNetwork>(network: &Variables<N>, learned: &Learned, own: &[f32]) -> Result<Vec<f32>> {
    let width = learned.preparation.width();
    let other = learned.mirror.as_ref().map(|mirror| mirrored(mirror, own));
    let views: Vec<&[f32]> = std::iter::once(own).chain(other.as_deref()).collect();
    let views: Vec<Pmf> =
        network.scores(&views, width)?.into_iter().map(|s| Pmf::from_scores(s.into_iter().map(f64::from))).collect();
    let share = 1.0 / views.len() as f32;
    let mut sums = vec![0.0; views.first().map_or(0, Pmf::classes)];
    for view in &views {
        sums.iter_mut().zip(view.logarithms()).for_each(|(sum, log)| *sum += share * log as f32);
    }
    Ok(sums)
}

/// Training data of a fit.
struct Work<'a> {
    data: &'a Dataset,
    learned: &'a Learned,
    sequences: &'a [Vec<f32>],
    fitting: &'a Fitting<'a>,
}

impl Work<'_> {
    /// Trains on some of the grasps. Progress goes on from `start` by a half.
    fn train<N: CandleNetwork>(&self, grasps: &[usize], start: f64) -> Result<Variables<N>> {
        let Self { data, learned, sequences, fitting } = *self;
        let width = learned.preparation.width();
        let batch = |group: &[usize], random: &mut ChaCha8Rng| {
            let mut x = Vec::with_capacity(group.len() * width * STEPS);
            for k in group {
                match learned.mirror.as_ref().filter(|_| random.random::<bool>()) {
                    Some(mirror) => x.extend(mirrored(mirror, &sequences[*k])),
                    None => x.extend_from_slice(&sequences[*k]),
                }
            }
            add_noise(&mut x, N::NOISE, random);
            x
        };
        let loss = |scores: &Tensor, group: &[usize]| {
            let y: Vec<u32> = group.iter().map(|k| data.examples[*k].class as u32).collect();
            candle_nn::loss::cross_entropy(scores, &Tensor::from_vec(y, group.len(), &Device::Cpu)?)
        };
        let progress = |share: f64| (fitting.progress)(start + 0.5 * share);
        let classes = data.labels.classes.len();
        let size = (width, classes);
        let training = Training {
            size,
            sequences: grasps,
            epochs: learned.epochs,
            rate: N::RATE,
            dropout: None,
            start: None,
            batch: &batch,
            loss: &loss,
            progress: &progress,
        };
        Variables::trained(&training, fitting)
    }
}

/// What a network is trained on, and how.
pub(super) struct Training<'a> {
    /// Numbers of inputs and of outputs.
    pub(super) size: (usize, usize),
    /// Indices of the sequences.
    pub(super) sequences: &'a [usize],
    /// Passes over them.
    pub(super) epochs: usize,
    /// Highest learning rate.
    pub(super) rate: f64,
    /// Share of values dropped, where it is not the network's own.
    pub(super) dropout: Option<f32>,
    /// Variables to start from, where name and form are the same.
    pub(super) start: Option<&'a Arrays>,
    /// Draws inputs for some sequences, `[batch][inputs][STEPS]`.
    pub(super) batch: &'a dyn Fn(&[usize], &mut ChaCha8Rng) -> Vec<f32>,
    /// Computes the loss of the outputs for the same sequences.
    pub(super) loss: &'a dyn Fn(&Tensor, &[usize]) -> Result<Tensor>,
    /// Called with the share of work done, 0 to 1.
    pub(super) progress: &'a dyn Fn(f64),
}

impl<N: CandleNetwork> Variables<N> {
    /// Trains a new network. Ends early, with what it has learned so far, if the fit is stopped.
    pub(super) fn trained(training: &Training<'_>, fitting: &Fitting<'_>) -> Result<Self> {
        let &Training { size: (inputs, outputs), sequences, epochs, rate, dropout, start, batch, loss, progress } =
            training;
        let mut random = ChaCha8Rng::seed_from_u64(fitting.seed);
        let network = Self::new(inputs, outputs, &mut random)?;
        for (name, var) in &network.by_name {
            if let Some(Ok(values)) = start.map(|start| start.f32s(name, var.dims())) {
                var.set(&Tensor::from_slice(values, var.dims(), &Device::Cpu)?)?;
            }
        }
        let settings = ParamsAdamW { lr: rate, weight_decay: N::WEIGHT_DECAY, ..ParamsAdamW::default() };
        let mut optimiser = AdamW::new(network.by_name.values().cloned().collect(), settings)?;
        let mut order = sequences.to_vec();
        let size = batch_size(order.len());
        let batches = (order.len().div_ceil(size).max(1) * epochs) as f64;
        let mut done = 0;
        for epoch in 0..epochs {
            order.shuffle(&mut random);
            for group in order.chunks(size) {
                let x = Tensor::from_vec(batch(group, &mut random), (group.len(), inputs, STEPS), &Device::Cpu)?;
                let scores = network.network.scores(&x, &mut Pass { random: Some(&mut random), dropout })?;
                optimiser.set_learning_rate(rate * one_cycle(f64::from(done) / batches));
                optimiser.backward_step(&loss(&scores, group)?)?;
                done += 1;
            }
            progress((epoch + 1) as f64 / epochs as f64);
            if fitting.check().is_err() {
                break;
            }
        }
        Ok(network)
    }
}

/// Adds noise of a deviation. Uniform noise of unit deviation reaches to the root of three.
pub(super) fn add_noise(x: &mut [f32], deviation: f32, random: &mut ChaCha8Rng) {
    x.iter_mut().for_each(|x| *x += deviation * 3.0_f32.sqrt() * (2.0 * random.random::<f32>() - 1.0));
}

/// Number of sequences per optimiser step, for steps of nearly equal size. No step has one sequence alone, which
/// normalisation over a batch would divide by zero.
fn batch_size(sequences: usize) -> usize {
    let steps = sequences.div_ceil(BATCH).max(1);
    let mut size = sequences.div_ceil(steps).max(1);
    while sequences > 1 && sequences % size == 1 {
        size += 1;
    }
    size
}

/// Share of the highest learning rate at a share of the training: half a cosine up, another down.
fn one_cycle(share: f64) -> f64 {
    let half_cosine = |from: f64, to: f64, x: f64| from + (to - from) * 0.5 * (1.0 - (PI * x).cos());
    if share < WARM_UP {
        half_cosine(0.04, 1.0, share / WARM_UP)
    } else {
        half_cosine(1.0, 1e-4, (share - WARM_UP) / (1.0 - WARM_UP))
    }
}

impl<N: CandleNetwork> Recogniser for Candle<N> {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let temperature = f64::from(self.learned.temperature);
        let calibrated = |logs: Vec<f32>| Pmf::from_scores(logs.into_iter().map(|log| f64::from(log) / temperature));
        let logarithms = logarithms(&self.network, &self.learned, &inputs(&self.learned, grasp));
        // Shapes were checked when the network was made, so that no grasp should make it fail.
        let pmf = logarithms.map_or_else(|_failed| Pmf::uniform(self.classes), calibrated);
        Verdict { pmf: before.map_or_else(|| pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        self.network.arrays()
    }

    fn parameters(&self) -> usize {
        self.network.by_name.values().map(|var| var.elem_count()).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::guide_network::Perceptron;
    use super::*;
    use crate::conformance_tests::{made_up, quick};

    #[test]
    fn no_step_has_one_sequence_alone() {
        assert_eq!((batch_size(992), batch_size(993)), (32, 33));
        assert_eq!([0, 1, 2, 33, 64, 65].map(batch_size), [1, 1, 2, 17, 32, 22]);
        assert!((2..5000).all(|sequences| sequences % batch_size(sequences) != 1));
    }

    #[test]
    fn the_network_of_the_guide_is_as_printed_and_learns() {
        let guide = include_str!("../../../assets/help/contributing.md");
        let source = include_str!("guide_network.rs");
        let code = source.split_once("\n\n").map_or(source, |(_, code)| code);
        assert!(guide.contains(&format!("```rust,ignore\n{code}```")), "{code}");
        let (train, test) = (made_up(12, 1), made_up(6, 2));
        let network = Candle::<Perceptron>::fit(&train, &quick(1)).expect("fits");
        let right = test.examples.iter().filter(|e| network.recognise(&e.grasp, None).pmf.top().0 == e.class).count();
        assert!(right as f64 > 0.8 * test.examples.len() as f64, "{right} of {}", test.examples.len());
        // A network that does not fit its inputs knows nothing.
        let broken = Variables::new(1, 4, &mut ChaCha8Rng::seed_from_u64(1)).expect("has layers");
        let broken = Candle::<Perceptron> { network: broken, ..network };
        assert_eq!(broken.recognise(&test.examples[0].grasp, None).pmf, Pmf::uniform(4));
    }
}
