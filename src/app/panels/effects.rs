//! Physical effects as a table: setting, and bars of cost and change, which are measured in the background while the
//! panel is open. Rows keep their place: values of the scene before
//! stay, dimmed and named so, until new ones come. A click on a name unfolds it.

use crate::app::actions::Actions;
use crate::app::features::simulation::SimulationFeature;
use crate::app::theme::{self, colour, veil};
use crate::app::widgets::{capital, fitted, put, put_line, words};
use egui::{Align, Color32, Layout, Rect, RichText, ScrollArea, Sense, Ui, UiBuilder, vec2};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::{symbol, three_digits};
use palpate_sim::frame::PlannedEffect;
use palpate_sim::scene::{Effect, Setting};
use palpate_study::{ExplainedEffect, Explanation};

/// Height of a row (points).
const ROW: f32 = 23.0;
/// Widths of the lamp and of the three settings together.
const LAMP: f32 = 14.0;
const SETTINGS: f32 = 86.0;
/// Least and largest width of a bar; names take the rest.
const BARS: std::ops::RangeInclusive<f32> = 26.0..=70.0;
/// Width of the longest name.
const NAME: f32 = 92.0;
const GAP: f32 = 4.0;
/// Opacity of values that a new measurement will replace.
const DIMMED: f32 = 0.4;
/// Origin of dimmed values.
const BEFORE: &str = "of the scene before";
/// Smallest change that has a bar, as a share of a sensor's range; the bar is logarithmic.
const LEAST_CHANGE: f64 = 1e-3;

pub(super) fn ui(ui: &mut Ui, simulation: &SimulationFeature, actions: &mut Actions) {
    let (running, last) = simulation.effects.state();
    let fresh = last.as_ref().filter(|ended| *ended.command == simulation.scene);
    if fresh.is_none() && running.as_ref().is_none_or(|running| *running.command != simulation.scene) {
        actions.push(|app| app.simulation.measure_effects());
    }
    let explanation = last.as_ref().and_then(|ended| ended.outcome.as_deref().ok());
    let state = match fresh.map(|ended| &ended.outcome) {
        Some(Ok(_)) => "costs are shares of a grasp's CPU time".to_owned(),
        Some(Err(cause)) => cause.to_string(),
        None => running
            .map(|running| running.progress.words)
            .filter(|words| !words.is_empty())
            .unwrap_or_else(|| "measuring …".to_owned()),
    };
    let fresh = fresh.is_some();
    let mut scene = simulation.scene.clone();
    let unfolded_id = ui.scope_id().with("unfolded");
    let mut unfolded: Option<Effect> = ui.data(|data| data.get_temp(unfolded_id)).flatten();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        state_ui(ui, if fresh || explanation.is_none() { state } else { format!("{BEFORE}: {state}") });
        header_ui(ui);
        for effect in Effect::ALL {
            let explained = explanation.and_then(|e| e.effects.iter().find(|e| e.planned.name == effect.name()));
            // The plan of the current grasp comes before the measurement.
            let running =
                simulation.snapshot.as_ref().and_then(|s| s.plan.effects.iter().find(|e| e.name == effect.name()));
            let planned = if fresh { explained.map(|e| &e.planned).or(running) } else { running };
            let row = Row { effect: *effect, planned, explained, explanation, fresh, theme: theme::of(ui) };
            let open = unfolded == Some(*effect);
            if let Some(setting) = row.setting_ui(ui, scene.effects.get(*effect), open, &mut unfolded) {
                scene.effects.set(*effect, setting);
            }
            if open {
                row.details_ui(ui);
            }
        }
    });
    ui.data_mut(|data| data.insert_temp(unfolded_id, unfolded));
    if scene != simulation.scene {
        actions.push(|app| app.set_scene(scene));
    }
}

/// State of the measurement, in a line.
fn state_ui(ui: &mut Ui, text: String) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
    let line = egui::Label::new(RichText::new(&text).weak()).truncate();
    ui.scope_builder(UiBuilder::new().max_rect(rect).layout(Layout::left_to_right(Align::Center)), |ui| ui.add(line));
    response.on_hover_text(text);
}

