//! Bar above the panels (modes and data source) and below (time, or the running trial).

mod timeline;
mod trial;

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::gripper::control_title;
use crate::app::features::simulation::LoggedGrasp;
use crate::app::features::view::{Mode, ViewSource};
use crate::app::icons::{self, Icon};
use crate::app::modes;
use crate::app::panels::view3d;
use crate::app::playback::{SPEEDS, Seek};
use crate::app::theme::{accented, colour, veil};
use crate::app::widgets::{chip, choice_ui, number_field, stop_button};
use egui::{Align, Layout, RichText, Ui, vec2};
use palpate_device::serial::LinkState;
use palpate_geometry::palette::{Rgb, Theme};
use palpate_geometry::units::{SPACE, shown as with_unit};
use palpate_lab::inspection::FigureOptions;
use palpate_lab::workers::{Command, GripperView, Status};
use palpate_store::TrialPlace;

/// A speed: ¼× is 0.25×.
fn speed_text(speed: f64) -> String {
    if speed >= 1.0 || (speed * 100.0).fract() == 0.0 {
        format!("{speed}×")
    } else {
        format!("1/{}×", (1.0 / speed).round())
    }
}

pub(super) fn top(ui: &mut Ui, app: &App, actions: &mut Actions) {
    // Buttons at the right stay in sight where there is no room for everything. They are added last, as Tab runs.
    let id = egui::Id::unique("buttons at the right");
    let right = ui.data(|data| data.get_temp::<f32>(id)).unwrap_or(RIGHT);
    ui.horizontal_centered(|ui| {
        let room = vec2((ui.available_width() - right - ui.spacing().item_spacing.x).max(0.0), ui.available_height());
        // What does not fit is cut off, and does not push the buttons away.
        let (place, _) = ui.allocate_exact_size(room, egui::Sense::hover());
        let builder = egui::UiBuilder::new().max_rect(place).layout(Layout::left_to_right(Align::Center));
        let inside = &mut ui.new_child(builder);
        inside.set_clip_rect(place.intersect(ui.clip_rect()));
        sources_and_modes_ui(inside, app, actions);
        let buttons = ui.scope(|ui| {
            activity_ui(ui, app, actions);
            if app.gripper_view().is_some_and(GripperView::is_connected) {
                stop_button(ui, actions);
            }
            menu_ui(ui, app, actions);
            actions.on(&ui.button("?").on_hover_text("Keys (F1)"), |app| app.view.keys_shown = !app.view.keys_shown);
        });
        let width = buttons.response.rect.width();
        if (width - right).abs() > 0.5 {
            ui.data_mut(|data| data.insert_temp(id, width));
            ui.ctx().request_repaint();
        }
    });
}

/// Left part of the upper bar: modes, the real gripper, sources, the driver.
fn sources_and_modes_ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    if ui.available_width() > 780.0 {
        ui.label(RichText::new("Palpate").heading().strong());
    }
    modes_ui(ui, app, actions);
    // Before what may be cut off.
    gripper_ui(ui, app, actions);
    sources_ui(ui, app, actions);
    if app.view.source == ViewSource::Simulation {
        simulated_ui(ui, app);
    }
    let room = ui.available_width();
    if let Some(driver) = app.driver.as_deref().filter(|_| room > 240.0) {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let quiet = RichText::new(driver).small().color(colour(app.view.theme.colours().quiet_text));
            ui.add(egui::Label::new(quiet).truncate()).on_hover_text(drawn_by(app, driver));
        });
    }
}

/// Room for sources below which a trial has its number alone (points).
const NARROW: f32 = 330.0;
/// Room below which a gripper beside it has its rate alone (points).
const CRAMPED: f32 = 480.0;

/// Width of the buttons at the right before they were drawn (points).
const RIGHT: f32 = 140.0;

/// What runs in the background, whatever mode is open: a chip each, with its progress and a button that stops it.
fn activity_ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let tools = &app.tools;
    let study = app.studies.running().map(|running| ("Study", running.progress));
    let training = tools.training.running().map(|running| ("Training", running.progress));
    let lesson = tools.teaching.running().map(|running| ("Learning", running.progress));
    let fit = tools.fit.running().map(|running| ("Fit", running.progress));
    let stops: [fn(&mut App); 4] =
        [|app| app.studies.stop(), |app| app.tools.training.stop(), App::stop_teaching, |app| app.tools.fit.stop()];
    for (running, stop) in [study, training, lesson, fit].into_iter().zip(stops) {
        let Some((name, progress)) = running else { continue };
        let text = format!("{name} {:.0}{SPACE}%", 100.0 * progress.share);
        chip(ui, &text, app.view.theme.colours().accent).on_hover_text(&progress.words);
        // The word would be read as that of the button beside it, which vents the gripper.
        let button = icons::button(ui, Icon::Cross, &format!("Stop: {name}"), &format!("Stop: {name}"));
        actions.on(&button, stop);
    }
}

