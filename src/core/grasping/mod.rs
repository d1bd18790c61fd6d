//! One grasp on any rig: run the programme, keep the frames, say what happened.

mod collect;
mod poses;
mod run;
mod summary;

pub use collect::{CollectionError, CollectionPlan, CollectionProgress, CollectionReport, Shard, all_objects, collect};
pub use poses::{PoseSampler, jittered};
pub use run::{GraspRun, grasp, prepare};
pub use summary::{GraspSummary, HoldSummary};
