//! Bar below the library: what can be done with the selected trials.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::library::LibrarySelection;
use crate::app::widgets::{text_field, wrapped};
use egui::containers::menu::{MenuButton, MenuConfig, SubMenuButton, is_in_menu};
use egui::{Button, Id, Key, PopupCloseBehavior, RichText, ScrollArea, Ui};
use palpate_lab::workers::{LabelView, LibraryView};
use palpate_sim::objects::object_title;
use palpate_store::labels::TrialEdit;
use palpate_store::{LibraryTrial, TrialPlace};
use palpate_tactile::trial::TrialSource;
use std::sync::Arc;

/// Room that the buttons of all edits need; with less they are in a menu (points).
const WHOLE: f32 = 280.0;
/// Room that the buttons need beside how many are selected; with less, one is not counted (points).
const COUNTED: f32 = 220.0;
/// Width of a menu (points).
const MENU: f32 = 200.0;
/// Height of what a menu offers below its field (points).
const OFFERS: f32 = 150.0;

pub(super) fn ui(
    ui: &mut Ui,
    picked: &LibrarySelection,
    labels: Option<&LabelView>,
    view: &LibraryView,
    actions: &mut Actions,
) {
    let trials = picked.trials.as_slice();
    let gone = trials.iter().all(|trial| trial.row.deleted.is_some());
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = egui::vec2(4.0, 4.0);
        if trials.len() > 1 || ui.available_width() > COUNTED {
            ui.strong(format!("{} selected", trials.len()));
        }
        if gone {
            actions.on(&ui.button("Restore"), |app| app.library.edit(TrialEdit::Restore));
            return;
        }
        actions.on(&ui.button("Open").on_hover_text("Open the trial selected last (Enter)"), App::open_selected);
        actions.on(&ui.button("Compare").on_hover_text("Pin for comparison (P)"), App::pin_selected);
        let logged = trials.iter().any(|trial| trial.row.place == TrialPlace::DemoLog);
        let hint = "Move from the demo log to the store (K)";
        if logged && ui.button("Keep").on_hover_text(hint).clicked() {
            actions.push(|app| app.library.edit(TrialEdit::Keep));
        }
        if ui.available_width() < WHOLE {
            menu(ui, "Edit", |ui| edits_ui(ui, picked, labels, view, actions));
        } else {
            edits_ui(ui, picked, labels, view, actions);
        }
    });
}

/// Everything that changes or exports the selection.
fn edits_ui(
    ui: &mut Ui,
    picked: &LibrarySelection,
    labels: Option<&LabelView>,
    view: &LibraryView,
    actions: &mut Actions,
) {
    let trials = picked.trials.as_slice();
    menu(ui, "Label", |ui| label_ui(ui, labels, trials, actions));
    menu(ui, "Tag", |ui| tag_ui(ui, view, trials, actions));
    menu(ui, "Note", |ui| note_ui(ui, trials, actions));
    menu(ui, "Export", |ui| {
        ui.strong(match trials {
            [one] => format!("Export trial {}", one.row.id),
            _ => format!("Export {} selected trials", trials.len()),
        });
        let others = picked.shown.filter(|id| !picked.selected.contains(id));
        others.into_iter().for_each(|id| _ = ui.weak(format!("Trial {id}, which is shown, is not selected.")));
        let id = Id::unique("exported taxels");
        let mut taxels = ui.data(|data| data.get_temp(id)).unwrap_or(false);
        if ui.button("CSV into a folder beside the store").clicked() {
            actions.push(App::export_tables);
            ui.close();
        }
        if ui
            .button("A file: MCAP, NPZ, Parquet, CSV …")
            .on_hover_text("For ROS 2, Foxglove, PlotJuggler; for numpy, pandas; CSV for one trial (Ctrl+Shift+E)")
            .clicked()
        {
            actions.push(move |app| app.export_trials(taxels));
            ui.close();
        }
        let hint = "The file also holds the force on every taxel of simulated trials, normal and shear. CSV lists the \
             loaded taxels anyway, in .contacts.csv";
        if ui.checkbox(&mut taxels, "With taxels (MCAP, NPZ)").on_hover_text(hint).changed() {
            ui.data_mut(|data| data.insert_temp(id, taxels));
        }
    });
    if ui.button("Discard").on_hover_text("Discard (Del); Ctrl+Z brings them back").clicked() {
        actions.push(|app| app.library.edit(TrialEdit::Discard));
        ui.close();
    }
}

