//! The paper's recognisers: the macro-layer alone, the dual-stage LSTM, and its iterated form (Fig. 2).
//!
//! ```text
//! readings --+--> stage one: macro-layer --> PMF of size, PMF of shape --+
//!            |                                                           v
//!            +------------------- skip connection ------> stage two: macro-layer --> PMF of class
//!                                                                        ^                |
//!                                            (iterated) PMF before ------+<---------------+
//! ```
//!
//! The [`Recipe`] says how it is trained. Tuned, both stages run step by step: at every step stage two takes the output of
//! stage one at that step, so the same network gives a PMF during closing and at the end.
//!
//! Strict is as in the paper (sections III, V-C and V-E), without any of our additions:
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

use super::calibrated::{Calibrated, HeldOut, LiveCalibrated, Plan, pmfs_at_the_end};
use super::macro_layer::{MacroLayer, MacroShape};
use super::preparation::{Binner, Preparation};
use super::recipe::Recipe;
use super::training_set::{Earlier, StageInputs};
use crate::arrays::{Arrays, ModelError};
use crate::belief::{Rejection, StopRule, agreement};
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::model::ModelCard;
use crate::pmf::Pmf;
use crate::recogniser::{LiveRecogniser, Properties, Recogniser, Verdict};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Fitted network with one stage or two.
#[derive(Clone, Debug)]
pub(super) struct TwoStageNetwork {
    learned: Learned,
    stage_one: Option<Calibrated>,
    stage_two: Calibrated,
    rejection: Option<Rejection>,
}

/// Settings and fitted values other than weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Learned {
    recipe: Recipe,
    preparation: Preparation,
    stage_one: Option<NetworkCard>,
    stage_two: NetworkCard,
}

/// Shape of a stage, and its temperatures where it is calibrated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum NetworkCard {
    Calibrated { shape: MacroShape, temperatures: Vec<Vec<f32>> },
    Strict(MacroShape),
}

impl NetworkCard {
    fn of(network: &Calibrated) -> Self {
        let shape = network.shape().clone();
        match network.temperatures.clone() {
            none if none.is_empty() => Self::Strict(shape),
            temperatures => Self::Calibrated { shape, temperatures },
        }
    }
}

/// One in this many grasps is held out for calibration.
const CALIBRATION: usize = 6;
/// Share of known objects that may be rejected as unknown.
const REJECTED_SHARE: f64 = 0.02;
/// Fewest held-out grasps of which this share is a whole grasp.
const LEAST_FOR_REJECTION: usize = (1.0 / REJECTED_SHARE) as usize - 1;
/// Largest number of earlier grasps while training a tuned network.
const MOST_EARLIER: usize = 3;
/// Number of beliefs drawn to calibrate the rejection after each number of grasps.
const DRAWN_BELIEFS: usize = 4000;
/// Largest number of grasps for which the rejection is calibrated.
const MOST_GRASPS: usize = 6;

impl TwoStageNetwork {
    /// Fits a network. `method` is its title in errors.
    pub(super) fn fit(
        data: &Dataset,
        recipe: Recipe,
        method: &'static str,
        fitting: &Fitting<'_>,
    ) -> Result<Self, LearnError> {
        // Every class must have a grasp outside the held-out part.
        let halves = if recipe.two_stages && !recipe.cross_fitted { 2 } else { 1 };
        let (own, data) = (data, fitting.joined(data)?);
        let data = data.as_ref();
        match fitting.second.filter(|_| halves == 2) {
            Some(second) => check_enough(own, if recipe.strict { 1 } else { 2 }).and(check_enough(second, 2))?,
            None => check_enough(data, 2 * halves)?,
        }
        if recipe.two_stages && !data.labels.have_properties() {
            return Err(LearnError::Refused(format!(
                "{method} learns size and shape first, but no class in these data has them; add columns \"size\" and \
                 \"shape\", or train another method"
            )));
        }
        let preparation = match recipe.strict {
            true => Preparation::standardising(data, recipe.rate_hz),
            false => Preparation::fit(data, recipe.rate_hz),
        };
        let readings = data.examples.iter().map(|e| preparation.inputs(&e.grasp)).collect();
        let work = StageFitting { data, recipe: &recipe, fitting, preparation, readings };
        let everything: Vec<usize> = (0..data.examples.len()).collect();
        let (for_one, for_two) = match (halves, fitting.second) {
            (1, _) => (everything.clone(), everything),
            (_, Some(_)) => (everything[..own.examples.len()].to_vec(), everything[own.examples.len()..].to_vec()),
            (_, None) => halves_of(data, fitting.seed),
        };
        let end_of_one = if recipe.two_stages { if recipe.iterated { 0.4 } else { 0.6 } } else { 0.0 };
        let (stage_one, beside) = if recipe.two_stages {
            let (network, held_out) = work.fit_stage_one(&for_one, 0.0..end_of_one)?;
            let beside = for_two.iter().map(|k| work.beside(&network, &held_out, *k)).collect();
            (Some(network), beside)
        } else {
            (None, vec![Vec::new(); for_two.len()])
        };
        let (stage_two, alone) = work.fit_stage_two(&for_two, &beside, &(end_of_one..1.0))?;
        let rejection = if recipe.strict { None } else { calibrated_rejection(&alone, fitting.seed) };
        let learned = Learned {
            preparation: work.preparation,
            stage_one: stage_one.as_ref().map(NetworkCard::of),
            stage_two: NetworkCard::of(&stage_two),
            recipe,
        };
        Ok(Self { learned, stage_one, stage_two, rejection })
    }

