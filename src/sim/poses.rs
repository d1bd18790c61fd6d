//! Random poses: the gripper is shifted and turned over the resting object, which may lie on another face. Seeded, so
//! that a seed names a pose.

use crate::frame::Frame;
use crate::gripper::{BUILD, GripperModel};
use crate::objects::ObjectModel;
#[cfg(feature = "rapier")]
use crate::physics::natural_rotations;
use crate::physics::random_rotation;
use crate::run::SimRun;
use crate::scene::{Faces, ObjectSetup, Scene, SupportKind};
use glam::{DQuat, DVec2, EulerRot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Draws before a scene without room is accepted.
const MOST_DRAWS: u32 = 100;

/// Sampler of poses for one object in one scene, by the scene's `pose`.
#[derive(Clone, Debug)]
pub struct PoseSampler {
    scene: Scene,
    /// Resting orientations to draw from; empty where the scene does not use them.
    natural: Vec<DQuat>,
}

impl PoseSampler {
    /// Prepares to draw; finding the natural faces takes some tenths of a second.
    pub fn new(scene: &Scene, object: Option<&ObjectModel>) -> Self {
        let natural = object.filter(|_| scene.uses_resting_faces()).map(natural_rotations).unwrap_or_default();
        Self { scene: scene.clone(), natural }
    }

    /// The scene about which poses are drawn.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene in the pose that `seed` names, and how many draws were thrown away because the open fingers would
    /// have stood inside the object.
    pub fn draw(&self, object: Option<&ObjectModel>, seed: u64) -> (Scene, u32) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut drawn = self.scene.clone();
        for rejected in 0..MOST_DRAWS {
            self.draw_once(&mut drawn, &mut random);
            if has_room(&drawn, object) {
                return (drawn, rejected);
            }
        }
        (drawn, MOST_DRAWS)
    }

    /// The scene of a grasp that follows another of the same object, which the fingers have left as in
    /// `released`. It stays there if the scene is set so and it still lies on its support; in all other cases this is
    /// [`PoseSampler::draw`].
    pub fn draw_after(&self, object: Option<&ObjectModel>, seed: u64, released: Option<&Frame>) -> (Scene, u32) {
        let left = released.and_then(|frame| self.left_behind(object?, frame));
        let Some(object_setup) = left else { return self.draw(object, seed) };
        let lying = Self { scene: Scene { object: object_setup, ..self.scene.clone() }, natural: Vec::new() };
        lying.draw(object, seed)
    }

    /// True for a scene of [`PoseSampler::draw_after`] in which the object stayed as it was left.
    pub fn is_left(&self, drawn: &Scene) -> bool {
        self.scene.pose.between.leaves_object() && drawn.object.shift != self.scene.object.shift
    }

    /// The object's setup in the pose in which it was left; `None` where it is to be put down anew.
    fn left_behind(&self, object: &ObjectModel, frame: &Frame) -> Option<ObjectSetup> {
        let pose = frame.world_from_object?;
        if !self.scene.pose.between.leaves_object() || self.scene.holds_object() {
            return None;
        }
        let centre = pose.point(object.mass.centre);
        let support = &self.scene.support;
        let (top, reach) = match support.kind {
            SupportKind::Pedestal => (support.height, support.radius),
            SupportKind::Table => (0.0, f64::INFINITY),
            SupportKind::None => return None,
        };
        let offset = centre.truncate() - DVec2::from_array(self.scene.object.shift);
        if centre.z < top || offset.length() > reach || !centre.is_finite() {
            return None;
        }
        let mut scene = self.scene.clone();
        lay(&mut scene, pose.rotation);
        scene.object.shift = centre.truncate().to_array();
        scene.check().is_ok().then_some(scene.object)
    }

    fn draw_once(&self, drawn: &mut Scene, random: &mut ChaCha8Rng) {
        let (nominal, spread) = (&self.scene.gripper.mount, &self.scene.pose);
        let mut within = |most: f64| most * (2.0 * random.random::<f64>() - 1.0);
        let mount = &mut drawn.gripper.mount;
        for axis in 0..3 {
            mount.offset[axis] = nominal.offset[axis] + within(spread.shift[axis]);
        }
        // A whole turn more or less is the same pose, and keeps to the range of scene files.
        let yaw = nominal.yaw_deg + within(spread.yaw_deg);
        mount.yaw_deg = if yaw.abs() > 180.0 { (yaw + 180.0).rem_euclid(360.0) - 180.0 } else { yaw };
        match spread.faces {
            Faces::Natural | Faces::Any if !self.natural.is_empty() => {
                lay(drawn, self.natural[random.random_range(0..self.natural.len())]);
            }
            Faces::Any if self.scene.holds_object() => lay(drawn, random_rotation(random)),
            Faces::Any | Faces::Nominal | Faces::Natural => {}
        }
        if spread.build > 0.0 {
            self.draw_build(&mut drawn.gripper, random);
        }
    }

    /// Another gripper of the same kind.
    fn draw_build(&self, drawn: &mut GripperModel, random: &mut ChaCha8Rng) {
        let (nominal, share) = (&self.scene.gripper, self.scene.pose.build);
        let mut factor = |[low, high]: [f64; 2]| 1.0 + share * (random.random_range(low..=high) - 1.0);
        let stiffness = factor(nominal.fitted.map_or(BUILD.stiffness, |fitted| fitted.stiffness));
        drawn.finger.bending_stiffness = nominal.finger.bending_stiffness * stiffness;
        drawn.pad.modulus = nominal.pad.modulus * factor(BUILD.pad_modulus);
        drawn.pad.friction = nominal.pad.friction * factor(BUILD.pad_friction);
        let torque = match nominal.fitted {
            Some(fitted) => stiffness * factor(fitted.torque_per_stiffness),
            None => factor(BUILD.torque),
        };
        drawn.actuation.curve.clone_from(&nominal.actuation.curve);
        drawn.actuation.curve.iter_mut().for_each(|point| point.torque *= torque);
        let [least, most] = nominal.fitted.map_or(BUILD.filling_s, |fitted| fitted.filling_s);
        let filling_s = share * random.random_range(least..=most);
        drawn.actuation.filling_time = (nominal.actuation.filling_time + filling_s).max(0.0);
        // The one that is drawn is known.
        drawn.fitted = None;
    }
}

