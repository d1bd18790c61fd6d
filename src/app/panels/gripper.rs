//! The real gripper: its port, how well its board keeps time, what its sensors show, where their zeros are, and the key
//! that stops everything.

use super::{PanelContext, command_ui, wrapped};
use crate::app::actions::Action;
use crate::app::theme::{colour, veil};
use egui::{Button, Grid, RichText, ScrollArea, TextEdit, Ui};
use palpate_device::serial::{LinkState, LinkStatus, PortInfo};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::three_digits;
use palpate_lab::workers::{GripperView, GripperWish, LatestReading, TrialRequest};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::{Drift, DriftLevel};
use palpate_tactile::trial::Control;
use std::path::PathBuf;

pub(super) fn ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let connected = context.gripper.and_then(|gripper| Some((gripper, gripper.link.as_ref()?)));
        match connected {
            Some((gripper, link)) => connected_ui(ui, context, gripper, link, actions),
            None => ports_ui(ui, context, actions),
        }
    });
}

/// What can be connected to.
fn ports_ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    if let Some(refused) = context.gripper.and_then(|gripper| gripper.refused.as_ref()) {
        wrapped(ui, RichText::new(&refused.text).color(ui.visuals().error_fg_color));
        if let Some(command) = &refused.command {
            command_ui(ui, "the port", command);
        }
        wrapped(ui, RichText::new("The panel Doctor, in the mode Label, examines port and board.").weak());
    } else {
        wrapped(ui, RichText::new("No gripper is connected. Everything works without one, simulated.").weak());
    }
    ui.horizontal_wrapped(|ui| {
        let connect = Button::new("Connect").fill(colour(accented(context.view.theme)));
        if ui.add(connect).on_hover_text("To the only port that looks like the gripper's board").clicked() {
            actions.push(Action::Gripper(GripperWish::Connect(None)));
        }
        if ui.button("Look for ports").clicked() {
            actions.push(Action::Gripper(GripperWish::ListPorts));
        }
    });
    let ports: &[PortInfo] = context.gripper.map_or(&[], |gripper| &gripper.ports);
    for port in ports {
        let path = port.path.display().to_string();
        let button = Button::new(format!("{path}\n{}", port.title)).wrap();
        if ui.add_sized([ui.available_width(), 40.0], button).on_hover_text("Connect to this port").clicked() {
            actions.push(Action::Gripper(GripperWish::Connect(Some(port.path.clone()))));
        }
    }
    let id = egui::Id::unique("port path");
    let mut path = ui.data_mut(|data| data.get_temp::<String>(id)).unwrap_or_default();
    ui.horizontal(|ui| {
        let label = ui.label("Port or file");
        let field =
            TextEdit::singleline(&mut path).hint_text("/dev/ttyACM0, or captured bytes").desired_width(f32::INFINITY);
        let response = ui.add(field).labelled_by(label.id);
        if response.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) && !path.trim().is_empty() {
            actions.push(Action::Gripper(GripperWish::Connect(Some(PathBuf::from(path.trim())))));
        }
    });
    ui.data_mut(|data| data.insert_temp(id, path));
}

fn accented(theme: Theme) -> palpate_geometry::palette::Rgb {
    let colours = theme.colours();
    colours.raised.mix(colours.accent, 0.35)
}

/// The key that stops everything: the same wherever it stands.
pub(in crate::app) fn stop_button(ui: &mut Ui, theme: Theme, actions: &mut Vec<Action>) {
    let colours = theme.colours();
    let text = RichText::new("STOP  Esc").strong().color(colour(colours.background));
    let button = Button::new(text).fill(colour(colours.error));
    let response =
        ui.add_sized([84.0, 26.0], button).on_hover_text("Vent the fingers at once, and end the trial (Esc)");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "Stop and vent"));
    if response.clicked() {
        actions.push(Action::Gripper(GripperWish::Vent));
    }
}

fn connected_ui(
    ui: &mut Ui,
    context: &PanelContext<'_>,
    gripper: &GripperView,
    link: &LinkStatus,
    actions: &mut Vec<Action>,
) {
    ui.horizontal_wrapped(|ui| {
        stop_button(ui, context.view.theme, actions);
        if ui
            .button("Tare")
            .on_hover_text("What the sensors show now is zero: nothing may touch the fingers (T)")
            .clicked()
        {
            actions.push(Action::Gripper(GripperWish::Tare));
        }
        if ui.button("Disconnect").on_hover_text("Give the port back").clicked() {
            actions.push(Action::Gripper(GripperWish::Disconnect));
        }
    });
    health_ui(ui, link);
    ui.separator();
    readings_ui(ui, context, gripper, link);
    for remark in &gripper.remarks {
        wrapped(ui, RichText::new(remark).small().color(ui.visuals().warn_fg_color));
    }
    ui.separator();
    control_ui(ui, context, gripper, actions);
}

