//! Resting poses: the object is dropped onto a plane many times, and its final orientations are collected. rapier3d
//! simulates the drops: the result needs a fair share of each face, not an accurate trajectory.
//!
//! The object is scaled to unit size first: rapier's tolerances suit bodies of about a metre, and the drop of a scaled
//! body under the same gravity differs only in its time scale.

use super::placement::random_rotation;
use crate::objects::ObjectModel;
use glam::{DMat3, DQuat, DVec3, Mat3, Quat, Vec3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rapier3d::prelude::{ColliderBuilder, MassProperties, PhysicsWorld, Pose, RigidBodyBuilder, SharedShape};

/// Drops per object: a face that one in ten drops ends on is then missed once in 150 objects.
const DROPS: usize = 48;
/// Steps of 1/60 s after which even what rolls on or quivers has long been lying.
const MOST_STEPS: usize = 600;
/// Speeds (unit sizes/s and rad/s) below which an object may have come to rest, and for how many steps.
const STILL: f32 = 0.03;
const STILL_STEPS: usize = 20;
/// Rolling resistance: without it a can never stops.
const ANGULAR_DAMPING: f32 = 1.5;
const LINEAR_DAMPING: f32 = 0.5;
/// Height of the drop (unit sizes): enough to tumble to a face that is easy to stay on.
const HEIGHT: f32 = 1.0;

/// Orientations (world from object) in which an object comes to rest, one per drop, so that frequent ones are listed
/// often. Never empty: an object that cannot be dropped keeps its own orientation. Equal objects give equal lists.
pub fn natural_rotations(object: &ObjectModel) -> Vec<DQuat> {
    let Some(body) = DroppedBody::new(object) else { return vec![DQuat::IDENTITY] };
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let found: Vec<DQuat> = (0..DROPS).filter_map(|_| body.drop_from(random_rotation(&mut random))).collect();
    if found.is_empty() { vec![DQuat::IDENTITY] } else { found }
}

/// An object of unit size, ready to be dropped again and again.
struct DroppedBody {
    shape: SharedShape,
    mass: MassProperties,
    /// Radius of a ball about the origin of its frame that holds it (unit sizes).
    radius: f32,
}

impl DroppedBody {
    fn new(object: &ObjectModel) -> Option<Self> {
        let size = object.bounds.size().max_element();
        let place = |p: DVec3| (p / size).as_vec3();
        let balls = &object.resting.0;
        let corners: Vec<Vec3> = balls.iter().filter(|b| b.radius == 0.0).map(|b| place(b.centre)).collect();
        let mut parts: Vec<(Pose, SharedShape)> = balls
            .iter()
            .filter(|b| b.radius > 0.0)
            .map(|b| (Pose::from_translation(place(b.centre)), SharedShape::ball((b.radius / size) as f32)))
            .collect();
        if corners.len() >= 4 {
            parts.push((Pose::IDENTITY, SharedShape::convex_hull(&corners)?));
        }
        if parts.is_empty() || !size.is_finite() {
            return None;
        }
        // Per unit mass and unit size.
        let inertia: DMat3 = object.mass.inertia * (1.0 / (object.mass.mass * size * size));
        let mass = MassProperties::with_inertia_matrix(place(object.mass.centre), 1.0, mat3(inertia));
        let reach = |b: &crate::objects::RestingBall| (b.centre.length() + b.radius) / size;
        let radius = balls.iter().map(reach).fold(0.0, f64::max) as f32;
        Some(Self { shape: SharedShape::compound(parts), mass, radius })
    }

    /// Final orientation; `None` where the engine has lost the body.
    fn drop_from(&self, rotation: DQuat) -> Option<DQuat> {
        let mut world = PhysicsWorld { gravity: Vec3::new(0.0, 0.0, -9.81), ..PhysicsWorld::default() };
        world.insert(
            RigidBodyBuilder::fixed().translation(Vec3::new(0.0, 0.0, -1.0)),
            ColliderBuilder::cuboid(50.0, 50.0, 1.0).friction(0.6),
        );
        let start = Pose::from_parts(Vec3::new(0.0, 0.0, self.radius + HEIGHT), quat(rotation));
        let (body, _) = world.insert(
            RigidBodyBuilder::dynamic().pose(start).linear_damping(LINEAR_DAMPING).angular_damping(ANGULAR_DAMPING),
            ColliderBuilder::new(self.shape.clone()).mass_properties(self.mass).friction(0.6),
        );
        let mut still = 0;
        for _ in 0..MOST_STEPS {
            world.step();
            let body = &world.bodies[body];
            let slow = body.linvel().length() < STILL && body.angvel().length() < STILL;
            still = if slow { still + 1 } else { 0 };
            if still == STILL_STEPS || body.is_sleeping() {
                break;
            }
        }
        let lying = world.bodies[body].rotation().as_dquat();
        lying.is_finite().then(|| lying.normalize())
    }
}

fn quat(rotation: DQuat) -> Quat {
    rotation.as_quat()
}

fn mat3(matrix: DMat3) -> Mat3 {
    matrix.as_mat3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::Primitive;

    /// Counts of the rotations in which each axis of the object points up or down.
    fn axes_up(shape: Primitive) -> [usize; 3] {
        let object = ObjectModel::from_primitive("thing", shape, 500.0, 0.5);
        let rotations = natural_rotations(&object);
        assert_eq!(rotations.len(), DROPS);
        let mut counts = [0; 3];
        for rotation in rotations {
            let up = (rotation.inverse() * DVec3::Z).abs();
            for (axis, share) in up.to_array().into_iter().enumerate() {
                counts[axis] += usize::from(share > 0.99);
            }
        }
        counts
    }

    #[test]
    fn a_brick_lies_on_its_faces_and_mostly_on_the_largest() {
        let [x, y, z] = axes_up(Primitive::Cuboid { half: DVec3::new(0.03, 0.015, 0.006) });
        assert!(z > y && y > x && z >= 30, "{x} {y} {z}");
    }

    #[test]
    fn a_cube_lies_on_all_its_faces() {
        let counts = axes_up(Primitive::Cuboid { half: DVec3::splat(0.02) });
        assert!(counts.iter().all(|n| *n >= 6), "{counts:?}");
    }

    #[test]
    fn a_long_cylinder_lies_and_a_flat_one_stands() {
        let long = axes_up(Primitive::Cylinder { radius: 0.008, half_length: 0.045 });
        assert_eq!(long[2], 0);
        let flat = axes_up(Primitive::Cylinder { radius: 0.02, half_length: 0.006 });
        assert!(flat[2] > 30, "{flat:?}");
    }

    #[test]
    fn the_list_is_the_same_every_time() {
        let cube = ObjectModel::from_primitive("c", Primitive::Cuboid { half: DVec3::splat(0.02) }, 500.0, 0.5);
        assert_eq!(natural_rotations(&cube), natural_rotations(&cube));
    }
}
