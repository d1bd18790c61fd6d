//! Command palette: every action of the window, found by a part of its name. Actions with a key show it.

use crate::app::actions::{Act, Actions};
use crate::app::features::App;
use crate::app::features::view::{Mode, SCALES, ViewSource};
use crate::app::keys;
use crate::app::modes;
use crate::app::panels;
use crate::app::playback::SPEEDS;
use crate::app::theme::colour;
use crate::app::widgets::{capital, put_line, selectable_row, text_field};
use egui::{Align2, FontId, Key, ScrollArea, Ui, vec2};
use palpate_geometry::palette::Theme;
use palpate_lab::workers::Command;
use palpate_sim::objects::{EMPTY, catalogue};
use palpate_study::all_studies;

/// Entry of the palette.
struct Entry {
    group: String,
    title: String,
    /// Its key, where it has one.
    key: String,
    run: Run,
}

type Run = Box<dyn FnOnce(&mut App)>;

/// Size of the palette (points).
const WIDTH: f32 = 620.0;
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
pub(super) fn ui(app: &App, actions: &mut Actions) {
    let (ctx, id) = (&app.ctx, egui::Id::unique("command palette"));
    if !app.view.palette_shown {
        return ctx.data_mut(|data| data.remove::<Search>(id));
    }
    let opened = ctx.data(|data| data.get_temp::<Search>(id));
    let mut search = opened.clone().unwrap_or_default();
    let entries = found(entries(app), &search.text);
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
            let field = text_field(&mut search.text, id.with("field")).hint_text("find an action, object or panel …");
            let response = ui.add(field);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SearchInput, true, "Find an action"));
            if response.changed() {
                search.chosen = 0;
            }
            response.request_focus();
            let height = (ROWS * ROW).min(room.height() - 130.0);
            let list = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
            list.auto_shrink([false, true]).show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 0.0;
                if entries.is_empty() {
                    ui.weak("No action has this name.");
                }
                for (place, entry) in entries.iter().enumerate() {
                    let chosen = place == search.chosen;
                    let response = row_ui(ui, app.view.theme, entry, chosen);
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
        actions.push(|app| app.view.palette_shown = false);
    }
    entry.into_iter().for_each(|entry| actions.push(entry.run));
}

fn row_ui(ui: &mut Ui, theme: Theme, entry: &Entry, chosen: bool) -> egui::Response {
    let colours = theme.colours();
    let Entry { group, title, key, .. } = entry;
    let (rect, response) = selectable_row(ui, ROW, chosen, &format!("{group}: {title}"));
    let [quiet, ink] = [colours.quiet_text, colours.text].map(colour);
    let small = FontId::proportional(11.5);
    let painter = ui.painter_at(rect.shrink2(vec2(6.0, 0.0)));
    painter.text(rect.left_center() + vec2(6.0, 0.0), Align2::LEFT_CENTER, group, small, quiet);
    let right = rect.right_center() - vec2(6.0, 0.0);
    let key = painter.text(right, Align2::RIGHT_CENTER, key, FontId::monospace(12.0), quiet);
    let place = rect.with_min_x(rect.left() + 104.0).with_max_x(key.left() - 8.0);
    put_line(ui, place, Align2::LEFT_CENTER, title, 13.5, ink);
    response
}

/// Every action, by group.
fn entries(app: &App) -> Vec<Entry> {
    let mode = app.view.mode;
    let mut all = Vec::new();
    let is_own = |act: &&'static Act| act.does.is_empty() || act.does.starts_with("command palette");
    let named = |acts: Vec<&'static Act>| acts.into_iter().filter(move |act| !is_own(act));
    let commands = [("Command", keys::COMMANDS.iter().collect())];
    for (group, acts) in keys::groups(mode).into_iter().chain(commands) {
        for act in named(acts) {
            let key = act.key_text(&app.ctx);
            let group = group.to_owned();
            all.push(Entry { group, title: capital(act.does), key, run: Box::new(|app| act.run(app)) });
        }
    }
    let mut add = |group: &'static str, title: String, run: Run| {
        all.push(Entry { group: group.to_owned(), title, key: String::new(), run });
    };
    for speed in SPEEDS {
        let run = move |app: &mut App| app.simulation.send(Command::SetSpeed(speed));
        add("Command", format!("Speed {speed}×"), Box::new(run));
    }
    for step in (SCALES.start() * 5.0).round() as u32..=(SCALES.end() * 5.0).round() as u32 {
        let run = move |app: &mut App| app.set_scale(step as f32 / 5.0);
        add("Command", format!("UI scale {} %", step * 20), Box::new(run));
    }
    for panel in &panels::ALL {
        add("Panel", panel.title.to_owned(), Box::new(|app| app.show_panel(panel.name)));
    }
    for study in all_studies() {
        let card = study.card();
        let run = move |app: &mut App| {
            app.set_mode(Mode::Study);
            app.studies.choose(card.key);
        };
        add("Study", card.title.to_owned(), Box::new(run));
    }
    let built_in = catalogue().iter().map(|built_in| (built_in.title.clone(), built_in.name.clone()));
    let empty = std::iter::once(("Empty hand".to_owned(), EMPTY.to_owned()));
    let recent = app.view.recent.iter().map(|path| (path.clone(), path.clone()));
    for (title, source) in built_in.chain(empty).chain(recent) {
        let run = move |app: &mut App| {
            app.view.source = ViewSource::Simulation;
            app.open(&source);
        };
        add("Grasp", title, Box::new(run));
    }
    // Keys of other modes may be about things not in sight: they open their mode.
    for kind in modes::ALL.iter().filter(|kind| kind.mode != mode) {
        for act in named(kind.keys.iter().collect()) {
            let key = format!("{} {}", kind.open.key_text(&app.ctx), act.key_text(&app.ctx));
            let (group, title) = (format!("opens {}", kind.title), capital(act.does));
            all.push(Entry { group, title, key, run: Box::new(|app| app.set_mode(kind.mode)) });
        }
    }
    all
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

/// How well a text fits a title; `None` where a letter is missing. After the first, each letter follows the one before or begins
/// a word. Beginnings of words and runs of letters count more.
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
            let before = match k {
                0 => Some(0),
                _ if starts(at) => best[..at].iter().copied().flatten().max(),
                _ => None,
            };
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
        assert_eq!(score("Discard what is not seen", "dscd"), None, "letters within words, apart");
        assert!(score("Tennis ball", "tb") > score("Tabletop cube", "tb"));
        assert!(score("Save the scene", "save") > score("Show a very early one", "save"));
        assert!(score("Lemon", "LEM") > score("Larger element", "lem"));
        assert_eq!(score("Lemon", ""), Some(0));
    }
}
