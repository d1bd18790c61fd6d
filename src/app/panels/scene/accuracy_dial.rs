//! Accuracy: a tolerance by name or as a number, with its measured cost and error, and what others would cost.

use super::choice;
use crate::app::actions::Actions;
use crate::app::features::simulation::SimulationFeature;
use crate::app::theme::{self, colour};
use crate::app::widgets::number_field;
use egui::{Label, Slider, Ui};
use palpate_geometry::units::{SPACE, symbol, three_digits, two_digits};
use palpate_lab::workers::Command;
use palpate_sim::scene::{Accuracy, EngineKind, IntegrationMethod, Integrator, Scene};

/// First tolerance.
const FIRST_TOLERANCE: f64 = 1e-5;
/// Range of the slider. Above it, the longest step is the time between samples; below it, a grasp takes longer to compute
/// than it lasts.
const SLIDER: std::ops::RangeInclusive<f64> = 1e-7..=1e-2;

/// Rows of a grid of two columns.
pub(super) fn rows(ui: &mut Ui, scene: &mut Scene, simulation: &SimulationFeature, actions: &mut Actions) {
    steps_row(ui, scene);
    tolerance_row(ui, scene);
    method_row(ui, scene);
    band_row(ui, simulation, actions);
    measured_rows(ui, simulation);
}

fn steps_row(ui: &mut Ui, scene: &mut Scene) {
    let accuracy = &mut scene.solver.accuracy;
    let tolerance = accuracy.tolerance().unwrap_or(FIRST_TOLERANCE);
    let all = [
        (Accuracy::Draft, "draft, 1e-3"),
        (Accuracy::Standard, "standard, 1e-4"),
        (Accuracy::Reference, "reference, 1e-6"),
        (Accuracy::Tolerance(tolerance), "own tolerance"),
    ];
    choice(ui, "accuracy", accuracy, &all);
}

fn tolerance_row(ui: &mut Ui, scene: &mut Scene) {
    let Some(mut tolerance) = scene.solver.accuracy.tolerance() else { return };
    let label = ui.label("tolerance").on_hover_text(
        "Largest estimated error of a step: angles in radians, positions as a share of the finger's length",
    );
    let slider = Slider::new(&mut tolerance, SLIDER)
        .logarithmic(true)
        .clamping(egui::SliderClamping::Edits)
        .custom_formatter(|value, _| format!("{value:.0e}"))
        .custom_parser(|text| text.trim().parse().ok());
    // Fits a narrow panel together with its number.
    ui.spacing_mut().slider_width = 60.0;
    if number_field(ui, "tolerance", slider).labelled_by(label.id).changed() {
        // A tolerance has one digit.
        let rounded = format!("{tolerance:.0e}").parse().unwrap_or(tolerance);
        scene.solver.accuracy = Accuracy::Tolerance(rounded);
    }
    ui.end_row();
}

fn method_row(ui: &mut Ui, scene: &mut Scene) {
    let all = [
        (Integrator::Auto, "automatic"),
        (Integrator::Euler, "Euler, 1st order"),
        (Integrator::Sdirk2, "SDIRK2, 2nd order"),
    ];
    choice(ui, "method", &mut scene.solver.integrator, &all);
}

fn band_row(ui: &mut Ui, simulation: &SimulationFeature, actions: &mut Actions) {
    let mut shown = simulation.snapshot.as_ref().is_some_and(|snapshot| snapshot.status.error_band);
    let label = ui.label("error band").on_hover_text(
        "Estimate the numerical error from a finer simulation, and show it in the plots. Restarts the grasp",
    );
    if ui.add(egui::Checkbox::without_text(&mut shown)).labelled_by(label.id).changed() {
        actions.push(move |app| app.simulation.send(Command::SetErrorBand(shown)));
    }
    ui.end_row();
}

/// Cost and error of the accuracy, once measured.
fn measured_rows(ui: &mut Ui, simulation: &SimulationFeature) {
    let measured = simulation.accuracy.as_ref().filter(|measured| measured.scene == simulation.scene);
    let mut row = |name: &str, value: Option<String>, hover: &str| {
        ui.label(name).on_hover_text(hover);
        match value {
            Some(text) => ui.add(Label::new(text).wrap()),
            None => ui.weak("measuring …"),
        };
        ui.end_row();
    };
    let cost = measured.map(|m| &m.cost);
    let at_reference = cost.and_then(|cost| Some((cost.cpu_ms, reference_factor(simulation)?)));
    row("cost", cost.map(|c| format!("{} ms CPU", three_digits(c.cpu_ms))), "CPU time of a grasp on one thread");
    row("", cost.map(|c| format!("{}× real time", three_digits(c.times_real_time))), "Simulated time over CPU time");
    if simulation.scene.solver.accuracy != Accuracy::Reference {
        let text =
            at_reference.map(|(ms, factor)| format!("≈ {} ms, {}×", two_digits(ms * factor), two_digits(factor)));
        row("reference", text, "CPU time of a grasp at accuracy reference, from the stored study (panel Accuracy)");
    }
    let hover = "Estimated numerical error over the grasp (RMS)";
    let error = |size: f64, unit: &str, share: f64| {
        format!("{}{SPACE}{}, {}{SPACE}%", two_digits(size), symbol(unit), short_percent(share))
    };
    let errors = cost.map(|c| &c.error);
    row("± curvature", errors.map(|e| error(e.curvature_per_m, "1/m", e.curvature_share)), hover);
    row("± pressure", errors.map(|e| error(e.pressure_pa * 1e-3, "kPa", e.pressure_share)), hover);
    row("± force", errors.map(|e| error(e.force_n, "N", e.force_share)), hover);
    if cost.is_some_and(|cost| cost.persists) {
        let warning = colour(theme::of(ui).colours().warning);
        ui.colored_label(warning, "stick-slip").on_hover_text(STICK_SLIP);
        ui.colored_label(warning, "no step removes it").on_hover_text(STICK_SLIP);
        ui.end_row();
    }
}

/// Explanation of an error that stays.
const STICK_SLIP: &str = "A hundredth of the tolerance does not reduce the error: the object sticks or slips, or rolls one \
                          way or the other, by differences that no real grasp repeats. A finer accuracy costs time and \
                          gains nothing.";

/// CPU time at `reference` over that of the scene's accuracy, from the stored study.
fn reference_factor(simulation: &SimulationFeature) -> Option<f64> {
    let (study, solver) = (simulation.stored_accuracy.as_ref()?, &simulation.scene.solver);
    if solver.engine != EngineKind::Palpate || solver.method() != IntegrationMethod::Sdirk2 {
        return None;
    }
    study.times_tolerance(
        Accuracy::Reference.step_tolerance(),
        solver.accuracy.step_tolerance(),
        simulation.scene.holds_object(),
    )
}

/// A share in percent, in four characters at most: the panel is narrow.
fn short_percent(share: f64) -> String {
    match 100.0 * share {
        percent if percent < 0.1 => "<0.1".to_owned(),
        percent if percent < 10.0 => format!("{percent:.1}"),
        percent => two_digits(percent),
    }
}
