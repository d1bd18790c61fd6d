//! Known and unknown objects: each object is left out in turn, random shapes are the class "other", and its probability should
//! be higher for the object that was left out.

use super::super::answers::BOOTSTRAP;
use super::super::plan::POSES;
use super::super::prelude::*;
use super::questions::QUESTIONS;
use super::{emulated, tested};
use palpate_lab::grasping::random_shapes;
use palpate_learn::evaluation::{answer, rounds};
use palpate_learn::{ModelCard, Shipped, check_apart};

/// Seeds of the random shapes of the class "other", which the encoders have not seen either.
pub(super) const OTHERS: std::ops::Range<u64> = 20_000..23_000;
/// Row of the unknown objects: area under the curve of known against unknown ones, each object left out in turn.
pub(super) const NOVELTY: &str = "unknown objects, B free";
pub(super) const NOVELTY_METHOD: &str = "geometry-trees";
pub(super) const NOVELTY_TARGETS: [[f64; 2]; 2] = [[0.87, 0.95], [0.90, 0.97]];

/// Row of unknown objects on grippers without labels: random shapes against the sixteen, by the shipped model.
pub(super) const EMULATED_NOVELTY: &str = "unknown objects, no labels, emulated gripper, B";
/// Seeds of those shapes.
const STRANGERS: std::ops::Range<u64> = 30_000..30_032;

/// Score of each test grasp, and whether its object was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::paper) struct Scored {
    pub(super) data: String,
    pub(super) trials: Vec<TrialId>,
    pub(super) is_new: Vec<bool>,
    /// After one grasp, and after three.
    pub(super) scores: [Vec<f64>; 2],
}

/// How surely each test grasp is of a known object, for a model that has not learned one of them.
pub(super) fn novelty(left_out: &str, method: &Method, bench: &StudyData<'_>) -> Result<Scored, StudyError> {
    let plan = bench.plan();
    let grasps = plan.grasps(50, 20);
    let question = &QUESTIONS[0];
    let test = tested(question, bench)?;
    let all = bench.data(&question.wanted(plan, grasps, POSES))?;
    let others = random_shapes(OTHERS.start..OTHERS.start + plan.pick(OTHERS.end - OTHERS.start, 100, 10));
    let wanted = DataWanted { objects: others, grasps: 1, ..question.wanted(plan, 1, POSES) };
    let others = bench.data(&wanted)?;
    let known: Vec<usize> =
        (0..all.examples.len()).filter(|k| all.labels.classes[all.examples[*k].class].name != left_out).collect();
    let train = all.part(&known).with(&others);
    let train = train.ok_or_else(|| StudyError::missing("random shapes with the channels of the objects"))?;
    check_apart(&train.examples, &test.examples)?;
    let model = bench.fit(method, &train)?;
    let other = model.card.labels.other().ok_or_else(|| StudyError::missing("random shapes"))?;
    let score = |pmf: &Pmf| pmf.probabilities()[other].max(f64::MIN_POSITIVE).ln();
    Ok(Scored::of(&model, &test, |name| name == left_out, plan.seed, score))
}

/// Rounds with emulated grippers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::paper) struct EmulatedRounds {
    pub(super) scored: Scored,
    /// What the identification of window and commands says at the end of each round, and after how many grasps.
    decided: Vec<Decided>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Decided {
    grasps: usize,
    /// Reached the threshold.
    sure: bool,
    other: bool,
    right: bool,
}

/// How surely grasps of emulated grippers are of a known object, for the shipped model, and what is decided.
pub(super) fn emulated_novelty(bench: &StudyData<'_>) -> Result<EmulatedRounds, StudyError> {
    let plan = bench.plan();
    let model = Shipped::AnyGripper.model().map_err(StudyError::missing)?;
    let other = model.card.labels.other().ok_or_else(|| StudyError::missing("random shapes"))?;
    let strangers = random_shapes(STRANGERS.start..STRANGERS.start + plan.pick(STRANGERS.end - STRANGERS.start, 4, 2));
    let objects = [plan.objects(), strangers.clone()].concat();
    let test = emulated(QUESTIONS[0].preset, &objects, plan)?;
    let score = |pmf: &Pmf| pmf.probabilities()[other].max(f64::MIN_POSITIVE).ln();
    let is_new = |name: &str| strangers.iter().any(|stranger| stranger == name);
    let scored = Scored::of(&model, &test, is_new, plan.seed, score);
    let recogniser = model.recogniser.as_ref();
    let rounds = rounds(recogniser, &test, &answer(recogniser, &test), plan.seed);
    let decided = rounds.iter().map(|round| {
        let truth = &test.labels.classes[round.truth].name;
        let class = if is_new(truth) { Some(other) } else { model.card.labels.class(truth) };
        Decided::of(&round.belief, &model.card, class)
    });
    Ok(EmulatedRounds { scored, decided: decided.collect() })
}

