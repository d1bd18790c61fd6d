//! Why the model gave its answer to the last grasp: sentences, bars of evidence per channel and phase, a table of channel
//! by phase, the course of the belief, and the nearest stored trials.

use crate::app::actions::Actions;
use crate::app::shown::DisplayedData;
use crate::app::theme::{self, colour, veil};
use crate::app::thumbnails::Thumbnails;
use crate::app::widgets::{self, capital, remark_ui, wrapped};
use egui::{Align2, Color32, Rect, Response, RichText, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};
use palpate_geometry::palette::{Rgb, Theme};
use palpate_geometry::units;
use palpate_lab::inspection::TouchPhase;
use palpate_lab::why::{
    Attribution, BeliefMove, Evidence, MEASURED_HOW, NearestReport, NearestTrial, channel_words, percent, points_words,
};
use palpate_lab::workers::{ExplainRequest, Explainer};
use palpate_sim::objects::{capital_title, object_title};
use palpate_tactile::trial::TrialId;

/// Height of a row (points).
const ROW: f32 = 20.0;
/// Width of names, as a share of the panel and at most (points).
const NAMES: (f32, f32) = (0.45, 170.0);
/// Width of a number beside a bar (points).
const NUMBER: f32 = 40.0;
/// Evidence of a full bar, at least (percent points): small evidence looks small.
const LEAST_SCALE: f64 = 10.0;
/// Distance below which two grasps read the same.
const SAME: f64 = 0.005;
/// Letters of rows (points).
const LETTERS: f32 = 12.5;
const LEAST_LETTERS: f32 = 9.0;
/// Letters above columns (points).
const HEADERS: f32 = 10.5;

pub(super) fn ui(
    ui: &mut Ui,
    data: &DisplayedData<'_>,
    explainer: &Explainer,
    pictures: &Thumbnails,
    actions: &mut Actions,
) {
    if data.blind {
        ui.heading("Blind");
        wrapped(ui, "The model's prediction is hidden until you label the trial.".into());
        return;
    }
    let request = match data.grasp_to_explain() {
        Ok(request) => request,
        Err(nothing) => {
            remark_ui(ui, nothing);
            return;
        }
    };
    let Some(explained) = explainer.explained(&request) else {
        actions.push(move |app| app.recognition.explainer.explain(&request));
        ui.weak("Leaving out channels and phases …");
        return;
    };
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 3.0;
        match &explained.outcome {
            Ok(why) => {
                ui.add(egui::Label::new(RichText::new(why.answer()).heading()).wrap());
                wrapped(ui, RichText::new(which_grasp(data, &request, why)).small().weak());
                evidence_ui(ui, why);
                nearest_ui(ui, (explainer, data.last_trial), pictures, &request, actions);
            }
            Err(cause) => {
                ui.heading("No explanation");
                wrapped(ui, RichText::new(capital(&cause.to_string()) + "."));
            }
        }
    });
}

/// The grasp that is explained, and where the answer at the time shown is another, that one.
fn which_grasp(data: &DisplayedData<'_>, request: &ExplainRequest, why: &Attribution) -> String {
    let grasps = request.grasp.belief.grasps();
    let now = data.recognised().and_then(|recognised| recognised.view);
    let explained = match request.trial {
        Some(id) => format!("At the end of trial {id}"),
        None => format!("At the end of grasp {grasps}"),
    };
    if data.newest_answer().is_some_and(|view| view.listening) {
        return format!("{explained}; grasp {} is running.", grasps + 1);
    }
    let shown = now.and_then(|view| view.verdict.as_ref().map(|verdict| &verdict.pmf).or(view.beliefs.last()));
    let shown = shown.map(|pmf| percent(pmf.probabilities()[why.first.class]));
    match (shown.filter(|shown| *shown != percent(why.first.probability)), data.time_s()) {
        (Some(shown), Some(t)) => format!("{explained}; at {} it is {shown}.", units::shown(t, "s")),
        _ => format!("{explained}."),
    }
}

