//! Recognition beyond the paper: what methods of our own reach, with perfect sensors, with real ones, and on grippers of which
//! no grasp is labelled, beside the targets.

use super::answers::{BOOTSTRAP, ModelAnswers, Pool, judge};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{named_rows, percent_row};
use super::emulated_grasps::EmulatedGrippers;
use super::plan::{DataWanted, POSES, StudyPlan};
use super::report::{Cell, FigureLink, FigureMark, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{OWN, StudyCard, UnitResult};
use crate::datasets::{DatasetError, SensorView, noise_seed, sequence_of};
use crate::grasping::random_shapes;
use palpate_geometry::drawing::{DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis};
use palpate_learn::evaluation::{answer, rounds};
use palpate_learn::metrics::Interval;
use palpate_learn::{Belief, Dataset, Example, Method, Shipped, check_apart, method};
use palpate_sim::gripper::Phase;
use palpate_sim::scene::{PosePreset, Scene};
use palpate_tactile::model::{PhysicalLike, SensorModel};
use palpate_tactile::trial::TrialId;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

pub(super) struct Recognition;

const CARD: StudyCard = StudyCard {
    key: "recognition",
    title: "Recognition beyond the paper",
    about: "trees and networks that know geometry, the shipped models, unknown grippers without labels, and unknown objects",
    paper: OWN,
    budget: "about 90 CPU minutes",
};

/// Seed of the poses of grasps that judge.
const JUDGED: u64 = 8;
/// Grasps of each object that judge.
const TESTED: usize = 100;
/// Training draws.
const DRAWS: usize = 5;
/// Seeds of the emulated grippers' parts, and grasps of each object by each.
const EMULATED: std::ops::Range<u64> = 900..906;
const EMULATED_EACH: u64 = 3;
/// Seeds of the random shapes of the class "other", which the encoders have not seen either.
const OTHERS: std::ops::Range<u64> = 20_000..21_000;

/// What a model learns from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Learns {
    /// So many grasps of each object like those that it is judged on.
    Like { of_each: usize, draws: usize },
    /// The same with labels in random order, a control.
    Shuffled { of_each: usize },
    /// It comes with the program.
    Shipped(Shipped),
}

/// How the grasps that judge are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reads {
    /// Through sensors of a gripper of this build: 0 that of the scene, 1 any.
    Sensors { sensors: SensorModel, build: f64 },
    /// Through sensors that only slip, drift and are noisy.
    MildNoise,
    /// By emulated grippers.
    Emulated,
}

/// A row of the table.
pub(super) struct Question {
    name: &'static str,
    preset: &'static str,
    fixed: bool,
    learns: Learns,
    reads: Reads,
    /// Methods; one that is shipped has its own.
    methods: &'static [&'static str],
    /// F1 to reach after one grasp and after three, and beyond that.
    targets: [[Option<f64>; 2]; 2],
}

const TREES: &[&str] = &["extra-trees", "geometry-trees"];
const ALL: &[&str] = &["extra-trees", "geometry-trees", "geometry-network"];
const VIRTUAL: Reads = Reads::Sensors { sensors: SensorModel::Virtual, build: 0.0 };
const PHYSICAL: Reads = Reads::Sensors { sensors: SensorModel::PhysicalLike, build: 0.0 };
const ADAPTED: Reads = Reads::Sensors { sensors: SensorModel::Adapted, build: 0.0 };
const UNKNOWN: Reads = Reads::Sensors { sensors: SensorModel::Drawn, build: 1.0 };
const FIFTY: Learns = Learns::Like { of_each: 50, draws: DRAWS };