/// Whether a scene is valid and its open fingers do not stand inside the object.
pub fn has_room(scene: &Scene, object: Option<&ObjectModel>) -> bool {
    scene.check().is_ok() && SimRun::new(scene, object).0.starting_overlap() <= 0.0
}

/// Without the feature no object can be dropped; [`Scene::check`] refuses scenes that need it.
#[cfg(not(feature = "rapier"))]
fn natural_rotations(_object: &ObjectModel) -> Vec<DQuat> {
    Vec::new()
}

/// Sets the object's orientation.
fn lay(scene: &mut Scene, rotation: DQuat) {
    let (yaw, pitch, roll) = rotation.to_euler(EulerRot::ZYX);
    scene.object.rotation_deg = [roll, pitch, yaw].map(f64::to_degrees);
}

/// Draws one pose of an object in a scene; for many, keep a [`PoseSampler`].
pub fn jittered(scene: &Scene, object: Option<&ObjectModel>, seed: u64) -> (Scene, u32) {
    PoseSampler::new(scene, object).draw(object, seed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gripper::FittedRanges;
    use crate::scene::Between;
    #[cfg(feature = "rapier")]
    use crate::scene::{PRESETS, PosePreset};
    use glam::DVec3;
    use palpate_geometry::Primitive;

    fn brick() -> ObjectModel {
        ObjectModel::from_primitive("brick", Primitive::Cuboid { half: DVec3::new(0.015, 0.03, 0.006) }, 500.0, 0.5)
    }

    #[cfg(feature = "rapier")]
    #[test]
    fn a_seed_names_a_pose_within_its_range() {
        for preset in PRESETS {
            let scene = Scene { pose: preset.poses(), ..Scene::default() };
            let sampler = PoseSampler::new(&scene, Some(&brick()));
            let (first, _) = sampler.draw(Some(&brick()), 7);
            assert_eq!(jittered(&scene, Some(&brick()), 7).0, first, "{}", preset.name);
            assert_ne!(sampler.draw(Some(&brick()), 8).0, first);
            for (offset, most) in first.gripper.mount.offset.iter().zip(scene.pose.shift) {
                assert!(offset.abs() <= most);
            }
            assert!(first.gripper.mount.yaw_deg.abs() <= scene.pose.yaw_deg && first.gripper.mount.yaw_deg != 0.0);
            assert_eq!(first.object.rotation_deg == [0.0; 3], scene.pose.faces == Faces::Nominal, "{}", preset.name);
        }
    }

    #[cfg(feature = "rapier")]
    #[test]
    fn natural_faces_are_flat_ones() {
        let poses = PosePreset::named("B").expect("in the list").poses();
        let sampler = PoseSampler::new(&Scene { pose: poses, ..Scene::default() }, Some(&brick()));
        for seed in 1..20 {
            let [roll, pitch, yaw] = sampler.draw(Some(&brick()), seed).0.object.rotation_deg.map(f64::to_radians);
            let up = palpate_geometry::Pose::from_xyz_rpy(DVec3::ZERO, DVec3::new(roll, pitch, yaw))
                .inverse()
                .direction(DVec3::Z);
            assert!(up.abs().max_element() > 0.99, "seed {seed}: {up}");
        }
    }

    #[test]
    fn builds_differ_around_the_scenes_own_and_poses_stay() {
        let mut scene = Scene::default();
        let plain = jittered(&scene, None, 7).0;
        scene.pose.build = 1.0;
        let (a, b) = (jittered(&scene, None, 7).0, jittered(&scene, None, 8).0);
        assert_eq!((&a.gripper.mount, &a.object), (&plain.gripper.mount, &plain.object));
        assert_eq!(jittered(&scene, None, 7).0.gripper, jittered(&scene, None, 7).0.gripper);
        let stiffness = [&a, &b].map(|s| s.gripper.finger.bending_stiffness / scene.gripper.finger.bending_stiffness);
        assert!(stiffness[0] != stiffness[1] && stiffness.iter().all(|f| (0.75..=1.25).contains(f)), "{stiffness:?}");
        let torque = b.gripper.actuation.torque(1.0) / scene.gripper.actuation.torque(1.0);
        assert!(torque != 1.0 && (0.83..=1.17).contains(&torque) && b.check().is_ok(), "{torque}");
        assert!((0.0..=0.12).contains(&b.gripper.actuation.filling_time));
        scene.pose.build = 2.0;
        assert!(scene.check().is_err());
    }

    #[test]
    fn builds_of_a_fitted_gripper_stay_within_what_the_fit_leaves_open() {
        let mut scene = Scene::default();
        scene.pose.build = 1.0;
        let fitted =
            FittedRanges { stiffness: [0.9, 1.1], torque_per_stiffness: [0.99, 1.01], filling_s: [-0.2, 0.01] };
        scene.gripper.fitted = Some(fitted);
        assert_eq!(Scene::from_toml(&scene.to_toml()).expect("reads").gripper.fitted, Some(fitted));
        let [mut least, mut most] = [f64::INFINITY, 0.0_f64];
        for seed in 0..100 {
            let own = jittered(&scene, None, seed).0.gripper;
            let nominal = &scene.gripper;
            let stiffness = own.finger.bending_stiffness / nominal.finger.bending_stiffness;
            let torque = own.actuation.torque(1.0) / nominal.actuation.torque(1.0);
            assert!((0.99..=1.01).contains(&(torque / stiffness)), "{torque} {stiffness}");
            assert!((0.0..=nominal.actuation.filling_time + 0.01).contains(&own.actuation.filling_time));
            assert!(own.fitted.is_none() && jittered(&scene, None, seed).0.check().is_ok());
            (least, most) = (least.min(stiffness), most.max(stiffness));
        }
        assert!((0.9..0.93).contains(&least) && (1.07..1.1).contains(&most), "{least} {most}");
        scene.gripper.fitted = Some(FittedRanges { stiffness: [1.1, 0.9], ..fitted });
        assert!(scene.check().is_err(), "a range that ends before it begins");
    }

    #[test]
    fn poses_stay_within_the_range_of_scene_files() {
        let mut scene = Scene::default();
        scene.gripper.mount.yaw_deg = 179.0;
        for seed in 0..20 {
            assert!(jittered(&scene, None, seed).0.check().is_ok());
        }
    }

    #[test]
    fn an_object_stays_as_it_was_left_unless_it_fell() {
        let mut scene = Scene::default();
        scene.pose.between = Between::AsReleased;
        let sampler = PoseSampler::new(&scene, Some(&brick()));
        // Many a brick falls off the slim pedestal when it is released; some do not.
        let after = |seed: u64| {
            let (first, _) = sampler.draw(Some(&brick()), seed);
            let released = SimRun::new(&first, Some(&brick()))
                .0
                .run_programme(&first.programme)
                .expect("finite")
                .pop()
                .expect("has frames");
            let (next, _) = sampler.draw_after(Some(&brick()), 4, Some(&released));
            (first, released, next)
        };
        let kept = (1..40).map(after).find(|(_, _, next)| next.object.shift != [0.0; 2]);
        let (first, mut released, next) = kept.expect("one of forty stays");
        let placed = crate::physics::Placement::new(&next, Some(&brick())).world_from_object.expect("an object");
        let left = released.world_from_object.expect("an object");
        assert!((placed.position - left.position).length() < 3e-4, "{placed:?} instead of {left:?}");
        assert!(placed.rotation.dot(left.rotation).abs() > 0.999_999);
        assert_ne!(next.gripper.mount, first.gripper.mount, "the gripper comes from elsewhere");
        assert!(sampler.is_left(&next) && !sampler.is_left(&first));

        let again = sampler.draw(Some(&brick()), 4);
        released.world_from_object = Some(palpate_geometry::Pose { position: DVec3::Z * 0.005, ..left });
        assert_eq!(sampler.draw_after(Some(&brick()), 4, Some(&released)), again, "it fell off its pedestal");
        assert_eq!(sampler.draw_after(Some(&brick()), 4, None), again);
    }

    #[test]
    fn colliding_poses_are_drawn_again() {
        // 80 mm between pads that are 84 mm apart: most shifts collide.
        let slab = Primitive::Cuboid { half: DVec3::new(0.040, 0.02, 0.02) };
        let object = ObjectModel::from_primitive("slab", slab, 500.0, 0.5);
        let mut wide = Scene::default();
        (wide.pose.shift, wide.pose.yaw_deg) = ([0.008; 3], 0.0);
        let (scene, rejected) = jittered(&wide, Some(&object), 3);
        assert!(scene.gripper.mount.offset[0].abs() < 0.0021 + 1e-9, "{:?}", scene.gripper.mount.offset);
        let total: u32 = (0..20).map(|seed| jittered(&wide, Some(&object), seed).1).sum();
        assert!(total > 20 && rejected < MOST_DRAWS, "{total}");
    }
}
