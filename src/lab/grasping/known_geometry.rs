//! Grasps of objects whose geometry is known, to train and judge the geometry encoder: random shapes, or any object.

use super::agreement::{Recompute, grasp_soundly};
use crate::datasets::{SensorView, sequence_of};
use glam::DVec3;
use palpate_geometry::Pose;
use palpate_learn::{Geometry, Measure, Touch};
use palpate_sim::objects::{ObjectError, ObjectModel, RandomShape, ShapeClass};
use palpate_sim::poses::PoseSampler;
use palpate_sim::scene::Scene;
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Channel, LayoutError};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Approximate shapes that the geometry encoder distinguishes.
pub const SHAPES: [ShapeClass; 3] = [ShapeClass::Cubic, ShapeClass::Cylindrical, ShapeClass::Spherical];

/// Simulated grasps of objects of known geometry.
#[derive(Clone, Debug)]
pub struct KnownGrasps {
    /// Scene without the object: poses, gripper, accuracy.
    pub scene: Scene,
    /// How the grasps are read.
    pub view: SensorView,
    /// Objects: built-in ones, random shapes, files.
    pub objects: Vec<String>,
    /// Poses of each.
    pub poses: u64,
    /// Whether the object is fixed: each pose is grasped once for each.
    pub fixed: Vec<bool>,
    /// Seed of the poses.
    pub seed: u64,
}