/// Port, board, and how well it keeps time.
fn health_ui(ui: &mut Ui, link: &LinkStatus) {
    let port = format!("{}, {}", link.port.path.display(), link.port.title);
    wrapped(ui, RichText::new(port).small());
    if link.state != LinkState::Listening {
        wrapped(ui, RichText::new(link.state.sentence()).color(ui.visuals().warn_fg_color));
    }
    let cadence = &link.cadence;
    Grid::new("health").num_columns(4).spacing([10.0, 2.0]).show(ui, |ui| {
        let pair = |ui: &mut Ui, name: &str, value: String, bad: bool, about: &str| {
            ui.weak(name);
            let text = RichText::new(value).monospace();
            let text = if bad { text.color(ui.visuals().error_fg_color) } else { text };
            ui.label(text).on_hover_text(about);
        };
        pair(ui, "rate", format!("{:.1} Hz", cadence.rate_hz), false, "Readings a second");
        pair(
            ui,
            "jitter",
            format!("{:.1} ms", cadence.jitter_p95_ms),
            false,
            "95 % of the intervals are no farther off",
        );
        ui.end_row();
        pair(
            ui,
            "lost",
            cadence.lost.to_string(),
            cadence.lost > 0,
            "Readings that are missing, since it was connected",
        );
        pair(ui, "bad lines", cadence.bad_lines.to_string(), cadence.troubled, "Lines that could not be read");
        ui.end_row();
        pair(ui, "reconnects", link.reconnects.to_string(), false, "How often the connection was taken up again");
        let firmware = link.board.firmware.clone().unwrap_or_else(|| "–".to_owned());
        pair(ui, "firmware", firmware, false, "What the board says of itself; – where it says nothing");
        ui.end_row();
    });
    wrapped(ui, RichText::new(link.heard_as()).small().weak());
    for text in link.line_remarks() {
        wrapped(ui, RichText::new(text).color(ui.visuals().error_fg_color));
    }
    for text in link.wiring_remarks() {
        wrapped(ui, RichText::new(text).color(ui.visuals().warn_fg_color));
    }
}

/// Each sensor: counts, what they come to, and where its zero is.
fn readings_ui(ui: &mut Ui, context: &PanelContext<'_>, gripper: &GripperView, link: &LinkStatus) {
    let Some(latest) = &gripper.latest else {
        ui.weak("no readings yet");
        return;
    };
    Grid::new("sensors").num_columns(4).spacing([10.0, 4.0]).show(ui, |ui| {
        for sensor in Sensor::ALL {
            let Some(column) = link.board.channel_of(sensor) else { continue };
            ui.label(sensor.label());
            let counts = latest.counts.get(column).copied().flatten();
            let counts = counts.map_or_else(|| "–".to_owned(), |counts| format!("{counts:4.0}"));
            ui.label(RichText::new(counts).monospace().weak()).on_hover_text("counts of the converter");
            let felt = RichText::new(felt_text(latest, sensor)).monospace();
            if latest.beyond[sensor as usize] {
                let about = "Beyond what it was calibrated with: read off the curve's extension";
                ui.label(felt.color(ui.visuals().warn_fg_color)).on_hover_text(about);
            } else {
                ui.label(felt);
            }
            match gripper.drift.iter().find(|drift| drift.sensor == sensor) {
                Some(drift) => drift_badge(ui, context.view.theme, drift),
                None => {
                    ui.weak("");
                }
            }
            ui.end_row();
        }
        ui.label("line pressure");
        ui.label("");
        let bar = latest.line_bar.map_or_else(|| "–".to_owned(), |bar| format!("{bar:.2} bar"));
        ui.label(RichText::new(bar).monospace()).on_hover_text("As commanded, or as the board reports it");
        ui.end_row();
    });
}

/// What a sensor feels, with its unit.
fn felt_text(latest: &LatestReading, sensor: Sensor) -> String {
    let side = sensor as usize % 2;
    let text = if sensor.is_flex() {
        latest.felt.angle[side].map(|angle| format!("{:6.1}°", angle.to_degrees()))
    } else {
        latest.felt.force[side].map(|force| format!("{:>5} N", three_digits(force)))
    };
    text.unwrap_or_else(|| "–".to_owned())
}

/// How far a zero has moved since the calibration.
fn drift_badge(ui: &mut Ui, theme: Theme, drift: &Drift) {
    let colours = theme.colours();
    let (word, ink) = match drift.level {
        DriftLevel::Steady => ("steady", colours.quiet_text),
        DriftLevel::Moved => ("moved", colours.warning),
        DriftLevel::TooFar => ("too far", colours.error),
    };
    let text = format!("{word} {}", drift.with_unit());
    let frame = egui::Frame::new().fill(veil(ink, 0.14)).corner_radius(4).inner_margin(egui::Margin::symmetric(5, 1));
    let about = drift.remark().unwrap_or_else(|| "The zero is where the calibration has it".to_owned());
    frame.show(ui, |ui| ui.label(RichText::new(text).small().color(colour(ink)))).response.on_hover_text(about);
}

/// Who moves the fingers, in words.
pub(in crate::app) fn control_title(control: Control) -> &'static str {
    match control {
        Control::ByHand => "by hand, as told",
        Control::Driven => "by the board",
        Control::Free => "as they like",
    }
}

/// Who moves the fingers, and trials that begin by themselves.
fn control_ui(ui: &mut Ui, context: &PanelContext<'_>, gripper: &GripperView, actions: &mut Vec<Action>) {
    ui.label("The fingers are moved  (M)");
    let mut control = context.view.control;
    for (kind, about) in [
        (Control::ByHand, "You turn the pressure up and down when the trial's phases say so"),
        (Control::Driven, "The board passes on the pressures of the programme, as our firmware does"),
        (Control::Free, "Nobody says when: a trial lasts until Q, and its phases are not known"),
    ] {
        if ui.radio_value(&mut control, kind, control_title(kind)).on_hover_text(about).changed() {
            actions.push(Action::SetControl(control));
        }
    }
    let mut watching = gripper.watching.is_some();
    let about = "A trial begins when the pressure rises or the fingers move, and ends when they are back at rest";
    if ui.checkbox(&mut watching, "Trials begin and end by themselves  (W)").on_hover_text(about).changed() {
        let request = TrialRequest { object: None, control: Control::Free, adds: false };
        actions.push(Action::Gripper(GripperWish::Watch(watching.then_some(request))));
    }
}
