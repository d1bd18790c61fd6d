//! Figures of signatures: curves over time, rates after contact by width, and settings about the paper's scene.

use super::super::prelude::*;
use super::bodies::{FLAT, ROUND, VARIED};
use super::{BODIES, DEFAULT, PAPER};

pub(super) fn all(report: &StudyReport) -> Vec<Option<LinkedFigure>> {
    let of = |table: &str, title: &str| {
        let mut figure = LinkedPlots::of(report, table)?;
        (figure.named_once, figure.title) = (true, title.to_owned());
        Some(figure)
    };
    let curves = of("curves", "Tactile signatures, means of both fingers").map(curves);
    let rates = of("objects", "Contact and what follows it, by width and shape").and_then(rates);
    let title = "For what finger the sentences hold: scene paper with one setting changed";
    vec![curves, rates, of("settings", title).map(settings)]
}

fn plot(title: String, x: &str, y: String) -> Plot {
    Plot { title, x: PlotAxis::linear(x), y: PlotAxis::linear(y), ..Plot::default() }
}

/// Bending and pressure over time, the default gripper above that of the paper's scene.
fn curves(mut figure: LinkedPlots<'_>) -> LinkedFigure {
    for gripper in [DEFAULT, PAPER] {
        for (column, name, unit) in [("bending", "bending", "1/m"), ("pressure", "contact pressure", "kPa")] {
            figure.plots.push(plot(format!("Scene {gripper}: {name}"), "time (s)", format!("{name} ({unit})")));
            for (colour, class) in unique(figure.lines().map(|line| line.text("class"))).into_iter().enumerate() {
                let lines = figure.lines_with(&[("gripper", gripper), ("class", class)]).into_iter();
                let points = lines.map(|line| (line, DataPoint::new(line.value("time"), line.value(column))));
                let line = if class.starts_with("tiny") { LineStyle::Thin } else { LineStyle::Bold };
                figure.series(DataSeries { name: class.to_owned(), colour, line, ..DataSeries::default() }, points);
            }
        }
    }
    let note = "Objects centred and as placed. Bending: circle through the joints; pressure: force over contact area.";
    figure.figure("signatures-curves", 2, [1080, 820], note)
}

/// Onset and rate after contact against the width of bodies.
fn rates(mut figure: LinkedPlots<'_>) -> Option<LinkedFigure> {
    for (column, unit, scale) in [("onset", "s", 1.0), ("rate after contact", "% of that before", 100.0)] {
        for gripper in [DEFAULT, PAPER] {
            let plot = plot(format!("Scene {gripper}: {column}"), "width (mm)", format!("{column} ({unit})"));
            let references = if unit == "s" { Vec::new() } else { thresholds() };
            figure.plots.push(Plot { references, ..plot });
            for (colour, (shape, marker)) in [(ROUND, Marker::Dot), (FLAT, Marker::Square)].into_iter().enumerate() {
                let lines =
                    figure.lines_with(&[("gripper", gripper), ("grasps", BODIES), ("shape", shape)]).into_iter();
                let points = lines.map(|line| (line, DataPoint::new(line.value("width"), scale * line.value(column))));
                figure.series(DataSeries { name: shape.to_owned(), colour, marker, ..DataSeries::default() }, points);
            }
        }
    }
    let any = figure.plots.iter().any(|plot| !plot.series.is_empty());
    let note = "Balls, lying cylinders, cubes and tall blocks, centred.";
    any.then(|| figure.figure("signatures-rates", 2, [1000, 760], note))
}

fn thresholds() -> Vec<ReferenceLine> {
    let line = |at: f64, text: &str| ReferenceLine { horizontal: true, at, text: text.to_owned() };
    vec![line(20.0, "steady below"), line(25.0, "increase above")]
}

/// Rates, and below them the rise of pressure, against each setting of the paper's scene.
fn settings(mut figure: LinkedPlots<'_>) -> LinkedFigure {
    const RATES: [(&str, &str, Marker); 2] =
        [("rate after contact, round", "round", Marker::Dot), ("rate after contact, flat", "flat", Marker::Square)];
    const RISE: [(&str, &str, Marker); 1] = [("time to 90 % of pressure", "", Marker::Ring)];
    let horizontal = |at: &f64| ReferenceLine { horizontal: true, at: *at, text: String::new() };
    let vertical = |at: f64, text: &str| ReferenceLine { horizontal: false, at, text: text.to_owned() };
    // Limits: steady below and increase above; longest rise of pressure that is early.
    for (columns, title, scale, limits) in [
        (&RATES[..], "rate after contact (%)", 100.0, &[20.0, 25.0][..]),
        (&RISE[..], "time to 90 % of pressure (s)", 1.0, &[0.2][..]),
    ] {
        for varied in &VARIED {
            let unit = if varied.unit.is_empty() { String::new() } else { format!(" ({})", varied.unit) };
            let [usual, papers] = varied.known();
            let scenes = if (usual - papers).abs() < 1e-9 * papers.abs() {
                vec![vertical(papers, "both")]
            } else {
                vec![vertical(usual, DEFAULT), vertical(papers, PAPER)]
            };
            figure.plots.push(Plot {
                x: PlotAxis::logarithmic(format!("{}{unit}", varied.name)),
                y: PlotAxis::linear(title),
                references: limits.iter().map(horizontal).chain(scenes).collect(),
                ..Plot::default()
            });
            for (colour, (column, name, marker)) in columns.iter().enumerate() {
                let lines = figure.lines_with(&[("setting", varied.name)]).into_iter();
                let points = lines.map(|line| (line, DataPoint::new(line.value("value"), scale * line.value(column))));
                let (name, line, marker) = ((*name).to_owned(), LineStyle::Thin, *marker);
                figure.series(DataSeries { name, colour, marker, line, points: Vec::new() }, points);
            }
        }
    }
    let note = "Bending after contact over that before it: round objects steady below 20 %, flat ones increasing above 25 %; \
                pressure saturates early below 0.2 s.";
    figure.figure("signatures-settings", VARIED.len(), [1560, 620], note)
}
