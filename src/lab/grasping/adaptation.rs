//! Adapting to a real gripper without labels: calibrations of its parts from one close of its empty hand. Recognisers
//! for any gripper were trained on readings that are calibrated in this way.

use super::run::grasp;
use palpate_sim::gripper::Phase;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_store::labels::{ADAPTING, TrialEdit};
use palpate_store::{Store, StoreError};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::{Calibration, CalibrationFault, EmptyHand, KnownWeight, Readout, SensorKind};
use palpate_tactile::trial::{BoardLog, TrialId};
use palpate_tactile::{Sensors, SignalDefinition};

/// Largest relative difference between a strip that was calibrated by hand and the bend of the modelled finger.
const AGREES: f64 = 0.1;
/// Least difference of the line pressure from that of the programme that is taken into account (bar).
const OTHER_BAR: f64 = 0.02;

/// Share of its bend by which a finger of an empty hand may be ahead of the modelled one while it closes, and behind it.
/// Tuned on 400 emulated hands: empty ones, also of other builds, are ahead by 0.04 and behind by 0.15 at most. Objects of
/// 20 mm and more make it 0.1 to 0.28; of thinner ones (syringe, small button) few are found. Larger lets thin objects pass,
/// smaller refuses soft or stiff fingers.
const MOST_EARLY: f64 = 0.07;
const MOST_LATE: f64 = 0.25;
/// Readings that may be disturbed.
const DISTURBED: usize = 4;

/// How a sensor was adapted.
#[derive(Clone, Debug, PartialEq)]
pub enum AdaptedSensor {
    /// Not adapted: its part keeps the calibration made by hand.
    Kept(Calibration),
    /// Calibrated from the empty close.
    Adapted(Calibration),
    /// It could not be calibrated.
    Failed(CalibrationFault),
}

impl AdaptedSensor {
    /// The calibration that serves from now on.
    pub fn calibration(&self) -> Option<&Calibration> {
        match self {
            Self::Kept(calibration) | Self::Adapted(calibration) => Some(calibration),
            Self::Failed(_) => None,
        }
    }
}

/// Calibrations of a gripper from a close of its empty hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Adaptation {
    /// Each strip and pad, in the order of the gripper's sensors.
    pub sensors: Vec<(Sensor, AdaptedSensor)>,
    /// Line pressure at the end of the closing (bar).
    pub bar: f64,
    /// Curvature of the modelled finger at that pressure (1/m), which was assumed.
    pub modelled: f64,
    /// Doubts, in sentences.
    pub warnings: Vec<String>,
}

/// Error of adapting to a gripper.
#[derive(Debug, thiserror::Error)]
pub enum AdaptError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Not a trial of a real gripper's empty hand.
    #[error("{0}")]
    Refused(String),
    /// The fingers did not close as empty ones do.
    #[error(
        "something is in the hand: the {finger} finger {how}. Take it out and close again. If the hand was empty, its fingers \
         bend otherwise than the modelled ones: {restore}`palpate fit {id} --out fitted.toml`, then `palpate adapt --trial {id} \
         --scene fitted.toml`",
        restore = if *deleted { format!("`palpate trials restore {id}`, ") } else { String::new() }
    )]
    Held {
        /// The trial.
        id: TrialId,
        /// Which finger.
        finger: &'static str,
        /// What it did.
        how: &'static str,
        /// The trial was deleted, because the hand was not empty.
        deleted: bool,
    },
}

/// Name of a part without a given name.
fn unnamed(sensor: Sensor) -> String {
    format!("unnamed {}", sensor.label())
}

impl Adaptation {
    /// Adapts to a gripper by a stored trial of its empty hand. `scene` holds the modelled gripper and the programme of
    /// the closing, `weights` what the pads read under known weights. Parts that were calibrated by hand keep their
    /// calibration, unless `replace`.
    pub fn from_trial(
        store: &Store,
        id: TrialId,
        scene: &Scene,
        weights: &[(Sensor, KnownWeight)],
        replace: bool,
    ) -> Result<Self, AdaptError> {
        let Some(log) = store.board_log(id)? else {
            // Loading returns the reason where there is no such trial.
            store.load(id)?;
            let cause = format!("trial {id} is not of a real gripper: adapt reads counts of its board");
            return Err(AdaptError::Refused(cause));
        };
        let object = store.list(false)?.into_iter().find(|row| row.id == id).map(|row| row.object).unwrap_or_default();
        if !object.is_empty() && object != EMPTY {
            return Err(AdaptError::Refused(format!(
                "trial {id} is of \"{object}\": adapt needs a close of the empty hand, which touches nothing"
            )));
        }
        if let Some((finger, how)) = held(&log, scene) {
            return Err(AdaptError::Held { id, finger, how, deleted: false });
        }
        let mut parts = Vec::new();
        for sensor in log.course.board.sensors.iter() {
            parts.extend(store.calibrations().part_in(sensor)?.map(|part| (sensor, part)));
        }
        let serving = store.calibrations().serving(None, &[])?;
        let measured = serving.calibrations.into_iter().filter(|(_, own)| !own.record.assumed && !replace);
        let mut adapted = Self::new(&log, scene, &parts, &measured.collect::<Vec<_>>(), weights);
        if !is_driven(&log) {
            adapted.warnings.push(format!(
                "Whether the hand was empty in trial {id} was not checked: only a close that the board drives is"
            ));
        }
        Ok(adapted)
    }

