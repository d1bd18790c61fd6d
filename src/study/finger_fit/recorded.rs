//! Stored trials as input of the fit: the board's readings through its calibrations, which also give the deviations of the
//! gains.

use super::{Observation, Trust};
use palpate_sim::gripper::GripperModel;
use palpate_sim::objects::{EMPTY, ObjectError};
use palpate_store::{CalibrationId, Serving, Store, StoreError};
use palpate_tactile::trial::{TrialData, TrialId};
use palpate_tactile::{Sensors, SignalDefinition};

/// Repeatability of a calibrated strip's gain, as a share. Assumed: half a degree in 90.
const STRIP_REPEATS: f64 = 0.005;

/// Repeatability of a pad's gain (data sheet, one deviation).
const PAD_REPEATS: f64 = 0.02;

/// Stored grasps for a fit.
#[derive(Clone, Debug, Default)]
pub struct RecordedGrasps {
    /// The grasps.
    pub observations: Vec<Observation>,
    /// Standard deviations of their sensors.
    pub trust: Trust,
    /// Remarks, in sentences.
    pub warnings: Vec<String>,
}

/// Error of reading a stored trial for a fit.
#[derive(Debug, thiserror::Error)]
pub enum RecordedGraspError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error("the object of trial {id} cannot be loaded: {cause}")]
    Object { id: TrialId, cause: ObjectError },
}

impl RecordedGrasps {
    /// Reads a trial. The fit starts at `gripper`, by default the trial's own; `calibrations` replace the newest of each
    /// part.
    pub fn add(
        &mut self,
        store: &Store,
        id: TrialId,
        gripper: Option<&GripperModel>,
        calibrations: &[CalibrationId],
    ) -> Result<(), RecordedGraspError> {
        let trial = store.load(id)?;
        let own = trial.header.scene;
        let mut scene = own.clone();
        if let Some(gripper) = gripper {
            // Object and pose remain those of the trial.
            scene.gripper = gripper.clone();
        }
        let empty = trial.header.object == EMPTY;
        let object =
            if empty { None } else { own.load_object().map_err(|cause| RecordedGraspError::Object { id, cause })? };
        if object.is_some() && !own.holds_object() {
            self.warnings.push(format!(
                "trial {id} grasps an object that can move: presses against a fixed object are more informative"
            ));
        }
        let programme = Observation::line_of(&own);
        let (signals, line) = match trial.data {
            TrialData::Recorded(_) => {
                let read = store.board_signals(id, calibrations)?.unwrap_or_default();
                self.warnings.extend(read.derived.warnings.iter().map(|warning| format!("trial {id}: {warning}")));
                self.trust.take(&read.serving);
                (read.derived.signals, read.line)
            }
            TrialData::Imported(signals) => (signals, programme.clone()),
            TrialData::Simulated(data) => {
                (Sensors::whole_fingers(&own.gripper, SignalDefinition::Parts).signals(&data.frames), programme.clone())
            }
        };
        let line = if line.is_empty() { programme } else { line };
        self.observations.push(Observation { name: format!("trial {id}"), signals, line, scene, object });
        Ok(())
    }
}

impl Trust {
    /// Takes the standard deviations of the gains from the calibrations' intervals; they are no smaller than the
    /// repeatability of the parts.
    fn take(&mut self, serving: &Serving) {
        const HALF: f64 = 1.96;
        for (sensor, calibration) in &serving.calibrations {
            let (gains, usual) = match sensor.is_flex() {
                true => (&mut self.strip_gain, STRIP_REPEATS),
                false => (&mut self.pad_gain, PAD_REPEATS),
            };
            let deviation = calibration.gain_interval().map_or(2.0 * usual, |half| half / HALF);
            gains[sensor.index() % 2] = deviation.max(usual);
        }
    }
}
