//! Calibrating step by step: what to set next, whether the reading has settled, and the result. Terminal and window use
//! the same procedure; it does not depend on them, nor on the port that its readings come from.
//!
//! ```text
//!   next() -> "bend to 30 degrees"
//!   feed(reading) ...                    until settled()
//!   take(30 degrees)                     or undo(), or skip()
//!   ...                                  until next() is nothing
//!   fit() -> calibration with residuals, or why there is none
//! ```

use super::input::Input;
use super::pad_curve::BendingZero;
use super::point::Point;
use super::record::{Calibration, Record};
use super::{CalibrationFault, RangeEnd};
use crate::board::{Board, Reading};
use crate::electronics::Divider;
use crate::sensor_list::{Sensor, SensorKind};
use std::collections::VecDeque;

/// Length of the window that is averaged (s): two and a half times the late part of a strip's bend, which lasts about
/// 0.4 s; 50 readings reduce the noise of 2 counts to a third of a count.
const WINDOW_S: f64 = 1.0;
/// Readings that the window must hold.
const LEAST_READINGS: usize = 10;
/// Difference between its two halves that passes, beyond what noise explains (counts).
const CREEP_COUNTS: f64 = 1.0;

/// Reason why no point can be taken yet.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unsettled {
    #[error("reading: {have_s:.1} of {need_s:.1} s")]
    TooShort {
        /// Present length (s).
        have_s: f64,
        /// Needed length (s).
        need_s: f64,
    },
    #[error("the board sends no value on this channel: check the wiring and the name of the channel")]
    Silent,
    #[error("still moving ({by:+.1} counts): hold it still and wait")]
    Moving {
        /// The later half less the earlier (counts).
        by: f64,
    },
    #[error("{counts:.0} counts is an end of the range: the circuit is open or shorted, or the pad is saturated")]
    RangeEnd {
        /// Reading (counts).
        counts: f64,
    },
}

/// Default stimuli, in rad or N: 0, 30, 60 and 90 degrees, or no load and seven weights up to 0.5 kg.
pub fn plan(kind: SensorKind) -> Vec<f64> {
    let shown: &[f64] = match kind {
        SensorKind::Flex => &[0.0, 30.0, 60.0, 90.0],
        SensorKind::Pad => &[0.0, 0.03, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5],
        SensorKind::Raw => &[],
    };
    shown.iter().map(|shown| kind.stimulus(*shown)).collect()
}

/// A calibration in the making.
#[derive(Clone, Debug)]
pub struct Procedure {
    sensor: Sensor,
    column: usize,
    record: Record,
    /// Remaining stimuli, next one first.
    left: VecDeque<f64>,
    /// Time (s) and counts of the last readings.
    window: VecDeque<(f64, f64)>,
    /// Readings since the last point that had no number.
    silent: usize,
    /// The user has entered the resistor beside the sensor.
    resistor_is_given: bool,
    /// The points were measured elsewhere, and their input stays as it was there.
    is_measured: bool,
}

impl Procedure {
    /// Begins a calibration of a mounted part, on a board as our firmware describes it. `resistor_ohm` overrides the
    /// resistor that the board reports.
    pub fn new(sensor: Sensor, part: &str, resistor_ohm: Option<f64>) -> Self {
        let (kind, mut input) = (sensor.kind(), Input::on(&Board::default(), sensor));
        input.divider.fixed_ohm = resistor_ohm.unwrap_or(input.divider.fixed_ohm);
        let (part, note) = (part.trim().to_owned(), String::new());
        Self {
            sensor,
            column: sensor.index(),
            record: Record { part, kind, input, points: Vec::new(), bending: None, assumed: false, note },
            left: plan(kind).into(),
            window: VecDeque::new(),
            silent: 0,
            resistor_is_given: resistor_ohm.is_some(),
            is_measured: false,
        }
    }

    /// Continues after points that were measured elsewhere.
    pub fn after(sensor: Sensor, record: Record) -> Self {
        let begun = Self::new(sensor, &record.part, None);
        Self { record, left: VecDeque::new(), is_measured: true, ..begun }
    }

