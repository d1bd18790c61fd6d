//! All methods side by side (Fig. 7): scores, paired differences, and what a model costs.

use super::answers::{Judged, ModelAnswers, ModelCost, PairedDifference, Pool, TestPart, fit_and_judge};
use super::bench::{StudyBench, StudyError};
use super::drawing::{F1_PERCENT, named_rows, percent_point, percent_row};
use super::plan::StudyPlan;
use super::report::{Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable, Verdict};
use super::{PaperStudy, StudyCard, UnitResult};
use crate::study::comparison::in_table_order;
use palpate_geometry::drawing::{DataPoint, DataSeries, Figure, Marker, Plot, PlotAxis};
use palpate_learn::metrics::{Interval, holm};
use palpate_learn::{Dataset, Method, MethodKind, method};
use palpate_tactile::model::SensorModel;
use std::collections::BTreeMap;

pub(super) struct Models;

/// Parts of the grasps, each of which is tested once, and training grasps of each object.
const PARTS: usize = 3;
const TRAIN: usize = 50;
/// Grasps of each object in a quick study, half of them to test.
const QUICK: usize = 40;
/// The paper's model: its strict recipe where there is one.
const PAPERS_MODEL: [&str; 2] = ["paper-ds-lstm", "ds-lstm"];

const CARD: StudyCard = StudyCard {
    key: "models",
    title: "Comparison of methods",
    about: "all methods on the same grasps: macro F1 and accuracy, paired differences, cost of training and answers",
    paper: "Fig. 7",
    budget: "about 80 CPU minutes",
};

/// A unit: a method fitted to one kind of data and judged on one part.
struct Case {
    sensors: SensorModel,
    imbalanced: bool,
    method: &'static Method,
    part: usize,
}

/// Name of a kind of data in tables.
fn kind(sensors: SensorModel, imbalanced: bool) -> String {
    format!("{}, {}", sensors.name(), if imbalanced { "imbalanced" } else { "balanced" })
}

fn papers_model() -> Option<&'static Method> {
    PAPERS_MODEL.into_iter().find_map(method)
}

impl Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let mut cases = Vec::new();
        for (number, &sensors) in plan.sensors.iter().enumerate() {
            // What imbalance does is asked once, of the paper's comparison.
            for imbalanced in [false, true].into_iter().take(if number == 0 { 2 } else { 1 }) {
                for method in in_table_order().into_iter().filter(|method| !imbalanced || is_of_papers_table(method)) {
                    let once = is_costly(method) || imbalanced || (number > 0 && method.recipe.is_some());
                    let parts = plan.pick(if once { 1 } else { PARTS }, 1, 1);
                    cases.extend((0..parts).map(|part| Self { sensors, imbalanced, method, part }));
                }
            }
        }
        cases
    }

    fn name(&self) -> String {
        format!("{}, {}, part {}", kind(self.sensors, self.imbalanced), self.method.key, self.part + 1)
    }
}

/// True for networks that are many in one.
fn is_costly(method: &Method) -> bool {
    method.recipe.is_some_and(|recipe| recipe().members > 1 || recipe().cross_fitted)
}

/// True for the paper's model and what it is compared with.
fn is_of_papers_table(method: &Method) -> bool {
    matches!(method.kind, MethodKind::Single | MethodKind::Ensemble) || PAPERS_MODEL.contains(&method.key)
}

/// Classes with 40 to 55 grasps for each 50, as in the paper, by their order.
fn imbalanced(train: &Dataset) -> Dataset {
    let keep = train.by_class().into_iter().enumerate().flat_map(|(class, members)| {
        let count = members.len() * (40 + 7 * class % 16) / 55;
        members.into_iter().take(count.max(2)).collect::<Vec<_>>()
    });
    let mut keep: Vec<usize> = keep.collect();
    keep.sort_unstable();
    train.part(&keep)
}

impl PaperStudy for Models {
    fn card(&self) -> StudyCard {
        CARD
    }

    fn units(&self, plan: &StudyPlan) -> Vec<String> {
        Case::all(plan).iter().map(Case::name).collect()
    }

