//! The networks as the paper has them (section III, V-C and V-E): the macro-layer, the dual-stage LSTM and its iterated
//! form, without any of our additions.
//!
//! - Channels are standardised; nothing is compressed, added, augmented or calibrated.
//! - Stage one reads a whole grasp and decides size and shape. Stage two reads the channels again, at every step beside
//!   that decision (one-hot), and is read out at the end.
//! - Each stage learns from grasps of its own, stage two with what stage one decides on grasps that it has not seen.
//! - The iterated form also reads the PMF of an earlier grasp of the same object at every step.
//!
//! What the paper leaves open is chosen so: AdamW with one cycle of the learning rate, gradients of at most unit length,
//! units that begin with memories of up to a whole grasp (the fingers have let go at the last sample, where the network is
//! read out: with forget gates that begin at a bias of one it learns nothing, F1 .01 instead of .53); standardisation by mean and
//! deviation of all training readings; the first grasp follows a uniform PMF, as do half of the training grasps of the
//! iterated form; its mock network answers each half of the grasps of stage two after learning from the other half, so that
//! no PMF is of a grasp it has learned from.

use super::calibrated::{Subset, progress_of};
use super::macro_layer::{LiveMacroLayer, MacroLayer, MacroShape};
use super::preparation::Preparation;
use super::recipe::Recipe;
use super::tactile_network::halves_of;
use super::training::train;
use super::training_set::{Earlier, StageInputs};
use crate::arrays::Arrays;
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::mirror::mirror;
use crate::model::{LoadError, ModelCard};
use crate::pmf::Pmf;
use crate::recogniser::{Properties, Recogniser, Verdict};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Fitted network of the paper, with one stage or two.
#[derive(Clone, Debug)]
pub(super) struct PaperNetwork {
    learned: Learned,
    stage_one: Option<MacroLayer>,
    stage_two: MacroLayer,
}

/// Settings and fitted values other than weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    recipe: Recipe,
    preparation: Preparation,
    /// Shape of each stage.
    stage_one: Option<MacroShape>,
    stage_two: MacroShape,
}

/// Names of the stages in files.
const STAGES: [&str; 2] = ["stage_one", "stage_two"];

/// Data and settings of a fit.
struct Work<'a> {
    data: &'a Dataset,
    recipe: &'a Recipe,
    fitting: &'a Fitting<'a>,
    preparation: Preparation,
    /// Inputs of each grasp.
    readings: Vec<Vec<f32>>,
}

impl PaperNetwork {
    /// Fits a network. `method` is its title in errors.
    pub(super) fn fit(
        data: &Dataset,
        recipe: Recipe,
        method: &'static str,
        fitting: &Fitting<'_>,
    ) -> Result<Self, LearnError> {
        let (own, joined) = (data.examples.len(), fitting.joined(data)?);
        match fitting.second.filter(|_| recipe.two_stages) {
            Some(second) => check_enough(data, 1).and(check_enough(second, 2))?,
            None => check_enough(&joined, if recipe.two_stages { 4 } else { 2 })?,
        }
        let data = joined.as_ref();
        if recipe.two_stages && !data.labels.have_properties() {
            return Err(LearnError::NoProperties { method });
        }
        let preparation = Preparation::standardising(data, recipe.rate_hz);
        let readings: Vec<Vec<f32>> = data.examples.iter().map(|e| preparation.inputs(&e.grasp)).collect();
        let everything: Vec<usize> = (0..readings.len()).collect();
        let (for_one, for_two) = match fitting.second {
            _ if !recipe.two_stages => (Vec::new(), everything),
            Some(_) => (everything[..own].to_vec(), everything[own..].to_vec()),
            None => halves_of(data, fitting.seed),
        };
        let work = Work { data, recipe: &recipe, fitting, preparation, readings };
        let end_of_one = match (recipe.two_stages, recipe.iterated) {
            (false, _) => 0.0,
            (true, false) => 0.5,
            (true, true) => 0.33,
        };
        let stage_one = if recipe.two_stages { Some(work.fit_stage_one(&for_one, 0.0..end_of_one)?) } else { None };
        let stage_two = work.fit_stage_two(&for_two, stage_one.as_ref(), end_of_one)?;
        let learned = Learned {
            preparation: work.preparation,
            stage_one: stage_one.as_ref().map(|layer| layer.shape().clone()),
            stage_two: stage_two.shape().clone(),
            recipe,
        };
        Ok(Self { learned, stage_one, stage_two })
    }

