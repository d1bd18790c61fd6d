//! Ranges. Every number a scene holds is checked once, here, and refused with its key, its value and the range.

use super::timing::{FASTEST_COMMON_HZ, MOST_TICKS};
use super::{Accuracy, Auto, Scene, SceneError};
use palpate_geometry::units::two_digits;
use std::ops::RangeInclusive;

/// Most characters of the name of an object.
const LONGEST_NAME: usize = 80;

/// Least thickness of a pad at its edges, as a share of that in the middle.
const LEAST_EDGE: f64 = 0.1;

/// Collects the first value out of range.
struct Ranges {
    fault: Option<SceneError>,
}

impl Ranges {
    fn number(&mut self, key: &str, value: f64, range: RangeInclusive<f64>) {
        // `contains` is false for NaN.
        if !range.contains(&value) {
            self.refuse(key, &value, &format!("between {} and {}", range.start(), range.end()));
        }
    }

    fn numbers(&mut self, key: &str, values: &[f64], range: &RangeInclusive<f64>) {
        for value in values {
            self.number(key, *value, range.clone());
        }
    }

    /// A range within another one.
    fn between(&mut self, key: &str, [low, high]: [f64; 2], range: RangeInclusive<f64>) {
        self.numbers(key, &[low, high], &range);
        if low > high {
            self.refuse(key, &format!("[{low}, {high}]"), "the smaller number first");
        }
    }

    fn auto(&mut self, key: &str, value: Auto, range: RangeInclusive<f64>) {
        if let Auto::Value(x) = value {
            self.number(key, x, range);
        }
    }

    fn count(&mut self, key: &str, value: u32, range: RangeInclusive<u32>) {
        if !range.contains(&value) {
            self.refuse(key, &value, &format!("between {} and {}", range.start(), range.end()));
        }
    }

    fn refuse(&mut self, key: &str, value: &dyn std::fmt::Display, wanted: &str) {
        let sentence = || SceneError::Refused(format!("{key} = {value} is not possible; it must be {wanted}"));
        self.fault.get_or_insert_with(sentence);
    }
}

impl Scene {
    /// Refuses values that no gripper, object or computer can have, naming the key.
    pub fn check(&self) -> Result<(), SceneError> {
        #[cfg(not(feature = "rapier"))]
        self.check_engine()?;
        let mut ranges = Ranges { fault: None };
        self.check_object_and_support(&mut ranges);
        self.check_gripper(&mut ranges);
        self.check_programme(&mut ranges);
        self.check_shaking(&mut ranges);
        self.check_timing_and_solver(&mut ranges);
        match ranges.fault {
            Some(fault) => Err(fault),
            None => Ok(()),
        }
    }

    #[cfg(not(feature = "rapier"))]
    fn check_engine(&self) -> Result<(), SceneError> {
        let without = |setting: &str| {
            Err(SceneError::Refused(format!(
                "{setting} needs rapier, which this build leaves out; build with the feature `rapier`"
            )))
        };
        if self.solver.engine == super::EngineKind::Rapier {
            return without("solver.engine = \"rapier\"");
        }
        if self.uses_resting_faces() {
            return without("pose.faces = \"natural\" (and \"any\" for a free object)");
        }
        Ok(())
    }

