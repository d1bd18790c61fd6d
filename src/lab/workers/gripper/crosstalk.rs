//! The doctor's crosstalk test on the link that everybody shares.

use palpate_device::doctor::{Bleed, CrosstalkTest};
use palpate_tactile::board::{Board, KNOWN_AFTER, Reading};
use std::path::PathBuf;

/// What the user wants of the crosstalk test.
#[derive(Clone, Debug, PartialEq)]
pub enum CrosstalkCommand {
    /// Begin, on the port that is open, else on this one, else on the only likely one.
    Begin(Option<PathBuf>),
    /// Leave out the sensor that is to be moved.
    Skip,
    /// Say what was seen so far.
    Stop,
}

/// Where the crosstalk test stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CrosstalkView {
    /// What to do next; none while no test goes on.
    pub running: Option<RunningCrosstalk>,
    /// What was found so far, or in the last test.
    pub found: Vec<Bleed>,
    /// What the last test came to, in sentences, or why there was none.
    pub ended: Option<Result<Vec<String>, String>>,
}

/// A crosstalk test that goes on.
#[derive(Clone, Debug, PartialEq)]
pub struct RunningCrosstalk {
    /// What to do next.
    pub instruction: String,
    /// Number of the step, from 1, and how many there are; none before the first reading.
    pub step: Option<[usize; 2]>,
}

/// A crosstalk test in the gripper's thread.
#[derive(Default)]
pub(super) struct Crossing {
    /// From the reading on after which the board is known.
    test: Option<CrosstalkTest>,
    heard: u32,
}

impl Crossing {
    /// Takes in a reading; true when the test is over. Fails where the board has too few sensors.
    pub(super) fn feed(&mut self, reading: &Reading, board: &Board) -> Result<bool, String> {
        self.heard = self.heard.saturating_add(1);
        if self.heard < KNOWN_AFTER {
            return Ok(false);
        }
        let test = match &mut self.test {
            Some(test) => test,
            empty @ None => empty.insert(CrosstalkTest::new(board).map_err(|error| error.to_string())?),
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

    /// True when every sensor was moved or left out.
    pub(super) fn is_over(&self) -> bool {
        self.test.as_ref().is_some_and(|test| test.source().is_none())
    }

    pub(super) fn found(&self) -> Vec<Bleed> {
        self.test.as_ref().map(|test| test.found().to_vec()).unwrap_or_default()
    }

    /// What it came to.
    pub(super) fn summary(&self) -> Result<Vec<String>, String> {
        self.test.as_ref().map(CrosstalkTest::summary).ok_or_else(|| "nothing was heard of the board".to_owned())
    }

    pub(super) fn view(&self, link: String) -> RunningCrosstalk {
        RunningCrosstalk {
            instruction: self.test.as_ref().map_or(link, CrosstalkTest::instruction),
            step: self.test.as_ref().map(CrosstalkTest::step),
        }
    }
}
