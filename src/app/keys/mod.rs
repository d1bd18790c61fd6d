//! Keys: one table for behaviour and key sheet alike, that of the mode before that of all modes. While a text field has focus,
//! only those that write nothing: function keys, and those that open a mode.

mod common;

use crate::app::actions::{Act, Actions};
use crate::app::features::App;
use crate::app::features::view::Mode;
use crate::app::modes;
pub(super) use common::COMMANDS;
use common::GROUPS;
use egui::{Key, RichText, Ui};

/// Mouse actions in the sheet.
const MOUSE: [(&str, &str); 6] = [
    ("drag", "turn the view"),
    ("right drag", "move the view"),
    ("wheel", "zoom; in a plot, zoom time"),
    ("drag in a plot or the time bar", "move the cursor; with Shift, move the time window"),
    ("double click", "show everything"),
    ("Ctrl+drag", "pull at the object"),
];

/// Actions of a mode with keys, in groups with titles: its own, those that open modes, and those of all modes.
pub(super) fn groups(mode: Mode) -> Vec<(&'static str, Vec<&'static Act>)> {
    let own = modes::kind(mode);
    let open = modes::ALL.iter().map(|kind| &kind.open).collect();
    let common = GROUPS.iter().map(|(title, acts)| (*title, acts.iter().collect()));
    [(own.title, own.keys.iter().collect()), ("Modes", open)].into_iter().chain(common).collect()
}

/// Actions of a mode, in the order in which they are looked through.
fn acts(mode: Mode) -> impl Iterator<Item = &'static Act> {
    groups(mode).into_iter().flat_map(|(_, acts)| acts)
}

/// Pushes the actions of the keys pressed in this frame.
pub(super) fn pressed(app: &App, actions: &mut Actions) {
    let ctx = &app.ctx;
    let dialog = ctx.memory(|memory| memory.top_modal_layer().is_some());
    if app.view.palette_shown || dialog {
        return stop(ctx, actions);
    }
    if ctx.text_edit_focused() {
        for act in acts(app.view.mode).filter(|act| writes_nothing(act)) {
            if act.shortcut.is_some_and(|own| ctx.input_mut(|input| input.consume_shortcut(&own))) {
                actions.push(|app| act.run(app));
            }
        }
        return stop(ctx, actions);
    }
    if egui::Popup::is_any_open(ctx) {
        // Escape closes it, and vents all the same.
        if ctx.input(|i| i.key_pressed(Key::Escape)) {
            actions.push(|app| app.gripper.stop());
        }
        return;
    }
    // Presenter mode demonstrates, whatever mode is behind it.
    let mode = if app.view.presents { Mode::Demo } else { app.view.mode };
    if let Some((waits, search)) = modes::kind(mode).search
        && let Some(typed) = typed_ahead(ctx, waits(app))
    {
        actions.push(move |app| search(app, typed));
        return stop(ctx, actions);
    }
    for pressed in bound(ctx, mode) {
        actions.push(move |app| match pressed {
            Pressed::Key(act) => act.run(app),
            Pressed::Elsewhere(act, mode) => {
                let kind = modes::kind(mode);
                let [key, open] = [act, &kind.open].map(|act| act.key_text(&app.ctx));
                app.notices.info(format!("{key} works in {} mode ({open}): {}", kind.title, act.does));
            }
        });
    }
}

/// A function key, or one that opens a mode.
fn writes_nothing(act: &Act) -> bool {
    let is_function_key = act.shortcut.is_some_and(|own| (Key::F1..=Key::F12).contains(&own.logical_key));
    is_function_key || modes::ALL.iter().any(|kind| kind.open.shortcut == act.shortcut)
}

/// Key pressed in this frame.
enum Pressed {
    Key(&'static Act),
    /// Key of another mode.
    Elsewhere(&'static Act, Mode),
}

/// Keys that belong to the widget with the keyboard, where one has it.
const OF_WIDGETS: [Key; 6] = [Key::Enter, Key::Space, Key::ArrowLeft, Key::ArrowRight, Key::ArrowUp, Key::ArrowDown];

/// Actions of the keys pressed in this frame, in their order. The keys are consumed.
fn bound(ctx: &egui::Context, mode: Mode) -> Vec<Pressed> {
    let mut pressed = Vec::new();
    let focused = ctx.memory(|memory| memory.focused().is_some());
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let egui::Event::Key { key, modifiers, pressed: true, repeat, .. } = event else { return true };
            if focused && modifiers.is_none() && OF_WIDGETS.contains(key) {
                return true;
            }
            let Some(act) = acts(mode).find(|act| act.is(*key, *modifiers)) else {
                let others = modes::ALL.iter().filter(|kind| kind.mode != mode && !repeat);
                let mut keys = others.flat_map(|kind| kind.keys.iter().map(|act| (act, kind.mode)));
                let told = keys.find(|(act, _)| act.is(*key, *modifiers) && !act.does.is_empty());
                pressed.extend(told.map(|(act, mode)| Pressed::Elsewhere(act, mode)));
                return true;
            };
            if !repeat || act.repeats() {
                pressed.push(Pressed::Key(act));
            }
            false
        });
    });
    pressed
}

