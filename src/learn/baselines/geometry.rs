//! Geometry encoder: what a grasp tells about the size, place, mass and shape of the object, whatever the object is. A
//! network in plain candle, trained on random shapes; its features serve classifiers of objects.
//!
//! It answers from the beginning of a grasp too: half of the training grasps end early, and one input says which steps have
//! been felt.

use super::answering::Answering;
use super::candle_network::{CandleNetwork, Pass, Training, Variables};
use super::convolution::{DENSE, Trunk};
use super::felt_steps::{FeltSteps, LEAST_FELT, STAGES, Views, end_of_stage, stage_of};
use super::measures::{Geometry, GeometryScores, Measure, MeasureEstimate, MeasureScore, Measured, Touch};
use crate::arrays::{Arrays, ModelError};
use crate::data::{DataCard, Dataset, Example, Sequence, fnv_1a};
use crate::features::Levels;
use crate::fitting::{Fitting, LearnError};
use crate::pmf::Pmf;
use crate::tensor_file::{self, TensorFile};
use candle_core::{Device, Result, Tensor};
use candle_nn::{Linear, Module as _, VarBuilder};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// Fitted geometry encoder.
pub struct GeometryEncoder {
    learned: Learned,
    network: Variables<Encoder>,
    answering: Answering,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    #[serde(flatten)]
    steps: FeltSteps,
    shapes: Vec<String>,
    revision: u32,
    /// Mean and standard deviation of each quantity on its scale.
    scales: Vec<[f64; 2]>,
    /// Half width of the 90 % range in units of the network's own spread, for each stage of a grasp and each quantity.
    spreads: Vec<Vec<f64>>,
    /// Numbers of training grasps and of objects.
    trained_on: [usize; 2],
}

/// Kinds of grasps that a model ships for, each with a geometry encoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shipped {
    /// Perfect sensors on the gripper of the default scene; objects are free.
    PerfectSensors,
    /// Real sensors on any gripper, after an empty close; objects are free.
    AnyGripper,
    /// Perfect sensors on the gripper of the default scene; objects are held in place.
    FixedObjects,
}

impl Shipped {
    /// All.
    pub const ALL: [Self; 3] = [Self::PerfectSensors, Self::AnyGripper, Self::FixedObjects];

    /// Name of the encoder's file. Encoders learn from free and fixed objects.
    pub fn encoder_file(self) -> &'static str {
        match self {
            Self::PerfectSensors | Self::FixedObjects => "geometry.safetensors",
            Self::AnyGripper => "geometry-any-gripper.safetensors",
        }
    }

    /// The kind of such grasps.
    pub fn of(data: &DataCard) -> Self {
        if data.from_perfect_sensors() { Self::simulated(data.fixed() == Some(true)) } else { Self::AnyGripper }
    }

    /// The kind of simulated grasps of an object that is held in place or free.
    pub fn simulated(fixed: bool) -> Self {
        if fixed { Self::FixedObjects } else { Self::PerfectSensors }
    }

    fn encoder_bytes(self) -> &'static [u8] {
        match self {
            Self::PerfectSensors | Self::FixedObjects => include_bytes!("../../../models/geometry.safetensors"),
            Self::AnyGripper => include_bytes!("../../../models/geometry-any-gripper.safetensors"),
        }
    }

    /// The geometry encoder, decoded once.
    pub fn encoder(self) -> std::result::Result<Arc<GeometryEncoder>, ModelError> {
        type Decoded = OnceLock<std::result::Result<Arc<GeometryEncoder>, ModelError>>;
        static ENCODERS: [Decoded; Shipped::ALL.len()] = [const { OnceLock::new() }; Shipped::ALL.len()];
        let decode = || GeometryEncoder::from_bytes(self.encoder_file(), self.encoder_bytes()).map(Arc::new);
        ENCODERS[self as usize].get_or_init(decode).clone()
    }

    /// Hash of all encoders, part of the fingerprint of methods that read their features.
    pub(super) fn encoders() -> u64 {
        fnv_1a([Self::PerfectSensors, Self::AnyGripper].iter().flat_map(|own| own.encoder_bytes().iter().copied()))
    }
}

/// Name of the last layer.
const LAST: &str = "last";
/// Number of quantities.
const MEASURES: usize = Measure::ALL.len();
/// One in this many objects is held out, to measure how far the estimates are off.
const HELD_OUT: usize = 8;
/// Weight of the shapes' cross entropy beside the mean loss of a quantity.
const SHAPE_WEIGHT: f64 = 0.1;
/// Bounds of the logarithm of the spread, in standard deviations of a quantity.
const SPREADS: std::ops::RangeInclusive<f64> = -5.0..=2.0;
/// Half width of the 90 % range of a Laplace distribution of unit scale.
const NINETY: f64 = std::f64::consts::LN_10;

