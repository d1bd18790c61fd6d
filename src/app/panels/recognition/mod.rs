//! Recognition: a lesson that is running, the answer and its reason, advice on the next grasp, size and shape, the measured
//! dimensions, a bar for each class with the threshold across them, and the grasps so far.

mod classes;
mod lesson;
mod properties;
mod strip;
mod touch;
pub(in crate::app) mod words;

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::recognition::Learned;
use crate::app::features::tools::GripperTools;
use crate::app::features::view::{Mode, ViewSource};
use crate::app::icons::{self, Icon};
use crate::app::shown::{DisplayedData, Recognised};
use crate::app::theme::{accented, colour};
use crate::app::thumbnails::Thumbnails;
use crate::app::widgets::{self, capital, failed_sensors_ui, number_field, put};
use egui::{
    Align2, Color32, FontId, Galley, Label, Rect, Response, RichText, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2,
    vec2,
};
use palpate_geometry::palette::ThemeColours;
use palpate_lab::grasping::{IdentificationView, ObjectMove, RecognisedGrasp};
use palpate_lab::workers::{Command, Explainer, Job, THRESHOLDS};
use palpate_learn::{Labels, OTHER};
use palpate_sim::objects::is_file;
use std::sync::Arc;
use words::{
    ALONE, BEING_LEARNED, FOREIGN, Headline, LEARNED_FIXED, LEARNED_FREE, NOT_LEARNED, OTHER_FINGERS, UNLIKE, percent,
    reason, title,
};

/// Time in which bars follow a new answer (s).
const EASE_S: f32 = 0.12;
/// Least time between two answers on the screen (s): faster ones cannot be read.
const CALM_S: f64 = 0.1;
/// Smallest letters (points).
const LEAST_LETTERS: f32 = 8.5;

/// Heights of the parts, and sizes of letters (points).
struct Measures {
    headline: f32,
    reason: f32,
    reason_letters: f32,
    truth: f32,
    properties: f32,
    class: f32,
    strip: f32,
    button: f32,
    gap: f32,
}

const ROOMY: Measures = Measures {
    headline: 50.0,
    reason: 38.0,
    reason_letters: 13.5,
    truth: 26.0,
    properties: 24.0,
    class: 21.0,
    strip: 50.0,
    button: 36.0,
    gap: 7.0,
};

/// Measures in a small window.
const TIGHT: Measures = Measures {
    headline: 28.0,
    reason: 38.0,
    reason_letters: 11.5,
    truth: 20.0,
    properties: 18.0,
    class: 16.0,
    strip: 40.0,
    button: 28.0,
    gap: 3.0,
};

/// Height of the line with the threshold (points).
const THRESHOLD_LINE: f32 = 24.0;
/// Least height of the line of a class in one column; least and largest in two; its height where there is less room and the
/// panel scrolls (points).
const ONE_COLUMN: f32 = 13.0;
const LEAST_CLASS: f32 = 8.0;
const TWO_COLUMNS: f32 = 18.0;
const SCROLLED_CLASS: f32 = 14.0;

impl Measures {
    /// True in a small window.
    fn is_tight(&self) -> bool {
        self.class <= TIGHT.class
    }

    fn fitting(room: egui::Vec2) -> &'static Self {
        if room.x < 250.0 || room.y < 560.0 { &TIGHT } else { &ROOMY }
    }

    /// Columns for classes, and the height of a line: all have one, in whatever window.
    fn lines(&self, height: f32, labels: &Labels, has_touch: bool, below: f32) -> (usize, f32) {
        let (properties, classes) = (properties::rows(labels) as f32, labels.classes.len());
        let properties = properties * self.properties + (properties - 1.0).max(0.0) * self.gap;
        let touch = if has_touch { touch::height(self) } else { 0.0 };
        let parts = self.headline + self.reason + self.truth + THRESHOLD_LINE + self.strip + below;
        let room = height - parts - properties - touch - 6.0 * self.gap;
        let line = |columns: usize| (2.0 * room / classes.div_ceil(columns).max(1) as f32).floor() / 2.0;
        match [line(1), line(2)] {
            [one, _] if one >= ONE_COLUMN => (1, one.min(self.class)),
            [_, two] if two >= LEAST_CLASS => (2, two.min(TWO_COLUMNS)),
            // What scrolls can as well be read.
            _ => (1, SCROLLED_CLASS),
        }
    }
}