/// All rows.
const QUESTIONS: [Question; 13] = [
    Question {
        name: "B free, 50 of each",
        preset: "B",
        fixed: false,
        learns: FIFTY,
        reads: VIRTUAL,
        methods: ALL,
        targets: [[Some(0.84), Some(0.97)], [Some(0.87), Some(0.98)]],
    },
    Question {
        name: "B fixed, 50 of each",
        preset: "B",
        fixed: true,
        learns: FIFTY,
        reads: VIRTUAL,
        methods: ALL,
        targets: [[Some(0.58), Some(0.83)], [Some(0.60), Some(0.85)]],
    },
    Question {
        name: "B fixed, 400 of each",
        preset: "B",
        fixed: true,
        learns: Learns::Like { of_each: 400, draws: 1 },
        reads: VIRTUAL,
        methods: &["geometry-trees", "geometry-network"],
        targets: [[Some(0.72), Some(0.94)], [Some(0.76), None]],
    },
    Question {
        name: "A free, physical-like, 50 of each",
        preset: "A",
        fixed: false,
        learns: FIFTY,
        reads: PHYSICAL,
        methods: TREES,
        targets: [[Some(0.95), None], [Some(0.96), None]],
    },
    Question {
        name: "A fixed, physical-like, 50 of each",
        preset: "A",
        fixed: true,
        learns: FIFTY,
        reads: PHYSICAL,
        methods: TREES,
        targets: [[Some(0.85), None], [Some(0.88), None]],
    },
    Question {
        name: "shipped model, B free",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::PerfectSensors),
        reads: VIRTUAL,
        methods: &[],
        targets: [[Some(0.95), Some(0.995)], [Some(0.97), None]],
    },
    Question {
        name: "shipped model, B free, mild noise",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::PerfectSensors),
        reads: Reads::MildNoise,
        methods: &[],
        targets: [[Some(0.90), None], [Some(0.93), None]],
    },
    Question {
        name: "no labels, physical-like B",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: ADAPTED,
        methods: &[],
        targets: [[Some(0.68), Some(0.90)], [Some(0.72), Some(0.93)]],
    },
    Question {
        name: "no labels, physical-like A",
        preset: "A",
        fixed: false,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: ADAPTED,
        methods: &[],
        targets: [[Some(0.90), None], [Some(0.93), None]],
    },
    Question {
        name: "no labels, unknown mechanics too, B",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: UNKNOWN,
        methods: &[],
        targets: [[Some(0.60), Some(0.85)], [Some(0.68), Some(0.90)]],
    },
    Question {
        name: "no labels, emulated gripper, B",
        preset: "B",
        fixed: false,
        learns: Learns::Shipped(Shipped::AnyGripper),
        reads: Reads::Emulated,
        methods: &[],
        targets: [[Some(0.70), Some(0.93)], [Some(0.75), Some(0.95)]],
    },
    Question {
        name: "control: shuffled labels, B free",
        preset: "B",
        fixed: false,
        learns: Learns::Shuffled { of_each: 50 },
        reads: VIRTUAL,
        methods: &["geometry-trees"],
        targets: [[None; 2]; 2],
    },
    Question {
        name: "contact pressure, B free, 50 of each",
        preset: "B",
        fixed: false,
        learns: FIFTY,
        reads: VIRTUAL,
        methods: &["extra-trees"],
        targets: [[None; 2]; 2],
    },
];

/// Row on the channel that only simulations have.
const CONTACT: &str = "contact pressure, B free, 50 of each";
/// Row of the unknown objects: area under the curve of known against unknown ones, each object left out in turn.
const NOVELTY: &str = "unknown objects, B free";
const NOVELTY_METHOD: &str = "geometry-trees";
const NOVELTY_TARGETS: [[f64; 2]; 2] = [[0.87, 0.95], [0.90, 0.97]];

pub(super) enum Case {
    Answers { question: &'static Question, method: &'static Method, draw: usize },
    Novelty { left_out: String, method: &'static Method },
}

impl Question {
    fn methods(&self) -> Vec<&'static Method> {
        match self.learns {
            Learns::Shipped(shipped) => {
                // A damaged shipped model fails a test of its own.
                let key = shipped.model().map(|model| model.card.method);
                key.ok().and_then(|key| method(&key)).into_iter().collect()
            }
            Learns::Like { .. } | Learns::Shuffled { .. } => {
                self.methods.iter().filter_map(|key| method(key)).collect()
            }
        }
    }

    /// Training grasps of each object that one draw takes, and number of draws.
    fn draws(&self, plan: &StudyPlan) -> (usize, usize) {
        match self.learns {
            Learns::Like { of_each, draws } => (plan.grasps(of_each, 20), plan.pick(draws, 1, 1)),
            Learns::Shuffled { of_each } => (plan.grasps(of_each, 20), 1),
            Learns::Shipped(_) => (0, 1),
        }
    }