/// [`Trunk`], then a linear layer: mean and logarithm of the spread of each quantity, scores of the shapes.
struct Encoder {
    trunk: Trunk,
    last: Linear,
}

impl CandleNetwork for Encoder {
    const REVISION: u32 = 1;
    const EPOCHS: usize = 40;
    const RATE: f64 = 3e-3;
    const WEIGHT_DECAY: f64 = 0.02;
    const NOISE: f32 = 0.05;

    fn new(inputs: usize, outputs: usize, variables: &VarBuilder<'_>) -> Result<Self> {
        Ok(Self { trunk: Trunk::new(inputs, variables)?, last: candle_nn::linear(DENSE, outputs, variables.pp(LAST))? })
    }

    fn scores(&self, x: &Tensor, pass: &mut Pass<'_>) -> Result<Tensor> {
        self.last.forward(&self.trunk.forward(x, 0.1, pass)?)
    }
}

impl GeometryEncoder {
    /// Fits an encoder to grasps of objects of known geometry. `channels` names the readings, `shapes` the approximate shapes.
    pub fn fit(
        channels: &[String],
        shapes: &[String],
        touches: &[Touch],
        fitting: &Fitting<'_>,
    ) -> std::result::Result<Self, LearnError> {
        if touches.is_empty() {
            return Err(LearnError::no_data());
        }
        let scales = (0..MEASURES).map(|k| scale_of(k, touches)).collect();
        let mut objects: Vec<usize> = touches.iter().map(|touch| touch.object).collect();
        objects.sort_unstable();
        objects.dedup();
        let learned = Learned {
            steps: steps_of(channels, touches),
            shapes: shapes.to_vec(),
            revision: Encoder::REVISION,
            scales,
            spreads: vec![vec![NINETY; MEASURES]; STAGES],
            trained_on: [touches.len(), objects.len()],
        };
        let is_held_out = |touch: &Touch| touch.object % HELD_OUT == HELD_OUT - 1;
        let of = |held_out: bool| -> Vec<usize> {
            (0..touches.len()).filter(|k| is_held_out(&touches[*k]) == held_out).collect()
        };
        let network = learned.train(touches, &of(false), fitting).map_err(LearnError::failed)?;
        fitting.check()?;
        let answering = Answering::new(&network, LAST).map_err(LearnError::failed)?;
        let mut encoder = Self { learned, network, answering };
        let held_out: Vec<&Touch> = of(true).into_iter().map(|k| &touches[k]).collect();
        encoder.learned.spreads = encoder.measured_spreads(&held_out);
        Ok(encoder)
    }

    /// Restores an encoder from its settings and arrays.
    pub fn load(settings: &serde_json::Value, arrays: &Arrays) -> std::result::Result<Self, ModelError> {
        let encoder = Self::load_from(settings, arrays, "")?;
        arrays.require_same_form(&encoder.arrays())?;
        Ok(encoder)
    }

    /// Restores an encoder from those of these arrays whose names begin with a prefix.
    pub(super) fn load_from(
        settings: &serde_json::Value,
        arrays: &Arrays,
        prefix: &str,
    ) -> std::result::Result<Self, ModelError> {
        let learned: Learned = serde_json::from_value(settings.clone())
            .map_err(|error| ModelError(format!("invalid settings on its card: {error}")))?;
        learned.check()?;
        let outputs = 2 * MEASURES + learned.shapes.len();
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let network = Variables::new(learned.steps.inputs(), outputs, &mut random).map_err(ModelError::failed)?;
        network.read(arrays, prefix)?;
        let answering = Answering::new(&network, LAST).map_err(ModelError::failed)?;
        Ok(Self { learned, network, answering })
    }

