//! Plots of traces over time. All show the same time and one cursor. Click or drag: move the cursor; Shift and drag: move the
//! time window; wheel: zoom about the pointer; double click: the whole grasp.

mod derived;
mod labels;

use crate::app::actions::Actions;
use crate::app::context::PanelContext;
use crate::app::derived::Derivation;
use crate::app::features::files::FileAction;
use crate::app::features::inspect::{ComparedTrace, InspectAction};
use crate::app::features::view::ViewAction;
use crate::app::playback::Seek;
use crate::app::theme::{colour, veil};
use crate::app::traces::GraspTrace;
use crate::app::view_source::ViewSource;
use egui::{Color32, Ui};
use egui_plot::{
    AxisHints, FilledArea, GridInput, GridMark, Line, LineStyle, Plot, PlotPoint, PlotPoints, PlotTransform, Span,
    Text, VLine,
};
use labels::CurveLabel;
use palpate_geometry::palette::{Rgb, Theme, Trace, series_colour};
use palpate_geometry::units::three_digits;
use palpate_lab::inspection::{FigureOptions, TouchPhase};
use palpate_sim::objects::object_title;
use palpate_tactile::trial::TrialSource;

/// Value of one row of a trace; `None` where it is undefined.
pub(super) type TraceValue = Box<dyn Fn(&GraspTrace, usize) -> Option<f64>>;

/// One curve of a plot.
pub(super) struct PlotCurve {
    /// Name beside the plot.
    pub(super) name: String,
    /// Its colour.
    pub(super) trace: Trace,
    /// Dashed for the right finger.
    pub(super) dashed: bool,
    /// Its values.
    pub(super) values: TraceValue,
    /// Half the width of its error band, in the same unit; `None` without one.
    pub(super) half_width: TraceValue,
    /// Name of its channel in files, and the factor from the channel's unit; `None` for curves that are no channel.
    pub(super) channel: Option<(String, f64)>,
}

/// Plot of curves over time.
pub(super) struct TimePlot<'a> {
    /// Name for egui and for screen readers.
    pub(super) id: &'a str,
    /// Unit of the values, shown at the axis.
    pub(super) unit: &'a str,
    /// Curves.
    pub(super) curves: Vec<PlotCurve>,
    /// Least range of values, so that noise does not fill a plot.
    pub(super) least: [f64; 2],
}

/// Opacity of the grasps before the current one.
const EARLIER: f32 = 0.28;
/// Opacity of an error band.
const BAND: f32 = 0.3;
/// Shortest time that can be shown (s).
const NARROWEST: f64 = 0.05;

