//! Time bar: line pressure, phases, marks and the cursor; a drag moves the cursor. For a stored trial and for the past of a
//! simulated grasp alike.

use crate::app::actions::Actions;
use crate::app::features::view::ViewSource;
use crate::app::playback::Seek;
use crate::app::shown::{DisplayedData, Inspected};
use crate::app::theme::{colour, veil};
use egui::emath::GuiRounding as _;
use egui::{Align2, FontId, Rect, Sense, Stroke, Ui, pos2, vec2};
use palpate_geometry::palette::Trace;
use palpate_lab::inspection::PhaseSpan;
use palpate_tactile::trial::TrialSource;

/// Height of the bar (points).
const HEIGHT: f32 = 26.0;

pub(super) fn ui(ui: &mut Ui, data: &DisplayedData<'_>, actions: &mut Actions) {
    if ui.available_width() < 60.0 {
        return;
    }
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width() - 6.0, HEIGHT), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Time bar"));
    let [first, last] = data.time_span();
    let length = (last - first).max(1e-9);
    let x_of = |t: f64| rect.left() + rect.width() * ((t - first) / length).clamp(0.0, 1.0) as f32;
    if (response.dragged() || response.clicked())
        && let Some(pointer) = response.interact_pointer_pos()
    {
        let share = f64::from((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        actions.push(move |app| app.seek(Seek::To(first + share * length)));
    }
    if response.has_focus() {
        let arrows = egui::EventFilter { horizontal_arrows: true, ..egui::EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
        for (key, by) in [(egui::Key::ArrowLeft, -0.1), (egui::Key::ArrowRight, 0.1)] {
            if ui.input(|input| input.key_pressed(key)) {
                actions.push(move |app| app.seek(Seek::By(by)));
            }
        }
    }
    let colours = data.view.theme.colours();
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 3.0, colour(colours.background));
    line_pressure(&painter, rect, data, x_of);
    for (place, span) in data.phases.iter().enumerate() {
        let [left, right] = [x_of(span.from_s), x_of(span.to_s)];
        if place > 0 {
            painter.vline(left, rect.y_range(), Stroke::new(1.0, veil(colours.text, 0.45)));
        }
        let font = FontId::proportional(10.5);
        let word = painter.layout_no_wrap(span.phase.name().to_owned(), font, veil(colours.text, 0.85));
        if word.size().x + 8.0 < right - left {
            let at = pos2(left + 4.0, rect.top() + 1.0);
            painter.rect_filled(Rect::from_min_size(at, word.size()).expand(1.0), 2.0, veil(colours.background, 0.7));
            painter.galley(at, word, colour(colours.text));
        }
    }
    if let Some(own) = data.inspected.filter(|own| is_corrected_by_hand(data, own)) {
        for span in &own.trial.phases {
            grip_ui(ui, rect, data, span, (first, length), actions);
        }
    }
    let playback = data.playback;
    if let Some([from, to]) = playback.repeated {
        let part = Rect::from_x_y_ranges(x_of(from)..=x_of(to), rect.bottom() - 4.0..=rect.bottom());
        painter.rect_filled(part, 0.0, colour(colours.accent));
    }
    for (mark, name) in playback.marks.iter().zip(["A", "B"]) {
        if let Some(t) = mark {
            let x = x_of(*t);
            painter.vline(x, rect.y_range(), Stroke::new(1.5, colour(colours.warning)));
            painter.text(
                pos2(x + 2.0, rect.bottom() - 1.0),
                Align2::LEFT_BOTTOM,
                name,
                FontId::proportional(10.5),
                colour(colours.warning),
            );
        }
    }
    if let Some(t) = data.time_s() {
        painter.vline(x_of(t), rect.y_range(), Stroke::new(2.5, colour(colours.accent)));
    }
    response.on_hover_text("Drag to move through time (arrow keys: 0.1 s, with Ctrl a sample)");
}

/// Marks of a simulated grasp are exact; those of others are measured, and a person may know better.
fn is_corrected_by_hand(data: &DisplayedData<'_>, own: &Inspected<'_>) -> bool {
    data.source == ViewSource::Trial && own.trial.source != TrialSource::Simulated
}

/// Grip at the beginning of a phase, by which it is moved.
fn grip_ui(
    ui: &mut Ui,
    rect: Rect,
    data: &DisplayedData<'_>,
    span: &PhaseSpan,
    (first, length): (f64, f64),
    actions: &mut Actions,
) {
    let id = ui.scope_id().with(("phase", span.phase));
    let dragged = ui.data(|data| data.get_temp::<f64>(id));
    let x_of = |t: f64| rect.left() + rect.width() * ((t - first) / length).clamp(0.0, 1.0) as f32;
    let x = x_of(dragged.unwrap_or(span.from_s));
    let place = Rect::from_min_max(pos2(x - 5.0, rect.top()), pos2(x + 5.0, rect.top() + 11.0));
    let response = ui.interact(place, id, Sense::drag()).on_hover_cursor(egui::CursorIcon::ResizeHorizontal);
    let name = span.phase.name();
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, format!("Beginning of {name}")));
    let ink = colour(data.view.theme.colours().accent);
    let points = vec![place.left_top(), place.right_top(), pos2(x, place.bottom())];
    ui.painter().add(egui::Shape::convex_polygon(points, ink, Stroke::NONE));
    if dragged.is_some() {
        ui.painter().vline(x, rect.y_range(), Stroke::new(1.5, ink));
    }
    if response.dragged()
        && let Some(pointer) = response.interact_pointer_pos()
    {
        let share = f64::from((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        ui.data_mut(|data| data.insert_temp(id, first + share * length));
    }
    if response.drag_stopped()
        && let Some(from_s) = dragged
    {
        ui.data_mut(|data| data.remove::<f64>(id));
        let phase = span.phase;
        actions.push(move |app| app.move_phase(phase, from_s));
    }
    response.on_hover_text(format!("Drag to correct where {name} begins; Ctrl+Z takes it back"));
}

/// Line pressure as a filled curve.
fn line_pressure(painter: &egui::Painter, rect: Rect, data: &DisplayedData<'_>, x_of: impl Fn(f64) -> f32) {
    let Some(trace) = data.traces.current() else { return };
    let top = trace.line_bar.iter().copied().filter(|bar| bar.is_finite()).fold(0.05, f64::max);
    let fill = veil(Trace::Line.colour(data.view.theme), 0.40);
    let height = |bar: f64| rect.height() * 0.92 * (bar / top).clamp(0.0, 1.0) as f32;
    // At most one column per point: a long trial has more samples than that.
    let mut drawn = None;
    for (pair, bars) in trace.t.windows(2).zip(trace.line_bar.windows(2)) {
        let [left, right] = [*drawn.get_or_insert_with(|| x_of(pair[0])), x_of(pair[1])];
        if !bars[1].is_finite() {
            drawn = None;
            continue;
        }
        if right <= left + 0.5 {
            continue;
        }
        let column = Rect::from_min_max(pos2(left, rect.bottom() - height(bars[1])), pos2(right, rect.bottom()));
        // Whole pixels leave no seam between two.
        painter.rect_filled(column.round_to_pixels(painter.pixels_per_point()), 0.0, fill);
        drawn = Some(right);
    }
}