    /// Decodes a file of [`GeometryEncoder::to_bytes`]. `name` is the file name in errors.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> std::result::Result<Self, ModelError> {
        let file = TensorFile::decode(bytes).map_err(|cause| ModelError::malformed(name, cause))?;
        let settings = serde_json::from_str(&file.card)
            .map_err(|error| ModelError::malformed(name, format!("invalid card: {error}")))?;
        let loaded = file.arrays().and_then(|arrays| Self::load(&settings, &arrays));
        loaded.map_err(|cause| ModelError::invalid(name, &cause))
    }

    /// Encodes the encoder as a safetensors file.
    pub fn to_bytes(&self) -> std::result::Result<Vec<u8>, ModelError> {
        tensor_file::encode(self.settings().to_string(), &self.arrays())
            .map_err(|cause| ModelError::malformed("a geometry encoder", cause))
    }

    /// Settings for [`GeometryEncoder::load`].
    pub fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }

    /// Learned parameters.
    pub fn arrays(&self) -> Arrays {
        self.network.arrays()
    }

    /// Channels that it reads.
    pub fn channels(&self) -> &[String] {
        &self.learned.steps.channels
    }

    /// Approximate shapes that it distinguishes.
    pub fn shapes(&self) -> &[String] {
        &self.learned.shapes
    }

    /// Estimates the geometry from the readings so far; `None` before the first contact.
    pub fn measure(&self, grasp: &Sequence) -> Option<Measured> {
        let views = self.learned.steps.views(grasp);
        if views.felt < LEAST_FELT || !self.has_touched(grasp) {
            return None;
        }
        let (means, shapes) = (self.answering.outputs(&views).outer, 2 * MEASURES);
        let stage = stage_of(views.felt);
        let estimate = |k: usize, measure: Measure| {
            let [centre, deviation] = self.learned.scales[k];
            let spread = f64::from(means[MEASURES + k]).clamp(*SPREADS.start(), *SPREADS.end()).exp();
            let half = self.learned.spreads[stage][k] * spread * deviation;
            let x = centre + deviation * f64::from(means[k]);
            let least = if measure.is_logarithmic() { f64::NEG_INFINITY } else { 0.0 };
            let at = |x: f64| measure.off_scale(x.max(least));
            MeasureEstimate { measure, value: at(x), range: [at(x - half), at(x + half)] }
        };
        let estimates = Measure::ALL.iter().enumerate().map(|(k, measure)| estimate(k, *measure)).collect();
        let shape = Pmf::from_scores(means[shapes..].iter().map(|score| f64::from(*score)));
        Some(Measured { estimates, shape })
    }

    /// True once a pad has felt more than the least force of a contact.
    fn has_touched(&self, grasp: &Sequence) -> bool {
        let onset = |channel: &String| Levels::of(channel, f32::INFINITY).onsets.first().copied();
        let onsets: Vec<f32> = self.learned.steps.channels.iter().map(|c| onset(c).unwrap_or(f32::INFINITY)).collect();
        grasp.rows().any(|(_, row)| row.iter().zip(&onsets).any(|(x, onset)| x > onset))
    }

    /// Judges the estimates on grasps, of which the first seconds are read.
    pub fn judge(&self, touches: &[Touch], seconds: f32) -> GeometryScores {
        let measured: Vec<(Measured, &Geometry)> = touches
            .iter()
            .filter_map(|touch| Some((self.measure(&touch.grasp.until(seconds))?, &touch.geometry)))
            .collect();
        let count = measured.len().max(1) as f64;
        let of_measure = |k: usize| {
            let estimates = || measured.iter().map(|(own, truth)| (&own.estimates[k], truth.values[k]));
            let mut errors: Vec<f64> = estimates().map(|(own, truth)| (own.value - truth).abs()).collect();
            errors.sort_by(f64::total_cmp);
            let inside = estimates().filter(|(own, truth)| (own.range[0]..=own.range[1]).contains(truth)).count();
            MeasureScore {
                measure: Measure::ALL[k],
                median_error: errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN),
                inside: inside as f64 / count,
            }
        };
        let with_shape: Vec<bool> =
            measured.iter().filter_map(|(own, truth)| Some(own.shape.top().0 == truth.shape?)).collect();
        GeometryScores {
            measures: (0..MEASURES).map(of_measure).collect(),
            shape: with_shape.iter().filter(|right| **right).count() as f64 / with_shape.len().max(1) as f64,
            grasps: measured.len(),
        }
    }

    /// Number of features.
    pub(crate) fn width(&self) -> usize {
        DENSE + 2 * MEASURES + self.learned.shapes.len()
    }

    /// Features of the readings so far: values before the last layer and all outputs, mean of the grasp and its mirror image.
    pub(crate) fn features(&self, grasp: &Sequence) -> Vec<f32> {
        let views = self.learned.steps.views(grasp);
        let outputs = self.answering.outputs(&views);
        outputs.inner.into_iter().chain(outputs.outer).collect()
    }

    /// Number and scaling of its inputs, for networks that start from it.
    pub(super) fn steps(&self) -> &FeltSteps {
        &self.learned.steps
    }

    /// Half widths that hold nine in ten of the held-out grasps, for each stage of a grasp and each quantity.
    fn measured_spreads(&self, held_out: &[&Touch]) -> Vec<Vec<f64>> {
        let mut spreads = self.learned.spreads.clone();
        for (stage, of_stage) in spreads.iter_mut().enumerate() {
            let mut off = vec![Vec::new(); MEASURES];
            for touch in held_out {
                let views = self.learned.steps.views(&touch.grasp).until(end_of_stage(stage));
                let means = self.answering.outputs(&views).outer;
                for (k, off) in off.iter_mut().enumerate() {
                    let spread = f64::from(means[MEASURES + k]).clamp(*SPREADS.start(), *SPREADS.end()).exp();
                    off.push((f64::from(means[k]) - self.learned.target(k, touch)).abs() / spread);
                }
            }
            for (spread, mut off) in of_stage.iter_mut().zip(off) {
                off.sort_by(f64::total_cmp);
                // One more than nine tenths, as a finite sample wants it.
                let at = ((off.len() + 1) as f64 * 0.9).ceil() as usize;
                *spread = off.get(at.saturating_sub(1)).or(off.last()).copied().unwrap_or(NINETY);
            }
        }
        spreads
    }
}