pub(super) fn show(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Actions, plot: TimePlot<'_>) {
    let span = context.shown().time_span();
    // A time window of a longer trial may show nothing of this one.
    let fits = |[from, to]: &[f64; 2]| *from >= span[0] && to - from >= 0.5 * NARROWEST && *to <= span[1] + 1e-9;
    let [from, to] = context.view.time_window.filter(fits).unwrap_or(span);
    let theme = context.view.theme;
    let derived = context.view.derived.get(plot.id).copied().unwrap_or_default();
    if ui.available_height() > ROOM_FOR_HEADER && ui.available_width() > ROOM_FOR_LABELS {
        let channels = plot.curves.iter().filter_map(|curve| Some(curve.channel.as_ref()?.0.as_str()));
        let plotted: Vec<&str> = channels.collect();
        header_ui(ui, context, actions, (plot.id, &plotted), derived);
    }
    let unit = derived.unit(plot.unit);
    let least = if derived == Derivation::Values { plot.least } else { [0.0, 0.0] };
    let plot = TimePlot { curves: derived::derive(derived, plot.curves), unit: &unit, least, ..plot };
    let [low, high] = value_range(context, &plot, [from, to]);
    let labelled = ui.available_width() > ROOM_FOR_LABELS;
    let width = ui.available_width() - if labelled { labels::WIDTH } else { 0.0 };
    let seconds = AxisHints::new_x()
        .formatter(|mark: GridMark, shown| seconds_at(mark.value, shown))
        .label_spacing(egui::Rangef::new(24.0, 40.0));
    let widget = Plot::new(plot.id)
        .width(width)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .allow_axis_zoom_drag(false)
        .show_background(false)
        .show_x(false)
        .show_y(false)
        .y_axis_min_width(44.0)
        .y_axis_label(unit.clone())
        .grid_color(colour(theme.colours().border))
        .grid_spacing(10.0..=44.0)
        .y_grid_spacer(|grid: GridInput| value_marks(grid.bounds.0, grid.bounds.1))
        .custom_x_axes(vec![seconds])
        .y_axis_formatter(|mark: GridMark, _| plain(mark.value))
        .set_margin_fraction(egui::Vec2::ZERO);
    let gaps = gaps(context);
    let response = widget.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(from..=to);
        plot_ui.set_plot_bounds_y(low..=high);
        add_phases(plot_ui, context, [from, to], high - 0.04 * (high - low));
        add_gaps(plot_ui, &gaps, theme);
        for trace in context.traces.earlier() {
            add_curves(plot_ui, trace, &plot, |c| veil(c.trace.colour(theme), EARLIER), 1.0);
        }
        if context.view.class_bands {
            add_class_bands(plot_ui, context, &plot);
        }
        for compared in context.comparison.traces {
            let ink = series_colour(compared.colour, theme);
            add_spread(plot_ui, compared, &plot, ink);
            add_curves(plot_ui, &compared.trace, &plot, |_| colour(ink), 1.3);
        }
        if let Some(trace) = context.traces.current() {
            add_bands(plot_ui, trace, &plot, theme);
            add_curves(plot_ui, trace, &plot, |c| own_ink(context, c), 1.8);
        }
        add_cursor(plot_ui, context);
        let bounds = plot_ui.plot_bounds();
        TimeDrag {
            pointer: plot_ui.pointer_coordinate().map(|p: PlotPoint| p.x),
            dragged: f64::from(plot_ui.pointer_coordinate_drag_delta().x),
            width: bounds.width(),
        }
    });
    let shade = veil(theme.colours().error, 0.55);
    gaps.iter().for_each(|gap| hatch(ui, &response.transform, *gap, shade));
    if labelled {
        let frame = *response.transform.frame();
        labels::draw(ui, frame, theme.colours().quiet_text, curve_labels(context, &plot, &response.transform));
    }
    if let Some(why) = nothing_read(context, &plot) {
        let ink = colour(theme.colours().quiet_text);
        let room = response.response.rect.width() - 60.0;
        let galley = ui.painter().layout(why.to_owned(), egui::FontId::proportional(13.0), ink, room.max(60.0));
        ui.painter().galley(response.response.rect.center() - 0.5 * galley.size(), galley, ink);
    }
    response
        .response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Figure, true, format!("{} over time", plot.id)));
    if let Some(t) = sought(ui, &response.response, &response.inner) {
        actions.push(InspectAction::Seek(Seek::To(t)));
    }
    if let Some(window) = moved_window(ui, &response.response, &response.inner, [from, to], span) {
        actions.push(ViewAction::SetTimeWindow(window));
    }
}

/// Height from which on a plot has a line of choices above it, and width from which on it has names beside it (points).
const ROOM_FOR_HEADER: f32 = 120.0;
const ROOM_FOR_LABELS: f32 = 380.0;

