//! Fingers that bend sideways and twist, against closed forms of beams, and against fingers that do not.

use super::closed_form_tests::{Run, bare, torque};
use super::contact::Against;
use super::coupling::{fill_coupling, prepare_coupling};
use super::detect::detect;
use super::integrator::{Integrator, Surroundings};
use super::solve::{
    Product, diagonal, fill_gradient, fill_hessian, multiply_by_a, relative_velocities, segment_velocities,
};
use super::state::State;
use super::step::{Drive, gather_dynamics, lay_out};
use super::{PhysicsModel, Simulation};
use crate::gripper::{Phase, Sideways, Sway};
use crate::objects::ObjectModel;
use crate::scene::{Accuracy, Auto, Effect, IntegrationMethod, Scene, Setting};
use glam::DVec3;
use palpate_geometry::Primitive;

/// Bending and torsional stiffness of the tests (N m²).
const EI: f64 = 4.2e-3;
const GJ: f64 = 2.4e-3;

fn sideways(bending: f64, torsion: f64) -> Sideways {
    Sideways { bending_stiffness: Auto::Value(bending), torsional_stiffness: Auto::Value(torsion) }
}

fn bare_in_space(joints: usize) -> Scene {
    let mut scene = bare(joints);
    scene.gripper.finger.sideways = sideways(EI, GJ);
    scene.effects.set(Effect::OutOfPlane, Setting::On);
    scene
}

fn across(force: f64) -> Drive {
    Drive { tip_force: [DVec3::Y * force, DVec3::ZERO], ..Drive::default() }
}

/// Tip of the left finger in the gripper frame (m).
fn tip(run: &mut Run) -> DVec3 {
    lay_out(&run.model, &run.state, &mut run.ws);
    run.ws.space.as_ref().expect("in space").tip(&run.model, 0)
}

#[test]
fn a_force_across_the_tip_bends_a_cantilever_sideways() {
    // F L³ / 3 E I, of which joints in the middle of N segments take 1 - 1 / (4 N²).
    for joints in [2, 10, 40] {
        let mut run = Run::new(&bare_in_space(joints), None, 0.02);
        let length = run.finger_length();
        let force = 0.01 * 3.0 * EI / length.powi(2);
        run.steps(1000, &across(force));
        let want = 0.01 * length * (1.0 - 0.25 / (joints * joints) as f64);
        let got = tip(&mut run).y;
        assert!((got / want - 1.0).abs() < 1e-3, "N = {joints}: {got} instead of {want}");
        assert!(run.state.sways[1] == Sway::NONE && run.state.sways[0].twist.abs() < 1e-9);
    }
}

#[test]
fn a_force_across_a_bent_finger_twists_it_as_a_curved_beam() {
    // Bent evenly into an arc of radius R, psi = (L - s) / R from the tip: moment F R sin psi, torque F R (1 - cos psi).
    let angle = 1.0;
    let mut run = Run::new(&bare_in_space(40), None, 0.02);
    let (length, force) = (run.finger_length(), 2e-3);
    let bent = torque(run.model.chain.stiffness * angle / 40.0);
    run.steps(500, &bent);
    let before = tip(&mut run);
    run.steps(1500, &Drive { tip_force: across(force).tip_force, ..bent });
    let got = (tip(&mut run) - before).y;
    let radius = length / angle;
    let parts = 2000;
    let mean = |of: &dyn Fn(f64, f64) -> f64| {
        (0..parts)
            .map(|k| (f64::from(k) + 0.5) / f64::from(parts))
            .map(|share| of(share, angle * (1.0 - share)))
            .sum::<f64>()
            / f64::from(parts)
    };
    let bending = mean(&|share, psi| (1.0 - share) * radius * psi.sin());
    let twist = mean(&|_, psi| radius * (1.0 - psi.cos()));
    let sway = Sway { curvature: force * bending * 3.0 / EI, twist: force * twist / GJ };
    // Twist that turns the pad's face against y is that which a force along y does to a finger bent inward, reversed.
    let Sway { curvature, twist: twisted } = run.state.sways[0];
    assert!((curvature / sway.curvature - 1.0).abs() < 5e-3, "{curvature} instead of {}", sway.curvature);
    assert!((twisted.abs() / sway.twist - 1.0).abs() < 5e-3, "{twisted} instead of {}", sway.twist);
    let two_shapes = length * (sway.curvature * bending + sway.twist * twist);
    assert!((got / two_shapes - 1.0).abs() < 5e-3, "{got} instead of {two_shapes}");
    // The exact one has torsion that falls from the palm; an even twist takes part of it only.
    let exact =
        force * length * mean(&|_, psi| (radius * psi.sin()).powi(2) / EI + (radius * (1.0 - psi.cos())).powi(2) / GJ);
    assert!((0.88..1.0).contains(&(got / exact)), "{got} of {exact}");
}