    /// Restores a network from a model file.
    pub(super) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, ModelError> {
        let learned: Learned = card.settings_as()?;
        let Recipe { strict, iterated, .. } = learned.recipe;
        learned.recipe.check().map_err(ModelError::failed)?;
        let channels = card.channels.len();
        let is_sound = match strict {
            true => learned.preparation.is_sound_and_standardising(channels),
            false => learned.preparation.is_sound(channels),
        };
        if !is_sound {
            return Err(ModelError::card("the input scaling"));
        }
        let labels = &card.labels;
        let readings = learned.preparation.width();
        let properties = vec![labels.sizes.len(), labels.shapes.len()];
        let read = |name, own, inputs, groups: &[usize]| read_network(arrays, name, (own, strict), inputs, groups);
        let stage_one =
            learned.stage_one.as_ref().map(|own| read("stage_one", own, readings, &properties)).transpose()?;
        let beside = stage_one.as_ref().map_or(0, |network| network.shape().outputs());
        let before = if iterated { labels.classes.len() } else { 0 };
        let stage_two = read("stage_two", &learned.stage_two, readings + beside + before, &[labels.classes.len()])?;
        if stage_two.shape().with_prior != (iterated && !strict) {
            return Err(ModelError::card("the second stage"));
        }
        Ok(Self { learned, stage_one, stage_two, rejection: card.rejection.clone() })
    }

    fn reader(&self) -> LiveNetwork {
        let mut reader = LiveNetwork {
            binner: Binner::new(&self.learned.preparation),
            stage_one: self.stage_one.as_ref().map(LiveCalibrated::new),
            stage_two: LiveCalibrated::new(&self.stage_two),
            iterated: self.learned.recipe.iterated,
            before: Pmf::uniform(self.stage_two.shape().outputs()),
            log_before: Vec::new(),
            row: Vec::new(),
            latest: None,
        };
        reader.begin(None);
        reader
    }

    /// As the paper has it: stage two reads what stage one decides after the whole grasp.
    fn recognise_whole(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        let classes = self.stage_two.shape().outputs();
        let before = before.filter(|before| before.classes() == classes);
        let inputs = self.learned.preparation.inputs(grasp);
        let properties = self.stage_one.as_ref().and_then(|stage_one| stage_one.pmfs_after(&inputs));
        let mut beside = properties.as_deref().map(one_hot).unwrap_or_default();
        let iterated = self.learned.recipe.iterated;
        if iterated {
            let uniform = Pmf::uniform(classes);
            beside.extend(before.unwrap_or(&uniform).probabilities().iter().map(|p| *p as f32));
        }
        let rows = inputs.chunks_exact(self.learned.preparation.width());
        let sequence: Vec<f32> = rows.flat_map(|row| row.iter().chain(&beside)).copied().collect();
        let pmf = match (self.stage_two.pmfs_after(&sequence).and_then(|mut pmfs| pmfs.pop()), before) {
            (None, before) => before.cloned().unwrap_or_else(|| Pmf::uniform(classes)),
            // Without feedback, earlier grasps count as independent observations.
            (Some(pmf), Some(before)) if !iterated => before.times(&pmf),
            (Some(pmf), _) => pmf,
        };
        Verdict { pmf, properties: properties.and_then(properties_of) }
    }
}

