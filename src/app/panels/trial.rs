//! Facts of the stored trial that is open: object, source, quality, phases with their times, and the scene.

use crate::app::actions::Actions;
use crate::app::playback::Seek;
use crate::app::shown::DisplayedData;
use crate::app::theme::colour;
use crate::app::widgets::{capital, wrapped};
use egui::{Grid, RichText, ScrollArea, Ui};
use palpate_lab::inspection::OpenTrial;
use palpate_sim::frame::TrustLevel;
use palpate_tactile::trial::TrialSource;

pub(super) fn ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let Some(inspected) = data.inspected else {
        ui.weak("No trial is open. Choose one in the library, or press Enter on it.");
        return;
    };
    let trial = inspected.trial;
    let colours = data.view.theme.colours();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.heading(&trial.title);
        ui.weak(format!("Trial {}, {}, {}", trial.id, trial.source_title(), date(&trial.created)));
        for remark in trial.remarks.iter().chain(&trial.header.warnings) {
            wrapped(ui, RichText::new(remark).color(colour(colours.warning)));
        }
        if let Some(facts) = &trial.simulated {
            let (level, why) = facts.quality.trust();
            let ink = match level {
                TrustLevel::Green => colours.text,
                TrustLevel::Amber => colours.warning,
                TrustLevel::Red => colours.error,
            };
            let text = RichText::new(format!("{}.", capital(&why))).color(colour(ink));
            ui.add(egui::Label::new(text).wrap()).on_hover_text(format!("Trust: {}", level.name()));
        }
        ui.add_space(6.0);
        ui.strong("Phases");
        if trial.phases.is_empty() {
            ui.weak("None were found.");
        }
        Grid::new("phases").num_columns(3).spacing([14.0, 3.0]).show(ui, |ui| {
            for span in &trial.phases {
                let name = ui.link(span.phase.name()).on_hover_text("Go to its beginning");
                if name.clicked() {
                    let from_s = span.from_s;
                    actions.push(move |app| app.seek(Seek::To(from_s)));
                }
                ui.monospace(format!("{:.2} s", span.from_s));
                ui.weak(format!("for {:.2} s", span.to_s - span.from_s));
                ui.end_row();
            }
        });
        ui.add_space(6.0);
        facts_ui(ui, trial);
        ui.add_space(6.0);
        if trial.source == TrialSource::Simulated
            && ui.button("Re-simulate this trial").on_hover_text("Take the trial's scene as the live one").clicked()
        {
            let scene = trial.header.scene.clone();
            actions.push(|app| app.set_scene(scene));
        }
    });
}

fn facts_ui(ui: &mut Ui, trial: &OpenTrial) {
    let header = &trial.header;
    let mut facts = vec![
        ("samples", format!("{}, {:.2} s", trial.t_s.len(), trial.span_s()[1] - trial.span_s()[0])),
        ("channels", trial.columns.len().to_string()),
        ("made by", format!("Palpate {}", header.version)),
    ];
    if trial.source == TrialSource::Simulated {
        facts.push(("seed", header.seed.to_string()));
        facts.push(("engine", header.scene.solver.engine.name().to_owned()));
        facts.push(("accuracy", header.scene.solver.accuracy.to_string()));
        facts.push(("peak pressure", format!("{:.2} bar", header.scene.programme.peak_bar)));
    }
    if let Some(own) = &trial.simulated {
        let on: Vec<&str> = own.plan.effects.iter().filter(|effect| effect.on).map(|e| e.name.as_str()).collect();
        facts.push(("effects", if on.is_empty() { "none".to_owned() } else { on.join(", ") }));
    }
    if let Some(collection) = &header.collection {
        facts.push(("collection", collection.clone()));
    }
    Grid::new("facts").num_columns(2).spacing([14.0, 3.0]).show(ui, |ui| {
        for (name, value) in facts {
            ui.weak(name);
            ui.add(egui::Label::new(value).wrap());
            ui.end_row();
        }
    });
}

/// `2026-11-22 16:05` of a time in the store's format.
fn date(created: &str) -> String {
    let shown: String = created.chars().take(16).collect();
    format!("{} UTC", shown.replace('T', " "))
}
