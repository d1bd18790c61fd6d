//! Command palette: every action of the window, found by a part of its name. Actions with a key show it.

use crate::app::actions::{Action, Actions};
use crate::app::context::PanelContext;
use crate::app::features::gripper::GripperAction;
use crate::app::features::inspect::InspectAction;
use crate::app::features::recognition::RecognitionAction;
use crate::app::features::simulation::SimulationAction;
use crate::app::features::view::{SCALES, ViewAction};
use crate::app::keys;
use crate::app::modes;
use crate::app::panels;
use crate::app::playback::SPEEDS;
use crate::app::theme::colour;
use crate::app::view_source::ViewSource;
use crate::app::widgets::text_field;
use egui::{Align2, FontId, Key, ScrollArea, Sense, Ui, vec2};
use palpate_geometry::palette::Theme;
use palpate_lab::workers::{Command, GripperCommand};
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_store::TrialPlace;

/// Entry of the palette.
struct Entry {
    group: &'static str,
    title: String,
    /// Its key, where it has one.
    key: String,
    actions: Vec<Action>,
}

/// Size of the palette (points).
const WIDTH: f32 = 520.0;
const ROW: f32 = 24.0;
/// Entries of the palette in sight.
const ROWS: f32 = 14.0;

/// Search and selection, while the palette is open.
#[derive(Clone, Default)]
struct Search {
    text: String,
    chosen: usize,
}

/// Draws the palette while it is open.
pub(super) fn ui(ctx: &egui::Context, context: &PanelContext<'_>, actions: &mut Actions) {
    let id = egui::Id::unique("command palette");
    if !context.view.palette_shown {
        return ctx.data_mut(|data| data.remove::<Search>(id));
    }
    let opened = ctx.data(|data| data.get_temp::<Search>(id));
    let mut search = opened.clone().unwrap_or_default();
    let entries = found(entries(ctx, context), &search.text);
    let [up, down, enter, closing] = ctx.input_mut(|input| {
        let taken = [Key::ArrowUp, Key::ArrowDown, Key::Enter, Key::Escape];
        let mut pressed = taken.map(|key| input.consume_key(egui::Modifiers::NONE, key));
        pressed[3] |= input.consume_key(egui::Modifiers::COMMAND, Key::K);
        pressed
    });
    let last = entries.len().saturating_sub(1);
    search.chosen = (search.chosen + usize::from(down)).saturating_sub(usize::from(up)).min(last);
    let mut run = enter.then_some(search.chosen);
    let room = ctx.content_rect();
    let width = WIDTH.min(room.width() - 24.0);
    let frame = egui::Frame::window(&ctx.global_style()).inner_margin(8);
    let area = egui::Area::new(id).order(egui::Order::Foreground).anchor(Align2::CENTER_TOP, vec2(0.0, 56.0));
    let drawn = area.show(ctx, |ui| {
        frame.show(ui, |ui| {
            ui.set_width(width - 16.0);
            let field = text_field(&mut search.text, id.with("field")).hint_text("find an action, object or panel ..");
            let response = ui.add(field);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SearchInput, true, "Find an action"));
            if response.changed() {
                search.chosen = 0;
            }
            response.request_focus();
            let height = (ROWS * ROW).min(room.height() - 130.0);
            ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 0.0;
                if entries.is_empty() {
                    ui.weak("No action has this name.");
                }
                for (place, entry) in entries.iter().enumerate() {
                    let chosen = place == search.chosen;
                    let response = row_ui(ui, context.view.theme, entry, chosen);
                    if chosen && (up || down || opened.is_none()) {
                        response.scroll_to_me(None);
                    }
                    if response.clicked() {
                        run = Some(place);
                    }
                }
            });
        });
    });
    let pointer = ctx.input(|input| input.pointer.any_pressed().then(|| input.pointer.interact_pos()).flatten());
    let outside = opened.is_some() && pointer.is_some_and(|at| !drawn.response.rect.contains(at));
    ctx.data_mut(|data| data.insert_temp(id, search));
    let entry = run.and_then(|place| entries.into_iter().nth(place));
    if entry.is_some() || closing || outside {
        actions.push(ViewAction::ShowPalette(false));
    }
    entry.into_iter().flat_map(|entry| entry.actions).for_each(|action| actions.push(action));
}