impl Learned {
    fn check(&self) -> std::result::Result<(), ModelError> {
        let part = |part| Err(ModelError::card(part));
        let all_finite = |rows: &[Vec<f64>]| rows.iter().flatten().all(|x| x.is_finite());
        if self.revision != Encoder::REVISION {
            part("the version of the encoder")
        } else if let Some(fault) = self.steps.fault() {
            part(fault)
        } else if self.scales.len() != MEASURES || !self.scales.iter().flatten().all(|x| x.is_finite()) {
            part("the scaling of quantities")
        } else if self.spreads.len() != STAGES
            || self.spreads.iter().any(|of_stage| of_stage.len() != MEASURES)
            || !all_finite(&self.spreads)
        {
            part("the spread of quantities")
        } else if self.shapes.is_empty() || self.shapes.len() > 64 {
            part("the list of shapes")
        } else {
            Ok(())
        }
    }

    /// Value of a quantity that the network should give.
    fn target(&self, measure: usize, touch: &Touch) -> f64 {
        let [centre, deviation] = self.scales[measure];
        (Measure::ALL[measure].on_scale(touch.geometry.values[measure]) - centre) / deviation
    }

    fn train(&self, touches: &[Touch], used: &[usize], fitting: &Fitting<'_>) -> Result<Variables<Encoder>> {
        let views: Vec<Views> = touches.iter().map(|touch| self.steps.views(&touch.grasp)).collect();
        let batch = |group: &[usize], random: &mut ChaCha8Rng| {
            group.iter().flat_map(|k| views[*k].drawn(Encoder::NOISE, random)).collect()
        };
        let shapes = self.shapes.len();
        let loss = |outputs: &Tensor, group: &[usize]| {
            let y: Vec<f32> = group
                .iter()
                .flat_map(|k| (0..MEASURES).map(move |measure| self.target(measure, &touches[*k]) as f32))
                .collect();
            let y = Tensor::from_vec(y, (group.len(), MEASURES), &Device::Cpu)?;
            let mean = outputs.narrow(1, 0, MEASURES)?;
            let spread = outputs.narrow(1, MEASURES, MEASURES)?.clamp(*SPREADS.start(), *SPREADS.end())?;
            // Negative log-likelihood of a Laplace distribution.
            let off = (mean - y)?.abs()?.mul(&spread.neg()?.exp()?)?;
            let loss = (off + spread)?.mean_all()?;
            let known: Vec<(u32, u32)> =
                (0_u32..).zip(group).filter_map(|(row, k)| Some((row, touches[*k].geometry.shape? as u32))).collect();
            if known.is_empty() {
                return Ok(loss);
            }
            let count = known.len();
            let (rows, shape): (Vec<u32>, Vec<u32>) = known.into_iter().unzip();
            let scores = outputs.narrow(1, 2 * MEASURES, shapes)?.contiguous()?;
            let scores = scores.index_select(&Tensor::from_vec(rows, count, &Device::Cpu)?, 0)?;
            let shape = Tensor::from_vec(shape, count, &Device::Cpu)?;
            loss + (SHAPE_WEIGHT * candle_nn::loss::cross_entropy(&scores, &shape)?)?
        };
        let epochs = if fitting.quick { 4 } else { Encoder::EPOCHS };
        let size = (self.steps.inputs(), 2 * MEASURES + shapes);
        let training = Training {
            size,
            sequences: used,
            epochs,
            rate: Encoder::RATE,
            dropout: None,
            start: None,
            batch: &batch,
            loss: &loss,
            progress: fitting.progress,
        };
        Variables::trained(&training, fitting)
    }
}

