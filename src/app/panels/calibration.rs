//! Calibrating the sensors of the real gripper, step by step: what to set next, the reading as it settles, the points with
//! the curve through them, and what is left between.

use super::{PanelContext, wrapped};
use crate::app::actions::Action;
use crate::app::plots::still;
use crate::app::theme::colour;
use egui::{Button, Grid, RichText, ScrollArea, TextEdit, Ui};
use egui_plot::{AxisHints, Line, Plot, PlotPoints, Points};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::three_digits;
use palpate_lab::workers::{CalibrationPlan, CalibrationView, CalibrationWish, GripperWish, RunningCalibration};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::{Calibration, Curve, Point, SensorKind};
use std::path::PathBuf;

pub(super) fn ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    let view = context.gripper.and_then(|gripper| gripper.calibration.as_deref());
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| match view {
        Some(CalibrationView { running: Some(running), .. }) => running_ui(ui, context, running, actions),
        Some(CalibrationView { running: None, ended }) => begin_ui(ui, context, ended.as_ref(), actions),
        None => begin_ui(ui, context, None, actions),
    });
}

/// What is typed before a calibration begins.
#[derive(Clone, Debug)]
struct Form {
    sensor: Sensor,
    part: String,
    port: String,
}

impl Default for Form {
    fn default() -> Self {
        Self { sensor: Sensor::FlexLeft, part: String::new(), port: String::new() }
    }
}

fn begin_ui(
    ui: &mut Ui,
    context: &PanelContext<'_>,
    ended: Option<&Result<String, String>>,
    actions: &mut Vec<Action>,
) {
    let id = egui::Id::unique("calibration form");
    let mut form = ui.data_mut(|data| data.get_temp::<Form>(id)).unwrap_or_default();
    match ended {
        Some(Ok(text)) => wrapped(ui, RichText::new(text).strong()),
        Some(Err(cause)) => wrapped(ui, RichText::new(cause).color(ui.visuals().error_fg_color)),
        None => {}
    }
    wrapped(
        ui,
        RichText::new("Readings of the real gripper become angles and forces by what its parts read at known ones.")
            .weak(),
    );
    ui.add_space(4.0);
    Grid::new("calibration form").num_columns(2).spacing([10.0, 5.0]).show(ui, |ui| {
        ui.label("Sensor");
        ui.vertical(|ui| {
            for pair in Sensor::ALL.chunks(2) {
                ui.horizontal(|ui| {
                    for sensor in pair {
                        ui.radio_value(&mut form.sensor, *sensor, sensor.label());
                    }
                });
            }
        });
        ui.end_row();
        let label = ui.label("Part");
        let hint = "its number, such as A7";
        ui.add(TextEdit::singleline(&mut form.part).hint_text(hint).char_limit(80)).labelled_by(label.id);
        ui.end_row();
        let label = ui.label("Port");
        match context.gripper.and_then(|gripper| gripper.link.as_ref()) {
            Some(link) => {
                ui.add(egui::Label::new(link.port.path.display().to_string()).truncate());
            }
            None => {
                ui.add(TextEdit::singleline(&mut form.port).hint_text("the only one there is")).labelled_by(label.id);
            }
        }
        ui.end_row();
    });
    let named = !form.part.trim().is_empty();
    let begin = ui.add_enabled(named, Button::new("Begin calibration"));
    if begin.on_disabled_hover_text("Calibrations belong to parts: give this one a name").clicked() {
        let port = Some(form.port.trim()).filter(|port| !port.is_empty()).map(PathBuf::from);
        let plan = CalibrationPlan { sensor: form.sensor, part: form.part.trim().to_owned(), port };
        actions.push(Action::Gripper(GripperWish::Calibrate(CalibrationWish::Begin(plan))));
    }
    ui.data_mut(|data| data.insert_temp(id, form));
}

fn running_ui(ui: &mut Ui, context: &PanelContext<'_>, running: &RunningCalibration, actions: &mut Vec<Action>) {
    wrapped(ui, RichText::new(format!("\"{}\", {}", running.plan.part, running.plan.sensor.label())).weak());
    wrapped(ui, RichText::new(&running.instruction).strong());
    let counts = running.latest.map_or_else(|| "–".to_owned(), |counts| format!("{counts:.0}"));
    let state = running.settled.as_ref().map_or_else(String::as_str, |_| "settled");
    wrapped(ui, RichText::new(format!("{counts} counts, {state}")));
    ui.horizontal_wrapped(|ui| buttons_ui(ui, running, actions));
    if let Some(why) = &running.not_taken {
        wrapped(ui, RichText::new(why).color(ui.visuals().warn_fg_color));
    }
    let kind = SensorKind::of(running.plan.sensor);
    let fit = running.fit.as_deref().ok();
    match &running.fit {
        Ok(calibration) => {
            wrapped(ui, RichText::new(calibration.summary()));
            for warning in &calibration.warnings {
                wrapped(ui, RichText::new(warning).color(ui.visuals().warn_fg_color));
            }
        }
        Err(why) => wrapped(ui, RichText::new(why).weak()),
    }
    let theme = context.view.theme;
    curve_plot(ui, kind, &running.points, fit, theme);
    if let Some(calibration) = fit {
        residual_plot(ui, kind, calibration, theme);
        bending_plot(ui, calibration, theme);
    }
}

