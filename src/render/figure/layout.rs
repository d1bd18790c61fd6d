//! Layout of a figure: title, plots beside each other, each with its legend and axes, and the note.

use super::FigureError;
use super::areas::{bar_room, draw_band, draw_bar, draw_cells};
use super::canvas::{CURVE, Canvas, RADIUS, Text, line_width};
use super::frame::{Frame, SMALL};
use super::labels::{Box2, PlacedLabel, placed_labels};
use palpate_geometry::drawing::{Align, DataSeries, Figure, LineStyle, Marker, Plot};
use palpate_geometry::palette::{Rgb, series_colour};
use plotters::prelude::DrawingBackend;
use std::ops::RangeInclusive;

/// Sizes of text (points per em).
const TITLE: f64 = 15.0;
const PLOT_TITLE: f64 = 13.0;
/// Margin of the figure and room between plots (points).
const MARGIN: f64 = 14.0;
const BETWEEN: f64 = 26.0;
/// Height of a line of small text.
const LINE: f64 = 15.0;
/// Length of a line in the legend.
const SAMPLE: f64 = 20.0;

pub(super) fn draw<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    figure: &Figure,
    [width, height]: [f64; 2],
) -> Result<(), FigureError> {
    let mut top = MARGIN;
    if !figure.title.is_empty() {
        top += TITLE;
        let colour = canvas.colours.text;
        canvas.text(&Text { text: &figure.title, at: [MARGIN, top], align: Align::Left, size: TITLE, colour })?;
        top += 10.0;
    }
    let shared = legend_rows(canvas, &figure.legend, width - 2.0 * MARGIN)?;
    draw_legend(canvas, &shared, [MARGIN, top])?;
    top += shared.len() as f64 * LINE + if shared.is_empty() { 0.0 } else { 8.0 };
    let own = |plot: &'_ Plot| -> usize { if figure.legend.is_empty() { plot.series.len() } else { 0 } };
    let mut bottom = height - MARGIN;
    for line in figure.note.lines().rev() {
        let colour = canvas.colours.quiet_text;
        canvas.text(&Text { text: line, at: [MARGIN, bottom], align: Align::Left, size: SMALL, colour })?;
        bottom -= LINE;
    }
    if !figure.note.is_empty() {
        bottom -= 8.0;
    }
    let columns = if figure.columns == 0 { figure.plots.len().max(1) } else { figure.columns };
    let rows = figure.plots.len().div_ceil(columns).max(1);
    let share = |room: f64, parts: usize| (room - (parts as f64 - 1.0) * BETWEEN) / parts as f64;
    let each = [share(width - 2.0 * MARGIN, columns), share(bottom - top, rows)];
    for (row, plots) in figure.plots.chunks(columns).enumerate() {
        // Legends of a row take the same height, so that its axes are in line.
        let lines = plots.iter().map(|plot| Ok(legend_rows(canvas, &plot.series[..own(plot)], each[0])?.len()));
        let lines = lines.collect::<Result<Vec<usize>, FigureError>>()?.into_iter().max().unwrap_or(0);
        for (column, plot) in plots.iter().enumerate() {
            let left = MARGIN + column as f64 * (each[0] + BETWEEN);
            let top = top + row as f64 * (each[1] + BETWEEN);
            let legend = legend_rows(canvas, &plot.series[..own(plot)], each[0])?;
            draw_plot(canvas, plot, [[left, top], [left + each[0], top + each[1]]], (&legend, lines))?;
        }
    }
    Ok(())
}

/// Rows of a legend: its series, each with the width that it takes.
type LegendRows<'a> = Vec<Vec<(&'a DataSeries, f64)>>;

/// Series of the legend in rows that fit.
fn legend_rows<'a, B: DrawingBackend>(
    canvas: &Canvas<B>,
    series: &'a [DataSeries],
    width: f64,
) -> Result<LegendRows<'a>, FigureError> {
    let mut rows: LegendRows<'_> = Vec::new();
    let mut used = f64::INFINITY;
    for series in series.iter().filter(|series| !series.name.is_empty()) {
        let needed = SAMPLE + 6.0 + canvas.width(&series.name, SMALL)? + 12.0;
        if used + needed > width {
            rows.push(Vec::new());
            used = 0.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push((series, needed));
        }
        used += needed;
    }
    Ok(rows)
}

