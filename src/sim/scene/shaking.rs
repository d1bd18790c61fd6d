//! Motion of the hand once it has closed: it lifts what it holds off the support and shakes it.
//!
//! ```text
//! place(t) = lift s((t - start) / T) up  +  amplitude w(t) sin(2 pi f (t - start - T)) direction,     T = 0.3 s
//! ```
//!
//! s(u) = 10 u³ - 15 u⁴ + 6 u⁵ is the smoothest way from 0 to 1 (minimum jerk; Flash and Hogan 1985), and w rises and
//! falls by it within a period, so that the acceleration has no jumps.

use super::{Auto, Scene};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Settings of the shaking.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Shaking {
    /// Distance of the turning points from the middle (m). Zero: the hand stays where it is and lifts nothing.
    pub amplitude: f64,
    /// Oscillations per second (Hz).
    pub frequency: f64,
    /// Direction in the axes of the gripper: closing direction, across the fingers, up. Its length does not matter.
    pub direction: [f64; 3],
    /// Height by which the hand is lifted before (m).
    pub lift: f64,
    /// Beginning of the lift (s); `auto`: 0.2 s after the fingers have closed.
    pub start: Auto,
    /// End of the shaking (s); `auto`: the end of the hold.
    pub end: Auto,
}

impl Default for Shaking {
    fn default() -> Self {
        Self {
            amplitude: 0.0,
            frequency: 4.0,
            direction: [0.0, 0.0, 1.0],
            lift: 0.03, // clears a pedestal's rim at every amplitude up to here
            start: Auto::Auto,
            end: Auto::Auto,
        }
    }
}

/// Duration of the lift (s).
const LIFT_S: f64 = 0.3;
/// Time after the closing at which the lift begins by default (s): the fingers have come to rest.
const SETTLED_S: f64 = 0.2;
/// Largest |s''| of the minimum-jerk course.
const PEAK_OF_COURSE: f64 = 5.7735;

/// Prescribed motion of the hand, in the axes of the gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct HandMotion {
    /// Largest displacement to either side (m).
    swing: DVec3,
    /// Displacement by the lift (m).
    lift: DVec3,
    /// Angular frequency (rad/s).
    rate: f64,
    begins: f64,
    ends: f64,
}

/// Place, velocity and acceleration of the hand relative to where it began.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HandPlace {
    /// Displacement (m).
    pub place: DVec3,
    /// Velocity (m/s).
    pub velocity: DVec3,
    /// Acceleration (m/s²).
    pub acceleration: DVec3,
}

impl Scene {
    /// Motion of the hand as set in the scene; `None` where it stays where it is. The gripper stands upright: its third
    /// axis is the vertical.
    pub fn hand_motion(&self) -> Option<HandMotion> {
        let shaking = &self.shaking;
        if shaking.amplitude <= 0.0 {
            return None;
        }
        let closed = f64::from(self.programme.close_ticks()) / f64::from(self.timing.actuation_hz.max(1));
        let held = f64::from(self.programme.hold_ticks) / f64::from(self.timing.actuation_hz.max(1));
        Some(HandMotion {
            swing: DVec3::from_array(shaking.direction).normalize_or(DVec3::Z) * shaking.amplitude,
            lift: DVec3::Z * shaking.lift,
            rate: TAU * shaking.frequency,
            begins: shaking.start.value().unwrap_or(closed + SETTLED_S),
            ends: shaking.end.value().unwrap_or((closed + held).min(self.timing.duration_s)),
        })
    }
}

impl HandMotion {
    /// Time at which the hand starts to move (s).
    pub fn begins_s(&self) -> f64 {
        self.begins
    }

    /// Bound of the acceleration (m/s²).
    pub fn peak_acceleration(&self) -> f64 {
        let lifting = PEAK_OF_COURSE * self.lift.length() / (LIFT_S * LIFT_S);
        // Within the periods in which the swing grows and falls it is a little more than at its turning points.
        lifting.max(self.swing.length() * self.rate * self.rate)
    }