fn buttons_ui(ui: &mut Ui, running: &RunningCalibration, actions: &mut Vec<Action>) {
    let mut button = |ready: bool, text: &str, about: &str, wish: Option<CalibrationWish>| {
        let clicked = ui.add_enabled(ready && wish.is_some(), Button::new(text)).on_hover_text(about).clicked();
        actions.extend(wish.filter(|_| clicked).map(|wish| Action::Gripper(GripperWish::Calibrate(wish))));
    };
    let take = running.next.map(CalibrationWish::Take);
    button(running.settled.is_ok(), "Take point", "Once the reading has settled", take);
    let free = !running.closing;
    button(free && running.next.is_some(), "Leave out", "Go on without this one", Some(CalibrationWish::Skip));
    button(
        running.closing || !running.points.is_empty(),
        "Take back",
        "Measure the last one again",
        Some(CalibrationWish::Undo),
    );
    if SensorKind::of(running.plan.sensor) == SensorKind::Pad {
        let about = "Watch the empty hand close for 15 s: how the pad's zero moves with bending";
        button(running.can_close, "Empty close", about, Some(CalibrationWish::EmptyClose));
    }
    button(free && running.fit.is_ok(), "Keep", "Store it; old trials are read by it too", Some(CalibrationWish::Keep));
    button(true, "Stop", "Forget it", Some(CalibrationWish::Stop));
}

/// What is read of a part, in the unit of the plot: kilohms of a strip, microsiemens of a pad.
fn shown(kind: SensorKind, ohm: f64) -> f64 {
    match kind {
        SensorKind::Flex => ohm * 1e-3,
        SensorKind::Pad => 1e6 / ohm,
    }
}

/// The points, and the curve through them.
fn curve_plot(ui: &mut Ui, kind: SensorKind, points: &[Point], fit: Option<&Calibration>, theme: Theme) {
    let Some(calibration) = fit else { return };
    let accent = colour(theme.colours().accent);
    let input = &calibration.record.input;
    let measured: PlotPoints<'_> =
        points.iter().map(|p| [kind.shown(p.stimulus), shown(kind, input.ohm(p.counts))]).collect();
    let most = points.iter().map(|point| point.stimulus).fold(0.0, f64::max);
    let along = |k: i32| most * f64::from(k) / 60.0;
    let line: PlotPoints<'_> = (0..=60)
        .map(|k| {
            let read = match &calibration.curve {
                Curve::Flex(curve) => shown(kind, curve.ohm(along(k))),
                Curve::Pad(curve) => 1e6 * (curve.siemens(along(k)) + curve.idle_siemens),
            };
            [kind.shown(along(k)), read]
        })
        .collect();
    let axis = if kind == SensorKind::Flex { "kΩ" } else { "µS" };
    plot(theme, "calibration curve", 140.0, axis, kind.unit()).show(ui, |plot| {
        plot.line(Line::new("fitted", line).color(accent).width(1.5));
        plot.points(Points::new("measured", measured).color(accent).radius(3.5));
    });
}

/// What is left between curve and points.
fn residual_plot(ui: &mut Ui, kind: SensorKind, calibration: &Calibration, theme: Theme) {
    let accent = colour(theme.colours().accent);
    let factor = if kind == SensorKind::Flex { 1f64.to_degrees() } else { 100.0 };
    let residuals = calibration.record.points.iter().zip(calibration.residuals());
    let off: Vec<[f64; 2]> = residuals.filter_map(|(p, off)| Some([kind.shown(p.stimulus), factor * off?])).collect();
    let worst = off.iter().map(|[_, off]| off.abs()).fold(0.0, f64::max);
    let unit = if kind == SensorKind::Flex { "degrees" } else { "%" };
    ui.weak(format!("off the curve, at most {} {unit}", three_digits(worst)));
    plot(theme, "calibration residuals", 90.0, unit, kind.unit()).include_y(-0.5).include_y(0.5).show(ui, |plot| {
        for [at, off] in &off {
            plot.line(Line::new("off", vec![[*at, 0.0], [*at, *off]]).color(accent).width(1.5));
        }
        plot.points(Points::new("off", off.clone()).color(accent).radius(3.0));
    });
}

/// What bending alone shows on a pad, as if it were a force.
fn bending_plot(ui: &mut Ui, calibration: &Calibration, theme: Theme) {
    let accent = colour(theme.colours().accent);
    let (Curve::Pad(curve), Some(bending)) = (&calibration.curve, &calibration.record.bending) else { return };
    let reaches = bending.reaches();
    ui.weak(format!("what bending alone shows, up to {} 1/m", three_digits(reaches)));
    let line: PlotPoints<'_> = (0..=60)
        .map(|k| {
            let kappa = reaches * f64::from(k) / 60.0;
            [kappa, bending.preload(curve, kappa)]
        })
        .collect();
    plot(theme, "bending zero", 90.0, "N", "1/m").include_y(0.0).include_y(0.1).show(ui, |plot| {
        plot.line(Line::new("load", line).color(accent).width(1.5));
    });
}

fn plot(theme: Theme, id: &str, height: f32, axis: &str, stimulus: &str) -> Plot<'static> {
    still(theme, id, height, axis, AxisHints::new_x().label(stimulus.to_owned()), 0.06)
}
