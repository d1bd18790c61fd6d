//! Layers of a plot over time: phases, gaps, curves, bands, cursor.

use super::{PlotCurve, TimePlot};
use crate::app::shown::{ComparedTrace, DisplayedData};
use crate::app::theme::{colour, veil};
use crate::app::traces::GraspTrace;
use egui::{Color32, Ui};
use egui_plot::{FilledArea, Line, LineStyle, PlotPoint, PlotPoints, PlotTransform, Span, Text, VLine};
use palpate_geometry::palette::{Rgb, Theme};
use palpate_lab::inspection::TouchPhase;

/// Opacity of an error band.
const BAND: f32 = 0.3;

/// Shades the hold, and names the phases.
pub(super) fn add_phases(
    plot_ui: &mut egui_plot::PlotUi<'_>,
    data: &DisplayedData<'_>,
    [from, to]: [f64; 2],
    height: f64,
) {
    let quiet = data.view.theme.colours().quiet_text;
    let width = f64::from(plot_ui.response().rect.width());
    for span in data.phases {
        if span.phase == TouchPhase::Hold {
            plot_ui.add(Span::new("", span.from_s..=span.to_s).fill(veil(quiet, 0.09)).border_width(0.0));
        } else {
            plot_ui.vline(VLine::new("", span.from_s).color(veil(quiet, 0.35)).width(1.0).allow_hover(false));
        }
        let name = span.phase.name();
        let room = (span.to_s.min(to) - span.from_s.max(from)) / (to - from) * width;
        if room > 7.0 * name.len() as f64 {
            let place = PlotPoint::new(span.from_s.max(from), height);
            let word = egui::RichText::new(format!(" {name}")).small();
            plot_ui.text(Text::new("", place, word).color(veil(quiet, 0.8)).anchor(egui::Align2::LEFT_TOP));
        }
    }
}

/// Cursor and marks.
pub(super) fn add_cursor(plot_ui: &mut egui_plot::PlotUi<'_>, data: &DisplayedData<'_>) {
    let colours = data.view.theme.colours();
    let line = |t: f64, ink: Color32, width: f32| VLine::new("", t).color(ink).width(width).allow_hover(false);
    for mark in data.playback.marks.into_iter().flatten() {
        plot_ui.vline(line(mark, colour(colours.warning), 1.0));
    }
    match (data.playback.cursor_s, data.time_s()) {
        (Some(t), _) => plot_ui.vline(line(t, colour(colours.accent), 1.5)),
        (None, Some(now)) => plot_ui.vline(line(now, veil(colours.quiet_text, 0.5), 1.0)),
        (None, None) => {}
    }
}

/// Shades one standard deviation about the mean of a class.
pub(super) fn add_spread(plot_ui: &mut egui_plot::PlotUi<'_>, compared: &ComparedTrace, plot: &TimePlot<'_>, ink: Rgb) {
    if compared.spread.is_empty() {
        return;
    }
    let trace = &compared.trace;
    let spread = GraspTrace { channels: compared.spread.clone(), ..trace.clone() };
    for curve in &plot.curves {
        let points: Vec<[f64; 3]> = (0..trace.t.len())
            .filter_map(|k| {
                let (mean, half) = ((curve.values)(trace, k)?, (curve.values)(&spread, k)?);
                (mean.is_finite() && half.is_finite()).then(|| [trace.t[k], mean - half, mean + half])
            })
            .collect();
        fill(plot_ui, &points, veil(ink, 0.16));
    }
}

/// Draws mean and spread of the two likeliest classes: the likeliest in the accent colour, the second in that of warnings.
pub(super) fn add_class_bands(plot_ui: &mut egui_plot::PlotUi<'_>, data: &DisplayedData<'_>, plot: &TimePlot<'_>) {
    let colours = data.view.theme.colours();
    for (name, factor) in plot.curves.iter().filter_map(|curve| curve.channel.as_ref()) {
        let Some(bands) = data.bands_for(name) else { continue };
        for (band, ink) in bands.iter().zip([colours.accent, colours.warning]) {
            let points: Vec<[f64; 3]> = (0..band.t_s.len())
                .map(|k| [band.t_s[k], factor * band.low[k], factor * band.high[k]])
                .filter(|point| point.iter().all(|value| value.is_finite()))
                .collect();
            fill(plot_ui, &points, veil(ink, 0.15));
            let mean: Vec<[f64; 2]> = (0..band.t_s.len()).map(|k| [band.t_s[k], factor * band.mean[k]]).collect();
            let line = Line::new("", PlotPoints::from(mean)).color(veil(ink, 0.7)).width(1.0);
            plot_ui.line(line.style(LineStyle::dotted_dense()).allow_hover(false));
        }
    }
}

/// Fills between low and high: time, low, high.
fn fill(plot_ui: &mut egui_plot::PlotUi<'_>, points: &[[f64; 3]], ink: Color32) {
    let [t, low, high] = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).collect::<Vec<f64>>());
    if t.len() > 1 {
        plot_ui.add(FilledArea::new("", &t, &low, &high).fill_color(ink));
    }
}