    /// Grasps that judge, or a draw of those that a model learns from.
    fn wanted(&self, plan: &StudyPlan, grasps: usize, poses: u64) -> DataWanted {
        let (sensors, build) = match self.reads {
            Reads::Sensors { sensors, build } => (sensors, build),
            Reads::MildNoise | Reads::Emulated => (SensorModel::Virtual, 0.0),
        };
        let usual = plan.wanted(grasps, sensors);
        let mut view = usual.view.clone();
        if self.name == CONTACT {
            view = view.with_signals(palpate_tactile::SignalDefinition::Contact);
        }
        DataWanted { preset: self.preset.to_owned(), fixed: self.fixed, build, poses, view, ..usual }
    }
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let mut cases = Vec::new();
        for question in &QUESTIONS {
            for method in question.methods() {
                let draws = question.draws(plan).1;
                cases.extend((0..draws).map(|draw| Self::Answers { question, method, draw }));
            }
        }
        let left_out = plan.objects().into_iter().take(plan.pick(usize::MAX, 2, 1));
        let novelty = method(NOVELTY_METHOD);
        cases.extend(left_out.filter_map(|left_out| Some(Self::Novelty { left_out, method: novelty? })));
        cases
    }

    fn name(&self) -> String {
        match self {
            Self::Answers { question, method, draw } => {
                let shipped = match question.learns {
                    Learns::Shipped(shipped) => {
                        format!(", {}", shipped.model().map_or_else(|_| String::new(), |m| m.card.described()))
                    }
                    Learns::Like { .. } | Learns::Shuffled { .. } => String::new(),
                };
                format!("{}, {}, draw {}{shipped}", question.name, method.key, draw + 1)
            }
            Self::Novelty { left_out, method } => format!("{NOVELTY}, {}, without {left_out}", method.key),
        }
    }

    fn method(&self) -> &'static Method {
        match self {
            Self::Answers { method, .. } | Self::Novelty { method, .. } => method,
        }
    }
}

/// Answers after one grasp and after three.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Answered {
    one: ModelAnswers,
    /// The same test grasps, each followed by two others of its object.
    three: Vec<usize>,
}

/// Known and unknown objects told apart: the score of each test grasp, and whether its object was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Scored {
    data: String,
    trials: Vec<TrialId>,
    is_new: Vec<bool>,
    /// After one grasp, and after three.
    scores: [Vec<f64>; 2],
}

impl Case {
    fn answers(
        question: &Question,
        method: &Method,
        draw: usize,
        bench: &StudyBench<'_>,
    ) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let (of_each, draws) = question.draws(plan);
        let Some(test) = tested(question, bench)? else { return Ok(None) };
        let model = match question.learns {
            Learns::Shipped(shipped) => shipped.model().map_err(|error| StudyError::Missing(error.to_string()))?,
            Learns::Like { .. } | Learns::Shuffled { .. } => {
                let Some(all) = bench.data(&question.wanted(plan, of_each * draws, POSES))? else { return Ok(None) };
                let own = all.by_class().into_iter().flat_map(|of| of.into_iter().skip(draw * of_each).take(of_each));
                let mut train = all.part(&own.collect::<Vec<_>>());
                check_apart(&train.examples, &test.examples)?;
                if matches!(question.learns, Learns::Shuffled { .. }) {
                    train = train.with_shuffled_labels(plan.seed);
                }
                let Some(model) = bench.fit(method, &train)? else { return Ok(None) };
                model
            }
        };
        let test = test.relabelled(&model.card.labels);
        let test = test.ok_or_else(|| StudyError::Missing("a model that knows the objects".to_owned()))?;
        let (one, answers) = (judge(&model, &test), answer(model.recogniser.as_ref(), &test));
        let rounds = rounds(model.recogniser.as_ref(), &test, &answers, plan.seed);
        let after_three = |belief: &Belief| belief.steps().get(2).or(belief.now()).map_or(0, |pmf| pmf.top().0);
        let three = rounds.iter().map(|round| after_three(&round.belief)).collect();
        UnitResult::new(&Answered { one, three }).map(Some)
    }

    /// How surely each test grasp is of a known object, for a model that has not learned one of them.
    fn novelty(left_out: &str, method: &Method, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
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
        let train = with_others(&all.part(&known), &others);
        check_apart(&train.examples, &test.examples)?;
        let Some(model) = bench.fit(method, &train)? else { return Ok(None) };
        let other = model.card.labels.other().ok_or_else(|| StudyError::Missing("random shapes".to_owned()))?;
        let recogniser = model.recogniser.as_ref();
        let answers = answer(recogniser, &test);
        let rounds = rounds(recogniser, &test, &answers, plan.seed);
        let score = |belief: &Belief, grasps: usize| {
            let pmf = belief.steps().get(grasps - 1).or(belief.now());
            pmf.map_or(0.0, |pmf| pmf.probabilities()[other].max(f64::MIN_POSITIVE).ln())
        };
        let is_new = |example: &Example| test.labels.classes[example.class].name == left_out;
        let scored = Scored {
            data: test.about.described(),
            trials: test.examples.iter().map(|example| example.id).collect(),
            is_new: test.examples.iter().map(is_new).collect(),
            scores: [1, 3].map(|grasps| rounds.iter().map(|round| score(&round.belief, grasps)).collect()),
        };
        UnitResult::new(&scored).map(Some)
    }
}

