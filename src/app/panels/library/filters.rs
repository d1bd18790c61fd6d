//! Filters of the library: a menu with all of them, chips for the usual ones and for those that are set.

use super::columns;
use crate::app::actions::Actions;
use egui::{RichText, ScrollArea, Ui};
use palpate_lab::workers::LibraryView;
use palpate_sim::objects::object_title;
use palpate_sim::scene::PRESETS;
use palpate_store::labels::Flag;
use palpate_store::{Counted, Day, Shown, TrialColumn, TrialOrder, TrialPlace, TrialQuality, TrialQuery};
use palpate_tactile::trial::TrialSource;

pub(super) fn ui(ui: &mut Ui, query: &TrialQuery, view: &LibraryView, actions: &mut Actions) {
    let mut wanted = query.clone();
    let low = ui.available_height() < LOW;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = egui::vec2(4.0, 4.0);
        let filter = ui.menu_button("Filter", |ui| {
            if low {
                usual_ui(ui, view, &mut wanted, true);
                ui.separator();
            }
            menu_ui(ui, view, &mut wanted);
        });
        filter.response.on_hover_text("Show some trials only");
        if ui.available_width() < columns::TABLE {
            ui.menu_button("Sort", |ui| order_ui(ui, &mut wanted.order)).response.on_hover_text("Order of the list");
        }
        usual_ui(ui, view, &mut wanted, !low);
        set_ui(ui, &mut wanted);
    });
    if wanted != *query {
        actions.push(|app| app.library.find(wanted));
    }
}

/// Height of a library that has the usual filters in its menu, and only those that are set above its rows (points).
const LOW: f32 = 330.0;

/// The usual filters: all, or those that are set.
fn usual_ui(ui: &mut Ui, view: &LibraryView, wanted: &mut TrialQuery, all: bool) {
    for (name, days) in [("today", [Some(0), None]), ("yesterday", [Some(1), Some(1)])] {
        let [since, until] = days.map(|ago| ago.map(Day::Ago));
        let set = wanted.since == since && wanted.until == until;
        if (set || all) && ui.selectable_label(set, small(name)).clicked() {
            [wanted.since, wanted.until] = if set { [None, None] } else { [since, until] };
        }
    }
    let counts = &view.counts;
    if wanted.unlabelled || all && counts.unlabelled > 0 {
        let text = format!("unlabelled {}", counts.unlabelled);
        if ui.selectable_label(wanted.unlabelled, small(&text)).clicked() {
            wanted.unlabelled = !wanted.unlabelled;
        }
    }
    let logged = wanted.place == Some(TrialPlace::DemoLog);
    if logged || all && counts.demo_log > 0 {
        let text = format!("demo log {}", counts.demo_log);
        let hint = "Grasps of demos; newer ones push them out. K keeps the selected ones";
        if ui.selectable_label(logged, small(&text)).on_hover_text(hint).clicked() {
            wanted.place = (!logged).then_some(TrialPlace::DemoLog);
        }
    }
    if counts.collected > 0 && (all || !wanted.without_collected) {
        let text = format!("data sets {}", counts.collected);
        let hint = "Show trials of data sets, too: grasps that studies and palpate collect simulated";
        if ui.selectable_label(!wanted.without_collected, small(&text)).on_hover_text(hint).clicked() {
            wanted.without_collected = !wanted.without_collected;
        }
    }
    let gone = wanted.shown == Shown::Discarded;
    if gone || all && counts.discarded > 0 {
        let text = format!("discarded {}", counts.discarded);
        if ui.selectable_label(gone, small(&text)).clicked() {
            wanted.shown = if gone { Shown::Kept } else { Shown::Discarded };
        }
    }
}

fn small(text: &str) -> RichText {
    RichText::new(text).small()
}

