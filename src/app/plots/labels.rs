//! Names of the curves at the right of a plot with their values at the cursor, in the order of their heights; of compared
//! trials in a table, with the numbers of the trials. They take the place of a legend, which would cover curves.

use crate::app::theme::colour;
use crate::app::widgets::put_line;
use egui::{Align2, Color32, FontId, Pos2, Rect, Shape, Stroke, Ui, pos2, vec2};
use palpate_geometry::palette::Rgb;
use palpate_geometry::units::number;

/// Width of the names beside a plot (points).
pub(super) const WIDTH: f32 = 144.0;
/// Length of the piece of a curve's line before its name (points).
const SAMPLE: f32 = 14.0;
/// Distance between two lines (points).
pub(super) const LINE: f32 = 14.0;

/// Name of a curve, and its values.
pub(super) struct CurveLabel<'a> {
    pub(super) name: String,
    pub(super) ink: Color32,
    /// Its line is dashed.
    pub(super) dashed: bool,
    /// Unit of its values.
    pub(super) unit: &'a str,
    /// Value at the cursor; none where it is undefined.
    pub(super) value: Option<f64>,
    /// Value at mark B less that at mark A, where both are set.
    pub(super) difference: Option<f64>,
    /// Height of the value on the screen; without a value, where there is room.
    pub(super) y: Option<f32>,
}

impl CurveLabel<'_> {
    fn text(&self) -> String {
        format!("{} {}", self.name, self.values())
    }

    fn values(&self) -> String {
        let value = self.value.map_or("–".to_owned(), |value| number(value, self.unit));
        match self.difference {
            Some(difference) => {
                let sign = if difference > 0.0 { "+" } else { "" };
                format!("{value}  Δ {sign}{}", number(difference, self.unit))
            }
            None => value,
        }
    }
}

/// Draws a piece of a curve's line, solid or dashed, before its name; returns its end.
fn draw_line(painter: &egui::Painter, from: Pos2, ink: Color32, dashed: bool) -> Pos2 {
    let line = [from, from + vec2(SAMPLE, 0.0)];
    let stroke = Stroke::new(1.8, ink);
    if dashed {
        painter.extend(Shape::dashed_line(&line, stroke, 5.0, 4.0));
    } else {
        painter.line_segment(line, stroke);
    }
    line[1]
}

/// Most curves that have a column of their own beside the names of trials.
const COLUMNS: usize = 2;
/// Widest names of trials in a table (points).
const TRIALS: f32 = 52.0;
/// Room between columns (points).
const GAP: f32 = 6.0;

