//! A classifier that starts from the geometry encoder: what was learned of random shapes is fine-tuned to the classes. It
//! answers from the beginning of a grasp on, like the encoder.
//!
//! The class "other" has half of the prior while training, as with trees.

use super::candle_network::{CandleNetwork, Pass, Training, Variables};
use super::convolution::{DENSE, Trunk};
use super::felt_steps::{Columns, FeltSteps, STAGES, Views, end_of_stage, stage_of};
use super::geometry::{GeometryEncoder, Shipped};
use super::other::{as_one_of_many, other_weight};
use crate::arrays::Arrays;
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::model::{LoadError, ModelCard};
use crate::pmf::Pmf;
use crate::recogniser::{LiveRecogniser, Recogniser, Verdict};
use crate::temperature::{Calibration, Temperatures};
use candle_core::{D, Device, Result, Tensor};
use candle_nn::{Linear, Module as _, VarBuilder};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Fine-tuned geometry encoder.
#[derive(Clone)]
pub(crate) struct GeometryNetwork(Arc<Fitted>);

struct Fitted {
    learned: Learned,
    columns: Columns,
    network: Variables<Head>,
    /// Number of classes, and the class "other".
    classes: usize,
    other: Option<usize>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    #[serde(flatten)]
    steps: FeltSteps,
    revision: u32,
    epochs: usize,
    /// Calibration at each stage of a grasp.
    calibrations: Vec<Calibration>,
}

/// The encoder's [`Trunk`], then a linear layer.
struct Head {
    trunk: Trunk,
    last: Linear,
}

/// Share of values dropped before and after the dense layer.
const DROPOUT: f32 = 0.3;
/// Training grasps times passes over them: many grasps need fewer passes.
const DRAWS: usize = 300_000;
/// Fewest and most passes.
const PASSES: [usize; 2] = [20, 80];
/// One in this many grasps is held out for calibration.
const CALIBRATION: usize = 6;
const TEMPERATURES: Temperatures = Temperatures { range: 0.2..=5.0, count: 60 };

impl CandleNetwork for Head {
    const REVISION: u32 = 1;
    const NOISE: f32 = 0.1;

    fn new(inputs: usize, classes: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        Ok(Self {
            trunk: Trunk::new(inputs, variables)?,
            last: candle_nn::linear(DENSE, classes, variables.pp("classes"))?,
        })
    }

    fn scores(&self, x: &Tensor, pass: &mut Pass<'_>) -> Result<Tensor> {
        let x = self.trunk.forward(x, DROPOUT, pass)?;
        self.last.forward(&pass.dropout(&x, DROPOUT)?)
    }
}

impl GeometryNetwork {
    /// Fits the network and its calibration.
    pub(crate) fn fit(data: &Dataset, fitting: &Fitting<'_>) -> std::result::Result<Self, LearnError> {
        check_enough(data, 2)?;
        fitting.refuse_settings()?;
        let encoder = Shipped::of(&data.about).encoder().map_err(LearnError::failed)?;
        let columns = Columns::of(encoder.channels(), &data.channels).ok_or_else(|| LearnError::Encoder {
            needs: encoder.channels().join(", "),
            found: data.channels.join(", "),
        })?;
        let steps = encoder.steps().clone();
        let views: Vec<Views> = data.examples.iter().map(|e| steps.views(&columns.pick(&e.grasp))).collect();
        let [least, most] = PASSES;
        let passes = (DRAWS / data.examples.len().max(1)).clamp(least, most);
        let epochs = if fitting.quick { passes.div_ceil(2) } else { passes };
        let work = Work { data, encoder: &encoder, views: &views, epochs, fitting };
        let part_of = data.folds(CALIBRATION, fitting.seed ^ 0xca11b);
        let of = |inside: bool| (0..part_of.len()).filter(|k| (part_of[*k] == 0) == inside).collect::<Vec<usize>>();
        let first = work.train(&of(false), 0.0).map_err(LearnError::failed)?;
        fitting.check()?;
        let calibrations = (0..STAGES).map(|stage| work.calibration(&first, &of(true), stage)).collect::<Result<_>>();
        let learned = Learned {
            steps,
            revision: Head::REVISION,
            epochs,
            calibrations: calibrations.map_err(LearnError::failed)?,
        };
        let all: Vec<usize> = (0..data.examples.len()).collect();
        let network = work.train(&all, 0.5).map_err(LearnError::failed)?;
        fitting.check()?;
        let (classes, other) = (data.labels.classes.len(), data.labels.other());
        Ok(Self(Arc::new(Fitted { learned, columns, network, classes, other })))
    }

