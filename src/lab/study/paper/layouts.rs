//! Sensor layouts (Fig. 5a): which are enough.

use super::answers::{PARTS, Pool, TestPart, fit_and_judge, usual_grasps};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{F1_PERCENT, named_rows, percent_row};
use super::plan::{DataWanted, StudyPlan};
use super::pools::{Gains, Pools, add_new, adjusted, better_than_each, finding, finding_on_gains, percent, points};
use super::report::{Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{StudyCard, UnitResult};
use crate::datasets::SensorView;
use palpate_geometry::drawing::{DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis};
use palpate_learn::{Method, method};
use palpate_sim::gripper::GripperModel;
use palpate_tactile::model::SensorModel;
use palpate_tactile::{CATALOGUE, SensorLayout, SignalDefinition};
use std::collections::BTreeMap;

pub(super) struct Layouts;

const CARD: StudyCard = StudyCard {
    key: "layouts",
    title: "Sensor layouts",
    about: "layouts C1 to C8 of real parts and of contact pressure, with and without force, and the layout with the fewest channels that is as good as the best",
    paper: "Fig. 5a",
    budget: "about 40 CPU minutes",
};

/// The paper's network, the one that it is compared with, both strict, and a method of seconds.
const MODELS: [&str; 3] = ["paper-macro-layer", "zuo", "extra-trees"];
/// The simplest layout, which the paper chooses.
const SIMPLEST: &str = "C1";
/// Gain below which two layouts are as good as each other.
const MINIMAL: f64 = 0.02;

/// Signals of a layout: its name, and what they are.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Signals {
    layout: String,
    definition: SignalDefinition,
}

impl Signals {
    /// What parts measure; what only a simulation knows, with and without force; and the paper's C1.
    fn all() -> Vec<Self> {
        let of = |definition: SignalDefinition, force: &str| {
            let named = move |layout: &SensorLayout| Self { layout: format!("{}{force}", layout.name), definition };
            CATALOGUE.iter().map(named).collect::<Vec<_>>()
        };
        let papers = vec![Self { layout: SIMPLEST.to_owned(), definition: SignalDefinition::Hull }];
        [
            of(SignalDefinition::Parts, ""),
            of(SignalDefinition::Contact, ""),
            of(SignalDefinition::Contact, "+F"),
            papers,
        ]
        .concat()
    }

    fn name(&self) -> String {
        match self.definition {
            SignalDefinition::Parts => self.layout.clone(),
            SignalDefinition::Contact | SignalDefinition::Hull => format!("{} {}", self.layout, self.definition.name()),
        }
    }
}

pub(super) struct Case {
    sensors: SensorModel,
    signals: Signals,
    method: &'static Method,
    part: usize,
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let mut cases = Vec::new();
        for &sensors in &plan.sensors {
            for signals in Signals::all() {
                let of_parts = signals.definition == SignalDefinition::Parts;
                if sensors == SensorModel::PhysicalLike && !of_parts {
                    continue;
                }
                for method in MODELS.into_iter().filter_map(method) {
                    let is_network = method.recipe.is_some();
                    // A network of minutes: on clean sensors, for parts, and for the simplest of other signals.
                    let simple = [SIMPLEST, "C1+F"].contains(&signals.layout.as_str());
                    let wanted = of_parts || (simple && method.key == MODELS[0]);
                    let skipped = is_network && (sensors != SensorModel::Virtual || !wanted);
                    let too_long = is_network && plan.pick(false, !simple || !of_parts, !simple || !of_parts);
                    if skipped || too_long {
                        continue;
                    }
                    let parts = plan.pick(if is_network { 1 } else { PARTS }, 1, 1);
                    cases.extend((0..parts).map(|part| Self { sensors, signals: signals.clone(), method, part }));
                }
            }
        }
        cases
    }

    fn name(&self) -> String {
        format!("{}, {}, {}, part {}", self.sensors.name(), self.signals.name(), self.method.key, self.part + 1)
    }

    fn method(&self) -> &'static Method {
        self.method
    }
}

/// Number of channels on both fingers.
fn channels(name: &str) -> Option<usize> {
    let signals = Signals::all().into_iter().find(|signals| signals.name() == name)?;
    let layout = SensorLayout::named(&signals.layout).ok()?;
    Some(layout.channels(&GripperModel::default(), signals.definition).ok()?.len())
}

