//! Keys: one list, from which both the behaviour and the sheet of keys are made. Off while a text field has focus.

use super::actions::{Action, DeskAction};
use super::bars::SPEEDS;
use super::modes::Mode;
use super::panels::PanelContext;
use egui::{Key, KeyboardShortcut, Modifiers};
use palpate_geometry::drawing::{Camera, StandardView};
use palpate_lab::workers::{Command, GripperWish, LabelWish};

/// A key, what it does, and how.
pub(super) struct Binding {
    pub(super) shortcut: KeyboardShortcut,
    pub(super) does: &'static str,
    /// The only mode in which it does so; in all of them where none is named.
    only: Option<Mode>,
    act: fn(&PanelContext<'_>) -> Option<Action>,
}

impl Binding {
    const fn only_in(self, mode: Mode) -> Self {
        Self { only: Some(mode), ..self }
    }

    fn counts_in(&self, mode: Mode) -> bool {
        self.only.is_none_or(|only| only == mode)
    }

    /// Shift more than is asked for is where the key is on this keyboard.
    fn is(&self, key: Key, modifiers: Modifiers) -> bool {
        let KeyboardShortcut { modifiers: wanted, logical_key } = self.shortcut;
        logical_key == key && modifiers.alt == wanted.alt && modifiers.matches_logically(wanted)
    }