    /// Adapts by readings that are not stored, of parts without names.
    pub fn of_log(log: &BoardLog, scene: &Scene) -> Self {
        Self::new(log, scene, &[], &[], &[])
    }

    /// Adapts by a trial that was recorded for this purpose, and tags it so. Deletes the trial if something was in the hand, or if
    /// it leaves a sensor without calibration, as where the fingers did not close.
    pub fn from_close(
        store: &mut Store,
        id: TrialId,
        scene: &Scene,
        weights: &[(Sensor, KnownWeight)],
        replace: bool,
    ) -> Result<Self, AdaptError> {
        let mut adapted = Self::from_trial(store, id, scene, weights, replace);
        let edit = match &mut adapted {
            Ok(adaptation) if adaptation.is_complete() => TrialEdit::Tag(vec![ADAPTING.to_owned()]),
            Ok(adaptation) => {
                adaptation
                    .warnings
                    .push(format!("Trial {id} was discarded; `palpate trials restore {id}` brings it back"));
                TrialEdit::Discard
            }
            Err(AdaptError::Held { deleted, .. }) => {
                *deleted = true;
                TrialEdit::Discard
            }
            Err(AdaptError::Store(_) | AdaptError::Refused(_)) => return adapted,
        };
        store.labels().edit(&[id], &edit)?;
        adapted
    }

    fn new(
        log: &BoardLog,
        scene: &Scene,
        parts: &[(Sensor, String)],
        measured: &[(Sensor, Calibration)],
        weights: &[(Sensor, KnownWeight)],
    ) -> Self {
        let scene = as_driven(log, scene);
        let modelled = most(&modelled_close(&scene));
        let hand = closed_hand(log, modelled);
        let name = |sensor: Sensor| {
            parts.iter().find(|(own, _)| *own == sensor).map_or_else(|| unnamed(sensor), |(_, part)| part.clone())
        };
        let kept = |sensor: Sensor| measured.iter().find(|(own, _)| *own == sensor).map(|(_, own)| own.clone());
        let adapted = |outcome: Result<Calibration, CalibrationFault>| {
            outcome.map_or_else(AdaptedSensor::Failed, AdaptedSensor::Adapted)
        };
        let list = log.course.board.sensors;
        let strips: Vec<(Sensor, AdaptedSensor)> = list
            .of_kind(SensorKind::Flex)
            .map(|sensor| {
                let strip = || adapted(hand.strip(sensor, &name(sensor)));
                (sensor, kept(sensor).map_or_else(strip, AdaptedSensor::Kept))
            })
            .collect();
        let pad = |sensor: Sensor| {
            let weight = weights.iter().find(|(own, _)| *own == sensor).map(|(_, weight)| *weight);
            let under = sensor.strip();
            let strip = under.and_then(|under| strips.iter().find(|(own, _)| *own == under)?.1.calibration());
            let pad = || match strip {
                Some(strip) => adapted(hand.pad(sensor, &name(sensor), strip, weight)),
                None => {
                    let missing = under.map_or_else(|| format!("{} flex strip", sensor.finger()), Sensor::label);
                    AdaptedSensor::Failed(CalibrationFault::no_strip(&missing))
                }
            };
            (sensor, kept(sensor).filter(|_| weight.is_none()).map_or_else(pad, AdaptedSensor::Kept))
        };
        let pads: Vec<(Sensor, AdaptedSensor)> = list.of_kind(SensorKind::Pad).map(pad).collect();
        let warnings = strips.iter().filter_map(|(sensor, strip)| disagrees(strip, *sensor, &hand)).collect();
        let mut sensors = [strips, pads].concat();
        sensors.sort_by_key(|(sensor, _)| sensor.index());
        Self { sensors, bar: scene.programme.peak_bar, modelled, warnings }
    }

