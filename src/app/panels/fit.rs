//! Finger fit: choose recorded trials, fit the simulated finger to them, see confidence intervals and residuals, and use
//! the fitted finger.

use crate::app::actions::Actions;
use crate::app::features::tools::GripperTools;
use crate::app::plots::static_plot;
use crate::app::theme::{self, colour, veil};
use crate::app::widgets::{failure_ui, job_ui, just_opened, remark_ui, warning_ui, wrapped};
use egui::{Align, Button, Layout, RichText, ScrollArea, Sense, Ui};
use egui_plot::{AxisHints, Line, LineStyle, Plot, PlotPoints};
use palpate_geometry::palette::{Theme, Trace};
use palpate_geometry::units::{self, three_digits};
use palpate_sim::gripper::Side;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_store::TrialRow;
use palpate_study::jobs::FittedFinger;
use palpate_study::{Certainty, Estimate, FingerFit, FingerMotion, Remainder};
use palpate_tactile::trial::TrialId;
use std::collections::BTreeSet;

pub(super) fn ui(ui: &mut Ui, tools: &GripperTools, scene: &Scene, actions: &mut Actions) {
    if just_opened(ui, "fit") {
        actions.push(|app| _ = app.tools.trials.start(()));
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let hint = "Fits the simulated finger to empty closes and grasps of a fixed object.";
        remark_ui(ui, hint);
        let controls = |ui: &mut Ui, actions: &mut Actions| match tools.trials.last().map(|ended| ended.outcome) {
            None => remark_ui(ui, "loading trials …"),
            Some(Ok(rows)) => choice_ui(ui, &rows, actions),
            Some(Err(cause)) => failure_ui(ui, cause),
        };
        match job_ui(ui, &tools.fit, (None, "Cancel; nothing changes", |app| app.tools.fit.stop()), actions, controls) {
            Some(Ok(fitted)) => fitted_ui(ui, scene, &fitted, actions),
            Some(Err(cause)) => failure_ui(ui, cause),
            None => {}
        }
    });
}

/// Height of the list of trials (points).
const LIST: f32 = 132.0;

/// Trials to choose from, and the button that starts.
fn choice_ui(ui: &mut Ui, rows: &[TrialRow], actions: &mut Actions) {
    if rows.is_empty() {
        let text = "No trials of the real gripper yet. Record some, here or with `palpate record`.";
        wrapped(ui, RichText::new(text));
    }
    let id = egui::Id::unique("fit trials");
    let mut chosen = ui.data_mut(|data| data.get_temp::<BTreeSet<TrialId>>(id)).unwrap_or_default();
    chosen.retain(|trial| rows.iter().any(|row| row.id == *trial));
    let height = ui.spacing().interact_size.y;
    ScrollArea::vertical().id_salt("fit trials").max_height(LIST).auto_shrink([false, true]).show_rows(
        ui,
        height,
        rows.len(),
        |ui, shown| {
            for row in rows.iter().skip(shown.start).take(shown.len()) {
                let mut ticked = chosen.contains(&row.id);
                if ui.checkbox(&mut ticked, trial_text(row)).on_hover_text("Time in UTC").changed() {
                    if ticked {
                        chosen.insert(row.id)
                    } else {
                        chosen.remove(&row.id)
                    };
                }
            }
        },
    );
    ui.horizontal_wrapped(|ui| {
        let fit = ui.add_enabled(!chosen.is_empty(), Button::new("Fit"));
        if fit.on_disabled_hover_text("Choose at least one trial").clicked() {
            let trials = chosen.iter().copied().collect();
            actions.push(|app| _ = app.tools.fit.start(trials));
        }
        actions.on(&ui.button("Refresh").on_hover_text("Reload the trials"), |app| _ = app.tools.trials.start(()));
    });
    ui.data_mut(|data| data.insert_temp(id, chosen));
}