fn draw_legend<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    rows: &LegendRows<'_>,
    [left, top]: [f64; 2],
) -> Result<(), FigureError> {
    let colour = canvas.colours.text;
    for (n, row) in rows.iter().enumerate() {
        let middle = top + (n as f64 + 0.5) * LINE;
        let mut x = left;
        for (series, width) in row {
            draw_sample(canvas, series, [x, middle])?;
            let at = [x + SAMPLE + 6.0, middle + 0.34 * SMALL];
            canvas.text(&Text { text: &series.name, at, align: Align::Left, size: SMALL, colour })?;
            x += width;
        }
    }
    Ok(())
}

fn draw_plot<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    [[left, top], [right, bottom]]: Box2,
    (legend, legend_height): (&LegendRows<'_>, usize),
) -> Result<(), FigureError> {
    let (text, quiet) = (canvas.colours.text, canvas.colours.quiet_text);
    let mut y = top;
    if !plot.title.is_empty() {
        y += PLOT_TITLE;
        canvas.text(&Text { text: &plot.title, at: [left, y], align: Align::Left, size: PLOT_TITLE, colour: text })?;
        y += 6.0;
    }
    draw_legend(canvas, legend, [left, y])?;
    y += legend_height as f64 * LINE + 6.0;
    // The title of the vertical axis stands above it, where it can be read without turning the head.
    y += SMALL;
    canvas.text(&Text { text: &plot.y.title, at: [left, y], align: Align::Left, size: SMALL, colour: quiet })?;
    y += 7.0;

    let [x_bounds, y_bounds] = plot.bounds();
    let y_marks = plot.y_marks(&y_bounds);
    let widths = y_marks.iter().map(|(_, mark)| canvas.width(mark, SMALL)).collect::<Result<Vec<f64>, _>>()?;
    let axes_right = right - bar_room(canvas, plot)?;
    let axis = left + widths.into_iter().fold(0.0, f64::max) + 6.0;
    let low = bottom - 2.0 * LINE - 6.0;
    if axis + 10.0 > axes_right || y + 10.0 > low {
        return Ok(()); // too small for axes
    }
    let frame = Frame { room: [[axis, y], [axes_right, low]], x: x_bounds, y: y_bounds };
    if let Some(heat) = &plot.heat {
        draw_cells(canvas, plot, &frame, heat)?;
        draw_bar(canvas, heat, [[axes_right, y], [right, low]])?;
    }
    draw_axes(canvas, plot, &frame, &y_marks)?;
    for band in &plot.bands {
        draw_band(canvas, plot, &frame, band)?;
    }
    let middle = [0.5 * (axis + axes_right), bottom];
    canvas.text(&Text { text: &plot.x.title, at: middle, align: Align::Centre, size: SMALL, colour: quiet })?;
    for series in &plot.series {
        draw_series(canvas, plot, &frame, series)?;
    }
    draw_reference_texts(canvas, plot, &frame)?;
    draw_labels(canvas, plot, &frame)
}

fn draw_axes<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    frame: &Frame,
    y_marks: &[(f64, String)],
) -> Result<(), FigureError> {
    let [[left, top], [right, bottom]] = frame.room;
    let (quiet, border) = (canvas.colours.quiet_text, canvas.colours.border);
    let faint = border.mix(canvas.colours.background, 0.55);
    let mut last_end = f64::NEG_INFINITY;
    for (at, mark) in plot.x.marks(&frame.x) {
        let [x, _] = frame.at([at, *frame.y.start()]);
        if mark.is_empty() {
            canvas.path(&[[x, bottom], [x, bottom + 3.0]], 0.75, border)?;
            continue;
        }
        let end = if plot.heat.is_some() { bottom + 3.0 } else { top };
        canvas.path(&[[x, end], [x, bottom]], 0.5, faint)?;
        let half = 0.5 * canvas.width(&mark, SMALL)?;
        if x - half > last_end {
            let at = [x, bottom + LINE];
            canvas.text(&Text { text: &mark, at, align: Align::Centre, size: SMALL, colour: quiet })?;
            last_end = x + half + 4.0;
        }
    }
    for (at, mark) in y_marks {
        let [_, y] = frame.at([*frame.x.start(), *at]);
        if mark.is_empty() {
            canvas.path(&[[left - 3.0, y], [left, y]], 0.75, border)?;
            continue;
        }
        let end = if plot.heat.is_some() { left - 3.0 } else { right };
        canvas.path(&[[left, y], [end, y]], 0.5, faint)?;
        let at = [left - 6.0, y + 0.34 * SMALL];
        canvas.text(&Text { text: mark, at, align: Align::Right, size: SMALL, colour: quiet })?;
    }
    canvas.path(&[[left, top], [left, bottom], [right, bottom]], 1.0, border)?;
    for reference in placed_references(canvas, plot, frame)? {
        dashes(canvas, &reference.ends, REFERENCE_DASHES, quiet)?;
    }
    Ok(())
}

