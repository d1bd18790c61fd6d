//! Journal: changes of labels and plan, newest first.

use crate::app::actions::Actions;
use crate::app::widgets::wrapped;
use egui::{Label, RichText, ScrollArea, Sense, Ui};
use palpate_lab::workers::{LabelCommand, LabelView};

pub(super) fn ui(ui: &mut Ui, labels: Option<&LabelView>, actions: &mut Actions) {
    ui.horizontal_wrapped(|ui| {
        actions.on(&ui.button("Undo").on_hover_text("Undo the last change (Ctrl+Z)"), |app| {
            app.edit_labels(LabelCommand::Undo);
        });
        actions
            .on(&ui.button("Redo").on_hover_text("Redo it (Ctrl+Shift+Z)"), |app| app.edit_labels(LabelCommand::Redo));
    });
    let journal = labels.map(|view| &view.journal).filter(|journal| !journal.is_empty());
    let Some(journal) = journal else {
        ui.weak("No changes yet.");
        return;
    };
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for entry in journal {
            // Number, hours and minutes; `palpate trials journal` lists the day too.
            let time: String = entry.at.chars().skip(11).take(5).collect();
            let text = RichText::new(format!("{}  {time}  {}", entry.number, entry.sentence())).small();
            let Some(id) = entry.trial.filter(|_| entry.others.is_empty()) else {
                wrapped(ui, text);
                continue;
            };
            let line = ui.add(Label::new(text).wrap().sense(Sense::click()));
            if line.double_clicked() {
                actions.push(move |app| app.open_trial(id));
            }
            line.context_menu(|ui| {
                actions.on(&ui.button("Inspect"), move |app| app.open_trial(id));
            });
        }
    });
}
