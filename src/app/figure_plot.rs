//! A plot of a figure in the window: the same data as in the files that studies write.

use crate::app::theme::{colour, veil};
use egui::{Align2, Color32, FontId, Rect, Response, RichText, Sense, Stroke, Ui, vec2};
use egui_plot::{
    AxisHints, FilledArea, GridInput, GridMark, HLine, Legend, Line, LineStyle as Dashes, MarkerShape,
    Plot as PlotWidget, PlotPoint, PlotTransform, Points, Text, VLine, VPlacement,
};
use palpate_geometry::drawing::{CellAxis, DataSeries, HeatMap, LineStyle, Marker, Plot};
use palpate_geometry::palette::{Rgb, Theme, series_colour};
use palpate_geometry::units::{capital, symbol};
use palpate_render::placed_labels;
use std::ops::RangeInclusive;

/// A plot on the screen.
pub(super) struct ShownPlot {
    /// Pointer and clicks.
    pub(super) response: Response,
    transform: PlotTransform,
}

impl ShownPlot {
    /// Place of values of a plot on the screen; `None` where an axis cannot show them.
    pub(super) fn position(&self, plot: &Plot, at: [f64; 2]) -> Option<egui::Pos2> {
        let [x, y] = plot.place(at)?;
        Some(self.transform.position_from_point(&PlotPoint::new(x, y)))
    }

    /// Place of a cell of colour on the screen.
    pub(super) fn cell(&self, plot: &Plot, row: usize, column: usize) -> Option<Rect> {
        let heat = plot.heat.as_ref()?;
        let corner = |row: usize, column: usize| self.position(plot, [edge(&heat.x, column), edge(&heat.y, row)]);
        Some(Rect::from_two_pos(corner(row, column)?, corner(row + 1, column + 1)?))
    }
}

/// Value at the beginning of a cell.
fn edge(axis: &CellAxis, cell: usize) -> f64 {
    let [from, to] = axis.range;
    from + (to - from) * cell as f64 / axis.count.max(1) as f64
}

