//! A lesson that is running: the object that the model learns, how far it is, and a button that stops it.

use crate::app::actions::Actions;
use crate::app::context::PanelContext;
use crate::app::features::recognition::RecognitionAction;
use egui::{ProgressBar, Ui};
use palpate_lab::grasping::LessonStage;
use palpate_sim::objects::titled;

/// Share of a lesson that simulating takes.
const SIMULATING: f32 = 0.4;

pub(super) fn ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    let Some(teacher) = context.tools.teacher.view() else { return };
    let Some((request, stage)) = &teacher.running else { return };
    let (share, doing) = match *stage {
        LessonStage::Simulating(done, of) => {
            (SIMULATING * done as f32 / of.max(1) as f32, format!("grasp {done} of {of}"))
        }
        LessonStage::Fitting(share) => {
            let share = share as f32;
            (SIMULATING + (1.0 - SIMULATING) * share, format!("fitting, {:.0} %", 100.0 * share))
        }
    };
    ui.horizontal(|ui| {
        let stop = ui.button("Stop").on_hover_text("Leave the model as it is");
        if stop.clicked() {
            actions.push(RecognitionAction::StopTeaching);
        }
        let text = format!("Learning {}: {doing}", titled(&request.name).to_lowercase());
        ui.add(ProgressBar::new(share).desired_width(ui.available_width()).text(text));
    });
}
