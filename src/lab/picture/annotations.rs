//! Annotations of a picture: axis gizmo, scale bar, legend of the pressure map, and a badge.

use super::contact_path::PathColour;
use super::{PictureView, ink};
use glam::{Vec2, Vec3};
use palpate_geometry::drawing::{Align, Camera, Overlay, Shape2};
use palpate_geometry::palette::{PRESSURE_MAP, Rgb, Theme};
use palpate_geometry::units::{SPACE, mark};
use palpate_sim::gripper::Side;

/// Distance of annotations from the edges (points).
pub(super) const MARGIN: f32 = 18.0;
/// Height of the scale bar with its distance from the lower edge (points).
pub(super) const SCALE_BAR: f32 = 46.0;
/// Height of its text (points).
const TEXT: f32 = 14.0;
/// Least size of a picture with scale bar and legends (points).
const LEAST_SIZE: Vec2 = Vec2::new(340.0, 150.0);
/// Width of a legend, and its height with its texts (points).
const LEGEND_WIDTH: f32 = 132.0;
const LEGEND_HEIGHT: f32 = 50.0;
/// Greatest length of the scale bar, as a share of the width of the picture.
const SCALE_BAR_SHARE: f32 = 0.16;
/// Room of its text (points).
const LEAST_BAR: f32 = 50.0;
/// Height of the texts in an inset, and of the lowest inset with a scale (points).
const INSET_TEXT: f32 = 12.0;
const INSET_WITH_SCALE: f32 = 76.0;
/// Lengths that the scale bar may stand for (mm).
pub const SCALE_STEPS: [f32; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// Part of a picture that numbers must not cover (points).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plate {
    pub(super) middle: Vec2,
    pub(super) half: Vec2,
}

/// Room of the axes in the lower left corner (points).
const AXES: Vec2 = Vec2::new(96.0, 104.0);

impl Plate {
    pub(super) fn between(low: Vec2, high: Vec2) -> Self {
        Self { middle: 0.5 * (low + high), half: 0.5 * (high - low) }
    }

    /// True where it comes within 4 points of another.
    pub(super) fn meets(&self, other: &Self) -> bool {
        ((self.middle - other.middle).abs() - self.half - other.half).max_element() < 4.0
    }

    /// True where it covers a place.
    pub(super) fn covers(&self, place: Vec2) -> bool {
        ((place - self.middle).abs() - self.half).max_element() < 2.0
    }
}

/// Annotations of a picture as they are added.
pub(super) struct Annotator<'a> {
    pub(super) view: &'a PictureView,
    pub(super) overlay: Overlay,
    /// What is taken already.
    plates: Vec<Plate>,
    /// Points that stay in sight, and those that do where there is room.
    kept: Vec<Vec2>,
    hand: Vec<Vec2>,
}

/// Distance of plates from the edges (points), height of the buttons above them, and of the caption below.
const EDGE: f32 = 10.0;
const HEAD: f32 = 48.0;
const FOOT: f32 = 42.0;
/// Distance of the places that are tried (points).
const STEP: f32 = 6.0;

impl<'a> Annotator<'a> {
    /// Begins with axes, scale bar, legends and badge, where the view has annotations, beside the place of an inset; `hand` is
    /// what plates cover last of all.
    pub(super) fn new(view: &'a PictureView, inset: Option<Plate>, hand: Vec<Vec2>) -> Self {
        let mut overlay = Overlay::default();
        if view.annotations {
            add(&mut overlay, view);
        }
        let (size, legends) = (view.size, legend_room(view));
        let axes = Plate::between(Vec2::new(0.0, size.y - AXES.y), Vec2::new(AXES.x, size.y));
        let legends = Plate::between(Vec2::new(size.x - legends.x, 0.0), Vec2::new(size.x, legends.y));
        let bar = scale_bar(view).map_or(0.0, |(_, length)| length.max(LEAST_BAR));
        let scale_bar = Plate::between(size - Vec2::new(bar + MARGIN, SCALE_BAR), size);
        let plates = [axes, legends, scale_bar].into_iter().chain(inset).collect();
        Self { view, overlay, plates, kept: Vec::new(), hand }
    }

    /// True where a plate would cover nothing.
    fn is_free(&self, plate: &Plate) -> bool {
        !self.plates.iter().any(|taken| plate.meets(taken)) && !self.kept.iter().any(|place| plate.covers(*place))
    }