    /// Stores the new calibrations as the newest of their parts, and mounts the parts.
    pub fn keep(&self, store: &Store) -> Result<(), StoreError> {
        for (sensor, adapted) in &self.sensors {
            let AdaptedSensor::Adapted(calibration) = adapted else { continue };
            let stored = store.calibrations().add(&calibration.record)?;
            if store.calibrations().part_in(*sensor)?.as_ref() != Some(&stored.record.part) {
                store.calibrations().mount(*sensor, &stored.record.part)?;
            }
        }
        Ok(())
    }

    /// True where every sensor has a calibration.
    pub fn is_complete(&self) -> bool {
        self.sensors.iter().all(|(_, sensor)| sensor.calibration().is_some())
    }
}

/// The scene with the pressure that the board reports.
fn as_driven(log: &BoardLog, scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let reported = log.readings.iter().filter_map(|reading| reading.line_bar).fold(0.0, f64::max);
    if reported > 0.0 && (reported - scene.programme.peak_bar).abs() > OTHER_BAR {
        scene.programme.peak_bar = reported;
    }
    scene
}

fn closed_hand(log: &BoardLog, modelled: f64) -> EmptyHand<'_> {
    let closing_s = log.course.phases.iter().find(|mark| mark.phase == Phase::Close).map(|mark| mark.from_s);
    EmptyHand { board: &log.course.board, readings: &log.readings, closing_s, modelled }
}

/// Mean curvature of the modelled fingers during an empty close: time (s) and curvature (1/m).
fn modelled_close(scene: &Scene) -> Vec<(f64, f64)> {
    let mut scene = scene.clone();
    EMPTY.clone_into(&mut scene.object.source);
    let trial = grasp(&scene, None, 0);
    let signals = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Parts).signals(trial.frames());
    let columns: Vec<usize> =
        (0..signals.channels.len()).filter(|k| signals.channels[*k].starts_with("curvature")).collect();
    let mean = |k: usize| columns.iter().map(|column| f64::from(signals.row(k)[*column])).sum::<f64>();
    (0..signals.len()).map(|k| (signals.t_s[k], mean(k) / columns.len().max(1) as f64)).collect()
}

/// Largest curvature (1/m).
fn most(course: &[(f64, f64)]) -> f64 {
    course.iter().map(|(_, kappa)| *kappa).fold(0.0, f64::max)
}

/// The finger that an object stopped during a driven close, and the evidence. Against an object a finger bends as in
/// the empty hand until it touches, and then hardly: it reaches its final bend early, or late if the object slips out.
/// Only the strips are used: pads also respond when fingers only bend or press on each other. A close by hand follows
/// no programme and is not checked.
fn held(log: &BoardLog, scene: &Scene) -> Option<(&'static str, &'static str)> {
    if !is_driven(log) {
        return None;
    }
    let scene = as_driven(log, scene);
    let model = modelled_close(&scene);
    let most = most(&model);
    let closed_s = f64::from(scene.programme.close_ticks()) / f64::from(scene.timing.actuation_hz.max(1));
    let judged = |strip: Sensor| {
        let course = closed_hand(log, most).course(strip);
        let closing = course.iter().filter(|(t_s, _)| *t_s < closed_s);
        let mut ahead: Vec<f64> = closing.map(|(t_s, share)| share - at(&model, *t_s) / most).collect();
        ahead.sort_by(f64::total_cmp);
        let (late, early) = (ahead.get(DISTURBED)?, ahead.get(ahead.len().checked_sub(DISTURBED + 1)?)?);
        if *early > MOST_EARLY {
            Some((strip.finger(), "stops bending early"))
        } else if -*late > MOST_LATE {
            Some((strip.finger(), "is held up and bends late"))
        } else {
            None
        }
    };
    log.course.board.sensors.of_kind(SensorKind::Flex).find_map(judged)
}

/// True for a close by the programme, whose pressure the board sets.
fn is_driven(log: &BoardLog) -> bool {
    log.course.phases.first().is_some_and(|phase| phase.line_bar.is_some())
}

/// Value of a curve over time at a time (s).
fn at(course: &[(f64, f64)], t_s: f64) -> f64 {
    let after = course.partition_point(|(own_s, _)| *own_s < t_s);
    match (after.checked_sub(1).and_then(|before| course.get(before)), course.get(after)) {
        (Some((a_s, a)), Some((b_s, b))) => a + (b - a) * ((t_s - a_s) / (b_s - a_s).max(f64::EPSILON)),
        (None, Some((_, only))) | (Some((_, only)), None) => *only,
        (None, None) => 0.0,
    }
}

