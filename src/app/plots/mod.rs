//! Plots of traces over time. All show the same time and one cursor. Click or drag: move the cursor; Shift and drag: move the
//! time window; wheel: zoom about the pointer; double click: the whole grasp.

mod axes;
mod channels;
mod derived;
mod header;
mod labels;
mod layers;
mod mouse;

pub(super) use axes::{static_plot, value_marks};
use channels::COUNTS;
pub(super) use channels::{channel_curves, colour_of, shows};

use crate::app::actions::Actions;
use crate::app::features::view::{Derivation, ViewSource};
use crate::app::playback::Seek;
use crate::app::shown::DisplayedData;
use crate::app::theme::{colour, veil};
use crate::app::traces::GraspTrace;
use crate::app::widgets::PAST;
use egui::{Color32, Ui};
use egui_plot::{AxisHints, GridInput, GridMark, Plot, PlotPoint, PlotTransform};
use labels::CurveLabel;
use palpate_geometry::palette::{SHOWN_SERIES, Trace, series_colour};
use palpate_geometry::units;
use palpate_lab::workers::GripperView;
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
    pub(super) curves: Vec<PlotCurve>,
    /// Least range of values, so that noise does not fill a plot; its ends are swapped where there is none.
    pub(super) least: [f64; 2],
}

/// Opacity of the grasps before the current one.
const EARLIER: f32 = 0.28;
/// Least size of a plot (points); the usual one is cut in low windows.
const LEAST_PLOT: egui::Vec2 = egui::vec2(64.0, 32.0);
/// Width of the axis of values, and of that of counts (points).
const Y_AXIS: f32 = 44.0;
const WIDE_Y_AXIS: f32 = 56.0;
/// Shortest time that can be shown (s).
const NARROWEST: f64 = 0.05;

