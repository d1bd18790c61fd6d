//! The real gripper for the window: a thread "gripper" that owns the link to the board and shares its readings between live view,
//! recorded trial, recognition and calibration.
//!
//! ```text
//!  UI                          "gripper"                                        serial-read, serial-decode
//!  GripperCommand ------------>   connects, drives the control box      <--events--   link
//!  <--newest GripperView----   derives angle and force, recognises
//!  <--every TraceRow--------   records: each reading, a second at a time
//!  <--Notice----------------
//! ```

mod calibrating;
mod guided;
mod messages;
mod observing;
mod plotted;
mod session;
mod worker;

pub use calibrating::{CalibrationCommand, CalibrationPlan, CalibrationSession, CalibrationSetup, keep_calibration};
pub use guided::{CalibrationView, CrosstalkCommand, CrosstalkView, Guided};
pub use messages::{EndedTrial, GripperCommand, GripperSetup, GripperView, LatestReading, TrialView};
pub use observing::ObserveRequest;
pub use worker::GripperWorker;
