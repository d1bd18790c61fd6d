//! Widgets that several panels share.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::theme::{self, colour, veil};
use egui::text::{LayoutJob, TextWrapping};
use egui::text_edit::TextEditState;
use egui::{
    Align2, AsIdSalt, Button, Color32, FontId, Galley, Id, Label, ProgressBar, Rect, Response, RichText, Role, Sense,
    Stroke, TextEdit, Ui, UiBuilder, Widget, WidgetInfo, pos2, vec2,
};
use palpate_geometry::palette::{Rgb, Trace};
pub(super) use palpate_geometry::units::capital;
use palpate_geometry::units::message;
use palpate_lab::workers::{GripperCommand, GripperView, Job, JobFailure};
use palpate_store::labels::Sparkline;
use palpate_tactile::trial::Control;
use std::fmt::Display;
use std::path::PathBuf;
use std::sync::Arc;

/// Text that wraps.
pub(super) fn wrapped(ui: &mut Ui, text: RichText) {
    ui.add(Label::new(text).wrap());
}

/// Remark that wraps.
pub(super) fn remark_ui(ui: &mut Ui, text: impl Into<String>) {
    wrapped(ui, RichText::new(text).weak());
}

/// Warning that wraps.
pub(super) fn warning_ui(ui: &mut Ui, text: impl Into<String>) {
    wrapped(ui, RichText::new(text).color(ui.visuals().warn_fg_color));
}

/// Chip: a short text on a veil of its colour.
pub(super) fn chip(ui: &mut Ui, text: impl Into<String>, ink: Rgb) -> Response {
    let frame = egui::Frame::new().fill(veil(ink, 0.14)).corner_radius(4).inner_margin(egui::Margin::symmetric(5, 1));
    let text = RichText::new(text).small().color(colour(ink));
    frame.show(ui, |ui| ui.label(text)).response
}

/// Chip that names sensors of the real gripper that have failed.
pub(super) fn failed_sensors_ui(ui: &mut Ui, gripper: &GripperView) {
    if let Some(failed) = &gripper.failed {
        let about = "The Doctor names the cause. Sensors count as sound again after Tare (T), a calibration or a new connection";
        let ink = theme::of(ui).colours().warning;
        chip(ui, failed.as_ref(), ink).on_hover_text(about);
    }
}

/// Row that can be chosen, with its name for screen readers.
pub(super) fn selectable_row(ui: &mut Ui, height: f32, chosen: bool, name: &str) -> (Rect, Response) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::Button, true, chosen, name));
    if chosen || response.hovered() || response.has_focus() {
        let (colours, share) = (theme::of(ui).colours(), if chosen { 0.30 } else { 0.10 });
        ui.painter().rect_filled(rect, 4.0, colour(colours.background.mix(colours.accent, share)));
    }
    (rect, response)
}

/// Choices beside each other, each with a hint; the one that was clicked.
pub(super) fn choice_ui<T: PartialEq + Copy>(
    ui: &mut Ui,
    now: Option<T>,
    choices: impl IntoIterator<Item = (T, impl Into<String>, &'static str)>,
) -> Option<T> {
    let mut clicked = None;
    for (choice, name, hint) in choices {
        if ui.selectable_label(now == Some(choice), name.into()).on_hover_text(hint).clicked() {
            clicked = Some(choice);
        }
    }
    clicked
}

/// Why something failed, in red.
pub(super) fn failure_ui(ui: &mut Ui, cause: impl Display) {
    wrapped(ui, RichText::new(message(&cause.to_string())).color(ui.visuals().error_fg_color));
}

/// A job in a panel: its controls or, while it runs, its progress, a remark, and a button that stops it, with a hint that says
/// what that does. Returns its last outcome, to be shown below.
pub(super) fn job_ui<C, O>(
    ui: &mut Ui,
    job: &Job<C, O>,
    (remark, hint, stop): (Option<&str>, &str, fn(&mut App)),
    actions: &mut Actions,
    controls: impl FnOnce(&mut Ui, &mut Actions),
) -> Option<Result<Arc<O>, JobFailure>> {
    let (running, last) = job.state();
    match running.map(|running| running.progress) {
        Some(progress) => {
            progress_ui(ui, progress.share, &progress.words);
            if let Some(remark) = remark {
                wrapped(ui, RichText::new(remark).strong());
            }
            actions.on(&ui.button("Stop").on_hover_text(hint), stop);
        }
        None => controls(ui, actions),
    }
    last.map(|ended| ended.outcome)
}

/// Field for a line of text, as wide as there is room. Its id is fixed: it keeps the keyboard while widgets above it come
/// and go.
pub(super) fn text_field(text: &mut String, id: Id) -> TextEdit<'_> {
    TextEdit::singleline(text).id(id).desired_width(f32::INFINITY)
}

