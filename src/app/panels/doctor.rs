//! Doctor: diagnostics of the gripper's board, wiring and port, as `palpate doctor` prints them, with cause, fix and a
//! command to copy.

use crate::app::actions::Actions;
use crate::app::features::App;
use crate::app::icons::{self, Icon};
use crate::app::theme::{self, colour};
use crate::app::widgets::{capital, command_ui, failure_ui, job_ui, port_field, remark_ui, warning_ui, words, wrapped};
use egui::text::{LayoutJob, TextFormat};
use egui::{CollapsingHeader, Color32, Grid, Label, RichText, ScrollArea, Sense, Ui};
use palpate_device::doctor::{
    Bleed, CHECKS, CheckFinding, CheckStatus, CrosstalkTest, SKETCH, USUAL_LISTEN_S, WIRING_RULES, is_sound, summary,
    wires,
};
use palpate_geometry::palette::Theme;
use palpate_lab::workers::{CrosstalkCommand, DiagnosticsReport, ExamineRequest, GripperCommand, GripperView, Job};
use palpate_tactile::board::SensorList;
use std::cmp::Reverse;

pub(super) fn ui(
    ui: &mut Ui,
    doctor: &Job<ExamineRequest, DiagnosticsReport>,
    gripper: Option<&GripperView>,
    actions: &mut Actions,
) {
    let sensors = gripper.map(|gripper| gripper.sensors).unwrap_or_default();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        if let Some((gripper, test)) = gripper.and_then(|gripper| Some((gripper, gripper.crosstalk.running.as_ref()?)))
        {
            return crosstalk_running_ui(ui, gripper, test, actions);
        }
        let remark = Some("Now bend each finger and press each pad.");
        let stop = (remark, "End and report so far", (|app| app.tools.doctor.stop()) as fn(&mut App));
        let last = job_ui(ui, doctor, stop, actions, |ui, actions| begin_ui(ui, sensors, actions));
        match gripper.and_then(|gripper| gripper.crosstalk.ended.as_ref()) {
            Some(Ok(test)) => crosstalk_ended_ui(ui, test),
            Some(Err(cause)) => failure_ui(ui, cause),
            None => {}
        }
        match last {
            Some(Ok(report)) => examination_ui(ui, theme::of(ui), &report),
            Some(Err(cause)) => failure_ui(ui, cause),
            None => {
                ui.add_space(6.0);
                CollapsingHeader::new("What is checked").show(ui, |ui| {
                    CHECKS.iter().for_each(|check| remark_ui(ui, capital(check.about)));
                });
            }
        }
        ui.add_space(6.0);
        CollapsingHeader::new("Wiring and firmware").show(ui, |ui| wiring_ui(ui, sensors));
    });
}

fn begin_ui(ui: &mut Ui, sensors: SensorList, actions: &mut Actions) {
    let port = port_field(ui, egui::Id::unique("doctor port"));
    let hint = "Meanwhile, bend each finger and press each pad: what does not move is not checked.";
    ui.horizontal_wrapped(|ui| {
        if ui.button("Examine").on_hover_text(format!("Listen for {USUAL_LISTEN_S} s")).clicked() {
            let request = ExamineRequest { port: port.clone(), seconds: USUAL_LISTEN_S, sensors };
            actions.push(|app| _ = app.tools.doctor.start(request));
        }
        let about = "Move each sensor in turn; those of the other finger must not follow";
        actions.on(&ui.button("Test for crosstalk").on_hover_text(about), |app| {
            _ = app.gripper.send(GripperCommand::Crosstalk(CrosstalkCommand::Begin(port)));
        });
    });
    remark_ui(ui, hint);
}

/// Wiring of the board.
fn wiring_ui(ui: &mut Ui, sensors: SensorList) {
    let [volt, bleeding] = WIRING_RULES;
    warning_ui(ui, volt);
    Grid::new("wiring").num_columns(3).spacing([14.0, 3.0]).striped(true).show(ui, |ui| {
        for title in ["pin", "to 3.3 V", "to ground"] {
            ui.weak(title);
        }
        ui.end_row();
        for wire in wires(sensors) {
            ui.monospace(wire.pin);
            ui.label(wire.above);
            ui.label(wire.below);
            ui.end_row();
        }
    });
    wrapped(ui, RichText::new(bleeding));
    remark_ui(
        ui,
        "The first command prints the full wiring and the line format, the second writes the Arduino sketch.",
    );
    for (mends, command) in
        [("wiring", "palpate doctor --wiring".to_owned()), ("the sketch", format!("palpate doctor --sketch {SKETCH}"))]
    {
        command_ui(ui, mends, &command);
    }
}

fn crosstalk_running_ui(ui: &mut Ui, gripper: &GripperView, test: &CrosstalkTest, actions: &mut Actions) {
    if test.is_begun() {
        let [step, of] = test.step();
        remark_ui(ui, format!("Crosstalk test, sensor {step} of {of}"));
    }
    let instruction = test.instruction().unwrap_or_else(|| gripper.link_state());
    wrapped(ui, RichText::new(format!("{}.", capital(&instruction))).strong());
    ui.horizontal_wrapped(|ui| {
        for (text, about, command) in [
            ("Skip", "Continue with the next sensor", CrosstalkCommand::Skip),
            ("Stop", "End the test and report so far", CrosstalkCommand::Stop),
        ] {
            actions.on(&ui.button(text).on_hover_text(about), |app| {
                _ = app.gripper.send(GripperCommand::Crosstalk(command));
            });
        }
    });
    bleeds_ui(ui, test.found());
}