/// Grasps that judge; none where it was cancelled.
fn tested(question: &Question, bench: &StudyBench<'_>) -> Result<Option<Arc<Dataset>>, StudyError> {
    let plan = bench.plan();
    let wanted = question.wanted(plan, plan.grasps(TESTED, 10), JUDGED);
    match question.reads {
        Reads::Sensors { .. } => bench.data(&wanted),
        Reads::MildNoise => {
            let Some(data) = bench.data(&wanted)? else { return Ok(None) };
            mildly_noisy(bench, &data).map(|data| Some(Arc::new(data)))
        }
        Reads::Emulated => {
            let preset = PosePreset::named(question.preset);
            let preset = preset.ok_or_else(|| StudyError::Unknown(format!("preset {}", question.preset)))?;
            let scene = Scene { pose: preset.poses(), ..Scene::default() };
            let seeds = EMULATED.start..EMULATED.start + plan.pick(EMULATED.end - EMULATED.start, 1, 1);
            let objects = plan.objects();
            let grippers = EmulatedGrippers {
                scene: &scene,
                preset: question.preset,
                seeds,
                objects: &objects,
                each: plan.pick(EMULATED_EACH, 1, 1),
            };
            let shipped = Shipped::AnyGripper.model().map_err(|error| StudyError::Missing(error.to_string()))?;
            grippers.grasps(&shipped.card.channels).map(|data| Some(Arc::new(data)))
        }
    }
}

/// The grasps through sensors that slip, drift and are noisy, and have no other fault.
fn mildly_noisy(bench: &StudyBench<'_>, data: &Dataset) -> Result<Dataset, StudyError> {
    let settings = PhysicalLike { slip: true, drift: true, noise: true, counts: true, ..PhysicalLike::OFF };
    let mut noisy = data.clone();
    for example in &mut noisy.examples {
        let trial = bench.simulated(example.id)?;
        let trial = trial.ok_or_else(|| StudyError::Missing("simulated grasps".to_owned()))?;
        let clean = SensorView::default().signals(&trial).map_err(|cause| DatasetError::Layout { cause })?;
        let end = trial.frames().iter().rev().find(|f| f.phase != Phase::Release).map_or(f64::INFINITY, |f| f.t);
        example.grasp = Arc::new(sequence_of(&settings.apply(&clean, noise_seed(&trial.header)).until(end)));
    }
    Ok(noisy)
}

/// Grasps of known classes and of random shapes together.
fn with_others(known: &Dataset, others: &Dataset) -> Dataset {
    let used: Vec<usize> =
        (0..known.labels.classes.len()).filter(|class| known.examples.iter().any(|e| e.class == *class)).collect();
    let mut both = known.clone();
    both.labels.classes = used.iter().map(|class| known.labels.classes[*class].clone()).collect();
    for example in &mut both.examples {
        example.class = used.iter().position(|class| *class == example.class).unwrap_or_default();
    }
    both.with_class_of(others)
}

/// Share of pairs of an unknown and a known object in which the unknown one has the higher score (AUROC), over resampled trials.
fn area(scored: &[Scored], grasps: usize) -> Option<Interval> {
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

impl CaseStudy for Recognition {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        match case {
            Case::Answers { question, method, draw } => Case::answers(question, method, draw, bench),
            Case::Novelty { left_out, method } => Case::novelty(&left_out, method, bench),
        }
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut kinds: Vec<(&'static Question, &'static str, Vec<Answered>)> = Vec::new();
        let (mut scored, mut data): (Vec<Scored>, Vec<String>) = (Vec::new(), Vec::new());
        let mut note = |text: &String| {
            if !data.contains(text) {
                data.push(text.clone());
            }
        };
        for case in Case::all(plan) {
            let Some(unit) = units.get(&case.name()) else { continue };
            match case {
                Case::Answers { question, method, .. } => {
                    let answered: Answered = unit.read()?;
                    note(&answered.one.data);
                    match kinds.iter_mut().find(|(own, key, _)| own.name == question.name && *key == method.key) {
                        Some((.., parts)) => parts.push(answered),
                        None => kinds.push((question, method.key, vec![answered])),
                    }
                }
                Case::Novelty { .. } => {
                    let own: Scored = unit.read()?;
                    note(&own.data);
                    scored.push(own);
                }
            }
        }
        let title =
            "Recognition beyond the paper: macro F1, for unknown objects the area under the curve; targets in brackets";
        let columns = [
            ("grasps", ""),
            ("model", ""),
            ("draws", ""),
            ("one grasp", PERCENT),
            ("to reach", PERCENT),
            ("three grasps", PERCENT),
            ("to reach after three", PERCENT),
            ("beyond", ""),
            ("reached", ""),
            ("tested", "grasps"),
        ];
        let mut table = StudyTable::new(CARD.key, title, &columns);
        for (question, key, parts) in &kinds {
            let one = Pool::of(parts.iter().map(|part| &part.one));
            let after = |part: &Answered| ModelAnswers { decided: part.three.clone(), ..part.one.clone() };
            let three: Vec<ModelAnswers> = parts.iter().map(after).collect();
            let three = Pool::of(&three);
            let found = [one.f1(), three.f1()];
            push(&mut table, [question.name, key], parts.len(), found, question.targets, (one.len(), one.misjudged()));
        }
        if !scored.is_empty() {
            let found = [0, 1].map(|grasps| area(&scored, grasps));
            let targets = NOVELTY_TARGETS.map(|both| both.map(Some));
            let tested = scored.iter().map(|own| own.trials.len()).max().unwrap_or(0);
            push(&mut table, [NOVELTY, NOVELTY_METHOD], scored.len(), found, targets, (tested, Vec::new()));
        }
        Ok(StudyReport::new(data, vec![table], Vec::new()))
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        report.table(CARD.key).map(|(at, table)| figure(at, table)).into_iter().collect()
    }
}

