//! Parts of the emulated gripper: hidden values that a calibration estimates.

use super::event::EmulatorError;
use palpate_sim::gripper::Side;
use palpate_tactile::board::{Sensor, SensorKind, SensorList};
use palpate_tactile::electronics::{Divider, FlexStrip, ForcePad, PadPart, StripPart};
use palpate_tactile::model::Stream;
use serde::{Deserialize, Serialize};

/// A strip and its divider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StripSetup {
    /// The part; its `reaching` is 1 on the bench and on the finger.
    #[serde(flatten)]
    pub part: StripPart,
    /// Fixed resistor (ohm).
    pub divider_ohm: f64,
}

/// A pad and its divider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PadSetup {
    /// The part: `gain` is its conductance (S) at `full` newtons, which is 1.
    #[serde(flatten)]
    pub part: PadPart,
    /// Load that bending puts on it, per curvature of the finger (N m). Pads fire when they are bent (Interlink's guide,
    /// "false triggering"), so that the zero of a pad moves as its finger closes.
    pub bending_load: f64,
    /// Fixed resistor (ohm).
    pub divider_ohm: f64,
}

/// Hidden values of the emulated gripper's electronics. The values of its fingers are in the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HiddenParts {
    /// Strips, left and right.
    pub strips: [StripSetup; 2],
    /// Pads, left and right.
    pub pads: [PadSetup; 2],
    /// Deviation of the noise of a single conversion (counts of 12 bits).
    pub noise_counts: f64,
    /// Strips creep, and pads read more while unloading.
    pub hysteresis: bool,
    /// Conductance of pads grows under load.
    pub drift: bool,
}

impl HiddenParts {
    /// Parts within the tolerances of their data sheets, drawn from a seed.
    pub fn drawn(seed: u64) -> Self {
        // The name is part of the draw: another would give other parts for the same seed.
        let mut random = Stream::new(seed, "pretended gripper", "parts");
        let mut strip = || {
            let off = random.within(-StripPart::FLAT_TOLERANCE, StripPart::FLAT_TOLERANCE);
            let bent = random.within(StripPart::BENT_OVER_FLAT[0], StripPart::BENT_OVER_FLAT[1]);
            let flat_ohm = StripPart::NOMINAL_OHM * (1.0 + off);
            let part = StripPart { flat_ohm, rise_per_rad: StripPart::rise(bent), ..StripPart::nominal() };
            StripSetup { part, divider_ohm: StripPart::DIVIDER_OHM }
        };
        let strips = [strip(), strip()];
        let mut pad = || {
            let off = random.within(-PadPart::GAIN_TOLERANCE, PadPart::GAIN_TOLERANCE);
            let part = PadPart {
                full: 1.0,
                gain: PadPart::NOMINAL_SIEMENS * (1.0 + off),
                exponent: random.within(PadPart::EXPONENT[0], PadPart::EXPONENT[1]),
                threshold: Some(PadPart::LEAST_FORCE * random.within(0.8, 1.2)),
                reaching: 1.0,
            };
            PadSetup {
                part,
                bending_load: random.within(MOST_BENDING_LOAD[0], MOST_BENDING_LOAD[1]),
                divider_ohm: 4.7e3,
            }
        };
        let pads = [pad(), pad()];
        Self { strips, pads, noise_counts: 2.0, hysteresis: true, drift: true }
    }

    /// Refuses values that no part has.
    pub fn check(&self) -> Result<(), EmulatorError> {
        let refuse = |is_fine: bool, name: &str, value: f64, wanted: &str| {
            if is_fine { Ok(()) } else { Err(EmulatorError(format!("{name} is {value}; it must {wanted}"))) }
        };
        let positive =
            |name: &str, value: f64| refuse(value.is_finite() && value > 0.0, name, value, "be a positive number");
        for strip in &self.strips {
            positive("flat_ohm", strip.part.flat_ohm)?;
            positive("rise_per_rad", strip.part.rise_per_rad)?;
            positive("divider_ohm", strip.divider_ohm)?;
            positive("reaching", strip.part.reaching)?;
        }
        for pad in &self.pads {
            positive("full", pad.part.full)?;
            positive("gain", pad.part.gain)?;
            positive("exponent", pad.part.exponent)?;
            positive("divider_ohm", pad.divider_ohm)?;
            positive("reaching", pad.part.reaching)?;
        }
        refuse(self.noise_counts >= 0.0, "noise_counts", self.noise_counts, "not be negative")
    }

    /// The sensors of a list, read so many times a second (1/s). Those beyond the first of a kind on a finger are parts of
    /// the same values.
    pub(super) fn sensors(&self, list: SensorList, rate_hz: f64) -> Sensors {
        let part = |sensor: Sensor| {
            let side = side_of(sensor);
            match sensor.kind() {
                SensorKind::Flex => {
                    let setup = self.strips[side];
                    let mut strip = FlexStrip::new(setup.part, rate_hz);
                    (strip.one_way, strip.folds, strip.creeps) = (true, true, self.hysteresis);
                    WiredPart::Strip(strip, Divider::of_strip(setup.divider_ohm))
                }
                SensorKind::Pad => {
                    let setup = self.pads[side];
                    let mut pad = ForcePad::new(setup.part, rate_hz);
                    (pad.hysteretic, pad.drifts) = (self.hysteresis, self.drift);
                    let strip = sensor.strip().map(Sensor::index);
                    WiredPart::Pad {
                        pad,
                        bending_load: setup.bending_load,
                        strip,
                        divider: Divider::of_pad(setup.divider_ohm),
                    }
                }
                SensorKind::Raw => WiredPart::Raw { units_of_full: sensor.raw_value(LEVELS) },
            }
        };
        Sensors { parts: list.iter().map(part).collect() }
    }

