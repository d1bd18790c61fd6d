//! Crosstalk test on the shared link.

use super::calibrating::SensorJobError;
use palpate_device::doctor::{Bleed, CrosstalkSession, CrosstalkTest};
use std::path::PathBuf;

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

/// State of the crosstalk test.
#[derive(Clone, Debug, Default)]
pub struct CrosstalkView {
    /// Running test.
    pub running: Option<RunningCrosstalk>,
    /// Crosstalk found so far, or in the last test.
    pub found: Vec<Bleed>,
    /// Result of the last test, in sentences.
    pub ended: Option<Result<Vec<String>, SensorJobError>>,
}

/// Running crosstalk test.
#[derive(Clone, Debug, PartialEq)]
pub struct RunningCrosstalk {
    /// Instruction for the next step.
    pub instruction: String,
    /// Number of the step, from 1, and number of steps; none before the first reading.
    pub step: Option<[usize; 2]>,
}

impl CrosstalkView {
    /// View of a running test; `link` is the state of the link, in a sentence.
    pub(super) fn running(session: &CrosstalkSession, link: String) -> Self {
        let test = session.test();
        let instruction = test.map_or(link, CrosstalkTest::instruction);
        let running = Some(RunningCrosstalk { instruction, step: test.map(CrosstalkTest::step) });
        Self { running, ended: None, ..Self::ended(session) }
    }

    /// View of a test that has ended.
    pub(super) fn ended(session: &CrosstalkSession) -> Self {
        let found = session.test().map(|test| test.found().to_vec()).unwrap_or_default();
        let nothing = || SensorJobError::Failed("no readings from the board".to_owned());
        let ended = session.test().map(CrosstalkTest::summary).ok_or_else(nothing);
        Self { running: None, found, ended: Some(ended) }
    }
}