fn properties_of(pmfs: Vec<Pmf>) -> Option<Properties> {
    let [size, shape]: [Pmf; 2] = pmfs.try_into().ok()?;
    Some(Properties { size, shape })
}

/// One for the most likely class of each PMF, zero for the others.
fn one_hot(pmfs: &[Pmf]) -> Vec<f32> {
    let of = |pmf: &Pmf| {
        let decided = pmf.top().0;
        (0..pmf.classes()).map(move |class| if class == decided { 1.0 } else { 0.0 })
    };
    pmfs.iter().flat_map(of).collect()
}

fn read_network(
    arrays: &Arrays,
    name: &str,
    (card, strict): (&NetworkCard, bool),
    inputs: usize,
    groups: &[usize],
) -> Result<Calibrated, ModelError> {
    let (shape, temperatures) = match card {
        NetworkCard::Strict(shape) => (shape, Vec::new()),
        NetworkCard::Calibrated { shape, temperatures } => (shape, temperatures.clone()),
    };
    let valid = shape.fits(inputs, groups)
        && temperatures.len() == if strict { 0 } else { groups.len() }
        && temperatures.iter().flatten().all(|t| t.is_finite() && *t > 0.0);
    if !valid {
        return Err(ModelError::card("the shape of the network"));
    }
    Ok(Calibrated { layer: MacroLayer::load(shape, name, arrays)?, temperatures })
}

/// Indices of the grasps for stage one and for stage two.
fn halves_of(data: &Dataset, seed: u64) -> (Vec<usize>, Vec<usize>) {
    let half_of = data.folds(2, seed ^ 0x5eed);
    let of = |half: usize| (0..half_of.len()).filter(|k| half_of[*k] == half).collect();
    (of(0), of(1))
}

/// Data and settings shared by the stages of a fit.
struct StageFitting<'a> {
    data: &'a Dataset,
    recipe: &'a Recipe,
    fitting: &'a Fitting<'a>,
    preparation: Preparation,
    /// Inputs of each grasp.
    readings: Vec<Vec<f32>>,
}

