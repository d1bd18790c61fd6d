//! Both pads unrolled at the cursor: the load on every taxel, from the palm down to the tip.

use crate::app::actions::Actions;
use crate::app::heat_map::{colour_bar, load_switch, pad_ui};
use crate::app::shown::DisplayedData;
use crate::app::shown_grasp::{ShownGrasp, shown_pads};
use crate::app::theme::colour;
use egui::{Align2, FontId, Rect, RichText, Sense, Ui, pos2, vec2};
use palpate_geometry::units;

/// Least height of a pad, and most width for its height.
const LOWEST: f32 = 60.0;
const WIDEST: f32 = 0.6;

pub(super) fn ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    let Some(grasp) = ShownGrasp::of(data) else {
        ui.label(RichText::new(ShownGrasp::missing(data)).weak());
        return;
    };
    let (theme, unit) = (data.view.theme, data.view.load_unit);
    let shown = shown_pads(ui, "pads", &grasp, unit);
    let [map, _] = &*shown.maps;
    let (header, _) = ui.allocate_exact_size(vec2(ui.available_width(), 24.0), Sense::hover());
    let mut switch =
        ui.new_child(egui::UiBuilder::new().max_rect(header).layout(egui::Layout::left_to_right(egui::Align::Center)));
    load_switch(&mut switch, unit, actions);
    colour_bar(ui, theme, header.right_center(), (0.25 * header.width()).clamp(30.0, 160.0), map.scale, &map.unit);
    let colours = theme.colours();
    let (ink, quiet, font) = (colour(colours.text), colour(colours.quiet_text), FontId::proportional(11.5));
    let room = ui.available_rect_before_wrap();
    let height = (room.height() - 46.0).max(LOWEST);
    let gutter = 44.0;
    let width = (0.5 * (room.width() - gutter - 28.0)).clamp(16.0, WIDEST * height);
    let (rect, _) = ui.allocate_exact_size(vec2(room.width(), height + 46.0), Sense::hover());
    let begin = rect.center().x - 0.5 * (2.0 * width + 28.0 + gutter) + gutter;
    let top = rect.top() + 16.0;
    for (side, pad) in grasp.pads().iter().enumerate() {
        let left = begin + side as f32 * (width + 28.0);
        let place = Rect::from_min_size(pos2(left, top), vec2(width, height));
        ui.painter().text(
            pos2(place.center().x, rect.top() + 7.0),
            Align2::CENTER_CENTER,
            &shown.maps[side].title,
            font.clone(),
            ink,
        );
        pad_ui(ui, theme, place, &shown, side, &pad.about(&shown.maps[side].title));
        let below = place.center_bottom() + vec2(0.0, 3.0);
        ui.painter().text(below, Align2::CENTER_TOP, pad.force_text(), font.clone(), ink);
        if let Some(peak) = pad.peak_text() {
            ui.painter().text(below + vec2(0.0, 13.0), Align2::CENTER_TOP, peak, font.clone(), quiet);
        }
    }
    let axis = &map.y;
    for share in [0.0, 0.5, 1.0] {
        let y = top + height * share;
        let value = axis.range[0] + (axis.range[1] - axis.range[0]) * f64::from(share);
        let align = [Align2::RIGHT_TOP, Align2::RIGHT_CENTER, Align2::RIGHT_BOTTOM][(2.0 * share) as usize];
        let text = match share {
            0.0 => "palm".to_owned(),
            1.0 => "tip".to_owned(),
            _ => units::shown(value, &axis.unit),
        };
        ui.painter().text(pos2(begin - 6.0, y), align, text, font.clone(), quiet);
    }
}
