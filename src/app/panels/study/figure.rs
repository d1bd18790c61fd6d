//! Figures of the chosen study: its plots, from which the pointer leads to rows and trials.

use super::plot::{plot_ui, title_ui};
use super::{part_title, result_ui};
use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::studies::{QUICK, Studies, is_quick};
use crate::app::figure_plot::{is_ambiguous, legend_ui};
use crate::app::theme;
use crate::app::widgets::wrapped;
use egui::{RichText, ScrollArea, Ui};
use palpate_study::jobs::{StudyOrigin, StudyResult};
use palpate_study::paper::paper_study;
use palpate_study::{LinkedFigure, StudySize};

/// Least width of a plot (points).
const LEAST_WIDTH: f32 = 300.0;
/// Room below a single row of plots (points).
const BELOW: f32 = 46.0;
/// Height of a title and a legend above each row of plots, and least height of plots that are seen at once (points).
const ABOVE: f32 = 44.0;
const SEEN: f32 = 220.0;

pub(in crate::app::panels) fn ui(ui: &mut Ui, studies: &Studies, actions: &mut Actions) {
    let Some(result) = result_ui(ui, studies, "study-figure", "figures", actions) else { return };
    let number = studies.figure_of(&result);
    header_ui(ui, studies, &result, number, actions);
    let Some(linked) = result.figures.get(number) else {
        ui.weak("This result has no figure.");
        return;
    };
    if !is_ambiguous(&linked.figure.plots) {
        legend_ui(ui, theme::of(ui), linked.figure.plots.iter().flat_map(|plot| &plot.series));
    }
    // Another figure begins at its top.
    ScrollArea::vertical().id_salt(&linked.name).auto_shrink(false).show(ui, |ui| {
        plots_ui(ui, &result, linked, actions);
        for line in linked.figure.note.lines().chain(result.stored.result.data.iter().map(String::as_str)) {
            wrapped(ui, RichText::new(line).small().weak());
        }
        wrapped(ui, RichText::new(result.stored.plain_origin()).small().weak());
    });
}

/// Title; origins and figures to choose from; the button that exports.
fn header_ui(ui: &mut Ui, studies: &Studies, result: &StudyResult, number: usize, actions: &mut Actions) {
    let card = studies.chosen().card();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        ui.strong(card.title);
        for other in studies.files(card.key).into_iter().flat_map(|files| &files.results) {
            let chosen = other.origin.is_like(result.origin);
            let button = ui.selectable_label(chosen, RichText::new(other.origin.title()).small());
            if button.on_hover_text(about_origin(other.origin)).clicked() {
                let origin = other.origin;
                actions.push(move |app| app.studies.show_result(origin));
            }
        }
        if result.figures.len() > 1 {
            ui.separator();
            for (k, figure) in result.figures.iter().enumerate() {
                let button =
                    ui.selectable_label(k == number, RichText::new(part_title(card.key, &figure.name)).small());
                actions.on(&button.on_hover_text(&figure.figure.title), move |app| app.studies.show_figure(k));
            }
        }
        actions.on(
            &ui.small_button("Export").on_hover_text("Save this figure as SVG or PNG (Ctrl+E)"),
            App::export_study_figure,
        );
    });
    let mut tables = result.stored.result.tables.iter();
    let opens = tables.any(|table| table.rows.iter().any(|row| !row.trials.is_empty()));
    let warning = match result.origin {
        _ if !result.current => "From other settings, methods or physics than today's: run the study again.",
        origin if is_quick(origin) => QUICK,
        StudyOrigin::Shipped if opens && paper_study(card.key).is_some() => {
            "Shipped result. After a run here, rows in blue open their trials."
        }
        StudyOrigin::Shipped => "Shipped result.",
        StudyOrigin::Run(_) => "",
    };
    let own_trials = opens && result.origin != StudyOrigin::Shipped;
    let opening = if own_trials { "Rows in blue open their trials." } else { "" };
    if !(warning.is_empty() && opening.is_empty()) {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(warning).small().color(ui.visuals().warn_fg_color));
            ui.label(RichText::new(opening).small().weak());
        });
    }
}

fn about_origin(origin: StudyOrigin) -> &'static str {
    match origin {
        StudyOrigin::Run(StudySize::Full) => "The full form, run here",
        StudyOrigin::Run(StudySize::Quick) => "The quick form, run here",
        StudyOrigin::Run(StudySize::Sample { .. }) => "A sample of a few objects and grasps, run here",
        StudyOrigin::Shipped => "The full form, as it comes with the program",
    }
}

/// Room of the scroll bar (points).
const SCROLL_BAR: f32 = 10.0;

/// All plots in rows, as many beside each other as there is room for.
fn plots_ui(ui: &mut Ui, result: &StudyResult, linked: &LinkedFigure, actions: &mut Actions) {
    let plots = &linked.figure.plots;
    // The scroll bar covers no number.
    ui.set_max_width(ui.available_width() - SCROLL_BAR);
    let most = if linked.figure.columns == 0 { plots.len() } else { linked.figure.columns };
    let fitting = (ui.available_width() / LEAST_WIDTH) as usize;
    let columns = most.min(plots.len()).min(fitting).max(1);
    // A single row fills the panel; more of them are seen at once where they are high enough then.
    let (whole, rows) = (ui.available_height() - BELOW, plots.len().div_ceil(columns).max(1));
    let each = whole / rows as f32 - ABOVE;
    let room = (if each >= SEEN { each } else { whole }, rows == 1);
    let own_legends = is_ambiguous(plots);
    for (row, chunk) in plots.chunks(columns).enumerate() {
        // Above the plots, so that the axes of a row are in line.
        if own_legends {
            ui.columns(columns, |uis| {
                for (ui, plot) in uis.iter_mut().zip(chunk) {
                    title_ui(ui, plot);
                    legend_ui(ui, theme::of(ui), plot.series.iter());
                }
            });
        }
        ui.columns(columns, |uis| {
            for (k, (ui, _)) in uis.iter_mut().zip(chunk).enumerate() {
                if !own_legends {
                    title_ui(ui, &plots[row * columns + k]);
                }
                plot_ui(ui, result, (linked, row * columns + k), room, actions);
            }
        });
    }
}
