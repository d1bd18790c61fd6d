//! Labelling plan: trials recorded and wanted of each object, and the next one.

use crate::app::actions::Actions;
use crate::app::theme::{self, colour, veil};
use crate::app::widgets::{number_field, put_line, text_field};
use egui::{Align, DragValue, Layout, Rect, RichText, ScrollArea, Sense, Ui, pos2, vec2};
use palpate_lab::workers::{LabelCommand, LabelView, NUMBERED_OBJECTS, ObjectSearch, search_objects};
use palpate_sim::objects::{EMPTY, capital_title, catalogue};
use palpate_store::labels::{MOST_WANTED, ObjectProgress};
use std::collections::BTreeSet;

/// Trials wanted of an added object (paper, section IV-B: 40 to 55).
const WANTED: u32 = 50;

pub(super) fn ui(ui: &mut Ui, labels: Option<&LabelView>, actions: &mut Actions) {
    let Some(view) = labels else {
        ui.weak("Reading the store …");
        return;
    };
    let (done, wanted) = (view.progress.done(), view.progress.wanted());
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(format!("{done} of {wanted} trials")).strong());
        if let Some(next) = &view.next {
            let order = "One of the objects with the smallest share done, and not the same twice in a row";
            ui.weak(format!("next: {}", capital_title(&next.object))).on_hover_text(order);
        }
    });
    clear_ui(ui, view, actions);
    matches_ui(ui, view, actions);
    let next = view.next.as_ref().map(|next| next.object.as_str());
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 3.0;
        let seen = ui.scope_id().with("seen");
        let before: Option<String> = ui.data(|data| data.get_temp(seen));
        for object in &view.progress.objects {
            let is_next = next == Some(object.name.as_str());
            let row = row_ui(ui, object, is_next, actions);
            if is_next && before.as_deref() != next {
                ui.scroll_to_rect(row, Some(egui::Align::Center));
                ui.data_mut(|data| data.insert_temp(seen, object.name.clone()));
            }
        }
    });
}

/// Field that adds an object, and a button that removes all, once that is confirmed.
fn clear_ui(ui: &mut Ui, view: &LabelView, actions: &mut Actions) {
    let id = egui::Id::unique("plan to be cleared");
    let planned = view.progress.objects.iter().filter(|object| object.wanted > 0).count();
    if ui.data(|data| data.get_temp::<bool>(id)).is_some() {
        ui.horizontal_wrapped(|ui| {
            ui.label(format!("Remove all {planned} objects? Their trials stay."));
            let [remove, keep] = ["Remove all", "Keep"].map(|text| ui.button(text).clicked());
            if remove {
                actions.push(|app| app.edit_labels(LabelCommand::ClearPlan));
            }
            if remove || keep {
                ui.data_mut(|data| data.remove::<bool>(id));
            }
        });
        return;
    }
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let clear = ui.add_enabled(planned > 0, egui::Button::new("Clear"));
            if clear.on_hover_text("Remove all objects, for a plan of your own").clicked() {
                ui.data_mut(|data| data.insert_temp(id, true));
            }
            add_ui(ui, view, actions);
        });
    });
}

/// Field that adds an object.
fn add_ui(ui: &mut Ui, view: &LabelView, actions: &mut Actions) {
    let id = addition_id();
    let mut name = ui.data_mut(|data| data.get_temp::<String>(id)).unwrap_or_default();
    let response = ui.add(text_field(&mut name, id.with("field")).hint_text("add an object …").char_limit(80));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, "Add an object to the plan"));
    if response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) && !name.trim().is_empty() {
        // Part of a name is no new object: which one is meant is chosen below.
        let ObjectSearch { names, sure } = search_objects(known(view), &name, None);
        match sure.and_then(|place| names.into_iter().nth(place)) {
            Some(object) => {
                name.clear();
                actions.push(move |app| app.edit_labels(LabelCommand::Want(object, WANTED)));
            }
            None => response.request_focus(),
        }
    }
    ui.data_mut(|data| data.insert_temp(id, name));
}

fn addition_id() -> egui::Id {
    egui::Id::unique("plan addition")
}

