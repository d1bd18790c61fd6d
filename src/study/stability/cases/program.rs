//! Hard cases of the program around the solver.

use super::super::{CaseAccuracy, Conditions, Findings, Measurement};
use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_lab::grasping::grasp;
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{Accuracy, Scene};
use palpate_tactile::trial::SimulatedTrial;

pub(super) fn same_bytes(conditions: &Conditions) -> Findings {
    let mut scene = Scene::default();
    scene.solver.accuracy = match conditions.setting {
        CaseAccuracy::Accuracy(accuracy) => accuracy,
        CaseAccuracy::Step(_) => Accuracy::Standard,
    };
    scene.timing.duration_s = conditions.span(4.0).max(0.8);
    let shapes =
        [Primitive::Cuboid { half: DVec3::splat(0.0225) }, Primitive::Cylinder { radius: 0.0175, half_length: 0.03 }];
    let objects = shapes.map(|shape| ObjectModel::from_primitive("it", shape, 400.0, 0.6));
    let grasped = |object: &ObjectModel| grasp(&scene, Some(object), 0);
    let once: Vec<SimulatedTrial> = objects.iter().map(grasped).collect();
    let (forth, mut back) = std::thread::scope(|scope| {
        let forth = scope.spawn(|| objects.iter().map(grasped).collect::<Vec<_>>());
        let back: Vec<SimulatedTrial> = objects.iter().rev().map(grasped).collect();
        (forth.join().unwrap_or_default(), back)
    });
    back.reverse();
    let differing = |other: &[SimulatedTrial]| {
        let pairs = once.iter().zip(other).flat_map(|(a, b)| a.frames().iter().zip(b.frames()));
        let lost = once.iter().map(|t| t.frames().len()).sum::<usize>() - pairs.clone().count();
        lost + pairs.filter(|(a, b)| a != b).count()
    };
    Ok(vec![
        Measurement::at_most("frames that differ in another thread", differing(&forth) as f64, 0.0),
        Measurement::at_most("frames that differ in another order", differing(&back) as f64, 0.0),
        Measurement::at_least("frames", once.iter().map(|t| t.frames().len()).sum::<usize>() as f64, 100.0),
    ])
}

pub(super) fn invalid_numbers(_conditions: &Conditions) -> Findings {
    let scene = Scene::default();
    let (mut tried, mut let_in, mut unnamed) = (0, 0, 0);
    for key in Scene::keys().iter().filter(|key| key.holds_fractions()) {
        for value in ["nan", "inf", "-inf"] {
            tried += 1;
            match scene.with_settings(&[key.with(value)]) {
                Ok(_) => let_in += 1,
                Err(error) => unnamed += i32::from(!error.to_string().contains(&key.name)),
            }
        }
    }
    Ok(vec![
        Measurement::at_most("values let in", f64::from(let_in), 0.0),
        Measurement::at_most("refusals that do not name the key", f64::from(unnamed), 0.0),
        Measurement::at_least("values tried", f64::from(tried), 100.0),
    ])
}