/// Choice of derived curves, and the times of cursor and marks.
fn header_ui(
    ui: &mut Ui,
    context: &PanelContext<'_>,
    actions: &mut Actions,
    (id, plotted): (&str, &[&str]),
    derived: Derivation,
) {
    ui.horizontal(|ui| {
        let combo = egui::ComboBox::from_id_salt((id, "derived")).width(96.0);
        let shown = combo.selected_text(egui::RichText::new(derived.name()).small()).show_ui(ui, |ui| {
            for choice in Derivation::ALL {
                if ui.selectable_label(choice == derived, choice.name()).clicked() {
                    actions.push(ViewAction::Derive(id.to_owned(), choice));
                }
            }
        });
        shown.response.on_hover_text("Values, sum or difference of both fingers, or change over time");
        if context.shown().board().is_some() && id != "counts" && id != "line pressure" {
            let mut raw = context.view.raw;
            if ui.checkbox(&mut raw, egui::RichText::new("raw counts").small()).changed() {
                actions.push(ViewAction::ShowRaw(raw));
            }
        }
        if let Some([first, second]) = plotted.first().and_then(|name| context.bands_for(name)) {
            let mut shown = context.view.class_bands;
            let text = egui::RichText::new("likeliest classes").small();
            let hint = format!(
                "Mean and spread of the two likeliest classes behind the curves: {} blue, {} orange",
                object_title(&first.class),
                object_title(&second.class)
            );
            if ui.checkbox(&mut shown, text).on_hover_text(hint).changed() {
                actions.push(ViewAction::ShowClassBands(shown));
            }
        }
        if context.source == ViewSource::Trial {
            let hint = "Export this plot as SVG or PNG, with the trials compared and a caption (Ctrl+E: all plots)";
            if ui.small_button("Export").on_hover_text(hint).clicked() {
                let channel = if id == "line pressure" { "line" } else { id };
                let raw = id == "counts" || context.view.raw;
                let channels = if raw { Vec::new() } else { vec![channel.to_owned()] };
                actions.push(FileAction::ExportFigure(FigureOptions { channels, raw, ..FigureOptions::default() }));
            }
        }
        let playback = context.playback;
        let time = |name: &str, t: f64| format!("{name} {t:.3} s");
        let mut times: Vec<String> = Vec::new();
        if let [Some(a), Some(b)] = playback.marks {
            times.push(time("B − A", b - a));
        }
        times.extend(playback.marks.iter().zip(["A", "B"]).rev().filter_map(|(t, name)| Some(time(name, (*t)?))));
        times.extend(playback.cursor_s.map(|t| time("cursor", t)));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            times.into_iter().for_each(|time| {
                ui.label(egui::RichText::new(time).small());
            });
        });
    });
}

/// Colour of a curve of the grasp shown: that of its sensor, or the text colour where trials are compared.
fn own_ink(context: &PanelContext<'_>, curve: &PlotCurve) -> Color32 {
    let theme = context.view.theme;
    colour(if context.comparison.traces.is_empty() { curve.trace.colour(theme) } else { theme.colours().text })
}

/// Names of all curves, with their values at the cursor.
fn curve_labels(context: &PanelContext<'_>, plot: &TimePlot<'_>, transform: &PlotTransform) -> Vec<CurveLabel> {
    let theme = context.view.theme;
    let Some(now) = context.shown().time_s() else { return Vec::new() };
    let marks = context.playback.marks;
    let label = |trace: &GraspTrace, curve: &PlotCurve, ink: Color32| {
        let at = |t: f64| (curve.values)(trace, trace.sample_at(t)?).filter(|value| value.is_finite());
        let value = at(now);
        let difference = marks[0].and_then(at).zip(marks[1].and_then(at)).map(|(a, b)| b - a);
        let y = value.map(|value| transform.position_from_point(&PlotPoint::new(now, value)).y);
        CurveLabel { name: curve.name.clone(), ink, value, difference, y }
    };
    let own = context.traces.current().into_iter();
    let own = own.flat_map(|trace| plot.curves.iter().map(move |curve| (trace, curve)));
    let own = own.map(|(trace, curve)| label(trace, curve, own_ink(context, curve)));
    let others = context.comparison.traces.iter().flat_map(|compared| plot.curves.iter().map(move |c| (compared, c)));
    let others =
        others.map(|(compared, curve)| label(&compared.trace, curve, colour(series_colour(compared.colour, theme))));
    own.chain(others).collect()
}

/// Text where a connected gripper gives no curve to draw.
fn nothing_read(context: &PanelContext<'_>, plot: &TimePlot<'_>) -> Option<&'static str> {
    let real = match context.source {
        ViewSource::Simulation => false,
        ViewSource::Gripper => true,
        ViewSource::Trial => context.inspected.is_some_and(|own| own.trial.source == TrialSource::Recorded),
    };
    let trace = context.traces.current().filter(|_| real)?;
    let number = |k: usize| plot.curves.iter().any(|c| (c.values)(trace, k).is_some_and(f64::is_finite));
    let nothing = trace.t.len() > 5 && !(0..trace.t.len()).any(number);
    nothing.then_some(if plot.id == "line pressure" {
        "The board does not report line pressure."
    } else {
        "Sensors not calibrated: see the Calibration panel in Label mode. Raw counts: Counts panel."
    })
}

/// Time that the mouse asks for: a click, or a drag without Shift.
fn sought(ui: &Ui, response: &egui::Response, drag: &TimeDrag) -> Option<f64> {
    let dragged = response.dragged_by(egui::PointerButton::Primary) && !ui.input(|input| input.modifiers.shift);
    drag.pointer.filter(|_| response.clicked() || dragged)
}

