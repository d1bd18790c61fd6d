//! Small pads beside the 3-D view of what no simulation knows, below the legend that gives their colours: one plain field for
//! each pad, as it reads one number.

use crate::app::heat_map::pad_ui;
use crate::app::shown::DisplayedData;
use crate::app::shown_grasp::{ShownGrasp, shown_pads};
use crate::app::theme::colour;
use egui::{Align2, FontId, Rect, Ui, pos2, vec2};
use palpate_geometry::units::SPACE;
use palpate_lab::picture::{LoadUnit, PictureView, legend_room};

/// Least and largest height of a pad, and its width as a share of its height (points).
const HEIGHT: [f32; 2] = [44.0, 132.0];
const WIDTH: f32 = 0.22;
/// Width that each pad has with its number (points).
const EACH: f32 = 54.0;
/// Height of the texts above and below a pad, and of the scale bar at the foot of the picture (points).
const TEXTS: f32 = 34.0;
const SCALE_BAR: f32 = 46.0;
/// A picture whose legends are lower has none (points).
const LEGEND: f32 = 40.0;

/// Width of a view from which on its buttons stand in a row in its upper left corner (points).
pub(super) const BUTTONS: f32 = 490.0;

/// Draws both pads where nothing else is; leaves them out where the view is too small.
pub(super) fn small_pads(ui: &Ui, rect: Rect, data: &DisplayedData<'_>, view: &PictureView) {
    let Some(grasp) = ShownGrasp::beside_fingers(data).filter(|grasp| !grasp.is_simulated()) else { return };
    let legends = legend_room(view);
    let room = rect.height() - legends.y - SCALE_BAR - TEXTS;
    let (right, top) = (rect.right() - 18.0, rect.top() + legends.y);
    // To the left of the legends they would cover the hand.
    if room < HEIGHT[0] || rect.width() < 2.0 * EACH + 90.0 {
        return;
    }
    let theme = data.view.theme;
    let height = (0.3 * rect.height()).clamp(HEIGHT[0], HEIGHT[1]).min(room);
    let size = vec2((WIDTH * height).max(14.0), height);
    let shown = shown_pads(ui, "small pads", &grasp, LoadUnit::Pressure);
    let (ink, font) = (colour(theme.colours().text), FontId::proportional(12.0));
    if legends.y < LEGEND {
        let [_, full] = shown.maps[0].scale.limits();
        let text = format!("0 to {full:.0}{SPACE}kPa");
        ui.painter().text(pos2(right - EACH, top + height + 40.0), Align2::CENTER_CENTER, text, font.clone(), ink);
    }
    for (side, pad) in grasp.pads().iter().enumerate() {
        let middle = right - EACH * (1.5 - side as f32);
        let title = &shown.maps[side].title;
        ui.painter().text(pos2(middle, top + 7.0), Align2::CENTER_CENTER, title, font.clone(), ink);
        let place = Rect::from_min_size(pos2(middle - 0.5 * size.x, top + 16.0), size);
        pad_ui(ui, theme, place, &shown, side, &pad.about(title));
        let below = place.center_bottom() + vec2(0.0, 3.0);
        ui.painter().text(below, Align2::CENTER_TOP, pad.force_text(), font.clone(), ink);
    }
}