    /// Held down it does so again and again; others do what they do once.
    fn repeats(&self) -> bool {
        matches!(self.shortcut.logical_key, Key::ArrowUp | Key::ArrowDown | Key::ArrowRight | Key::Minus | Key::Equals)
    }
}

const fn key(
    modifiers: Modifiers,
    key: Key,
    does: &'static str,
    act: fn(&PanelContext<'_>) -> Option<Action>,
) -> Binding {
    Binding { shortcut: KeyboardShortcut::new(modifiers, key), does, only: None, act }
}

/// Ctrl and Shift.
const UNDONE: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };

/// A key of the mode Label.
const fn label(
    modifiers: Modifiers,
    at: Key,
    does: &'static str,
    act: fn(&PanelContext<'_>) -> Option<Action>,
) -> Binding {
    key(modifiers, at, does, act).only_in(Mode::Label)
}

/// A key of the mode Label that another line of the sheet speaks of.
const fn hidden(at: Key, act: fn(&PanelContext<'_>) -> Option<Action>) -> Binding {
    label(Modifiers::NONE, at, "", act)
}

/// All keys. Those with more modifiers come first, so that they win.
pub(super) static ALL: [Binding; 50] = [
    key(Modifiers::COMMAND, Key::Num1, "mode Demo", |_| Some(Action::SetMode(Mode::Demo))),
    key(Modifiers::COMMAND, Key::Num3, "mode Label", |_| Some(Action::SetMode(Mode::Label))),
    key(Modifiers::NONE, Key::R, "record a grasp of the real gripper, or begin it anew", |_| {
        Some(Action::Desk(DeskAction::Record))
    }),
    key(Modifiers::NONE, Key::Q, "end the trial, and keep it", |c| {
        c.gripper?.trial.as_ref()?;
        Some(Action::Gripper(GripperWish::End))
    }),
    key(Modifiers::NONE, Key::D, "discard the trial", |_| Some(Action::Desk(DeskAction::Discard))),
    key(Modifiers::NONE, Key::T, "tare the real gripper's sensors", |_| Some(Action::Gripper(GripperWish::Tare))),
    key(Modifiers::COMMAND, Key::G, "connect the real gripper, or give its port back", |_| Some(Action::ToggleGripper)),
    label(Modifiers::NONE, Key::N, "give the label, go on with the next", |_| Some(Action::Desk(DeskAction::Give))),
    label(Modifiers::NONE, Key::Enter, "give the label", |_| Some(Action::Desk(DeskAction::Give))),
    label(Modifiers::NONE, Key::U, "the label is unsure", |_| Some(Action::Desk(DeskAction::ToggleUnsure))),
    label(Modifiers::NONE, Key::B, "blind: the model's guess stays hidden until the label is given", |_| {
        Some(Action::Desk(DeskAction::ToggleBlind))
    }),
    label(Modifiers::NONE, Key::M, "who moves the fingers: you, the board, or nobody says", |_| {
        Some(Action::Desk(DeskAction::NextControl))
    }),
    label(Modifiers::NONE, Key::W, "trials begin and end by themselves", |_| {
        Some(Action::Desk(DeskAction::ToggleWatch))
    }),
    label(Modifiers::COMMAND, Key::E, "export all labelled trials", |_| Some(Action::Desk(DeskAction::Export))),
    label(Modifiers::COMMAND, Key::T, "train on all labelled trials", |_| Some(Action::Desk(DeskAction::Train))),
    label(Modifiers::NONE, Key::Slash, "find an object", |_| {
        Some(Action::Desk(DeskAction::FocusSearch(String::new())))
    }),
    label(Modifiers::NONE, Key::Num1, "choose the first object; 2 to 9 the others", |_| {
        Some(Action::Desk(DeskAction::Choose(0)))
    }),
    hidden(Key::Num2, |_| Some(Action::Desk(DeskAction::Choose(1)))),
    hidden(Key::Num3, |_| Some(Action::Desk(DeskAction::Choose(2)))),
    hidden(Key::Num4, |_| Some(Action::Desk(DeskAction::Choose(3)))),
    hidden(Key::Num5, |_| Some(Action::Desk(DeskAction::Choose(4)))),
    hidden(Key::Num6, |_| Some(Action::Desk(DeskAction::Choose(5)))),
    hidden(Key::Num7, |_| Some(Action::Desk(DeskAction::Choose(6)))),
    hidden(Key::Num8, |_| Some(Action::Desk(DeskAction::Choose(7)))),
    hidden(Key::Num9, |_| Some(Action::Desk(DeskAction::Choose(8)))),
    label(Modifiers::NONE, Key::ArrowUp, "the trial above", |_| Some(Action::Desk(DeskAction::Step(-1)))),
    label(Modifiers::NONE, Key::ArrowDown, "the trial below", |_| Some(Action::Desk(DeskAction::Step(1)))),
    label(Modifiers::NONE, Key::Home, "the newest trial without a label", |_| {
        Some(Action::Desk(DeskAction::Select(None)))
    }),
    key(UNDONE, Key::Z, "make it again", |_| Some(Action::Label(LabelWish::Redo))),
    key(Modifiers::COMMAND, Key::Z, "take the last label or discard back", |_| Some(Action::Label(LabelWish::Undo))),
    key(Modifiers::NONE, Key::Space, "play or pause", |c| {
        let playing = c.snapshot?.status.playing;
        Some(Action::Simulation(if playing { Command::Pause } else { Command::Play }))
    }),
    key(Modifiers::COMMAND, Key::ArrowRight, "one sample further", |_| Some(Action::Simulation(Command::Step))),
    key(Modifiers::NONE, Key::Backspace, "back to the start", |_| Some(Action::Simulation(Command::Reset))),
    key(Modifiers::NONE, Key::Minus, "slower", |c| next_speed(c, -1)),
    key(Modifiers::NONE, Key::Equals, "faster", |c| next_speed(c, 1)),
    key(Modifiers::NONE, Key::N, "next object", |_| Some(Action::NextObject)).only_in(Mode::Demo),
    key(Modifiers::COMMAND, Key::O, "open a URDF, OBJ or STL file", |_| Some(Action::PickFile)),
    key(Modifiers::COMMAND, Key::S, "save the scene", |_| Some(Action::SaveScene)),
    key(Modifiers::COMMAND, Key::P, "save a picture of the 3-D view", |_| Some(Action::SavePicture)),
    key(Modifiers::SHIFT, Key::Z, "show everything", |_| Some(Action::FrameAll)),
    key(Modifiers::NONE, Key::Z, "show the object", |c| Some(Action::SetCamera(object_framed(c)?))),
    key(Modifiers::NONE, Key::F, "force arrows", |c| Some(Action::SetForces(!c.view.forces))),
    key(Modifiers::NONE, Key::G, "ghost: what the other engine computes", |c| Some(Action::SetGhost(!c.view.ghost))),
    key(Modifiers::ALT, Key::Num1, "front view", |c| turned(c, StandardView::Front)),
    key(Modifiers::ALT, Key::Num3, "right view", |c| turned(c, StandardView::Right)),
    key(Modifiers::ALT, Key::Num7, "top view", |c| turned(c, StandardView::Top)),
    key(Modifiers::ALT, Key::Num5, "parallel projection", |c| {
        Some(Action::SetCamera(Camera { parallel: !c.view.camera.parallel, ..c.view.camera }))
    }),
    key(Modifiers::NONE, Key::F1, "this sheet", |c| Some(Action::ShowKeys(!c.view.keys_shown))),
    key(Modifiers::NONE, Key::Escape, "STOP: vent the real gripper; close this sheet", |_| Some(Action::Stop)),
    key(Modifiers::NONE, Key::F11, "full screen", |_| None),
];

fn next_speed(context: &PanelContext<'_>, by: isize) -> Option<Action> {
    let now = context.snapshot?.status.target_speed;
    let nearest = (0..SPEEDS.len()).min_by(|a, b| (SPEEDS[*a] - now).abs().total_cmp(&(SPEEDS[*b] - now).abs()))?;
    let next = nearest.saturating_add_signed(by).min(SPEEDS.len() - 1);
    Some(Action::Simulation(Command::SetSpeed(SPEEDS[next])))
}

fn turned(context: &PanelContext<'_>, view: StandardView) -> Option<Action> {
    Some(Action::SetCamera(context.view.camera.turned_to(view)))
}

fn object_framed(context: &PanelContext<'_>) -> Option<Camera> {
    let snapshot = context.snapshot?;
    let place = snapshot.frame.world_from_object?.position.as_vec3();
    let radius = snapshot.object.as_ref()?.size.length() as f32;
    Some(context.view.camera.framing(place, 0.6 * radius.max(0.02)))
}

/// Actions for the keys pressed in this frame.
pub(super) fn pressed(ctx: &egui::Context, context: &PanelContext<'_>) -> Vec<Action> {
    if ctx.text_edit_focused() {
        return stop(ctx).into_iter().collect();
    }
    let mode = context.view.mode;
    if ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::F11)) {
        let full = ctx.input(|i| i.viewport().fullscreen.unwrap_or(false));
        ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(!full));
    }
    if mode == Mode::Label
        && let Some(typed) = typed_for_search(ctx, context.view.draft.focus_search)
    {
        return std::iter::once(Action::Desk(DeskAction::FocusSearch(typed))).chain(stop(ctx)).collect();
    }
    bound(ctx, mode).into_iter().filter_map(|binding| (binding.act)(context)).collect()
}

