//! Initial placement: the object on its support, the gripper above it.

use crate::objects::ObjectModel;
use crate::scene::{Scene, SupportKind};
use glam::{DQuat, DVec3};
use palpate_geometry::Pose;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The start of a scene, in world coordinates. The world's origin is the middle of the table, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    pub world_from_gripper: Pose,
    /// Pose of the object's own frame (not its centre of mass) in the world; absent for an empty hand.
    pub world_from_object: Option<Pose>,
    /// Corrections made for clearance.
    pub warnings: Vec<String>,
}

/// Room kept between the palm and the top of the object, and between the fingertips and the table (m).
const CLEARANCE: f64 = 0.003;

/// Height at which an object floats when there is no support (m), so that the picture stays the same.
const FLOATING_HEIGHT: f64 = 0.050;

impl Placement {
    /// Puts the object's lowest point on its support, its centre of mass above the support's middle, and the palm
    /// `grasp_depth` above the middle of the object. Offsets then move the gripper, not the resting object.
    pub fn new(scene: &Scene, object: Option<&ObjectModel>) -> Self {
        let support_top = match scene.support.kind {
            SupportKind::Pedestal => scene.support.height,
            SupportKind::Table => 0.0,
            SupportKind::None => FLOATING_HEIGHT,
        };
        let mount = &scene.gripper.mount;
        let mut warnings = Vec::new();
        let (world_from_object, object_top, middle) = match object {
            Some(object) => {
                let (pose, height) = put_down(scene, object, support_top);
                (Some(pose), support_top + height, support_top + 0.5 * height)
            }
            None => (None, support_top, support_top + 0.02),
        };
        let mut palm = middle + mount.grasp_depth;
        if palm < object_top + CLEARANCE {
            palm = object_top + CLEARANCE;
            warnings.push("the palm was raised to clear the top of the object".to_owned());
        }
        let lowest_palm = scene.gripper.finger.length + CLEARANCE;
        if scene.support.kind != SupportKind::None && palm < lowest_palm {
            palm = lowest_palm;
            warnings.push("the gripper was raised to keep its fingertips off the table".to_owned());
        }
        let [x, y, z] = mount.offset;
        let world_from_gripper =
            Pose::new(DVec3::new(x, y, palm + z), DQuat::from_rotation_z(mount.yaw_deg.to_radians()));
        Self { world_from_gripper, world_from_object, warnings }
    }
}

/// Pose of an object resting on a level surface, and its height.
fn put_down(scene: &Scene, object: &ObjectModel, surface: f64) -> (Pose, f64) {
    let [roll, pitch, yaw] = scene.object.rotation_deg.map(f64::to_radians);
    let turned = Pose::from_xyz_rpy(DVec3::ZERO, DVec3::new(roll, pitch, yaw));
    let down = turned.inverse().direction(-DVec3::Z);
    let (below, above) = (object.resting.reach(down), object.resting.reach(-down));
    let centre = turned.point(object.mass.centre);
    let [x, y] = scene.object.shift;
    let position = DVec3::new(x - centre.x, y - centre.y, surface + below);
    (Pose { position, rotation: turned.rotation }, below + above)
}

/// A rotation, all equally likely (Shoemake 1992).
pub fn random_rotation(random: &mut ChaCha8Rng) -> DQuat {
    let [u, v, w] = [(); 3].map(|()| random.random::<f64>());
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    let (v, w) = (v * std::f64::consts::TAU, w * std::f64::consts::TAU);
    DQuat::from_xyzw(a * v.sin(), a * v.cos(), b * w.sin(), b * w.cos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;

    #[test]
    fn a_lying_cylinder_touches_its_pedestal() {
        let mut scene = Scene::default();
        scene.object.rotation_deg = [90.0, 0.0, 0.0];
        scene.gripper.mount.offset = [0.001, 0.002, 0.003];
        let shape = Primitive::Cylinder { radius: 0.015, half_length: 0.03 };
        let object = ObjectModel::from_primitive("roll", shape, 500.0, 0.5);
        let placed = Placement::new(&scene, Some(&object));
        let pose = placed.world_from_object.expect("an object");
        assert!((pose.position.z - (scene.support.height + 0.015)).abs() < 1e-5);
        let palm = placed.world_from_gripper.position;
        let want = scene.support.height + 0.015 + scene.gripper.mount.grasp_depth + 0.003;
        assert!((palm.z - want).abs() < 1e-5 && palm.x == 0.001);
        assert!(placed.warnings.is_empty());
    }

    #[test]
    fn tall_and_low_things_get_room_and_a_warning() {
        let tall =
            ObjectModel::from_primitive("post", Primitive::Cuboid { half: DVec3::new(0.01, 0.01, 0.1) }, 500.0, 0.5);
        let placed = Placement::new(&Scene::default(), Some(&tall));
        assert!(placed.world_from_gripper.position.z > Scene::default().support.height + 0.2);
        assert_eq!(placed.warnings.len(), 1);
        let mut scene = Scene::default();
        scene.support.kind = SupportKind::Table;
        let flat =
            ObjectModel::from_primitive("tile", Primitive::Cuboid { half: DVec3::new(0.02, 0.02, 0.003) }, 500.0, 0.5);
        let placed = Placement::new(&scene, Some(&flat));
        assert!(placed.world_from_gripper.position.z >= scene.gripper.finger.length);
        assert_eq!(placed.warnings.len(), 1);
    }
}
