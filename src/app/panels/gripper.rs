//! The real gripper: port, timing of its board, sensor readings and zeros, actuation, and the stop button.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::features::gripper::{CONTROLS, control_title};
use crate::app::theme::{self, accented};
use crate::app::widgets::{
    PAST, adapt_button, chip, command_ui, failed_sensors_ui, failure_ui, remark_ui, stop_button, text_field,
    warning_ui, wrapped,
};
use egui::{Button, Grid, RichText, ScrollArea, Ui};
use palpate_device::serial::{LinkState, LinkStatus, PortInfo};
use palpate_geometry::units::{number, shown as with_unit, three_digits, true_minus};
use palpate_lab::workers::{GripperCommand, GripperView, LatestReading};
use palpate_tactile::board::{Sensor, SensorKind};
use palpate_tactile::calibration::{Drift, DriftLevel};
use palpate_tactile::trial::Control;
use std::path::{Path, PathBuf};

pub(super) fn ui(
    ui: &mut Ui,
    (gripper, silent_s): (Option<&GripperView>, Option<u64>),
    port: Option<&Path>,
    control: Control,
    actions: &mut Actions,
) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let connected = gripper.and_then(|gripper| Some((gripper, gripper.link.as_ref()?)));
        match connected {
            Some((gripper, link)) => connected_ui(ui, (gripper, silent_s), link, control, actions),
            None => ports_ui(ui, gripper, port, actions),
        }
    });
}

/// Ports to connect to, first the last one.
fn ports_ui(ui: &mut Ui, gripper: Option<&GripperView>, port: Option<&Path>, actions: &mut Actions) {
    if let Some(refused) = gripper.and_then(|gripper| gripper.refused.as_ref()) {
        failure_ui(ui, &refused.text);
        if let Some(command) = &refused.command {
            command_ui(ui, "the port", command);
        }
    } else {
        remark_ui(ui, "No gripper connected. Demo and Inspect work with the simulated one.");
    }
    let id = egui::Id::unique("port path");
    let typed = ui.data_mut(|data| data.get_temp::<String>(id));
    let mut path = typed.unwrap_or_else(|| port.map(|port| port.display().to_string()).unwrap_or_default());
    let typed = Some(path.trim()).filter(|path| !path.is_empty()).map(PathBuf::from);
    ui.horizontal_wrapped(|ui| {
        let connect = Button::new("Connect").fill(accented(theme::of(ui)));
        let hint = "Connect to the port or file below; without one, find the gripper's board (Ctrl+G)";
        actions.on(&ui.add(connect).on_hover_text(hint), |app| app.connect(typed));
        actions.on(&ui.button("List ports"), |app| _ = app.gripper.send(GripperCommand::ListPorts));
    });
    ui.horizontal(|ui| {
        let label = ui.label("Port or file");
        let field = text_field(&mut path, id.with("field")).hint_text("/dev/ttyACM0 or captured bytes");
        let response = ui.add(field).labelled_by(label.id);
        if response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) && !path.trim().is_empty() {
            let path = PathBuf::from(path.trim());
            actions.push(|app| app.connect(Some(path)));
        }
    });
    ui.data_mut(|data| data.insert_temp(id, path));
    let ports: &[PortInfo] = gripper.map_or(&[], |gripper| &gripper.ports);
    for port in ports {
        let path = port.path.display().to_string();
        let button = Button::new(format!("{path}\n{}", port.title)).wrap();
        if ui.add_sized([ui.available_width(), 40.0], button).on_hover_text("Connect to this port").clicked() {
            let path = port.path.clone();
            actions.push(|app| app.connect(Some(path)));
        }
    }
    if gripper.is_some_and(|gripper| gripper.refused.is_some()) {
        remark_ui(ui, "The panel Doctor of Label mode examines port and board.");
    }
    let sensors = gripper.map(|gripper| gripper.sensors).unwrap_or_default();
    let expected = format!("Expected columns of the board: {}", sensors.names());
    wrapped(ui, RichText::new(expected).small().weak());
    let button = ui.button("Open gripper file");
    let about =
        "A TOML file that lists the sensors of another gripper; the store remembers them. It can also be dropped here";
    actions.on(&button.on_hover_text(about), App::ask_for_sensors);
}