    /// Everything that decides a fit, besides the data, the seed and the options of the fit.
    pub(crate) fn decided_by() -> serde_json::Value {
        serde_json::json!({
            "revision": Head::REVISION,
            "training": [Head::RATE, Head::WEIGHT_DECAY, f64::from(Head::NOISE), DRAWS as f64],
            "passes": PASSES,
            "encoder": Shipped::encoders(),
        })
    }

    /// Restores a recogniser from a model file.
    pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> std::result::Result<Self, LoadError> {
        let learned: Learned = card.settings_as()?;
        let columns = Columns::of(&learned.steps.channels, &card.channels);
        let part = |part: &'static str| LoadError::Card { part };
        if learned.revision != Head::REVISION {
            return Err(part("the version of the network"));
        }
        if let Some(fault) = learned.steps.fault() {
            return Err(part(fault));
        }
        if learned.calibrations.len() != STAGES || !learned.calibrations.iter().all(|own| own.is_sound(&TEMPERATURES)) {
            return Err(part("the calibration"));
        }
        let columns = columns.ok_or(part("the list of channels"))?;
        let (classes, other) = (card.labels.classes.len(), card.labels.other());
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let network = Variables::<Head>::new(learned.steps.inputs(), classes, &mut random)
            .map_err(|error| LoadError::Failed { cause: error.to_string() })?;
        network.read(arrays, "")?;
        Ok(Self(Arc::new(Fitted { learned, columns, network, classes, other })))
    }
}

impl Fitted {
    /// Answer to the readings so far.
    fn answer(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let views = self.learned.steps.views(&self.columns.pick(grasp));
        // Shapes were checked when the network was made, so that no grasp should make it fail.
        let pmf = uncalibrated(&self.network, &views).unwrap_or_else(|_failed| Pmf::uniform(self.classes));
        let pmf = as_one_of_many(&self.learned.calibrations[stage_of(views.felt)].apply(&pmf), self.other);
        let pmf = before.map_or_else(|| pmf.clone(), |before| before.times(&pmf));
        Verdict { pmf, properties: None }
    }
}

/// Mean of the logarithms of the probabilities over a grasp and its mirror image.
fn uncalibrated(network: &Variables<Head>, views: &Views) -> Result<Pmf> {
    let scores = network.network.scores(&views.tensor()?, &mut Pass::answering())?;
    let logarithms = candle_nn::ops::log_softmax(&scores, D::Minus1)?.mean(0)?.to_vec1::<f32>()?;
    Ok(Pmf::from_scores(logarithms.into_iter().map(f64::from)))
}

/// Training data of a fit.
struct Work<'a> {
    data: &'a Dataset,
    encoder: &'a GeometryEncoder,
    views: &'a [Views],
    epochs: usize,
    fitting: &'a Fitting<'a>,
}

impl Work<'_> {
    /// Trains on some of the grasps. Progress goes on from `start` by a half.
    fn train(&self, grasps: &[usize], start: f64) -> Result<Variables<Head>> {
        let class = |k: &usize| self.data.examples[*k].class;
        let other = other_weight(self.data, &grasps.iter().map(class).collect::<Vec<_>>());
        let batch = |group: &[usize], random: &mut ChaCha8Rng| {
            group.iter().flat_map(|k| self.views[*k].drawn(Head::NOISE, random)).collect()
        };
        let loss = |scores: &Tensor, group: &[usize]| {
            let y: Vec<u32> = group.iter().map(|k| class(k) as u32).collect();
            let weight =
                |k: &usize| other.filter(|(other, _)| *other == class(k)).map_or(1.0, |(_, weight)| weight as f32);
            let weights: Vec<f32> = group.iter().map(weight).collect();
            let total: f32 = weights.iter().sum();
            let y = Tensor::from_vec(y, (group.len(), 1), &Device::Cpu)?;
            let weights = Tensor::from_vec(weights, (group.len(), 1), &Device::Cpu)?;
            let likely = candle_nn::ops::log_softmax(scores, D::Minus1)?.gather(&y, 1)?;
            likely.mul(&weights)?.sum_all()?.affine(f64::from(-1.0 / total.max(1e-6)), 0.0)
        };
        let progress = |share: f64| (self.fitting.progress)(start + 0.5 * share);
        let encoder = self.encoder.arrays();
        let training = Training {
            size: (self.encoder.steps().inputs(), self.data.labels.classes.len()),
            sequences: grasps,
            epochs: self.epochs,
            start: Some(&encoder),
            batch: &batch,
            loss: &loss,
            progress: &progress,
        };
        Variables::trained(&training, self.fitting)
    }

    /// Calibration at a stage of a grasp, on held-out grasps.
    fn calibration(&self, network: &Variables<Head>, held_out: &[usize], stage: usize) -> Result<Calibration> {
        let answer = |k: &usize| {
            Ok((
                uncalibrated(network, &self.views[*k].clone().until(end_of_stage(stage)))?,
                self.data.examples[*k].class,
            ))
        };
        let answers: Vec<(Pmf, usize)> = held_out.iter().map(answer).collect::<Result<_>>()?;
        let truths: Vec<usize> = answers.iter().map(|(_, truth)| *truth).collect();
        let other = other_weight(self.data, &truths);
        let weight = |class: usize| other.filter(|(other, _)| *other == class).map_or(1.0, |(_, weight)| weight);
        Ok(Calibration::fit(&answers, weight, &TEMPERATURES).0)
    }
}

