//! How many grasps a model has to learn from (Fig. 6c).

use super::answers::{PairedDifference, Pool, TestPart, fit_and_judge};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{F1_PERCENT, percent_point};
use super::plan::StudyPlan;
use super::pools::{Gains, Pools, better_than_each, finding, finding_on_gains, no_worse_than_any, points};
use super::report::{Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{StudyCard, UnitResult};
use palpate_geometry::drawing::{DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};
use palpate_learn::metrics::Interval;
use palpate_learn::{Method, MethodKind, method};
use palpate_tactile::model::SensorModel;
use std::collections::BTreeMap;

pub(super) struct TrainingSize;

const CARD: StudyCard = StudyCard {
    key: "training-size",
    title: "Size of the training set",
    about: "models over 5 to 800 training grasps of each object (networks and noisy SVMs to fewer), and the fewest that are enough",
    paper: "Fig. 6c",
    budget: "about 140 CPU minutes",
};

/// Models of the figure: the paper's and what it is compared with.
const MODELS: [&str; 9] =
    [PAPERS_MODEL, TUNED, "lstm", "decision-tree", "knn", "svm", "random-forest", "rusboost", "extra-trees"];
/// Models that are trained on more grasps than a hand collects in a day.
const BEYOND: [&str; 5] = [PAPERS_MODEL, TUNED, "svm", "random-forest", "extra-trees"];
/// The paper's model, strict and tuned.
const PAPERS_MODEL: &str = "paper-ds-lstm";
const TUNED: &str = "ds-lstm";
/// Training grasps of each object that the paper had.
const USUAL: usize = 50;
/// Grasps of each object to test in each part, and parts.
const TEST: usize = 100;
const PARTS: usize = 3;
/// Most training grasps of each object, and those of methods whose fits take minutes: networks, and support vector machines on
/// noisy readings (16 CPU minutes with 400 grasps of each object, three times that with 800).
const MOST: usize = 800;
const MOST_OF_NOISY_SVM: usize = 400;
const MOST_OF_TUNED: usize = 400;
const MOST_OF_NETWORK: usize = 200;

fn sizes(plan: &StudyPlan) -> &'static [usize] {
    plan.pick(&[5, 10, 20, 50, 100, 200, 400, 800][..], &[5, 10, 20][..], &[2, 4][..])
}

/// A unit: a method fitted to so many grasps of each object.
pub(super) struct Case {
    sensors: SensorModel,
    size: usize,
    method: &'static Method,
    part: usize,
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let mut cases = Vec::new();
        for (number, &sensors) in plan.sensors.iter().enumerate() {
            for &size in sizes(plan) {
                for method in MODELS.into_iter().filter_map(method) {
                    let is_network = method.recipe.is_some();
                    let most = match (is_network, number) {
                        (true, 0) if method.key == TUNED => MOST_OF_TUNED,
                        (true, 0) => MOST_OF_NETWORK,
                        (true, _) => USUAL,
                        (false, 1..) if method.key == "svm" => MOST_OF_NOISY_SVM,
                        (false, _) => MOST,
                    };
                    if size > most || (size > USUAL && !BEYOND.contains(&method.key)) {
                        continue;
                    }
                    let once = size > USUAL || (is_network && (number > 0 || method.key != PAPERS_MODEL));
                    let parts = plan.pick(if once { 1 } else { PARTS }, 1, 1);
                    cases.extend((0..parts).map(|part| Self { sensors, size, method, part }));
                }
            }
        }
        cases
    }

    fn name(&self) -> String {
        format!("{}, {} of {} grasps, part {}", self.sensors.name(), self.method.key, self.size, self.part + 1)
    }

    fn method(&self) -> &'static Method {
        self.method
    }
}

impl CaseStudy for TrainingSize {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let grasps = plan.grasps(MOST + TEST, 40);
        let Some(data) = bench.data(&plan.wanted(grasps, case.sensors).read_by(case.method))? else { return Ok(None) };
        let of = plan.pick((MOST + TEST) / TEST, 2, 3);
        let (train, test) = TestPart { of, part: case.part, train: case.size }.split(&data, plan.seed)?;
        fit_and_judge(bench, case.method, &train, &test)?.map(|judged| UnitResult::new(&judged)).transpose()
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut pools = Pools::default();
        for case in Case::all(plan) {
            pools.add((case.sensors.name(), case.method.key, case.size), units, &case.name())?;
        }
        let curves: Vec<Point<'_>> = pools.pooled().into_iter().map(|(kind, pool)| Point { kind, pool }).collect();
        let mut table = StudyTable::new(
            CARD.key,
            format!("Models by the number of training grasps of each object, {}", plan.described()),
            &[
                ("sensors", ""),
                ("model", ""),
                ("training grasps", ""),
                ("F1", PERCENT),
                ("accuracy", PERCENT),
                ("gain of doubling", PERCENT),
                ("tested", "grasps"),
            ],
        );
        for point in &curves {
            let gain = point.smaller(&curves).and_then(|smaller| point.pool.against(&smaller.pool));
            table.push(
                vec![
                    Cell::text(point.kind.0),
                    Cell::text(point.kind.1),
                    Cell::Number(point.kind.2 as f64),
                    Cell::interval(point.pool.f1()),
                    Cell::interval(point.pool.accuracy()),
                    Cell::interval(gain.map(|gain| gain.f1)),
                    Cell::Number(point.pool.len() as f64),
                ],
                point.pool.misjudged(),
            );
        }
        let least = least_table(&table);
        let findings = findings(&curves, &least);
        Ok(StudyReport::new(pools.data.clone(), vec![table, least], findings))
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        report.table(CARD.key).map(|(at, table)| figure(at, table, report)).into_iter().collect()
    }
}

