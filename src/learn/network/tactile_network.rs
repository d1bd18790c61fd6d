//! The paper's recognisers, tuned: the macro-layer alone, the dual-stage LSTM, and its iterated form (Fig. 2).
//!
//! ```text
//! readings --+--> stage one: macro-layer --> PMF of size, PMF of shape --+
//!            |                                                           v
//!            +------------------- skip connection ------> stage two: macro-layer --> PMF of class
//!                                                                        ^                |
//!                                            (iterated) PMF before ------+<---------------+
//! ```
//!
//! Both stages run step by step: at every step stage two takes the output of stage one at that step, so the same network
//! gives a PMF during closing and at the end.

use super::calibrated::{Calibrated, HeldOut, LiveCalibrated, Plan};
use super::macro_layer::{MacroLayer, MacroShape};
use super::preparation::{Binner, Preparation};
use super::recipe::Recipe;
use super::training_set::{Earlier, StageInputs};
use crate::arrays::Arrays;
use crate::belief::{Rejection, StopRule, agreement};
use crate::data::{Dataset, Sequence};
use crate::fitting::{Fitting, LearnError, check_enough};
use crate::mirror::mirror;
use crate::model::{LoadError, ModelCard};
use crate::pmf::Pmf;
use crate::recogniser::{LiveRecogniser, Properties, Recogniser, Verdict};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Fitted network of the paper, with one stage or two.
#[derive(Clone, Debug)]
pub(super) struct TactileNetwork {
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
    /// Shape and temperatures of each stage.
    stage_one: Option<NetworkCard>,
    stage_two: NetworkCard,
}

/// Shape and temperatures of a network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct NetworkCard {
    shape: MacroShape,
    temperatures: Vec<Vec<f32>>,
}

impl NetworkCard {
    fn of(network: &Calibrated) -> Self {
        Self { shape: network.shape().clone(), temperatures: network.temperatures.clone() }
    }
}

/// One in this many grasps is held out for calibration.
const CALIBRATION: usize = 6;
/// Share of known objects that may be rejected as unknown.
const REJECTED_SHARE: f64 = 0.02;
/// Fewest held-out grasps of which this share is a whole grasp.
const LEAST_FOR_REJECTION: usize = (1.0 / REJECTED_SHARE) as usize - 1;
/// Largest number of earlier grasps while training.
const MOST_EARLIER: usize = 3;
/// Number of beliefs drawn to calibrate the rejection after each number of grasps.
const DRAWN_BELIEFS: usize = 4000;
/// Largest number of grasps for which the rejection is calibrated.
const MOST_GRASPS: usize = 6;

