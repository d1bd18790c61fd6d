//! Readings of a board through the calibrations of its parts, one by one or a whole trial.

use super::CalibrationFault;
use super::input::{Input, RangeEnd, stated_resistor};
use super::pad_curve::PadCurve;
use super::record::{Calibration, Curve};
use super::zero::{Drift, DriftLevel, Unrest, Zero};
use crate::board::{Board, Reading};
use crate::electronics::{PadPart, StripPart};
use crate::sensor_list::{Sensor, SensorKind, SensorList};
use crate::{Channel, Quantity, Signals};
use palpate_geometry::units::three_digits;
use palpate_sim::gripper::Side;

/// Sensor estimates from one reading. None where a sensor is missing, not calibrated, or at an end of its range.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorEstimate {
    sensors: SensorList,
    /// Angle over the active length of a strip (rad), force on a pad (N), value of a raw sensor; by place in the list.
    values: Vec<Option<f64>>,
}

impl SensorEstimate {
    /// Angle of a strip (rad), force on a pad (N) or value of a raw sensor.
    pub fn value(&self, sensor: Sensor) -> Option<f64> {
        self.values.get(sensor.index()).copied().flatten()
    }

    /// Curvature of a simulated finger, by its first strip (1/m).
    pub fn curvature(&self, side: Side) -> Option<f64> {
        let strip = self.sensors.first_on(SensorKind::Flex, side)?;
        Some(self.value(strip)? / active_length(strip))
    }

    /// The value of a channel in its unit; none of what only simulations have.
    pub fn of(&self, channel: &Channel) -> Option<f64> {
        let sensor = self.sensors.iter().find(|sensor| sensor.gives(channel))?;
        let value = self.value(sensor)?;
        match channel.quantity {
            Quantity::Curvature => Some(value / active_length(sensor)),
            Quantity::Pressure => Some(value / PadPart::ACTIVE_AREA),
            Quantity::Force | Quantity::Raw { .. } => Some(value),
            Quantity::ContactPressure => None,
        }
    }
}

/// Length over which a strip's angle is taken (m).
fn active_length(strip: Sensor) -> f64 {
    strip.row().length_m.unwrap_or(StripPart::ACTIVE_LENGTH)
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
    sensor: Sensor,
    column: usize,
    /// The input and the calibration of its part; a raw sensor has none.
    part: Option<(Input, Calibration)>,
}