/// A model after so many training grasps: sensors, model, size.
struct Point<'a> {
    kind: &'a (&'static str, &'static str, usize),
    pool: Pool,
}

impl Point<'_> {
    /// The same model after the next smaller number of grasps.
    fn smaller<'a>(&self, curves: &'a [Self]) -> Option<&'a Self> {
        let own = curves.iter().filter(|other| (other.kind.0, other.kind.1) == (self.kind.0, self.kind.1));
        own.filter(|other| other.kind.2 < self.kind.2).max_by_key(|other| other.kind.2)
    }
}

/// Fewest training grasps whose interval reaches the interval of the usual number, and of the largest.
fn least_table(table: &StudyTable) -> StudyTable {
    let mut least = StudyTable::new(
        "training-size-least",
        format!(
            "Fewest training grasps of each object whose 95 % interval reaches that of {USUAL}, and of the largest number"
        ),
        &[
            ("sensors", ""),
            ("model", ""),
            ("for that of 50", "grasps"),
            ("for that of the largest", "grasps"),
            ("largest", "grasps"),
        ],
    );
    for sensors in table.texts("sensors") {
        for model in table.texts("model") {
            let rows = table.rows_with(&[("sensors", sensors), ("model", model)]);
            let size = |row: usize| table.cell(row, "training grasps").value().unwrap_or(0.0);
            let reaching = |wanted: Option<&usize>| -> Option<usize> {
                let low = table.cell(*wanted?, "F1").spread()?[0];
                rows.iter().copied().find(|row| table.cell(*row, "F1").spread().is_some_and(|ends| ends[1] >= low))
            };
            let usual = rows.iter().find(|row| size(**row) == USUAL as f64);
            let (of_usual, of_largest) = (reaching(usual), reaching(rows.last()));
            let largest = rows.last().map(|row| size(*row));
            let cells = [of_usual.map(size), of_largest.map(size), largest].map(Cell::number);
            least.push([vec![Cell::text(sensors), Cell::text(model)], cells.to_vec()].concat(), Vec::new());
        }
    }
    least
}

