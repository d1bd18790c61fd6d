//! Adapting to the gripper by a close of its empty hand: a trial is recorded, and its readings become calibrations.

use super::GripperSession;
use crate::grasping::{AdaptError, Adaptation, AdaptedSensor};
use crate::recording::TrialRequest;
use crate::workers::Notice;
use palpate_geometry::units::shown;
use palpate_sim::objects::EMPTY;
use palpate_store::Store;
use palpate_tactile::trial::{Control, TrialId};

impl GripperSession {
    /// Records a close of the empty hand.
    pub(super) fn adapt(&mut self, control: Control) {
        // Nobody's hand closes an emulated one, which would go on holding objects by itself.
        let emulated = self.connection.as_ref().is_some_and(|own| own.board.emulated);
        let control = if emulated { Control::Driven } else { control };
        let begun = self.begun;
        self.begin(TrialRequest { object: Some(EMPTY.to_owned()), control, length_s: None, adds: false }, None);
        self.adapting = self.begun > begun;
    }

    /// Calibrates the sensors by the recorded close, if it was recorded for this purpose. True where the trial is discarded, also
    /// because it was of no use.
    pub(super) fn adapt_to(&mut self, id: TrialId, discarded: bool) -> bool {
        if !std::mem::take(&mut self.adapting) || discarded {
            return discarded;
        }
        let scene = self.scene.clone();
        let adapted = self.store.open().map_err(AdaptError::from).and_then(|store: &mut Store| {
            let adaptation = Adaptation::from_close(store, id, &scene, &[], false)?;
            adaptation.keep(store)?;
            Ok(adaptation)
        });
        match adapted {
            Ok(adaptation) => {
                self.calibrated_anew();
                adaptation.warnings.iter().for_each(|text| self.publisher.notify(Notice::Warning(text.clone())));
                self.publisher.notify(notice_of(&adaptation));
                !adaptation.is_complete()
            }
            Err(cause) => {
                self.publisher.notify(Notice::Failed(format!("not adapted: {cause}")));
                matches!(cause, AdaptError::Held { deleted: true, .. })
            }
        }
    }
}

/// Results and assumptions, in a sentence.
fn notice_of(adaptation: &Adaptation) -> Notice {
    let failed = adaptation.sensors.iter().find_map(|(sensor, adapted)| match adapted {
        AdaptedSensor::Failed(fault) => Some(format!("The {} is not calibrated: {fault}", sensor.label())),
        AdaptedSensor::Kept(_) | AdaptedSensor::Adapted(_) => None,
    });
    let kept = adaptation.sensors.iter().filter(|(_, adapted)| matches!(adapted, AdaptedSensor::Kept(_))).count();
    let (bar, modelled) = (adaptation.bar, adaptation.modelled);
    let assumed = format!("Assumes nominal pads and a bend of {} at {bar:.2} bar", shown(modelled, "1/m"));
    match (failed, kept) {
        (Some(failed), _) => Notice::Failed(failed),
        (None, 0) => Notice::Info(format!("Adapted. {assumed}.")),
        (None, kept) if kept == adaptation.sensors.len() => {
            Notice::Info("Nothing to adapt: all sensors are calibrated by hand.".to_owned())
        }
        (None, kept) => Notice::Info(format!("Adapted, {kept} sensors calibrated by hand kept. {assumed}.")),
    }
}