struct TimeDrag {
    pointer: Option<f64>,
    dragged: f64,
    width: f64,
}

/// New time window, where the mouse changes it.
fn moved_window(
    ui: &Ui,
    response: &egui::Response,
    drag: &TimeDrag,
    [from, to]: [f64; 2],
    [first, last]: [f64; 2],
) -> Option<Option<[f64; 2]>> {
    if response.double_clicked() {
        return Some(None);
    }
    let shifted = |by: f64| {
        let by = by.clamp(first - from, (last - to).max(first - from));
        Some(Some([from + by, to + by]))
    };
    let shift = ui.input(|input| input.modifiers.shift);
    let panned = response.dragged() && (shift || !response.dragged_by(egui::PointerButton::Primary));
    if panned && drag.dragged != 0.0 {
        return shifted(-drag.dragged);
    }
    let wheel = ui.input(|i| i.smooth_scroll_delta().y);
    if response.hovered() && wheel != 0.0 {
        let about = drag.pointer?.clamp(from, to);
        let factor = (-f64::from(wheel) * 0.004).exp().max(NARROWEST / drag.width);
        let start = (about - (about - from) * factor).clamp(first, (last - NARROWEST).max(first));
        let end = (about + (to - about) * factor).clamp(start + NARROWEST, (start + NARROWEST).max(last));
        let whole = start <= first && end >= last;
        return Some((!whole).then_some([start, end]));
    }
    None
}

/// Time at the axis; empty near its end, where it would be cut off.
fn seconds_at(value: f64, shown: &std::ops::RangeInclusive<f64>) -> String {
    let left = (shown.end() - value) / (shown.end() - shown.start());
    if left < 0.02 { String::new() } else { format!("{}\u{2009}s", plain(value)) }
}

/// Plot without interaction, its axes as wide as those of the others.
pub(super) fn static_plot(
    theme: Theme,
    id: &str,
    height: f32,
    y_label: &str,
    below: AxisHints<'static>,
    air_beside: f32,
) -> Plot<'static> {
    Plot::new(id.to_owned())
        .height(height)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .show_background(false)
        .grid_color(colour(theme.colours().border))
        .grid_spacing(10.0..=44.0)
        .y_axis_min_width(44.0)
        .y_axis_label(y_label.to_owned())
        .y_grid_spacer(|grid: GridInput| value_marks(grid.bounds.0, grid.bounds.1))
        .y_axis_formatter(|mark: GridMark, _| plain(mark.value))
        .custom_x_axes(vec![below.label_spacing(egui::Rangef::new(24.0, 40.0))])
        .set_margin_fraction(egui::vec2(air_beside, 0.12))
}

