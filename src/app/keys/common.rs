//! Actions of all modes, by group. Within a group those with more modifiers come first, so that they win.

use crate::app::actions::{Act, command, key, key_where};
use crate::app::features::App;
use crate::app::features::view::ViewSource;
use crate::app::panels::view3d;
use crate::app::playback::{Seek, next_speed};
use egui::{Key, Modifiers};
use palpate_geometry::drawing::{Camera, StandardView};
use palpate_geometry::palette::Theme;
use palpate_lab::workers::{Command, GripperCommand, LabellingAction};
use palpate_store::TrialPlace;

const NONE: Modifiers = Modifiers::NONE;
const COMMAND: Modifiers = Modifiers::COMMAND;
const COMMAND_SHIFT: Modifiers = Modifiers { shift: true, ..Modifiers::COMMAND };

/// Change of the scale by one step.
const SCALE_STEP: f32 = 0.1;

const NOT_LOADED: &str = "The simulation has not loaded an object yet.";

/// Groups of actions with keys, by title.
pub(super) static GROUPS: [(&str, &[Act]); 4] =
    [("General", GENERAL), ("View", VIEW), ("Time", TIME), ("Real gripper", GRIPPER)];

const GENERAL: &[Act] = &[
    key(COMMAND, Key::K, "command palette: find and run any action", |app| {
        app.view.palette_shown = !app.view.palette_shown;
    }),
    key(COMMAND_SHIFT, Key::Z, "redo", |app| app.undo(true)),
    key(COMMAND, Key::Z, "undo the last change of the scene (Demo mode), or the last label or discard", |app| {
        app.undo(false);
    }),
    key(COMMAND, Key::O, "open a URDF, OBJ or STL file", App::ask_for_object),
    key(COMMAND, Key::S, "save the scene", App::save_scene),
    key_where(COMMAND, Key::P, "save a picture of the 3-D view", |app| {
        app.snapshot().ok_or(NOT_LOADED)?;
        view3d::save_picture(app)
    }),
    key(COMMAND, Key::Plus, "larger texts and buttons", |app| scale(app, SCALE_STEP)),
    key(COMMAND, Key::Equals, "", |app| scale(app, SCALE_STEP)),
    key(COMMAND, Key::Minus, "smaller texts and buttons", |app| scale(app, -SCALE_STEP)),
    key(COMMAND, Key::Num0, "texts and buttons at 100 %", |app| app.set_scale(1.0)),
    key(NONE, Key::F1, "show or hide the keys", |app| app.view.keys_shown = !app.view.keys_shown),
    key(NONE, Key::F11, "presenter mode", |app| app.present(!app.view.presents)),
];

const VIEW: &[Act] = &[
    key(Modifiers::SHIFT, Key::Z, "show everything", App::frame_all),
    key_where(NONE, Key::Z, "show the object", |app| {
        app.view.camera = object_framed(app).ok_or("There is no object in the hand.")?;
        Ok(())
    }),
    key(NONE, Key::F, "force arrows", |app| app.view.forces = !app.view.forces),
    key(NONE, Key::O, "circles that the flex strips read", |app| app.view.circles = !app.view.circles),
    key(NONE, Key::C, "contact path on the object: by time, by pressure, off", |app| {
        app.view.path = app.view.path.next();
    }),
    key(NONE, Key::I, "enlarge the picture of the touch", App::enlarge_touch),
    key(NONE, Key::G, "ghost: result of the other engine", |app| app.set_ghost(!app.view.ghost)),
    key(Modifiers::ALT, Key::Num1, "front view", |app| turn(app, StandardView::Front)),
    key(Modifiers::ALT, Key::Num3, "right view", |app| turn(app, StandardView::Right)),
    key(Modifiers::ALT, Key::Num7, "top view", |app| turn(app, StandardView::Top)),
    key(Modifiers::ALT, Key::Num5, "parallel projection", |app| app.view.camera.parallel = !app.view.camera.parallel),
];

const TIME: &[Act] = &[
    key_where(NONE, Key::Space, "play or pause", |app| {
        if app.shown().replays() {
            app.toggle_playing();
            return Ok(());
        }
        let playing = app.snapshot().ok_or(NOT_LOADED)?.status.playing;
        app.simulation.send(if playing { Command::Pause } else { Command::Play });
        Ok(())
    }),
    key(COMMAND, Key::ArrowRight, "one sample forward", |app| match app.shown().replays() {
        true => app.seek(Seek::Samples(1)),
        false => app.simulation.send(Command::Step),
    }),
    key(COMMAND, Key::ArrowLeft, "one sample back", |app| app.seek(Seek::Samples(-1))),
    key(NONE, Key::ArrowRight, "0.1 s forward", |app| app.seek(Seek::By(0.1))),
    key(NONE, Key::ArrowLeft, "0.1 s back", |app| app.seek(Seek::By(-0.1))),
    key(NONE, Key::End, "last sample; of a live gripper, back to live", |app| app.seek(Seek::End)),
    key(NONE, Key::Backspace, "back to the start", |app| match app.shown().replays() {
        true => app.seek(Seek::Start),
        false => app.simulation.send(Command::Reset),
    }),
    key_where(NONE, Key::Minus, "slower", |app| change_speed(app, -1)),
    key_where(NONE, Key::Equals, "faster", |app| change_speed(app, 1)),
];

