//! Input of a board: counts to the resistance or conductance of the sensor.
//!
//! Count c of a converter with full scale C stands for the share c / (C + 1) of the reference voltage; the rest is the
//! [`Divider`]'s.

use crate::board::{Board, Sensor};
use crate::electronics::{Divider, PadPart, StripPart, Wiring};
use serde::{Deserialize, Serialize};

/// An input of the board: a divider and the converter behind it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Input {
    pub divider: Divider,
    /// The largest count of the converter, C.
    pub full_scale: u32,
    /// Voltage of the reference (V).
    pub reference_volt: f64,
}

/// Counts within this distance of an end of the converter's range are saturated.
const RAIL_COUNTS: f64 = 1.5;

impl Input {
    /// The divider of a sensor on a board: as the board reports it, else as in the gripper file, else as our firmware wires it:
    /// strips to ground beside 47 kΩ, pads to the supply beside 4.7 kΩ.
    pub fn on(board: &Board, sensor: Sensor) -> Self {
        let stated = sensor.row().divider_ohm;
        let usual = match sensor.is_flex() {
            true => Divider::of_strip(stated.unwrap_or(StripPart::DIVIDER_OHM)),
            false => Divider::of_pad(stated.unwrap_or(PadPart::DIVIDER_OHM)),
        };
        Self { divider: usual, full_scale: board.full_scale, reference_volt: board.reference_volt }
            .seen_by(board, sensor)
    }

    /// The same divider seen through another board, which may have another converter and another resistor.
    #[must_use]
    pub fn seen_by(&self, board: &Board, sensor: Sensor) -> Self {
        let fixed_ohm = stated_resistor(board, sensor).unwrap_or(self.divider.fixed_ohm);
        let divider = Divider { fixed_ohm, ..self.divider };
        Self { divider, full_scale: board.full_scale, reference_volt: board.reference_volt }
    }

    /// True where its numbers are possible.
    pub fn is_possible(&self) -> bool {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let Divider { fixed_ohm, gain, .. } = self.divider;
        positive(fixed_ohm) && positive(gain) && positive(self.reference_volt) && self.full_scale >= 1
    }

    /// Resistance of the sensor (ohm).
    pub fn ohm(&self, counts: f64) -> f64 {
        self.divider.ohm(self.share(counts))
    }

    /// Conductance of the sensor (S).
    pub fn siemens(&self, counts: f64) -> f64 {
        self.divider.siemens(self.share(counts))
    }

    /// Reading of a resistance (ohm) before noise and rounding (counts).
    pub fn counts(&self, ohm: f64) -> f64 {
        self.divider.share_of_ohm(ohm) * self.levels()
    }

    /// By which share of itself the conductance changes with one count, d ln G / dc.
    pub fn relative_step(&self, counts: f64) -> f64 {
        let share = self.share(counts) / self.divider.gain;
        1.0 / (share * (1.0 - share) * self.divider.gain * self.levels())
    }

    /// End of the converter's range that a reading is at, if any: it then does not determine the resistance. A pad that
    /// reads zero is only unloaded.
    pub fn range_end(&self, counts: f64) -> Option<RangeEnd> {
        let high = counts >= f64::from(self.full_scale) - RAIL_COUNTS;
        let low = counts <= RAIL_COUNTS;
        match (self.divider.wiring, high, low) {
            (Wiring::SensorToGround, true, _) | (Wiring::SensorToSupply, _, true) => Some(RangeEnd::Open),
            (Wiring::SensorToGround, _, true) | (Wiring::SensorToSupply, true, _) => Some(RangeEnd::Short),
            _ => None,
        }
    }

    fn share(&self, counts: f64) -> f64 {
        (counts / self.levels()).clamp(0.0, f64::from(self.full_scale) / self.levels())
    }

    fn levels(&self) -> f64 {
        f64::from(self.full_scale) + 1.0
    }
}

/// Resistor beside a sensor that the board reports (ohm).
pub(super) fn stated_resistor(board: &Board, sensor: Sensor) -> Option<f64> {
    let ohm = *board.divider_ohm.get(board.channel_of(sensor)?)?;
    (ohm.is_finite() && ohm > 0.0).then_some(ohm)
}

/// An end of the converter's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RangeEnd {
    /// As if nothing were connected: no current flows through the sensor.
    Open,
    /// As if the sensor were a wire.
    Short,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inputs() -> [Input; 2] {
        [Input::on(&Board::default(), Sensor::FLEX_LEFT), Input::on(&Board::default(), Sensor::PAD_RIGHT)]
    }

    #[test]
    fn equal_resistors_share_the_voltage() {
        for input in inputs() {
            assert_eq!(input.counts(input.divider.fixed_ohm), 2048.0);
            assert!((input.ohm(2048.0) - input.divider.fixed_ohm).abs() < 1e-9);
        }
        // 25 kΩ below 47 kΩ: 25 / 72 of 4096.
        assert!((inputs()[0].counts(25e3) - 4096.0 * 25.0 / 72.0).abs() < 1e-9);
        // 1 kΩ above 4.7 kΩ: 4.7 / 5.7.
        assert!((inputs()[1].counts(1e3) - 4096.0 * 4.7 / 5.7).abs() < 1e-9);
    }

    #[test]
    fn counts_and_ohms_are_inverse_to_each_other() {
        for input in inputs() {
            for ohm in [500.0, 6e3, 25e3, 60e3] {
                let counts = input.counts(ohm);
                assert!((input.ohm(counts) / ohm - 1.0).abs() < 1e-12);
                let next = input.siemens(counts + 1e-3) / input.siemens(counts);
                let step = (next.ln() / 1e-3).abs();
                assert!((step / input.relative_step(counts) - 1.0).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn an_end_of_the_range_is_open_or_short() {
        let [strip, pad] = inputs();
        assert_eq!(
            (strip.range_end(4095.0), strip.range_end(0.0), strip.range_end(1400.0)),
            (Some(RangeEnd::Open), Some(RangeEnd::Short), None)
        );
        assert_eq!(
            (pad.range_end(0.0), pad.range_end(4095.0), pad.range_end(900.0)),
            (Some(RangeEnd::Open), Some(RangeEnd::Short), None)
        );
        assert!(pad.siemens(0.0) == 0.0 && pad.siemens(4095.0).is_finite() && pad.siemens(1e9).is_finite());
        assert!(strip.ohm(0.0) == 0.0 && strip.ohm(4095.0).is_finite());
    }

    #[test]
    fn a_board_has_the_last_word_on_its_resistor_and_converter() {
        let ten_bit = Board { full_scale: 1023, divider_ohm: vec![33e3, f64::NAN, 0.0, 3.3e3], ..Board::default() };
        let input = |sensor| Input::on(&ten_bit, sensor);
        assert_eq!((input(Sensor::FLEX_LEFT).divider.fixed_ohm, input(Sensor::FLEX_LEFT).full_scale), (33e3, 1023));
        assert_eq!(input(Sensor::FLEX_RIGHT).divider.fixed_ohm, 47e3);
        assert_eq!(input(Sensor::PAD_LEFT).divider.fixed_ohm, 4.7e3);
        let seen = inputs()[1].seen_by(&ten_bit, Sensor::PAD_RIGHT);
        assert_eq!((seen.divider.fixed_ohm, seen.full_scale), (3.3e3, 1023));
    }
}
