//! Summary of a grasp in a few numbers: the object that `palpate grasp --json` prints.

use palpate_sim::frame::{Frame, Quality};
use palpate_sim::gripper::{Phase, Side, Sway};
use palpate_sim::scene::{Effect, Scene};
use palpate_tactile::trial::SimulatedTrial;
use palpate_tactile::{Quantity, Sensors, SignalDefinition, whole_fingers};
use serde::Serialize;

/// Normal force on a pad that counts as contact (N): below the 0.15 N at which the real force sensor wakes, well above
/// rounding.
pub const CONTACT_FORCE: f64 = 1e-3;

/// A grasp in a few numbers. Pairs are left, right.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GraspSummary {
    /// Name of the object.
    pub object: String,
    /// False when a number became infinite or NaN.
    pub finite: bool,
    /// False when any step missed the solver's tolerance.
    pub converged: bool,
    /// Warnings: defaults used, repairs, early ends.
    pub warnings: Vec<String>,
    /// First sample at which either pad carried load (s); null when never.
    pub contact_onset_s: Option<f64>,
    /// The end of the hold; null when the trial has none.
    pub hold: Option<HoldSummary>,
    /// Displacement of the object's frame from start to hold (m); null for an empty hand.
    pub object_moved_m: Option<f64>,
    /// Outcome of a shaking; null where the hand stays where it is.
    pub shaken: Option<ShakenSummary>,
    /// Solver statistics.
    pub quality: Quality,
}

/// Outcome of a shaking.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShakenSummary {
    /// Way of the object within the hand, from before the lift to the end of the hold (m); null for an empty hand.
    pub slipped_m: Option<f64>,
    /// True where both pads carry load at the end of the hold.
    pub held: bool,
}

/// Means over the last quarter of the hold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HoldSummary {
    /// Normal force on each pad (N), without that of the other finger.
    pub force_n: [f64; 2],
    /// Curvature that each strip measures (1/m).
    pub curvature_per_m: [f64; 2],
    /// Pressure that each pad measures: force over its sensing area (Pa).
    pub pressure_pa: [f64; 2],
    /// Force over the participation area of the contact (Pa).
    pub contact_pressure_pa: [f64; 2],
    /// Shape out of their planes; null for fingers that stay in them.
    pub out_of_plane: Option<OutOfPlaneSummary>,
}

/// Fingers that have bent sideways and twisted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OutOfPlaneSummary {
    /// Way of each tip along the gripper's y (m).
    pub tip_m: [f64; 2],
    /// Turn of each tip about its finger (rad).
    pub twist_rad: [f64; 2],
}

impl GraspSummary {
    /// No pad pressed the object at the end of the hold.
    pub fn lost_object(&self) -> bool {
        self.object_moved_m.is_some() && self.hold.as_ref().is_some_and(|hold| hold.force_n == [0.0, 0.0])
    }

    /// Reads a trial that was made from `scene`.
    pub fn new(trial: &SimulatedTrial, scene: &Scene) -> Self {
        let count = scene.gripper.taxels().count();
        let touches = |frame: &&Frame| Side::BOTH.iter().any(|s| frame.normal_force(*s, count) > CONTACT_FORCE);
        let held: Vec<&Frame> = trial.frames().iter().filter(|f| f.phase == Phase::Hold).collect();
        let place = |frame: &Frame| frame.world_from_object.map(|pose| pose.position);
        let moved = || Some((place(held.last()?)? - place(trial.frames().first()?)?).length());
        Self {
            object: trial.header.object.clone(),
            finite: trial.data.quality.finite,
            converged: trial.data.quality.converged,
            warnings: trial.header.warnings.clone(),
            contact_onset_s: trial.frames().iter().find(touches).map(|frame| frame.t),
            hold: HoldSummary::new(&held[held.len() - held.len().div_ceil(4)..], scene, trial.data.quality.hold_force),
            object_moved_m: moved(),
            shaken: ShakenSummary::new(trial, scene, &held),
            quality: trial.data.quality.clone(),
        }
    }
}

impl ShakenSummary {
    fn new(trial: &SimulatedTrial, scene: &Scene, held: &[&Frame]) -> Option<Self> {
        let motion = scene.hand_motion().filter(|_| trial.data.plan.is_on(Effect::Shaking.name()))?;
        let in_hand = |frame: &Frame| Some(frame.world_from_object?.position - frame.hand);
        let before = trial.frames().iter().rev().find(|frame| frame.t <= motion.begins_s())?;
        let last = held.last()?;
        let count = scene.gripper.taxels().count();
        Some(Self {
            slipped_m: in_hand(last).zip(in_hand(before)).map(|(last, before)| (last - before).length()),
            held: Side::BOTH.iter().all(|side| last.normal_force(*side, count) > CONTACT_FORCE),
        })
    }
}

