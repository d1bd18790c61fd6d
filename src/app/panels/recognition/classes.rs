//! A bar for each class, in rows that never change: by shape, then the empty hand and all others; and the
//! threshold as a line across them that can be dragged.

use super::words::{newest, percent, title};
use super::{LEAST_LETTERS, Part, eased, fitted, put};
use crate::app::theme::colour;
use egui::{Align2, Color32, CursorIcon, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use palpate_lab::workers::THRESHOLDS;
use palpate_learn::{Labels, OTHER, Pmf};
use palpate_sim::objects::{EMPTY, catalogue};

/// Size of letters where there is room (points).
const LETTERS: f32 = 12.5;
/// Distance within which the line of the threshold can be dragged (points).
const GRIP: f32 = 6.0;
/// Distance between two columns (points).
const GUTTER: f32 = 12.0;

/// Share of a bar that names on it take where they can: the usual threshold is beyond.
const ON_BAR: f32 = 0.88;

/// Columns of a line (points).
#[derive(Clone, Copy)]
struct Columns {
    /// Of names, beside the bars or on them.
    names: [f32; 2],
    bars: [f32; 2],
    right: f32,
    line: f32,
    /// Size of letters of all names and numbers.
    letters: f32,
}

/// Draws a line of this height for each class, in so many columns.
pub(super) fn ui(ui: &mut Ui, part: &mut Part<'_, '_>, (columns, line): (usize, f32)) {
    let labels = &part.view.labels;
    let pmf = newest(part.view);
    let order = by_shape(labels);
    let rows = order.len().div_ceil(columns.max(1));
    let size = vec2(ui.available_width(), line * rows as f32);
    let (all, _) = ui.allocate_exact_size(size, Sense::hover());
    let width = (all.width() - GUTTER * (columns as f32 - 1.0)) / columns as f32;
    // Names stand on the bars of two columns, so that there is room for both.
    let on_bars = columns > 1;
    let numbers = if on_bars { (0.24 * width).clamp(29.0, 37.0) } else { 46.0 };
    let names = if on_bars { [4.0, width - numbers - 2.0] } else { [0.0, (0.40 * width).min(104.0) + 2.0] };
    let usual = (names[1] - names[0]) * if on_bars { ON_BAR } else { 1.0 };
    let bars = [if on_bars { 0.0 } else { names[1] + 2.0 }, width - numbers];
    let width_of = |class| fitted(ui, &title(labels, class), LETTERS, f32::INFINITY, Color32::WHITE).size().x;
    let longest = (0..labels.classes.len()).map(width_of).fold(1.0, f32::max);
    let letters = (LETTERS * (usual / longest).min(1.0)).max(LEAST_LETTERS).min(line);
    let places: Vec<Columns> = (0..columns)
        .map(|column| {
            let left = all.left() + (width + GUTTER) * column as f32;
            let [names, bars] = [names, bars].map(|ends| ends.map(|x| left + x));
            Columns { names, bars, right: left + width, line, letters }
        })
        .collect();
    for (place, class) in order.iter().enumerate() {
        let own = places[place / rows.max(1)];
        let top = all.top() + line * (place % rows.max(1)) as f32;
        // A thin line between the bars sets the shapes apart; names have no room for it.
        let before = place.checked_sub(1).filter(|_| place % rows != 0).map(|before| order[before]);
        if before.is_some_and(|before| group(labels, before) != group(labels, *class)) {
            let stroke = Stroke::new(1.0, colour(part.colours().border));
            ui.painter().hline(own.bars[0]..=own.bars[1], top, stroke);
        }
        class_ui(ui, part, *class, pmf, (own, top));
    }
    let ends = [all.top(), all.bottom()];
    places.iter().enumerate().for_each(|(column, own)| threshold_ui(ui, part, *own, ends, column == 0));
}

/// Group of a class: its shape, then classes without one, then the empty hand and all other objects.
fn group(labels: &Labels, class: usize) -> usize {
    let class = &labels.classes[class];
    match class.shape {
        _ if [EMPTY, OTHER].contains(&class.name.as_str()) => labels.shapes.len() + 1,
        shape => shape.unwrap_or(labels.shapes.len()),
    }
}

/// All classes by their groups, in each in the order of the model.
fn by_shape(labels: &Labels) -> Vec<usize> {
    let mut order: Vec<usize> = (0..labels.classes.len()).collect();
    order.sort_by_key(|class| group(labels, *class));
    order
}

/// True for a class that the model has learned after its training: none of the built-in ones.
fn is_taught(name: &str) -> bool {
    ![EMPTY, OTHER].contains(&name) && !catalogue().iter().any(|built_in| built_in.name == *name)
}

fn class_ui(ui: &Ui, part: &Part<'_, '_>, class: usize, pmf: Option<&Pmf>, (columns, top): (Columns, f32)) {
    let colours = part.colours();
    let (name, taught) = (title(&part.view.labels, class), is_taught(&part.view.labels.classes[class].name));
    let p = pmf.map_or(0.0, |pmf| pmf.probabilities()[class]);
    let leads = pmf.is_some_and(|pmf| pmf.top().0 == class);
    let rect = Rect::from_min_max(pos2(columns.names[0], top), pos2(columns.right, top + columns.line));
    let is_gone = part.view.left.as_ref().is_some_and(|left| !left[class]) && !part.view.beliefs.is_empty();
    let learned = if taught { ", learned" } else { "" };
    let spoken = format!("{name}{learned} {}{}", percent(p), if is_gone { ", ruled out" } else { "" });
    let response = ui.interact(rect, ui.scope_id().with(("class line", class)), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, &spoken));
    let quiet = if is_gone { colours.background.mix(colours.quiet_text, 0.6) } else { colours.quiet_text };
    let ink = colour(if leads { colours.text } else { quiet });
    let [from, to] = columns.bars;
    let on_bar = from <= columns.names[0];
    let shrunk = if on_bar { 0.06 } else { 0.18 };
    let track =
        Rect::from_min_max(pos2(from, rect.top()), pos2(to, rect.bottom())).shrink2(vec2(0.0, shrunk * columns.line));
    ui.painter().rect_filled(track, 2.0, colour(colours.raised));
    let share = eased(ui, ui.scope_id().with(("class", class)), pmf.map(|_| p));
    let fill = match leads {
        true if on_bar => colours.background.mix(colours.accent, 0.5),
        true => colours.accent,
        false => colours.background.mix(colours.quiet_text, if on_bar { 0.35 } else { 0.7 }),
    };
    if share > 0.003 {
        ui.painter().rect_filled(track.with_max_x(from + (to - from) * share), 2.0, colour(fill));
    }
    // A dot marks what was learned.
    let dot = if taught { 8.0 } else { 0.0 };
    if taught {
        ui.painter().circle_filled(pos2(rect.left() + 3.0, rect.center().y), 3.0, colour(colours.good));
    }
    let room = rect.with_min_x(rect.left() + dot);
    put(ui, fitted(ui, &name, columns.letters, columns.names[1] - room.left(), ink), room, Align2::LEFT_CENTER);
    // An empty bar says "0 %" already.
    if p >= 0.01 {
        let number = fitted(ui, &percent(p), LETTERS.min(columns.line), rect.right() - to - 4.0, ink);
        put(ui, number, rect, Align2::RIGHT_CENTER);
    }
}