impl CaseStudy for Layouts {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let usual = usual_grasps(plan, case.sensors);
        let view =
            SensorView { layout: case.signals.layout.clone(), signals: case.signals.definition, ..usual.view.clone() };
        let Some(data) = bench.data(&DataWanted { view, ..usual }.read_by(case.method))? else { return Ok(None) };
        if data.about.object == "recorded" {
            let what = "simulated trials: recorded and imported ones have the channels that they have";
            return Err(StudyError::Missing(what.to_owned()));
        }
        let (train, test) = TestPart::usual(plan, case.part).split(&data, plan.seed)?;
        fit_and_judge(bench, case.method, &train, &test)?.map(|judged| UnitResult::new(&judged)).transpose()
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut pools = Pools::default();
        for case in Case::all(plan) {
            pools.add((case.sensors.name(), case.method.key, case.signals.name()), units, &case.name())?;
        }
        let pooled = pools.pooled();
        let mut table = StudyTable::new(
            CARD.key,
            format!("Sensor layouts, {}; differences to {SIMPLEST}", plan.described()),
            &[
                ("sensors", ""),
                ("model", ""),
                ("layout", ""),
                ("channels", ""),
                ("F1", PERCENT),
                ("accuracy", PERCENT),
                ("F1 against C1", PERCENT),
                ("p (Holm)", ""),
                ("tested", "grasps"),
            ],
        );
        let differences: Vec<_> = pooled
            .iter()
            .map(|(kind, pool)| {
                let simplest = of(&pooled, kind.0, kind.1, SIMPLEST).filter(|_| kind.2 != SIMPLEST);
                simplest.and_then(|simplest| pool.against(simplest))
            })
            .collect();
        for (((kind, pool), difference), p) in pooled.iter().zip(&differences).zip(adjusted(&differences)) {
            let cells = vec![
                Cell::text(kind.0),
                Cell::text(kind.1),
                Cell::text(&kind.2),
                Cell::number(channels(&kind.2).map(|count| count as f64)),
                Cell::interval(pool.f1()),
                Cell::interval(pool.accuracy()),
                Cell::interval(difference.map(|difference| difference.f1)),
                Cell::number(p),
                Cell::Number(pool.len() as f64),
            ];
            table.push(cells, pool.misjudged());
        }
        let recommended = recommended_table(&table);
        let findings = findings(&pooled, &recommended);
        Ok(StudyReport::new(pools.data.clone(), vec![table, recommended], findings))
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        report.table(CARD.key).map(|(at, table)| figure(at, table)).into_iter().collect()
    }
}

/// Sensors, model, layout.
type Pooled<'a> = (&'a (&'static str, &'static str, String), Pool);