/// A board with calibrated parts on it; by default none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readout {
    sensors: SensorList,
    /// Those of the list that can be read, in its order.
    wired: Vec<Wired>,
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
        let (mut wired, mut warnings) = (Vec::new(), Vec::new());
        for sensor in board.sensors.iter() {
            let label = sensor.label();
            let calibration = calibrations.iter().find(|(own, _)| *own == sensor).map(|(_, calibration)| calibration);
            let column = board.channel_of(sensor);
            if column.is_none() {
                warnings.push(format!("the board has no channel \"{}\" for the {label}", sensor.channel()));
            }
            let Some(column) = column else { continue };
            if sensor.kind() == SensorKind::Raw {
                wired.push(Wired { sensor, column, part: None });
                continue;
            }
            let Some(calibration) = calibration else { continue };
            calibration.check_fits(sensor)?;
            let made_with = &calibration.record.input;
            if let Some(ohm) =
                stated_resistor(board, sensor).filter(|ohm| (ohm / made_with.divider.fixed_ohm - 1.0).abs() > 0.02)
            {
                let [was, now] = [made_with.divider.fixed_ohm, ohm].map(|ohm| three_digits(ohm * 1e-3));
                warnings.push(format!(
                    "the {label} was calibrated beside {was} kΩ, but the board reports {now}; the board's value is used"
                ));
            }
            let input = made_with.seen_by(board, sensor);
            wired.push(Wired { sensor, column, part: Some((input, calibration.clone())) });
        }
        Ok(Self { sensors: board.sensors, wired, zero: Zero::default(), warnings })
    }

    /// Warnings about missing or doubtful channels, in sentences.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The zero that is subtracted.
    pub fn zero(&self) -> &Zero {
        &self.zero
    }

    /// Subtracts a zero from now on; a sensor whose zero is no drift keeps that of its calibration.
    #[must_use]
    pub fn with_zero(mut self, zero: Zero) -> Self {
        let drift = self.drift(&zero);
        self.zero = zero;
        for Drift { sensor, .. } in drift.iter().filter(|drift| drift.level == DriftLevel::TooFar) {
            self.zero.set(*sensor, None);
        }
        self
    }

    /// Zero from readings taken at rest: the median of each sensor, so that a knock does no harm.
    pub fn zero_from(&self, readings: &[Reading]) -> Zero {
        let mut zero = Zero::default();
        for wired in &self.wired {
            let mut raw: Vec<f64> = readings.iter().filter_map(|reading| wired.raw(reading)).collect();
            raw.sort_by(f64::total_cmp);
            zero.set(wired.sensor, (raw.len() >= LEAST_READINGS).then(|| raw[raw.len() / 2]));
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
        let each = self.wired.iter().filter_map(|wired| {
            let offset = zero.of(wired.sensor)?;
            let moved = match &wired.curve()? {
                Curve::Flex(_) => offset,
                Curve::Pad(curve) => curve.force(offset),
            };
            Some(Drift::of(wired.sensor, moved))
        });
        each.collect()
    }

    /// Estimates what each sensor reads from one reading.
    pub fn estimate(&self, reading: &Reading) -> SensorEstimate {
        let mut estimate = SensorEstimate { sensors: self.sensors, values: vec![None; self.sensors.len()] };
        // Pads come after the strips that tell how their fingers are bent.
        for pads in [false, true] {
            for wired in self.wired.iter().filter(|wired| (wired.sensor.kind() == SensorKind::Pad) == pads) {
                let value = wired.raw(reading).map(|raw| {
                    let raw = raw - self.zero.of(wired.sensor).unwrap_or(0.0);
                    match wired.curve() {
                        Some(Curve::Pad(curve)) => wired.force(curve, raw, self.bend(wired.sensor, &estimate)),
                        Some(Curve::Flex(_)) | None => raw,
                    }
                });
                estimate.values[wired.sensor.index()] = value;
            }
        }
        estimate
    }

    /// Curvature of a pad's finger (1/m).
    fn bend(&self, pad: Sensor, estimate: &SensorEstimate) -> Option<f64> {
        let strip = pad.strip()?;
        Some(estimate.value(strip)? / active_length(strip))
    }

    /// Sensors whose estimate is outside the calibrated range by more than the calibration's accuracy: such estimates are
    /// extrapolated.
    pub fn beyond(&self, estimate: &SensorEstimate) -> Vec<Sensor> {
        let is_beyond = |wired: &&Wired| {
            let (Some((_, calibration)), Some(value)) = (&wired.part, estimate.value(wired.sensor)) else {
                return false;
            };
            let [least, most] = calibration.range();
            match calibration.curve {
                Curve::Flex(_) => value < least - ANGLE_BEYOND || value > most + ANGLE_BEYOND,
                Curve::Pad(_) => value > most * (1.0 + FORCE_BEYOND),
            }
        };
        self.wired.iter().filter(is_beyond).map(|wired| wired.sensor).collect()
    }

    /// Remarks on estimates outside the calibrated range, in sentences.
    fn beyond_remarks(&self, estimates: &[SensorEstimate]) -> Vec<String> {
        let mut counts = vec![0u32; self.sensors.len()];
        for estimate in estimates {
            self.beyond(estimate).into_iter().for_each(|sensor| counts[sensor.index()] += 1);
        }
        let all = estimates.len();
        let of = |wired: &Wired| {
            let (_, calibration) = wired.part.as_ref()?;
            let (label, count) = (wired.sensor.label(), counts[wired.sensor.index()]);
            let [least, most] = calibration.range().map(|end| calibration.record.kind.with_unit(end));
            (count > 0).then(|| {
                format!(
                    "the {label} was outside its calibrated range, {least} to {most}, in {count} of {all} readings: extrapolated"
                )
            })
        };
        self.wired.iter().filter_map(of).collect()
    }

    /// Curvature under a pad (1/m) and its conductance (S) in readings of an empty close: what a [`super::BendingZero`] is
    /// made from.
    pub fn bending(&self, pad: Sensor, readings: &[Reading]) -> Vec<(f64, f64)> {
        let raw = |sensor: Sensor, reading: &Reading| {
            self.wired.iter().find(|wired| wired.sensor == sensor).and_then(|wired| wired.raw(reading))
        };
        let pair = |reading: &Reading| {
            let strip = pad.strip()?;
            let angle = raw(strip, reading)? - self.zero.of(strip).unwrap_or(0.0);
            Some((angle / active_length(strip), raw(pad, reading)?))
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
        let of = |wired: &Wired| {
            let (input, _) = wired.part.as_ref().filter(|_| wired.sensor.kind() == SensorKind::Pad)?;
            let at_its_end = |reading: &&Reading| {
                let counts = reading.counts.get(wired.column).copied().flatten();
                counts.is_some_and(|counts| input.range_end(f64::from(counts)) == Some(RangeEnd::Short))
            };
            let (count, label, all) =
                (readings.iter().filter(at_its_end).count(), wired.sensor.label(), readings.len());
            (count > 0)
                .then(|| format!("the {label} is saturated in {count} of {all} readings: forces are larger there"))
        };
        self.wired.iter().filter_map(of).collect()
    }

    /// Curvature, pressure, force and raw values, as far as they can be read.
    pub fn channels(&self) -> Vec<Channel> {
        let has = |channel: &Channel| self.wired.iter().any(|wired| wired.sensor.gives(channel));
        self.sensors.channels().into_iter().filter(has).collect()
    }
}

impl Wired {
    fn curve(&self) -> Option<&Curve> {
        self.part.as_ref().map(|(_, calibration)| &calibration.curve)
    }

    /// Angle (rad), conductance beyond that at rest (S), or raw value.
    fn raw(&self, reading: &Reading) -> Option<f64> {
        let counts = f64::from((*reading.counts.get(self.column)?)?);
        if !counts.is_finite() {
            return None;
        }
        let Some((input, calibration)) = &self.part else { return Some(self.sensor.raw_value(counts)) };
        match (&calibration.curve, input.range_end(counts)) {
            (Curve::Flex(curve), None) => Some(curve.angle(input.ohm(counts))),
            (Curve::Flex(_), Some(_)) => None,
            // A pad at the end of its range is saturated: the value is a lower bound.
            (Curve::Pad(curve), None | Some(RangeEnd::Open | RangeEnd::Short)) => {
                Some(input.siemens(counts) - curve.idle_siemens)
            }
        }
    }

    /// Force (N) at a conductance beyond that at rest (S), less the effect of bending (1/m).
    fn force(&self, curve: &PadCurve, siemens: f64, curvature: Option<f64>) -> f64 {
        let bending = self.part.as_ref().and_then(|(_, calibration)| calibration.record.bending.as_ref());
        let preload = bending.map_or(0.0, |bending| bending.preload(curve, curvature.unwrap_or(0.0)));
        (curve.force(siemens) - preload).max(0.0)
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
