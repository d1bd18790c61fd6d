//! A classifier that starts from the geometry encoder: what was learned of random shapes is fine-tuned to the classes. It
//! answers from the beginning of a grasp on, like the encoder.
//!
//! The class "other" has half of the prior while training, as with trees.
//!
//! It keeps some of its training grasps. With them it learns new objects later: training goes on from what it has learned, on
//! kept and new grasps, and each class has one more output.

use super::answering::Answering;
use super::candle_network::{CandleNetwork, Pass, Training, Variables};
use super::convolution::{DENSE, Trunk};
use super::felt_steps::{Columns, FeltSteps, STAGES, Views, end_of_stage, stage_of};
use super::geometry::Shipped;
use super::kept_grasps::KeptGrasps;
use super::other::{as_one_of_many, balanced_weights, other_weight};
use crate::arrays::{Arrays, ModelError};
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::model::ModelCard;
use crate::pmf::Pmf;
use crate::recogniser::{LiveRecogniser, Pupil, Recogniser, Verdict};
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
    answering: Answering,
    kept: KeptGrasps,
    /// The class "other".
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
    /// Number of grasps that are kept; files of early versions have none.
    #[serde(default)]
    kept: usize,
}

/// The encoder's [`Trunk`], then a linear layer.
struct Head {
    trunk: Trunk,
    last: Linear,
}

/// Name of the last layer.
const CLASSES: &str = "classes";
/// An array of it.
fn last(kind: &str) -> String {
    format!("{CLASSES}.{kind}")
}

/// Share of values dropped before and after the dense layer, with few readings and with many.
const DROPOUT: [f32; 2] = [0.3, 0.1];
/// Number of readings from which they are many.
const MANY: usize = 3000;
/// Training readings times passes over them, where the settings do not say how many: many readings need fewer passes.
const DRAWS: usize = 300_000;
/// Fewest and most passes.
const PASSES: [usize; 2] = [20, 150];
/// Training grasps times passes over them when new objects are learned.
const DRAWS_OF_NEW: usize = 25_000;
/// Highest learning rate then.
const RATE_OF_NEW: f64 = 1e-3;
/// One in this many grasps is held out for calibration.
const CALIBRATION: usize = 6;
const TEMPERATURES: Temperatures = Temperatures { range: 0.2..=5.0, count: 60 };

/// Passes over the training grasps that the settings ask for.
fn epochs_of(fitting: &Fitting<'_>) -> std::result::Result<Option<usize>, LearnError> {
    let unknown = |name: &String| name != "epochs";
    if let Some(name) = fitting.settings.keys().find(|name| unknown(name)) {
        return Err(LearnError::setting(name, "this method has one setting, epochs"));
    }
    let Some(value) = fitting.settings.get("epochs") else { return Ok(None) };
    let epochs = value.as_u64().filter(|epochs| (1..=10_000).contains(epochs));
    let refused = || LearnError::setting("epochs", "write a number from 1 to 10000");
    epochs.map(|epochs| Some(epochs as usize)).ok_or_else(refused)
}

impl CandleNetwork for Head {
    const REVISION: u32 = 1;
    const NOISE: f32 = 0.005;

    fn new(inputs: usize, classes: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        Ok(Self {
            trunk: Trunk::new(inputs, variables)?,
            last: candle_nn::linear(DENSE, classes, variables.pp(CLASSES))?,
        })
    }

    fn scores(&self, x: &Tensor, pass: &mut Pass<'_>) -> Result<Tensor> {
        let x = self.trunk.forward(x, DROPOUT[0], pass)?;
        self.last.forward(&pass.dropout(&x, DROPOUT[0])?)
    }
}

