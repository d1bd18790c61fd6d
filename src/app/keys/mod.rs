//! Keys: one list for behaviour and key sheet alike, that of the mode before that of all modes. Off while a text field
//! has focus.

pub(super) mod binding;

use crate::app::actions::{Action, Actions};
use crate::app::context::PanelContext;
use crate::app::features::files::FileAction;
use crate::app::features::gripper::GripperAction;
use crate::app::features::inspect::InspectAction;
use crate::app::features::simulation::SimulationAction;
use crate::app::features::view::ViewAction;
use crate::app::modes;
use crate::app::modes::mode::Mode;
use crate::app::playback::{Seek, next_speed};
use crate::app::view_source::ViewSource;
use binding::{Binding, key};
use egui::{Key, Modifiers};
use palpate_geometry::drawing::{Camera, StandardView};
use palpate_lab::workers::{Command, GripperCommand, LabelCommand, LabellingAction};

/// Ctrl and Shift.
const COMMAND_SHIFT: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };

/// Keys of all modes. Those with more modifiers come first, so that they win.
static COMMON: [Binding; 31] = [
    key(Modifiers::NONE, Key::R, "record a grasp of the real gripper, or restart it", |_| {
        Some(LabellingAction::Record.into())
    }),
    key(Modifiers::NONE, Key::Q, "end the trial and keep it", |c| {
        c.gripper?.trial.as_ref()?;
        Some(GripperCommand::End.into())
    }),
    key(Modifiers::NONE, Key::D, "discard the trial", |_| Some(LabellingAction::Discard.into())),
    key(Modifiers::NONE, Key::T, "tare the sensors of the real gripper", |_| Some(GripperCommand::Tare.into())),
    key(Modifiers::COMMAND, Key::G, "connect or disconnect the real gripper", |_| {
        Some(GripperAction::ToggleConnection.into())
    }),
    key(COMMAND_SHIFT, Key::Z, "redo", |_| Some(LabelCommand::Redo.into())),
    key(Modifiers::COMMAND, Key::Z, "undo the last label or discard", |_| Some(LabelCommand::Undo.into())),
    key(Modifiers::NONE, Key::Space, "play or pause", |c| {
        if replays(c) {
            return Some(InspectAction::TogglePlaying.into());
        }
        let playing = c.snapshot?.status.playing;
        Some(if playing { Command::Pause } else { Command::Play }.into())
    }),
    key(Modifiers::COMMAND, Key::ArrowRight, "one sample forward", |c| {
        Some(if replays(c) { InspectAction::Seek(Seek::Samples(1)).into() } else { Command::Step.into() })
    }),
    key(Modifiers::COMMAND, Key::ArrowLeft, "one sample back", |_| Some(InspectAction::Seek(Seek::Samples(-1)).into())),
    key(Modifiers::NONE, Key::ArrowRight, "0.1 s forward", |_| Some(InspectAction::Seek(Seek::By(0.1)).into())),
    key(Modifiers::NONE, Key::ArrowLeft, "0.1 s back", |_| Some(InspectAction::Seek(Seek::By(-0.1)).into())),
    key(Modifiers::NONE, Key::End, "last sample; of a live gripper, back to live", |_| {
        Some(InspectAction::Seek(Seek::End).into())
    }),
    key(Modifiers::NONE, Key::Backspace, "back to the start", |c| {
        Some(if replays(c) { InspectAction::Seek(Seek::Start).into() } else { Command::Reset.into() })
    }),
    key(Modifiers::NONE, Key::Minus, "slower", |c| faster(c, -1)),
    key(Modifiers::NONE, Key::Equals, "faster", |c| faster(c, 1)),
    key(Modifiers::COMMAND, Key::O, "open a URDF, OBJ or STL file", |_| Some(FileAction::Open.into())),
    key(Modifiers::COMMAND, Key::S, "save the scene", |_| Some(FileAction::SaveScene.into())),
    key(Modifiers::COMMAND, Key::P, "save a picture of the 3-D view", |_| Some(FileAction::SavePicture.into())),
    key(Modifiers::SHIFT, Key::Z, "show everything", |_| Some(ViewAction::FrameAll.into())),
    key(Modifiers::NONE, Key::Z, "show the object", |c| Some(ViewAction::SetCamera(object_framed(c)?).into())),
    key(Modifiers::NONE, Key::F, "force arrows", |c| Some(ViewAction::SetForces(!c.view.forces).into())),
    key(Modifiers::NONE, Key::C, "contact path on the object: by time, by pressure, off", |c| {
        Some(ViewAction::SetPath(c.view.path.next()).into())
    }),
    key(Modifiers::NONE, Key::G, "ghost: result of the other engine", |c| {
        Some(SimulationAction::SetGhost(!c.view.ghost).into())
    }),
    key(Modifiers::ALT, Key::Num1, "front view", |c| turned(c, StandardView::Front)),
    key(Modifiers::ALT, Key::Num3, "right view", |c| turned(c, StandardView::Right)),
    key(Modifiers::ALT, Key::Num7, "top view", |c| turned(c, StandardView::Top)),
    key(Modifiers::ALT, Key::Num5, "parallel projection", |c| {
        let camera = Camera { parallel: !c.view.camera.parallel, ..c.view.camera };
        Some(ViewAction::SetCamera(camera).into())
    }),
    key(Modifiers::NONE, Key::F1, "show or hide the keys", |c| Some(ViewAction::ShowKeys(!c.view.keys_shown).into())),
    key(Modifiers::NONE, Key::Escape, "STOP: vent the real gripper and end the trial; close the keys", |_| {
        Some(Action::Stop)
    }),
    key(Modifiers::NONE, Key::F11, "full screen", |_| None),
];

