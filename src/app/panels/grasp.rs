//! This grasp in numbers: object, present readings, and result of the last grasp.

use crate::app::actions::Actions;
use crate::app::plots::shows;
use crate::app::shown::DisplayedData;
use crate::app::theme::colour;
use crate::app::widgets::wrapped;
use egui::{Button, Grid, RichText, ScrollArea, Sense, Shape, Stroke, Ui, pos2, vec2};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::{mm, number, shown as with_unit, symbol, three_digits};
use palpate_lab::workers::{Checking, Command, FinishedGrasp, ObjectCard, Snapshot};
use palpate_sim::frame::TrustLevel;
use palpate_sim::gripper::Side;
use palpate_tactile::Quantity;

pub(super) fn ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let Some(snapshot) = data.snapshot else {
        ui.weak("Waiting for the first grasp …");
        return;
    };
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        match &snapshot.object {
            Some(object) => object_ui(ui, object),
            None => {
                ui.strong("Empty hand");
            }
        }
        ui.add_space(6.0);
        readings_ui(ui, data, snapshot);
        ui.add_space(6.0);
        match &snapshot.last {
            Some(last) => {
                ui.weak(if last.grasp == snapshot.grasp {
                    "result of this grasp"
                } else {
                    "result of the grasp before"
                });
                trust_ui(ui, data.view.theme, last, snapshot.status.checking, actions);
                last_ui(ui, last);
            }
            None => {
                ui.weak("The result appears when the grasp ends.");
            }
        }
    });
}

fn object_ui(ui: &mut Ui, object: &ObjectCard) {
    ui.strong(&object.title);
    let size = object.size.to_array().map(|side| format!("{:.0}", mm(side)));
    let grams = three_digits(object.mass * 1e3);
    let text = format!("{} mm, {grams} g, friction {:.2}", size.join(" × "), object.friction);
    ui.weak(text);
    if let Some(class) = object.class {
        ui.weak(class.to_string());
    }
}

/// Values of the channels at the time shown, left and right.
fn readings_ui(ui: &mut Ui, data: &DisplayedData<'_>, snapshot: &Snapshot) {
    let trace = data.traces.current().filter(|trace| trace.grasp == snapshot.grasp);
    let sample = data.sample();
    let value = |quantity: Quantity, side: Side| -> Option<f64> {
        let index = snapshot.channels.iter().position(|c| shows(quantity, c) && c.side() == Some(side))?;
        trace?.channels.get(index)?.get(sample?).map(|value| f64::from(*value))
    };
    let frame = data.moment().map_or(snapshot.frame.as_ref(), |moment| moment.frame);
    ui.spacing_mut().interact_size.y = 18.0;
    Grid::new("readings").num_columns(3).spacing([14.0, 3.0]).show(ui, |ui| {
        ui.weak(data.past_s().map_or_else(|| "now".to_owned(), |t| format!("at {}", with_unit(t, "s"))));
        for side in ["left", "right"] {
            ui.add_sized([52.0, 18.0], egui::Label::new(RichText::new(side).weak()));
        }
        ui.end_row();
        for (name, unit, quantity, factor) in [
            ("curvature", "1/m", Quantity::Curvature, 1.0),
            ("pressure", "kPa", Quantity::Pressure, 1e-3),
            ("force", "N", Quantity::Force, 1.0),
        ] {
            ui.label(format!("{name}, {}", symbol(unit)));
            for side in Side::BOTH {
                // A fixed width: columns do not move while digits change.
                let text = value(quantity, side).map_or("–".to_owned(), |v| number(v * factor, unit));
                ui.add_sized([52.0, 18.0], egui::Label::new(RichText::new(text).monospace()));
            }
            ui.end_row();
        }
        ui.label("line, bar");
        let line = RichText::new(format!("{:.2}", frame.line_bar)).monospace();
        ui.add_sized([52.0, 18.0], egui::Label::new(line));
        ui.end_row();
        ui.label("command");
        ui.label(frame.phase.name());
        ui.end_row();
    });
}

