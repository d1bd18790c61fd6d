//! The lower bar while the real gripper is shown: the keys of a trial, what is to be done now, and how much of it is left.

use crate::app::actions::{Action, DeskAction};
use crate::app::panels::PanelContext;
use crate::app::theme::{colour, veil};
use egui::{Button, RichText, Ui};
use palpate_geometry::palette::Rgb;
use palpate_lab::grasping::{GraspStage, LEAD_S};
use palpate_lab::workers::{GripperWish, TrialView};
use palpate_sim::gripper::Phase;
use palpate_tactile::trial::Control;

pub(super) fn ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    let trial = context.gripper.and_then(|gripper| gripper.trial.as_ref());
    let connected = context.gripper.is_some_and(palpate_lab::workers::GripperView::is_connected);
    ui.horizontal_centered(|ui| {
        let mut button = |on: bool, text: &str, about: &str, action: Action| {
            if ui.add_enabled(on, Button::new(text)).on_hover_text(about).on_disabled_hover_text(about).clicked() {
                actions.push(action);
            }
        };
        let record = if trial.is_some() { "Again  R" } else { "Record  R" };
        button(
            connected,
            record,
            "Record a grasp; while one goes on, give it up and begin anew (R)",
            Action::Desk(DeskAction::Record),
        );
        let end = Action::Gripper(GripperWish::End);
        button(trial.is_some(), "End  Q", "End the trial now, and keep it (Q)", end);
        button(trial.is_some(), "Discard  D", "Give the trial up (D)", Action::Desk(DeskAction::Discard));
        ui.separator();
        let colours = context.view.theme.colours();
        match trial {
            Some(trial) => {
                let (text, ink) = (instruction(trial), part_colour(context, trial.stage));
                ui.label(RichText::new(text).heading().strong().color(colour(ink)));
                progress_ui(ui, trial, ink, colours.raised);
            }
            None if connected => {
                ui.weak("ready");
            }
            None => {
                ui.weak("no gripper is connected");
            }
        }
    });
}

/// What is to be done now, as whoever stands at the control box wants to hear it.
pub(in crate::app) fn instruction(trial: &TrialView) -> String {
    let by_hand = trial.request.control == Control::ByHand;
    match trial.stage {
        GraspStage::Lead if by_hand => "Ready to close".to_owned(),
        GraspStage::Lead => "At rest".to_owned(),
        GraspStage::Phase(Phase::Close) if by_hand => "CLOSE: turn the pressure up".to_owned(),
        GraspStage::Phase(Phase::Close) => "Closing".to_owned(),
        GraspStage::Phase(Phase::Hold) if by_hand => "HOLD: leave it".to_owned(),
        GraspStage::Phase(Phase::Hold) => "Holding".to_owned(),
        GraspStage::Phase(Phase::Release) if by_hand => "RELEASE: turn the pressure down".to_owned(),
        GraspStage::Phase(Phase::Release) => "Releasing".to_owned(),
        GraspStage::Settle => "Coming to rest".to_owned(),
        GraspStage::Free => "Recording".to_owned(),
    }
}

fn part_colour(context: &PanelContext<'_>, part: GraspStage) -> Rgb {
    let colours = context.view.theme.colours();
    match part {
        GraspStage::Phase(Phase::Close | Phase::Hold) => colours.accent,
        GraspStage::Phase(Phase::Release) => colours.warning,
        GraspStage::Lead | GraspStage::Settle | GraspStage::Free => colours.text,
    }
}

/// How far the trial is, and what is left of this part.
fn progress_ui(ui: &mut Ui, trial: &TrialView, ink: Rgb, ground: Rgb) {
    let left = trial.left_s.map_or_else(String::new, |left_s| format!("{left_s:.1} s"));
    ui.add_sized([52.0, 20.0], egui::Label::new(RichText::new(left).monospace()));
    ui.weak(format!("{}, {} readings", trial.title(), trial.samples));
    let Some(length_s) = trial.length_s.filter(|_| ui.available_width() > 60.0) else { return };
    let (rect, response) = ui.allocate_exact_size(egui::vec2(ui.available_width() - 6.0, 16.0), egui::Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ProgressIndicator, true, "Time in the trial"));
    let share = ((trial.t_s + LEAD_S) / (length_s + LEAD_S)).clamp(0.0, 1.0) as f32;
    ui.painter().rect_filled(rect, 3.0, colour(ground));
    let done = egui::Rect::from_min_size(rect.min, egui::vec2(rect.width() * share, rect.height()));
    ui.painter().rect_filled(done, 3.0, veil(ink, 0.55));
}
