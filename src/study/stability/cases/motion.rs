//! Hard cases of an object over long times: resting, held, in flight.

use super::super::{Conditions, Findings, Measurement};
use super::fingers::missed;
use super::{FULL_TORQUE, bare, stepped, torque};
use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::Drive;
use palpate_sim::scene::{Auto, Scene};

pub(super) fn resting_masses(conditions: &Conditions) -> Findings {
    let mut findings = Vec::new();
    for mass in [1e-4, 0.05, 100.0] {
        let mut scene = Scene::default();
        scene.object.mass = Auto::Value(mass);
        let mut cube =
            ObjectModel::from_primitive("cube", Primitive::Cuboid { half: DVec3::splat(0.0225) }, 500.0, 0.5);
        cube.mass = cube.mass.with_mass(mass);
        let mut run = stepped(&scene, Some(&cube), conditions);
        let start = run.object_centre();
        let weight = mass * scene.world.gravity;
        run.cover(conditions.span(10.0), |_| Drive::default())?;
        let moved = run.object_centre() - start;
        let carried: f64 = run.skin_forces().map(|force| force.normal).sum();
        // As on a slope of 1:10, held by friction alone.
        let pull = Drive { object_force: DVec3::new(0.06, 0.08, 0.0) * weight, ..Drive::default() };
        run.cover(conditions.span(10.0), |_| pull)?;
        let early = run.object_centre();
        run.cover(conditions.span(10.0), |_| pull)?;
        let slid = (run.object_centre() - early).length();
        let of = format!("of {mass} kg");
        findings.push(Measurement::at_most(
            format!("sinking {of} over what is allowed"),
            -moved.z / scene.support.sink,
            1.1,
        ));
        findings.push(Measurement::at_least(format!("sinking {of} (m)"), -moved.z, 0.0));
        findings.push(Measurement::at_most(format!("creep {of} (m)"), moved.truncate().length(), 1e-9));
        findings.push(Measurement::at_most(format!("creep {of} on a slope (m)"), slid, 1e-7));
        findings.push(Measurement::at_most(format!("load {of} not carried"), (carried / weight - 1.0).abs(), 1e-5));
        findings.push(missed(&run));
    }
    Ok(findings)
}

pub(super) fn long_hold(conditions: &Conditions) -> Findings {
    let scene = Scene::default();
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
    let mut run = stepped(&scene, Some(&ball), conditions);
    run.cover(1.0, |t| torque(FULL_TORQUE * t))?;
    run.cover(2.0, |_| torque(FULL_TORQUE))?;
    let (place, energy) = (run.object_centre(), run.energy());
    run.cover(conditions.span(600.0), |_| torque(FULL_TORQUE))?;
    let drift = (run.object_centre() - place).length();
    Ok(vec![
        Measurement::at_most("drift (m)", drift, 1e-5),
        Measurement::at_most("change of energy (J)", (run.energy() - energy).abs(), 1e-6),
        missed(&run),
    ])
}

pub(super) fn free_flight(conditions: &Conditions) -> Findings {
    let mut scene = bare(10);
    scene.gripper.mount.opening = 0.5;
    let half = DVec3::new(0.03, 0.015, 0.006);
    let brick = ObjectModel::from_primitive("brick", Primitive::Cuboid { half }, 800.0, 0.5);
    let span = conditions.span(600.0);
    let mut findings = Vec::new();
    for turn in [0.003, 3.0] {
        let mut run = stepped(&scene, Some(&brick), conditions);
        // Slow enough to stay within the drawn space.
        let (way, axis) = (DVec3::new(0.1, 0.0, 0.2) / span, DVec3::new(1.0, 1.0 / 30.0, 1.0 / 15.0));
        run.throw_object(way, axis * (turn / conditions.h()));
        let (start, (linear, angular)) = (run.object_centre(), run.object_momentum());
        let least = brick.mass.inertia.to_cols_array().iter().step_by(4).copied().fold(f64::INFINITY, f64::min);
        let fastest = angular.length() / least;
        let mut spin = 0.0f64;
        for _ in 0..(span / conditions.h()) as usize {
            run.step(&Drive::default())?;
            spin = spin.max(run.object_velocity().1.length());
        }
        let after = run.object_momentum();
        let passed = run.steps as f64 * conditions.h();
        let at = format!("at {turn} rad per step");
        let off = (run.object_centre() - start - way * passed).length();
        findings.push(Measurement::at_most(
            format!("change of momentum {at}"),
            (after.0 - linear).length() / linear.length(),
            1e-9,
        ));
        let turned = (after.1 - angular).length() / angular.length();
        findings.push(Measurement::at_most(format!("change of angular momentum {at}"), turned, 1e-8));
        findings.push(Measurement::at_most(
            format!("spin over what the momentum allows {at}"),
            spin / fastest,
            1.0 + 1e-9,
        ));
        findings.push(Measurement::at_most(format!("off the straight line {at} (m)"), off, 1e-9));
        findings.push(missed(&run));
    }
    Ok(findings)
}