    /// Updates the board's properties, which apply to all points, as points are stored as counts. False for a board that has
    /// no such channel.
    pub fn see(&mut self, board: &Board) -> bool {
        let Some(column) = board.channel_of(self.sensor) else { return false };
        self.column = column;
        if !self.is_measured {
            let input = &mut self.record.input;
            let seen = input.seen_by(board, self.sensor);
            let fixed_ohm = if self.resistor_is_given { input.divider.fixed_ohm } else { seen.divider.fixed_ohm };
            *input = Input { divider: Divider { fixed_ohm, ..seen.divider }, ..seen };
        }
        true
    }

    /// With other angles (rad) or forces (N) to be set.
    #[must_use]
    pub fn with_plan(mut self, plan: &[f64]) -> Self {
        self.left = plan.iter().copied().collect();
        self
    }

    /// The sensor.
    pub fn sensor(&self) -> Sensor {
        self.sensor
    }

    /// Points measured so far.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// The angle (rad) or force (N) to set next; none when the plan is done.
    pub fn next(&self) -> Option<f64> {
        self.left.front().copied()
    }

    /// Number of points left in the plan.
    pub fn left(&self) -> usize {
        self.left.len()
    }

    /// Instruction for the next step.
    pub fn instruction(&self) -> String {
        let place = self.sensor.label();
        let Some(next) = self.next() else {
            return match (self.record.kind, &self.record.bending) {
                (SensorKind::Pad, None) => {
                    "all points are taken; let the empty hand close once, so that its bending is not read as \
                                      a force"
                        .to_owned()
                }
                _ => "all points are taken".to_owned(),
            };
        };
        match self.record.kind {
            SensorKind::Flex if next == 0.0 => format!("{place}: let the finger hang straight"),
            SensorKind::Flex => {
                format!("{place}: bend it by {:.0} degrees over its length and hold", next.to_degrees())
            }
            SensorKind::Pad if next == 0.0 => format!("{place}: put nothing on it"),
            SensorKind::Pad => format!("{place}: put {:.0} g on its middle", 1e3 * self.record.kind.shown(next)),
            SensorKind::Raw => format!("{place}: a raw sensor has no calibration"),
        }
    }

    /// Takes in a reading.
    pub fn feed(&mut self, reading: &Reading) {
        let counts = reading.counts.get(self.column).copied().flatten().filter(|counts| counts.is_finite());
        let Some(counts) = counts else {
            self.silent += 1;
            return;
        };
        // A clock that was set back begins a new window.
        if self.window.back().is_some_and(|(t, _)| reading.t_s < *t) {
            self.window.clear();
        }
        self.silent = 0;
        self.window.push_back((reading.t_s, f64::from(counts)));
        while self.window.front().is_some_and(|(t, _)| *t < reading.t_s - WINDOW_S) {
            self.window.pop_front();
        }
    }

    /// The last reading (counts).
    pub fn latest(&self) -> Option<f64> {
        self.window.back().map(|(_, counts)| *counts)
    }

    /// Mean, spread and number of the last readings, where they have settled; the stimulus is still open.
    pub fn settled(&self) -> Result<Point, Unsettled> {
        let have_s = self.window.back().map_or(0.0, |last| last.0) - self.window.front().map_or(0.0, |first| first.0);
        // A window is full when one more period would be too much.
        let full = 0.95 * WINDOW_S;
        if self.silent > LEAST_READINGS {
            return Err(Unsettled::Silent);
        }
        if have_s < full || self.window.len() < LEAST_READINGS {
            return Err(Unsettled::TooShort { have_s, need_s: full });
        }
        let counts: Vec<f64> = self.window.iter().map(|(_, counts)| *counts).collect();
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let deviation = |part: &[f64]| {
            let middle = mean(part);
            (part.iter().map(|c| (c - middle).powi(2)).sum::<f64>() / (part.len() - 1) as f64).sqrt()
        };
        let (earlier, later) = counts.split_at(counts.len() / 2);
        // The spread within each half is noise; that between them is not.
        let spread = 0.5 * (deviation(earlier) + deviation(later));
        let by = mean(later) - mean(earlier);
        if by.abs() > CREEP_COUNTS + 3.0 * spread * (2.0 / earlier.len() as f64).sqrt() {
            return Err(Unsettled::Moving { by });
        }
        let counts = mean(&counts);
        let unloaded = self.record.kind == SensorKind::Pad;
        match self.record.input.range_end(counts) {
            Some(RangeEnd::Open) if unloaded => {}
            Some(_) => return Err(Unsettled::RangeEnd { counts }),
            None => {}
        }
        Ok(Point { stimulus: f64::NAN, counts, spread, readings: self.window.len() as u32 })
    }

