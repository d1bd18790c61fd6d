//! Study mode: the studies, the figures, tables and findings of the one that is chosen. A click on a point, cell
//! or row opens the trials behind it.

pub(super) mod figure;
pub(super) mod findings;
pub(super) mod list;
mod plot;
pub(super) mod tables;

use crate::app::actions::Actions;
use crate::app::features::studies::Studies;
use crate::app::widgets::{capital, just_opened, wrapped};
use egui::{RichText, Ui};
use palpate_geometry::palette::SERIES_COLOURS;
use palpate_geometry::units::symbol;
use palpate_sim::objects::object_title;
use palpate_study::jobs::{StudyOrigin, StudyResult};
use palpate_study::{Cell, StudyColumn, StudyRow, StudyTable};
use std::sync::Arc;

/// Result of the chosen study. Without one the panel says what to do.
fn result_ui(
    ui: &mut Ui,
    studies: &Studies,
    panel: &str,
    what: &str,
    actions: &mut Actions,
) -> Option<Arc<StudyResult>> {
    if just_opened(ui, panel) {
        actions.push(|app| app.studies.look());
    }
    let result = studies.result();
    if result.is_none() {
        let card = studies.chosen().card();
        let text = match studies.running() {
            _ if studies.files(card.key).is_none() => "Reading the results …".to_owned(),
            Some(running) if running.command.key == card.key => {
                format!("{}: its {what} appear here when the run is over.", card.title)
            }
            _ => {
                format!("{}: no {what} yet. Run the study: Enter for the quick form, Shift+Enter in full.", card.title)
            }
        };
        wrapped(ui, RichText::new(text).weak());
    }
    result
}

/// Columns with names of classes.
const CLASSES: [&str; 3] = ["object", "true", "predicted"];

/// Text of a cell, with the titles of objects.
fn cell_text(cell: &Cell, column: &StudyColumn) -> String {
    let text = cell.shown(&column.unit);
    match cell {
        Cell::Text(_) if CLASSES.contains(&column.name.as_str()) => object_title(&text),
        _ => text,
    }
}

/// Title of a table or figure of a study: `signatures-rates` of the study `signatures` is `Rates`.
fn part_title(study: &str, name: &str) -> String {
    let rest = name.strip_prefix(study).map(|rest| rest.trim_start_matches('-'));
    capital(&rest.filter(|rest| !rest.is_empty()).unwrap_or(name).replace('-', " "))
}

/// The trials behind a row; none where they are not in the store of the window.
fn opening(result: &StudyResult, row: &StudyRow) -> Option<StudyRow> {
    let own = !row.trials.is_empty() && result.origin != StudyOrigin::Shipped;
    own.then(|| row.clone())
}

/// What a click on a row does, or why it does nothing.
fn hint(result: &StudyResult, row: &StudyRow) -> String {
    match (row.trials.as_slice(), result.origin) {
        ([], _) => "No trials are kept for this row".to_owned(),
        (_, StudyOrigin::Shipped) => "Run the study here to open its trials".to_owned(),
        ([only], _) => format!("Click to open trial {only} in Inspect"),
        (all, _) if all.len() <= SERIES_COLOURS + 1 => format!("Click to open its {} trials in Inspect", all.len()),
        (all, _) => format!("Click to open {} of the {} trials kept of it in Inspect", SERIES_COLOURS + 1, all.len()),
    }
}

/// Row of a table under the pointer: a line for each column, and what a click does.
fn about_row_ui(ui: &mut Ui, result: &StudyResult, table: &StudyTable, row: &StudyRow) {
    ui.spacing_mut().item_spacing.y = 2.0;
    for (cell, column) in row.cells.iter().zip(&table.columns) {
        let text = cell_text(cell, column);
        if *cell != Cell::Missing && !text.is_empty() {
            let unit = symbol(&column.unit);
            let one = unit.strip_suffix('s').filter(|one| text == "1" && one.len() > 1);
            let unit = one.unwrap_or(&unit);
            let gap = if unit.is_empty() { "" } else { " " };
            ui.label(RichText::new(format!("{}: {text}{gap}{unit}", column.name)).small());
        }
    }
    ui.label(RichText::new(hint(result, row)).small().weak());
}
