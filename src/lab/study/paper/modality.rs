//! Curvature, pressure, and both (Fig. 5b to 5d).

use super::answers::{PARTS, Pool, TestPart, fit_and_judge, usual_grasps};
use super::bench::{StudyBench, StudyError};
use super::cases::{CaseStudy, StudyCase};
use super::drawing::{F1_PERCENT, confusion_plot, confusion_table, named_columns, percent_point};
use super::plan::{DataWanted, StudyPlan};
use super::pools::{Gains, Pools, add_new, adjusted, better_than_each, finding, finding_on_gains};
use super::report::{Agreement, Cell, FigureLink, FigureMark, Finding, LinkedFigure, PERCENT, StudyReport, StudyTable};
use super::{StudyCard, UnitResult};
use crate::datasets::SensorView;
use palpate_geometry::drawing::{DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis};
use palpate_learn::metrics::Interval;
use palpate_learn::{Dataset, Example, Method, Sequence, method};
use palpate_tactile::model::SensorModel;
use std::collections::BTreeMap;
use std::sync::Arc;

pub(super) struct Modality;

const CARD: StudyCard = StudyCard {
    key: "modality",
    title: "Curvature and pressure",
    about: "curvature alone, pressure alone and both, for each pattern of sensors, and which objects are confused",
    paper: "Fig. 5b to 5d",
    budget: "about 30 CPU minutes",
};

/// The paper's network, strict and tuned, for whole fingers, and a method of seconds for every pattern.
const MODELS: [&str; 3] = ["paper-macro-layer", NETWORK, "extra-trees"];
const NETWORK: &str = "macro-layer";

/// Some channels of a layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Pattern {
    layout: &'static str,
    modality: &'static str,
    /// Name of the sensors that it has.
    name: &'static str,
}

const fn pattern(layout: &'static str, modality: &'static str, name: &'static str) -> Pattern {
    Pattern { layout, modality, name }
}

const CURVATURE: &str = "curvature";
const PRESSURE: &str = "pressure";
const BOTH: &str = "both";

/// Whole fingers, and every other pattern of one modality and of both.
const PATTERNS: [Pattern; 14] = [
    pattern("C1", CURVATURE, "whole"),
    pattern("C1", PRESSURE, "whole"),
    pattern("C1", BOTH, "C1"),
    pattern("C5", CURVATURE, "halves"),
    pattern("C2", PRESSURE, "halves"),
    pattern("C3", PRESSURE, "pairs"),
    pattern("C4", PRESSURE, "joints"),
    pattern("C2", BOTH, "C2"),
    pattern("C3", BOTH, "C3"),
    pattern("C4", BOTH, "C4"),
    pattern("C5", BOTH, "C5"),
    pattern("C6", BOTH, "C6"),
    pattern("C7", BOTH, "C7"),
    pattern("C8", BOTH, "C8"),
];

pub(super) struct Case {
    sensors: SensorModel,
    pattern: Pattern,
    method: &'static Method,
    part: usize,
}

impl StudyCase for Case {
    fn all(plan: &StudyPlan) -> Vec<Self> {
        let mut cases = Vec::new();
        for &sensors in &plan.sensors {
            for pattern in PATTERNS {
                // Stored trials have the channels that they have.
                if plan.query.is_some() && pattern.layout != "C1" {
                    continue;
                }
                for method in MODELS.into_iter().filter_map(method) {
                    let is_network = method.recipe.is_some();
                    if is_network && pattern.layout != "C1" {
                        continue;
                    }
                    let once = is_network && method.key != NETWORK;
                    let parts = plan.pick(if once { 1 } else { PARTS }, 1, 1);
                    cases.extend((0..parts).map(|part| Self { sensors, pattern, method, part }));
                }
            }
        }
        cases
    }

    fn name(&self) -> String {
        let Pattern { modality, name, .. } = self.pattern;
        format!("{}, {modality} {name}, {}, part {}", self.sensors.name(), self.method.key, self.part + 1)
    }

