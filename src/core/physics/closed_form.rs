//! The step against answers from textbooks. Every scene is tiny and its answer can be checked by hand.

use super::contact::{Acting, Against};
use super::detect::detect;
use super::step::{Drive, lay_out, step};
use super::{Model, Placement, State, Workspace};
use crate::geometry::Primitive;
use crate::gripper::{Finger, PadLaw};
use crate::objects::ObjectModel;
use crate::scene::{Auto, Effect, Scene, Setting, SupportKind};
use glam::DVec3;

/// No gravity, no support, no object, and two fingers that know nothing of each other.
pub(super) fn bare(joints: usize) -> Scene {
    let mut scene = Scene::default();
    scene.world.gravity = 0.0;
    scene.support.kind = SupportKind::None;
    scene.gripper.finger.joints = joints;
    scene.effects.set(Effect::FingerContact, Setting::Off);
    scene
}

pub(super) struct Run {
    pub(super) model: Model,
    pub(super) state: State,
    pub(super) ws: Workspace,
    pub(super) h: f64,
}

impl Run {
    pub(super) fn new(scene: &Scene, object: Option<&ObjectModel>, h: f64) -> Self {
        let placement = Placement::new(scene, object);
        Self::of(Model::new(scene, object, &placement), &placement, h)
    }

    pub(super) fn of(model: Model, placement: &Placement, h: f64) -> Self {
        let state = State::new(&model, placement);
        let ws = Workspace::new(&model);
        Self { model, state, ws, h }
    }

    pub(super) fn steps(&mut self, count: usize, drive: &Drive) {
        for _ in 0..count {
            let report = step(&self.model, &mut self.state, &mut self.ws, drive, self.h).expect("finite");
            assert!(report.converged);
        }
    }

