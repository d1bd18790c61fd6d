//! Calibration of a gripper of which no angle or weight is known, from one close of its empty hand.
//!
//! Two assumptions replace measurements: the fingers bend like the modelled finger, and the pads are nominal parts. A
//! strip's reading at rest is calibrated as zero bend, and its reading at the end of the closing as the bend of the
//! modelled finger, so it does not matter how much of the finger's bend reaches the strip. Whatever a pad reads while
//! the empty hand closes is taken as the effect of bending.

use super::CalibrationFault;
use super::input::Input;
use super::pad_curve::BendingZero;
use super::point::Point;
use super::readout::{Readout, rest_window};
use super::record::{Calibration, Record};
use crate::board::{Board, Reading};
use crate::electronics::{PadPart, StripPart};
use crate::sensor_list::Sensor;
use palpate_geometry::units::STANDARD_GRAVITY;

/// Loads of a nominal pad's points (kg).
const LOADS_KG: [f64; 6] = [0.03, 0.06, 0.1, 0.2, 0.35, 0.5];
/// Fewest readings of a sensor at rest, and of one that is bent.
const LEAST_READINGS: usize = 3;
/// A strip counts as bent from this share of its largest change on.
const BENT: f64 = 0.95;
/// Least change of a strip's reading, as a share of that at rest.
const LEAST_CHANGE: f64 = 0.05;

/// One close of an empty hand.
#[derive(Clone, Copy, Debug)]
pub struct EmptyHand<'a> {
    pub board: &'a Board,
    /// Readings of the board, from rest on.
    pub readings: &'a [Reading],
    /// Start of the closing on the clock of the readings (s), where known.
    pub closing_s: Option<f64>,
    /// Curvature of the modelled finger at the end of the closing (1/m).
    pub modelled: f64,
}

/// A weight on a pad, and the reading of the pad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownWeight {
    /// Force of the weight (N).
    pub force: f64,
    /// Mean of the readings (counts).
    pub counts: f64,
}

