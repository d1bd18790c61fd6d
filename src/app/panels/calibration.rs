//! Calibration of the real gripper's sensors, step by step: instruction, reading, points with the fitted curve, residuals.

use crate::app::actions::Actions;
use crate::app::plots::static_plot;
use crate::app::theme::{self, colour};
use crate::app::widgets::{ANY_PORT, failure_ui, remark_ui, text_field, warning_ui, wrapped};
use egui::{Button, Grid, RichText, ScrollArea, Ui};
use egui_plot::{AxisHints, Line, Plot, PlotPoints, Points};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::{self, three_digits};
use palpate_lab::workers::{CalibrationCommand, CalibrationPlan, CalibrationSession, GripperCommand, GripperView};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::{Calibration, Curve, Record, SensorKind};
use std::path::PathBuf;

pub(super) fn ui(ui: &mut Ui, gripper: Option<&GripperView>, actions: &mut Actions) {
    let running = gripper.and_then(|gripper| Some((gripper, gripper.calibration.running.as_ref()?)));
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| match running {
        Some((gripper, session)) => running_ui(ui, gripper, session, actions),
        None => begin_ui(ui, gripper, actions),
    });
}

/// Form before a calibration.
#[derive(Clone, Debug)]
struct Form {
    sensor: Sensor,
    part: String,
    port: String,
}

impl Default for Form {
    fn default() -> Self {
        Self { sensor: Sensor::FLEX_LEFT, part: String::new(), port: String::new() }
    }
}

fn begin_ui(ui: &mut Ui, gripper: Option<&GripperView>, actions: &mut Actions) {
    let id = egui::Id::unique("calibration form");
    let mut form = ui.data_mut(|data| data.get_temp::<Form>(id)).unwrap_or_default();
    match gripper.and_then(|gripper| gripper.calibration.ended.as_ref()) {
        Some(Ok(text)) => wrapped(ui, RichText::new(text).strong()),
        Some(Err(cause)) => failure_ui(ui, cause),
        None => {}
    }
    remark_ui(
        ui,
        "Turns the counts of a sensor into angles or forces: you bend it to known angles, or press it with known forces.",
    );
    ui.add_space(4.0);
    Grid::new("calibration form").num_columns(2).spacing([10.0, 5.0]).show(ui, |ui| {
        ui.label("Sensor");
        ui.vertical(|ui| {
            let sensors = gripper.map(|gripper| gripper.sensors).unwrap_or_default();
            let sensors: Vec<Sensor> = sensors.iter().filter(|sensor| sensor.kind() != SensorKind::Raw).collect();
            if !sensors.contains(&form.sensor) {
                form.sensor = *sensors.first().unwrap_or(&form.sensor);
            }
            for pair in sensors.chunks(2) {
                ui.horizontal(|ui| {
                    for sensor in pair {
                        ui.radio_value(&mut form.sensor, *sensor, sensor.label());
                    }
                });
            }
        });
        ui.end_row();
        let label = ui.label("Part");
        let hint = "name or number, such as A7";
        ui.add(text_field(&mut form.part, id.with("part")).hint_text(hint).char_limit(80)).labelled_by(label.id);
        ui.end_row();
        let label = ui.label("Port");
        match gripper.and_then(|gripper| gripper.link.as_ref()) {
            Some(link) => {
                ui.add(egui::Label::new(link.port.path.display().to_string()).truncate());
            }
            None => {
                ui.add(text_field(&mut form.port, id.with("port")).hint_text(ANY_PORT)).labelled_by(label.id);
            }
        }
        ui.end_row();
    });
    let named = !form.part.trim().is_empty();
    let begin = ui.add_enabled(named, Button::new("Start calibration"));
    if begin.on_disabled_hover_text("Name the part: calibrations belong to parts").clicked() {
        let port = Some(form.port.trim()).filter(|port| !port.is_empty()).map(PathBuf::from);
        let plan = CalibrationPlan { sensor: form.sensor, part: form.part.trim().to_owned(), port };
        actions.push(|app| _ = app.gripper.send(GripperCommand::Calibrate(CalibrationCommand::Begin(plan))));
    }
    ui.data_mut(|data| data.insert_temp(id, form));
}

fn running_ui(ui: &mut Ui, gripper: &GripperView, session: &CalibrationSession, actions: &mut Actions) {
    let CalibrationPlan { sensor, part, .. } = session.plan();
    remark_ui(ui, format!("\"{part}\", {}", sensor.label()));
    let instruction = if session.is_begun() { session.instruction() } else { gripper.link_state() };
    wrapped(ui, RichText::new(instruction).strong());
    wrapped(ui, RichText::new(session.state()));
    let fit = session.procedure().fit();
    let calibration = fit.as_ref().ok();
    ui.horizontal_wrapped(|ui| buttons_ui(ui, session, calibration.is_some(), actions));
    if let Some(why) = session.not_taken() {
        warning_ui(ui, why);
    }
    match &fit {
        Ok(calibration) => {
            wrapped(ui, RichText::new(calibration.summary()));
            for warning in &calibration.warnings {
                warning_ui(ui, warning);
            }
        }
        Err(why) => remark_ui(ui, why.to_string()),
    }
    if let Some(calibration) = calibration {
        let (kind, theme) = (sensor.kind(), theme::of(ui));
        curve_plot(ui, kind, calibration, theme);
        residual_plot(ui, kind, calibration, theme);
        bending_plot(ui, calibration, theme);
    }
}

