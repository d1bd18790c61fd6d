//! Lower bar while the real gripper is shown: keys of a trial, instruction, and time left.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::gripper::instruction;
use crate::app::theme::{colour, veil};
use egui::{Button, RichText, Ui};
use palpate_geometry::palette::Rgb;
use palpate_geometry::units::{SPACE, capital};
use palpate_lab::grasping::GraspStage;
use palpate_lab::workers::{GripperCommand, GripperView, LabellingAction, TrialView};
use palpate_sim::gripper::Phase;

pub(super) fn ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let trial = app.gripper_view().and_then(|gripper| gripper.trial.as_ref());
    let connected = app.gripper_view().is_some_and(GripperView::is_connected);
    let silent_s = app.gripper.silent_s();
    ui.horizontal_centered(|ui| {
        let mut button = |on: bool, text: &str, about: &str, action: fn(&mut App)| {
            let button = ui.add_enabled(on, Button::new(text)).on_hover_text(about).on_disabled_hover_text(about);
            actions.on(&button, action);
        };
        let (record, about) = match trial {
            Some(_) => ("Restart  R", "Discard the running trial and record from the beginning (R)"),
            None => ("Record  R", "Record a grasp; a trial without a label is kept (R)"),
        };
        button(connected && silent_s.is_none(), record, about, |app| app.label(LabellingAction::Record));
        let about = "End the trial and keep it (Q)";
        button(trial.is_some(), "End  Q", about, |app| _ = app.gripper.send(GripperCommand::End));
        let about = "Discard the trial (D)";
        button(trial.is_some(), "Discard  D", about, |app| app.label(LabellingAction::Discard));
        ui.separator();
        let colours = app.view.theme.colours();
        match (trial, silent_s) {
            (Some(trial), Some(silent_s)) => {
                let text = format!("{}: no readings for {silent_s}{SPACE}s", capital(&trial.title()));
                ui.label(RichText::new(text).heading().strong().color(colour(colours.warning)));
            }
            (Some(trial), None) => {
                let (text, ink) = (instruction(trial), part_colour(app, trial.stage));
                ui.label(RichText::new(text).heading().strong().color(colour(ink)));
                progress_ui(ui, trial, ink, colours.raised);
            }
            (None, None) if connected => {
                ui.weak("ready");
            }
            (None, Some(silent_s)) => {
                ui.weak(format!("no readings for {silent_s}{SPACE}s: is the board plugged in?"));
            }
            (None, None) => {
                ui.weak("no gripper connected");
            }
        }
    });
}

fn part_colour(app: &App, part: GraspStage) -> Rgb {
    let colours = app.view.theme.colours();
    match part {
        GraspStage::Phase(Phase::Close | Phase::Hold) => colours.accent,
        GraspStage::Phase(Phase::Release) => colours.warning,
        GraspStage::Lead | GraspStage::Settle | GraspStage::Free => colours.text,
    }
}

/// Progress of the trial, and time left of this part.
fn progress_ui(ui: &mut Ui, trial: &TrialView, ink: Rgb, ground: Rgb) {
    let left = trial.left_s.map_or_else(String::new, |left_s| format!("{left_s:.1} s left"));
    ui.add_sized([84.0, 20.0], egui::Label::new(RichText::new(left).monospace()));
    ui.weak(format!("{}, {} readings", trial.title(), trial.samples));
    let Some(length_s) = trial.length_s.filter(|_| ui.available_width() > 60.0) else { return };
    let (rect, response) = ui.allocate_exact_size(egui::vec2(ui.available_width() - 6.0, 16.0), egui::Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ProgressIndicator, true, "Time in the trial"));
    let share = (trial.t_s / length_s).clamp(0.0, 1.0) as f32;
    ui.painter().rect_filled(rect, 3.0, colour(ground));
    let done = egui::Rect::from_min_size(rect.min, egui::vec2(rect.width() * share, rect.height()));
    ui.painter().rect_filled(done, 3.0, veil(ink, 0.55));
}
