//! Tables of the chosen study; a click on a row opens its trials.

use super::{about_row_ui, cell_text, hint, opening, part_title, result_ui};
use crate::app::actions::Actions;
use crate::app::features::studies::{Studies, is_quick};
use crate::app::theme::{self, colour};
use crate::app::widgets::put_line;
use egui::{Align, Align2, Color32, FontId, Layout, Rect, RichText, ScrollArea, Sense, Ui, pos2, vec2};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::symbol;
use palpate_study::jobs::StudyResult;
use palpate_study::{Cell, StudyRow, StudyTable};

/// Height of a row, room between columns, widest column (points).
const ROW: f32 = 21.0;
const GAP: f32 = 14.0;
const WIDEST: f32 = 300.0;
/// Size of the texts (points).
const SIZE: f32 = 12.5;
/// Rows that are seen in a low panel.
const IN_SIGHT: usize = 4;
/// Rows whose texts decide the widths of columns.
const MEASURED: usize = 300;

pub(in crate::app::panels) fn ui(ui: &mut Ui, studies: &Studies, actions: &mut Actions) {
    let Some(result) = result_ui(ui, studies, "study-tables", "tables", actions) else { return };
    let tables = &result.stored.result.tables;
    let key = studies.chosen().card().key;
    let id = egui::Id::unique(("study table", key));
    let mut chosen = ui.data_mut(|data| data.get_temp::<usize>(id)).unwrap_or(0).min(tables.len().saturating_sub(1));
    let Some(first) = tables.get(chosen) else {
        ui.weak("This result has no table.");
        return;
    };
    if tables.len() > 1 {
        ui.horizontal_wrapped(|ui| {
            for (k, table) in tables.iter().enumerate() {
                let button = ui.selectable_label(k == chosen, RichText::new(part_title(key, &table.name)).small());
                if button.on_hover_text(&table.title).clicked() {
                    chosen = k;
                    ui.data_mut(|data| data.insert_temp(id, k));
                }
            }
        });
    }
    let table = tables.get(chosen).unwrap_or(first);
    let first = table.rows.iter().position(|row| opening(&result, row).is_some());
    let mut goes = false;
    ui.allocate_ui_with_layout(vec2(ui.available_width(), ROW), Layout::right_to_left(Align::Center), |ui| {
        if ui.small_button("Export").on_hover_text("Write this table as CSV").clicked() {
            let quick = if is_quick(result.origin) { "-quick" } else { "" };
            let (name, text) = (format!("{}{quick}", table.name), table.csv());
            actions.push(move |app| app.export_table(&name, text));
        }
        if let Some(first) = first.filter(|first| *first >= IN_SIGHT) {
            goes = ui.small_button(format!("To row {}, which opens trials", first + 1)).clicked();
        }
        ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
            ui.add(egui::Label::new(RichText::new(&table.title).strong()).truncate());
        });
    });
    table_ui(ui, (theme::of(ui), first.filter(|_| goes)), &result, table, actions);
}

/// Columns, from their left ends to their right ones, and whether they hold numbers.
fn columns(ui: &Ui, table: &StudyTable) -> Vec<(f32, f32, bool)> {
    let font = FontId::proportional(SIZE);
    let width = |text: String| ui.painter().layout_no_wrap(text, font.clone(), Color32::WHITE).size().x;
    let mut left = 6.0;
    let mut places = Vec::new();
    for (k, column) in table.columns.iter().enumerate() {
        let cells = || table.rows.iter().take(MEASURED).filter_map(move |row| row.cells.get(k));
        let widest = cells().map(|cell| width(cell_text(cell, column))).fold(width(symbol(&column.titled())), f32::max);
        // The last one has room to the right.
        let most = if k + 1 == table.columns.len() { f32::INFINITY } else { WIDEST };
        let right = left + widest.min(most);
        places.push((left, right, cells().all(|cell| !matches!(cell, Cell::Text(_)))));
        left = right + GAP;
    }
    places
}

/// Draws a table, from a row on where it is to come into sight.
fn table_ui(
    ui: &mut Ui,
    (theme, sought): (Theme, Option<usize>),
    result: &StudyResult,
    table: &StudyTable,
    actions: &mut Actions,
) {
    let places = columns(ui, table);
    let colours = theme.colours();
    // Another table begins at its top.
    ScrollArea::horizontal().id_salt(&table.name).auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        let whole = places.last().map_or(0.0, |(_, right, _)| right + GAP).max(ui.available_width());
        let (header, _) = ui.allocate_exact_size(vec2(whole, ROW), Sense::hover());
        let titles = table.columns.iter().map(|column| symbol(&column.titled()));
        texts(ui, header, &places, titles, colour(colours.quiet_text));
        let mut rows = ScrollArea::vertical().id_salt(&table.name).auto_shrink(false);
        if let Some(sought) = sought {
            rows = rows.vertical_scroll_offset(ROW * sought as f32);
        }
        rows.show_rows(ui, ROW, table.rows.len(), |ui, rows| {
            for at in rows {
                if let Some(row) = table.rows.get(at) {
                    row_ui(ui, theme, result, (table, row), (whole, &places), actions);
                }
            }
        });
    });
}

fn row_ui(
    ui: &mut Ui,
    theme: Theme,
    result: &StudyResult,
    (table, row): (&StudyTable, &StudyRow),
    (whole, places): (f32, &[(f32, f32, bool)]),
    actions: &mut Actions,
) {
    let colours = theme.colours();
    let trials = opening(result, row);
    let (rect, response) = ui.allocate_exact_size(vec2(whole, ROW), Sense::click());
    let cells: Vec<String> = row.cells.iter().zip(&table.columns).map(|(cell, own)| cell_text(cell, own)).collect();
    let label = format!("Row {}", cells.join(", "));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, trials.is_some(), &label));
    if response.hovered() || response.has_focus() {
        ui.painter().rect_filled(rect, 3.0, colour(colours.background.mix(colours.accent, 0.14)));
    }
    // Like a link where it leads to trials.
    let ink = colour(if trials.is_some() { colours.accent } else { colours.text });
    texts(ui, rect, &places[..1.min(places.len())], cells.iter().take(1).cloned(), ink);
    texts(ui, rect, &places[1.min(places.len())..], cells.into_iter().skip(1), colour(colours.text));
    let clicked = response.clicked();
    // Cells in sight are not said again, over the rows above.
    let in_sight = whole <= ui.clip_rect().width() + 1.0;
    response.on_hover_ui(|ui| match in_sight {
        true => _ = ui.label(RichText::new(hint(result, row)).small().weak()),
        false => about_row_ui(ui, result, table, row),
    });
    match trials {
        Some(trials) if clicked => actions.push(move |app| app.open_trials(&trials)),
        None if clicked => {
            let why = hint(result, row);
            actions.push(move |app| app.notices.info(format!("{why}.")));
        }
        _ => {}
    }
}

/// Texts in their columns: numbers to the right.
fn texts(ui: &Ui, row: Rect, places: &[(f32, f32, bool)], texts: impl Iterator<Item = String>, ink: Color32) {
    for ((left, right, number), text) in places.iter().zip(texts) {
        let [left, right] = [left, right].map(|x| row.left() + x);
        let room = Rect::from_min_max(pos2(left, row.top()), pos2(right + 1.0, row.bottom()));
        let align = if *number { Align2::RIGHT_CENTER } else { Align2::LEFT_CENTER };
        put_line(ui, room, align, &text, SIZE, ink);
    }
}