/// Driver that draws, and while the view moves how often and how finely.
fn drawn_by(app: &App, driver: &str) -> String {
    let Some(rate) = app.frame_rate.per_second() else { return driver.to_owned() };
    let resolution = app.resolution();
    let coarse =
        if resolution < 1.0 { format!(", 3-D view at {:.0}{SPACE}%", 100.0 * resolution) } else { String::new() };
    let frames = if rate.round() == 1.0 { "frame" } else { "frames" };
    format!("{rate:.0}{SPACE}{frames}/s{coarse} \u{b7} {driver}")
}

/// Width of the list of messages (points), and how many it shows: the newest.
const MESSAGES: f32 = 380.0;
const MOST_MESSAGES: usize = 12;

/// Settings of the window.
fn menu_ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let (icon, other) = match app.view.theme {
        Theme::Dark => (Icon::Sun, Theme::Light),
        Theme::Light => (Icon::Moon, Theme::Dark),
    };
    if icons::button(ui, icon, "Theme", &format!("Change to {} theme", other.name())).clicked() {
        actions.push(move |app| app.set_theme(other));
    }
    let menu = ui.menu_button("Menu", |ui| {
        let mut item = |ui: &mut Ui, name: &str, key: &str, action: fn(&mut App)| {
            actions.on(&ui.add(egui::Button::new(name).shortcut_text(key)), action);
        };
        item(ui, "Find an action …", "Ctrl+K", |app| app.view.palette_shown = true);
        ui.separator();
        item(ui, "Open an object …", "Ctrl+O", App::ask_for_object);
        item(ui, "Import trials …", "", App::ask_for_trials);
        item(ui, "Save the scene …", "Ctrl+S", App::save_scene);
        item(ui, "Save a picture …", "Ctrl+P", |app| {
            if let Err(why) = view3d::save_picture(app) {
                app.notices.info(why);
            }
        });
        item(ui, "Export …", "Ctrl+E", |app| match app.view.mode {
            Mode::Demo | Mode::Inspect => app.export_figure(FigureOptions::default()),
            Mode::Label => app.export_labelled(),
            Mode::Study => app.export_study_figure(),
        });
        ui.separator();
        item(ui, "Undo", "Ctrl+Z", |app| app.undo(false));
        item(ui, "Redo", "Ctrl+Shift+Z", |app| app.undo(true));
        ui.separator();
        ui.label("UI scale");
        ui.horizontal(|ui| {
            let scale = app.view.scale;
            for step in [0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 1.75, 2.0] {
                let text = format!("{:.0} %", 100.0 * step);
                actions.on(&ui.selectable_label((scale - step).abs() < 0.01, text), move |app| app.set_scale(step));
            }
        });
        ui.separator();
        actions.on(&ui.button("Reset layout").on_hover_text("Restore the default layout of all modes"), |app| {
            app.view.layouts.clear();
        });
        let hint = "Full screen: object after object, with large letters and a score";
        let presenter = egui::Button::new("Presenter mode").shortcut_text("F11");
        actions.on(&ui.add(presenter).on_hover_text(hint), |app| app.present(true));
        ui.menu_button("Messages", |ui| {
            ui.set_width(MESSAGES);
            if app.notices.messages().is_empty() {
                ui.weak("There was none yet.");
            }
            for text in app.notices.messages().iter().rev().take(MOST_MESSAGES) {
                ui.add(egui::Label::new(RichText::new(text).small()).wrap());
            }
        });
        ui.separator();
        actions.on(&ui.add(egui::Button::new("Keys").shortcut_text("F1")), |app| app.view.keys_shown = true);
        actions.on(&ui.button("Manual"), |app| app.view.manual_shown = true);
        actions.on(&ui.button("About"), |app| app.view.about_shown = true);
    });
    menu.response.on_hover_text("Open, save, export, undo, keys, manual");
}

/// Tabs of the modes.
fn modes_ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    ui.spacing_mut().item_spacing.x = 2.0;
    for kind in &modes::ALL {
        let chosen = app.view.mode == kind.mode;
        if ui.selectable_label(chosen, kind.title).on_hover_text(kind.about).clicked() && !chosen {
            actions.push(|app| app.set_mode(kind.mode));
        }
    }
    ui.spacing_mut().item_spacing.x = 8.0;
}