fn trial_text(row: &TrialRow) -> String {
    let object = if row.object == EMPTY { "empty close" } else { &row.object };
    let began: String = row.created.replace('T', " ").chars().take(16).collect();
    format!("{}  {object}  {began}", row.id)
}

fn fitted_ui(ui: &mut Ui, now: &Scene, fitted: &FittedFinger, actions: &mut Actions) {
    let FittedFinger { trials, fit, scene, warnings } = fitted;
    ui.add_space(6.0);
    let names: Vec<String> = trials.iter().map(ToString::to_string).collect();
    let plural = if names.len() == 1 { "trial" } else { "trials" };
    wrapped(ui, RichText::new(format!("Fitted to {plural} {}", names.join(", "))).heading());
    ui.horizontal_wrapped(|ui| {
        let in_use = now.gripper == fit.gripper;
        let text = if in_use { "Finger in use" } else { "Use this finger" };
        let hint = "Simulate with the fitted finger from now on";
        if ui.add_enabled(!in_use, Button::new(text)).on_hover_text(hint).clicked() {
            let scene = Scene { gripper: fit.gripper.clone(), ..now.clone() };
            actions.push(|app| {
                app.set_scene(scene);
                app.notices.info("Fitted finger in use.");
            });
        }
        if ui.button("Save as scene …").on_hover_text("Scene of the first trial with this finger, as TOML").clicked()
        {
            let scene = scene.clone();
            actions.push(|app| app.save_scene_as(scene));
        }
    });
    for remark in fit.remarks.iter().chain(warnings) {
        warning_ui(ui, remark);
    }
    estimates_ui(ui, theme::of(ui), &fit.estimates);
    courses_ui(ui, theme::of(ui), fit);
}

/// Least and largest share of the value at which the bars end.
const BAR_ENDS: [f64; 2] = [0.02, 0.5];

/// Each parameter with its interval, in numbers and as a bar about its value.
fn estimates_ui(ui: &mut Ui, theme: Theme, estimates: &[Estimate]) {
    let share = |estimate: &Estimate| [estimate.low, estimate.high].map(|end| end / estimate.value.max(1e-12) - 1.0);
    // Unidentified parameters reach beyond.
    let identified = estimates.iter().filter(|estimate| estimate.known != Certainty::Hardly);
    let widest = identified.flat_map(share).map(f64::abs).fold(0.0, f64::max);
    let end = widest.clamp(BAR_ENDS[0], BAR_ENDS[1]);
    ui.add_space(4.0);
    let text = format!("95 % intervals; bars span ±{:.0} % of the value", 100.0 * end);
    remark_ui(ui, text);
    ui.spacing_mut().interact_size.y = 16.0;
    for estimate in estimates {
        let known = match estimate.known {
            Certainty::Well => theme.colours().accent,
            Certainty::Roughly => theme.colours().warning,
            Certainty::Hardly => theme.colours().error,
        };
        ui.horizontal(|ui| {
            ui.label(name_of(estimate));
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.label(format!("{} {}", three_digits(estimate.value), units::symbol(estimate.unit)));
            });
        });
        ui.horizontal(|ui| {
            bar_ui(ui, share(estimate).map(|share| (share / end) as f32), colour(known), estimate);
            let words = match estimate.known {
                Certainty::Well => "well identified",
                Certainty::Roughly => "roughly identified",
                Certainty::Hardly => "hardly identified",
            };
            let [low, high] = [estimate.low, estimate.high].map(three_digits);
            ui.label(RichText::new(format!("{low} to {high}, {words}")).small().weak());
        });
        ui.add_space(3.0);
    }
}

/// Last part of a scene's key, in plain letters.
fn name_of(estimate: &Estimate) -> String {
    let name = estimate.name.rsplit_once("gripper.").map_or(estimate.name.as_str(), |(_, name)| name);
    let name = name.split_once('.').filter(|(group, _)| !group.contains(' ')).map_or(name, |(_, key)| key);
    name.replace('_', " ").replace("/ bending stiffness", "/ stiffness")
}

