//! Readings of a board through the calibrations of its parts, one by one or a whole trial.

use super::CalibrationFault;
use super::input::{Input, RangeEnd, stated_resistor};
use super::record::{Calibration, Curve};
use super::zero::{Drift, DriftLevel, Unrest, Zero};
use crate::board::{Board, Reading, Sensor};
use crate::electronics::{PadPart, StripPart};
use crate::{Channel, Quantity, SignalDefinition, Signals, whole_fingers};
use palpate_geometry::units::three_digits;
use palpate_sim::gripper::Side;

/// Sensor estimates from one reading, left and right. None where a sensor is missing, not calibrated, or at an end of
/// its range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorEstimate {
    /// Angle over the active length of each strip (rad).
    pub angle: [Option<f64>; 2],
    /// Curvature of each finger (1/m).
    pub curvature: [Option<f64>; 2],
    /// Force on each pad (N).
    pub force: [Option<f64>; 2],
    /// Pressure on each pad (Pa): force over the area of the pad.
    pub pressure: [Option<f64>; 2],
}

impl SensorEstimate {
    /// The value of a channel of whole fingers, in its unit; none of what only simulations have.
    pub fn of(&self, channel: &Channel) -> Option<f64> {
        let side = channel.side.index();
        match channel.quantity {
            Quantity::Curvature => self.curvature[side],
            Quantity::Pressure => self.pressure[side],
            Quantity::Force => self.force[side],
            Quantity::ContactPressure => None,
        }
    }
}

/// A whole trial as derived.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Derived {
    /// Curvature, pressure and force of each finger, as far as they could be derived. Readings in which one of them is
    /// missing are left out.
    pub signals: Signals,
    /// Drift of the zeros before the closing.
    pub drift: Vec<Drift>,
    /// Readings left out.
    pub left_out: usize,
    /// Remarks, in sentences.
    pub warnings: Vec<String>,
}

/// One sensor on its channel of the board.
#[derive(Clone, Debug, PartialEq)]
struct Wired {
    column: usize,
    input: Input,
    calibration: Calibration,
}

/// A board with calibrated parts on it; by default none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readout {
    /// In the order of [`Sensor::ALL`].
    wired: [Option<Wired>; 4],
    zero: Zero,
    warnings: Vec<String>,
}

/// If more than this share of the readings lack a channel, the channel is left out instead of the readings.
const MOST_MISSING: f64 = 0.2;

/// Length of the window before the closing if the line pressure is unknown (s).
const REST_WINDOW_S: f64 = 0.3;

/// Margin beyond the calibrated angles of a strip before a warning (rad): 3 degrees.
const ANGLE_BEYOND: f64 = 0.052;

/// Share beyond the largest calibrated force of a pad before a warning.
const FORCE_BEYOND: f64 = 0.1;

/// Readings that a window must hold for a zero.
const LEAST_READINGS: usize = 5;

impl Readout {
    /// Puts calibrations onto the channels of a board. A sensor without one gives nothing; a channel that the board
    /// does not have is left out with a warning.
    pub fn new(board: &Board, calibrations: &[(Sensor, Calibration)]) -> Result<Self, CalibrationFault> {
        let mut wired = [const { None }; 4];
        let mut warnings = Vec::new();
        for (place, sensor) in wired.iter_mut().zip(Sensor::ALL) {
            let label = sensor.label();
            let calibration = calibrations.iter().find(|(own, _)| *own == sensor).map(|(_, calibration)| calibration);
            let (calibration, column) = match (calibration, board.channel_of(sensor)) {
                (Some(calibration), Some(column)) => (calibration, column),
                (None, Some(_)) => continue,
                (_, None) => {
                    warnings.push(format!("the board has no channel \"{}\" for the {label}", sensor.channel()));
                    continue;
                }
            };
            calibration.check_fits(sensor)?;
            let made_with = &calibration.record.input;
            if let Some(ohm) =
                stated_resistor(board, sensor).filter(|ohm| (ohm / made_with.divider.fixed_ohm - 1.0).abs() > 0.02)
            {
                let [was, now] = [made_with.divider.fixed_ohm, ohm].map(|ohm| three_digits(ohm * 1e-3));
                warnings.push(format!(
                    "the {label} was calibrated beside {was} kOhm, but the board reports {now}; the board's value is used"
                ));
            }
            let input = made_with.seen_by(board, sensor);
            *place = Some(Wired { column, input, calibration: calibration.clone() });
        }
        Ok(Self { wired, zero: Zero::default(), warnings })
    }

