//! Heat maps in the window: crisp cells, a colour bar with unit, and the value under the pointer. The values are those of
//! [`HeatMap`], from which figures are drawn as well.

use crate::app::actions::Actions;
use crate::app::theme::{colour, veil};
use crate::app::widgets::{capital, choice_ui};
use egui::emath::GuiRounding as _;
use egui::{
    Align2, Color32, ColorImage, FontId, Pos2, Rect, Response, Sense, Stroke, TextureFilter, TextureHandle,
    TextureOptions, Ui, WidgetInfo, pos2, vec2,
};
use palpate_geometry::drawing::{CellAxis, ColourScale, HeatMap};
use palpate_geometry::palette::Theme;
use palpate_geometry::units::{SPACE, mark, shown as with_unit, symbol};
use palpate_lab::inspection::PhaseSpan;
use palpate_lab::picture::LoadUnit;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Width of the margin with the names of rows, and height of a line of text (points).
const GUTTER: f32 = 38.0;
const LINE: f32 = 15.0;
/// Distance between the maps of both fingers (points).
const BETWEEN: f32 = 3.0;
/// Least height of a map over time (points).
const LOWEST: f32 = 10.0;
/// Distance between the strokes of a hatching (points).
const STROKES: f32 = 7.0;

/// Maps of both fingers, ready to be drawn.
#[derive(Clone)]
pub(super) struct ShownMaps {
    pub(super) maps: Arc<[HeatMap; 2]>,
    textures: [TextureHandle; 2],
}

/// Contents of maps: while they stay the same nothing is made again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MapsKey {
    /// Identity of the first and of the last frame.
    pub(super) frames: [usize; 2],
    /// Number of frames.
    pub(super) count: usize,
    /// Unit of the values.
    pub(super) unit: &'static str,
    /// Most columns and rows.
    pub(super) most: [usize; 2],
}

/// Maps made for `key`, or the same as before where the key is.
pub(super) fn shown_maps(ui: &Ui, name: &'static str, key: MapsKey, make: impl FnOnce() -> [HeatMap; 2]) -> ShownMaps {
    let id = egui::Id::unique(("heat maps", name));
    let known = ui.data(|data| data.get_temp::<(MapsKey, ShownMaps)>(id)).filter(|(known, _)| *known == key);
    if let Some((_, shown)) = known {
        return shown;
    }
    let maps = make().map(|map| map.at_most(key.most[0], key.most[1]));
    let textures = [0, 1].map(|k| ui.ctx().load_texture(format!("{name} {k}"), image(&maps[k]), CRISP));
    let shown = ShownMaps { maps: Arc::new(maps), textures };
    ui.data_mut(|data| data.insert_temp(id, (key, shown.clone())));
    shown
}

/// Cells keep their edges; cells smaller than a pixel blend.
const CRISP: TextureOptions = TextureOptions {
    magnification: TextureFilter::Nearest,
    minification: TextureFilter::Linear,
    ..TextureOptions::NEAREST
};

/// A pixel for each cell; none where the value is undefined.
fn image(map: &HeatMap) -> ColorImage {
    let pixel = |value: &f32| map.scale.colour(*value).map_or(Color32::TRANSPARENT, colour);
    let [width, height] = [map.x.count, map.y.count];
    if map.values.is_empty() || width * height != map.values.len() {
        return ColorImage::filled([1, 1], Color32::TRANSPARENT);
    }
    ColorImage::new([width, height], map.values.iter().map(pixel).collect())
}

