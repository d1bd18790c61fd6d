//! A grasp of the real gripper, recorded as it happens: raw bytes and counts; what they mean is derived later.

use crate::gripper::SerialRig;
use crate::gripper::{Event, Rig, RigError};
use crate::recording::{BoardRecorder, BoardTrialPlan, Recorded};
use palpate_device::serial::LinkStatus;
use palpate_sim::gripper::Programme;
use palpate_store::{Store, StoreError};

/// Why a trial of the real gripper ended badly.
#[derive(Debug, thiserror::Error)]
pub enum BoardGraspError {
    /// The rig.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The store; what was written before is safe.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// A grasp of the real gripper, as it was recorded.
#[derive(Clone, Debug)]
pub struct BoardGrasp {
    /// What is in the store.
    pub recorded: Recorded,
    /// The link at its end.
    pub status: LinkStatus,
    /// It was driven, and ended early because the fingers did not do what they were told.
    pub cut: bool,
}

/// Records on a rig that has begun, to its end. `tell` is called about once a second.
pub fn record_board(
    mut rig: SerialRig,
    programme: &Programme,
    plan: &BoardTrialPlan,
    store: &mut Store,
    tell: &mut dyn FnMut(&BoardRecorder, &LinkStatus),
) -> Result<BoardGrasp, BoardGraspError> {
    let mut recorder = BoardRecorder::begin(store, plan, &rig.link().status(), rig.began_s())?;
    loop {
        match rig.next_event()? {
            Event::ActuationDue { tick } => {
                let (bar, phase) = programme.command(tick);
                rig.command(bar, phase);
            }
            Event::Commanded(mark) => recorder.mark(mark),
            Event::Heard(event) => recorder.take(event),
            // A board has no frames.
            Event::Sampled(_) => {}
            Event::Finished => break,
        }
        if recorder.flush_if_due(store)? {
            tell(&recorder, &rig.link().status());
        }
    }
    let status = rig.link().status();
    let (notes, cut) = (rig.notes(), rig.was_cut());
    drop(rig);
    Ok(BoardGrasp { recorded: recorder.finish(store, &status, notes)?, status, cut })
}
