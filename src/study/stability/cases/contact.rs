//! Hard cases of contact.

use super::super::{Conditions, Findings, Measurement};
use super::fingers::{gains, missed};
use super::{FULL_TORQUE, bare, stepped, torque};
use glam::DVec3;
use palpate_geometry::Primitive;
use palpate_sim::gripper::Sideways;
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::{Drive, NotFinite, SteppedScene};
use palpate_sim::scene::{Auto, Scene};

/// Torque that rises over a second and then stays.
fn ramp(t: f64) -> Drive {
    torque(FULL_TORQUE * t.min(1.0))
}

fn of_mass(shape: Primitive, mass: f64, friction: f64) -> ObjectModel {
    let mut object = ObjectModel::from_primitive("it", shape, 400.0, friction);
    object.mass = object.mass.with_mass(mass);
    object
}

pub(super) fn squeezed_masses(conditions: &Conditions) -> Findings {
    let shapes = [Primitive::Sphere { radius: 0.02 }, Primitive::Cuboid { half: DVec3::splat(0.0175) }];
    let mut findings = Vec::new();
    // Sideways, held by friction alone. Heavy objects would swing on the skin for minutes.
    for (mass, pull) in [(1e-4, 0.05), (0.01, 0.05), (0.1, 0.05), (10.0, 0.0), (100.0, 0.0)] {
        for shape in conditions.some_of(&shapes, 1) {
            let scene = Scene::default();
            let object = of_mass(*shape, mass, 0.6);
            let mut run = stepped(&scene, Some(&object), conditions);
            let start = run.object_centre();
            run.cover(1.5, ramp)?;
            let pulled = |t: f64| Drive { object_force: DVec3::Y * (pull * t.min(1.0)), ..torque(FULL_TORQUE) };
            run.cover(5.0, pulled)?;
            // Means over half a second, since a held object may still ring.
            let [early, late] = [mean_centre(&mut run, pulled(1.0))?, mean_centre(&mut run, pulled(1.0))?];
            let creep = (late - early).length() / 0.5;
            let moved = (run.object_centre() - start).length();
            findings.push(Measurement::at_most(format!("creep at {mass} kg [m/s]"), creep, 1e-6));
            findings.push(Measurement::at_most(format!("moved at {mass} kg (m)"), moved, 0.01));
            let depth = run.deepest() / scene.gripper.pad.thickness;
            findings.push(Measurement::at_most(format!("depth over the pad's thickness at {mass} kg"), depth, 1.0));
            findings.push(missed(&run));
        }
    }
    Ok(findings)
}

/// Beside the middle of the pads, so that the fingers are pushed sideways and twisted: squeezed, and let go.
pub(super) fn soft_sideways(conditions: &Conditions) -> Findings {
    let mut scene = Scene::default();
    scene.gripper.mount.offset = [0.0, 0.005, 0.0];
    let solid = scene.gripper.finger.of_solid_section(scene.gripper.pad.thickness);
    let softened = |stiffness: Auto| stiffness.value().map_or(stiffness, |stiffness| Auto::Value(0.01 * stiffness));
    scene.gripper.finger.sideways = Sideways {
        bending_stiffness: softened(solid.bending_stiffness),
        torsional_stiffness: softened(solid.torsional_stiffness),
    };
    let mut findings = Vec::new();
    for mass in [1e-3, 0.01, 10.0] {
        let object = of_mass(Primitive::Sphere { radius: 0.02 }, mass, 0.6);
        let mut run = stepped(&scene, Some(&object), conditions);
        run.cover(1.5, ramp)?;
        let depth = run.deepest() / scene.gripper.pad.thickness;
        let squeezed = run.energy();
        let mut most = squeezed;
        for _ in 0..(conditions.span(1.0) / run.h).round() as usize {
            run.step(&Drive::default())?;
            most = most.max(run.energy());
        }
        findings.push(Measurement::at_most(format!("depth over the pad's thickness at {mass} kg"), depth, 1.0));
        findings.push(Measurement::at_most(format!("gain once let go at {mass} kg (J)"), most - squeezed, 1e-6));
        let tip = run.state.sways.iter().map(|sway| sway.curvature.abs()).fold(0.0, f64::max);
        findings.push(Measurement::at_least(format!("sideways curvature at {mass} kg (1/m)"), tip, 1e-6));
        findings.push(missed(&run));
    }
    Ok(findings)
}

