//! Which grasp next: grasps of objects that stay where they are, until the recogniser is sure, from random poses of the
//! gripper and from those that a guide chooses.

use super::super::answers::BOOTSTRAP;
use super::super::plan::POSES;
use super::super::prelude::*;
use super::questions::{LEARNED, QUESTIONS, Question, UNLABELLED};
use palpate_lab::datasets::{SensorView, sequence_of};
use palpate_lab::grasping::{GripperMove, Guide, KnownTouches, Recompute, Stance, TouchLibrary, grasp_soundly};
use palpate_learn::{Shipped, check_apart};
use palpate_sim::gripper::GripperModel;
use palpate_sim::objects::ObjectModel;
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::{Between, Faces, PosePreset, Scene};
use palpate_tactile::trial::SimulatedTrial;
use rayon::prelude::*;

/// Method of the model that learns here.
const GUIDED_METHOD: &str = "geometry-trees";
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

impl NextPose {
    /// Word in tables.
    fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Guided => "guided",
        }
    }
}

/// End of one round.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct RoundEnd {
    grasps: usize,
    /// Reached the probability.
    sure: bool,
    right: bool,
}

/// Rounds from the same first pose of an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct GuidedAndRandom {
    class: usize,
    random: RoundEnd,
    guided: RoundEnd,
}

impl GuidedAndRandom {
    fn of(&self, next: NextPose) -> &RoundEnd {
        match next {
            NextPose::Random => &self.random,
            NextPose::Guided => &self.guided,
        }
    }
}

/// All rounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::paper) struct GuidedRounds {
    pub(super) data: String,
    rounds: Vec<GuidedAndRandom>,
}

/// Grasps and recogniser of the rounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::paper) enum GuidedCase {
    /// Fixed objects, and a model that has learned many grasps of each.
    Fixed,
    /// Free objects on grippers of unknown parts and mechanics, and the shipped model.
    Unlabelled,
}

impl GuidedCase {
    pub(super) const ALL: [Self; 2] = [Self::Fixed, Self::Unlabelled];

    /// Method of its model.
    pub(super) fn method(self) -> &'static str {
        match self {
            Self::Fixed => GUIDED_METHOD,
            Self::Unlabelled => "geometry-network",
        }
    }

    /// Name of its unit.
    pub(super) fn name(self) -> String {
        match self {
            Self::Fixed => format!("guided grasps, B fixed, {GUIDED_METHOD}"),
            Self::Unlabelled => {
                format!("guided grasps, no labels, B free, {:08x}", Shipped::AnyGripper.model_content())
            }
        }
    }

    /// Grasps and model, for the table.
    fn described(self) -> String {
        match self {
            Self::Fixed => format!("B fixed, {GUIDED_METHOD} of {LEARNED} grasps of each"),
            Self::Unlabelled => format!("{UNLABELLED} free, shipped model"),
        }
    }

    fn question(self) -> &'static Question {
        match self {
            Self::Fixed => &QUESTIONS[2],
            Self::Unlabelled => QUESTIONS.iter().find(|own| own.name == UNLABELLED).unwrap_or(&QUESTIONS[2]),
        }
    }

    /// A model, grasps that it has not learned from with its answers, and what it learned.
    fn model(self, bench: &StudyData<'_>) -> Result<(Model, TouchLibrary, String), StudyError> {
        if self == Self::Unlabelled {
            let model = Shipped::AnyGripper.model().map_err(StudyError::missing)?;
            let touches = KnownTouches::shipped(Shipped::AnyGripper).map_err(StudyError::missing)?;
            let library =
                touches.library(&model).ok_or_else(|| StudyError::missing("channels of the shipped model"))?;
            let about = model.card.data.described();
            return Ok((model, library, about));
        }
        let (plan, question) = (bench.plan(), self.question());
        let wanted = |grasps: usize, quick: usize, poses: u64| question.wanted(plan, plan.grasps(grasps, quick), poses);
        let method = method(GUIDED_METHOD).ok_or_else(|| StudyError::missing(GUIDED_METHOD))?;
        let train = bench.data(&wanted(LEARNED, 20, POSES))?;
        let known = bench.data(&wanted(KNOWN, 20, KNOWN_POSES))?;
        check_apart(&train.examples, &known.examples)?;
        let model = bench.fit(method, &train)?;
        let known = known.relabelled(&model.card.labels).ok_or_else(|| StudyError::missing("simulated grasps"))?;
        let library = library(&model, &known, bench)?;
        Ok((model, library, train.about.described()))
    }
}

