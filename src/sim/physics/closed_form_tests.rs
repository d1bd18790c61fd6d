//! The step against answers from textbooks. Every scene is tiny and its answer can be checked by hand. Hard cases stand
//! in `palpate-study`.

use super::chain::BothSegments;
use super::detect::detect;
use super::hessian::Lanes;
use super::step::{Drive, lay_out, step};
use super::{PhysicsModel, Placement, SteppedScene};
use crate::gripper::{Finger, PadLaw};
use crate::objects::ObjectModel;
use crate::scene::{Effect, Scene, Setting, SupportKind};
use glam::DVec3;
use palpate_geometry::Primitive;

/// No gravity, no support, no object, and two fingers that know nothing of each other.
pub(super) fn bare(joints: usize) -> Scene {
    let mut scene = Scene::default();
    scene.world.gravity = 0.0;
    scene.support.kind = SupportKind::None;
    scene.gripper.finger.joints = joints;
    scene.effects.set(Effect::FingerContact, Setting::Off);
    scene
}

/// Scenes that tests step by hand.
pub(super) type Run = SteppedScene;

impl SteppedScene {
    /// Takes steps that must all converge.
    pub(super) fn steps(&mut self, count: usize, drive: &Drive) {
        for _ in 0..count {
            let report = self.step(drive).expect("finite");
            assert!(report.converged);
        }
    }
}

pub(super) fn torque(torque: f64) -> Drive {
    Drive { torque, ..Drive::default() }
}

/// A force inward on the left tip only (N).
fn tip_force(force: f64) -> Drive {
    Drive { tip_force: [DVec3::X * force, DVec3::ZERO], ..Drive::default() }
}

#[test]
fn a_moment_bends_every_joint_alike() {
    for joints in [2, 10, 80] {
        let mut run = Run::new(&bare(joints), None, 0.01);
        run.steps(2000, &torque(0.05));
        let want = 0.05 / run.model.chain.stiffness;
        for q in &run.state.q {
            assert!((q / want - 1.0).abs() < 1e-9, "N = {joints}: {q} instead of {want}");
        }
    }
}

#[test]
fn a_tip_force_tends_to_the_elastica_at_second_order() {
    // E I theta'' = -F cos theta. Tip at F L² / E I = 1: y/L = .301721, x/L = .943567; at 4: .669964, .671059.
    for (load, across, ahead) in [(1.0, 0.301_721, 0.943_567), (4.0, 0.669_964, 0.671_059)] {
        let errors: Vec<f64> = [10, 20, 40]
            .map(|joints| {
                let mut scene = bare(joints);
                scene.gripper.finger.curvature_limit = 1e4;
                let finger = scene.gripper.finger.clone();
                let mut run = Run::new(&scene, None, 0.02);
                run.steps(1500, &tip_force(load * finger.bending_stiffness / finger.length.powi(2)));
                let (x, y) = run.tip();
                (x / finger.length - across).hypot(y / finger.length - ahead)
            })
            .into();
        assert!(errors[0] < 2.6e-3, "N = 10 at load {load}: {errors:?}");
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((3.6..4.4).contains(&ratio), "second order at load {load}: {errors:?}");
        }
    }
}

#[test]
fn a_cantilever_rings_at_its_modes() {
    // omega = (beta / L)² sqrt(E I / (rho A)), beta = 1.8751, 4.6941; the chain's own from det(K - omega² M) = 0.
    let want = |beta: f64, f: &Finger| (beta / f.length).powi(2) * (f.bending_stiffness * f.length / f.mass).sqrt();
    let errors: Vec<[f64; 2]> = [10, 20, 40]
        .map(|joints| {
            let mut scene = bare(joints);
            scene.gripper.finger.back = 0.0;
            scene.gripper.pad.thickness = 1e-4; // a thin beam: no rotary inertia beyond that of its segments
            let model = PhysicsModel::new(&scene, None, &Placement::new(&scene, None));
            let modes = lowest_modes(&model);
            [(modes[0], 1.8751), (modes[1], 4.6941)].map(|(got, beta)| got / want(beta, &scene.gripper.finger) - 1.0)
        })
        .into();
    assert!(errors[0][0].abs() < 0.01 && errors[0][1].abs() < 0.05, "{errors:?}");
    for pair in errors.windows(2) {
        for (mode, (coarse, fine)) in pair[0].iter().zip(&pair[1]).enumerate() {
            assert!((3.3..4.7).contains(&(coarse / fine)), "mode {mode}: {errors:?}");
        }
    }
}

/// The two lowest natural frequencies of the straight chain (rad/s), by inverse iteration with deflation.
fn lowest_modes(model: &PhysicsModel) -> [f64; 2] {
    let n = model.chain.joints;
    let mut both = vec![BothSegments::default(); n + 1];
    model.chain.bend_both(&vec![0.0; 2 * n], &mut both);
    let mut m = vec![Lanes::ZERO; n * n];
    model.chain.inertia(&both, &mut m);
    let m: Vec<f64> = m.iter().map(|lanes| lanes.to_array()[0]).collect();
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let times_m = |x: &[f64]| -> Vec<f64> { m.chunks_exact(n).map(|row| dot(row, x)).collect() };
    let mut found: Vec<(Vec<f64>, f64)> = Vec::new();
    for _ in 0..2 {
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64 * 2.3).sin()).collect();
        let mut omega = 0.0;
        for _ in 0..400 {
            for (mode, _) in &found {
                let share = dot(&times_m(mode), &x) / dot(&times_m(mode), mode);
                x.iter_mut().zip(mode).for_each(|(x, m)| *x -= share * m);
            }
            // K is k times the unit matrix, so K⁻¹ M x is M x / k.
            let next: Vec<f64> = times_m(&x).iter().map(|y| y / model.chain.stiffness).collect();
            omega = (dot(&x, &x) / dot(&x, &next)).sqrt();
            let size = dot(&next, &next).sqrt();
            x = next.iter().map(|y| y / size).collect();
        }
        found.push((x, omega));
    }
    [found[0].1, found[1].1]
}

