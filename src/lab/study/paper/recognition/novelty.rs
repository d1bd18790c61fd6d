//! Known and unknown objects: each object is left out in turn, random shapes are the class "other", and its probability should
//! be higher for the object that was left out.

use super::super::UnitResult;
use super::super::answers::BOOTSTRAP;
use super::super::bench::{StudyBench, StudyError};
use super::super::plan::{DataWanted, POSES};
use super::questions::QUESTIONS;
use super::tested;
use crate::grasping::random_shapes;
use palpate_learn::evaluation::{answer, rounds};
use palpate_learn::metrics::Interval;
use palpate_learn::{Belief, Dataset, Example, Method, Model, Pmf, check_apart};
use palpate_tactile::trial::TrialId;
use serde::{Deserialize, Serialize};

/// Seeds of the random shapes of the class "other", which the encoders have not seen either.
const OTHERS: std::ops::Range<u64> = 20_000..21_000;
/// Row of the unknown objects: area under the curve of known against unknown ones, each object left out in turn.
pub(super) const NOVELTY: &str = "unknown objects, B free";
pub(super) const NOVELTY_METHOD: &str = "geometry-trees";
pub(super) const NOVELTY_TARGETS: [[f64; 2]; 2] = [[0.87, 0.95], [0.90, 0.97]];

/// Score of each test grasp, and whether its object was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Scored {
    pub(super) data: String,
    pub(super) trials: Vec<TrialId>,
    pub(super) is_new: Vec<bool>,
    /// After one grasp, and after three.
    pub(super) scores: [Vec<f64>; 2],
}

/// How surely each test grasp is of a known object, for a model that has not learned one of them.
pub(super) fn novelty(
    left_out: &str,
    method: &Method,
    bench: &StudyBench<'_>,
) -> Result<Option<UnitResult>, StudyError> {
    let plan = bench.plan();
    let grasps = plan.grasps(50, 20);
    let question = &QUESTIONS[0];
    let Some(test) = tested(question, bench)? else { return Ok(None) };
    let Some(all) = bench.data(&question.wanted(plan, grasps, POSES))? else { return Ok(None) };
    let others = random_shapes(OTHERS.start..OTHERS.start + plan.pick(OTHERS.end - OTHERS.start, 100, 10));
    let wanted = DataWanted { objects: others, grasps: 1, ..question.wanted(plan, 1, POSES) };
    let Some(others) = bench.data(&wanted)? else { return Ok(None) };
    let known: Vec<usize> =
        (0..all.examples.len()).filter(|k| all.labels.classes[all.examples[*k].class].name != left_out).collect();
    let other_channels = || StudyError::Missing("random shapes with the channels of the objects".to_owned());
    let train = all.part(&known).with(&others).ok_or_else(other_channels)?;
    check_apart(&train.examples, &test.examples)?;
    let Some(model) = bench.fit(method, &train)? else { return Ok(None) };
    let other = model.card.labels.other().ok_or_else(|| StudyError::Missing("random shapes".to_owned()))?;
    let score = |pmf: &Pmf| pmf.probabilities()[other].max(f64::MIN_POSITIVE).ln();
    UnitResult::new(&Scored::of(&model, &test, left_out, plan.seed, score)).map(Some)
}

impl Scored {
    /// Scores what a model believes after one test grasp of each round, and after three.
    pub(super) fn of(model: &Model, test: &Dataset, left_out: &str, seed: u64, score: impl Fn(&Pmf) -> f64) -> Self {
        let recogniser = model.recogniser.as_ref();
        let rounds = rounds(recogniser, test, &answer(recogniser, test), seed);
        let after =
            |belief: &Belief, grasps: usize| belief.steps().get(grasps - 1).or(belief.now()).map_or(0.0, &score);
        let is_new = |example: &Example| test.labels.classes[example.class].name == left_out;
        Self {
            data: test.about.described(),
            trials: test.examples.iter().map(|example| example.id).collect(),
            is_new: test.examples.iter().map(is_new).collect(),
            scores: [1, 3].map(|grasps| rounds.iter().map(|round| after(&round.belief, grasps)).collect()),
        }
    }
}

/// Share of pairs of an unknown and a known object in which the unknown one has the higher score (AUROC), over resampled trials.
pub(super) fn area(scored: &[Scored], grasps: usize) -> Option<Interval> {
    let all: Vec<(usize, bool, f64)> = scored
        .iter()
        .enumerate()
        .flat_map(|(k, own)| own.is_new.iter().zip(&own.scores[grasps]).map(move |(new, score)| (k, *new, *score)))
        .collect();
    let strata: Vec<usize> = all.iter().map(|(k, new, _)| 2 * k + usize::from(*new)).collect();
    BOOTSTRAP.interval(&strata, |chosen| {
        let mut areas = Vec::new();
        for k in 0..scored.len() {
            let of = |new: bool| -> Vec<f64> {
                let own = chosen.iter().map(|at| all[*at]).filter(|own| own.0 == k && own.1 == new);
                own.map(|(.., score)| score).collect()
            };
            let mut known = of(false);
            known.sort_by(f64::total_cmp);
            let below = |score: f64| {
                let (less, up_to) =
                    (known.partition_point(|own| *own < score), known.partition_point(|own| *own <= score));
                0.5 * (less + up_to) as f64 / known.len().max(1) as f64
            };
            let new: Vec<f64> = of(true).into_iter().map(below).collect();
            areas.push(new.iter().sum::<f64>() / new.len().max(1) as f64);
        }
        Some(areas.iter().sum::<f64>() / areas.len().max(1) as f64)
    })
}