/// Runs all rounds.
pub(super) fn guided(case: GuidedCase, bench: &StudyData<'_>) -> Result<GuidedRounds, StudyError> {
    let (plan, question) = (bench.plan(), case.question());
    let missing = || StudyError::missing("simulated grasps of the same objects");
    let (model, library, data) = case.model(bench)?;
    let library = Arc::new(library);
    let wanted = question.wanted(plan, 1, 0);
    let preset = PosePreset::named(question.preset).ok_or_else(missing)?;
    let mut nominal = Scene { pose: preset.poses(), ..Scene::default() };
    (nominal.pose.between, nominal.pose.build) = (Between::AsReleased, wanted.build);
    nominal.set_object_fixed(question.fixed);
    let mut rounds = Vec::new();
    for (class, own) in model.card.labels.classes.iter().enumerate() {
        if !plan.objects().contains(&own.name) {
            continue;
        }
        let mut scene = nominal.clone();
        scene.object.source.clone_from(&own.name);
        let object = scene.load_object().ok().flatten().ok_or_else(missing)?;
        let sampler = PoseSampler::new(&scene, Some(&object));
        let count = plan.pick(ROUNDS, 4, 1);
        let round = |number: usize| {
            let seed = ROUND_SEEDS + (class * ROUNDS + number) as u64;
            let first = sampler.draw(Some(&object), seed).0;
            let view = &wanted.view;
            let round = Round { model: &model, library: &library, view, nominal: &scene, object: &object, class, seed };
            let run = |next: NextPose| round.run(&first, next, bench);
            Some(GuidedAndRandom { class, random: run(NextPose::Random)?, guided: run(NextPose::Guided)? })
        };
        let ended: Option<Vec<_>> = (0..count).into_par_iter().map(round).collect();
        rounds.extend(ended.ok_or(StudyError::Stopped)?);
    }
    Ok(GuidedRounds { data, rounds })
}

/// The guide's library: grasps that the model has not learned from, and its answers.
fn library(model: &Model, known: &Dataset, bench: &StudyData<'_>) -> Result<TouchLibrary, StudyError> {
    let mut touches = Vec::new();
    for example in &known.examples {
        let Some(SimulatedTrial { header, .. }) = bench.simulated(example.id)? else { continue };
        let answer = model.recogniser.recognise(&example.grasp, None).pmf;
        touches.push((example.class, Stance::of(&header.scene), example.grasp.as_ref(), answer));
    }
    Ok(TouchLibrary::new(&known.channels, known.labels.classes.len(), &touches))
}

/// Grasps of one object that stays where it is, or as the grasp before released it.
struct Round<'a> {
    model: &'a Model,
    library: &'a Arc<TouchLibrary>,
    view: &'a SensorView,
    nominal: &'a Scene,
    object: &'a ObjectModel,
    class: usize,
    seed: u64,
}

