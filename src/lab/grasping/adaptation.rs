//! Adapting to a real gripper without labels: calibrations of its parts from one close of its empty hand. Afterwards its
//! readings are those that a recogniser for any gripper has learned.

use super::run::grasp;
use palpate_sim::gripper::Side;
use palpate_sim::objects::EMPTY;
use palpate_sim::scene::Scene;
use palpate_store::{Store, StoreError};
use palpate_tactile::board::Sensor;
use palpate_tactile::calibration::{Calibration, CalibrationFault, EmptyHand, KnownWeight, Readout, SensorKind};
use palpate_tactile::trial::{BoardLog, TrialId};
use palpate_tactile::{Sensors, SignalDefinition};

/// Largest share by which a strip that was calibrated by hand may read otherwise than the modelled finger bends.
const AGREES: f64 = 0.1;
/// Least difference of the line pressure from that of the programme that is taken into account (bar).
const OTHER_BAR: f64 = 0.02;

/// How a sensor was adapted.
#[derive(Clone, Debug, PartialEq)]
pub enum AdaptedSensor {
    /// Its part was calibrated by hand before, and stays so.
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
    /// Each sensor, in the order of [`Sensor::ALL`].
    pub sensors: [AdaptedSensor; 4],
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
    /// Not a trial of a real gripper.
    #[error("trial {id} is not of a real gripper: adapt reads counts of its board")]
    NotRecorded {
        /// The trial.
        id: TrialId,
    },
    /// A trial of a hand that holds something.
    #[error("trial {id} is of \"{object}\": adapt needs a close of the empty hand, which touches nothing")]
    NotEmpty {
        /// The trial.
        id: TrialId,
        /// Its label.
        object: String,
    },
}

/// Name of a part that nobody has named.
fn unnamed(sensor: Sensor) -> String {
    format!("unnamed {}", sensor.label())
}

impl Adaptation {
    /// Adapts to a gripper by a stored trial of its empty hand. `scene` holds the modelled gripper and the programme of the
    /// closing, `weights` what the pads read under known weights. Parts that were calibrated by hand stay so, unless
    /// `replace`.
    pub fn from_trial(
        store: &Store,
        id: TrialId,
        scene: &Scene,
        weights: [Option<KnownWeight>; 2],
        replace: bool,
    ) -> Result<Self, AdaptError> {
        let Some(log) = store.board_log(id)? else {
            // Loading returns the reason where there is no such trial.
            store.load(id)?;
            return Err(AdaptError::NotRecorded { id });
        };
        let object = store.list(false)?.into_iter().find(|row| row.id == id).map(|row| row.object).unwrap_or_default();
        if !object.is_empty() && object != EMPTY {
            return Err(AdaptError::NotEmpty { id, object });
        }
        let parts = store.calibrations().mounted()?;
        let serving = store.calibrations().serving(None, &[])?;
        let measured = serving.calibrations.into_iter().filter(|(_, own)| !own.record.assumed && !replace);
        Ok(Self::new(&log, scene, &parts, &measured.collect::<Vec<_>>(), weights))
    }

    /// The same by readings that are not stored, of parts without names.
    pub fn of_log(log: &BoardLog, scene: &Scene) -> Self {
        Self::new(log, scene, &[const { None }; 4], &[], [None; 2])
    }

