//! Presenter mode: the touch fills the window, beside it a column that tells what happens, what the program thinks after
//! each grasp and why, and at last the true object. Nothing is smaller than a 36th of the window's height.

mod beliefs;
mod letters;
mod verdict;
mod words;

use crate::app::context::PanelContext;
use crate::app::features::presenter::Score;
use crate::app::panels::view3d;
use crate::app::theme::{colour, veil};
use egui::{Align2, Rect, Role, Ui, WidgetInfo, vec2};
use letters::{line, paragraph};
use palpate_lab::grasping::{IdentificationView, Presentation};

/// Smallest letters: a share of the window's height.
const LETTERS: f32 = 1.0 / 36.0;
/// Letters of the annotations of a picture (points).
const PICTURE_LETTERS: f32 = 14.0;
/// Width of the column: a share of the window's, within limits in heights of the smallest letters.
const COLUMN: f32 = 0.385;
const NARROWEST: f32 = 20.0;
const WIDEST: f32 = 26.0;

/// Heights of the parts of the column from above, and the gap between them (heights of the smallest letters). The verdict
/// stands at the bottom.
const STORY: f32 = 4.2;
const GUESS: f32 = 4.6;
const BELIEFS: f32 = 10.4;
const REASON: f32 = 6.0;
const VERDICT: f32 = 5.4;
const GAP: f32 = 0.6;

/// Draws the window; `message` is news for the user.
pub(super) fn ui(ui: &Ui, context: &PanelContext<'_>, score: Score, message: Option<&str>) {
    let rect = ui.max_rect();
    let unit = LETTERS * rect.height();
    let width = (COLUMN * rect.width()).clamp(NARROWEST * unit, WIDEST * unit);
    let (picture, column) = rect.split_left_right_at_x(rect.right() - width);
    let colours = context.view.theme.colours();
    ui.painter().rect_filled(rect, 0.0, colour(colours.background));
    if !view3d::picture_ui(ui, picture, context, 1.1 * unit / PICTURE_LETTERS) {
        let text = line(ui, "Loading the object ..", 1.5 * unit, picture.width(), colour(colours.text), unit);
        put(ui, text, picture, Align2::CENTER_CENTER);
    }
    ui.painter().rect_filled(column, 0.0, colour(colours.raised));
    let page = Page { context, unit };
    page.picture_ui(ui, picture, score, message);
    page.column_ui(ui, column.shrink(unit));
}

/// Paints a text aligned within a place.
fn put(ui: &Ui, text: std::sync::Arc<egui::Galley>, place: Rect, align: Align2) {
    let at = align.align_size_within_rect(text.size(), place).min;
    ui.painter().galley(at, text, egui::Color32::PLACEHOLDER);
}

struct Page<'a, 'b> {
    context: &'a PanelContext<'b>,
    /// Height of the smallest letters (points).
    unit: f32,
}

impl Page<'_, '_> {
    fn answer(&self) -> Option<&IdentificationView> {
        self.context.snapshot?.identification.as_deref()
    }

    /// Text for screen readers.
    fn speak(&self, ui: &Ui, name: &str, place: Rect, text: &str) {
        ui.interact(place, ui.scope_id().with(("presenter", name)), egui::Sense::hover())
            .widget_info(|| WidgetInfo::labeled(Role::Label, true, text));
    }

    /// Text on a plate at a corner of the picture, no wider than a share of it.
    fn plate(&self, ui: &Ui, text: &str, (picture, share): (Rect, f32), align: Align2) {
        let colours = self.context.view.theme.colours();
        let place = picture.shrink(self.unit);
        let rows = paragraph(ui, text, 1.1 * self.unit, share * place.width(), colour(colours.text), 2);
        let ground = align.align_size_within_rect(rows.size(), place).expand(0.4 * self.unit);
        self.speak(ui, text, ground, text);
        ui.painter().rect_filled(ground, 0.3 * self.unit, veil(colours.background, 0.8));
        put(ui, rows, place, align);
    }

    /// What there is to say about the picture: that the pose is hard, what colours and arrows mean, news, and the score.
    fn picture_ui(&self, ui: &Ui, picture: Rect, score: Score, message: Option<&str>) {
        let Some(snapshot) = self.context.snapshot else { return };
        if Presentation::is_hard(&snapshot.scene.pose) {
            self.plate(ui, &words::hard_pose(&snapshot.scene.gripper.mount), (picture, 0.6), Align2::LEFT_TOP);
        }
        let touches = !snapshot.frame.taxels.is_empty();
        match message {
            Some(message) => self.plate(ui, message, (picture, 0.55), Align2::LEFT_BOTTOM),
            None if touches => self.plate(ui, words::ENCODING, (picture, 0.55), Align2::LEFT_BOTTOM),
            None => {}
        }
        if score != Score::default() {
            let text = format!("{} right, {} wrong", score.right, score.wrong);
            self.plate(ui, &text, (picture, 0.4), Align2::RIGHT_BOTTOM);
        }
    }

    fn column_ui(&self, ui: &Ui, column: Rect) {
        let Some(snapshot) = self.context.snapshot else { return };
        let colours = self.context.view.theme.colours();
        let mut top = column.top();
        let mut part = |height: f32| {
            let place = Rect::from_min_size(egui::pos2(column.left(), top), vec2(column.width(), height * self.unit));
            top = place.bottom() + GAP * self.unit;
            place
        };
        let [story, guess, beliefs, reason] = [STORY, GUESS, BELIEFS, REASON].map(&mut part);
        let text = words::story(snapshot);
        self.speak(ui, "story", story, text);
        let rows = paragraph(ui, text, 1.5 * self.unit, story.width(), colour(colours.text), 2);
        put(ui, rows, story, Align2::LEFT_TOP);
        if let Some(view) = self.answer() {
            self.guess_ui(ui, view, guess);
            self.beliefs_ui(ui, view, beliefs);
            let text = words::reason(view);
            self.speak(ui, "reason", reason, &text);
            let rows = paragraph(ui, &text, 1.1 * self.unit, reason.width(), colour(colours.text), 4);
            put(ui, rows, reason, Align2::LEFT_TOP);
        }
        self.verdict_ui(ui, column.with_min_y(column.bottom() - VERDICT * self.unit));
    }

    /// Picture of a class, or a frame with a question mark.
    fn portrait(&self, ui: &Ui, class: Option<&str>, place: Rect) {
        let colours = self.context.view.theme.colours();
        match class.and_then(|class| self.context.thumbnails.get(class)) {
            Some(texture) => egui::Image::new(texture).corner_radius(0.3 * self.unit).paint_at(ui, place),
            None => {
                let stroke = egui::Stroke::new(2.0, colour(colours.border));
                ui.painter().rect_stroke(place, 0.3 * self.unit, stroke, egui::StrokeKind::Inside);
                let letters = (0.6 * place.height()).max(self.unit);
                let mark = line(ui, "?", letters, place.width(), colour(colours.quiet_text), self.unit);
                put(ui, mark, place, Align2::CENTER_CENTER);
            }
        }
    }
}
