//! Recognition beyond the paper: what methods of our own reach, with perfect sensors, with real ones, and on grippers of which
//! no grasp is labelled, beside the targets.

mod guided;
mod new_objects;
mod novelty;
mod questions;

use super::answers::{judge_answers, mean};
use super::emulated_grasps::EmulatedGrippers;
use super::prelude::*;
use guided::{GuidedCase, GuidedRounds, guided};
use new_objects::{mean_f1, new_object};
use novelty::{
    EMULATED_NOVELTY, EmulatedRounds, NOVELTY, NOVELTY_METHOD, NOVELTY_TARGETS, OTHERS, Scored, area, decisions,
    emulated_novelty, novelty,
};
use palpate_learn::comparison::with_true_size_and_shape;
use palpate_learn::evaluation::{answer, rounds};
use palpate_learn::{Shipped, check_apart};
use palpate_sim::scene::{PosePreset, Scene};
pub(super) use questions::UNLABELLED;
use questions::{JUDGED, Learns, NEW_OBJECTS, QUESTIONS, Question, Reads, TESTED, Targets};

pub(super) struct Recognition;

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

impl StudyCell for Case {
    fn name(&self) -> String {
        match self {
            Self::Answers { question, method, draw } => {
                // Answers depend on the shipped model.
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

    fn method(&self) -> Option<&'static Method> {
        match self {
            Self::Answers { method, .. }
            | Self::Novelty { method, .. }
            | Self::EmulatedNovelty { method }
            | Self::NewObject { method, .. }
            | Self::Guided { method, .. } => Some(method),
        }
    }
}

/// Answers after one grasp and after three.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Answered {
    one: ModelAnswers,
    /// The same test grasps, each followed by two others of its object.
    three: Vec<usize>,
}

impl Answered {
    fn new(question: &Question, method: &Method, draw: usize, bench: &StudyData<'_>) -> Result<Self, StudyError> {
        let plan = bench.plan();
        let (of_each, _) = question.draws(plan);
        let test = tested(question, bench)?;
        let model = match question.learns {
            Learns::Shipped(shipped) => shipped.model().map_err(StudyError::missing)?,
            Learns::Like { .. } | Learns::Drawn { .. } | Learns::Shuffled { .. } | Learns::Given { .. } => {
                let all = bench.data(&question.learned(plan))?;
                let own = all.by_class().into_iter().flat_map(|of| of.into_iter().skip(draw * of_each).take(of_each));
                let mut train = all.part(&own.collect::<Vec<_>>());
                check_apart(&train.examples, &test.examples)?;
                if matches!(question.learns, Learns::Shuffled { .. }) {
                    train = train.with_shuffled_labels(plan.seed);
                }
                bench.fit(method, &train)?
            }
        };
        let unseen = |k: &usize| !model.card.learned.contains(&test.examples[*k]);
        let test = test.part(&(0..test.examples.len()).filter(unseen).collect::<Vec<_>>());
        let test = test.relabelled(&model.card.labels).filter(|_| model.card.method == method.key);
        let test = test.ok_or_else(|| StudyError::missing("a model of this method that knows the objects"))?;
        let answers = answer(model.recogniser.as_ref(), &test);
        let answers = match question.learns {
            Learns::Given { .. } => with_true_size_and_shape(&answers, &test),
            Learns::Like { .. } | Learns::Drawn { .. } | Learns::Shuffled { .. } | Learns::Shipped(_) => answers,
        };
        let one = judge_answers(&model, &test, &answers);
        let rounds = rounds(model.recogniser.as_ref(), &test, &answers, plan.seed);
        let after_three = |belief: &Belief| belief.steps().get(2).or(belief.now()).map_or(0, |pmf| pmf.top().0);
        let three = rounds.iter().map(|round| after_three(&round.belief)).collect();
        Ok(Self { one, three })
    }
}

/// Grasps that judge.
fn tested(question: &Question, bench: &StudyData<'_>) -> Result<Arc<Dataset>, StudyError> {
    let plan = bench.plan();
    let wanted = question.wanted(plan, plan.grasps(TESTED, 10), JUDGED);
    match question.reads {
        Reads::Sensors { .. } | Reads::Contact => bench.data(&wanted),
        Reads::Emulated => emulated(question.preset, &plan.objects(), plan).map(Arc::new),
    }
}

/// Grasps of objects by emulated grippers, as the shipped model for any gripper reads them.
fn emulated(preset: &'static str, objects: &[String], plan: &StudyPlan) -> Result<Dataset, StudyError> {
    let poses = PosePreset::named(preset).ok_or_else(|| StudyError::Unknown(format!("preset {preset}")))?.poses();
    let scene = Scene { pose: poses, ..Scene::default() };
    let seeds = EMULATED.start..EMULATED.start + plan.pick(EMULATED.end - EMULATED.start, 1, 1);
    let each = plan.pick(EMULATED_EACH, 1, 1);
    let shipped = Shipped::AnyGripper.model().map_err(StudyError::missing)?;
    EmulatedGrippers { scene: &scene, preset, seeds, objects, each }.grasps(&shipped.card.channels)
}

/// What is found in a cell.
#[derive(Clone, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Found {
    Answered(Answered),
    Emulated(EmulatedRounds),
    Guided(GuidedRounds),
    Scored(Scored),
}

