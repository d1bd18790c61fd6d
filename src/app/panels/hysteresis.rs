//! Hysteresis: the load of each pad over the curvature of its finger; closing and releasing run on different paths where the
//! finger or the object gives way.

use crate::app::plots::{colour_of, shows, value_marks};
use crate::app::shown::DisplayedData;
use crate::app::theme::{colour, veil};
use crate::app::traces::GraspTrace;
use egui::{Color32, Ui};
use egui_plot::{GridInput, Line, LineStyle, Plot, PlotPoints, Points};
use palpate_geometry::palette::series_colour;
use palpate_geometry::units::symbol;
use palpate_sim::gripper::Side;
use palpate_tactile::{Channel, Quantity};

/// Columns of one finger: its curvature and its load.
struct Finger {
    side: Side,
    curvature: usize,
    load: usize,
    ink: Color32,
}

pub(super) fn ui(ui: &mut Ui, data: &DisplayedData<'_>) {
    let theme = data.view.theme;
    let channels = data.channels();
    let find = |quantity: Quantity, side: Side| {
        let wanted = |channel: &Channel| shows(quantity, channel) && channel.side() == Some(side);
        channels.iter().position(|channel| channel.is_some_and(wanted))
    };
    let finger = |side: Side| {
        let load = find(Quantity::Pressure, side)?;
        let ink = colour(colour_of(channels[load]?).colour(theme));
        Some(Finger { side, curvature: find(Quantity::Curvature, side)?, load, ink })
    };
    let fingers: Vec<Finger> = Side::BOTH.into_iter().filter_map(finger).collect();
    let Some(trace) = data.traces.current().filter(|_| !fingers.is_empty()) else {
        ui.weak("Pressure over curvature: nothing is shown yet that has both.");
        return;
    };
    ui.weak("Pressure over curvature. Left finger solid, right finger dashed; the dot is the cursor.");
    let now = data.sample();
    let room = f64::from(ui.available_height());
    Plot::new("hysteresis")
        .x_axis_label(format!("curvature ({})", symbol("1/m")))
        .y_axis_label("pressure (kPa)")
        .x_grid_spacer(move |grid: GridInput| value_marks(grid.bounds.0, grid.bounds.1, room))
        .y_grid_spacer(move |grid: GridInput| value_marks(grid.bounds.0, grid.bounds.1, room))
        .show_background(false)
        .allow_scroll(false)
        .show_x(false)
        .show_y(false)
        .grid_color(colour(theme.colours().border))
        .show(ui, |plot_ui| {
            for compared in data.comparison.traces {
                let ink = colour(series_colour(compared.colour, theme));
                for finger in &fingers {
                    add_loop(plot_ui, &compared.trace, finger, ink, 1.2);
                }
            }
            for finger in &fingers {
                let alone = data.comparison.traces.is_empty();
                let ink = if alone { finger.ink } else { colour(theme.colours().text) };
                add_loop(plot_ui, trace, finger, ink, 1.8);
                let Some(place) = now.and_then(|k| point(trace, finger, k)) else { continue };
                let filled = finger.side == Side::Left;
                let dot = Points::new("", vec![place]).radius(4.5).filled(filled).color(ink);
                plot_ui.points(dot.allow_hover(false));
            }
            plot_ui.hline(egui_plot::HLine::new("", 0.0).color(veil(theme.colours().quiet_text, 0.4)).width(1.0));
        });
}

/// Curvature (1/m) and pressure (kPa) of a sample; none where either is undefined.
fn point(trace: &GraspTrace, finger: &Finger, sample: usize) -> Option<[f64; 2]> {
    let value = |column: usize| trace.channels.get(column)?.get(sample).map(|value| f64::from(*value));
    let [x, y] = [value(finger.curvature)?, 1e-3 * value(finger.load)?];
    (x.is_finite() && y.is_finite()).then_some([x, y])
}

fn add_loop(plot_ui: &mut egui_plot::PlotUi<'_>, trace: &GraspTrace, finger: &Finger, ink: Color32, width: f32) {
    let points: Vec<[f64; 2]> = (0..trace.t.len()).filter_map(|k| point(trace, finger, k)).collect();
    let style = if finger.side == Side::Right { LineStyle::dashed_loose() } else { LineStyle::Solid };
    plot_ui.line(Line::new("", PlotPoints::from(points)).color(ink).width(width).style(style).allow_hover(false));
}