impl EmptyHand<'_> {
    /// Calibration of the strip with this part name.
    pub fn strip(&self, sensor: Sensor, part: &str) -> Result<Calibration, CalibrationFault> {
        let rest = self.rest(sensor)?;
        let mut moved: Vec<f64> = self.counts(sensor, self.readings).map(|counts| counts - rest).collect();
        moved.sort_by(f64::total_cmp);
        // The 98th percentile instead of the maximum: up to 2 % of the readings may be transmission errors.
        let farthest =
            *moved.get(moved.len() * 49 / 50).ok_or_else(|| CalibrationFault::no_readings(&sensor.label()))?;
        let bent: Vec<f64> =
            moved.iter().copied().filter(|own| *own >= BENT * farthest && *own <= farthest / BENT).collect();
        let bent_counts = rest + bent.get(bent.len() / 2).copied().unwrap_or_default();
        if farthest < LEAST_CHANGE * rest || bent.len() < LEAST_READINGS {
            return Err(CalibrationFault(format!(
                "the {} went from {rest:.0} to {:.0} counts only: the hand did not close, or the strip is loose, broken or \
                 on another channel; `palpate doctor` looks at the signals",
                sensor.label(),
                rest + farthest
            )));
        }
        let point = |stimulus: f64, counts: f64| Point { stimulus, counts, spread: 0.0, readings: 1 };
        let angle = self.modelled * sensor.row().length_m.unwrap_or(StripPart::ACTIVE_LENGTH);
        self.fit(sensor, part, vec![point(0.0, rest), point(angle, bent_counts)], None)
    }

    /// Bend of a strip over time: time since the closing began (s), and bend divided by the largest bend. No
    /// calibration is needed, because the resistance is linear in the bend. Empty if the strip does not move or the
    /// start of the closing is unknown.
    pub fn course(&self, sensor: Sensor) -> Vec<(f64, f64)> {
        let (Some(closing_s), Ok(rest), Some(column)) =
            (self.closing_s, self.rest(sensor), self.board.channel_of(sensor))
        else {
            return Vec::new();
        };
        let input = Input::on(self.board, sensor);
        let bend = |reading: &Reading| {
            let counts = reading.counts.get(column).copied().flatten().filter(|counts| counts.is_finite())?;
            Some((reading.t_s - closing_s, input.ohm(f64::from(counts)) - input.ohm(rest)))
        };
        let bends: Vec<(f64, f64)> = self.readings.iter().filter_map(bend).filter(|(t_s, _)| *t_s >= 0.0).collect();
        let mut sizes: Vec<f64> = bends.iter().map(|(_, bend)| *bend).collect();
        sizes.sort_by(f64::total_cmp);
        // The 98th percentile, as in `strip`.
        let most = sizes.get(sizes.len() * 49 / 50).copied().unwrap_or_default();
        if most < LEAST_CHANGE * input.ohm(rest) {
            return Vec::new();
        }
        bends.into_iter().map(|(t_s, bend)| (t_s, bend / most)).collect()
    }

    /// Calibration of a pad. Its gain is that of a nominal part or, with `known`, the one that gives the reading
    /// measured under that weight. `strip` is the calibration of the flex strip on the same finger, from which the
    /// bending is computed.
    pub fn pad(
        &self,
        sensor: Sensor,
        part: &str,
        strip: &Calibration,
        known: Option<KnownWeight>,
    ) -> Result<Calibration, CalibrationFault> {
        let (input, rest) = (Input::on(self.board, sensor), self.rest(sensor)?);
        let idle = input.siemens(rest);
        let nominal = |force: f64| PadPart::NOMINAL_SIEMENS * force.powf(PadPart::NOMINAL_EXPONENT);
        let gain = known.map_or(1.0, |known| (input.siemens(known.counts) - idle) / nominal(known.force));
        let points = [0.0].iter().chain(&LOADS_KG).map(|kg| {
            let force = kg * STANDARD_GRAVITY;
            let counts = if *kg > 0.0 { input.counts(1.0 / (idle + gain * nominal(force))) } else { rest };
            Point { stimulus: force, counts, spread: 0.0, readings: 1 }
        });
        let unbent = self.fit(sensor, part, points.collect(), None)?;
        let under = sensor.strip().ok_or_else(|| CalibrationFault::no_strip("strip of its finger"))?;
        let bent = Readout::new(self.board, &[(under, strip.clone()), (sensor, unbent.clone())])?;
        let bending = BendingZero::from_empty_close(&bent.bending(sensor, self.readings))?;
        self.fit(sensor, part, unbent.record.points, Some(bending))
    }

    fn fit(
        &self,
        sensor: Sensor,
        part: &str,
        points: Vec<Point>,
        bending: Option<BendingZero>,
    ) -> Result<Calibration, CalibrationFault> {
        let (kind, input) = (sensor.kind(), Input::on(self.board, sensor));
        let note = "from an empty close".to_owned();
        Calibration::fit(Record { part: part.to_owned(), kind, input, points, bending, assumed: true, note })
    }

    /// Median reading before the closing (counts).
    fn rest(&self, sensor: Sensor) -> Result<f64, CalibrationFault> {
        let window = rest_window(self.readings, self.closing_s);
        let mut counts: Vec<f64> = self.counts(sensor, &self.readings[..window]).collect();
        counts.sort_by(f64::total_cmp);
        let middle = counts.get(counts.len() / 2).copied().filter(|_| counts.len() >= LEAST_READINGS);
        middle.ok_or_else(|| CalibrationFault::no_readings(&sensor.label()))
    }

    fn counts<'r>(&self, sensor: Sensor, readings: &'r [Reading]) -> impl Iterator<Item = f64> + use<'r> {
        let column = self.board.channel_of(sensor);
        let count = move |reading: &Reading| reading.counts.get(column?).copied().flatten().map(f64::from);
        readings.iter().filter_map(count).filter(|counts| counts.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::Curve;
    use super::*;
    use crate::electronics::{FlexStrip, ForcePad};
    use palpate_sim::gripper::Side;

    /// Readings of fingers that rest, close and hold, with a pad that fires when bent.
    fn readings(board: &Board, strip: StripPart, pad: PadPart, bending: f64) -> Vec<Reading> {
        let (mut strip, mut pad) = (FlexStrip::new(strip, 50.0), ForcePad::new(pad, 50.0));
        let input = |sensor| Input::on(board, sensor);
        let reading = |k: u32| {
            let t_s = 0.02 * f64::from(k);
            let kappa = 14.3 * ((t_s - 0.5) / 2.0).clamp(0.0, 1.0);
            let strip = input(Sensor::FLEX_LEFT).counts(strip.ohm(kappa)).floor() as f32;
            let pad = input(Sensor::PAD_LEFT).counts(1.0 / pad.conductance(bending * kappa)).floor() as f32;
            let counts = vec![Some(strip), Some(1420.0), Some(pad), Some(0.0)];
            Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None }
        };
        (0..200).map(reading).collect()
    }

    fn parts() -> (StripPart, PadPart) {
        let strip = StripPart { flat_ohm: 21e3, rise_per_rad: StripPart::rise(2.4), reaching: 0.7, rest: 0.0 };
        let pad = PadPart {
            full: 1.0,
            gain: 1.04 * PadPart::NOMINAL_SIEMENS,
            exponent: 0.86,
            threshold: Some(0.14),
            reaching: 1.0,
        };
        (strip, pad)
    }

    #[test]
    fn a_loose_strip_reads_as_the_modelled_finger_bends() -> Result<(), CalibrationFault> {
        let board = Board::default();
        let (part, pad) = parts();
        let readings = readings(&board, part, pad, 0.018);
        let hand = EmptyHand { board: &board, readings: &readings, closing_s: None, modelled: 14.3 };
        let calibration = hand.strip(Sensor::FLEX_LEFT, "A1")?;
        assert!(calibration.record.assumed);
        let readout = Readout::new(&board, &[(Sensor::FLEX_LEFT, calibration)])?;
        let curvature = |k: usize| readout.estimate(&readings[k]).curvature(Side::Left).unwrap_or(f64::NAN);
        assert!(
            curvature(5).abs() < 0.1 && (curvature(199) - 14.3).abs() < 0.15,
            "{} {}",
            curvature(5),
            curvature(199)
        );
        // Resistance is linear in the bend, so that half of it reads as half.
        assert!((curvature(75) - 7.15).abs() < 0.2, "{}", curvature(75));
        let still = hand.strip(Sensor::FLEX_RIGHT, "A2");
        assert!(still.is_err_and(|error| error.to_string().starts_with("the right flex strip went from")));
        let nothing = EmptyHand { readings: &[], ..hand };
        assert!(nothing.strip(Sensor::FLEX_LEFT, "A1") == Err(CalibrationFault::no_readings("left flex strip")));
        Ok(())
    }

    #[test]
    fn a_pad_shows_nothing_in_the_empty_hand_and_a_known_weight_as_it_is() -> Result<(), CalibrationFault> {
        let board = Board::default();
        let (part, pad) = parts();
        let readings = readings(&board, part, pad, 0.018);
        let hand = EmptyHand { board: &board, readings: &readings, closing_s: None, modelled: 14.3 };
        let strip = hand.strip(Sensor::FLEX_LEFT, "A1")?;
        let nominal = hand.pad(Sensor::PAD_LEFT, "P1", &strip, None)?;
        let readout = Readout::new(&board, &[(Sensor::FLEX_LEFT, strip.clone()), (Sensor::PAD_LEFT, nominal)])?;
        let shown =
            readings.iter().filter_map(|reading| readout.estimate(reading).value(Sensor::PAD_LEFT)).fold(0.0, f64::max);
        assert!(shown < 0.03, "{shown}");
        let counts = Input::on(&board, Sensor::PAD_LEFT).counts(1.0 / ForcePad::new(pad, 50.0).conductance(1.0));
        let known = hand.pad(Sensor::PAD_LEFT, "P1", &strip, Some(KnownWeight { force: 1.0, counts }))?;
        let Curve::Pad(curve) = &known.curve else { return Err(CalibrationFault::no_bending()) };
        assert!((1.0 / curve.gain - 6e3 / 1.04).abs() < 10.0, "{}", 1.0 / curve.gain);
        Ok(())
    }
}