/// Draws a plot, `height` points high. `legend`: names of the series stand in it where there
/// is room. `labelled` chooses points whose labels are shown.
pub(super) fn show(
    ui: &mut Ui,
    theme: Theme,
    (id, plot): (&str, &Plot),
    height: f32,
    legend: bool,
    labelled: impl Fn(&str) -> bool,
) -> ShownPlot {
    let [x_bounds, y_bounds] = plot.bounds();
    let quiet = theme.colours().quiet_text;
    let mut known = [plot.x.marks(&x_bounds), plot.y_marks(&y_bounds)];
    let lines = if height > 2.0 * LINE * (known[1].len() + 2) as f32 { 2 } else { 1 };
    let most = (NAMES * ui.available_width() / LETTER) as usize;
    known[1].iter_mut().for_each(|(_, text)| *text = wrapped_name(text, most, lines));
    if !plot.x.ticks.is_empty() {
        let names = known[1].iter().map(|(_, text)| text.chars().count()).max().unwrap_or(0);
        let column = ((ui.available_width() / LETTER) as usize).saturating_sub(names) / plot.x.ticks.len();
        known[0].iter_mut().for_each(|(_, text)| *text = wrapped_name(text, column.max(2), 2));
        // Numbers close to each other: every second.
        if column < 3 {
            known[0].iter_mut().skip(1).step_by(2).for_each(|(_, text)| text.clear());
        }
    }
    let marks = |known: &[(f64, String)], bounds: &RangeInclusive<f64>| {
        let step_size = bounds.end() - bounds.start();
        let numbered = known.iter().filter(|(_, text)| !text.is_empty());
        let marks: Vec<GridMark> = numbered.map(|(value, _)| GridMark { value: *value, step_size }).collect();
        move |_: GridInput| marks.clone()
    };
    let texts = |known: &[(f64, String)]| {
        let known = known.to_vec();
        move |mark: GridMark, _: &RangeInclusive<f64>| {
            known.iter().find(|(at, _)| (at - mark.value).abs() < 1e-9).map_or(String::new(), |(_, text)| text.clone())
        }
    };
    let mut widget = PlotWidget::new(id.to_owned())
        .height(height)
        .width(ui.available_width() - LAST)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .show_background(false)
        .show_x(false)
        .show_y(false)
        .grid_color(colour(theme.colours().border))
        .grid_spacing(10.0..=44.0)
        // Where not all is seen at once, the axis is at the end that is.
        .custom_x_axes(vec![AxisHints::new_x().placement(if height > ui.clip_rect().height() {
            VPlacement::Top
        } else {
            VPlacement::Bottom
        })])
        .x_grid_spacer(marks(&known[0], &x_bounds))
        .y_grid_spacer(marks(&known[1], &y_bounds))
        .x_axis_formatter(texts(&known[0]))
        .y_axis_formatter(texts(&known[1]))
        .set_margin_fraction(egui::Vec2::ZERO);
    if height > ROOM_FOR_TITLES {
        let names = known[1].iter().map(|(_, text)| text.lines().map(|line| line.chars().count()).max().unwrap_or(0));
        let axis = ((ui.available_width() / LETTER) as usize).saturating_sub(names.max().unwrap_or(0).min(most));
        let x_title = wrapped_name(&symbol(&plot.x.title), axis.max(8), 1);
        widget = widget.x_axis_label(x_title).y_axis_label(symbol(&plot.y.title));
    }
    if height <= ROOM_FOR_TITLES || plot.heat.is_some() {
        let titles = [plot.y.title.as_str(), plot.x.title.as_str()].map(symbol);
        let axes = match &titles {
            [rows, columns] if let Some(heat) = &plot.heat => {
                format!("{} ({}). Rows: {rows}, columns: {columns}", capital(&heat.quantity), heat.unit)
            }
            titles => titles
                .iter()
                .filter(|title| !title.is_empty())
                .map(AsRef::as_ref)
                .collect::<Vec<&str>>()
                .join(" against "),
        };
        ui.add(egui::Label::new(RichText::new(axes).small().weak()).truncate());
    }
    if legend && ui.available_width() > ROOM_FOR_LEGEND[0] && height > ROOM_FOR_LEGEND[1] {
        let legend = Legend::default().background_alpha(0.6).follow_insertion_order(true);
        let legend = legend.text_style(egui::TextStyle::Small).position(egui_plot::Corner::RightBottom);
        widget = widget.legend(legend);
    }
    let shown = widget.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(x_bounds.clone());
        plot_ui.set_plot_bounds_y(y_bounds.clone());
        for band in &plot.bands {
            add_band(plot_ui, plot, &band.points, veil(series_colour(band.colour, theme), BAND));
        }
        for line in &plot.references {
            let axis = if line.horizontal { &plot.y } else { &plot.x };
            let Some(at) = axis.coordinate(line.at) else { continue };
            let (ink, dashes) = (veil(quiet, 0.8), Dashes::dashed_loose());
            if line.horizontal {
                plot_ui.hline(HLine::new("", at).color(ink).width(1.0).style(dashes));
            } else {
                plot_ui.vline(VLine::new("", at).color(ink).width(1.0).style(dashes));
            }
        }
        for series in &plot.series {
            add_series(plot_ui, plot, series, colour(series_colour(series.colour, theme)));
        }
        for line in plot.references.iter().filter(|line| !line.text.is_empty()) {
            let axis = if line.horizontal { &plot.y } else { &plot.x };
            let Some(at) = axis.coordinate(line.at) else { continue };
            let (place, anchor) = if line.horizontal {
                (PlotPoint::new(*x_bounds.start(), at), Align2::LEFT_BOTTOM)
            } else {
                // On the side that has room, or else in the middle.
                let (frame, width) = (*plot_ui.transform().frame(), LETTER * line.text.chars().count() as f32);
                let x = plot_ui.transform().position_from_point(&PlotPoint::new(at, *y_bounds.end())).x;
                let middle = 0.5 * (x_bounds.start() + x_bounds.end());
                let (at, anchor) = match (frame.right() - x > width, x - frame.left() > width) {
                    (true, _) => (at, Align2::LEFT_TOP),
                    (_, true) => (at, Align2::RIGHT_TOP),
                    _ => (middle, Align2::CENTER_TOP),
                };
                (PlotPoint::new(at, *y_bounds.end()), anchor)
            };
            let word = RichText::new(&line.text).small().background_color(veil(theme.colours().background, 0.8));
            plot_ui.text(Text::new("", place, word).color(colour(quiet)).anchor(anchor));
        }
    });
    let shown = ShownPlot { response: shown.response, transform: shown.transform };
    if let Some(heat) = &plot.heat {
        cells(ui, &shown, plot, heat);
    }
    labels(ui, theme, &shown, plot, labelled);
    shown
}