fn evidence_ui(ui: &mut Ui, why: &Attribution) {
    for sentence in why.sentences() {
        wrapped(ui, RichText::new(sentence));
    }
    let title = object_title(&why.first.name);
    let rows = Rows::new(theme::of(ui), why);
    heading(ui, "Channels", &format!("Percent points of {title} that the answer loses without this channel"));
    for (channel, evidence) in why.channels.iter().zip(&why.by_channel) {
        rows.bar_ui(ui, &channel_words(channel), evidence);
    }
    heading(ui, "Phases", &format!("Percent points of {title} that the answer loses without this phase"));
    for (span, evidence) in why.phases.iter().zip(&why.by_phase) {
        rows.bar_ui(ui, span.phase.name(), evidence);
    }
    heading(ui, "Channel by phase", "The points of each channel, shared out over the phases");
    rows.table_ui(ui, why);
    if why.grasps.len() > 1 {
        heading(ui, "Grasps", &format!("Probability of {title} after each grasp"));
        for (k, step) in why.grasps.iter().enumerate() {
            let [before, alone, after] = [step.before, step.alone, step.after].map(|two| percent(two[0]));
            let name = format!("grasp {}", k + 1);
            let hint = format!("{title}: {before} before it, {alone} by it alone, {after} after it");
            rows.plain_bar_ui(ui, &name, moved(step)).on_hover_text(hint);
        }
    }
    ui.add_space(2.0);
    let how = format!("{MEASURED_HOW} {} answers of the model.", why.calls);
    wrapped(ui, RichText::new(how).small().weak());
}

/// Percent points by which a grasp has moved the answer.
fn moved(step: &BeliefMove) -> f64 {
    100.0 * (step.after[0] - step.before[0])
}

fn heading(ui: &mut Ui, text: &str, hint: &str) {
    ui.add_space(6.0);
    ui.label(RichText::new(text).strong()).on_hover_text(hint);
}

/// Common measures of all rows.
struct Rows {
    /// Evidence of a full bar (percent points).
    scale: f64,
    /// Spoke for, spoke against.
    signs: [Rgb; 2],
    ground: Color32,
    ink: Color32,
    quiet: Color32,
}

impl Rows {
    fn new(theme: Theme, why: &Attribution) -> Self {
        let parts = why.by_channel.iter().chain(&why.by_phase).chain(why.by_both.iter().flatten());
        let points =
            parts.map(|evidence| evidence.points).chain(why.grasps.iter().filter(|_| why.grasps.len() > 1).map(moved));
        let scale = points.map(f64::abs).fold(LEAST_SCALE, f64::max);
        let colours = theme.colours();
        Self {
            scale,
            signs: [colours.accent, colours.warning],
            ground: colour(colours.raised),
            ink: colour(colours.text),
            quiet: colour(colours.quiet_text),
        }
    }

    fn sign(&self, points: f64) -> Rgb {
        self.signs[usize::from(points < 0.0)]
    }

    fn bar_ui(&self, ui: &mut Ui, name: &str, evidence: &Evidence) {
        self.plain_bar_ui(ui, name, evidence.points).on_hover_text(hint_of(name, evidence));
    }

    /// Name, bar from the middle to the right (for) or left (against), number.
    fn plain_bar_ui(&self, ui: &mut Ui, name: &str, points: f64) -> Response {
        let (rect, response) = row(ui, &format!("{name}: {}", spoken(points)));
        let names = names_width(rect.width());
        put(ui, name, rect.with_max_x(rect.left() + names), Align2::LEFT_CENTER, self.ink);
        let track = Rect::from_min_max(
            pos2(rect.left() + names + 4.0, rect.top() + 4.0),
            pos2(rect.right() - NUMBER, rect.bottom() - 4.0),
        );
        ui.painter().rect_filled(track, 2.0, self.ground);
        let middle = track.center().x;
        let reach = 0.5 * track.width() * (points / self.scale).clamp(-1.0, 1.0) as f32;
        let bar = Rect::from_x_y_ranges(middle.min(middle + reach)..=middle.max(middle + reach), track.y_range());
        ui.painter().rect_filled(bar, 1.0, colour(self.sign(points)));
        ui.painter().vline(middle, track.y_range(), (1.0, self.quiet));
        put(ui, &points_words(points), rect, Align2::RIGHT_CENTER, self.ink);
        response
    }