    fn measure(&self, unit: &str, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let case = Case::all(plan).into_iter().find(|case| case.name() == unit);
        let case = case.ok_or_else(|| StudyError::Unknown(format!("unit {unit}")))?;
        let grasps = plan.grasps(PARTS * TRAIN, QUICK);
        let Some(data) = bench.data(&plan.wanted(grasps, case.sensors))? else { return Ok(None) };
        let of = plan.pick(PARTS, 2, 2);
        let most = if case.imbalanced { TRAIN * 55 / 50 } else { TRAIN };
        let (train, test) =
            TestPart { of, part: case.part, train: plan.pick(most, grasps, grasps) }.split(&data, plan.seed)?;
        let train = if case.imbalanced { imbalanced(&train) } else { train };
        fit_and_judge(bench, case.method, &train, &test)?.map(|judged| UnitResult::new(&judged)).transpose()
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut rows: Vec<ModelRow> = Vec::new();
        let mut report = StudyReport::default();
        for case in Case::all(plan) {
            let Some(unit) = units.get(&case.name()) else { continue };
            let judged: Judged = unit.read()?;
            let of = kind(case.sensors, case.imbalanced);
            let same = |row: &ModelRow| row.kind == of && row.method.key == case.method.key;
            if let Some(answers) = judged.answers() {
                let about = if case.imbalanced { ", 40 to 55 training grasps for each 50" } else { "" };
                let line = format!("{}{about}", answers.data);
                if !report.data.contains(&line) {
                    report.data.push(line);
                }
            }
            match rows.iter_mut().find(|row| same(row)) {
                Some(row) => row.parts.push(judged),
                None => rows.push(ModelRow { kind: of, method: case.method, parts: vec![judged] }),
            }
        }
        let reference = papers_model();
        let mut table = StudyTable::new(
            CARD.key,
            format!(
                "Methods on grasps that none has seen, preset {}; differences to {}",
                plan.preset,
                reference.map_or("", |m| m.key)
            ),
            &[
                ("grasps", ""),
                ("model", ""),
                ("kind", ""),
                ("F1", PERCENT),
                ("accuracy", PERCENT),
                ("F1 against the paper's model", PERCENT),
                ("p (Holm)", ""),
                ("ECE", ""),
                ("training", "CPU s"),
                ("live step", "µs"),
                ("whole grasp", "ms"),
                ("model file", "kB"),
                ("parameters", ""),
                ("tested", "grasps"),
                ("remark", ""),
            ],
        );
        let mut measured = Vec::new();
        for kind in rows.iter().map(|row| row.kind.clone()).fold(Vec::new(), with_new) {
            let of_kind: Vec<(&ModelRow, Pool)> =
                rows.iter().filter(|row| row.kind == kind).map(|row| (row, row.pool())).collect();
            let papers = of_kind.iter().find(|(row, _)| reference.is_some_and(|m| m.key == row.method.key));
            let compared: Vec<Option<PairedDifference>> = of_kind
                .iter()
                .map(|(row, pool)| {
                    let (own, papers) = papers.filter(|(own, _)| own.method.key != row.method.key)?;
                    pool.against(papers).filter(|_| own.kind == row.kind)
                })
                .collect();
            let adjusted = holm(&compared.iter().flatten().map(|difference| difference.p).collect::<Vec<_>>());
            let mut adjusted = adjusted.into_iter();
            for ((row, pool), difference) in of_kind.iter().zip(&compared) {
                let cost = row.cost();
                let number = |pick: fn(&ModelCost) -> f64| Cell::number(cost.as_ref().map(pick));
                table.push(
                    vec![
                        Cell::text(&row.kind),
                        Cell::text(row.method.key),
                        Cell::text(kind_name(row.method.kind)),
                        Cell::interval(pool.f1()),
                        Cell::interval(pool.accuracy()),
                        Cell::interval(difference.map(|difference| difference.f1)),
                        Cell::number(difference.and_then(|_| adjusted.next())),
                        Cell::number(row.mean(|answers| answers.ece)),
                        number(|cost| cost.train_cpu_s),
                        Cell::number(cost.and_then(|cost| cost.step_us)),
                        number(|cost| cost.answer_ms),
                        number(|cost| cost.bytes as f64 / 1e3),
                        number(|cost| cost.parameters as f64),
                        Cell::Number(pool.len() as f64),
                        Cell::text(row.remark()),
                    ],
                    pool.misjudged(),
                );
                measured.push(Measured { kind: row.kind.clone(), method: row.method, difference: *difference, cost });
            }
        }
        report.tables.push(table);
        report.findings = findings(&measured);
        Ok(report)
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        report.table(CARD.key).map(|(at, table)| figure(at, table)).into_iter().collect()
    }
}

/// Adds a text that is not there yet.
fn with_new(mut known: Vec<String>, text: String) -> Vec<String> {
    if !known.contains(&text) {
        known.push(text);
    }
    known
}

fn kind_name(kind: MethodKind) -> &'static str {
    match kind {
        MethodKind::Network => "network",
        MethodKind::Single => "single model",
        MethodKind::Ensemble => "ensemble",
        MethodKind::Further => "further",
    }
}

/// A method on a kind of data.
struct ModelRow {
    kind: String,
    method: &'static Method,
    parts: Vec<Judged>,
}

impl ModelRow {
    fn pool(&self) -> Pool {
        Pool::of(self.parts.iter().filter_map(Judged::answers))
    }