    /// Tip of the left finger relative to its root, inward and along (m).
    fn tip(&self) -> (f64, f64) {
        let n = self.model.chain.joints;
        let mut segments = vec![crate::gripper::SegmentPose::default(); n + 1];
        let tip = self.model.chain.bend(&self.state.q[..n], &mut segments);
        (tip.x, tip.y)
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
            let model = Model::new(&scene, None, &Placement::new(&scene, None));
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
fn lowest_modes(model: &Model) -> [f64; 2] {
    let n = model.chain.joints;
    let mut segments = vec![crate::gripper::SegmentPose::default(); n + 1];
    model.chain.bend(&vec![0.0; n], &mut segments);
    let mut m = vec![0.0; n * n];
    model.chain.inertia(&segments, &mut m);
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
    // F = pi R E delta² / H, as the taxels are refined.
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
    assert!((force / want - 1.0).abs() < 0.02, "{force} instead of {want}");
}

#[test]
fn a_passive_gripper_gains_no_energy() {
    // Bent outward, let go without damping, with a free ball in reach of the swing back: over 2 s no net rise, and no
    // step gains more than the frozen inertia and explicit Coriolis forces account for.
    let rise = |h: f64| -> f64 {
        let mut scene = Scene::default();
        scene.gripper.finger.damping_time = 0.0;
        scene.gripper.pad.dissipation = 0.0;
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        let mut run = Run::new(&scene, Some(&ball), h);
        run.state.q[..10].fill(-0.06);
        run.state.q[10..].fill(-0.05);
        let energy = |run: &Run| super::energy::mechanical_energy(&run.model, &run.state);
        let start = energy(&run);
        let (mut before, mut largest) = (start, 0.0f64);
        for _ in 0..(2.0 / h) as usize {
            run.steps(1, &Drive::default());
            let now = energy(&run);
            largest = largest.max(now - before);
            before = now;
        }
        assert!(before < start, "h = {h}: {start} J became {before} J");
        largest
    };
    for h in [5e-3, 2e-3, 5e-4] {
        let largest = rise(h);
        assert!(largest < 1e-6, "a step of {h} s gained {largest} J");
    }
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
fn stiff_joints_bend_as_little_as_they_should() {
    // k times 1e3 .. 1e6, no damping, steps up to 0.1 s: finite, and the static bend within 0.1 %.
    for factor in [1e3, 1e4, 1e6] {
        for h in [1e-3, 0.01, 0.1] {
            let mut scene = bare(10);
            scene.gripper.finger.bending_stiffness *= factor;
            scene.gripper.finger.damping_time = 0.0;
            let mut run = Run::new(&scene, None, h);
            run.steps(2000, &torque(0.05));
            let want = 0.05 / run.model.chain.stiffness;
            for q in &run.state.q {
                assert!((q / want - 1.0).abs() < 1e-3, "x {factor}, h = {h}: {q} instead of {want}");
            }
        }
    }
}

#[test]
fn joint_limits_hold_against_any_pressure() {
    let mut run = Run::new(&bare(10), None, 1.0 / 300.0);
    run.steps(600, &torque(20.0 * 0.06));
    let limit = run.model.chain.angle_limit;
    assert!(run.state.q.iter().all(|q| *q < 1.05 * limit), "{:?}", run.state.q);
}

#[test]
fn a_free_object_in_flight_keeps_its_momentum() {
    let mut scene = bare(10);
    scene.gripper.mount.opening = 0.5;
    let brick =
        ObjectModel::from_primitive("brick", Primitive::Cuboid { half: DVec3::new(0.03, 0.015, 0.006) }, 800.0, 0.5);
    // Spins up to half a turn per step.
    for (h, spin) in [(1e-3, 1.0), (1e-2, 100.0), (1e-3, 1000.0)] {
        flies_freely(&scene, &brick, h, DVec3::new(3.0, 0.1, 0.2) * spin);
    }
}

fn flies_freely(scene: &Scene, brick: &ObjectModel, h: f64, angular: DVec3) {
    let mut run = Run::new(scene, Some(brick), h);
    run.state.velocity[20..].copy_from_slice(&[0.01, 0.0, 0.02, angular.x, angular.y, angular.z]);
    let spin = |run: &Run| {
        let r = run.state.body.matrix();
        let (linear, angular) = run.state.body_velocity(&run.model);
        (linear, r * (brick.mass.inertia * (r.transpose() * angular)))
    };
    let before = spin(&run);
    run.steps((2.0 / h) as usize, &Drive::default());
    let after = spin(&run);
    assert!(after.0.abs_diff_eq(before.0, 1e-12));
    assert!((after.1 - before.1).length() < 1e-9 * before.1.length(), "{before:?} {after:?}");
    let least = brick.mass.inertia.to_cols_array().iter().step_by(4).copied().fold(f64::INFINITY, f64::min);
    let fastest = before.1.length() / least;
    let now = run.state.body_velocity(&run.model).1.length();
    assert!(now <= fastest * (1.0 + 1e-9), "{now} rad/s, but the momentum allows {fastest} at most");
}

#[test]
fn a_resting_object_sinks_as_far_as_the_scene_allows() {
    for mass in [1e-4, 0.05, 100.0] {
        let mut scene = Scene::default();
        scene.object.mass = Auto::Value(mass);
        let mut cube =
            ObjectModel::from_primitive("cube", Primitive::Cuboid { half: DVec3::splat(0.0225) }, 500.0, 0.5);
        cube.mass = cube.mass.with_mass(mass);
        let mut run = Run::new(&scene, Some(&cube), 1.0 / 300.0);
        let start = run.state.body.position;
        run.steps(3000, &Drive::default());
        let sunk = start.z - run.state.body.position.z;
        assert!((0.0..=1.1 * scene.support.sink).contains(&sunk), "{mass} kg sank {sunk} m");
        let creep = (run.state.body.position - start).truncate().length();
        assert!(creep < 1e-9, "{mass} kg crept {creep} m");
        let carried: f64 = run.ws.contacts.iter().map(|c| c.force(run.ws.step).0).sum();
        assert!((carried / (mass * scene.world.gravity) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn without_friction_nothing_is_dragged() {
    let mut scene = Scene::default();
    scene.object.fixed = true;
    scene.gripper.pad.friction = 0.0;
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.025 }, 400.0, 0.6);
    let mut run = Run::new(&scene, Some(&ball), 1.0 / 300.0);
    run.steps(600, &torque(0.05));
    let forces: Vec<_> = run.ws.contacts.iter().map(|c| c.force(run.ws.step)).collect();
    assert!(forces.iter().any(|(normal, _)| *normal > 0.01));
    assert!(forces.iter().all(|(_, tangential)| tangential.length() < 1e-12));
}

#[test]
fn strong_friction_stays_in_its_cone() {
    for mu in [0.5, 5.0] {
        let mut scene = Scene::default();
        scene.gripper.pad.friction = mu;
        scene.object.friction = Auto::Value(mu);
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.025 }, 400.0, mu);
        let mut run = Run::new(&scene, Some(&ball), 1.0 / 300.0);
        let mut worst = 0.0f64;
        for k in 0..900 {
            run.steps(1, &torque(1e-4 * f64::from(k.min(600))));
            let (mut used, mut allowed) = (0.0, 0.0);
            for c in run.ws.contacts.iter().filter(|c| c.acting != Acting::Object && c.against == Against::Object) {
                let (normal, tangential) = c.force(run.ws.step);
                used += tangential.length();
                allowed += c.mu * normal;
            }
            if allowed > 0.02 {
                worst = worst.max(used / allowed);
            }
        }
        assert!(worst < 1.05, "mu = {mu}: friction reached {worst} of its cone");
    }
}

#[test]
fn thin_things_are_not_crossed() {
    let thin = [
        ("plate", Primitive::Cuboid { half: DVec3::new(0.0005, 0.02, 0.03) }, [0.0; 3]),
        ("card edge-on", Primitive::Cuboid { half: DVec3::new(0.02, 0.0005, 0.03) }, [0.0; 3]),
        ("needle across", Primitive::Cylinder { radius: 0.0005, half_length: 0.03 }, [90.0, 0.0, 0.0]),
        ("needle along", Primitive::Cylinder { radius: 0.0005, half_length: 0.03 }, [0.0; 3]),
    ];
    for (name, shape, rotation_deg) in thin {
        for h in [1.0 / 150.0, 1.0 / 300.0] {
            let mut scene = Scene::default();
            scene.object.fixed = true;
            scene.object.rotation_deg = rotation_deg;
            scene.gripper.mount.offset = [0.0, 0.0007, -0.012];
            let object = ObjectModel::from_primitive(name, shape, 400.0, 0.6);
            let mut run = Run::new(&scene, Some(&object), h);
            let ticks = (3.0 / h) as usize;
            let mut touched = false;
            for k in 0..ticks {
                run.steps(1, &torque(0.12 * (2.0 * k as f64 / ticks as f64).min(1.0)));
                touched |= run.ws.contacts.iter().any(|c| c.force(run.ws.step).0 > 0.01);
            }
            assert!(touched, "{name} was never felt at h = {h}");
            let deepest = run.ws.contacts.iter().map(|c| c.compression).fold(0.0, f64::max);
            assert!(deepest < scene.gripper.pad.thickness, "{name}: {deepest} m deep at h = {h}");
            let (across, _) = run.tip();
            assert!(across < run.model.planes[0].half_gap + 0.002, "{name} was crossed at h = {h}");
        }
    }
}

#[test]
fn an_object_born_inside_a_finger_leaves_gently() {
    let mut scene = Scene::default();
    scene.world.gravity = 0.0;
    scene.support.kind = SupportKind::None;
    scene.gripper.mount.offset = [0.032, 0.0, 0.02]; // the ball's surface lies 10 mm inside the left pad's skin
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
    let mut run = Run::new(&scene, Some(&ball), 1.0 / 300.0);
    let start = super::energy::mechanical_energy(&run.model, &run.state);
    let mut fastest = 0.0f64;
    for _ in 0..600 {
        run.steps(1, &Drive::default());
        fastest = fastest.max(run.state.body_velocity(&run.model).0.length());
    }
    let bound = (2.0 * start / ball.mass.mass).sqrt();
    assert!(fastest > 0.01 && fastest < bound, "{fastest} m/s, the stored energy allows {bound}");
}

#[test]
fn numbers_out_of_range_are_reported_with_the_body() {
    let mut run = Run::new(&bare(10), None, 1e-3);
    run.state.velocity[13] = f64::NAN;
    let error = step(&run.model, &mut run.state, &mut run.ws, &Drive::default(), run.h).expect_err("NaN");
    assert!(error.to_string().contains("right finger"), "{error}");
}
