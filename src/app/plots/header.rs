//! Line above a plot: derived curves, raw counts, classes, export, times of cursor and marks.

use crate::app::actions::Actions;
use crate::app::features::view::{Derivation, ViewSource};
use crate::app::shown::DisplayedData;
use crate::app::widgets::adapt_button;
use egui::Ui;
use palpate_lab::inspection::{Alignment, FigureOptions};
use palpate_sim::objects::object_title;

/// Choice of derived curves, and the times of cursor and marks; `uncalibrated` where raw counts stand in for values.
pub(super) fn ui(
    ui: &mut Ui,
    data: &DisplayedData<'_>,
    actions: &mut Actions,
    (id, plotted): (&str, &[&str]),
    (derived, uncalibrated): (Derivation, bool),
) {
    ui.horizontal(|ui| {
        let combo = egui::ComboBox::from_id_salt((id, "derived")).width(96.0);
        let shown = combo.selected_text(egui::RichText::new(derived.name()).small()).show_ui(ui, |ui| {
            for choice in Derivation::ALL {
                if ui.selectable_label(choice == derived, choice.name()).clicked() {
                    let plot = id.to_owned();
                    actions.push(move |app| _ = app.view.derived.insert(plot, choice));
                }
            }
        });
        shown.response.on_hover_text("Values, sum or difference of both fingers, or change over time");
        if uncalibrated {
            let text = egui::RichText::new("not calibrated: raw counts").small().color(ui.visuals().warn_fg_color);
            let about = "Adapt (closes the empty hand once), or calibrate with reference weights and angles";
            ui.label(text).on_hover_text(about);
            if data.source == ViewSource::Gripper {
                adapt_button(ui, data.gripper, data.view.control, actions);
            }
        } else if data.board().is_some() && id != "counts" && id != "line pressure" {
            let mut raw = data.view.raw;
            if ui.checkbox(&mut raw, egui::RichText::new("raw counts").small()).changed() {
                actions.push(move |app| app.view.raw = raw);
            }
        }
        if let Some([first, second]) = plotted.first().and_then(|name| data.bands_for(name)) {
            let mut shown = data.view.class_bands;
            let text = egui::RichText::new("likeliest classes").small();
            let hint = format!(
                "Mean and spread of the two likeliest classes behind the curves: {} blue, {} orange",
                object_title(&first.class),
                object_title(&second.class)
            );
            if ui.checkbox(&mut shown, text).on_hover_text(hint).changed() {
                actions.push(move |app| app.view.class_bands = shown);
            }
        }
        if data.source == ViewSource::Trial {
            let hint = "Export this plot as SVG or PNG, with the trials compared and a caption (Ctrl+E: all plots)";
            if ui.small_button("Export").on_hover_text(hint).clicked() {
                let channel = if id == "line pressure" { "line" } else { id };
                let raw = id == "counts" || data.view.raw || uncalibrated;
                let channels = if raw { Vec::new() } else { vec![channel.to_owned()] };
                let options = FigureOptions { channels, raw, ..FigureOptions::default() };
                actions.push(|app| app.export_figure(options));
            }
        }
        let playback = data.playback;
        let time = |name: &str, t: f64| format!("{name} {t:.3} s");
        let mut times: Vec<String> = Vec::new();
        if let [Some(a), Some(b)] = playback.marks {
            times.push(time("B − A", b - a));
        }
        times.extend(playback.marks.iter().zip(["A", "B"]).rev().filter_map(|(t, name)| Some(time(name, (*t)?))));
        times.extend(playback.cursor_s.map(|t| time("cursor", t)));
        let is_shifted = data.comparison.alignment == Alignment::Contact && !data.comparison.traces.is_empty();
        times.extend(is_shifted.then(|| "others: aligned at contact".to_owned()));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            times.into_iter().for_each(|time| {
                ui.label(egui::RichText::new(time).small());
            });
        });
    });
}