/// Mean position of the object's centre of mass over half a second (m).
fn mean_centre(run: &mut SteppedScene, drive: Drive) -> Result<DVec3, NotFinite> {
    let steps = (0.5 / run.h).round().max(1.0) as u32;
    let mut sum = DVec3::ZERO;
    for _ in 0..steps {
        run.step(&drive)?;
        sum += run.object_centre();
    }
    Ok(sum / f64::from(steps))
}

pub(super) fn light_stiff_sticky(conditions: &Conditions) -> Findings {
    let scene = light_stiff_scene();
    let shapes = [Primitive::Sphere { radius: 0.02 }, Primitive::Cuboid { half: DVec3::splat(0.0175) }];
    let mut findings = Vec::new();
    for shape in conditions.some_of(&shapes, 1) {
        let object = of_mass(*shape, 1e-3, 5.0);
        let rest = |mut run: SteppedScene| {
            run.cover(1.0, |_| torque(FULL_TORQUE))?;
            Ok((run.object_centre(), run.deepest(), missed(&run)))
        };
        let (reference, _, _) =
            rest(SteppedScene::new(&scene, Some(&object), if conditions.thorough { 1e-4 } else { 5e-4 }))?;
        let (place, depth, missed) = rest(stepped(&scene, Some(&object), conditions))?;
        let apart = (place - reference).length();
        findings.push(Measurement::at_most("resting place apart from the reference (m)", apart, 5e-3));
        findings.push(Measurement::at_most("depth over the pad's thickness", depth / scene.gripper.pad.thickness, 1.0));
        findings.push(missed);
    }
    Ok(findings)
}

fn light_stiff_scene() -> Scene {
    let mut scene = Scene::default();
    scene.gripper.pad.modulus *= 1000.0;
    scene.gripper.pad.friction = 5.0;
    scene.object.friction = Auto::Value(5.0);
    scene
}

pub(super) fn initial_overlap(conditions: &Conditions) -> Findings {
    let mut findings = Vec::new();
    for stiffer in conditions.some_of(&[1.0, 1000.0], 2) {
        let mut scene = bare(10);
        scene.gripper.pad.modulus *= stiffer;
        scene.gripper.mount.offset = [0.032, 0.0, 0.02]; // the ball's surface lies 10 mm inside the left pad's skin
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        let mut run = stepped(&scene, Some(&ball), conditions);
        let start = run.energy();
        let (mut fastest, mut most) = (0.0f64, 0.0f64);
        for _ in 0..(conditions.span(2.0) / conditions.h()) as usize {
            run.step(&Drive::default())?;
            fastest = fastest.max(run.object_velocity().0.length());
            most = most.max(run.energy());
        }
        let bound = (2.0 * start / ball.mass.mass).sqrt();
        let at = format!("at E x {stiffer}");
        findings.push(Measurement::at_most(
            format!("exit speed over what the energy allows {at}"),
            fastest / bound,
            1.0,
        ));
        findings.push(Measurement::at_least(format!("exit speed {at} [m/s]"), fastest, 0.01));
        findings.push(Measurement::at_most(format!("most energy over the first {at}"), most / start, 1.0 + 1e-9));
        findings.push(missed(&run));
    }
    // The axis of the left finger has just crossed a 1 mm plate: the finger must return to its side.
    let mut scene = bare(10);
    scene.object.fixed = true;
    scene.gripper.mount.offset = [0.0508, 0.0, 0.0];
    let half = DVec3::new(0.0005, 0.02, 0.03);
    let plate = ObjectModel::from_primitive("plate", Primitive::Cuboid { half }, 400.0, 0.6);
    let mut run = stepped(&scene, Some(&plate), conditions);
    let start = run.energy();
    let (mut forward, mut most) = (f64::NEG_INFINITY, 0.0f64);
    for _ in 0..(conditions.span(0.3) / conditions.h()).ceil() as usize {
        run.step(&Drive::default())?;
        forward = forward.max(run.tip().0);
        most = most.max(run.energy());
    }
    findings.push(Measurement::at_most("way on through a plate (m)", forward, 0.0));
    findings.push(Measurement::at_most("most energy over the first at a plate", most / start, 1.0 + 1e-9));
    findings.push(missed(&run));
    Ok(findings)
}

