//! A lesson that is running: the object that the model learns, how far it is, and a button that stops it.

use crate::app::actions::Actions;
use crate::app::context::PanelContext;
use crate::app::features::App;
use egui::{ProgressBar, Ui};

pub(super) fn ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    let Some(progress) = context.tools.teaching.running().map(|running| running.progress) else { return };
    ui.horizontal(|ui| {
        let stop = ui.button("Stop").on_hover_text("Leave the model as it is");
        actions.on(&stop, App::stop_teaching);
        ui.add(ProgressBar::new(progress.share as f32).desired_width(ui.available_width()).text(progress.words));
    });
}
