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
    Home,
    /// A cube with the face in front filled, with that at the right, and with the upper one.
    Front,
    Right,
    Top,
    Parallel,
    Force,
    Circle,
    Path,
    Ghost,
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

/// Smaller button that stays pressed while `on`.
pub(super) fn toggle(ui: &mut Ui, icon: Icon, on: bool, name: &str, hint: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(26.0, 24.0), Sense::click());
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, ui.is_enabled(), on, name));
    let visuals = ui.style().interact_selectable(&response, on);
    if on || response.hovered() || response.has_focus() {
        ui.painter().rect(rect, visuals.corner_radius, visuals.bg_fill, visuals.bg_stroke, egui::StrokeKind::Inside);
    }
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
    let thin = Stroke::new(1.4, ink);
    let at = |places: &[[f32; 2]]| places.iter().map(|place| middle + Vec2::from(*place)).collect::<Vec<_>>();
    let lines = |places: &[[f32; 2]]| painter.line(at(places), thin);
    let fill = |places: &[[f32; 2]]| painter.add(Shape::convex_polygon(at(places), ink, Stroke::NONE));
    // Corners of a cube, seen from above its nearest edge.
    let [top, right, low_right, bottom, low_left, left, near] =
        [[0.0, -8.0], [7.0, -4.5], [7.0, 4.0], [0.0, 8.0], [-7.0, 4.0], [-7.0, -4.5], [0.0, -1.0]];
    let cube = |face: &[[f32; 2]]| {
        fill(face);
        lines(&[top, right, low_right, bottom, low_left, left, top]);
        for corner in [left, right, bottom] {
            lines(&[near, corner]);
        }
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
        Icon::Home => {
            lines(&[[-8.0, 0.5], [0.0, -7.0], [8.0, 0.5]]);
            lines(&[[-5.5, -1.0], [-5.5, 6.5], [5.5, 6.5], [5.5, -1.0]]);
        }
        Icon::Front => cube(&[left, near, bottom, low_left]),
        Icon::Right => cube(&[near, right, low_right, bottom]),
        Icon::Top => cube(&[top, right, near, left]),
        Icon::Parallel => {
            // A box whose far side is as large as its near one.
            let (square, far) = ([[-7.5, -3.0], [3.0, -3.0], [3.0, 7.5], [-7.5, 7.5], [-7.5, -3.0]], 4.5);
            lines(&square);
            lines(&[0, 1, 2].map(|k| [square[k][0] + far, square[k][1] - far]));
            square[..3].iter().for_each(|[x, y]| _ = lines(&[[*x, *y], [x + far, y - far]]));
        }
        Icon::Force => {
            lines(&[[-6.5, 6.5], [3.5, -3.5]]);
            fill(&[[7.5, -7.5], [5.0, 1.5], [-1.5, -5.0]]);
        }
        Icon::Circle => {
            painter.circle_stroke(middle, 7.0, thin);
            painter.circle_filled(middle, 1.6, ink);
            lines(&[[0.0, 0.0], [5.0, -5.0]]);
        }
        Icon::Path => {
            lines(&[[-7.0, 5.0], [-4.5, -2.0], [-1.0, 3.0], [2.0, -5.0], [4.5, 1.0], [7.0, -4.0]]);
            at(&[[-7.0, 5.0], [7.0, -4.0]]).into_iter().for_each(|end| _ = painter.circle_filled(end, 2.2, ink));
        }
        Icon::Ghost => {
            let dome =
                (0..=8).map(|k| 6.0 * Vec2::angled(std::f32::consts::PI * (1.0 + k as f32 / 8.0)) - vec2(0.0, 1.5));
            let hem = [[6.0, 7.5], [3.0, 5.0], [0.0, 7.5], [-3.0, 5.0], [-6.0, 7.5], [-6.0, -1.5]].map(Vec2::from);
            painter.line(dome.chain(hem).map(|corner| middle + corner).collect(), thin);
            at(&[[-2.2, -1.5], [2.2, -1.5]]).into_iter().for_each(|eye| _ = painter.circle_filled(eye, 1.3, ink));
        }
        Icon::Moon => {
            // A disc with a bite out of it, in the colour of the button.
            painter.circle_filled(middle, 6.5, ink);
            painter.circle_filled(middle + vec2(3.2, -2.4), 5.6, ground);
        }
    }
}