impl Found {
    /// Description of the data.
    fn data(&self) -> &str {
        match self {
            Self::Answered(own) => &own.one.data,
            Self::Emulated(own) => &own.scored.data,
            Self::Guided(own) => &own.data,
            Self::Scored(own) => &own.data,
        }
    }
}

impl Study for Recognition {
    type Cell = Case;
    type Found = Found;

    const CARD: StudyCard = StudyCard {
        key: "recognition",
        title: "Recognition beyond the paper",
        about: "trees and networks that know geometry, the shipped models, unknown grippers without labels, and unknown objects",
        paper: OWN_METHODS,
    };

    fn grid(plan: &StudyPlan) -> Vec<Case> {
        let mut cases = Vec::new();
        for question in &QUESTIONS {
            for method in question.methods.iter().filter_map(|key| method(key)) {
                let draws = question.draws(plan).1;
                cases.extend((0..draws).map(|draw| Case::Answers { question, method, draw }));
            }
        }
        let left_out = || plan.objects().into_iter().take(plan.pick(usize::MAX, 2, 1));
        let novelty = method(NOVELTY_METHOD);
        cases.extend(left_out().filter_map(|left_out| Some(Case::Novelty { left_out, method: novelty? })));
        cases.extend(method("geometry-network").map(|method| Case::EmulatedNovelty { method }));
        for question in &NEW_OBJECTS {
            for method in question.methods.iter().filter_map(|key| method(key)) {
                cases.extend(left_out().map(|left_out| Case::NewObject { question, left_out, method }));
            }
        }
        let guided = |which: GuidedCase| Some(Case::Guided { which, method: method(which.method())? });
        cases.extend(GuidedCase::ALL.into_iter().filter_map(guided));
        cases
    }

    fn measure(case: &Case, bench: &StudyData<'_>) -> Result<Found, StudyError> {
        if bench.plan().query.is_some() {
            let needs = "grasps of several presets that it simulates; leave out the options that choose trials";
            return Err(StudyError::missing(needs));
        }
        Ok(match case {
            Case::Answers { question, method, draw } => Found::Answered(Answered::new(question, method, *draw, bench)?),
            Case::Novelty { left_out, method } => Found::Scored(novelty(left_out, method, bench)?),
            Case::EmulatedNovelty { .. } => Found::Emulated(emulated_novelty(bench)?),
            Case::NewObject { question, left_out, method } => {
                Found::Scored(new_object(question, left_out, method, bench)?)
            }
            Case::Guided { which, .. } => Found::Guided(guided(*which, bench)?),
        })
    }