impl GeometryNetwork {
    /// Fits the network and its calibration.
    pub(crate) fn fit(data: &Dataset, fitting: &Fitting<'_>) -> std::result::Result<Self, LearnError> {
        check_enough(data, 2)?;
        let set = epochs_of(fitting)?;
        let encoder = Shipped::of(&data.about).encoder().map_err(LearnError::failed)?;
        let columns = Columns::of(encoder.channels(), &data.channels)
            .ok_or_else(|| LearnError::encoder(encoder.channels(), &data.channels))?;
        let steps = encoder.steps().clone();
        let views: Vec<Views> = data.examples.iter().map(|e| steps.views(&columns.pick(&e.grasp))).collect();
        let [least, most] = PASSES;
        let passes = set.unwrap_or_else(|| (DRAWS / data.examples.len().max(1)).clamp(least, most));
        let epochs = if fitting.quick { passes.div_ceil(2) } else { passes };
        let (truth, other) = (data.truth(), data.labels.other());
        let classes = data.labels.classes.len();
        let start = encoder.arrays();
        let work = Work {
            steps: &steps,
            views: &views,
            truth: &truth,
            weights: None,
            size: (classes, other),
            start: &start,
            epochs,
            rate: Head::RATE,
            fitting,
        };
        let part_of = data.folds(CALIBRATION, fitting.seed ^ 0xca11b);
        let of = |inside: bool| (0..part_of.len()).filter(|k| (part_of[*k] == 0) == inside).collect::<Vec<usize>>();
        let first = work.train(&of(false), [0.0, 0.5]).map_err(LearnError::failed)?;
        fitting.check()?;
        let first = Answering::new(&first, CLASSES).map_err(LearnError::failed)?;
        let calibrations = (0..STAGES).map(|stage| work.calibration(&first, &of(true), stage)).collect();
        let all: Vec<usize> = (0..data.examples.len()).collect();
        let network = work.train(&all, [0.5, 1.0]).map_err(LearnError::failed)?;
        fitting.check()?;
        let kept = KeptGrasps::of(&truth, classes, other, &views);
        let learned = Learned { steps, revision: Head::REVISION, epochs, calibrations, kept: kept.len() };
        Ok(Self(Arc::new(Fitted::new(learned, columns, network, kept, other).map_err(LearnError::failed)?)))
    }

    /// Learns grasps of classes that come after its own, and further ones of its own.
    fn with_new(&self, data: &Dataset, fitting: &Fitting<'_>) -> std::result::Result<Self, LearnError> {
        let Fitted { learned, network, kept, .. } = &*self.0;
        let steps = learned.steps.clone();
        let columns = Columns::of(&steps.channels, &data.channels)
            .ok_or_else(|| LearnError::encoder(&steps.channels, &data.channels))?;
        let (mut truth, mut views): (Vec<usize>, Vec<Views>) = kept.views(&steps).unzip();
        truth.extend(data.examples.iter().map(|example| example.class));
        views.extend(data.examples.iter().map(|example| steps.views(&columns.pick(&example.grasp))));
        let (classes, other) = (data.labels.classes.len(), data.labels.other());
        let weights = balanced_weights(other, &truth);
        let mut start = network.arrays();
        for name in ["weight", "bias"].map(last) {
            start.extend_rows(&name, classes);
        }
        let epochs = DRAWS_OF_NEW.div_ceil(views.len().max(1));
        let work = Work {
            steps: &steps,
            views: &views,
            truth: &truth,
            weights: Some(&weights),
            size: (classes, other),
            start: &start,
            epochs: if fitting.quick { epochs.div_ceil(4) } else { epochs },
            rate: RATE_OF_NEW,
            fitting,
        };
        let all: Vec<usize> = (0..views.len()).collect();
        let network = work.train(&all, [0.0, 1.0]).map_err(LearnError::failed)?;
        fitting.check()?;
        let kept = KeptGrasps::of(&truth, classes, other, &views);
        let learned = Learned { kept: kept.len(), ..learned.clone() };
        Ok(Self(Arc::new(Fitted::new(learned, columns, network, kept, other).map_err(LearnError::failed)?)))
    }

    /// Everything that decides a fit, besides the data, the seed and the options of the fit.
    pub(crate) fn decided_by() -> serde_json::Value {
        serde_json::json!({
            "revision": Head::REVISION,
            "training": [Head::RATE, Head::WEIGHT_DECAY, f64::from(Head::NOISE), DRAWS as f64, MANY as f64],
            "dropout": DROPOUT,
            "passes": PASSES,
            "encoder": Shipped::encoders(),
        })
    }