/// Sources of the data; with more than one, a click changes it.
fn sources_ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let colours = app.view.theme.colours();
    let link = app.gripper_view().and_then(|gripper| gripper.link.as_ref());
    let mut sources: Vec<(ViewSource, String, String, Rgb)> = Vec::new();
    // A trial beside a gripper keeps its button to close it.
    let cramped = link.is_some() && ui.available_width() < CRAMPED;
    if let Some(link) = link {
        let cadence = &link.cadence;
        let listening = link.state == LinkState::Listening;
        let kind = if link.board.emulated { "EMULATED" } else { "REAL" };
        let gripper = if cramped { kind.to_owned() } else { format!("{kind} GRIPPER") };
        let text = match (listening, cadence.troubled) {
            (true, true) => format!("{gripper} {:.0} Hz: many unreadable lines", cadence.rate_hz),
            (true, false) if cramped => format!("{gripper} {:.0} Hz", cadence.rate_hz),
            (true, false) => format!("{gripper} {:.0} Hz, {} lost", cadence.rate_hz, cadence.lost),
            (false, _) => format!("{gripper}: no readings"),
        };
        let remarks = [link.line_remarks(), link.wiring_remarks()].concat();
        let about = format!("{}: {}", link.port.path.display(), link.state.sentence());
        let about = std::iter::once(about).chain(remarks.iter().cloned()).collect::<Vec<_>>().join("\n");
        let ink = match (!listening || cadence.troubled, remarks.is_empty()) {
            (true, _) => colours.error,
            (false, false) => colours.warning,
            (false, true) => colours.text,
        };
        sources.push((ViewSource::Gripper, text, about, ink));
    }
    let simulated = "SIMULATED".to_owned();
    sources.push((ViewSource::Simulation, simulated, "Show the simulated gripper".to_owned(), colours.text));
    if let Some(inspected) = app.inspect.inspected() {
        let trial = inspected.trial;
        let text = match !cramped && ui.available_width() > NARROW {
            true => format!("TRIAL {}, {}", trial.id, trial.source_title().to_uppercase()),
            false => format!("TRIAL {}", trial.id),
        };
        let about = format!("{}: show this stored trial", trial.title);
        sources.push((ViewSource::Trial, text, about, colours.text));
    }
    if let [(_, text, ..)] = &sources[..] {
        return badge(ui, text, veil(colours.accent, 0.22), colour(colours.text));
    }
    for (source, text, about, ink) in sources {
        let text = RichText::new(text).small().color(colour(ink));
        actions.on(&ui.selectable_label(app.view.source == source, text).on_hover_text(about), move |app| {
            app.view.source = source;
        });
    }
    if app.view.source == ViewSource::Trial
        && icons::button(ui, Icon::Cross, "Close the trial", "Close the trial and show the live gripper").clicked()
    {
        actions.push(App::close_trial);
    }
}

/// State of the real gripper, in every mode: who actuates it, and whether trials begin automatically.
fn gripper_ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let Some(gripper) = app.gripper_view() else { return };
    let colours = app.view.theme.colours();
    if let Some(refused) = &gripper.refused {
        let text = RichText::new("gripper not connected").small().color(colour(colours.warning));
        actions.on(&ui.button(text).on_hover_text(&refused.text), |app| app.show_panel("gripper"));
    }
    if !gripper.is_connected() {
        return;
    }
    let watching = gripper.watching.is_some();
    let narrow = ui.available_width() < 640.0;
    let trials = match (watching, narrow) {
        (true, true) => "auto",
        (true, false) => "trials: automatic",
        (false, true) => "key R",
        (false, false) => "trials: key R",
    };
    let ink = if watching { colours.warning } else { colours.quiet_text };
    let about = match watching {
        true => "Trials begin and end with the movement of the fingers. W in Label mode, or a click, ends that",
        false => "Trials begin with R. W in Label mode, or a click, detects them automatically",
    };
    let text = RichText::new(trials).small().color(colour(ink));
    let button = egui::Button::selectable(watching, text).frame_when_inactive(true);
    actions.on(&ui.add(button).on_hover_text(about), App::toggle_watch);
    let text = RichText::new(drive_text(app, gripper, narrow)).small().color(colour(colours.text));
    let about = "Who sets the pressure of the next trial: you by hand, or the board; untimed trials last until Q. \
                 A in Label mode, or a click, changes it";
    actions.on(&ui.button(text).on_hover_text(about), App::next_control);
}

