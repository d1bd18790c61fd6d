//! The measured touch: width and height of the object with their spread, as the fingers feel them, before any
//! class is named.

use super::words::leads;
use super::{Measures, Part, fitted, put};
use crate::app::theme::colour;
use egui::{Align2, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use palpate_learn::{Measure, MeasureEstimate};
use palpate_sim::objects::EMPTY;

/// Longest length on the scale (mm).
const LONGEST: f64 = 110.0;
/// Room for the name of a quantity, and for its value (points).
const NAME: f32 = 44.0;
const VALUE: f32 = 84.0;
/// Size of letters (points).
const LETTERS: f32 = 11.5;
/// Text without contact.
const UNKNOWN: &str = "no contact";
/// Share of a line that its bar takes.
const BAR: f32 = 0.4;

/// The quantities that are shown.
const SHOWN: [(Measure, &str, &str); 2] = [
    (Measure::Width, "width", "Extent of the object between the fingers"),
    (Measure::Height, "height", "Extent of the object along the gripper's axis"),
];

/// Height of all lines (points).
pub(super) fn height(measures: &Measures) -> f32 {
    // In a small window, one line with its gap takes the room of a class.
    if measures.is_tight() { measures.class } else { SHOWN.len() as f32 * (measures.class + measures.gap) }
}

/// Draws the lines; false where nothing can be measured.
pub(super) fn ui(ui: &mut Ui, part: &Part<'_, '_>) -> bool {
    // For a model from perfect sensors, the encoder knows those only; it knows free and fixed objects.
    if !part.view.measures_geometry || part.is_foreign() || part.data.other_fingers {
        return false;
    }
    // Fingers that touch each other measure nothing.
    let is_empty = leads(part.view, EMPTY);
    let touched = part.view.measured.as_deref().filter(|_| !part.recognised.nothing_held);
    let unknown = match part.view.measured.is_some() {
        true if part.recognised.nothing_held => "not held",
        true => "–",
        false if part.view.unlike => "–",
        false => UNKNOWN,
    };
    let of = |measure: Measure| touched.filter(|_| !is_empty).and_then(|measured| measured.felt(measure));
    if part.measures.is_tight() {
        let height = part.measures.class - part.measures.gap;
        let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
        let share = line.width() / SHOWN.len() as f32;
        for (k, (measure, name, about)) in SHOWN.into_iter().enumerate() {
            let corner = pos2(line.left() + share * k as f32, line.top());
            let place = Rect::from_min_size(corner, vec2(share - 4.0, line.height()));
            let text = of(measure).map_or_else(|| "–".to_owned(), |estimate| estimate.words("–"));
            explain(ui, place, (name, about), of(measure).ok_or(unknown));
            let ink = colour(if of(measure).is_some() { part.colours().text } else { part.colours().quiet_text });
            put(
                ui,
                fitted(ui, &format!("{name} {text}"), height - 1.0, place.width(), ink),
                place,
                Align2::LEFT_CENTER,
            );
        }
    } else {
        SHOWN
            .into_iter()
            .for_each(|(measure, name, about)| line_ui(ui, part, (name, about), of(measure).ok_or(unknown)));
    }
    true
}

/// Text of an estimate for people who point at it, and for screen readers.
fn explain(ui: &Ui, place: Rect, (name, about): (&str, &str), estimate: Result<&MeasureEstimate, &str>) {
    let text = estimate.map_or_else(str::to_owned, |estimate| estimate.words(" to "));
    let spoken = format!("{name} {text}");
    let meaning = match estimate.map(MeasureEstimate::felt) {
        Ok([Some(_), None]) => "it is longer with 95 % probability; how much is not felt",
        Ok([None, _]) => "it is shorter with 95 % probability; fingers that may touch each other do not feel how much",
        _ => "median, and the range that holds the true value with 90 % probability",
    };
    ui.interact(place, ui.scope_id().with(("touch", name)), Sense::hover())
        .on_hover_text(format!("{about}: {meaning}"))
        .widget_info(|| WidgetInfo::labeled(Role::Label, true, &spoken));
}

fn line_ui(ui: &mut Ui, part: &Part<'_, '_>, (name, about): (&str, &str), estimate: Result<&MeasureEstimate, &str>) {
    let (colours, height) = (part.colours(), part.measures.class);
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    let text = estimate.map_or_else(str::to_owned, |estimate| estimate.words(" to "));
    explain(ui, rect, (name, about), estimate);
    let quiet = colour(colours.quiet_text);
    let (left, right) = (rect.left() + NAME, rect.right() - VALUE);
    put(ui, fitted(ui, name, LETTERS, NAME, quiet), rect, Align2::LEFT_CENTER);
    let bar = Rect::from_min_max(
        pos2(left, rect.center().y - 0.5 * BAR * height),
        pos2(right - 8.0, rect.center().y + 0.5 * BAR * height),
    );
    if bar.width() > 20.0 {
        ui.painter().rect_filled(bar, 2.0, colour(colours.raised));
        if let Ok(estimate) = estimate {
            let at = |x: f64| bar.left() + bar.width() * (x * 1e3 / LONGEST).clamp(0.0, 1.0) as f32;
            let [from, to] = estimate.felt().map(|end| end.map(at));
            let is_vague = from.is_none() || to.is_none();
            let (from, to) = (from.unwrap_or(bar.left()), to.unwrap_or(bar.right()));
            let range = Rect::from_min_max(pos2(from, bar.top()), pos2(to.max(from + 2.0), bar.bottom()));
            ui.painter().rect_filled(range, 2.0, colour(colours.background.mix(colours.accent, 0.45)));
            let middle = Rect::from_center_size(pos2(at(estimate.value), bar.center().y), vec2(2.5, height * 0.7));
            if !is_vague {
                ui.painter().rect_filled(middle, 1.0, colour(colours.accent));
            }
        }
    }
    let ink = if estimate.is_ok() { colour(colours.text) } else { quiet };
    put(ui, fitted(ui, &text, LETTERS, VALUE, ink), rect, Align2::RIGHT_CENTER);
}
