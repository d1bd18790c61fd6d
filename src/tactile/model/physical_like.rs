//! Sensors as on a real gripper; each of their faults can be switched off.

use super::streams::Stream;
use serde::{Deserialize, Serialize};

/// Default gripper whose parts are drawn: the first whose two whole-finger strips rise within
/// 2 % of the nominal calibration, which the published readings of the real gripper suggest.
pub const GRIPPER: u64 = 127;

/// Faults of the sensors, each a switch, and the gripper from which their tolerances are drawn. Other constants are
/// with the parts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PhysicalLike {
    /// Names the gripper: the tolerances of its parts are drawn from it, the same for every grasp.
    pub gripper: u64,
    /// The closing goes in steps and is sampled once each has settled; a quasi-static re-timing.
    pub stepping: bool,
    /// The recording starts a little early or late, and its clock jitters.
    pub jitter: bool,
    /// Less of the bend and of the load reaches the sensors on the right.
    pub asymmetry: bool,
    /// Parts are not the nominal ones that the calibration knows.
    pub parts: bool,
    /// Sensors sit a little differently in every grasp.
    pub slip: bool,
    /// Readings depend on what went before: strips creep, pads read more while unloading.
    pub hysteresis: bool,
    /// The rest angle of strips is another in every grasp; the conductance of pads grows under load.
    pub drift: bool,
    /// Pads do not respond to a light touch, strips not to bending backwards.
    pub threshold: bool,
    /// Pads saturate at full force, strips cannot be bent beyond a fold.
    pub saturation: bool,
    /// Voltages are noisy.
    pub noise: bool,
    /// Voltages are read in whole counts of 12 bits.
    pub counts: bool,
    /// Strips and pads sit on the fingers as on any gripper: how much of the bend and load reaches them, their thresholds,
    /// the load at which pads saturate and how much pads fire when bent are drawn for the gripper, instead of
    /// `asymmetry`, `full_force` and the thresholds of the real one.
    pub drawn: bool,
    /// The gains of the strips, and what bending does to the pads, are known from one empty close of the hand.
    pub closed_empty: bool,
    /// Force at which the nominal pad saturates (N). Assumed: 0.3 N. Real recordings have nearly three levels only,
    /// idle, touched and saturated; simulated grips press with 0.2 to 0.7 N, and must saturate soon after a touch as
    /// well.
    pub full_force: f64,
}

impl Default for PhysicalLike {
    /// Everything on.
    fn default() -> Self {
        Self {
            stepping: true,
            jitter: true,
            asymmetry: true,
            parts: true,
            slip: true,
            hysteresis: true,
            drift: true,
            threshold: true,
            saturation: true,
            noise: true,
            counts: true,
            ..Self::OFF
        }
    }
}

impl PhysicalLike {
    /// Everything off: clean signals, read at 50 Hz.
    pub const OFF: Self = Self {
        gripper: GRIPPER,
        stepping: false,
        jitter: false,
        asymmetry: false,
        parts: false,
        slip: false,
        hysteresis: false,
        drift: false,
        threshold: false,
        saturation: false,
        noise: false,
        counts: false,
        drawn: false,
        closed_empty: false,
        full_force: 0.3,
    };

    /// Nominal parts that slip and drift, are noisy and are read in counts.
    pub const MILD: Self = Self { slip: true, drift: true, noise: true, counts: true, ..Self::OFF };

    /// Any gripper, with everything on: its parts and their mounting are drawn, and it has closed empty once. Every other
    /// one closes in steps.
    pub fn any(gripper: u64) -> Self {
        let stepping = Stream::new(gripper, "hand", "stepping").within(0.0, 1.0) < 0.5;
        Self { gripper, stepping, drawn: true, closed_empty: true, ..Self::default() }
    }
}