#[test]
fn a_load_beside_the_middle_of_a_pad_twists_the_finger() {
    // A fixed ball reaches into the pad 6 mm beside its middle: the torque F y turns all before it by T s / G J.
    let mut scene = bare_in_space(40);
    scene.object.fixed = true;
    scene.gripper.pad.crown_radius = 1e6;
    scene.gripper.pad.friction = 0.0;
    scene.gripper.mount.opening = 0.2;
    scene.gripper.mount.grasp_depth = 0.085;
    scene.gripper.mount.offset = [0.1 - 0.004 + 5e-4, -0.006, 0.0];
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.004 }, 500.0, 0.0);
    let mut run = Run::new(&scene, Some(&ball), 0.01);
    run.steps(3000, &Drive::default());
    let axis = -run.half_gap();
    let (mut turned, mut torque) = (0.0, 0.0);
    for contact in &run.ws.contacts {
        let (normal, tangential) = contact.force(run.ws.step);
        let (place, force) = (run.ws.reference + contact.arm, contact.normal * normal + tangential);
        let about_axis = (place.x - axis) * force.y - place.y * force.x;
        torque += about_axis;
        turned += about_axis * -place.z / (GJ * run.finger_length());
    }
    let twist = run.state.sways[0].twist;
    // Against the along axis, which points down.
    assert!((twist / -turned - 1.0).abs() < 0.03, "{twist} instead of {}", -turned);
    assert!(torque.abs() > 1e-5, "{torque}");
    // The pad's face turns away from what presses on its side of positive y.
    assert!(twist.is_sign_negative() == (run.object_centre().y > 0.0), "{twist}");
}

#[test]
fn a_finger_swings_sideways_at_the_frequency_of_its_shape() {
    // Deflection a (s² / 2 - s³ / 6 L): omega² = (E I L / 3) / (11 / 420 m L⁴), 1.5 % above that of a cantilever.
    let mut scene = bare_in_space(40);
    let finger = &mut scene.gripper.finger;
    (finger.damping_time, finger.back, finger.width) = (0.0, 0.0, 1e-3);
    scene.gripper.pad.thickness = 1e-4;
    let want = (EI / 3.0 * 420.0 / 11.0 / (scene.gripper.finger.mass * scene.gripper.finger.length.powi(3))).sqrt();
    let h = std::f64::consts::TAU / want / 4000.0;
    let mut run = Run::new(&scene, None, h);
    run.state.sways[0].curvature = 0.1;
    let mut crossings = Vec::new();
    for k in 0..10_500 {
        let before = run.state.sways[0].curvature;
        run.steps(1, &Drive::default());
        let after = run.state.sways[0].curvature;
        if before > 0.0 && after <= 0.0 {
            crossings.push((f64::from(k) + before / (before - after)) * h);
        }
    }
    let got = std::f64::consts::TAU / (crossings[1] - crossings[0]);
    assert!((got / want - 1.0).abs() < 2e-3, "{got} instead of {want}");
}

