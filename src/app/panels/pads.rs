//! Both pads unrolled at the cursor, the tip to the right: the load on every taxel from the first touched row on.

use crate::app::actions::Actions;
use crate::app::heat_map::{begin_of, colour_bar, load_switch, pad_ui};
use crate::app::shown::DisplayedData;
use crate::app::shown_grasp::{ShownGrasp, shown_pads};
use crate::app::theme::colour;
use egui::{Align2, Color32, FontId, Pos2, Rect, RichText, Sense, Ui, vec2};
use palpate_geometry::units::shown as shown_in;
use palpate_lab::picture::LoadUnit;

/// Width of a panel over its height from which on the pads lie beside each other.
const ABREAST: f32 = 1.8;
/// Least size of a pad, room between two, and that for the texts above and below (points).
const LEAST: egui::Vec2 = vec2(40.0, 24.0);
const BETWEEN: f32 = 12.0;
const TEXTS: f32 = 34.0;
/// Width from which on a pad says from where its place is counted (points).
const WORDY: f32 = 160.0;

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
    let room = ui.available_size();
    // Lying beside each other, or in a narrow panel one below the other.
    let beside = room.x > ABREAST * room.y;
    let count = if beside { vec2(2.0, 1.0) } else { vec2(1.0, 2.0) };
    let size = (room / count - vec2(BETWEEN, TEXTS)).max(LEAST);
    let (rect, _) = ui.allocate_exact_size((size + vec2(BETWEEN, TEXTS)) * count, Sense::hover());
    let say =
        |at: Pos2, align: Align2, text: String, ink: Color32| ui.painter().text(at, align, text, font.clone(), ink);
    for (side, pad) in grasp.pads().iter().enumerate() {
        let title = &shown.maps[side].title;
        let at = if beside { vec2(side as f32, 0.0) } else { vec2(0.0, side as f32) };
        let corner = rect.min + (size + vec2(BETWEEN, TEXTS)) * at + vec2(0.5 * BETWEEN, 15.0);
        let place = Rect::from_min_size(corner, size);
        say(place.left_top() - vec2(0.0, 2.0), Align2::LEFT_BOTTOM, title.clone(), ink);
        let most = shown.maps[side].values.iter().copied().filter(|load| load.is_finite()).reduce(f32::max);
        let peak = match unit {
            LoadUnit::Pressure => pad.peak_text(),
            LoadUnit::Force => most.map(|most| format!("peak {}", shown_in(f64::from(most), "N"))),
        };
        let texts = std::iter::once(pad.force_text()).chain(peak).collect::<Vec<_>>().join(", ");
        say(place.right_top() - vec2(0.0, 2.0), Align2::RIGHT_BOTTOM, texts, ink);
        pad_ui(ui, theme, place, &shown, side, &pad.about(title));
        let begin = match map.x.is_cut() && size.x > WORDY {
            true => format!("{} from the palm", begin_of(&map.x)),
            false => begin_of(&map.x),
        };
        say(place.left_bottom() + vec2(0.0, 3.0), Align2::LEFT_TOP, begin, quiet);
        say(place.right_bottom() + vec2(0.0, 3.0), Align2::RIGHT_TOP, "tip".to_owned(), quiet);
    }
}