/// Labels of points, clear of each other, of points and of lines.
fn labels(ui: &Ui, theme: Theme, shown: &ShownPlot, plot: &Plot, labelled: impl Fn(&str) -> bool) {
    let rect = *shown.transform.frame();
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let font = egui::TextStyle::Small.resolve(ui.style());
    let galley = |text: &str| painter.layout_no_wrap(text.to_owned(), font.clone(), colour(theme.colours().text));
    let size = |text: &str| {
        let egui::Vec2 { x, y } = galley(text).size();
        Ok::<_, std::convert::Infallible>([x, y].map(f64::from))
    };
    let at = |at| shown.position(plot, at).filter(|place| rect.contains(*place)).map(|p| [p.x, p.y].map(f64::from));
    let position = |[x, y]: [f64; 2]| egui::pos2(x as f32, y as f32);
    let corners = |rect: Rect| [rect.min, rect.max].map(|corner| [corner.x, corner.y].map(f64::from));
    let obstacles = plot.references.iter().filter_map(|line| {
        let axis = if line.horizontal { &plot.y } else { &plot.x };
        let at = axis.coordinate(line.at)?;
        let at = shown.transform.position_from_point(&PlotPoint::new(at, at));
        let drawn = if line.horizontal {
            Rect::from_x_y_ranges(rect.x_range(), at.y - 1.5..=at.y + 1.5)
        } else {
            Rect::from_x_y_ranges(at.x - 1.5..=at.x + 1.5, rect.y_range())
        };
        // Its text stands at one end.
        let words = vec2(LETTER * line.text.chars().count() as f32, LINE);
        let text = if line.horizontal {
            Rect::from_min_size(egui::pos2(rect.left(), at.y - LINE), words)
        } else {
            Rect::from_center_size(egui::pos2(at.x, rect.top() + 0.5 * LINE), 2.0 * words)
        };
        Some([drawn, text].map(corners))
    });
    let Ok(labels) = placed_labels(plot, at, size, labelled, (obstacles.flatten().collect(), corners(rect)));
    for label in labels {
        if let Some(ends) = label.lead {
            painter.line_segment(ends.map(position), Stroke::new(0.6, colour(theme.colours().quiet_text)));
        }
        // Legible where no place is free of curves.
        let ground = Rect::from_min_max(position(label.room[0]), position(label.room[1]));
        painter.rect_filled(ground, 2.0, veil(theme.colours().background, 0.75));
        painter.galley(position(label.room[0]), galley(label.text), colour(theme.colours().text));
    }
}

/// Most width of the names of rows, as a share of the plot's; width of a letter and height of a line (points).
const NAMES: f32 = 0.45;
const LETTER: f32 = 6.6;
const LINE: f32 = 15.0;
/// Room for the half of a number at the right end of the axis (points).
const LAST: f32 = 16.0;

/// A name in at most so many lines of so many letters, cut in the middle.
fn wrapped_name(text: &str, most: usize, lines: usize) -> String {
    let mut wrapped = vec![String::new()];
    for word in text.split(' ') {
        let long = wrapped
            .last()
            .is_some_and(|line| !line.is_empty() && line.chars().count() + 1 + word.chars().count() > most);
        if long && wrapped.len() < lines {
            wrapped.push(String::new());
        }
        if let Some(line) = wrapped.last_mut() {
            let space = if line.is_empty() { "" } else { " " };
            *line = format!("{line}{space}{word}");
        }
    }
    for line in wrapped.iter_mut().filter(|line| line.chars().count() > most) {
        // Names that begin alike differ at their ends.
        let letters: Vec<char> = line.chars().collect();
        let head = 3 * most.saturating_sub(1) / 5;
        let tail = most.saturating_sub(1) - head;
        *line = letters[..head].iter().chain(['…'].iter()).chain(&letters[letters.len() - tail..]).collect();
    }
    wrapped.join("\n")
}

