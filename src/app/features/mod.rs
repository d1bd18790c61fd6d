//! Features of the window: each owns its state, its actions and how they are applied. What an action of one feature does
//! to another goes from a higher layer to a lower one (see the table in [`crate::app`]).

pub(super) mod files;
pub(super) mod gripper;
pub(super) mod labelling;
pub(super) mod recognition;
pub(super) mod simulation;
pub(super) mod tools;
pub(super) mod view;