    /// Restores a network from a model file.
    pub(super) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, LoadError> {
        let learned: Learned = card.settings_as()?;
        learned.recipe.check()?;
        if !learned.preparation.is_sound_and_standardising(card.channels.len()) {
            return Err(LoadError::Card { part: "the input scaling" });
        }
        let labels = &card.labels;
        let readings = learned.preparation.width();
        let properties = [labels.sizes.len(), labels.shapes.len()];
        let classes = labels.classes.len();
        let stage_one = match &learned.stage_one {
            Some(shape) => Some(read_layer(arrays, STAGES[0], shape, readings, &properties)?),
            None => None,
        };
        let beside = stage_one.as_ref().map_or(0, |_| properties.iter().sum());
        let before = if learned.recipe.iterated { classes } else { 0 };
        let stage_two = read_layer(arrays, STAGES[1], &learned.stage_two, readings + beside + before, &[classes])?;
        Ok(Self { learned, stage_one, stage_two })
    }
}

fn read_layer(
    arrays: &Arrays,
    name: &str,
    shape: &MacroShape,
    inputs: usize,
    groups: &[usize],
) -> Result<MacroLayer, LoadError> {
    if !shape.fits(inputs, groups) || shape.with_prior {
        return Err(LoadError::Card { part: "the shape of the network" });
    }
    MacroLayer::load(shape, name, arrays)
}

/// Scores after the last step of a sequence; `None` for an empty one.
fn last_scores(layer: &MacroLayer, x: &[f32]) -> Option<Vec<f32>> {
    let mut live = LiveMacroLayer::new(layer);
    let mut last = None;
    for row in x.chunks_exact(layer.shape().inputs) {
        last = Some(live.step(row, &[]).to_vec());
    }
    last
}

fn softmax(scores: &[f32]) -> Pmf {
    Pmf::from_scores(scores.iter().map(|s| f64::from(*s)))
}

/// PMFs of size and shape that stage one gives after a whole grasp; `None` for an empty one.
fn properties_of(stage_one: &MacroLayer, readings: &[f32]) -> Option<Properties> {
    let scores = last_scores(stage_one, readings)?;
    let (sizes, shapes) = scores.split_at(*stage_one.shape().groups.first()?);
    Some(Properties { size: softmax(sizes), shape: softmax(shapes) })
}

/// What stage one decides: one for the most likely size and shape, zero for the others.
fn one_hot(properties: &Properties) -> Vec<f32> {
    let of = |pmf: &Pmf| {
        let decided = pmf.top().0;
        (0..pmf.classes()).map(move |class| if class == decided { 1.0 } else { 0.0 })
    };
    of(&properties.size).chain(of(&properties.shape)).collect()
}

/// Adds the same further inputs to every step.
fn with_beside(readings: &[f32], width: usize, beside: &[f32]) -> Vec<f32> {
    readings.chunks_exact(width).flat_map(|row| row.iter().chain(beside)).copied().collect()
}

