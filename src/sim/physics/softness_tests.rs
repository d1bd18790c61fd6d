//! Soft objects against the closed form of springs in series, and against finite elements.

use super::closed_form_tests::{Run, bare};
use super::detect::detect;
use super::step::lay_out;
use crate::gripper::PadLaw;
use crate::objects::ObjectModel;
use crate::scene::{Auto, Effect, Scene, Setting};
use glam::DVec3;
use palpate_geometry::Primitive;

/// Force (N) of a fixed object that reaches `depth` (m) into the left pad at half the finger's height; its half
/// extent along x is `half` (m).
fn pressed(scene: &mut Scene, object: &ObjectModel, half: f64, depth: f64) -> f64 {
    scene.object.fixed = true;
    scene.gripper.pad.law = PadLaw::Linear;
    scene.gripper.pad.crown_radius = 1e6;
    (scene.gripper.pad.rows, scene.gripper.pad.columns) = (400, 80);
    scene.gripper.mount.opening = 0.2;
    scene.gripper.mount.grasp_depth = 0.055;
    scene.gripper.mount.offset = [0.1 - half + depth, 0.0, 0.0];
    let mut run = Run::new(scene, Some(object), 1e-3);
    run.ws.step.h = run.h;
    lay_out(&run.model, &run.state, &mut run.ws);
    detect(&run.model, &run.state, &mut run.ws);
    run.ws.contacts.iter().map(|c| c.force(run.ws.step).0 * -c.normal.x).sum()
}

#[test]
fn a_soft_block_and_a_pad_are_two_layers_in_series() {
    // F = A d / (H / E + t / E_o), whatever the two moduli.
    let half = DVec3::new(0.02, 0.1, 0.02);
    let block = ObjectModel::from_primitive("block", Primitive::Cuboid { half }, 500.0, 0.6);
    let force = |modulus: Auto, setting: Setting| {
        let mut scene = bare(10);
        (scene.object.modulus, scene.object.shell) = (modulus, Auto::Value(0.010));
        scene.effects.set(Effect::SoftObject, setting);
        pressed(&mut scene, &block, half.x, 4e-4)
    };
    let pad = Scene::default().gripper.pad;
    let rigid = force(Auto::Auto, Setting::Auto);
    for modulus in [2e3, 5e4, 1e6] {
        let share = (pad.thickness / pad.modulus) / (pad.thickness / pad.modulus + 0.010 / modulus);
        let got = force(Auto::Value(modulus), Setting::On) / rigid;
        // The round ends of the outermost springs lean on the block's edges, where springs give way sideways too.
        assert!((got / share - 1.0).abs() < 0.01, "{modulus} Pa: {got} instead of {share}");
        assert_eq!(force(Auto::Value(modulus), Setting::Off), rigid);
    }
}

#[test]
fn a_soft_ball_presses_like_finite_elements_of_it() {
    // Pads a thousand times as stiff are the plates.
    let radius = 0.02;
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius }, 500.0, 0.6);
    let stored = include_str!("../../../tests/peers/results/soft_sphere.csv");
    let mut compared = 0;
    for line in stored.lines().skip(1) {
        let numbers: Vec<f64> = line.split(',').map(|field| field.parse().expect("a number")).collect();
        let [shell, depth, want] = numbers[..] else { panic!("three columns: {line}") };
        let mut scene = bare(10);
        scene.gripper.pad.modulus = 5e7;
        scene.object.modulus = Auto::Value(5e4);
        // Soft to the middle is what a modulus alone means.
        scene.object.shell = if shell == radius { Auto::Auto } else { Auto::Value(shell) };
        scene.effects.set(Effect::SoftObject, Setting::On);
        let error = pressed(&mut scene, &ball, radius, depth) / want - 1.0;
        // The shares of the module page of `effects/soft_object.rs`.
        let allowed = match (shell, depth) {
            (0.02, 0.001 | 0.002) => 0.20,
            (_, 0.002) => 0.25,
            (0.005, 0.001) => 0.25,
            (_, 0.001) => 0.35,
            _ => continue,
        };
        assert!(error.abs() < allowed, "shell {shell} m, {depth} m: {error}");
        compared += 1;
    }
    assert_eq!(compared, 6);
}

#[test]
fn a_soft_object_sinks_into_its_support_by_its_weight() {
    // m g t / (E A) on the face of the pedestal, and what the support itself gives.
    let half = DVec3::new(0.006, 0.006, 0.01);
    let block = ObjectModel::from_primitive("block", Primitive::Cuboid { half }, 2000.0, 0.6);
    let mut scene = Scene::default();
    scene.gripper.mount.opening = 0.3;
    (scene.object.modulus, scene.object.shell) = (Auto::Value(2e4), Auto::Value(0.005));
    let mut run = Run::new(&scene, Some(&block), 1e-3);
    let start = run.object_centre().z;
    run.steps(2000, &super::step::Drive::default());
    let (weight, face) = (block.mass.mass * scene.world.gravity, 4.0 * half.x * half.y);
    // Four corners carry what three are taken for.
    let want = 0.75 * (weight * 0.005 / (2e4 * face) + weight / 3e4);
    let sunk = start - run.object_centre().z;
    assert!((sunk / want - 1.0).abs() < 0.02, "{sunk} instead of {want}");
}
