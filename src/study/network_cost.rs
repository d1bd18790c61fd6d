//! Cost of networks: a training step and a live step of our macro-layer, the same training step in candle's own LSTM, with the
//! same data in one run, and the live answers of a model. `tests/peers/lstm_step.py` times PyTorch on the same sizes.

use candle_core::{DType, Device, Tensor};
use candle_nn::rnn::{self, LSTMConfig, RNN as _};
use candle_nn::{AdamW, Module as _, Optimizer as _, ParamsAdamW, VarBuilder, VarMap};
use palpate_learn::network::{Batch, LiveMacroLayer, MacroLayer, MacroShape, Pass, ReadOut, Regular};
use palpate_learn::{Model, Sequence};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Sizes of the timed step; the defaults are those of the reference measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StepSizes {
    /// Time steps of a sequence.
    pub steps: usize,
    /// Sequences in a batch.
    pub batch: usize,
    pub channels: usize,
    /// LSTM units.
    pub units: usize,
    /// Width of the first fully connected layer.
    pub hidden: usize,
    pub classes: usize,
}

impl StepSizes {
    /// 300 steps, 32 sequences, LSTM 128, fully connected 64, 16 classes.
    pub fn usual(channels: usize) -> Self {
        Self { steps: 300, batch: 32, channels, units: 128, hidden: 64, classes: 16 }
    }
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NetworkCost {
    /// Timed operation.
    pub what: &'static str,
    pub sizes: StepSizes,
    /// CPU time, the median over the runs (ms).
    pub cpu_ms_median: f64,
    /// CPU time, the shortest (ms).
    pub cpu_ms_least: f64,
}

fn row(what: &'static str, sizes: StepSizes, mut times: Vec<f64>) -> NetworkCost {
    times.sort_by(f64::total_cmp);
    let at = |k: usize| times.get(k).map_or(0.0, |t| t * 1e3);
    NetworkCost { what, sizes, cpu_ms_median: at(times.len() / 2), cpu_ms_least: at(0) }
}

fn shape(sizes: StepSizes) -> MacroShape {
    MacroShape {
        inputs: sizes.channels,
        units: sizes.units,
        hidden: Some(sizes.hidden),
        groups: vec![sizes.classes],
        with_prior: false,
    }
}

/// Sequences that differ by class, in time-major order.
fn batch(sizes: StepSizes, random: &mut ChaCha8Rng) -> Batch {
    let targets: Vec<usize> = (0..sizes.batch).map(|s| s % sizes.classes).collect();
    let mut x = Vec::with_capacity(sizes.steps * sizes.batch * sizes.channels);
    for _ in 0..sizes.steps {
        for target in &targets {
            let level = *target as f32 / 8.0 - 1.0;
            x.extend((0..sizes.channels).map(|_| level + random.random::<f32>() - 0.5));
        }
    }
    let last = sizes.steps - 1;
    let weight = 1.0 / sizes.batch as f32;
    let read_outs = (0..sizes.batch).map(|sequence| ReadOut { step: last, sequence, weight }).collect();
    Batch { x, steps: sizes.steps, sequences: sizes.batch, read_outs, targets, log_prior: Vec::new() }
}

/// Times training steps of our kernel: forward, back-propagation, AdamW.
pub fn kernel_step_cost(sizes: StepSizes, runs: usize) -> NetworkCost {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut layer = MacroLayer::new(shape(sizes), &mut random);
    let batch = batch(sizes, &mut random);
    let mut pass = Pass::new(layer.shape());
    let mut optimiser = palpate_learn::network::AdamW::new(layer.values().len());
    let mut gradient = vec![0.0; layer.values().len()];
    let regular = Regular { dropout: 0.2, smoothing: 0.0 };
    let mut times = Vec::new();
    for run in 0..runs + 2 {
        let start = cpu_time::ThreadTime::now();
        layer.loss(&batch, regular, &mut random, &mut gradient, &mut pass);
        optimiser.step(layer.values_mut(), &gradient, 1e-3, 0.01);
        if run >= 2 {
            times.push(start.elapsed().as_secs_f64());
        }
    }
    row("training step, our kernel", sizes, times)
}

/// Times the same training step in candle: `candle_nn`'s LSTM, two linear layers, its autograd and AdamW.
pub fn candle_step_cost(sizes: StepSizes, runs: usize) -> candle_core::Result<NetworkCost> {
    // On all cores, its default, candle is slower at these sizes.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.map_err(|e| candle_core::Error::Msg(e.to_string()))?;
    pool.install(|| {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let batch = batch(sizes, &mut random);
        let device = Device::Cpu;
        let variables = VarMap::new();
        let builder = VarBuilder::from_varmap(&variables, DType::F32, &device);
        let most = 1.0 / (sizes.units as f64).sqrt();
        let even = candle_nn::Init::Uniform { lo: -most, up: most };
        let config = LSTMConfig {
            w_ih_init: even,
            w_hh_init: even,
            // Positive biases for the forget gates, as in our kernel; without them candle computes with subnormal
            // numbers.
            b_ih_init: Some(candle_nn::Init::Const(0.25)),
            b_hh_init: Some(candle_nn::Init::Const(0.25)),
            ..LSTMConfig::default()
        };
        let lstm = rnn::lstm(sizes.channels, sizes.units, config, builder.pp("lstm"))?;
        let first = candle_nn::linear(sizes.units, sizes.hidden, builder.pp("fc1"))?;
        let second = candle_nn::linear(sizes.hidden, sizes.classes, builder.pp("fc2"))?;
        let mut optimiser = AdamW::new(variables.all_vars(), ParamsAdamW { lr: 1e-3, ..ParamsAdamW::default() })?;
        let x = Tensor::from_slice(&batch.x, (sizes.steps, sizes.batch, sizes.channels), &device)?;
        let x = x.transpose(0, 1)?.contiguous()?;
        let targets: Vec<u32> = batch.targets.iter().map(|t| *t as u32).collect();
        let targets = Tensor::from_vec(targets, sizes.batch, &device)?;
        let mut times = Vec::new();
        for run in 0..runs + 2 {
            let start = cpu_time::ThreadTime::now();
            let states = lstm.seq(&x)?;
            let hidden = first.forward(states[sizes.steps - 1].h())?.relu()?;
            let hidden = candle_nn::ops::dropout(&hidden, 0.2)?;
            let loss = candle_nn::loss::cross_entropy(&second.forward(&hidden)?, &targets)?;
            optimiser.backward_step(&loss)?;
            if run >= 2 {
                times.push(start.elapsed().as_secs_f64());
            }
        }
        Ok(row("training step, candle-nn", sizes, times))
    })
}

/// Cost of a live answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LiveCost {
    /// Timed operation.
    pub what: String,
    pub channels: usize,
    /// CPU time, the median (ms).
    pub cpu_ms_median: f64,
    /// CPU time, 95th percentile (ms).
    pub cpu_ms_p95: f64,
}