fn findings(curves: &[Point<'_>], least: &StudyTable) -> Vec<Finding> {
    let mut sensors: Vec<&str> = Vec::new();
    let mut sizes: Vec<usize> = Vec::new();
    for point in curves {
        if !sensors.contains(&point.kind.0) {
            sensors.push(point.kind.0);
        }
        if !sizes.contains(&point.kind.2) {
            sizes.push(point.kind.2);
        }
    }
    let of = |sensors: &str, model: &str, size: usize| {
        curves.iter().find(|p| *p.kind == (sensors, model, size)).map(|p| &p.pool)
    };
    let gains = |group: MethodKind| -> Vec<(String, Gains)> {
        let kinds = sensors.iter().flat_map(|sensors| sizes.iter().map(move |size| (*sensors, *size)));
        let of_kind = |(sensors, size): (&str, usize)| {
            let others = MODELS.into_iter().filter_map(method).filter(|m| m.kind == group);
            let gains = others.filter_map(|other| {
                let difference = of(sensors, PAPERS_MODEL, size)?.against(of(sensors, other.key, size)?)?;
                Some((format!("over {}", other.key), difference.f1))
            });
            (format!("{sensors}, {size} grasps"), gains.collect())
        };
        kinds.map(of_kind).collect()
    };
    let rule = "Agrees where every paired 95 % interval at every size is above zero, disagrees where one is below";
    vec![
        fewer_is_worse(curves, &sensors),
        gains_shrink(curves, &sensors, least),
        one_finding(
            ("V-C", "The dual-stage LSTM outperforms other single models at every size", rule),
            &gains(MethodKind::Single),
            better_than_each,
        ),
        one_finding(
            (
                "V-C",
                "The dual-stage LSTM remains comparable to ensembles at every size",
                "Disagrees where the paired 95 % interval of an ensemble excludes zero in its favour",
            ),
            &gains(MethodKind::Ensemble),
            no_worse_than_any,
        ),
    ]
}

/// A claim for all sizes together: one size refutes it.
fn one_finding(
    words: (&str, &str, &str),
    kinds: &[(String, Gains)],
    rule: fn(&[(String, Interval)]) -> Agreement,
) -> Finding {
    let all: Gains = kinds.iter().flat_map(|(_, gains)| gains.clone()).collect();
    Finding { verdict: rule(&all), ..finding_on_gains(words, kinds, rule) }
}

/// Model and its paired difference between the smallest and the largest size that it was trained on.
fn fewer_is_worse(curves: &[Point<'_>], sensors: &[&str]) -> Finding {
    let gain = |sensors: &str, model: &str| -> Option<(String, Interval)> {
        let own: Vec<&Point<'_>> = curves.iter().filter(|p| (p.kind.0, p.kind.1) == (sensors, model)).collect();
        let (first, last) = (own.first()?, own.last()?);
        let difference = last.pool.against(&first.pool)?;
        Some((format!("{model} from {} to {}", first.kind.2, last.kind.2), difference.f1))
    };
    let kinds: Vec<(String, Gains)> = sensors
        .iter()
        .map(|sensors| ((*sensors).to_owned(), MODELS.iter().filter_map(|model| gain(sensors, model)).collect()))
        .collect();
    let rule = "Agrees where every model gains from the fewest to the most grasps: paired 95 % interval above zero";
    finding_on_gains(("V-C", "Fewer training grasps give worse results", rule), &kinds, better_than_each)
}

/// The paper's model: gain of the first doubling against that of the last.
fn gains_shrink(curves: &[Point<'_>], sensors: &[&str], least: &StudyTable) -> Finding {
    let (mut found, mut verdicts) = (Vec::new(), Vec::new());
    for sensors in sensors {
        for model in MODELS {
            let own: Vec<&Point<'_>> = curves.iter().filter(|p| (p.kind.0, p.kind.1) == (*sensors, model)).collect();
            let steps: Vec<(usize, PairedDifference)> = own
                .windows(2)
                .filter_map(|pair| Some((pair[1].kind.2, pair[1].pool.against(&pair[0].pool)?)))
                .collect();
            let ([(first_size, first), .., (last_size, last)], true) = (steps.as_slice(), model == PAPERS_MODEL) else {
                continue;
            };
            found.push(format!(
                "{sensors}, {model}: {} points of macro F1 up to {first_size} grasps, {} up to {last_size}",
                points(first.f1),
                points(last.f1)
            ));
            verdicts.push(match (first.f1.low > last.f1.high, first.f1.high < last.f1.low) {
                (true, _) => Agreement::Agrees,
                (_, true) => Agreement::Disagrees,
                (false, false) => Agreement::Partly,
            });
        }
    }
    for row in 0..least.rows.len() {
        if least.text(row, "model") == PAPERS_MODEL
            && let Some(size) = least.cell(row, "for that of the largest").value()
        {
            let largest = least.cell(row, "largest").value().unwrap_or(0.0);
            let sensors = least.text(row, "sensors");
            found.push(if size < largest {
                format!("{sensors}: {size:.0} grasps are as good as {largest:.0}")
            } else {
                format!("{sensors}: fewer than {largest:.0} grasps are not as good as {largest:.0}")
            });
        }
    }
    let why = "Agrees where the 95 % interval of the first step's gain is above that of the last. Enough is the fewest grasps whose interval \
               reaches that of the most";
    finding(
        ("V-C", "With more grasps the gain becomes less pronounced: there is a smallest set that is enough", why),
        found.join("; "),
        Agreement::of_all(verdicts),
    )
}

/// A plot for each sensor model, one line per model.
fn figure(at: usize, table: &StudyTable, report: &StudyReport) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    for sensors in table.texts("sensors") {
        let mut series = Vec::new();
        for (colour, model) in table.texts("model").into_iter().enumerate() {
            let rows = table.rows_with(&[("sensors", sensors), ("model", model)]);
            for (point, row) in rows.iter().enumerate() {
                let mark = FigureMark::Point(series.len(), point);
                links.push(FigureLink { plot: plots.len(), mark, table: at, row: *row });
            }
            let points = rows.iter().map(|row| {
                percent_point(table, *row, "F1", table.cell(*row, "training grasps").value().unwrap_or(f64::NAN))
            });
            let line = if model == PAPERS_MODEL { LineStyle::Bold } else { LineStyle::Thin };
            let points = points.collect();
            series.push(DataSeries { name: model.to_owned(), colour, line, marker: Marker::of_series(colour), points });
        }
        let enough = report.table("training-size-least").and_then(|(_, least)| {
            let row = *least.rows_with(&[("sensors", sensors), ("model", PAPERS_MODEL)]).first()?;
            let [at, largest] = ["for that of the largest", "largest"].map(|column| least.cell(row, column).value());
            let (at, largest) = (at?, largest?);
            let text = if at < largest {
                format!("{at:.0} are enough for {PAPERS_MODEL}")
            } else {
                format!("{PAPERS_MODEL}: fewer than {at:.0} are not enough")
            };
            Some(ReferenceLine { horizontal: false, at, text })
        });
        plots.push(Plot {
            title: format!("{sensors} sensors"),
            x: PlotAxis::logarithmic("training grasps of each object"),
            y: PlotAxis::linear(F1_PERCENT),
            references: enough.into_iter().collect(),
            series,
            ..Plot::default()
        });
    }
    let note = "Macro F1 after one grasp with 95 % intervals, by bootstrap over test grasps.".to_owned();
    let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1080, 520], links }
}
