//! Signals of a trial of a real gripper: its readings through the calibrations that serve it. Derived anew each time, so
//! that a better calibration serves old trials too.

use super::calibrations::{CalibrationId, Serving};
use super::store::{Store, TrialId};
use super::store_error::StoreError;
use crate::gripper::Phase;
use crate::sensing::Signals;
use crate::sensing::calibration::{Derived, Readout};

/// A trial of a real gripper as its calibrations read it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoardSignals {
    /// Its signals, with channels of layout C1+F; time counts from the beginning of the trial (s).
    pub derived: Derived,
    /// The calibrations.
    pub serving: Serving,
    /// Line pressure, time (s) and pressure from then on (bar): as commanded, or else as the board reported; empty where
    /// nobody says.
    pub line: Vec<(f64, f64)>,
    /// When the closing began (s), where it is known.
    pub closing_s: Option<f64>,
    /// When the release began (s), where it is known.
    pub release_s: Option<f64>,
}

impl BoardSignals {
    /// What recognisers learn and files exchange: some channels from the beginning of the closing, where it is known, to the
    /// end of the hold: what is heard while a grasp goes on, and what is simulated. None where a channel could not be derived.
    pub fn grasp(&self, channels: &[String]) -> Option<Signals> {
        let until = self.derived.signals.chosen(channels)?.until(self.release_s.unwrap_or(f64::INFINITY));
        Some(match self.closing_s {
            Some(closing_s) => until.since(closing_s),
            None => until,
        })
    }
}

impl Store {
    /// Reads a trial of a real gripper through the newest calibrations of its parts, or those asked for; none for a trial of
    /// another kind.
    pub fn board_signals(&self, id: TrialId, asked: &[CalibrationId]) -> Result<Option<BoardSignals>, StoreError> {
        let Some(mut trial) = self.board_trial(id)? else { return Ok(None) };
        let began = trial.about.began_s;
        for reading in &mut trial.readings {
            reading.t_s -= began;
        }
        let from = |phase: Phase, after: f64| {
            let found = trial.about.phases.iter().find(|mark| mark.phase == phase && mark.from_s - began >= after);
            found.map(|mark| mark.from_s - began)
        };
        let closing_s = from(Phase::Close, f64::NEG_INFINITY);
        let release_s = from(Phase::Release, closing_s.unwrap_or(f64::NEG_INFINITY));
        let serving = self.serving(Some(id), asked)?;
        let readout = Readout::new(&trial.about.board, &serving.calibrations)
            .map_err(|cause| StoreError::BadInfo { id, cause: cause.to_string() })?;
        let mut derived = readout.derive(&trial.readings, closing_s);
        derived.warnings.extend(serving.warnings.iter().cloned());
        let marks = trial.about.phases.iter().filter_map(|mark| Some((mark.from_s - began, mark.line_bar?)));
        let mut line: Vec<(f64, f64)> = marks.collect();
        if line.is_empty() {
            line = trial.readings.iter().filter_map(|reading| Some((reading.t_s, reading.line_bar?))).collect();
        }
        Ok(Some(BoardSignals { derived, serving, line, closing_s, release_s }))
    }
}
