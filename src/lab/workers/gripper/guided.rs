//! Guided work on the shared link: a calibration, or a crosstalk test.

use super::calibrating::CalibrationSession;
use crate::workers::job::JobFailure;
use palpate_device::doctor::CrosstalkTest;
use std::path::PathBuf;

/// Guided work: its session while it runs, and how the last one ended.
#[derive(Clone, Debug)]
pub struct Guided<S, E> {
    /// Running session.
    pub running: Option<S>,
    /// Result of the last one.
    pub ended: Option<Result<E, JobFailure>>,
}

impl<S, E> Default for Guided<S, E> {
    fn default() -> Self {
        Self { running: None, ended: None }
    }
}

/// State of the calibration; its result is a sentence.
pub type CalibrationView = Guided<CalibrationSession, String>;

/// State of the crosstalk test; its result is what the test has found.
pub type CrosstalkView = Guided<CrosstalkTest, CrosstalkTest>;

/// Command to the crosstalk test.
#[derive(Clone, Debug, PartialEq)]
pub enum CrosstalkCommand {
    /// Begin: on the open port, or else on this one, or else on the only likely one.
    Begin(Option<PathBuf>),
    /// Skip the present sensor.
    Skip,
    /// Stop and report the results so far.
    Stop,
}