/// A cube whose edge, or whose corner, passes over a fingertip, without damping or friction.
pub(super) fn dragged_edge(conditions: &Conditions) -> Findings {
    const SPEED: f64 = 0.05;
    const HALF: f64 = 0.01;
    let mut findings = Vec::new();
    for (what, reach, turn) in
        [("edge", 2f64.sqrt(), [0.0, 45.0, 0.0]), ("corner", 3f64.sqrt(), [45.0, 54.735_61, 0.0])]
    {
        let mut scene = bare(10);
        (scene.gripper.finger.damping_time, scene.gripper.pad.dissipation) = (0.0, 0.0);
        scene.object.rotation_deg = turn;
        scene.object.friction = Auto::Value(0.0);
        // Its farthest place is 2 mm in the left pad, and begins 8 mm below the tip.
        let skin = 0.5 * scene.gripper.mount.opening;
        scene.gripper.mount.offset = [skin + 0.002 - reach * HALF, 0.002, 0.0];
        scene.gripper.mount.grasp_depth = scene.gripper.finger.length + 0.008 + reach * HALF;
        let cube = of_mass(Primitive::Cuboid { half: DVec3::splat(HALF) }, 1.0, 0.0);
        let mut run = stepped(&scene, Some(&cube), conditions);
        run.throw_object(DVec3::Z * SPEED, DVec3::ZERO);
        let gains = gains(&mut run, conditions, 0.6)?;
        findings.extend(gains.map(|gain| Measurement { what: format!("{what}: {}", gain.what), ..gain }));
        findings.push(missed(&run));
    }
    Ok(findings)
}

pub(super) fn thrown_object(conditions: &Conditions) -> Findings {
    let mut findings = Vec::new();
    for speed in [1.0, 3.0] {
        let mut scene = bare(10);
        scene.gripper.mount.grasp_depth = 0.05;
        let ball = of_mass(Primitive::Sphere { radius: 0.01 }, 1e-3, 0.6);
        let mut run = stepped(&scene, Some(&ball), conditions);
        // Towards the left finger, a few centimetres away.
        run.throw_object(DVec3::X * -speed, DVec3::ZERO);
        let start = run.energy();
        let (mut most, mut farthest) = (0.0f64, 0.0f64);
        for _ in 0..(0.1 / conditions.h()).ceil() as usize {
            run.step(&Drive::default())?;
            most = most.max(run.energy());
            farthest = farthest.max(-run.object_centre().x - run.tip_sway());
        }
        let at = format!("at {speed} m/s");
        findings.push(Measurement::at_most(
            format!("beyond the finger's root {at} (m)"),
            farthest - run.half_gap(),
            0.0,
        ));
        findings.push(Measurement::at_most(format!("most energy over the first {at}"), most / start, 1.0 + 1e-9));
        findings.push(missed(&run));
    }
    Ok(findings)
}

