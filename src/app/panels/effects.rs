//! Physical effects: setting, reason, cost, and influence on the grasp. Cost and influence are measured in the background
//! while the panel is open.

use crate::app::actions::Actions;
use crate::app::context::PanelContext;
use crate::app::features::simulation::SimulationAction;
use crate::app::theme::colour;
use egui::{Align, Layout, RichText, ScrollArea, Sense, Ui};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::three_digits;
use palpate_lab::study::{ExplainedEffect, Explanation};
use palpate_lab::workers::{EffectsState, EffectsView};
use palpate_sim::frame::PlannedEffect;
use palpate_sim::scene::{Effect, Scene, Setting};

pub(super) fn ui(ui: &mut Ui, context: &PanelContext<'_>, actions: &mut Actions) {
    if context.effects.asked() != Some(context.scene) {
        actions.push(SimulationAction::MeasureEffects);
    }
    let view = context.effects.view().filter(|view| *view.scene == *context.scene);
    let explanation = match view.as_deref().map(|view| &view.state) {
        Some(EffectsState::Ready(explanation)) => Some(explanation.as_ref()),
        _ => None,
    };
    let mut scene = context.scene.clone();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        state_ui(ui, view.as_deref());
        for effect in Effect::ALL {
            let explained = explanation.and_then(|e| e.effects.iter().find(|e| e.planned.name == effect.name()));
            // Until all is measured, the plan of the current grasp.
            let current = context.snapshot.and_then(|s| s.plan.effects.iter().find(|e| e.name == effect.name()));
            let planned = explained.map(|explained| &explained.planned).or(current);
            effect_ui(ui, context.view.theme, &mut scene, *effect, planned);
            details_ui(ui, planned, explained.zip(explanation));
            ui.add_space(7.0);
        }
    });
    if scene != *context.scene {
        actions.push(SimulationAction::SetScene(Box::new(scene)));
    }
}

/// State of the measurement.
fn state_ui(ui: &mut Ui, view: Option<&EffectsView>) {
    let text = match view.map(|view| &view.state) {
        None | Some(EffectsState::Measuring(_, 0)) => "measuring ..".to_owned(),
        Some(EffectsState::Measuring(done, of)) => format!("measuring .. {done} of {of}"),
        Some(EffectsState::Ready(explanation)) => {
            format!("a grasp takes {} ms of CPU time", three_digits(explanation.cpu_ms))
        }
        Some(EffectsState::Failed(cause)) => cause.to_string(),
    };
    ui.weak(text);
    ui.add_space(4.0);
}

/// Lamp, name and settings.
fn effect_ui(ui: &mut Ui, theme: Theme, scene: &mut Scene, effect: Effect, planned: Option<&PlannedEffect>) {
    let name = effect.name();
    ui.horizontal(|ui| {
        lamp_ui(ui, theme, name, planned.is_some_and(|planned| planned.on));
        ui.strong(name);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            for setting in Setting::ALL.into_iter().rev() {
                let chosen = scene.effects.get(effect) == setting;
                let response = ui.selectable_label(chosen, setting.name());
                let label = format!("{name} {}", setting.name());
                response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, chosen, &label));
                if response.clicked() {
                    scene.effects.set(effect, setting);
                }
            }
        });
    });
}

/// Lamp, lit where the effect is on.
fn lamp_ui(ui: &mut Ui, theme: Theme, name: &str, on: bool) {
    let (rect, response) = ui.allocate_exact_size(egui::vec2(12.0, 12.0), Sense::hover());
    let label = format!("{name} is {}", if on { "on" } else { "off" });
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &label));
    let colours = theme.colours();
    let centre = rect.center();
    if on {
        ui.painter().circle_filled(centre, 4.5, colour(colours.accent));
    }
    let rim = if on { colours.accent } else { colours.quiet_text };
    ui.painter().circle_stroke(centre, 4.5, egui::Stroke::new(1.2, colour(rim)));
    response.on_hover_text(label);
}

/// Reason, cost and influence.
fn details_ui(ui: &mut Ui, planned: Option<&PlannedEffect>, explained: Option<(&ExplainedEffect, &Explanation)>) {
    let quiet = |ui: &mut Ui, text: String| ui.add(egui::Label::new(RichText::new(text).small().weak()).wrap());
    if let Some(planned) = planned {
        let relation = if planned.number > planned.threshold { ">" } else { "≤" };
        let number = three_digits(planned.number);
        let text = format!("{} ({number} {relation} {})", planned.reason, planned.threshold);
        let response = quiet(ui, text);
        if let Some((explained, _)) = explained {
            response.on_hover_text(format!("{}\nNumber: {}.", explained.about, explained.number_is));
        }
    }
    if let Some((explained, explanation)) = explained {
        let small = |ui: &mut Ui, text: String| ui.add(egui::Label::new(RichText::new(text).small()).wrap());
        small(ui, explained.cost_in_words());
        small(ui, explained.change_in_words(explanation.contact_onset_s));
    }
}
