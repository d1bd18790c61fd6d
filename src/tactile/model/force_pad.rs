//! The force-sensing pad, whose one reading is force, or pressure over its area: Ohmite FSR07CE (paper, section IV-B).
//!
//! [`crate::electronics`] has its law; here the pad also saturates, and the divider is amplified so that the converter
//! reaches full scale when the pad saturates. Loads are given as shares u of the load that saturates the nominal pad:
//! G = G_full u^b.
//!
//! Recordings of the real gripper have three levels: idle, touched, and saturated soon after the touch. No circuit or
//! curve of it is published, so the load that saturates is assumed, and a setting: [`PhysicalLike::full_force`].
//! The calibration knows the nominal a and b: two points of a straight line in logarithms.

use super::input::Input;
use super::physical_like::PhysicalLike;
use super::sampling::SAMPLE_HZ;
use super::streams::Streams;
use crate::electronics::{Divider, ForcePad, PadPart};

/// Threshold force of a pad, left and right (N). The right is assumed a third less sensitive.
const LEAST_FORCE: [f64; 2] = [PadPart::LEAST_FORCE, 0.20];

/// Share of the load that reaches the pad, left and right. Assumed: the right pad is mounted as poorly as its strip.
const REACHING: [f64; 2] = [1.0, 0.7];

/// Ranges on any gripper, assumed: share of the load that reaches the pad; threshold over [`PadPart::LEAST_FORCE`]; force
/// at which the nominal pad saturates (N), on a logarithmic scale and the same for both pads; force that a pad shows
/// over the curvature of its finger (N m).
const ANY_REACHING: [f64; 2] = [0.6, 1.0];
const ANY_THRESHOLD: [f64; 2] = [0.6, 1.6];
const ANY_FULL: [f64; 2] = [0.2, 1.0];
const ANY_BENDING: [f64; 2] = [0.005, 0.02];

/// Curvature at the end of an empty close (1/m): that of the simulated finger at 1 bar.
const CLOSED_EMPTY: f64 = 11.8;

/// Deviation of the conductance from grasp to grasp (data sheet, single part repeatability).
const SLIP: f64 = 0.02;

/// The divider's resistor over the pad's at the load that saturates, G_full R_m. The pad is assumed to have the
/// conductance there that a common pad has at 1 N.
const FULL_RATIO: f64 = PadPart::DIVIDER_OHM * PadPart::NOMINAL_SIEMENS;

/// Voltage over R_m at the load that saturates, as a share of the supply.
const FULL_SHARE: f64 = FULL_RATIO / (1.0 + FULL_RATIO);

/// One pad on its finger during one grasp, and its calibration.
#[derive(Clone, Debug)]
pub(super) struct ReadPad {
    pad: ForcePad,
    /// Counts conductances in the one at saturation.
    divider: Divider,
    input: Input,
    /// Load that it shows over the curvature of its finger (N m).
    bending: f64,
    /// An empty close has shown what bending does to it.
    closed_empty: bool,
}

