//! Features of the window: each owns its state, its actions and their application. A feature may act on those of lower
//! layers (see the table in [`crate::app`]).

pub(super) mod files;
pub(super) mod gripper;
pub(super) mod inspect;
pub(super) mod labelling;
pub(super) mod library;
pub(super) mod presenter;
pub(super) mod recognition;
pub(super) mod simulation;
pub(super) mod studies;
pub(super) mod tools;
pub(super) mod view;
