//! Tests of the fit: hidden fingers recovered, through perfect sensors and through counts of real ones.

use super::*;
use palpate_lab::grasping::grasp;
use palpate_sim::gripper::{Side, TorquePoint};
use palpate_sim::objects::ObjectModel;
use palpate_sim::scene::{Accuracy, Scene};
use palpate_tactile::board::{Board, Reading, Sensor};
use palpate_tactile::calibration::{Calibration, Input, Point, Readout, Record, plan};
use palpate_tactile::electronics::{Converter, FlexStrip, ForcePad, PadPart, StripPart};
use palpate_tactile::{Sensors, SignalDefinition, Signals};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

/// A gripper whose finger the fit does not know.
fn hidden() -> GripperModel {
    let mut gripper = GripperModel::default();
    gripper.finger.bending_stiffness *= 1.27;
    gripper.finger.damping_time = 0.028;
    gripper.actuation.filling_time = 0.07;
    gripper.actuation.curve = [(0.0, 0.0), (0.2, 0.010), (0.4, 0.029), (0.6, 0.047)]
        .map(|(bar, torque)| TorquePoint { bar, torque })
        .to_vec();
    gripper
}

/// A close to 0.6 bar and back, quickly, so that the finger swings.
fn scene(gripper: &GripperModel) -> Scene {
    let mut scene = Scene { gripper: gripper.clone(), ..Scene::default() };
    scene.programme.peak_bar = 0.6;
    scene.programme.close_bar_per_tick = 0.2;
    scene.programme.release_bar_per_tick = 0.6;
    scene.programme.hold_ticks = 7;
    scene.timing.duration_s = 1.6;
    scene.timing.sample_hz = 50;
    scene
}

/// Fixed object to press against.
fn block() -> ObjectModel {
    ObjectModel::from_primitive("block", palpate_geometry::Primitive::Sphere { radius: 0.033 }, 400.0, 0.6)
}

fn clean(scene: &Scene, object: Option<&ObjectModel>) -> Signals {
    let sensors = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Parts);
    // A real gripper makes no numerical errors.
    let mut exact = scene.clone();
    exact.solver.accuracy = Accuracy::Reference;
    sensors.signals(grasp(&exact, object, 0).frames())
}

fn observed(name: &str, signals: Signals, scene: &Scene, object: Option<ObjectModel>) -> Observation {
    // The fit starts with the default finger.
    let scene = Scene { gripper: GripperModel::default(), ..scene.clone() };
    Observation { name: name.to_owned(), signals, line: Observation::line_of(&scene), scene, object }
}

fn off(fit: &FingerFit) -> f64 {
    fit.gripper.finger.bending_stiffness / hidden().finger.bending_stiffness - 1.0
}

/// Real sensors: parts, noise of two counts, whole counts.
struct Box4 {
    strips: [StripPart; 2],
    pads: [PadPart; 2],
    random: ChaCha8Rng,
}

