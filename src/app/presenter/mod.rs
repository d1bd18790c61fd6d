//! Presenter mode: the touch fills the window, beside it a column says what happens, what the program thinks after
//! each grasp and why, and shows the true object at last. Nothing is smaller than a 36th of the window's height.

mod beliefs;
mod words;

use crate::app::features::App;
use crate::app::features::presenter::Score;
use crate::app::panels::view3d::{self, View3d};
use crate::app::theme::{colour, veil};
use crate::app::widgets::{fitted, put};
use egui::text::LayoutJob;
use egui::{Align2, Color32, FontId, Galley, Pos2, Rect, Role, Stroke, Ui, WidgetInfo, pos2, vec2};
use palpate_geometry::units;
use palpate_lab::grasping::{IdentificationView, Presentation};
use palpate_sim::objects::object_title;
use std::sync::Arc;

/// Smallest letters: a share of the window's height.
const LETTERS: f32 = 1.0 / 36.0;
/// Letters of the annotations of a picture (points).
const PICTURE_LETTERS: f32 = 14.0;
/// Width of the column: a share of the window's, within limits in heights of the smallest letters.
const COLUMN: f32 = 0.36;
const NARROWEST: f32 = 20.0;
const WIDEST: f32 = 24.0;

/// Heights of the parts of the column from above, and the gap between them (heights of the smallest letters). Score and
/// verdict stand at the bottom.
const STORY: f32 = 3.5;
const GUESS: f32 = 4.6;
const BELIEFS: f32 = 10.4;
const REASON: f32 = 5.6;
const SCORE: f32 = 2.2;
const VERDICT: f32 = 5.2;
const GAP: f32 = 0.6;

/// Draws the window; `message` is news for the user.
pub(super) fn ui(ui: &Ui, app: &App, message: Option<&str>) {
    let rect = ui.max_rect();
    let unit = LETTERS * rect.height();
    let width = (COLUMN * rect.width()).clamp(NARROWEST * unit, WIDEST * unit);
    let (picture, column) = rect.split_left_right_at_x(rect.right() - width);
    let colours = app.view.theme.colours();
    let page = Page { app, unit };
    if !view3d::picture_ui(ui, picture, &View3d::of(app), 1.1 * unit / PICTURE_LETTERS) {
        let text = page.line(ui, "Loading the object …", 1.5 * unit, picture.width(), colour(colours.text));
        put(ui, text, picture, Align2::CENTER_CENTER);
    }
    ui.painter().rect_filled(column, 0.0, colour(colours.raised));
    page.picture_ui(ui, picture, message);
    page.column_ui(ui, column.shrink(unit));
}

struct Page<'a> {
    app: &'a App,
    /// Height of the smallest letters (points).
    unit: f32,
}