impl ReadPad {
    /// The pad of a channel.
    pub(super) fn new(settings: &PhysicalLike, side: usize, streams: Streams<'_>) -> Self {
        let mounted = if settings.asymmetry { side } else { 0 };
        let slip = if settings.slip { 1.0 + SLIP * streams.of_trial("slip").normal() } else { 1.0 };
        let (gain, exponent) = if settings.parts {
            let off = streams.of_gripper("gain").within(-PadPart::GAIN_TOLERANCE, PadPart::GAIN_TOLERANCE);
            (1.0 + off, streams.of_gripper("exponent").within(PadPart::EXPONENT[0], PadPart::EXPONENT[1]))
        } else {
            (1.0, PadPart::NOMINAL_EXPONENT)
        };
        let any = |effect: &str, [low, high]: [f64; 2]| streams.of_gripper(effect).within(low, high);
        let (full, threshold, reaching) = if settings.drawn {
            let both = Streams { channel: "pads", ..streams };
            let full = both.of_gripper("full").within(ANY_FULL[0].ln(), ANY_FULL[1].ln()).exp();
            (full, any("threshold", ANY_THRESHOLD) * PadPart::LEAST_FORCE, any("reaching", ANY_REACHING))
        } else {
            (settings.full_force, LEAST_FORCE[mounted], REACHING[mounted])
        };
        let bending = if settings.drawn { any("bending", ANY_BENDING) } else { 0.0 };
        let threshold = settings.threshold.then_some(threshold);
        let part = PadPart { full, gain: gain * slip, exponent, threshold, reaching };
        let mut pad = ForcePad::new(part, SAMPLE_HZ);
        pad.hysteretic = settings.hysteresis;
        pad.drifts = settings.drift;
        pad.ceiling = settings.saturation.then_some(1.0);
        let gain = if settings.saturation { 1.0 / FULL_SHARE } else { 1.0 };
        let divider = Divider { gain, ..Divider::of_pad(FULL_RATIO) };
        let (input, closed_empty) = (Input::new(settings, streams), settings.closed_empty);
        Self { pad, divider, input, bending, closed_empty }
    }

    /// The force (N) that is reported of a true one at the next sample, on a finger of this curvature (1/m). A pull counts
    /// as no force.
    pub(super) fn read(&mut self, force: f64, kappa: f64) -> f64 {
        let conductance = self.pad.conductance(force.max(0.0) + self.bending * kappa.max(0.0));
        let conductance = self.convert(conductance);
        let read = self.force(conductance);
        if self.closed_empty { (read - self.of_bending(kappa)).max(0.0) } else { read }
    }

    /// Force by the nominal law, of a conductance as a share of the one at saturation.
    fn force(&self, conductance: f64) -> f64 {
        self.pad.part.full * conductance.powf(1.0 / PadPart::NOMINAL_EXPONENT)
    }

    /// Force that bending alone causes at a curvature, as a user knows it from an empty close (N). Below the threshold
    /// it rises linearly to the first value that shows, as in [`crate::calibration::BendingZero`].
    fn of_bending(&self, kappa: f64) -> f64 {
        let shown = |kappa: f64| {
            let mut still = ForcePad::new(self.pad.part, SAMPLE_HZ);
            still.ceiling = self.pad.ceiling;
            self.force(still.conductance(self.bending * kappa))
        };
        let kappa = kappa.clamp(0.0, CLOSED_EMPTY);
        let first = self.pad.part.threshold.map_or(0.0, |least| least / self.bending);
        match () {
            () if self.bending <= 0.0 || first > CLOSED_EMPTY => 0.0,
            () if kappa < first => shown(first) * kappa / first,
            () => shown(kappa),
        }
    }