    /// Warnings about missing or doubtful channels, in sentences.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The zero that is subtracted.
    pub fn zero(&self) -> Zero {
        self.zero
    }

    /// Subtracts a zero from now on; a sensor whose zero is no drift keeps that of its calibration.
    #[must_use]
    pub fn with_zero(mut self, zero: Zero) -> Self {
        let drift = self.drift(&zero);
        self.zero = zero;
        for Drift { sensor, .. } in drift.iter().filter(|drift| drift.level == DriftLevel::TooFar) {
            self.zero.offsets[*sensor as usize] = None;
        }
        self
    }

    /// Zero from readings taken at rest: the median of each sensor, so that a knock does no harm.
    pub fn zero_from(&self, readings: &[Reading]) -> Zero {
        let mut zero = Zero::default();
        for (offset, wired) in zero.offsets.iter_mut().zip(&self.wired) {
            let Some(wired) = wired else { continue };
            let mut raw: Vec<f64> = readings.iter().filter_map(|reading| wired.raw(reading)).collect();
            raw.sort_by(f64::total_cmp);
            *offset = (raw.len() >= LEAST_READINGS).then(|| raw[raw.len() / 2]);
        }
        zero
    }

    /// The zero of readings taken while the hand is open and left alone: a tare. Sensors whose zero is so far away that
    /// it is no drift are left out, as [`Readout::with_zero`] does; [`Readout::drift`] of [`Readout::zero_from`] lists
    /// them.
    pub fn tare(&self, readings: &[Reading]) -> Result<Zero, Unrest> {
        if readings.len() < 2 * LEAST_READINGS {
            return Err(Unrest::TooFew { have: readings.len() });
        }
        let bar = readings.iter().filter_map(|reading| reading.line_bar).fold(0.0, f64::max);
        if bar > 0.0 {
            return Err(Unrest::Pressed { bar });
        }
        let (earlier, later) = readings.split_at(readings.len() / 2);
        let [earlier, later] = [earlier, later].map(|half| self.drift(&self.zero_from(half)));
        let moves = |before: &&Drift| {
            let after = later.iter().find(|after| after.sensor == before.sensor);
            after.is_some_and(|after| Drift::of(after.sensor, after.moved - before.moved).level != DriftLevel::Steady)
        };
        if let Some(Drift { sensor, .. }) = earlier.iter().find(moves) {
            return Err(Unrest::Moving { sensor: *sensor });
        }
        Ok(self.clone().with_zero(self.zero_from(readings)).zero)
    }

    /// Drift of a zero from that of the calibrations.
    pub fn drift(&self, zero: &Zero) -> Vec<Drift> {
        let each = Sensor::ALL.into_iter().zip(&self.wired).zip(zero.offsets);
        each.filter_map(|((sensor, wired), offset)| {
            let moved = match &wired.as_ref()?.calibration.curve {
                Curve::Flex(_) => offset?,
                Curve::Pad(curve) => curve.force(offset?),
            };
            Some(Drift::of(sensor, moved))
        })
        .collect()
    }

    /// Estimates curvature, force and pressure from one reading.
    pub fn estimate(&self, reading: &Reading) -> SensorEstimate {
        let mut estimate = SensorEstimate::default();
        for side in Side::BOTH {
            let side = side.index();
            let angle = self.raw(reading, side).map(|angle| angle - self.offset(side));
            let curvature = angle.map(|angle| angle / StripPart::ACTIVE_LENGTH);
            estimate.angle[side] = angle;
            estimate.curvature[side] = curvature;
            let force = self.raw(reading, 2 + side).and_then(|siemens| self.force(2 + side, siemens, curvature));
            estimate.force[side] = force;
            estimate.pressure[side] = force.map(|force| force / PadPart::ACTIVE_AREA);
        }
        estimate
    }