impl LiveCost {
    fn new(what: String, channels: usize, mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let at = |share: usize| times.get(times.len() * share / 100).map_or(0.0, |t| t * 1e3);
        Self { what, channels, cpu_ms_median: at(50), cpu_ms_p95: at(95) }
    }
}

/// Times one live step of the macro-layer: a sample in, scores out. Each time is the mean over one sequence.
pub fn live_step_cost(sizes: StepSizes, runs: usize) -> LiveCost {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let layer = MacroLayer::new(shape(sizes), &mut random);
    let samples: Vec<f32> = (0..sizes.steps * sizes.channels).map(|_| random.random::<f32>() - 0.5).collect();
    let mut live = LiveMacroLayer::new(&layer);
    let sequence = || {
        live.reset();
        let start = cpu_time::ThreadTime::now();
        for sample in samples.chunks_exact(sizes.channels) {
            std::hint::black_box(live.step(sample, &[]));
        }
        start.elapsed().as_secs_f64() / sizes.steps as f64
    };
    let times = std::iter::repeat_with(sequence).take(runs.max(1)).collect();
    LiveCost::new("step of the macro-layer".to_owned(), sizes.channels, times)
}

/// Times the answers of a model while a grasp runs; of methods that need the whole grasp, the one at its end.
pub fn answer_cost(what: String, model: &Model, grasp: &Sequence, runs: usize) -> LiveCost {
    let mut live = model.recogniser.live();
    let mut times = Vec::new();
    for _ in 0..runs.max(1) {
        let Some(live) = &mut live else {
            let start = cpu_time::ThreadTime::now();
            std::hint::black_box(model.recogniser.recognise(grasp, None));
            times.push(start.elapsed().as_secs_f64());
            continue;
        };
        live.begin(None);
        for (t, row) in grasp.rows() {
            let start = cpu_time::ThreadTime::now();
            if std::hint::black_box(live.push(t, row)).is_some() {
                times.push(start.elapsed().as_secs_f64());
            }
        }
    }
    LiveCost::new(what, model.card.channels.len(), times)
}