pub(super) fn ui(
    ui: &mut Ui,
    data: &DisplayedData<'_>,
    tools: &GripperTools,
    (learned, explainer): (Option<&Learned>, &Explainer),
    pictures: &Thumbnails,
    actions: &mut Actions,
) {
    let Some(recognised) = data.recognised() else {
        ui.weak("Waiting for the first grasp …");
        return;
    };
    if data.blind {
        ui.heading("Blind");
        ui.label("The model's prediction is hidden until you label the trial.");
        return;
    }
    let room = ui.available_size();
    let measures = Measures::fitting(room);
    // The buttons stay in sight below what scrolls.
    let has_buttons = data.source != ViewSource::Trial && data.view.mode != Mode::Label;
    let below = if has_buttons { measures.button + measures.gap } else { 0.0 };
    let mut can_learn = false;
    let scrolled = ScrollArea::vertical().auto_shrink(false).max_height(room.y - below);
    scrolled.show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = measures.gap;
        let top = ui.cursor().top();
        let labels = recognised.view.map(|view| view.labels.as_ref());
        // What was learned of fixed objects says nothing about free ones, nor about another object.
        let is_in_hand = |name: &str| recognised.truth.as_ref().is_none_or(|(truth, _)| *truth == name);
        let learned = learned.filter(|own| own.fixed == data.scene.holds_object() && is_in_hand(&own.name));
        lesson::ui(ui, tools, learned, labels, measures, actions);
        match recognised.view {
            Some(view) => {
                let view = calmed(ui, view);
                if let Some(gripper) = data.gripper.filter(|_| data.source == ViewSource::Gripper) {
                    failed_sensors_ui(ui, gripper);
                }
                let told = ui.cursor().top() - top;
                let running = tools.teaching.running().map(|running| running.command);
                let lessons: Vec<_> = running.into_iter().chain(tools.teaching.waiting()).collect();
                let is_being_learned = data.source == ViewSource::Simulation
                    && recognised.truth.as_ref().is_some_and(|(own, _)| lessons.iter().any(|next| next.name == *own));
                let mut part = Part {
                    data,
                    pictures,
                    explainer,
                    recognised: &recognised,
                    view: &view,
                    is_being_learned,
                    measures,
                    actions,
                };
                part.headline_ui(ui);
                can_learn = data.source == ViewSource::Simulation
                    && part.distrust() == Some(NOT_LEARNED)
                    && is_file(&data.scene.object.source);
                let advised = part.advice_ui(ui, &tools.advice) + told;
                if let Some((_, title)) = &recognised.truth {
                    part.truth_ui(ui, title);
                }
                properties::ui(ui, &part);
                let has_touch = touch::ui(ui, &part);
                let lines = measures.lines(room.y - advised, &view.labels, has_touch, below);
                classes::ui(ui, &mut part, lines);
                part.threshold_ui(ui);
                strip::ui(ui, &part);
            }
            None => off_ui(ui, data.source, recognised.off),
        }
    });
    if has_buttons {
        ui.horizontal(|ui| {
            more_ui(ui, data, measures, actions);
            if can_learn {
                let width = 0.5 * (ui.available_width() - ui.spacing().item_spacing.x);
                let learn = ui.add_sized([width, measures.button], egui::Button::new("Learn it"));
                actions
                    .on(&learn.on_hover_text("Simulate grasps of this object, and learn from them"), App::teach_object);
            }
            next_ui(ui, data, measures, actions);
        });
    }
}

