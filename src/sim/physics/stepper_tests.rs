//! Methods and tolerances against closed forms, against themselves at far finer steps, and in hard cases.

use super::integrator::{Integrator, Surroundings};
use super::step::Drive;
use super::stepper::{PATIENCE, Stepper};
use super::{PhysicsModel, Placement, Simulation, State, Workspace};
use crate::gripper::Phase;
use crate::objects::ObjectModel;
use crate::scene::{Accuracy, IntegrationMethod, Scene, SupportKind};
use palpate_geometry::Primitive;
use proptest::prelude::*;

/// Nothing but two fingers.
fn bare() -> Scene {
    let mut scene = Scene::default();
    scene.world.gravity = 0.0;
    scene.support.kind = SupportKind::None;
    scene
}

fn ball() -> ObjectModel {
    ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6)
}

/// PhysicsModel, state and scratch memory of a scene without an object.
fn set_up(scene: &Scene) -> (PhysicsModel, State, Workspace) {
    let placement = Placement::new(scene, None);
    let model = PhysicsModel::new(scene, None, &placement);
    let state = State::new(&model, &placement);
    let ws = Workspace::new(&model);
    (model, state, ws)
}

/// The middle joint's angle (rad) after steps of `h` under stretches of (torque, duration).
fn bent_after(scene: &Scene, method: IntegrationMethod, h: f64, stretches: &[(f64, f64)]) -> f64 {
    let (model, mut state, mut ws) = set_up(scene);
    let mut integrator = Integrator::new(method, &state);
    for (torque, duration) in stretches {
        let drive = Drive { torque: *torque, ..Drive::default() };
        for _ in 0..(duration / h).round() as usize {
            let mut within = Surroundings { model: &model, ws: &mut ws, drive: &drive };
            assert!(integrator.advance(&mut within, &mut state, h).expect("finite").report.converged);
        }
    }
    state.q[4]
}

/// Almost no mass: theta = (tau / k) (1 - exp(-k t / c)) in every joint. Returns the scene, and theta at 0.1 s.
fn kelvin_voigt() -> (Scene, f64) {
    let mut scene = bare();
    scene.gripper.finger.mass = 1e-6;
    scene.gripper.finger.damping_time = 0.1;
    let stiffness = scene.gripper.finger.joint_stiffness();
    (scene, 0.05 / stiffness * (1.0 - (-1.0f64).exp()))
}

#[test]
fn two_stages_creep_towards_a_bend_at_second_order() {
    let (scene, want) = kelvin_voigt();
    let error = |h: f64| (bent_after(&scene, IntegrationMethod::Sdirk2, h, &[(0.05, 0.1)]) / want - 1.0).abs();
    let errors: Vec<f64> = [0.02, 0.01, 0.005, 0.0025].map(error).into();
    assert!(errors[0] < 2e-3, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((3.5..4.6).contains(&(pair[0] / pair[1])), "second order: {errors:?}");
    }
}

#[test]
fn two_stages_swing_back_far_closer_than_twice_as_many_of_euler() {
    // Inertia and Coriolis forces are those of a stage's start, which leaves a small error of first order.
    let scene = bare();
    let after = |method, h: f64| bent_after(&scene, method, h, &[(0.05, 0.2), (0.0, 0.05)]);
    let reference = after(IntegrationMethod::Sdirk2, 2.5e-5);
    for h in [0.01, 0.005, 0.0025] {
        let two_stages = (after(IntegrationMethod::Sdirk2, h) - reference).abs();
        let euler = (after(IntegrationMethod::Euler, 0.5 * h) - reference).abs();
        assert!(two_stages < 0.1 * euler, "h = {h}: {two_stages} rad, Euler {euler} rad");
    }
}

#[test]
fn a_bend_follows_its_closed_form_as_closely_as_the_tolerance_asks() {
    let (scene, want) = kelvin_voigt();
    for method in [IntegrationMethod::Euler, IntegrationMethod::Sdirk2] {
        let mut before = (f64::INFINITY, 0);
        for tolerance in [1e-3, 1e-4, 1e-5, 1e-6] {
            let (model, mut state, mut ws) = set_up(&scene);
            let mut stepper = Stepper::new(&model, &state, method, Some(tolerance), 0.1);
            let drive = Drive { torque: 0.05, ..Drive::default() };
            let mut within = Surroundings { model: &model, ws: &mut ws, drive: &drive };
            stepper.cover(&mut within, &mut state, 0.1).expect("finite");
            let (error, steps) = ((state.q[4] - want).abs(), stepper.totals.steps);
            // Errors of single steps add up, at most.
            assert!(error < tolerance * steps as f64, "{method:?} at {tolerance:e}: {error} rad in {steps} steps");
            assert!(
                error < 0.6 * before.0 && steps > before.1,
                "{method:?} at {tolerance:e}: {error} after {before:?}"
            );
            // Joints without mass jump to their rate in the first step, which an estimate made of velocities takes for an
            // error, however short the step.
            assert!(stepper.totals.missed <= 1, "{}", stepper.totals.missed);
            before = (error, steps);
        }
    }
}