#[test]
fn undamped_motion_in_space_keeps_its_energy() {
    // Bent, swayed and twisted at once, with weight: whatever forces of inertia lacked would show here.
    // Two joints, so that steps resolve every mode.
    let mut scene = bare_in_space(2);
    scene.world.gravity = 9.81;
    scene.gripper.finger.damping_time = 0.0;
    let drift = |h: f64| {
        let mut run = Run::new(&scene, None, h);
        run.state.q.copy_from_slice(&[0.5, 0.3, 0.2, 0.6]);
        run.state.sways = [Sway { curvature: 9.0, twist: -6.0 }, Sway { curvature: -4.0, twist: 8.0 }];
        let mut integrator = Integrator::new(IntegrationMethod::Sdirk2, &run.state);
        let (start, elastic) = (run.energy(), 0.5 * run.model.chain.stiffness * (0.25 + 0.09 + 0.04 + 0.36));
        let mut worst = 0.0f64;
        for _ in 0..(0.2 / h).round() as usize {
            let mut within = Surroundings { model: &run.model, ws: &mut run.ws, drive: &Drive::default() };
            integrator.advance(&mut within, &mut run.state, h).expect("finite");
            worst = worst.max((run.energy() - start).abs());
        }
        worst / elastic
    };
    // As in the plane, forces of inertia that are explicit leave an error of first order.
    let (coarse, fine) = (drift(1e-4), drift(2.5e-5));
    assert!(fine < 4e-3 && (3.3..4.7).contains(&(coarse / fine)), "{coarse} {fine}");
}

fn ball() -> ObjectModel {
    ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.015 }, 500.0, 0.6)
}

/// A grasp 5 mm beside the middle, at the programme's pressure for a second.
fn held(scene: &Scene, steps: u32) -> Run {
    let mut run = Run::new(scene, Some(&ball()), 1.0 / 300.0);
    let full = scene.gripper.actuation.torque(scene.programme.peak_bar);
    for k in 0..steps {
        run.steps(1, &torque(full * (f64::from(k) / 300.0).min(1.0)));
    }
    run
}

fn beside(stiffness: Option<f64>) -> Scene {
    let mut scene = Scene::default();
    scene.gripper.mount.offset = [0.0, 0.005, 0.0];
    scene.solver.tolerance = 1e-11;
    if let Some(factor) = stiffness {
        scene.gripper.finger.sideways = sideways(factor * EI, factor * GJ);
        scene.effects.set(Effect::OutOfPlane, Setting::On);
    }
    scene
}