#[test]
fn creep_towards_a_bend_is_kelvin_voigt_at_first_order_in_h() {
    // Almost no mass: theta = (tau / k) (1 - exp(-k t / c)) in every joint.
    let error_at = |h: f64| -> f64 {
        let mut scene = bare(10);
        scene.gripper.finger.mass = 1e-6;
        scene.gripper.finger.damping_time = 0.1;
        let mut run = Run::new(&scene, None, h);
        run.steps((0.1 / h).round() as usize, &torque(0.05));
        let want = 0.05 / run.model.chain.stiffness * (1.0 - (-1.0f64).exp());
        (run.state.q[4] / want - 1.0).abs()
    };
    let errors: Vec<f64> = [0.01, 0.005, 0.0025, 0.00125].map(error_at).into();
    assert!(errors[0] < 0.04, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((1.8..2.2).contains(&(pair[0] / pair[1])), "first order: {errors:?}");
    }
}

#[test]
fn free_motion_converges_at_first_order_in_h() {
    // A finger with its real mass, let go from a moment, against itself at a far smaller step.
    let tip_at = |h: f64| -> f64 {
        let mut run = Run::new(&bare(10), None, h);
        run.steps((0.2 / h).round() as usize, &torque(0.05));
        run.steps((0.05 / h).round() as usize, &torque(0.0));
        run.tip().0
    };
    let reference = tip_at(2e-5);
    let errors: Vec<f64> = [0.01, 0.005, 0.0025, 0.00125].map(|h| (tip_at(h) - reference).abs()).into();
    for pair in errors.windows(2) {
        assert!((1.6..2.4).contains(&(pair[0] / pair[1])), "first order: {errors:?}");
    }
}

#[test]
fn a_ball_on_a_thin_linear_pad_is_a_winkler_foundation() {
    // As the taxels are refined, springs become rods without width: one at the distance rho from the axis is pushed in by
    // x = delta - rho² / 2R and presses with E x / H along its own axis. In all this is pi R E delta² / H.
    let (radius, depth) = (0.02, 5e-4);
    let mut scene = bare(10);
    scene.object.fixed = true;
    scene.gripper.pad.law = PadLaw::Linear;
    scene.gripper.pad.crown_radius = 1e6;
    (scene.gripper.pad.rows, scene.gripper.pad.columns) = (400, 64);
    // The ball reaches `depth` into the left pad, half way down the finger.
    scene.gripper.mount.opening = 0.2;
    scene.gripper.mount.grasp_depth = 0.055;
    scene.gripper.mount.offset = [0.1 - radius + depth, 0.0, 0.0];
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius }, 500.0, 0.0);
    let mut run = Run::new(&scene, Some(&ball), 1e-3);
    run.ws.step.h = run.h;
    lay_out(&run.model, &run.state, &mut run.ws);
    detect(&run.model, &run.state, &mut run.ws);
    let force: f64 = run.ws.contacts.iter().map(|c| c.force(run.ws.step).0 * -c.normal.x).sum();
    let pad = &scene.gripper.pad;
    let want = std::f64::consts::PI * radius * pad.modulus * depth * depth / pad.thickness;
    assert!((force / want - 1.0).abs() < 0.01, "{force} instead of {want}");
}

#[test]
fn a_mirrored_scene_stays_mirrored() {
    let shapes = [
        (Primitive::Sphere { radius: 0.02 }, [0.0; 3]),
        (Primitive::Cuboid { half: DVec3::splat(0.0225) }, [0.0; 3]),
        (Primitive::Cylinder { radius: 0.0175, half_length: 0.03 }, [0.0; 3]),
    ];
    for (shape, rotation_deg) in shapes {
        for fixed in [true, false] {
            let mut scene = Scene::default();
            scene.object.fixed = fixed;
            scene.object.rotation_deg = rotation_deg;
            let object = ObjectModel::from_primitive("it", shape, 400.0, 0.6);
            let mut run = Run::new(&scene, Some(&object), 1.0 / 300.0);
            for k in 0..700 {
                run.steps(1, &torque(1e-4 * f64::from(k.min(600))));
                let (left, right) = run.state.q.split_at(10);
                let apart = left.iter().zip(right).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-12, "{shape:?} fixed {fixed} step {k}: {apart}");
            }
        }
    }
}

#[test]
fn numbers_out_of_range_are_reported_with_the_body() {
    let mut run = Run::new(&bare(10), None, 1e-3);
    run.state.velocity[13] = f64::NAN;
    let error = step(&run.model, &mut run.state, &mut run.ws, &Drive::default(), run.h).expect_err("NaN");
    assert!(error.to_string().contains("right finger"), "{error}");
}