fn row_ui(ui: &mut Ui, theme: Theme, entry: &Entry, chosen: bool) -> egui::Response {
    let colours = theme.colours();
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let Entry { group, title, key, .. } = entry;
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, chosen, format!("{group}: {title}")));
    if chosen || response.hovered() {
        let share = if chosen { 0.30 } else { 0.10 };
        ui.painter().rect_filled(rect, 4.0, colour(colours.background.mix(colours.accent, share)));
    }
    let [quiet, ink] = [colours.quiet_text, colours.text].map(colour);
    let small = FontId::proportional(11.5);
    let painter = ui.painter_at(rect.shrink2(vec2(6.0, 0.0)));
    painter.text(rect.left_center() + vec2(6.0, 0.0), Align2::LEFT_CENTER, group, small, quiet);
    let right = rect.right_center() - vec2(6.0, 0.0);
    let key = painter.text(right, Align2::RIGHT_CENTER, key, FontId::monospace(12.0), quiet);
    let place = rect.left_center() + vec2(104.0, 0.0);
    let room = (key.left() - 8.0 - place.x).max(20.0);
    let mut job = egui::text::LayoutJob::simple_singleline(title.clone(), FontId::proportional(13.5), ink);
    job.wrap = egui::text::TextWrapping::truncate_at_width(room);
    let galley = painter.layout_job(job);
    painter.galley(place - vec2(0.0, 0.5 * galley.size().y), galley, ink);
    response
}

/// Every action, by group.
fn entries(ctx: &egui::Context, context: &PanelContext<'_>) -> Vec<Entry> {
    let mode = context.view.mode;
    let mut all = Vec::new();
    for (group, bindings) in keys::groups(mode) {
        for binding in bindings.into_iter().filter(|binding| !binding.does.is_empty()) {
            let key = ctx.format_shortcut(&binding.shortcut);
            all.push(Entry { group, title: capital(binding.does), key, actions: vec![binding.action(context)] });
        }
    }
    let mut add = |group: &'static str, title: String, actions: Vec<Action>| {
        all.push(Entry { group, title, key: String::new(), actions });
    };
    for (title, action) in commands(context) {
        add("Command", title, vec![action]);
    }
    for panel in &panels::ALL {
        add("Panel", panel.title.to_owned(), vec![ViewAction::ShowPanel(panel.name).into()]);
    }
    let grasped = |name: &str| {
        let open = SimulationAction::OpenObject(name.to_owned());
        vec![ViewAction::Show(ViewSource::Simulation).into(), open.into()]
    };
    for built_in in catalogue() {
        add("Grasp", built_in.title.clone(), grasped(&built_in.name));
    }
    add("Grasp", "Empty hand".to_owned(), grasped(EMPTY));
    for path in &context.view.recent {
        add("Grasp", path.clone(), grasped(path));
    }
    // Keys of other modes may be about things not in sight: they open their mode.
    for kind in modes::ALL.iter().filter(|kind| kind.mode != mode) {
        for binding in kind.keys.iter().filter(|binding| !binding.does.is_empty()) {
            let key =
                format!("{} {}", ctx.format_shortcut(&kind.open.shortcut), ctx.format_shortcut(&binding.shortcut));
            let title = format!("{} (opens {} mode)", capital(binding.does), kind.title);
            all.push(Entry { group: kind.title, title, key, actions: vec![ViewAction::SetMode(kind.mode).into()] });
        }
    }
    all
}

