//! Grasps so far, side by side: answer and confidence after each, and the running one.

use super::words::{percent, ranked, running, title};
use super::{Part, eased, fitted, put};
use crate::app::theme::{colour, veil};
use egui::{Align2, Rect, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};
use palpate_learn::Pmf;

/// Most grasps shown; of more, the last ones.
const MOST_CELLS: usize = 8;
/// Widest cell (points).
const WIDEST: f32 = 130.0;

/// Grasp of a cell.
#[derive(Clone, Copy)]
enum Grasp<'a> {
    Over(&'a Pmf),
    Running(Option<&'a Pmf>),
    ToCome,
    NotNeeded,
}

pub(super) fn ui(ui: &mut Ui, part: &Part<'_, '_>) {
    let view = part.view;
    let over = view.beliefs.len();
    let known = over + usize::from(view.listening);
    let last = view.rule.most_grasps.min(MOST_CELLS).max(known);
    let first = last.saturating_sub(MOST_CELLS);
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), part.measures.strip), Sense::hover());
    let width = (rect.width() / (last - first).max(1) as f32).min(WIDEST);
    for number in first..last {
        let grasp = match view.beliefs.get(number) {
            Some(belief) => Grasp::Over(belief),
            None if number == over && view.listening => Grasp::Running(running(view)),
            None if view.decision.is_some() => Grasp::NotNeeded,
            None => Grasp::ToCome,
        };
        let left = rect.left() + width * (number - first) as f32;
        let cell = Rect::from_min_size(pos2(left, rect.top()), vec2(width - 3.0, rect.height()));
        cell_ui(ui, part, number, grasp, cell);
    }
}

fn cell_ui(ui: &Ui, part: &Part<'_, '_>, number: usize, grasp: Grasp<'_>, cell: Rect) {
    let colours = part.colours();
    let labels = &part.view.labels;
    let named = |pmf: &Pmf| format!("{} {}", title(labels, pmf.top().0), percent(pmf.top().1));
    let count = number + 1;
    let (spoken, pmf, border) = match grasp {
        Grasp::Over(pmf) => (format!("Grasp {count}: {}", named(pmf)), Some(pmf), colours.border),
        Grasp::Running(Some(pmf)) => (format!("Grasp {count}, running: {}", named(pmf)), Some(pmf), colours.accent),
        Grasp::Running(None) => (format!("Grasp {count}, running"), None, colours.accent),
        Grasp::ToCome => (format!("Grasp {count}: not yet"), None, colours.border),
        Grasp::NotNeeded => (format!("Grasp {count}: not needed"), None, colours.border),
    };
    ui.interact(cell, ui.scope_id().with(("grasp", number)), Sense::hover())
        .on_hover_text(&spoken)
        .widget_info(|| WidgetInfo::labeled(Role::Label, true, &spoken));
    if !matches!(grasp, Grasp::NotNeeded) {
        ui.painter().rect_filled(cell, 4.0, colour(colours.raised));
    }
    if let Some(pmf) = pmf {
        shares_ui(ui, part, number, pmf, cell);
    }
    ui.painter().rect_stroke(cell, 4.0, Stroke::new(1.0, colour(border)), StrokeKind::Inside);
    let inside = cell.shrink2(vec2(4.0, 3.0));
    let quiet = colour(colours.quiet_text);
    let Some(pmf) = pmf else {
        put(ui, fitted(ui, &count.to_string(), 11.5, inside.width(), quiet), inside, Align2::CENTER_CENTER);
        return;
    };
    let (class, p) = pmf.top();
    let ink = colour(colours.text);
    let picture = Rect::from_min_size(inside.min, vec2(20.0, 20.0));
    let below = inside.with_min_y(picture.bottom());
    let number = fitted(ui, &percent(p), 12.5, inside.width(), ink);
    part.thumbnail(ui, &labels.classes[class].name, picture);
    if picture.width() + number.size().x + 4.0 <= inside.width() {
        put(ui, number, inside.with_max_y(picture.bottom()), Align2::RIGHT_CENTER);
        put(ui, fitted(ui, &title(labels, class), 11.5, inside.width(), ink), below, Align2::LEFT_BOTTOM);
    } else {
        put(ui, number, below, Align2::LEFT_BOTTOM);
    }
}

/// The two largest shares, stacked.
fn shares_ui(ui: &Ui, part: &Part<'_, '_>, number: usize, pmf: &Pmf, cell: Rect) {
    let colours = part.colours();
    let fills = [veil(colours.accent, 0.38), veil(colours.quiet_text, 0.22)];
    let mut level = cell.bottom();
    for (rank, (class, fill)) in ranked(pmf).into_iter().zip(fills).enumerate() {
        let share = eased(ui, ui.scope_id().with(("share", number, rank)), Some(pmf.probabilities()[class]));
        let top = (level - cell.height() * share).max(cell.top());
        ui.painter().rect_filled(Rect::from_x_y_ranges(cell.x_range(), top..=level), 2.0, fill);
        level = top;
    }
}