/// Menu that stays open while text is written; in another menu a part of that.
fn menu(ui: &mut Ui, title: &str, contents: impl FnOnce(&mut Ui)) {
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let contents = |ui: &mut Ui| {
        ui.set_width(MENU);
        contents(ui);
    };
    if is_in_menu(ui) {
        SubMenuButton::new(title).config(config).ui(ui, contents);
    } else {
        MenuButton::new(title).config(config).ui(ui, contents);
    }
}

/// What a menu offers below its field.
fn offers(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    ScrollArea::vertical().max_height(OFFERS).show(ui, contents);
}

/// Field for a word; the word once it is entered.
fn word_ui(ui: &mut Ui, name: &str, hint: &str, done: &str) -> Option<String> {
    let id = Id::unique(("library word", name));
    let mut word = ui.data(|data| data.get_temp::<String>(id)).unwrap_or_default();
    let field = ui.add(text_field(&mut word, id.with("field")).hint_text(hint));
    field.widget_info(|| {
        let mut info = egui::WidgetInfo::text_edit(true, &word, &word, hint);
        info.label = Some(name.to_owned());
        info
    });
    let entered = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
    let written = !word.trim().is_empty();
    let clicked = ui.add_enabled(written, Button::new(done)).clicked();
    let given = ((entered || clicked) && written).then(|| std::mem::take(&mut word));
    ui.data_mut(|data| data.insert_temp(id, word));
    if given.is_some() {
        ui.close();
    }
    given
}

fn label_ui(ui: &mut Ui, labels: Option<&LabelView>, trials: &[Arc<LibraryTrial>], actions: &mut Actions) {
    let recorded = trials.iter().filter(|trial| trial.row.source == TrialSource::Recorded).count();
    let known = trials.len() - recorded;
    if known > 0 {
        let text = format!(
            "{known} of {} {} simulated or imported: the object is known, a label leaves {} alone.",
            trials.len(),
            if known == 1 { "is" } else { "are" },
            if known == 1 { "it" } else { "them" },
        );
        wrapped(ui, RichText::new(text).small().weak());
    }
    if recorded == 0 {
        return;
    }
    let done = format!("Label {recorded}");
    let mut given = word_ui(ui, "Label of the selection", "name of the object", &done);
    offers(ui, |ui| {
        for object in labels.iter().flat_map(|labels| &labels.progress.objects) {
            if ui.button(object_title(&object.name)).clicked() {
                given = Some(object.name.clone());
                ui.close();
            }
        }
    });
    actions_of(given.map(TrialEdit::Label), actions);
}

/// Tags that all have are removed by a click, others are added.
fn tag_ui(ui: &mut Ui, view: &LibraryView, trials: &[Arc<LibraryTrial>], actions: &mut Actions) {
    let mut edit = word_ui(ui, "Tag of the selection", "new tag", "Add").map(|tag| TrialEdit::Tag(vec![tag]));
    offers(ui, |ui| {
        for (tag, _) in &view.counts.tags {
            let all = trials.iter().all(|trial| trial.row.tags.contains(tag));
            if ui.selectable_label(all, tag).clicked() {
                let tags = vec![tag.clone()];
                edit = Some(if all { TrialEdit::Untag(tags) } else { TrialEdit::Tag(tags) });
                ui.close();
            }
        }
    });
    actions_of(edit, actions);
}

fn note_ui(ui: &mut Ui, trials: &[Arc<LibraryTrial>], actions: &mut Actions) {
    let mut edit = word_ui(ui, "Note of the selection", "note; replaces the present one", "Set").map(TrialEdit::Note);
    if trials.iter().any(|trial| !trial.row.note.is_empty()) && ui.button("Remove the note").clicked() {
        edit = Some(TrialEdit::Note(String::new()));
        ui.close();
    }
    actions_of(edit, actions);
}

fn actions_of(edit: Option<TrialEdit>, actions: &mut Actions) {
    edit.into_iter().for_each(|edit| actions.push(|app| app.library.edit(edit)));
}