/// Actions without a key.
fn commands(context: &PanelContext<'_>) -> Vec<(String, Action)> {
    let text = |text: &str| text.to_owned();
    let mut all: Vec<(String, Action)> = vec![
        (text("Dark theme"), ViewAction::SetTheme(Theme::Dark).into()),
        (text("Light theme"), ViewAction::SetTheme(Theme::Light).into()),
        (text("Reset layout of all modes"), ViewAction::ResetLayout.into()),
        (text("Show or hide the true object"), ViewAction::ShowTruth(!context.view.truth_shown).into()),
        (text("Show the simulation"), ViewAction::Show(ViewSource::Simulation).into()),
        (text("Show the real gripper"), ViewAction::Show(ViewSource::Gripper).into()),
        (text("Close the stored trial that is open"), InspectAction::Close.into()),
        (text("Remove all trials from the comparison"), InspectAction::UnpinAll.into()),
        (text("Show mean and spread of each class"), InspectAction::ShowSpread(true).into()),
        (text("Show each compared trial"), InspectAction::ShowSpread(false).into()),
        (text("Show the whole grasp in all plots"), ViewAction::SetTimeWindow(None).into()),
        (text("Measure effects of the scene"), SimulationAction::MeasureEffects.into()),
        (text("Compute the last grasp again"), Command::ComputeAgain.into()),
        (text("Use the shipped model for the real gripper"), RecognitionAction::UseModel(None).into()),
        (text("Teach the model the object file in the hand"), RecognitionAction::TeachObject.into()),
        (text("Detect trials automatically, or by key"), GripperAction::ToggleWatch.into()),
        (text("Next actuation: manual, board or untimed"), GripperAction::NextControl.into()),
        (
            text("Adapt to the real gripper by one close of the empty hand"),
            GripperCommand::Adapt(context.view.control).into(),
        ),
        (text("List serial ports"), GripperCommand::ListPorts.into()),
    ];
    if let Some(snapshot) = context.snapshot {
        let status = &snapshot.status;
        for place in TrialPlace::ALL {
            let title = format!("Record simulated grasps into the {}", place.title());
            all.push((title, Command::SetRecording(Some(place)).into()));
        }
        all.push((text("Error band, on or off"), Command::SetErrorBand(!status.error_band).into()));
    }
    all.extend(SPEEDS.iter().map(|speed| (format!("Speed {speed}×"), Command::SetSpeed(*speed).into())));
    let steps = (SCALES.start() * 5.0).round() as u32..=(SCALES.end() * 5.0).round() as u32;
    all.extend(steps.map(|step| (format!("UI scale {} %", step * 20), ViewAction::SetScale(step as f32 / 5.0).into())));
    all
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// Entries whose title or group has the letters of the text in their order, best first.
fn found(entries: Vec<Entry>, text: &str) -> Vec<Entry> {
    let mut scored: Vec<(i32, Entry)> = entries
        .into_iter()
        .filter_map(|entry| {
            let title = score(&entry.title, text);
            let whole = score(&format!("{} {}", entry.group, entry.title), text).map(|score| score - 3);
            title.max(whole).map(|score| (score, entry))
        })
        .collect();
    scored.sort_by_key(|(score, _)| -score);
    scored.into_iter().map(|(_, entry)| entry).collect()
}

/// How well a text fits a title; `None` where a letter is missing. Beginnings of words and runs of letters count more.
fn score(title: &str, text: &str) -> Option<i32> {
    let title: Vec<char> = title.to_lowercase().chars().collect();
    let wanted: Vec<char> = text.to_lowercase().chars().filter(|letter| !letter.is_whitespace()).collect();
    let starts = |at: usize| at == 0 || !title[at - 1].is_alphanumeric();
    // Best score of all letters so far, by the place of the last one.
    let mut best: Vec<Option<i32>> = vec![Some(0); title.len() + 1];
    for (k, letter) in wanted.iter().enumerate() {
        let mut next = vec![None; title.len() + 1];
        for (at, _) in title.iter().enumerate().filter(|(_, own)| *own == letter) {
            let run = if k > 0 { best[at].map(|score| score + 6) } else { None };
            let before = if k == 0 { Some(0) } else { best[..at].iter().copied().flatten().max() };
            let gain = 1 + if starts(at) { 5 } else { 0 };
            next[at + 1] = run.max(before).map(|score| score + gain);
        }
        best = next;
    }
    let length = (title.len() / 24) as i32;
    best.into_iter().flatten().max().map(|score| if wanted.is_empty() { 0 } else { score - length })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_in_their_order_are_found_and_words_count_more() {
        assert_eq!(score("Tennis ball", "xyz"), None);
        assert_eq!(score("Tennis ball", "llab"), None);
        assert!(score("Tennis ball", "tb") > score("Tabletop cube", "tb"));
        assert!(score("Save the scene", "save") > score("Show a very early one", "save"));
        assert!(score("Lemon", "LEM") > score("Larger element", "lem"));
        assert_eq!(score("Lemon", ""), Some(0));
    }
}
