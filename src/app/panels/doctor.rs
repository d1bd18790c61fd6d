//! What is wrong between the gripper's board and this computer: the same list as `palpate doctor` prints, with cause, fix and
//! a command to copy.

use super::{PanelContext, command_ui, port_field, wrapped};
use crate::app::actions::Action;
use crate::app::gripper_tools::ToolWish;
use crate::app::icons::{self, Icon};
use crate::app::theme::colour;
use egui::text::{LayoutJob, TextFormat};
use egui::{Color32, Label, ProgressBar, RichText, ScrollArea, Sense, Ui};
use palpate_core::doctor::{CHECKS, Finding, USUAL_LISTEN_S, Verdict, is_sound, summary};
use palpate_core::palette::Theme;
use palpate_core::workers::{Examination, ExamineRequest};

pub(super) fn ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Vec<Action>) {
    let view = context.tools.examiner.view().unwrap_or_default();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        match &view.running {
            Some((request, listened_s)) => running_ui(ui, request, *listened_s, actions),
            None => begin_ui(ui, actions),
        }
        match &view.last {
            Some(last) => examination_ui(ui, context.view.theme, last),
            None => {
                ui.add_space(6.0);
                let about: Vec<&str> = CHECKS.iter().map(|check| check.about).collect();
                wrapped(ui, RichText::new(format!("It checks that {}.", about.join(", "))).weak());
            }
        }
    });
}

fn begin_ui(ui: &mut Ui, actions: &mut Vec<Action>) {
    let port = port_field(ui, egui::Id::unique("doctor port"));
    let hint = "Bend a finger and press each pad meanwhile: more can be seen then.";
    if ui.button("Examine").on_hover_text(format!("Listen for {USUAL_LISTEN_S} s")).clicked() {
        actions.push(Action::Tool(ToolWish::Examine(ExamineRequest { port, seconds: USUAL_LISTEN_S })));
    }
    wrapped(ui, RichText::new(hint).weak());
}

fn running_ui(ui: &mut Ui, request: &ExamineRequest, listened_s: f64, actions: &mut Vec<Action>) {
    let of = request.seconds;
    let share = (listened_s / of.max(1e-9)) as f32;
    ui.add(ProgressBar::new(share).text(format!("listening, {listened_s:.0} of {of:.0} s")));
    wrapped(ui, RichText::new("Now bend a finger, and press each pad.").strong());
    if ui.button("Stop").on_hover_text("Say what was seen so far").clicked() {
        actions.push(Action::Tool(ToolWish::StopExamining));
    }
}

fn examination_ui(ui: &mut Ui, theme: Theme, examination: &Examination) {
    ui.add_space(6.0);
    let sound = is_sound(&examination.findings);
    let ink = if sound { ui.visuals().strong_text_color() } else { ui.visuals().error_fg_color };
    wrapped(ui, RichText::new(sentence(&summary(&examination.findings))).heading().color(ink));
    if let Some(port) = &examination.port {
        let early = if examination.cut_short { ", then stopped" } else { "" };
        let text = format!("{port}, listened to for {:.0} s{early}", examination.listened_s);
        wrapped(ui, RichText::new(text).weak());
    }
    ui.add_space(2.0);
    // What is to be done comes first; among equals, the order of the checks.
    let mut findings: Vec<&Finding> = examination.findings.iter().collect();
    findings.sort_by_key(|finding| match finding.verdict {
        Verdict::Wrong => 0,
        Verdict::Note => 1,
        Verdict::Good => 2,
        Verdict::NotSeen => 3,
    });
    for finding in findings {
        finding_ui(ui, theme, finding);
    }
}

/// With a capital letter.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

fn finding_ui(ui: &mut Ui, theme: Theme, finding: &Finding) {
    ui.horizontal_top(|ui| {
        mark_ui(ui, theme, finding);
        ui.vertical(|ui| {
            ui.spacing_mut().item_spacing.y = 3.0;
            headline_ui(ui, theme, finding);
            for (word, text) in [("Why: ", &finding.cause), ("Do: ", &finding.fix)] {
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

/// What was checked and what was seen, in one line where there is room.
fn headline_ui(ui: &mut Ui, theme: Theme, finding: &Finding) {
    let colours = theme.colours();
    let (name, seen) = match finding.verdict {
        Verdict::Wrong => (colours.error, colours.text),
        Verdict::Note => (colours.warning, colours.text),
        Verdict::Good => (colours.text, colours.quiet_text),
        Verdict::NotSeen => (colours.quiet_text, colours.quiet_text),
    };
    let font = egui::TextStyle::Body.resolve(ui.style());
    let mut line = LayoutJob::default();
    line.append(&finding.check.replace('-', " "), 0.0, TextFormat::simple(font.clone(), colour(name)));
    line.append(&finding.seen, 10.0, TextFormat::simple(font, colour(seen)));
    ui.add(Label::new(line).wrap());
}

/// A sign for the verdict, and its words for screen readers and pointers.
fn mark_ui(ui: &mut Ui, theme: Theme, finding: &Finding) {
    let (rect, response) = ui.allocate_exact_size(egui::vec2(18.0, 18.0), Sense::hover());
    let label = format!("{}: {}", finding.check, finding.verdict.name());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &label));
    let colours = theme.colours();
    let letter = |text: &str, ink: Color32| {
        let font = egui::FontId::proportional(17.0);
        ui.painter().text(rect.center(), egui::Align2::CENTER_CENTER, text, font, ink);
    };
    match finding.verdict {
        Verdict::Good => icons::sign(ui, Icon::Check, rect, colour(colours.accent)),
        Verdict::Wrong => icons::sign(ui, Icon::Cross, rect, colour(colours.error)),
        Verdict::Note => letter("!", colour(colours.warning)),
        Verdict::NotSeen => letter("–", colour(colours.quiet_text)),
    }
    response.on_hover_text(label);
}