    /// True when the reading differs from that of the last point: a hands-free procedure waits for this.
    pub fn has_changed(&self) -> bool {
        let (Some(last), Ok(now)) = (self.record.points.last(), self.settled()) else {
            return self.record.points.is_empty();
        };
        (now.counts - last.counts).abs() > 10.0 + 5.0 * now.spread
    }

    /// Takes the settled reading as that of an angle (rad) or force (N), which completes the next value of the plan;
    /// readings for the following point begin anew. A reading that has not settled is refused, and nothing changes.
    pub fn take(&mut self, stimulus: f64) -> Result<Point, Unsettled> {
        let point = Point { stimulus, ..self.settled()? };
        self.record.points.push(point);
        // It was measured from the rest that the points had shown.
        self.record.bending = None;
        self.left.pop_front();
        self.window.clear();
        Ok(point)
    }

    /// Skips the next value of the plan.
    pub fn skip(&mut self) {
        self.left.pop_front();
    }

    /// Takes the last point back and puts it next in the plan.
    pub fn undo(&mut self) -> Option<Point> {
        let point = self.record.points.pop()?;
        self.left.push_front(point.stimulus);
        self.record.bending = None;
        self.window.clear();
        Some(point)
    }

    /// Adds how the zero of a pad moves with bending.
    pub fn set_bending(&mut self, bending: BendingZero) {
        self.record.bending = Some(bending);
    }