pub(super) fn friction_extremes(conditions: &Conditions) -> Findings {
    let mut findings = Vec::new();
    for mu in [0.0, 0.5, 5.0] {
        let mut scene = Scene::default();
        scene.gripper.pad.friction = mu;
        scene.object.friction = Auto::Value(mu);
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.025 }, 400.0, mu);
        let mut run = stepped(&scene, Some(&ball), conditions);
        let (mut cone, mut dragged, mut pressed) = (0.0f64, 0.0f64, 0.0f64);
        for k in 0..(3.0 / conditions.h()) as usize {
            run.step(&torque((0.03 * k as f64 * conditions.h()).min(FULL_TORQUE)))?;
            let (mut used, mut normal) = (0.0, 0.0);
            for force in run.skin_forces().filter(|force| force.on_object) {
                used += force.friction;
                normal += force.normal;
            }
            pressed = pressed.max(normal);
            dragged = dragged.max(used);
            if mu * normal > 0.02 {
                cone = cone.max(used / (mu * normal));
            }
        }
        findings.push(Measurement::at_least(format!("largest normal force at mu = {mu} [N]"), pressed, 0.1));
        if mu == 0.0 {
            findings.push(Measurement::at_most("friction at mu = 0 [N]", dragged, 1e-12));
        } else {
            findings.push(Measurement::at_most(format!("friction over its cone at mu = {mu}"), cone, 1.05));
        }
        findings.push(missed(&run));
    }
    Ok(findings)
}

pub(super) fn thin_things(conditions: &Conditions) -> Findings {
    let needle = Primitive::Cylinder { radius: 0.0005, half_length: 0.03 };
    let thin = [
        ("plate", Primitive::Cuboid { half: DVec3::new(0.0005, 0.02, 0.03) }, [0.0; 3]),
        ("needle across", needle, [90.0, 0.0, 0.0]),
        ("card edge-on", Primitive::Cuboid { half: DVec3::new(0.02, 0.0005, 0.03) }, [0.0; 3]),
        ("needle along", needle, [0.0; 3]),
    ];
    let mut findings = Vec::new();
    for (name, shape, rotation_deg) in thin {
        let mut scene = Scene::default();
        scene.object.fixed = true;
        scene.object.rotation_deg = rotation_deg;
        scene.gripper.mount.offset = [0.0, 0.0007, -0.012];
        let object = ObjectModel::from_primitive(name, shape, 400.0, 0.6);
        let mut run = stepped(&scene, Some(&object), conditions);
        let mut force = 0.0f64;
        for k in 0..(3.0 / conditions.h()) as usize {
            let t = k as f64 * conditions.h();
            run.step(&torque(2.0 * FULL_TORQUE * (t / 1.5).min(1.0)))?;
            force = force.max(run.skin_forces().map(|force| force.normal).fold(0.0, f64::max));
        }
        let depth = run.deepest() / scene.gripper.pad.thickness;
        findings.push(Measurement::at_least(format!("force on the {name} [N]"), force, 0.01));
        findings.push(Measurement::at_most(format!("depth over the pad's thickness: {name}"), depth, 1.0));
        let across = run.tip().0 - run.half_gap();
        findings.push(Measurement::at_most(format!("tip beyond the {name} (m)"), across, 0.002));
        findings.push(missed(&run));
    }
    Ok(findings)
}

pub(super) fn crushing_torque(conditions: &Conditions) -> Findings {
    let mut scene = Scene::default();
    scene.object.fixed = true;
    scene.gripper.finger.bending_stiffness *= 1000.0;
    let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
    let mut run = stepped(&scene, Some(&ball), conditions);
    let mut deepest = 0.0f64;
    for k in 0..(1.5 / conditions.h()) as usize {
        run.step(&torque(1000.0 * FULL_TORQUE * (k as f64 * conditions.h()).min(1.0)))?;
        deepest = deepest.max(run.deepest());
    }
    let pad = &scene.gripper.pad;
    Ok(vec![Measurement::at_most("depth over the pad's thickness", deepest / pad.thickness, 1.0), missed(&run)])
}
