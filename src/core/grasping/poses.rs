//! Random poses: the gripper is shifted and turned over the resting object, seeded, so that a seed names a pose.

use super::run::prepare;
use crate::objects::ObjectModel;
use crate::scene::Scene;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How far a pose may stray from straight above the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseJitter {
    /// Largest shift along each axis (m).
    pub shift: f64,
    /// Largest turn about the vertical (degrees).
    pub yaw_deg: f64,
}

impl Default for PoseJitter {
    fn default() -> Self {
        Self { shift: 0.005, yaw_deg: 25.0 }
    }
}

/// Draws before a scene that leaves no room is accepted as it is.
const MOST_DRAWS: u32 = 100;

/// The scene with its gripper moved to a random pose, and how many draws were thrown away because the open fingers
/// would have stood inside the object.
pub fn jittered(scene: &Scene, object: Option<&ObjectModel>, jitter: PoseJitter, seed: u64) -> (Scene, u32) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut drawn = scene.clone();
    for rejected in 0..MOST_DRAWS {
        let mut within = |most: f64| most * (2.0 * random.random::<f64>() - 1.0);
        for (offset, nominal) in drawn.gripper.mount.offset.iter_mut().zip(scene.gripper.mount.offset) {
            *offset = nominal + within(jitter.shift);
        }
        // A whole turn more or less is the same pose, and keeps to the range of scene files.
        let yaw = scene.gripper.mount.yaw_deg + within(jitter.yaw_deg);
        drawn.gripper.mount.yaw_deg = if yaw.abs() > 180.0 { (yaw + 180.0).rem_euclid(360.0) - 180.0 } else { yaw };
        if drawn.check().is_err() {
            continue;
        }
        if prepare(&drawn, object, seed).rig_mut().starting_overlap() <= 0.0 {
            return (drawn, rejected);
        }
    }
    (drawn, MOST_DRAWS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Primitive;
    use glam::DVec3;

    #[test]
    fn a_seed_names_a_pose_within_its_range() {
        let scene = Scene::default();
        let jitter = PoseJitter::default();
        let (first, _) = jittered(&scene, None, jitter, 7);
        assert_eq!(jittered(&scene, None, jitter, 7).0, first);
        assert_ne!(jittered(&scene, None, jitter, 8).0, first);
        for offset in first.gripper.mount.offset {
            assert!(offset.abs() <= jitter.shift);
        }
        assert!(first.gripper.mount.yaw_deg.abs() <= jitter.yaw_deg && first.gripper.mount.yaw_deg != 0.0);
    }

    #[test]
    fn colliding_poses_are_drawn_again() {
        // 80 mm between pads that are 84 mm apart: most shifts collide.
        let slab = Primitive::Cuboid { half: DVec3::new(0.040, 0.02, 0.02) };
        let object = ObjectModel::from_primitive("slab", slab, 500.0, 0.5);
        let jitter = PoseJitter { shift: 0.008, yaw_deg: 0.0 };
        let (scene, rejected) = jittered(&Scene::default(), Some(&object), jitter, 3);
        assert!(scene.gripper.mount.offset[0].abs() < 0.0021 + 1e-9, "{:?}", scene.gripper.mount.offset);
        let total: u32 = (0..20).map(|seed| jittered(&Scene::default(), Some(&object), jitter, seed).1).sum();
        assert!(total > 20 && rejected < MOST_DRAWS, "{total}");
    }
}