/// Times of the current grasp without readings (s).
pub(super) fn gaps(data: &DisplayedData<'_>) -> Vec<[f64; 2]> {
    data.traces.current().map(GraspTrace::gaps).unwrap_or_default()
}

/// Distance between the strokes of a hatching (points).
const STROKES: f32 = 7.0;

/// Narrower gaps are not hatched (points).
const NARROW: f32 = 3.0;

/// Hatches a time without readings.
pub(super) fn hatch(ui: &Ui, transform: &PlotTransform, [from, to]: [f64; 2], shade: Color32) {
    let frame = *transform.frame();
    let [left, right] = [from, to].map(|t| transform.position_from_point_x(t));
    let rect = egui::Rect::from_x_y_ranges(left..=right, frame.y_range()).intersect(frame);
    // A narrow gap shows by its colour.
    if rect.width() < NARROW || rect.height() <= 0.0 {
        return;
    }
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    // Strokes are fixed to the plot, so that they do not move while the gap grows.
    let first = ((rect.left() - frame.left() - rect.height()) / STROKES).floor() as i32;
    let last = ((rect.right() - frame.left()) / STROKES).ceil() as i32;
    for k in first..=last {
        let foot = frame.left() + STROKES * k as f32;
        let ends = [egui::pos2(foot, rect.bottom()), egui::pos2(foot + rect.height(), rect.top())];
        painter.line_segment(ends, egui::Stroke::new(1.0, shade));
    }
}

/// Shades times without readings, to tell them from rest.
pub(super) fn add_gaps(plot_ui: &mut egui_plot::PlotUi<'_>, gaps: &[[f64; 2]], theme: Theme) {
    let error = theme.colours().error;
    for [from, to] in gaps {
        let span = Span::new("", *from..=*to).fill(veil(error, 0.16));
        plot_ui.add(span.border_width(1.0).border_color(veil(error, 0.5)));
    }
}

/// Draws the curves of a grasp, later by `by_s`.
pub(super) fn add_curves(
    plot_ui: &mut egui_plot::PlotUi<'_>,
    trace: &GraspTrace,
    by_s: f64,
    plot: &TimePlot<'_>,
    shade: impl Fn(&PlotCurve) -> Color32,
    width: f32,
) {
    for curve in &plot.curves {
        let style = if curve.dashed { LineStyle::Dashed { length: 7.0 } } else { LineStyle::Solid };
        for points in runs(trace, by_s, curve) {
            plot_ui.line(
                Line::new("", PlotPoints::from(points))
                    .id(egui::Id::unique((&curve.name, trace.grasp, width.to_bits())))
                    .color(shade(curve))
                    .width(width)
                    .style(style)
                    .allow_hover(false),
            );
        }
    }
}

/// Parts of a curve where it is defined, as points of time (s), later by `by_s`, and value. Nothing is drawn between them: some line styles
/// break off at a point that is not a number, others forbid it.
fn runs(trace: &GraspTrace, by_s: f64, curve: &PlotCurve) -> Vec<Vec<[f64; 2]>> {
    let mut runs = vec![Vec::new()];
    for (k, t) in trace.t.iter().enumerate() {
        match ((curve.values)(trace, k).filter(|value| value.is_finite()), runs.last_mut()) {
            (Some(value), Some(run)) => run.push([*t + by_s, value]),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// Shades the error band about each curve.
pub(super) fn add_bands(plot_ui: &mut egui_plot::PlotUi<'_>, trace: &GraspTrace, plot: &TimePlot<'_>, theme: Theme) {
    for curve in &plot.curves {
        let points: Vec<[f64; 3]> = (0..trace.t.len())
            .filter_map(|k| {
                let (value, half) = ((curve.values)(trace, k)?, (curve.half_width)(trace, k)?);
                (value.is_finite() && half.is_finite()).then(|| [trace.t[k], value - half, value + half])
            })
            .collect();
        fill(plot_ui, &points, veil(curve.trace.colour(theme), BAND));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::palette::Trace;

    #[test]
    fn a_curve_is_drawn_where_it_is_defined() {
        let nan = f32::NAN;
        let channels = vec![vec![nan, 1.0, 2.0, nan, nan, 3.0, nan]];
        let t: Vec<f64> = (0..7).map(f64::from).collect();
        let trace = GraspTrace { t, channels, ..GraspTrace::default() };
        let curve = PlotCurve {
            name: String::new(),
            trace: Trace::Pressure,
            dashed: true,
            values: Box::new(|trace, k| Some(f64::from(trace.channels[0][k]))),
            half_width: Box::new(|_, _| None),
            channel: None,
        };
        assert_eq!(runs(&trace, 0.0, &curve), [vec![[1.0, 1.0], [2.0, 2.0]], vec![[5.0, 3.0]]]);
    }
}
