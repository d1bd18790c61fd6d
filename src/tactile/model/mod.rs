//! Sensor models: perfect sensors, as in the paper's simulation, or the strips, pads, dividers
//! and clock of a real sensorised gripper (paper, section IV-B). A model is applied to the clean signals of a finished
//! trial, so that one simulation serves both.
//!
//! The chain of the real gripper, first to last; each link is a switch of [`PhysicalLike`]:
//!
//! | link | flex strip (curvature) | pad (force, or that over its area) |
//! |---|---|---|
//! | stepped closing | signals held on a grid of steps, sampled once settled | the same |
//! | clock | 50 Hz, late start, jitter | the same |
//! | mounting | share of the bend that reaches the strip, by side | share of the load, threshold, by side |
//! | parts | flat resistance, rise with bend | gain, exponent |
//! | slip | gain of this grasp | conductance of this grasp |
//! | hysteresis | creep | unloading reads higher |
//! | threshold, saturation | none backwards, none beyond a fold | silent below, saturated above |
//! | drift | rest resistance of this grasp | conductance grows under load |
//! | noise, counts | divider, converter | divider, amplifier, converter |
//!
//! Readings have the units of the clean signals, by a nominal two-point calibration, as a user of the real gripper
//! would make it: the difference between nominal and actual part stays in the readings. A real pad also fires when it
//! is bent (Interlink's guide, "false triggering"). The model of the real gripper leaves it out, so that a channel
//! reads the same in every layout that has it; that of any gripper draws it.
//!
//! Constants without a source are marked as assumed. They were chosen from data sheets and from the published facts
//! about the real recordings, before any recogniser was trained on the result.

mod chain;
mod flex;
mod force_pad;
mod input;
mod physical_like;
mod sampling;
mod stepping;
mod streams;
#[cfg(test)]
mod tests;

pub use physical_like::{GRIPPER, PhysicalLike};
pub use sampling::SAMPLE_HZ;
pub use streams::Stream;

use super::Signals;
use serde::{Deserialize, Serialize};

/// Sensor model of a gripper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorModel {
    /// Perfect sensors, as in the paper's simulation.
    #[default]
    Virtual,
    /// Perfect parts that slip a little, drift a little and are read with noise.
    Noisy,
    /// Sensors as on the real gripper: [`PhysicalLike`] with everything on.
    PhysicalLike,
    /// Sensors as on the real gripper after one close of the empty hand, by which [`crate::calibration::EmptyHand`]
    /// calibrates them.
    Adapted,
    /// Sensors as on any real gripper: parts and their mounting are drawn anew for each grasp, and one empty close is
    /// known. For training recognisers for grippers without labelled grasps.
    Drawn,
}

impl SensorModel {
    /// All.
    pub const ALL: [Self; 5] = [Self::Virtual, Self::Noisy, Self::PhysicalLike, Self::Adapted, Self::Drawn];
    /// Those of one gripper, the clean one first.
    pub const BOTH: [Self; 2] = [Self::Virtual, Self::PhysicalLike];

    /// The name used in files and on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Virtual => "virtual",
            Self::Noisy => "noisy",
            Self::PhysicalLike => "physical-like",
            Self::Adapted => "adapted",
            Self::Drawn => "drawn",
        }
    }

    /// A model by its name, in either case.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.name().eq_ignore_ascii_case(name.trim()))
    }

    /// Readings of a grasp from its clean signals. `seed` determines the grasp's noise, drift, jitter
    /// and slip; the parts of the gripper are the same for every seed.
    pub fn apply(self, clean: &Signals, seed: u64) -> Signals {
        self.apply_on(clean, seed, seed)
    }

    /// The same on the gripper of a number; only [`Self::Drawn`] has several.
    pub fn apply_on(self, clean: &Signals, gripper: u64, seed: u64) -> Signals {
        match self {
            Self::Virtual => clean.clone(),
            Self::Noisy => PhysicalLike::MILD.apply(clean, seed),
            Self::PhysicalLike => PhysicalLike::default().apply(clean, seed),
            Self::Adapted => PhysicalLike { closed_empty: true, ..PhysicalLike::default() }.apply(clean, seed),
            Self::Drawn => PhysicalLike::any(gripper).apply(clean, seed),
        }
    }
}
