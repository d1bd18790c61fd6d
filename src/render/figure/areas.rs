//! Filled areas of a plot: cells of colour with their colour bar, and bands.

use super::FigureError;
use super::canvas::{Canvas, Text};
use super::frame::{Frame, SMALL};
use super::labels::Box2;
use palpate_geometry::drawing::{Align, CellAxis, HeatMap, Plot, PlotAxis, SpreadBand};
use palpate_geometry::palette::{Rgb, series_colour};
use plotters::prelude::DrawingBackend;

/// Room between the axes and the colour bar, and its width (points).
const BEFORE_BAR: f64 = 14.0;
const BAR: f64 = 12.0;
/// Steps of colour in the bar.
const STEPS: usize = 64;
/// Opacity of a band.
const BAND: f64 = 0.22;

/// Marks of a colour bar.
fn bar_marks(heat: &HeatMap) -> Vec<(f64, String)> {
    let [low, high] = heat.scale.limits().map(f64::from);
    PlotAxis::default().marks(&(low..=high))
}

/// Title of a colour bar.
fn bar_title(heat: &HeatMap) -> String {
    format!("{} ({})", heat.quantity, heat.unit)
}

/// Width that a plot's colour bar takes beside its axes (points); zero without one.
pub(super) fn bar_room<B: DrawingBackend>(canvas: &Canvas<B>, plot: &Plot) -> Result<f64, FigureError> {
    let Some(heat) = &plot.heat else { return Ok(0.0) };
    let marks = bar_marks(heat).into_iter().map(|(_, mark)| canvas.width(&mark, SMALL));
    let widest = marks.collect::<Result<Vec<f64>, _>>()?.into_iter().fold(0.0, f64::max);
    let title = canvas.width(&bar_title(heat), SMALL)?;
    Ok(BEFORE_BAR + (BAR + 5.0 + widest).max(title))
}

/// The colour bar, in the room beside the axes.
pub(super) fn draw_bar<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    heat: &HeatMap,
    [[left, top], [_, bottom]]: Box2,
) -> Result<(), FigureError> {
    let left = left + BEFORE_BAR;
    let y = |share: f64| bottom - share * (bottom - top);
    let [least, most] = heat.scale.limits();
    for step in 0..STEPS {
        let [low, high] = [step, step + 1].map(|n| y(n as f64 / STEPS as f64));
        let value = least + (most - least) * (step as f32 + 0.5) / STEPS as f32;
        let Some(colour) = heat.scale.colour(value) else { continue };
        canvas.rectangle([[left, high], [left + BAR, low]], colour)?;
    }
    let colour = canvas.colours.quiet_text;
    for (at, mark) in bar_marks(heat) {
        let share = (at - f64::from(least)) / f64::from(most - least);
        let at = [left + BAR + 5.0, y(share) + 0.34 * SMALL];
        canvas.text(&Text { text: &mark, at, align: Align::Left, size: SMALL, colour })?;
    }
    let at = [left, top - 7.0];
    canvas.text(&Text { text: &bar_title(heat), at, align: Align::Left, size: SMALL, colour })?;
    Ok(())
}

/// Cells as rectangles; neighbours of one colour in a row share one.
pub(super) fn draw_cells<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    frame: &Frame,
    heat: &HeatMap,
) -> Result<(), FigureError> {
    let edge = |axis: &CellAxis, cell: usize| {
        let [from, to] = axis.range;
        from + (to - from) * cell as f64 / axis.count.max(1) as f64
    };
    for (row, values) in heat.values.chunks(heat.x.count.max(1)).enumerate() {
        let colours: Vec<Option<Rgb>> = values.iter().map(|value| heat.scale.colour(*value)).collect();
        let mut first = 0;
        for run in colours.chunk_by(|a, b| a == b) {
            let after = first + run.len();
            let corners =
                [(first, row), (after, row + 1)].map(|(x, y)| plot.place([edge(&heat.x, x), edge(&heat.y, y)]));
            first = after;
            if let (Some(colour), [Some(from), Some(to)]) = (run[0], corners) {
                canvas.rectangle([frame.at(from), frame.at(to)], colour)?;
            }
        }
    }
    Ok(())
}

/// A band, cut where an edge has no number.
pub(super) fn draw_band<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    frame: &Frame,
    band: &SpreadBand,
) -> Result<(), FigureError> {
    let colour = series_colour(band.colour, canvas.theme);
    let place = |x: f64, y: f64| {
        let [x, y] = plot.place([x, y])?;
        frame.x.contains(&x).then(|| frame.at([x, y.clamp(*frame.y.start(), *frame.y.end())]))
    };
    for run in band.points.split(|point| point.iter().any(|c| !c.is_finite())) {
        let lower = run.iter().filter_map(|[x, low, _]| place(*x, *low));
        let upper = run.iter().rev().filter_map(|[x, _, high]| place(*x, *high));
        let outline: Vec<[f64; 2]> = lower.chain(upper).collect();
        if outline.len() > 2 {
            canvas.veil(&outline, colour, BAND)?;
        }
    }
    Ok(())
}