const GRIPPER: &[Act] = &[
    key(NONE, Key::R, "record a grasp of the real gripper, or restart it", |app| app.label(LabellingAction::Record)),
    key_where(NONE, Key::Q, "end the trial and keep it", |app| {
        let running = app.gripper_view().and_then(|gripper| gripper.trial.as_ref());
        running.ok_or("No trial of the real gripper is running.")?;
        app.gripper.send(GripperCommand::End);
        Ok(())
    }),
    key(NONE, Key::D, "discard the trial", |app| app.label(LabellingAction::Discard)),
    key(NONE, Key::T, "tare the sensors of the real gripper", |app| _ = app.gripper.send(GripperCommand::Tare)),
    key(COMMAND, Key::G, "connect or disconnect the real gripper", App::toggle_connection),
    key(
        NONE,
        Key::Escape,
        "STOP: vent the real gripper and end the trial; close what is topmost, or end presenter mode",
        App::stop,
    ),
];

/// Actions without a key.
pub(in crate::app) static COMMANDS: &[Act] = &[
    command("Import trials of other programs (CSV, MCAP, NPZ, Parquet)", App::ask_for_trials),
    command("Dark theme", |app| app.set_theme(Theme::Dark)),
    command("Light theme", |app| app.set_theme(Theme::Light)),
    command("Reset layout of all modes", |app| app.view.layouts.clear()),
    command("Show or hide the true object", |app| app.view.truth_shown = !app.view.truth_shown),
    command("Show the simulation", |app| app.view.source = ViewSource::Simulation),
    command("Show the real gripper", |app| app.view.source = ViewSource::Gripper),
    command("Close the stored trial that is open", App::close_trial),
    command("Remove all trials from the comparison", |app| app.inspect.unpin_all()),
    command("Show mean and spread of each class", |app| app.inspect.spread = true),
    command("Show each compared trial", |app| app.inspect.spread = false),
    command("Show the whole grasp in all plots", |app| app.view.time_window = None),
    command("Measure effects of the scene", |app| app.simulation.measure_effects()),
    command("Verify the last grasp at finer accuracy", |app| app.simulation.send(Command::ComputeAgain)),
    command("Use the shipped model for the real gripper", |app| app.use_model(None)),
    command("Use the shipped model in the simulation: forget all learned objects", |app| {
        app.use_simulation_model(None);
    }),
    command("Learn the object file in the hand", App::teach_object),
    command("Forget or rename the learned object in the hand", |app| {
        app.change_learned(&app.simulation.scene.object.source.clone());
    }),
    command("Detect trials automatically, or by key", App::toggle_watch),
    command("Next actuation: manual, board or untimed", App::next_control),
    command("Adapt to the real gripper by one close of the empty hand", |app| {
        app.gripper.send(GripperCommand::Adapt(app.control()));
    }),
    command("List serial ports", |app| _ = app.gripper.send(GripperCommand::ListPorts)),
    command("Record simulated grasps into the store", |app| {
        app.simulation.send(Command::SetRecording(Some(TrialPlace::Store)));
    }),
    command("Record simulated grasps into the demo log", |app| {
        app.simulation.send(Command::SetRecording(Some(TrialPlace::DemoLog)));
    }),
    command("Show the load on every taxel (panel Pads)", |app| app.show_panel("pads")),
    command("Error band, on or off", |app| {
        let shown = app.snapshot().is_some_and(|snapshot| snapshot.status.error_band);
        app.simulation.send(Command::SetErrorBand(!shown));
    }),
];

fn scale(app: &mut App, by: f32) {
    // Whole steps, also after many.
    let steps = (app.view.scale / SCALE_STEP).round() + (by / SCALE_STEP).round();
    app.set_scale(steps * SCALE_STEP);
}

fn change_speed(app: &mut App, by: isize) -> Result<(), &'static str> {
    if app.shown().replays() {
        app.playback().change_speed(by);
    } else {
        let now = app.snapshot().ok_or(NOT_LOADED)?.status.target_speed;
        app.simulation.send(Command::SetSpeed(next_speed(now, by)));
    }
    Ok(())
}

fn turn(app: &mut App, view: StandardView) {
    app.view.camera = app.view.camera.turned_to(view);
}

fn object_framed(app: &App) -> Option<Camera> {
    let snapshot = app.snapshot()?;
    let (place, radius) = snapshot.stage.object_ball(&snapshot.frame)?;
    Some(app.view.camera.framing(place, 1.2 * radius.max(0.01)))
}