    /// Keeps a line clear of plates.
    pub(super) fn keep_clear(&mut self, from: Vec2, to: Vec2) {
        let pieces = (from.distance(to) / STEP).ceil().max(1.0);
        self.kept.extend((0..=pieces as u32).map(|k| from.lerp(to, k as f32 / pieces)));
    }

    /// The free place for a plate of that half size: the first one wanted that is free, or else the nearest to that, sooner
    /// on its side of the picture; beside the hand, or over it where it must stand somewhere: `farthest` (points) is infinite.
    /// None where all within that is taken.
    pub(super) fn place(&self, wanted: &[Vec2], half: Vec2, farthest: f32) -> Option<Plate> {
        let low = half + Vec2::new(EDGE, HEAD);
        let high = (self.view.size - half - Vec2::new(EDGE, FOOT)).max(low);
        let first = wanted.first()?.clamp(low, high);
        let count = ((high - low) / STEP).floor().as_uvec2();
        let places = (0..=count.y).flat_map(|y| (0..=count.x).map(move |x| low + STEP * Vec2::new(x as f32, y as f32)));
        let mut near: Vec<Vec2> = places.filter(|place| place.distance(first) <= farthest).collect();
        let middle = 0.5 * self.view.size.x;
        let crosses = |place: &Vec2| (place.x < middle) != (first.x < middle);
        near.sort_by(|a, b| crosses(a).cmp(&crosses(b)).then(a.distance(first).total_cmp(&b.distance(first))));
        let places = || wanted.iter().map(|place| place.clamp(low, high)).chain(near.iter().copied());
        let mut free = places().map(|middle| Plate { middle, half }).filter(|plate| self.is_free(plate));
        let first_free = free.next()?;
        let is_beside = |plate: &Plate| !self.hand.iter().any(|place| plate.covers(*place));
        let beside = std::iter::once(first_free).chain(free).find(is_beside);
        beside.or(Some(first_free).filter(|_| farthest.is_infinite()))
    }

    /// Adds the ground of a text.
    pub(super) fn add_plate(&mut self, plate: Plate) {
        add_ground(&mut self.overlay, self.view.theme, plate.middle, plate.half);
        self.plates.push(plate);
    }
}

/// Adds everything that fits; small pictures get less.
fn add(overlay: &mut Overlay, view: &PictureView) {
    let size = view.size;
    if size.x >= 160.0 && size.y >= 120.0 {
        add_gizmo(overlay, &view.camera, Vec2::new(MARGIN + 26.0, size.y - MARGIN - 26.0), view.theme);
    }
    if shows_legends(view) {
        add_scale_bar(overlay, view, [MARGIN, TEXT], false);
        let full = f64::from(view.full_scale) * 1e-3;
        add_legend(overlay, view, MARGIN, "taxel pressure, kPa", [0.0, full]);
        if let Some(PathColour::Time(span)) = view.path {
            add_legend(overlay, view, MARGIN + LEGEND_HEIGHT, "first touch, s", span.map(f64::from));
        }
    }
    if let Some(badge) = view.badge.as_ref().filter(|_| size.x >= 160.0) {
        add_badge(overlay, badge, view.theme);
    }
}

/// Red x, green y, blue z, as everywhere in robotics; each readable on its theme.
fn axis_colours(theme: Theme) -> [Rgb; 3] {
    match theme {
        Theme::Dark => [Rgb(240, 104, 92), Rgb(122, 200, 96), Rgb(98, 160, 246)],
        Theme::Light => [Rgb(190, 44, 36), Rgb(38, 124, 40), Rgb(30, 90, 190)],
    }
}

fn add_gizmo(overlay: &mut Overlay, camera: &Camera, centre: Vec2, theme: Theme) {
    const LENGTH: f32 = 24.0;
    let [right, up, back] = camera.axes();
    let mut axes: Vec<(Vec3, Rgb, &str)> = [Vec3::X, Vec3::Y, Vec3::Z]
        .into_iter()
        .zip(axis_colours(theme))
        .zip(["x", "y", "z"])
        .map(|((axis, colour), name)| (axis, colour, name))
        .collect();
    // Those that point away are drawn first.
    axes.sort_by(|a, b| a.0.dot(back).total_cmp(&b.0.dot(back)));
    for (axis, colour, name) in axes {
        let flat = Vec2::new(axis.dot(right), -axis.dot(up));
        overlay.line(centre, centre + flat * LENGTH, 2.2, colour);
        // An axis that points at the eye has its letter at the middle.
        overlay.text(centre + flat * (LENGTH + 9.0), Align::Centre, TEXT, colour, name);
    }
    overlay.shapes.push(Shape2::Disc { centre, radius: 2.2, colour: ink(theme) });
}