/// Columns of a row: lamp, name, settings, cost, change.
fn columns(row: Rect) -> [Rect; 5] {
    let rest = row.width() - LAMP - SETTINGS - NAME - 4.0 * GAP;
    let bar = (0.5 * rest).clamp(*BARS.start(), *BARS.end());
    let name = row.width() - LAMP - SETTINGS - 2.0 * bar - 4.0 * GAP;
    let mut left = row.left();
    [LAMP, name, SETTINGS, bar, bar].map(|width| {
        let rect = Rect::from_min_size(egui::pos2(left, row.top()), vec2(width.max(0.0), row.height()));
        left += width + GAP;
        rect
    })
}

fn header_ui(ui: &mut Ui) {
    let (row, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW - 4.0), Sense::hover());
    let [lamp, name, settings, cost, change] = columns(row);
    let titles = [
        (lamp.union(name), "effect", "Click a name for the reason, the cost and the change in words"),
        (settings, "setting", "auto: on where the scene calls for it"),
        (cost, "cost", "CPU time that the effect takes, or would take; the bar ends at all of the grasp's"),
        (
            change,
            "change",
            "Largest change of curvature, pressure or force without it, or with it; logarithmic, 0.1 to 100 %",
        ),
    ];
    for (rect, title, hover) in titles {
        // What reaches beyond its column would widen the rows below.
        put_line(ui, rect, egui::Align2::LEFT_CENTER, title, 11.0, ui.visuals().weak_text_color());
        ui.interact(rect, ui.scope_id().with(("column", title)), Sense::hover()).on_hover_text(hover);
    }
}

/// An effect with what is known of it.
struct Row<'a> {
    effect: Effect,
    planned: Option<&'a PlannedEffect>,
    explained: Option<&'a ExplainedEffect>,
    explanation: Option<&'a Explanation>,
    /// False while a new measurement is under way.
    fresh: bool,
    theme: Theme,
}

