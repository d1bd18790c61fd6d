//! A voltage divider: the sensor and a fixed resistor between supply and ground, read where they meet.
//!
//! With the sensor to ground the share of the supply that is read is R / (R + R_fixed); with the sensor to the supply
//! it is r / (1 + r), r = G R_fixed. Only ratios of resistances count, so that they may be in ohm or in anything else.

use serde::{Deserialize, Serialize};

/// Side of the divider that the sensor is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wiring {
    /// Sensor to ground, fixed resistor to the supply: more resistance reads higher. Our flex strips.
    SensorToGround,
    /// Sensor to the supply, fixed resistor to ground: more conductance reads higher. Our pads.
    SensorToSupply,
}

/// A divider and what amplifies it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Divider {
    /// The fixed resistor (ohm).
    pub fixed_ohm: f64,
    /// Side of the sensor.
    pub wiring: Wiring,
    /// Factor on the voltage before it is read; 1 without an amplifier.
    pub gain: f64,
}

impl Divider {
    /// A flex strip's, without amplifier.
    pub const fn of_strip(fixed_ohm: f64) -> Self {
        Self { fixed_ohm, wiring: Wiring::SensorToGround, gain: 1.0 }
    }

    /// A pad's, without amplifier.
    pub const fn of_pad(fixed_ohm: f64) -> Self {
        Self { fixed_ohm, wiring: Wiring::SensorToSupply, gain: 1.0 }
    }

    /// Share of the supply that a sensor of some resistance (ohm) puts on the input.
    pub fn share_of_ohm(&self, ohm: f64) -> f64 {
        match self.wiring {
            Wiring::SensorToGround if ohm.is_infinite() => self.gain,
            Wiring::SensorToGround => self.gain * ohm / (ohm + self.fixed_ohm),
            Wiring::SensorToSupply => self.share_of_siemens(ohm.recip()),
        }
    }

    /// Share of the supply that a sensor of some conductance (S) puts on the input; 0 is an open circuit.
    pub fn share_of_siemens(&self, siemens: f64) -> f64 {
        match self.wiring {
            Wiring::SensorToGround => self.share_of_ohm(siemens.recip()),
            Wiring::SensorToSupply => {
                let ratio = self.fixed_ohm * siemens;
                self.gain * ratio / (1.0 + ratio)
            }
        }
    }

    /// Resistance (ohm) of the sensor that puts this share on the input; infinite for an open circuit.
    pub fn ohm(&self, share: f64) -> f64 {
        let share = share / self.gain;
        match self.wiring {
            Wiring::SensorToGround => self.fixed_ohm * share / (1.0 - share),
            Wiring::SensorToSupply => self.fixed_ohm * (1.0 - share) / share,
        }
    }

    /// Conductance (S) of the sensor that puts this share on the input.
    pub fn siemens(&self, share: f64) -> f64 {
        match self.wiring {
            Wiring::SensorToGround => self.ohm(share).recip(),
            Wiring::SensorToSupply => {
                let share = share / self.gain;
                share / (1.0 - share) / self.fixed_ohm
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_resistors_halve_the_supply() {
        for divider in [Divider::of_strip(47e3), Divider::of_pad(47e3)] {
            assert!((divider.share_of_ohm(47e3) - 0.5).abs() < 1e-15);
            assert!((divider.share_of_siemens(1.0 / 47e3) - 0.5).abs() < 1e-15);
        }
        // Twice the resistance: two thirds on one side, one third on the other.
        assert!((Divider::of_strip(10e3).share_of_ohm(20e3) - 2.0 / 3.0).abs() < 1e-15);
        assert!((Divider::of_pad(10e3).share_of_ohm(20e3) - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn readings_invert_to_the_sensor() {
        for divider in [Divider::of_strip(47e3), Divider { gain: 2.0, ..Divider::of_pad(4.7e3) }] {
            for ohm in [1e3, 25e3, 50e3, 1e6] {
                let share = divider.share_of_ohm(ohm);
                assert!((divider.ohm(share) / ohm - 1.0).abs() < 1e-9, "{ohm}");
                assert!((divider.siemens(share) * ohm - 1.0).abs() < 1e-9, "{ohm}");
            }
        }
    }

    #[test]
    fn an_open_circuit_is_at_the_rail_of_its_side() {
        assert_eq!(Divider::of_strip(47e3).share_of_siemens(0.0), 1.0);
        assert_eq!(Divider::of_strip(47e3).share_of_ohm(f64::INFINITY), 1.0);
        assert_eq!(Divider::of_pad(4.7e3).share_of_siemens(0.0), 0.0);
        assert_eq!(Divider::of_pad(4.7e3).share_of_ohm(f64::INFINITY), 0.0);
        assert_eq!(Divider::of_pad(4.7e3).siemens(0.0), 0.0);
    }
}
