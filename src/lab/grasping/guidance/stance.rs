//! Poses of the gripper as seen from an object, and moves between them.

use glam::{DQuat, DVec2, EulerRot};
use palpate_sim::scene::Scene;

/// Units for distances between poses: differences of turn, shift in the plane and lift that change the readings.
const TURN_DEG: f64 = 12.0;
const SHIFT: f64 = 0.012;
const LIFT: f64 = 0.003;

/// Moves that are compared: turns by this much up to a quarter turn to either side, as the fingers are alike; shifts and
/// lifts on these grids (degrees, m).
const TURN_STEP_DEG: f64 = 15.0;
const ACROSS: [f64; 3] = [-0.006, 0.0, 0.006];
const ALONG: [f64; 3] = [-0.008, 0.0, 0.008];
const HEIGHTS: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// Pose of the gripper as seen from an object at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// Orientation of the gripper in the frame of the object.
    turned: DQuat,
    /// Place of the gripper from that of the object, in the gripper's frame: across the pads, and along their width (m).
    offset: DVec2,
    /// Height above the nominal one (m).
    height: f64,
}

/// A move of the gripper between two grasps: a turn, then a shift in the new frame, and a lift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GripperMove {
    /// Turn about the vertical, counter-clockwise from above (degrees).
    pub turn_deg: f64,
    /// Shift across the pads, in the direction of closing, and along their width (m).
    pub shift: [f64; 2],
    /// Lift (m).
    pub lift: f64,
}

impl Stance {
    /// The stance in a scene.
    pub fn of(scene: &Scene) -> Self {
        let [roll, pitch, yaw] = scene.object.rotation_deg.map(f64::to_radians);
        let object = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
        let mount = &scene.gripper.mount;
        let turn = mount.yaw_deg.to_radians();
        let [x, y, height] = mount.offset;
        let place = DVec2::new(x, y) - DVec2::from_array(scene.object.shift);
        let offset = DVec2::from_angle(-turn).rotate(place);
        Self { turned: object.inverse() * DQuat::from_rotation_z(turn), offset, height }
    }

    /// The stance after a move.
    #[must_use]
    pub fn moved(&self, by: &GripperMove) -> Self {
        let turn = by.turn_deg.to_radians();
        Self {
            turned: self.turned * DQuat::from_rotation_z(turn),
            offset: DVec2::from_angle(-turn).rotate(self.offset) + DVec2::from_array(by.shift),
            height: self.height + by.lift,
        }
    }

    /// Its numbers: orientation (x, y, z, w), offset and height (m).
    pub(super) fn to_array(self) -> [f32; 7] {
        let [x, y, z, w] = self.turned.to_array();
        [x, y, z, w, self.offset.x, self.offset.y, self.height].map(|number| number as f32)
    }

    /// The stance with such numbers.
    pub(super) fn from_array(numbers: [f32; 7]) -> Self {
        let [x, y, z, w, across, along, height] = numbers.map(f64::from);
        let turned = DQuat::from_xyzw(x, y, z, w);
        let turned = if turned.length_squared() > 0.5 { turned.normalize() } else { DQuat::IDENTITY };
        Self { turned, offset: DVec2::new(across, along), height }
    }

    /// Squared distance, in these units.
    pub(super) fn distance2(&self, other: &Self) -> f64 {
        let turn_deg = 2.0 * self.turned.dot(other.turned).abs().min(1.0).acos().to_degrees();
        let squared = |difference: f64, felt: f64| (difference / felt) * (difference / felt);
        squared(turn_deg, TURN_DEG)
            + squared((self.offset - other.offset).length(), SHIFT)
            + squared(self.height - other.height, LIFT)
    }
}

impl GripperMove {
    /// All moves from a scene that keep to the poses of the nominal one, each with the scene after it.
    pub fn all(from: &Scene, nominal: &Scene) -> Vec<(Self, Scene)> {
        let (here, centre, most) = (&from.gripper.mount, nominal.gripper.mount.offset, nominal.pose.shift);
        let quarter = (90.0 / TURN_STEP_DEG) as i32;
        let mut all = Vec::new();
        for turn_deg in (1 - quarter..=quarter).map(|k| TURN_STEP_DEG * f64::from(k)) {
            for (across, along) in ACROSS.iter().flat_map(|across| ALONG.map(|along| (*across, along))) {
                for height in HEIGHTS.map(|share| centre[2] + share * most[2]) {
                    let by = Self { turn_deg, shift: [across, along], lift: height - here.offset[2] };
                    let (offset, yaw_deg) = by.mount(from, height);
                    let is_far = |axis: usize| (offset[axis] - centre[axis]).abs() > most[axis] + 1e-9;
                    if !(0..3).any(is_far) {
                        all.push((by, mounted(from, offset, yaw_deg)));
                    }
                }
            }
        }
        all
    }

    /// A scene after this move.
    pub fn after(&self, from: &Scene) -> Scene {
        let (offset, yaw_deg) = self.mount(from, from.gripper.mount.offset[2] + self.lift);
        mounted(from, offset, yaw_deg)
    }

    /// Offset (m) and turn (degrees) of the gripper after this move to a height (m).
    fn mount(&self, from: &Scene, height: f64) -> ([f64; 3], f64) {
        let here = &from.gripper.mount;
        let yaw_deg = here.yaw_deg + self.turn_deg;
        let shift = DVec2::from_angle(yaw_deg.to_radians()).rotate(DVec2::from_array(self.shift));
        ([here.offset[0] + shift.x, here.offset[1] + shift.y, height], yaw_deg)
    }
}

/// A scene with the gripper there.
fn mounted(from: &Scene, offset: [f64; 3], yaw_deg: f64) -> Scene {
    let mut scene = from.clone();
    scene.gripper.mount.offset = offset;
    scene.gripper.mount.yaw_deg = (yaw_deg + 180.0).rem_euclid(360.0) - 180.0;
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stance_after_a_move_is_that_of_the_scene_after_it() {
        let mut from = Scene::default();
        (from.gripper.mount.yaw_deg, from.gripper.mount.offset) = (20.0, [0.003, -0.002, 0.004]);
        from.object.rotation_deg = [90.0, 10.0, -30.0];
        let mut nominal = Scene::default();
        nominal.pose.shift = [0.008; 3];
        let all = GripperMove::all(&from, &nominal);
        assert!(
            all.len() > 100 && all.iter().any(|(by, _)| *by == GripperMove { lift: -0.004, ..GripperMove::default() })
        );
        for (by, after) in all {
            let (own, wanted) = (Stance::of(&from).moved(&by), Stance::of(&after));
            assert!(own.distance2(&wanted) < 1e-9, "{by:?}: {own:?}, {wanted:?}");
            assert!(Stance::of(&by.after(&from)).distance2(&wanted) < 1e-9, "{by:?}");
            let mount = &after.gripper.mount;
            assert!(mount.offset.iter().all(|x| x.abs() <= 0.008 + 1e-9) && mount.yaw_deg.abs() <= 180.0);
        }
    }

    #[test]
    fn a_stance_is_its_numbers() {
        let mut scene = Scene::default();
        scene.object.rotation_deg = [90.0, 10.0, -30.0];
        (scene.gripper.mount.yaw_deg, scene.gripper.mount.offset) = (20.0, [0.003, -0.002, 0.004]);
        let stance = Stance::of(&scene);
        assert!(Stance::from_array(stance.to_array()).distance2(&stance) < 1e-6);
    }
}