impl Row<'_> {
    /// Draws the row; returns a setting that was clicked.
    fn setting_ui(&self, ui: &mut Ui, now: Setting, open: bool, unfolded: &mut Option<Effect>) -> Option<Setting> {
        let (row, _) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
        let [lamp, name, settings, cost, change] = columns(row);
        lamp_ui(ui, lamp, self.theme, &words(self.effect.name()), self.planned.is_some_and(|planned| planned.on));
        if self.name_ui(ui, name, open) {
            *unfolded = if open { None } else { Some(self.effect) };
        }
        let clicked = settings_ui(ui, settings, &words(self.effect.name()), now);
        if let (Some(explained), Some(explanation)) = (self.explained, self.explanation) {
            let colours = self.theme.colours();
            let share = explained.cost_share.max(0.0) as f32;
            self.bar_ui(ui, cost, (share, colour(colours.accent)), &explained.cost_in_words());
            if explained.is_saving() {
                put_line(ui, cost, egui::Align2::CENTER_CENTER, "saves", 10.0, colour(colours.quiet_text));
            }
            let size = explained.change.norms;
            let largest = size.curvature_share.max(size.pressure_share).max(size.force_share);
            let share = (1.0 - (largest.max(LEAST_CHANGE)).log10() / LEAST_CHANGE.log10()) as f32;
            let words = symbol(&explained.change_in_words(explanation.contact_onset_s));
            self.bar_ui(ui, change, (share, colour(colours.warning)), &words);
        }
        clicked
    }

    /// The name; true when it was clicked.
    fn name_ui(&self, ui: &mut Ui, rect: Rect, open: bool) -> bool {
        let response = ui.interact(rect, ui.scope_id().with(("name", self.effect.name())), Sense::click());
        let colours = self.theme.colours();
        let ink = if response.hovered() || open { colours.accent } else { colours.text };
        let name = words(self.effect.name());
        let text =
            fitted(ui, &name, [9.0, egui::TextStyle::Body.resolve(ui.style()).size], rect.width() + GAP, colour(ink));
        put(ui, text, rect, egui::Align2::LEFT_CENTER);
        response.widget_info(|| {
            egui::WidgetInfo::selected(egui::Role::Button, true, open, format!("about {}", words(self.effect.name())))
        });
        let clicked = response.clicked();
        if let Some(planned) = self.planned {
            response.on_hover_text(reason(planned));
        }
        clicked
    }

    /// A bar from the left; its words for the mouse and for screen readers.
    fn bar_ui(&self, ui: &mut Ui, rect: Rect, (share, ink): (f32, Color32), words: &str) {
        let response = ui.interact(rect, ui.scope_id().with((rect.left() as i32, self.effect.name())), Sense::hover());
        let opacity = if self.fresh { 1.0 } else { DIMMED };
        let room = rect.shrink2(vec2(0.0, 0.5 * (rect.height() - 9.0)));
        ui.painter().rect_filled(room, 2.0, veil(self.theme.colours().border, 0.5 * opacity));
        let width = room.width() * share.clamp(0.0, 1.0);
        if width >= 0.5 {
            let filled = Rect::from_min_size(room.min, vec2(width, room.height()));
            ui.painter().rect_filled(filled, 2.0, ink.gamma_multiply(opacity));
        }
        let words = if self.fresh { words.to_owned() } else { format!("{words} ({BEFORE})") };
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &words));
        response.on_hover_text(format!("{}: {words}", self::words(self.effect.name())));
    }

    /// Reason, cost and change in words.
    fn details_ui(&self, ui: &mut Ui) {
        let mut lines = Vec::new();
        if let Some(explained) = self.explained {
            lines.push(explained.about.to_owned());
        }
        lines.extend(self.planned.map(reason));
        if let (Some(explained), Some(explanation)) = (self.explained, self.explanation) {
            if !self.fresh {
                lines.push(format!("The numbers below are {BEFORE}."));
            }
            lines.push(format!("It {}.", explained.cost_in_words()));
            lines.push(format!("{}.", capital(&symbol(&explained.change_in_words(explanation.contact_onset_s)))));
        }
        let indented = egui::Margin { left: (LAMP + GAP) as i8, bottom: 6, ..egui::Margin::ZERO };
        egui::Frame::new().inner_margin(indented).show(ui, |ui| {
            for line in lines {
                let text = RichText::new(line).small();
                ui.add(egui::Label::new(if self.fresh { text } else { text.weak() }).wrap());
            }
        });
    }
}

/// Reason of a decision with its number.
fn reason(planned: &PlannedEffect) -> String {
    let relation = if planned.number > planned.threshold { ">" } else { "≤" };
    format!("{} ({} {relation} {})", capital(&planned.reason), three_digits(planned.number), planned.threshold)
}

/// Off, auto, on as three cells; returns the one that was clicked.
fn settings_ui(ui: &mut Ui, rect: Rect, name: &str, now: Setting) -> Option<Setting> {
    let mut clicked = None;
    let builder = UiBuilder::new().max_rect(rect).layout(Layout::left_to_right(Align::Center));
    ui.scope_builder(builder, |ui| {
        ui.spacing_mut().item_spacing.x = 1.0;
        ui.spacing_mut().button_padding = vec2(3.5, 1.0);
        ui.spacing_mut().interact_size.y = ROW - 4.0;
        for setting in Setting::ALL {
            let chosen = now == setting;
            let response = ui.selectable_label(chosen, RichText::new(setting.name()).small());
            let label = format!("{name} {}", setting.name());
            response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, chosen, &label));
            if response.clicked() {
                clicked = Some(setting);
            }
        }
    });
    clicked
}

/// Lamp, lit where the effect is on.
fn lamp_ui(ui: &mut Ui, rect: Rect, theme: Theme, name: &str, on: bool) {
    let response = ui.interact(rect, ui.scope_id().with(("lamp", name)), Sense::hover());
    let label = format!("{name} is {}", if on { "on" } else { "off" });
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &label));
    let colours = theme.colours();
    let centre = rect.center();
    if on {
        ui.painter().circle_filled(centre, 4.5, colour(colours.accent));
    }
    let rim = if on { colours.accent } else { colours.quiet_text };
    ui.painter().circle_stroke(centre, 4.5, egui::Stroke::new(1.2, colour(rim)));
    response.on_hover_text(label);
}