fn of<'a>(pooled: &'a [Pooled<'a>], sensors: &str, model: &str, layout: &str) -> Option<&'a Pool> {
    pooled.iter().find(|(kind, _)| (kind.0, kind.1, kind.2.as_str()) == (sensors, model, layout)).map(|(_, pool)| pool)
}

/// The fewest channels whose F1 lies inside the interval of the best layout.
fn recommended_table(table: &StudyTable) -> StudyTable {
    let mut recommended = StudyTable::new(
        "layouts-recommended",
        "Fewest channels whose F1 is inside the best layout's 95 % interval",
        &[
            ("sensors", ""),
            ("model", ""),
            ("best", ""),
            ("F1 of the best", PERCENT),
            ("recommended", ""),
            ("channels", ""),
            ("F1", PERCENT),
        ],
    );
    for sensors in table.texts("sensors") {
        for model in table.texts("model") {
            let rows = table.rows_with(&[("sensors", sensors), ("model", model)]);
            // Only layouts of parts can be built.
            let rows: Vec<usize> = rows.into_iter().filter(|row| !table.text(*row, "layout").contains(' ')).collect();
            let f1 = |row: usize| table.cell(row, "F1").value().unwrap_or(f64::NEG_INFINITY);
            let Some(best) = rows.iter().copied().max_by(|a, b| f1(*a).total_cmp(&f1(*b))) else { continue };
            let Some([low, _]) = table.cell(best, "F1").spread() else { continue };
            let count = |row: usize| table.cell(row, "channels").value().unwrap_or(f64::INFINITY);
            let inside = rows.iter().copied().filter(|row| f1(*row) >= low);
            let Some(chosen) = inside.min_by(|a, b| count(*a).total_cmp(&count(*b)).then(f1(*b).total_cmp(&f1(*a))))
            else {
                continue;
            };
            let text = |row: usize| Cell::text(table.text(row, "layout"));
            let cells = vec![
                Cell::text(sensors),
                Cell::text(model),
                text(best),
                table.cell(best, "F1").clone(),
                text(chosen),
                table.cell(chosen, "channels").clone(),
                table.cell(chosen, "F1").clone(),
            ];
            recommended.push(cells, Vec::new());
        }
    }
    recommended
}

fn findings(pooled: &[Pooled<'_>], recommended: &StudyTable) -> Vec<Finding> {
    let mut kinds: Vec<(&str, &str)> = Vec::new();
    for (kind, _) in pooled {
        if !kinds.contains(&(kind.0, kind.1)) {
            kinds.push((kind.0, kind.1));
        }
    }
    let (mut found, mut verdicts) = (Vec::new(), Vec::new());
    for (sensors, model) in &kinds {
        let Some(simplest) = of(pooled, sensors, model, SIMPLEST) else { continue };
        let others = pooled
            .iter()
            .filter(|(kind, _)| (kind.0, kind.1) == (*sensors, *model) && kind.2 != SIMPLEST && !kind.2.contains(' '));
        let gains = others.filter_map(|(kind, pool)| Some((kind.2.clone(), pool.against(simplest)?.f1)));
        let Some((layout, gain)) = gains.max_by(|a, b| a.1.estimate.total_cmp(&b.1.estimate)) else { continue };
        found.push(format!(
            "{sensors}, {model}: the most that a layout gains over {SIMPLEST} is {} points ({layout})",
            points(gain)
        ));
        verdicts.push(if gain.low > MINIMAL {
            Agreement::Disagrees
        } else if gain.high < MINIMAL {
            Agreement::Agrees
        } else {
            Agreement::Partly
        });
    }
    for row in 0..recommended.rows.len() {
        found.push(format!(
            "{}, {}: {} is recommended",
            recommended.text(row, "sensors"),
            recommended.text(row, "model"),
            recommended.text(row, "recommended")
        ));
    }
    let why = "Agrees where no layout gains more than 2 points over C1, with its paired 95 % interval; disagrees where one gains more. The \
               paper numbers its layouts without saying which is which, but for C1";
    let enough = finding(
        ("V-B", "The simplest layout, C1, is enough: more sensors add little or nothing", why),
        found.join("; "),
        Agreement::of_all(verdicts),
    );
    let over_zuo: Vec<(String, Gains)> = kinds
        .iter()
        .filter(|(_, model)| *model == MODELS[0])
        .map(|(sensors, _)| {
            let layouts = pooled.iter().filter(|(kind, _)| (kind.0, kind.1) == (*sensors, MODELS[0]));
            let gain = |(kind, pool): &Pooled<'_>| {
                let other = of(pooled, sensors, MODELS[1], &kind.2)?;
                Some((format!("{} over {}", kind.2, MODELS[1]), pool.against(other)?.f1))
            };
            ((*sensors).to_owned(), layouts.filter_map(gain).collect())
        })
        .collect();
    let rule = "Agrees where the paired 95 % interval is above zero for every layout, disagrees where one is below";
    let better = finding_on_gains(
        ("V-B", "The macro-layer is more accurate than the network of Zuo et al.", rule),
        &over_zuo,
        better_than_each,
    );
    let best = pooled.iter().filter_map(|(kind, pool)| Some((kind, pool.f1()?)));
    let best = best.max_by(|a, b| a.1.estimate.total_cmp(&b.1.estimate));
    let in_short = best.map_or_else(String::new, |(kind, f1)| {
        format!(". Best of all: {}, {}, {}: {}", kind.2, kind.0, kind.1, percent(f1))
    });
    vec![Finding { found: enough.found.clone() + &in_short, ..enough }, better]
}

/// A plot for each sensor model: a row for each layout, a colour for each model.
fn figure(at: usize, table: &StudyTable) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    let models = table.texts("model");
    for sensors in table.texts("sensors") {
        let mut names: Vec<String> = Vec::new();
        table.rows_with(&[("sensors", sensors)]).iter().for_each(|row| add_new(&mut names, table.text(*row, "layout")));
        let mut series = Vec::new();
        for (colour, model) in models.iter().enumerate() {
            let mut points = Vec::new();
            for row in table.rows_with(&[("sensors", sensors), ("model", model)]) {
                let place = names.iter().position(|name| name == table.text(row, "layout")).unwrap_or(0) as f64;
                let mark = FigureMark::Point(series.len(), points.len());
                links.push(FigureLink { plot: plots.len(), mark, table: at, row });
                points.push(percent_row(table, row, "F1", -place - 0.2 * (colour as f64 - 1.0)));
            }
            if !points.is_empty() {
                series.push(DataSeries {
                    name: (*model).to_owned(),
                    colour,
                    line: LineStyle::None,
                    marker: Marker::Dot,
                    points,
                });
            }
        }
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (x, y) = (PlotAxis::linear(F1_PERCENT), named_rows(&names));
        plots.push(Plot { title: format!("{sensors} sensors"), x, y, series, sideways: true, ..Plot::default() });
    }
    let note = "Macro F1 after one grasp with 95 % intervals, by bootstrap over test grasps.".to_owned();
    let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1080, 720], links }
}
