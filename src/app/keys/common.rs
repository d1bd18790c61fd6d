//! Keys of all modes, by group. Within a group those with more modifiers come first, so that they win.

use super::binding::{Binding, key};
use crate::app::actions::Action;
use crate::app::context::PanelContext;
use crate::app::features::files::FileAction;
use crate::app::features::gripper::GripperAction;
use crate::app::features::inspect::InspectAction;
use crate::app::features::simulation::SimulationAction;
use crate::app::features::view::ViewAction;
use crate::app::modes::mode::Mode;
use crate::app::playback::{Seek, next_speed};
use crate::app::view_source::ViewSource;
use egui::{Key, Modifiers};
use palpate_geometry::drawing::{Camera, StandardView};
use palpate_lab::workers::{Command, GripperCommand, LabelCommand, LabellingAction};

const NONE: Modifiers = Modifiers::NONE;
const COMMAND: Modifiers = Modifiers::COMMAND;
const COMMAND_SHIFT: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };

/// Change of the scale by one step.
const SCALE_STEP: f32 = 0.1;

const NOT_LOADED: &str = "The simulation has not loaded an object yet.";

/// Groups of keys, by title.
pub(super) static GROUPS: [(&str, &[Binding]); 4] =
    [("General", GENERAL), ("View", VIEW), ("Time", TIME), ("Real gripper", GRIPPER)];

const GENERAL: &[Binding] = &[
    key(COMMAND, Key::K, "command palette: find and run any action", |c| {
        Some(ViewAction::ShowPalette(!c.view.palette_shown).into())
    }),
    key(COMMAND_SHIFT, Key::Z, "redo", |c| {
        Some(if edits_scene(c) { SimulationAction::Redo.into() } else { LabelCommand::Redo.into() })
    }),
    key(COMMAND, Key::Z, "undo the last change of the scene (Demo mode), or the last label or discard", |c| {
        Some(if edits_scene(c) { SimulationAction::Undo.into() } else { LabelCommand::Undo.into() })
    }),
    key(COMMAND, Key::O, "open a URDF, OBJ or STL file", |_| Some(FileAction::Open.into())),
    key(COMMAND, Key::S, "save the scene", |_| Some(FileAction::SaveScene.into())),
    key(COMMAND, Key::P, "save a picture of the 3-D view", |c| {
        c.snapshot?;
        Some(FileAction::SavePicture.into())
    })
    .otherwise(NOT_LOADED),
    key(COMMAND, Key::Plus, "larger texts and buttons", |c| scaled(c, SCALE_STEP)),
    key(COMMAND, Key::Equals, "", |c| scaled(c, SCALE_STEP)),
    key(COMMAND, Key::Minus, "smaller texts and buttons", |c| scaled(c, -SCALE_STEP)),
    key(COMMAND, Key::Num0, "texts and buttons at 100 %", |_| Some(ViewAction::SetScale(1.0).into())),
    key(NONE, Key::F1, "show or hide the keys", |c| Some(ViewAction::ShowKeys(!c.view.keys_shown).into())),
    key(NONE, Key::F11, "presenter mode", |c| Some(ViewAction::Present(!c.view.presents).into())),
];

const VIEW: &[Binding] = &[
    key(Modifiers::SHIFT, Key::Z, "show everything", |_| Some(ViewAction::FrameAll.into())),
    key(NONE, Key::Z, "show the object", |c| Some(ViewAction::SetCamera(object_framed(c)?).into()))
        .otherwise("There is no object in the hand."),
    key(NONE, Key::F, "force arrows", |c| Some(ViewAction::SetForces(!c.view.forces).into())),
    key(NONE, Key::O, "circles that the flex strips read", |c| Some(ViewAction::SetCircles(!c.view.circles).into())),
    key(NONE, Key::C, "contact path on the object: by time, by pressure, off", |c| {
        Some(ViewAction::SetPath(c.view.path.next()).into())
    }),
    key(NONE, Key::G, "ghost: result of the other engine", |c| Some(SimulationAction::SetGhost(!c.view.ghost).into())),
    key(Modifiers::ALT, Key::Num1, "front view", |c| turned(c, StandardView::Front)),
    key(Modifiers::ALT, Key::Num3, "right view", |c| turned(c, StandardView::Right)),
    key(Modifiers::ALT, Key::Num7, "top view", |c| turned(c, StandardView::Top)),
    key(Modifiers::ALT, Key::Num5, "parallel projection", |c| {
        let camera = Camera { parallel: !c.view.camera.parallel, ..c.view.camera };
        Some(ViewAction::SetCamera(camera).into())
    }),
];

const TIME: &[Binding] = &[
    key(NONE, Key::Space, "play or pause", |c| {
        if replays(c) {
            return Some(InspectAction::TogglePlaying.into());
        }
        let playing = c.snapshot?.status.playing;
        Some(if playing { Command::Pause } else { Command::Play }.into())
    })
    .otherwise(NOT_LOADED),
    key(COMMAND, Key::ArrowRight, "one sample forward", |c| {
        Some(if replays(c) { InspectAction::Seek(Seek::Samples(1)).into() } else { Command::Step.into() })
    }),
    key(COMMAND, Key::ArrowLeft, "one sample back", |_| Some(InspectAction::Seek(Seek::Samples(-1)).into())),
    key(NONE, Key::ArrowRight, "0.1 s forward", |_| Some(InspectAction::Seek(Seek::By(0.1)).into())),
    key(NONE, Key::ArrowLeft, "0.1 s back", |_| Some(InspectAction::Seek(Seek::By(-0.1)).into())),
    key(NONE, Key::End, "last sample; of a live gripper, back to live", |_| {
        Some(InspectAction::Seek(Seek::End).into())
    }),
    key(NONE, Key::Backspace, "back to the start", |c| {
        Some(if replays(c) { InspectAction::Seek(Seek::Start).into() } else { Command::Reset.into() })
    }),
    key(NONE, Key::Minus, "slower", |c| faster(c, -1)).otherwise(NOT_LOADED),
    key(NONE, Key::Equals, "faster", |c| faster(c, 1)).otherwise(NOT_LOADED),
];

const GRIPPER: &[Binding] = &[
    key(NONE, Key::R, "record a grasp of the real gripper, or restart it", |_| Some(LabellingAction::Record.into())),
    key(NONE, Key::Q, "end the trial and keep it", |c| {
        c.gripper?.trial.as_ref()?;
        Some(GripperCommand::End.into())
    })
    .otherwise("No trial of the real gripper is running."),
    key(NONE, Key::D, "discard the trial", |_| Some(LabellingAction::Discard.into())),
    key(NONE, Key::T, "tare the sensors of the real gripper", |_| Some(GripperCommand::Tare.into())),
    key(COMMAND, Key::G, "connect or disconnect the real gripper", |_| Some(GripperAction::ToggleConnection.into())),
    key(NONE, Key::Escape, "STOP: vent the real gripper and end the trial; close the keys, end presenter mode", |_| {
        Some(Action::Stop)
    }),
];

/// True in the mode whose changes are those of the scene.
fn edits_scene(context: &PanelContext<'_>) -> bool {
    context.view.mode == Mode::Demo
}

fn scaled(context: &PanelContext<'_>, by: f32) -> Option<Action> {
    // Whole steps, also after many.
    let steps = (context.view.scale / SCALE_STEP).round() + (by / SCALE_STEP).round();
    Some(ViewAction::SetScale(steps * SCALE_STEP).into())
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