    fn check_object_and_support(&self, ranges: &mut Ranges) {
        let object = &self.object;
        if object.source.trim().is_empty() {
            ranges.refuse("object.source", &"\"\"", "a name or a path");
        }
        let is_name = |name: &&String| name.chars().count() <= LONGEST_NAME && !name.contains(char::is_control);
        if let Some(name) = object.name.as_ref().filter(|name| !is_name(name)) {
            ranges.refuse("object.name", &format!("{name:?}"), "at most 80 characters on one line");
        }
        ranges.numbers("object.rotation_deg", &object.rotation_deg, &(-360.0..=360.0));
        ranges.numbers("object.shift", &object.shift, &(-0.5..=0.5));
        ranges.auto("object.mass", object.mass, 1e-6..=1e3);
        ranges.number("object.density", object.density, 0.1..=30_000.0);
        ranges.auto("object.friction", object.friction, 0.0..=100.0);
        ranges.auto("object.modulus", object.modulus, 100.0..=1e12);
        ranges.auto("object.shell", object.shell, 1e-4..=1.0);
        ranges.auto("object.scale", object.scale, 1e-9..=1e9);
        ranges.numbers("pose.shift", &self.pose.shift, &(0.0..=0.5));
        ranges.number("pose.yaw_deg", self.pose.yaw_deg, 0.0..=180.0);
        ranges.number("pose.build", self.pose.build, 0.0..=1.0);
        let support = &self.support;
        ranges.number("support.height", support.height, 0.0..=2.0);
        ranges.number("support.radius", support.radius, 5e-4..=1.0);
        ranges.number("support.friction", support.friction, 0.0..=100.0);
        ranges.number("support.sink", support.sink, 1e-9..=1e-2);
        ranges.number("support.stiffness", support.stiffness, 1.0..=1e9);
        ranges.number("world.gravity", self.world.gravity, 0.0..=1000.0);
    }

    fn check_shaking(&self, ranges: &mut Ranges) {
        let shaking = &self.shaking;
        ranges.number("shaking.amplitude", shaking.amplitude, 0.0..=0.5);
        ranges.number("shaking.frequency", shaking.frequency, 0.01..=100.0);
        ranges.numbers("shaking.direction", &shaking.direction, &(-1e3..=1e3));
        if shaking.direction == [0.0; 3] {
            ranges.refuse("shaking.direction", &"[0, 0, 0]", "a direction");
        }
        ranges.number("shaking.lift", shaking.lift, 0.0..=0.5);
        ranges.auto("shaking.start", shaking.start, 0.0..=1e5);
        ranges.auto("shaking.end", shaking.end, 0.0..=1e5);
    }

    fn check_gripper(&self, ranges: &mut Ranges) {
        use crate::gripper::Finger;
        let mount = &self.gripper.mount;
        ranges.number("gripper.mount.opening", mount.opening, 0.0..=1.0);
        ranges.number("gripper.mount.grasp_depth", mount.grasp_depth, 0.0..=1.0);
        ranges.numbers("gripper.mount.offset", &mount.offset, &(-0.2..=0.2));
        ranges.number("gripper.mount.yaw_deg", mount.yaw_deg, -360.0..=360.0);
        let finger = &self.gripper.finger;
        if let Some(fitted) = &self.gripper.fitted {
            ranges.between("gripper.fitted.stiffness", fitted.stiffness, 0.05..=20.0);
            ranges.between("gripper.fitted.torque_per_stiffness", fitted.torque_per_stiffness, 0.05..=20.0);
            ranges.between("gripper.fitted.filling_s", fitted.filling_s, -10.0..=10.0);
        }
        ranges.number("gripper.finger.length", finger.length, 5e-3..=2.0);
        ranges.number("gripper.finger.width", finger.width, 1e-3..=1.0);
        ranges.number("gripper.finger.back", finger.back, 0.0..=1.0);
        let joints = small_count(finger.joints);
        ranges.count("gripper.finger.joints", joints, Finger::FEWEST_JOINTS..=Finger::MOST_JOINTS);
        ranges.number("gripper.finger.mass", finger.mass, 1e-6..=100.0);
        ranges.number("gripper.finger.bending_stiffness", finger.bending_stiffness, 1e-9..=1e6);
        ranges.number("gripper.finger.damping_time", finger.damping_time, 0.0..=100.0);
        ranges.number("gripper.finger.curvature_limit", finger.curvature_limit, 1e-3..=1e4);
        ranges.number("gripper.finger.creep_share", finger.creep_share, 0.0..=0.99);
        ranges.number("gripper.finger.creep_time", finger.creep_time, 1e-3..=1e6);
        let sideways = &finger.sideways;
        let (bending, torsion) =
            ("gripper.finger.sideways.bending_stiffness", "gripper.finger.sideways.torsional_stiffness");
        ranges.auto(bending, sideways.bending_stiffness, 1e-9..=1e6);
        ranges.auto(torsion, sideways.torsional_stiffness, 1e-9..=1e6);
        let given = |stiffness: Auto| stiffness.value().is_some();
        for (key, own, other) in [
            (bending, sideways.bending_stiffness, sideways.torsional_stiffness),
            (torsion, sideways.torsional_stiffness, sideways.bending_stiffness),
        ] {
            if !given(own) && given(other) {
                ranges.refuse(key, &"\"auto\"", "a number where the other stiffness out of the plane is one");
            }
        }
        let pad = &self.gripper.pad;
        ranges.number("gripper.pad.thickness", pad.thickness, 1e-4..=0.5);
        ranges.number("gripper.pad.modulus", pad.modulus, 1.0..=1e12);
        let least_crown = 0.51 * finger.width; // a crown rounder than the pad is wide would leave its edges behind
        ranges.number("gripper.pad.crown_radius", pad.crown_radius, least_crown..=1e6);
        let least = (0.5 * finger.width).powi(2) / (2.0 * pad.crown_radius * (1.0 - LEAST_EDGE));
        if pad.thickness < least {
            let wanted = format!(
                "at least {}: with its crown_radius of {} a thinner pad has no edges left, a larger one makes it flatter",
                two_digits(least),
                pad.crown_radius
            );
            ranges.refuse("gripper.pad.thickness", &pad.thickness, &wanted);
        }
        ranges.number("gripper.pad.dissipation", pad.dissipation, 0.0..=1e4);
        ranges.number("gripper.pad.shear_damping_time", pad.shear_damping_time, 0.0..=1.0);
        ranges.number("gripper.pad.friction", pad.friction, 0.0..=100.0);
        ranges.count("gripper.pad.rows", small_count(pad.rows), 2..=400);
        ranges.count("gripper.pad.columns", small_count(pad.columns), 1..=64);
        self.check_strip(ranges);
    }

