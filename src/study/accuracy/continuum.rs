//! What separate springs leave out: the pad and the finger beside finite elements of a continuum.
//!
//! `tests/peers/soft_pad.py` presses rigid bodies into a layer of incompressible neo-Hookean rubber, bonded below, of the
//! pad's thickness and modulus. `tests/peers/soft_finger.py` loads the tip of a solid finger as stiff in bending as ours.
//! Here the same bodies are pressed into a straight finger without a crown. Edges are sharp here, and have a fillet of
//! 0.5 mm there. Forces are means over four places along a row of taxels.

use crate::frame::{StudyError, rounded};
use glam::{DQuat, DVec3};
use palpate_geometry::Primitive;
use palpate_sim::frame::Frame;
use palpate_sim::gripper::Side;
use palpate_sim::objects::ObjectModel;
use palpate_sim::physics::{Drive, SteppedScene};
use palpate_sim::run::{SimEvent, SimRun};
use palpate_sim::scene::{Auto, Effect, Scene, Setting, SupportKind};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_6, SQRT_2};

/// Results of the finite elements; units as in the scripts.
const PAD: &str = include_str!("../../../tests/peers/results/soft_pad.csv");
const FINGER: &str = include_str!("../../../tests/peers/results/soft_finger.csv");

/// Distance between the open pads (m): room for every body.
const OPENING: f64 = 0.2;
/// Way of a body into the pad (m), its acceleration (m/s²) and its mass (kg).
const WAY: f64 = 2e-3;
const PULL: f64 = 4e-3;
const MASS: f64 = 1e7;
/// Places along a row of taxels that forces are averaged over.
const PLACES: u32 = 4;
/// Half of the bodies' length across the finger, and of the square bar's edges (m).
const HALF_LENGTH: f64 = 0.03;
const HALF_BAR: f64 = 0.02;
/// Length of the plate along the finger (m).
const PLATE: f64 = 0.04;

/// A rigid body with its lowest point towards the left pad.
struct RigidBody {
    shape: Primitive,
    /// Its turn in the gripper's frame.
    turn: DQuat,
    /// From its centre to its lowest point, towards the pad and along the finger (m).
    lowest: [f64; 2],
    /// Length that forces are divided by (m); one for the ball.
    length: f64,
}

impl RigidBody {
    fn named(name: &str, finger_width: f64) -> Option<Self> {
        let bar = |tilt: f64| Self {
            shape: Primitive::Cuboid { half: DVec3::new(HALF_BAR, HALF_LENGTH, HALF_BAR) },
            turn: DQuat::from_rotation_y(FRAC_PI_4 + tilt),
            lowest: [tilt.cos(), tilt.sin()].map(|share| share * SQRT_2 * HALF_BAR),
            length: finger_width,
        };
        let flat = |half: f64, length: f64| Self {
            shape: Primitive::Cuboid { half: DVec3::new(HALF_BAR, HALF_LENGTH, half) },
            turn: DQuat::IDENTITY,
            lowest: [HALF_BAR, 0.0],
            length,
        };
        let round = |shape: Primitive, radius: f64, length: f64| Self {
            shape,
            turn: DQuat::from_rotation_x(FRAC_PI_2),
            lowest: [radius, 0.0],
            length,
        };
        Some(match name {
            "ball" => round(Primitive::Sphere { radius: 0.02 }, 0.02, 1.0),
            "cylinder" => round(Primitive::Cylinder { radius: 0.01, half_length: HALF_LENGTH }, 0.01, finger_width),
            "edge" => bar(0.0),
            "edge turned" => bar(FRAC_PI_6),
            "flat" => flat(0.01, finger_width),
            "plate" => flat(0.5 * PLATE, PLATE),
            _ => return None,
        })
    }
}

/// Load of a pad: force towards it and along it (N), footprint along the finger, peak pressure.
#[derive(Clone, Copy, Default)]
struct PadLoad {
    normal: f64,
    along: f64,
    width_m: f64,
    peak_pa: f64,
}

