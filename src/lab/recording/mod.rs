//! Recording trials into the store.

mod board_recorder;
#[cfg(test)]
mod board_tests;

pub use board_recorder::{BoardRecorder, BoardTrialPlan, Recorded};
