//! Source of the data that the window shows.

/// Source of the data that are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewSource {
    /// The simulated gripper.
    #[default]
    Simulation,
    /// The real gripper.
    Gripper,
    /// The stored trial that is open.
    Trial,
}