/// Escape stops the gripper wherever the cursor is.
fn stop(ctx: &egui::Context, actions: &mut Actions) {
    if ctx.input(|i| i.key_pressed(Key::Escape)) {
        actions.push(App::stop);
    }
}

/// Text typed after the key of a search field, in the same frame or before the field has the keyboard (`waits`). It is for
/// the field and triggers no keys.
fn typed_ahead(ctx: &egui::Context, waits: bool) -> Option<String> {
    ctx.input_mut(|input| {
        let slash = |event: &egui::Event| matches!(event, egui::Event::Key { key: Key::Slash, pressed: true, .. });
        let text = |event: &egui::Event| match event {
            egui::Event::Text(text) if text != "/" => Some(text.clone()),
            _ => None,
        };
        let pressed = input.events.iter().position(slash);
        let from = pressed.or_else(|| waits.then_some(0))?;
        let typed: String = input.events[from..].iter().filter_map(text).collect();
        if pressed.is_none() && !input.events.iter().any(|event| matches!(event, egui::Event::Text(_))) {
            return None;
        }
        let is_stop = |event: &egui::Event| matches!(event, egui::Event::Key { key: Key::Escape, .. });
        let is_typed = |event: &egui::Event| matches!(event, egui::Event::Key { .. } | egui::Event::Text(_));
        let mut place = 0;
        input.events.retain(|event| {
            place += 1;
            place <= from || !is_typed(event) || is_stop(event)
        });
        Some(typed)
    })
}

/// Width of a column of the sheet (points).
const COLUMN: f32 = 380.0;

/// Sheet of keys and mouse actions.
pub(super) fn sheet(app: &App, mode: Mode, actions: &mut Actions) {
    let (ctx, shown) = (&app.ctx, app.view.keys_shown);
    let mut open = shown;
    let room = ctx.content_rect().size() - egui::vec2(60.0, 90.0);
    let columns = if room.x > 2.0 * COLUMN + 30.0 { 2 } else { 1 };
    let window = egui::Window::new("Keys").open(&mut open).collapsible(false).resizable(false);
    let window = window.default_width(COLUMN * columns as f32).max_width(room.x).default_height(room.y);
    window.pivot(egui::Align2::CENTER_CENTER).default_pos(ctx.content_rect().center()).show(ctx, |ui| {
        let lines = sheet_lines(ctx, mode);
        // Its bar shows that there is more.
        ui.spacing_mut().scroll = egui::style::ScrollStyle::solid();
        egui::ScrollArea::vertical().max_height(room.y).show(ui, |ui| {
            ui.columns(columns, |columns| {
                let left = if columns.len() > 1 { in_left(&lines) } else { lines.len() };
                for (k, (title, lines)) in lines.iter().enumerate() {
                    group_ui(&mut columns[usize::from(k >= left)], title, lines);
                }
            });
        });
    });
    if shown && !open {
        actions.push(|app| app.view.keys_shown = false);
    }
}

/// Letters of a line of the sheet, beside its key.
const LETTERS: usize = 38;

/// Groups that stand in the left of two columns, so that both are about as high.
fn in_left(groups: &[(&str, Vec<(String, &str)>)]) -> usize {
    let heights = groups.iter().map(|(_, lines)| {
        let lines = lines.iter().map(|(_, does)| does.chars().count().div_ceil(LETTERS).max(1));
        2 + lines.sum::<usize>()
    });
    let heights: Vec<usize> = heights.collect();
    let higher = |left: &usize| heights[..*left].iter().sum::<usize>().max(heights[*left..].iter().sum());
    (0..=groups.len()).min_by_key(higher).unwrap_or(0)
}

/// Lines of the sheet by group: how, and what it does.
fn sheet_lines(ctx: &egui::Context, mode: Mode) -> Vec<(&'static str, Vec<(String, &'static str)>)> {
    let keys = |acts: Vec<&'static Act>| -> Vec<(String, &'static str)> {
        acts.into_iter().filter(|act| !act.does.is_empty()).map(|act| (act.key_text(ctx), act.does)).collect()
    };
    let mouse = MOUSE.iter().map(|(how, does)| ((*how).to_owned(), *does)).collect();
    groups(mode).into_iter().map(|(title, acts)| (title, keys(acts))).chain([("Mouse", mouse)]).collect()
}

