//! The two stages (Fig. 6a and 6b): how well stage one tells size and shape, and what stage two makes of it.
//!
//! Stage one is two models, one of sizes and one of shapes, each trained on one half of the training grasps. Stage two is
//! trained on the other half, for which stage one's probabilities are further channels, constant over a grasp. In place of
//! them it gets nothing (uniform probabilities), one of both, or the true size and shape.

use super::answers::{Judged, PARTS, Pool, TestPart, fit_and_judge, judge, usual_grasps};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{F1_PERCENT, confusion_plot, confusion_table, named_rows, percent_row};
use super::plan::StudyPlan;
use super::pools::{Gains, Pools, adjusted, better_than_each, finding, finding_on_gains, percent};
use super::report::{Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{StudyCard, UnitResult};
use palpate_geometry::drawing::{DataSeries, Figure, Marker, Plot, PlotAxis};
use palpate_learn::{Class, Dataset, Example, Labels, Method, Model, Pmf, Sequence, SplitPlan, method};
use palpate_tactile::model::SensorModel;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

pub(super) struct Stages;

const CARD: StudyCard = StudyCard {
    key: "stages",
    title: "Two stages",
    about: "confusions of size and shape in stage one, and stage two with size, shape, both, the true ones or none",
    paper: "Fig. 6a and 6b",
    budget: "about 20 CPU minutes",
};

/// The network of both stages, and a method of seconds.
const MODELS: [&str; 2] = ["macro-layer", "extra-trees"];

/// What stage two knows beside the grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Known {
    name: &'static str,
    size: Source,
    shape: Source,
}

/// Source of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// Uniform probabilities.
    Uniform,
    /// Probabilities of stage one.
    StageOne,
    /// The truth.
    Truth,
}

const NOTHING: &str = "nothing";
const SIZE: &str = "size";
const SHAPE: &str = "shape";
const BOTH: &str = "size and shape";
const TRUTH: &str = "true size and shape";
/// One model of all training grasps, as a fair rival of two stages.
const ONE_STAGE: &str = "one stage, all grasps";

const KNOWN: [Known; 7] = [
    Known { name: NOTHING, size: Source::Uniform, shape: Source::Uniform },
    Known { name: SIZE, size: Source::StageOne, shape: Source::Uniform },
    Known { name: SHAPE, size: Source::Uniform, shape: Source::StageOne },
    Known { name: BOTH, size: Source::StageOne, shape: Source::StageOne },
    Known { name: "true size", size: Source::Truth, shape: Source::Uniform },
    Known { name: "true shape", size: Source::Uniform, shape: Source::Truth },
    Known { name: TRUTH, size: Source::Truth, shape: Source::Truth },
];

/// Properties in tables, and the paper's F1 of stage one.
const PROPERTIES: [(&str, f64); 2] = [(SIZE, 0.90), (SHAPE, 0.81)];
/// Distance within which an F1 is that of the paper.
const NEAR: f64 = 0.05;

pub(super) struct Case {
    sensors: SensorModel,
    method: &'static Method,
    part: usize,
}

/// Result of a unit: answers of stage one, and of stage two by what it knows.
#[derive(Serialize, Deserialize)]
struct StagesResult {
    /// Of sizes and of shapes.
    stage_one: [Judged; 2],
    stage_two: Vec<(String, Judged)>,
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let mut cases = Vec::new();
        for (number, &sensors) in plan.sensors.iter().enumerate() {
            for method in MODELS.into_iter().filter_map(method) {
                let parts = plan.pick(if number > 0 && method.recipe.is_some() { 1 } else { PARTS }, 1, 1);
                cases.extend((0..parts).map(|part| Self { sensors, method, part }));
            }
        }
        cases
    }

    fn name(&self) -> String {
        format!("{}, {}, part {}", self.sensors.name(), self.method.key, self.part + 1)
    }

    fn method(&self) -> &'static Method {
        self.method
    }
}

/// The data set with sizes, or with shapes, as its classes.
fn of_property(data: &Dataset, property: usize) -> Option<Dataset> {
    let labels = &data.labels;
    let names = if property == 0 { &labels.sizes } else { &labels.shapes };
    let pick = |class: &Class| if property == 0 { class.size } else { class.shape };
    let class = |name: &String| Class { name: name.clone(), size: None, shape: None };
    let examples: Option<Vec<Example>> = data
        .examples
        .iter()
        .map(|example| Some(Example { class: pick(&labels.classes[example.class])?, ..example.clone() }))
        .collect();
    let labels = Labels { classes: names.iter().map(class).collect(), ..Labels::default() };
    Some(Dataset { labels, examples: examples?, channels: data.channels.clone(), about: data.about.clone() })
}