    fn mean(&self, pick: impl Fn(&ModelAnswers) -> f64) -> Option<f64> {
        let values: Vec<f64> = self.parts.iter().filter_map(Judged::answers).map(pick).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }

    /// Means over the parts.
    fn cost(&self) -> Option<ModelCost> {
        let first = self.parts.iter().find_map(Judged::answers)?.cost;
        Some(ModelCost {
            train_cpu_s: self.mean(|answers| answers.cost.train_cpu_s)?,
            answer_ms: self.mean(|answers| answers.cost.answer_ms)?,
            step_us: first.step_us.and_then(|_| self.mean(|answers| answers.cost.step_us.unwrap_or(f64::NAN))),
            ..first
        })
    }

    /// Reason why it could not be fitted, where it could not.
    fn remark(&self) -> String {
        let reason = self.parts.iter().find_map(|part| match part {
            Judged::NotFitted(reason) => Some(reason.clone()),
            Judged::Answers(_) => None,
        });
        reason.unwrap_or_default()
    }
}

/// What findings rest on.
struct Measured {
    kind: String,
    method: &'static Method,
    /// Against the paper's model.
    difference: Option<PairedDifference>,
    cost: Option<ModelCost>,
}

/// Points with sign, rounded.
fn points(share: f64) -> String {
    format!("{:+.1}", 100.0 * share)
}

fn findings(all: &[Measured]) -> Vec<Finding> {
    let Some(papers) = papers_model() else { return Vec::new() };
    let kinds: Vec<String> = all.iter().map(|row| row.kind.clone()).fold(Vec::new(), with_new);
    let (imbalanced, balanced): (Vec<&String>, Vec<&String>) =
        kinds.iter().partition(|kind| kind.ends_with("imbalanced"));
    // Gain of the paper's model over others of a kind of data, worst first.
    let gains = |kind: &str, group: MethodKind| -> Vec<(&'static str, Interval)> {
        let rows =
            all.iter().filter(|row| row.kind == kind && row.method.kind == group && row.method.key != papers.key);
        let mut gains: Vec<_> = rows.filter_map(|row| Some((row.method.key, negated(row.difference?.f1)))).collect();
        gains.sort_by(|a, b| a.1.estimate.total_cmp(&b.1.estimate));
        gains
    };
    let described = |kind: &str, gains: &[(&str, Interval)]| {
        let listed = gains.iter().map(|(key, gain)| {
            format!("{key} {} ({} to {})", points(gain.estimate), points(gain.low), points(gain.high))
        });
        format!("{kind}: points of macro F1 over {}", listed.collect::<Vec<_>>().join(", "))
    };
    let over = |kinds: &[&String], group: MethodKind, verdict: fn(&[Interval]) -> Verdict| {
        let (mut found, mut verdicts) = (Vec::new(), Vec::new());
        for kind in kinds {
            let gains = gains(kind, group);
            if !gains.is_empty() {
                found.push(described(kind, &gains));
                verdicts.push(verdict(&gains.iter().map(|(_, gain)| *gain).collect::<Vec<_>>()));
            }
        }
        (found.join("; "), Verdict::of_all(verdicts))
    };
    let mut findings = Vec::new();
    let mut add = |section: &str, claim: &str, (found, verdict): (String, Verdict), why: &str| {
        let (section, claim, why) = (section.to_owned(), claim.to_owned(), why.to_owned());
        findings.push(Finding { section, claim, found, verdict, why });
    };
    add(
        "V-D",
        "The dual-stage LSTM is better than every single model",
        over(&balanced, MethodKind::Single, better_than_each),
        "Agrees where every paired 95 % interval is above zero, disagrees where one is below",
    );
    add(
        "V-D",
        "The dual-stage LSTM is at least as good as every ensemble, and comparable to RUSBoost",
        over(&balanced, MethodKind::Ensemble, no_worse_than_any),
        "Disagrees where an ensemble's paired 95 % interval is above that of the dual-stage LSTM",
    );
    add(
        "V-D",
        "The dual-stage LSTM is particularly effective on imbalanced data",
        over(&imbalanced, MethodKind::Single, better_than_each),
        "The same rule for training sets of 40 to 55 grasps for each 50",
    );
    add(
        "VI",
        "The dual-stage LSTM costs less than ensembles",
        cost_finding(all, papers.key, &balanced),
        "Agrees where both its training and its answer to a grasp take less CPU time than those of every ensemble, disagrees where they \
         take more",
    );
    findings
}

fn negated(interval: Interval) -> Interval {
    let Interval { estimate, low, high } = interval;
    Interval { estimate: -estimate, low: -high, high: -low }
}

