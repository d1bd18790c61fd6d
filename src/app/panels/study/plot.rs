//! A plot of a study's figure: the row behind the point or cell under the pointer; a click opens its trials.

use super::{about_row_ui, opening};
use crate::app::actions::Actions;
use crate::app::figure_plot::{self, ShownPlot};
use crate::app::theme::{self, colour};
use crate::app::widgets::capital;
use egui::{Rect, RichText, Stroke, StrokeKind, Tooltip, Ui, Vec2};
use palpate_geometry::drawing::Plot;
use palpate_geometry::units::{symbol, three_digits, true_minus};
use palpate_study::jobs::StudyResult;
use palpate_study::{FigureLink, FigureMark, LinkedFigure};

/// Distance within which the pointer means a point (points).
const NEAR: f32 = 16.0;
/// Heights of a named row and of what stands around the rows (points).
const ROW: f32 = 15.0;
const AROUND: f32 = 64.0;
/// Least and largest height of other plots (points).
const HEIGHTS: [f32; 2] = [140.0, 380.0];

/// Labelled points of a plot up to which the labels are shown.
const MOST_LABELS: usize = 8;

/// Title of a plot, where it has one.
pub(super) fn title_ui(ui: &mut Ui, plot: &Plot) {
    if !plot.title.is_empty() {
        ui.add(egui::Label::new(RichText::new(capital(&plot.title)).small().strong()).truncate());
    }
}

pub(super) fn plot_ui(
    ui: &mut Ui,
    result: &StudyResult,
    (linked, number): (&LinkedFigure, usize),
    (room, alone): (f32, bool),
    actions: &mut Actions,
) {
    let plot = &linked.figure.plots[number];
    let [least, most] = HEIGHTS;
    let rows = plot.heat.as_ref().map_or(plot.y.ticks.len(), |heat| heat.y.count);
    let height = if rows > 0 {
        (ROW * rows as f32 + AROUND).max(least).max(if alone { room.min(1.6 * most) } else { 0.0 })
    } else {
        // Seen as a whole, with the titles of its axes.
        let own = (0.7 * ui.available_width()).clamp(least, most).min(room.max(least));
        own.max(if alone { room.min(1.2 * most) } else { 0.0 })
    };
    let id = format!("{} {number}", linked.name);
    // More than these would cover each other.
    let labels = plot.series.iter().flat_map(|series| &series.points).filter(|point| !point.label.is_empty()).count();
    let shown = figure_plot::show(ui, theme::of(ui), (&id, plot), height, false, |_| labels <= MOST_LABELS);
    let points: usize = plot.series.iter().map(|series| series.points.len()).sum();
    let text = match &plot.heat {
        Some(heat) => {
            format!("{}: {} by {} cells, {} in {}", plot.title, heat.y.count, heat.x.count, heat.quantity, heat.unit)
        }
        None => format!("{}: {points} points", plot.title),
    };
    shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Figure, true, &text));
    let links = linked.links.iter().filter(|link| link.plot == number);
    pointed_ui(ui, result, (plot, &shown), links, actions);
}

/// Place of a mark on the screen, and its distance from the pointer.
fn place(plot: &Plot, shown: &ShownPlot, mark: FigureMark, pointer: egui::Pos2) -> Option<(Rect, f32)> {
    match mark {
        FigureMark::Point(series, point) => {
            let at = plot.series.get(series)?.points.get(point)?.at;
            let at = shown.position(plot, at)?;
            Some((Rect::from_center_size(at, Vec2::splat(2.0 * NEAR)), at.distance(pointer)))
        }
        FigureMark::Cell(row, column) => {
            let cell = shown.cell(plot, row, column)?;
            cell.contains(pointer).then_some((cell, 0.0))
        }
    }
}

/// Marks what the pointer means and tells its row; a click opens its trials.
fn pointed_ui<'a>(
    ui: &mut Ui,
    result: &StudyResult,
    (plot, shown): (&Plot, &ShownPlot),
    links: impl Iterator<Item = &'a FigureLink>,
    actions: &mut Actions,
) {
    let Some(pointer) = shown.response.hover_pos() else { return };
    let places = links.filter_map(|link| Some((link, place(plot, shown, link.mark, pointer)?)));
    let nearest = places.min_by(|(_, a), (_, b)| a.1.total_cmp(&b.1)).filter(|(_, (_, distance))| *distance < NEAR);
    let Some((link, (rect, _))) = nearest else { return values_ui(ui, (plot, shown), pointer) };
    let Some(table) = result.stored.result.tables.get(link.table) else { return };
    let Some(row) = table.rows.get(link.row) else { return };
    mark_ui(ui, shown, rect, matches!(link.mark, FigureMark::Cell(..)), |ui| about_row_ui(ui, result, table, row));
    let Some(trials) = opening(result, row) else { return };
    ui.ctx().set_cursor_icon(egui::CursorIcon::PointingHand);
    actions.on(&shown.response, move |app| app.open_trials(&trials));
}

/// Marks a point or a cell, with what is said about it beside it.
fn mark_ui(ui: &Ui, shown: &ShownPlot, rect: Rect, is_cell: bool, about: impl FnOnce(&mut Ui)) {
    let stroke = Stroke::new(2.0, colour(theme::of(ui).colours().text));
    let painter = ui.painter().with_clip_rect(shown.response.rect.intersect(ui.clip_rect()));
    match is_cell {
        true => painter.rect_stroke(rect, 0.0, stroke, StrokeKind::Inside),
        false => painter.circle_stroke(rect.center(), 7.0, stroke),
    };
    // At once, without the delay of hints.
    let (ctx, response) = (ui.ctx().clone(), &shown.response);
    Tooltip::always_open(ctx, response.layer_id, response.id, rect).show(about);
}

/// Values of a point that belongs to no row.
fn values_ui(ui: &Ui, (plot, shown): (&Plot, &ShownPlot), pointer: egui::Pos2) {
    let series = plot.series.iter().rev();
    let points = series.flat_map(|series| series.points.iter().map(move |point| (series, point)));
    let places = points.filter_map(|(series, point)| {
        let at = shown.position(plot, point.at)?;
        Some((series, point, at, at.distance(pointer)))
    });
    let nearest = places.min_by(|a, b| a.3.total_cmp(&b.3)).filter(|(.., distance)| *distance < NEAR);
    let Some((series, point, at, _)) = nearest else { return };
    let names = [&series.name, &point.label].into_iter().filter(|name| !name.is_empty()).cloned();
    // An axis of names has no values.
    let axes = [&plot.x, &plot.y].into_iter().zip(point.at).filter(|(axis, _)| axis.ticks.is_empty());
    let values = axes.map(|(axis, value)| format!("{}: {}", symbol(&axis.title), true_minus(&three_digits(value))));
    let lines: Vec<String> = names.chain(values).collect();
    mark_ui(ui, shown, Rect::from_center_size(at, Vec2::splat(2.0 * NEAR)), false, |ui| {
        lines.into_iter().for_each(|line| _ = ui.label(RichText::new(line).small()));
    });
}
