//! Lines of the real gripper's board as they arrive, decoded.

use egui::{RichText, ScrollArea, TextWrapMode, Ui};
use palpate_device::protocol::LineKind;
use palpate_lab::workers::GripperView;

pub(super) fn ui(ui: &mut Ui, gripper: Option<&GripperView>) {
    let lines = gripper.map(|gripper| &gripper.console).filter(|lines| !lines.is_empty());
    let Some(lines) = lines else {
        ui.weak("Lines of the board. Connect it in the panel Gripper.");
        return;
    };
    ui.horizontal_wrapped(|ui| {
        ui.weak(format!("last {} lines; unreadable ones in red", lines.len()));
        if ui.small_button("Copy").on_hover_text("Copy all lines").clicked() {
            let text: Vec<String> =
                lines.iter().map(|line| format!("{:.3} {}", 1e-3 * line.arrived_ms as f64, line.text)).collect();
            ui.ctx().copy_text(text.join("\n"));
        }
    });
    let height = ui.text_style_height(&egui::TextStyle::Monospace);
    ScrollArea::both().auto_shrink(false).stick_to_bottom(true).show_rows(ui, height, lines.len(), |ui, rows| {
        ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
        for line in &lines[rows] {
            let time = format!("{:9.3}", 1e-3 * line.arrived_ms as f64);
            ui.horizontal(|ui| {
                ui.label(RichText::new(time).monospace().weak());
                let text = RichText::new(&line.text).monospace();
                match line.kind {
                    LineKind::Values => ui.label(text),
                    LineKind::Remark => ui.label(text.color(ui.visuals().hyperlink_color)),
                    LineKind::Bad(why) => ui.label(text.color(ui.visuals().error_fg_color)).on_hover_text(why),
                };
                if let LineKind::Bad(why) = line.kind {
                    ui.weak(why);
                }
            });
        }
    });
}
