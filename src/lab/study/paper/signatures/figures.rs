//! Figures of signatures: curves over time, rates after contact by width, and settings about the paper's scene.

use super::bodies::{FLAT, ROUND, VARIED};
use super::{BODIES, DEFAULT, PAPER};
use crate::study::paper::report::{FigureLink, FigureMark, LinkedFigure, StudyReport, StudyTable};
use palpate_geometry::drawing::{DataPoint, DataSeries, Figure, LineStyle, Marker, Plot, PlotAxis, ReferenceLine};

pub(super) fn all(report: &StudyReport) -> Vec<LinkedFigure> {
    let table = |name: &str| report.table(name);
    let figures = [table("curves").map(curves), table("objects").and_then(rates), table("settings").map(settings)];
    figures.into_iter().flatten().collect()
}

fn value(table: &StudyTable, row: usize, column: &str) -> f64 {
    table.cell(row, column).value().unwrap_or(f64::NAN)
}

/// Bending and pressure over time, the default gripper above that of the paper's scene.
fn curves((at, table): (usize, &StudyTable)) -> LinkedFigure {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    for gripper in [DEFAULT, PAPER] {
        for (column, unit) in [("bending", "1/m"), ("pressure", "kPa")] {
            let mut plot = Plot {
                title: format!("Scene {gripper}: {column}"),
                x: PlotAxis::linear("time (s)"),
                y: PlotAxis::linear(format!("{column} ({unit})")),
                ..Plot::default()
            };
            for (colour, class) in table.texts("class").into_iter().enumerate() {
                let rows = table.rows_with(&[("gripper", gripper), ("class", class)]);
                for (point, row) in rows.iter().enumerate() {
                    let mark = FigureMark::Point(plot.series.len(), point);
                    links.push(FigureLink { plot: plots.len(), mark, table: at, row: *row });
                }
                let points =
                    rows.iter().map(|row| DataPoint::new(value(table, *row, "time"), value(table, *row, column)));
                let line = if class.starts_with("tiny") { LineStyle::Thin } else { LineStyle::Bold };
                let name = if plots.is_empty() { class.to_owned() } else { String::new() };
                plot.series.push(DataSeries { name, colour, line, points: points.collect(), ..DataSeries::default() });
            }
            plots.push(plot);
        }
    }
    let figure = Figure {
        title: "Tactile signatures, means of both fingers".to_owned(),
        plots,
        columns: 2,
        note: "Objects centred and as placed. Bending: circle through the joints; pressure: force over contact area."
            .to_owned(),
    };
    LinkedFigure { name: "signatures-curves".to_owned(), figure, size: [1080, 820], links }
}

/// Onset and rate after contact against the width of bodies.
fn rates((at, table): (usize, &StudyTable)) -> Option<LinkedFigure> {
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    for (column, unit, scale) in [("onset", "s", 1.0), ("rate after contact", "% of that before", 100.0)] {
        for gripper in [DEFAULT, PAPER] {
            let mut plot = Plot {
                title: format!("Scene {gripper}: {column}"),
                x: PlotAxis::linear("width (mm)"),
                y: PlotAxis::linear(format!("{column} ({unit})")),
                ..Plot::default()
            };
            if unit != "s" {
                plot.references = thresholds();
            }
            for (colour, shape) in [ROUND, FLAT].into_iter().enumerate() {
                let rows = table.rows_with(&[("gripper", gripper), ("grasps", BODIES), ("shape", shape)]);
                for (point, row) in rows.iter().enumerate() {
                    let mark = FigureMark::Point(plot.series.len(), point);
                    links.push(FigureLink { plot: plots.len(), mark, table: at, row: *row });
                }
                let points = rows
                    .iter()
                    .map(|row| DataPoint::new(value(table, *row, "width"), scale * value(table, *row, column)));
                let marker = if shape == ROUND { Marker::Dot } else { Marker::Square };
                let name = if plots.is_empty() { shape.to_owned() } else { String::new() };
                plot.series.push(DataSeries {
                    name,
                    colour,
                    marker,
                    points: points.collect(),
                    ..DataSeries::default()
                });
            }
            plots.push(plot);
        }
    }
    let any = plots.iter().any(|plot| plot.series.iter().any(|series| !series.points.is_empty()));
    let note = "Balls, lying cylinders, cubes and tall blocks, centred.".to_owned();
    let title = "Contact and what follows it, by width and shape".to_owned();
    let figure = Figure { title, plots, columns: 2, note };
    any.then(|| LinkedFigure { name: "signatures-rates".to_owned(), figure, size: [1000, 760], links })
}

