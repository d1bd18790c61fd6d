//! Crosstalk test on the shared link.

use super::sensor_job_error::SensorJobError;
use palpate_device::doctor::{Bleed, CrosstalkError, CrosstalkTest};
use palpate_tactile::board::{Board, KNOWN_AFTER, Reading};
use std::path::PathBuf;

/// Command to the crosstalk test.
#[derive(Clone, Debug, PartialEq)]
pub enum CrosstalkCommand {
    /// Begin, on the port that is open, else on this one, else on the only likely one.
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

/// Crosstalk test in the gripper thread.
#[derive(Default)]
pub(super) struct Crossing {
    /// Set once the board is known.
    test: Option<CrosstalkTest>,
    readings: u32,
}

impl Crossing {
    /// Adds a reading; true when the test is over. Fails where the board has too few sensors.
    pub(super) fn feed(&mut self, reading: &Reading, board: &Board) -> Result<bool, CrosstalkError> {
        self.readings = self.readings.saturating_add(1);
        if self.readings < KNOWN_AFTER {
            return Ok(false);
        }
        let test = match &mut self.test {
            Some(test) => test,
            empty @ None => empty.insert(CrosstalkTest::new(board)?),
        };
        test.see(board);
        test.feed(reading);
        Ok(test.source().is_none())
    }

    pub(super) fn skip(&mut self) {
        if let Some(test) = &mut self.test {
            test.skip();
        }
    }

    /// True when every sensor was moved or skipped.
    pub(super) fn is_over(&self) -> bool {
        self.test.as_ref().is_some_and(|test| test.source().is_none())
    }

    pub(super) fn found(&self) -> Vec<Bleed> {
        self.test.as_ref().map(|test| test.found().to_vec()).unwrap_or_default()
    }

    /// Result, in sentences.
    pub(super) fn summary(&self) -> Result<Vec<String>, SensorJobError> {
        self.test.as_ref().map(CrosstalkTest::summary).ok_or(SensorJobError::NoReadings)
    }

    pub(super) fn view(&self, link: String) -> RunningCrosstalk {
        RunningCrosstalk {
            instruction: self.test.as_ref().map_or(link, CrosstalkTest::instruction),
            step: self.test.as_ref().map(CrosstalkTest::step),
        }
    }
}