/// Interval about the middle: ends as shares of half the width, cut where they go beyond.
fn bar_ui(ui: &mut Ui, [low, high]: [f32; 2], ink: egui::Color32, estimate: &Estimate) {
    let (rect, response) = ui.allocate_exact_size(egui::vec2(96.0, 14.0), Sense::hover());
    let label = format!("{}: {} to {}", name_of(estimate), three_digits(estimate.low), three_digits(estimate.high));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Figure, true, &label));
    let painter = ui.painter_at(rect);
    let x = |share: f32| rect.center().x + share.clamp(-1.0, 1.0) * (0.5 * rect.width() - 2.0);
    painter.vline(x(0.0), rect.y_range(), egui::Stroke::new(1.0, ui.visuals().weak_text_color()));
    painter.hline(x(low)..=x(high), rect.center().y, egui::Stroke::new(2.0, ink));
    for end in [low, high].into_iter().filter(|end| end.abs() <= 1.0) {
        painter.vline(x(end), rect.center().y - 4.0..=rect.center().y + 4.0, egui::Stroke::new(2.0, ink));
    }
    painter.circle_filled(egui::pos2(x(0.0), rect.center().y), 3.5, ink);
}

/// Recorded and fitted curvature over time, and residuals, trial by trial.
fn courses_ui(ui: &mut Ui, theme: Theme, fit: &FingerFit) {
    ui.add_space(6.0);
    remark_ui(ui, "Thick: recorded. Thin: fitted. Dashed: right finger.");
    for (number, left) in fit.remainders.iter().enumerate() {
        wrapped(ui, RichText::new(remainder_text(left)));
        let own = |course: &&FingerMotion| course.name == left.name;
        let courses: Vec<&FingerMotion> = fit.courses.iter().filter(own).collect();
        let recorded = veil(Trace::Curvature.colour(theme), 0.5);
        let thin = colour(theme.colours().text);
        plot(theme, &format!("fitted curvature {number}"), 110.0).show(ui, |plot| {
            for course in &courses {
                plot.line(line(course, &course.recorded, "recorded").color(recorded).width(3.5));
                plot.line(line(course, &course.fitted, "fitted").color(thin).width(1.2));
            }
        });
        wrapped(ui, RichText::new("residual: recorded less fitted").small().weak());
        plot(theme, &format!("residuals {number}"), 70.0).include_y(-0.1).include_y(0.1).show(ui, |plot| {
            for course in &courses {
                let off: Vec<f64> = course.recorded.iter().zip(&course.fitted).map(|(seen, fit)| seen - fit).collect();
                plot.line(line(course, &off, "off").color(colour(Trace::Curvature.colour(theme))).width(1.5));
            }
        });
    }
}

fn remainder_text(left: &Remainder) -> String {
    let force = left.force_share.map_or_else(String::new, |share| format!(", force within {:.1} %", 100.0 * share));
    format!("{}: curvature within {}{force} (RMS)", left.name, units::shown(left.curvature_per_m, "1/m"))
}

fn line<'a>(course: &FingerMotion, values: &[f64], name: &str) -> Line<'a> {
    let points: PlotPoints<'_> = course.t_s.iter().zip(values).map(|(t, value)| [*t, *value]).collect();
    let style = match course.side {
        Side::Left => LineStyle::Solid,
        Side::Right => LineStyle::Dashed { length: 7.0 },
    };
    Line::new(format!("{name} {}", course.side.name()), points).style(style)
}

fn plot(theme: Theme, id: &str, height: f32) -> Plot<'static> {
    let seconds = AxisHints::new_x().formatter(|mark: egui_plot::GridMark, _| format!("{}\u{a0}s", mark.value));
    static_plot(theme, id, height, &units::symbol("1/m"), seconds, 0.0)
}