    fn check_strip(&self, ranges: &mut Ranges) {
        let (strip, finger) = (&self.gripper.strip, &self.gripper.finger);
        ranges.auto("gripper.strip.length_m", strip.length_m, 1e-3..=finger.length);
        let [from, to] = strip.reach(finger);
        // Rounded, so that a strip may end at the tip.
        let most = ((finger.length - (to - from)) * 1e7).round() * 1e-7;
        ranges.auto("gripper.strip.from_m", strip.from_m, 0.0..=most);
    }

    fn check_programme(&self, ranges: &mut Ranges) {
        let actuation = &self.gripper.actuation;
        ranges.number("gripper.actuation.max_bar", actuation.max_bar, 1e-3..=100.0);
        ranges.number("gripper.actuation.step_bar", actuation.step_bar, 1e-6..=actuation.max_bar);
        ranges.number("gripper.actuation.filling_time", actuation.filling_time, 0.0..=100.0);
        let points = small_count(actuation.curve.len());
        ranges.count("gripper.actuation.curve (its number of points)", points, 2..=1000);
        for point in &actuation.curve {
            ranges.number("gripper.actuation.curve.bar", point.bar, -100.0..=100.0);
            ranges.number("gripper.actuation.curve.torque", point.torque, -1e4..=1e4);
        }
        if let Some(pair) = actuation.curve.windows(2).find(|pair| pair[1].bar <= pair[0].bar) {
            ranges.refuse("gripper.actuation.curve.bar", &pair[1].bar, "rising from point to point");
        }
        let programme = &self.programme;
        ranges.number("programme.peak_bar", programme.peak_bar, 0.0..=actuation.max_bar);
        ranges.number("programme.close_bar_per_tick", programme.close_bar_per_tick, 1e-6..=actuation.max_bar);
        ranges.number("programme.release_bar_per_tick", programme.release_bar_per_tick, 1e-6..=actuation.max_bar);
    }