/// Moves the keyboard to a text field, to the end of the text typed ahead; true once the field has it.
pub(super) fn focus_field(ui: &Ui, id: Id) -> bool {
    let focused = ui.memory(|memory| memory.has_focus(id));
    let mut state = TextEditState::load(ui.ctx(), id).unwrap_or_default();
    state.cursor.set_char_range(None);
    state.store(ui.ctx(), id);
    ui.memory_mut(|memory| memory.request_focus(id));
    focused
}

/// Adds a number that can be typed, under a fixed id for the same reason.
pub(super) fn number_field(ui: &mut Ui, name: impl AsIdSalt, number: impl Widget) -> Response {
    ui.scope_builder(UiBuilder::new().scope_id(ui.scope_id().with(name)), |ui| ui.add(number)).inner
}

/// Terminal command for `purpose`, with a button that copies it.
pub(super) fn command_ui(ui: &mut Ui, purpose: &str, command: &str) {
    egui::Frame::new().fill(ui.visuals().faint_bg_color).corner_radius(4).inner_margin(6).show(ui, |ui| {
        ui.add(Label::new(RichText::new(command).monospace()).wrap());
        let copy = ui.add(Button::new("Copy"));
        let label = format!("Copy the command for {purpose}");
        copy.widget_info(|| WidgetInfo::labeled(Role::Button, true, &label));
        if copy.on_hover_text("Copy it for a terminal").clicked() {
            ui.copy_text(command.to_owned());
        }
    });
}

/// True in the first frame in which `name` is shown again: a panel then updates data from elsewhere.
pub(super) fn just_opened(ui: &Ui, name: &str) -> bool {
    let id = egui::Id::unique(("shown last", name));
    let now = ui.ctx().cumulative_frame_nr();
    let last = ui.data_mut(|data| {
        let last = data.get_temp::<u64>(id);
        data.insert_temp(id, now);
        last
    });
    last.is_none_or(|last| last + 1 < now)
}

/// Field for a port of the real gripper; none where it is empty. Its text is kept under `id`.
pub(super) fn port_field(ui: &mut Ui, id: egui::Id) -> Option<PathBuf> {
    let mut port = ui.data_mut(|data| data.get_temp::<String>(id)).unwrap_or_default();
    ui.horizontal(|ui| {
        let label = ui.label("Port");
        ui.add(text_field(&mut port, id.with("field")).hint_text(ANY_PORT)).labelled_by(label.id);
    });
    let named = Some(port.trim()).filter(|port| !port.is_empty()).map(PathBuf::from);
    ui.data_mut(|data| data.insert_temp(id, port));
    named
}

/// Opacity of values that were read in the past.
pub(super) const PAST: f32 = 0.45;
/// Hint in an empty field for a port.
pub(super) const ANY_PORT: &str = "automatic";

/// Stop button, the same everywhere.
pub(super) fn stop_button(ui: &mut Ui, actions: &mut Actions) {
    let colours = theme::of(ui).colours();
    let text = RichText::new("STOP  Esc").strong().color(colour(colours.background));
    let button = Button::new(text).fill(colour(colours.error));
    let response = ui.add_sized([84.0, 26.0], button).on_hover_text("Vent the fingers and end the trial (Esc)");
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, "Stop and vent"));
    actions.on(&response, |app| _ = app.gripper.send(GripperCommand::Vent));
}

