//! Bar above the panels (modes and data source) and below (time, or the running trial).

mod trial;

use crate::app::actions::Actions;
use crate::app::context::PanelContext;
use crate::app::features::simulation::SPEEDS;
use crate::app::features::view::ViewAction;
use crate::app::icons::{self, Icon};
use crate::app::modes;
use crate::app::modes::mode::Mode;
use crate::app::theme::{colour, veil};
use crate::app::view_source::ViewSource;
use crate::app::widgets::stop_button;
use egui::{Align, Layout, RichText, Ui};
use palpate_device::serial::LinkState;
use palpate_geometry::palette::{Theme, Trace};
use palpate_lab::workers::{Command, GripperView, Status};

/// A speed: ¼× is 0.25×.
fn speed_text(speed: f64) -> String {
    if speed >= 1.0 || (speed * 100.0).fract() == 0.0 {
        format!("{speed}×")
    } else {
        format!("1/{}×", (1.0 / speed).round())
    }
}

pub(super) fn top(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    let colours = context.view.theme.colours();
    ui.horizontal_centered(|ui| {
        ui.label(RichText::new("Palpate").heading().strong());
        modes_ui(ui, context, actions);
        sources_ui(ui, context, actions);
        if context.source == ViewSource::Simulation {
            simulated_ui(ui, context);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("?").on_hover_text("Keys (F1)").clicked() {
                actions.push(ViewAction::ShowKeys(!context.view.keys_shown));
            }
            let (icon, other) = match context.view.theme {
                Theme::Dark => (Icon::Sun, Theme::Light),
                Theme::Light => (Icon::Moon, Theme::Dark),
            };
            if icons::button(ui, icon, "Theme", &format!("Change to {} theme", other.name())).clicked() {
                actions.push(ViewAction::SetTheme(other));
            }
            if ui.button("Reset layout").on_hover_text("Restore the default layout of all modes").clicked() {
                actions.push(ViewAction::ResetLayout);
            }
            if context.gripper.is_some_and(GripperView::is_connected) {
                stop_button(ui, context.view.theme, actions);
            }
            if let Some(driver) = context.driver.filter(|_| ui.available_width() > 240.0) {
                let quiet = RichText::new(driver).small().color(colour(colours.quiet_text));
                ui.add(egui::Label::new(quiet).truncate());
            }
        });
    });
}

/// Tabs of the modes.
fn modes_ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    ui.spacing_mut().item_spacing.x = 2.0;
    for kind in &modes::ALL {
        let chosen = context.view.mode == kind.mode;
        if ui.selectable_label(chosen, kind.title).on_hover_text(kind.about).clicked() && !chosen {
            actions.push(ViewAction::SetMode(kind.mode));
        }
    }
    ui.spacing_mut().item_spacing.x = 8.0;
}

/// Source of the data. While a gripper is connected, a click changes it.
fn sources_ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    let colours = context.view.theme.colours();
    let link = context.gripper.and_then(|gripper| gripper.link.as_ref());
    let Some(link) = link else {
        return badge(ui, "SIMULATED", veil(colours.accent, 0.22), colour(colours.text));
    };
    let listening = link.state == LinkState::Listening;
    let cadence = &link.cadence;
    let real = match (listening, cadence.troubled) {
        (true, true) => format!("REAL GRIPPER {:.0} Hz: many unreadable lines", cadence.rate_hz),
        (true, false) => format!("REAL GRIPPER {:.0} Hz, {} lost", cadence.rate_hz, cadence.lost),
        (false, _) => "REAL GRIPPER: no readings".to_owned(),
    };
    let remarks = [link.line_remarks(), link.wiring_remarks()].concat();
    let trouble = !listening || cadence.troubled;
    let about = format!("{}: {}", link.port.path.display(), link.state.sentence());
    let about = std::iter::once(about).chain(remarks.iter().cloned()).collect::<Vec<_>>().join("\n");
    for (source, text, about) in [
        (ViewSource::Gripper, real, about),
        (ViewSource::Simulation, "SIMULATED".to_owned(), "Show the simulation".to_owned()),
    ] {
        let chosen = context.source == source;
        let ink = match source {
            ViewSource::Gripper if trouble => colours.error,
            ViewSource::Gripper if !remarks.is_empty() => colours.warning,
            ViewSource::Gripper | ViewSource::Simulation => colours.text,
        };
        let text = RichText::new(text).small().color(colour(ink));
        if ui.selectable_label(chosen, text).on_hover_text(about).clicked() {
            actions.push(ViewAction::Show(source));
        }
    }
}

/// Object in the simulated hand, and grasps made.
fn simulated_ui(ui: &mut Ui, context: &PanelContext<'_>) {
    let object = context.snapshot.and_then(|s| s.object.as_deref());
    if let Some(object) = object.filter(|_| context.view.truth_shown) {
        ui.label(&object.title);
    }
    if let Some(snapshot) = context.snapshot {
        let status = &snapshot.status;
        // With a model, grasping ends as soon as the object is recognised.
        let of = if snapshot.identification.is_some() { "of at most" } else { "of" };
        ui.weak(format!("grasp {} {of} {}", status.grasp_of_round.max(1), status.grasps));
    }
}

