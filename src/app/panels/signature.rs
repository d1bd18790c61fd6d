//! Signature of a grasp as two heat maps over time: bending of every joint, and load on every row of taxels, of both
//! fingers. A click or drag moves the cursor.

use crate::app::actions::Actions;
use crate::app::features::view::ViewSource;
use crate::app::heat_map::{OverTime, cells_width, height_beside, load_switch, over_time_ui};
use crate::app::playback::Seek;
use crate::app::shown::DisplayedData;
use crate::app::shown_grasp::{MAP_COLUMNS, ShownGrasp, shown_joints, shown_rows};
use crate::app::widgets::choice_ui;
use egui::{RichText, ScrollArea, Ui, vec2};
use palpate_geometry::units;
use palpate_lab::inspection::{FigureOptions, HeatKind};
use palpate_lab::picture::BendUnit;

pub(super) fn ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let Some(grasp) = ShownGrasp::of(data).filter(ShownGrasp::has_course) else {
        ui.add(egui::Label::new(RichText::new(ShownGrasp::missing(data)).weak()).wrap());
        return;
    };
    let (load_unit, bend_unit) = (data.view.load_unit, data.view.bend_unit);
    ui.horizontal(|ui| {
        load_switch(ui, load_unit, actions);
        ui.separator();
        let abouts = [(BendUnit::Angle, "Bending as joint angle"), (BendUnit::Curvature, "Bending as curvature")];
        let units = abouts.map(|(unit, about)| (unit, units::symbol(unit.symbol()), about));
        if let Some(unit) = choice_ui(ui, Some(bend_unit), units) {
            actions.push(move |app| app.view.bend_unit = unit);
        }
        if data.source == ViewSource::Trial {
            ui.separator();
            for (heat, name) in
                [(HeatKind::Joints(bend_unit), "Export joints"), (HeatKind::Pads(load_unit), "Export pads")]
            {
                if ui.small_button(name).on_hover_text("Export this heat map as SVG or PNG").clicked() {
                    let options = FigureOptions { heat: Some(heat), ..FigureOptions::default() };
                    actions.push(|app| app.export_figure(options));
                }
            }
        }
    });
    ui.spacing_mut().item_spacing = vec2(0.0, 0.0);
    let time = grasp.time_shown();
    // As many columns as pixels at least, so that no peak falls between two of them.
    let share = (time[1] - time[0]) / (grasp.span_s[1] - grasp.span_s[0]).max(1e-9);
    let pixels = f64::from(cells_width(ui.available_width()) * ui.ctx().pixels_per_point());
    let columns = ((pixels / share.max(1e-3)) as usize).clamp(1, MAP_COLUMNS);
    let parts = [(true, false), (false, true)];
    let beside: f32 = parts.iter().map(|(names, seconds)| height_beside(*names, *seconds)).sum();
    let each = 0.5 * (ui.available_height() - beside);
    // No more rows than pixels either: a contact of one row at the tip is seen in a low panel too.
    let rows = ((0.5 * each * ui.ctx().pixels_per_point()).floor() as usize).max(1);
    let most = [columns, rows];
    let maps = [shown_joints(ui, &grasp, bend_unit, most), shown_rows(ui, &grasp, load_unit, most)];
    // A low panel scrolls.
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for (shown, (names, seconds)) in maps.iter().zip(parts) {
            let over_time = OverTime {
                theme: data.view.theme,
                shown,
                time,
                cursor_s: Some(grasp.cursor_s),
                phases: &grasp.phases,
                names,
                seconds,
            };
            if let Some(t) = over_time_ui(ui, &over_time, height_beside(names, seconds) + each) {
                actions.push(move |app| app.seek(Seek::To(t)));
            }
        }
    });
}
