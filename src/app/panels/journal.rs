//! What was changed of labels and plan, newest first; nothing is ever taken out of it.

use super::{PanelContext, wrapped};
use crate::app::actions::Action;
use egui::{RichText, ScrollArea, Ui};
use palpate_lab::workers::LabelWish;

pub(super) fn ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("Undo").on_hover_text("Take the last change back (Ctrl+Z)").clicked() {
            actions.push(Action::Label(LabelWish::Undo));
        }
        if ui.button("Redo").on_hover_text("Make it again (Ctrl+Shift+Z)").clicked() {
            actions.push(Action::Label(LabelWish::Redo));
        }
    });
    let journal = context.labels.map(|view| &view.journal).filter(|journal| !journal.is_empty());
    let Some(journal) = journal else {
        ui.weak("Nothing has been changed yet.");
        return;
    };
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for entry in journal {
            // Hours and minutes; the day is in the command `palpate trials journal`.
            let time: String = entry.at.chars().skip(11).take(5).collect();
            wrapped(ui, RichText::new(format!("{time}  {}", entry.sentence())).small());
        }
    });
}