/// Actuation, and line pressure where it is known.
fn drive_text(app: &App, gripper: &GripperView, narrow: bool) -> String {
    let running = gripper.trial.as_ref().map(|trial| trial.request.control);
    let control = control_title(running.unwrap_or(app.control()));
    if narrow {
        return control.to_owned();
    }
    match gripper.latest.as_ref().filter(|_| app.gripper.silent_s().is_none()).and_then(|latest| latest.line_bar) {
        Some(bar) => format!("drive: {control}, {}", with_unit(bar, "bar")),
        None => format!("drive: {control}"),
    }
}

/// Object in the simulated hand, and grasps made.
fn simulated_ui(ui: &mut Ui, app: &App) {
    let object = app.snapshot().and_then(|s| s.object.as_deref());
    if let Some(object) = object.filter(|_| app.view.truth_shown) {
        ui.add(egui::Label::new(&object.title).truncate());
    }
    if let Some(snapshot) = app.snapshot().filter(|_| ui.available_width() > 120.0) {
        let status = &snapshot.status;
        // With a model, grasping ends as soon as the object is recognised.
        let of = if snapshot.identification.is_some() { "of up to" } else { "of" };
        let grasp = status.grasp_of_round.max(1);
        ui.weak(format!("grasp {grasp} {of} {}", status.grasps.max(grasp)));
    }
}

fn badge(ui: &mut Ui, text: &str, fill: egui::Color32, ink: egui::Color32) {
    egui::Frame::new().fill(fill).corner_radius(4).inner_margin(egui::Margin::symmetric(7, 2)).show(ui, |ui| {
        ui.label(RichText::new(text).small().color(ink));
    });
}

pub(super) fn bottom(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let shown = app.shown();
    let running = app.gripper_view().is_some_and(|gripper| gripper.trial.is_some());
    let records = match app.view.source {
        ViewSource::Gripper => true,
        ViewSource::Simulation => app.view.mode == Mode::Label,
        // A trial runs while the card asks about an older one.
        ViewSource::Trial => app.view.mode == Mode::Label && running,
    };
    if records && !shown.looks_back() {
        return trial::ui(ui, app, actions);
    }
    // Nothing is known before the first state of the simulation.
    let Some(status) = app.snapshot().map(|snapshot| snapshot.status.clone()) else { return };
    ui.horizontal_centered(|ui| {
        if shown.replays() {
            replay_buttons(ui, app, actions);
        } else {
            transport(ui, &status, actions);
        }
        ui.separator();
        speeds(ui, app, &status, actions);
        ui.separator();
        if app.view.source == ViewSource::Simulation && ui.available_width() > 420.0 {
            recording(ui, app, &status, actions);
            ui.separator();
        }
        let [first, last] = shown.time_span();
        let t = shown.time_s().unwrap_or(first);
        ui.label(RichText::new(format!("{t:5.2} / {last:.2} s")).monospace());
        if shown.looks_back() {
            live_button(ui, app, actions);
        }
        timeline::ui(ui, &shown, actions);
    });
}

/// Back to the newest sample.
fn live_button(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let button = egui::Button::new("Live").fill(accented(app.view.theme));
    actions.on(&ui.add(button).on_hover_text("Return to the newest sample (End)"), |app| app.seek(Seek::End));
}

/// Buttons of a stored trial, and of the past of a live gripper.
fn replay_buttons(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let mut button = |icon: Icon, name: &str, hint: &str, action: fn(&mut App)| {
        actions.on(&icons::button(ui, icon, name, hint), action);
    };
    button(Icon::Reset, "To the start", "To the start (Home)", |app| app.seek(Seek::Start));
    button(Icon::StepBack, "Step back", "One sample back (Ctrl+Left)", |app| app.seek(Seek::Samples(-1)));
    if app.shown().playback.playing {
        button(Icon::Pause, "Pause", "Pause (Space)", App::toggle_playing);
    } else {
        button(Icon::Play, "Play", "Play (Space)", App::toggle_playing);
    }
    button(Icon::Step, "Step", "One sample forward (Ctrl+Right)", |app| app.seek(Seek::Samples(1)));
    let repeated = app.shown().playback.repeated.is_some();
    let hint = "Repeat, between the marks A and B where both are set (L)";
    actions.on(&ui.selectable_label(repeated, "Loop").on_hover_text(hint), App::toggle_repeat);
}