fn connected_ui(
    ui: &mut Ui,
    (gripper, silent_s): (&GripperView, Option<u64>),
    link: &LinkStatus,
    control: Control,
    actions: &mut Actions,
) {
    ui.horizontal_wrapped(|ui| {
        stop_button(ui, actions);
        if ui
            .add_enabled(silent_s.is_none(), Button::new("Tare"))
            .on_hover_text("Set the present readings as zero; nothing may touch the fingers (T)")
            .clicked()
        {
            actions.push(|app| _ = app.gripper.send(GripperCommand::Tare));
        }
        adapt_button(ui, Some(gripper), control, actions);
        actions.on(&ui.button("Disconnect").on_hover_text("Release the port (Ctrl+G)"), |app| {
            _ = app.gripper.send(GripperCommand::Disconnect);
        });
    });
    health_ui(ui, link);
    failed_sensors_ui(ui, gripper);
    ui.separator();
    if let Some(silent_s) = silent_s.filter(|_| gripper.latest.is_some()) {
        warning_ui(ui, format!("No readings for {silent_s}\u{a0}s. These are the last:"));
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(500));
    }
    ui.scope(|ui| {
        if silent_s.is_some() {
            ui.multiply_opacity(PAST);
        }
        readings_ui(ui, gripper, link);
    });
    for remark in &gripper.remarks {
        wrapped(ui, RichText::new(remark).small().color(ui.visuals().warn_fg_color));
    }
    ui.separator();
    control_ui(ui, control, gripper, actions);
}

/// Width of the panel from which two facts stand beside each other (points).
const TWO_FACTS: f32 = 260.0;

/// Port, board and timing.
fn health_ui(ui: &mut Ui, link: &LinkStatus) {
    let port = format!("{}, {}", link.port.path.display(), link.port.title);
    wrapped(ui, RichText::new(port).small());
    if link.state != LinkState::Listening {
        warning_ui(ui, link.state.sentence());
    }
    let cadence = &link.cadence;
    let now = |text: String| if link.state == LinkState::Listening { text } else { "–".to_owned() };
    let firmware = link.board.firmware.clone().unwrap_or_else(|| "–".to_owned());
    let jitter = format!("{:.1} ms", cadence.jitter_p95_ms);
    let facts = [
        ("rate", now(format!("{:.1} Hz", cadence.rate_hz)), false, "Readings per second"),
        ("jitter", now(jitter), false, "95th percentile of the deviation between readings"),
        ("lost", cadence.lost.to_string(), cadence.lost > 0, "Readings lost since connecting"),
        ("bad lines", cadence.bad_lines.to_string(), cadence.troubled, "Unreadable lines"),
        ("reconnects", link.reconnects.to_string(), false, "Reconnections since connecting"),
        ("firmware", firmware, false, "Firmware that the board reports"),
    ];
    let beside = if ui.available_width() < TWO_FACTS { 1 } else { 2 };
    Grid::new("health").num_columns(2 * beside).spacing([10.0, 2.0]).show(ui, |ui| {
        for (place, (name, value, bad, about)) in facts.into_iter().enumerate() {
            ui.weak(name);
            let text = RichText::new(value).monospace();
            let text = if bad { text.color(ui.visuals().error_fg_color) } else { text };
            ui.label(text).on_hover_text(about);
            if (place + 1) % beside == 0 {
                ui.end_row();
            }
        }
    });
    wrapped(ui, RichText::new(link.format_summary()).small().weak());
    for text in link.line_remarks() {
        failure_ui(ui, text);
    }
    for text in link.wiring_remarks() {
        warning_ui(ui, text);
    }
}