impl PadLoad {
    /// Weighted sum.
    fn sum(loads: impl IntoIterator<Item = (f64, Self)>) -> Self {
        loads.into_iter().fold(Self::default(), |sum, (weight, load)| Self {
            normal: sum.normal + weight * load.normal,
            along: sum.along + weight * load.along,
            width_m: sum.width_m + weight * load.width_m,
            peak_pa: sum.peak_pa + weight * load.peak_pa,
        })
    }

    fn new(scene: &Scene, frame: &Frame) -> Self {
        let grid = scene.gripper.taxels();
        let loads: Vec<_> = frame.loads(Side::Left, grid.count()).filter(|(_, load)| load.normal > 0.0).collect();
        let rows = loads.iter().map(|(taxel, _)| taxel / grid.columns);
        let span = rows.clone().max().zip(rows.min()).map_or(0, |(last, first)| last + 1 - first);
        Self {
            normal: loads.iter().map(|(_, load)| f64::from(load.normal)).sum(),
            along: loads.iter().map(|(_, load)| f64::from(load.along)).sum::<f64>().abs(),
            width_m: span as f64 * grid.row_pitch(),
            peak_pa: loads.iter().map(|(_, load)| f64::from(load.normal)).fold(0.0, f64::max)
                / (grid.row_pitch() * grid.column_pitch()),
        }
    }
}

/// A straight finger that does not bend, with a pad as finite elements have it.
fn straight_finger(sticks: bool) -> Scene {
    let mut scene = Scene::default();
    scene.world.gravity = 0.0;
    scene.support.kind = SupportKind::None;
    scene.object.friction = Auto::Value(if sticks { 100.0 } else { 0.0 });
    let gripper = &mut scene.gripper;
    gripper.mount.opening = OPENING;
    gripper.finger.bending_stiffness *= 1e6;
    let pad = &mut gripper.pad;
    (pad.crown_radius, pad.dissipation, pad.shear_damping_time) = (1e6, 0.0, 0.0);
    scene
}

/// Presses a body in, slanted along the finger, from a place along a row of taxels on: loads of the pad by depth (m).
/// A very heavy body is pulled: the pad hardly slows it down, and skin that sticks to it is sheared.
fn press(scene: &Scene, body: &RigidBody, slant_deg: f64, place: f64) -> Result<Vec<(f64, PadLoad)>, StudyError> {
    let mut object = ObjectModel::from_primitive("body", body.shape, 500.0, 1.0);
    object.mass = object.mass.with_mass(MASS);
    let (mut run, placement) = SimRun::new(scene, Some(&object));
    let gripper = placement.world_from_gripper;
    let middle = 0.5 * scene.gripper.finger.length + place;
    let start = DVec3::new(body.lowest[0] - 0.5 * OPENING, 0.0, body.lowest[1] - middle);
    let now = placement.world_from_object.map_or(DVec3::ZERO, |pose| pose.position);
    let turn = gripper.rotation * body.turn * gripper.rotation.inverse();
    run.move_object(gripper.point(start) - now, turn.to_scaled_axis());
    let way = DVec3::new(-1.0, 0.0, -slant_deg.to_radians().tan());
    run.pull_object(gripper.direction(way) * (MASS * PULL));
    let mut loads = vec![(0.0, PadLoad::default())];
    while loads.last().is_some_and(|(depth, _)| *depth < WAY) {
        match run.next_event()? {
            SimEvent::Sampled(frame) => {
                let at = frame.world_from_object.map_or(DVec3::ZERO, |pose| gripper.inverse().point(pose.position));
                loads.push((start.x - at.x, PadLoad::new(scene, &frame)));
            }
            SimEvent::ActuationDue { .. } => {}
            SimEvent::Finished => break,
        }
    }
    Ok(loads)
}

/// Load between the samples around a depth (m).
fn at_depth(loads: &[(f64, PadLoad)], depth: f64) -> PadLoad {
    let after = loads.partition_point(|(reached, _)| *reached < depth).clamp(1, loads.len() - 1);
    let ((from, low), (to, high)) = (loads[after - 1], loads[after]);
    let share = (depth - from) / (to - from);
    PadLoad::sum([(1.0 - share, low), (share, high)])
}

