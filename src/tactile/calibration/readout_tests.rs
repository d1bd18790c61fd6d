//! Tests of the whole chain: known parts forward through input, noise and rounding, then calibrated and read back.

use super::*;
use crate::board::{Board, Reading, Sensor};
use crate::electronics::{PadPart, StripPart};
use crate::{SensorLayout, Sensors, SignalDefinition};
use palpate_sim::gripper::Side;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Parts whose values the calibration does not know.
struct Parts {
    flat_ohm: [f64; 2],
    bent_over_flat: [f64; 2],
    ohm_at_1_n: [f64; 2],
    exponent: [f64; 2],
    /// Load that bending puts on both pads, per curvature (N m).
    bending: f64,
    /// Deviation of the noise (counts).
    noise: f64,
    random: ChaCha8Rng,
}

impl Parts {
    fn new(seed: u64) -> Self {
        Self {
            flat_ohm: [19.3e3, 31.0e3],
            bent_over_flat: [2.05, 2.45],
            ohm_at_1_n: [6.3e3, 5.2e3],
            exponent: [0.83, 0.97],
            bending: 0.0,
            noise: 2.0,
            random: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// A reading of two angles (degrees) and two forces (N).
    fn read(&mut self, t_s: f64, degrees: [f64; 2], force: [f64; 2]) -> Reading {
        let board = Board::default();
        let mut counts = Vec::new();
        for (i, sensor) in Sensor::PAPER.into_iter().enumerate() {
            let side = i % 2;
            let siemens = if sensor.is_flex() {
                1.0 / (self.flat_ohm[side] * (1.0 + (self.bent_over_flat[side] - 1.0) * degrees[side] / 90.0))
            } else {
                let kappa = degrees[side].to_radians() / StripPart::ACTIVE_LENGTH;
                let load = force[side] + self.bending * kappa;
                let pressed = if load < 0.15 { 0.0 } else { load.powf(self.exponent[side]) };
                pressed / self.ohm_at_1_n[side]
            };
            // Sums of twelve even numbers are nearly normal.
            let noise: f64 = (0..12).map(|_| self.random.random::<f64>()).sum::<f64>() - 6.0;
            let exact = Input::on(&board, sensor).counts(1.0 / siemens) + self.noise * noise;
            counts.push(Some(exact.floor().clamp(0.0, 4095.0) as f32));
        }
        Reading { t_s, arrived_s: t_s, seq: None, counts, line_bar: None }
    }

    /// Goes through the usual procedure.
    fn calibrate(&mut self, sensor: Sensor) -> Calibration {
        let mut procedure = Procedure::new(sensor, sensor.channel(), None);
        let mut now = 0.0;
        while let Some(stimulus) = procedure.next() {
            while procedure.settled().is_err() {
                let at =
                    if sensor.is_flex() { ([stimulus.to_degrees(); 2], [0.0; 2]) } else { ([0.0; 2], [stimulus; 2]) };
                procedure.feed(&self.read(now, at.0, at.1));
                now += 0.02;
            }
            procedure.take(stimulus).unwrap();
        }
        procedure.fit().unwrap()
    }

    fn readout(&mut self) -> Readout {
        let calibrations = Sensor::PAPER.map(|sensor| (sensor, self.calibrate(sensor)));
        Readout::new(&Board::default(), &calibrations).unwrap()
    }
}

#[test]
fn a_calibration_recovers_angle_within_a_degree_and_force_within_5_per_cent() {
    for seed in 0..6 {
        let mut parts = Parts::new(seed);
        let readout = parts.readout();
        let pressures = &readout.channels()[2..4];
        for step in 0..=60 {
            let share = f64::from(step) / 60.0;
            let (degrees, force) = (90.0 * share, 0.3 + 4.6 * share);
            // Readings of a finger at rest during half a second.
            let mut mean = [0.0; 4];
            for _ in 0..25 {
                let estimate = readout.estimate(&parts.read(0.0, [degrees; 2], [force; 2]));
                for side in 0..2 {
                    mean[side] += estimate.value(Sensor::PAPER[side]).unwrap().to_degrees() / 25.0;
                    mean[2 + side] += estimate.value(Sensor::PAPER[2 + side]).unwrap() / 25.0;
                    let pressure = estimate.of(&pressures[side]).unwrap();
                    assert!(
                        (pressure * PadPart::ACTIVE_AREA / estimate.value(Sensor::PAPER[2 + side]).unwrap() - 1.0)
                            .abs()
                            < 1e-12
                    );
                    // Each reading for itself, too.
                    assert!(
                        (estimate.value(Sensor::PAPER[2 + side]).unwrap() / force - 1.0).abs() < 0.05,
                        "seed {seed}: {force} N"
                    );
                }
            }
            for side in 0..2 {
                assert!((mean[side] - degrees).abs() < 0.5, "seed {seed}: {} of {degrees} degrees", mean[side]);
                assert!((mean[2 + side] / force - 1.0).abs() < 0.02, "seed {seed}: {} of {force} N", mean[2 + side]);
            }
        }
    }
}

#[test]
fn a_bent_finger_reads_no_force_once_its_zero_is_known() {
    let mut parts = Parts::new(1);
    parts.bending = 0.02;
    let plain = parts.readout();
    let close: Vec<Reading> =
        (0..400).map(|i| parts.read(0.02 * f64::from(i), [0.15 * f64::from(i); 2], [0.0; 2])).collect();
    let mut calibrations = Sensor::PAPER.map(|sensor| (sensor, parts.calibrate(sensor)));
    for side in Side::BOTH {
        let (_, calibration) = &mut calibrations[2 + side.index()];
        let mut record = calibration.record.clone();
        record.bending =
            Some(BendingZero::from_empty_close(&plain.bending(Sensor::PAPER[2 + side.index()], &close)).unwrap());
        *calibration = Calibration::fit(record).unwrap();
    }
    let zeroed = Readout::new(&Board::default(), &calibrations).unwrap();
    for degrees in [10.0, 30.0, 50.0] {
        let estimate = |readout: &Readout, reading: &Reading| {
            [Sensor::PAD_LEFT, Sensor::PAD_RIGHT].map(|pad| readout.estimate(reading).value(pad).unwrap())
        };
        let empty = parts.read(0.0, [degrees; 2], [0.0; 2]);
        let nothing = estimate(&zeroed, &empty);
        assert!(nothing.iter().all(|force| *force < 0.03), "{degrees} degrees: {nothing:?}");
        let held = parts.read(0.0, [degrees; 2], [1.0; 2]);
        assert!(
            estimate(&zeroed, &held).iter().all(|force| (force - 1.0).abs() < 0.05),
            "{:?}",
            estimate(&zeroed, &held)
        );
        assert!(degrees < 50.0 || estimate(&plain, &empty).iter().all(|force| *force > 0.15));
    }
}

#[test]
fn a_trial_has_the_channels_of_the_layout_and_its_own_zero() {
    let mut parts = Parts::new(2);
    let readout = parts.readout();
    // Both strips rest at 4 degrees; half a second at rest, then a close with a touch.
    let mut readings = Vec::new();
    for i in 0..150 {
        let t = 0.02 * f64::from(i);
        let close = (t - 0.5).max(0.0);
        let mut reading = parts.read(t, [4.0 + 20.0 * close; 2], [if close > 1.5 { 2.0 } else { 0.0 }; 2]);
        reading.line_bar = Some(0.5 * close);
        readings.push(reading);
    }
    let derived = readout.derive(&readings, None);
    let gripper = palpate_sim::gripper::GripperModel::default();
    let layout = SensorLayout::named("C1+F").unwrap();
    let names: Vec<String> =
        Sensors::new(&layout, &gripper, SignalDefinition::Parts).unwrap().channels().iter().map(|c| c.name()).collect();
    assert_eq!(derived.signals.channels, names, "what recognisers take");
    assert_eq!((derived.signals.len(), derived.left_out), (150, 0));
    let last = derived.signals.row(149);
    for side in 0..2 {
        let kappa = (20.0 * 2.48f64).to_radians() / StripPart::ACTIVE_LENGTH;
        assert!((f64::from(last[side]) - kappa).abs() < 0.3, "{} of {kappa}", last[side]);
        assert!(
            (last[2 + side] / 2.0 * PadPart::ACTIVE_AREA as f32 - 1.0).abs() < 0.05
                && (last[4 + side] / 2.0 - 1.0).abs() < 0.05
        );
    }
    let levels: Vec<DriftLevel> = derived.drift.iter().map(|drift| drift.level).collect();
    assert_eq!(levels, [DriftLevel::Moved, DriftLevel::Moved, DriftLevel::Steady, DriftLevel::Steady]);
    assert!(
        derived.warnings.iter().all(|w| w.contains("corrected")) && derived.warnings.len() == 2,
        "{:?}",
        derived.warnings
    );
}

#[test]
fn a_zero_that_is_no_drift_is_not_corrected() {
    let mut parts = Parts::new(3);
    let readout = parts.readout();
    let bent: Vec<Reading> = (0..100).map(|i| parts.read(0.02 * f64::from(i), [30.0; 2], [2.0, 0.0])).collect();
    let derived = readout.derive(&bent, None);
    let levels: Vec<DriftLevel> = derived.drift.iter().map(|drift| drift.level).collect();
    assert_eq!(levels, [DriftLevel::TooFar, DriftLevel::TooFar, DriftLevel::TooFar, DriftLevel::Steady]);
    assert!(derived.warnings.iter().any(|w| w.contains("left pad") && w.contains("not corrected")));
    let row = derived.signals.row(50);
    assert!(
        (f64::from(row[0]) * StripPart::ACTIVE_LENGTH - 30f64.to_radians()).abs() < 0.02 && (row[4] - 2.0).abs() < 0.1
    );
}

#[test]
fn missing_channels_are_left_out_and_never_invented() {
    let mut parts = Parts::new(4);
    let readout = parts.readout();
    let mut readings: Vec<Reading> = (0..100).map(|i| parts.read(0.02 * f64::from(i), [20.0; 2], [1.0; 2])).collect();
    // A number missing here and there, a strip that breaks for good, and a clock that jumps back.
    readings[20].counts[2] = None;
    readings[30].t_s = readings[28].t_s;
    for reading in &mut readings[40..] {
        reading.counts[1] = Some(4095.0);
    }
    let derived = readout.derive(&readings, None);
    assert!(!derived.signals.channels.contains(&"curvature_right".to_owned()));
    assert_eq!((derived.signals.channels.len(), derived.signals.len(), derived.left_out), (5, 98, 2));
    assert!(derived.signals.values.iter().all(|value| value.is_finite()));
    assert!(
        derived.warnings.iter().any(|w| w.contains("curvature_right is left out: 60 of 100")),
        "{:?}",
        derived.warnings
    );
    assert_eq!(readout.derive(&[], None), Derived { warnings: vec![], ..Derived::default() });
}

#[test]
fn missing_channels_and_calibrations_give_warnings() {
    let mut parts = Parts::new(5);
    let only = [(Sensor::FLEX_LEFT, parts.calibrate(Sensor::FLEX_LEFT))];
    let board = Board { channels: vec!["flexL".into(), "fsrL".into()], divider_ohm: vec![33e3], ..Board::default() };
    let readout = Readout::new(&board, &only).unwrap();
    let warnings = readout.warnings().join("\n");
    assert!(warnings.contains("no channel \"flexR\""), "{warnings}");
    assert!(warnings.contains("calibrated beside 47.0 kΩ, but the board reports 33.0"), "{warnings}");
    let wrong = [(Sensor::PAD_LEFT, only[0].1.clone())];
    let text = Readout::new(&board, &wrong).expect_err("a strip is no pad").to_string();
    assert!(text.contains("flexL") && text.contains("left pad"), "{text}");
}

#[test]
fn a_record_survives_a_file_and_is_fitted_anew() {
    let calibration = Parts::new(6).calibrate(Sensor::PAD_LEFT);
    let text = serde_json::to_string(&calibration).unwrap();
    assert!(text.contains("exponent") && text.contains("\"part\":\"fsrL\""));
    let record: Record = serde_json::from_str(&text).unwrap();
    assert_eq!(Calibration::fit(record).unwrap(), calibration);
}

#[test]
fn a_tare_wants_an_open_hand_at_rest() {
    let mut parts = Parts::new(1);
    let readout = parts.readout();
    let mut rest = |degrees: &dyn Fn(f64) -> [f64; 2]| -> Vec<Reading> {
        (0..50).map(|k| 0.02 * f64::from(k)).map(|t| parts.read(t, degrees(t), [0.0; 2])).collect()
    };
    let steady = rest(&|_| [5.0, -0.2]);
    let zero = readout.tare(&steady).unwrap();
    assert!((zero.offsets[0].unwrap().to_degrees() - 5.0).abs() < 0.5 && zero.offsets[3].is_some(), "{zero:?}");
    let levels: Vec<&str> = readout.drift(&zero).iter().map(Drift::badge).collect();
    assert_eq!(levels, ["moved", "steady", "steady", "steady"]);
    // Subtracted, it is straight.
    let estimate = readout.clone().with_zero(zero).estimate(&steady[7]);
    assert!(estimate.value(Sensor::FLEX_LEFT).unwrap().to_degrees().abs() < 1.0, "{estimate:?}");
    assert_eq!(readout.tare(&rest(&|_| [30.0, 0.0])).unwrap().offsets[0], None, "a bent finger is no drift");
    assert_eq!(readout.tare(&rest(&|t| [6.0 * t, 0.0])), Err(Unrest::Moving { sensor: Sensor::FLEX_LEFT }));
    assert_eq!(readout.tare(&steady[..5]), Err(Unrest::TooFew { have: 5 }));
    let pressed = Reading { line_bar: Some(0.5), ..steady[0].clone() };
    assert_eq!(readout.tare(&[&steady[..], &[pressed]].concat()), Err(Unrest::Pressed { bar: 0.5 }));
}

#[test]
fn estimates_outside_the_calibrated_range_give_warnings() {
    let mut parts = Parts::new(6);
    let readout = parts.readout();
    let mut beyond = |degrees, force| {
        let estimate = readout.estimate(&parts.read(0.0, degrees, force));
        readout.beyond(&estimate)
    };
    assert_eq!(beyond([90.0, 0.0], [4.9, 0.0]), []);
    assert_eq!(beyond([100.0, -9.0], [0.0, 6.5]), [Sensor::FLEX_LEFT, Sensor::FLEX_RIGHT, Sensor::PAD_RIGHT]);
    let mut readings: Vec<Reading> = (0..50).map(|i| parts.read(0.02 * f64::from(i), [0.0; 2], [0.0; 2])).collect();
    readings.extend((50..60).map(|i| parts.read(0.02 * f64::from(i), [30.0; 2], [0.0, 7.0])));
    let warnings = readout.derive(&readings, Some(0.9)).warnings;
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(
        warnings[0].contains("right pad was outside") && warnings[0].contains("0.500 kg, in 10 of 60"),
        "{warnings:?}"
    );
}