#[test]
fn very_stiff_fingers_are_those_that_stay_in_their_planes() {
    let rigid = held(&beside(None), 700);
    let apart = |factor: f64| {
        let run = held(&beside(Some(factor)), 700);
        assert_eq!(run.model.unknowns(), 30);
        run.state.q.iter().zip(&rigid.state.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let (soft, stiff, stiffer) = (apart(1.0), apart(1e4), apart(1e6));
    assert!(soft > 1e-3 && stiff < 2e-5 && stiffer < 1e-6, "{soft} {stiff} {stiffer}");
}

#[test]
fn mirrored_scenes_stay_mirrored() {
    let run = held(&beside(Some(1.0)), 700);
    let (left, right) = run.state.q.split_at(10);
    let apart = left.iter().zip(right).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let [left, right] = run.state.sways;
    assert!(apart < 1e-9 && (left.twist - right.twist).abs() < 1e-7, "{apart} {left:?} {right:?}");
    assert!(left.twist.abs() > 0.1, "{left:?}");
    // Mirrored in the plane of the fingers, all goes the other way.
    let mut scene = beside(Some(1.0));
    scene.gripper.mount.offset[1] *= -1.0;
    let other = held(&scene, 700);
    let sum = |a: f64, b: f64| (a + b).abs();
    let mirrored = other.state.sways[0];
    assert!(sum(mirrored.twist, left.twist) < 1e-7 && sum(mirrored.curvature, left.curvature) < 1e-7, "{mirrored:?}");
}

#[test]
fn an_object_held_beside_the_middle_is_in_balance() {
    let mut scene = beside(Some(1.0));
    scene.solver.accuracy = Accuracy::Tolerance(1e-4);
    let ball = ball();
    let (mut run, _) = Simulation::new(&scene, Some(&ball));
    run.command(scene.programme.peak_bar, Phase::Hold);
    let ticks = 4 * u64::from(run.clock().ticks_per_sample) * 75;
    run.advance_by(ticks).expect("finite");
    let (force, moment) = run.object_wrench();
    let weight = ball.mass.mass * scene.world.gravity;
    assert!((force - DVec3::Z * weight).length() < 0.01 * weight, "{force} holds {weight} N");
    assert!(moment.length() < 0.01 * weight * 0.015, "{moment}");
    let quality = run.quality();
    assert!(quality.static_residual < 1e-3 && quality.converged, "{quality:?}");
    assert!(run.state().sways[0].twist.abs() > 0.1);
}

/// The gradient's change along a direction is the Hessian times it, for the solution of H d = g.
#[test]
fn the_hessian_is_the_slope_of_the_gradient() {
    let mut crossed = beside(Some(1.0));
    crossed.gripper.mount.offset[2] = 0.03;
    for (mut run, meets) in [(held(&beside(Some(1.0)), 400), false), (held(&crossed, 700), true)] {
        let model = run.model.clone();
        lay_out(&model, &run.state, &mut run.ws);
        gather_dynamics(&model, &run.state, &mut run.ws, &torque(0.01));
        segment_velocities(&model, &run.state.velocity, &mut run.ws);
        detect(&model, &run.state, &mut run.ws);
        let between = run.ws.contacts.iter().filter(|c| matches!(c.against, Against::Finger(_)) && c.compression > 0.0);
        assert_eq!(between.count() > 0, meets);
        for contact in &mut run.ws.contacts {
            // Far from the kink of the slip limit.
            contact.limit *= 10.0;
        }
        let ws = &mut run.ws;
        prepare_coupling(ws);
        ws.weights.fill(1.0);
        let gradient = |velocity: &[f64], ws: &mut super::Workspace| {
            multiply_by_a(&model, ws, velocity, Product::OfVelocity);
            relative_velocities(&model, velocity, ws, Product::OfVelocity);
            fill_gradient(&model, &run.state.q, velocity, ws);
            ws.gradient.clone()
        };
        let velocity = run.state.velocity.clone();
        let start = gradient(&velocity, ws);
        fill_hessian(&model, &run.state.q, &velocity, ws);
        fill_coupling(&model, ws);
        ws.hessian.factorise();
        for unknown in [3, 14, 22, 27, 26, 28, 29] {
            let mut direction = vec![0.0; velocity.len()];
            direction[unknown] = 1.0;
            ws.hessian.solve(&mut direction);
            let size = direction.iter().map(|d| d.abs()).fold(0.0, f64::max);
            let step = 1e-7 / size;
            let ends = [step, -step].map(|step| {
                let moved: Vec<f64> = velocity.iter().zip(&direction).map(|(v, d)| v + step * d).collect();
                gradient(&moved, ws)
            });
            for (k, (plus, minus)) in ends[0].iter().zip(&ends[1]).enumerate() {
                let slope = (plus - minus) / (2.0 * step);
                let want = if k == unknown { 1.0 } else { 0.0 };
                let scale = (diagonal(&model, ws, k) / diagonal(&model, ws, unknown)).sqrt();
                assert!((slope - want).abs() < 1e-5 * scale.max(1.0), "meets {meets}: {k} along {unknown}: {slope}");
            }
        }
        assert_eq!(start.len(), 30);
    }
}

#[test]
fn forces_across_do_nothing_where_fingers_stay_in_their_planes() {
    let mut run = Run::new(&bare(10), None, 0.02);
    run.steps(100, &across(0.5));
    assert!(run.state.sways == [Sway::NONE; 2] && run.state.q.iter().all(|q| *q == 0.0));
    let off = {
        let mut scene = bare_in_space(10);
        scene.effects.set(Effect::OutOfPlane, Setting::Off);
        PhysicsModel::new(&scene, None, &super::Placement::new(&scene, None))
    };
    assert_eq!(off.unknowns(), 20);
    let state = State::new(&off, &super::Placement::new(&Scene::default(), None));
    assert_eq!(state.velocity.len(), 20);
}