impl TactileNetwork {
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
            Some(second) => check_enough(own, 2).and(check_enough(second, 2))?,
            None => check_enough(data, 2 * halves)?,
        }
        if recipe.two_stages && !data.labels.have_properties() {
            return Err(LearnError::NoProperties { method });
        }
        let work = StageFitting { data, recipe: &recipe, fitting, preparation: Preparation::fit(data, recipe.rate_hz) };
        let readings: Vec<Vec<f32>> = data.examples.iter().map(|e| work.preparation.inputs(&e.grasp)).collect();
        let everything: Vec<usize> = (0..readings.len()).collect();
        let (for_one, for_two) = match (halves, fitting.second) {
            (1, _) => (everything.clone(), everything),
            (_, Some(_)) => (everything[..own.examples.len()].to_vec(), everything[own.examples.len()..].to_vec()),
            (_, None) => halves_of(data, fitting.seed),
        };
        let end_of_one = if recipe.two_stages { if recipe.iterated { 0.4 } else { 0.6 } } else { 0.0 };
        let (stage_one, beside) = if recipe.two_stages {
            let (network, held_out) = work.fit_stage_one(&readings, &for_one, 0.0..end_of_one)?;
            let beside = work.beside(&network, &held_out, &readings, &for_two);
            (Some(network), beside)
        } else {
            (None, vec![Vec::new(); for_two.len()])
        };
        let (stage_two, alone) = work.fit_stage_two(&readings, &for_two, &beside, &(end_of_one..1.0))?;
        let rejection = calibrated_rejection(&alone, fitting.seed);
        let learned = Learned {
            preparation: work.preparation,
            stage_one: stage_one.as_ref().map(NetworkCard::of),
            stage_two: NetworkCard::of(&stage_two),
            recipe,
        };
        Ok(Self { learned, stage_one, stage_two, rejection })
    }

    /// Restores a network from a model file.
    pub(super) fn load(card: &ModelCard, arrays: &Arrays) -> Result<Self, LoadError> {
        let learned: Learned = card.settings_as()?;
        learned.recipe.check()?;
        if !learned.preparation.is_sound(card.channels.len()) {
            return Err(LoadError::Card { part: "the input scaling" });
        }
        let labels = &card.labels;
        let readings = learned.preparation.width();
        let properties = vec![labels.sizes.len(), labels.shapes.len()];
        let stage_one = match &learned.stage_one {
            Some(own) => Some(read_network(arrays, "stage_one", own, readings, &properties)?),
            None => None,
        };
        let beside = stage_one.as_ref().map_or(0, |network| network.shape().outputs());
        let before = if learned.recipe.iterated { labels.classes.len() } else { 0 };
        let classes = [labels.classes.len()];
        let stage_two = read_network(arrays, "stage_two", &learned.stage_two, readings + beside + before, &classes)?;
        if stage_two.shape().with_prior != learned.recipe.iterated {
            return Err(LoadError::Card { part: "the second stage" });
        }
        Ok(Self { learned, stage_one, stage_two, rejection: card.rejection.clone() })
    }

    fn reader(&self) -> LiveTactile {
        let classes = self.stage_two.shape().outputs();
        LiveTactile {
            binner: Binner::new(&self.learned.preparation),
            stage_one: self.stage_one.as_ref().map(LiveCalibrated::new),
            stage_two: LiveCalibrated::new(&self.stage_two),
            iterated: self.learned.recipe.iterated,
            before: Pmf::uniform(classes),
            log_before: Vec::new(),
            row: Vec::new(),
            latest: None,
        }
        .at_the_start(None)
    }
}

fn read_network(
    arrays: &Arrays,
    name: &str,
    card: &NetworkCard,
    inputs: usize,
    groups: &[usize],
) -> Result<Calibrated, LoadError> {
    let shape = &card.shape;
    let valid = shape.fits(inputs, groups)
        && card.temperatures.len() == groups.len()
        && card.temperatures.iter().flatten().all(|t| t.is_finite() && *t > 0.0);
    if !valid {
        return Err(LoadError::Card { part: "the shape of the network" });
    }
    Ok(Calibrated { layer: MacroLayer::load(shape, name, arrays)?, temperatures: card.temperatures.clone() })
}

/// Indices of the grasps for stage one and for stage two.
pub(super) fn halves_of(data: &Dataset, seed: u64) -> (Vec<usize>, Vec<usize>) {
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
}

