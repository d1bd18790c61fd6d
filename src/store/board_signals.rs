//! Signals of a trial of a real gripper: its readings converted by the calibrations of its parts. Derived each time, so
//! that a better calibration improves old trials too.

use super::calibrations::{CalibrationId, Serving};
use super::store::Store;
use super::store_error::StoreError;
use palpate_sim::gripper::Phase;
use palpate_tactile::Signals;
use palpate_tactile::calibration::{Derived, Readout};
use palpate_tactile::trial::TrialId;

/// Signals of a trial of a real gripper.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoardSignals {
    /// Curvature, pressure and force of each finger; time counts from the beginning of the trial (s).
    pub derived: Derived,
    /// The calibrations.
    pub serving: Serving,
    /// Line pressure, time (s) and pressure from then on (bar): as commanded, or else as the board reported; empty where
    /// unknown.
    pub line: Vec<(f64, f64)>,
    /// Beginning of the closing (s), where known.
    pub closing_s: Option<f64>,
    /// Beginning of the hold (s), where known.
    pub hold_s: Option<f64>,
    /// Beginning of the release (s), where known.
    pub release_s: Option<f64>,
}

impl BoardSignals {
    /// The part that recognisers learn and files exchange: some channels from the beginning of the closing, where known, to
    /// the end of the hold. None where a channel could not be derived.
    pub fn grasp(&self, channels: &[String]) -> Option<Signals> {
        let until = self.derived.signals.chosen(channels)?.until(self.release_s.unwrap_or(f64::INFINITY));
        Some(self.since_closing(until))
    }

    /// The same to another end (s), counted from the beginning of the closing, where known.
    pub fn grasp_until(&self, channels: &[String], end_s: f64) -> Option<Signals> {
        Some(self.since_closing(self.derived.signals.chosen(channels)?).until(end_s))
    }

    fn since_closing(&self, signals: Signals) -> Signals {
        match self.closing_s {
            Some(closing_s) => signals.since(closing_s),
            None => signals,
        }
    }
}

impl Store {
    /// Derives the signals of a trial of a real gripper with the newest calibrations of its parts, or those asked for;
    /// none for a trial of another kind.
    pub fn board_signals(&self, id: TrialId, asked: &[CalibrationId]) -> Result<Option<BoardSignals>, StoreError> {
        let Some(mut trial) = self.board_log(id)? else { return Ok(None) };
        let began = trial.course.began_s;
        for reading in &mut trial.readings {
            reading.t_s -= began;
        }
        let from = |phase: Phase, after: f64| {
            let found = trial.course.phases.iter().find(|mark| mark.phase == phase && mark.from_s - began >= after);
            found.map(|mark| mark.from_s - began)
        };
        let closing_s = from(Phase::Close, f64::NEG_INFINITY);
        let hold_s = from(Phase::Hold, closing_s.unwrap_or(f64::NEG_INFINITY));
        let release_s = from(Phase::Release, closing_s.unwrap_or(f64::NEG_INFINITY));
        let serving = self.calibrations().serving(Some(id), asked)?;
        let readout = Readout::new(&trial.course.board, &serving.calibrations)
            .map_err(|cause| StoreError::bad_info(id, cause))?;
        let mut derived = readout.derive(&trial.readings, closing_s);
        derived.warnings.extend(serving.warnings.iter().cloned());
        let marks = trial.course.phases.iter().filter_map(|mark| Some((mark.from_s - began, mark.line_bar?)));
        let commanded: Vec<(f64, f64)> = marks.collect();
        let reported: Vec<(f64, f64)> =
            trial.readings.iter().filter_map(|reading| Some((reading.t_s, reading.line_bar?))).collect();
        let line = if follows_commands(&commanded, &reported) { commanded } else { reported };
        Ok(Some(BoardSignals { derived, serving, line, closing_s, hold_s, release_s }))
    }
}

/// Largest difference between commanded and reported pressure (bar): half a step of the control box.
const HALF_STEP_BAR: f64 = 0.026;
/// The board reports a new pressure within this time (s).
const ANSWER_S: f64 = 0.1;

/// Whether the reported pressures follow the commands, whose times are then more exact. Where the board refused a
/// command or vented on its own, only its reports are right.
fn follows_commands(commanded: &[(f64, f64)], reported: &[(f64, f64)]) -> bool {
    let other = |(t_s, bar): &&(f64, f64)| {
        let last = commanded.iter().take_while(|(from_s, _)| from_s <= t_s).last();
        last.is_some_and(|(from_s, asked)| t_s - from_s > ANSWER_S && (bar - asked).abs() > HALF_STEP_BAR)
    };
    !commanded.is_empty() && reported.iter().filter(other).count() < 3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_replace_commands_that_a_board_refused_or_vented() {
        let commanded = [(0.0, 0.5), (1.0, 1.0)];
        let reported = |bar_of: fn(f64) -> f64| -> Vec<(f64, f64)> {
            (0..100).map(|k| 0.02 * f64::from(k)).map(|t_s| (t_s, bar_of(t_s))).collect()
        };
        assert!(follows_commands(&commanded, &reported(|t_s| if t_s < 1.04 { 0.5 } else { 1.0 })));
        assert!(follows_commands(&commanded, &[]), "without reports the commands stand");
        assert!(!follows_commands(&commanded, &reported(|_| 0.5)), "the second step was refused");
        assert!(!follows_commands(&commanded, &reported(|t_s| if t_s < 1.5 { 1.0 } else { 0.0 })), "it vented");
        assert!(!follows_commands(&[], &reported(|_| 0.5)));
    }
}
