//! A shaken hand against mechanics by hand: m a on what it holds, a finger that sways as a cantilever, a world that
//! stays where it is.

use super::closed_form_tests::{Run, bare};
use super::step::Drive;
use super::{Placement, Simulation};
use crate::gripper::Phase;
use crate::objects::ObjectModel;
use crate::scene::{Accuracy, Auto, Effect, Scene, Setting};
use glam::DVec3;
use palpate_geometry::Primitive;

fn ball() -> ObjectModel {
    ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6)
}

/// A long hold, shaken along a direction.
fn shaken(amplitude: f64, frequency: f64, direction: [f64; 3]) -> Scene {
    let mut scene = Scene::default();
    scene.programme.hold_ticks = 30;
    scene.timing.duration_s = 5.0;
    let shaking = &mut scene.shaking;
    (shaking.amplitude, shaking.frequency, shaking.direction) = (amplitude, frequency, direction);
    scene
}

#[test]
fn a_shaken_finger_sways_as_a_cantilever_under_its_inertia() {
    // Slowly: x = m a L³ / (8 E I), and by 1 / (1 - (omega / omega_1)²) more, omega_1 = 1.8751² sqrt(E I / (m L³)).
    for frequency in [0.25, 1.0] {
        let mut scene = bare(20);
        let shaking = &mut scene.shaking;
        (shaking.amplitude, shaking.frequency, shaking.direction) = (0.02, frequency, [1.0, 0.0, 0.0]);
        (shaking.start, shaking.end, shaking.lift) = (Auto::Value(0.0), Auto::Value(100.0), 0.0);
        // Slower than what a sensor sees, which `auto` leaves out.
        scene.effects.set(Effect::Shaking, Setting::On);
        let finger = scene.gripper.finger.clone();
        let mut run = Run::new(&scene, None, 1e-3);
        // Two periods and a half, from the end of the lift's time on.
        run.steps((1e3 * (0.3 + 1.5 / frequency)) as usize, &Drive::default());
        let mut largest = 0.0f64;
        for _ in 0..(1e3 / frequency) as usize {
            run.steps(1, &Drive::default());
            largest = largest.max(run.tip().0);
        }
        let omega = std::f64::consts::TAU * frequency;
        let compliance = finger.mass * finger.length.powi(3) / finger.bending_stiffness;
        let slowest = 1.8751f64.powi(2) / compliance.sqrt();
        let amplified = 1.0 / (1.0 - (omega / slowest).powi(2));
        let want = compliance * 0.02 * omega * omega / 8.0 * amplified;
        assert!((largest / want - 1.0).abs() < 0.01, "{frequency} Hz: {largest} instead of {want}");
    }
}

#[test]
fn what_is_held_is_carried_by_its_mass_times_its_acceleration() {
    for direction in [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
        let mut scene = shaken(0.004, 2.0, direction);
        scene.solver.accuracy = Accuracy::Tolerance(1e-5);
        let ball = ball();
        let mut simulation = Simulation::new(&scene, Some(&ball)).0;
        let motion = scene.hand_motion().expect("shaken");
        let along = DVec3::from_array(direction);
        let (mass, gravity) = (ball.mass.mass, DVec3::Z * scene.world.gravity);
        let (mut worst, mut largest, mut apart) = (0.0f64, 0.0f64, 0.0f64);
        let mut places = Vec::new();
        let mut before = DVec3::ZERO;
        for k in 0..370 {
            let (bar, phase) = scene.programme.command(k * 10 / 75);
            simulation.command(bar, phase);
            simulation.advance_by(u64::from(simulation.clock().ticks_per_sample)).expect("finite");
            let t = f64::from(k + 1) / 75.0;
            places.push(simulation.world_from_object().expect("an object").position);
            // From the end of the lift to the end of the shaking.
            if phase == Phase::Hold && t > 2.7 && t < 4.9 {
                // Its acceleration in the world at the sample before, from three places.
                let [.., a, b, c] = places[..] else { panic!("three samples") };
                let acceleration = (a - b * 2.0 + c) * (75.0 * 75.0);
                let want = mass * (acceleration + gravity);
                worst = worst.max((before - want).dot(along).abs());
                let of_hand = mass * (motion.at(t - 1.0 / 75.0).acceleration + gravity);
                apart = apart.max((before - of_hand).dot(along).abs());
                largest = largest.max((mass * motion.at(t).acceleration).dot(along).abs());
            }
            before = simulation.object_wrench().0;
        }
        assert!(largest > 0.8 * mass * 0.004 * (2.0 * std::f64::consts::TAU).powi(2), "{direction:?}: {largest} N");
        // Newton in the world; upwards the ball hardly moves in the hand, across it swings between the pads.
        let give = if along == DVec3::Z { 0.05 } else { 0.2 };
        assert!(worst < 0.03 * largest && apart < give * largest, "{direction:?}: {worst}, {apart} of {largest} N");
    }
}