    fn report(_: &StudyPlan, found: Vec<(Case, Found)>) -> StudyReport {
        let data = unique(found.iter().map(|(_, found)| found.data().to_owned()));
        let (mut answered, mut taught, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        let (mut strangers, mut guided) = (Vec::new(), Vec::new());
        for pair in found {
            match pair {
                (Case::Answers { question, method, .. }, Found::Answered(own)) => {
                    answered.push(((question, method.key), own));
                }
                (Case::NewObject { question, method, .. }, Found::Scored(own)) => {
                    taught.push(((question, method.key), own));
                }
                (Case::EmulatedNovelty { method }, Found::Emulated(own)) => strangers.push((method.key, own)),
                (Case::Guided { which, .. }, Found::Guided(own)) => guided.push((which, own)),
                (_, Found::Scored(own)) => left_out.push(own),
                (_, Found::Answered(_) | Found::Emulated(_) | Found::Guided(_)) => {}
            }
        }
        let answered = grouped(answered);
        let mut rows: Vec<Reached> = answered.iter().map(Reached::of_answers).collect();
        if !left_out.is_empty() {
            let found = [0, 1].map(|grasps| area(&left_out, grasps));
            let targets = NOVELTY_TARGETS.map(|both| both.map(Some));
            rows.push(Reached::of_scored([NOVELTY, NOVELTY_METHOD], found, targets, &left_out));
        }
        let said: Vec<StudyTable> = strangers.iter().map(|(_, own)| decisions(own)).collect();
        for (model, EmulatedRounds { scored, .. }) in strangers {
            let all = [scored];
            let found = [0, 1].map(|grasps| area(&all, grasps));
            rows.push(Reached::of_scored([EMULATED_NOVELTY, model], found, [[None; 2]; 2], &all));
        }
        for ((question, model), parts) in grouped(taught) {
            let found = [0, 1].map(|grasps| mean_f1(&parts, grasps));
            rows.push(Reached::of_scored([question.name, model], found, question.targets, &parts));
        }
        let next = (!guided.is_empty()).then(|| guided::table(&guided));
        let tables = [Reached::table(&rows)].into_iter().chain(said).chain(next).chain([costs(&answered)]);
        StudyReport::new(data, tables.collect(), Vec::new())
    }

    /// One plot for one grasp and one for three: a row for each question and model, with the target beside.
    fn figures(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
        let Some(mut figure) = LinkedPlots::of(report, "recognition") else { return Vec::new() };
        figure.named_once = true;
        let names: Vec<String> =
            figure.lines().map(|line| format!("{}, {}", line.text("grasps"), line.text("model"))).collect();
        for (title, target) in [("one grasp", "to reach"), ("three grasps", "to reach after three")] {
            figure.plots.push(Plot {
                title: title.to_owned(),
                x: PlotAxis { range: Some([0.0, 100.0]), ..PlotAxis::linear("macro F1, or area under the curve (%)") },
                y: named_rows(&names),
                ..Plot::default()
            });
            let shown = [(title, "reached", Marker::Dot), (target, "to reach", Marker::Ring)];
            for (colour, (column, name, marker)) in shown.into_iter().enumerate() {
                let lines = figure.lines().filter(|line| !line.value(column).is_nan());
                let points = lines.map(|line| (line, line.percent_row(column, -(line.row as f64))));
                figure.series(DataSeries { name: name.to_owned(), marker, ..dots(colour) }, points);
            }
        }
        let note =
            "Test grasps from collections with seeds of their own. 95 % intervals by bootstrap over test grasps.";
        vec![Some(figure.figure("recognition", 2, [1240, 760], note))]
    }
}

/// What was found after one grasp and after three, beside the targets.
struct Reached {
    names: [&'static str; 2],
    draws: usize,
    found: [Option<Interval>; 2],
    targets: Targets,
    tested: usize,
    misjudged: Vec<TrialId>,
}

/// Answers of all draws of a question by a method.
type Draws = ((&'static Question, &'static str), Vec<Answered>);

impl Reached {
    fn of_answers(((question, model), parts): &Draws) -> Self {
        let one = Pool::of(parts.iter().map(|part| &part.one));
        let after = |part: &Answered| ModelAnswers { decided: part.three.clone(), ..part.one.clone() };
        let three: Vec<ModelAnswers> = parts.iter().map(after).collect();
        Self {
            names: [question.name, model],
            draws: parts.len(),
            found: [one.f1(), Pool::of(&three).f1()],
            targets: question.targets,
            tested: one.len(),
            misjudged: one.misjudged(),
        }
    }