    /// The hand at a time (s).
    pub fn at(&self, t: f64) -> HandPlace {
        let (s, ds, dds) = course((t - self.begins) / LIFT_S);
        let shaken_from = self.begins + LIFT_S;
        let period = (TAU / self.rate).min(0.5 * (self.ends - shaken_from)).max(1e-9);
        let (up, up1, up2) = course((t - shaken_from) / period);
        let (down, down1, down2) = course((self.ends - t) / period);
        // The window is the product of its rise and its fall, which do not overlap.
        let w = up * down;
        let w1 = (up1 * down - up * down1) / period;
        let w2 = (up2 * down - 2.0 * up1 * down1 + up * down2) / (period * period);
        let (sin, cos) = (self.rate * (t - shaken_from)).sin_cos();
        let (x, v) = (w * sin, w1 * sin + w * self.rate * cos);
        let a = w2 * sin + 2.0 * w1 * self.rate * cos - w * self.rate * self.rate * sin;
        HandPlace {
            place: self.lift * s + self.swing * x,
            velocity: self.lift * (ds / LIFT_S) + self.swing * v,
            acceleration: self.lift * (dds / (LIFT_S * LIFT_S)) + self.swing * a,
        }
    }
}

/// The course s(u) with its first and second derivative; constant before 0 and after 1.
fn course(u: f64) -> (f64, f64, f64) {
    if u <= 0.0 {
        return (0.0, 0.0, 0.0);
    }
    if u >= 1.0 {
        return (1.0, 0.0, 0.0);
    }
    let square = u * u;
    (
        square * u * (10.0 - 15.0 * u + 6.0 * square),
        30.0 * square * (1.0 - 2.0 * u + square),
        60.0 * u * (1.0 - 3.0 * u + 2.0 * square),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shaken() -> HandMotion {
        let mut scene = Scene::default();
        scene.programme.hold_ticks = 40;
        scene.timing.duration_s = 7.0;
        (scene.shaking.amplitude, scene.shaking.direction) = (0.01, [0.0, 2.0, 0.0]);
        scene.hand_motion().expect("shaken")
    }

    #[test]
    fn velocity_and_acceleration_are_the_slopes_of_place_and_velocity() {
        let (motion, step) = (shaken(), 1e-6);
        for k in 0..700 {
            let t = 0.01 * f64::from(k) + 0.003;
            let (before, now, after) = (motion.at(t - step), motion.at(t), motion.at(t + step));
            let slope = |a: DVec3, b: DVec3| (b - a) / (2.0 * step);
            assert!(slope(before.place, after.place).abs_diff_eq(now.velocity, 1e-6), "{t}");
            assert!(slope(before.velocity, after.velocity).abs_diff_eq(now.acceleration, 1e-3), "{t}");
            assert!(now.acceleration.length() <= 1.2 * motion.peak_acceleration(), "{t}: {}", now.acceleration);
        }
    }

    #[test]
    fn it_lifts_then_shakes_then_stands_still_above() {
        let motion = shaken();
        assert_eq!(motion.begins_s(), 2.2);
        assert_eq!(motion.at(2.2), HandPlace::default());
        assert!(motion.at(2.5).place.abs_diff_eq(DVec3::Z * 0.03, 1e-12));
        // A quarter period after a whole number of them, in the middle of the shaking.
        assert!(motion.at(2.5 + 4.0 / 4.0 + 0.25 / 4.0).place.abs_diff_eq(DVec3::new(0.0, 0.01, 0.03), 1e-9));
        assert!(motion.at(6.5).place.abs_diff_eq(DVec3::Z * 0.03, 1e-12) && motion.at(6.5).velocity == DVec3::ZERO);
        assert_eq!(Scene::default().hand_motion(), None);
    }
}