    fn new(
        log: &BoardLog,
        scene: &Scene,
        parts: &[Option<String>; 4],
        measured: &[(Sensor, Calibration)],
        weights: [Option<KnownWeight>; 2],
    ) -> Self {
        let mut scene = scene.clone();
        let reported = log.readings.iter().filter_map(|reading| reading.line_bar).fold(0.0, f64::max);
        if reported > 0.0 && (reported - scene.programme.peak_bar).abs() > OTHER_BAR {
            scene.programme.peak_bar = reported;
        }
        let modelled = closed_curvature(&scene);
        let closing = log.course.phases.iter().find(|mark| mark.phase == palpate_sim::gripper::Phase::Close);
        let hand = EmptyHand {
            board: &log.course.board,
            readings: &log.readings,
            closing_s: closing.map(|mark| mark.from_s),
            modelled,
        };
        let name = |sensor: Sensor| parts[sensor as usize].clone().unwrap_or_else(|| unnamed(sensor));
        let kept = |sensor: Sensor| measured.iter().find(|(own, _)| *own == sensor).map(|(_, own)| own.clone());
        let adapted = |outcome: Result<Calibration, CalibrationFault>| {
            outcome.map_or_else(AdaptedSensor::Failed, AdaptedSensor::Adapted)
        };
        let strips = Side::BOTH.map(|side| {
            let sensor = SensorKind::Flex.on(side);
            kept(sensor).map_or_else(|| adapted(hand.strip(side, &name(sensor))), AdaptedSensor::Kept)
        });
        let pads = Side::BOTH.map(|side| {
            let (sensor, weight) = (SensorKind::Pad.on(side), weights[side.index()]);
            let strip = strips[side.index()].calibration();
            let pad = || match strip {
                Some(strip) => adapted(hand.pad(side, &name(sensor), strip, weight)),
                None => AdaptedSensor::Failed(CalibrationFault::NoStrip { strip: SensorKind::Flex.on(side).label() }),
            };
            kept(sensor).filter(|_| weight.is_none()).map_or_else(pad, AdaptedSensor::Kept)
        });
        let warnings =
            strips.iter().zip(Side::BOTH).filter_map(|(strip, side)| disagrees(strip, side, &hand)).collect();
        let ([left, right], [left_pad, right_pad]) = (strips, pads);
        Self { sensors: [left, right, left_pad, right_pad], bar: scene.programme.peak_bar, modelled, warnings }
    }

    /// Stores the new calibrations as the newest of their parts, and mounts the parts.
    pub fn keep(&self, store: &Store) -> Result<(), StoreError> {
        let mounted = store.calibrations().mounted()?;
        for (sensor, adapted) in Sensor::ALL.into_iter().zip(&self.sensors) {
            let AdaptedSensor::Adapted(calibration) = adapted else { continue };
            let stored = store.calibrations().add(&calibration.record)?;
            if mounted[sensor as usize].as_ref() != Some(&stored.record.part) {
                store.calibrations().mount(sensor, &stored.record.part)?;
            }
        }
        Ok(())
    }

    /// True where every sensor has a calibration.
    pub fn is_complete(&self) -> bool {
        self.sensors.iter().all(|sensor| sensor.calibration().is_some())
    }
}

/// Curvature of the modelled finger at the end of an empty close (1/m).
fn closed_curvature(scene: &Scene) -> f64 {
    let mut scene = scene.clone();
    EMPTY.clone_into(&mut scene.object.source);
    let trial = grasp(&scene, None, 0);
    let signals = Sensors::whole_fingers(&scene.gripper, SignalDefinition::Parts).signals(trial.frames());
    let columns: Vec<usize> =
        (0..signals.channels.len()).filter(|k| signals.channels[*k].starts_with("curvature")).collect();
    let most = |column: &usize| (0..signals.len()).map(|k| f64::from(signals.row(k)[*column])).fold(0.0, f64::max);
    columns.iter().map(most).sum::<f64>() / columns.len().max(1) as f64
}

/// Doubt about a strip that was calibrated by hand.
fn disagrees(strip: &AdaptedSensor, side: Side, hand: &EmptyHand<'_>) -> Option<String> {
    let AdaptedSensor::Kept(calibration) = strip else { return None };
    let sensor = SensorKind::Flex.on(side);
    let readout = Readout::new(hand.board, &[(sensor, calibration.clone())]).ok()?;
    let read = hand.readings.iter().filter_map(|reading| readout.estimate(reading).curvature[side.index()]);
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

    #[test]
    fn the_modelled_finger_bends_more_at_more_pressure() {
        let mut scene = Scene::default();
        let full = closed_curvature(&scene);
        scene.programme.peak_bar = 0.6;
        let less = closed_curvature(&scene);
        assert!((11.0..13.0).contains(&full) && less < 0.8 * full, "{full} {less}");
    }
}