    fn of_scored(names: [&'static str; 2], found: [Option<Interval>; 2], targets: Targets, all: &[Scored]) -> Self {
        let tested = all.iter().map(|own| own.trials.len()).max().unwrap_or(0);
        Self { names, draws: all.len(), found, targets, tested, misjudged: Vec::new() }
    }

    fn beyond(&self) -> String {
        let listed: Vec<String> =
            self.targets[1].iter().flatten().map(|target| format!("{:.0}", 100.0 * target)).collect();
        if listed.is_empty() { "-".to_owned() } else { listed.join(", ") }
    }

    fn verdict(&self) -> &'static str {
        let [reached, went_beyond] = self.targets.map(|targets| {
            let both = self.found.iter().zip(targets);
            both.filter_map(|(found, target)| Some(found.as_ref()?.estimate >= target?)).collect::<Vec<bool>>()
        });
        match () {
            () if reached.is_empty() => "-",
            () if reached.contains(&false) => "no",
            () if went_beyond.is_empty() || went_beyond.contains(&false) => "yes",
            () => "beyond",
        }
    }

    fn table(rows: &[Self]) -> StudyTable {
        let title =
            "Recognition beyond the paper: macro F1, for unknown objects the area under the curve, beside targets";
        TableRows::new("recognition", title, rows).with_trials(&|row| row.misjudged.clone()).columns(&[
            Column("grasps", "", &|row| row.names[0].into()),
            Column("model", "", &|row| row.names[1].into()),
            Column("draws", "", &|row| row.draws.into()),
            Column("one grasp", PERCENT, &|row| row.found[0].into()),
            Column("to reach", PERCENT, &|row| row.targets[0][0].into()),
            Column("three grasps", PERCENT, &|row| row.found[1].into()),
            Column("to reach after three", PERCENT, &|row| row.targets[0][1].into()),
            Column("beyond", "", &|row| row.beyond().into()),
            Column("reached", "", &|row| row.verdict().into()),
            Column("tested", "grasps", &|row| row.tested.into()),
        ])
    }
}

/// What the models of the rows cost, means over draws.
fn costs(all: &[Draws]) -> StudyTable {
    let mean = |(_, parts): &Draws, of: fn(&ModelAnswers) -> Option<f64>| -> Cell {
        mean(parts.iter().map(|part| &part.one), of).into()
    };
    TableRows::new("costs", "Cost of the models", all).columns(&[
        Column("grasps", "", &|row| row.0.0.name.into()),
        Column("model", "", &|row| row.0.1.into()),
        // Whatever made a shipped model is measured elsewhere.
        Column("training", "CPU s", &|row| match row.0.0.learns {
            Learns::Shipped(_) => Cell::Missing,
            _ => mean(row, |own| Some(own.cost.train_cpu_s)),
        }),
        Column("answer", "ms", &|row| mean(row, |own| Some(own.cost.answer_ms))),
        Column("live step", "µs", &|row| mean(row, |own| own.cost.step_us)),
        Column("file", "kB", &|row| mean(row, |own| Some(own.cost.bytes as f64 * 1e-3))),
        Column("parameters", "", &|row| mean(row, |own| Some(own.cost.parameters as f64))),
    ])
}