/// Loads of a body pressed in from several places along a row of taxels.
struct PressedBody {
    places: Vec<Vec<(f64, PadLoad)>>,
    /// Length that forces are divided by (m).
    length: f64,
}

impl PressedBody {
    fn new(body: &RigidBody, slant_deg: f64, sticks: bool) -> Result<Self, StudyError> {
        let scene = straight_finger(sticks);
        let pitch = scene.gripper.taxels().row_pitch() / f64::from(PLACES);
        let places = (0..PLACES).map(|place| press(&scene, body, slant_deg, pitch * f64::from(place)));
        Ok(Self { places: places.collect::<Result<_, _>>()?, length: body.length })
    }

    /// Mean over the places, at a depth (m), with forces per length.
    fn at(&self, depth: f64) -> PadLoad {
        let mean = PadLoad::sum(self.places.iter().map(|loads| (1.0 / f64::from(PLACES), at_depth(loads, depth))));
        PadLoad { normal: mean.normal / self.length, along: mean.along / self.length, ..mean }
    }
}

/// A number of a continuum and that of our springs or joints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContinuumPair {
    pub continuum: f64,
    pub ours: f64,
}

impl ContinuumPair {
    fn new(continuum: f64, ours: f64) -> Self {
        Self { continuum: rounded(continuum), ours: rounded(ours) }
    }

    /// The continuum's over ours.
    pub(super) fn ratio(self) -> f64 {
        self.continuum / self.ours
    }
}

/// A body at a depth in the pad.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PadRow {
    /// Ball, cylinder, edge, flat, plate.
    pub body: String,
    /// Angle of its way from the normal (degrees).
    pub slant_deg: f64,
    /// True where it sticks; otherwise there is no friction.
    pub sticks: bool,
    pub depth_mm: f64,
    /// Force towards the pad (N for the ball, N/m for the others).
    pub normal: ContinuumPair,
    /// Force along the pad, where the way is slanted (the same units).
    pub along: Option<ContinuumPair>,
    /// Extent of the contact along the finger (mm).
    pub width_mm: ContinuumPair,
    /// Peak pressure (kPa): ours is that of a taxel.
    pub peak_kpa: ContinuumPair,
    /// Change of the continuum's normal force between two meshes (%); absent where one of them did not get as deep.
    pub mesh_percent: Option<f64>,
}

/// A load on the tip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FingerRow {
    /// F L² / (E I).
    pub load: f64,
    pub tip_angle_deg: f64,
    /// Deflection of the tip over the finger's length.
    pub deflection: ContinuumPair,
}

/// The pad and the finger beside a continuum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Continuum {
    pub pad: Vec<PadRow>,
    pub finger: Vec<FingerRow>,
}

impl Continuum {
    /// Computes our side of every case.
    pub(super) fn measure() -> Result<Self, StudyError> {
        let width = Scene::default().gripper.finger.width;
        let mut pad = Vec::new();
        let mut pressed: Option<(Vec<String>, PressedBody)> = None;
        for line in PAD.lines().skip(1) {
            let field: Vec<&str> = line.split(',').collect();
            let number = |k: usize| field.get(k).and_then(|text| text.parse::<f64>().ok());
            let wrong = || StudyError::missing(format!("another line in soft_pad.csv than: {line}"));
            let case: Vec<String> = field.iter().take(3).map(|text| (*text).to_owned()).collect();
            let (slant_deg, sticks) = (number(1).ok_or_else(wrong)?, number(2) == Some(1.0));
            if pressed.as_ref().is_none_or(|(known, _)| *known != case) {
                let body = RigidBody::named(field[0], width).ok_or_else(wrong)?;
                pressed = Some((case, PressedBody::new(&body, slant_deg, sticks)?));
            }
            let depth_mm = number(3).ok_or_else(wrong)?;
            let ours = pressed.as_ref().map(|(_, pressed)| pressed.at(1e-3 * depth_mm)).ok_or_else(wrong)?;
            let pair = |k: usize, ours: f64| Some(ContinuumPair::new(number(k)?.abs(), ours));
            pad.push(PadRow {
                body: field[0].to_owned(),
                slant_deg,
                sticks,
                depth_mm,
                normal: pair(4, ours.normal).ok_or_else(wrong)?,
                along: (slant_deg != 0.0).then(|| pair(5, ours.along)).flatten(),
                // The plate is seen across the finger, whose width it covers.
                width_mm: pair(6, 1e3 * if field[0] == "plate" { width } else { ours.width_m }).ok_or_else(wrong)?,
                peak_kpa: pair(7, 1e-3 * ours.peak_pa).ok_or_else(wrong)?,
                mesh_percent: number(8),
            });
        }
        let finger = FINGER.lines().skip(1).filter_map(finger_row).collect();
        Ok(Self { pad, finger })
    }

