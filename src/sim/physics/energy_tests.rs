//! Contact forces are the gradient of the skin's energy: at edges and corners, against object, pedestal and finger.

use super::closed_form_tests::{Run, bare};
use super::detect::detect;
use super::solve::{Product, relative_velocities, segment_velocities};
use super::step::lay_out;
use crate::objects::ObjectModel;
use crate::scene::{Effect, Setting, SupportKind};
use glam::{DQuat, DVec3};
use palpate_geometry::Primitive;
use proptest::prelude::*;
use std::f64::consts::TAU;

/// What the left finger touches.
#[derive(Clone, Copy, Debug)]
enum Touched {
    Cube,
    Cylinder,
    Pedestal,
    Finger,
}

impl Touched {
    const ALL: [Self; 4] = [Self::Cube, Self::Cylinder, Self::Pedestal, Self::Finger];

    /// A scene about to touch it, without friction.
    fn run(self) -> Run {
        let mut scene = bare(10);
        let free = |shape| Some(ObjectModel::from_primitive("it", shape, 400.0, 0.0));
        let object = match self {
            Self::Cube => free(Primitive::Cuboid { half: DVec3::splat(0.01) }),
            Self::Cylinder => free(Primitive::Cylinder { radius: 0.012, half_length: 0.015 }),
            Self::Pedestal => {
                scene.support.kind = SupportKind::Pedestal;
                // Open fingertips stand over the rim.
                scene.gripper.mount.grasp_depth = 0.095;
                scene.gripper.mount.offset = [0.018, 0.0, -0.055];
                None
            }
            Self::Finger => {
                scene.gripper.mount.opening = 0.03;
                scene.effects.set(Effect::FingerContact, Setting::On);
                None
            }
        };
        Run::new(&scene, object.as_ref(), 1e-3)
    }

    /// The middle of the path: joint angles of both fingers, and the object's place before the left pad.
    fn middle(self, run: &Run) -> ([f64; 2], DVec3) {
        match self {
            // Near the tip, its farthest corner 5 mm in the pad.
            Self::Cube => ([0.0, 0.0], DVec3::new(-run.half_gap() + 0.0205, 0.004, -0.085)),
            Self::Cylinder => ([0.0, 0.0], DVec3::new(-run.half_gap() + 0.0225, 0.004, -0.09)),
            Self::Pedestal => ([0.03, 0.0], DVec3::ZERO),
            Self::Finger => ([0.04, 0.03], DVec3::ZERO),
        }
    }
}

/// Energy of the skin (J), and the power of its forces at a motion in all unknowns.
fn energy_and_power(run: &mut Run, motion: &[f64]) -> (f64, f64) {
    run.ws.step.h = 0.0;
    run.state.velocity.fill(0.0);
    lay_out(&run.model, &run.state, &mut run.ws);
    segment_velocities(&run.model, &run.state.velocity, &mut run.ws);
    detect(&run.model, &run.state, &mut run.ws);
    relative_velocities(&run.model, motion, &mut run.ws, Product::OfDirection);
    let contacts = run.ws.contacts.iter();
    contacts.fold((0.0, 0.0), |(energy, power), c| {
        let force = c.law.force(c.stiffness, c.height, c.compression).0;
        (energy + c.law.energy(c.stiffness, c.height, c.compression), power + force * c.normal.dot(c.change))
    })
}

/// Moves all coordinates by a motion (rad, m).
fn shift(run: &mut Run, motion: &[f64]) {
    run.state.velocity.copy_from_slice(motion);
    run.state.integrate(&run.model, 1.0);
}

/// A motion of the left finger's joints, of the right one's, and of the object.
fn motion(run: &Run, fingers: [f64; 2], linear: DVec3, angular: DVec3) -> Vec<f64> {
    let mut motion = vec![0.0; run.model.unknowns()];
    motion[..10].fill(fingers[0]);
    motion[10..20].fill(fingers[1]);
    if run.model.free_body().is_some() {
        motion[20..23].copy_from_slice(&linear.to_array());
        motion[23..].copy_from_slice(&angular.to_array());
    }
    motion
}

/// Puts it in the middle of its path, the object turned.
fn start(touched: Touched, turn: DQuat) -> Run {
    let mut run = touched.run();
    let (fingers, place) = touched.middle(&run);
    run.state.q[..10].fill(fingers[0]);
    run.state.q[10..].fill(fingers[1]);
    (run.state.body.position, run.state.body.rotation) = (place, turn);
    run
}

fn direction() -> impl Strategy<Value = DVec3> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(DVec3::from_array)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn forces_are_the_slope_of_the_energy(
        which in 0usize..4,
        turn in direction(),
        (linear, angular) in (direction(), direction()),
        fingers in [-1.0..1.0, -1.0..1.0],
        from in direction(),
    ) {
        let mut run = start(Touched::ALL[which], DQuat::from_scaled_axis(turn * 2.0));
        let off = motion(&run, [0.01 * from.x, 0.01 * from.y], from * 2e-3, DVec3::ZERO);
        shift(&mut run, &off);
        let way = motion(&run, fingers, linear * 0.1, angular * 10.0);
        let (energy, power) = energy_and_power(&mut run, &way);
        prop_assume!(run.ws.contacts.iter().all(|c| c.compression < 0.95 * c.height));
        let step = 1e-7;
        let at = |share: f64| {
            let mut moved = run.clone();
            shift(&mut moved, &way.iter().map(|x| x * share).collect::<Vec<_>>());
            energy_and_power(&mut moved, &way).0
        };
        let slope = (at(step) - at(-step)) / (2.0 * step);
        let scale = energy / 1e-3 * 0.1 + 1e-6;
        prop_assert!((slope + power).abs() < 1e-3 * scale, "{:?}: {power} W, slope {slope}", Touched::ALL[which]);
    }

    /// Across edges and corners.
    #[test]
    fn a_closed_loop_does_no_work(which in 0usize..4, turn in direction(), (one, other) in (direction(), direction())) {
        let touched = Touched::ALL[which];
        let mut run = start(touched, DQuat::from_scaled_axis(turn * 2.0));
        const STEPS: usize = 1000;
        let along = |k: f64| {
            let (sin, cos) = (TAU * k / STEPS as f64).sin_cos();
            one * (cos - 1.0) + other * sin
        };
        // Turns about one axis add up to none.
        let axis = one.normalize_or(DVec3::Z);
        let (mut work, mut most) = (0.0, 0.0f64);
        for k in 0..STEPS {
            let step = along(k as f64 + 1.0) - along(k as f64);
            let half = motion(&run, [0.004 * step.x, 0.004 * step.y], step * DVec3::new(1.2e-3, 4e-3, 4e-3), axis * (0.2 * step.dot(axis))).iter().map(|x| 0.5 * x).collect::<Vec<_>>();
            shift(&mut run, &half);
            let (energy, power) = energy_and_power(&mut run, &half);
            work += 2.0 * power;
            most = most.max(energy);
            // Beyond the foot there is another law.
            prop_assume!(run.ws.contacts.iter().all(|c| c.compression < 0.95 * c.height));
            shift(&mut run, &half);
        }
        prop_assert!(work.abs() < 1e-3 * most + 1e-8, "{touched:?}: {work} J around, {most} J at most");
    }
}
