//! Labelling trials of the real gripper: which object to take next, when a grasp begins and ends, faults of a trial,
//! and trials whose label differs from the model's prediction. Nothing here touches a disk; the store keeps the
//! results.
//!
//! | file | holds |
//! |---|---|
//! | `class_name` | what a label may be |
//! | `plan` | how many trials of each object are wanted, which is next, and how it is to be held |
//! | `labelled_trial` | a trial as lists of labels show it |
//! | `flags` | faults of a trial, from its readings |
//! | `decimated` | a trial of any length in bounded memory, and its small picture |
//! | `segmentation` | beginning, phases and end of grasps in a stream |
//! | `sensor_watch` | sensors that fail, and what they should read |
//! | `disagreement` | trials to look at again |

mod disagreement;
mod flags;
mod segmentation;
#[cfg(test)]
mod segmentation_tests;
mod sensor_watch;
mod sparkline;

pub use disagreement::{Disagreement, disagreements};
pub use flags::{Observed, flags_of};
pub use segmentation::{PRE_ROLL_S, SegmentEvent, Segmenter, measured_phases, shows_grasps};
pub use sensor_watch::{SensorFault, SensorTrouble, SensorWatch};
pub use sparkline::{decimated, sparkline, stored_sparkline};
