//! Rows of the library: a table, or a list of two lines where it is narrow. Only rows in sight are drawn.

use super::columns::{self, Shows, cell, fitting, title};
use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::library::{LibraryFeature, LibrarySelection, Reach};
use crate::app::shown::Pinned;
use crate::app::theme::{self, colour};
use crate::app::thumbnails::Thumbnails;
use crate::app::widgets::{LEAST_COUNTS, LEAST_FORCE, capital, put_line as text, sparkline};
use egui::{Align2, Color32, FontId, Rect, Response, ScrollArea, Sense, Ui, pos2, vec2};
use palpate_geometry::palette::{ThemeColours, series_colour};
use palpate_lab::workers::LibraryView;
use palpate_store::labels::TrialEdit;
use palpate_store::{LibraryTrial, TrialColumn, TrialOrder, TrialPlace, TrialQuality, TrialQuery};
use palpate_tactile::trial::{TrialId, TrialSource};
use std::ops::Range;

/// Heights of rows in the table and in the list (points).
const TABLE_ROW: f32 = 30.0;
const LIST_ROW: f32 = 42.0;
/// Room between a column's text and the next column (points).
const GAP: f32 = 8.0;
/// Between the parts of a second line.
const BETWEEN: &str = "  \u{b7}  ";
/// Least room of a part that is cut (points).
const LEAST_CUT: f32 = 36.0;
/// Room of the scroll bar (points).
const SCROLL_BAR: f32 = 10.0;

pub(super) fn ui(
    ui: &mut Ui,
    (library, pinned): (&LibraryFeature, &[Pinned]),
    pictures: &Thumbnails,
    view: &LibraryView,
    actions: &mut Actions,
) {
    let picked = &library.selection;
    let room = ui.available_width() - SCROLL_BAR;
    let table = (room >= columns::TABLE).then(|| fitting(room));
    if let Some(columns) = &table {
        header_ui(ui, &picked.query, columns, actions);
    }
    let height = if table.is_some() { TABLE_ROW } else { LIST_ROW };
    ui.spacing_mut().item_spacing.y = 0.0;
    let seen = ui.scope_id().with("rows");
    let mut list = ScrollArea::vertical().auto_shrink(false);
    let before = ui.data(|data| data.get_temp::<Seen>(seen)).unwrap_or_default();
    let room = ui.available_height();
    let (cursor, shown) = (picked.cursor, picked.shown);
    let mut now = Seen { room, cursor, shown, query: view.query.clone(), ..Seen::default() };
    // One that is not in the list yet is new when it comes.
    now.place = now.shown.and_then(|id| place_of(view, id));
    now.shown = now.shown.filter(|_| now.place.is_some());
    if let Some(offset) = scroll_offset(&before, &now, view, height) {
        list = list.vertical_scroll_offset(offset);
        // An offset beyond the last picture's end is no swipe that springs back.
        ui.spacing_mut().scroll.kinetic.rubber_band = false;
    }
    let shown = list.show_rows(ui, height, view.found.len(), |ui, rows| {
        for trial in &view.found[rows.clone()] {
            let rect = row_ui(ui, (picked, pictures), view, trial, (table.as_deref(), height), actions);
            let id = trial.row.id;
            if let Some(compared) = pinned.iter().find(|own| own.trial.id == id && picked.shown != Some(id)) {
                // At the right end: the left one says which is shown.
                let edge = rect.with_min_x(rect.right() - 4.0).shrink2(vec2(0.0, 2.0));
                ui.painter().rect_filled(edge, 1.0, colour(series_colour(compared.colour, theme::of(ui))));
            }
        }
        rows
    });
    draw_seen(ui, seen, view, &shown.inner, actions);
    ui.data_mut(|data| data.insert_temp(seen, Seen { rows: shown.inner, ..now }));
}

/// What the last picture of the list has shown.
#[derive(Clone, Default)]
struct Seen {
    rows: Range<usize>,
    /// Height of the list (points).
    room: f32,
    cursor: Option<TrialId>,
    /// Trial that is shown, and its place in the list.
    shown: Option<TrialId>,
    place: Option<usize>,
    query: TrialQuery,
}

/// Asks for the sparklines of rows in sight, once for each set of rows.
fn draw_seen(ui: &Ui, seen: egui::Id, view: &LibraryView, rows: &Range<usize>, actions: &mut Actions) {
    let missing = |trial: &&std::sync::Arc<LibraryTrial>| !view.sparklines.contains_key(&trial.row.id);
    let ids: Vec<TrialId> = view.found[rows.clone()].iter().filter(missing).map(|trial| trial.row.id).collect();
    let asked = seen.with("asked");
    let before = ui.data(|data| data.get_temp::<Vec<TrialId>>(asked)).unwrap_or_default();
    // Those asked for before are on their way.
    if ids.iter().any(|id| !before.contains(id)) {
        ui.data_mut(|data| data.insert_temp(asked, ids.clone()));
        actions.push(|app| app.library.draw(ids));
    }
}

