//! Hard cases of the fingers by themselves.

use super::super::{Conditions, Findings, Measurement};
use super::{FULL_TORQUE, bare, stepped, torque};
use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::{Drive, NotFinite, SteppedScene, Stepping};
use palpate_sim::scene::Scene;

pub(super) fn stiff_joints(conditions: &Conditions) -> Findings {
    let mut findings = Vec::new();
    for factor in [1e3, 1e4, 1e6] {
        let mut scene = bare(10);
        scene.gripper.finger.bending_stiffness *= factor;
        scene.gripper.finger.damping_time = 0.0;
        let mut run = stepped(&scene, None, conditions);
        for _ in 0..2000 {
            run.step(&torque(0.05))?;
        }
        let want = 0.05 / run.joint_stiffness();
        let error = run.state.q.iter().map(|q| (q / want - 1.0).abs()).fold(0.0, f64::max);
        findings.push(Measurement::at_most(format!("error of the bend at k x {factor:e}"), error, 1e-3));
        findings.push(missed(&run));
    }
    Ok(findings)
}

pub(super) fn twentyfold_actuation(conditions: &Conditions) -> Findings {
    let mut run = stepped(&bare(10), None, conditions);
    let limit = run.angle_limit();
    let largest_of = |run: &SteppedScene| run.state.q.iter().map(|q| q.abs()).fold(0.0, f64::max) / limit;
    let (mut swing, mut settled) = (0.0f64, 0.0f64);
    for direction in [20.0, -20.0] {
        for _ in 0..(2.0 / conditions.h()) as usize {
            run.step(&torque(direction * FULL_TORQUE))?;
            swing = swing.max(largest_of(&run));
        }
        settled = settled.max(largest_of(&run));
    }
    // Bellows a hundred times as stiff as the joint yield by 4 % under this torque.
    Ok(vec![
        Measurement::at_most("largest joint angle at rest, over its limit", settled, 1.05),
        Measurement::at_most("largest joint angle on the way, over its limit", swing, 1.5),
        missed(&run),
    ])
}

pub(super) fn passive_swing(conditions: &Conditions) -> Findings {
    let mut scene = Scene::default();
    undamp(&mut scene);
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
    swing(stepped(&scene, Some(&ball), conditions), conditions)
}

/// Fingertips swing against the edges of a thin plate between them, which is turned a little.
pub(super) fn plate_edges(conditions: &Conditions) -> Findings {
    let mut scene = bare(10);
    undamp(&mut scene);
    scene.object.rotation_deg = [4.0, 8.0, 3.0];
    let half = DVec3::new(0.025, 0.02, 0.001);
    let plate = ObjectModel::from_primitive("plate", Primitive::Cuboid { half }, 400.0, 0.6);
    swing(stepped(&scene, Some(&plate), conditions), conditions)
}

/// Fingers that swing against each other.
pub(super) fn clapping(conditions: &Conditions) -> Findings {
    let mut scene = bare(10);
    undamp(&mut scene);
    scene.gripper.mount.opening = 0.03;
    swing(stepped(&scene, None, conditions), conditions)
}

fn undamp(scene: &mut Scene) {
    scene.gripper.finger.damping_time = 0.0;
    scene.gripper.pad.dissipation = 0.0;
    scene.gripper.pad.shear_damping_time = 0.0;
}

/// Fingers that are bent outward and let go: energy is not gained.
fn swing(mut run: SteppedScene, conditions: &Conditions) -> Findings {
    run.state.q[..10].fill(-0.06);
    run.state.q[10..].fill(-0.05);
    let gains = gains(&mut run, conditions, 2.0)?;
    Ok(gains.into_iter().chain([missed(&run)]).collect())
}

/// Runs without a drive: the largest gain of energy in a tick, that in all, and whether anything was touched.
pub(super) fn gains(
    run: &mut SteppedScene,
    conditions: &Conditions,
    seconds: f64,
) -> Result<[Measurement; 3], NotFinite> {
    let start = run.energy();
    let (mut before, mut largest, mut force, mut tightest) = (start, 0.0f64, 0.0f64, 0.0f64);
    for _ in 0..(conditions.span(seconds) / conditions.h()) as usize {
        tightest = tightest.max(run.state.q.iter().map(|q| q.abs()).sum());
        run.step(&Drive::default())?;
        let now = run.energy();
        largest = largest.max(now - before);
        before = now;
        force = force.max(run.skin_forces().map(|force| force.normal).sum());
    }
    // Frozen inertia and explicit Coriolis forces allow small gains; a tolerance allows the energy of an equal error in
    // every joint at the largest spring tension.
    let error = conditions.setting.tolerance() * run.joint_stiffness() * tightest;
    Ok([
        Measurement::at_most("largest gain in one tick (J)", largest, 1e-6 + error),
        Measurement::at_most("net gain (J)", before - start, error),
        Measurement::at_least("largest force on the pads (N)", force, 0.05),
    ])
}

pub(super) fn explicit_step(_conditions: &Conditions) -> Findings {
    let mut scene = bare(10);
    scene.gripper.finger.damping_time = 0.0;
    let critical = 2.0 / SteppedScene::new(&scene, None, 1.0).fastest_mode();
    let start = 1e-4;
    let swing = |stepping: Stepping, share: f64| {
        let mut run = SteppedScene::new(&scene, None, share * critical);
        run.stepping = stepping;
        for (i, q) in run.state.q.iter_mut().enumerate() {
            *q = if i % 2 == 0 { start } else { -start };
        }
        let mut largest = 0.0f64;
        for _ in 0..4000 {
            if run.step(&Drive::default()).is_err() {
                return (run.steps, f64::INFINITY);
            }
            largest = run.state.q.iter().fold(largest, |largest, q| largest.max(q.abs()));
        }
        (run.steps, largest / start)
    };
    let (_, below) = swing(Stepping::Explicit, 0.95);
    let (reported_after, beyond) = swing(Stepping::Explicit, 1.05);
    let (_, convex) = swing(Stepping::Convex, 20.0);
    Ok(vec![
        Measurement::at_most("explicit at 0.95 x 2/omega_max: largest angle over the first", below, 20.0),
        Measurement::at_least("explicit at 1.05 x 2/omega_max: largest angle over the first", beyond, f64::INFINITY),
        Measurement::at_most("explicit at 1.05 x 2/omega_max: steps until reported", reported_after as f64, 3999.0),
        Measurement::at_most("convex at 20 x 2/omega_max: largest angle over the first", convex, 1.0),
    ])
}

/// Number of steps that missed the solver's tolerance; zero in every hard case.
pub(super) fn missed(run: &SteppedScene) -> Measurement {
    Measurement::at_most("steps that missed the tolerance", run.missed as f64, 0.0)
}
