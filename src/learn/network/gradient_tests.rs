//! Comparison of the kernel with finite differences, with candle's autograd, and of live steps with whole sequences.

use super::macro_layer::{Batch, LiveMacroLayer, MacroLayer, MacroShape, Pass, ReadOut, Regular};
use candle_core::{DType, Device, Result, Tensor, Var};
use candle_nn::rnn::{self, LSTMConfig, RNN as _};
use candle_nn::{Module as _, VarBuilder};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashMap;

const NONE: Regular = Regular { dropout: 0.0, smoothing: 0.0 };

fn random(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Three sequences of seven steps, read out early and at the end.
fn batch(shape: &MacroShape, seed: u64) -> Batch {
    let mut random = random(seed);
    let mut even = |count: usize| (0..count).map(|_| 2.0 * random.random::<f32>() - 1.0).collect::<Vec<f32>>();
    let (steps, sequences) = (7, 3);
    let mut read_outs = Vec::new();
    for step in [2, 5, 6] {
        let weight = if step == 6 { 0.5 } else { 0.25 } / sequences as f32;
        read_outs.extend((0..sequences).map(|sequence| ReadOut { step, sequence, weight }));
    }
    let log_prior = if shape.with_prior { even(sequences * shape.outputs()) } else { Vec::new() };
    let targets = (0..sequences).flat_map(|s| shape.groups.iter().map(move |classes| s % classes)).collect();
    Batch { x: even(steps * sequences * shape.inputs), steps, sequences, read_outs, targets, log_prior }
}

fn shapes() -> [MacroShape; 3] {
    let shape = |hidden, groups: &[usize], with_prior| MacroShape {
        inputs: 3,
        units: 5,
        hidden,
        groups: groups.to_vec(),
        with_prior,
    };
    [shape(Some(4), &[6], true), shape(Some(4), &[2, 3], false), shape(None, &[4], false)]
}

#[test]
fn gradients_agree_with_finite_differences() {
    for shape in shapes() {
        for smoothing in [0.0, 0.2] {
            let regular = Regular { smoothing, ..NONE };
            let batch = batch(&shape, 1);
            let mut layer = MacroLayer::new(shape.clone(), &mut random(2));
            let mut pass = Pass::new(&shape);
            let mut gradient = vec![0.0; shape.parameters()];
            layer.loss(&batch, regular, &mut random(0), &mut gradient, &mut pass);
            let mut unused = vec![0.0; shape.parameters()];
            let step = 3e-3;
            for (k, found) in gradient.iter().enumerate() {
                let at = |layer: &mut MacroLayer, moved: f32, pass: &mut Pass, unused: &mut [f32]| {
                    let before = layer.values()[k];
                    layer.values_mut()[k] = before + moved;
                    let loss = layer.loss(&batch, regular, &mut random(0), unused, pass);
                    layer.values_mut()[k] = before;
                    loss
                };
                let mut slope = |h: f32| {
                    let ahead = at(&mut layer, h, &mut pass, &mut unused);
                    (ahead - at(&mut layer, -h, &mut pass, &mut unused)) / f64::from(2.0 * h)
                };
                // Two steps and Richardson's rule: differences of single-precision losses want a large step.
                let difference = (4.0 * slope(0.5 * step) - slope(step)) / 3.0;
                let error = (f64::from(*found) - difference).abs();
                assert!(error < 5e-4, "{shape:?} parameter {k}: {found} instead of {difference}");
            }
        }
    }
}

/// The same network in candle: its LSTM, two linear layers, cross-entropy at the last step.
fn in_candle(layer: &MacroLayer, batch: &Batch) -> Result<(f64, HashMap<&'static str, Vec<f32>>)> {
    let shape = layer.shape();
    let device = Device::Cpu;
    let mut vars: HashMap<String, Var> = HashMap::new();
    for block in shape.blocks() {
        let values = layer.values()[block.place.clone()].to_vec();
        vars.insert(block.name.to_owned(), Var::from_tensor(&Tensor::from_vec(values, block.shape.clone(), &device)?)?);
    }
    let tensor = |name: &str| vars[name].as_tensor().clone();
    let zeros = Tensor::zeros(4 * shape.units, DType::F32, &device)?;
    let weights = HashMap::from([
        ("weight_ih_l0".to_owned(), tensor("lstm.weight_ih")),
        ("weight_hh_l0".to_owned(), tensor("lstm.weight_hh")),
        ("bias_ih_l0".to_owned(), tensor("lstm.bias")),
        ("bias_hh_l0".to_owned(), zeros),
    ]);
    let builder = VarBuilder::from_tensors(weights, DType::F32, &device);
    let lstm = rnn::lstm(shape.inputs, shape.units, LSTMConfig::default(), builder)?;
    let x = Tensor::from_slice(&batch.x, (batch.steps, batch.sequences, shape.inputs), &device)?.transpose(0, 1)?;
    let states = lstm.seq(&x.contiguous()?)?;
    let hidden = states[batch.steps - 1].h();
    let hidden = candle_nn::Linear::new(tensor("fc1.weight"), Some(tensor("fc1.bias"))).forward(hidden)?.relu()?;
    let scores = candle_nn::Linear::new(tensor("fc2.weight"), Some(tensor("fc2.bias"))).forward(&hidden)?;
    let targets: Vec<u32> = batch.targets.iter().map(|t| *t as u32).collect();
    let loss = candle_nn::loss::cross_entropy(&scores, &Tensor::from_vec(targets, batch.sequences, &device)?)?;
    let store = loss.backward()?;
    let mut gradients = HashMap::new();
    for block in shape.blocks() {
        let gradient = store.get(vars[block.name].as_tensor()).expect("every parameter matters");
        gradients.insert(block.name, gradient.flatten_all()?.to_vec1()?);
    }
    Ok((f64::from(loss.to_scalar::<f32>()?), gradients))
}

#[test]
fn loss_and_gradients_agree_with_candle() -> Result<()> {
    let shape = MacroShape { inputs: 6, units: 24, hidden: Some(16), groups: vec![5], with_prior: false };
    let layer = MacroLayer::new(shape.clone(), &mut random(3));
    let (steps, sequences) = (40, 4);
    let mut even = random(4);
    let batch = Batch {
        x: (0..steps * sequences * shape.inputs).map(|_| 2.0 * even.random::<f32>() - 1.0).collect(),
        steps,
        sequences,
        read_outs: (0..sequences).map(|sequence| ReadOut { step: steps - 1, sequence, weight: 0.25 }).collect(),
        targets: vec![0, 1, 2, 3],
        log_prior: Vec::new(),
    };
    let mut gradient = vec![0.0; shape.parameters()];
    let loss = layer.loss(&batch, NONE, &mut random(0), &mut gradient, &mut Pass::new(&shape));
    let (of_candle, gradients) = in_candle(&layer, &batch)?;
    assert!((loss - of_candle).abs() < 1e-5, "{loss} instead of {of_candle}");
    for block in shape.blocks() {
        let (own, other) = (&gradient[block.place.clone()], &gradients[block.name]);
        let length = |v: &[f32]| v.iter().map(|x| x * x).sum::<f32>().sqrt();
        let apart: Vec<f32> = own.iter().zip(other).map(|(a, b)| a - b).collect();
        assert!(length(&apart) < 1e-4 * length(other).max(1e-6), "{}: {:?}", block.name, length(&apart));
    }
    Ok(())
}

#[test]
fn live_steps_agree_with_whole_sequences() {
    for shape in shapes() {
        let batch = batch(&shape, 5);
        let layer = MacroLayer::new(shape.clone(), &mut random(6));
        let mut pass = Pass::new(&shape);
        layer.score(&batch, &mut pass);
        let outputs = shape.outputs();
        let mut live = LiveMacroLayer::new(&layer);
        for sequence in 0..batch.sequences {
            live.reset();
            let prior = batch.log_prior.chunks(outputs).nth(sequence).unwrap_or(&[]);
            for step in 0..batch.steps {
                let from = (step * batch.sequences + sequence) * shape.inputs;
                let scores = live.step(&batch.x[from..from + shape.inputs], prior).to_vec();
                let place = |at: &ReadOut| at.step == step && at.sequence == sequence;
                if let Some(row) = batch.read_outs.iter().position(place) {
                    let whole = &pass.scores()[row * outputs..(row + 1) * outputs];
                    assert!(scores.iter().zip(whole).all(|(a, b)| (a - b).abs() < 1e-5), "step {step}");
                }
            }
        }
    }
}

#[test]
fn gradients_of_long_sequences_do_not_become_subnormal() {
    let shape = MacroShape { inputs: 2, units: 8, hidden: None, groups: vec![3], with_prior: false };
    let mut layer = MacroLayer::new(shape.clone(), &mut random(7));
    // Closed forget gates: the gradient of the last step decays quickly.
    let bias = shape.blocks()[2].place.clone();
    layer.values_mut()[bias.start + shape.units..bias.start + 2 * shape.units].fill(-3.0);
    let steps = 300;
    let batch = Batch {
        x: vec![0.1; steps * shape.inputs],
        steps,
        sequences: 1,
        read_outs: vec![ReadOut { step: steps - 1, sequence: 0, weight: 1.0 }],
        targets: vec![1],
        log_prior: Vec::new(),
    };
    let (mut pass, mut gradient) = (Pass::new(&shape), vec![0.0; shape.parameters()]);
    layer.loss(&batch, NONE, &mut random(0), &mut gradient, &mut pass);
    assert_eq!(pass.subnormal_gradients(), 0);
    assert!(gradient.iter().any(|g| *g != 0.0));
}

#[test]
fn dropout_keeps_the_mean_loss() {
    let shape = MacroShape { inputs: 3, units: 6, hidden: Some(50), groups: vec![4], with_prior: false };
    let layer = MacroLayer::new(shape.clone(), &mut random(8));
    let batch = batch(&shape, 9);
    let (mut pass, mut gradient) = (Pass::new(&shape), vec![0.0; shape.parameters()]);
    let mut losses = |dropout: f32| {
        let mut random = random(10);
        let of = |_| layer.loss(&batch, Regular { dropout, smoothing: 0.0 }, &mut random, &mut gradient, &mut pass);
        let losses: Vec<f64> = (0..200).map(of).collect();
        (losses.iter().sum::<f64>() / 200.0, losses.windows(2).any(|w| w[0] != w[1]))
    };
    let ((plain, varies_plain), (dropped, varies)) = (losses(0.0), losses(0.5));
    assert!(!varies_plain && varies);
    assert!((plain - dropped).abs() < 0.05, "{plain} and {dropped}");
}

/// Largest gradient of an input weight of a layer that is read out 300 steps after its only input.
fn gradient_of_an_early_input(layer: &MacroLayer) -> f32 {
    let shape = layer.shape();
    let steps = 300;
    let mut x = vec![0.0; steps * shape.inputs];
    x[..shape.inputs].fill(1.0);
    let batch = Batch {
        x,
        steps,
        sequences: 1,
        read_outs: vec![ReadOut { step: steps - 1, sequence: 0, weight: 1.0 }],
        targets: vec![1],
        log_prior: Vec::new(),
    };
    let (mut pass, mut gradient) = (Pass::new(shape), vec![0.0; shape.parameters()]);
    layer.loss(&batch, NONE, &mut random(0), &mut gradient, &mut pass);
    gradient[shape.blocks()[0].place.clone()].iter().fold(0.0, |most, g| most.max(g.abs()))
}

#[test]
fn units_begin_with_memories_of_all_lengths() {
    let shape = MacroShape { inputs: 2, units: 64, hidden: None, groups: vec![3], with_prior: false };
    let forgetful = MacroLayer::new(shape.clone(), &mut random(9));
    let mut layer = forgetful.clone();
    layer.remember(300, &mut random(10));
    let bias = layer.values()[shape.blocks()[2].place.clone()].to_vec();
    // A unit with memory m keeps m / (m + 1) of its cell and takes in 1 / (m + 1).
    let memories: Vec<f32> = bias[64..128].iter().map(|b| b.exp()).collect();
    assert!(bias[..64].iter().zip(&memories).all(|(b, m)| (b.exp() - 1.0 / m).abs() < 1e-5), "{bias:?}");
    assert!(memories.iter().all(|m| (1.0..299.1).contains(m)), "{memories:?}");
    let mean = memories.iter().sum::<f32>() / 64.0;
    assert!((mean - 150.0).abs() < 4.0 * 299.0 / (12.0 * 64.0_f32).sqrt(), "mean {mean}");
    let [early, with_memory] = [&forgetful, &layer].map(gradient_of_an_early_input);
    assert!(with_memory > 1e-6 && early < 1e-15, "{early} {with_memory}");
}
