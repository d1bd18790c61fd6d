//! The threads that help with the real gripper, each behind a panel of its own.

use palpate_core::workers::{Examine, ExamineRequest, Examiner, Wake};
use std::sync::Arc;

/// What they start from.
pub struct GripperToolsSetup {
    /// Looks at the gripper's port for the doctor.
    pub examine: Examine,
}

/// What can be asked of them.
#[derive(Clone, Debug)]
pub enum ToolWish {
    /// Find out what is wrong between the gripper's board and this computer.
    Examine(ExamineRequest),
    /// End that, with what was seen so far.
    StopExamining,
}

/// Their handles.
pub struct GripperTools {
    /// Finds out what is wrong between board and computer.
    pub examiner: Examiner,
}

impl GripperTools {
    /// Starts the threads. The error is a text for the user.
    pub(super) fn start(setup: GripperToolsSetup, wake: &Wake) -> Result<Self, String> {
        let failed = |what: &str| {
            let what = what.to_owned();
            move |error: std::io::Error| format!("{what} could not be started: {error}")
        };
        Ok(Self { examiner: Examiner::start(setup.examine, Arc::clone(wake)).map_err(failed("the doctor"))? })
    }

    /// Passes a wish on.
    pub(super) fn grant(&mut self, wish: ToolWish) {
        match wish {
            ToolWish::Examine(request) => self.examiner.ask(request),
            ToolWish::StopExamining => self.examiner.give_up(),
        }
    }
}