/// Counts, calibrated value and zero of each sensor.
fn readings_ui(ui: &mut Ui, gripper: &GripperView, link: &LinkStatus) {
    let Some(latest) = &gripper.latest else {
        ui.weak("no readings yet");
        return;
    };
    Grid::new("sensors").num_columns(4).spacing([10.0, 4.0]).show(ui, |ui| {
        for sensor in link.board.sensors.iter() {
            let Some(column) = link.board.channel_of(sensor) else { continue };
            ui.label(sensor.label());
            let counts = latest.counts.get(column).copied().flatten();
            let counts = counts.map_or_else(|| "–".to_owned(), |counts| format!("{counts:4.0}"));
            ui.label(RichText::new(counts).monospace().weak()).on_hover_text("ADC counts");
            let value = RichText::new(value_text(latest, sensor)).monospace();
            if latest.beyond.contains(&sensor) {
                let about = "Outside the calibrated range: extrapolated";
                ui.label(value.color(ui.visuals().warn_fg_color)).on_hover_text(about);
            } else {
                ui.label(value);
            }
            match gripper.drift.iter().find(|drift| drift.sensor == sensor) {
                Some(drift) => drift_badge(ui, drift),
                None => {
                    ui.weak("");
                }
            }
            ui.end_row();
        }
        ui.label("line pressure");
        ui.label("");
        let bar = latest.line_bar.map_or_else(|| "–".to_owned(), |bar| format!("{bar:.2} bar"));
        ui.label(RichText::new(bar).monospace()).on_hover_text("Commanded, or reported by the board");
        ui.end_row();
    });
}

/// Calibrated value with its unit.
fn value_text(latest: &LatestReading, sensor: Sensor) -> String {
    let text = latest.estimate.value(sensor).map(|value| match sensor.kind() {
        SensorKind::Flex => format!("{:>6}°", number(value.to_degrees(), "°")),
        SensorKind::Pad => format!("{:>7}", with_unit(value, "N")),
        SensorKind::Raw => format!("{:>5} {}", true_minus(&three_digits(value)), sensor.raw_unit_name()),
    });
    text.unwrap_or_else(|| "–".to_owned())
}

/// Drift of a zero since the calibration.
fn drift_badge(ui: &mut Ui, drift: &Drift) {
    let colours = theme::of(ui).colours();
    let (word, ink) = match drift.level {
        DriftLevel::Steady => ("zero", colours.quiet_text),
        DriftLevel::Moved => ("zero drifted", colours.warning),
        DriftLevel::TooFar => ("zero too far off", colours.error),
    };
    let about = drift.remark().unwrap_or_else(|| "Shift of its zero since the calibration: small".to_owned());
    chip(ui, format!("{word} {}", true_minus(&drift.with_unit())), ink).on_hover_text(about);
}

/// Actuation, and automatic detection of trials.
fn control_ui(ui: &mut Ui, mut control: Control, gripper: &GripperView, actions: &mut Actions) {
    ui.label("Actuation  (A)");
    for kind in CONTROLS {
        let about = match kind {
            Control::ByHand => "You set the pressure at the control box, as instructed",
            Control::Driven => "The board sets the pressure of the programme; needs our firmware",
            Control::Free => "Untimed: recording runs until Q, phases are unknown",
        };
        let can = kind != Control::ByHand || !gripper.driven_only;
        let radio = ui.add_enabled_ui(can, |ui| ui.radio_value(&mut control, kind, control_title(kind))).inner;
        let radio = radio.on_disabled_hover_text("The emulated hand has no control box: the board moves it");
        if radio.on_hover_text(about).changed() {
            actions.push(move |app| app.view.control = control);
        }
    }
    let mut watching = gripper.watching.is_some();
    let about = "A trial starts when the pressure rises or the fingers move, and ends when they are at rest again";
    if ui.checkbox(&mut watching, "Detect trials automatically  (W)").on_hover_text(about).changed() {
        actions.push(App::toggle_watch);
    }
}