/// Doubt about a strip that was calibrated by hand.
fn disagrees(strip: &AdaptedSensor, sensor: Sensor, hand: &EmptyHand<'_>) -> Option<String> {
    let AdaptedSensor::Kept(calibration) = strip else { return None };
    let readout = Readout::new(hand.board, &[(sensor, calibration.clone())]).ok()?;
    let curvature = readout.channels().into_iter().find(|channel| sensor.gives(channel))?;
    let read = hand.readings.iter().filter_map(|reading| readout.estimate(reading).of(&curvature));
    let most = read.fold(0.0, f64::max);
    ((most / hand.modelled - 1.0).abs() > AGREES).then(|| {
        format!(
            "the {} reads {most:.1} 1/m where the modelled finger bends to {:.1}: `palpate fit` estimates this finger, \
             --replace calibrates the strip by it",
            sensor.label(),
            hand.modelled
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasping::{GraspController, GraspPlan};
    use palpate_device::emulator::{EmulatedGripper, EmulatorSetup, HandPlan, HiddenParts};
    use palpate_device::protocol::{BoardEvent, Decoder};
    use palpate_tactile::board::SensorList;
    use palpate_tactile::trial::{BoardCourse, Control};

    #[test]
    fn the_modelled_finger_bends_more_at_more_pressure() {
        let mut scene = Scene::default();
        let full = most(&modelled_close(&scene));
        scene.programme.peak_bar = 0.6;
        let less = most(&modelled_close(&scene));
        assert!((11.0..13.0).contains(&full) && less < 0.8 * full, "{full} {less}");
    }

    /// What an emulated hand with this object prints while it is driven.
    fn closed(object: &str, seed: u64, build: f64) -> BoardLog {
        let mut scene = Scene::default();
        scene.pose.build = build;
        let hand = HandPlan {
            sensors: SensorList::default(),
            scene: scene.clone(),
            objects: vec![object.to_owned()],
            seed,
            grasp_every_s: None,
            script: Vec::new(),
        };
        let setup = EmulatorSetup {
            hand,
            parts: HiddenParts::drawn(seed),
            rate_hz: 50,
            channels: 4,
            most_steps: 30,
            clock_start_us: 0,
            faults: Vec::new(),
            seed,
        };
        let mut gripper = EmulatedGripper::new(setup).expect("a built-in object");
        let mut controller = GraspController::new(GraspPlan::recorded(&scene, Control::Driven), 0.0);
        let (mut decoder, mut events, mut phases) = (Decoder::default(), Vec::new(), Vec::new());
        for k in 1..=600u32 {
            let now_s = 0.01 * f64::from(k);
            gripper.advance(now_s);
            decoder.push(&gripper.take_bytes(), now_s, &mut events);
            if let Some(command) = controller.command(now_s) {
                gripper.hear(format!("P {:.2}\n", command.bar).as_bytes());
                phases.push(controller.mark(&command));
            }
        }
        let course = BoardCourse { board: decoder.board(), phases, ..BoardCourse::default() };
        BoardLog {
            course,
            readings: events.into_iter().filter_map(BoardEvent::into_reading).collect(),
            gaps: Vec::new(),
        }
    }

    #[test]
    fn an_empty_hand_is_told_from_one_that_holds_something() {
        let scene = Scene::default();
        for seed in 1..=24 {
            // Every other one is of another build than the modelled gripper.
            let found = held(&closed(EMPTY, seed, f64::from(seed as u32 % 2)), &scene);
            assert_eq!(found, None, "seed {seed}");
        }
        let names =
            "ball bigball box button case cube cylinder labello lemon metalbrick parallelepiped smallcube tomato jenga";
        for (name, seed) in names.split(' ').zip(1..) {
            assert!(held(&closed(name, seed, 0.0), &scene).is_some(), "{name}");
        }
        // It slips out on the way.
        assert_eq!(held(&closed("case", 2, 0.0), &scene).map(|(_, how)| how), Some("is held up and bends late"));
        // By hand nobody knows the pressure.
        let mut by_hand = closed("ball", 1, 0.0);
        by_hand.course.phases.iter_mut().for_each(|mark| mark.line_bar = None);
        assert_eq!(held(&by_hand, &scene), None);
    }
}