pub(super) fn show(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions, plot: TimePlot<'_>) {
    let span = data.time_span();
    // A time window of a longer trial may show nothing of this one.
    let fits = |[from, to]: &[f64; 2]| *from >= span[0] && to - from >= 0.5 * NARROWEST && *to <= span[1] + 1e-9;
    let [from, to] = data.view.time_window.filter(fits).unwrap_or(span);
    let theme = data.view.theme;
    let derived = data.view.derived.get(plot.id).copied().unwrap_or_default();
    let uncalibrated = plot.unit == COUNTS && plot.id != COUNTS && !data.view.raw;
    let has_header = ui.available_height() > ROOM_FOR_HEADER && ui.available_width() > ROOM_FOR_LABELS;
    if has_header {
        let channels = plot.curves.iter().filter_map(|curve| Some(curve.channel.as_ref()?.0.as_str()));
        let plotted: Vec<&str> = channels.collect();
        header::ui(ui, data, actions, (plot.id, &plotted), (derived, uncalibrated));
    }
    let unit = derived.unit(plot.unit);
    let least = if derived == Derivation::Values { plot.least } else { [0.0, 0.0] };
    let plot = TimePlot { curves: derived::derive(derived, plot.curves), unit: &unit, least, ..plot };
    let [low, high] = value_range(data, &plot, [from, to], ui.available_height());
    let labelled = ui.available_width() > ROOM_FOR_LABELS;
    let width = ui.available_width() - if labelled { labels::WIDTH } else { 0.0 };
    // Counts have four digits; all plots of a board are in line.
    let axis = if data.board().is_some() { WIDE_Y_AXIS } else { Y_AXIS };
    let (plotted, plotted_height) = (f64::from(width - axis), f64::from(ui.available_height() - TIMES));
    let seconds = AxisHints::new_x()
        .formatter(|mark: GridMark, shown| axes::seconds_at(mark, shown))
        .label_spacing(egui::Rangef::new(24.0, 40.0));
    let widget = Plot::new(plot.id)
        .width(width)
        .min_size(LEAST_PLOT)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .allow_axis_zoom_drag(false)
        .show_background(false)
        .show_x(false)
        .show_y(false)
        .y_axis_min_width(axis)
        .y_axis_label(units::symbol(&unit))
        .grid_color(colour(theme.colours().border))
        .grid_spacing(10.0..=44.0)
        .x_grid_spacer(move |grid: GridInput| axes::time_marks(grid.bounds.0, grid.bounds.1, plotted))
        .y_grid_spacer(move |grid: GridInput| axes::value_marks(grid.bounds.0, grid.bounds.1, plotted_height))
        .custom_x_axes(vec![seconds])
        .y_axis_formatter(move |mark: GridMark, shown| axes::value_at(mark, shown, plotted_height))
        .set_margin_fraction(egui::Vec2::ZERO);
    let nothing = nothing_read(data, &plot);
    // No sentence across grid lines.
    let widget = widget.show_grid(nothing.is_none()).show_axes(nothing.is_none());
    let gaps = layers::gaps(data);
    let response = widget.show(ui, |plot_ui| {
        plot_ui.set_plot_bounds_x(from..=to);
        plot_ui.set_plot_bounds_y(low..=high);
        layers::add_phases(plot_ui, data, [from, to], high - 0.04 * (high - low));
        layers::add_gaps(plot_ui, &gaps, theme);
        let closing_s = data.traces.current().map_or(0.0, |trace| trace.closing_s);
        for trace in data.traces.earlier() {
            // Closing begins at the same place.
            let by_s = closing_s - trace.closing_s;
            layers::add_curves(plot_ui, trace, by_s, &plot, |c| veil(c.trace.colour(theme), EARLIER), 1.0);
        }
        if data.view.class_bands {
            layers::add_class_bands(plot_ui, data, &plot);
        }
        for compared in data.comparison.traces {
            let ink = series_colour(compared.colour, theme);
            layers::add_spread(plot_ui, compared, &plot, ink);
            layers::add_curves(plot_ui, &compared.trace, 0.0, &plot, |_| colour(ink), 1.3);
        }
        if let Some(trace) = data.traces.current() {
            layers::add_bands(plot_ui, trace, &plot, theme);
            layers::add_curves(plot_ui, trace, 0.0, &plot, |c| own_ink(data, c), 1.8);
        }
        if nothing.is_none() {
            layers::add_cursor(plot_ui, data);
        }
        let bounds = plot_ui.plot_bounds();
        mouse::TimeDrag {
            pointer: plot_ui.pointer_coordinate().map(|p: PlotPoint| p.x),
            dragged: f64::from(plot_ui.pointer_coordinate_drag_delta().x),
            width: bounds.width(),
        }
    });
    let shade = veil(theme.colours().error, 0.55);
    gaps.iter().for_each(|gap| layers::hatch(ui, &response.transform, *gap, shade));
    if labelled {
        let mut frame = *response.transform.frame();
        let quiet = theme.colours().quiet_text;
        // Below the names, from the bottom up.
        let mut note = |text: &str, ink: Color32| {
            let (font, corner) = (egui::FontId::proportional(11.0), frame.right_bottom() + egui::vec2(6.0, 0.0));
            ui.painter().text(corner, egui::Align2::LEFT_BOTTOM, text, font, ink);
            frame.max.y -= labels::LINE;
        };
        if uncalibrated && !has_header {
            note("not calibrated", ui.visuals().warn_fg_color);
        }
        let has_room = response.transform.frame().height() >= ROOM_FOR_EARLIER;
        if data.traces.earlier().next().is_some() && has_room {
            note("faint: earlier grasps", veil(quiet, 0.8));
        }
        if let Some(trial) = data.recorded().filter(|_| has_room) {
            note(&format!("as recorded: trial {trial}"), veil(quiet, 0.8));
        }
        let labels = curve_labels(data, &plot, &response.transform);
        if data.comparison.traces.is_empty() {
            labels::draw(ui, frame, quiet, labels);
        } else {
            labels::draw_table(ui, frame, quiet, (&names_of_trials(data), &labels));
        }
    }
    if let Some(why) = nothing {
        let rect = response.response.rect;
        let ink = colour(theme.colours().quiet_text);
        let galley =
            ui.painter().layout(why.to_owned(), egui::FontId::proportional(13.0), ink, (rect.width() - 60.0).max(60.0));
        let corner = rect.center() - 0.5 * galley.size();
        let ground = egui::Rect::from_min_size(corner, galley.size()).expand(6.0);
        ui.painter().rect_filled(ground, 3.0, ui.visuals().panel_fill);
        ui.painter().galley(corner, galley, ink);
    }
    response
        .response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Figure, true, format!("{} over time", plot.id)));
    if let Some(t) = mouse::sought(ui, &response.response, &response.inner) {
        actions.push(move |app| app.seek(Seek::To(t)));
    }
    if let Some(window) = mouse::moved_window(ui, &response.response, &response.inner, [from, to], span) {
        actions.push(move |app| app.view.time_window = window);
    }
}

/// Height from which on a plot has a line of choices above it, and width from which on it has names beside it (points).
const ROOM_FOR_HEADER: f32 = 120.0;
const ROOM_FOR_LABELS: f32 = 380.0;
/// Height from which on faint curves are named (points).
const ROOM_FOR_EARLIER: f32 = 84.0;

/// Colour of a curve of the grasp shown: that of its sensor, or the text colour where trials are compared.
fn own_ink(data: &DisplayedData<'_>, curve: &PlotCurve) -> Color32 {
    let theme = data.view.theme;
    let alone = data.comparison.traces.is_empty();
    colour(if alone { curve.trace.colour(theme) } else { series_colour(SHOWN_SERIES, theme) })
}