/// Chips of filters that are set; a click removes one.
fn set_ui(ui: &mut Ui, query: &mut TrialQuery) {
    let mut chip = |text: String| {
        let clicked = ui.selectable_label(true, small(&format!("{text}  \u{d7}"))).on_hover_text("Remove").clicked();
        (!clicked).then_some(())
    };
    if query.only.as_ref().is_some_and(|only| chip(format!("trials kept of the row: {}", only.len())).is_none()) {
        query.only = None;
    }
    let keep = |value: &mut Option<String>, name: &str, chip: &mut dyn FnMut(String) -> Option<()>| {
        if let Some(text) = value.as_ref()
            && chip(format!("{name} {text}")).is_none()
        {
            *value = None;
        }
    };
    if let Some(name) = &query.object
        && chip(object_title(name)).is_none()
    {
        query.object = None;
    }
    query.source = query.source.filter(|source| chip(source.title().to_owned()).is_some());
    // That of the demo log has a chip of its own.
    let place = query.place.filter(|place| *place == TrialPlace::Store);
    if place.is_some_and(|place| chip(format!("in the {}", place.title())).is_none()) {
        query.place = None;
    }
    query.quality = query.quality.filter(|quality| chip(quality.name().to_owned()).is_some());
    query.flag = query.flag.filter(|flag| chip(flag.label().to_owned()).is_some());
    keep(&mut query.tag, "tag", &mut chip);
    keep(&mut query.preset, "preset", &mut chip);
    keep(&mut query.collection, "in", &mut chip);
    keep(&mut query.sensors, "sensors", &mut chip);
}

/// All filters.
fn menu_ui(ui: &mut Ui, view: &LibraryView, query: &mut TrialQuery) {
    let counts = &view.counts;
    counted_ui(ui, "Object", &counts.objects, object_title, &mut query.object);
    choice_ui(ui, "Source", TrialSource::ALL.map(|source| (source.title(), source)), &mut query.source);
    choice_ui(ui, "Place", TrialPlace::ALL.map(|place| (place.title(), place)), &mut query.place);
    choice_ui(ui, "Quality", TrialQuality::ALL.map(|quality| (quality.name(), quality)), &mut query.quality);
    choice_ui(ui, "Flag", Flag::ALL.map(|flag| (flag.label(), flag)), &mut query.flag);
    choice_ui(ui, "Preset of poses", PRESETS.map(|p| (p.name, p.name.to_owned())), &mut query.preset);
    counted_ui(ui, "Tag", &counts.tags, str::to_owned, &mut query.tag);
    counted_ui(ui, "Collection", &counts.collections, str::to_owned, &mut query.collection);
}

/// Submenu with a few choices; choosing the set one again removes it.
fn choice_ui<T: Clone + PartialEq, const N: usize>(
    ui: &mut Ui,
    title: &str,
    choices: [(&str, T); N],
    value: &mut Option<T>,
) {
    ui.menu_button(title, |ui| {
        for (name, choice) in choices {
            let set = value.as_ref() == Some(&choice);
            if ui.selectable_label(set, name).clicked() {
                *value = (!set).then_some(choice);
                ui.close();
            }
        }
    });
}

/// Submenu with the values that occur.
fn counted_ui(
    ui: &mut Ui,
    title: &str,
    counts: &[Counted],
    shown: impl Fn(&str) -> String,
    value: &mut Option<String>,
) {
    ui.add_enabled_ui(!counts.is_empty(), |ui| {
        ui.menu_button(title, |ui| {
            ScrollArea::vertical().max_height(360.0).show(ui, |ui| {
                for (name, count) in counts {
                    let set = value.as_ref() == Some(name);
                    if ui.selectable_label(set, format!("{}  {count}", shown(name))).clicked() {
                        *value = (!set).then(|| name.clone());
                        ui.close();
                    }
                }
            });
        });
    });
}

/// Columns to sort by, and the direction.
fn order_ui(ui: &mut Ui, order: &mut TrialOrder) {
    for column in TrialColumn::ALL {
        if ui.selectable_label(order.column == column, column.name()).clicked() {
            order.column = column;
            ui.close();
        }
    }
    ui.separator();
    if ui.selectable_label(order.descending, "last first").clicked() {
        order.descending = !order.descending;
        ui.close();
    }
}