impl HoldSummary {
    fn new(frames: &[&Frame], scene: &Scene, on_object: Option<[f64; 2]>) -> Option<Self> {
        if frames.is_empty() {
            return None;
        }
        let gripper = &scene.gripper;
        let mean = |value: &dyn Fn(&Frame, Side) -> f64| {
            Side::BOTH.map(|side| frames.iter().map(|f| value(f, side)).sum::<f64>() / frames.len() as f64)
        };
        let read = |signals: SignalDefinition, wanted: Quantity| {
            let channels = whole_fingers(signals).into_iter().filter(|channel| channel.quantity == wanted);
            let sensors = Sensors::of(channels.collect(), gripper);
            mean(&|frame, side| sensors.read(frame)[side.index()].unwrap_or_default())
        };
        let tip = |frame: &Frame, side: Side| {
            let placed = frame.placed(gripper, side);
            let last = placed.lengths.len() - 1;
            placed.point(last, placed.lengths[last], 0.0, 0.0).y
        };
        let sways = frames.iter().any(|frame| frame.sways != [Sway::NONE; 2]);
        Some(Self {
            out_of_plane: sways.then(|| OutOfPlaneSummary {
                tip_m: mean(&tip),
                twist_rad: mean(&|frame, side| frame.sways[side.index()].twist * gripper.finger.length),
            }),
            force_n: on_object.unwrap_or_else(|| read(SignalDefinition::Parts, Quantity::Force)),
            curvature_per_m: read(SignalDefinition::Parts, Quantity::Curvature),
            pressure_pa: read(SignalDefinition::Parts, Quantity::Pressure),
            contact_pressure_pa: read(SignalDefinition::Contact, Quantity::ContactPressure),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::grasp;
    use palpate_geometry::Primitive;
    use palpate_sim::objects::ObjectModel;
    use palpate_sim::scene::Setting;

    #[test]
    fn fingers_that_leave_their_planes_say_by_how_much() {
        let mut scene = Scene::default();
        scene.gripper.mount.offset = [0.0, 0.005, 0.0];
        scene.gripper.finger.sideways = scene.gripper.finger.of_solid_section(scene.gripper.pad.thickness);
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.02 }, 400.0, 0.6);
        let hold = |scene: &Scene| GraspSummary::new(&grasp(scene, Some(&ball), 0), scene).hold.expect("held");
        let shape = hold(&scene).out_of_plane.expect("bends");
        // The ball is at negative y, seen from the gripper: the pads turn away from what presses there.
        assert!(shape.twist_rad.iter().all(|twist| (0.01..0.5).contains(twist)), "{shape:?}");
        assert!(shape.tip_m.iter().all(|way| (1e-5..0.02).contains(&way.abs())), "{shape:?}");
        scene.effects.set(Effect::OutOfPlane, Setting::Off);
        assert_eq!(hold(&scene).out_of_plane, None);
    }

    #[test]
    fn a_larger_ball_is_met_earlier_and_bends_the_fingers_less() {
        let scene = Scene::default();
        let of = |radius: f64| {
            let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius }, 400.0, 0.6);
            GraspSummary::new(&grasp(&scene, Some(&ball), 0), &scene)
        };
        let (small, large) = (of(0.015), of(0.030));
        let (hold_small, hold_large) = (small.hold.expect("held"), large.hold.expect("held"));
        assert!(large.contact_onset_s < small.contact_onset_s && large.contact_onset_s.is_some());
        assert!(hold_large.curvature_per_m[0] < hold_small.curvature_per_m[0]);
        assert!(hold_large.force_n[1] > 0.1 && hold_large.pressure_pa[1] > 100.0);
    }

    #[test]
    fn a_shaken_grasp_says_whether_it_held() {
        let ball = ObjectModel::from_primitive("ball", Primitive::Sphere { radius: 0.020 }, 400.0, 0.6);
        let shaken = |amplitude: f64, frequency: f64| {
            let mut scene = Scene::default();
            (scene.programme.hold_ticks, scene.timing.duration_s) = (30, 6.0);
            (scene.shaking.amplitude, scene.shaking.frequency) = (amplitude, frequency);
            let summary = GraspSummary::new(&grasp(&scene, Some(&ball), 0), &scene);
            (summary.shaken, summary.object_moved_m, summary.quality.is_restless())
        };
        assert_eq!(shaken(0.0, 2.0).0, None);
        let (gentle, moved, restless) = shaken(0.002, 2.0);
        assert!(moved > Some(0.02), "lifted: {moved:?}");
        let gentle = gentle.expect("shaken");
        assert!(gentle.held && gentle.slipped_m < Some(0.004) && !restless, "{gentle:?}, restless {restless}");
        let hard = shaken(0.03, 8.0).0.expect("shaken");
        assert!(hard.slipped_m > Some(0.02), "{hard:?}");
    }

    #[test]
    fn an_empty_hand_touches_nothing_but_itself() {
        let mut scene = Scene::default();
        let summary = GraspSummary::new(&grasp(&scene, None, 0), &scene);
        let hold = summary.hold.expect("held");
        // The pads feel each other, but hold nothing.
        let [left, right] = hold.pressure_pa;
        assert!(left > 50.0 && (left / right - 1.0).abs() < 1e-6, "{left} Pa and {right} Pa");
        assert_eq!(hold.force_n, [0.0, 0.0]);
        assert!(summary.contact_onset_s.is_some() && summary.object_moved_m.is_none());
        scene.effects.set(Effect::FingerContact, Setting::Off);
        let summary = GraspSummary::new(&grasp(&scene, None, 0), &scene);
        assert_eq!(summary.contact_onset_s, None);
        assert_eq!(summary.hold.map(|hold| hold.force_n), Some([0.0, 0.0]));
    }
}