    /// Restores a recogniser from a model file.
    pub(crate) fn load(card: &ModelCard, arrays: &Arrays) -> std::result::Result<Self, ModelError> {
        let learned: Learned = card.settings_as()?;
        let columns = Columns::of(&learned.steps.channels, &card.channels);
        if learned.revision != Head::REVISION {
            return Err(ModelError::card("the version of the network"));
        }
        if let Some(fault) = learned.steps.fault() {
            return Err(ModelError::card(fault));
        }
        if learned.calibrations.len() != STAGES || !learned.calibrations.iter().all(|own| own.is_sound(&TEMPERATURES)) {
            return Err(ModelError::card("the calibration"));
        }
        let columns = columns.ok_or_else(|| ModelError::card("the list of channels"))?;
        let (classes, other) = (card.labels.classes.len(), card.labels.other());
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let network =
            Variables::<Head>::new(learned.steps.inputs(), classes, &mut random).map_err(ModelError::failed)?;
        network.read(arrays, "")?;
        let kept = KeptGrasps::read(arrays, learned.kept, &learned.steps, classes)?;
        Ok(Self(Arc::new(Fitted::new(learned, columns, network, kept, other).map_err(ModelError::failed)?)))
    }
}

impl Fitted {
    fn new(
        learned: Learned,
        columns: Columns,
        network: Variables<Head>,
        kept: KeptGrasps,
        other: Option<usize>,
    ) -> Result<Self> {
        let answering = Answering::new(&network, CLASSES)?;
        Ok(Self { learned, columns, network, answering, kept, other })
    }

    /// Answer to the readings so far.
    fn answer(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let views = self.learned.steps.views(&self.columns.pick(grasp));
        let pmf = uncalibrated(&self.answering, &views);
        let pmf = as_one_of_many(&self.learned.calibrations[stage_of(views.felt)].apply(&pmf), self.other);
        let pmf = before.map_or_else(|| pmf.clone(), |before| before.times(&pmf));
        Verdict { pmf, properties: None }
    }
}

/// Probabilities from the mean scores over a grasp and its mirror image.
fn uncalibrated(network: &Answering, views: &Views) -> Pmf {
    Pmf::from_scores(network.outputs(views).outer.into_iter().map(f64::from))
}

/// Training data of a fit, and how it is done.
struct Work<'a> {
    steps: &'a FeltSteps,
    views: &'a [Views],
    /// Class of each.
    truth: &'a [usize],
    /// Weight of each, where it is not that of its class.
    weights: Option<&'a [f32]>,
    /// Number of classes, and the class "other".
    size: (usize, Option<usize>),
    start: &'a Arrays,
    epochs: usize,
    rate: f64,
    fitting: &'a Fitting<'a>,
}

