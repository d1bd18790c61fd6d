//! The true object, and whether the program was right: by a tick or cross, a word and a colour.

use super::{Page, put};
use crate::app::theme::colour;
use egui::{Align2, Color32, Pos2, Rect, Stroke, Ui, pos2, vec2};
use palpate_sim::objects::object_title;

impl Page<'_> {
    /// The true object, once there is a verdict.
    pub(super) fn verdict_ui(&self, ui: &Ui, place: Rect) {
        let (colours, unit) = (self.app.view.theme.colours(), self.unit);
        let Some(snapshot) = self.app.snapshot() else { return };
        let truth = snapshot.truth();
        let title = snapshot.object.as_ref().map_or_else(|| object_title(truth), |object| object.title.clone());
        let finished = snapshot.status.finished;
        let right = self.answer().filter(|_| finished).and_then(|view| view.is_right(truth));
        let (word, ink) = match right {
            Some(true) => ("Right", colours.good),
            Some(false) => ("Wrong", colours.error),
            None if finished => ("No verdict", colours.quiet_text),
            None => ("What is it?", colours.quiet_text),
        };
        let edge = Rect::from_min_max(place.left_top() - vec2(0.0, 0.5 * unit), place.right_top());
        let stroke = Stroke::new(0.12 * unit, colour(if right.is_some() { ink } else { colours.border }));
        ui.painter().hline(edge.x_range(), edge.top(), stroke);
        let side = place.height();
        self.portrait(ui, Some(truth).filter(|_| finished), Rect::from_min_size(place.min, vec2(side, side)));
        let lines = place.with_min_x(place.left() + side + unit);
        let (head, below) = lines.split_top_bottom_at_y(lines.top() + 0.56 * side);
        let mut words = head;
        if let Some(right) = right {
            let middle = pos2(head.left() + 1.4 * unit, head.center().y);
            ui.painter().circle_filled(middle, 1.4 * unit, colour(ink));
            mark(ui, right, middle, unit, colour(colours.background));
            words = head.with_min_x(head.left() + 3.4 * unit);
        }
        put(ui, self.line(ui, word, 2.2 * unit, words.width(), colour(ink)), words, Align2::LEFT_CENTER);
        let name = if finished { format!("It is: {title}") } else { "Shown once it decides.".to_owned() };
        let quiet = colour(if finished { colours.text } else { colours.quiet_text });
        put(ui, self.line(ui, &name, 1.4 * unit, below.width(), quiet), below, Align2::LEFT_CENTER);
        let spoken = if finished { format!("{word}: it is {title}") } else { word.to_owned() };
        self.speak(ui, "truth", lines, &spoken);
    }
}

/// A tick or a cross, as large as the letters around it.
fn mark(ui: &Ui, right: bool, middle: Pos2, unit: f32, ink: Color32) {
    let stroke = Stroke::new(0.36 * unit, ink);
    let at = |x: f32, y: f32| middle + vec2(x, y) * unit;
    if right {
        ui.painter().line(vec![at(-0.62, 0.05), at(-0.18, 0.5), at(0.66, -0.46)], stroke);
    } else {
        ui.painter().line_segment([at(-0.5, -0.5), at(0.5, 0.5)], stroke);
        ui.painter().line_segment([at(-0.5, 0.5), at(0.5, -0.5)], stroke);
    }
}
