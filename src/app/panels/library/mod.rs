//! All trials: search, filters, a table that becomes a list of two lines where it is narrow, and edits of the selection.

mod bar;
mod columns;
mod filters;
mod rows;

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::library::{LibraryFeature, LibrarySelection};
use crate::app::shown::Pinned;
use crate::app::theme::{self, colour};
use crate::app::thumbnails::Thumbnails;
use crate::app::widgets::{focus_field, text_field};
use egui::{Frame, Id, Margin, Panel, RichText, Ui};
use palpate_lab::workers::{LabelView, LibraryView};
use palpate_store::TrialQuery;

pub(super) fn ui(
    ui: &mut Ui,
    (library, pinned): (&LibraryFeature, &[Pinned]),
    labels: Option<&LabelView>,
    pictures: &Thumbnails,
    actions: &mut Actions,
) {
    let Some(view) = &library.view else {
        ui.weak("Reading the store …");
        actions.push(|app| app.library.find(app.library.selection.query.clone()));
        return;
    };
    if !library.selection.trials.is_empty() {
        let fill = colour(theme::of(ui).colours().raised);
        let frame = Frame::new().fill(fill).corner_radius(4).inner_margin(Margin::same(6));
        Panel::bottom("selected trials")
            .frame(frame)
            .show(ui, |ui| bar::ui(ui, &library.selection, labels, view, actions));
    }
    search_ui(ui, &library.selection, view, actions);
    filters::ui(ui, &library.selection.query, view, actions);
    let query = &library.selection.query;
    if query.is_filtered() || !view.complete || hidden(query, view) > 0 {
        count_ui(ui, query, view, actions);
    }
    if view.found.is_empty() {
        return empty_ui(ui, query, view, actions);
    }
    rows::ui(ui, (library, pinned), pictures, view, actions);
}

/// Trials of data sets that are left out.
fn hidden(query: &TrialQuery, view: &LibraryView) -> usize {
    if query.hides_collected() { view.counts.collected } else { 0 }
}

/// Field for words; its text is asked for with every letter.
fn search_ui(ui: &mut Ui, picked: &LibrarySelection, view: &LibraryView, actions: &mut Actions) {
    let mut search = picked.query.search.clone();
    let hint = format!("Search {} trials  ( / )", grouped(view.counts.kept - hidden(&picked.query, view)));
    let id = Id::unique("library search");
    if picked.focus_search && focus_field(ui, id) {
        actions.push(|app| app.library.selection.focus_search = false);
    }
    let field = ui.add(text_field(&mut search, id).hint_text(hint));
    field.widget_info(|| {
        let mut info = egui::WidgetInfo::text_edit(true, &picked.query.search, &search, "");
        info.label = Some("Search trials".to_owned());
        info
    });
    if search != picked.query.search {
        let query = TrialQuery { search, ..picked.query.clone() };
        actions.push(|app| app.library.find(query));
    }
}

/// How many trials were found; without filters the search field says how many there are.
fn count_ui(ui: &mut Ui, query: &TrialQuery, view: &LibraryView, actions: &mut Actions) {
    let hidden = hidden(query, view);
    ui.horizontal_wrapped(|ui| {
        if query.is_filtered() || !view.complete {
            let text = format!("{} of {} trials", grouped(view.found.len()), grouped(view.counts.kept - hidden));
            ui.label(RichText::new(text).small().weak());
        }
        if hidden > 0 {
            let verb = if hidden == 1 { "trial of data sets is" } else { "trials of data sets are" };
            ui.label(RichText::new(format!("{} {verb} hidden", grouped(hidden))).small().weak());
        }
        if !view.complete {
            ui.label(RichText::new("reading older ones …").small().weak());
        }
        if query.is_filtered() && ui.small_button("Clear").on_hover_text("Remove search and filters").clicked() {
            let cleared = query.cleared();
            actions.push(|app| app.library.find(cleared));
        }
    });
}

fn empty_ui(ui: &mut Ui, query: &TrialQuery, view: &LibraryView, actions: &mut Actions) {
    ui.add_space(12.0);
    ui.vertical_centered(|ui| {
        if !view.complete {
            ui.weak("Reading the store …");
        } else if hidden(query, view) > 0 && !query.is_filtered() {
            ui.weak("No trials but those of data sets: \"data sets\" above shows them.");
        } else if query.is_filtered() {
            ui.weak("No trial matches. Clear the search and the filters to see all.");
        } else {
            ui.weak("No trials yet.");
            ui.weak("Play a grasp in Demo mode (Ctrl+1), record one of the real gripper with R, or import a file.");
            let hint = "CSV, MCAP, NPZ or Parquet; or drop the file anywhere on the window";
            actions.on(&ui.button("Import …").on_hover_text(hint), App::ask_for_trials);
        }
    });
}

/// A number with its thousands apart: 12 345.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push('\u{a0}');
        }
        text.push(digit);
    }
    text
}
