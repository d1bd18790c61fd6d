//! Which grasp next: the move that the simulation has chosen, or advice to the person at the real gripper.

use super::Part;
use crate::app::theme::colour;
use crate::app::view_source::ViewSource;
use egui::{Label, RichText, Ui};
use std::sync::Arc;

/// Draws the line; returns its height (points), 0 without advice.
pub(super) fn ui(ui: &mut Ui, part: &Part<'_, '_>) -> f32 {
    let Some(text) = text(part) else { return 0.0 };
    // No line break between number and unit.
    let text = RichText::new(text.replace(" mm", "\u{a0}mm"))
        .size(part.measures.reason_letters)
        .color(colour(part.colours().accent));
    let hint = "The grasp from which most is expected to be learned, by the readings so far";
    ui.add(Label::new(text).wrap()).on_hover_text(hint).rect.height() + ui.spacing().item_spacing.y
}

fn text(part: &Part<'_, '_>) -> Option<String> {
    match part.context.source {
        ViewSource::Trial => None,
        ViewSource::Simulation => {
            let by = part.context.snapshot?.status.guided?;
            Some(format!("Guided: gripper {by}"))
        }
        ViewSource::Gripper => {
            let last = part.view.last.as_ref().filter(|_| part.view.decision.is_none() && !part.view.listening)?;
            let advice = part.context.tools.advice.last().filter(|advice| Arc::ptr_eq(&*advice.command, last))?;
            Some(format!("Before the next grasp: {}.", advice.outcome.ok()?))
        }
    }
}
