//! Facts of the stored trial that is open: object, labels, source, quality, phases with their times, and the scene.

use crate::app::actions::Actions;
use crate::app::playback::Seek;
use crate::app::shown::DisplayedData;
use crate::app::theme::colour;
use crate::app::widgets::{capital, chip, words, wrapped};
use egui::{Grid, RichText, ScrollArea, Ui};
use palpate_geometry::palette::Rgb;
use palpate_geometry::units::SPACE;
use palpate_lab::inspection::OpenTrial;
use palpate_lab::workers::LibraryView;
use palpate_sim::frame::TrustLevel;
use palpate_tactile::trial::TrialSource;

pub(super) fn ui(ui: &mut Ui, data: &DisplayedData<'_>, library: Option<&LibraryView>, actions: &mut Actions) {
    let Some(inspected) = data.inspected else {
        ui.weak("No trial is open. Choose one in the library, or press Enter on it.");
        return;
    };
    let trial = inspected.trial;
    let colours = data.view.theme.colours();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.heading(&trial.title);
        labels_ui(ui, trial, library, colours.accent);
        let trust = trial.simulated.as_ref().map(|facts| facts.quality.trust());
        // What the trust says is not said twice.
        let is_said = |remark: &&String| trust.as_ref().is_some_and(|(_, why)| why == *remark);
        for remark in trial.remarks.iter().chain(&trial.header.warnings).filter(|remark| !is_said(remark)) {
            wrapped(ui, RichText::new(capital(remark)).color(colour(colours.warning)));
        }
        if let Some((level, why)) = trust {
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
                ui.monospace(format!("{:.2}{SPACE}s", span.from_s));
                ui.weak(format!("for {:.2}{SPACE}s", span.to_s - span.from_s));
                ui.end_row();
            }
        });
        if let Some(text) = touches_text(trial.touched_s) {
            wrapped(ui, RichText::new(text).weak());
        }
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

/// When each finger touched first.
fn touches_text(touched_s: [Option<f64>; 2]) -> Option<String> {
    let text = |t: Option<f64>| t.map_or_else(|| "never".to_owned(), |t| format!("at {t:.2}{SPACE}s"));
    let [left, right] = touched_s.map(text);
    touched_s.iter().any(Option::is_some).then(|| format!("First contact: left {left}, right {right}"))
}

/// Number and source, and what the library says: local time, tags and note.
fn labels_ui(ui: &mut Ui, trial: &OpenTrial, library: Option<&LibraryView>, ink: Rgb) {
    ui.weak(format!("Trial {}, {}", trial.id, trial.source_title()));
    let followed = library.and_then(|view| Some((view, view.followed.as_ref().filter(|own| own.row.id == trial.id)?)));
    let Some((view, row)) = followed.map(|(view, own)| (view, &own.row)) else { return };
    let utc: String = trial.created.chars().take(16).collect();
    ui.weak(capital(&view.date(&row.local))).on_hover_text(format!("{} UTC", utc.replace('T', " ")));
    if !row.tags.is_empty() {
        ui.horizontal_wrapped(|ui| row.tags.iter().for_each(|tag| _ = chip(ui, tag, ink)));
    }
    if !row.note.is_empty() {
        wrapped(ui, RichText::new(&row.note));
    }
}

fn facts_ui(ui: &mut Ui, trial: &OpenTrial) {
    let header = &trial.header;
    let mut facts = vec![
        ("samples", trial.t_s.len().to_string()),
        ("ends at", format!("{:.2}{SPACE}s", trial.span_s()[1])),
        ("channels", trial.columns.len().to_string()),
        ("made by", format!("Palpate {}", header.version)),
    ];
    if trial.source == TrialSource::Simulated {
        facts.push(("seed", header.seed.to_string()));
        facts.push(("engine", header.scene.solver.engine.name().to_owned()));
        facts.push(("accuracy", header.scene.solver.accuracy.to_string()));
        facts.push(("line pressure", format!("{:.2}{SPACE}bar", header.scene.programme.peak_bar)));
    }
    if let Some(own) = &trial.simulated {
        let on = own.plan.effects.iter().filter(|effect| effect.on);
        let on: Vec<String> = on.map(|effect| words(&effect.name)).collect();
        facts.push(("effects at the start", if on.is_empty() { "none".to_owned() } else { on.join(", ") }));
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