    fn check_timing_and_solver(&self, ranges: &mut Ranges) {
        let timing = &self.timing;
        ranges.count("timing.sample_hz", timing.sample_hz, 1..=FASTEST_COMMON_HZ);
        ranges.count("timing.actuation_hz", timing.actuation_hz, 1..=FASTEST_COMMON_HZ);
        let shortest = 1.0 / f64::from(timing.sample_hz.max(1));
        ranges.number("timing.duration_s", timing.duration_s, shortest..=3600.0);
        if timing.common_hz() > u64::from(FASTEST_COMMON_HZ) {
            let rates = format!("{} and timing.actuation_hz = {}", timing.sample_hz, timing.actuation_hz);
            ranges.refuse("timing.sample_hz", &rates, &format!("rates that meet below {FASTEST_COMMON_HZ} Hz"));
        }
        let solver = &self.solver;
        if let Some(tolerance) = solver.accuracy.tolerance() {
            ranges.number("solver.accuracy", tolerance, Accuracy::TOLERANCES);
        }
        ranges.number("solver.tolerance", solver.tolerance, 1e-14..=1e-2);
        ranges.count("solver.max_iterations", solver.max_iterations, 1..=10_000);
        ranges.count("solver.relag_passes", solver.relag_passes, 0..=100);
        ranges.auto("solver.distance_cell", solver.distance_cell, 1e-6..=0.1);
        if ranges.fault.is_none() && timing.clock(solver.accuracy).total_ticks() > MOST_TICKS {
            ranges.refuse("timing.duration_s", &timing.duration_s, &format!("a trial of at most {MOST_TICKS} steps"));
        }
    }
}

fn small_count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl Fn(&mut Scene)) -> String {
        let mut scene = Scene::default();
        change(&mut scene);
        scene.check().expect_err("out of range").to_string()
    }

    #[test]
    fn the_default_scene_is_in_range() {
        assert_eq!(Scene::default().check(), Ok(()));
    }

    #[cfg(not(feature = "rapier"))]
    #[test]
    fn scenes_that_need_rapier_are_refused_by_name() {
        assert!(refused(|s| s.solver.engine = crate::scene::EngineKind::Rapier).contains("solver.engine"));
        assert!(refused(|s| s.pose.faces = crate::scene::Faces::Natural).contains("pose.faces"));
    }

    #[test]
    fn refusals_name_the_key() {
        assert!(refused(|s| s.gripper.pad.modulus = f64::NAN).contains("gripper.pad.modulus"));
        // The edges lie 2.5 mm below the middle.
        assert!(
            refused(|s| s.gripper.pad.thickness = 0.0027).contains("at least 0.0028: with its crown_radius of 0.02")
        );
        assert!(refused(|s| s.gripper.finger.joints = 81).contains("between 2 and 80"));
        let half = |s: &mut Scene| s.gripper.finger.sideways.torsional_stiffness = Auto::Value(1e-3);
        assert!(refused(half).contains("gripper.finger.sideways.bending_stiffness"));
        // 55.37 mm from 50 mm on end beyond a finger of 100 mm.
        assert!(refused(|s| s.gripper.strip.from_m = Auto::Value(0.05)).contains("gripper.strip.from_m"));
        assert!(refused(|s| s.gripper.strip.length_m = Auto::Value(0.11)).contains("gripper.strip.length_m"));
        let both = |bending| {
            move |s: &mut Scene| {
                half(s);
                s.gripper.finger.sideways.bending_stiffness = Auto::Value(bending);
            }
        };
        for bending in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(refused(both(bending)).contains("gripper.finger.sideways.bending_stiffness"), "{bending}");
        }
        assert!(refused(|s| s.timing.sample_hz = 9973).contains("timing.sample_hz"));
        assert!(refused(|s| s.timing.duration_s = f64::INFINITY).contains("timing.duration_s"));
        assert!(refused(|s| s.programme.peak_bar = 1.6).contains("programme.peak_bar"));
        assert!(refused(|s| s.gripper.actuation.curve.reverse()).contains("rising"));
        assert!(refused(|s| s.object.source.clear()).contains("object.source"));
    }
}
