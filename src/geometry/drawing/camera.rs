//! The camera: it looks at a target from a distance, as plain numbers, without any window.
//!
//! ```text
//!        z  eye
//!        | /  pitch up from the ground
//!        |/____ y
//!       /   yaw from -y towards +x: at yaw 0 the camera stands in front (at -y) and looks along +y
//!      x
//! ```

use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::f32::consts::{FRAC_PI_2, PI};

/// Camera of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// The point in the middle of the picture (m).
    pub target: Vec3,
    /// Distance of the eye from the target (m).
    pub distance: f32,
    /// Turn about the vertical (rad); 0 looks along +y, positive moves the eye towards +x.
    pub yaw: f32,
    /// Height of the eye above the horizon (rad).
    pub pitch: f32,
    /// Vertical angle of view (rad).
    pub angle_of_view: f32,
    /// Parallel projection instead of perspective.
    pub parallel: bool,
}

/// Views that have a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// The whole hand from three quarters, a little above: the view to begin with.
    Home,
    /// Along +y: both fingers side by side.
    Front,
    /// Along -y.
    Back,
    /// Along +x.
    Left,
    /// Along -x.
    Right,
    /// From above.
    Top,
    /// From below.
    Bottom,
}

impl StandardView {
    /// All of them.
    pub const ALL: [Self; 7] = [Self::Home, Self::Front, Self::Back, Self::Left, Self::Right, Self::Top, Self::Bottom];

    /// The name used on the command line and in menus.
    pub fn name(self) -> &'static str {
        match self {
            Self::Home => "hand",
            Self::Front => "front",
            Self::Back => "back",
            Self::Left => "left",
            Self::Right => "right",
            Self::Top => "top",
            Self::Bottom => "bottom",
        }
    }

    /// Yaw and pitch (rad).
    fn angles(self) -> (f32, f32) {
        match self {
            Self::Home => (-0.68, 0.30),
            Self::Front => (0.0, 0.0),
            Self::Back => (PI, 0.0),
            Self::Left => (-FRAC_PI_2, 0.0),
            Self::Right => (FRAC_PI_2, 0.0),
            Self::Top => (0.0, STEEPEST),
            Self::Bottom => (0.0, -STEEPEST),
        }
    }
}

/// Part of a picture that things are to fill, in shares of its width and height from the top left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureRoom {
    /// Upper left corner.
    pub min: Vec2,
    /// Lower right corner.
    pub max: Vec2,
    /// Share of the width beyond which nothing reaches where the rest leaves the choice.
    pub clear_of: f32,
}

/// Straight up or down, less a hair, so that "up" in the picture stays defined (rad).
const STEEPEST: f32 = FRAC_PI_2 - 1e-3;
/// Nearest and farthest distance (m).
const DISTANCES: (f32, f32) = (0.03, 4.0);

impl Default for Camera {
    fn default() -> Self {
        let (yaw, pitch) = StandardView::Home.angles();
        Self { target: Vec3::new(0.0, 0.0, 0.095), distance: 0.46, yaw, pitch, angle_of_view: 0.60, parallel: false }
    }
}

impl Camera {
    /// Turned to a standard view, the same target and distance.
    pub fn turned_to(self, view: StandardView) -> Self {
        let (yaw, pitch) = view.angles();
        Self { yaw, pitch, ..self }
    }

    /// Moved so that a ball of `radius` (m) about `centre` fills the picture.
    pub fn framing(self, centre: Vec3, radius: f32) -> Self {
        let distance = radius / (0.5 * self.angle_of_view).sin();
        Self { target: centre, distance: distance.clamp(DISTANCES.0, DISTANCES.1), ..self }
    }

