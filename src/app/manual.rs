//! The manual and what the program is, as windows over the panels.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::manual::TOPICS;
use egui::{RichText, ScrollArea, vec2};

/// Draws both, while they are open.
pub(super) fn ui(app: &App, actions: &mut Actions) {
    let (mut manual, mut about) = (app.view.manual_shown, app.view.about_shown);
    let ctx = &app.ctx;
    let room = ctx.content_rect().size() - vec2(60.0, 90.0);
    let window = |title: &'static str| {
        let middle = ctx.content_rect().center();
        egui::Window::new(title).collapsible(false).pivot(egui::Align2::CENTER_CENTER).default_pos(middle)
    };
    window("Manual").open(&mut manual).default_size(room.min(vec2(860.0, 620.0))).show(ctx, |ui| {
        let id = egui::Id::unique("chapter");
        let mut chapter = ui.data(|data| data.get_temp::<usize>(id)).unwrap_or(0).min(TOPICS.len() - 1);
        ui.horizontal_top(|ui| {
            ScrollArea::vertical().id_salt("chapters").max_width(130.0).auto_shrink(false).show(ui, |ui| {
                for (number, topic) in TOPICS.iter().enumerate() {
                    if ui.selectable_label(number == chapter, topic.name).clicked() {
                        chapter = number;
                    }
                }
            });
            ScrollArea::both().id_salt(("chapter", chapter)).auto_shrink(false).show(ui, |ui| {
                ui.add(egui::Label::new(RichText::new(TOPICS[chapter].text).monospace()).extend());
            });
        });
        ui.data_mut(|data| data.insert_temp(id, chapter));
    });
    window("About Palpate").open(&mut about).resizable(false).show(ctx, |ui| {
        egui::Grid::new("about").num_columns(2).spacing([14.0, 4.0]).show(ui, |ui| {
            let driver = app.driver.clone().unwrap_or_else(|| "none".to_owned());
            let store = app.store.display().to_string();
            for (name, value) in [("version", env!("CARGO_PKG_VERSION")), ("store", &store), ("graphics", &driver)] {
                ui.weak(name);
                ui.add(egui::Label::new(value).wrap());
                ui.end_row();
            }
        });
    });
    if app.view.manual_shown && !manual {
        actions.push(|app| app.view.manual_shown = false);
    }
    if app.view.about_shown && !about {
        actions.push(|app| app.view.about_shown = false);
    }
}