    /// A conductance through divider, amplifier and converter and back, both as shares of the one at saturation.
    fn convert(&mut self, conductance: f64) -> f64 {
        if self.input.is_perfect() {
            return conductance;
        }
        self.divider.siemens(self.input.read(self.divider.share_of_siemens(conductance)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Force at which the nominal pad saturates (N).
    const FULL: f64 = PhysicalLike::OFF.full_force;

    fn pad(settings: &PhysicalLike, side: usize) -> ReadPad {
        ReadPad::new(settings, side, Streams { gripper: 1, trial: 1, channel: "force_left" })
    }

    #[test]
    fn its_characteristic_is_silent_then_rises_then_saturates() {
        let still = PhysicalLike { noise: false, hysteresis: false, drift: false, ..PhysicalLike::default() };
        for side in 0..2 {
            let mut pad = pad(&still, side);
            let reads: Vec<f64> = (0..300).map(|i| pad.read(0.01 * f64::from(i) * FULL, 0.0)).collect();
            assert!(reads.windows(2).all(|w| w[0] <= w[1]));
            let least = (100.0 * LEAST_FORCE[side] / FULL).ceil() as usize;
            assert!(reads[..least].iter().all(|&r| r == 0.0) && reads[least + 1] > 0.02 * FULL);
            let most = reads[299];
            assert!((most / FULL - 1.0).abs() < 1e-3, "saturated, {most}");
            let saturated = reads.iter().position(|&r| r == most).unwrap();
            assert!(saturated < [120, 170][side], "{saturated}");
        }
    }

    #[test]
    fn an_ideal_pad_is_exact() {
        let mut ideal = pad(&PhysicalLike::OFF, 1);
        for load in [0.0, 1e-3, 0.2, 1.0, 30.0] {
            assert!((ideal.read(load * FULL, 0.0) - load * FULL).abs() <= 1e-12 * FULL * load);
        }
        assert_eq!(ideal.read(-1.0, 0.0), 0.0);
    }

    #[test]
    fn pads_of_any_gripper_differ_and_fire_when_bent_until_an_empty_close_is_known() {
        let pads = |closed_empty: bool| -> Vec<ReadPad> {
            let of = |gripper| {
                let settings = PhysicalLike { noise: false, counts: false, closed_empty, ..PhysicalLike::any(gripper) };
                ReadPad::new(&settings, 0, Streams { gripper, trial: 1, channel: "force_left" })
            };
            (0..40).map(of).collect()
        };
        let thresholds: Vec<f64> = pads(true).iter().filter_map(|pad| pad.pad.part.threshold).collect();
        assert!(thresholds.iter().any(|t| *t < 0.12) && thresholds.iter().any(|t| *t > 0.2));
        assert!(pads(true).iter().all(|pad| (0.2..=1.0).contains(&pad.pad.part.full)));
        let fired = |closed_empty| {
            let reads = pads(closed_empty).into_iter().map(|mut pad| pad.read(0.0, 11.0));
            reads.filter(|read| *read > 0.01).count()
        };
        assert!(fired(false) > 10 && fired(true) == 0, "{} {}", fired(false), fired(true));
        assert_eq!(pad(&PhysicalLike::default(), 0).read(0.0, 11.0), 0.0);
        // Bending loads the pad below its threshold too, so that a light touch shows earlier, and less of it is known.
        let errors = |closed_empty| {
            let off = |mut pad: ReadPad| (pad.read(0.15, 11.0) - 0.15 * pad.pad.part.reaching).abs();
            pads(closed_empty).into_iter().map(off).sum::<f64>() / 40.0
        };
        assert!(errors(true) < 0.7 * errors(false), "{} {}", errors(true), errors(false));
    }

    #[test]
    fn unloading_reads_up_to_5_per_cent_more() {
        let mut pad = pad(&PhysicalLike { hysteresis: true, ..PhysicalLike::OFF }, 0);
        for load in [0.1, 0.2, 0.4] {
            assert!((pad.read(load, 0.0) - load).abs() < 1e-12);
        }
        assert!((pad.read(0.39, 0.0) - 0.40).abs() < 1e-12, "not yet");
        assert!((pad.read(0.2, 0.0) - 0.21).abs() < 1e-12);
        assert_eq!(pad.read(0.0, 0.0), 0.0);
    }

    #[test]
    fn a_held_load_creeps_up_by_1_per_cent_a_decade_until_released() {
        let mut pad = pad(&PhysicalLike { drift: true, ..PhysicalLike::OFF }, 0);
        let held: Vec<f64> = (0..=45).map(|_| pad.read(0.5, 0.0)).collect();
        assert!((held[0] - 0.5).abs() < 1e-12);
        // 45 samples are 0.9 s: 1 + 0.9 / 0.1 is one decade.
        let grown = 1.01_f64.powf(1.0 / PadPart::NOMINAL_EXPONENT);
        assert!((held[45] / 0.5 - grown).abs() < 1e-9);
        pad.read(0.0, 0.0);
        assert!((pad.read(0.5, 0.0) - 0.5).abs() < 1e-12);
    }
}
