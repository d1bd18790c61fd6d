//! How far the builds of grippers of one kind differ, and how far a fit leaves the build of one open.

use serde::{Deserialize, Serialize};

/// Ranges of the gripper's build at `pose.build = 1`, assumed: the scene's constants times or plus these, evenly drawn.
pub const BUILD: BuildSpread = BuildSpread {
    stiffness: [0.75, 1.25],
    torque: [0.83, 1.17],
    pad_modulus: [0.6, 1.7],
    pad_friction: [0.6, 1.3],
    filling_s: [0.0, 0.12],
};

/// Ranges in which grippers of one kind differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BuildSpread {
    /// Factor on the bending stiffness of both fingers.
    pub stiffness: [f64; 2],
    /// Factor on the torque at any line pressure.
    pub torque: [f64; 2],
    /// Factor on the modulus of the pads.
    pub pad_modulus: [f64; 2],
    /// Factor on the friction of the pads.
    pub pad_friction: [f64; 2],
    /// Time constant of filling that is added (s).
    pub filling_s: [f64; 2],
}

/// 95 % intervals of fitted constants of a gripper, about its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FittedRanges {
    /// Factor on the bending stiffness, with the same torque per stiffness.
    pub stiffness: [f64; 2],
    /// Factor on the torque per stiffness, which decides the shape in free bending.
    pub torque_per_stiffness: [f64; 2],
    /// Change of the filling time (s).
    pub filling_s: [f64; 2],
}

impl Default for FittedRanges {
    /// As among any grippers of its kind.
    fn default() -> Self {
        Self { stiffness: BUILD.stiffness, torque_per_stiffness: BUILD.torque, filling_s: BUILD.filling_s }
    }
}