    /// Factors on our forces towards and along the pad that fit best, and the root mean squares of the logarithms that
    /// then remain.
    pub(super) fn best_factors(&self) -> [(f64, f64); 2] {
        let normal: Vec<f64> = self.pad.iter().map(|row| row.normal.ratio()).collect();
        let along: Vec<f64> = self.pad.iter().filter_map(|row| row.along).map(ContinuumPair::ratio).collect();
        [normal, along].map(|ratios| {
            let count = ratios.len().max(1) as f64;
            let mean = ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / count;
            let left = ratios.iter().map(|ratio| (ratio.ln() - mean).powi(2)).sum::<f64>() / count;
            (mean.exp(), left.sqrt())
        })
    }
}

/// Our chain under the load of a line of `soft_finger.csv`.
fn finger_row(line: &str) -> Option<FingerRow> {
    let number: Vec<f64> = line.split(',').map_while(|text| text.parse().ok()).collect();
    let [load, tip_angle_deg, _, _, solid_across, _] = number[..] else { return None };
    let mut scene = Scene::default();
    scene.world.gravity = 0.0;
    scene.support.kind = SupportKind::None;
    scene.gripper.finger.curvature_limit = 1e4;
    scene.effects.set(Effect::FingerContact, Setting::Off);
    let finger = &scene.gripper.finger;
    let force = load * finger.bending_stiffness / finger.length.powi(2);
    let mut run = SteppedScene::new(&scene, None, 0.02);
    let drive = Drive { tip_force: [DVec3::X * force, DVec3::ZERO], ..Drive::default() };
    run.cover(10.0, |_| drive).ok()?;
    let deflection = ContinuumPair::new(solid_across, run.tip().0 / scene.gripper.finger.length);
    Some(FingerRow { load, tip_angle_deg, deflection })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn springs_under_a_plate_press_with_their_own_law() {
        let scene = straight_finger(false);
        let (gripper, pad) = (&scene.gripper, &scene.gripper.pad);
        let body = RigidBody::named("plate", gripper.finger.width).expect("is known");
        let load = PressedBody::new(&body, 0.0, false).expect("finite").at(1e-3);
        let area = gripper.finger.width;
        let (want, _) = pad.law.force(pad.modulus * area / pad.thickness, pad.thickness, 1e-3);
        // Springs at both ends of the plate lean on its edges.
        let got = load.normal;
        assert!((1.0..1.12).contains(&(got / want)), "{got} N/m instead of {want}");
    }

    #[test]
    fn every_case_of_the_finite_elements_is_compared() {
        let found = Continuum::measure().expect("finite");
        assert_eq!((found.pad.len(), found.finger.len()), (PAD.lines().count() - 1, FINGER.lines().count() - 1));
        for row in &found.pad {
            assert!(row.normal.ours > 0.0 && row.width_mm.ours > 0.0, "{row:?}");
            assert_eq!(row.along.is_some(), row.slant_deg > 0.0, "{row:?}");
        }
        for row in &found.finger {
            assert!((row.deflection.ratio() - 1.0).abs() < 0.03, "{row:?}");
        }
    }
}
