//! Keys: one list for behaviour and key sheet alike, that of the mode before that of all modes. Off while a text field
//! has focus.

pub(super) mod binding;
mod common;

use crate::app::actions::{Action, Actions};
use crate::app::context::PanelContext;
use crate::app::features::view::ViewAction;
use crate::app::modes;
use crate::app::modes::mode::Mode;
use crate::app::notices::UserMessage;
use binding::Binding;
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

/// Bindings of a mode in groups with titles: its own, those that open modes, and those of all modes.
pub(super) fn groups(mode: Mode) -> Vec<(&'static str, Vec<&'static Binding>)> {
    let own = modes::kind(mode);
    let open = modes::ALL.iter().map(|kind| &kind.open).collect();
    let common = GROUPS.iter().map(|(title, bindings)| (*title, bindings.iter().collect()));
    [(own.title, own.keys.iter().collect()), ("Modes", open)].into_iter().chain(common).collect()
}

/// Bindings of a mode, in the order in which they are looked through.
fn bindings(mode: Mode) -> impl Iterator<Item = &'static Binding> {
    groups(mode).into_iter().flat_map(|(_, bindings)| bindings)
}

/// Pushes the actions of the keys pressed in this frame.
pub(super) fn pressed(ctx: &egui::Context, context: &PanelContext<'_>, actions: &mut Actions) {
    let dialog = ctx.memory(|memory| memory.top_modal_layer().is_some());
    if ctx.text_edit_focused() || context.view.palette_shown || dialog {
        return stop(ctx, actions);
    }
    // Presenter mode demonstrates, whatever mode is behind it.
    let mode = if context.view.presents { Mode::Demo } else { context.view.mode };
    if let Some(action) = (modes::kind(mode).typed)(ctx, context) {
        actions.push(action);
        return stop(ctx, actions);
    }
    for pressed in bound(ctx, mode) {
        actions.push(match pressed {
            Pressed::Key(binding) => binding.action(context),
            Pressed::Elsewhere(binding, mode) => elsewhere(ctx, binding, mode).into(),
        });
    }
}

/// Key pressed in this frame.
enum Pressed {
    Key(&'static Binding),
    /// Key of another mode.
    Elsewhere(&'static Binding, Mode),
}

/// Message about a key that acts in another mode.
fn elsewhere(ctx: &egui::Context, binding: &Binding, mode: Mode) -> UserMessage {
    let kind = modes::kind(mode);
    let [key, open] = [&binding.shortcut, &kind.open.shortcut].map(|shortcut| ctx.format_shortcut(shortcut));
    UserMessage::Info(format!("{key} acts in {} mode ({open}): {}.", kind.title, binding.does))
}

/// Bindings of the keys pressed in this frame, in their order. The keys are consumed.
fn bound(ctx: &egui::Context, mode: Mode) -> Vec<Pressed> {
    let mut pressed = Vec::new();
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let egui::Event::Key { key, modifiers, pressed: true, repeat, .. } = event else { return true };
            let Some(binding) = bindings(mode).find(|binding| binding.is(*key, *modifiers)) else {
                let others = modes::ALL.iter().filter(|kind| kind.mode != mode && !repeat);
                pressed.extend(others.flat_map(|kind| kind.keys.iter().map(|binding| (binding, kind.mode))).find_map(
                    |(binding, mode)| {
                        let told = binding.is(*key, *modifiers) && !binding.does.is_empty();
                        told.then_some(Pressed::Elsewhere(binding, mode))
                    },
                ));
                return true;
            };
            if !repeat || binding.repeats() {
                pressed.push(Pressed::Key(binding));
            }
            false
        });
    });
    pressed
}

/// Escape stops the gripper wherever the cursor is.
fn stop(ctx: &egui::Context, actions: &mut Actions) {
    if ctx.input(|i| i.key_pressed(Key::Escape)) {
        actions.push(Action::Stop);
    }
}

/// Width of a column of the sheet (points).
const COLUMN: f32 = 380.0;

/// Sheet of keys and mouse actions.
pub(super) fn sheet(ctx: &egui::Context, shown: bool, mode: Mode, actions: &mut Actions) {
    let mut open = shown;
    let room = ctx.content_rect().size() - egui::vec2(60.0, 90.0);
    let columns = if room.x > 2.0 * COLUMN + 30.0 { 2 } else { 1 };
    let window = egui::Window::new("Keys").open(&mut open).collapsible(false).resizable(false);
    let window = window.default_width(COLUMN * columns as f32).max_width(room.x).default_height(room.y);
    window.pivot(egui::Align2::CENTER_CENTER).default_pos(ctx.content_rect().center()).show(ctx, |ui| {
        let lines = sheet_lines(ctx, mode);
        egui::ScrollArea::vertical().max_height(room.y).show(ui, |ui| {
            ui.columns(columns, |columns| {
                let many = columns.len();
                let all: usize = lines.iter().map(|(_, lines)| lines.len() + 2).sum();
                let mut above = 0;
                for (title, lines) in &lines {
                    // A group stands in the column of its middle.
                    let middle = above + lines.len() / 2;
                    above += lines.len() + 2;
                    group_ui(&mut columns[(middle * many / all).min(many - 1)], title, lines);
                }
            });
        });
    });
    if shown && !open {
        actions.push(ViewAction::ShowKeys(false));
    }
}

/// Lines of the sheet by group: how, and what it does.
fn sheet_lines(ctx: &egui::Context, mode: Mode) -> Vec<(&'static str, Vec<(String, &'static str)>)> {
    let keys = |bindings: Vec<&'static Binding>| -> Vec<(String, &'static str)> {
        let named = bindings.into_iter().filter(|binding| !binding.does.is_empty());
        named.map(|binding| (ctx.format_shortcut(&binding.shortcut), binding.does)).collect()
    };
    let mouse = MOUSE.iter().map(|(how, does)| ((*how).to_owned(), *does)).collect();
    groups(mode).into_iter().map(|(title, bindings)| (title, keys(bindings))).chain([("Mouse", mouse)]).collect()
}

fn group_ui(ui: &mut Ui, title: &str, lines: &[(String, &str)]) {
    ui.add_space(4.0);
    ui.label(RichText::new(title).strong());
    ui.spacing_mut().interact_size.y = 18.0;
    egui::Grid::new(("keys", title)).num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
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
    fn no_key_does_two_things() {
        for kind in &modes::ALL {
            let all: Vec<&Binding> = bindings(kind.mode).collect();
            for (k, a) in all.iter().enumerate() {
                assert!(all[k + 1..].iter().all(|b| a.shortcut != b.shortcut), "{}: {}", kind.title, a.does);
            }
        }
    }

    #[test]
    fn the_manual_lists_the_same_keys() {
        let row = |how: &str, does: &str| if does.is_empty() { String::new() } else { format!("| {how} | {does} |\n") };
        let name = |binding: &Binding| binding.shortcut.format(&egui::ModifierNames::NAMES, false);
        let table = |keys: &[&'static Binding]| -> String {
            let rows: String = keys.iter().map(|binding| row(&name(binding), binding.does)).collect();
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
                    Pressed::Key(binding) | Pressed::Elsewhere(binding, _) => binding.does,
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