impl Page<'_> {
    fn answer(&self) -> Option<&IdentificationView> {
        self.app.snapshot()?.identification.as_deref()
    }

    /// [`fitted`] with the smallest letters of the page.
    fn line(&self, ui: &Ui, text: &str, letters: f32, width: f32, ink: Color32) -> Arc<Galley> {
        fitted(ui, text, [self.unit, letters], width, ink)
    }

    /// At most so many rows; numbers keep their units.
    fn paragraph(&self, ui: &Ui, (text, rows): (&str, usize), letters: f32, width: f32) -> Arc<Galley> {
        let text = text.replace(" %", "\u{a0}%").replace(" mm", "\u{a0}mm").replace(" N", "\u{a0}N");
        let ink = colour(self.app.view.theme.colours().text);
        let mut job = LayoutJob::simple(text, FontId::proportional(letters), ink, width.max(1.0));
        job.wrap.max_rows = rows;
        ui.painter().layout_job(job)
    }

    /// Text for screen readers.
    fn speak(&self, ui: &Ui, name: &str, place: Rect, text: &str) {
        ui.interact(place, ui.scope_id().with(("presenter", name)), egui::Sense::hover())
            .widget_info(|| WidgetInfo::labeled(Role::Label, true, text));
    }

    /// What there is to say about the picture, beside its legend: news, that the pose is hard, what colours and arrows mean.
    fn picture_ui(&self, ui: &Ui, picture: Rect, message: Option<&str>) {
        let Some(snapshot) = self.app.snapshot() else { return };
        let hard = Presentation::is_hard(&snapshot.scene.pose);
        let hard = hard.then(|| words::hard_pose(&snapshot.scene.gripper.mount));
        let shown = self.app.shown();
        let hold = shown.last_hold().and_then(view3d::last_hold_words);
        let touches = shown.moment().filter(|moment| !moment.frame.taxels.is_empty());
        if let Some(moment) = touches {
            let forces = moment.stage.finger_forces(moment.frame).map(|force| force.unwrap_or(0.0));
            let [left, right] = forces.map(|force| units::shown(force, "N"));
            self.speak(ui, "forces", picture, &format!("Pressing with {left} (left) and {right} (right)"));
        }
        let encoding = touches.is_some().then(|| words::ENCODING.to_owned());
        let colours = self.app.view.theme.colours();
        let mut place = picture.shrink(self.unit).with_max_x(picture.left() + 0.58 * picture.width());
        let texts = message.map(str::to_owned).into_iter().chain(hard).chain(encoding).map(|text| (text, 1.0));
        // News above the hand, its last forces below it.
        let below = hold.map(|text| (text, 1.25, Align2::LEFT_BOTTOM));
        for (text, letters, corner) in texts.map(|(text, letters)| (text, letters, Align2::LEFT_TOP)).chain(below) {
            let rows = self.paragraph(ui, (&text, 3), letters * self.unit, place.width());
            let ground = corner.align_size_within_rect(rows.size(), place).expand(0.4 * self.unit);
            self.speak(ui, &text, ground, &text);
            ui.painter().rect_filled(ground, 0.3 * self.unit, veil(colours.background, 0.8));
            put(ui, rows, place, corner);
            place.set_top(ground.bottom() + 0.8 * self.unit);
        }
    }

    fn column_ui(&self, ui: &Ui, column: Rect) {
        let Some(snapshot) = self.app.snapshot() else { return };
        let colours = self.app.view.theme.colours();
        let mut top = column.top();
        let mut part = |height: f32| {
            let place = Rect::from_min_size(pos2(column.left(), top), vec2(column.width(), height * self.unit));
            top = place.bottom() + GAP * self.unit;
            place
        };
        let [story, guess, beliefs, reason] = [STORY, GUESS, BELIEFS, REASON].map(&mut part);
        let text = words::story(snapshot);
        self.speak(ui, "story", story, text);
        let rows = self.paragraph(ui, (text, 2), 1.35 * self.unit, story.width());
        put(ui, rows, story, Align2::LEFT_TOP);
        if let Some(view) = self.answer() {
            self.guess_ui(ui, view, guess);
            self.beliefs_ui(ui, view, beliefs);
            let text = words::reason(view, snapshot.status.nothing_held);
            self.speak(ui, "reason", reason, &text);
            let rows = self.paragraph(ui, (&text, 4), 1.1 * self.unit, reason.width());
            put(ui, rows, reason, Align2::LEFT_TOP);
        }
        let (column, verdict) = column.split_top_bottom_at_y(column.bottom() - VERDICT * self.unit);
        self.verdict_ui(ui, verdict);
        let score = self.app.presenter.score;
        if score != Score::default() {
            let text = format!("{} right, {} wrong", score.right, score.wrong);
            let place = column.with_min_y(column.bottom() - SCORE * self.unit);
            self.speak(ui, "score", place, &text);
            let text = self.line(ui, &text, 1.1 * self.unit, place.width(), colour(colours.text));
            put(ui, text, place, Align2::LEFT_TOP);
        }
    }

    /// Picture of a class, or a frame with a question mark.
    fn portrait(&self, ui: &Ui, class: Option<&str>, place: Rect) {
        let colours = self.app.view.theme.colours();
        match class.and_then(|class| self.app.thumbnails.get(class)) {
            Some(texture) => egui::Image::new(texture).corner_radius(0.3 * self.unit).paint_at(ui, place),
            None => {
                let stroke = Stroke::new(2.0, colour(colours.border));
                ui.painter().rect_stroke(place, 0.3 * self.unit, stroke, egui::StrokeKind::Inside);
                let letters = (0.6 * place.height()).max(self.unit);
                let mark = self.line(ui, "?", letters, place.width(), colour(colours.quiet_text));
                put(ui, mark, place, Align2::CENTER_CENTER);
            }
        }
    }

    /// The true object, once there is a verdict.
    fn verdict_ui(&self, ui: &Ui, place: Rect) {
        let (colours, unit) = (self.app.view.theme.colours(), self.unit);
        let Some(snapshot) = self.app.snapshot() else { return };
        let truth = snapshot.truth();
        let title = snapshot.object.as_ref().map_or_else(|| object_title(truth), |object| object.title.clone());
        let finished = snapshot.status.finished;
        let right = self.answer().filter(|_| finished).and_then(|view| snapshot.is_right(view));
        let is_new = self.answer().is_some_and(|view| view.labels.class(truth).is_none());
        let (word, ink) = match right {
            Some(true) => ("Right", colours.good),
            Some(false) => ("Wrong", colours.error),
            None if finished && is_new => ("Not learned", colours.quiet_text),
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
        let decided = self.answer().is_some_and(|view| view.decision.is_some());
        let name = match (finished, decided) {
            (true, _) if snapshot.status.nothing_held => format!("It was: {title}. It left the hand"),
            (true, _) => format!("It is: {title}"),
            (false, true) => "Shown once it lets go.".to_owned(),
            (false, false) => "Shown once it decides.".to_owned(),
        };
        let quiet = colour(if finished { colours.text } else { colours.quiet_text });
        let mut text = self.line(ui, &name, 1.4 * unit, below.width(), quiet);
        if text.elided {
            text = self.paragraph(ui, (&name, 2), unit, below.width());
        }
        put(ui, text, below, Align2::LEFT_CENTER);
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