/// Button for one more grasp, where a raised threshold asks for it.
fn more_ui(ui: &mut Ui, data: &DisplayedData<'_>, measures: &Measures, actions: &mut Actions) {
    if data.source != ViewSource::Simulation || !data.one_more() {
        return;
    }
    let hint = "The threshold is above the probability reached: grasp the same object again (M)";
    let more = egui::Button::new("One more grasp").fill(accented(data.view.theme));
    // Beside the button for another object.
    let width = 0.5 * (ui.available_width() - ui.spacing().item_spacing.x);
    actions.on(&ui.add_sized([width, measures.button], more).on_hover_text(hint), |app| {
        app.simulation.send(Command::GraspOnceMore);
    });
}

/// Button for another object.
fn next_ui(ui: &mut Ui, data: &DisplayedData<'_>, measures: &Measures, actions: &mut Actions) {
    let fill = accented(data.view.theme);
    let hint = match data.source {
        ViewSource::Trial => return,
        ViewSource::Simulation => "Grasp another built-in object at random (N)",
        ViewSource::Gripper => "Start over with another object in the hand (N)",
    };
    let next = egui::Button::new("Next object").fill(fill);
    actions.on(&ui.add_sized([ui.available_width(), measures.button], next).on_hover_text(hint), App::next_object);
}

fn off_ui(ui: &mut Ui, source: ViewSource, why: Option<&str>) {
    ui.heading(if source == ViewSource::Trial { "No answer" } else { "Recognition is off" });
    ui.label(why.map_or_else(
        || "No recognition model. Grasps are still recorded.".to_owned(),
        |why| format!("{}.", capital(why)),
    ));
}

/// Newest answer, at most ten different ones per second.
fn calmed(ui: &Ui, view: &Arc<IdentificationView>) -> Arc<IdentificationView> {
    let (id, now) = (ui.scope_id().with("calmed"), ui.input(|i| i.time));
    let shown: Option<(f64, Arc<IdentificationView>)> = ui.data(|data| data.get_temp(id));
    if let Some((since, shown)) = shown {
        let same_grasp = view.listening && shown.listening && shown.verdict.is_some() && view.rule == shown.rule;
        if same_grasp && view.beliefs.len() == shown.beliefs.len() && view.verdict.is_some() && now - since < CALM_S {
            ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(CALM_S));
            return shown;
        }
    }
    ui.data_mut(|data| data.insert_temp(id, (now, Arc::clone(view))));
    Arc::clone(view)
}

/// Data of all parts of the panel.
struct Part<'a, 'b> {
    data: &'a DisplayedData<'b>,
    pictures: &'a Thumbnails,
    explainer: &'a Explainer,
    recognised: &'a Recognised<'a>,
    view: &'a IdentificationView,
    /// The model is learning the object in the hand.
    is_being_learned: bool,
    measures: &'static Measures,
    actions: &'a mut Actions,
}

impl Part<'_, '_> {
    fn colours(&self) -> ThemeColours {
        self.data.view.theme.colours()
    }