#[test]
fn the_world_stays_where_it_is_while_the_hand_moves() {
    // Open fingers and a ball that nobody touches: seen from the hand it moves with its pedestal.
    let mut scene = shaken(0.01, 3.0, [0.0, 1.0, 0.3]);
    scene.gripper.mount.opening = 0.3;
    (scene.shaking.start, scene.shaking.end) = (Auto::Value(0.1), Auto::Value(1.5));
    let mut simulation = Simulation::new(&scene, Some(&ball())).0;
    let place = |simulation: &Simulation| simulation.world_from_object().expect("an object").position;
    let (start, mut moved, mut hand) = (place(&simulation), 0.0f64, 0.0f64);
    for _ in 0..120 {
        simulation.advance_by(u64::from(simulation.clock().ticks_per_sample)).expect("finite");
        moved = moved.max((place(&simulation) - start).length());
        hand = hand.max(simulation.frame().hand.length());
    }
    let strayed = (simulation.frame().hand - DVec3::Z * 0.03).length();
    assert!(hand > 0.03 && strayed < 1e-4 && moved < 5e-5, "the hand went {hand} m, the ball {moved} m");
}

#[test]
fn a_gentle_shake_is_held_and_a_hard_one_is_not() {
    let slip = |amplitude: f64, frequency: f64| {
        let scene = shaken(amplitude, frequency, [0.0, 0.0, 1.0]);
        let mut simulation = Simulation::new(&scene, Some(&ball())).0;
        let mut held = Vec::new();
        for k in 0..370 {
            let (bar, phase) = scene.programme.command(k * 10 / 75);
            simulation.command(bar, phase);
            simulation.advance_by(u64::from(simulation.clock().ticks_per_sample)).expect("finite");
            let frame = simulation.frame();
            held.push(frame.world_from_object.expect("an object").position - frame.hand);
        }
        // From the last sample before the lift to the end of the hold.
        (held[369] - held[160]).length()
    };
    let (gentle, hard) = (slip(0.002, 2.0), slip(0.03, 8.0));
    assert!(gentle < 0.004, "slips by {gentle} m");
    assert!(hard > 0.02, "{hard} m");
}

#[test]
fn shaking_is_planned_from_what_it_takes() {
    let plan = |scene: &Scene| super::effects::plan(scene, Some(&ball()), &Placement::new(scene, Some(&ball())));
    assert!(!plan(&Scene::default()).is_on("shaking"));
    assert!(plan(&shaken(0.01, 4.0, [1.0, 0.0, 0.0])).is_on("shaking"));
    let mut still = shaken(1e-6, 0.1, [1.0, 0.0, 0.0]);
    still.shaking.lift = 0.0;
    assert!(!plan(&still).is_on("shaking"), "less than is seen");
    let mut off = shaken(0.01, 4.0, [1.0, 0.0, 0.0]);
    off.effects.set(Effect::Shaking, Setting::Off);
    assert!(!plan(&off).is_on("shaking"));
}