    /// Sensors, in the order of [`Sensor::ALL`], whose estimate is outside the calibrated range by more than the
    /// calibration's accuracy: such estimates are extrapolated.
    pub fn beyond(&self, estimate: &SensorEstimate) -> [bool; 4] {
        let values = [estimate.angle[0], estimate.angle[1], estimate.force[0], estimate.force[1]];
        std::array::from_fn(|place| {
            let (Some(wired), Some(value)) = (&self.wired[place], values[place]) else { return false };
            let [least, most] = wired.calibration.range();
            match wired.calibration.curve {
                Curve::Flex(_) => value < least - ANGLE_BEYOND || value > most + ANGLE_BEYOND,
                Curve::Pad(_) => value > most * (1.0 + FORCE_BEYOND),
            }
        })
    }

    /// Remarks on estimates outside the calibrated range, in sentences.
    fn beyond_remarks(&self, estimates: &[SensorEstimate]) -> Vec<String> {
        let mut counts = [0; 4];
        for estimate in estimates {
            counts.iter_mut().zip(self.beyond(estimate)).for_each(|(count, beyond)| *count += u32::from(beyond));
        }
        let all = estimates.len();
        let of = |((sensor, wired), count): ((Sensor, &Option<Wired>), u32)| {
            let calibration = &wired.as_ref()?.calibration;
            let [least, most] = calibration.range().map(|end| calibration.record.kind.with_unit(end));
            let label = sensor.label();
            (count > 0).then(|| {
                format!(
                    "the {label} was outside its calibrated range, {least} to {most}, in {count} of {all} readings: extrapolated"
                )
            })
        };
        Sensor::ALL.into_iter().zip(&self.wired).zip(counts).filter_map(of).collect()
    }

    /// Curvature (1/m) and conductance (S) of one finger in readings of an empty close: what a [`super::BendingZero`]
    /// is made from.
    pub fn bending(&self, side: Side, readings: &[Reading]) -> Vec<(f64, f64)> {
        let pair = |reading: &Reading| {
            let angle = self.raw(reading, side.index())? - self.offset(side.index());
            Some((angle / StripPart::ACTIVE_LENGTH, self.raw(reading, 2 + side.index())?))
        };
        readings.iter().filter_map(pair).collect()
    }

    /// A whole trial. Its zeros are taken from the window before the closing, which began at `closing_s` where that is
    /// known, and corrected where they have drifted.
    pub fn derive(&self, readings: &[Reading], closing_s: Option<f64>) -> Derived {
        if readings.is_empty() {
            return Derived { warnings: self.warnings.clone(), ..Derived::default() };
        }
        let window = rest_window(readings, closing_s);
        let zero = self.zero_from(&readings[..window]);
        let drift = self.drift(&zero);
        let mut warnings = self.warnings.clone();
        warnings.extend(drift.iter().filter_map(Drift::remark));
        let estimates: Vec<SensorEstimate> = {
            let zeroed = self.clone().with_zero(zero);
            readings.iter().map(|reading| zeroed.estimate(reading)).collect()
        };
        warnings.extend(self.saturated(readings));
        warnings.extend(self.beyond_remarks(&estimates));
        let mut channels = Vec::new();
        for channel in self.channels() {
            let missing = estimates.iter().filter(|estimate| estimate.of(&channel).is_none()).count();
            if missing as f64 > MOST_MISSING * estimates.len() as f64 {
                let (name, all) = (channel.name(), estimates.len());
                warnings.push(format!(
                    "{name} is left out: {missing} of {all} readings have no number for it, or are at the end of its range"
                ));
            } else {
                channels.push(channel);
            }
        }
        let mut signals = Signals { channels: channels.iter().map(Channel::name).collect(), ..Signals::default() };
        let mut left_out = 0;
        for (reading, estimate) in readings.iter().zip(&estimates) {
            let row: Option<Vec<f32>> = channels.iter().map(|channel| estimate.of(channel).map(|v| v as f32)).collect();
            // Time that does not rise comes from a clock that was set back; such a reading has no place.
            let rises = signals.t_s.last().is_none_or(|last| reading.t_s > *last) && reading.t_s.is_finite();
            match row.filter(|_| rises && !channels.is_empty()) {
                Some(row) => signals.push(reading.t_s, &row),
                None => left_out += 1,
            }
        }
        Derived { signals, drift, left_out, warnings }
    }