fn thresholds() -> Vec<ReferenceLine> {
    let line = |at: f64, text: &str| ReferenceLine { horizontal: true, at, text: text.to_owned() };
    vec![line(20.0, "steady below"), line(25.0, "increase above")]
}

/// Longest rise of pressure that is early.
fn soon() -> ReferenceLine {
    ReferenceLine { horizontal: true, at: 0.2, text: String::new() }
}

/// Rates, and below them the rise of pressure, against each setting of the paper's scene.
fn settings((at, table): (usize, &StudyTable)) -> LinkedFigure {
    const RATES: [(&str, &str, Marker); 2] =
        [("rate after contact, round", "round", Marker::Dot), ("rate after contact, flat", "flat", Marker::Square)];
    const RISE: [(&str, &str, Marker); 1] = [("time to 90 % of pressure", "both", Marker::Ring)];
    let rows_of = [(&RATES[..], "rate after contact (%)", 100.0), (&RISE[..], "time to 90 % of pressure (s)", 1.0)];
    let (mut plots, mut links) = (Vec::new(), Vec::new());
    for (columns, title, scale) in rows_of {
        for varied in &VARIED {
            let rows = table.rows_with(&[("setting", varied.name)]);
            let unit = if varied.unit.is_empty() { String::new() } else { format!(" ({})", varied.unit) };
            let [usual, papers] = varied.known();
            let vertical = |at: f64, text: &str| ReferenceLine { horizontal: false, at, text: text.to_owned() };
            let both = (usual - papers).abs() < 1e-9 * papers.abs();
            let marks = if both {
                vec![vertical(papers, "both")]
            } else {
                vec![vertical(usual, DEFAULT), vertical(papers, PAPER)]
            };
            let limits = if scale == 1.0 { vec![soon()] } else { thresholds() };
            let mut plot = Plot {
                x: PlotAxis::logarithmic(format!("{}{unit}", varied.name)),
                y: PlotAxis::linear(title),
                references: limits
                    .into_iter()
                    .map(|line| ReferenceLine { text: String::new(), ..line })
                    .chain(marks)
                    .collect(),
                ..Plot::default()
            };
            for (colour, (column, name, marker)) in columns.iter().enumerate() {
                for (point, row) in rows.iter().enumerate() {
                    let mark = FigureMark::Point(plot.series.len(), point);
                    links.push(FigureLink { plot: plots.len(), mark, table: at, row: *row });
                }
                let points = rows
                    .iter()
                    .map(|row| DataPoint::new(value(table, *row, "value"), scale * value(table, *row, column)));
                let name = if plots.is_empty() { (*name).to_owned() } else { String::new() };
                let (line, marker) = (LineStyle::Thin, *marker);
                plot.series.push(DataSeries { name, colour, marker, line, points: points.collect() });
            }
            plots.push(plot);
        }
    }
    let figure = Figure {
        title: "For what finger the sentences hold: scene paper with one setting changed".to_owned(),
        plots,
        columns: VARIED.len(),
        note: "Bending after contact over that before it: round objects steady below 20 %, flat ones increasing above 25 %; \
               pressure saturates early below 0.2 s."
            .to_owned(),
    };
    LinkedFigure { name: "signatures-settings".to_owned(), figure, size: [1560, 620], links }
}
