//! A small convolutional network over time in plain candle, without our LSTM kernel: a template for a user's own
//! network.

use crate::arrays::{Array, Arrays, Numbers};
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::mirror::mirror;
use crate::model::{LoadError, ModelCard};
use crate::network::Preparation;
use crate::pmf::Pmf;
use crate::recogniser::{Recogniser, Verdict};
use candle_core::{DType, Device, Result, Tensor};
use candle_nn::{AdamW, Conv1d, Conv1dConfig, Linear, Module as _, Optimizer as _, ParamsAdamW, VarBuilder, VarMap};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// Two convolutions over time, the mean over time, and a linear layer.
pub(crate) struct Convolution {
    learned: Learned,
    arrays: Arrays,
    network: Network,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    preparation: Preparation,
    channels: usize,
    steps: usize,
    epochs: usize,
}

/// Input rate (Hz).
const RATE_HZ: f32 = 8.0;
/// Channels of both convolutions.
const CHANNELS: usize = 48;
/// Width of both kernels (steps).
const KERNEL: usize = 5;
/// Steps that are averaged before the linear layer.
const POOL: usize = 4;
const EPOCHS: usize = 120;
const BATCH: usize = 32;
/// Learning rate at the start.
const RATE: f64 = 3e-3;

struct Network {
    first: Conv1d,
    second: Conv1d,
    last: Linear,
}

impl Network {
    fn new(inputs: usize, steps: usize, classes: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        let same = Conv1dConfig { padding: KERNEL / 2, ..Conv1dConfig::default() };
        Ok(Self {
            first: candle_nn::conv1d(inputs, CHANNELS, KERNEL, same, variables.pp("first"))?,
            second: candle_nn::conv1d(CHANNELS, CHANNELS, KERNEL, same, variables.pp("second"))?,
            last: candle_nn::linear(CHANNELS * (steps / POOL).max(1), classes, variables.pp("last"))?,
        })
    }

    /// Scores `[batch][classes]` of sequences `[batch][inputs][steps]`.
    fn forward(&self, x: &Tensor) -> Result<Tensor> {
        let (batch, _, steps) = x.dims3()?;
        let x = self.first.forward(x)?.relu()?;
        let x = self.second.forward(&x)?.relu()?;
        // Means over four steps keep the order of events.
        let stretches = (steps / POOL).max(1);
        let length = steps.min(POOL);
        let x = x.narrow(2, 0, stretches * length)?.reshape((batch, CHANNELS, stretches, length))?.mean(3)?;
        self.last.forward(&x.flatten_from(1)?)
    }
}

impl Convolution {
    /// Fits the network.
    pub(crate) fn fit(data: &Dataset, fitting: &Fitting<'_>) -> std::result::Result<Self, LearnError> {
        check_enough(data, 2)?;
        fitting.refuse_settings()?;
        let preparation = Preparation::fit(data, RATE_HZ);
        let mut lengths: Vec<usize> =
            data.examples.iter().map(|e| preparation.inputs(&e.grasp).len() / preparation.width().max(1)).collect();
        lengths.sort_unstable();
        let steps = lengths[lengths.len() / 2].max(1);
        let epochs = if fitting.quick { EPOCHS / 6 } else { EPOCHS };
        let learned = Learned { preparation, channels: CHANNELS, steps, epochs };
        let arrays = train(data, &learned, fitting).map_err(LearnError::failed)?;
        fitting.check()?;
        Self::assemble(learned, arrays, data.labels.classes.len()).map_err(LearnError::failed)
    }

    /// Restores a recogniser from a model file.
    pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> std::result::Result<Self, LoadError> {
        let learned: Learned = card.settings_as()?;
        if !learned.preparation.is_sound(card.channels.len()) {
            return Err(LoadError::Card { part: "the input scaling" });
        }
        if learned.channels != CHANNELS || !(1..=100_000).contains(&learned.steps) {
            return Err(LoadError::Card { part: "the size of the network" });
        }
        let classes = card.labels.classes.len();
        let mut known = Arrays::default();
        for (name, shape) in shapes(&learned, classes) {
            known.put(name, &shape, arrays.f32s(name, &shape)?.to_vec());
        }
        Self::assemble(learned, known, classes).map_err(|error| LoadError::Failed { cause: error.to_string() })
    }

    fn assemble(learned: Learned, arrays: Arrays, classes: usize) -> Result<Self> {
        let tensor = |(name, array): (&String, &Array)| match &array.numbers {
            Numbers::F32(values) => {
                Ok((name.clone(), Tensor::from_slice(values, array.shape.as_slice(), &Device::Cpu)?))
            }
            Numbers::F64(_) | Numbers::I64(_) => Err(candle_core::Error::Msg(format!("array {name} is not f32"))),
        };
        let tensors = arrays.0.iter().map(tensor).collect::<Result<HashMap<String, Tensor>>>()?;
        let variables = VarBuilder::from_tensors(tensors, DType::F32, &Device::Cpu);
        let network = Network::new(learned.preparation.width(), learned.steps, classes, &variables)?;
        Ok(Self { learned, arrays, network })
    }

    fn scores(&self, grasp: &Sequence) -> Result<Vec<f32>> {
        let inputs = fixed_length(&self.learned, grasp);
        let x = Tensor::from_vec(inputs, (1, self.learned.preparation.width(), self.learned.steps), &Device::Cpu)?;
        self.network.forward(&x)?.flatten_all()?.to_vec1()
    }
}