/// Button that calibrates the sensors by one close of the empty hand.
pub(super) fn adapt_button(ui: &mut Ui, gripper: Option<&GripperView>, control: Control, actions: &mut Actions) {
    let free =
        gripper.is_some_and(|gripper| gripper.trial.is_none() && !gripper.is_silent()) && control != Control::Free;
    let button = ui.add_enabled(free, Button::new("Adapt")).on_hover_text(
        "Close the empty hand once and calibrate the sensors by it, so that objects are recognised without labels. Sensors \
         that were calibrated by hand stay so",
    );
    let button = button.on_disabled_hover_text("Between trials, with the hand driven by the board or timed by hand");
    actions.on(&button, |app| _ = app.gripper.send(GripperCommand::Adapt(app.control())));
}

/// The name of an effect or a check in words.
pub(super) fn words(name: &str) -> String {
    name.replace('-', " ")
}

/// Progress as a bar, its words cut with dots where they have no room.
pub(super) fn progress_ui(ui: &mut Ui, share: f64, words: &str) {
    // Narrow panels cut it off.
    let bar = ui.add(ProgressBar::new(share as f32)).on_hover_text(words);
    bar.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, words));
    let inside = bar.rect.shrink2(vec2(8.0, 0.0));
    put_line(ui, inside, Align2::LEFT_CENTER, words, 12.0, ui.visuals().strong_text_color());
}

/// One line of text, smaller where it needs more than the width; cut with dots where the smallest letters do not suffice.
pub(super) fn fitted(ui: &Ui, text: &str, [least, most]: [f32; 2], width: f32, ink: Color32) -> Arc<Galley> {
    let line = |letters: f32| LayoutJob::simple_singleline(text.to_owned(), FontId::proportional(letters), ink);
    let whole = ui.painter().layout_job(line(most));
    if whole.size().x <= width {
        return whole;
    }
    let mut job = line((0.97 * most * width / whole.size().x).floor().clamp(least.min(most), most));
    job.wrap = TextWrapping::truncate_at_width(width.max(1.0));
    ui.painter().layout_job(job)
}

/// Paints a text aligned within a place; its right end.
pub(super) fn put(ui: &Ui, text: Arc<Galley>, place: Rect, align: Align2) -> f32 {
    let at = align.align_size_within_rect(text.size(), place);
    ui.painter().galley(at.min, text, Color32::PLACEHOLDER);
    at.right()
}

/// Writes one line, cut where there is no room; its right end.
pub(super) fn put_line(ui: &Ui, place: Rect, align: Align2, text: &str, size: f32, ink: Color32) -> f32 {
    if place.is_positive() {
        put(ui, fitted(ui, text, [size; 2], place.width(), ink), place, align)
    } else {
        place.left()
    }
}

/// Least ranges of sparklines of counts and of forces (N), and share of the largest value that one has, so that noise stays low.
pub(super) const LEAST_COUNTS: f32 = 40.0;
pub(super) const LEAST_FORCE: f32 = 1.0;
const LEAST_SHARE: f32 = 0.03;

/// Sparkline of both pads, over the range of its values, `least` at least.
pub(super) fn sparkline(ui: &Ui, (values, least): (&Sparkline, f32), place: Rect) {
    let (theme, painter) = (theme::of(ui), ui.painter_at(place));
    painter.rect_filled(place, 2.0, colour(theme.colours().raised));
    let inks: [Color32; 2] = [Trace::Pressure, Trace::PressureDistal].map(|trace| colour(trace.colour(theme)));
    let all = || values.iter().flatten().flatten().copied();
    let (low, high) = (all().fold(f32::INFINITY, f32::min), all().fold(f32::NEG_INFINITY, f32::max));
    let range = (high - low).max(least).max(LEAST_SHARE * high);
    for (finger, ink) in values.iter().zip(inks) {
        let last = finger.len().saturating_sub(1).max(1) as f32;
        let at = |(k, value): (usize, &Option<f32>)| {
            let x = place.left() + place.width() * k as f32 / last;
            value.map(|value| pos2(x, place.bottom() - 2.0 - (place.height() - 4.0) * (value - low) / range))
        };
        let points: Vec<Option<egui::Pos2>> = finger.iter().enumerate().map(at).collect();
        for piece in points.split(Option::is_none) {
            painter.line(piece.iter().copied().flatten().collect(), Stroke::new(1.2, ink));
        }
    }
}