    /// Cells coloured by their evidence, a row per channel and a column per phase.
    fn table_ui(&self, ui: &mut Ui, why: &Attribution) {
        let (head, _) = row(ui, "channel by phase");
        let cells = |rect: Rect| -> Vec<Rect> {
            let left = rect.left() + names_width(rect.width()) + 4.0;
            let width = (rect.right() - left) / why.phases.len().max(1) as f32;
            let place = |k: usize| pos2(left + width * k as f32, rect.top());
            (0..why.phases.len()).map(|k| Rect::from_min_size(place(k), vec2(width - 2.0, rect.height()))).collect()
        };
        for (k, (span, cell)) in why.phases.iter().zip(cells(head)).enumerate() {
            // There is room beside the first.
            let (cell, align) = if k == 0 {
                (cell.with_min_x(head.left()), Align2::RIGHT_CENTER)
            } else {
                (cell, Align2::CENTER_CENTER)
            };
            put_sized(ui, (span.phase.name(), HEADERS), cell, align, self.quiet);
        }
        for ((channel, evidence), unloaded) in why.channels.iter().zip(&why.by_both).zip(&why.unloaded) {
            let name = channel_words(channel);
            let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
            put(ui, &name, rect.with_max_x(rect.left() + names_width(rect.width())), Align2::LEFT_CENTER, self.ink);
            for (((span, own), unloaded), cell) in why.phases.iter().zip(evidence).zip(unloaded).zip(cells(rect)) {
                self.cell_ui(ui, (&name, span.phase, *unloaded), own, cell);
            }
        }
    }

    fn cell_ui(&self, ui: &Ui, part: (&str, TouchPhase, bool), evidence: &Evidence, cell: Rect) {
        let (channel, phase, unloaded) = part;
        let touches = if unloaded { ", which touches nothing" } else { "" };
        let name = format!("{channel}{touches}, {}", phase.name());
        let text = format!("{name}: {}", spoken(evidence.points));
        let response = ui.interact(cell, ui.scope_id().with(("cell", channel, phase)), Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, &text));
        let share = (evidence.points.abs() / self.scale).clamp(0.0, 1.0) as f32;
        ui.painter().rect_filled(cell, 2.0, self.ground);
        ui.painter().rect_filled(cell, 2.0, veil(self.sign(evidence.points), 0.6 * share));
        put(ui, &points_words(evidence.points), cell, Align2::CENTER_CENTER, self.ink);
        response.on_hover_text(format!("{text}, of those of the channel"));
    }
}

fn spoken(points: f64) -> String {
    format!("{} percentage points", points_words(points))
}

fn hint_of(name: &str, evidence: &Evidence) -> String {
    let side = if evidence.points < 0.0 { "against" } else { "for" };
    let times = units::three_digits(10_f64.powf(0.1 * evidence.decibans));
    format!(
        "{name}: {} {side} the answer; odds against the second class {times} times as high as without it",
        spoken(evidence.points)
    )
}

/// Row over the whole width, with its text for screen readers.
fn row(ui: &mut Ui, text: &str) -> (Rect, Response) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, text));
    (rect, response)
}

fn names_width(width: f32) -> f32 {
    (NAMES.0 * width).min(NAMES.1)
}

/// Paints a line of text.
fn put(ui: &Ui, text: &str, place: Rect, align: Align2, ink: Color32) {
    put_sized(ui, (text, LETTERS), place, align, ink);
}