    /// Fixed resistor beside a sensor (ohm).
    pub(super) fn divider_ohm(&self, sensor: Sensor) -> f64 {
        match sensor.kind() {
            SensorKind::Flex => self.strips[side_of(sensor)].divider_ohm,
            SensorKind::Pad => self.pads[side_of(sensor)].divider_ohm,
            SensorKind::Raw => SPARE_OHM,
        }
    }
}

/// Load that bending puts on a pad, least and most (N m). Assumed: 0.07 to 0.3 N when the finger is closed on nothing
/// at 1 bar (14 1/m), so that it shows above the threshold of some pads and not of others.
const MOST_BENDING_LOAD: [f64; 2] = [0.005, 0.02];

/// Stated resistor of inputs that are no strip and no pad (ohm).
pub(super) const SPARE_OHM: f64 = 4700.0;
/// Counts of the converter.
const LEVELS: f64 = palpate_tactile::electronics::Converter::DUE.levels;

/// Which of the two parts of a kind a sensor has: the right finger's, or the left one's for all other fingers.
fn side_of(sensor: Sensor) -> usize {
    sensor.side().map_or(0, Side::index)
}

/// Stimulus of each sensor of a list: curvature under a strip (1/m), normal force on a pad (N), what a raw sensor measures.
pub(super) type Stimuli = Vec<f64>;

/// The stimuli that are `share` of the way from one to another.
pub(super) fn between(from: &[f64], to: &[f64], share: f64) -> Stimuli {
    from.iter().zip(to).map(|(a, b)| a + (b - a) * share).collect()
}

/// A part with its divider, at work.
#[derive(Clone, Debug)]
enum WiredPart {
    Strip(FlexStrip, Divider),
    Pad { pad: ForcePad, bending_load: f64, strip: Option<usize>, divider: Divider },
    Raw { units_of_full: f64 },
}

/// The sensors at work.
#[derive(Clone, Debug)]
pub(super) struct Sensors {
    parts: Vec<WiredPart>,
}

impl Sensors {
    /// Shares of the supply on the inputs, in the order of the list.
    pub(super) fn shares(&mut self, stimuli: &[f64]) -> Vec<f64> {
        let share = |(part, stimulus): (&mut WiredPart, &f64)| match part {
            WiredPart::Strip(strip, divider) => divider.share_of_ohm(strip.ohm(*stimulus)),
            WiredPart::Pad { pad, bending_load, strip, divider } => {
                let kappa = strip.and_then(|strip| stimuli.get(strip)).copied().unwrap_or_default();
                divider.share_of_siemens(pad.conductance(stimulus + *bending_load * kappa.max(0.0)))
            }
            WiredPart::Raw { units_of_full } => (stimulus / *units_of_full).clamp(0.0, 1.0),
        };
        self.parts.iter_mut().zip(stimuli).map(share).collect()
    }

    /// Share that an input reads where nothing is connected: a strip is to ground, so that the input is pulled up; a pad is to
    /// the supply.
    pub(super) fn share_when_open(&self, channel: usize) -> f64 {
        if matches!(self.parts.get(channel), Some(WiredPart::Strip(..))) { 1.0 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_parts_are_within_their_data_sheets_and_named_by_their_seed() {
        assert_eq!(HiddenParts::drawn(3), HiddenParts::drawn(3));
        for seed in 0..50 {
            let parts = HiddenParts::drawn(seed);
            assert_eq!(parts.check(), Ok(()));
            for strip in parts.strips {
                assert!((17.5e3..=32.5e3).contains(&strip.part.flat_ohm), "{strip:?}");
                let bent = 1.0 + strip.part.rise_per_rad * std::f64::consts::FRAC_PI_2;
                assert!((2.0..=2.5).contains(&bent), "{strip:?}");
            }
            for pad in parts.pads {
                assert!((0.8..=1.0).contains(&pad.part.exponent) && (1.0 / pad.part.gain - 6e3).abs() < 251.0);
            }
            assert_ne!(parts.strips[0], parts.strips[1]);
        }
    }

    #[test]
    fn parts_survive_being_written_down() {
        let parts = HiddenParts::drawn(5);
        let text = serde_json::to_string(&parts).expect("plain numbers");
        assert_eq!(serde_json::from_str::<HiddenParts>(&text).expect("just written"), parts);
    }

    #[test]
    fn half_a_kilogram_on_a_nominal_pad_reads_what_the_law_says() {
        let mut parts = HiddenParts::drawn(1);
        parts.pads[0].part = PadPart { gain: 1.0 / 6e3, exponent: 0.9, ..parts.pads[0].part };
        (parts.hysteresis, parts.drift) = (false, false);
        let force = 0.5 * palpate_geometry::units::STANDARD_GRAVITY;
        let shares = parts.sensors(SensorList::default(), 50.0).shares(&[0.0, 0.0, force, 0.0]);
        let [flat, _, pressed, idle] = shares[..] else { panic!("four sensors") };
        let ratio = 4.7e3 * force.powf(0.9) / 6e3;
        assert!((pressed - ratio / (1.0 + ratio)).abs() < 1e-12 && idle == 0.0);
        let ohm = parts.strips[0].part.flat_ohm;
        assert!((flat - ohm / (ohm + 47e3)).abs() < 1e-12);
    }
}
