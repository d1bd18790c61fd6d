//! Icons, drawn from lines and triangles: they look the same with every font and on every theme.

use egui::{Color32, Rect, Response, Sense, Shape, Stroke, Ui, Vec2, vec2};

/// An icon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Icon {
    Play,
    Pause,
    Reset,
    Step,
    StepBack,
    Sun,
    Moon,
    Eye,
    Check,
    Cross,
}

/// Draws an icon in the middle of a place.
pub(super) fn sign(ui: &Ui, icon: Icon, place: Rect, ink: Color32) {
    paint(ui, icon, place, ink, Color32::TRANSPARENT);
}

/// Button with an icon, and a name for screen readers and tests.
pub(super) fn button(ui: &mut Ui, icon: Icon, name: &str, hint: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(34.0, 28.0), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, ui.is_enabled(), name));
    let visuals = ui.style().interact(&response);
    ui.painter().rect(rect, visuals.corner_radius, visuals.bg_fill, visuals.bg_stroke, egui::StrokeKind::Inside);
    paint(ui, icon, rect, visuals.fg_stroke.color, visuals.bg_fill);
    response.on_hover_text(hint)
}

fn paint(ui: &Ui, icon: Icon, rect: Rect, ink: Color32, ground: Color32) {
    let middle = rect.center();
    let painter = ui.painter();
    let bar = |x: f32| painter.rect_filled(Rect::from_center_size(middle + vec2(x, 0.0), vec2(3.0, 11.0)), 0.5, ink);
    // A triangle with its base at x, pointing right (+1) or left (-1).
    let triangle = |x: f32, to: f32| {
        let corner = |dx: f32, dy: f32| middle + vec2(x + dx, dy);
        let points = vec![corner(0.0, -5.5), corner(9.0 * to, 0.0), corner(0.0, 5.5)];
        painter.add(Shape::convex_polygon(points, ink, Stroke::NONE));
    };
    match icon {
        Icon::Play => triangle(-3.5, 1.0),
        Icon::Pause => {
            bar(-3.0);
            bar(3.0);
        }
        Icon::Reset => {
            bar(-7.0);
            triangle(2.0, -1.0);
            triangle(8.0, -1.0);
        }
        Icon::Step => {
            triangle(-6.0, 1.0);
            bar(5.0);
        }
        Icon::StepBack => {
            bar(-5.0);
            triangle(6.0, -1.0);
        }
        Icon::Sun => {
            painter.circle_filled(middle, 3.6, ink);
            for k in 0..8 {
                let ray = Vec2::angled(std::f32::consts::TAU * k as f32 / 8.0);
                painter.line_segment([middle + ray * 5.6, middle + ray * 8.0], Stroke::new(1.5, ink));
            }
        }
        Icon::Eye => {
            painter.add(Shape::ellipse_stroke(middle, vec2(8.0, 5.0), Stroke::new(1.5, ink)));
            painter.circle_filled(middle, 2.4, ink);
        }
        Icon::Check => {
            let corners = [vec2(-5.5, 0.5), vec2(-1.5, 4.5), vec2(6.0, -4.5)].map(|corner| middle + corner);
            painter.line(corners.to_vec(), Stroke::new(2.2, ink));
        }
        Icon::Cross => {
            for tilt in [1.0, -1.0] {
                let arm = vec2(4.5, 4.5 * tilt);
                painter.line_segment([middle - arm, middle + arm], Stroke::new(2.2, ink));
            }
        }
        Icon::Moon => {
            // A disc with a bite out of it, in the colour of the button.
            painter.circle_filled(middle, 6.5, ink);
            painter.circle_filled(middle + vec2(3.2, -2.4), 5.6, ground);
        }
    }
}