/// Paints a line of text, smaller where it needs more than its place.
fn put_sized(ui: &Ui, (text, most): (&str, f32), place: Rect, align: Align2, ink: Color32) {
    widgets::put(ui, widgets::fitted(ui, text, [LEAST_LETTERS, most], place.width(), ink), place, align);
}

fn nearest_ui(
    ui: &mut Ui,
    (explainer, last): (&Explainer, Option<TrialId>),
    pictures: &Thumbnails,
    request: &ExplainRequest,
    actions: &mut Actions,
) {
    heading(ui, "Nearest stored trials", "By the root mean square difference of all channels over the grasp");
    let nearest = &explainer.nearest;
    match nearest.last().filter(|ended| ended.command.is_like(request)).map(|ended| ended.outcome) {
        Some(Ok(report)) => report_ui(ui, pictures, &report, last, actions),
        Some(Err(cause)) => {
            let ink = colour(theme::of(ui).colours().error);
            wrapped(ui, RichText::new(format!("The store cannot be read: {cause}.")).color(ink));
        }
        None => {
            // The answer may have been weighed beside it already.
            let request = request.clone();
            actions.push(move |app| app.recognition.explainer.explain(&request));
            let words = nearest.running().map(|running| running.progress.words).filter(|words| !words.is_empty());
            ui.weak(words.unwrap_or_else(|| "Reading the store …".to_owned()));
        }
    }
}

fn report_ui(ui: &mut Ui, pictures: &Thumbnails, report: &NearestReport, last: Option<TrialId>, actions: &mut Actions) {
    if report.trials.is_empty() {
        remark_ui(ui, "No stored trial has these channels. Record grasps, or run palpate collect.");
        return;
    }
    let colours = theme::of(ui).colours();
    // The grasp itself, as it was just stored, is none of its neighbours.
    let is_other = |own: &&NearestTrial| own.distance >= SAME || Some(own.id) != last;
    let itself = report.trials.iter().filter(|own| !is_other(own)).count();
    for trial in report.trials.iter().filter(is_other) {
        let name = if trial.label.is_empty() { "unlabelled".to_owned() } else { capital_title(&trial.label) };
        let same = if trial.distance < SAME { ", same readings" } else { "" };
        let source = trial.source.title();
        let text = format!("Trial {}, {name}, {source}, distance {:.2}{same}", trial.id, trial.distance);
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, &text));
        if response.hovered() || response.has_focus() {
            let ground = colours.background.mix(colours.accent, 0.15);
            ui.painter().rect_filled(rect, 3.0, colour(ground));
        }
        let picture = Rect::from_min_size(rect.min, vec2(ROW, ROW));
        if let Some(texture) = pictures.get(&trial.label) {
            egui::Image::new(texture).corner_radius(3.0).paint_at(ui, picture.shrink(1.0));
        }
        let words = rect.with_min_x(picture.right() + 6.0).with_max_x(rect.right() - NUMBER);
        put(ui, &format!("{name}  {source} {}{same}", trial.id), words, Align2::LEFT_CENTER, colour(colours.text));
        put(ui, &format!("{:.2}", trial.distance), rect, Align2::RIGHT_CENTER, colour(colours.text));
        if response.on_hover_text(format!("{text}; click to open it")).clicked() {
            let id = trial.id;
            actions.push(move |app| app.open_trial(id));
        }
    }
    let left_out =
        if report.left_out > 0 { format!("; {} have other channels", report.left_out) } else { String::new() };
    let compared = match (report.older, report.compared - itself) {
        (0, 1) => "1 trial is compared".to_owned(),
        (0, compared) => format!("{compared} trials are compared"),
        (older, compared) => format!("The newest {compared} trials are compared, {older} older ones are not"),
    };
    let about = format!("Distance in spreads within a class; 0 for the same readings. {compared}{left_out}.");
    wrapped(ui, RichText::new(about).small().weak());
}