/// True where a view has scale bar and legends.
pub(super) fn shows_legends(view: &PictureView) -> bool {
    view.annotations && view.size.cmpge(LEAST_SIZE).all()
}

/// Title of an inset with that pad: a letter where words would cover it.
pub(super) fn pad_title(side: Side, view: &PictureView) -> String {
    let name = side.name();
    if view.size.y < INSET_WITH_SCALE { name[..1].to_uppercase() } else { format!("{name} pad") }
}

/// Border, title and scale bar of an inset.
pub(super) fn frame_inset(overlay: &mut Overlay, view: &PictureView, title: &str) {
    let ink = ink(view.theme);
    let corners = [Vec2::ZERO, Vec2::new(view.size.x, 0.0), view.size, Vec2::new(0.0, view.size.y)];
    for k in 0..4 {
        overlay.line(corners[k], corners[(k + 1) % 4], 1.5, view.theme.colours().border);
    }
    // Legible on whatever is touched.
    let half = Vec2::new(0.25 * INSET_TEXT * title.chars().count() as f32 + 4.0, 0.5 * INSET_TEXT + 3.0);
    add_ground(overlay, view.theme, half + 4.0, half);
    overlay.text(half + 4.0, Align::Centre, INSET_TEXT, ink, title);
    if view.size.y >= INSET_WITH_SCALE {
        add_scale_bar(overlay, view, [11.0, INSET_TEXT], true);
    }
}

/// Translucent ground of a text about a place.
fn add_ground(overlay: &mut Overlay, theme: Theme, middle: Vec2, half: Vec2) {
    let (min, max, colours) = (middle - half, middle + half, [theme.colours().background; 2]);
    overlay.shapes.push(Shape2::Rectangle { min, max, colours, opacity: 0.72 });
}

/// Length that the scale bar stands for (mm), and its own (points).
fn scale_bar(view: &PictureView) -> Option<(f32, f32)> {
    let points_per_mm = view.size.y / (view.camera.height_at_target() * 1e3);
    let wanted = SCALE_BAR_SHARE * view.size.x.min(900.0);
    let mm = SCALE_STEPS.into_iter().rfind(|mm| mm * points_per_mm <= wanted)?;
    Some((mm, mm * points_per_mm))
}

/// A bar of a round length at the distance of the target, so far from the lower right corner, with letters of that height, and
/// a ground where it may stand on anything.
fn add_scale_bar(overlay: &mut Overlay, view: &PictureView, [margin, letters]: [f32; 2], grounded: bool) {
    let Some((mm, length)) = scale_bar(view) else { return };
    let text = format!("{mm}{SPACE}mm");
    // As wide as the wider of both.
    let half = 0.5 * length.max(0.5 * letters * text.chars().count() as f32);
    let middle = view.size - margin - Vec2::new(half, 0.0);
    let [left, right] = [-0.5, 0.5].map(|share| middle + Vec2::new(share * length, 0.0));
    if grounded {
        add_ground(overlay, view.theme, middle - Vec2::new(0.0, 8.0), Vec2::new(half + 6.0, 14.0));
    }
    let colour = ink(view.theme);
    overlay.line(left, right, 1.6, colour);
    for end in [left, right] {
        overlay.line(end - Vec2::new(0.0, 4.5), end + Vec2::new(0.0, 4.5), 1.6, colour);
    }
    overlay.text(middle - Vec2::new(0.0, 12.0), Align::Centre, letters, colour, text);
}

/// Room of the legends in the top right corner of a picture (points): width from the right edge, height from the top.
pub fn legend_room(view: &PictureView) -> Vec2 {
    let timed = matches!(view.path, Some(PathColour::Time(_)));
    let count = if view.size.cmplt(LEAST_SIZE).any() { 0.0 } else { 1.0 + f32::from(u8::from(timed)) };
    Vec2::new(MARGIN + LEGEND_WIDTH, MARGIN + count * LEGEND_HEIGHT)
}