/// Mouse actions in the sheet.
const MOUSE: [(&str, &str); 6] = [
    ("drag", "turn the view"),
    ("right drag", "move the view"),
    ("wheel", "zoom; in a plot, zoom time"),
    ("drag in a plot or the time bar", "move the cursor; with Shift, move the time window"),
    ("double click", "show everything"),
    ("Ctrl+drag", "pull at the object"),
];

/// Bindings of a mode: its own, those that open modes, and those of all modes.
fn bindings(mode: Mode) -> impl Iterator<Item = &'static Binding> {
    let open = modes::ALL.iter().map(|kind| &kind.open);
    modes::kind(mode).keys.iter().chain(open).chain(&COMMON)
}

/// True where a stored trial or the past of a live gripper is shown.
fn replays(context: &PanelContext<'_>) -> bool {
    context.source == ViewSource::Trial || context.shown().looks_back()
}

fn faster(context: &PanelContext<'_>, by: isize) -> Option<Action> {
    if replays(context) {
        return Some(InspectAction::ChangeSpeed(by).into());
    }
    let now = context.snapshot?.status.target_speed;
    Some(Command::SetSpeed(next_speed(now, by)).into())
}

fn turned(context: &PanelContext<'_>, view: StandardView) -> Option<Action> {
    Some(ViewAction::SetCamera(context.view.camera.turned_to(view)).into())
}

fn object_framed(context: &PanelContext<'_>) -> Option<Camera> {
    let snapshot = context.snapshot?;
    let place = snapshot.frame.world_from_object?.position.as_vec3();
    let radius = snapshot.object.as_ref()?.size.length() as f32;
    Some(context.view.camera.framing(place, 0.6 * radius.max(0.02)))
}

/// Pushes the actions of the keys pressed in this frame.
pub(super) fn pressed(ctx: &egui::Context, context: &PanelContext<'_>, actions: &mut Actions) {
    if ctx.text_edit_focused() {
        return stop(ctx, actions);
    }
    if ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::F11)) {
        let full = ctx.input(|i| i.viewport().fullscreen.unwrap_or(false));
        ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(!full));
    }
    let mode = context.view.mode;
    if let Some(action) = (modes::kind(mode).typed)(ctx, context) {
        actions.push(action);
        return stop(ctx, actions);
    }
    for action in bound(ctx, mode).into_iter().filter_map(|binding| (binding.act)(context)) {
        actions.push(action);
    }
}

/// Bindings of the keys pressed in this frame, in their order. The keys are consumed.
fn bound(ctx: &egui::Context, mode: Mode) -> Vec<&'static Binding> {
    let mut pressed = Vec::new();
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let egui::Event::Key { key, modifiers, pressed: true, repeat, .. } = event else { return true };
            let Some(binding) = bindings(mode).find(|binding| binding.is(*key, *modifiers)) else { return true };
            if !repeat || binding.repeats() {
                pressed.push(binding);
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

/// Sheet of keys and mouse actions.
pub(super) fn sheet(ctx: &egui::Context, shown: bool, mode: Mode, actions: &mut Actions) {
    let mut open = shown;
    let room = ctx.content_rect().height() - 90.0;
    let window = egui::Window::new("Keys").open(&mut open).collapsible(false).resizable(false).default_width(330.0);
    window.show(ctx, |ui| {
        egui::ScrollArea::vertical().max_height(room).show(ui, |ui| {
            egui::Grid::new("keys").num_columns(2).spacing([22.0, 4.0]).show(ui, |ui| {
                let keys = bindings(mode).filter(|binding| !binding.does.is_empty());
                let keys = keys.map(|binding| (ctx.format_shortcut(&binding.shortcut), binding.does));
                let mouse = MOUSE.iter().map(|(how, does)| ((*how).to_owned(), *does));
                for (how, does) in keys.chain(mouse) {
                    ui.monospace(how);
                    ui.label(does);
                    ui.end_row();
                }
            });
        });
    });
    if shown && !open {
        actions.push(ViewAction::ShowKeys(false));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manual::TOPICS;

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
        let table = |keys: &mut dyn Iterator<Item = &'static Binding>| -> String {
            let rows: String = keys.map(|binding| row(&name(binding), binding.does)).collect();
            format!("| key | action |\n|---|---|\n{rows}\n")
        };
        let mouse: String = MOUSE.iter().map(|(how, does)| row(how, does)).collect();
        for (topic, expected) in [
            ("keys", table(&mut bindings(Mode::Demo)) + "| mouse | action |\n|---|---|\n" + &mouse),
            ("labelling", table(&mut modes::kind(Mode::Label).keys.iter())),
        ] {
            let text = TOPICS.iter().find(|own| own.name == topic).expect("a topic").text;
            assert!(text.contains(&expected), "assets/help/{topic}.md should hold:\n{expected}");
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
            does = bound(ui.ctx(), Mode::Label).iter().map(|binding| binding.does).collect();
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
        assert_eq!(does(vec![key(Key::Z, COMMAND_SHIFT, false)]), ["redo"]);
        assert_eq!(does(vec![key(Key::Z, Modifiers::COMMAND, false)]), ["undo the last label or discard"]);
    }
}