/// Probabilities of size and shape of a grasp.
type Estimates = [Pmf; 2];

/// The data set with properties as further channels. Each stands on both fingers, so that grasps can still be mirrored.
fn with_known(data: &Dataset, estimates: &[Estimates], known: Known) -> Dataset {
    let labels = &data.labels;
    let mut channels = data.channels.clone();
    for name in labels.sizes.iter().chain(&labels.shapes) {
        channels.extend(["left", "right"].map(|side| format!("known_{name}_{side}")));
    }
    let widened = |(example, [size, shape]): (&Example, &Estimates)| {
        let class = &labels.classes[example.class];
        let of = |source: Source, estimate: &Pmf, truth: Option<usize>| -> Vec<f32> {
            let count = estimate.classes();
            match source {
                Source::Uniform => vec![1.0 / count as f32; count],
                Source::StageOne => estimate.probabilities().iter().map(|p| *p as f32).collect(),
                Source::Truth => (0..count).map(|k| if truth == Some(k) { 1.0 } else { 0.0 }).collect(),
            }
        };
        let properties = [of(known.size, size, class.size), of(known.shape, shape, class.shape)].concat();
        let twice: Vec<f32> = properties.into_iter().flat_map(|p| [p, p]).collect();
        let values = example.grasp.rows().flat_map(|(_, row)| row.iter().chain(&twice).copied().collect::<Vec<_>>());
        let grasp = Sequence { t_s: example.grasp.t_s.clone(), values: values.collect() };
        Example { grasp: Arc::new(grasp), ..example.clone() }
    };
    let examples = data.examples.iter().zip(estimates).map(widened).collect();
    Dataset { channels, examples, labels: data.labels.clone(), about: data.about.clone() }
}

/// Both halves of the training grasps of each object.
fn halves(train: &Dataset, seed: u64) -> Result<[Dataset; 2], StudyError> {
    let splits = SplitPlan::Folds { folds: 2 }.splits(train, seed, 1)?;
    let split = splits.first().cloned().unwrap_or_default();
    Ok([train.part(&split.train), train.part(&split.test)])
}