/// Closes on something to 1 bar in 2 s, holds for 1 s; gives joint angles at every hundredth of a second.
fn close(scene: &Scene, object: &ObjectModel) -> (Vec<Vec<f64>>, Simulation) {
    let (mut simulation, _) = Simulation::new(scene, Some(object));
    let clock = simulation.clock();
    let mut seen = Vec::new();
    while clock.seconds(simulation.tick()) < 3.0 - 1e-9 {
        let tick = simulation.tick() / u64::from(clock.ticks_per_actuation);
        simulation.command(0.05 * (tick + 1).min(20) as f64, Phase::Close);
        simulation.advance_by(u64::from(clock.ticks_per_sample)).expect("finite");
        seen.push(simulation.state().q.clone());
    }
    (seen, simulation)
}

fn grasp_scene(accuracy: Accuracy) -> Scene {
    let mut scene = Scene::default();
    scene.object.fixed = true;
    scene.timing.sample_hz = 50;
    scene.solver.accuracy = accuracy;
    scene
}

#[test]
fn a_grasp_comes_closer_to_the_truth_with_a_smaller_tolerance() {
    let object = ball();
    let (truth, _) = close(&grasp_scene(Accuracy::Tolerance(1e-7)), &object);
    let mut before = f64::INFINITY;
    for tolerance in [1e-2, 3e-5, 3e-6, 3e-7] {
        let (seen, simulation) = close(&grasp_scene(Accuracy::Tolerance(tolerance)), &object);
        let difference = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let error = (seen.iter().zip(&truth).map(difference).sum::<f64>() / seen.len() as f64).sqrt();
        assert!(error < 0.75 * before, "tolerance {tolerance:e}: {error} after {before}");
        assert_eq!(simulation.quality().missed_steps, 0);
        before = error;
    }
    // Well below what steps of 1/300 s leave, at 1.4e-3.
    assert!(before < 2e-5, "{before} rad");
}

#[test]
fn a_quiet_hold_takes_few_steps_and_the_first_contact_short_ones() {
    let object = ball();
    let scene = grasp_scene(Accuracy::Tolerance(1e-6));
    let (mut simulation, _) = Simulation::new(&scene, Some(&object));
    let per_sample = simulation.clock().ticks_per_sample;
    let mut steps_of_sample = Vec::new();
    let mut onset = None;
    for sample in 0..200usize {
        let bar = 0.05 * (sample / 5 + 1).min(20) as f64;
        simulation.command(bar, Phase::Close);
        let before = simulation.quality().steps;
        let contacts = simulation.advance_by(u64::from(per_sample)).expect("finite").contacts;
        steps_of_sample.push(simulation.quality().steps - before);
        if contacts > 0 && onset.is_none() {
            onset = Some(sample);
        }
    }
    let onset = onset.expect("the ball is met");
    let near_onset = steps_of_sample[onset - 1..onset + 3].iter().max().copied().unwrap_or(0);
    let quiet = &steps_of_sample[180..];
    assert!(quiet.iter().all(|steps| *steps <= 1), "{quiet:?}");
    assert!(near_onset >= 8, "around {onset}: {steps_of_sample:?}");
    assert!(simulation.quality().rejected_steps > 0);
}

#[test]
fn steps_chosen_by_error_repeat_and_go_on_from_a_copy() {
    let object = ball();
    let scene = grasp_scene(Accuracy::Tolerance(1e-4));
    let (seen, whole) = close(&scene, &object);
    assert_eq!(close(&scene, &object).0, seen);
    let mut copy = whole.clone();
    let mut original = whole;
    for _ in 0..50 {
        for simulation in [&mut copy, &mut original] {
            simulation.command(0.2, Phase::Release);
            simulation.advance().expect("finite");
        }
        assert_eq!(copy.state(), original.state());
    }
}

