//! Description of a gripper: two fingers, their compliant pads, the actuation from line pressure to joint torque, and
//! the pressure programme. Plain data for the physics.

mod actuation;
mod auto;
mod bend;
mod build;
mod finger;
mod pad;
mod programme;
mod space;
mod strip;
mod taxels;

pub use actuation::{Actuation, TorquePoint};
pub use auto::Auto;
pub use bend::{BentFinger, FingerPlane, SegmentPose, bend};
pub use build::{BUILD, BuildSpread, FittedRanges};
pub use finger::{Finger, Sideways};
pub use pad::{Pad, PadLaw};
pub use programme::{Phase, Programme};
pub use space::{JointAxes, PlacedFinger, SegmentFrame, Sway, bend_in_space, sway_shares};
pub use strip::Strip;
pub use taxels::TaxelGrid;

use serde::{Deserialize, Serialize};

/// Side of the gripper. The left finger stands at negative x in the gripper frame and closes towards positive x.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The finger at negative x.
    Left,
    /// The finger at positive x.
    Right,
}

impl Side {
    /// Both, in the order in which arrays hold them.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// Position in arrays: left 0, right 1.
    pub fn index(self) -> usize {
        match self {
            Self::Left => 0,
            Self::Right => 1,
        }
    }

    /// The name used in files and on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    /// Sign of the closing direction along x in the gripper frame.
    pub fn closing_sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// A parallel two-finger pneumatic soft gripper (paper, section IV-B: SoftGripping, 0 to 1.5 bar).
///
/// GripperModel frame: origin midway between the fingers at the palm, z away from the fingertips, x the closing
/// direction, y across the fingers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct GripperModel {
    /// Distance between the two pads when open, and where the gripper is held.
    pub mount: Mount,
    /// Both fingers are alike.
    pub finger: Finger,
    /// The compliant inner side of each finger.
    pub pad: Pad,
    /// The flex strip on the back of each finger.
    pub strip: Strip,
    /// Line pressure to joint torque.
    pub actuation: Actuation,
    /// How far its constants may be off, where they were fitted to a real gripper; [`crate::scene::PoseSpread::build`] draws
    /// within these ranges. None where they are assumed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fitted: Option<FittedRanges>,
}

impl GripperModel {
    /// Distance of each neutral axis from the middle of the gripper when open (m).
    pub fn half_gap(&self) -> f64 {
        0.5 * self.mount.opening + self.pad.thickness
    }

    /// The fingers alone: held as by default, and without what is known of their constants.
    #[must_use]
    pub fn fingers(&self) -> Self {
        let mount = Mount { opening: self.mount.opening, ..Mount::default() };
        Self { mount, fitted: None, ..self.clone() }
    }

    /// The grid of taxels on each pad.
    pub fn taxels(&self) -> TaxelGrid {
        TaxelGrid::new(&self.finger, &self.pad)
    }

    /// The plane in which a finger bends.
    pub fn plane(&self, side: Side) -> FingerPlane {
        FingerPlane::new(side, self.half_gap())
    }
}

/// Mounting of the fingers relative to each other and to the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Mount {
    /// Pad to pad when open (m).
    pub opening: f64,
    /// Height of the palm above the middle of the resting object (m).
    pub grasp_depth: f64,
    /// Shift of the gripper from straight above the middle of the support, in world axes (m).
    pub offset: [f64; 3],
    /// Turn of the gripper about the vertical (degrees).
    pub yaw_deg: f64,
}

impl Default for Mount {
    fn default() -> Self {
        Self {
            opening: 0.084,     // our gripper, chosen to take the largest of the sixteen objects
            grasp_depth: 0.086, // tips a little below the middle: deeper, thin objects are wiped over; higher, they are scooped
            offset: [0.0; 3],
            yaw_deg: 0.0,
        }
    }
}
