//! Which grasp next: grasps of objects that stay where they are, until the recogniser is sure, from random poses of the
//! gripper and from those that a guide chooses.

use super::super::UnitResult;
use super::super::answers::BOOTSTRAP;
use super::super::bench::{StudyBench, StudyError};
use super::super::plan::POSES;
use super::super::report::{Cell, PERCENT, StudyTable};
use super::questions::{LEARNED, QUESTIONS, Question};
use crate::datasets::{SensorView, sequence_of};
use crate::grasping::{GripperMove, Guide, Recompute, Stance, TouchLibrary, grasp_soundly};
use palpate_learn::metrics::Interval;
use palpate_learn::{Belief, Dataset, Method, Model, Pmf, Sequence, check_apart};
use palpate_sim::objects::ObjectModel;
use palpate_sim::poses::{PoseSampler, has_room};
use palpate_sim::scene::{Faces, PosePreset, Scene};
use palpate_tactile::trial::SimulatedTrial;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub(super) const GUIDED: &str = "guided grasps, B fixed";
pub(super) const GUIDED_METHOD: &str = "geometry-trees";
/// Share of the grasps after the first that guidance is to save.
const TO_SAVE: f64 = 1.0 / 3.0;

/// Grasps of each object in the guide's library, and the seed of their poses.
const KNOWN: usize = 400;
const KNOWN_POSES: u64 = 9;
/// Objects are put down so often, in poses of these seeds.
const ROUNDS: usize = 20;
const ROUND_SEEDS: u64 = 41_000_000;
/// Probability at which a round ends, and grasps at most.
const SURE: f64 = 0.95;
const MOST_GRASPS: usize = 9;

/// How the next pose is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NextPose {
    /// Another turn, shift and lift, as the preset draws them.
    Random,
    /// By a guide.
    Guided,
}

/// End of one round.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Ended {
    grasps: usize,
    /// Reached the probability.
    sure: bool,
    right: bool,
}

/// Rounds from the same first pose of an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct BothRounds {
    class: usize,
    random: Ended,
    guided: Ended,
}

impl BothRounds {
    fn of(&self, next: NextPose) -> &Ended {
        match next {
            NextPose::Random => &self.random,
            NextPose::Guided => &self.guided,
        }
    }
}

/// All rounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct GuidedRounds {
    pub(super) data: String,
    rounds: Vec<BothRounds>,
}

/// The question whose grasps a model learns from: fixed objects, many grasps of each.
fn question() -> &'static Question {
    &QUESTIONS[2]
}

/// Runs all rounds; none where it was cancelled.
pub(super) fn guided(method: &Method, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
    let plan = bench.plan();
    let wanted = |grasps: usize, quick: usize, poses: u64| question().wanted(plan, plan.grasps(grasps, quick), poses);
    let Some(train) = bench.data(&wanted(LEARNED, 20, POSES))? else { return Ok(None) };
    let Some(known) = bench.data(&wanted(KNOWN, 20, KNOWN_POSES))? else { return Ok(None) };
    check_apart(&train.examples, &known.examples)?;
    let Some(model) = bench.fit(method, &train)? else { return Ok(None) };
    let missing = || StudyError::Missing("simulated grasps of the same objects".to_owned());
    let known = known.relabelled(&model.card.labels).ok_or_else(missing)?;
    let library = library(&model, &known, bench)?;
    let preset = PosePreset::named(question().preset).ok_or_else(missing)?;
    let mut nominal = Scene { pose: preset.poses(), ..Scene::default() };
    nominal.set_object_fixed(true);
    let mut rounds = Vec::new();
    for (class, own) in model.card.labels.classes.iter().enumerate() {
        let mut scene = nominal.clone();
        scene.object.source.clone_from(&own.name);
        let object = scene.load_object().ok().flatten().ok_or_else(missing)?;
        let sampler = PoseSampler::new(&scene, Some(&object));
        let count = plan.pick(ROUNDS, 4, 1);
        let round = |number: usize| {
            let seed = ROUND_SEEDS + (class * ROUNDS + number) as u64;
            let first = sampler.draw(Some(&object), seed).0;
            let round = Round { model: &model, library: &library, nominal: &scene, object: &object, class, seed };
            let run = |next: NextPose| round.run(&first, next, bench);
            Some(BothRounds { class, random: run(NextPose::Random)?, guided: run(NextPose::Guided)? })
        };
        let ended: Option<Vec<_>> = (0..count).into_par_iter().map(round).collect();
        let Some(ended) = ended else { return Ok(None) };
        rounds.extend(ended);
    }
    UnitResult::new(&GuidedRounds { data: train.about.described(), rounds }).map(Some)
}

/// The guide's library: grasps that the model has not learned from, and its answers.
fn library(model: &Model, known: &Dataset, bench: &StudyBench<'_>) -> Result<TouchLibrary, StudyError> {
    let mut touches = Vec::new();
    for example in &known.examples {
        let Some(SimulatedTrial { header, .. }) = bench.simulated(example.id)? else { continue };
        let answer = model.recogniser.recognise(&example.grasp, None).pmf;
        touches.push((example.class, Stance::of(&header.scene), example.grasp.as_ref(), answer));
    }
    Ok(TouchLibrary::new(&known.channels, known.labels.classes.len(), &touches))
}