/// Names of all curves, with their values at the cursor.
fn curve_labels<'a>(data: &DisplayedData<'_>, plot: &TimePlot<'a>, transform: &PlotTransform) -> Vec<CurveLabel<'a>> {
    let theme = data.view.theme;
    let Some(now) = data.time_s() else { return Vec::new() };
    let marks = data.playback.marks;
    let label = |trace: &GraspTrace, curve: &PlotCurve, ink: Color32| {
        let at = |t: f64| (curve.values)(trace, trace.sample_at(t)?).filter(|value| value.is_finite());
        let value = at(now);
        let difference = marks[0].and_then(at).zip(marks[1].and_then(at)).map(|(a, b)| b - a);
        let y = value.map(|value| transform.position_from_point(&PlotPoint::new(now, value)).y);
        CurveLabel { name: curve.name.clone(), ink, dashed: curve.dashed, unit: plot.unit, value, difference, y }
    };
    let own = data.traces.current().into_iter();
    let own = own.flat_map(|trace| plot.curves.iter().map(move |curve| (trace, curve)));
    // Values of a board that is silent are of the past.
    let past = data.source == ViewSource::Gripper && data.gripper.is_some_and(GripperView::is_silent);
    let ink = |curve: &PlotCurve| own_ink(data, curve).gamma_multiply(if past { PAST } else { 1.0 });
    let own = own.map(|(trace, curve)| label(trace, curve, ink(curve)));
    let others = data.comparison.traces.iter().flat_map(|compared| plot.curves.iter().map(move |c| (compared, c)));
    let others =
        others.map(|(compared, curve)| label(&compared.trace, curve, colour(series_colour(compared.colour, theme))));
    own.chain(others).collect()
}

/// Names of the trial shown and of those compared, in the order of their curves.
fn names_of_trials(data: &DisplayedData<'_>) -> Vec<String> {
    let own = match data.shown_trial() {
        Some(own) => own.trial.id.to_string(),
        None => "live".to_owned(),
    };
    let own = data.traces.current().map(|_| own);
    own.into_iter().chain(data.comparison.traces.iter().map(|compared| compared.short.clone())).collect()
}

/// Text where a connected gripper gives no curve to draw.
fn nothing_read(data: &DisplayedData<'_>, plot: &TimePlot<'_>) -> Option<&'static str> {
    let real = match data.source {
        ViewSource::Simulation => false,
        ViewSource::Gripper => true,
        ViewSource::Trial => data.inspected.is_some_and(|own| own.trial.source == TrialSource::Recorded),
    };
    let trace = data.traces.current().filter(|_| real)?;
    if plot.curves.is_empty() {
        return Some("The gripper has no such sensors; those that it has may be in the panel Other channels.");
    }
    channels::is_empty(trace, &plot.curves).then_some(if plot.id == "line pressure" {
        "The board does not report line pressure."
    } else {
        "The board sends no numbers of these sensors."
    })
}

/// Heights of the names of phases, and of the marks of time below a plot (points).
const NAMES: f32 = 17.0;
const TIMES: f32 = 20.0;
/// Least share of the height that names have.
const LEAST_SHARE: f32 = 0.165;

/// Least range of raw counts, so that noise does not fill a plot.
const LEAST_COUNTS: f64 = 100.0;

/// Range of the curves within the time shown, with a margin, and at least the plot's least range; in a plot so high (points).
fn value_range(data: &DisplayedData<'_>, plot: &TimePlot<'_>, [from, to]: [f64; 2], height: f32) -> [f64; 2] {
    // Counts have no natural zero.
    let [mut low, mut high] = if plot.unit == COUNTS { [f64::INFINITY, f64::NEG_INFINITY] } else { plot.least };
    let compared = data.comparison.traces.iter().map(|compared| &compared.trace);
    for trace in data.traces.earlier().chain(data.traces.current()).chain(compared) {
        for (k, _) in trace.t.iter().enumerate().filter(|(_, t)| (from..=to).contains(*t)) {
            for value in plot.curves.iter().filter_map(|c| (c.values)(trace, k)).filter(|v| v.is_finite()) {
                low = low.min(value);
                high = high.max(value);
            }
        }
    }
    if plot.unit == COUNTS && high - low < LEAST_COUNTS {
        [low, high] = [0.5 * (low + high - LEAST_COUNTS), 0.5 * (low + high + LEAST_COUNTS)];
    }
    if low >= high {
        [low, high] = if low.is_finite() { [low - 0.5, high + 0.5] } else { [0.0, 1.0] };
    }
    let air = 0.06 * (high - low);
    // The word "hold" has a place of its own above the curves.
    let share = f64::from((NAMES / (height - TIMES).max(2.5 * NAMES)).max(LEAST_SHARE));
    [low - air, high + share / (1.0 - share) * (high - low + air)]
}
