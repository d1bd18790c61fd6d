//! What the program thinks: its guess, and a bar for each grasp of the round with the threshold across them, so that one
//! sees the evidence add up.

use super::{Page, put};
use crate::app::panels::recognition::words::{Headline, percent, running, title};
use crate::app::theme::{colour, veil};
use egui::{Align2, Rect, Stroke, StrokeKind, Ui, pos2, vec2};
use palpate_lab::grasping::IdentificationView;
use palpate_learn::Pmf;

/// Most grasps shown; of more, the last ones.
const MOST_ROWS: usize = 5;
/// Height of the line with the threshold; width of the number of a grasp before its bar, and of the probability behind it
/// (heights of the smallest letters).
const HEAD: f32 = 1.6;
const NUMBER: f32 = 1.5;
const SHARE: f32 = 3.6;

/// The bar in a row.
fn bar_of(row: Rect, unit: f32) -> Rect {
    Rect::from_x_y_ranges(row.left() + NUMBER * unit..=row.right() - SHARE * unit, row.y_range())
}

impl Page<'_> {
    /// The newest answer and its probability.
    pub(super) fn guess_ui(&self, ui: &Ui, view: &IdentificationView, place: Rect) {
        let (colours, unit) = (self.app.view.theme.colours(), self.unit);
        let (ink, quiet) = (colour(colours.text), colour(colours.quiet_text));
        let headline = Headline::of(view);
        let (text, p) = headline.text(&view.labels);
        let class = headline.class().map(|class| &view.labels.classes[class].name);
        let side = place.height();
        self.portrait(ui, class.map(String::as_str), Rect::from_min_size(place.min, vec2(side, side)));
        let lines = place.with_min_x(place.left() + side + unit);
        let (said, large) = lines.split_top_bottom_at_y(lines.top() + 1.5 * unit);
        let about = if view.decision.is_some() { "It says" } else { "It thinks" };
        put(ui, self.line(ui, about, unit, said.width(), quiet), said, Align2::LEFT_CENTER);
        let number = self.line(ui, &p.map_or_else(String::new, percent), 2.0 * unit, 0.4 * large.width(), ink);
        let room = large.width() - number.size().x - 0.5 * unit;
        put(ui, self.line(ui, &text, 2.0 * unit, room, ink), large, Align2::LEFT_CENTER);
        put(ui, number, large, Align2::RIGHT_CENTER);
        let spoken = p.map_or_else(|| format!("{about}: {text}"), |p| format!("{about}: {text}, {}", percent(p)));
        self.speak(ui, "guess", place, &spoken);
    }

    /// A bar for each grasp of the round, with the threshold across them.
    pub(super) fn beliefs_ui(&self, ui: &Ui, view: &IdentificationView, place: Rect) {
        let (colours, unit) = (self.app.view.theme.colours(), self.unit);
        let (head, rows) = place.split_top_bottom_at_y(place.top() + HEAD * unit);
        let known = view.beliefs.len() + usize::from(view.listening);
        let last = view.rule.most_grasps.min(MOST_ROWS).max(known);
        let first = last.saturating_sub(MOST_ROWS);
        let height = rows.height() / (last - first).max(4) as f32;
        let bars = bar_of(rows, unit);
        for number in first..last {
            let top = rows.top() + height * (number - first) as f32;
            let row = Rect::from_min_max(pos2(rows.left(), top), pos2(rows.right(), top + height - 0.3 * unit));
            self.belief_ui(ui, view, number, row);
        }
        // The threshold, and what it is.
        let x = bars.left() + view.rule.threshold.clamp(0.0, 1.0) as f32 * bars.width();
        let drawn = if view.decision.is_some() { known.min(MOST_ROWS) } else { last - first };
        let foot = rows.top() + height * drawn as f32 - 0.3 * unit;
        let stroke = Stroke::new(0.16 * unit, colour(colours.text));
        ui.painter().vline(x, head.bottom() - 0.3 * unit..=foot, stroke);
        let text = format!("decides at {}", percent(view.rule.threshold));
        let ink = colour(colours.quiet_text);
        let label = self.line(ui, &text, unit, 0.6 * head.width(), ink);
        let right = (x + 0.5 * label.size().x).min(head.right());
        put(ui, label, head.with_max_x(right), Align2::RIGHT_TOP);
        put(ui, self.line(ui, "Grasp", unit, 0.3 * head.width(), ink), head, Align2::LEFT_TOP);
    }

    fn belief_ui(&self, ui: &Ui, view: &IdentificationView, number: usize, row: Rect) {
        let (colours, unit) = (self.app.view.theme.colours(), self.unit);
        let over = view.beliefs.len();
        let runs = number == over && view.listening;
        let pmf: Option<&Pmf> = match view.beliefs.get(number) {
            Some(belief) => Some(belief),
            None => running(view).filter(|_| runs),
        };
        let needed = pmf.is_some() || runs || view.decision.is_none();
        let bar = bar_of(row, unit);
        let ink = colour(if needed { colours.text } else { colours.border });
        if needed {
            put(ui, self.line(ui, &(number + 1).to_string(), 1.1 * unit, NUMBER * unit, ink), row, Align2::LEFT_CENTER);
            ui.painter().rect_filled(bar, 0.25 * unit, colour(colours.background));
        }
        if let Some((class, p)) = pmf.map(Pmf::top) {
            let fill = bar.with_max_x(bar.left() + p.clamp(0.0, 1.0) as f32 * bar.width());
            ui.painter().rect_filled(fill, 0.25 * unit, veil(colours.accent, 0.45));
            let inside = bar.shrink2(vec2(0.5 * unit, 0.0));
            let name = title(&view.labels, class);
            put(ui, self.line(ui, &name, 1.1 * unit, inside.width(), ink), inside, Align2::LEFT_CENTER);
            put(ui, self.line(ui, &percent(p), 1.1 * unit, (SHARE - 0.4) * unit, ink), row, Align2::RIGHT_CENTER);
            let running = if runs { ", running" } else { "" };
            let spoken = format!("Grasp {}{running}: {name} {}", number + 1, percent(p));
            self.speak(ui, &format!("grasp {number}"), row, &spoken);
        }
        if needed {
            let edge = if runs { colours.accent } else { colours.border };
            let stroke = Stroke::new(if runs { 0.16 * unit } else { 1.0 }, colour(edge));
            ui.painter().rect_stroke(bar, 0.25 * unit, stroke, StrokeKind::Inside);
        }
    }
}
