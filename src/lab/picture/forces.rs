//! Contact forces on each finger, as arrows with numbers: the force across the pad, and the shear along it.

use super::PictureView;
use super::annotations::{Annotator, MARGIN, Plate, SCALE_BAR, shows_legends};
use glam::{DVec3, Vec2, Vec3};
use palpate_geometry::Pose;
use palpate_geometry::drawing::{Align, Arrow};
use palpate_geometry::palette::{Rgb, Theme};
use palpate_geometry::units;
use palpate_sim::frame::{Frame, TaxelLoad};
use palpate_sim::gripper::{GripperModel, Side};

/// Greatest and least length of an arrow, as shares of the height of the picture at the camera's target; and the forces that may
/// have the greatest (N): the least of them that none exceeds.
const LONGEST: f64 = 0.26;
const FORCES: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
const SHORTEST: f64 = 0.03;
/// Radius of a shaft, as a share of that height.
const RADIUS: f64 = 0.0042;
/// Forces below this are not drawn (N).
const FAINTEST: f64 = 0.01;
/// Height of the numbers (points), of a line of them, and their distance from the tips.
const TEXT: f32 = 14.0;
const LINE: f32 = 18.0;
const GAP: f32 = 14.0;
/// Least height of a picture with numbers, with a plate for each finger, and with shear and a key (points).
const LEAST_HEIGHT: f32 = 150.0;
const APART: f32 = 250.0;
const HIGH: f32 = 320.0;

/// Colour of shear, of its arrow and its number; that of a force across the pad is the colour of text.
fn shear_colour(theme: Theme) -> Rgb {
    match theme {
        Theme::Dark => Rgb(255, 126, 182),
        Theme::Light => Rgb(190, 24, 110),
    }
}

/// Forces on a finger, from a place outside of it on (N).
struct Forces {
    side: Side,
    from: DVec3,
    /// Across the pad.
    normal: DVec3,
    /// Along the pad; none where it is too small to be drawn.
    shear: Option<DVec3>,
}

/// The shear that a picture shows: a low one has no room for its number.
fn shown_shear(forces: &Forces, view: &PictureView) -> Option<DVec3> {
    forces.shear.filter(|_| view.size.y >= HIGH && !view.plain)
}

/// Arrows along the forces that the object exerts on the fingers.
pub(super) fn arrows(
    gripper: &GripperModel,
    world_from_gripper: &Pose,
    frame: &Frame,
    view: &PictureView,
) -> Vec<Arrow> {
    let (height, all) = (f64::from(view.camera.height_at_target()), on_fingers(gripper, world_from_gripper, frame));
    let scale = [span(view), longest_force(&all)];
    let mut arrows = Vec::new();
    for forces in all {
        let mut arrow = |vector: DVec3, colour: Rgb| {
            let (from, to) = (forces.from.as_vec3(), tip(forces.from, vector, scale));
            arrows.push(Arrow { from, to, radius: (RADIUS * height) as f32, colour });
        };
        arrow(forces.normal, view.theme.colours().text);
        if let Some(shear) = shown_shear(&forces, view) {
            arrow(shear, shear_colour(view.theme));
        }
    }
    arrows
}

/// Force of each finger across its pad (N); none below the smallest that is drawn.
pub(super) fn of_fingers(gripper: &GripperModel, frame: &Frame) -> [Option<f64>; 2] {
    let all = on_fingers(gripper, &Pose::IDENTITY, frame);
    Side::BOTH.map(|side| Some(all.iter().find(|forces| forces.side == side)?.normal.length()))
}

/// Points along the arrows across the pads at their greatest length: what keeps clear of them does not move as they grow.
pub(super) fn reach(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame, view: &PictureView) -> Vec<Vec3> {
    const PLACES: u8 = 12;
    let longest = |forces: &Forces| span(view) * LONGEST * forces.normal.normalize();
    let along = |forces: Forces| {
        let to = longest(&forces);
        (0..=PLACES).map(move |k| (forces.from + to * f64::from(k) / f64::from(PLACES)).as_vec3())
    };
    on_fingers(gripper, world_from_gripper, frame).into_iter().flat_map(along).collect()
}

/// Force that has the longest arrow beside these (N).
fn longest_force(all: &[Forces]) -> f64 {
    let sizes = all.iter().flat_map(|own| [Some(own.normal), own.shear]).flatten().map(DVec3::length);
    let largest = sizes.fold(0.0, f64::max);
    FORCES.into_iter().find(|force| *force >= largest).unwrap_or(largest)
}

/// Force of the arrow in the key (share of that of the longest arrow), and the height of its tip and of the middle of the key
/// above the scale bar (points).
const KEY: f64 = 0.2;
const KEY_TIP: f32 = 10.0;
const KEY_MIDDLE: f32 = 17.0;

