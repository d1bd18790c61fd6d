//! A small convolutional network over time, written in plain candle without our kernel: what a new network looks like
//! that someone brings along.

use super::super::data::{Dataset, Sequence};
use super::super::model_file::{Arrays, ModelCard};
use super::super::network::{Preparation, mirror};
use super::super::{FitError, Fitting, Pmf, Recogniser, Verdict, check_enough};
use candle_core::{DType, Device, Result, Tensor};
use candle_nn::{AdamW, Conv1d, Conv1dConfig, Linear, Module as _, Optimizer as _, ParamsAdamW, VarBuilder, VarMap};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Two convolutions over time, the mean over time, and a linear layer.
pub(in super::super) struct Convolution {
    learned: Learned,
    tensors: HashMap<String, Tensor>,
    network: Network,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    preparation: Preparation,
    channels: usize,
    steps: usize,
    epochs: usize,
}

const RATE_HZ: f32 = 8.0;
const CHANNELS: usize = 48;
const KERNEL: usize = 5;
const EPOCHS: usize = 120;
const BATCH: usize = 32;
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
            last: candle_nn::linear(CHANNELS * (steps / 4).max(1), classes, variables.pp("last"))?,
        })
    }

    /// Scores `[batch][classes]` of sequences `[batch][inputs][steps]`.
    fn forward(&self, x: &Tensor) -> Result<Tensor> {
        let (batch, _, steps) = x.dims3()?;
        let x = self.first.forward(x)?.relu()?;
        let x = self.second.forward(&x)?.relu()?;
        // Means over stretches of four steps: what happened when, roughly.
        let stretches = (steps / 4).max(1);
        let length = steps.min(4);
        let x = x.narrow(2, 0, stretches * length)?.reshape((batch, CHANNELS, stretches, length))?.mean(3)?;
        self.last.forward(&x.flatten_from(1)?)
    }
}

impl Convolution {
    /// Fits the network.
    pub(in super::super) fn fit(data: &Dataset, fitting: &Fitting<'_>) -> std::result::Result<Self, FitError> {
        check_enough(data, 2)?;
        fitting.refuse_settings()?;
        let preparation = Preparation::fit(data, RATE_HZ);
        let mut lengths: Vec<usize> =
            data.examples.iter().map(|e| preparation.inputs(&e.grasp).len() / preparation.width().max(1)).collect();
        lengths.sort_unstable();
        let steps = lengths[lengths.len() / 2].max(1);
        let epochs = if fitting.quick { EPOCHS / 6 } else { EPOCHS };
        let learned = Learned { preparation, channels: CHANNELS, steps, epochs };
        let failed = |cause: String| FitError::Failed { cause };
        let tensors = train(data, &learned, fitting).map_err(|e| failed(e.to_string()))?;
        fitting.check()?;
        let classes = data.labels.classes.len();
        Self::assemble(learned, tensors, classes).map_err(|e| failed(e.to_string()))
    }

    /// Brings it back from a card and arrays.
    pub(in super::super) fn load(card: &ModelCard, arrays: &Arrays) -> std::result::Result<Self, String> {
        let learned: Learned =
            serde_json::from_value(card.settings.clone()).map_err(|e| format!("its settings: {e}"))?;
        let sound = learned.preparation.is_sound() && learned.preparation.scales.len() == card.channels.len();
        if !sound || learned.channels != CHANNELS || !(1..=100_000).contains(&learned.steps) {
            return Err("its parts do not fit its channels".to_owned());
        }
        for name in arrays.0.keys() {
            arrays.get_f32(name)?;
        }
        let tensors = arrays.0.iter().map(|(name, tensor)| (name.clone(), tensor.clone())).collect();
        Self::assemble(learned, tensors, card.labels.classes.len()).map_err(|e| e.to_string())
    }

    fn assemble(learned: Learned, tensors: HashMap<String, Tensor>, classes: usize) -> Result<Self> {
        let variables = VarBuilder::from_tensors(tensors.clone(), DType::F32, &Device::Cpu);
        let network = Network::new(learned.preparation.width(), learned.steps, classes, &variables)?;
        Ok(Self { learned, tensors, network })
    }