/// Inputs for such grasps.
fn steps_of(channels: &[String], touches: &[Touch]) -> FeltSteps {
    let examples = touches.iter().map(|touch| Example { grasp: Arc::clone(&touch.grasp), ..Example::default() });
    FeltSteps::fit(&Dataset { channels: channels.to_vec(), examples: examples.collect(), ..Dataset::default() })
}

/// Mean and standard deviation of a quantity on its scale.
fn scale_of(measure: usize, touches: &[Touch]) -> [f64; 2] {
    let values = || touches.iter().map(|touch| Measure::ALL[measure].on_scale(touch.geometry.values[measure]));
    let count = touches.len() as f64;
    let mean = values().sum::<f64>() / count;
    let deviation = (values().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
    [mean, deviation.max(1e-6)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance_tests::quick;
    use rand::RngExt;

    /// The force grows faster the wider the object is, which noise hides at first; its shape shows in the other channel.
    fn touches(count: usize) -> Vec<Touch> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let touch = |object: usize| {
            let width = random.random_range(0.01..0.08);
            let shape = object % 2;
            let t_s: Vec<f32> = (1..=200).map(|k| k as f32 * 0.02).collect();
            let mut noise = || 0.2 * random.random::<f32>();
            let row = |t: &f32| {
                let force = 0.05 + 5.0 * width as f32 * (t - 0.6) + noise();
                let bend = t.min(2.0) * (1.0 + shape as f32) + noise();
                [if *t > 0.6 { force } else { 0.0 }, bend]
            };
            let values = t_s.iter().flat_map(row).collect();
            let mut values_of = [0.02; MEASURES];
            values_of[3] = width;
            let geometry = Geometry { values: values_of, shape: Some(shape) };
            Touch { grasp: Arc::new(Sequence { t_s, values }), geometry, object }
        };
        (0..count).map(touch).collect()
    }

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|name| (*name).to_owned()).collect()
    }

    fn fitted(touches: &[Touch]) -> GeometryEncoder {
        let (channels, shapes) = (names(&["force_left", "bend"]), names(&["round", "flat"]));
        GeometryEncoder::fit(&channels, &shapes, touches, &quick(1)).expect("fits")
    }

    #[test]
    fn widths_are_measured_with_honest_spread_from_the_beginning_on() {
        let all = touches(600);
        let encoder = fitted(&all[..400]);
        let judge = |until: f32| {
            let (mut off, mut inside, mut right) = (0.0, 0, 0);
            for touch in &all[400..] {
                let measured = encoder.measure(&touch.grasp.until(until)).expect("has felt enough");
                let width = measured.of(Measure::Width).expect("is measured");
                let truth = touch.geometry.values[3];
                off += (width.value - truth).abs() / 200.0;
                inside += u32::from((width.range[0]..=width.range[1]).contains(&truth));
                right += u32::from(Some(measured.shape.top().0) == touch.geometry.shape);
            }
            (off, inside, right)
        };
        let (whole, early) = (judge(4.0), judge(0.9));
        assert!(whole.0 < 0.006 && whole.2 > 190, "{whole:?}");
        assert!(early.0 > 2.0 * whole.0, "the beginning tells less: {early:?}, {whole:?}");
        assert!((155..=200).contains(&whole.1) && (155..=200).contains(&early.1), "{whole:?}, {early:?}");
        assert!(encoder.measure(&all[0].grasp.until(0.59)).is_none(), "nothing is known before contact");
    }

    #[test]
    fn an_encoder_comes_back_from_its_arrays() {
        let all = touches(60);
        let encoder = fitted(&all);
        let again = GeometryEncoder::load(&encoder.settings(), &encoder.arrays()).expect("loads");
        assert_eq!(encoder.measure(&all[7].grasp), again.measure(&all[7].grasp));
        assert_eq!(encoder.features(&all[7].grasp), again.features(&all[7].grasp));
        assert_eq!(encoder.features(&all[7].grasp).len(), encoder.width());
        let mut settings = encoder.settings();
        settings["spreads"] = serde_json::json!([]);
        assert!(GeometryEncoder::load(&settings, &encoder.arrays()).is_err());
        assert!(GeometryEncoder::load(&encoder.settings(), &Arrays::default()).is_err());
        assert!(encoder.features(&Sequence::default()).iter().all(|x| x.is_finite()));
    }
}