impl Work<'_> {
    fn shape(&self, inputs: usize, groups: Vec<usize>) -> MacroShape {
        let hidden = (self.recipe.hidden > 0).then_some(self.recipe.hidden);
        MacroShape { inputs, units: self.recipe.units, hidden, groups, with_prior: false }
    }

    /// Training sequences: the readings of each grasp, and beside them the same inputs at every step.
    fn inputs(&self, grasps: &[usize], beside: &[Vec<f32>], targets: Vec<Vec<usize>>) -> StageInputs {
        let readings = self.preparation.width();
        let further = beside.first().map_or(0, Vec::len);
        let exchanged = mirror(&self.data.channels).filter(|_| self.recipe.mirror);
        let sequence = |(k, beside): (&usize, &Vec<f32>)| with_beside(&self.readings[*k], readings, beside);
        StageInputs {
            width: readings + further,
            sequences: grasps.iter().zip(beside).map(sequence).collect(),
            targets,
            mirror: exchanged.map(|own| own.into_iter().chain(readings..readings + further).collect()),
            readings,
            noise: self.recipe.noise,
            earlier: None,
        }
    }

    fn learn(
        &self,
        inputs: &StageInputs,
        groups: Vec<usize>,
        kept: Vec<usize>,
        seed: u64,
        share: Range<f64>,
    ) -> Result<MacroLayer, LearnError> {
        let training = &self.recipe.training;
        let mut go_on = progress_of(self.fitting, share.start, share.end - share.start, training.epochs);
        let shape = self.shape(inputs.width, groups);
        let seed = self.fitting.seed.wrapping_mul(1000).wrapping_add(seed);
        let layer = train(shape, &Subset { inputs, kept }, training, seed, &mut go_on);
        self.fitting.check().map(|()| layer)
    }

    fn fit_stage_one(&self, grasps: &[usize], share: Range<f64>) -> Result<MacroLayer, LearnError> {
        let labels = &self.data.labels;
        let properties = |k: &usize| {
            let class = &labels.classes[self.data.examples[*k].class];
            Some(vec![class.size?, class.shape?])
        };
        // The empty hand has neither size nor shape and is left out.
        let labelled: Vec<usize> = grasps.iter().copied().filter(|k| properties(k).is_some()).collect();
        let targets = labelled.iter().filter_map(properties).collect();
        let inputs = self.inputs(&labelled, &vec![Vec::new(); labelled.len()], targets);
        let groups = vec![labels.sizes.len(), labels.shapes.len()];
        self.learn(&inputs, groups, (0..labelled.len()).collect(), 0, share)
    }

    fn fit_stage_two(
        &self,
        grasps: &[usize],
        stage_one: Option<&MacroLayer>,
        start: f64,
    ) -> Result<MacroLayer, LearnError> {
        let labels = &self.data.labels;
        let classes = labels.classes.len();
        let truth: Vec<usize> = grasps.iter().map(|k| self.data.examples[*k].class).collect();
        let targets: Vec<Vec<usize>> = truth.iter().map(|class| vec![*class]).collect();
        let decided = |k: &usize| match stage_one {
            Some(stage_one) => properties_of(stage_one, &self.readings[*k])
                .map_or_else(|| vec![0.0; stage_one.shape().outputs()], |properties| one_hot(&properties)),
            None => Vec::new(),
        };
        let decided: Vec<Vec<f32>> = grasps.iter().map(decided).collect();
        let inputs = self.inputs(grasps, &decided, targets.clone());
        let all: Vec<usize> = (0..grasps.len()).collect();
        if !self.recipe.iterated {
            return self.learn(&inputs, vec![classes], all, 500, start..1.0);
        }
        let middle = 0.5 * (start + 1.0);
        let alone = self.mock(grasps, &inputs, start..middle)?;
        let with_uniform = |decided: &Vec<f32>| -> Vec<f32> {
            decided.iter().copied().chain(std::iter::repeat_n(1.0 / classes as f32, classes)).collect()
        };
        let beside: Vec<Vec<f32>> = decided.iter().map(with_uniform).collect();
        let earlier = Some(Earlier::new(alone, &truth, classes, 1));
        let pairs = StageInputs { earlier, ..self.inputs(grasps, &beside, targets) };
        self.learn(&pairs, vec![classes], all, 600, middle..1.0)
    }

    /// PMFs of the mock network (section V-E): it learns from the other parts of the grasps.
    fn mock(&self, grasps: &[usize], inputs: &StageInputs, share: Range<f64>) -> Result<Vec<(usize, Pmf)>, LearnError> {
        let parts = self.recipe.parts;
        let part_of = self.data.part(grasps).folds(parts, self.fitting.seed ^ 0xf01d);
        let classes = self.data.labels.classes.len();
        let length = (share.end - share.start) / parts as f64;
        let mut alone = Vec::new();
        for part in 0..parts {
            let from = share.start + length * part as f64;
            let of = |inside: bool| -> Vec<usize> {
                (0..part_of.len()).filter(|n| (part_of[*n] == part) == inside).collect()
            };
            let layer = self.learn(inputs, vec![classes], of(false), 510 + part as u64, from..from + length)?;
            let answered = of(true).into_iter();
            alone.extend(answered.filter_map(|n| Some((n, softmax(&last_scores(&layer, &inputs.sequences[n])?)))));
        }
        Ok(alone)
    }
}

impl Recogniser for PaperNetwork {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let classes = self.stage_two.shape().outputs();
        let before = before.filter(|before| before.classes() == classes);
        let inputs = self.learned.preparation.inputs(grasp);
        let properties = self.stage_one.as_ref().and_then(|stage_one| properties_of(stage_one, &inputs));
        let mut beside = properties.as_ref().map(one_hot).unwrap_or_default();
        let iterated = self.learned.recipe.iterated;
        if iterated {
            let uniform = Pmf::uniform(classes);
            beside.extend(before.unwrap_or(&uniform).probabilities().iter().map(|p| *p as f32));
        }
        let sequence = with_beside(&inputs, self.learned.preparation.width(), &beside);
        let pmf = last_scores(&self.stage_two, &sequence).map(|scores| softmax(&scores));
        let pmf = match (pmf, before) {
            (None, before) => before.cloned().unwrap_or_else(|| Pmf::uniform(classes)),
            // Without feedback, earlier grasps count as independent observations.
            (Some(pmf), Some(before)) if !iterated => before.times(&pmf),
            (Some(pmf), _) => pmf,
        };
        Verdict { pmf, properties }
    }

    fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        let layers = [self.stage_one.as_ref(), Some(&self.stage_two)];
        for (name, layer) in STAGES.into_iter().zip(layers).filter_map(|(name, layer)| Some((name, layer?))) {
            layer.save(name, &mut arrays);
        }
        arrays
    }

    fn parameters(&self) -> usize {
        self.stage_one.iter().chain([&self.stage_two]).map(|layer| layer.values().len()).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }

    fn has_stage_one(&self) -> bool {
        self.stage_one.is_some()
    }
}