/// Name and shape of every parameter.
fn shapes(learned: &Learned, classes: usize) -> [(&'static str, Vec<usize>); 6] {
    [
        ("first.weight", vec![CHANNELS, learned.preparation.width(), KERNEL]),
        ("first.bias", vec![CHANNELS]),
        ("second.weight", vec![CHANNELS, CHANNELS, KERNEL]),
        ("second.bias", vec![CHANNELS]),
        ("last.weight", vec![classes, CHANNELS * (learned.steps / POOL).max(1)]),
        ("last.bias", vec![classes]),
    ]
}

/// Inputs of a grasp, `[inputs][steps]`, truncated or padded with the last step to a fixed length.
fn fixed_length(learned: &Learned, grasp: &Sequence) -> Vec<f32> {
    let width = learned.preparation.width();
    let inputs = learned.preparation.inputs(grasp);
    let rows = inputs.len() / width.max(1);
    let at = |step: usize, input: usize| rows.checked_sub(1).map_or(0.0, |last| inputs[step.min(last) * width + input]);
    (0..width).flat_map(|input| (0..learned.steps).map(move |step| at(step, input))).collect()
}

fn train(data: &Dataset, learned: &Learned, fitting: &Fitting<'_>) -> Result<Arrays> {
    let (width, steps) = (learned.preparation.width(), learned.steps);
    let variables = VarMap::new();
    let network = {
        let builder = VarBuilder::from_varmap(&variables, DType::F32, &Device::Cpu);
        Network::new(width, steps, data.labels.classes.len(), &builder)?
    };
    // candle cannot seed its generator on the CPU, so we draw the initial weights.
    let mut random = ChaCha8Rng::seed_from_u64(fitting.seed);
    seed_weights(&variables, &mut random)?;
    let mut grasps: Vec<(Vec<f32>, u32)> = Vec::new();
    let exchanged = mirror(&data.channels);
    for example in &data.examples {
        let own = fixed_length(learned, &example.grasp);
        if let Some(exchanged) = &exchanged {
            let channels = exchanged.len();
            let from = |input: usize| input / channels * channels + exchanged[input % channels];
            let rows = (0..width).flat_map(|input| own[from(input) * steps..(from(input) + 1) * steps].to_vec());
            grasps.push((rows.collect(), example.class as u32));
        }
        grasps.push((own, example.class as u32));
    }
    let batches = grasps.len().div_ceil(BATCH) * learned.epochs;
    let settings = ParamsAdamW { lr: RATE, weight_decay: 0.05, ..ParamsAdamW::default() };
    let mut optimiser = AdamW::new(variables.all_vars(), settings)?;
    let mut done = 0;
    for epoch in 0..learned.epochs {
        grasps.shuffle(&mut random);
        for group in grasps.chunks(BATCH) {
            let x: Vec<f32> = group.iter().flat_map(|(inputs, _)| inputs.iter().copied()).collect();
            let y: Vec<u32> = group.iter().map(|(_, class)| *class).collect();
            let x = Tensor::from_vec(x, (group.len(), width, steps), &Device::Cpu)?;
            let y = Tensor::from_vec(y, group.len(), &Device::Cpu)?;
            let loss = candle_nn::loss::cross_entropy(&network.forward(&x)?, &y)?;
            optimiser.backward_step(&loss)?;
            done += 1;
            // Cosine decay.
            let share = done as f64 / batches as f64;
            optimiser.set_learning_rate(RATE * 0.5 * (1.0 + (std::f64::consts::PI * share).cos()) + 1e-6);
        }
        (fitting.progress)((epoch + 1) as f64 / learned.epochs as f64);
        if fitting.check().is_err() {
            break;
        }
    }
    let named = variables.data().lock();
    let named = named.map_err(|_poisoned| candle_core::Error::Msg("the variables are locked".to_owned()))?;
    let mut arrays = Arrays::default();
    for (name, var) in named.iter().collect::<BTreeMap<_, _>>() {
        arrays.put(name.clone(), var.dims(), var.as_tensor().flatten_all()?.to_vec1()?);
    }
    Ok(arrays)
}

/// Draws weights uniformly within one over the root of the fan-in, in the order of their names; biases are zero.
fn seed_weights(variables: &VarMap, random: &mut ChaCha8Rng) -> Result<()> {
    use rand::RngExt as _;
    let named = variables.data().lock();
    let named = named.map_err(|_poisoned| candle_core::Error::Msg("the variables are locked".to_owned()))?;
    let mut order: Vec<&String> = named.keys().collect();
    order.sort();
    for name in order {
        let var = &named[name];
        let fan_in: usize = var.dims().iter().skip(1).product::<usize>().max(1);
        let most = 1.0 / (fan_in as f32).sqrt();
        let most = if name.ends_with("bias") { 0.0 } else { most };
        let values: Vec<f32> = (0..var.elem_count()).map(|_| most * (2.0 * random.random::<f32>() - 1.0)).collect();
        var.set(&Tensor::from_vec(values, var.dims(), &Device::Cpu)?)?;
    }
    Ok(())
}

impl Recogniser for Convolution {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        // Shapes were checked when the network was made; on failure all classes would be equally likely.
        let scores = self.scores(grasp).unwrap_or_default();
        let pmf = Pmf::from_scores(scores.into_iter().map(f64::from));
        Verdict { pmf: before.map_or_else(|| pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        self.arrays.clone()
    }

    fn parameters(&self) -> usize {
        self.arrays.elements()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }
}