#[test]
fn undamped_stiff_joints_and_passive_swings_stay_tame() {
    // k up to x 1e6, no damping: static bend within 0.1 %; and over 2 s of swinging into a free ball no energy is
    // gained, but for a thousandth that the inertia frozen at a stage's start may lend.
    for factor in [1e3, 1e6] {
        for h in [1e-3, 0.01, 0.1] {
            let mut scene = bare();
            scene.gripper.finger.bending_stiffness *= factor;
            scene.gripper.finger.damping_time = 0.0;
            let q = bent_after(&scene, IntegrationMethod::Sdirk2, h, &[(0.05, 2000.0 * h)]);
            let want = 0.05 / scene.gripper.finger.joint_stiffness();
            assert!((q / want - 1.0).abs() < 1e-3, "x {factor}, h = {h}: {q} instead of {want}");
        }
    }
    for accuracy in [Accuracy::Tolerance(1e-2), Accuracy::Tolerance(1e-5)] {
        let mut scene = Scene::default();
        scene.gripper.finger.damping_time = 0.0;
        scene.gripper.pad.dissipation = 0.0;
        scene.solver.accuracy = accuracy;
        let (mut simulation, _) = Simulation::new(&scene, Some(&ball()));
        let bend: f64 = -0.055;
        simulation.state_mut().q.fill(bend);
        let elastic = 10.0 * scene.gripper.finger.joint_stiffness() * bend.powi(2);
        let start = simulation.energy();
        let mut highest = start;
        for _ in 0..300 {
            simulation.advance().expect("finite");
            highest = highest.max(simulation.energy());
        }
        assert!(highest < start + 1e-3 * elastic && simulation.energy() < start, "{accuracy}: {start} J, {highest} J");
    }
}

#[test]
fn a_tolerance_that_cannot_be_met_is_counted() {
    // A finger born inside a ball, with a stiff pad: no step of 20 µs is short enough for 1e-9.
    let mut scene = grasp_scene(Accuracy::Tolerance(1e-9));
    scene.gripper.pad.modulus *= 1e3;
    scene.gripper.mount.offset = [0.03, 0.0, 0.0];
    let (mut simulation, _) = Simulation::new(&scene, Some(&ball()));
    for _ in 0..10 {
        simulation.advance().expect("finite");
    }
    let quality = simulation.quality();
    assert!(quality.missed_steps > 0, "{quality:?}");
    assert!(
        quality.least_step_s <= 1.001 / 50.0 / 1024.0 && quality.solves >= 2 * quality.steps + quality.missed_steps
    );
}

#[test]
fn a_tolerance_that_is_missed_for_ever_costs_a_bounded_number_of_steps() {
    // No step is that exact. A floor that stays takes 92 250 steps.
    let (mut simulation, _) = Simulation::new(&grasp_scene(Accuracy::Tolerance(1e-16)), Some(&ball()));
    for tick in 0..90 {
        simulation.command(if tick % 10 < 5 { 0.5 } else { 0.2 }, Phase::Close);
        simulation.advance().expect("finite");
    }
    let quality = simulation.quality();
    assert!(quality.missed_steps > PATIENCE, "{quality:?}");
    assert!(quality.steps < 30_000, "{quality:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_ball_is_grasped_to_any_tolerance(
        radius in 0.010..0.030f64,
        density in 10f64..8000.0,
        friction in 0f64..2.0,
        digits in 2f64..5.0,
        fixed: bool,
        euler: bool,
    ) {
        let object = ObjectModel::from_primitive("ball", Primitive::Sphere { radius }, density, friction);
        let mut scene = grasp_scene(Accuracy::Tolerance(10f64.powf(-digits)));
        scene.object.fixed = fixed;
        scene.solver.integrator = if euler { crate::scene::Integrator::Euler } else { crate::scene::Integrator::Sdirk2 };
        let (seen, simulation) = close(&scene, &object);
        let quality = simulation.quality();
        prop_assert!(quality.converged && quality.missed_steps == 0, "{quality:?}");
        prop_assert!(quality.steps >= seen.len() as u64);
        let stages = if euler { 1 } else { 2 };
        prop_assert_eq!(quality.solves, stages * (quality.steps + quality.rejected_steps));
        prop_assert!(seen.iter().flatten().all(|q| q.abs() < 0.5));
    }
}