/// An arrow of a known force above the scale bar, where there is room beside an inset.
pub(super) fn add_key(annotator: &mut Annotator<'_>, gripper: &GripperModel, frame: &Frame, inset: Option<Plate>) {
    let view = annotator.view;
    if !shows_legends(view) || view.size.y < HIGH {
        return;
    }
    let tip = view.size - Vec2::new(MARGIN, SCALE_BAR + KEY_TIP);
    let force = KEY * longest_force(&on_fingers(gripper, &Pose::IDENTITY, frame));
    let length = view.size.y * (LONGEST * KEY) as f32;
    let (tail, ink) = (tip - Vec2::new(length, 0.0), view.theme.colours().text);
    let half = Vec2::new((0.5 * length).max(1.5 * TEXT) + 5.0, LINE);
    let middle_x = (tip.x - 0.5 * length).min(view.size.x - half.x - 8.0);
    let middle = Vec2::new(middle_x, view.size.y - SCALE_BAR - KEY_MIDDLE);
    let plate = Plate { middle, half };
    if inset.is_some_and(|inset| inset.meets(&plate)) {
        return;
    }
    annotator.add_plate(plate);
    let overlay = &mut annotator.overlay;
    overlay.line(tail, tip, 2.0, ink);
    for side in [-4.0, 4.0] {
        overlay.line(tip, tip + Vec2::new(-6.0, side), 2.0, ink);
    }
    overlay.text(Vec2::new(middle.x, tip.y - 14.0), Align::Centre, TEXT, ink, units::shown(force, "N"));
}

/// Their numbers, beyond the tips or near by: a plate for each finger, or one for both in a low picture.
pub(super) fn label(annotator: &mut Annotator<'_>, gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame) {
    let view = annotator.view;
    let all = on_fingers(gripper, world_from_gripper, frame);
    let scale = [span(view), longest_force(&all)];
    let ends = |forces: &Forces, force: DVec3| {
        let [from, to] = [forces.from.as_vec3(), tip(forces.from, force, scale)];
        view.camera.project(from, view.size).zip(view.camera.project(to, view.size))
    };
    for forces in &all {
        for (from, to) in
            std::iter::once(forces.normal).chain(shown_shear(forces, view)).filter_map(|force| ends(forces, force))
        {
            annotator.keep_clear(from, to);
        }
    }
    if view.size.y < LEAST_HEIGHT {
        return;
    }
    let tips: Vec<f32> = all.iter().filter_map(|forces| Some(ends(forces, forces.normal)?.0.x)).collect();
    let middle = if tips.len() == 2 { 0.5 * (tips[0] + tips[1]) } else { 0.5 * view.size.x };
    let lines = |forces: &Forces, short: bool| -> Vec<(String, Rgb)> {
        let letter = match forces.side {
            Side::Left => "L",
            Side::Right => "R",
        };
        let text = |name: &str, force: DVec3| format!("{letter}  {name}{}", units::shown(force.length(), "N"));
        let name = if short || view.plain || view.size.y < APART { "" } else { "normal " };
        let shear = shown_shear(forces, view).map(|force| (text("shear ", force), shear_colour(view.theme)));
        std::iter::once((text(name, forces.normal), view.theme.colours().text)).chain(shear).collect()
    };
    // Where a group of forces is written, and whether that is on its side of the hand.
    let place = |annotator: &Annotator<'_>, group: &[Forces], short: bool| {
        let forces = group.first()?;
        let (from, to) = ends(forces, forces.normal)?;
        let along = (to - from).normalize_or(Vec2::Y);
        let outward = (from.x - middle).signum();
        let texts: Vec<(String, Rgb)> = group.iter().flat_map(|forces| lines(forces, short)).collect();
        // The letters of this font are half as wide as high.
        let width = texts.iter().map(|(text, _)| 0.5 * TEXT * text.chars().count() as f32).fold(0.0, f32::max);
        let half = Vec2::new(0.5 * width + 7.0, 0.5 * LINE * texts.len() as f32 + 2.0);
        // Beyond the tip, or else on a side of the arrow.
        let beyond = to + along * (GAP + half.x * along.x.abs() + half.y * along.y.abs());
        let aside = |sign: f32| {
            let edge = if sign < 0.0 { from.x.min(to.x) } else { from.x.max(to.x) };
            Vec2::new(edge + sign * (GAP + half.x), 0.5 * (from.y + to.y))
        };
        let over = Vec2::new(0.0, -2.5 * half.y);
        // Sooner further up or down than beside the other finger.
        let outside = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0].map(|rows| aside(outward) + rows * over);
        let places = [&[beyond], &outside[..], &[aside(-outward), aside(-outward) + over]].concat();
        // Over the hand sooner than nowhere, unless that is most of the picture.
        let farthest = if shows_legends(view) { f32::INFINITY } else { view.size.length() };
        let plate = annotator.place(&places, half, farthest)?;
        Some((plate, texts, group.len() > 1 || (plate.middle.x - middle) * outward > 0.0))
    };
    // With fewer words sooner than beside the other finger, and sooner both on one plate than that.
    let has_own = |group: &[Forces]| {
        [false, true].into_iter().any(|short| place(annotator, group, short).is_some_and(|(.., is_own)| is_own))
    };
    let apart = view.size.y >= APART && all.chunks(1).all(has_own);
    for group in all.chunks(if apart { 1 } else { 2 }) {
        let placed = match place(annotator, group, false) {
            Some(placed @ (.., true)) => Some(placed),
            other => place(annotator, group, true).filter(|(.., is_own)| *is_own).or(other),
        };
        let Some((plate, texts, _)) = placed else { continue };
        annotator.add_plate(plate);
        let mut at = plate.middle - plate.half + Vec2::new(7.0, 2.0 + 0.5 * LINE);
        for (text, ink) in texts {
            annotator.overlay.text(at, Align::Left, TEXT, ink, text);
            at.y += LINE;
        }
    }
}