impl CaseStudy for Stages {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let Some(data) = bench.data(&usual_grasps(plan, case.sensors).read_by(case.method))? else { return Ok(None) };
        let (train, test) = TestPart::usual(plan, case.part).split(&data, plan.seed)?;
        let [first, second] = halves(&train, plan.seed)?;
        // None where it was cancelled; without a model where it cannot be fitted to these grasps.
        let first_stage = |property: usize| -> Result<Option<(Option<Model>, Judged)>, StudyError> {
            let pair = of_property(&first, property).zip(of_property(&test, property));
            let no_properties = || StudyError::Missing("a size and a shape of every object".to_owned());
            let (first, test) = pair.ok_or_else(no_properties)?;
            match bench.fit(case.method, &first) {
                Ok(Some(model)) => {
                    let judged = Judged::Answers(judge(&model, &test));
                    Ok(Some((Some(model), judged)))
                }
                Ok(None) => Ok(None),
                Err(StudyError::Fit { cause, .. }) => Ok(Some((None, Judged::NotFitted(cause.to_string())))),
                Err(other) => Err(other),
            }
        };
        let Some((sizes, of_size)) = first_stage(0)? else { return Ok(None) };
        let Some((shapes, of_shape)) = first_stage(1)? else { return Ok(None) };
        let stage_one = [of_size, of_shape];
        let (Some(sizes), Some(shapes)) = (sizes, shapes) else {
            return UnitResult::new(&StagesResult { stage_one, stage_two: Vec::new() }).map(Some);
        };
        let estimates = |data: &Dataset| -> Vec<Estimates> {
            let of = |model: &Model, example: &Example| model.recogniser.recognise(&example.grasp, None).pmf;
            data.examples.iter().map(|example| [of(&sizes, example), of(&shapes, example)]).collect()
        };
        let (of_second, of_test) = (estimates(&second), estimates(&test));
        let mut stage_two = Vec::new();
        let mut add = |name: &str, train: &Dataset, test: &Dataset| -> Result<bool, StudyError> {
            let judged = fit_and_judge(bench, case.method, train, test)?;
            let is_finished = judged.is_some();
            stage_two.extend(judged.map(|judged| (name.to_owned(), judged)));
            Ok(is_finished)
        };
        for known in KNOWN {
            if !add(known.name, &with_known(&second, &of_second, known), &with_known(&test, &of_test, known))? {
                return Ok(None);
            }
        }
        if !add(ONE_STAGE, &train, &test)? {
            return Ok(None);
        }
        UnitResult::new(&StagesResult { stage_one, stage_two }).map(Some)
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let (mut ones, mut twos) = (Pools::default(), Pools::default());
        for case in Case::all(plan) {
            let Some(unit) = units.get(&case.name()) else { continue };
            let StagesResult { stage_one, stage_two } = unit.read()?;
            let kind = (case.sensors.name(), case.method.key);
            for ((property, _), judged) in PROPERTIES.into_iter().zip(stage_one) {
                ones.push((kind, property.to_owned()), judged);
            }
            for (known, judged) in stage_two {
                twos.push((kind, known), judged);
            }
        }
        let first = ones.pooled();
        let mut properties = StudyTable::new(
            "stages-first",
            format!("Stage one, {}", plan.described()),
            &[
                ("sensors", ""),
                ("model", ""),
                ("property", ""),
                ("F1", PERCENT),
                ("accuracy", PERCENT),
                ("tested", "grasps"),
            ],
        );
        for ((kind, property), pool) in &first {
            let cells = vec![
                Cell::text(kind.0),
                Cell::text(kind.1),
                Cell::text(property),
                Cell::interval(pool.f1()),
                Cell::interval(pool.accuracy()),
                Cell::Number(pool.len() as f64),
            ];
            properties.push(cells, pool.misjudged());
        }
        let named: Vec<(String, &Pool)> = first
            .iter()
            .map(|((kind, property), pool)| (format!("{}, {}, {property}", kind.0, kind.1), pool))
            .collect();
        let named: Vec<(&str, &Pool)> = named.iter().map(|(name, pool)| (name.as_str(), *pool)).collect();
        let confusions =
            confusion_table("stages-confusion", &format!("Confusions of stage one, {}", plan.described()), &named);
        let second = twos.pooled();
        let table = second_table(plan, &second);
        let findings = findings(&first, &second);
        Ok(StudyReport::new(twos.data.clone(), vec![properties, confusions, table], findings))
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        let confusions = report.table("stages-confusion").map(|(at, table)| {
            let (mut plots, mut links) = (Vec::new(), Vec::new());
            for kind in table.texts("grasps").into_iter().filter(|kind| kind.contains(MODELS[0])) {
                let (plot, marks) =
                    confusion_plot((table, at), &table.rows_with(&[("grasps", kind)]), kind, plots.len());
                plots.push(plot);
                links.extend(marks);
            }
            let note = "Rows: true size or shape, with its number; columns: predicted.".to_owned();
            let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
            LinkedFigure { name: table.name.clone(), figure, size: [900, 700], links }
        });
        let second = report.table(CARD.key).map(|(at, table)| second_figure(at, table));
        [confusions, second].into_iter().flatten().collect()
    }
}

/// Sensors and model, and the property or what is known.
type Pooled<'a> = (&'a ((&'static str, &'static str), String), Pool);