/// Number at an axis, without trailing zeros.
fn plain(value: f64) -> String {
    let text = three_digits(value);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Shades the hold, and names the phases.
fn add_phases(plot_ui: &mut egui_plot::PlotUi<'_>, context: &PanelContext<'_>, [from, to]: [f64; 2], height: f64) {
    let quiet = context.view.theme.colours().quiet_text;
    let width = f64::from(plot_ui.response().rect.width());
    for span in context.phases {
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
fn add_cursor(plot_ui: &mut egui_plot::PlotUi<'_>, context: &PanelContext<'_>) {
    let colours = context.view.theme.colours();
    let line = |t: f64, ink: Color32, width: f32| VLine::new("", t).color(ink).width(width).allow_hover(false);
    for mark in context.playback.marks.into_iter().flatten() {
        plot_ui.vline(line(mark, colour(colours.warning), 1.0));
    }
    match (context.playback.cursor_s, context.shown().time_s()) {
        (Some(t), _) => plot_ui.vline(line(t, colour(colours.accent), 1.5)),
        (None, Some(now)) => plot_ui.vline(line(now, veil(colours.quiet_text, 0.5), 1.0)),
        (None, None) => {}
    }
}

/// Shades one standard deviation about the mean of a class.
fn add_spread(plot_ui: &mut egui_plot::PlotUi<'_>, compared: &ComparedTrace, plot: &TimePlot<'_>, ink: Rgb) {
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
fn add_class_bands(plot_ui: &mut egui_plot::PlotUi<'_>, context: &PanelContext<'_>, plot: &TimePlot<'_>) {
    let colours = context.view.theme.colours();
    for (name, factor) in plot.curves.iter().filter_map(|curve| curve.channel.as_ref()) {
        let Some(bands) = context.bands_for(name) else { continue };
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
fn gaps(context: &PanelContext<'_>) -> Vec<[f64; 2]> {
    context.traces.current().map(GraspTrace::gaps).unwrap_or_default()
}

/// Distance between the strokes of a hatching (points).
const STROKES: f32 = 7.0;

/// Narrower gaps are not hatched (points).
const NARROW: f32 = 3.0;

/// Hatches a time without readings.
fn hatch(ui: &Ui, transform: &PlotTransform, [from, to]: [f64; 2], shade: Color32) {
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
fn add_gaps(plot_ui: &mut egui_plot::PlotUi<'_>, gaps: &[[f64; 2]], theme: Theme) {
    let error = theme.colours().error;
    for [from, to] in gaps {
        let span = Span::new("", *from..=*to).fill(veil(error, 0.16));
        plot_ui.add(span.border_width(1.0).border_color(veil(error, 0.5)));
    }
}

fn add_curves(
    plot_ui: &mut egui_plot::PlotUi<'_>,
    trace: &GraspTrace,
    plot: &TimePlot<'_>,
    shade: impl Fn(&PlotCurve) -> Color32,
    width: f32,
) {
    for curve in &plot.curves {
        let style = if curve.dashed { LineStyle::Dashed { length: 7.0 } } else { LineStyle::Solid };
        for points in runs(trace, curve) {
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

/// Parts of a curve where it is defined, as points of time (s) and value. Nothing is drawn between them: some line styles
/// break off at a point that is not a number, others forbid it.
fn runs(trace: &GraspTrace, curve: &PlotCurve) -> Vec<Vec<[f64; 2]>> {
    let mut runs = vec![Vec::new()];
    for (k, t) in trace.t.iter().enumerate() {
        match ((curve.values)(trace, k).filter(|value| value.is_finite()), runs.last_mut()) {
            (Some(value), Some(run)) => run.push([*t, value]),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// Shades the error band about each curve.
fn add_bands(plot_ui: &mut egui_plot::PlotUi<'_>, trace: &GraspTrace, plot: &TimePlot<'_>, theme: Theme) {
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

/// Range of the curves within the time shown, with a margin, and at least the plot's least range.
fn value_range(context: &PanelContext<'_>, plot: &TimePlot<'_>, [from, to]: [f64; 2]) -> [f64; 2] {
    let [mut low, mut high] = plot.least;
    let compared = context.comparison.traces.iter().map(|compared| &compared.trace);
    for trace in context.traces.earlier().chain(context.traces.current()).chain(compared) {
        for (k, _) in trace.t.iter().enumerate().filter(|(_, t)| (from..=to).contains(*t)) {
            for value in plot.curves.iter().filter_map(|c| (c.values)(trace, k)).filter(|v| v.is_finite()) {
                low = low.min(value);
                high = high.max(value);
            }
        }
    }
    // The word "hold" has a place of its own above the curves.
    let air = 0.06 * (high - low);
    [low - air, high + 3.5 * air]
}

/// About four marks at round values.
fn value_marks(low: f64, high: f64) -> Vec<GridMark> {
    let rough = (high - low) / 4.0;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|s| s * decade).into_iter().find(|s| *s >= rough).unwrap_or(10.0 * decade);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    // A step of a whole range makes all marks equally strong.
    (first..=last).map(|k| GridMark { value: k as f64 * step, step_size: high - low }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(runs(&trace, &curve), [vec![[1.0, 1.0], [2.0, 2.0]], vec![[5.0, 3.0]]]);
    }

    #[test]
    fn marks_are_few_and_round() {
        for (low, high, want) in [
            (-0.5, 9.0, vec![0.0, 5.0]),
            (-1.3, 23.0, vec![0.0, 10.0, 20.0]),
            (0.0, 0.4, vec![0.0, 0.1, 0.2, 0.3, 0.4]),
        ] {
            let marks: Vec<f64> = value_marks(low, high).iter().map(|m| m.value).collect();
            assert!(
                marks.len() == want.len() && marks.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-9),
                "{marks:?}"
            );
        }
        assert!(value_marks(1.0, 1.0).is_empty());
        assert!(value_marks(f64::NAN, 1.0).is_empty());
    }
}