fn place_of(view: &LibraryView, id: TrialId) -> Option<usize> {
    view.found.iter().position(|trial| trial.row.id == id)
}

/// Offset that brings a newly selected trial into sight, or else one that is newly shown, also in another list.
fn scroll_offset(before: &Seen, now: &Seen, view: &LibraryView, height: f32) -> Option<f32> {
    let cursor = now.cursor.filter(|_| now.cursor != before.cursor);
    // What is above, below or in the list has grown: one that was in sight stays there.
    let lower = now.room < before.room;
    let moved = lower || now.place != before.place;
    let stays = moved && before.place.is_some_and(|place| before.rows.contains(&place));
    let is_new = (now.shown, &now.query) != (before.shown, &before.query);
    let place = place_of(view, cursor.or(now.shown.filter(|_| is_new || stays))?)?;
    if !lower && (before.rows.start + 1..before.rows.end.saturating_sub(1)).contains(&place) {
        return None;
    }
    let at = place as f32 * height;
    Some(if place <= before.rows.start { at } else { (at + height - now.room).max(0.0) })
}

/// Titles of columns; a click sorts.
fn header_ui(ui: &mut Ui, query: &TrialQuery, columns: &[(Shows, f32)], actions: &mut Actions) {
    let colours = theme::of(ui).colours();
    let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), 22.0), Sense::hover());
    ui.painter().hline(line.x_range(), line.bottom() - 0.5, egui::Stroke::new(1.0, colour(colours.border)));
    for (shows, rect) in placed(columns, line) {
        let Shows::Text(column) = shows else { continue };
        let response = ui.interact(rect, ui.scope_id().with(("sort", column.name())), Sense::click());
        let sorted = query.order.column == column;
        let name = format!("Sort by {}", column.name());
        response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, sorted, &name));
        let ink = if sorted || response.hovered() { colours.text } else { colours.quiet_text };
        let words = Rect::from_min_max(rect.min, pos2(rect.right() - GAP, rect.bottom()));
        let end = text(ui, words, Align2::LEFT_CENTER, title(column), 11.5, colour(ink));
        if sorted {
            triangle(
                ui,
                pos2((end + 7.0).min(rect.right() - 5.0), rect.center().y),
                query.order.descending,
                colour(ink),
            );
        }
        if response.clicked() {
            let descending = if sorted { !query.order.descending } else { column == TrialColumn::Date };
            let sorted = TrialQuery { order: TrialOrder { column, descending }, ..query.clone() };
            actions.push(|app| app.library.find(sorted));
        }
    }
}

/// Mark of the direction: up for rising values, down for falling ones.
fn triangle(ui: &Ui, at: egui::Pos2, descending: bool, ink: Color32) {
    let tip = if descending { 3.0 } else { -3.0 };
    let corners = vec![at + vec2(-3.5, -tip), at + vec2(3.5, -tip), at + vec2(0.0, tip)];
    ui.painter().add(egui::Shape::convex_polygon(corners, ink, egui::Stroke::NONE));
}

/// Places of columns in a line.
fn placed(columns: &[(Shows, f32)], line: Rect) -> Vec<(Shows, Rect)> {
    let mut left = line.left() + 4.0;
    let place = |(shows, width): &(Shows, f32)| {
        let rect = Rect::from_min_max(pos2(left, line.top()), pos2((left + width).min(line.right()), line.bottom()));
        left += width;
        (*shows, rect)
    };
    columns.iter().map(place).collect()
}

fn row_ui(
    ui: &mut Ui,
    (picked, pictures): (&LibrarySelection, &Thumbnails),
    view: &LibraryView,
    trial: &LibraryTrial,
    (table, height): (Option<&[(Shows, f32)]>, f32),
    actions: &mut Actions,
) -> Rect {
    let colours = theme::of(ui).colours();
    let id = trial.row.id;
    let selected = picked.selected.contains(&id);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
    let shown = picked.shown == Some(id);
    let name = format!("Trial {id}, {}{}", trial.title, if shown { ", shown" } else { "" });
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, selected, &name));
    if selected || response.hovered() || response.has_focus() {
        let share = if selected { 0.30 } else { 0.10 };
        ui.painter().rect_filled(
            rect.shrink2(vec2(0.0, 1.0)),
            4.0,
            colour(colours.background.mix(colours.accent, share)),
        );
    }
    if shown {
        let edge = Rect::from_min_size(rect.min + vec2(0.0, 1.0), vec2(4.0, height - 2.0));
        ui.painter().rect_filled(edge, 1.0, colour(colours.accent));
    } else if picked.cursor == Some(id) {
        let edge = Rect::from_min_size(rect.min + vec2(0.0, 3.0), vec2(2.5, height - 6.0));
        ui.painter().rect_filled(edge, 1.0, colour(colours.quiet_text));
    }
    match table {
        Some(columns) => table_row(ui, pictures, view, trial, &placed(columns, rect)),
        None => list_row(ui, pictures, view, (trial, shown), rect),
    }
    answer(ui, &response, trial, selected, actions);
    response.on_hover_ui(|ui| hint_ui(ui, view, trial));
    rect
}