    fn scores(&self, grasp: &Sequence) -> Result<Vec<f32>> {
        let page = page(&self.learned, grasp);
        let x = Tensor::from_vec(page, (1, self.learned.preparation.width(), self.learned.steps), &Device::Cpu)?;
        self.network.forward(&x)?.flatten_all()?.to_vec1()
    }
}

/// Inputs of a grasp, `[inputs][steps]`, cut or held to a fixed length.
fn page(learned: &Learned, grasp: &Sequence) -> Vec<f32> {
    let width = learned.preparation.width();
    let inputs = learned.preparation.inputs(grasp);
    let rows = inputs.len() / width.max(1);
    let at = |step: usize, input: usize| rows.checked_sub(1).map_or(0.0, |last| inputs[step.min(last) * width + input]);
    (0..width).flat_map(|input| (0..learned.steps).map(move |step| at(step, input))).collect()
}

fn train(data: &Dataset, learned: &Learned, fitting: &Fitting<'_>) -> Result<HashMap<String, Tensor>> {
    let (width, steps) = (learned.preparation.width(), learned.steps);
    let variables = VarMap::new();
    let network = {
        let builder = VarBuilder::from_varmap(&variables, DType::F32, &Device::Cpu);
        Network::new(width, steps, data.labels.classes.len(), &builder)?
    };
    // candle draws initial weights from a generator that cannot be seeded everywhere; ours can.
    let mut random = ChaCha8Rng::seed_from_u64(fitting.seed);
    seed_weights(&variables, &mut random)?;
    let mut pages: Vec<(Vec<f32>, u32)> = Vec::new();
    let exchanged = mirror(&data.channels);
    for example in &data.examples {
        let own = page(learned, &example.grasp);
        if let Some(exchanged) = &exchanged {
            let channels = exchanged.len();
            let from = |input: usize| input / channels * channels + exchanged[input % channels];
            let rows = (0..width).flat_map(|input| own[from(input) * steps..(from(input) + 1) * steps].to_vec());
            pages.push((rows.collect(), example.class as u32));
        }
        pages.push((own, example.class as u32));
    }
    let batches = pages.len().div_ceil(BATCH) * learned.epochs;
    let settings = ParamsAdamW { lr: RATE, weight_decay: 0.05, ..ParamsAdamW::default() };
    let mut optimiser = AdamW::new(variables.all_vars(), settings)?;
    let mut done = 0;
    for epoch in 0..learned.epochs {
        pages.shuffle(&mut random);
        for group in pages.chunks(BATCH) {
            let x: Vec<f32> = group.iter().flat_map(|(page, _)| page.iter().copied()).collect();
            let y: Vec<u32> = group.iter().map(|(_, class)| *class).collect();
            let x = Tensor::from_vec(x, (group.len(), width, steps), &Device::Cpu)?;
            let y = Tensor::from_vec(y, group.len(), &Device::Cpu)?;
            let loss = candle_nn::loss::cross_entropy(&network.forward(&x)?, &y)?;
            optimiser.backward_step(&loss)?;
            done += 1;
            // Down along half a cosine.
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
    Ok(named.iter().map(|(name, var)| (name.clone(), var.as_tensor().detach())).collect())
}

/// Weights even within one over the root of the fan-in, drawn in the order of their names.
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
        // Shapes were checked when the network was made; a failure would leave every class as likely as before.
        let scores = self.scores(grasp).unwrap_or_default();
        let pmf = Pmf::from_scores(scores.into_iter().map(f64::from));
        Verdict { pmf: before.map_or_else(|| pmf.clone(), |before| before.times(&pmf)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        Arrays(self.tensors.iter().map(|(name, tensor)| (name.clone(), tensor.clone())).collect())
    }

    fn parameters(&self) -> usize {
        self.tensors.values().map(Tensor::elem_count).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }
}