fn crosstalk_ended_ui(ui: &mut Ui, test: &CrosstalkTest) {
    ui.add_space(6.0);
    let bleeds = test.found().iter().any(|bleed| bleed.bleeds);
    for (k, text) in test.summary().iter().enumerate() {
        let text = RichText::new(format!("{text}."));
        wrapped(ui, if k == 0 && !bleeds { text.strong() } else { text });
    }
    bleeds_ui(ui, test.found());
}

/// Influence of each moved sensor on the watched ones.
fn bleeds_ui(ui: &mut Ui, found: &[Bleed]) {
    if found.is_empty() {
        return;
    }
    ui.add_space(4.0);
    Grid::new("crosstalk").num_columns(3).spacing([12.0, 3.0]).striped(true).show(ui, |ui| {
        for title in ["moved", "watched", "follows by"] {
            ui.weak(title);
        }
        ui.end_row();
        for bleed in found {
            ui.label(bleed.from.label());
            ui.label(bleed.into.label());
            let share = RichText::new(format!("{:5.1} %", 100.0 * bleed.share)).monospace();
            let share = if bleed.bleeds { share.color(ui.visuals().error_fg_color) } else { share };
            ui.label(share).on_hover_text(format!("at most {:+.0} counts", bleed.counts));
            ui.end_row();
        }
    });
}

fn examination_ui(ui: &mut Ui, theme: Theme, examination: &DiagnosticsReport) {
    ui.add_space(6.0);
    let sound = is_sound(&examination.findings);
    let ink = if sound { ui.visuals().strong_text_color() } else { ui.visuals().error_fg_color };
    wrapped(ui, RichText::new(capital(&summary(&examination.findings))).heading().color(ink));
    if let Some(port) = &examination.port {
        let early = if examination.cut_short { ", then stopped" } else { "" };
        let text = format!("{port}, {:.0} s of readings{early}", examination.listened_s);
        remark_ui(ui, text);
    }
    ui.add_space(2.0);
    // Problems first; among equals, the order of the checks.
    let mut findings: Vec<&CheckFinding> = examination.findings.iter().collect();
    findings.sort_by_key(|finding| Reverse(finding.verdict));
    for finding in findings {
        finding_ui(ui, theme, finding);
    }
}

fn finding_ui(ui: &mut Ui, theme: Theme, finding: &CheckFinding) {
    ui.horizontal_top(|ui| {
        mark_ui(ui, theme, finding);
        ui.vertical(|ui| {
            ui.spacing_mut().item_spacing.y = 3.0;
            headline_ui(ui, theme, finding);
            for (word, text) in [("Cause: ", &finding.cause), ("Fix: ", &finding.fix)] {
                if let Some(text) = text {
                    wrapped(ui, RichText::new(format!("{word}{text}.")));
                }
            }
            if let Some(command) = &finding.command {
                command_ui(ui, finding.check, command);
            }
        });
    });
}

/// Check and observation, in one line where there is room.
fn headline_ui(ui: &mut Ui, theme: Theme, finding: &CheckFinding) {
    let colours = theme.colours();
    let name = match finding.verdict {
        CheckStatus::Failed => colours.error,
        CheckStatus::Note => colours.warning,
        CheckStatus::NotChecked | CheckStatus::Passed => colours.text,
        CheckStatus::Skipped => colours.quiet_text,
    };
    let seen = if finding.verdict >= CheckStatus::NotChecked { colours.text } else { colours.quiet_text };
    let font = egui::TextStyle::Body.resolve(ui.style());
    let mut line = LayoutJob::default();
    line.append(&words(finding.check), 0.0, TextFormat::simple(font.clone(), colour(name)));
    // A number and its unit stay in one line.
    let seen_text = finding.seen.replace(" %", "\u{a0}%");
    line.append(&seen_text, 10.0, TextFormat::simple(font, colour(seen)));
    ui.add(Label::new(line).wrap());
}

/// Sign of the verdict, with its words for screen readers and pointers.
fn mark_ui(ui: &mut Ui, theme: Theme, finding: &CheckFinding) {
    let (rect, response) = ui.allocate_exact_size(egui::vec2(18.0, 18.0), Sense::hover());
    let label = format!("{}: {}", finding.check, finding.verdict.name());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &label));
    let colours = theme.colours();
    let letter = |text: &str, ink: Color32| {
        let font = egui::FontId::proportional(17.0);
        ui.painter().text(rect.center(), egui::Align2::CENTER_CENTER, text, font, ink);
    };
    match finding.verdict {
        CheckStatus::Passed => icons::sign(ui, Icon::Check, rect, colour(colours.accent)),
        CheckStatus::Failed => icons::sign(ui, Icon::Cross, rect, colour(colours.error)),
        CheckStatus::Note => letter("!", colour(colours.warning)),
        CheckStatus::NotChecked => letter("?", colour(colours.quiet_text)),
        CheckStatus::Skipped => letter("–", colour(colours.quiet_text)),
    }
    response.on_hover_text(label);
}