fn buttons_ui(ui: &mut Ui, session: &CalibrationSession, fits: bool, actions: &mut Actions) {
    let mut button = |ready: bool, text: &str, about: &str, command: CalibrationCommand| {
        actions.on(&ui.add_enabled(ready, Button::new(text)).on_hover_text(about), |app| {
            _ = app.gripper.send(GripperCommand::Calibrate(command));
        });
    };
    let (free, procedure) = (session.closing().is_none(), session.procedure());
    let next = procedure.next();
    let ready = free && next.is_some() && procedure.settled().is_ok();
    let take = CalibrationCommand::Take(next.unwrap_or_default());
    button(ready, "Take point", "Take the settled reading", take);
    button(free && next.is_some(), "Skip", "Leave this point out", CalibrationCommand::Skip);
    let has_points = !procedure.record().points.is_empty();
    button(!free || has_points, "Undo", "Measure the last point again", CalibrationCommand::Undo);
    if session.plan().sensor.kind() == SensorKind::Pad {
        let about = "Watch the empty hand close for 15 s, to correct the pad's zero for bending";
        button(free && fits, "Empty close", about, CalibrationCommand::EmptyClose);
    }
    let about = "Store the calibration; it applies to earlier trials too";
    button(free && fits, "Save", about, CalibrationCommand::Keep);
    button(true, "Cancel", "Discard the calibration", CalibrationCommand::Stop);
}

/// Reading of a part in the unit of the plot: kilohms of a strip, microsiemens of a pad.
fn shown(kind: SensorKind, ohm: f64) -> f64 {
    match kind {
        SensorKind::Pad => 1e6 / ohm,
        SensorKind::Flex | SensorKind::Raw => ohm * 1e-3,
    }
}

/// Points and fitted curve.
fn curve_plot(ui: &mut Ui, kind: SensorKind, calibration: &Calibration, theme: Theme) {
    let accent = colour(theme.colours().accent);
    let Record { input, points, .. } = &calibration.record;
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

/// Residuals of the points.
fn residual_plot(ui: &mut Ui, kind: SensorKind, calibration: &Calibration, theme: Theme) {
    let accent = colour(theme.colours().accent);
    let factor = if kind == SensorKind::Flex { 1f64.to_degrees() } else { 100.0 };
    let residuals = calibration.record.points.iter().zip(calibration.residuals());
    let off: Vec<[f64; 2]> = residuals.filter_map(|(p, off)| Some([kind.shown(p.stimulus), factor * off?])).collect();
    let worst = off.iter().map(|[_, off]| off.abs()).fold(0.0, f64::max);
    let unit = if kind == SensorKind::Flex { "degrees" } else { "%" };
    ui.weak(format!("residuals, at most {} {unit}", three_digits(worst)));
    plot(theme, "calibration residuals", 90.0, unit, kind.unit()).include_y(-0.5).include_y(0.5).show(ui, |plot| {
        for [at, off] in &off {
            plot.line(Line::new("off", vec![[*at, 0.0], [*at, *off]]).color(accent).width(1.5));
        }
        plot.points(Points::new("off", off.clone()).color(accent).radius(3.0));
    });
}

/// Force that bending alone simulates on a pad.
fn bending_plot(ui: &mut Ui, calibration: &Calibration, theme: Theme) {
    let accent = colour(theme.colours().accent);
    let (Curve::Pad(curve), Some(bending)) = (&calibration.curve, &calibration.record.bending) else { return };
    let reaches = bending.reaches();
    ui.weak(format!("zero shift by bending, up to {}", units::shown(reaches, "1/m")));
    let line: PlotPoints<'_> = (0..=60)
        .map(|k| {
            let kappa = reaches * f64::from(k) / 60.0;
            [kappa, bending.preload(curve, kappa)]
        })
        .collect();
    plot(theme, "bending zero", 90.0, "N", &units::symbol("1/m")).include_y(0.0).include_y(0.1).show(ui, |plot| {
        plot.line(Line::new("load", line).color(accent).width(1.5));
    });
}

fn plot(theme: Theme, id: &str, height: f32, axis: &str, stimulus: &str) -> Plot<'static> {
    static_plot(theme, id, height, axis, AxisHints::new_x().label(stimulus.to_owned()), 0.06)
}