    /// Fits the points taken so far.
    pub fn fit(&self) -> Result<Calibration, CalibrationFault> {
        Calibration::fit(self.record.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(t_s: f64, counts: Option<f32>) -> Reading {
        let mut all = vec![Some(1000.0); 4];
        all[Sensor::PAD_RIGHT.index()] = counts;
        Reading { t_s, arrived_s: t_s, seq: None, counts: all, line_bar: None }
    }

    fn procedure() -> Procedure {
        Procedure::new(Sensor::PAD_RIGHT, " P7 ", None)
    }

    /// Feeds readings at 50 Hz from a time on.
    fn feed(procedure: &mut Procedure, from: f64, seconds: f64, counts: impl Fn(f64) -> f32) {
        for k in 0..(seconds * 50.0) as u32 {
            let t = f64::from(k) / 50.0;
            procedure.feed(&reading(from + t, Some(counts(t))));
        }
    }

    #[test]
    fn a_whole_procedure_ends_in_a_calibration() -> Result<(), Box<dyn std::error::Error>> {
        let mut procedure = procedure();
        let input = procedure.record().input;
        let mut now = 0.0;
        while let Some(force) = procedure.next() {
            let ohm = 6e3 / force.powf(0.9);
            let counts = if force < 0.147 { 0.0 } else { input.counts(ohm) as f32 };
            feed(&mut procedure, now, 1.1, |_| counts);
            assert!(procedure.has_changed());
            let point = procedure.take(force)?;
            assert!((point.counts - f64::from(counts)).abs() < 1e-3 && point.readings >= 49);
            assert!(
                matches!(procedure.take(force), Err(Unsettled::TooShort { .. })),
                "each point has readings of its own"
            );
            now += 2.0;
        }
        assert_eq!(
            (procedure.left(), procedure.instruction().as_str()),
            (0, "all points are taken; let the empty hand close once, so that its bending is not read as a force")
        );
        let calibration = procedure.fit()?;
        assert_eq!(calibration.record.part, "P7");
        let force = calibration.stimulus(&input, input.counts(6e3)).ok_or("in range")?;
        assert!((force - 1.0).abs() < 1e-3);
        Ok(())
    }

    #[test]
    fn it_waits_until_the_reading_has_settled() {
        let mut procedure = procedure();
        assert!(matches!(procedure.settled(), Err(Unsettled::TooShort { .. })));
        feed(&mut procedure, 0.0, 0.5, |_| 500.0);
        assert!(matches!(procedure.settled(), Err(Unsettled::TooShort { .. })));
        // A transient of 0.4 s: moving at first, settled 2 s later.
        let creeping = |t: f64| (500.0 - 100.0 * (-t / 0.4).exp()) as f32;
        feed(&mut procedure, 10.0, 1.2, creeping);
        assert!(matches!(procedure.settled(), Err(Unsettled::Moving { by }) if by > 5.0), "{:?}", procedure.settled());
        assert!(procedure.take(1.0).is_err() && procedure.record().points.is_empty());
        feed(&mut procedure, 20.0, 3.5, creeping);
        assert!(procedure.settled().is_ok_and(|point| (point.counts - 500.0).abs() < 0.5));
        assert!(procedure.take(1.0).is_ok());
        // Noise of four counts is no movement.
        feed(&mut procedure, 30.0, 2.0, |t| {
            700.0 + if ((t * 50.0).round() as u32).is_multiple_of(2) { 4.0 } else { -4.0 }
        });
        assert!(procedure.settled().is_ok_and(|point| (point.counts - 700.0).abs() < 0.3 && point.spread > 3.0));
    }

    #[test]
    fn later_facts_about_the_board_apply_to_all_points() -> Result<(), Unsettled> {
        let mut procedure = procedure();
        feed(&mut procedure, 0.0, 1.1, |_| 600.0);
        procedure.take(1.0)?;
        assert!((procedure.record().input.ohm(600.0) - 4.7e3 * (4096.0 / 600.0 - 1.0)).abs() < 1e-6);
        let channels = vec!["fsrR".into(), "flexL".into()];
        let ten_bits = Board { full_scale: 1023, divider_ohm: vec![3.3e3, 33e3], channels, ..Board::default() };
        assert!(procedure.see(&ten_bits));
        assert!((procedure.record().input.ohm(600.0) - 3.3e3 * (1024.0 / 600.0 - 1.0)).abs() < 1e-6);
        assert_eq!(procedure.column, 0);
        // The user's resistor takes precedence over the board's.
        let mut procedure = Procedure::new(Sensor::PAD_RIGHT, "x", Some(1e3));
        assert!(procedure.see(&Board { divider_ohm: vec![1.0; 4], ..Board::default() }));
        assert_eq!(procedure.record().input.divider.fixed_ohm, 1e3);
        Ok(())
    }

    #[test]
    fn silence_and_the_end_of_the_range_are_reported() {
        let mut procedure = procedure();
        for k in 0..60 {
            procedure.feed(&reading(f64::from(k) * 0.02, None));
        }
        assert_eq!(procedure.settled(), Err(Unsettled::Silent));
        feed(&mut procedure, 5.0, 2.0, |_| 4095.0);
        assert!(matches!(procedure.settled(), Err(Unsettled::RangeEnd { .. })));
        let no_channel = Board { channels: vec!["flexL".into()], ..Board::default() };
        assert!(!procedure.see(&no_channel));
    }

    #[test]
    fn points_can_be_taken_back_and_left_out() -> Result<(), Unsettled> {
        let mut procedure = procedure().with_plan(&[0.0, 1.0, 2.0]);
        feed(&mut procedure, 0.0, 1.1, |_| 0.0);
        procedure.take(0.0)?;
        procedure.skip();
        feed(&mut procedure, 3.0, 1.1, |_| 800.0);
        procedure.take(2.2)?;
        assert_eq!((procedure.next(), procedure.record().points.len()), (None, 2));
        assert_eq!(procedure.undo().map(|point| point.stimulus), Some(2.2));
        assert_eq!((procedure.next(), procedure.left()), (Some(2.2), 1));
        assert!(procedure.fit().is_err());
        Ok(())
    }
}