/// What the keys of this frame are bound to, in the order in which they were pressed. Nothing else hears of them.
fn bound(ctx: &egui::Context, mode: Mode) -> Vec<&'static Binding> {
    let mut pressed = Vec::new();
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let egui::Event::Key { key, modifiers, pressed: true, repeat, .. } = event else { return true };
            let fits = |binding: &&Binding| binding.counts_in(mode) && binding.is(*key, *modifiers);
            let Some(binding) = ALL.iter().find(fits) else { return true };
            if !repeat || binding.repeats() {
                pressed.push(binding);
            }
            false
        });
    });
    pressed
}

/// Whoever has to stop the gripper does not look where the cursor is.
fn stop(ctx: &egui::Context) -> Option<Action> {
    ctx.input(|i| i.key_pressed(Key::Escape)).then_some(Action::Stop)
}

/// What was typed in this frame after the key that goes to the search field, or while the cursor is on its way there: it
/// belongs there, and is no keys. None where nothing is for the field.
fn typed_for_search(ctx: &egui::Context, on_its_way: bool) -> Option<String> {
    ctx.input_mut(|input| {
        let slash = |event: &egui::Event| matches!(event, egui::Event::Key { key: Key::Slash, pressed: true, .. });
        let text = |event: &egui::Event| match event {
            egui::Event::Text(text) if text != "/" => Some(text.clone()),
            _ => None,
        };
        let pressed = input.events.iter().position(slash);
        let from = pressed.or_else(|| on_its_way.then_some(0))?;
        let typed: String = input.events[from..].iter().filter_map(text).collect();
        if pressed.is_none() && typed.is_empty() {
            return None;
        }
        let is_stop = |event: &egui::Event| matches!(event, egui::Event::Key { key: Key::Escape, .. });
        let mut place = 0;
        input.events.retain(|event| {
            place += 1;
            place <= from || is_stop(event)
        });
        Some(typed)
    })
}