    /// What the answer lacks; none where it can be trusted.
    fn distrust(&self) -> Option<&'static str> {
        let is_alone = self.data.shown_trial().is_some_and(|shown| shown.trial.judged_alone);
        let is_unknown = |(truth, _): &(&str, String)| self.view.labels.class(truth).is_none();
        // "Unknown" is right for it.
        let is_new = !self.view.is_unknown()
            && !self.recognised.nothing_held
            && self.recognised.truth.as_ref().is_some_and(is_unknown);
        match self.is_being_learned {
            _ if self.is_foreign() => Some(FOREIGN),
            _ if self.data.other_fingers => Some(OTHER_FINGERS),
            _ if self.view.unlike => Some(UNLIKE),
            _ if self.data.learned_otherwise && is_new => {
                Some(if self.data.scene.holds_object() { LEARNED_FREE } else { LEARNED_FIXED })
            }
            true => Some(BEING_LEARNED),
            false if is_new => Some(NOT_LEARNED),
            false => is_alone.then_some(ALONE),
        }
    }

    /// A model from perfect sensors reads real ones, or such as are like them.
    fn is_foreign(&self) -> bool {
        self.view.from_perfect_sensors && (self.data.board().is_some() || self.data.reads_like_parts())
    }

    /// Picture of a class, or a frame with a question mark.
    fn thumbnail(&self, ui: &Ui, class: &str, place: Rect) {
        match self.pictures.get(class) {
            Some(texture) => egui::Image::new(texture).corner_radius(3.0).paint_at(ui, place),
            None => {
                let stroke = egui::Stroke::new(1.5, colour(self.colours().border));
                ui.painter().rect_stroke(place.shrink(1.0), 3.0, stroke, egui::StrokeKind::Inside);
                let (font, ink) = (FontId::proportional(0.7 * place.height()), colour(self.colours().quiet_text));
                ui.painter().text(place.center(), Align2::CENTER_CENTER, "?", font, ink);
            }
        }
    }

    /// Answer, probability and reason.
    fn headline_ui(&self, ui: &mut Ui) {
        let (colours, measures) = (self.colours(), self.measures);
        let headline = Headline::of(self.view);
        let (mut text, mut p) = headline.text(&self.view.labels);
        let distrust = self.distrust();
        let mut why = distrust.map_or_else(|| reason(self.view, self.recognised), str::to_owned);
        // No answer can be right: the likest known object is no headline.
        let is_new = distrust == Some(BEING_LEARNED);
        if let Some((class, probability)) = headline.class().zip(p.take_if(|_| is_new)) {
            let like = match self.view.labels.classes[class].name.as_str() {
                OTHER => "no known object".to_owned(),
                _ => title(&self.view.labels, class),
            };
            why = format!("{why} So far like {like} ({}).", percent(probability));
            "New object".clone_into(&mut text);
        }
        // Without a grasp, what the pads touch is no contact of one.
        if matches!(headline, Headline::Waiting) && !self.view.listening {
            "No answer yet".clone_into(&mut text);
        }
        let spoken = p.map_or_else(|| text.clone(), |p| format!("{text}, {}", percent(p)));
        let (rect, _) = labelled(ui, vec2(ui.available_width(), measures.headline), &spoken);
        let right = self.recognised.is_right().filter(|_| self.data.view.truth_shown && !is_new);
        // What is not to be trusted does not look like a decision.
        let ink = match right {
            None | Some(true) if distrust.is_some_and(|why| why != ALONE) => colours.warning,
            _ => headline.ink(&colours, right),
        };
        let ink = colour(ink);
        let mut left = rect.left();
        if let Some(class) = headline.class().filter(|_| !is_new) {
            let side = measures.headline - 4.0;
            let place = Rect::from_min_size(pos2(left, rect.top() + 2.0), vec2(side, side));
            self.thumbnail(ui, &self.view.labels.classes[class].name, place);
            left += side + 8.0;
        }
        let large = 0.75 * measures.headline;
        let number = p.map(|p| fitted(ui, &percent(p), large, 0.4 * rect.width(), ink));
        let room = rect.right() - left - number.as_ref().map_or(0.0, |n| n.size().x + 8.0);
        put(ui, fitted(ui, &text, large, room, ink), rect.with_min_x(left), Align2::LEFT_CENTER);
        if let Some(number) = number {
            put(ui, number, rect, Align2::RIGHT_CENTER);
        }
        let by_simulation = self.view.left.is_some() && self.data.board().is_some();
        let why = if by_simulation { format!("{why} (calibrated in simulation)") } else { why };
        let ink = colour(if distrust.is_some() { colours.warning } else { colours.quiet_text });
        let (rect, _) = labelled(ui, vec2(ui.available_width(), measures.reason), &why);
        let font = FontId::proportional(measures.reason_letters);
        // No line break between number and unit.
        let lines = ui.painter().layout(why.replace(" %", "\u{a0}%"), font, ink, rect.width());
        put(ui, lines, rect, Align2::LEFT_CENTER);
    }

    /// Which grasp next; returns the height of the line (points), 0 without advice.
    fn advice_ui(&self, ui: &mut Ui, advice: &Job<Arc<RecognisedGrasp>, ObjectMove>) -> f32 {
        let Some(text) = self.advice(advice) else { return 0.0 };
        // No line break between number and unit.
        let text = RichText::new(text.replace(" mm", "\u{a0}mm"))
            .size(self.measures.reason_letters)
            .color(colour(self.colours().accent));
        let hint = "The grasp from which most is expected to be learned, by the readings so far";
        ui.add(Label::new(text).wrap()).on_hover_text(hint).rect.height() + ui.spacing().item_spacing.y
    }

    /// The move that the simulation has chosen, or advice to the person at the real gripper.
    fn advice(&self, advice: &Job<Arc<RecognisedGrasp>, ObjectMove>) -> Option<String> {
        match self.data.source {
            ViewSource::Trial => None,
            // There the plan says how the object is to lie.
            ViewSource::Gripper if self.data.view.mode == Mode::Label => None,
            ViewSource::Simulation => Some(format!("Guided: gripper {}", self.data.snapshot?.status.guided?)),
            ViewSource::Gripper => {
                let undecided = self.view.decision.is_none() && !self.view.listening;
                let last = self.view.last.as_ref().filter(|_| undecided)?;
                let advice = advice.last().filter(|advice| Arc::ptr_eq(&*advice.command, last))?;
                Some(format!("Before the next grasp: {}.", advice.outcome.ok()?))
            }
        }
    }

    /// True object, which the simulation knows; set apart from what was recognised.
    fn truth_ui(&mut self, ui: &mut Ui, title: &str) {
        let colours = self.colours();
        let shown = self.data.view.truth_shown;
        let right = self.recognised.is_right().filter(|_| shown && !self.is_being_learned);
        let title = capital(title);
        let title = if right.is_some() && self.recognised.nothing_held { format!("{title}, not held") } else { title };
        let (text, spoken, sign) = match right {
            Some(true) => (title.clone(), format!("Right: {title}"), Some((Icon::Check, colours.good))),
            Some(false) => (title.clone(), format!("Wrong: {title}"), Some((Icon::Cross, colours.error))),
            None if shown => (title.clone(), format!("Truth: {title}"), None),
            None => ("hidden".to_owned(), "Truth hidden".to_owned(), None),
        };
        let size = vec2(ui.available_width(), self.measures.truth);
        let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
        ui.painter().rect_filled(rect, 4.0, colour(colours.raised));
        let eye = Rect::from_min_max(pos2(rect.right() - 28.0, rect.top()), rect.max);
        let row = Rect::from_min_max(rect.min, eye.left_bottom()).shrink2(vec2(6.0, 0.0));
        ui.interact(row, ui.scope_id().with("truth"), Sense::hover())
            .widget_info(|| WidgetInfo::labeled(Role::Label, true, &spoken));
        let mut left = row.left();
        let label = fitted(ui, "truth", 11.5, row.width(), colour(colours.quiet_text));
        left += label.size().x + 8.0;
        put(ui, label, row, Align2::LEFT_CENTER);
        if let Some((icon, ink)) = sign {
            icons::sign(
                ui,
                icon,
                Rect::from_center_size(pos2(left + 7.0, row.center().y), vec2(14.0, 14.0)),
                colour(ink),
            );
            left += 20.0;
        }
        let ink = if sign.is_some() { colours.text } else { colours.quiet_text };
        put(ui, fitted(ui, &text, 13.5, row.right() - left, colour(ink)), row.with_min_x(left), Align2::LEFT_CENTER);
        let hint = "Show or hide the true object";
        let toggle = ui.interact(eye, ui.scope_id().with("show the truth"), Sense::click()).on_hover_text(hint);
        toggle.widget_info(|| WidgetInfo::selected(Role::CheckBox, true, shown, "Show the truth"));
        focus_ring(ui, &toggle, eye);
        let lit = if toggle.hovered() || toggle.has_focus() { colours.text } else { colours.quiet_text };
        icons::sign(ui, Icon::Eye, eye, colour(lit));
        if !shown {
            ui.painter()
                .line_segment([eye.center() + vec2(-7.0, 6.0), eye.center() + vec2(7.0, -6.0)], (2.0, colour(lit)));
        }
        if toggle.clicked() {
            self.actions.push(move |app| app.view.truth_shown = !shown);
        }
    }

    /// The strongest reason for the answer to the last grasp, once it is known.
    fn because(&mut self) -> Option<String> {
        let request = self.data.grasp_to_explain().ok()?;
        let Some(explained) = self.explainer.explained(&request) else {
            self.actions.push(move |app| app.recognition.explainer.weigh(&request));
            return None;
        };
        Some(explained.outcome.ok()?.because())
    }

    /// Threshold as a number.
    fn threshold_ui(&mut self, ui: &mut Ui) {
        let size = vec2(ui.available_width(), THRESHOLD_LINE);
        ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
            ui.set_min_size(size);
            let label = ui.weak("threshold");
            let [least, most] = [THRESHOLDS.start(), THRESHOLDS.end()].map(|p| p * 100.0);
            let mut threshold = self.view.rule.threshold * 100.0;
            let plain =
                |percents: f64, _: std::ops::RangeInclusive<usize>| format!("{}", (percents * 10.0).round() / 10.0);
            let drag = egui::DragValue::new(&mut threshold)
                .range(least..=most)
                .speed(0.25)
                .max_decimals(1)
                .custom_formatter(plain)
                .suffix(" %");
            let hint = "Probability from which a class counts as certain; drag the line or the number";
            if number_field(ui, "threshold", drag).labelled_by(label.id).on_hover_text(hint).changed() {
                self.actions.push(move |app| app.set_threshold(classes::stepped(threshold / 100.0)));
            }
            if self.view.last.is_some() {
                let hint = "Label the trial with a new name; the panel Training teaches the model named objects";
                let is_unknown = self.view.is_unknown() && self.data.source == ViewSource::Gripper;
                if is_unknown && ui.link("Name it").on_hover_text(hint).clicked() {
                    self.actions.push(|app| app.show_panel("label"));
                }
                let hint = "What spoke for and against this answer (panel Why)";
                if ui.link("Why?").on_hover_text(hint).clicked() {
                    self.actions.push(|app| app.show_panel("why"));
                }
                if let Some(because) = self.because() {
                    let room = ui.available_rect_before_wrap();
                    let ink = ui.visuals().weak_text_color();
                    let (place, _) = labelled(ui, room.size(), &because);
                    let mut text = fitted(ui, &because, self.measures.reason_letters.min(11.5), place.width(), ink);
                    if text.elided {
                        // Two lines have room for it.
                        let font = FontId::proportional(LEAST_LETTERS);
                        text = ui.painter().layout(because, font, ink, place.width());
                    }
                    put(ui, text, place, Align2::LEFT_CENTER);
                }
            }
        });
    }
}