    fn method(&self) -> &'static Method {
        self.method
    }
}

/// The data set with some of its channels: those of curvature, those of pressure and force, or all.
fn with_modality(data: &Dataset, modality: &str) -> Result<Dataset, StudyError> {
    let of_curvature = |name: &String| name.starts_with(CURVATURE);
    let keep: Vec<usize> = (0..data.channels.len())
        .filter(|k| modality == BOTH || of_curvature(&data.channels[*k]) == (modality == CURVATURE))
        .collect();
    if keep.is_empty() {
        return Err(StudyError::Missing(format!(
            "channels of {modality}; the trials have {}",
            data.channels.join(", ")
        )));
    }
    let thinned = |example: &Example| {
        let values =
            example.grasp.rows().flat_map(|(_, row)| keep.iter().map(|k| row[*k]).collect::<Vec<_>>()).collect();
        Example { grasp: Arc::new(Sequence { t_s: example.grasp.t_s.clone(), values }), ..example.clone() }
    };
    Ok(Dataset {
        channels: keep.iter().map(|k| data.channels[*k].clone()).collect(),
        labels: data.labels.clone(),
        examples: data.examples.iter().map(thinned).collect(),
        about: data.about.clone(),
    })
}

impl CaseStudy for Modality {
    type Case = Case;

    const CARD: StudyCard = CARD;

    fn measure(&self, case: Case, bench: &StudyBench<'_>) -> Result<Option<UnitResult>, StudyError> {
        let plan = bench.plan();
        let usual = usual_grasps(plan, case.sensors);
        let view = SensorView { layout: case.pattern.layout.to_owned(), ..usual.view.clone() };
        let Some(data) = bench.data(&DataWanted { view, ..usual }.read_by(case.method))? else { return Ok(None) };
        let (train, test) = TestPart::usual(plan, case.part).split(&data, plan.seed)?;
        let modality = case.pattern.modality;
        let judged =
            fit_and_judge(bench, case.method, &with_modality(&train, modality)?, &with_modality(&test, modality)?)?;
        judged.map(|judged| UnitResult::new(&judged)).transpose()
    }

    fn report(&self, plan: &StudyPlan, units: &BTreeMap<String, UnitResult>) -> Result<StudyReport, StudyError> {
        let mut pools = Pools::default();
        for case in Case::all(plan) {
            let kind = (case.sensors.name(), case.method.key, case.pattern.modality, case.pattern.name);
            pools.add(kind, units, &case.name())?;
        }
        let pooled = pools.pooled();
        let of = |kind: Kind| pooled.iter().find(|(own, _)| **own == kind).map(|(_, pool)| pool);
        let mut table = StudyTable::new(
            CARD.key,
            format!("Modalities, {}; differences to both modalities of whole fingers", plan.described()),
            &[
                ("sensors", ""),
                ("model", ""),
                ("modality", ""),
                ("pattern", ""),
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
                let whole = (kind.0, kind.1, BOTH, "C1");
                of(whole).filter(|_| **kind != whole).and_then(|whole| pool.against(whole))
            })
            .collect();
        for (((kind, pool), difference), p) in pooled.iter().zip(&differences).zip(adjusted(&differences)) {
            table.push(
                vec![
                    Cell::text(kind.0),
                    Cell::text(kind.1),
                    Cell::text(kind.2),
                    Cell::text(kind.3),
                    Cell::interval(pool.f1()),
                    Cell::interval(pool.accuracy()),
                    Cell::interval(difference.map(|difference| difference.f1)),
                    Cell::number(p),
                    Cell::Number(pool.len() as f64),
                ],
                pool.misjudged(),
            );
        }
        let whole = plan.sensors.iter().filter_map(|s| Some((s.name(), of((s.name(), NETWORK, BOTH, "C1"))?)));
        let whole: Vec<(&str, &Pool)> = whole.collect();
        let confusions = confusion_table(
            "modality-confusion",
            &format!("Confusions of {NETWORK} with C1, {}", plan.described()),
            &whole,
        );
        let findings = findings(plan, &of, &whole);
        Ok(StudyReport::new(pools.data.clone(), vec![table, confusions], findings))
    }