/// Adds a row: what was found after one grasp and after three, and the targets.
fn push(
    table: &mut StudyTable,
    names: [&str; 2],
    draws: usize,
    found: [Option<Interval>; 2],
    [reach, beyond]: [[Option<f64>; 2]; 2],
    (tested, misjudged): (usize, Vec<TrialId>),
) {
    let cell = |value: Option<f64>| value.map_or(Cell::Missing, Cell::Number);
    let reaches = |targets: [Option<f64>; 2]| {
        let both = found.iter().zip(targets).filter_map(|(found, target)| Some(found.as_ref()?.estimate >= target?));
        both.collect::<Vec<bool>>()
    };
    let (reached, went_beyond) = (reaches(reach), reaches(beyond));
    let verdict = match () {
        () if reached.is_empty() => "-",
        () if reached.contains(&false) => "no",
        () if went_beyond.is_empty() || went_beyond.contains(&false) => "yes",
        () => "beyond",
    };
    let listed: Vec<String> = beyond.iter().flatten().map(|target| format!("{:.0}", 100.0 * target)).collect();
    table.push(
        vec![
            Cell::text(names[0]),
            Cell::text(names[1]),
            Cell::Number(draws as f64),
            Cell::interval(found[0]),
            cell(reach[0]),
            Cell::interval(found[1]),
            cell(reach[1]),
            Cell::text(if listed.is_empty() { "-".to_owned() } else { listed.join(", ") }),
            Cell::text(verdict),
            Cell::Number(tested as f64),
        ],
        misjudged,
    );
}

/// One plot for one grasp and one for three: a row for each question and model, with the target as a line.
fn figure(at: usize, table: &StudyTable) -> LinkedFigure {
    let names: Vec<String> = (0..table.rows.len())
        .map(|row| format!("{}, {}", table.text(row, "grasps"), table.text(row, "model")))
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    for (title, column, target) in
        [("one grasp", "one grasp", "to reach"), ("three grasps", "three grasps", "to reach after three")]
    {
        let mut series = [(Marker::Dot, Vec::new()), (Marker::Ring, Vec::new())];
        for row in 0..table.rows.len() {
            for (number, (column, (_, points))) in [column, target].iter().zip(&mut series).enumerate() {
                if table.cell(row, column).value().is_some() {
                    let mark = FigureMark::Point(number, points.len());
                    links.push(FigureLink { plot: plots.len(), mark, table: at, row });
                    points.push(percent_row(table, row, column, -(row as f64)));
                }
            }
        }
        let shown = ["reached", "to reach"];
        let series = series.into_iter().zip(shown).enumerate().map(|(colour, ((marker, points), name))| DataSeries {
            name: if plots.is_empty() { name.to_owned() } else { String::new() },
            colour,
            line: LineStyle::None,
            marker,
            points,
        });
        plots.push(Plot {
            title: title.to_owned(),
            x: PlotAxis { range: Some([0.0, 100.0]), ..PlotAxis::linear("macro F1, or area under the curve (%)") },
            y: named_rows(&names),
            series: series.collect(),
            ..Plot::default()
        });
    }
    let note = "Test grasps from collections with seeds of their own. 95 % intervals by bootstrap over test grasps."
        .to_owned();
    let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1240, 760], links }
}