/// Bar of the colours of a scale with the values at its ends and its unit, to the left of `right`, centred on that height.
/// Returns its left end.
pub(super) fn colour_bar(ui: &Ui, theme: Theme, right: Pos2, width: f32, scale: ColourScale, unit: &str) -> f32 {
    const HEIGHT: f32 = 8.0;
    let ink = colour(theme.colours().quiet_text);
    let font = FontId::proportional(11.5);
    let [low, high] = scale.limits().map(|value| mark(f64::from(value)));
    let painter = ui.painter();
    let end = painter.text(right, Align2::RIGHT_CENTER, format!("{high}{SPACE}{}", symbol(unit)), font.clone(), ink);
    let bar = Rect::from_min_size(pos2(end.left() - 4.0 - width, right.y - 0.5 * HEIGHT), vec2(width, HEIGHT));
    let [from, to] = scale.limits();
    let steps = width.max(1.0) as usize;
    for k in 0..steps {
        let value = from + (to - from) * (k as f32 + 0.5) / steps as f32;
        let x = |k: usize| bar.left() + width * k as f32 / steps as f32;
        // Whole pixels leave no seam between two.
        let cell = Rect::from_x_y_ranges(x(k)..=x(k + 1), bar.y_range());
        painter.rect_filled(
            cell.round_to_pixels(painter.pixels_per_point()),
            0.0,
            scale.colour(value).map_or(Color32::TRANSPARENT, colour),
        );
    }
    painter.text(pos2(bar.left() - 4.0, right.y), Align2::RIGHT_CENTER, low, font, ink).left()
}

/// Draws the cells of one map into a rectangle: all of them, or those in a range of the horizontal axis.
fn cells(ui: &Ui, theme: Theme, rect: Rect, (map, texture): (&HeatMap, &TextureHandle), shown: [f64; 2]) {
    let [from, to] = map.x.range;
    let x = |value: f64| rect.left() + rect.width() * ((value - shown[0]) / (shown[1] - shown[0])) as f32;
    let all = Rect::from_x_y_ranges(x(from)..=x(to), rect.y_range());
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    if map.values.iter().any(|value| value.is_nan()) {
        hatch(&painter, all.intersect(rect), veil(theme.colours().quiet_text, 0.5));
    }
    painter.image(texture.id(), all, Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)), Color32::WHITE);
    let edge = Stroke::new(1.0, colour(theme.colours().border));
    ui.painter().rect_stroke(rect, 0.0, edge, egui::StrokeKind::Outside);
    if map.x.is_cut() {
        tear(ui, theme, rect.left_bottom(), rect.left_top());
    } else if map.y.is_cut() {
        tear(ui, theme, rect.left_top(), rect.right_top());
    }
}

/// Width and depth of a tooth of a cut (points).
const TOOTH: [f32; 2] = [8.0, 4.0];

/// Tears an edge of a map off, from one corner to another with the map to the right: what is beyond is left out.
fn tear(ui: &Ui, theme: Theme, from: Pos2, to: Pos2) {
    let count = ((to - from).length() / TOOTH[0]).round().max(1.0);
    let (along, inward) = ((to - from) / count, TOOTH[1] * (to - from).normalized().rot90());
    let (ground, edge) = (ui.visuals().panel_fill, Stroke::new(1.0, colour(theme.colours().quiet_text)));
    for k in 0..count as u32 {
        let [low, high] = [from + along * k as f32, from + along * (k + 1) as f32];
        let tip = low + 0.5 * along - inward;
        ui.painter().add(egui::Shape::convex_polygon(
            vec![low + inward, low, tip, high, high + inward],
            ground,
            Stroke::NONE,
        ));
        ui.painter().line(vec![low, tip, high], edge);
    }
}

/// Hatches what has no value.
fn hatch(painter: &egui::Painter, rect: Rect, shade: Color32) {
    let painter = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    let mut foot = rect.left() - rect.height();
    while foot < rect.right() {
        let ends = [pos2(foot, rect.bottom()), pos2(foot + rect.height(), rect.top())];
        painter.line_segment(ends, Stroke::new(1.0, shade));
        foot += STROKES;
    }
}

/// One pad unrolled, the tip to the right. Returns the response of its rectangle, whose name is `about`.
pub(super) fn pad_ui(ui: &Ui, theme: Theme, rect: Rect, shown: &ShownMaps, side: usize, about: &str) -> Response {
    let map = &shown.maps[side];
    cells(ui, theme, rect, (map, &shown.textures[side]), map.x.range);
    let response = ui.interact(rect, egui::Id::unique(("pad", ui.scope_id(), side)), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, about));
    let Some(at) = response.hover_pos() else { return response };
    let share = (at - rect.min) / rect.size();
    let cell = |share: f32, count: usize| ((share * count as f32) as usize).min(count.saturating_sub(1));
    let text = if map.values.len() > 1 {
        map.text(cell(share.y, map.y.count), cell(share.x, map.x.count))
    } else {
        about.to_owned()
    };
    response.on_hover_text_at_pointer(text)
}