    /// Pads that reached the end of their range: their numbers are lower bounds there.
    fn saturated(&self, readings: &[Reading]) -> Vec<String> {
        let at_its_end = |wired: &Wired, reading: &Reading| {
            let counts = reading.counts.get(wired.column).copied().flatten();
            counts.is_some_and(|counts| wired.input.range_end(f64::from(counts)) == Some(RangeEnd::Short))
        };
        let pads = Sensor::ALL.into_iter().zip(&self.wired).filter(|(sensor, _)| !sensor.is_flex());
        pads.filter_map(|(sensor, wired)| {
            let wired = wired.as_ref()?;
            let count = readings.iter().filter(|reading| at_its_end(wired, reading)).count();
            let (label, all) = (sensor.label(), readings.len());
            (count > 0)
                .then(|| format!("the {label} is saturated in {count} of {all} readings: forces are larger there"))
        })
        .collect()
    }

    /// Curvature, pressure and force of each finger, as far as they can be read.
    pub fn channels(&self) -> Vec<Channel> {
        whole_fingers(SignalDefinition::Parts).into_iter().filter(|channel| self.has(channel)).collect()
    }

    /// True when the sensor that a channel needs is there.
    fn has(&self, channel: &Channel) -> bool {
        let first = if channel.quantity == Quantity::Curvature { 0 } else { 2 };
        self.wired[first + channel.side.index()].is_some()
    }

    /// Angle (rad) or conductance (S) of a sensor, before any zero.
    fn raw(&self, reading: &Reading, sensor: usize) -> Option<f64> {
        self.wired[sensor].as_ref()?.raw(reading)
    }

    fn offset(&self, sensor: usize) -> f64 {
        self.zero.offsets[sensor].unwrap_or(0.0)
    }

    /// Force (N) at a conductance, less the reading at rest and the effect of bending.
    fn force(&self, sensor: usize, siemens: f64, curvature: Option<f64>) -> Option<f64> {
        let wired = self.wired[sensor].as_ref()?;
        let Curve::Pad(curve) = &wired.calibration.curve else { return None };
        let bending = wired.calibration.record.bending.as_ref();
        let preload = bending.map_or(0.0, |bending| bending.preload(curve, curvature.unwrap_or(0.0)));
        Some((curve.force(siemens - self.offset(sensor)) - preload).max(0.0))
    }
}

impl Wired {
    /// Angle (rad), or conductance beyond that at rest (S).
    fn raw(&self, reading: &Reading) -> Option<f64> {
        let counts = f64::from((*reading.counts.get(self.column)?)?);
        if !counts.is_finite() {
            return None;
        }
        match (&self.calibration.curve, self.input.range_end(counts)) {
            (Curve::Flex(curve), None) => Some(curve.angle(self.input.ohm(counts))),
            (Curve::Flex(_), Some(_)) => None,
            // A pad at the end of its range is saturated: the value is a lower bound.
            (Curve::Pad(curve), None | Some(RangeEnd::Open | RangeEnd::Short)) => {
                Some(self.input.siemens(counts) - curve.idle_siemens)
            }
        }
    }
}

/// Number of readings before the closing: until the line pressure rises, or the first 0.3 s
/// where it is not known.
pub(super) fn rest_window(readings: &[Reading], closing_s: Option<f64>) -> usize {
    if let Some(closing_s) = closing_s {
        return readings.partition_point(|reading| reading.t_s < closing_s);
    }
    let Some(first) = readings.first() else { return 0 };
    if readings.iter().any(|reading| reading.line_bar.is_some()) {
        let pressed = |reading: &Reading| reading.line_bar.is_some_and(|bar| bar > 0.0);
        return readings.iter().position(pressed).unwrap_or(readings.len());
    }
    readings.partition_point(|reading| reading.t_s < first.t_s + REST_WINDOW_S)
}