/// Most arrows of shear on a pad, length of the longest, and the radius of their shafts (m).
const MOST_SHEAR: usize = 24;
const LONGEST_SHEAR: f32 = 0.006;
const SHEAR_RADIUS: f32 = 0.0003;
/// Shear on a taxel below this is not drawn (N).
const FAINTEST_SHEAR: f32 = 2e-4;

/// Shear on the taxels that bear most of it, as small arrows along the pads: each as long as its share of the largest.
pub(super) fn shear(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame, theme: Theme) -> Vec<Arrow> {
    let grid = gripper.taxels();
    let mut loads = Vec::new();
    for side in Side::BOTH {
        let mut own: Vec<_> =
            frame.loads(side, grid.count()).map(|own| (own.1.along.hypot(own.1.across), own)).collect();
        own.sort_by(|a, b| b.0.total_cmp(&a.0));
        own.truncate(MOST_SHEAR);
        loads.extend(own.into_iter().map(|(size, (taxel, load))| (side, size, taxel, load)));
    }
    let largest = loads.iter().map(|(_, size, ..)| *size).fold(FAINTEST_SHEAR, f32::max);
    let arrow = |(side, size, taxel, load): &(Side, f32, usize, TaxelLoad)| {
        let placed = frame.placed(gripper, *side);
        let (segment, along) = grid.place(*taxel, &gripper.finger);
        let skin = grid.height(*taxel) - grid.compression(*taxel, f64::from(load.normal));
        let from = world_from_gripper.point(placed.point(segment, along, grid.across(*taxel), skin)).as_vec3();
        let force = placed.axes(segment) * DVec3::new(f64::from(load.along), f64::from(load.across), 0.0);
        let along = world_from_gripper.direction(force).as_vec3().normalize_or_zero();
        let to = from + along * (LONGEST_SHEAR * size / largest);
        Arrow { from, to, radius: SHEAR_RADIUS, colour: shear_colour(theme) }
    };
    loads.iter().filter(|(_, size, ..)| *size >= FAINTEST_SHEAR).map(arrow).collect()
}

/// Height of the picture at the camera's target that lengths of arrows are shares of (m): less in a plain view, where the
/// inset is large.
fn span(view: &PictureView) -> f64 {
    let share = if view.plain { 0.65 } else { 1.0 };
    share * f64::from(view.camera.height_at_target())
}

/// Point of the arrow of a force, where a span (m) has that of so many newtons as its longest.
fn tip(from: DVec3, force: DVec3, [span, longest]: [f64; 2]) -> Vec3 {
    let size = force.length();
    let length = span * (LONGEST * size / longest).max(SHORTEST);
    (from + force / size * length).as_vec3()
}

/// The force across the pad and the shear along it, of each finger that is touched.
fn on_fingers(gripper: &GripperModel, world_from_gripper: &Pose, frame: &Frame) -> Vec<Forces> {
    let grid = gripper.taxels();
    // Outside the finger, so that the loaded pad is seen.
    let clear = gripper.pad.thickness + gripper.finger.back;
    let mut all = Vec::new();
    for side in Side::BOTH {
        let placed = frame.placed(gripper, side);
        let (mut across, mut shear, mut moment, mut weight) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0.0);
        for (taxel, load) in frame.loads(side, grid.count()) {
            let (segment, along) = grid.place(taxel, &gripper.finger);
            let normal = f64::from(load.normal);
            let skin = grid.height(taxel) - grid.compression(taxel, normal);
            let axes = placed.axes(segment);
            across += axes * DVec3::new(0.0, 0.0, -normal);
            shear += axes * DVec3::new(f64::from(load.along), f64::from(load.across), 0.0);
            moment += placed.point(segment, along, grid.across(taxel), skin) * normal;
            weight += normal;
        }
        if weight < FAINTEST || across.length() < FAINTEST {
            continue;
        }
        let out = across.normalize();
        let from = world_from_gripper.point(moment / weight + out * clear);
        let shear = Some(shear).filter(|force| force.length() >= FAINTEST);
        let shear = shear.map(|force| world_from_gripper.direction(force));
        // As much as the sensors of the pad read together.
        all.push(Forces { side, from, normal: world_from_gripper.direction(out * weight), shear });
    }
    all
}
