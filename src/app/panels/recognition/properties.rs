//! Size and shape, as bars with one segment for each answer.

use super::words::{newest, percent, title};
use super::{Part, eased, fitted, labelled, put};
use crate::app::theme::colour;
use egui::{Align2, Color32, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use palpate_learn::{Class, Labels, OTHER, Pmf, Properties};
use palpate_sim::objects::EMPTY;

/// Height of the line that shows the probability of an answer (points).
const UNDERLINE: f32 = 4.0;
/// Room for the name of a property, which narrow panels leave out (points).
const NAME: f32 = 36.0;
const NARROW: f32 = 250.0;
/// Size of letters, and the least with which numbers are shown (points).
const LETTERS: f32 = 11.0;
const SMALL: f32 = 9.5;

/// Size and shape of an answer: those of the classes, so that they never contradict it.
pub(super) fn ui(ui: &mut Ui, part: &Part<'_, '_>) {
    let labels = &part.view.labels;
    if rows(labels) == 0 {
        return;
    }
    // An empty hand has neither, and nothing is known of other objects.
    let has_any = |class: &Class| class.size.is_some() || class.shape.is_some();
    let share_of_known = |pmf: &Pmf| -> f64 {
        let classes = labels.classes.iter().zip(pmf.probabilities());
        classes.filter(|(class, _)| has_any(class)).map(|(_, p)| p).sum()
    };
    let known = newest(part.view).filter(|pmf| share_of_known(pmf) > 0.5);
    let properties = known.map(|pmf| Properties::of_classes(labels, pmf));
    // A class that merely leads is no fact.
    let sure = |(_, p): &(usize, f64)| part.view.decision.is_some() || *p >= part.view.rule.threshold;
    let leader = newest(part.view).filter(|_| known.is_none()).map(Pmf::top).filter(sure).map(|(class, _)| class);
    let why = leader.filter(|class| !has_any(&labels.classes[*class])).map(|class| why_none(labels, class));
    let mut row = |name: &str, answers: &[String], pmf: Option<&Pmf>| match &why {
        _ if answers.is_empty() => {}
        Some(why) => none_ui(ui, part, name, why),
        None => property_ui(ui, part, name, answers, pmf),
    };
    row("size", &labels.sizes, properties.as_ref().map(|own| &own.size));
    row("shape", &labels.shapes, properties.as_ref().map(|own| &own.shape));
}

/// Why a class has neither size nor shape.
fn why_none(labels: &Labels, class: usize) -> String {
    match labels.classes[class].name.as_str() {
        EMPTY => "none: the hand is empty".to_owned(),
        OTHER => "not known of other objects".to_owned(),
        _ => format!("none was given for {}", title(labels, class)),
    }
}

/// The line of a property that the likeliest class does not have.
fn none_ui(ui: &mut Ui, part: &Part<'_, '_>, name: &str, why: &str) {
    let spoken = format!("{name} {why}");
    let (rect, _) = labelled(ui, vec2(ui.available_width(), part.measures.properties), &spoken);
    let named = named_ui(ui, part, name, rect);
    let place = rect.with_min_x(rect.left() + named).shrink2(vec2(2.0, 0.0));
    ui.painter().rect_filled(place, 3.0, colour(part.colours().raised));
    let inside = place.shrink2(vec2(4.0, 0.0));
    let ink = colour(part.colours().quiet_text);
    let text = if named > 0.0 { why.to_owned() } else { spoken };
    put(ui, fitted(ui, &text, LETTERS, inside.width(), ink), inside, Align2::LEFT_CENTER);
}

/// The name of a property before its answers; returns its room (points).
fn named_ui(ui: &Ui, part: &Part<'_, '_>, name: &str, rect: Rect) -> f32 {
    if rect.width() < NARROW {
        return 0.0;
    }
    let quiet = colour(part.colours().quiet_text);
    put(ui, fitted(ui, name, 11.5, NAME, quiet), rect, Align2::LEFT_CENTER);
    NAME
}

/// Number of lines.
pub(super) fn rows(labels: &Labels) -> usize {
    usize::from(!labels.sizes.is_empty()) + usize::from(!labels.shapes.is_empty())
}

fn property_ui(ui: &mut Ui, part: &Part<'_, '_>, name: &str, answers: &[String], pmf: Option<&Pmf>) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), part.measures.properties), Sense::hover());
    let named = named_ui(ui, part, name, rect);
    let width = (rect.width() - named) / answers.len().max(1) as f32;
    // All have numbers, or none has; letters are a little smaller for it.
    let needed =
        |answer: &String| fitted(ui, &format!("{answer} 99.9 %"), LETTERS, f32::INFINITY, Color32::WHITE).size().x;
    let letters = LETTERS * ((width - 10.0) / answers.iter().map(needed).fold(1.0, f32::max)).min(1.0);
    let numbered = letters >= SMALL;
    let letters = if numbered { letters } else { LETTERS };
    // Below one half nothing is said.
    let best = pmf.map(Pmf::top).filter(|(_, p)| *p > 0.5).map(|(best, _)| best);
    for (k, answer) in answers.iter().enumerate() {
        let corner = pos2(rect.left() + named + width * k as f32, rect.top());
        let place = Rect::from_min_size(corner, vec2(width, rect.height())).shrink2(vec2(2.0, 0.0));
        let p = pmf.map(|pmf| pmf.probabilities()[k]);
        let spoken = p.map_or_else(|| answer.clone(), |p| format!("{answer} {}", percent(p)));
        ui.interact(place, ui.scope_id().with((name, k)), Sense::hover())
            .on_hover_text(format!("{name}: {spoken}"))
            .widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, &spoken));
        let share = eased(ui, ui.scope_id().with((name, k, "share")), p);
        segment_ui(ui, part, place, &Segment { answer, p, share, numbered, letters, leads: best == Some(k) });
    }
}

struct Segment<'a> {
    answer: &'a str,
    p: Option<f64>,
    /// Probability as drawn.
    share: f32,
    /// There is room for a number.
    numbered: bool,
    letters: f32,
    leads: bool,
}

fn segment_ui(ui: &Ui, part: &Part<'_, '_>, place: Rect, segment: &Segment<'_>) {
    let colours = part.colours();
    ui.painter().rect_filled(place, 3.0, colour(colours.raised));
    let fill = if segment.leads { colours.accent } else { colours.background.mix(colours.quiet_text, 0.7) };
    let line = Rect::from_min_max(pos2(place.left(), place.bottom() - UNDERLINE), place.max);
    let filled = line.with_max_x(line.left() + line.width() * segment.share);
    ui.painter().rect_filled(filled, 1.5, colour(fill));
    let ink = colour(if segment.leads { colours.text } else { colours.quiet_text });
    let inside = place.shrink2(vec2(3.0, 0.0)).with_max_y(line.top());
    let word = fitted(ui, segment.answer, segment.letters, inside.width(), ink);
    let number = segment.p.filter(|_| segment.numbered).map(percent);
    put(ui, word, inside, if number.is_some() { Align2::LEFT_CENTER } else { Align2::CENTER_CENTER });
    if let Some(number) = number {
        put(ui, fitted(ui, &number, segment.letters, inside.width(), ink), inside, Align2::RIGHT_CENTER);
    }
}
