//! Presenter mode: the touch fills the window, below it what the program thinks and why, and the true object after the verdict.
//! Nothing is smaller than a 36th of the window's height.

use crate::app::context::PanelContext;
use crate::app::features::presenter::Score;
use crate::app::icons::{self, Icon};
use crate::app::panels::recognition::words::{Headline, percent};
use crate::app::panels::recognition::{fitted, put};
use crate::app::panels::view3d;
use crate::app::theme::{colour, veil};
use egui::{Align2, Rect, Role, Ui, WidgetInfo, pos2, vec2};
use palpate_lab::grasping::IdentificationView;
use palpate_learn::{Measure, StopReason};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::object_title;

/// Letters in a window: a share of its height.
const LETTERS: f32 = 1.0 / 36.0;
/// Letters of the annotations of a picture (points).
const PICTURE_LETTERS: f32 = 14.0;

/// Draws the window.
pub(super) fn ui(ui: &Ui, context: &PanelContext<'_>, score: Score) {
    let rect = ui.max_rect();
    let unit = LETTERS * rect.height();
    let strip = rect.with_min_y(rect.bottom() - 10.0 * unit);
    let picture = rect.with_max_y(strip.top());
    let colours = context.view.theme.colours();
    if !view3d::picture_ui(ui, picture, context, 1.1 * unit / PICTURE_LETTERS) {
        let text = fitted(ui, "Loading the object ..".to_owned(), 1.5 * unit, picture.width(), colour(colours.text));
        put(ui, text, picture, Align2::CENTER_CENTER);
    }
    ui.painter().rect_filled(strip, 0.0, colour(colours.raised));
    let page = Page { context, unit };
    page.story_ui(ui, picture);
    page.score_ui(ui, picture, score);
    let (left, right) = (strip.with_max_x(strip.left() + 0.62 * strip.width()), strip);
    page.guess_ui(ui, left.shrink(unit));
    page.truth_ui(ui, right.with_min_x(left.right()).shrink(unit));
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

    /// Text on a plate at a corner of the picture.
    fn plate(&self, ui: &Ui, text: String, place: Rect, align: Align2) {
        let colours = self.context.view.theme.colours();
        let place = place.shrink(self.unit);
        ui.interact(place, ui.scope_id().with(("presenter", align.0)), egui::Sense::hover())
            .widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
        let text = fitted(ui, text, 1.25 * self.unit, 0.6 * place.width(), colour(colours.text));
        let ground = align.align_size_within_rect(text.size(), place).expand(0.5 * self.unit);
        ui.painter().rect_filled(ground, 0.3 * self.unit, veil(colours.background, 0.75));
        put(ui, text, place, align);
    }

    /// What happens now.
    fn story_ui(&self, ui: &Ui, picture: Rect) {
        let Some(snapshot) = self.context.snapshot else { return };
        let touches = !snapshot.frame.taxels.is_empty();
        let number = snapshot.status.grasp_of_round;
        let text = match (snapshot.status.finished, snapshot.frame.phase) {
            (true, _) => "This is where it was felt".to_owned(),
            (false, Phase::Close) if !touches && number > 1 => format!("Not sure yet: grasp {number}, from elsewhere"),
            (false, Phase::Close) if !touches => "The fingers close on something they cannot see".to_owned(),
            (false, Phase::Close) => "The fingers bend around it: the pads feel its shape".to_owned(),
            (false, Phase::Hold) => "Holding: how it bends the fingers, how hard it presses".to_owned(),
            (false, _) => "Letting go".to_owned(),
        };
        self.plate(ui, text, picture, Align2::LEFT_TOP);
    }

    fn score_ui(&self, ui: &Ui, picture: Rect, score: Score) {
        if score != Score::default() {
            let text = format!("{} right, {} wrong", score.right, score.wrong);
            self.plate(ui, text, picture, Align2::CENTER_BOTTOM);
        }
    }

    /// The newest answer, how sure it is, and why there is another grasp or none.
    fn guess_ui(&self, ui: &Ui, place: Rect) {
        let (colours, unit) = (self.context.view.theme.colours(), self.unit);
        let ink = colour(colours.text);
        let side = place.height().min(0.25 * place.width());
        let Some(view) = self.answer() else { return };
        let headline = Headline::of(view);
        let (text, p) = headline.text(&view.labels);
        let class = match headline {
            Headline::Leading(class, _) | Headline::Decided(class, _) => Some(&view.labels.classes[class].name),
            Headline::Waiting | Headline::Sensing | Headline::Unknown => None,
        };
        self.portrait(ui, class.map(String::as_str), Rect::from_min_size(place.min, vec2(side, side)));
        let lines = place.with_min_x(place.left() + side + unit);
        let [title, bar, reason] = [(0.0, 3.2), (3.6, 0.8), (5.2, 2.8)].map(|(from, height)| {
            Rect::from_min_size(lines.min + vec2(0.0, from * unit), vec2(lines.width(), height * unit))
        });
        let number = fitted(ui, p.map_or_else(String::new, percent), 2.6 * unit, 0.3 * title.width(), ink);
        let text = fitted(ui, text, 2.6 * unit, title.width() - number.size().x - unit, ink);
        put(ui, text, title, Align2::LEFT_CENTER);
        put(ui, number, title, Align2::RIGHT_CENTER);
        // How sure, with the threshold.
        ui.painter().rect_filled(bar, 0.2 * unit, colour(colours.border));
        let share = |p: f64| bar.left() + p.clamp(0.0, 1.0) as f32 * bar.width();
        let filled = bar.with_max_x(share(p.unwrap_or(0.0)));
        ui.painter().rect_filled(filled, 0.2 * unit, colour(colours.accent));
        let x = share(view.rule.threshold);
        let mark = Rect::from_x_y_ranges(x - 0.1 * unit..=x + 0.1 * unit, bar.y_range().expand(0.3 * unit));
        ui.painter().rect_filled(mark, 0.0, ink);
        let reason_text = self.reason(view, p);
        ui.interact(reason, ui.scope_id().with("presenter reason"), egui::Sense::hover())
            .widget_info(|| WidgetInfo::labeled(Role::Label, true, &reason_text));
        let font = egui::FontId::proportional(1.15 * unit);
        let galley = ui.painter().layout(reason_text, font, colour(colours.quiet_text), reason.width());
        put(ui, galley, reason, Align2::LEFT_TOP);
    }

    /// Why this answer, and what follows from it.
    fn reason(&self, view: &IdentificationView, p: Option<f64>) -> String {
        let felt = view.measured.as_ref().and_then(|measured| measured.of(Measure::Width));
        let felt =
            felt.map_or_else(String::new, |width| format!("Feels about {:.0}\u{2009}mm wide. ", 1e3 * width.value));
        let threshold = percent(view.rule.threshold);
        let grasps = view.beliefs.len();
        let plural = if grasps == 1 { "grasp" } else { "grasps" };
        let follows = match view.decision {
            Some(StopReason::Sure) => format!("Sure enough after {grasps} {plural}: {threshold} or more."),
            Some(StopReason::GraspLimit) => format!("Not sure after {grasps} {plural}: its best guess."),
            Some(StopReason::Unknown) => "Like nothing it knows.".to_owned(),
            None if !view.listening && p.is_some() => {
                format!("Less sure than {threshold}: it grasps again, and adds up what it feels.")
            }
            None => format!("It decides at {threshold}, marked on the bar."),
        };
        felt + &follows
    }

    /// The true object, once there is a verdict.
    fn truth_ui(&self, ui: &Ui, place: Rect) {
        let (colours, unit) = (self.context.view.theme.colours(), self.unit);
        let Some(snapshot) = self.context.snapshot else { return };
        let truth = snapshot.truth();
        let title = snapshot.object.as_ref().map_or_else(|| object_title(truth), |object| object.title.clone());
        let finished = snapshot.status.finished;
        let right = self.answer().filter(|_| finished).and_then(|view| view.is_right(truth));
        let side = place.height().min(0.45 * place.width());
        let lines = place.with_min_x(place.left() + side + unit);
        let (word, ink, icon) = match right {
            Some(true) => ("Right", colours.accent, Some(Icon::Check)),
            Some(false) => ("Wrong", colours.error, Some(Icon::Cross)),
            None => ("What is it?", colours.quiet_text, None),
        };
        self.portrait(ui, Some(truth).filter(|_| finished), Rect::from_min_size(place.min, vec2(side, side)));
        let spoken = if finished { format!("{word}: it is {title}") } else { word.to_owned() };
        ui.interact(lines, ui.scope_id().with("presenter truth"), egui::Sense::hover())
            .widget_info(|| WidgetInfo::labeled(Role::Label, true, &spoken));
        let head = Rect::from_min_size(lines.min, vec2(lines.width(), 3.2 * unit));
        let mut left = head.left();
        if let Some(icon) = icon {
            // Icons are drawn for buttons of 16 points.
            let middle = pos2(left + 1.2 * unit, head.center().y);
            let ground = Rect::from_center_size(middle, vec2(2.4 * unit, 2.4 * unit));
            ui.painter().rect_filled(ground, 1.2 * unit, colour(ink));
            icons::sign(ui, icon, ground, colour(colours.background));
            left += 3.0 * unit;
        }
        let head = head.with_min_x(left);
        put(ui, fitted(ui, word.to_owned(), 2.2 * unit, head.width(), colour(ink)), head, Align2::LEFT_CENTER);
        if finished {
            let name = Rect::from_min_size(lines.min + vec2(0.0, 3.8 * unit), vec2(lines.width(), 2.0 * unit));
            let text = fitted(ui, title, 1.6 * unit, name.width(), colour(colours.text));
            put(ui, text, name, Align2::LEFT_CENTER);
        }
    }

    /// Picture of a class, or a frame with a question mark.
    fn portrait(&self, ui: &Ui, class: Option<&str>, place: Rect) {
        let colours = self.context.view.theme.colours();
        match class.and_then(|class| self.context.thumbnails.get(class)) {
            Some(texture) => egui::Image::new(texture).corner_radius(0.3 * self.unit).paint_at(ui, place),
            None => {
                let stroke = egui::Stroke::new(2.0, colour(colours.border));
                ui.painter().rect_stroke(place, 0.3 * self.unit, stroke, egui::StrokeKind::Inside);
                let mark = fitted(ui, "?".to_owned(), 0.6 * place.height(), place.width(), colour(colours.quiet_text));
                put(ui, mark, place, Align2::CENTER_CENTER);
            }
        }
    }
}
