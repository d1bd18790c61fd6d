//! The real gripper for a window: a thread "gripper" that owns the link to the board and shares what it hears between all
//! who want it: the live view, the trial that is being recorded, recognition, and a calibration.
//!
//! ```text
//!  UI                          "gripper"                                        serial-read, serial-decode
//!  GripperWish ------------>   connects, conducts the control box    <--events--   link
//!  <--newest GripperView----   derives angle and force, recognises
//!  <--every TraceRow--------   records: each reading, a second at a time
//!  <--Notice----------------
//! ```

mod calibrating;
mod crosstalk;
mod desk;
mod messages;
mod observing;
mod plotted;
mod worker;

pub use calibrating::{CalibrationPlan, CalibrationView, CalibrationWish, RunningCalibration};
pub use crosstalk::{CrosstalkView, CrosstalkWish, RunningCrosstalk};
pub use messages::{EndedTrial, GripperView, GripperWish, LatestReading, TrialView};
pub use observing::ObserveRequest;
pub use worker::{GripperSetup, GripperWorker};
