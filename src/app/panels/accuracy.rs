//! What accuracy costs: the picture of the stored study. Each point is a setting; a click adopts it.

use crate::app::actions::Actions;
use crate::app::features::simulation::SimulationFeature;
use crate::app::figure_plot::{self, ShownPlot};
use crate::app::theme::{self, colour};
use egui::{Button, Pos2, RichText, ScrollArea, Tooltip, Ui};
use palpate_geometry::drawing::Plot;
use palpate_geometry::units::{symbol, three_digits};
use palpate_sim::scene::Scene;
use palpate_study::accuracy::{
    AccuracySetting, AccuracyStudy, GroupCost, SceneGroup, SettingFamily, Spread, accuracy_plot,
};

pub(super) fn ui(ui: &mut Ui, simulation: &SimulationFeature, actions: &mut Actions) {
    let group = SceneGroup::of(simulation.scene.holds_object());
    let Some(study) = &simulation.stored_accuracy else {
        ui.weak("The stored study cannot be read.");
        return;
    };
    let held = if simulation.scene.holds_object() { "fixed" } else { "free" };
    let (shapes, poses) = (study.objects.len(), study.poses);
    ui.weak(format!("stored study: {held} objects, {shapes} shapes, {poses} poses"))
        .on_hover_text("palpate study accuracy; palpate help accuracy has its tables");
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let plot = accuracy_plot(study, group);
        figure_plot::legend_ui(ui, theme::of(ui), plot.series.iter());
        let height = (ui.available_height() - FRONT_HEIGHT).max(LEAST_HEIGHT);
        let roomy = height > ROOM_FOR_LABELS;
        let labelled = |label: &str| roomy && (label.contains("(default)") || ["draft", "reference"].contains(&label));
        let shown = figure_plot::show(ui, theme::of(ui), ("error against CPU time", &plot), height, false, labelled);
        shown.response.widget_info(|| {
            let text = format!("Error against CPU time, {} settings", study.rows.len());
            egui::WidgetInfo::labeled(egui::Role::Figure, true, text)
        });
        mark_current(ui, simulation, study, group, (&plot, &shown));
        pointed_ui(ui, simulation, study, group, (&plot, &shown), actions);
        front_ui(ui, simulation, study, group, actions);
    });
}

/// Room for the buttons below the plot, and the least height of the plot (points).
const FRONT_HEIGHT: f32 = 62.0;
const LEAST_HEIGHT: f32 = 130.0;
/// Radius of the ring around the setting of the scene: its label begins beside it (points).
const RING: f32 = 5.0;
/// Height from which on points have labels.
const ROOM_FOR_LABELS: f32 = 200.0;

/// All settings with their cost in this group.
fn settings(study: &AccuracyStudy, group: SceneGroup) -> impl Iterator<Item = (&AccuracySetting, &GroupCost)> {
    SettingFamily::ALL.into_iter().flat_map(move |family| study.family(family, group))
}

/// True where adopting a setting would change nothing.
fn is_current(setting: &AccuracySetting, scene: &Scene) -> bool {
    setting.adopted(scene).is_ok_and(|adopted| adopted == *scene)
}

/// Rings the setting of the scene.
fn mark_current(
    ui: &Ui,
    simulation: &SimulationFeature,
    study: &AccuracyStudy,
    group: SceneGroup,
    (plot, shown): (&Plot, &ShownPlot),
) {
    let stroke = egui::Stroke::new(1.5, colour(theme::of(ui).colours().text));
    // Joints and taxels of the scene belong to every setting of motion.
    let current = settings(study, group).find(|(setting, _)| is_current(setting, &simulation.scene));
    if let Some(place) = current.and_then(|(_, cost)| shown.position(plot, place_of(cost))) {
        ui.painter().with_clip_rect(shown.response.rect).circle_stroke(place, RING, stroke);
    }
}