/// Maps of both fingers over time, one above the other.
pub(super) struct OverTime<'a> {
    pub(super) theme: Theme,
    pub(super) shown: &'a ShownMaps,
    /// Time shown (s).
    pub(super) time: [f64; 2],
    pub(super) cursor_s: Option<f64>,
    /// Phases of the grasp.
    pub(super) phases: &'a [PhaseSpan],
    /// Phases are named above the maps.
    pub(super) names: bool,
    /// Seconds stand below the maps.
    pub(super) seconds: bool,
}

/// Width of the cells of maps over time, in a panel of that width (points).
pub(super) fn cells_width(width: f32) -> f32 {
    (width - GUTTER - 6.0).max(20.0)
}

/// Height of maps over time beside their cells (points).
pub(super) fn height_beside(names: bool, seconds: bool) -> f32 {
    LINE * (1.0 + f32::from(u8::from(names)) + f32::from(u8::from(seconds))) + BETWEEN + 6.0
}

/// Draws them, `height` points high. Returns the time that was clicked or dragged to.
pub(super) fn over_time_ui(ui: &mut Ui, over_time: &OverTime<'_>, height: f32) -> Option<f64> {
    let OverTime { theme, shown, time, cursor_s, phases, names, seconds } = *over_time;
    let colours = theme.colours();
    let (ink, quiet, font) = (colour(colours.text), colour(colours.quiet_text), FontId::proportional(11.5));
    let each = (0.5 * (height - height_beside(names, seconds))).max(LOWEST);
    let size = vec2(ui.available_width(), height_beside(names, seconds) + 2.0 * each);
    let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
    let first = &shown.maps[0];
    let room = rect.left() + GUTTER..=rect.left() + GUTTER + cells_width(rect.width());
    let width = room.end() - room.start();
    let middle = pos2(*room.end(), rect.top() + 0.5 * LINE);
    let bar_left = colour_bar(ui, theme, middle, (0.22 * width).clamp(30.0, 120.0), first.scale, &first.unit);
    let title = ui.painter().with_clip_rect(Rect::everything_left_of(bar_left - 6.0).intersect(ui.clip_rect()));
    title.text(pos2(rect.left(), middle.y), Align2::LEFT_CENTER, capital(&first.quantity), font.clone(), ink);
    let mut top = rect.top() + LINE + 2.0;
    let x = |t: f64| room.start() + width * ((t - time[0]) / (time[1] - time[0])) as f32;
    if names {
        phase_names(ui, phases, &room, &x, (top + 0.5 * LINE, quiet, &font));
        top += LINE;
    }
    let mut wanted = None;
    let strips = [0, 1].map(|k| {
        let strip_top = top + k as f32 * (each + BETWEEN);
        Rect::from_x_y_ranges(room.clone(), strip_top..=strip_top + each)
    });
    for (side, strip) in strips.into_iter().enumerate() {
        let map = &shown.maps[side];
        cells(ui, theme, strip, (map, &shown.textures[side]), time);
        row_names(ui, strip, map, quiet, &font);
        let painter = ui.painter().with_clip_rect(strip.intersect(ui.clip_rect()));
        for span in phases.iter().skip(1).filter(|span| span.from_s > time[0]) {
            line(&painter, x(span.from_s), strip, 1.0, [veil(colours.background, 0.5), veil(colours.text, 0.75)]);
        }
        if let Some(cursor) = cursor_s {
            line(&painter, x(cursor), strip, 1.6, [colour(colours.background), colour(colours.accent)]);
        }
        let id = egui::Id::unique(("over time", ui.scope_id(), &map.quantity, side));
        let response = ui.interact(strip, id, Sense::click_and_drag());
        let cursor = cursor_s.map(|t| format!(", cursor at {}", with_unit(t, "s"))).unwrap_or_default();
        let name = format!("{} over time, {} finger{cursor}", capital(&map.quantity), map.title);
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, &name));
        let pointer = response.interact_pointer_pos().or(response.hover_pos());
        let at = pointer.map(|at| time[0] + (time[1] - time[0]) * f64::from((at.x - room.start()) / width));
        if response.clicked() || response.dragged() {
            wanted = at.map(|t| t.clamp(time[0], time[1]));
        }
        if let (Some(t), Some(pointer)) = (at, response.hover_pos())
            && let Some(column) = map.x.cell(t)
        {
            let row = ((pointer.y - strip.top()) / each * map.y.count as f32) as usize;
            response.on_hover_text_at_pointer(format!("{}, {}", map.title, map.text(row.min(map.y.count - 1), column)));
        }
    }
    if seconds {
        let axis = first.x.plot_axis();
        let below = strips[1].bottom() + 2.0;
        for (t, text) in axis.marks(&(time[0]..=time[1])) {
            ui.painter().vline(x(t), below - 2.0..=below + 1.0, Stroke::new(1.0, quiet));
            let near_end = x(t) > room.end() - 14.0;
            let (place, align) = if near_end { (*room.end(), Align2::RIGHT_TOP) } else { (x(t), Align2::CENTER_TOP) };
            let text = if text.is_empty() { text } else { format!("{text}{SPACE}s") };
            ui.painter().text(pos2(place, below), align, text, font.clone(), quiet);
        }
    }
    wanted
}

