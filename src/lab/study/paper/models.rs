//! All methods side by side (Fig. 7): scores, paired differences, and what a model costs.

use super::answers::{
    Judged, ModelAnswers, ModelCost, PARTS, PairedDifference, Pool, TRAIN, TestPart, fit_and_judge, usual_grasps,
};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{F1_PERCENT, named_rows, percent_point, percent_row};
use super::plan::StudyPlan;
use super::pools::{
    Gains, Pools, add_new, adjusted, better_than_each, finding, finding_on_gains, negated, no_worse_than_any,
};
use super::report::{Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{StudyCard, UnitResult};
use crate::study::comparison::in_table_order;
use palpate_geometry::drawing::{DataPoint, DataSeries, Figure, Marker, Plot, PlotAxis};
use palpate_learn::{Method, MethodKind, method};
use palpate_tactile::model::SensorModel;
use std::collections::BTreeMap;

pub(super) struct Models;

/// The paper's model: its strict recipe where there is one.
const PAPERS_MODEL: [&str; 2] = ["paper-ds-lstm", "ds-lstm"];

const CARD: StudyCard = StudyCard {
    key: "models",
    title: "Comparison of methods",
    about: "all methods on the same grasps: macro F1 and accuracy, paired differences, cost of training and answers",
    paper: "Fig. 7",
    budget: "about 100 CPU minutes",
};

/// A unit: a method fitted to one kind of data and judged on one part.
pub(super) struct Case {
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

impl StudyCase for Case {
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

    fn method(&self) -> &'static Method {
        self.method
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

impl CaseStudy for Models {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let Some(data) = bench.data(&usual_grasps(plan, case.sensors).read_by(case.method))? else { return Ok(None) };
        let most = if case.imbalanced { TRAIN * 55 / 50 } else { TRAIN };
        let (train, test) = TestPart { train: most, ..TestPart::usual(plan, case.part) }.split(&data, plan.seed)?;
        // 40 to 55 grasps of each object, as in the paper, or the same share of fewer.
        let most = train.by_class().iter().map(Vec::len).max().unwrap_or(0);
        let train = if case.imbalanced { train.imbalanced((40 * most).div_ceil(55)..=most, plan.seed) } else { train };
        fit_and_judge(bench, case.method, &train, &test)?.map(|judged| UnitResult::new(&judged)).transpose()
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut pools = Pools::default();
        for case in Case::all(plan) {
            pools.add((kind(case.sensors, case.imbalanced), case.method.key), units, &case.name())?;
        }
        let reference = papers_model();
        let mut table = StudyTable::new(
            CARD.key,
            format!(
                "Methods on grasps that none has seen, {}; differences to {}",
                plan.described(),
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
        let rows: Vec<ModelRow<'_>> =
            pools.parts().filter_map(|((kind, key), parts)| ModelRow::new(kind, key, parts)).collect();
        let mut kinds: Vec<String> = Vec::new();
        rows.iter().for_each(|row| add_new(&mut kinds, row.kind));
        let mut measured = Vec::new();
        for kind in &kinds {
            let rows: Vec<&ModelRow<'_>> = rows.iter().filter(|row| row.kind == kind).collect();
            let papers = rows.iter().find(|row| reference.is_some_and(|papers| papers.key == row.method.key));
            let against = |row: &&ModelRow<'_>| {
                let papers = papers.filter(|papers| papers.method.key != row.method.key)?;
                row.pool.against(&papers.pool)
            };
            let differences: Vec<Option<PairedDifference>> = rows.iter().map(against).collect();
            for ((row, difference), p) in rows.iter().zip(&differences).zip(adjusted(&differences)) {
                table.push(row.cells(*difference, p), row.pool.misjudged());
                measured.push(Measured {
                    kind: kind.clone(),
                    method: row.method,
                    difference: *difference,
                    cost: row.cost(),
                });
            }
        }
        Ok(StudyReport::new(pools.data.clone(), vec![table], findings(&measured)))
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        report.table(CARD.key).map(|(at, table)| figure(at, table)).into_iter().collect()
    }
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
struct ModelRow<'a> {
    kind: &'a str,
    method: &'static Method,
    parts: &'a [Judged],
    pool: Pool,
}

impl<'a> ModelRow<'a> {
    fn new(kind: &'a str, key: &str, parts: &'a [Judged]) -> Option<Self> {
        let pool = Pool::of(parts.iter().filter_map(Judged::answers));
        Some(Self { kind, method: method(key)?, parts, pool })
    }

    fn cells(&self, difference: Option<PairedDifference>, p: Option<f64>) -> Vec<Cell> {
        let cost = self.cost();
        let number = |pick: fn(&ModelCost) -> f64| Cell::number(cost.as_ref().map(pick));
        vec![
            Cell::text(self.kind),
            Cell::text(self.method.key),
            Cell::text(kind_name(self.method.kind)),
            Cell::interval(self.pool.f1()),
            Cell::interval(self.pool.accuracy()),
            Cell::interval(difference.map(|difference| difference.f1)),
            Cell::number(p),
            Cell::number(self.mean(|answers| answers.ece)),
            number(|cost| cost.train_cpu_s),
            Cell::number(cost.and_then(|cost| cost.step_us)),
            number(|cost| cost.answer_ms),
            number(|cost| cost.bytes as f64 / 1e3),
            number(|cost| cost.parameters as f64),
            Cell::Number(self.pool.len() as f64),
            Cell::text(self.remark()),
        ]
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

fn findings(all: &[Measured]) -> Vec<Finding> {
    let Some(papers) = papers_model() else { return Vec::new() };
    let mut kinds: Vec<String> = Vec::new();
    all.iter().for_each(|row| add_new(&mut kinds, &row.kind));
    let (imbalanced, balanced): (Vec<String>, Vec<String>) =
        kinds.into_iter().partition(|kind| kind.ends_with("imbalanced"));
    // Gain of the paper's model over others of a kind of data, worst first.
    let gains = |kind: &String, group: MethodKind| {
        let rows =
            all.iter().filter(|row| row.kind == *kind && row.method.kind == group && row.method.key != papers.key);
        let gains = rows.filter_map(|row| Some((format!("over {}", row.method.key), negated(row.difference?.f1))));
        let mut gains: Gains = gains.collect();
        gains.sort_by(|a, b| a.1.estimate.total_cmp(&b.1.estimate));
        (kind.clone(), gains)
    };
    let over = |kinds: &[String], group: MethodKind| -> Vec<(String, Gains)> {
        kinds.iter().map(|kind| gains(kind, group)).collect()
    };
    let rule = "Agrees where every paired 95 % interval is above zero, disagrees where one is below";
    let (cost, cost_verdict) = cost_finding(all, papers.key, balanced.first().map_or("", String::as_str));
    vec![
        finding_on_gains(
            ("V-D", "The dual-stage LSTM is better than every single model", rule),
            &over(&balanced, MethodKind::Single),
            better_than_each,
        ),
        finding_on_gains(
            (
                "V-D",
                "The dual-stage LSTM is at least as good as every ensemble, and comparable to RUSBoost",
                "Disagrees where the paired 95 % interval of an ensemble excludes zero in its favour",
            ),
            &over(&balanced, MethodKind::Ensemble),
            no_worse_than_any,
        ),
        finding_on_gains(
            ("V-D", "The dual-stage LSTM is particularly effective on imbalanced data", rule),
            &over(&imbalanced, MethodKind::Single),
            better_than_each,
        ),
        finding(
            (
                "VI",
                "The dual-stage LSTM is as precise as ensembles and costs less",
                "Agrees where both its training and its answer to a grasp take less CPU time than those of every ensemble, \
                 disagrees where both take more",
            ),
            cost,
            cost_verdict,
        ),
    ]
}

fn cost_finding(all: &[Measured], papers: &str, first: &str) -> (String, Agreement) {
    let costs = |wanted: &dyn Fn(&Measured) -> bool| -> Vec<(&'static str, ModelCost)> {
        let rows = all.iter().filter(|row| row.kind == first && wanted(row));
        rows.filter_map(|row| Some((row.method.key, row.cost?))).collect()
    };
    let own = costs(&|row| row.method.key == papers);
    let ensembles = costs(&|row| row.method.kind == MethodKind::Ensemble);
    let ([(key, own)], false) = (own.as_slice(), ensembles.is_empty()) else {
        return (String::new(), Agreement::NotMeasured);
    };
    let listed = std::iter::once((*key, *own)).chain(ensembles.iter().copied());
    let listed = listed.map(|(key, cost)| format!("{key} {:.1} s and {:.2} ms", cost.train_cpu_s, cost.answer_ms));
    let found = format!("CPU time of training and of an answer to a grasp: {}", listed.collect::<Vec<_>>().join(", "));
    let cheaper = |cost: &ModelCost| [own.train_cpu_s < cost.train_cpu_s, own.answer_ms < cost.answer_ms];
    let all_cheaper: Vec<bool> = ensembles.iter().flat_map(|(_, cost)| cheaper(cost)).collect();
    let verdict = match (all_cheaper.iter().all(|c| *c), all_cheaper.iter().any(|c| *c)) {
        (true, _) => Agreement::Agrees,
        (false, true) => Agreement::Partly,
        (false, false) => Agreement::Disagrees,
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
    let first = table.texts("grasps").first().copied().unwrap_or_default();
    for (colour, group) in table.texts("kind").into_iter().enumerate() {
        let rows = table.rows_with(&[("grasps", first), ("kind", group)]);
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