/// A reference line in a plot.
struct PlacedReference<'a> {
    ends: [[f64; 2]; 2],
    text: &'a str,
    /// Room of the text.
    ground: Box2,
}

impl PlacedReference<'_> {
    /// Depth of the text's room below its base line.
    const DESCENT: f64 = 2.5;
}

/// The reference lines that lie within the plot.
fn placed_references<'a, B: DrawingBackend>(
    canvas: &Canvas<B>,
    plot: &'a Plot,
    frame: &Frame,
) -> Result<Vec<PlacedReference<'a>>, FigureError> {
    let [[left, top], [right, bottom]] = frame.room;
    let mut placed = Vec::new();
    for line in &plot.references {
        let (axis, range) = if line.horizontal { (&plot.y, &frame.y) } else { (&plot.x, &frame.x) };
        let Some(at) = axis.coordinate(line.at).filter(|at| range.contains(at)) else { continue };
        let width = canvas.width(&line.text, SMALL)?;
        let (ends, low, base) = if line.horizontal {
            let [_, y] = frame.at([*frame.x.start(), at]);
            ([[left, y], [right, y]], right - 2.0 - width, y - 4.0)
        } else {
            let [x, _] = frame.at([at, *frame.y.start()]);
            let beside = if x + 4.0 + width <= right { x + 4.0 } else { x - 4.0 - width };
            ([[x, top], [x, bottom]], beside, top + SMALL)
        };
        let ground = [[low, base - SMALL + 1.0], [low + width, base + PlacedReference::DESCENT]];
        placed.push(PlacedReference { ends, text: &line.text, ground });
    }
    Ok(placed)
}

/// Texts of the reference lines, above all series, which show through their ground.
fn draw_reference_texts<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    frame: &Frame,
) -> Result<(), FigureError> {
    let (behind, colour) = (canvas.colours.background, canvas.colours.quiet_text);
    for PlacedReference { text, ground: [[low, above], [high, below]], .. } in placed_references(canvas, plot, frame)? {
        if !text.is_empty() {
            canvas.veil(&[[low, above], [high, above], [high, below], [low, below]], behind, 0.8)?;
            let at = [low, below - PlacedReference::DESCENT];
            canvas.text(&Text { text, at, align: Align::Left, size: SMALL, colour })?;
        }
    }
    Ok(())
}

/// A dashed line through points. Curves have longer dashes than reference lines.
fn dashes<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    points: &[[f64; 2]],
    ([dash, gap], width): ([f64; 2], f64),
    colour: Rgb,
) -> Result<(), FigureError> {
    let mut piece: Vec<[f64; 2]> = points.first().copied().into_iter().collect();
    // Length left of the dash or gap that is being drawn.
    let (mut drawn, mut left) = (true, dash);
    for pair in points.windows(2) {
        let [mut from, to] = [pair[0], pair[1]];
        let mut length = (to[0] - from[0]).hypot(to[1] - from[1]);
        while length >= left {
            from = [0, 1].map(|k| from[k] + (to[k] - from[k]) * (left / length));
            length -= left;
            piece.push(from);
            if drawn {
                canvas.curve(&piece, width, colour)?;
            }
            piece = vec![from];
            drawn = !drawn;
            left = if drawn { dash } else { gap };
        }
        left -= length;
        piece.push(to);
    }
    if drawn { canvas.curve(&piece, width, colour) } else { Ok(()) }
}