/// Error of simulating grasps of known geometry.
#[derive(Debug, thiserror::Error)]
pub enum KnownGeometryError {
    /// An object failed to load.
    #[error(transparent)]
    Object(#[from] ObjectError),
    /// The gripper has no such sensors.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// Names of random shapes.
pub fn random_shapes(seeds: Range<u64>) -> Vec<String> {
    seeds.map(|seed| format!("random:{seed}")).collect()
}

impl KnownGrasps {
    /// Names of the readings.
    pub fn channels(&self) -> Result<Vec<String>, LayoutError> {
        let channels = self.view.learnt()?.channels(&self.scene.gripper, self.view.signals)?;
        Ok(channels.iter().map(Channel::name).collect())
    }

    /// Simulates the grasps on all threads of the current pool, in the order of the objects. Grasps that are not sound are
    /// left out. Ends early, with what there is, once `stop` is set.
    pub fn simulate(&self, stop: &AtomicBool) -> Result<Vec<Touch>, KnownGeometryError> {
        let of_object = |object: usize| match stop.load(Ordering::Relaxed) {
            true => Ok(Vec::new()),
            false => self.touches_of(object),
        };
        let made: Vec<Vec<Touch>> =
            (0..self.objects.len()).into_par_iter().map(of_object).collect::<Result<_, KnownGeometryError>>()?;
        Ok(made.into_iter().flatten().collect())
    }

    fn touches_of(&self, number: usize) -> Result<Vec<Touch>, KnownGeometryError> {
        let mut scene = self.scene.clone();
        scene.object.source.clone_from(&self.objects[number]);
        let Some(object) = scene.load_object()? else { return Ok(Vec::new()) };
        let sampler = PoseSampler::new(&scene, Some(&object));
        let mut touches = Vec::new();
        for seed in seeds_of(&object, self.seed).take(self.poses as usize) {
            let (mut drawn, _) = sampler.draw(Some(&object), seed);
            for &fixed in &self.fixed {
                drawn.object.fixed = fixed;
                let trial = grasp_soundly(&drawn, Some(&object), seed, Recompute::Unsettled);
                if let Some(geometry) = geometry_of(&trial, &object).filter(|_| trial.data.quality.is_sound()) {
                    let readings = self.view.readings(&trial)?;
                    touches.extend(readings.iter().map(|signals| {
                        let grasp = Arc::new(sequence_of(signals));
                        Touch { grasp, geometry: geometry.clone(), object: number }
                    }));
                }
            }
        }
        Ok(touches)
    }
}

/// Seeds of grasps of an object.
pub(super) fn seeds_of(object: &ObjectModel, seed: u64) -> impl Iterator<Item = u64> {
    let mut seeds = ChaCha8Rng::seed_from_u64(seed ^ object.content);
    std::iter::repeat_with(move || seeds.random_range(1..i64::MAX as u64))
}

/// Geometry of the object as the gripper found it; `None` for a trial without frames.
pub fn geometry_of(trial: &SimulatedTrial, object: &ObjectModel) -> Option<Geometry> {
    let world_from_object = trial.frames().first()?.world_from_object?;
    let gripper_from_object = trial.data.world_from_gripper.inverse() * world_from_object;
    let [from, to] = reaches(object, &gripper_from_object);
    let (middle, extents) = (0.5 * (from + to), to - from);
    let mut sides = object.bounds.size().to_array();
    sides.sort_by(f64::total_cmp);
    let value = |measure: Measure| match measure {
        Measure::Short => sides[0],
        Measure::Middle => sides[1],
        Measure::Long => sides[2],
        Measure::Width => extents.x,
        Measure::Depth => extents.y,
        Measure::Height => extents.z,
        Measure::Aside => middle.x.abs(),
        Measure::Across => middle.y.abs(),
        Measure::Below => -middle.z,
        Measure::Mass => object.mass.mass,
    };
    let shape = object.class.map(|class| class.shape);
    let shape = shape.or_else(|| RandomShape::named(&object.name).map(|shape| shape.class));
    let shape = shape.and_then(|shape| SHAPES.iter().position(|own| *own == shape));
    Some(Geometry { values: Measure::ALL.map(value), shape })
}

/// Least and greatest coordinates of an object along the gripper's axes (m).
fn reaches(object: &ObjectModel, gripper_from_object: &Pose) -> [DVec3; 2] {
    let along = |axis: DVec3| {
        let of_object = gripper_from_object.rotation.inverse() * axis;
        object.resting.reach(of_object) + gripper_from_object.position.dot(axis)
    };
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    [DVec3::from_array(axes.map(|axis| -along(-axis))), DVec3::from_array(axes.map(along))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;

    #[test]
    fn geometry_is_seen_from_the_gripper() {
        let mut scene = Scene::default();
        scene.timing.duration_s = 0.1;
        scene.object.source = "jenga".to_owned();
        let object = scene.load_object().expect("loads").expect("an object");
        let [short, middle, long] = {
            let mut sides = object.bounds.size().to_array();
            sides.sort_by(f64::total_cmp);
            sides
        };
        scene.gripper.mount.yaw_deg = 0.0;
        let at = |yaw_deg: f64| {
            let mut scene = scene.clone();
            scene.gripper.mount.yaw_deg = yaw_deg;
            geometry_of(&grasp(&scene, Some(&object), 0), &object).expect("has frames")
        };
        let (straight, turned, oblique) = (at(0.0).values, at(90.0).values, at(45.0).values);
        assert_eq!(straight[..3], [short, middle, long]);
        assert_eq!(at(0.0).shape, Some(0), "cubic");
        // A quarter of a turn exchanges width and depth.
        assert!((straight[3] - turned[4]).abs() < 1e-6 && (straight[4] - turned[3]).abs() < 1e-6, "{straight:?}");
        assert!((straight[3] - straight[4]).abs() > 1e-3, "{straight:?}");
        let diagonal = (straight[3] + straight[4]) * 0.5_f64.sqrt();
        assert!((oblique[3] - diagonal).abs() < 1e-6, "{oblique:?}");
        assert!(straight[8] > 0.02 && straight[8] < 0.2, "below the palm: {straight:?}");
    }

    #[test]
    fn grasps_of_random_shapes_are_repeatable() {
        let mut scene = Scene::default();
        scene.timing.duration_s = 0.5;
        let (view, objects) = (SensorView::default(), random_shapes(3..6));
        let grasps = KnownGrasps { scene, view, objects, poses: 1, fixed: vec![false, true], seed: 1 };
        let stop = AtomicBool::new(false);
        let (a, b) = (grasps.simulate(&stop).expect("simulates"), grasps.simulate(&stop).expect("simulates"));
        assert!((4..=6).contains(&a.len()), "{}", a.len());
        let readings = |touches: &[Touch]| touches.iter().map(|t| t.grasp.content()).collect::<Vec<_>>();
        assert_eq!(readings(&a), readings(&b));
        stop.store(true, Ordering::Relaxed);
        assert!(grasps.simulate(&stop).expect("ends").is_empty());
    }
}