/// Verdict on a claim to be better than all others.
fn better_than_each(gains: &[Interval]) -> Verdict {
    if gains.iter().any(|gain| gain.high < 0.0) {
        Verdict::Disagrees
    } else if gains.iter().all(|gain| gain.low > 0.0) {
        Verdict::Agrees
    } else {
        Verdict::Partly
    }
}

/// Verdict on a claim to be as good as all others.
fn no_worse_than_any(gains: &[Interval]) -> Verdict {
    if gains.iter().any(|gain| gain.high < 0.0) { Verdict::Disagrees } else { Verdict::Agrees }
}

fn cost_finding(all: &[Measured], papers: &str, kinds: &[&String]) -> (String, Verdict) {
    let first = kinds.first().map_or("", |kind| kind.as_str());
    let costs = |wanted: &dyn Fn(&Measured) -> bool| -> Vec<(&'static str, ModelCost)> {
        let rows = all.iter().filter(|row| row.kind == first && wanted(row));
        rows.filter_map(|row| Some((row.method.key, row.cost?))).collect()
    };
    let own = costs(&|row| row.method.key == papers);
    let ensembles = costs(&|row| row.method.kind == MethodKind::Ensemble);
    let ([(key, own)], false) = (own.as_slice(), ensembles.is_empty()) else {
        return (String::new(), Verdict::NotMeasured);
    };
    let listed = std::iter::once((*key, *own)).chain(ensembles.iter().copied());
    let listed = listed.map(|(key, cost)| format!("{key} {:.1} s and {:.2} ms", cost.train_cpu_s, cost.answer_ms));
    let found = format!("CPU time of training and of an answer to a grasp: {}", listed.collect::<Vec<_>>().join(", "));
    let cheaper = |cost: &ModelCost| [own.train_cpu_s < cost.train_cpu_s, own.answer_ms < cost.answer_ms];
    let all_cheaper: Vec<bool> = ensembles.iter().flat_map(|(_, cost)| cheaper(cost)).collect();
    let verdict = match (all_cheaper.iter().all(|c| *c), all_cheaper.iter().any(|c| *c)) {
        (true, _) => Verdict::Agrees,
        (false, true) => Verdict::Partly,
        (false, false) => Verdict::Disagrees,
    };
    (found, verdict)
}

/// A plot for each kind of data, one row per method, and the cost beside them.
fn figure(at: usize, table: &StudyTable) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    for kind in table.texts("grasps") {
        let rows = table.rows_with(&[("grasps", kind)]);
        let names: Vec<&str> = rows.iter().map(|row| table.text(*row, "model")).collect();
        let mut series = Vec::new();
        for (colour, group) in table.texts("kind").into_iter().enumerate() {
            let own: Vec<(usize, &usize)> =
                rows.iter().enumerate().filter(|(_, row)| table.text(**row, "kind") == group).collect();
            for (point, (_, row)) in own.iter().enumerate() {
                let mark = FigureMark::Point(series.len(), point);
                links.push(FigureLink { plot: plots.len(), mark, table: at, row: **row });
            }
            let points = own.iter().map(|(place, row)| percent_row(table, **row, "F1", -(*place as f64))).collect();
            series.push(DataSeries {
                name: group.to_owned(),
                colour,
                marker: Marker::Dot,
                points,
                ..DataSeries::default()
            });
        }
        let (x, y) = (PlotAxis::linear(F1_PERCENT), named_rows(&names));
        plots.push(Plot { title: kind.to_owned(), x, y, series, sideways: true, ..Plot::default() });
    }
    let mut cost = Plot {
        title: "Cost".to_owned(),
        x: PlotAxis::logarithmic("CPU time of training (s)"),
        y: PlotAxis::linear(F1_PERCENT),
        ..Plot::default()
    };
    let kinds = table.texts("grasps");
    for (colour, group) in table.texts("kind").into_iter().enumerate() {
        let rows = table.rows_with(&[("grasps", kinds[0]), ("kind", group)]);
        for (point, row) in rows.iter().enumerate() {
            let mark = FigureMark::Point(cost.series.len(), point);
            links.push(FigureLink { plot: plots.len(), mark, table: at, row: *row });
        }
        let points = rows.iter().map(|row| {
            let x = table.cell(*row, "training").value().unwrap_or(f64::NAN);
            let label = table.text(*row, "model").to_owned();
            DataPoint { label, ..percent_point(table, *row, "F1", x) }
        });
        let series = DataSeries {
            name: group.to_owned(),
            colour,
            marker: Marker::Dot,
            points: points.collect(),
            ..DataSeries::default()
        };
        cost.series.push(series);
    }
    plots.push(cost);
    let note = "Macro F1 after one grasp with 95 % intervals, by bootstrap over test grasps.".to_owned();
    let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1080, 900], links }
}