fn group_ui(ui: &mut Ui, title: &str, lines: &[(String, &str)]) {
    ui.add_space(4.0);
    ui.label(RichText::new(title).strong());
    ui.spacing_mut().interact_size.y = 18.0;
    // Long enough for most keys, so that what they do is one column in all groups.
    egui::Grid::new(("keys", title)).num_columns(2).min_col_width(96.0).spacing([14.0, 3.0]).show(ui, |ui| {
        for (how, does) in lines {
            ui.monospace(how);
            ui.add(egui::Label::new(*does).wrap());
            ui.end_row();
        }
    });
    ui.add_space(6.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manual::TOPICS;
    use egui::Modifiers;

    #[test]
    fn both_columns_of_the_sheet_are_about_as_high() {
        let ctx = egui::Context::default();
        for kind in &modes::ALL {
            let groups = sheet_lines(&ctx, kind.mode);
            let left = in_left(&groups);
            let lines = |groups: &[(&str, Vec<(String, &str)>)]| groups.iter().map(|(_, own)| own.len()).sum::<usize>();
            let [left, right] = [&groups[..left], &groups[left..]].map(lines);
            assert!(left.abs_diff(right) < 12, "{}: {left} and {right}", kind.title);
        }
        let long = "a".repeat(3 * LETTERS);
        let line = |does: &'static str| (String::new(), does);
        let groups = [("a", vec![(String::new(), long.as_str())]), ("b", vec![line("b"); 3])];
        assert_eq!(in_left(&groups), 1);
    }

    #[test]
    fn no_key_does_two_things() {
        for kind in &modes::ALL {
            let all: Vec<&Act> = acts(kind.mode).collect();
            for (k, a) in all.iter().enumerate() {
                assert!(all[k + 1..].iter().all(|b| a.shortcut != b.shortcut), "{}: {}", kind.title, a.does);
            }
        }
    }

    #[test]
    fn the_manual_lists_the_same_keys() {
        let row = |how: &str, does: &str| if does.is_empty() { String::new() } else { format!("| {how} | {does} |\n") };
        let name = |act: &Act| act.shortcut.expect("a key").format(&egui::ModifierNames::NAMES, false);
        let table = |keys: &[&'static Act]| -> String {
            let rows: String = keys.iter().map(|act| row(&name(act), act.does)).collect();
            format!("| key | action |\n|---|---|\n{rows}\n")
        };
        let holds = |topic: &str, expected: &str| {
            let text = TOPICS.iter().find(|own| own.name == topic).expect("a topic").text;
            assert!(text.contains(expected), "assets/help/{topic}.md should hold:\n{expected}");
        };
        for (title, keys) in groups(Mode::Demo) {
            holds("keys", &format!("## {title}\n\n{}", table(&keys)));
        }
        let mouse: String = MOUSE.iter().map(|(how, does)| row(how, does)).collect();
        holds("keys", &format!("| mouse | action |\n|---|---|\n{mouse}"));
        for (topic, mode) in [("labelling", Mode::Label), ("inspect", Mode::Inspect), ("paper", Mode::Study)] {
            holds(topic, &table(&modes::kind(mode).keys.iter().collect::<Vec<_>>()));
        }
    }

    fn key(key: Key, modifiers: Modifiers, repeat: bool) -> egui::Event {
        egui::Event::Key { key, physical_key: None, pressed: true, repeat, modifiers }
    }

    /// Lines of the sheet that act on these events in Label mode.
    fn does(events: Vec<egui::Event>) -> Vec<&'static str> {
        let ctx = egui::Context::default();
        let mut does = Vec::new();
        let mut drawn = ctx.run_ui(egui::RawInput { events, ..egui::RawInput::default() }, |ui| {
            does = bound(ui.ctx(), Mode::Label)
                .iter()
                .map(|pressed| match pressed {
                    Pressed::Key(act) | Pressed::Elsewhere(act, _) => act.does,
                })
                .collect();
        });
        drawn.textures_delta.clear();
        does
    }

    #[test]
    fn keys_of_a_frame_act_in_their_order_and_once() {
        let plain = |at: Key| key(at, Modifiers::NONE, false);
        let choose = "choose the first object; 2 to 9: the others";
        assert_eq!(does(vec![plain(Key::Num1), plain(Key::N)]), [choose, "give the label and continue"]);
        assert_eq!(does(vec![plain(Key::D), key(Key::D, Modifiers::NONE, true)]), ["discard the trial"]);
        assert_eq!(does(vec![plain(Key::ArrowUp), key(Key::ArrowUp, Modifiers::NONE, true)]).len(), 2);
        assert_eq!(does(vec![key(Key::Num1, Modifiers::ALT, false)]), ["front view"]);
        assert_eq!(does(vec![key(Key::Slash, Modifiers::SHIFT, false)]), ["find an object"]);
        assert_eq!(does(vec![key(Key::Z, Modifiers::COMMAND | Modifiers::SHIFT, false)]), ["redo"]);
        assert!(does(vec![key(Key::Z, Modifiers::COMMAND, false)])[0].starts_with("undo the last change"));
        // Larger and faster share a key.
        assert_eq!(does(vec![key(Key::Minus, Modifiers::COMMAND, false)]), ["smaller texts and buttons"]);
        assert_eq!(does(vec![key(Key::Minus, Modifiers::NONE, false)]), ["slower"]);
    }
}