/// An upright line with a rim on both sides, so that it is seen on any colour.
fn line(painter: &egui::Painter, x: f32, strip: Rect, width: f32, [rim, ink]: [Color32; 2]) {
    painter.vline(x, strip.y_range(), Stroke::new(width + 2.0, rim));
    painter.vline(x, strip.y_range(), Stroke::new(width, ink));
}

/// First place along the finger that is shown: the palm, or how far it is off.
pub(super) fn begin_of(axis: &CellAxis) -> String {
    if axis.is_cut() { format!("{:.0}{SPACE}{}", axis.range[0], axis.unit) } else { "palm".to_owned() }
}

/// Side of the finger, and its ends where there is room.
fn row_names(ui: &Ui, strip: Rect, map: &HeatMap, ink: Color32, font: &FontId) {
    let at = |y: f32, align: Align2, text: &str| {
        ui.painter().text(pos2(strip.left() - 5.0, y), align, text, font.clone(), ink);
    };
    at(strip.center().y, Align2::RIGHT_CENTER, &map.title);
    if strip.height() > 3.2 * LINE && map.y.count > 1 {
        at(strip.top(), Align2::RIGHT_TOP, &begin_of(&map.y));
        at(strip.bottom(), Align2::RIGHT_BOTTOM, "tip");
    }
}

/// Names of the phases where they begin, as far as they fit.
fn phase_names(
    ui: &Ui,
    phases: &[PhaseSpan],
    room: &RangeInclusive<f32>,
    x: &impl Fn(f64) -> f32,
    (y, ink, font): (f32, Color32, &FontId),
) {
    let mut free = *room.start();
    for (k, span) in phases.iter().enumerate() {
        let galley = ui.painter().layout_no_wrap(span.phase.name().to_owned(), font.clone(), ink);
        let from = x(span.from_s).max(*room.start());
        // A name never reaches into the next phase.
        let end = phases.get(k + 1).map_or(*room.end(), |next| x(next.from_s).min(*room.end()));
        if from < free || from + galley.size().x > end {
            continue;
        }
        free = from + galley.size().x + 6.0;
        ui.painter().galley(pos2(from, y - 0.5 * galley.size().y), galley, ink);
    }
}

/// Switch between kPa and N.
pub(super) fn load_switch(ui: &mut Ui, unit: LoadUnit, actions: &mut Actions) {
    ui.spacing_mut().item_spacing.x = 4.0;
    let abouts = [(LoadUnit::Pressure, "Loads as pressure"), (LoadUnit::Force, "Loads as force")];
    if let Some(unit) = choice_ui(ui, Some(unit), abouts.map(|(unit, about)| (unit, unit.symbol(), about))) {
        actions.push(move |app| app.view.load_unit = unit);
    }
}