/// An entry of a legend: name, number of the colour, sign and line.
type Entry<'a> = (&'a str, usize, Marker, LineStyle);

/// Entries of a legend, each once.
fn entries<'a>(series: impl Iterator<Item = &'a DataSeries>) -> Vec<Entry<'a>> {
    let mut seen = Vec::new();
    for series in series.filter(|series| !series.name.is_empty()) {
        let key = (series.name.as_str(), series.colour, series.marker, series.line);
        if !seen.contains(&key) {
            seen.push(key);
        }
    }
    seen
}

/// True where one legend of these plots would give a colour, sign and line to several names: each plot needs its own.
pub(super) fn is_ambiguous(plots: &[Plot]) -> bool {
    let seen = entries(plots.iter().flat_map(|plot| &plot.series));
    let look = |entry: &Entry<'_>| (entry.1, entry.2, entry.3);
    seen.iter().enumerate().any(|(k, entry)| seen[..k].iter().any(|other| look(other) == look(entry)))
}

/// Names of all series with their colours and signs.
pub(super) fn legend_ui<'a>(ui: &mut Ui, theme: Theme, series: impl Iterator<Item = &'a DataSeries>) {
    let seen = entries(series);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 2.0);
        for (name, number, marker, line) in seen {
            let ink = colour(series_colour(number, theme));
            let font = egui::TextStyle::Small.resolve(ui.style());
            // A sign and its name stay together.
            let text = ui.painter().layout_no_wrap(name.to_owned(), font, Color32::PLACEHOLDER);
            if text.size().x + 24.0 > ui.available_size_before_wrap().x {
                ui.end_row();
            }
            let (rect, _) = ui.allocate_exact_size(vec2(16.0, 14.0), Sense::hover());
            let (painter, at) = (ui.painter(), rect.center());
            if line != LineStyle::None {
                let width = if line == LineStyle::Bold { 3.0 } else { 1.3 };
                let ends = [rect.left_center(), rect.right_center()];
                if line == LineStyle::Dashed {
                    painter.extend(egui::Shape::dashed_line(&ends, Stroke::new(width, ink), 4.0, 3.0));
                } else {
                    painter.line_segment(ends, Stroke::new(width, ink));
                }
            }
            match marker {
                Marker::None => {}
                Marker::Dot => {
                    painter.circle_filled(at, 3.5, ink);
                }
                Marker::Ring => {
                    painter.circle_stroke(at, 3.5, Stroke::new(1.3, ink));
                }
                Marker::Square => {
                    painter.rect_filled(Rect::from_center_size(at, vec2(7.0, 7.0)), 0.0, ink);
                }
                Marker::Cross => {
                    for side in [1.0, -1.0] {
                        let reach = vec2(3.5, 3.5 * side);
                        painter.line_segment([at - reach, at + reach], Stroke::new(1.3, ink));
                    }
                }
            }
            ui.label(RichText::new(name).small());
            ui.add_space(6.0);
        }
    });
}

/// Opacity of a band.
const BAND: f32 = 0.22;
/// Least size of a cell with its value in it (points).
const ROOM_FOR_VALUE: egui::Vec2 = egui::vec2(19.0, 12.0);

/// Cells of colour; their values where there is room, but for zeros.
fn cells(ui: &Ui, shown: &ShownPlot, plot: &Plot, heat: &HeatMap) {
    let painter = ui.painter().with_clip_rect(shown.response.rect.intersect(ui.clip_rect()));
    for (row, column) in (0..heat.y.count).flat_map(|row| (0..heat.x.count).map(move |column| (row, column))) {
        let value = heat.value(row, column);
        let (Some(fill), Some(cell)) = (heat.scale.colour(value), shown.cell(plot, row, column)) else { continue };
        painter.rect_filled(cell, 0.0, colour(fill));
        let text = format!("{value:.0}");
        if text.trim_start_matches('-') != "0" && cell.width() > ROOM_FOR_VALUE.x && cell.height() > ROOM_FOR_VALUE.y {
            let [dark, bright] = [Rgb(0, 0, 0), Rgb(255, 255, 255)];
            let ink = if fill.contrast(dark) > fill.contrast(bright) { dark } else { bright };
            let letters = (0.35 * cell.height()).min(0.2 * cell.width()).clamp(10.0, 16.0);
            painter.text(cell.center(), Align2::CENTER_CENTER, text, FontId::proportional(letters), colour(ink));
        }
    }
}