impl StageFitting<'_> {
    /// Part of each of some grasps, stratified by class.
    fn parts(&self, grasps: &[usize], parts: usize) -> Vec<usize> {
        self.data.part(grasps).folds(parts, self.fitting.seed ^ 0xf01d)
    }

    /// Training inputs of some grasps: their readings, and further inputs at every step; the PMF of earlier grasps comes last.
    fn inputs(
        &self,
        grasps: &[usize],
        beside: &[Vec<f32>],
        targets: Vec<Vec<usize>>,
        earlier: Option<Earlier>,
    ) -> StageInputs {
        let readings = self.preparation.width();
        let steps = |k: usize| self.readings[k].len() / readings;
        let added = grasps.iter().zip(beside).find(|(k, _)| steps(**k) > 0).map_or(0, |(k, b)| b.len() / steps(*k));
        let before = earlier.as_ref().map_or_else(Vec::new, |earlier| vec![0.0; earlier.classes]);
        let sequence = |(k, beside): (&usize, &Vec<f32>)| -> Vec<f32> {
            let rows = self.readings[*k].chunks_exact(readings).enumerate();
            let beside = |step: usize| &beside[step * added..(step + 1) * added];
            rows.flat_map(|(step, row)| row.iter().chain(beside(step)).chain(&before)).copied().collect()
        };
        let width = readings + added + before.len();
        let mirror = self.preparation.mirror(&self.data.channels).filter(|_| self.recipe.mirror);
        StageInputs {
            width,
            sequences: grasps.iter().zip(beside).map(sequence).collect(),
            targets,
            mirror: mirror.map(|own| own.into_iter().chain(readings..width).collect()),
            readings,
            noise: self.recipe.noise,
            earlier,
        }
    }

    fn seed(&self, of: u64) -> u64 {
        self.fitting.seed.wrapping_mul(1000).wrapping_add(of)
    }

    /// Settings of a fit to these inputs.
    fn plan<'p>(
        &'p self,
        inputs: &StageInputs,
        groups: &[usize],
        held_out: &'p [usize],
        seed: u64,
        share: Range<f64>,
    ) -> Plan<'p> {
        let Recipe { units, hidden, .. } = *self.recipe;
        let (hidden, groups) = ((hidden > 0).then_some(hidden), groups.to_vec());
        Plan {
            shape: MacroShape { inputs: inputs.width, units, hidden, groups, with_prior: false },
            training: &self.recipe.training,
            held_out: (!self.recipe.strict).then_some(held_out),
            seed: self.seed(seed),
            share,
        }
    }

    fn fit_stage_one(&self, grasps: &[usize], share: Range<f64>) -> Result<(Calibrated, HeldOut), LearnError> {
        let labels = &self.data.labels;
        let properties = |k: &usize| {
            let class = &labels.classes[self.data.examples[*k].class];
            Some(vec![class.size?, class.shape?])
        };
        // The empty hand has neither size nor shape and is left out.
        let labelled: Vec<usize> = grasps.iter().copied().filter(|k| properties(k).is_some()).collect();
        let targets = labelled.iter().filter_map(properties).collect();
        let inputs = self.inputs(&labelled, &vec![Vec::new(); labelled.len()], targets, None);
        let middle = if self.recipe.cross_fitted { 0.5 * (share.start + share.end) } else { share.end };
        let calibration = self.parts(&labelled, CALIBRATION);
        let plan = self.plan(&inputs, &[labels.sizes.len(), labels.shapes.len()], &calibration, 0, share.start..middle);
        let (network, _) = Calibrated::fit(&plan, &inputs, self.fitting)?;
        let mut held_out: HeldOut = vec![None; self.readings.len()];
        if self.recipe.cross_fitted {
            let plan = Plan { share: middle..share.end, ..plan };
            let parts = self.parts(&labelled, self.recipe.parts);
            let of_labelled = Calibrated::cross_fit(&plan, (&parts, self.recipe.parts), &inputs, self.fitting)?;
            for (k, scores) in labelled.into_iter().zip(of_labelled) {
                held_out[k] = scores;
            }
        }
        Ok((network, held_out))
    }

    /// Outputs of stage one, `[steps][outputs]`, for a grasp of stage two, by a network not trained on it: held-out
    /// scores if cross-fitted, otherwise and for objects without size and shape those of the final network. In a strict
    /// network, its decision after the whole grasp, at every step.
    fn beside(&self, network: &Calibrated, held_out: &HeldOut, grasp: usize) -> Vec<f32> {
        let (readings, outputs) = (&self.readings[grasp], network.shape().outputs());
        if self.recipe.strict {
            let decided = network.pmfs_after(readings).as_deref().map(one_hot).unwrap_or_default();
            return decided.repeat(readings.len() / self.preparation.width());
        }
        let scores = held_out[grasp].clone().unwrap_or_else(|| network.scores(readings));
        let pmfs = scores.chunks_exact(outputs).enumerate().flat_map(|(step, row)| network.pmfs(row, step));
        pmfs.flat_map(|pmf| pmf.probabilities().iter().map(|p| *p as f32).collect::<Vec<_>>()).collect()
    }

    /// Fits stage two. Returns also the true class and PMF of each grasp by a network not trained on it.
    fn fit_stage_two(
        &self,
        grasps: &[usize],
        beside: &[Vec<f32>],
        share: &Range<f64>,
    ) -> Result<(Calibrated, Vec<(usize, Pmf)>), LearnError> {
        let (recipe, fitting, classes) = (self.recipe, self.fitting, self.data.labels.classes.len());
        let class_of: Vec<usize> = grasps.iter().map(|k| self.data.examples[*k].class).collect();
        let inputs = |beside: &[Vec<f32>], earlier| {
            self.inputs(grasps, beside, class_of.iter().map(|class| vec![*class]).collect(), earlier)
        };
        let at = |share_of_it: f64| share.start + share_of_it * (share.end - share.start);
        let (calibration, parts) = (self.parts(grasps, CALIBRATION), self.parts(grasps, recipe.parts));
        let complete = inputs(beside, None);
        // The mock networks of the paper (section V-E): their PMFs of held-out grasps stand for earlier grasps.
        let mock = |seed, share| {
            let plan = self.plan(&complete, &[classes], &calibration, seed, share);
            Calibrated::cross_fit(&plan, (&parts, recipe.parts), &complete, fitting)
        };
        if recipe.strict && recipe.iterated {
            let mut alone = last_pmfs(&mock(500, at(0.0)..at(0.5))?, classes, &[]);
            alone.sort_by_key(|(n, _)| parts[*n]);
            let pairs = inputs(beside, Some(Earlier::new(alone, &class_of, classes, 1)));
            let plan = self.plan(&pairs, &[classes], &calibration, 600, at(0.5)..at(1.0));
            return Ok((Calibrated::fit(&plan, &pairs, fitting)?.0, Vec::new()));
        }
        // Cross-fitted, stage two is trained on readings alone and then fine-tuned with the outputs of stage one; otherwise
        // it is trained on both at once, as in the paper.
        let at_once = if recipe.cross_fitted { &inputs(&vec![Vec::new(); grasps.len()], None) } else { &complete };
        let end = at(if recipe.iterated { 0.45 } else { 0.9 });
        let plan = self.plan(at_once, &[classes], &calibration, 500, at(0.0)..end);
        let (mut network, held_out) = Calibrated::fit(&plan, at_once, fitting)?;
        let added = complete.width - at_once.width;
        if added > 0 {
            network.layer = network.layer.with_inputs(added);
            network.refine(&complete, &recipe.refining(), self.seed(550), end..end + 0.05, fitting)?;
        }
        let named = |alone: Vec<(usize, Pmf)>| alone.into_iter().map(|(n, pmf)| (class_of[n], pmf)).collect();
        if !recipe.iterated {
            let alone = last_pmfs(&held_out, classes, &network.temperatures);
            return Ok((network, named(alone)));
        }
        let alone = last_pmfs(&mock(700, at(0.5)..at(0.95))?, classes, &network.temperatures);
        let pairs = inputs(beside, Some(Earlier::new(alone.clone(), &class_of, classes, MOST_EARLIER)));
        // The network starts as the product of experts and learns corrections.
        let gain = network.last_temperature();
        network.layer = network.layer.with_inputs(classes).with_prior(gain);
        network.refine(&pairs, &recipe.refining(), self.seed(600), at(0.95)..at(1.0), fitting)?;
        Ok((network, named(alone)))
    }
}

