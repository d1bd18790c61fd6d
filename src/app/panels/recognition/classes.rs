//! A bar for each class, always in the same order, and the threshold as a line across them that can be dragged.

use super::words::{newest, percent, ranked, title};
use super::{LEAST_LETTERS, Part, eased, fitted, labelled, put};
use crate::app::theme::colour;
use egui::{Align2, Color32, CursorIcon, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};
use palpate_lab::workers::THRESHOLDS;
use palpate_learn::{Labels, OTHER, Pmf};
use palpate_sim::objects::{EMPTY, catalogue};

/// Size of letters where there is room (points).
const LETTERS: f32 = 12.5;
/// Distance within which the line of the threshold can be dragged (points).
const GRIP: f32 = 6.0;

/// Columns of a line (points).
#[derive(Clone, Copy)]
struct Columns {
    bars: [f32; 2],
    line: f32,
    /// Size of letters of all names.
    letters: f32,
}

/// Draws this many lines of this height.
pub(super) fn ui(ui: &mut Ui, part: &mut Part<'_, '_>, (lines, line): (usize, f32)) {
    let labels = &part.view.labels;
    let pmf = newest(part.view);
    let shown = shown_classes(labels, lines, pmf);
    let rest = labels.classes.len() - shown.len();
    let width = ui.available_width();
    let left = ui.cursor().left();
    let names = (0.40 * width).min(104.0);
    let width_of = |class| fitted(ui, title(labels, class), LETTERS, f32::INFINITY, Color32::WHITE).size().x;
    let longest = (0..labels.classes.len()).map(width_of).fold(1.0, f32::max);
    let letters = LETTERS * (names / longest).min(1.0);
    let columns = Columns { bars: [left + names + 4.0, left + width - 46.0], line, letters };
    let gap = std::mem::replace(&mut ui.spacing_mut().item_spacing.y, 0.0);
    let top = ui.cursor().top();
    for class in &shown {
        class_ui(ui, part, *class, pmf, columns);
    }
    let bottom = ui.cursor().top();
    if rest > 0 {
        let left_over: f64 = pmf.map_or(0.0, |pmf| 1.0 - shown.iter().map(|k| pmf.probabilities()[*k]).sum::<f64>());
        let text = format!("and {rest} others, {}", percent(left_over));
        let (rect, response) = labelled(ui, vec2(width, line), &text);
        response.on_hover_text("Enlarge the panel to see all");
        let quiet = colour(part.colours().quiet_text);
        put(ui, fitted(ui, text, 11.5, width, quiet), rect, Align2::LEFT_CENTER);
    }
    ui.spacing_mut().item_spacing.y = gap;
    threshold_ui(ui, part, columns, [top, bottom]);
}

/// All classes or, with fewer lines, those that the model was taught and the most likely ones; one line is left for the number
/// of the others.
fn shown_classes(labels: &Labels, lines: usize, pmf: Option<&Pmf>) -> Vec<usize> {
    let classes = labels.classes.len();
    if classes <= lines {
        return (0..classes).collect();
    }
    let is_usual = |class: &usize| {
        let name = &labels.classes[*class].name;
        [EMPTY, OTHER].contains(&name.as_str()) || catalogue().iter().any(|built_in| built_in.name == *name)
    };
    let (usual, mut shown): (Vec<usize>, Vec<usize>) =
        pmf.map_or_else(|| (0..classes).collect(), ranked).into_iter().partition(is_usual);
    shown.extend(usual);
    shown.truncate(lines.saturating_sub(1));
    shown.sort_unstable();
    shown
}

fn class_ui(ui: &mut Ui, part: &Part<'_, '_>, class: usize, pmf: Option<&Pmf>, columns: Columns) {
    let colours = part.colours();
    let name = title(&part.view.labels, class);
    let p = pmf.map_or(0.0, |pmf| pmf.probabilities()[class]);
    let leads = pmf.is_some_and(|pmf| pmf.top().0 == class);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), columns.line), Sense::hover());
    let is_gone = part.view.left.as_ref().is_some_and(|left| !left[class]) && !part.view.beliefs.is_empty();
    let spoken = format!("{name} {}{}", percent(p), if is_gone { ", ruled out" } else { "" });
    response.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, &spoken));
    let quiet = if is_gone { colours.background.mix(colours.quiet_text, 0.6) } else { colours.quiet_text };
    let ink = colour(if leads { colours.text } else { quiet });
    let [from, to] = columns.bars;
    put(
        ui,
        fitted(ui, name, columns.letters.max(LEAST_LETTERS), from - 2.0 - rect.left(), ink),
        rect,
        Align2::LEFT_CENTER,
    );
    let track =
        Rect::from_min_max(pos2(from, rect.top()), pos2(to, rect.bottom())).shrink2(vec2(0.0, 0.18 * columns.line));
    ui.painter().rect_filled(track, 2.0, colour(colours.raised));
    let share = eased(ui, ui.scope_id().with(("class", class)), pmf.map(|_| p));
    let fill = if leads { colours.accent } else { colours.background.mix(colours.quiet_text, 0.7) };
    if share > 0.003 {
        ui.painter().rect_filled(track.with_max_x(from + (to - from) * share), 2.0, colour(fill));
    }
    // An empty bar says "0 %" already.
    if p >= 0.01 {
        put(ui, fitted(ui, percent(p), LETTERS, rect.right() - to - 4.0, ink), rect, Align2::RIGHT_CENTER);
    }
}

/// Line of the threshold across the bars.
fn threshold_ui(ui: &Ui, part: &mut Part<'_, '_>, columns: Columns, [top, bottom]: [f32; 2]) {
    let [from, to] = columns.bars;
    let threshold = part.view.rule.threshold;
    let x = from + (to - from) * threshold as f32;
    let grip = Rect::from_min_max(pos2(x - GRIP, top), pos2(x + GRIP, bottom));
    // For the mouse; the number below is for the keyboard.
    let response =
        ui.interact(grip, ui.scope_id().with("threshold"), Sense::DRAG).on_hover_cursor(CursorIcon::ResizeHorizontal);
    response.widget_info(|| WidgetInfo::labeled(Role::Splitter, true, "Threshold"));
    let held = response.hovered() || response.dragged();
    let ink = colour(part.colours().text);
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
    fn where_there_is_little_room_taught_classes_and_the_likeliest_stay_in_their_order() {
        let labels = |names: [&str; 5]| {
            let class = |name: &str| Class { name: name.to_owned(), size: None, shape: None };
            Labels { classes: names.map(class).to_vec(), ..Labels::default() }
        };
        let usual = labels(["ball", "box", "case", EMPTY, OTHER]);
        let pmf = Pmf::from_weights([0.1, 0.4, 0.0, 0.3, 0.2]);
        assert_eq!(shown_classes(&usual, 5, Some(&pmf)), [0, 1, 2, 3, 4]);
        assert_eq!(shown_classes(&usual, 4, Some(&pmf)), [1, 3, 4]);
        assert_eq!(shown_classes(&usual, 4, None), [0, 1, 2]);
        let taught = labels(["ball", "box", "mug", EMPTY, OTHER]);
        assert_eq!(shown_classes(&taught, 4, Some(&pmf)), [1, 2, 3]);
        assert_eq!(shown_classes(&taught, 2, None), [2]);
    }
}