impl Recogniser for GeometryNetwork {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        self.0.answer(grasp, before)
    }

    fn live(&self) -> Option<Box<dyn LiveRecogniser>> {
        let model = Arc::clone(&self.0);
        Some(Box::new(Live { model, before: None, readings: Sequence::default(), felt: 0 }))
    }

    fn arrays(&self) -> Arrays {
        self.0.network.arrays()
    }

    fn parameters(&self) -> usize {
        self.0.network.by_name.values().map(|var| var.elem_count()).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.0.learned).unwrap_or_default()
    }
}

/// The network at work on a running grasp.
struct Live {
    model: Arc<Fitted>,
    before: Option<Pmf>,
    readings: Sequence,
    /// Steps felt at the last answer.
    felt: usize,
}

impl LiveRecogniser for Live {
    fn begin(&mut self, before: Option<&Pmf>) {
        (self.before, self.readings, self.felt) = (before.cloned(), Sequence::default(), 0);
    }

    fn push(&mut self, t: f32, row: &[f32]) -> Option<Verdict> {
        self.readings.t_s.push(t);
        self.readings.values.extend_from_slice(row);
        let felt = self.model.learned.steps.felt_at(t);
        (felt > std::mem::replace(&mut self.felt, felt))
            .then(|| self.model.answer(&self.readings, self.before.as_ref()))
    }

    fn finish(&mut self) -> Option<Verdict> {
        (!self.readings.is_empty()).then(|| self.model.answer(&self.readings, self.before.as_ref()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance_tests::quick;
    use crate::data::{Class, DataCard, Example, Labels};

    /// Two classes that touch at different times and press differently hard.
    fn data() -> Dataset {
        let channels = Shipped::AnyGripper.encoder().expect("is shipped").channels().to_vec();
        let grasp = |class: usize, k: usize| {
            let t_s: Vec<f32> = (1..=200).map(|k| k as f32 * 0.02).collect();
            let wiggle = (k * 7919 % 100) as f32 * 1e-3;
            let row = |t: f32| -> Vec<f32> {
                let touched = (t - 1.0 - 0.5 * class as f32 - wiggle).max(0.0);
                let of = |c: &String| if c.starts_with("curvature") { 4.0 * t - touched } else { 0.3 * touched };
                channels.iter().map(of).collect()
            };
            let values = t_s.iter().flat_map(|t| row(*t)).collect();
            Arc::new(Sequence { t_s, values })
        };
        let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
        Dataset {
            labels: Labels { classes: vec![class("thick"), class("thin")], ..Labels::default() },
            examples: (0..60)
                .map(|k| Example { id: k as i64, class: k % 2, grasp: grasp(k % 2, k), ..Example::default() })
                .collect(),
            about: DataCard::default(),
            channels: channels.clone(),
        }
    }

    #[test]
    fn it_answers_from_the_beginning_of_a_grasp_on() {
        let data = data();
        let network = GeometryNetwork::fit(&data, &quick(1)).expect("fits");
        let right = |until: f32| {
            let of = |e: &&Example| network.recognise(&e.grasp.until(until), None).pmf.top().0 == e.class;
            data.examples.iter().filter(of).count()
        };
        assert!(right(4.0) > 55 && right(2.0) > 50, "{} {}", right(4.0), right(2.0));
        // Live answers are those to the readings so far.
        let mut live = network.live().expect("has one");
        live.begin(None);
        let example = &data.examples[0];
        let answers: Vec<(f32, Verdict)> =
            example.grasp.rows().filter_map(|(t, row)| Some((t, live.push(t, row)?))).collect();
        assert!((20..=30).contains(&answers.len()), "{}", answers.len());
        assert!(answers.iter().all(|(t, answer)| *answer == network.recognise(&example.grasp.until(*t), None)));
        assert_eq!(live.finish(), Some(network.recognise(&example.grasp, None)));
    }
}