fn transport(ui: &mut Ui, status: &Status, actions: &mut Actions) {
    let mut button = |icon: Icon, name: &str, hint: &str, command: Command| {
        actions.on(&icons::button(ui, icon, name, hint), |app| app.simulation.send(command));
    };
    button(Icon::Reset, "Reset", "Back to the start (Backspace)", Command::Reset);
    if status.playing {
        button(Icon::Pause, "Pause", "Pause (Space)", Command::Pause);
    } else {
        let hint = if status.finished { "Grasp again (Space)" } else { "Play (Space)" };
        button(Icon::Play, "Play", hint, Command::Play);
    }
    button(Icon::Step, "Step", "One sample forward (Ctrl+Right)", Command::Step);
}

/// Speed of the replay or of the simulation.
fn speeds(ui: &mut Ui, app: &App, status: &Status, actions: &mut Actions) {
    let replayed = app.shown().replays();
    let target = if replayed { app.shown().playback.speed } else { status.target_speed };
    let combo = egui::ComboBox::from_id_salt("speed").width(64.0).selected_text(speed_text(target));
    let shown = combo.show_ui(ui, |ui| {
        for speed in SPEEDS {
            if ui.selectable_label(target == speed, speed_text(speed)).clicked() {
                actions.push(move |app| match replayed {
                    true => app.playback().speed = speed,
                    false => app.simulation.send(Command::SetSpeed(speed)),
                });
            }
        }
    });
    shown.response.on_hover_text("Speed (- and =)");
    if replayed {
        return;
    }
    let actual = if status.playing && status.actual_speed > 0.0 {
        format!("{:.2}×", status.actual_speed)
    } else {
        String::new()
    };
    ui.add_sized([46.0, 20.0], egui::Label::new(RichText::new(actual).monospace()))
        .on_hover_text("Actual speed, as a multiple of real time");
}

/// Width that the name of the choice of a place needs beside everything else (points).
const NAMED: f32 = 620.0;

/// Where grasps are recorded, a button that keeps the last one, and how many grasps there are at most.
fn recording(ui: &mut Ui, app: &App, status: &Status, actions: &mut Actions) {
    let is_wide = ui.available_width() > NAMED;
    if is_wide {
        ui.weak("Record into");
    }
    let chosen = choice_ui(
        ui,
        status.recording,
        [
            (
                TrialPlace::DemoLog,
                "Demo log",
                "Keep the last 1000 grasps. They can be looked at, but are in no data set",
            ),
            (TrialPlace::Store, "Store", "Store every finished grasp as a trial, which data sets use"),
        ],
    );
    if let Some(place) = chosen.filter(|place| status.recording != Some(*place)) {
        actions.push(move |app| app.simulation.send(Command::SetRecording(Some(place))));
    }
    keep_ui(ui, app, actions);
    let mut grasps = status.grasps.max(1);
    let unit = if grasps == 1 { " grasp" } else { " grasps" };
    let drag = egui::DragValue::new(&mut grasps).range(1..=1000).speed(0.05).suffix(unit);
    let drag = if is_wide { drag.prefix("up to ") } else { drag };
    if number_field(ui, "grasps", drag).on_hover_text("Most grasps; all but the first in random poses").changed() {
        actions.push(move |app| app.simulation.send(Command::SetGrasps(grasps)));
    }
}

/// Button that moves the last grasp from the demo log to the store.
fn keep_ui(ui: &mut Ui, app: &App, actions: &mut Actions) {
    let kept = app.logged().is_some_and(|logged| logged.kept);
    let waits = app.logged().filter(|logged| !logged.kept);
    let hint = match app.logged() {
        Some(LoggedGrasp { trial, kept: true }) => format!("Trial {trial} is in the store"),
        Some(LoggedGrasp { trial, kept: false }) => {
            format!("Move the last grasp, trial {trial}, from the demo log to the store (K)")
        }
        None => "The last grasp is not in the demo log".to_owned(),
    };
    let button = ui.add_enabled(waits.is_some(), egui::Button::new(if kept { "Kept" } else { "Keep" }));
    if button.on_hover_text(&hint).on_disabled_hover_text(&hint).clicked()
        && let Some(LoggedGrasp { trial, .. }) = waits
    {
        actions.push(move |app| app.library.keep(trial));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_short() {
        let texts: Vec<String> = SPEEDS.iter().map(|s| speed_text(*s)).collect();
        assert_eq!(texts, ["1/32×", "1/16×", "1/8×", "0.25×", "0.5×", "1×", "2×", "4×", "8×"]);
    }
}
