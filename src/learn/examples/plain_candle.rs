//! A network in plain candle, fitted and judged as the built-in recognisers are:
//! `cargo run --release -p palpate-learn --example plain_candle`.
//!
//! To have it in `palpate train` and every study, see `palpate help contributing`.

#![expect(clippy::print_stdout, reason = "an example that says what it did")]

use candle_core::{DType, Device, Tensor};
use candle_nn::{AdamW, Linear, Module as _, Optimizer as _, VarBuilder, VarMap};
use palpate_learn::evaluation::answer;
use palpate_learn::metrics::Confusion;
use palpate_learn::{Arrays, Class, Dataset, Example, Labels, Pmf, Recogniser, Sequence, Verdict};
use std::error::Error;
use std::sync::Arc;

/// Samples of a grasp that the network reads.
const STEPS: usize = 30;

/// Two dense layers.
struct Perceptron {
    first: Linear,
    last: Linear,
}

impl Perceptron {
    fn new(inputs: usize, classes: usize, variables: &VarBuilder<'_>) -> candle_core::Result<Self> {
        Ok(Self {
            first: candle_nn::linear(inputs * STEPS, 32, variables.pp("first"))?,
            last: candle_nn::linear(32, classes, variables.pp("last"))?,
        })
    }

    /// Scores `[batch][classes]` of grasps `[batch][inputs * STEPS]`.
    fn scores(&self, x: &Tensor) -> candle_core::Result<Tensor> {
        self.last.forward(&self.first.forward(x)?.relu()?)
    }
}

impl Recogniser for Perceptron {
    fn recognise(&self, grasp: &Sequence, _before: Option<&Pmf>) -> Verdict {
        let scores = rows(&[grasp]).and_then(|x| self.scores(&x)?.flatten_all()?.to_vec1::<f32>()).unwrap_or_default();
        Verdict { pmf: Pmf::from_scores(scores.into_iter().map(f64::from)), properties: None }
    }

    fn arrays(&self) -> Arrays {
        Arrays::default() // What a model file would hold.
    }

    fn parameters(&self) -> usize {
        [&self.first, &self.last].iter().map(|layer| layer.weight().elem_count()).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

/// Inputs of the network: every grasp at equally spaced samples.
fn rows(grasps: &[&Sequence]) -> candle_core::Result<Tensor> {
    let sampled = |grasp: &&Sequence| -> Vec<f32> {
        let width = grasp.values.len() / grasp.len();
        (0..STEPS).flat_map(|k| grasp.values[(k * grasp.len() / STEPS) * width..][..width].to_vec()).collect()
    };
    let values: Vec<f32> = grasps.iter().flat_map(sampled).collect();
    let width = values.len() / grasps.len();
    Tensor::from_vec(values, (grasps.len(), width), &Device::Cpu)
}

/// Grasps of three objects: the later the touch, the smaller the object. Real ones come from `DatasetQuery` in `palpate-lab`.
fn grasps() -> Dataset {
    let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
    let grasp = |class: usize, k: usize| {
        let touch_s = 0.6 + 0.3 * class as f32 + 0.1 * (7.0 * k as f32).sin();
        let t_s: Vec<f32> = (0..225).map(|k| k as f32 / 75.0).collect();
        let values = t_s.iter().flat_map(|t| [t.min(touch_s) * 4.0, (t - touch_s).max(0.0)]).collect();
        Arc::new(Sequence { t_s, values })
    };
    let example = |id: usize| Example { id: id as i64, class: id % 3, grasp: grasp(id % 3, id), ..Example::default() };
    Dataset {
        channels: ["curvature", "pressure"].map(str::to_owned).to_vec(),
        labels: Labels { classes: ["large", "medium", "small"].map(class).to_vec(), ..Labels::default() },
        examples: (0..90).map(example).collect(),
        ..Dataset::default()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let data = grasps();
    let [train, test] = [0..60, 60..90].map(|part| data.part(&part.collect::<Vec<_>>()));

    let variables = VarMap::new();
    let builder = VarBuilder::from_varmap(&variables, DType::F32, &Device::Cpu);
    let network = Perceptron::new(data.channels.len(), data.labels.classes.len(), &builder)?;
    let x = rows(&train.examples.iter().map(|example| &*example.grasp).collect::<Vec<_>>())?;
    let truth: Vec<u32> = train.examples.iter().map(|example| example.class as u32).collect();
    let truth = Tensor::from_vec(truth, train.examples.len(), &Device::Cpu)?;
    let mut optimiser = AdamW::new_lr(variables.all_vars(), 0.01)?;
    for _pass in 0..200 {
        optimiser.backward_step(&candle_nn::loss::cross_entropy(&network.scores(&x)?, &truth)?)?;
    }

    let answers = answer(&network, &test);
    let pairs = answers.truth.iter().zip(&answers.verdicts).map(|(truth, verdict)| (*truth, Some(verdict.pmf.top().0)));
    let confusion = Confusion::from_pairs(data.labels.classes.len(), pairs);
    let f1 = confusion.and_then(|confusion| confusion.f1_over_occurring()).unwrap_or(0.0);
    println!("{} parameters, macro F1 {f1:.3} on {} grasps", network.parameters(), test.examples.len());
    Ok(())
}