/// PMF of each held-out sequence after its last step, with the number of the sequence.
fn last_pmfs(held_out: &HeldOut, classes: usize, temperatures: &[Vec<f32>]) -> Vec<(usize, Pmf)> {
    let last = |scores: &Vec<f32>| pmfs_at_the_end(scores, &[classes], temperatures)?.pop();
    held_out.iter().enumerate().filter_map(|(n, scores)| Some((n, last(scores.as_ref()?)?))).collect()
}

/// Draws beliefs after several held-out grasps of the same object and finds the agreement that all but a share of them
/// reach. `None` for fewer grasps than [`LEAST_FOR_REJECTION`].
fn calibrated_rejection(alone: &[(usize, Pmf)], seed: u64) -> Option<Rejection> {
    if alone.len() < LEAST_FOR_REJECTION {
        return None;
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0e1ec7);
    let mut of_class: Vec<Vec<&Pmf>> = Vec::new();
    for (class, pmf) in alone {
        of_class.resize(of_class.len().max(class + 1), Vec::new());
        of_class[*class].push(pmf);
    }
    of_class.retain(|pmfs| !pmfs.is_empty());
    // A belief that reaches the default confidence threshold is never unknown, however confident the held-out grasps were.
    let certain = 2.0 * StopRule::default().threshold.ln();
    let least = (1..=MOST_GRASPS)
        .map(|grasps| {
            let mut reached: Vec<f64> = (0..DRAWN_BELIEFS)
                .map(|n| {
                    let own = &of_class[n % of_class.len()];
                    let drawn: Vec<Pmf> = (0..grasps).map(|_| own[random.random_range(0..own.len())].clone()).collect();
                    let belief = drawn.iter().skip(1).fold(drawn[0].clone(), |belief, pmf| belief.times(pmf));
                    agreement(Some(&belief), &drawn)
                })
                .collect();
            reached.sort_by(f64::total_cmp);
            reached[(REJECTED_SHARE * DRAWN_BELIEFS as f64) as usize].min(certain)
        })
        .collect();
    Some(Rejection { share: REJECTED_SHARE, least })
}