    fn figures(&self, report: &StudyReport) -> Vec<LinkedFigure> {
        let patterns = report.table(CARD.key).map(|(at, table)| figure(at, table));
        let confusions = report.table("modality-confusion").map(|(at, table)| {
            let (mut plots, mut links) = (Vec::new(), Vec::new());
            for kind in table.texts("grasps") {
                let (plot, marks) = confusion_plot(
                    (table, at),
                    &table.rows_with(&[("grasps", kind)]),
                    &format!("{kind} sensors"),
                    plots.len(),
                );
                plots.push(plot);
                links.extend(marks);
            }
            let note = "Rows: true object, with its number; columns: predicted object.".to_owned();
            let figure = Figure { title: table.title.clone(), plots, columns: 2, note };
            LinkedFigure { name: table.name.clone(), figure, size: [1080, 560], links }
        });
        [patterns, confusions].into_iter().flatten().collect()
    }
}

/// Sensors, method, modality, pattern.
type Kind = (&'static str, &'static str, &'static str, &'static str);

fn findings<'a>(plan: &StudyPlan, of: &dyn Fn(Kind) -> Option<&'a Pool>, whole: &[(&str, &Pool)]) -> Vec<Finding> {
    let gains = |sensors: &'static str, key: &'static str| -> (String, Gains) {
        let over = |modality: &'static str| {
            let both = of((sensors, key, BOTH, "C1"))?;
            Some((format!("over {modality} alone"), both.against(of((sensors, key, modality, "whole"))?)?.f1))
        };
        (format!("{sensors}, {key}"), [CURVATURE, PRESSURE].into_iter().filter_map(over).collect())
    };
    let kinds: Vec<(String, Gains)> =
        plan.sensors.iter().flat_map(|sensors| MODELS.map(|key| gains(sensors.name(), key))).collect();
    let rule = "Agrees where every paired 95 % interval is above zero, disagrees where one is below";
    let mut findings = vec![finding_on_gains(
        ("V-B", "Both modalities are better than either alone, in simulation and on the physical gripper", rule),
        &kinds,
        better_than_each,
    )];
    let [clean, noisy] = SensorModel::BOTH.map(|sensors| of((sensors.name(), NETWORK, BOTH, "C1")));
    let lost = clean.zip(noisy).and_then(|(clean, noisy)| clean.against(noisy)).map(|difference| difference.f1);
    let lost: Gains = lost.map(|lost| ("virtual over physical-like".to_owned(), lost)).into_iter().collect();
    findings.push(finding_on_gains(
        ("V-B", "The physical gripper performs worse than the simulated one", rule),
        &[(NETWORK.to_owned(), lost)],
        better_than_each,
    ));
    for pair in [["jenga", "smallcube"], ["tomato", "lemon"]] {
        findings.push(confused(pair, whole));
    }
    findings
}