impl StageFitting<'_> {
    /// Part of each of some grasps, stratified by class.
    fn parts(&self, grasps: &[usize], parts: usize) -> Vec<usize> {
        self.data.part(grasps).folds(parts, self.fitting.seed ^ 0xf01d)
    }

    fn shape(&self, inputs: usize, groups: Vec<usize>, with_prior: bool) -> MacroShape {
        let hidden = (self.recipe.hidden > 0).then_some(self.recipe.hidden);
        MacroShape { inputs, units: self.recipe.units, hidden, groups, with_prior }
    }

    /// Index of each input's counterpart when left and right are exchanged; `beside` further inputs stay in place.
    fn mirror(&self, beside: usize) -> Option<Vec<usize>> {
        let channels = self.data.channels.len();
        let of_channels = mirror(&self.data.channels).filter(|_| self.recipe.mirror)?;
        let scaled = of_channels.iter().copied();
        let deviations = of_channels.iter().map(|to| to + channels);
        Some(scaled.chain(deviations).chain(2 * channels..2 * channels + beside).collect())
    }

    fn fit_stage_one(
        &self,
        readings: &[Vec<f32>],
        grasps: &[usize],
        share: Range<f64>,
    ) -> Result<(Calibrated, HeldOut), LearnError> {
        let labels = &self.data.labels;
        let properties = |k: usize| {
            let class = &labels.classes[self.data.examples[k].class];
            Some(vec![class.size?, class.shape?])
        };
        // The empty hand has neither size nor shape and is left out.
        let labelled: Vec<usize> = grasps.iter().copied().filter(|k| properties(*k).is_some()).collect();
        let inputs = StageInputs {
            width: self.preparation.width(),
            sequences: labelled.iter().map(|k| readings[*k].clone()).collect(),
            targets: labelled.iter().filter_map(|k| properties(*k)).collect(),
            mirror: self.mirror(0),
            readings: self.preparation.width(),
            noise: self.recipe.noise,
            earlier: None,
        };
        let middle = if self.recipe.cross_fitted { 0.5 * (share.start + share.end) } else { share.end };
        let plan = Plan {
            shape: self.shape(inputs.width, vec![labels.sizes.len(), labels.shapes.len()], false),
            training: &self.recipe.training,
            held_out: &self.parts(&labelled, CALIBRATION),
            seed: self.fitting.seed.wrapping_mul(1000),
            share: share.start..middle,
        };
        let (network, _) = Calibrated::fit(&plan, &inputs, self.fitting)?;
        let mut held_out: HeldOut = vec![None; readings.len()];
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

    /// Outputs of stage one, `[steps][outputs]`, for each grasp of stage two, by a network not trained on it: held-out
    /// scores if cross-fitted, otherwise and for objects without size and shape those of the final network.
    fn beside(
        &self,
        network: &Calibrated,
        held_out: &HeldOut,
        readings: &[Vec<f32>],
        for_two: &[usize],
    ) -> Vec<Vec<f32>> {
        let (width, outputs) = (self.preparation.width(), network.shape().outputs());
        let mut live = LiveCalibrated::new(network);
        let flat = |pmfs: Vec<Pmf>| -> Vec<f32> {
            pmfs.iter().flat_map(|pmf| pmf.probabilities().iter().map(|p| *p as f32)).collect()
        };
        let of_grasp = |k: &usize| -> Vec<f32> {
            match held_out[*k].as_ref().filter(|_| self.recipe.cross_fitted) {
                Some(scores) => {
                    let rows = scores.chunks_exact(outputs).enumerate();
                    rows.flat_map(|(step, row)| flat(network.pmfs(row, step))).collect()
                }
                None => {
                    live.reset();
                    readings[*k].chunks_exact(width).flat_map(|row| flat(live.step(row, &[]))).collect()
                }
            }
        };
        for_two.iter().map(of_grasp).collect()
    }

    /// Fits stage two. Returns also the true class and PMF of each grasp by a network not trained on it.
    fn fit_stage_two(
        &self,
        readings: &[Vec<f32>],
        grasps: &[usize],
        beside: &[Vec<f32>],
        share: &Range<f64>,
    ) -> Result<(Calibrated, Vec<(usize, Pmf)>), LearnError> {
        let width = self.preparation.width();
        let classes = self.data.labels.classes.len();
        let steps = |k: usize| readings[k].len() / width;
        let added = grasps.iter().zip(beside).find(|(k, _)| steps(**k) > 0).map_or(0, |(k, b)| b.len() / steps(*k));
        let inputs_with = |beside_them: bool, before: Option<Earlier>| {
            let (added, extra) = (if beside_them { added } else { 0 }, before.as_ref().map_or(0, |e| e.classes));
            let sequence = |(k, beside): (&usize, &Vec<f32>)| -> Vec<f32> {
                let mut sequence = Vec::with_capacity(steps(*k) * (width + added + extra));
                for step in 0..steps(*k) {
                    sequence.extend_from_slice(&readings[*k][step * width..(step + 1) * width]);
                    sequence.extend_from_slice(&beside[step * added..(step + 1) * added]);
                    sequence.extend(std::iter::repeat_n(1.0 / extra.max(1) as f32, extra));
                }
                sequence
            };
            StageInputs {
                width: width + added + extra,
                sequences: grasps.iter().zip(beside).map(sequence).collect(),
                targets: grasps.iter().map(|k| vec![self.data.examples[*k].class]).collect(),
                mirror: self.mirror(added + extra),
                readings: width,
                noise: self.recipe.noise,
                earlier: before,
            }
        };
        let recipe = self.recipe;
        let refining = recipe.refining();
        let at = |share_of_it: f64| share.start + share_of_it * (share.end - share.start);
        let seed = self.fitting.seed.wrapping_mul(1000) + 500;
        // Cross-fitted, stage two is trained on readings alone and then fine-tuned with the outputs of stage one; otherwise
        // it is trained on both at once, as in the paper.
        let at_once = inputs_with(!recipe.cross_fitted, None);
        let plan = Plan {
            shape: self.shape(at_once.width, vec![classes], false),
            training: &recipe.training,
            held_out: &self.parts(grasps, CALIBRATION),
            seed,
            share: at(0.0)..at(if recipe.iterated { 0.45 } else { 0.9 }),
        };
        let (mut network, held_out) = Calibrated::fit(&plan, &at_once, self.fitting)?;
        let complete = if recipe.cross_fitted && added > 0 {
            let inputs = inputs_with(true, None);
            network.layer = network.layer.with_inputs(added);
            network.refine(&inputs, &refining, seed + 50, plan.share.end..plan.share.end + 0.05, self.fitting)?;
            inputs
        } else {
            at_once.clone()
        };
        let truth = |n: usize| self.data.examples[grasps[n]].class;
        let last_of = |network: &Calibrated, held_out: &HeldOut| -> Vec<(usize, Pmf)> {
            let last = |n: usize| {
                let scores = held_out[n].as_ref()?;
                let steps = scores.len() / classes;
                let row = scores.get(steps.checked_sub(1)? * classes..)?;
                network.pmfs(row, steps - 1).pop()
            };
            (0..grasps.len()).filter_map(|n| Some((n, last(n)?))).collect()
        };
        let named = |alone: Vec<(usize, Pmf)>| alone.into_iter().map(|(n, pmf)| (truth(n), pmf)).collect();
        if !recipe.iterated {
            return Ok((network.clone(), named(last_of(&network, &held_out))));
        }
        // The mock networks of the paper (section V-E): their PMFs of held-out grasps stand for earlier grasps.
        let mock = Plan {
            shape: self.shape(complete.width, vec![classes], false),
            share: at(0.5)..at(0.95),
            seed: seed + 200,
            ..plan.clone()
        };
        let parts = self.parts(grasps, recipe.parts);
        let of_mock = Calibrated::cross_fit(&mock, (&parts, recipe.parts), &complete, self.fitting)?;
        let alone = last_of(&network, &of_mock);
        let class_of: Vec<usize> = (0..grasps.len()).map(truth).collect();
        let earlier = Earlier::new(alone.clone(), &class_of, classes, MOST_EARLIER);
        // The network starts as the product of experts and learns corrections.
        let gain = network.last_temperature();
        network.layer = network.layer.with_inputs(classes).with_prior(gain);
        network.refine(&inputs_with(true, Some(earlier)), &refining, seed + 100, at(0.95)..at(1.0), self.fitting)?;
        Ok((network, named(alone)))
    }
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

impl Recogniser for TactileNetwork {
    fn recognise(&self, grasp: &Sequence, before: Option<&Pmf>) -> Verdict {
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
        Some(Box::new(self.reader()))
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
struct LiveTactile {
    binner: Binner,
    stage_one: Option<LiveCalibrated>,
    stage_two: LiveCalibrated,
    iterated: bool,
    before: Pmf,
    log_before: Vec<f32>,
    row: Vec<f32>,
    latest: Option<Verdict>,
}

impl LiveTactile {
    fn at_the_start(mut self, before: Option<&Pmf>) -> Self {
        self.begin(before);
        self
    }

    fn verdict(&mut self) -> Verdict {
        let properties = self.stage_one.as_mut().and_then(|stage_one| {
            let readings = self.row.len();
            let pmfs = stage_one.step(&self.row[..readings], &[]);
            let [size, shape]: [Pmf; 2] = pmfs.try_into().ok()?;
            for pmf in [&size, &shape] {
                self.row.extend(pmf.probabilities().iter().map(|p| *p as f32));
            }
            Some(Properties { size, shape })
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

impl LiveRecogniser for LiveTactile {
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
