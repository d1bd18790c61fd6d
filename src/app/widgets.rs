//! Widgets that several panels share.

use crate::app::actions::Actions;
use crate::app::theme::colour;
use egui::{Button, Label, RichText, TextEdit, Ui};
use palpate_geometry::palette::Theme;
use palpate_lab::workers::GripperCommand;
use std::path::PathBuf;

/// Text that wraps.
pub(super) fn wrapped(ui: &mut Ui, text: RichText) {
    ui.add(Label::new(text).wrap());
}

/// Terminal command for `purpose`, with a button that copies it.
pub(super) fn command_ui(ui: &mut Ui, purpose: &str, command: &str) {
    egui::Frame::new().fill(ui.visuals().faint_bg_color).corner_radius(4).inner_margin(6).show(ui, |ui| {
        ui.add(Label::new(RichText::new(command).monospace()).wrap());
        let copy = ui.add(Button::new("Copy"));
        let label = format!("Copy the command for {purpose}");
        copy.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
        if copy.on_hover_text("Copy it for a terminal").clicked() {
            ui.copy_text(command.to_owned());
        }
    });
}

/// True in the first frame in which `name` is shown again: a panel then updates data from elsewhere.
pub(super) fn just_opened(ui: &Ui, name: &str) -> bool {
    let id = egui::Id::unique(("shown last", name));
    let now = ui.ctx().cumulative_frame_nr();
    let last = ui.data_mut(|data| {
        let last = data.get_temp::<u64>(id);
        data.insert_temp(id, now);
        last
    });
    last.is_none_or(|last| last + 1 < now)
}

/// Field for a port of the real gripper; none where it is empty. Its text is kept under `id`.
pub(super) fn port_field(ui: &mut Ui, id: egui::Id) -> Option<PathBuf> {
    let mut port = ui.data_mut(|data| data.get_temp::<String>(id)).unwrap_or_default();
    ui.horizontal(|ui| {
        let label = ui.label("Port");
        ui.add(TextEdit::singleline(&mut port).hint_text(ANY_PORT)).labelled_by(label.id);
    });
    let named = Some(port.trim()).filter(|port| !port.is_empty()).map(PathBuf::from);
    ui.data_mut(|data| data.insert_temp(id, port));
    named
}

/// Hint in an empty field for a port.
pub(super) const ANY_PORT: &str = "automatic";

/// Stop button, the same everywhere.
pub(super) fn stop_button(ui: &mut Ui, theme: Theme, actions: &mut Actions) {
    let colours = theme.colours();
    let text = RichText::new("STOP  Esc").strong().color(colour(colours.background));
    let button = Button::new(text).fill(colour(colours.error));
    let response = ui.add_sized([84.0, 26.0], button).on_hover_text("Vent the fingers and end the trial (Esc)");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "Stop and vent"));
    if response.clicked() {
        actions.push(GripperCommand::Vent);
    }
}