/// Room for a drawing, with its text for screen readers.
fn labelled(ui: &mut Ui, size: egui::Vec2, spoken: &str) -> (Rect, Response) {
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, spoken));
    (rect, response)
}

/// [`widgets::fitted`] with the smallest letters of this panel.
fn fitted(ui: &Ui, text: &str, letters: f32, width: f32, ink: Color32) -> Arc<Galley> {
    widgets::fitted(ui, text, [LEAST_LETTERS, letters], width, ink)
}

/// Share as drawn: it follows the answer within [`EASE_S`], but jumps without an answer and at low frame rates.
fn eased(ui: &Ui, id: egui::Id, p: Option<f64>) -> f32 {
    let seldom = ui.input(|i| i.unstable_dt) > 0.5 * EASE_S;
    let time = if p.is_none() || seldom { 0.0 } else { EASE_S };
    ui.ctx().animate_value_with_time(id, p.unwrap_or(0.0) as f32, time)
}

/// Marks the widget with keyboard focus.
fn focus_ring(ui: &Ui, response: &Response, place: Rect) {
    if response.has_focus() {
        let stroke = ui.visuals().selection.stroke;
        ui.painter().rect_stroke(place.shrink(1.0), 3.0, stroke, egui::StrokeKind::Inside);
    }
}
