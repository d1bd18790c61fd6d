//! State of the real gripper in the upper bar, in every mode: who actuates it, and whether trials begin automatically.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::gripper::control_title;
use crate::app::theme::colour;
use egui::{RichText, Ui};
use palpate_lab::workers::GripperView;

pub(super) fn ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let Some(gripper) = app.gripper_view().filter(|gripper| gripper.is_connected()) else { return };
    let colours = app.view.theme.colours();
    let watching = gripper.watching.is_some();
    let narrow = ui.available_width() < 640.0;
    let trials = match (watching, narrow) {
        (true, true) => "auto",
        (true, false) => "trials: automatic",
        (false, true) => "key R",
        (false, false) => "trials: key R",
    };
    let ink = if watching { colours.warning } else { colours.quiet_text };
    let about = match watching {
        true => "Trials begin and end with the movement of the fingers. W in Label mode, or a click, ends that",
        false => "Trials begin with R. W in Label mode, or a click, detects them automatically",
    };
    let text = RichText::new(trials).small().color(colour(ink));
    actions.on(&ui.selectable_label(watching, text).on_hover_text(about), App::toggle_watch);
    let text = RichText::new(drive_text(app, gripper, narrow)).small().color(colour(colours.text));
    let about = "Who sets the pressure of the next trial: you by hand, or the board; untimed trials last until Q. \
                 M in Label mode, or a click, changes it";
    actions.on(&ui.selectable_label(false, text).on_hover_text(about), App::next_control);
}

/// Actuation, and line pressure where it is known.
fn drive_text(app: &App, gripper: &GripperView, narrow: bool) -> String {
    let running = gripper.trial.as_ref().map(|trial| trial.request.control);
    let control = control_title(running.unwrap_or(app.view.control));
    if narrow {
        return control.to_owned();
    }
    match gripper.latest.as_ref().and_then(|latest| latest.line_bar) {
        Some(bar) => format!("drive: {control}, {bar:.2} bar"),
        None => format!("drive: {control}"),
    }
}