/// Lengths of a dash and of a gap, and the width, of a reference line.
const REFERENCE_DASHES: ([f64; 2], f64) = ([5.0, 4.0], 0.9);
/// Lengths of a dash and of a gap, and the width, of a dashed curve.
const CURVE_DASHES: ([f64; 2], f64) = ([7.0, 4.0], CURVE);

fn draw_line<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    points: &[[f64; 2]],
    line: LineStyle,
    colour: Rgb,
) -> Result<(), FigureError> {
    match (line, line_width(line)) {
        (LineStyle::Dashed, _) => dashes(canvas, points, CURVE_DASHES, colour),
        // Round corners cost an element each, so that only short lines have them.
        (_, Some(width)) if points.len() > MANY => canvas.curve(points, width, colour),
        (_, Some(width)) => canvas.path(points, width, colour),
        (_, None) => Ok(()),
    }
}

/// Points from which on a line is drawn in one piece.
const MANY: usize = 40;

/// Line and marker of a series in the legend.
fn draw_sample<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    series: &DataSeries,
    [x, y]: [f64; 2],
) -> Result<(), FigureError> {
    let colour = series_colour(series.colour, canvas.theme);
    draw_line(canvas, &[[x, y], [x + SAMPLE, y]], series.line, colour)?;
    canvas.marker(series.marker, [x + 0.5 * SAMPLE, y], RADIUS, colour)
}

fn draw_series<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    frame: &Frame,
    series: &DataSeries,
) -> Result<(), FigureError> {
    let colour = series_colour(series.colour, canvas.theme);
    let spread_colour = colour.mix(canvas.colours.background, 0.45);
    for point in &series.points {
        let Some(ends) = plot.spread(point) else { continue };
        let ends = ends.map(|end| {
            let [x, y] = plot.place(end)?;
            // A bar that leaves the axes ends there.
            let within = |value: f64, range: &RangeInclusive<f64>| value.clamp(*range.start(), *range.end());
            Some(frame.at([within(x, &frame.x), within(y, &frame.y)]))
        });
        if let [Some(low), Some(high)] = ends {
            canvas.path(&[low, high], 1.0, spread_colour)?;
        }
    }
    // A point without a number interrupts the line.
    for run in series.points.split(|point| point.at.iter().any(|c| c.is_nan())) {
        let places: Vec<[f64; 2]> = run.iter().filter_map(|point| frame.of(plot, point.at)).collect();
        draw_line(canvas, &places, series.line, colour)?;
    }
    if series.marker == Marker::None {
        return Ok(());
    }
    for place in series.points.iter().filter_map(|point| frame.of(plot, point.at)) {
        canvas.marker(series.marker, place, RADIUS, colour)?;
    }
    Ok(())
}

/// Labels of all points.
fn draw_labels<B: DrawingBackend>(canvas: &mut Canvas<B>, plot: &Plot, frame: &Frame) -> Result<(), FigureError> {
    const SIZE: f64 = SMALL - 0.5;
    let mut obstacles: Vec<Box2> = Vec::new();
    for PlacedReference { ends: [[left, top], [right, bottom]], text, ground } in
        placed_references(canvas, plot, frame)?
    {
        obstacles.push([[left - 1.5, top - 1.5], [right + 1.5, bottom + 1.5]]);
        obstacles.extend((!text.is_empty()).then_some(ground));
    }
    let size = |text: &str| Ok::<_, FigureError>([canvas.width(text, SIZE)?, SIZE + 1.5]);
    let labels = placed_labels(plot, |at| frame.of(plot, at), size, |_| true, (obstacles, frame.room))?;
    for PlacedLabel { text, colour, room: [low, high], lead } in labels {
        if let Some(ends) = lead {
            canvas.path(&ends, 0.6, canvas.colours.quiet_text)?;
        }
        let colour = series_colour(colour, canvas.theme).mix(canvas.colours.text, 0.45);
        let at = [0.5 * (low[0] + high[0]), high[1] - 0.24 * SIZE];
        canvas.text(&Text { text, at, align: Align::Centre, size: SIZE, colour })?;
    }
    Ok(())
}