fn of<'a>(pooled: &'a [Pooled<'a>], kind: (&'static str, &'static str), name: &str) -> Option<&'a Pool> {
    pooled.iter().find(|((own, known), _)| *own == kind && known == name).map(|(_, pool)| pool)
}

fn second_table(plan: &StudyPlan, second: &[Pooled<'_>]) -> StudyTable {
    let mut table = StudyTable::new(
        CARD.key,
        format!("Stage two by its extra input, {}; differences to none", plan.described()),
        &[
            ("sensors", ""),
            ("model", ""),
            ("known", ""),
            ("F1", PERCENT),
            ("accuracy", PERCENT),
            ("F1 against nothing", PERCENT),
            ("p (Holm)", ""),
            ("tested", "grasps"),
        ],
    );
    let differences: Vec<_> = second
        .iter()
        .map(|((kind, known), pool)| {
            of(second, *kind, NOTHING).filter(|_| known != NOTHING).and_then(|nothing| pool.against(nothing))
        })
        .collect();
    for ((((kind, known), pool), difference), p) in second.iter().zip(&differences).zip(adjusted(&differences)) {
        let cells = vec![
            Cell::text(kind.0),
            Cell::text(kind.1),
            Cell::text(known),
            Cell::interval(pool.f1()),
            Cell::interval(pool.accuracy()),
            Cell::interval(difference.map(|difference| difference.f1)),
            Cell::number(p),
            Cell::Number(pool.len() as f64),
        ];
        table.push(cells, pool.misjudged());
    }
    table
}

fn findings(first: &[Pooled<'_>], second: &[Pooled<'_>]) -> Vec<Finding> {
    let mut kinds: Vec<(&'static str, &'static str)> = Vec::new();
    for ((kind, _), _) in second {
        if !kinds.contains(kind) {
            kinds.push(*kind);
        }
    }
    let mut findings: Vec<Finding> = PROPERTIES
        .into_iter()
        .map(|(property, papers)| {
            let (mut found, mut verdicts) = (Vec::new(), Vec::new());
            for kind in kinds.iter().filter(|kind| kind.1 == MODELS[0]) {
                let Some(f1) = of(first, *kind, property).and_then(Pool::f1) else { continue };
                found.push(format!("{}, {}: {}", kind.0, kind.1, percent(f1)));
                let is_near = f1.low <= papers + NEAR && f1.high >= papers - NEAR;
                verdicts.push(if is_near { Agreement::Agrees } else { Agreement::Disagrees });
            }
            let claim = format!("Stage one recognises the {property} with an F1 of {:.0} %", 100.0 * papers);
            let why = "Agrees where the 95 % interval comes within 5 points of the paper's number";
            finding(("V-C", &claim, why), found.join("; "), Agreement::of_all(verdicts))
        })
        .collect();
    let gains = |name: &str, over: &[&str]| -> Vec<(String, Gains)> {
        let of_kind = |kind: &(&'static str, &'static str)| {
            let own = of(second, *kind, name);
            let gain = |other: &&str| Some((format!("over {other}"), own?.against(of(second, *kind, other)?)?.f1));
            (format!("{}, {}", kind.0, kind.1), over.iter().filter_map(gain).collect())
        };
        kinds.iter().map(of_kind).collect()
    };
    let rule = "Agrees where every paired 95 % interval is above zero, disagrees where one is below";
    findings.push(finding_on_gains(
        ("V-C", "Size and shape from stage one improve the recognition of the object, more together than alone", rule),
        &gains(BOTH, &[NOTHING, SIZE, SHAPE]),
        better_than_each,
    ));
    findings.push(finding_on_gains(
        ("V-C", "Known size and shape would improve the recognition of the object", rule),
        &gains(TRUTH, &[NOTHING, BOTH]),
        better_than_each,
    ));
    findings.push(finding_on_gains(
        ("V-C", "Two stages on one half of the grasps each are better than one stage on all of them", rule),
        &gains(BOTH, &[ONE_STAGE]),
        better_than_each,
    ));
    findings
}

/// A plot for each sensor model: what stage two is told from top to bottom, a colour for each model.
fn second_figure(at: usize, table: &StudyTable) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    let names = table.texts("known");
    for sensors in table.texts("sensors") {
        let mut series = Vec::new();
        for (colour, model) in table.texts("model").into_iter().enumerate() {
            let mut points = Vec::new();
            for row in table.rows_with(&[("sensors", sensors), ("model", model)]) {
                let place = names.iter().position(|name| *name == table.text(row, "known")).unwrap_or(0) as f64;
                let mark = FigureMark::Point(series.len(), points.len());
                links.push(FigureLink { plot: plots.len(), mark, table: at, row });
                points.push(percent_row(table, row, "F1", -place - 0.16 * colour as f64));
            }
            series.push(DataSeries {
                name: model.to_owned(),
                colour,
                marker: Marker::Dot,
                points,
                ..DataSeries::default()
            });
        }
        let (x, y) = (PlotAxis::linear(F1_PERCENT), named_rows(&names));
        plots.push(Plot { title: format!("{sensors} sensors"), x, y, series, sideways: true, ..Plot::default() });
    }
    let note = "Macro F1 of stage two after one grasp, with 95 % intervals, by its input beside the grasp.".to_owned();
    let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1080, 420], links }
}