impl Work<'_> {
    /// Trains on some of the grasps. Progress goes on from one share to another.
    fn train(&self, grasps: &[usize], [from, to]: [f64; 2]) -> Result<Variables<Head>> {
        let (classes, other) = self.size;
        let of_other = other_weight(other, &grasps.iter().map(|k| self.truth[*k]).collect::<Vec<_>>());
        let weight = |k: &usize| match self.weights {
            Some(weights) => weights[*k],
            None => of_other.filter(|(other, _)| *other == self.truth[*k]).map_or(1.0, |(_, weight)| weight as f32),
        };
        let batch = |group: &[usize], random: &mut ChaCha8Rng| {
            group.iter().flat_map(|k| self.views[*k].drawn(Head::NOISE, random)).collect()
        };
        let loss = |scores: &Tensor, group: &[usize]| {
            let y: Vec<u32> = group.iter().map(|k| self.truth[*k] as u32).collect();
            let weights: Vec<f32> = group.iter().map(weight).collect();
            let total: f32 = weights.iter().sum();
            let y = Tensor::from_vec(y, (group.len(), 1), &Device::Cpu)?;
            let weights = Tensor::from_vec(weights, (group.len(), 1), &Device::Cpu)?;
            let likely = candle_nn::ops::log_softmax(scores, D::Minus1)?.gather(&y, 1)?;
            likely.mul(&weights)?.sum_all()?.affine(f64::from(-1.0 / total.max(1e-6)), 0.0)
        };
        let progress = |share: f64| (self.fitting.progress)(from + (to - from) * share);
        let training = Training {
            size: (self.steps.inputs(), classes),
            sequences: grasps,
            epochs: self.epochs,
            rate: self.rate,
            dropout: Some(DROPOUT[usize::from(grasps.len() >= MANY)]),
            start: Some(self.start),
            batch: &batch,
            loss: &loss,
            progress: &progress,
        };
        Variables::trained(&training, self.fitting)
    }

    /// Calibration at a stage of a grasp, on held-out grasps.
    fn calibration(&self, network: &Answering, held_out: &[usize], stage: usize) -> Calibration {
        let answer =
            |k: &usize| (uncalibrated(network, &self.views[*k].clone().until(end_of_stage(stage))), self.truth[*k]);
        let answers: Vec<(Pmf, usize)> = held_out.iter().map(answer).collect();
        let truths: Vec<usize> = answers.iter().map(|(_, truth)| *truth).collect();
        let (_, other) = self.size;
        let other = other_weight(other, &truths);
        let weight = |class: usize| other.filter(|(other, _)| *other == class).map_or(1.0, |(_, weight)| weight);
        Calibration::fit(&answers, weight, &TEMPERATURES).0
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
        let mut arrays = self.0.network.arrays();
        self.0.kept.put_into(&mut arrays);
        arrays
    }

    fn as_pupil(&self) -> Option<&dyn Pupil> {
        (self.0.kept.len() > 0).then_some(self)
    }

    fn parameters(&self) -> usize {
        self.0.network.by_name.values().map(|var| var.elem_count()).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.0.learned).unwrap_or_default()
    }
}

impl Pupil for GeometryNetwork {
    fn taught(&self, data: &Dataset, fitting: &Fitting<'_>) -> std::result::Result<Box<dyn Recogniser>, LearnError> {
        Ok(Box::new(self.with_new(data, fitting)?))
    }