/// Line of the threshold across the bars of a column; it can be dragged in the first one.
fn threshold_ui(ui: &Ui, part: &mut Part<'_, '_>, columns: Columns, [top, bottom]: [f32; 2], dragged: bool) {
    let [from, to] = columns.bars;
    let threshold = part.view.rule.threshold;
    let x = from + (to - from) * threshold as f32;
    let ink = colour(part.colours().text);
    if !dragged {
        ui.painter().vline(x, top..=bottom, Stroke::new(1.5, ink));
        return;
    }
    let grip = Rect::from_min_max(pos2(x - GRIP, top), pos2(x + GRIP, bottom));
    // For the mouse; the number below is for the keyboard.
    let response =
        ui.interact(grip, ui.scope_id().with("threshold"), Sense::DRAG).on_hover_cursor(CursorIcon::ResizeHorizontal);
    response.widget_info(|| WidgetInfo::labeled(Role::Splitter, true, "Threshold"));
    let held = response.hovered() || response.dragged();
    ui.painter().vline(x, top..=bottom, Stroke::new(if held { 2.5 } else { 1.5 }, ink));
    ui.painter().circle_filled(pos2(x, bottom), if held { 5.0 } else { 4.0 }, ink);
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) {
        let wanted = stepped(f64::from((pointer.x - from) / (to - from)));
        if wanted != threshold {
            part.actions.push(move |app| app.set_threshold(wanted));
        }
    }
}

/// Threshold in whole percent, above 99 % in tenths.
pub(super) fn stepped(threshold: f64) -> f64 {
    let within = threshold.clamp(*THRESHOLDS.start(), *THRESHOLDS.end());
    let steps = if within > 0.99 { 1e3 } else { 1e2 };
    (within * steps).round() / steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_learn::Class;

    #[test]
    fn thresholds_come_in_steps_and_leave_room_for_doubt() {
        assert_eq!([0.2, 0.8983, 0.99, 0.9962, 1.0, 7.0].map(stepped), [0.5, 0.9, 0.99, 0.996, 0.999, 0.999]);
    }

    #[test]
    fn classes_stand_by_their_shape_and_what_is_none_stands_last() {
        let class = |(name, shape): (&str, Option<usize>)| Class { name: name.to_owned(), size: None, shape };
        let classes =
            [(EMPTY, None), ("ball", Some(1)), (OTHER, None), ("box", Some(0)), ("mug", None), ("can", Some(0))];
        let shapes = ["cubic", "spherical"].map(str::to_owned).to_vec();
        let labels = Labels { classes: classes.map(class).to_vec(), shapes, ..Labels::default() };
        assert_eq!(by_shape(&labels), [3, 5, 1, 4, 0, 2]);
    }
}