/// How far the result can be trusted and why, and a button that computes it again.
fn trust_ui(ui: &mut Ui, theme: Theme, last: &FinishedGrasp, checking: Option<Checking>, actions: &mut Actions) {
    let quality = &last.summary.quality;
    let (level, reason) = quality.trust();
    let reason = match checking {
        Some(Checking::Comparing) if quality.agrees.is_none() => "comparing with runs at other accuracies …".to_owned(),
        Some(Checking::ComputingAgain) => "computing again at finer accuracy …".to_owned(),
        _ => reason,
    };
    ui.horizontal(|ui| {
        light_ui(ui, theme, level);
        ui.strong(format!("trust: {}", level.name()));
        ui.weak(format!("at {}", last.accuracy));
    });
    wrapped(ui, RichText::new(reason).small());
    if let Some(recomputed) = quality.recomputed {
        wrapped(ui, RichText::new(format!("computed at {}: {recomputed}", last.accuracy)).small().weak());
    }
    let free = last.repeatable && checking != Some(Checking::ComputingAgain);
    let about = if last.repeatable {
        "Refine until three levels of accuracy agree, and show and store that result instead"
    } else {
        "Not possible: the object was pulled by hand, or this engine controls no error"
    };
    let button = ui.add_enabled(free, Button::new("Verify at finer accuracy"));
    actions.on(&button.on_hover_text(about).on_disabled_hover_text(about), |app| {
        app.simulation.send(Command::ComputeAgain);
    });
}

/// Light of a trial: a green circle, an amber triangle or a red square.
fn light_ui(ui: &mut Ui, theme: Theme, level: TrustLevel) {
    let (rect, response) = ui.allocate_exact_size(vec2(16.0, 16.0), Sense::hover());
    let label = format!("Trust light: {}", level.name());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &label));
    let (colours, centre) = (theme.colours(), rect.center());
    let corners = |corners: &[[f32; 2]]| corners.iter().map(|[x, y]| pos2(centre.x + x, centre.y + y)).collect();
    ui.painter().add(match level {
        TrustLevel::Green => Shape::circle_filled(centre, 6.0, colour(colours.good)),
        TrustLevel::Amber => {
            let points = corners(&[[0.0, -6.5], [7.0, 5.5], [-7.0, 5.5]]);
            Shape::convex_polygon(points, colour(colours.warning), Stroke::NONE)
        }
        TrustLevel::Red => {
            let points = corners(&[[-5.5, -5.5], [5.5, -5.5], [5.5, 5.5], [-5.5, 5.5]]);
            Shape::convex_polygon(points, colour(colours.error), Stroke::NONE)
        }
    });
    response.on_hover_text(label);
}

fn last_ui(ui: &mut Ui, last: &FinishedGrasp) {
    let summary = &last.summary;
    Grid::new("summary").num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
        let mut line = |name: &str, value: String| {
            ui.label(name);
            ui.label(RichText::new(value).monospace());
            ui.end_row();
        };
        let onset = summary.contact_onset_s.map_or("never".to_owned(), |t| format!("{t:.2} s"));
        line("first contact", onset);
        if let Some(hold) = &summary.hold {
            let pair = |values: [f64; 2], unit: &str| {
                let [left, right] = values.map(|value| number(value, unit));
                format!("{left} | {right} {}", symbol(unit))
            };
            line("force on object", pair(hold.force_n, "N"));
            line("hold curvature", pair(hold.curvature_per_m, "1/m"));
            line("hold pressure", pair(hold.pressure_pa.map(|p| p * 1e-3), "kPa"));
        }
        if let Some(moved) = summary.object_moved_m {
            line("object moved", with_unit(mm(moved), "mm"));
        }
        let quality = &summary.quality;
        line("solver", format!("{:.2} Newton/step", quality.newton_mean));
        line(
            "converged",
            if summary.converged { "every step".to_owned() } else { format!("not {}", quality.unconverged_steps) },
        );
    });
}