/// The colour map with its quantity and the values at its ends, in the top right corner.
fn add_legend(overlay: &mut Overlay, view: &PictureView, from_top: f32, title: &str, [low, high]: [f64; 2]) {
    const WIDTH: f32 = LEGEND_WIDTH;
    const HEIGHT: f32 = 9.0;
    let colour = ink(view.theme);
    let left = view.size.x - MARGIN - WIDTH;
    let top = from_top + 16.0;
    // Legible on whatever comes near.
    let (min, max) =
        (Vec2::new(left - 8.0, from_top - 6.0), Vec2::new(left + WIDTH + 8.0, from_top + LEGEND_HEIGHT - 6.0));
    let ground = [view.theme.colours().background; 2];
    overlay.shapes.push(Shape2::Rectangle { min, max, colours: ground, opacity: 0.55 });
    overlay.text(Vec2::new(left, from_top + 4.0), Align::Left, TEXT, colour, title);
    let steps = PRESSURE_MAP.len() - 1;
    for k in 0..steps {
        let x = |k: usize| left + WIDTH * k as f32 / steps as f32;
        overlay.shapes.push(Shape2::Rectangle {
            min: Vec2::new(x(k), top),
            max: Vec2::new(x(k + 1), top + HEIGHT),
            colours: [PRESSURE_MAP[k], PRESSURE_MAP[k + 1]],
            opacity: 1.0,
        });
    }
    for share in [0.0, 0.5, 1.0] {
        let at = Vec2::new(left + WIDTH * share, top + HEIGHT);
        overlay.line(at, at + Vec2::new(0.0, 3.0), 1.2, colour);
        let align = if share == 0.0 {
            Align::Left
        } else if share == 1.0 {
            Align::Right
        } else {
            Align::Centre
        };
        let value = low + (high - low) * f64::from(share);
        let value = mark(if high - low > 1.0 { (10.0 * value).round() / 10.0 } else { value });
        overlay.text(at + Vec2::new(0.0, 12.0), align, TEXT, colour, value);
    }
}

fn add_badge(overlay: &mut Overlay, badge: &str, theme: Theme) {
    let colours = theme.colours();
    // The letters of this font are half as wide as high.
    let width = 7.6 * badge.chars().count() as f32 + 18.0;
    let (min, max) = (Vec2::new(MARGIN - 4.0, MARGIN - 4.0), Vec2::new(MARGIN - 4.0 + width, MARGIN + 19.0));
    overlay.shapes.push(Shape2::Rectangle { min, max, colours: [colours.raised; 2], opacity: 0.92 });
    let accent = Vec2::new(min.x + 3.0, max.y);
    overlay.shapes.push(Shape2::Rectangle { min, max: accent, colours: [colours.accent; 2], opacity: 1.0 });
    overlay.text(Vec2::new(min.x + 11.0, 0.5 * (min.y + max.y)), Align::Left, TEXT, colours.text, badge);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(view: &PictureView) -> Vec<String> {
        let mut overlay = Overlay::default();
        add(&mut overlay, view);
        let text = |shape: &Shape2| match shape {
            Shape2::Text { text, .. } => Some(text.clone()),
            Shape2::Line { .. } | Shape2::Rectangle { .. } | Shape2::Disc { .. } => None,
        };
        overlay.shapes.iter().filter_map(text).collect()
    }

    #[test]
    fn the_scale_bar_snaps_to_round_lengths_and_fits() {
        for distance in [0.05, 0.2, 0.46, 1.5] {
            let mut view = PictureView::default();
            view.camera.distance = distance;
            let label = texts(&view).into_iter().find(|t| t.contains("mm")).expect("a scale bar");
            let mm: f32 = label.split(SPACE).next().and_then(|n| n.parse().ok()).expect("a number");
            assert!(SCALE_STEPS.contains(&mm));
            let points = mm * view.size.y / (view.camera.height_at_target() * 1e3);
            assert!((40.0..160.0).contains(&points), "{points} points at {distance} m");
        }
    }

    #[test]
    fn everything_is_labelled_and_small_pictures_get_less() {
        let view = PictureView { badge: Some("SIMULATED".into()), ..PictureView::default() };
        let all = texts(&view);
        for want in ["x", "y", "z", "taxel pressure, kPa", "0", "20", "40", "SIMULATED"] {
            assert!(all.iter().any(|t| t == want), "{want} in {all:?}");
        }
        let timed = PictureView { path: Some(PathColour::Time([0.0, 3.0])), ..view.clone() };
        let all = texts(&timed);
        assert!(["first touch, s", "1.5", "3"].iter().all(|want| all.iter().any(|t| t == want)), "{all:?}");
        assert!(legend_room(&timed).y > legend_room(&view).y);
        let tiny = PictureView { size: Vec2::new(100.0, 80.0), ..view };
        assert!(texts(&tiny).is_empty());
    }
}
