//! A force-sensing pad, Ohmite FSR07CE (paper, section IV-B): from the load on it to its conductance.
//!
//! Below a threshold it does not conduct. Above, its conductance follows a power law, G = a F^b; a is the conductance at
//! one [`PadPart::full`] of force. It gives one signal, its normal force; a pressure is that over its area.

use serde::{Deserialize, Serialize};

/// One part, glued to its finger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PadPart {
    /// Force at which the law's base is 1 (N).
    pub full: f64,
    /// Conductance there, a.
    pub gain: f64,
    /// Exponent, b.
    pub exponent: f64,
    /// Threshold (N); none where it responds to any load.
    pub threshold: Option<f64>,
    /// Share of the load that reaches it.
    pub reaching: f64,
}

impl PadPart {
    /// Threshold force of a pad (N). Data sheet: less than 15 g, 0.15 N, actuates.
    pub const LEAST_FORCE: f64 = 0.15;

    /// Sensing area, a disc of 14.70 mm (m²) (data sheet): a pad's pressure is its force over this.
    pub const ACTIVE_AREA: f64 = std::f64::consts::FRAC_PI_4 * 0.0147 * 0.0147;

    /// Conductance at 1 N (S): 6 kΩ (Interlink 402, the table of Adafruit; there is none for the FSR07).
    pub const NOMINAL_SIEMENS: f64 = 1.0 / 6e3;

    /// Exponent b from part to part: 0.8 to 1 (the same table; Interlink's guide). The nominal part is in the middle.
    pub const EXPONENT: [f64; 2] = [0.8, 1.0];

    /// The exponent of the nominal part.
    pub const NOMINAL_EXPONENT: f64 = 0.5 * (Self::EXPONENT[0] + Self::EXPONENT[1]);

    /// Tolerance of a part's conductance, as a share of the nominal (data sheet, parts of one batch).
    pub const GAIN_TOLERANCE: f64 = 0.04;

    /// Resistor of its divider (ohm): the value recommended for the lowest tenth of the pad's range.
    pub const DIVIDER_OHM: f64 = 4.7e3;
}

/// Hysteresis: reading of an unloading pad above that of a loading one, as a share of the load (data sheet).
const HYSTERESIS: f64 = 0.05;

/// Growth of the conductance for every tenfold time under load (data sheet, 1 % per log time).
const DRIFT_PER_DECADE: f64 = 0.01;

/// Time under load at which that growth sets in (s). Assumed; a data sheet counts from hours.
const DRIFT_FROM_S: f64 = 0.1;

/// A pad that is read at regular times.
#[derive(Clone, Debug)]
pub struct ForcePad {
    /// Part constants.
    pub part: PadPart,
    /// Unloading reads more than loading.
    pub hysteretic: bool,
    /// Its conductance grows under load.
    pub drifts: bool,
    /// Conductance beyond which it does not rise; none where it always does.
    pub ceiling: Option<f64>,
    /// Times per second at which it is read (1/s).
    pub rate_hz: f64,
    /// The load that shows, with hysteresis.
    shown: f64,
    /// Time since it began to conduct (s).
    loaded_s: f64,
}

impl ForcePad {
    /// A pad without faults, unloaded.
    pub fn new(part: PadPart, rate_hz: f64) -> Self {
        Self { part, hysteretic: false, drifts: false, ceiling: None, rate_hz, shown: 0.0, loaded_s: 0.0 }
    }

    /// Its conductance under a load at the next reading, in the unit of [`PadPart::gain`]. A pull counts as no load.
    pub fn conductance(&mut self, load: f64) -> f64 {
        let load = self.hysteresis(load.max(0.0));
        if load <= 0.0 || self.part.threshold.is_some_and(|least| load < least) {
            self.loaded_s = 0.0;
            return 0.0;
        }
        let decades = if self.drifts { (1.0 + self.loaded_s / DRIFT_FROM_S).log10() } else { 0.0 };
        self.loaded_s += 1.0 / self.rate_hz;
        let law = (load * self.part.reaching / self.part.full).powf(self.part.exponent);
        let conductance = self.part.gain * (1.0 + DRIFT_PER_DECADE * decades) * law;
        self.ceiling.map_or(conductance, |most| conductance.min(most))
    }

    /// The load that shows: rising with it, but falling only once it has fallen by the hysteresis.
    fn hysteresis(&mut self, load: f64) -> f64 {
        let most = if self.hysteretic { (1.0 + HYSTERESIS) * load } else { load };
        self.shown = self.shown.clamp(load, most);
        self.shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nominal_pad_has_6_kilohm_at_one_newton_and_none_below_its_threshold() {
        let part = PadPart {
            full: 1.0,
            gain: PadPart::NOMINAL_SIEMENS,
            exponent: PadPart::NOMINAL_EXPONENT,
            threshold: Some(PadPart::LEAST_FORCE),
            reaching: 1.0,
        };
        let mut pad = ForcePad::new(part, 50.0);
        assert!((1.0 / pad.conductance(1.0) - 6e3).abs() < 1e-9);
        assert!((pad.conductance(2.0) * 6e3 - 2f64.powf(0.9)).abs() < 1e-12);
        assert_eq!((pad.conductance(0.149), pad.conductance(-1.0)), (0.0, 0.0));
    }
}
