//! Recording: one recorder thread for all trials, and the recording of a real grasp that the command line and the window
//! share.

mod board_trial;
mod board_writer;
mod recent;
mod record;
mod recorder;
mod replay;
#[cfg(test)]
mod tests;

pub use board_trial::{BoardTrialRecording, TrialRequest};
pub use board_writer::{BoardTrialPlan, RecordedTrial};
pub use recent::RecentEvents;
pub use record::{RecordError, RecordProgress, Recording, record};
pub use recorder::{BoardTrialEnd, Recorder, RecorderNotice};
pub(crate) use replay::REST_S;
pub use replay::{OpenTrialError, Replay};