impl Decided {
    /// Follows a round grasp by grasp, from the belief before the first one on.
    fn of(belief: &Belief, card: &ModelCard, truth: Option<usize>) -> Self {
        let prior = card.prior();
        let mut followed = Belief::default();
        for (step, alone) in belief.pairs() {
            followed.add(prior.as_ref().map_or_else(|| step.clone(), |prior| prior.times(step)), alone.clone());
            if card.stop.judge(&followed, card.rejection.as_ref()).is_some() {
                break;
            }
        }
        let (class, p) = followed.now().map_or((0, 0.0), Pmf::top);
        let (sure, other) = (p >= card.stop.threshold, Some(class) == card.labels.other());
        Self { grasps: followed.grasps(), sure, other, right: Some(class) == truth }
    }
}

/// Share of rounds that something is said of, over resampled rounds.
fn share(all: &[&Decided], said: impl Fn(&Decided) -> Option<bool>) -> Cell {
    Cell::from(BOOTSTRAP.interval(&vec![0; all.len()], |chosen| {
        let said: Vec<bool> = chosen.iter().filter_map(|k| said(all[*k])).collect();
        Some(said.iter().filter(|yes| **yes).count() as f64 / said.len() as f64)
    }))
}

/// Table of what is decided about known objects and others.
pub(super) fn decisions(found: &EmulatedRounds) -> StudyTable {
    let mean_grasps = |all: &[&Decided]| {
        let mean =
            |chosen: &[usize]| chosen.iter().map(|k| all[*k].grasps as f64).sum::<f64>() / chosen.len().max(1) as f64;
        Cell::from(BOOTSTRAP.interval(&vec![0; all.len()], |chosen| Some(mean(chosen))))
    };
    let rows = [("the sixteen", false), ("random shapes, none of them", true)].map(|(name, is_new)| {
        let own = found.decided.iter().zip(&found.scored.is_new).filter(|(_, new)| **new == is_new);
        (name, own.map(|(decided, _)| decided).collect::<Vec<&Decided>>())
    });
    let title = "Grasps until sure, by emulated grippers, without labels: what the shipped model says";
    TableRows::new("decisions", title, &rows).columns(&[
        Column("objects", "", &|(name, _)| (*name).into()),
        Column("right", PERCENT, &|(_, all)| share(all, |own| Some(own.right))),
        Column("said \"other\"", PERCENT, &|(_, all)| share(all, |own| Some(own.other))),
        Column("sure", PERCENT, &|(_, all)| share(all, |own| Some(own.sure))),
        Column("right when sure", PERCENT, &|(_, all)| share(all, |own| own.sure.then_some(own.right))),
        Column("grasps", "", &|(_, all)| mean_grasps(all)),
        Column("rounds", "", &|(_, all)| all.len().into()),
    ])
}

impl Scored {
    /// Scores what a model believes after one test grasp of each round, and after three.
    pub(super) fn of(
        model: &Model,
        test: &Dataset,
        is_new: impl Fn(&str) -> bool,
        seed: u64,
        score: impl Fn(&Pmf) -> f64,
    ) -> Self {
        let recogniser = model.recogniser.as_ref();
        let rounds = rounds(recogniser, test, &answer(recogniser, test), seed);
        let after =
            |belief: &Belief, grasps: usize| belief.steps().get(grasps - 1).or(belief.now()).map_or(0.0, &score);
        let is_new = |example: &Example| is_new(&test.labels.classes[example.class].name);
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