/// A band, cut where an edge has no number.
fn add_band(plot_ui: &mut egui_plot::PlotUi<'_>, plot: &Plot, points: &[[f64; 3]], fill: Color32) {
    for run in points.split(|point| point.iter().any(|c| !c.is_finite())) {
        let places = run.iter().filter_map(|[x, low, high]| Some([plot.place([*x, *low])?, plot.place([*x, *high])?]));
        let places: Vec<[[f64; 2]; 2]> = places.collect();
        let [xs, low, high] =
            [[0, 0], [0, 1], [1, 1]].map(|[end, axis]| places.iter().map(|place| place[end][axis]).collect::<Vec<_>>());
        if xs.len() > 1 {
            plot_ui.add(FilledArea::new("", &xs, &low, &high).fill_color(fill).allow_hover(false));
        }
    }
}

/// Height from which on titles stand at the axes (points).
const ROOM_FOR_TITLES: f32 = 200.0;
/// Least width and height of a plot with a legend (points).
const ROOM_FOR_LEGEND: [f32; 2] = [380.0, 220.0];

fn add_series(plot_ui: &mut egui_plot::PlotUi<'_>, plot: &Plot, series: &DataSeries, ink: Color32) {
    let places: Vec<[f64; 2]> = series.points.iter().filter_map(|point| plot.place(point.at)).collect();
    for point in &series.points {
        let Some(ends) = plot.spread(point) else { continue };
        if let [Some(low), Some(high)] = ends.map(|end| plot.place(end)) {
            plot_ui.line(Line::new("", vec![low, high]).color(ink.gamma_multiply(0.5)).width(1.0).allow_hover(false));
        }
    }
    let width = match series.line {
        LineStyle::None => None,
        LineStyle::Thin | LineStyle::Dashed => Some(1.3),
        LineStyle::Bold => Some(3.5),
    };
    if let Some(width) = width {
        let style = if series.line == LineStyle::Dashed { Dashes::dashed_dense() } else { Dashes::Solid };
        let line = Line::new(series.name.clone(), places.clone()).color(ink).width(width).style(style);
        plot_ui.line(line.allow_hover(false));
    }
    let (shape, filled) = match series.marker {
        Marker::None => return,
        Marker::Dot => (MarkerShape::Circle, true),
        Marker::Ring => (MarkerShape::Circle, false),
        Marker::Square => (MarkerShape::Square, true),
        Marker::Cross => (MarkerShape::Cross, false),
    };
    let radius = if series.marker == Marker::Cross { 5.5 } else { 3.5 };
    let points = Points::new(series.name.clone(), places).shape(shape).filled(filled).radius(radius).color(ink);
    plot_ui.points(points.allow_hover(false));
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_study::accuracy::{SceneGroup, accuracy_plot, stored_accuracy};

    #[test]
    fn plots_that_give_a_colour_to_several_names_need_legends_of_their_own() {
        let figure = stored_accuracy().expect("stored").result.figure().figure;
        assert!(is_ambiguous(&figure.plots));
        assert!(figure.plots.iter().all(|plot| !is_ambiguous(std::slice::from_ref(plot))));
        let free = accuracy_plot(&stored_accuracy().expect("stored").result, SceneGroup::Free);
        assert!(!is_ambiguous(&[free.clone(), free]));
    }

    #[test]
    fn long_names_are_wrapped_and_then_cut() {
        let name = "two pads on each finger, chamber pressure";
        assert_eq!(wrapped_name(name, 60, 1), name);
        assert_eq!(wrapped_name(name, 24, 2), "two pads on each finger,\nchamber pressure");
        assert_eq!(wrapped_name(name, 10, 1), "two p…sure");
        assert_eq!(wrapped_name("", 10, 2), "");
    }
}
