//! The last step of a pad's calibration: the empty hand closes once, and the pad's readings meanwhile give the effect
//! of bending, over the curvature that the strip of the same finger reads.

use super::CalibrationFault;
use super::pad_curve::BendingZero;
use super::readout::Readout;
use super::record::Calibration;
use crate::board::{Board, Reading};
use crate::sensor_list::{Sensor, SensorKind};

/// Most readings that are kept: half a minute at 1 kHz.
const MOST_READINGS: usize = 30_000;

/// An empty close that is being watched.
#[derive(Clone, Debug)]
pub struct EmptyClose {
    readout: Readout,
    pad: Sensor,
    seconds: f64,
    /// Curvature (1/m) and conductance of the pad (S) in the readings so far.
    readings: Vec<(f64, f64)>,
    /// Times of the first and the last of them (s).
    span_s: Option<[f64; 2]>,
}

impl EmptyClose {
    /// Default duration (s): enough to turn a regulator up and down again.
    pub const SECONDS: f64 = 15.0;

    /// Records a pad that was just calibrated, for some seconds. `serving` are the calibrations of the other parts; the
    /// strip of the same finger must be among them.
    pub fn begin(
        board: &Board,
        pad: (Sensor, Calibration),
        serving: &[(Sensor, Calibration)],
        seconds: f64,
    ) -> Result<Self, CalibrationFault> {
        let sensor = pad.0;
        if sensor.kind() != SensorKind::Pad {
            return Err(CalibrationFault::no_bending());
        }
        let strip = sensor
            .strip()
            .filter(|strip| board.channel_of(*strip).is_some() && serving.iter().any(|(own, _)| own == strip));
        if strip.is_none() {
            let finger = sensor.finger();
            return Err(CalibrationFault::no_strip(
                &sensor.strip().map_or(format!("{finger} flex strip"), Sensor::label),
            ));
        }
        let mut calibrations: Vec<(Sensor, Calibration)> =
            serving.iter().filter(|(own, _)| *own != sensor).cloned().collect();
        calibrations.push(pad);
        let readout = Readout::new(board, &calibrations)?;
        Ok(Self { readout, pad: sensor, seconds, readings: Vec::new(), span_s: None })
    }

    /// Takes in a reading; true once it has watched for long enough.
    pub fn feed(&mut self, reading: &Reading) -> bool {
        // A clock that was set back begins anew.
        if self.span_s.is_some_and(|[_, last]| reading.t_s < last) {
            (self.readings, self.span_s) = (Vec::new(), None);
        }
        if self.readings.len() < MOST_READINGS {
            self.readings.extend(self.readout.bending(self.pad, std::slice::from_ref(reading)));
        }
        self.span_s.get_or_insert([reading.t_s; 2])[1] = reading.t_s;
        self.left_s() <= 0.0
    }

    /// Time left (s).
    pub fn left_s(&self) -> f64 {
        (self.seconds - self.span_s.map_or(0.0, |[first, last]| last - first)).max(0.0)
    }

    /// Instruction to the user.
    pub fn instruction(&self) -> String {
        let left = self.left_s().ceil();
        format!(
            "take everything away and let the empty hand close to about half a bar and open again, so that the fingers do not \
             touch: {left:.0} s left"
        )
    }

    /// Bending zero from the recorded readings.
    pub fn bending(&self) -> Result<BendingZero, CalibrationFault> {
        BendingZero::from_empty_close(&self.readings)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Input;
    use super::super::point::Point;
    use super::super::record::{Curve, Record};
    use super::*;
    use crate::electronics::StripPart;

    fn calibration(sensor: Sensor, points: &[(f64, f64)]) -> Calibration {
        let (kind, input) = (sensor.kind(), Input::on(&Board::default(), sensor));
        let point = |&(shown, ohm): &(f64, f64)| Point {
            stimulus: kind.stimulus(shown),
            counts: input.counts(ohm),
            spread: 1.0,
            readings: 50,
        };
        let points = points.iter().map(point).collect();
        let part = sensor.channel().to_owned();
        let record = Record { part, kind, input, points, bending: None, assumed: false, note: String::new() };
        Calibration::fit(record).expect("is such a part")
    }

    fn parts() -> [(Sensor, Calibration); 2] {
        let ohm = |kg: f64| 6e3 / SensorKind::Pad.stimulus(kg).powf(0.9);
        let loads = [0.03, 0.05, 0.1, 0.2, 0.35, 0.5].map(|kg| (kg, ohm(kg)));
        [
            (Sensor::FLEX_LEFT, calibration(Sensor::FLEX_LEFT, &[(0.0, 25e3), (45.0, 37.5e3), (90.0, 50e3)])),
            (Sensor::PAD_LEFT, calibration(Sensor::PAD_LEFT, &loads)),
        ]
    }

    #[test]
    fn the_bending_zero_is_found_from_an_empty_close() -> Result<(), CalibrationFault> {
        let [strip, pad] = parts();
        let board = Board::default();
        let mut close = EmptyClose::begin(&board, pad.clone(), std::slice::from_ref(&strip), 4.0)?;
        // At 50 Hz the finger bends to 45 degrees, and its pad shows 0.02 N for each degree.
        let inputs = [Sensor::FLEX_LEFT, Sensor::PAD_LEFT].map(|sensor| Input::on(&board, sensor));
        let mut over = false;
        for k in 0..=200u32 {
            let degrees = 45.0 * f64::from(k) / 200.0;
            let force: f64 = 0.02 * degrees;
            let counts = [inputs[0].counts(25e3 * (1.0 + degrees / 90.0)), inputs[1].counts(6e3 / force.powf(0.9))];
            let counts = vec![Some(counts[0] as f32), None, Some(counts[1] as f32), None];
            assert!(!over, "{k}");
            let t_s = 0.02 * f64::from(k);
            over = close.feed(&Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None });
        }
        assert!(over && close.left_s() == 0.0);
        let bending = close.bending()?;
        let Curve::Pad(curve) = &pad.1.curve else { return Err(CalibrationFault::no_bending()) };
        let kappa = 30f64.to_radians() / StripPart::ACTIVE_LENGTH;
        let load = bending.preload(curve, kappa);
        assert!((load - 0.6).abs() < 0.03, "{load}");
        Ok(())
    }

    #[test]
    fn an_unusable_empty_close_is_refused_with_the_reason() -> Result<(), CalibrationFault> {
        let [strip, pad] = parts();
        let board = Board::default();
        let begin = |sensor: &(Sensor, Calibration), serving: &[(Sensor, Calibration)]| {
            EmptyClose::begin(&board, sensor.clone(), serving, 1.0).map(|_| ())
        };
        assert!(begin(&strip, &[]) == Err(CalibrationFault::no_bending()));
        assert!(begin(&pad, &[]) == Err(CalibrationFault::no_strip("left flex strip")));
        let mut still = EmptyClose::begin(&board, pad, &[strip], 1.0)?;
        let counts = vec![Some(1424.0), None, Some(0.0), None];
        for k in 0..60u32 {
            let t_s = 0.02 * f64::from(k);
            still.feed(&Reading { t_s, arrived_s: t_s, seq: None, counts: counts.clone(), line_bar: None });
        }
        assert!(still.bending().is_err_and(|error| error.to_string().starts_with("the empty close has")));
        Ok(())
    }
}