fn place_of(cost: &GroupCost) -> [f64; 2] {
    [cost.cpu_ms.median, cost.curvature_per_m.median]
}

/// Distance within which the pointer means a point (points).
const NEAR: f32 = 14.0;

/// Tells the setting under the pointer; a click adopts it.
fn pointed_ui(
    ui: &mut Ui,
    simulation: &SimulationFeature,
    study: &AccuracyStudy,
    group: SceneGroup,
    (plot, shown): (&Plot, &ShownPlot),
    actions: &mut Actions,
) {
    let Some(pointer) = shown.response.hover_pos() else { return };
    let distance = |(_, cost): &(&AccuracySetting, &GroupCost)| {
        shown.position(plot, place_of(cost)).map_or(f32::INFINITY, |at: Pos2| at.distance(pointer))
    };
    let nearest = settings(study, group).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let Some((setting, cost)) = nearest.filter(|found| distance(found) < NEAR) else { return };
    let Some(place) = shown.position(plot, place_of(cost)) else { return };
    ui.ctx().set_cursor_icon(egui::CursorIcon::PointingHand);
    // Beside the point at once, without the delay of hints.
    let beside = egui::Rect::from_center_size(place, egui::Vec2::splat(2.0 * NEAR));
    let (ctx, response) = (ui.ctx().clone(), &shown.response);
    Tooltip::always_open(ctx, response.layer_id, response.id, beside).show(|ui| about_ui(ui, setting, cost));
    if response.clicked() {
        adopt(setting, simulation, actions);
    }
}

fn adopt(setting: &AccuracySetting, simulation: &SimulationFeature, actions: &mut Actions) {
    match setting.adopted(&simulation.scene) {
        Ok(scene) => actions.push(|app| app.set_scene(scene)),
        Err(cause) => actions.push(move |app| app.notices.error(cause.to_string())),
    }
}

/// What a setting costs and how accurate it is.
fn about_ui(ui: &mut Ui, setting: &AccuracySetting, cost: &GroupCost) {
    ui.spacing_mut().item_spacing.y = 2.0;
    let small = |ui: &mut Ui, text: String| ui.label(RichText::new(text).small());
    ui.strong(format!("{}, {}", setting.name, setting.family.title()));
    ui.label(RichText::new(setting.on_command_line()).small().monospace());
    let range = |spread: Spread, factor: f64, unit: &str| {
        let [low, median, high] = [spread.low, spread.median, spread.high].map(|v| three_digits(factor * v));
        format!("{median} {} ({low} to {high})", symbol(unit))
    };
    small(ui, format!("CPU {}", range(cost.cpu_ms, 1.0, "ms")));
    let errors = [range(cost.curvature_per_m, 1.0, "1/m"), range(cost.force_n, 1e3, "mN")];
    small(ui, format!("error {}", errors.join(", ")));
    if cost.failed > 0 {
        small(ui, format!("{} of {} grasps fail", cost.failed, cost.grasps));
    }
    ui.label(RichText::new("Click to adopt").small().weak());
}

/// Buttons of the settings on the front, for the keyboard and for small windows.
fn front_ui(
    ui: &mut Ui,
    simulation: &SimulationFeature,
    study: &AccuracyStudy,
    group: SceneGroup,
    actions: &mut Actions,
) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = egui::vec2(4.0, 4.0);
        ui.weak("Pareto front").on_hover_text("No other setting is cheaper and as accurate");
        for (setting, cost) in study.front(group) {
            let current = is_current(setting, &simulation.scene);
            let euler = if setting.family == SettingFamily::Tolerance { "" } else { " Euler" };
            let name = format!("{}{euler}", setting.name);
            let response = ui.add(Button::selectable(current, RichText::new(&name).small()));
            let label = format!("Adopt {name}");
            response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, current, &label));
            if response.on_hover_ui(|ui| about_ui(ui, setting, cost)).clicked() {
                adopt(setting, simulation, actions);
            }
        }
    });
}
