//! A plot of a figure in the window: the same data as in the files that studies write.

use crate::app::theme::{colour, veil};
use egui::{Align2, Color32, Response, RichText, Ui};
use egui_plot::{
    GridInput, GridMark, HLine, Legend, Line, LineStyle as Dashes, MarkerShape, Plot as PlotWidget, PlotPoint,
    PlotTransform, Points, Text, VLine,
};
use palpate_geometry::drawing::{DataSeries, LineStyle, Marker, Plot, PlotAxis};
use palpate_geometry::palette::{Theme, series_colour};
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
}

/// Draws a plot, `height` points high. `labelled` chooses points whose labels are shown.
pub(super) fn show(
    ui: &mut Ui,
    theme: Theme,
    (id, plot): (&str, &Plot),
    height: f32,
    labelled: impl Fn(&str) -> bool,
) -> ShownPlot {
    let [x_bounds, y_bounds] = plot.bounds();
    let quiet = theme.colours().quiet_text;
    let marks = |axis: &PlotAxis, bounds: &RangeInclusive<f64>| {
        let (axis, bounds) = (axis.clone(), bounds.clone());
        let step_size = bounds.end() - bounds.start();
        move |_: GridInput| {
            let numbered = axis.marks(&bounds).into_iter().filter(|(_, text)| !text.is_empty());
            numbered.map(|(value, _)| GridMark { value, step_size }).collect()
        }
    };
    let texts = |axis: &PlotAxis, bounds: &RangeInclusive<f64>| {
        let known = axis.marks(bounds);
        move |mark: GridMark, _: &RangeInclusive<f64>| {
            known.iter().find(|(at, _)| (at - mark.value).abs() < 1e-9).map_or(String::new(), |(_, text)| text.clone())
        }
    };
    let mut widget = PlotWidget::new(id.to_owned())
        .height(height)
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
        .x_grid_spacer(marks(&plot.x, &x_bounds))
        .y_grid_spacer(marks(&plot.y, &y_bounds))
        .x_axis_formatter(texts(&plot.x, &x_bounds))
        .y_axis_formatter(texts(&plot.y, &y_bounds))
        .set_margin_fraction(egui::Vec2::ZERO);
    if height > ROOM_FOR_TITLES {
        widget = widget.x_axis_label(plot.x.title.clone()).y_axis_label(plot.y.title.clone());
    } else {
        let axes = format!("{} against {}", plot.y.title, plot.x.title);
        ui.add(egui::Label::new(RichText::new(axes).small().weak()).truncate());
    }
    if ui.available_width() > ROOM_FOR_LEGEND[0] && height > ROOM_FOR_LEGEND[1] {
        let legend = Legend::default().background_alpha(0.6).follow_insertion_order(true);
        let legend = legend.text_style(egui::TextStyle::Small).position(egui_plot::Corner::RightBottom);
        widget = widget.legend(legend);
    }
    let shown = widget.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(x_bounds.clone());
        plot_ui.set_plot_bounds_y(y_bounds.clone());
        for line in &plot.references {
            let axis = if line.horizontal { &plot.y } else { &plot.x };
            let Some(at) = axis.coordinate(line.at) else { continue };
            let (ink, dashes) = (veil(quiet, 0.8), Dashes::dashed_loose());
            let word = RichText::new(&line.text).small();
            if line.horizontal {
                plot_ui.hline(HLine::new("", at).color(ink).width(1.0).style(dashes));
                let place = PlotPoint::new(*x_bounds.start(), at);
                plot_ui.text(Text::new("", place, word).color(ink).anchor(Align2::LEFT_BOTTOM));
            } else {
                plot_ui.vline(VLine::new("", at).color(ink).width(1.0).style(dashes));
                let place = PlotPoint::new(at, *y_bounds.end());
                plot_ui.text(Text::new("", place, word).color(ink).anchor(Align2::LEFT_TOP));
            }
        }
        for series in &plot.series {
            add_series(plot_ui, plot, series, colour(series_colour(series.colour, theme)));
            for point in series.points.iter().filter(|point| labelled(&point.label)) {
                let Some([x, y]) = plot.place(point.at) else { continue };
                let word = RichText::new(format!("  {}", point.label)).small();
                let text = Text::new("", PlotPoint::new(x, y), word).color(colour(theme.colours().text));
                plot_ui.text(text.anchor(Align2::LEFT_CENTER));
            }
        }
    });
    ShownPlot { response: shown.response, transform: shown.transform }
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
