//! Whole grasps: every object, fixed and free, and what must hold of each of them. Closed-form answers of single steps
//! stand beside the solver, in `physics::closed_form`.

use crate::allocations::allocations_in;
use palpate_lab::grasping::{GraspSummary, grasp};
use palpate_sim::gripper::Phase;
use palpate_sim::objects::{EMPTY, ObjectModel, catalogue};
use palpate_sim::physics::{Placement, Simulation};
use palpate_sim::scene::{Accuracy, Effect, EngineKind, Scene, Setting};

fn scene_of(name: &str) -> (Scene, Option<ObjectModel>) {
    let mut scene = Scene::default();
    name.clone_into(&mut scene.object.source);
    let object = scene.load_object().unwrap();
    (scene, object)
}

#[test]
fn every_object_is_grasped_fixed_and_free() {
    for built_in in catalogue() {
        let (mut scene, object) = scene_of(&built_in.name);
        for (fixed, accuracy) in [(false, Accuracy::Standard), (true, Accuracy::Standard), (false, Accuracy::Draft)] {
            scene.object.fixed = fixed;
            scene.solver.accuracy = accuracy;
            let what = format!("{}, fixed {fixed}, {accuracy}", built_in.name);
            let trial = grasp(&scene, object.as_ref(), 0);
            let summary = GraspSummary::new(&trial, &scene);
            assert!(summary.finite && summary.converged, "{what}: {:?}", summary.quality);
            assert!(summary.warnings.is_empty(), "{what}: {:?}", summary.warnings);
            let onset = summary.contact_onset_s.unwrap_or(f64::INFINITY);
            assert!((0.1..2.5).contains(&onset), "{what}: first contact at {onset} s");
            let hold = summary.hold.expect("the default programme holds");
            for side in 0..2 {
                assert!(hold.force_n[side] > 0.05, "{what}: {:?}", hold.force_n);
                assert!(hold.pressure_pa[side] > 100.0, "{what}: {:?}", hold.pressure_pa);
            }
            let residual = summary.quality.static_residual;
            assert!(residual < 0.01, "{what}: not at rest at the end of the hold, {residual}");
            if fixed {
                assert_eq!(summary.object_moved_m, Some(0.0), "{what}");
            }
        }
    }
}

/// A grasp advanced to the end of its hold.
fn held(scene: &Scene, object: Option<&ObjectModel>) -> (Simulation, Placement) {
    let (mut simulation, placement) = Simulation::new(scene, object);
    let per_actuation = u64::from(simulation.clock().ticks_per_actuation);
    loop {
        if simulation.tick().is_multiple_of(per_actuation) {
            let (bar, phase) = scene.programme.command((simulation.tick() / per_actuation) as u32);
            if phase == Phase::Release {
                return (simulation, placement);
            }
            simulation.command(bar, phase);
        }
        simulation.advance().unwrap();
    }
}

#[test]
fn contact_carries_the_weight_of_a_held_object() {
    for name in ["lemon", "box", "syringe"] {
        let (mut scene, object) = scene_of(name);
        let mass = object.as_ref().expect("not empty").mass.mass;
        // Long enough for what swings between the fingers to come to rest.
        scene.programme.hold_ticks = 120;
        scene.timing.duration_s = 16.0;
        let (simulation, placement) = held(&scene, object.as_ref());
        let force = placement.world_from_gripper.direction(simulation.object_wrench().0);
        let weight = mass * scene.world.gravity;
        assert!((force.z / weight - 1.0).abs() < 1e-3, "{name}: {force} against {weight} N");
        assert!(force.truncate().length() < 1e-3 * weight.max(1.0), "{name}: {force}");
    }
}

#[test]
fn a_held_object_does_not_creep() {
    let (mut scene, object) = scene_of("lemon");
    scene.timing.duration_s = 26.0;
    // What friction lets slip, not what silicone yields.
    scene.effects.set(Effect::Creep, Setting::Off);
    let mut place_after = |hold_ticks: u32| {
        scene.programme.hold_ticks = hold_ticks;
        held(&scene, object.as_ref()).0.world_from_object().expect("not empty").position
    };
    let (early, late) = (place_after(90), place_after(190));
    let drift = (late - early).length() / 10.0;
    assert!(drift < 1e-6, "it drifts by {} mm/s", drift * 1e3);
}

#[test]
fn a_step_allocates_nothing() {
    let tolerance = Accuracy::Tolerance(1e-4);
    for (name, fixed, accuracy) in [
        ("lemon", false, Accuracy::Standard),
        ("box", false, Accuracy::Standard),
        ("case", true, Accuracy::Standard),
        (EMPTY, false, Accuracy::Standard),
        ("lemon", false, tolerance),
        ("ball", true, tolerance),
    ] {
        let (mut scene, object) = scene_of(name);
        scene.object.fixed = fixed;
        scene.solver.accuracy = accuracy;
        let (mut simulation, _) = Simulation::new(&scene, object.as_ref());
        let mut touching = 0;
        for _ in 0..simulation.clock().total_ticks() {
            simulation.command(1.0, Phase::Hold);
            let (count, report) = allocations_in(|| simulation.advance());
            assert_eq!(count, 0, "{name} at step {}", simulation.tick());
            touching += report.unwrap().contacts;
        }
        assert!(touching > 0, "{name}: nothing was ever touched");
    }
}

/// Joint angles, forces and onset of the same grasps by both engines. rapier's skin is rigid and does not shear, which is
/// worth what the bounds allow: see `physics::rapier_engine`.
#[test]
fn the_second_engine_grasps_alike() {
    for name in ["ball", "cube"] {
        let (mut scene, object) = scene_of(name);
        scene.timing.duration_s = 3.0;
        let ours = grasp(&scene, object.as_ref(), 0);
        scene.solver.engine = EngineKind::Rapier;
        let theirs = grasp(&scene, object.as_ref(), 0);
        assert!(theirs.data.quality.finite && theirs.header.warnings == ours.header.warnings, "{name}");
        assert_eq!(ours.frames().len(), theirs.frames().len());
        let mut squares = 0.0;
        for (a, b) in ours.frames().iter().zip(theirs.frames()) {
            assert_eq!((a.sample, a.t, a.line_bar, a.phase), (b.sample, b.t, b.line_bar, b.phase));
            squares += a.q.iter().zip(&b.q).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.q.len() as f64;
        }
        let apart = (squares / ours.frames().len() as f64).sqrt().to_degrees();
        assert!(apart < 0.25, "{name}: joints are {apart} degrees apart");
        let [ours, theirs] = [ours, theirs].map(|trial| GraspSummary::new(&trial, &scene));
        let onset = |summary: &GraspSummary| summary.contact_onset_s.expect("touched");
        assert!((onset(&ours) - onset(&theirs)).abs() < 0.04, "{name}");
        let force = |summary: &GraspSummary| summary.hold.as_ref().expect("held").force_n;
        for (a, b) in force(&ours).into_iter().zip(force(&theirs)) {
            assert!((b / a - 1.0).abs() < 0.1, "{name}: held with {b} N instead of {a} N");
        }
    }
}
