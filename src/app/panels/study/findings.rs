//! Findings of the chosen study: each claim of the paper, our number beside it, and the verdict as a word and a sign.

use super::result_ui;
use crate::app::actions::Actions;
use crate::app::features::studies::{QUICK, Studies, is_quick};
use crate::app::theme::{self, colour, veil};
use crate::app::widgets::wrapped;
use egui::{Color32, Frame, Label, Margin, RichText, Role, ScrollArea, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use palpate_geometry::palette::{Rgb, Theme};
use palpate_geometry::units::{SPACE, symbol};
use palpate_study::{Agreement, Cell, Finding};

pub(in crate::app::panels) fn ui(ui: &mut Ui, studies: &Studies, actions: &mut Actions) {
    let Some(result) = result_ui(ui, studies, "study-findings", "findings", actions) else { return };
    let findings = &result.stored.result.findings;
    // Those of another study begin at the top.
    ScrollArea::vertical().id_salt(studies.chosen().card().key).auto_shrink(false).show(ui, |ui| {
        let count = |verdict: Agreement| findings.iter().filter(|finding| finding.verdict == verdict).count();
        let all = [Agreement::Agrees, Agreement::Partly, Agreement::Disagrees, Agreement::NotMeasured];
        let counts = all.map(|verdict| (count(verdict), verdict.name()));
        let shown = counts.iter().filter(|(count, _)| *count > 0).map(|(count, name)| format!("{name} {count}"));
        let plural = if findings.len() == 1 { "claim" } else { "claims" };
        let text = format!("{} {plural}: {}", findings.len(), shown.collect::<Vec<_>>().join(", "));
        wrapped(
            ui,
            RichText::new(if findings.is_empty() { "The paper has no claim about this.".to_owned() } else { text })
                .weak(),
        );
        if is_quick(result.origin) && !findings.is_empty() {
            ui.label(RichText::new(QUICK).small().color(ui.visuals().warn_fg_color));
        }
        for finding in findings {
            finding_ui(ui, theme::of(ui), finding);
        }
    });
}

/// Sign and colour of a verdict.
fn sign(verdict: Agreement, theme: Theme) -> (&'static str, Rgb) {
    let colours = theme.colours();
    match verdict {
        Agreement::Agrees => ("✔", colours.good),
        Agreement::Partly => ("±", colours.warning),
        Agreement::Disagrees => ("✖", colours.error),
        Agreement::NotMeasured => ("–", colours.quiet_text),
    }
}

fn finding_ui(ui: &mut Ui, theme: Theme, finding: &Finding) {
    let (sign, ink) = sign(finding.verdict, theme);
    Frame::new().fill(colour(theme.colours().raised)).corner_radius(4).inner_margin(Margin::same(7)).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.spacing_mut().item_spacing.y = 3.0;
        ui.horizontal_wrapped(|ui| {
            let tag = Frame::new().fill(veil(ink, 0.16)).corner_radius(4).inner_margin(Margin::symmetric(6, 1));
            tag.show(ui, |ui| {
                ui.label(RichText::new(format!("{sign} {}", finding.verdict.name())).color(colour(ink)).strong());
            });
            ui.weak(&finding.section);
        });
        wrapped(ui, RichText::new(&finding.claim));
        if !finding.found.is_empty() {
            wrapped(ui, RichText::new(finding.found.replace(" %", "\u{a0}%")));
        }
        wrapped(ui, RichText::new(&finding.why).small().weak());
        // The verdict is on all of them; each may stand on either side.
        numbers_ui(ui, theme, finding, colour(theme.colours().accent));
    });
}

/// Width and height of a strip (points).
const STRIP: [f32; 2] = [64.0, 12.0];

/// The numbers of a finding, one below the other, each with its interval around the line that decides.
fn numbers_ui(ui: &mut Ui, theme: Theme, finding: &Finding, ink: Color32) {
    let quiet = colour(theme.colours().quiet_text);
    for (own, strip) in finding.strips() {
        wrapped(ui, RichText::new(&own.what).small().weak());
        ui.horizontal(|ui| {
            let (rect, response) = ui.allocate_exact_size(STRIP.into(), Sense::hover());
            // In the unit of the number before it.
            let line_at = format!("line at {}", Cell::Number(own.line).shown(&own.unit));
            let text = format!("{}: {}, {line_at}{SPACE}{}", own.what, own.shown(), symbol(&own.unit));
            let text = text.trim_end().to_owned();
            response.widget_info(|| WidgetInfo::labeled(Role::Figure, true, &text));
            let inner = rect.shrink2(vec2(4.0, 1.0));
            let at = |place: f64| inner.left() + inner.width() * place as f32;
            let [low, estimate, high, line] = strip.0.map(at);
            ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(1.0, quiet.gamma_multiply(0.4)));
            ui.painter().vline(line, rect.y_range(), Stroke::new(1.0, quiet));
            ui.painter().hline(low..=high, rect.center().y, Stroke::new(2.5, ink));
            ui.painter().circle_filled(pos2(estimate, rect.center().y), 3.0, ink);
            response.on_hover_text(text);
            let estimate = Cell::from(own.value.value()).shown(&own.unit);
            ui.add(Label::new(RichText::new(format!("{estimate}{SPACE}{}", symbol(&own.unit))).small()).extend());
            ui.add(Label::new(RichText::new(line_at).small().weak()).truncate());
        });
    }
    if let Some(more) = finding.left_out() {
        ui.label(RichText::new(more).small().weak());
    }
}