/// Draws the values of trials as a table beside a plot whose frame this is: a row for each trial and a column for each curve,
/// or, where these have no room, a row for each curve of each trial. The labels are those of the first trial's curves, then
/// of the second's, and so on.
pub(super) fn draw_table(ui: &Ui, frame: Rect, quiet: Rgb, (trials, labels): (&[String], &[CurveLabel<'_>])) {
    let curves = (labels.len() / trials.len().max(1)).max(1);
    let wide = curves <= COLUMNS && labels.iter().all(|label| label.difference.is_none());
    let (in_row, head) = if wide { (curves, 1) } else { (1, 0) };
    let (rows, room) = (labels.len() / in_row, (frame.height() / LINE).floor().max(2.0) as usize);
    let shown = if head + rows > room { room - head - 1 } else { rows };
    let width_of = |name: &str| {
        ui.painter().layout_no_wrap(name.to_owned(), FontId::proportional(LETTERS), Color32::WHITE).size().x
    };
    // A word that all names share is the heading: `contact` above `left` and `right`.
    let beginning = |label: &CurveLabel<'_>| label.name.split_once(' ').map(|(word, _)| format!("{word} "));
    let word = labels.first().filter(|_| in_row > 1).and_then(beginning);
    let shared = word.as_deref().filter(|word| labels.iter().take(in_row).all(|label| label.name.starts_with(word)));
    let head_word = shared.map_or(HEAD, |word| word.trim_end().trim_end_matches(','));
    let first = if wide { width_of(head_word) } else { 0.0 };
    let names = trials.iter().map(|name| width_of(name)).fold(first, f32::max).min(TRIALS) + GAP;
    let left = frame.right() + 6.0 + SAMPLE + 5.0;
    let column = (frame.right() + WIDTH - left - names) / in_row as f32;
    let cell = |row: usize, from: f32, width: f32| {
        Rect::from_min_size(pos2(left + from, frame.top() + LINE * row as f32), vec2(width, LINE))
    };
    let put = |cell: Rect, text: &str, ink| put_line(ui, cell, Align2::LEFT_CENTER, text, LETTERS, ink);
    let quiet = colour(quiet);
    if wide {
        put(cell(0, 0.0, names), head_word, quiet);
        let name_of = |label: &CurveLabel<'_>| -> String {
            label.name.strip_prefix(shared.unwrap_or_default()).unwrap_or(&label.name).to_owned()
        };
        let fits = labels.iter().take(in_row).all(|label| width_of(&name_of(label)) <= column - SAMPLE - 4.0);
        for (k, label) in labels.iter().take(in_row).enumerate() {
            let place = cell(0, names + column * k as f32, column);
            let end = draw_line(ui.painter(), place.left_center(), quiet, label.dashed);
            let name = name_of(label);
            let letter = || name.chars().next().map_or_else(String::new, |first| first.to_uppercase().collect());
            put(place.with_min_x(end.x + 4.0), &if fits { name.clone() } else { letter() }, quiet);
        }
    }
    for (k, own) in labels.chunks(in_row).take(shown).enumerate() {
        let (row, ink) = (head + k, own[0].ink);
        let line = cell(row, -SAMPLE - 5.0, SAMPLE).left_center();
        draw_line(ui.painter(), line, ink, own[0].dashed && !wide);
        put(cell(row, 0.0, names - GAP), trials.get(k * in_row / curves).map_or("", String::as_str), ink);
        for (k, label) in own.iter().enumerate() {
            // Beside differences there is no room for the name: its line is dashed or not.
            let text = if wide || label.difference.is_some() { label.values() } else { label.text() };
            put(cell(row, names + column * k as f32, column), &text, ink);
        }
    }
    if shown < rows {
        put(cell(head + shown, 0.0, WIDTH), &format!("and {} more", rows - shown), quiet);
    }
}

/// Head of the column of trials.
const HEAD: &str = "trial";
/// Letters of the table (points).
const LETTERS: f32 = 11.5;
/// Draws the labels beside a plot whose frame this is; those that do not fit are left out, the last first.
pub(super) fn draw(ui: &Ui, frame: Rect, quiet: Rgb, mut labels: Vec<CurveLabel<'_>>) {
    let room = ((frame.height() / LINE).floor().max(1.0)) as usize;
    if room == 1 && labels.len() > 1 && draw_row(ui, frame, &labels) {
        return;
    }
    let hidden = labels.len().saturating_sub(room);
    labels.truncate(if hidden > 0 { room.saturating_sub(1) } else { room });
    let wanted: Vec<f32> = labels.iter().map(|label| label.y.unwrap_or(frame.bottom())).collect();
    let last = frame.bottom() - if hidden > 0 { LINE } else { 0.0 };
    let places = spread(&wanted, frame.top() + 0.5 * LINE, last - 0.5 * LINE, LINE);
    let clip = Rect::from_min_max(pos2(frame.right(), frame.top()), pos2(frame.right() + WIDTH, frame.bottom()));
    let painter = ui.painter_at(clip);
    for (label, y) in labels.iter().zip(places) {
        let place = draw_line(&painter, pos2(frame.right() + 6.0, y), label.ink, label.dashed) + vec2(5.0, 0.0);
        painter.text(place, Align2::LEFT_CENTER, label.text(), FontId::proportional(11.5), label.ink);
    }
    if hidden > 0 {
        let place = pos2(frame.right() + 8.0, frame.bottom() - 0.5 * LINE);
        let text = format!("and {} more", hidden + 1);
        painter.text(place, Align2::LEFT_CENTER, text, FontId::proportional(11.0), colour(quiet));
    }
}

/// Draws the labels beside each other in a low plot; false where they have no room.
fn draw_row(ui: &Ui, frame: Rect, labels: &[CurveLabel<'_>]) -> bool {
    let font = FontId::proportional(10.0);
    let texts = labels.iter().map(|label| ui.painter().layout_no_wrap(label.text(), font.clone(), label.ink));
    let texts: Vec<_> = texts.collect();
    let width: f32 = texts.iter().map(|text| SAMPLE + 3.0 + text.size().x + GAP).sum();
    if width > WIDTH {
        return false;
    }
    let mut place = pos2(frame.right() + 6.0, frame.center().y);
    for (label, text) in labels.iter().zip(texts) {
        let corner = draw_line(ui.painter(), place, label.ink, label.dashed) + vec2(3.0, -0.5 * text.size().y);
        place.x = corner.x + text.size().x + GAP;
        ui.painter().galley(corner, text, label.ink);
    }
    true
}

/// Heights near the wanted ones, at least `line` apart and between `top` and `bottom` where there is room.
fn spread(wanted: &[f32], top: f32, bottom: f32, line: f32) -> Vec<f32> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|a, b| wanted[*a].total_cmp(&wanted[*b]));
    // Those closer than a line keep their own order, so that they do not change places where curves cross.
    for _ in 0..order.len() {
        for k in 1..order.len() {
            let (above, below) = (order[k - 1], order[k]);
            if above > below && wanted[below] - wanted[above] < line {
                order.swap(k - 1, k);
            }
        }
    }
    let mut places = vec![0.0; wanted.len()];
    let mut above = f32::NEG_INFINITY;
    for k in &order {
        places[*k] = wanted[*k].clamp(top, bottom.max(top)).max(above + line);
        above = places[*k];
    }
    // What was pushed out at the bottom pushes back.
    let mut below = bottom + line;
    for k in order.iter().rev() {
        places[*k] = places[*k].min(below - line);
        below = places[*k];
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_keep_their_distance_and_stay_within_the_plot() {
        for wanted in [vec![10.0, 11.0, 12.0], vec![95.0, 99.0, 400.0], vec![-50.0, 50.0, 50.0], vec![f32::NAN, 1.0]] {
            let places = spread(&wanted, 7.0, 93.0, 14.0);
            let mut sorted = places.clone();
            sorted.sort_by(f32::total_cmp);
            assert!(sorted.windows(2).all(|pair| pair[1] - pair[0] >= 13.99), "{places:?}");
            assert!(sorted[0] >= 6.99 && sorted[sorted.len() - 1] <= 93.01, "{places:?}");
        }
        assert_eq!(spread(&[50.0], 7.0, 93.0, 14.0), [50.0]);
        // Curves that cross keep their order; those far apart have that of their heights.
        for wanted in [[50.0, 52.0], [52.0, 50.0]] {
            let places = spread(&wanted, 7.0, 93.0, 14.0);
            assert!(places[0] < places[1], "{places:?}");
        }
        assert!(spread(&[80.0, 20.0], 7.0, 93.0, 14.0)[1] < 30.0);
        assert!(spread(&[], 7.0, 93.0, 14.0).is_empty());
    }

    #[test]
    fn a_label_has_its_value_and_the_difference_between_the_marks() {
        let label = CurveLabel {
            name: "left".to_owned(),
            ink: Color32::WHITE,
            dashed: false,
            unit: "N",
            value: Some(1.234),
            difference: Some(0.5),
            y: None,
        };
        assert_eq!(label.text(), "left 1.23  Δ +0.50");
        assert_eq!(CurveLabel { value: None, difference: None, ..label }.text(), "left –");
    }
}