impl Recogniser for TwoStageNetwork {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
        if self.learned.recipe.strict {
            return self.recognise_whole(grasp, before);
        }
        let mut reader = self.reader();
        reader.begin(before);
        for (t, row) in grasp.rows() {
            reader.push(t, row);
        }
        reader.finish().unwrap_or_else(|| Verdict {
            pmf: before.cloned().unwrap_or_else(|| Pmf::uniform(self.stage_two.shape().outputs())),
            properties: None,
        })
    }

    fn live(&self) -> Option<Box<dyn LiveRecogniser>> {
        (!self.learned.recipe.strict).then(|| Box::new(self.reader()) as _)
    }

    fn arrays(&self) -> Arrays {
        let mut arrays = Arrays::default();
        let stages = [("stage_one", self.stage_one.as_ref()), ("stage_two", Some(&self.stage_two))];
        for (name, network) in stages.into_iter().filter_map(|(name, network)| Some((name, network?))) {
            network.layer.save(name, &mut arrays);
        }
        arrays
    }

    fn parameters(&self) -> usize {
        self.stage_one.iter().chain([&self.stage_two]).map(|network| network.layer.values().len()).sum()
    }

    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(&self.learned).unwrap_or_default()
    }

    fn has_stage_one(&self) -> bool {
        self.stage_one.is_some()
    }

    fn rejection(&self) -> Option<&Rejection> {
        self.rejection.as_ref()
    }
}

/// Both stages, one sample at a time.
struct LiveNetwork {
    binner: Binner,
    stage_one: Option<LiveCalibrated>,
    stage_two: LiveCalibrated,
    iterated: bool,
    before: Pmf,
    log_before: Vec<f32>,
    row: Vec<f32>,
    latest: Option<Verdict>,
}

impl LiveNetwork {
    fn verdict(&mut self) -> Verdict {
        let properties = self.stage_one.as_mut().and_then(|stage_one| {
            let readings = self.row.len();
            let pmfs = stage_one.step(&self.row[..readings], &[]);
            self.row.extend(pmfs.iter().flat_map(Pmf::probabilities).map(|p| *p as f32));
            properties_of(pmfs)
        });
        if self.iterated {
            self.row.extend(self.before.probabilities().iter().map(|p| *p as f32));
        }
        let pmf = self.stage_two.step(&self.row, &self.log_before).pop();
        let pmf = pmf.unwrap_or_else(|| self.before.clone());
        // Without feedback, earlier grasps count as independent observations.
        let pmf = if self.iterated { pmf } else { self.before.times(&pmf) };
        let verdict = Verdict { pmf, properties };
        self.latest = Some(verdict.clone());
        verdict
    }
}

impl LiveRecogniser for LiveNetwork {
    fn begin(&mut self, before: Option<&Pmf>) {
        self.binner.reset();
        if let Some(stage_one) = &mut self.stage_one {
            stage_one.reset();
        }
        self.stage_two.reset();
        let classes = self.before.classes();
        self.before = before.filter(|b| b.classes() == classes).cloned().unwrap_or_else(|| Pmf::uniform(classes));
        self.log_before.clear();
        if self.iterated {
            self.log_before.extend(self.before.logarithms().map(|l| l as f32));
        }
        self.latest = None;
    }

    fn push(&mut self, t: f32, row: &[f32]) -> Option<Verdict> {
        let inputs = self.binner.push(t, row)?;
        self.row.clear();
        self.row.extend_from_slice(inputs);
        Some(self.verdict())
    }

    fn finish(&mut self) -> Option<Verdict> {
        match self.binner.finish() {
            Some(inputs) => {
                self.row.clear();
                self.row.extend_from_slice(inputs);
                Some(self.verdict())
            }
            None => self.latest.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::Belief;

    fn rejects(rejection: &Rejection, p: f64) -> bool {
        let pmf = Pmf::from_weights([p, 1.0 - p, 0.0]);
        let mut belief = Belief::default();
        belief.add(pmf.clone(), pmf);
        rejection.rejects(&belief)
    }

    #[test]
    fn few_grasps_give_no_rejection_threshold() {
        let sure = |class: usize| (class, Pmf::from_weights([0, 1, 2].map(|k| if k == class { 1.0 } else { 1e-6 })));
        let of = |grasps: usize| -> Vec<(usize, Pmf)> { (0..grasps).map(|n| sure(n % 3)).collect() };
        assert_eq!(calibrated_rejection(&of(LEAST_FOR_REJECTION - 1), 1), None);
        // Held-out grasps were more confident than real ones ever are; the stop threshold still suffices.
        let rejection = calibrated_rejection(&of(LEAST_FOR_REJECTION), 1).expect("enough");
        assert!(!rejects(&rejection, 0.999) && !rejects(&rejection, 0.9));
        assert!(rejects(&rejection, 0.5));
    }
}
