//! One grasp on any rig: run the programme, keep the frames, say what happened.

mod poses;
mod run;
mod summary;

pub use poses::{PoseSampler, jittered};
pub use run::{GraspRun, grasp, prepare};
pub use summary::{GraspSummary, HoldSummary};