impl Round<'_> {
    /// Grasps until the recogniser is sure; none where it was cancelled.
    fn run(&self, first: &Scene, next: NextPose, bench: &StudyData<'_>) -> Option<RoundEnd> {
        let mut belief = Belief::default();
        let mut guide = Guide::new(Arc::clone(self.library));
        let (mut scene, mut by) = (first.clone(), GripperMove::default());
        // The same gripper in all grasps, about the object as it lies.
        let mut nominal = self.nominal.clone();
        nominal.gripper = GripperModel { mount: nominal.gripper.mount.clone(), ..first.gripper.clone() };
        nominal.pose.build = 0.0;
        let is_fixed = nominal.holds_object();
        if is_fixed {
            nominal.object.clone_from(&first.object);
            nominal.pose.faces = Faces::Nominal;
        }
        let sampler = PoseSampler::new(&nominal, Some(self.object));
        loop {
            if bench.is_cancelled() {
                return None;
            }
            let trial = grasp_soundly(&scene, Some(self.object), self.seed, Recompute::Unsettled);
            let grasp = sequence_of(self.view.readings(&trial).ok()?.first()?);
            let recogniser = &self.model.recogniser;
            let alone = recogniser.recognise(&grasp, None).pmf;
            let with = belief.now().map(|before| recogniser.recognise(&grasp, Some(before)).pmf);
            let now: Pmf = with.unwrap_or_else(|| alone.clone());
            belief.add(now.clone(), alone);
            let (top, probability) = now.top();
            let (sure, right) = (probability >= SURE, top == self.class);
            if sure || belief.grasps() >= MOST_GRASPS {
                return Some(RoundEnd { grasps: belief.grasps(), sure, right });
            }
            let seed = self.seed.wrapping_mul(1000).wrapping_add(belief.grasps() as u64);
            let random = sampler.draw_after(Some(self.object), seed, trial.frames().last()).0;
            // An object that has fallen off its support is put down anew: nothing is known of its pose.
            let stays = is_fixed || sampler.is_left(&random);
            if next == NextPose::Random || !stays {
                scene = random;
                continue;
            }
            // A free object has moved in the hand: its readings tell more of its pose than the moves so far.
            if !is_fixed {
                guide = Guide::new(Arc::clone(self.library));
            }
            guide.felt(&grasp, &by);
            let from = Scene { object: random.object, ..scene };
            let Some(chosen) = guide.best(&now, &from, &nominal, Some(self.object)) else {
                return Some(RoundEnd { grasps: MOST_GRASPS, sure, right });
            };
            (by, scene) = chosen;
        }
    }
}

/// Rounds of a case with one way to choose poses.
type Row<'a> = (GuidedCase, &'a [GuidedAndRandom], NextPose);

/// A number of rounds, over resampled rounds of each object.
fn resampled((_, rounds, _): &Row<'_>, number: impl Fn(&[usize]) -> f64) -> Cell {
    let strata: Vec<usize> = rounds.iter().map(|own| own.class).collect();
    Cell::from(BOOTSTRAP.interval(&strata, |chosen| Some(number(chosen))))
}

/// Mean number of grasps after the first.
fn after_first(rounds: &[GuidedAndRandom], next: NextPose, chosen: &[usize]) -> f64 {
    let all = chosen.iter().map(|k| rounds[*k].of(next).grasps as f64 - 1.0);
    all.sum::<f64>() / chosen.len().max(1) as f64
}

fn share(row: &Row<'_>, said: impl Fn(&RoundEnd) -> Option<bool>) -> Cell {
    resampled(row, |chosen| {
        let said: Vec<bool> = chosen.iter().filter_map(|k| said(row.1[*k].of(row.2))).collect();
        said.iter().filter(|yes| **yes).count() as f64 / said.len() as f64
    })
}

/// Table of grasps after the first with random poses and guided.
pub(super) fn table(all: &[(GuidedCase, GuidedRounds)]) -> StudyTable {
    let rows = all.iter().flat_map(|(case, found)| {
        [NextPose::Random, NextPose::Guided].map(|next| (*case, found.rounds.as_slice(), next))
    });
    let rows: Vec<Row<'_>> = rows.collect();
    let if_guided = |(.., next): &Row<'_>, cell: &dyn Fn() -> Cell| match next {
        NextPose::Random => Cell::Missing,
        NextPose::Guided => cell(),
    };
    let title = format!("Which grasp next: grasps until {:.0} % sure, of an object that nobody moves", 100.0 * SURE);
    TableRows::new("guided", title, &rows).columns(&[
        Column("grasps", "", &|(case, ..)| case.described().into()),
        Column("poses", "", &|(.., next)| next.name().into()),
        Column("grasps after the first", "", &|row| resampled(row, |chosen| after_first(row.1, row.2, chosen))),
        Column("saved", PERCENT, &|row| {
            let of = |next, chosen: &[usize]| after_first(row.1, next, chosen);
            let saved = |chosen: &[usize]| 1.0 - of(NextPose::Guided, chosen) / of(NextPose::Random, chosen);
            if_guided(row, &|| resampled(row, saved))
        }),
        Column("to save", PERCENT, &|row| if_guided(row, &|| Cell::Number(TO_SAVE))),
        Column("sure", PERCENT, &|row| share(row, |ended| Some(ended.sure))),
        Column("right when sure", PERCENT, &|row| share(row, |ended| ended.sure.then_some(ended.right))),
        Column("rounds", "", &|(_, rounds, _)| rounds.len().into()),
    ])
}