/// Objects that have a name already.
fn known(view: &LabelView) -> Vec<String> {
    let built_in = catalogue().iter().map(|built_in| built_in.name.clone()).chain([EMPTY.to_owned()]);
    let planned = view.progress.objects.iter().map(|object| object.name.clone());
    built_in.chain(planned).collect::<BTreeSet<_>>().into_iter().collect()
}

/// What the text in the field may mean, to choose from.
fn matches_ui(ui: &mut Ui, view: &LabelView, actions: &mut Actions) {
    let name = ui.data(|data| data.get_temp::<String>(addition_id())).unwrap_or_default();
    if name.trim().is_empty() {
        return;
    }
    let known = known(view);
    ui.horizontal_wrapped(|ui| {
        for object in search_objects(known.clone(), &name, None).names.into_iter().take(NUMBERED_OBJECTS) {
            let new = !known.contains(&object);
            let text = format!("{}{}", capital_title(&object), if new { " (new)" } else { "" });
            if ui.small_button(text).clicked() {
                ui.data_mut(|data| data.remove::<String>(addition_id()));
                actions.push(move |app| app.edit_labels(LabelCommand::Want(object, WANTED)));
            }
        }
    });
}

/// Name, progress, and trials wanted; returns its place.
fn row_ui(ui: &mut Ui, object: &ObjectProgress, next: bool, actions: &mut Actions) -> Rect {
    let colours = theme::of(ui).colours();
    let ObjectProgress { name, wanted, done, flagged } = object;
    let row = ui.horizontal(|ui| {
        let size = vec2((ui.available_width() - 84.0).max(60.0), 22.0);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let flags = if *flagged > 0 { format!(", {flagged} flagged") } else { String::new() };
        let spoken = format!("{}: {done} of {wanted}{flags}", capital_title(name));
        response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, next, &spoken));
        let painter = ui.painter_at(rect);
        let lit = if response.hovered() || response.has_focus() { 0.12 } else { 0.0 };
        painter.rect_filled(rect, 3.0, colour(colours.raised.mix(colours.accent, lit)));
        let chosen = object.next();
        actions.on(&response.on_hover_text(format!("{spoken}. Record it next")), move |app| {
            app.edit_labels(LabelCommand::Next(chosen));
        });
        let share = |count: u32| (f64::from(count) / f64::from((*wanted).max(1))).min(1.0) as f32;
        let part = |from: f32, to: f32| {
            let x = |share: f32| rect.left() + rect.width() * share;
            Rect::from_min_max(pos2(x(from), rect.top()), pos2(x(to), rect.bottom()))
        };
        let sound = share(done.saturating_sub(*flagged));
        painter.rect_filled(part(0.0, sound), 3.0, veil(colours.accent, 0.45));
        painter.rect_filled(part(sound, share(*done)), 3.0, veil(colours.warning, 0.45));
        if next {
            let stroke = egui::Stroke::new(1.5, colour(colours.accent));
            painter.rect_stroke(rect, 3.0, stroke, egui::StrokeKind::Inside);
        }
        let (font, ink) = (egui::FontId::proportional(12.5), colour(colours.text));
        let count = rect.right_center() - vec2(6.0, 0.0);
        let count = painter.text(count, egui::Align2::RIGHT_CENTER, done.to_string(), font, ink);
        let room = rect.with_min_x(rect.left() + 6.0).with_max_x(count.left() - 6.0);
        put_line(ui, room, egui::Align2::LEFT_CENTER, &capital_title(name), 12.5, ink);
        let mut new = *wanted;
        let drag = DragValue::new(&mut new).range(0..=MOST_WANTED).speed(0.2);
        let sized = |ui: &mut Ui| ui.add_sized([40.0, 22.0], drag);
        let response = number_field(ui, ("wanted", name), sized).on_hover_text("Trials wanted");
        // Dragging has not ended.
        if new != *wanted && new > 0 && !response.dragged() {
            let name = name.clone();
            actions.push(move |app| app.edit_labels(LabelCommand::Want(name, new)));
        }
        let remove = ui.add_enabled(*wanted > 0, egui::Button::new("–").small());
        remove.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Remove {} from the plan", capital_title(name)))
        });
        if remove.on_hover_text("Remove it from the plan; its trials stay").clicked() {
            let name = name.clone();
            actions.push(|app| app.edit_labels(LabelCommand::Unplan(name)));
        }
    });
    row.response.rect
}