/// Clicks on a row.
fn answer(ui: &Ui, response: &Response, trial: &LibraryTrial, selected: bool, actions: &mut Actions) {
    let id = trial.row.id;
    let modifiers = ui.input(|input| input.modifiers);
    if response.clicked() {
        let reach = match (modifiers.shift, modifiers.command) {
            (true, _) => Reach::Range,
            (_, true) => Reach::Toggle,
            _ => Reach::Alone,
        };
        actions.push(move |app| app.library.select(id, reach));
    }
    if response.double_clicked() && !modifiers.shift && !modifiers.command {
        actions.push(App::open_selected);
    }
    // A menu is about the selection; opened beside it, about its row.
    if response.secondary_clicked() && !selected {
        actions.push(move |app| app.library.select(id, Reach::Alone));
    }
    response.context_menu(|ui| {
        let gone = trial.row.deleted.is_some();
        let logged = trial.row.place == TrialPlace::DemoLog;
        /// Whether it is offered, its name, and what it does.
        type Choice = (bool, &'static str, fn(&mut App));
        let choices: [Choice; 5] = [
            (!gone, "Open", App::open_selected),
            (!gone, "Compare", App::pin_selected),
            (!gone && logged, "Keep", |app| app.library.edit(TrialEdit::Keep)),
            (!gone, "Discard", |app| app.library.edit(TrialEdit::Discard)),
            (gone, "Restore", |app| app.library.edit(TrialEdit::Restore)),
        ];
        for (_, name, action) in choices.into_iter().filter(|(offered, ..)| *offered) {
            if ui.button(name).clicked() {
                actions.push(action);
                ui.close();
            }
        }
    });
}

/// Everything that is known, for a row whose texts may be cut.
fn hint_ui(ui: &mut Ui, view: &LibraryView, trial: &LibraryTrial) {
    ui.strong(format!("Trial {}: {}", trial.row.id, capital(&trial.title)));
    let row = &trial.row;
    let samples = format!("{} samples", row.samples);
    ui.label([cell(view, trial, TrialColumn::Date), cell(view, trial, TrialColumn::Source), samples].join(", "));
    for (title, text) in [
        ("object", &row.object),
        ("collection", row.collection.as_ref().unwrap_or(&String::new())),
        ("sensors", &row.sensors),
        ("tags", &row.tags.join(", ")),
        ("note", &row.note),
    ] {
        if !text.is_empty() {
            ui.label(format!("{title}: {text}"));
        }
    }
    for found in &row.flags {
        ui.label(format!("{}: {}", found.flag.label(), found.remark));
    }
    if row.warnings > 0 {
        let warnings = if row.warnings == 1 { "warning" } else { "warnings" };
        ui.label(format!("{} {warnings}; open the trial to read", row.warnings));
    }
    if !row.sound {
        ui.label("unsound: data sets exclude it");
    }
    if row.place == TrialPlace::DemoLog {
        ui.label("in the demo log: data sets exclude it, and newer grasps push it out; K keeps it");
    }
}

fn table_row(ui: &Ui, pictures: &Thumbnails, view: &LibraryView, trial: &LibraryTrial, places: &[(Shows, Rect)]) {
    let colours = theme::of(ui).colours();
    for (shows, rect) in places {
        let inner = Rect::from_min_max(rect.min, pos2(rect.right() - GAP, rect.bottom()));
        match shows {
            Shows::Thumbnail => thumbnail(ui, pictures, trial, inner.shrink2(vec2(0.0, 3.0))),
            Shows::Sparkline => {
                if let Some(lines) = view.sparklines.get(&trial.row.id) {
                    sparkline(ui, (lines, least_of(trial)), inner.shrink2(vec2(0.0, 4.0)));
                }
            }
            Shows::Text(column) => {
                let ink = ink(&colours, trial, *column);
                text(ui, inner, Align2::LEFT_CENTER, &cell(view, trial, *column), 13.0, colour(ink));
            }
        }
    }
}

/// Two lines: title and date, then the rest in small print.
fn list_row(ui: &Ui, pictures: &Thumbnails, view: &LibraryView, (trial, shown): (&LibraryTrial, bool), rect: Rect) {
    let colours = theme::of(ui).colours();
    let inside = rect.shrink2(vec2(6.0, 4.0));
    let side = inside.height();
    let picture = Rect::from_min_size(inside.min, vec2(side, side));
    if pictures.get(&trial.row.object).is_some() {
        thumbnail(ui, pictures, trial, picture);
    } else if let Some(lines) = view.sparklines.get(&trial.row.id) {
        sparkline(ui, (lines, least_of(trial)), picture);
    }
    let words = Rect::from_min_max(pos2(picture.right() + GAP, inside.top()), inside.max);
    let (date, name) = (cell(view, trial, TrialColumn::Date), cell(view, trial, TrialColumn::Object));
    let quiet = colour(colours.quiet_text);
    let width_of = |text: &str, size: f32| {
        ui.painter().layout_no_wrap(text.to_owned(), FontId::proportional(size), quiet).size().x
    };
    // The name comes first; what is left of the date begins the second line.
    let room = words.width() - width_of(&name, 13.5) - GAP;
    let day = date.split(' ').next().unwrap_or_default();
    let said = [date.as_str(), day].into_iter().find(|text| width_of(text, 11.5) <= room).unwrap_or_default();
    let width = width_of(said, 11.5);
    let upper = Rect::from_min_max(words.min, pos2(words.right(), words.center().y));
    text(ui, upper, Align2::RIGHT_CENTER, said, 11.5, quiet);
    let title = Rect::from_min_max(upper.min, pos2(upper.right() - width - GAP, upper.bottom()));
    let ink_of = |column: TrialColumn| colour(ink(&colours, trial, column));
    text(ui, title, Align2::LEFT_CENTER, &name, 13.5, ink_of(TrialColumn::Object));
    let lower = Rect::from_min_max(pos2(words.left(), words.center().y), words.max);
    let quality = cell(view, trial, TrialColumn::Quality);
    let plain = trial.row.deleted.is_none() && trial.quality() == TrialQuality::Sound;
    let mut left = lower.left();
    let first = [("shown", colour(colours.accent), shown), (&quality, ink_of(TrialColumn::Quality), !plain)];
    for (word, ink, _) in first.into_iter().filter(|(.., said)| *said) {
        left = text(ui, lower.with_min_x(left), Align2::LEFT_CENTER, word, 11.5, ink) + GAP;
    }
    let preset = trial.row.preset.map(|name| format!("preset {name}")).unwrap_or_default();
    let tags: String = trial.row.tags.iter().map(|tag| format!("#{tag} ")).collect();
    let number = format!("no {}", trial.row.id);
    let time = date[said.len()..].to_owned();
    let parts = [time, number, cell(view, trial, TrialColumn::Source), tags, trial.row.note.clone(), preset];
    let mut parts: Vec<&str> = parts.iter().map(|part| part.trim()).filter(|part| !part.is_empty()).collect();
    let rest = Rect::from_min_max(pos2(left, lower.top()), lower.max);
    // The name above says what most presets do.
    if trial.row.preset.is_some() && width_of(&parts.join(BETWEEN), 11.5) > rest.width() {
        parts.pop();
    }
    // A letter or two of the last one say nothing.
    while parts.len() > 1 && width_of(&parts[..parts.len() - 1].join(BETWEEN), 11.5) + LEAST_CUT > rest.width() {
        parts.pop();
    }
    text(ui, rest, Align2::LEFT_CENTER, &parts.join(BETWEEN), 11.5, quiet);
}

fn ink(colours: &ThemeColours, trial: &LibraryTrial, column: TrialColumn) -> palpate_geometry::palette::Rgb {
    match column {
        TrialColumn::Quality if trial.row.deleted.is_some() => colours.error,
        TrialColumn::Quality => match trial.quality() {
            TrialQuality::Sound => colours.quiet_text,
            TrialQuality::Warned => colours.warning,
            TrialQuality::Unsound | TrialQuality::Damaged => colours.error,
        },
        TrialColumn::Object if trial.row.object.is_empty() => colours.warning,
        TrialColumn::Object => colours.text,
        _ => colours.quiet_text,
    }
}

/// Least range of the sparkline of a trial.
fn least_of(trial: &LibraryTrial) -> f32 {
    if trial.row.source == TrialSource::Recorded { LEAST_COUNTS } else { LEAST_FORCE }
}

fn thumbnail(ui: &Ui, pictures: &Thumbnails, trial: &LibraryTrial, place: Rect) {
    let Some(texture) = pictures.get(&trial.row.object) else { return };
    let side = place.width().min(place.height());
    let square = Rect::from_center_size(place.center(), vec2(side, side));
    egui::Image::new(texture).corner_radius(3.0).paint_at(ui, square);
}