    fn without(&self, class: usize) -> std::result::Result<Box<dyn Recogniser>, LearnError> {
        let Fitted { learned, columns, network, kept, other, .. } = &*self.0;
        let mut arrays = network.arrays();
        let rows = network.by_name.get(&last("bias")).map_or(0, |bias| bias.elem_count());
        for name in ["weight", "bias"].map(last) {
            arrays.remove_row(&name, class);
        }
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let network = Variables::<Head>::new(learned.steps.inputs(), rows.saturating_sub(1), &mut random)
            .map_err(LearnError::failed)?;
        network.read(&arrays, "").map_err(LearnError::failed)?;
        let kept = kept.without(class);
        let learned = Learned { kept: kept.len(), ..learned.clone() };
        let other = other.map(|other| other - usize::from(other > class));
        let fitted = Fitted::new(learned, columns.clone(), network, kept, other).map_err(LearnError::failed)?;
        Ok(Box::new(Self(Arc::new(fitted))))
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
    use crate::{Model, method};

    /// Grasps of objects that are touched at different times.
    fn data_of(names: &[&str]) -> Dataset {
        let channels = Shipped::AnyGripper.encoder().expect("is shipped").channels().to_vec();
        let onset = |name: &str| match name {
            "thick" => 1.0,
            "thin" => 1.5,
            "wide" => 0.5,
            other => panic!("{other}"),
        };
        let grasp = |name: &str, k: usize| {
            let t_s: Vec<f32> = (1..=200).map(|k| k as f32 * 0.02).collect();
            let wiggle = (k * 7919 % 100) as f32 * 1e-3;
            let row = |t: f32| -> Vec<f32> {
                let touched = (t - onset(name) - wiggle).max(0.0);
                let of = |c: &String| if c.starts_with("curvature") { 4.0 * t - touched } else { 0.3 * touched };
                channels.iter().map(of).collect()
            };
            let values = t_s.iter().flat_map(|t| row(*t)).collect();
            Arc::new(Sequence { t_s, values })
        };
        let class = |name: &&str| Class { name: (*name).to_owned(), size: None, shape: None };
        let of = |k: usize| {
            let class = k % names.len();
            let grasp = grasp(names[class], k);
            Example { id: k as i64, class, content: grasp.content(), grasp, ..Example::default() }
        };
        Dataset {
            labels: Labels { classes: names.iter().map(class).collect(), ..Labels::default() },
            examples: (0..30 * names.len()).map(of).collect(),
            about: DataCard::default(),
            channels: channels.clone(),
        }
    }

    fn data() -> Dataset {
        data_of(&["thick", "thin"])
    }

    #[test]
    fn it_learns_a_new_object_and_forgets_none() {
        let method = method("geometry-network").expect("is one");
        let model = method.train(&data(), &quick(1)).expect("fits");
        let lesson = data_of(&["wide"]);
        let taught = model.taught(&lesson, &quick(1)).expect("learns");
        let names: Vec<&str> = taught.card.labels.classes.iter().map(|class| class.name.as_str()).collect();
        assert_eq!((names, &taught.card.taught[..]), (vec!["thick", "thin", "wide"], &["wide".to_owned()][..]));
        // Stored and read again, as a model that learns further.
        let taught = Model::from_bytes("taught", &taught.to_bytes().expect("writes")).expect("reads");
        for data in [data(), lesson.clone()] {
            let data = data.relabelled(&taught.card.labels).expect("knows all");
            let right = |e: &&Example| taught.recogniser.recognise(&e.grasp, None).pmf.top().0 == e.class;
            let right = data.examples.iter().filter(right).count();
            assert!(right * 10 > data.examples.len() * 9, "{right} of {}", data.examples.len());
            assert!(data.examples.iter().all(|example| taught.card.learned.contains(example)));
        }
        let again = taught.taught(&lesson, &quick(1)).expect("learns the same object again");
        assert_eq!((again.card.labels.classes.len(), again.card.taught.len()), (3, 1));
        let signatures = again.signatures.expect("has signatures");
        assert_eq!(signatures.grasps().len(), 3);
    }

    #[test]
    fn it_forgets_and_renames_what_it_was_taught() {
        let model = method("geometry-network").expect("is one").train(&data(), &quick(1)).expect("fits");
        let taught = model.taught(&data_of(&["wide"]), &quick(1)).expect("learns");
        let renamed = taught.renamed("wide", "broad");
        let names = |model: &Model| -> Vec<String> {
            model.card.labels.classes.iter().map(|class| class.name.clone()).collect()
        };
        assert_eq!((names(&renamed)[2].as_str(), &renamed.card.taught[..]), ("broad", &["broad".to_owned()][..]));
        let more = renamed.taught(&data_of(&["thick"]), &quick(1)).expect("learns more");
        assert_eq!(more.card.labels.classes.len(), 3);
        let least = renamed.without("broad").expect("forgets");
        let least = Model::from_bytes("least", &least.to_bytes().expect("writes")).expect("reads");
        assert_eq!((names(&least), least.card.taught.len()), (names(&model), 0));
        assert_eq!(least.signatures.as_ref().map(|own| own.grasps().len()), Some(2));
        for example in &data().examples {
            let [with, without] = [&renamed, &least].map(|model| model.recogniser.recognise(&example.grasp, None).pmf);
            let [a, b] = [with, without].map(|pmf| pmf.probabilities()[0] > pmf.probabilities()[1]);
            assert_eq!(a, b, "the order of the others stays");
        }
        assert!(least.taught(&data_of(&["wide"]), &quick(1)).is_ok(), "it still has grasps to learn with");
        let refused = least.without("thin").map(|model| model.card).expect_err("was not taught");
        assert!(refused.to_string().contains("was not taught \"thin\""), "{refused}");
    }

    #[test]
    fn a_model_that_keeps_no_grasps_learns_nothing_new() {
        let knn = method("knn").expect("is one").train(&data(), &quick(1)).expect("fits");
        let error = knn.taught(&data_of(&["wide"]), &quick(1)).map(|model| model.card).expect_err("cannot");
        assert!(error.to_string().contains("geometry-network"), "{error}");
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