/// Two objects that the paper names as confused: are they confused more often than two objects are on average?
fn confused([a, b]: [&str; 2], whole: &[(&str, &Pool)]) -> Finding {
    let (mut found, mut verdicts) = (Vec::new(), Vec::new());
    for (sensors, pool) in whole {
        let at = |name: &str| pool.classes.iter().position(|class| class == name);
        let (Some(first), Some(second)) = (at(a), at(b)) else { continue };
        let cells = pool.confusions();
        let count = |cell: (usize, usize)| cells.get(&cell).map_or(0, |(count, _)| *count);
        let all: usize = cells.values().map(|(count, _)| count).sum();
        let wrong: usize = cells.iter().filter(|(cell, _)| cell.0 != cell.1).map(|(_, (count, _))| count).sum();
        let of_pair: usize =
            cells.iter().filter(|(cell, _)| [first, second].contains(&cell.0)).map(|(_, (n, _))| n).sum();
        let share = Interval::of_share(count((first, second)) + count((second, first)), of_pair);
        let average = wrong as f64 / all.max(1) as f64 / (pool.classes.len() as f64 - 1.0).max(1.0);
        found.push(format!(
            "{sensors}: {:.1} % ({:.1} to {:.1}) of their grasps are taken for each other, {:.1} % for any other object on average",
            100.0 * share.estimate,
            100.0 * share.low,
            100.0 * share.high,
            100.0 * average
        ));
        verdicts.push(match (share.low > average, share.high < average) {
            (true, _) => Agreement::Agrees,
            (_, true) => Agreement::Disagrees,
            (false, false) => Agreement::Partly,
        });
    }
    let why =
        "Agrees where the 95 % interval of the share is above the average of all pairs, disagrees where it is below";
    finding(
        ("V-B", &format!("{a} and {b} are confused, since shape and size are similar"), why),
        found.join("; "),
        Agreement::of_all(verdicts),
    )
}

/// A plot for each sensor model: patterns side by side, a colour for each model.
fn figure(at: usize, table: &StudyTable) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    let named = |row: usize| match table.text(row, "modality") {
        BOTH => table.text(row, "pattern").to_owned(),
        CURVATURE => format!("κ {}", table.text(row, "pattern")),
        _ => format!("p {}", table.text(row, "pattern")),
    };
    for sensors in table.texts("sensors") {
        let of_sensors = table.rows_with(&[("sensors", sensors)]);
        let mut names: Vec<String> = Vec::new();
        of_sensors.iter().for_each(|row| add_new(&mut names, &named(*row)));
        let mut series = Vec::new();
        for (colour, model) in table.texts("model").into_iter().enumerate() {
            let rows = table.rows_with(&[("sensors", sensors), ("model", model)]);
            let mut points = Vec::new();
            for row in rows {
                let place = names.iter().position(|name| *name == named(row)).unwrap_or(0) as f64;
                let mark = FigureMark::Point(series.len(), points.len());
                links.push(FigureLink { plot: plots.len(), mark, table: at, row });
                points.push(percent_point(table, row, "F1", place + 0.16 * colour as f64));
            }
            series.push(DataSeries {
                name: model.to_owned(),
                colour,
                line: LineStyle::None,
                marker: Marker::Dot,
                points,
            });
        }
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        plots.push(Plot {
            title: format!("{sensors} sensors"),
            x: named_columns("curvature alone (κ), pressure alone (p), both (C1 to C8)", &names),
            y: PlotAxis::linear(F1_PERCENT),
            series,
            ..Plot::default()
        });
    }
    let note = "Macro F1 after one grasp with 95 % intervals, by bootstrap over test grasps.".to_owned();
    let figure = Figure { title: table.title.clone(), plots, columns: 1, note };
    LinkedFigure { name: CARD.key.to_owned(), figure, size: [1080, 760], links }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_modality_keeps_its_channels_and_the_order_of_time() -> Result<(), StudyError> {
        let channels = ["curvature_left", "pressure_left", "force_left"].map(str::to_owned).to_vec();
        let grasp = Arc::new(Sequence { t_s: vec![0.0, 1.0], values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] });
        let data = Dataset { channels, examples: vec![Example { grasp, ..Example::default() }], ..Dataset::default() };
        let values = |modality: &str| with_modality(&data, modality).map(|d| d.examples[0].grasp.values.clone());
        assert_eq!((values(CURVATURE)?, values(PRESSURE)?), (vec![1.0, 4.0], vec![2.0, 3.0, 5.0, 6.0]));
        assert_eq!(with_modality(&data, BOTH)?, data);
        let none = Dataset { channels: vec!["grip".to_owned()], ..Dataset::default() };
        assert!(with_modality(&none, CURVATURE).is_err_and(|cause| cause.to_string().contains("grip")));
        Ok(())
    }
}