/// The sheet of keys and of what the mouse does.
pub(super) fn sheet(ctx: &egui::Context, shown: bool, mode: Mode, actions: &mut Vec<Action>) {
    let mut open = shown;
    let room = ctx.content_rect().height() - 90.0;
    egui::Window::new("Keys").open(&mut open).collapsible(false).resizable(false).default_width(330.0).show(
        ctx,
        |ui| {
            egui::ScrollArea::vertical().max_height(room).show(ui, |ui| {
                egui::Grid::new("keys").num_columns(2).spacing([22.0, 4.0]).show(ui, |ui| {
                    for binding in ALL.iter().filter(|binding| binding.counts_in(mode) && !binding.does.is_empty()) {
                        ui.monospace(ctx.format_shortcut(&binding.shortcut));
                        ui.label(binding.does);
                        ui.end_row();
                    }
                    for (how, does) in [
                        ("drag", "turn the view"),
                        ("right drag", "shift the view"),
                        ("wheel", "zoom the view; in a plot, time"),
                        ("double click", "show everything"),
                        ("Ctrl+drag", "pull at the object"),
                    ] {
                        ui.monospace(how);
                        ui.label(does);
                        ui.end_row();
                    }
                });
            });
        },
    );
    if shown && !open {
        actions.push(Action::ShowKeys(false));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things() {
        for (k, a) in ALL.iter().enumerate() {
            let together = |b: &&Binding| a.only.is_none() || b.only.is_none() || a.only == b.only;
            assert!(ALL[k + 1..].iter().filter(together).all(|b| a.shortcut != b.shortcut), "{}", a.does);
        }
    }

    fn key(key: Key, modifiers: Modifiers, repeat: bool) -> egui::Event {
        egui::Event::Key { key, physical_key: None, pressed: true, repeat, modifiers }
    }

    /// What a frame with these events does in the mode Label.
    fn does(events: Vec<egui::Event>) -> Vec<&'static str> {
        let ctx = egui::Context::default();
        let mut does = Vec::new();
        let mut drawn = ctx.run_ui(egui::RawInput { events, ..egui::RawInput::default() }, |ui| {
            does = bound(ui.ctx(), Mode::Label).iter().map(|binding| binding.does).collect();
        });
        drawn.textures_delta.clear();
        does
    }

    #[test]
    fn keys_of_a_frame_act_in_their_order_and_once() {
        let plain = |at: Key| key(at, Modifiers::NONE, false);
        let choose = "choose the first object; 2 to 9 the others";
        assert_eq!(does(vec![plain(Key::Num1), plain(Key::N)]), [choose, "give the label, go on with the next"]);
        assert_eq!(does(vec![plain(Key::D), key(Key::D, Modifiers::NONE, true)]), ["discard the trial"]);
        assert_eq!(does(vec![plain(Key::ArrowUp), key(Key::ArrowUp, Modifiers::NONE, true)]).len(), 2);
        assert_eq!(does(vec![key(Key::Num1, Modifiers::ALT, false)]), ["front view"]);
        assert_eq!(does(vec![key(Key::Slash, Modifiers::SHIFT, false)]), ["find an object"]);
        assert_eq!(does(vec![key(Key::Z, UNDONE, false)]), ["make it again"]);
        assert_eq!(does(vec![key(Key::Z, Modifiers::COMMAND, false)]), ["take the last label or discard back"]);
    }
}