    /// Moved, not turned, so that points fill a room of a picture of this width over height and none is outside.
    pub fn containing(self, points: &[Vec3], room: &PictureRoom, aspect: f32) -> Self {
        let [right, up, back] = self.axes();
        let ends = |values: &dyn Fn(&Vec3) -> f32| {
            points.iter().map(values).fold([f32::INFINITY, f32::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
        };
        let [near, far] = ends(&|point: &Vec3| -point.dot(back));
        let middle = 0.5 * (near + far);
        // In a parallel projection what is farther away is no smaller.
        let depth = |point: &Vec3| if self.parallel { 0.0 } else { -point.dot(back) - middle };
        // An edge of the room is a plane through the eye: its slope is the way to the side for each step ahead.
        let slope = |share: f32| (2.0 * share - 1.0) * (0.5 * self.angle_of_view).tan();
        let behind = |axis: Vec3, slope: f32| {
            let [low, high] = ends(&|point: &Vec3| point.dot(axis) - slope * depth(point));
            if slope < 0.0 { low } else { high }
        };
        let across = [room.min.x, room.max.x].map(|share| slope(share) * aspect);
        let upwards = [1.0 - room.max.y, 1.0 - room.min.y].map(slope);
        let [[left, rightmost], [lowest, top]] =
            [(right, across), (up, upwards)].map(|(axis, s)| s.map(|s| behind(axis, s)));
        let distance = ((rightmost - left) / (across[1] - across[0])).max((top - lowest) / (upwards[1] - upwards[0]));
        let distance = distance.clamp(DISTANCES.0, DISTANCES.1);
        // Where the eye is: in the middle of where it can be, or as far to the side as keeps the rest of the picture clear.
        let beside = slope(room.clear_of) * aspect;
        let [least, most] = [rightmost - across[1] * distance, left - across[0] * distance];
        let wanted = behind(right, beside) - beside * distance;
        let side = (0.5 * (least + most)).max(wanted.min(most));
        let height = 0.5 * (top - upwards[1] * distance + lowest - upwards[0] * distance);
        Self { target: right * side + up * height - back * middle, distance, ..self }
    }

    /// Turned by a drag of the mouse, in shares of the picture's height.
    pub fn orbited(self, drag: Vec2) -> Self {
        let turn = PI * 1.1;
        Self {
            yaw: (self.yaw - turn * drag.x + PI).rem_euclid(2.0 * PI) - PI,
            pitch: (self.pitch + turn * drag.y).clamp(-STEEPEST, STEEPEST),
            ..self
        }
    }

    /// Shifted by a drag of the mouse, in shares of the picture's height: what lies at the target follows the mouse.
    pub fn panned(self, drag: Vec2) -> Self {
        let height = self.height_at_target();
        let [right, up, _] = self.axes();
        Self { target: self.target + (up * drag.y - right * drag.x) * height, ..self }
    }

    /// Nearer (factor below 1) or farther.
    pub fn zoomed(self, factor: f32) -> Self {
        Self { distance: (self.distance * factor).clamp(DISTANCES.0, DISTANCES.1), ..self }
    }

    /// Height of the picture at the distance of the target (m).
    pub fn height_at_target(&self) -> f32 {
        2.0 * self.distance * (0.5 * self.angle_of_view).tan()
    }

    /// Unit vectors to the right, up, and back towards the eye.
    pub fn axes(&self) -> [Vec3; 3] {
        let (sin_yaw, cos_yaw) = self.yaw.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch.sin_cos();
        let back = Vec3::new(sin_yaw * cos_pitch, -cos_yaw * cos_pitch, sin_pitch);
        let right = Vec3::new(cos_yaw, sin_yaw, 0.0);
        [right, back.cross(right), back]
    }

    /// Position of the eye (m).
    pub fn eye(&self) -> Vec3 {
        self.target + self.axes()[2] * self.distance
    }

    /// From world coordinates to clip coordinates, for a picture of this width over height.
    pub fn clip_from_world(&self, aspect: f32) -> Mat4 {
        let [_, up, _] = self.axes();
        let view = view::look_at_mat4(self.eye(), self.target, up);
        let (near, far) = (0.05 * self.distance, self.distance + 5.0);
        let projection = if self.parallel {
            let half = 0.5 * self.height_at_target();
            directx::orthographic(-half * aspect, half * aspect, -half, half, near - self.distance, far)
        } else {
            directx::perspective(self.angle_of_view, aspect, near, far)
        };
        projection * view
    }

    /// Projects a point of the world into a picture of `size` points, from its top left; `None` behind the eye.
    pub fn project(&self, point: Vec3, size: Vec2) -> Option<Vec2> {
        self.projector(size)(point)
    }

    /// [`Camera::project`] for many points.
    pub fn projector(&self, size: Vec2) -> impl Fn(Vec3) -> Option<Vec2> + use<> {
        let clip_from_world = self.clip_from_world(size.x / size.y);
        move |point| {
            let clip = clip_from_world * point.extend(1.0);
            let ndc = clip.truncate() / clip.w;
            (clip.w > 0.0).then(|| Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * size)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Vec2 = Vec2::new(400.0, 300.0);

    #[test]
    fn the_target_is_in_the_middle_and_up_is_up() {
        for view in StandardView::ALL {
            for parallel in [false, true] {
                let camera = Camera { parallel, ..Camera::default() }.turned_to(view);
                let middle = camera.project(camera.target, SIZE).expect("in front");
                assert!(middle.abs_diff_eq(0.5 * SIZE, 1e-2), "{view:?}: {middle}");
                let above = camera.project(camera.target + camera.axes()[1] * 0.01, SIZE).expect("in front");
                assert!(above.y < middle.y, "{view:?}");
            }
        }
    }

    #[test]
    fn front_shows_x_to_the_right_and_z_up() {
        let camera = Camera::default().turned_to(StandardView::Front);
        let [right, up, back] = camera.axes();
        assert!(right.abs_diff_eq(Vec3::X, 1e-6) && up.abs_diff_eq(Vec3::Z, 1e-6));
        assert!(back.abs_diff_eq(Vec3::NEG_Y, 1e-6));
        assert!(Camera::default().turned_to(StandardView::Top).axes()[2].z > 0.999);
    }

    #[test]
    fn panning_moves_the_target_with_the_mouse() {
        let camera = Camera::default();
        let moved = camera.panned(Vec2::new(0.1, 0.0));
        // The old middle is now a tenth of the height to the right.
        let at = moved.project(camera.target, SIZE).expect("in front");
        assert!((at.x - (200.0 + 30.0)).abs() < 0.5, "{at}");
    }

    #[test]
    fn framing_fits_a_ball() {
        let camera = Camera::default().framing(Vec3::new(0.1, 0.0, 0.0), 0.05);
        let edge = camera.target + camera.axes()[1] * 0.05;
        let at = camera.project(edge, SIZE).expect("in front");
        assert!(at.y > 0.0 && at.y < 30.0, "{at}");
    }

    #[test]
    fn orbiting_never_tips_over() {
        let camera = Camera::default().orbited(Vec2::new(3.0, 9.0)).orbited(Vec2::new(0.0, 9.0));
        assert!(camera.pitch < FRAC_PI_2 && camera.yaw.abs() <= PI);
        assert!(camera.clip_from_world(1.5).is_finite());
    }
}