/// Grasps of one object that stays where it is.
struct Round<'a> {
    model: &'a Model,
    library: &'a TouchLibrary,
    nominal: &'a Scene,
    object: &'a ObjectModel,
    class: usize,
    seed: u64,
}

impl Round<'_> {
    /// Grasps until the recogniser is sure; none where it was cancelled.
    fn run(&self, first: &Scene, next: NextPose, bench: &StudyBench<'_>) -> Option<Ended> {
        let mut belief = Belief::default();
        let mut guide = Guide::new(self.library);
        let (mut scene, mut by) = (first.clone(), GripperMove::default());
        // Random poses of the gripper about the object as it lies.
        let mut lying = Scene { object: first.object.clone(), ..self.nominal.clone() };
        lying.pose.faces = Faces::Nominal;
        let sampler = PoseSampler::new(&lying, Some(self.object));
        loop {
            if bench.is_cancelled() {
                return None;
            }
            let grasp = self.grasp(&scene)?;
            let recogniser = &self.model.recogniser;
            let alone = recogniser.recognise(&grasp, None).pmf;
            let with = belief.now().map(|before| recogniser.recognise(&grasp, Some(before)).pmf);
            let now: Pmf = with.unwrap_or_else(|| alone.clone());
            belief.add(now.clone(), alone);
            let (top, probability) = now.top();
            let (sure, right) = (probability >= SURE, top == self.class);
            if sure || belief.grasps() >= MOST_GRASPS {
                return Some(Ended { grasps: belief.grasps(), sure, right });
            }
            match next {
                NextPose::Random => {
                    let seed = self.seed.wrapping_mul(1000).wrapping_add(belief.grasps() as u64);
                    scene = sampler.draw(Some(self.object), seed).0;
                }
                NextPose::Guided => {
                    guide.felt(&grasp, &by);
                    let all = GripperMove::all(&scene, self.nominal);
                    let moves: Vec<GripperMove> = all.iter().map(|(by, _)| *by).collect();
                    let expected = guide.expected_entropy(&now, &moves);
                    let mut order: Vec<usize> = (0..all.len()).collect();
                    order.sort_by(|a, b| expected[*a].total_cmp(&expected[*b]));
                    let chosen = order.into_iter().find(|k| has_room(&all[*k].1, Some(self.object)));
                    let Some(k) = chosen else { return Some(Ended { grasps: MOST_GRASPS, sure, right }) };
                    (by, scene) = all[k].clone();
                }
            }
        }
    }

    fn grasp(&self, scene: &Scene) -> Option<Sequence> {
        let trial = grasp_soundly(scene, Some(self.object), self.seed, Recompute::Unsettled);
        SensorView::default().signals(&trial).ok().map(|signals| sequence_of(&signals))
    }
}

/// Table of grasps after the first with random poses and guided.
pub(super) fn table(found: &GuidedRounds) -> StudyTable {
    let columns = [
        ("poses", ""),
        ("grasps after the first", ""),
        ("saved", PERCENT),
        ("to save", PERCENT),
        ("sure", PERCENT),
        ("right when sure", PERCENT),
        ("rounds", ""),
    ];
    let title = format!(
        "Which grasp next: {GUIDED_METHOD}, {LEARNED} fixed grasps of each object, until {:.0} % sure; the object stays",
        100.0 * SURE
    );
    let mut table = StudyTable::new("guided", title, &columns);
    let strata: Vec<usize> = found.rounds.iter().map(|own| own.class).collect();
    let after_first = |next: NextPose, chosen: &[usize]| {
        let all = chosen.iter().map(|k| found.rounds[*k].of(next).grasps as f64 - 1.0);
        all.sum::<f64>() / chosen.len().max(1) as f64
    };
    for (name, next) in [("random", NextPose::Random), ("guided", NextPose::Guided)] {
        let share = |of: &dyn Fn(&Ended) -> Option<bool>| -> Option<Interval> {
            BOOTSTRAP.interval(&strata, |chosen| {
                let said: Vec<bool> = chosen.iter().filter_map(|k| of(found.rounds[*k].of(next))).collect();
                Some(said.iter().filter(|yes| **yes).count() as f64 / said.len() as f64)
            })
        };
        let saved = |chosen: &[usize]| Some(1.0 - after_first(next, chosen) / after_first(NextPose::Random, chosen));
        let (saved, to_save) = match next {
            NextPose::Random => (Cell::Missing, Cell::Missing),
            NextPose::Guided => (Cell::interval(BOOTSTRAP.interval(&strata, saved)), Cell::Number(TO_SAVE)),
        };
        let cells = vec![
            Cell::text(name),
            Cell::interval(BOOTSTRAP.interval(&strata, |chosen| Some(after_first(next, chosen)))),
            saved,
            to_save,
            Cell::interval(share(&|ended| Some(ended.sure))),
            Cell::interval(share(&|ended| ended.sure.then_some(ended.right))),
            Cell::Number(found.rounds.len() as f64),
        ];
        table.push(cells, Vec::new());
    }
    table
}