impl Box4 {
    fn new(seed: u64) -> Self {
        let strip =
            |flat_ohm, ratio| StripPart { flat_ohm, rise_per_rad: StripPart::rise(ratio), ..StripPart::nominal() };
        let pad = |ohm: f64, exponent| PadPart {
            full: 1.0,
            gain: 1.0 / ohm,
            exponent,
            threshold: Some(PadPart::LEAST_FORCE),
            reaching: 1.0,
        };
        Self {
            strips: [strip(21e3, 2.1), strip(30e3, 2.4)],
            pads: [pad(6.5e3, 0.86), pad(5.4e3, 0.95)],
            random: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    fn count(&mut self, sensor: Sensor, kappa: f64, force: f64) -> f64 {
        let side = sensor.index() % 2;
        let input = Input::on(&Board::default(), sensor);
        let share = match sensor.is_flex() {
            true => input.divider.share_of_ohm(FlexStrip::new(self.strips[side], 50.0).ohm(kappa)),
            false => input.divider.share_of_siemens(ForcePad::new(self.pads[side], 50.0).conductance(force)),
        };
        let noise: f64 = (0..12).map(|_| self.random.random::<f64>()).sum::<f64>() - 6.0;
        Converter::DUE.counts(share, 2.0 * noise)
    }

    fn calibrate(&mut self, sensor: Sensor) -> Calibration {
        let kind = sensor.kind();
        let mut point = |stimulus: f64| {
            let (kappa, force) =
                if sensor.is_flex() { (stimulus / StripPart::ACTIVE_LENGTH, 0.0) } else { (0.0, stimulus) };
            let counts = (0..50).map(|_| self.count(sensor, kappa, force)).sum::<f64>() / 50.0;
            Point { stimulus, counts, spread: 2.0, readings: 50 }
        };
        let points = plan(kind).into_iter().map(&mut point).collect();
        let input = Input::on(&Board::default(), sensor);
        let part = sensor.channel().to_owned();
        Calibration::fit(Record { part, kind, input, points, bending: None, assumed: false, note: String::new() })
            .expect("sound")
    }

    /// Clean signals through a board's converter and its calibrations.
    fn through(&mut self, clean: &Signals) -> Signals {
        let calibrations = Sensor::PAPER.map(|sensor| (sensor, self.calibrate(sensor)));
        let readings: Vec<Reading> = (0..clean.len())
            .map(|k| {
                let row = clean.row(k);
                let value = |column: usize| f64::from(row[column]);
                let counts =
                    Sensor::PAPER.map(|s| Some(self.count(s, value(s.index() % 2), value(4 + s.index() % 2)) as f32));
                let t_s = clean.t_s[k];
                Reading { t_s, arrived_s: t_s, seq: None, counts: counts.to_vec(), line_bar: Some(1.0) }
            })
            .collect();
        Readout::new(&Board::default(), &calibrations).expect("fits").derive(&readings, None).signals
    }
}

/// Truth of each estimate, in their order.
fn truths() -> [f64; 7] {
    let GripperModel { finger, actuation, .. } = hidden();
    let torques = [0.2, 0.4, 0.6].map(|bar| actuation.torque(bar));
    let ratio = torques[2] / finger.bending_stiffness;
    [finger.bending_stiffness, finger.damping_time, actuation.filling_time, torques[0], torques[1], torques[2], ratio]
}

#[test]
fn a_hidden_finger_is_recovered_from_one_clean_close() -> Result<(), FingerFitError> {
    let truth = scene(&hidden());
    let close = observed("close", clean(&truth, None), &truth, None);
    let steps_seen = Cell::new(0.0);
    let watch = FitWatch { progress: &|steps| steps_seen.set(steps), stop: &AtomicBool::new(false) };
    let fit = fit_finger_watched(&[close], &Trust::default(), &watch)?;
    assert!(
        steps_seen.get() > 1.0 && steps_seen.get() <= f64::from(fit.steps),
        "{} of {} steps",
        steps_seen.get(),
        fit.steps
    );
    // Both fingers over all of the recording, with the reported RMS error.
    assert_eq!(fit.courses.iter().map(|c| (c.side, c.t_s.len())).collect::<Vec<_>>(), Side::BOTH.map(|s| (s, 80)));
    let off = fit.courses.iter().flat_map(|c| c.recorded.iter().zip(&c.fitted).map(|(a, b)| (a - b) * (a - b)));
    let rms = (off.sum::<f64>() / 160.0).sqrt();
    assert!((rms / fit.remainders[0].curvature_per_m - 1.0).abs() < 1e-9, "{rms} {:?}", fit.remainders);
    for (estimate, truth) in fit.estimates.iter().zip(truths()) {
        assert!((estimate.value / truth - 1.0).abs() < 0.03, "{estimate:?} instead of {truth}");
    }
    // A close alone cannot determine this well; the result shows it.
    assert!(
        fit.estimates[0].known == Certainty::Roughly && fit.estimates[6].known == Certainty::Well,
        "{:?}",
        fit.estimates
    );
    assert!(fit.remarks.iter().any(|r| r.contains("weight of the finger, 30.0 g")), "{:?}", fit.remarks);
    assert!(fit.remarks.iter().any(|r| r.contains("change both together")), "{:?}", fit.remarks);
    Ok(())
}

#[test]
fn a_close_and_a_press_through_real_sensors_recover_stiffness_within_3_per_cent() -> Result<(), FingerFitError> {
    let (free, pressed) = (scene(&hidden()), {
        let mut scene = scene(&hidden());
        scene.set_object_fixed(true);
        scene
    });
    let (close, press) = (clean(&free, None), clean(&pressed, Some(&block())));
    let (mut held, mut all) = (0, 0);
    for seed in 0..2 {
        let mut board = Box4::new(seed);
        let close = observed("close", board.through(&close), &free, None);
        let press = observed("press", board.through(&press), &pressed, Some(block()));
        let fit = fit_finger(&[close, press], &Trust { pad_gain: [0.02; 2], ..Trust::default() })?;
        println!("seed {seed}: {:+.4}, {} steps, {fit:?}", off(&fit), fit.steps);
        assert!(off(&fit).abs() < 0.03, "seed {seed}: {}", off(&fit));
        assert!(fit.estimates[0].known == Certainty::Well && fit.remarks.is_empty(), "{fit:?}");
        assert!(
            fit.remainders[0].curvature_per_m < 0.1 && fit.remainders[1].force_share.is_some_and(|share| share < 0.02)
        );
        for (estimate, truth) in fit.estimates.iter().zip(truths()) {
            all += 1;
            held += i32::from(estimate.low <= truth && truth <= estimate.high);
        }
    }
    assert!(held >= all - 2, "{held} of {all} intervals hold the truth");
    Ok(())
}

#[test]
fn a_fit_can_be_cancelled() {
    let truth = scene(&hidden());
    let close = observed("close", clean(&truth, None), &truth, None);
    let stop = AtomicBool::new(false);
    let watch = FitWatch { progress: &|steps| stop.store(steps > 0.5, Ordering::Relaxed), stop: &stop };
    assert_eq!(fit_finger_watched(&[close], &Trust::default(), &watch), Err(FingerFitError::Stopped));
}

#[test]
fn unusable_recordings_are_refused_with_the_reason() {
    let truth = scene(&hidden());
    let signals = clean(&truth, None);
    let fault = |signals: Signals| {
        let seen = observed("trial 7", signals, &truth, None);
        fit_finger(&[seen], &Trust::default()).expect_err("refused").to_string()
    };
    assert!(fit_finger(&[], &Trust::default()).is_err_and(|e| e.to_string().contains("empty closes")));
    assert!(fault(signals.clone().until(0.3)).contains("trial 7 lasts 0.300 s"));
    let unnamed = Signals { channels: ["a", "b", "c", "d", "e", "f"].map(str::to_owned).to_vec(), ..signals.clone() };
    assert!(fault(unnamed).contains("no curvature"));
    let still = Signals { values: vec![0.0; signals.values.len()], ..signals };
    assert!(fault(still).contains("hardly moves"));
}

#[test]
fn the_gap_is_measured_and_the_constant_behind_it_named() {
    // A finger that differs in its stiffness alone, and strips that are perfect.
    let mut gripper = GripperModel::default();
    gripper.actuation.curve = hidden().actuation.curve;
    let known = scene(&gripper);
    gripper.finger.bending_stiffness *= 1.2;
    let signals = clean(&scene(&gripper), None);
    let line = Observation::line_of(&known);
    let seen = Observation { name: "a close".to_owned(), signals, line, scene: known, object: None };
    let watch = FitWatch { progress: &|share| assert!((0.0..=1.0).contains(&share)), stop: &AtomicBool::new(false) };
    let gap = simulation_gap(&[seen], &Trust::default(), &watch).expect("measures");
    let names: Vec<&str> = gap.channels.iter().map(|channel| channel.name.as_str()).collect();
    assert_eq!(names, ["curvature_left", "curvature_right"]);
    for channel in &gap.channels {
        let ChannelGap { bias, rmse, lag_s, told_apart, .. } = channel;
        // A softer finger bends more.
        assert!(bias[0] > 0.5 && rmse[0] > bias[0] && rmse[1] < 0.1 * rmse[0], "{channel:?}");
        assert!(lag_s.iter().all(|lag| lag.abs() <= 0.05) && *told_apart == [None; 2], "{channel:?}");
    }
    let first = &gap.constants[0];
    assert!(first.name == "gripper.finger.bending_stiffness" && first.left < 0.01, "{:?}", gap.constants);
    assert!(gap.constants[3].left > 0.2, "others do not replace it: {:?}", gap.constants);
}
