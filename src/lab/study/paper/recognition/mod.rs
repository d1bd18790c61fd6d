//! Recognition beyond the paper: what methods of our own reach, with perfect sensors, with real ones, and on grippers of which
//! no grasp is labelled, beside the targets.

mod guided;
mod new_objects;
mod novelty;
mod questions;

use super::answers::{ModelAnswers, Pool, judge_answers};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{named_rows, percent_row};
use super::emulated_grasps::EmulatedGrippers;
use super::plan::StudyPlan;
use super::report::{Cell, FigureLink, FigureMark, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{OWN, StudyCard, UnitResult};
use crate::study::comparison::with_true_size_and_shape;
use guided::{GuidedCase, GuidedRounds, guided};
use new_objects::{mean_f1, new_object};
use novelty::{
    EMULATED_NOVELTY, EmulatedRounds, NOVELTY, NOVELTY_METHOD, NOVELTY_TARGETS, OTHERS, Scored, area, decisions,
    emulated_novelty, novelty,
};
use palpate_geometry::drawing::{DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis};
use palpate_learn::evaluation::{answer, rounds};
use palpate_learn::metrics::Interval;
use palpate_learn::{Belief, Dataset, Method, Shipped, check_apart, method};
use palpate_sim::scene::{PosePreset, Scene};
use palpate_tactile::trial::TrialId;
pub(super) use questions::UNLABELLED;
use questions::{JUDGED, Learns, NEW_OBJECTS, QUESTIONS, Question, Reads, TESTED};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

pub(super) struct Recognition;

const CARD: StudyCard = StudyCard {
    key: "recognition",
    title: "Recognition beyond the paper",
    about: "trees and networks that know geometry, the shipped models, unknown grippers without labels, and unknown objects",
    paper: OWN,
    budget: "about 120 CPU minutes",
};

/// Seeds of the emulated grippers' parts, and grasps of each object by each.
const EMULATED: std::ops::Range<u64> = 900..906;
const EMULATED_EACH: u64 = 3;

pub(super) enum Case {
    Answers { question: &'static Question, method: &'static Method, draw: usize },
    Novelty { left_out: String, method: &'static Method },
    EmulatedNovelty { method: &'static Method },
    NewObject { question: &'static Question, left_out: String, method: &'static Method },
    Guided { which: GuidedCase, method: &'static Method },
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let mut cases = Vec::new();
        for question in &QUESTIONS {
            for method in question.methods.iter().filter_map(|key| method(key)) {
                let draws = question.draws(plan).1;
                cases.extend((0..draws).map(|draw| Self::Answers { question, method, draw }));
            }
        }
        let left_out = || plan.objects().into_iter().take(plan.pick(usize::MAX, 2, 1));
        let novelty = method(NOVELTY_METHOD);
        cases.extend(left_out().filter_map(|left_out| Some(Self::Novelty { left_out, method: novelty? })));
        cases.extend(method("geometry-network").map(|method| Self::EmulatedNovelty { method }));
        for question in &NEW_OBJECTS {
            for method in question.methods.iter().filter_map(|key| method(key)) {
                cases.extend(left_out().map(|left_out| Self::NewObject { question, left_out, method }));
            }
        }
        let guided = |which: GuidedCase| Some(Self::Guided { which, method: method(which.method())? });
        cases.extend(GuidedCase::ALL.into_iter().filter_map(guided));
        cases
    }

    fn name(&self) -> String {
        match self {
            Self::Answers { question, method, draw } => {
                // Answers of another shipped model are others.
                let shipped = match question.learns {
                    Learns::Shipped(shipped) => format!(", {:08x}", shipped.model_content()),
                    Learns::Like { .. } | Learns::Drawn { .. } | Learns::Shuffled { .. } | Learns::Given { .. } => {
                        String::new()
                    }
                };
                format!("{}, {}, draw {}{shipped}", question.name, method.key, draw + 1)
            }
            Self::Novelty { left_out, method } => {
                format!("{NOVELTY}, {}, {} shapes, without {left_out}", method.key, OTHERS.count())
            }
            Self::EmulatedNovelty { .. } => {
                format!("{EMULATED_NOVELTY}, {:08x}", Shipped::AnyGripper.model_content())
            }
            Self::NewObject { question, left_out, method } => {
                format!("{}, {}, {left_out}", question.name, method.key)
            }
            Self::Guided { which, .. } => which.name(),
        }
    }

    fn method(&self) -> &'static Method {
        match self {
            Self::Answers { method, .. }
            | Self::Novelty { method, .. }
            | Self::EmulatedNovelty { method }
            | Self::NewObject { method, .. }
            | Self::Guided { method, .. } => method,
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

impl Case {
    fn answers(
        question: &Question,
        method: &Method,
        draw: usize,
        bench: &StudyBench<'_>,
    ) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let (of_each, _) = question.draws(plan);
        let Some(test) = tested(question, bench)? else { return Ok(None) };
        let model = match question.learns {
            Learns::Shipped(shipped) => shipped.model().map_err(|error| StudyError::Missing(error.to_string()))?,
            Learns::Like { .. } | Learns::Drawn { .. } | Learns::Shuffled { .. } | Learns::Given { .. } => {
                let Some(all) = bench.data(&question.learned(plan))? else { return Ok(None) };
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
        let unseen = |k: &usize| !model.card.learned.contains(&test.examples[*k]);
        let test = test.part(&(0..test.examples.len()).filter(unseen).collect::<Vec<_>>());
        let test = test.relabelled(&model.card.labels).filter(|_| model.card.method == method.key);
        let test =
            test.ok_or_else(|| StudyError::Missing("a model of this method that knows the objects".to_owned()))?;
        let answers = answer(model.recogniser.as_ref(), &test);
        let answers = match question.learns {
            Learns::Given { .. } => with_true_size_and_shape(&answers, &test),
            Learns::Like { .. } | Learns::Drawn { .. } | Learns::Shuffled { .. } | Learns::Shipped(_) => answers,
        };
        let one = judge_answers(&model, &test, &answers);
        let rounds = rounds(model.recogniser.as_ref(), &test, &answers, plan.seed);
        let after_three = |belief: &Belief| belief.steps().get(2).or(belief.now()).map_or(0, |pmf| pmf.top().0);
        let three = rounds.iter().map(|round| after_three(&round.belief)).collect();
        UnitResult::new(&Answered { one, three }).map(Some)
    }
}

/// Grasps that judge; none where it was cancelled.
fn tested(question: &Question, bench: &StudyBench<'_>) -> Result<Option<Arc<Dataset>>, StudyError> {
    let plan = bench.plan();
    let wanted = question.wanted(plan, plan.grasps(TESTED, 10), JUDGED);
    match question.reads {
        Reads::Sensors { .. } | Reads::Contact => bench.data(&wanted),
        Reads::Emulated => emulated(question.preset, &plan.objects(), plan).map(|data| Some(Arc::new(data))),
    }
}

/// Grasps of objects by emulated grippers, as the shipped model for any gripper reads them.
fn emulated(preset: &'static str, objects: &[String], plan: &StudyPlan) -> Result<Dataset, StudyError> {
    let poses = PosePreset::named(preset).ok_or_else(|| StudyError::Unknown(format!("preset {preset}")))?.poses();
    let scene = Scene { pose: poses, ..Scene::default() };
    let seeds = EMULATED.start..EMULATED.start + plan.pick(EMULATED.end - EMULATED.start, 1, 1);
    let each = plan.pick(EMULATED_EACH, 1, 1);
    let shipped = Shipped::AnyGripper.model().map_err(|error| StudyError::Missing(error.to_string()))?;
    EmulatedGrippers { scene: &scene, preset, seeds, objects, each }.grasps(&shipped.card.channels)
}

impl CaseStudy for Recognition {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        if bench.plan().query.is_some() {
            let needs = "grasps of several presets that it simulates; leave out the options that choose trials";
            return Err(StudyError::Missing(needs.to_owned()));
        }
        match case {
            Case::Answers { question, method, draw } => Case::answers(question, method, draw, bench),
            Case::Novelty { left_out, method } => novelty(&left_out, method, bench),
            Case::EmulatedNovelty { .. } => emulated_novelty(bench),
            Case::NewObject { question, left_out, method } => new_object(question, &left_out, method, bench),
            Case::Guided { which, .. } => guided(which, bench),
        }
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut kinds: Vec<(&'static Question, &'static str, Vec<Answered>)> = Vec::new();
        let (mut scored, mut data): (Vec<Scored>, Vec<String>) = (Vec::new(), Vec::new());
        let mut taught: Vec<(&'static Question, &'static str, Vec<Scored>)> = Vec::new();
        let mut strangers: Option<(&'static str, EmulatedRounds)> = None;
        let mut guided = Vec::new();
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
                Case::EmulatedNovelty { method } => {
                    let own: EmulatedRounds = unit.read()?;
                    note(&own.scored.data);
                    strangers = Some((method.key, own));
                }
                Case::NewObject { question, method, .. } => {
                    let own: Scored = unit.read()?;
                    note(&own.data);
                    match taught.iter_mut().find(|(known, key, _)| known.name == question.name && *key == method.key) {
                        Some((.., parts)) => parts.push(own),
                        None => taught.push((question, method.key, vec![own])),
                    }
                }
                Case::Guided { which, .. } => {
                    let own: GuidedRounds = unit.read()?;
                    note(&own.data);
                    guided.push((which, own));
                }
            }
        }
        let title =
            "Recognition beyond the paper: macro F1, for unknown objects the area under the curve, beside targets";
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
        let said = strangers.as_ref().map(|(_, own)| decisions(own));
        if let Some((key, EmulatedRounds { scored, .. })) = strangers {
            let (tested, all) = (scored.trials.len(), [scored]);
            let found = [0, 1].map(|grasps| area(&all, grasps));
            push(&mut table, [EMULATED_NOVELTY, key], 1, found, [[None; 2]; 2], (tested, Vec::new()));
        }
        for (question, key, parts) in &taught {
            let found = [0, 1].map(|grasps| mean_f1(parts, grasps));
            let tested = parts.iter().map(|own| own.trials.len()).max().unwrap_or(0);
            push(&mut table, [question.name, key], parts.len(), found, question.targets, (tested, Vec::new()));
        }
        let next = (!guided.is_empty()).then(|| guided::table(&guided));
        let tables = [Some(table), said, next, Some(costs(&kinds))];
        Ok(StudyReport::new(data, tables.into_iter().flatten().collect(), Vec::new()))
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

/// What the models of the rows cost, means over draws.
fn costs(kinds: &[(&'static Question, &'static str, Vec<Answered>)]) -> StudyTable {
    let columns = [
        ("grasps", ""),
        ("model", ""),
        ("training", "CPU s"),
        ("answer", "ms"),
        ("live step", "µs"),
        ("file", "kB"),
        ("parameters", ""),
    ];
    let mut table = StudyTable::new("costs", "Cost of the models", &columns);
    for (question, key, parts) in kinds {
        let mean = |of: &dyn Fn(&Answered) -> Option<f64>| {
            let all: Option<Vec<f64>> = parts.iter().map(of).collect();
            let all = all.filter(|all| !all.is_empty());
            all.map_or(Cell::Missing, |all| Cell::Number(all.iter().sum::<f64>() / all.len() as f64))
        };
        let cost = |of: fn(&ModelAnswers) -> Option<f64>| mean(&|part| of(&part.one));
        let row = vec![
            Cell::text(question.name),
            Cell::text(*key),
            // Whatever made a shipped model is measured elsewhere.
            if matches!(question.learns, Learns::Shipped(_)) {
                Cell::Missing
            } else {
                cost(|own| Some(own.cost.train_cpu_s))
            },
            cost(|own| Some(own.cost.answer_ms)),
            cost(|own| own.cost.step_us),
            cost(|own| Some(own.cost.bytes as f64 * 1e-3)),
            cost(|own| Some(own.cost.parameters as f64)),
        ];
        table.push(row, Vec::new());
    }
    table
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