fn badge(ui: &mut Ui, text: &str, fill: egui::Color32, ink: egui::Color32) {
    egui::Frame::new().fill(fill).corner_radius(4).inner_margin(egui::Margin::symmetric(7, 2)).show(ui, |ui| {
        ui.label(RichText::new(text).small().color(ink));
    });
}

pub(super) fn bottom(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    if context.source == ViewSource::Gripper || context.view.mode == Mode::Label {
        return trial::ui(ui, context, actions);
    }
    let status = context.snapshot.map(|s| s.status.clone()).unwrap_or_default();
    let t = context.snapshot.map_or(0.0, |s| s.frame.t);
    ui.horizontal_centered(|ui| {
        transport(ui, &status, actions);
        ui.separator();
        speeds(ui, &status, actions);
        ui.separator();
        recording(ui, &status, actions);
        ui.separator();
        progress(ui, context, &status, t);
    });
}

fn transport(ui: &mut Ui, status: &Status, actions: &mut Actions) {
    let mut button = |icon: Icon, name: &str, hint: &str, command: Command| {
        if icons::button(ui, icon, name, hint).clicked() {
            actions.push(command);
        }
    };
    button(Icon::Reset, "Reset", "Back to the start (Backspace)", Command::Reset);
    if status.playing {
        button(Icon::Pause, "Pause", "Pause (Space)", Command::Pause);
    } else {
        let hint = if status.finished { "Grasp again (Space)" } else { "Play (Space)" };
        button(Icon::Play, "Play", hint, Command::Play);
    }
    button(Icon::Step, "Step", "One sample forward (Ctrl+→)", Command::Step);
}

fn speeds(ui: &mut Ui, status: &Status, actions: &mut Actions) {
    let combo = egui::ComboBox::from_id_salt("speed").width(64.0).selected_text(speed_text(status.target_speed));
    let shown = combo.show_ui(ui, |ui| {
        for speed in SPEEDS {
            if ui.selectable_label(status.target_speed == speed, speed_text(speed)).clicked() {
                actions.push(Command::SetSpeed(speed));
            }
        }
    });
    shown.response.on_hover_text("Speed (- and =)");
    let actual = if status.playing && status.actual_speed > 0.0 {
        format!("{:.2}×", status.actual_speed)
    } else {
        "–".to_owned()
    };
    ui.add_sized([46.0, 20.0], egui::Label::new(RichText::new(actual).monospace()))
        .on_hover_text("Actual speed, as a multiple of real time");
}

fn recording(ui: &mut Ui, status: &Status, actions: &mut Actions) {
    let mut on = status.recording;
    if ui.checkbox(&mut on, "Record").on_hover_text("Store every finished grasp").changed() {
        actions.push(Command::SetRecording(on));
    }
    let mut grasps = status.grasps.max(1);
    let drag = egui::DragValue::new(&mut grasps).range(1..=1000).speed(0.05).suffix(" grasps");
    if ui.add(drag).on_hover_text("Most grasps; all but the first in random poses").changed() {
        actions.push(Command::SetGrasps(grasps));
    }
}

/// Time and line pressure.
fn progress(ui: &mut Ui, context: &PanelContext<'_>, status: &Status, t: f64) {
    let colours = context.view.theme.colours();
    let duration = status.duration.max(1e-9);
    ui.label(RichText::new(format!("{t:5.2} / {:.2} s", status.duration)).monospace());
    if ui.available_width() < 60.0 {
        return;
    }
    let (rect, response) = ui.allocate_exact_size(egui::vec2(ui.available_width() - 6.0, 16.0), egui::Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ProgressIndicator, true, "Time in the grasp"));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, colour(colours.raised));
    // The filled height is the line pressure.
    if let Some(trace) = context.traces.current() {
        let top = context.scene.programme.peak_bar.max(1e-9);
        let place = |k: usize| {
            let x = rect.left() + rect.width() * (trace.t[k] / duration) as f32;
            let y = rect.bottom() - rect.height() * (trace.line_bar[k] / top).clamp(0.0, 1.0) as f32;
            egui::pos2(x, y)
        };
        let fill = veil(Trace::Line.colour(context.view.theme), 0.45);
        for k in 1..trace.t.len() {
            let (a, b) = (place(k - 1), place(k));
            let column = egui::Rect::from_min_max(egui::pos2(a.x, b.y.min(a.y)), egui::pos2(b.x, rect.bottom()));
            painter.rect_filled(column, 0.0, fill);
        }
    }
    let x = rect.left() + rect.width() * (t / duration).clamp(0.0, 1.0) as f32;
    painter.vline(x, rect.y_range(), egui::Stroke::new(2.0, colour(colours.accent)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_short() {
        let texts: Vec<String> = SPEEDS.iter().map(|s| speed_text(*s)).collect();
        assert_eq!(texts, ["1/16×", "1/8×", "0.25×", "0.5×", "1×", "2×", "4×", "8×"]);
    }
}
